"""The results of a campaign as one file: a column for each key and each result, a value for each design."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pmor.storage.hdf5 import Schema, attribute, create, open_checked, read, write
from pmor.storage.layout import Field, check_layout
from pmor.storage.structure import items_of

CAMPAIGN_SCHEMA = Schema("pmor-campaign", 1, "make it anew with 'pmor campaign'")
NUMBER, STATUS = "design/number", "design/status"
AXIS = "design"


@dataclass(frozen=True)
class CampaignFile:
    """What is in a campaign file.

    Parameters
    ----------
    name, text : str
        Of the campaign.
    statuses : tuple of str
        What the codes of the status mean, from 0.
    units : mapping of str to str
        Of each column below `arrays` but number and status.
    arrays : mapping of str to ndarray
        By their paths: ``design/number``, ``design/status``, ``inputs/<key>``, ``results/<key>``; NaN where a design
        has no such value. Why designs have no results stands in the CSV file.
    """

    name: str
    text: str
    statuses: tuple[str, ...]
    units: Mapping[str, str]
    arrays: Mapping[str, np.ndarray]


def write_campaign_file(path: Path, content: CampaignFile) -> None:
    """Write a campaign file, whole, in the place of an older one of ours; equal contents are equal files.

    Raises
    ------
    OutputError
    """
    attributes = {"campaign": content.name, "campaign_text": content.text, "statuses": ", ".join(content.statuses)}
    layout = _layout(content.units, content.statuses)
    with create(path, CAMPAIGN_SCHEMA, attributes, overwrite=True, dated=False) as file:
        for name, array in content.arrays.items():
            write(file, name, array, layout[name])


def read_campaign_file(path: Path) -> CampaignFile:
    """Read a campaign file.

    Raises
    ------
    FileFormatError
        When it is missing, foreign, damaged, or of another version.
    """
    with open_checked(path, CAMPAIGN_SCHEMA) as file:
        items, statuses = items_of(file), tuple(attribute(file, "statuses", str).split(", "))
        columns = [name for name in items if name.startswith(("inputs/", "results/"))]
        units = {name: attribute(file[name], "unit", str) for name in columns}
        layout = _layout(units, statuses)
        check_layout(items, layout, {AXIS: file[NUMBER].shape[0]})
        arrays = {name: read(file, name, field) for name, field in layout.items()}
        return CampaignFile(attribute(file, "campaign", str), attribute(file, "campaign_text", str), statuses, units,
                            arrays)  # fmt: skip


def _layout(units: Mapping[str, str], statuses: tuple[str, ...]) -> dict[str, Field]:
    codes = ", ".join(f"{code} {status}" for code, status in enumerate(statuses))
    return {
        NUMBER: Field("1", AXIS, "number of the design", kind=int, least=1, increasing=True),
        STATUS: Field("1", AXIS, codes, kind=int, least=0, most=len(statuses) - 1),
        **{name: Field(unit, AXIS, _words(name), finite=False) for name, unit in units.items()},
    }


def _words(name: str) -> str:
    return "key of the case" if name.startswith("inputs/") else "at the nominal torque"
