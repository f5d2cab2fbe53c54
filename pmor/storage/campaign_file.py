"""The results of a campaign as one file: a column for each key and each result, a value for each design."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from pmor.storage.hdf5 import Schema, create, write_all
from pmor.storage.layout import Field

CAMPAIGN_SCHEMA = Schema("pmor-campaign", 2, "make it anew with pmor.campaign")
NUMBER, STATUS = "design/number", "design/status"
AXIS = "design"


def write_campaign_file(
    path: Path, name: str, text: str, statuses: tuple[str, ...], units: Mapping[str, str],
    arrays: Mapping[str, np.ndarray],
) -> None:  # fmt: skip
    """Write a campaign file, whole, in the place of an older one of ours; equal contents are equal files.

    OutputError where that fails.

    Parameters
    ----------
    name, text : str
        Of the campaign.
    statuses : tuple of str
        By their codes, from 0.
    units : mapping of str to str
        Of each column below `arrays` but number and status.
    arrays : mapping of str to ndarray
        By their paths: ``design/number``, ``design/status``, ``inputs/<key>``, ``results/<key>``; NaN where a design
        has no such value. The reasons stand in the CSV file.
    """
    codes = ", ".join(f"{code} {status}" for code, status in enumerate(statuses))
    layout = {
        NUMBER: Field("1", AXIS, "number of the design", kind=int), STATUS: Field("1", AXIS, codes, kind=int),
        **{column: Field(unit, AXIS, _words(column)) for column, unit in units.items()},
    }  # fmt: skip
    attributes = {"campaign": name, "campaign_text": text, "statuses": ", ".join(statuses)}
    with create(path, CAMPAIGN_SCHEMA, attributes, overwrite=True, dated=False) as file:
        write_all(file, arrays, layout)


def _words(column: str) -> str:
    return "key of the case" if column.startswith("inputs/") else "at the nominal torque"
