"""What an engineer says first: what is good, what is not, and a change of a file, solved, that betters a figure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from pmor.results.quantities import TABLE


@dataclass(frozen=True)
class Change:
    """Keys to write into a section of a file.

    Parameters
    ----------
    section : str
        As the file names it; of a mesh or set of a gearbox after its name, as in ``first: pinion.modification``.
    values : mapping
        By key.
    filed : mapping
        What the file has there, of those that are not 0 or none.
    instead_of : tuple of str
        Keys of the section to leave out, since these say the same.
    """

    section: str
    values: Mapping[str, Any]
    filed: Mapping[str, Any] = field(default_factory=dict)
    instead_of: tuple[str, ...] = ()


@dataclass(frozen=True)
class Advice:
    """What was tried and helps.

    Parameters
    ----------
    what : str
        In words.
    figure : str
        Key of the figure that it lowers or raises, in the table of quantities.
    part, load : str
        Mesh or set, and load, that the figure is of; empty where there is one alone.
    before, after : float
        The figure as filed, and solved with the changes.
    changes : tuple of Change
    beside : tuple of str
        Sentences on other loads and figures that get worse.
    """

    what: str
    figure: str
    part: str
    load: str
    before: float
    after: float
    changes: tuple[Change, ...]
    beside: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """All of it in words."""
        quantity = TABLE[self.figure]
        unit = f" {quantity.shown_unit}" if quantity.shown_unit else ""
        of, under = f" of {self.part}" * bool(self.part), f" under {self.load}" * bool(self.load)
        gain = f"from {digits(self.before)} to {digits(self.after)}{unit}"
        said = f"{self.what} takes {quantity.symbol}{of}{under} {gain}: {written(self.changes)}."
        return " ".join([said, *self.beside])

    @property
    def data(self) -> dict[str, Any]:
        """All of it as plain data."""
        return asdict(self)

    def again(self, other: Advice) -> bool:
        """Whether it changes a key that another one changes."""
        own, others = ({(one.section, key) for one in of.changes for key in one.values} for of in (self, other))
        return bool(own & others)


@dataclass(frozen=True)
class Verdict:
    """What is good, what is not, and what to try first, in words, and the last as data.

    `then` betters the next figure that is not good, `then_advice`, solved with the first advice in the file.
    """

    good: str
    not_good: str
    try_first: str
    advice: Advice | None = None
    then: str = ""
    then_advice: Advice | None = None

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """Heads and sentences."""
        lines = ("Good", self.good), ("Not good", self.not_good), ("Try first", self.try_first)
        return (*lines, ("Then", self.then)) if self.then else lines

    @property
    def data(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def written(changes: tuple[Change, ...]) -> str:
    """Return changes as they stand in a file; sections with the same ones together."""
    alike = dict[str, list[str]]()
    for change in changes:
        keys = ", ".join(
            f"{key} = {_shown(value)}" + (f" (now {_shown(change.filed[key])})" if key in change.filed else "")
            for key, value in change.values.items()
        )
        keys += f" (in place of {', '.join(change.instead_of)})" * bool(change.instead_of)
        alike.setdefault(keys, []).append(f"[{change.section}]")
    return "; ".join(f"{keys} in {_and(sections)}" for keys, sections in alike.items())


def _shown(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_shown, value))}]"
    return f'"{value}"' if isinstance(value, str) else f"{value:g}"


def digits(value: float) -> str:
    """Return a number with three digits, or all before the point."""
    return f"{value:.0f}" if abs(value) >= 1e3 else f"{value:.3g}"


def _and(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
