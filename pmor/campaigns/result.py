"""The result of a campaign: its designs and its files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.campaigns.campaign import Campaign
from pmor.campaigns.columns import Columns, Effort
from pmor.campaigns.output import campaign_text, write_campaign
from pmor.campaigns.page import head_of
from pmor.campaigns.rows import STATUSES, Answer
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.errors import CaseError
from pmor.core.wording import did_you_mean
from pmor.report.curves import Drawn

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class CampaignResult(Columns, Drawn):
    """All designs of a campaign, as arrays and as files; parameters as in `pmor.campaigns.columns.Columns`."""

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write results, times, cases and the page: the files of `pmor campaign`.

        Parameters
        ----------
        overwrite : bool
            Replace files there, whoever wrote them.

        Raises
        ------
        OutputError
        """
        write_campaign(self, Path(folder), overwrite)

    def columns(self) -> Mapping[str, Any]:
        """All of it by the names of columns, for `to_dataframe`: a value for each design."""
        numbers = np.arange(1, len(self.codes) + 1)
        return {"design": numbers, "status": self.status, **self.inputs, **self.results, "reason": self.reasons}

    def plot(self, ax: Axes | None = None, x: str = "", y: str = "", **style: Any) -> Axes:
        """Draw the designs as points over two of their columns.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            To draw into; those of a new figure by default.
        x, y : str
            Names of columns, keys or results; by default the first two results of the page.
        **style
            Of `matplotlib.axes.Axes.plot`.

        Raises
        ------
        CaseError
            When there is no such column.
        """
        kind, every = self.campaign.kind, {**self.inputs, **self.results}
        names = [given or default for given, default in zip((x, y), kind.first, strict=False)]
        for name in names:
            if name not in every:
                raise CaseError(f"{self.campaign.name}: {name}: is no column: {did_you_mean(name, list(every))}")

        def draw(axes: Axes) -> None:
            axes.plot(*(every[name] for name in names), **{"ls": "", "marker": "o", "ms": 3.5, **style})
            axes.set(xlabel=head_of(names[0], kind), ylabel=head_of(names[1], kind))

        return self._plotted(ax, draw)

    def __repr__(self) -> str:
        return f"<CampaignResult of {self.campaign.name!r}: {len(self.codes)} designs>"

    def __str__(self) -> str:
        return campaign_text(self)


def gathered(
    campaign: Campaign, answers: Iterable[Answer], effort: Effort, places: IntArray | None = None
) -> CampaignResult:
    """Return the result of answers that come in the order of the designs that differ.

    Parameters
    ----------
    places : ndarray of int, shape (n,), optional
        Of all designs among these, as `pmor.campaigns.table.different_designs` gives them; by default all differ.

    Raises
    ------
    ValueError
        When there are more or fewer answers.
    """
    places = np.arange(campaign.count) if places is None else places
    total = int(places.max()) + 1

    def empty() -> FloatArray:
        return np.full(total, np.nan)

    inputs, results = {name: empty() for name in campaign.columns}, {key: empty() for key in campaign.results}
    codes, seconds, reasons, i = np.empty(total, dtype=np.int64), empty(), list[str](), 0
    shared: dict[str, str] = {}
    for answer in answers:
        for row, taken in zip(answer.rows, answer.seconds, strict=True):
            if row["design"] != i + 1:
                raise ValueError(f"design {row['design']} stands where {i + 1} belongs")
            codes[i], seconds[i] = STATUSES.index(row["status"]), taken
            reasons.append(shared.setdefault(row["reason"], row["reason"]))
            for values, known in ((inputs, row["inputs"]), (results, row["results"])):
                for key, value in known.items():
                    if value is not None:
                        values[key][i] = value
            i += 1
    if i != total:
        raise ValueError(f"{i} designs are there, not {total}")
    again = np.ones(campaign.count, dtype=bool)
    again[np.unique(places, return_index=True)[1]] = False
    return CampaignResult(
        campaign=campaign, codes=codes[places], reasons=tuple(reasons[place] for place in places),
        inputs={name: values[places] for name, values in inputs.items()},
        results={key: values[places] for key, values in results.items()},
        solving_s=np.where(again, 0.0, seconds[places]), effort=effort,
    )  # fmt: skip
