"""Read a case file: TOML -> sections -> checked values -> `Case`."""

from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from pmor.case.checks import check_together
from pmor.case.document import CONDITION, GEARS, MODIFICATION, flattened, parse_toml, with_topography
from pmor.case.schema import (
    Case,
    CompareCase,
    ConditionCase,
    ContactCase,
    DynamicsCase,
    GearCase,
    LoadCase,
    MeshCase,
    MisalignmentCase,
    OfflineCase,
    OnlineCase,
    OutputCase,
    PairCase,
    ReductionCase,
    ResultsCase,
)
from pmor.case.values import Refused, convert, did_you_mean, toml_text
from pmor.core.errors import CaseError
from pmor.gear.modification import Modification

Section = TypeVar("Section")

SECTIONS: dict[str, type] = {
    "load": LoadCase,
    "pair": PairCase,
    "pinion": GearCase,
    "wheel": GearCase,
    "pinion.modification": Modification,
    "wheel.modification": Modification,
    "mesh": MeshCase,
    "contact": ContactCase,
    "misalignment": MisalignmentCase,
    "reduction": ReductionCase,
    "offline": OfflineCase,
    "online": OnlineCase,
    "compare": CompareCase,
    "results": ResultsCase,
    "dynamics": DynamicsCase,
    "output": OutputCase,
}

# Torques of a stage when the case file gives none, as multiples of the nominal torque.
OFFLINE_TORQUES = (0.2, 0.7, 1.8)
ONLINE_TORQUES = (1.0,)
COMPARE_TORQUES = (0.3, 1.0, 1.6)
HARRIS_TORQUES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
DYNAMICS_TORQUES = (1.0,)
# Line contact needs no training.
DEFAULT_SHAPES = {"line": "line_loads"}
OTHER_SHAPES = "flank_lines"


def load_case(path: Path | str) -> Case:
    """Read and check a case file.

    Parameters
    ----------
    path : Path or str
        TOML file; its stem becomes the name of the case.

    Raises
    ------
    CaseError
        One line with file, section, key, rule and remedy.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")  # some editors put a byte order mark in front
    except FileNotFoundError:
        raise CaseError(f"{path}: there is no such case file: check the path{_neighbours(path)}") from None
    except IsADirectoryError:
        raise CaseError(f"{path}: is a folder: name a case file in it{_files_in(path)}") from None
    except PermissionError:
        raise CaseError(f"{path}: may not be read: check the permissions of the file") from None
    except UnicodeDecodeError:
        raise CaseError(f"{path}: is not UTF-8 text: save the case file as plain text in UTF-8") from None
    except (OSError, ValueError) as error:
        raise CaseError(f"{path}: cannot be read ({error}): name a readable case file") from None
    return parse_case(text, name=path.stem, where=str(path), folder=path.parent)


def parse_case(text: str, name: str, where: str, folder: Path | None = None) -> Case:
    """Check the text of a case file.

    Parameters
    ----------
    text : str
        TOML text.
    name : str
        Name of the case.
    where : str
        What error messages call the text, usually the path.
    folder : Path, optional
        What names of files in it are relative to; without it, it may not name any.

    Returns
    -------
    Case
        Complete: every default is filled in.
    """
    document = flattened(parse_toml(text, where))
    _check_sections(document, where)
    for gear in GEARS:
        key = f"{gear}.{MODIFICATION}"
        document[key] = with_topography(document.get(key, {}), key, folder, where)

    def section(key: str, **filled: Any) -> Any:
        return _read_section(document.get(key, {}), SECTIONS[key], key, where, filled)

    title = _read_title(document, name, where)
    torque_Nm = section("load").torque_Nm
    pinion = section("pinion")
    wheel = section("wheel") if "wheel" in document else pinion
    misalignment, modifications = section("misalignment"), [section(f"{gear}.{MODIFICATION}") for gear in GEARS]
    contact = section("contact")
    case = Case(
        name=name,
        title=title,
        torque_Nm=torque_Nm,
        pair=section("pair", pinion=pinion, wheel=wheel),
        pinion_modification=modifications[0],
        wheel_modification=modifications[1],
        conditions=_read_conditions(
            document, {"torque_Nm": torque_Nm, **vars(misalignment)}, modifications, folder, where
        ),
        mesh=section("mesh"),
        contact=contact,
        misalignment=misalignment,
        reduction=section("reduction", shapes=DEFAULT_SHAPES.get(contact.scheme, OTHER_SHAPES)),
        offline=section("offline", torques_Nm=_multiples(torque_Nm, OFFLINE_TORQUES)),
        online=section("online", torques_Nm=_multiples(torque_Nm, ONLINE_TORQUES)),
        compare=section("compare", torques_Nm=_multiples(torque_Nm, COMPARE_TORQUES)),
        results=section("results", harris_torques_Nm=_multiples(torque_Nm, HARRIS_TORQUES)),
        dynamics=section("dynamics", torques_Nm=_multiples(torque_Nm, DYNAMICS_TORQUES)),
        output=section("output"),
        text=text,
    )
    check_together(case, document, where)
    return case


def _check_sections(document: dict[str, Any], where: str) -> None:
    for name, content in document.items():
        if name == CONDITION:
            if not isinstance(content, list) or not all(isinstance(table, dict) for table in content):
                raise CaseError(f"{where}: [{name}]: there may be several: write [[{name}]], brackets doubled")
        elif name in SECTIONS:
            if not isinstance(content, dict):
                raise CaseError(f"{where}: {name}: must be a section: write [{name}] on a line of its own")
        elif isinstance(content, dict):
            raise CaseError(f"{where}: [{name}]: unknown section: {did_you_mean(name, [*SECTIONS, CONDITION])}")
        elif name != "title":
            raise CaseError(f"{where}: {name}: unknown key outside of the sections: {_elsewhere(name, ['title'])}")


def _read_title(document: dict[str, Any], name: str, where: str) -> str:
    title = document.get("title", name)
    try:
        return str(convert(title, str))
    except Refused as refused:
        raise CaseError(f"{where}: title = {toml_text(title)}: {refused}") from None


def _read_conditions(
    document: dict[str, Any], filled: dict[str, Any], modifications: list[Modification], folder: Path | None, where: str
) -> tuple[ConditionCase, ...]:
    """Read the list of conditions; `filled` holds what the case says for keys that they leave out."""
    found: list[ConditionCase] = []
    for number, table in enumerate(document.get(CONDITION, ()), start=1):
        own, flanks = dict(table), dict[str, Any]()
        for gear, modification in zip(GEARS, modifications, strict=True):
            section, keys = f"{CONDITION}.{gear}", own.pop(gear, {})
            if not isinstance(keys, dict):
                raise CaseError(f"{where}: [{CONDITION}] {gear}: must be a section: write [{section}]")
            keys = with_topography(keys, section, folder, where)
            flanks[gear] = _read_section(keys, Modification, section, where, vars(modification))
        values = filled | flanks | {"name": f"condition {number}"}
        condition = _read_section(own, ConditionCase, CONDITION, where, values)
        if condition.name in [other.name for other in found]:
            raise CaseError(f"{where}: [{CONDITION}] name = {toml_text(condition.name)}: is there twice: rename one")
        found.append(condition)
    return tuple(found)


def _read_section(
    table: dict[str, Any], kind: type[Section], section: str, where: str, filled: dict[str, Any]
) -> Section:
    """Build the dataclass `kind` from a TOML table; `filled` holds values for keys that the table leaves out."""
    keys = keys_of(kind)
    for key in table:
        if key not in keys:
            inside = [MODIFICATION] if section in GEARS else []
            raise CaseError(f"{where}: [{section}] {key}: unknown key: {_elsewhere(key, [*keys, *inside])}")
    values = dict(filled)
    for key, annotation in keys.items():
        if key in table:
            try:
                values[key] = convert(table[key], annotation)
            except Refused as refused:
                raise CaseError(f"{where}: [{section}] {key} = {toml_text(table[key])}: {refused}") from None
    for item in fields(kind):  # type: ignore[arg-type]
        if item.name not in values and item.default is MISSING:
            raise CaseError(f"{where}: [{section}] {item.name}: is missing: add '{item.name} = ...' below [{section}]")
    return kind(**values)


def keys_of(kind: type) -> dict[str, Any]:
    """Keys of a section and their annotations; nested dataclasses are sections of their own."""
    return {key: hint for key, hint in get_type_hints(kind, include_extras=True).items() if not is_dataclass(hint)}


def _elsewhere(key: str, valid: list[str]) -> str:
    """Remedy for an unknown key: the section where it belongs, or the closest valid key here."""
    homes = [f"[{name}]" for name, kind in SECTIONS.items() if key in keys_of(kind)]
    return f"it belongs in {' or '.join(homes)}" if homes else did_you_mean(key, valid)


def _multiples(torque_Nm: float, factors: tuple[float, ...]) -> tuple[float, ...]:
    """Multiples of the nominal torque, rid of the last digits' rounding; once itself it stays to the last digit."""
    return tuple(torque_Nm if factor == 1.0 else float(f"{factor * torque_Nm:.12g}") for factor in factors)


def _neighbours(path: Path) -> str:
    return _files_in(path.parent) if path.parent.is_dir() else ""


def _files_in(folder: Path) -> str:
    names = sorted(item.name for item in folder.glob("*.toml"))
    return f" (there is {', '.join(names[:5])})" if names else ""
