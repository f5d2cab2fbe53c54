"""The shape of a case file: sections by name, those inside of others brought beside them."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pmor.case.values import toml_text
from pmor.core.errors import CaseError
from pmor.gear.topography import Topography, read_topography

GEARS = ("pinion", "wheel")
MODIFICATION = "modification"
CONDITION = "condition"
TOPOGRAPHY = "topography"


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """Return what a TOML text says.

    Raises
    ------
    CaseError
        One line with the file and the place in it.
    """
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise CaseError(f"{where}: not valid TOML: brackets nested too deeply: correct the file") from None
    except tomllib.TOMLDecodeError as error:
        raise CaseError(f"{where}: not valid TOML: {error}: correct that place in the file") from None
    except ValueError:  # Python's own limit, 4300 digits
        raise CaseError(f"{where}: not valid TOML: a number has too many digits: correct the file") from None


def flattened(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document with `[pinion.modification]` beside `[pinion]`, under that name; the same for the wheel.

    A wheel of which only the modification is said is like the pinion, as one that is not mentioned.
    """
    flat: dict[str, Any] = {}
    for name, content in document.items():
        if name not in GEARS or not isinstance(content, Mapping) or MODIFICATION not in content:
            flat[name] = content
            continue
        rest = {key: value for key, value in content.items() if key != MODIFICATION}
        if rest or name == GEARS[0]:
            flat[name] = rest
        flat[f"{name}.{MODIFICATION}"] = content[MODIFICATION]
    return flat


def with_topography(table: Mapping[str, Any], section: str, folder: Path | None, where: str) -> dict[str, Any]:
    """Return the keys of a modification with its topography read.

    Parameters
    ----------
    table : mapping
    section, where : str
        Name of the section and of the file, for messages.
    folder : Path, optional
        What names of files are relative to.

    Raises
    ------
    CaseError
        One line with the file and the place in it.
    """
    name = table.get(TOPOGRAPHY)
    if not isinstance(name, str):
        return dict(table)
    place = f"{where}: [{section}] {TOPOGRAPHY} = {toml_text(name)}"
    if folder is None:
        raise CaseError(f"{place}: there is no folder to look for it in: read the case from its file with load_case")
    return dict(table) | {TOPOGRAPHY: _read(folder / name, place)}


def _read(path: Path, place: str) -> Topography:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise CaseError(f"{place}: there is no such file beside the case: check its name") from None
    except (OSError, ValueError) as error:
        raise CaseError(f"{place}: cannot be read ({error}): save it as CSV text in UTF-8") from None
    try:
        return read_topography(text)
    except CaseError as error:
        raise CaseError(f"{place}: {error}") from None
