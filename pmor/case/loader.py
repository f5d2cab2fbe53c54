"""Read a case file: TOML -> sections -> checked values -> `Case`."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pmor.case.blank import BlankCase
from pmor.case.body import UNITS, BodyCase, MatrixCase
from pmor.case.capability import refuse_beyond
from pmor.case.checks import check_together
from pmor.case.coast import in_amounts, other_by_default, other_flank
from pmor.case.document import BLANK, COAST, CONDITION, GEARS, HOLES, LOADS, MATRIX, MESH, MODIFICATION, flattened
from pmor.case.duty import TimedLoad, check_duty
from pmor.case.gears import GearCase, PairCase
from pmor.case.reader import NOTHING, Reader, parse_toml, read_text
from pmor.case.schema import SECTIONS, Case, ConditionCase, OnlineCase
from pmor.case.values import NO_LOAD, toml_text
from pmor.core.errors import CaseError, printable
from pmor.core.wording import suggesting
from pmor.gear.modification import Modification, other_places
from pmor.gear.tooth import largest_rack_tip_radius

# Torques of a stage when the case file gives none, as multiples of the nominal torque.
OFFLINE_TORQUES = (0.2, 0.7, 1.8)
ONLINE_TORQUES = (1.0,)
COMPARE_TORQUES = (0.3, 1.0, 1.6)
# Line loads were trained at no torque: none beyond the nominal one is asked for.
COMPARED_LOADS = (0.3, 1.0)
HARRIS_TORQUES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
DYNAMICS_TORQUES = (1.0,)
# Of the section of a blank: no key of a gear.
NO_BODY = {"body": None}
# Line contact needs no training.
DEFAULT_SHAPES = {"line": "line_loads"}
OTHER_SHAPES = "flank_lines"
# Angles at which line loads, exact but for round-off, are held against full FE; trained shapes have errors to look for.
EXACT_ANGLES = 3
# Positions to a pitch of a sweep until holes stand as before.
ANGLES_OF_MANY = 32
# Elements over the width of helical pairs with line contact: so many to an axial pitch, an even number within limits.
# *Measured* (23/57, 20 deg, overlap ratio 1.3): peak-to-peak STE 20 % high with 3.1 to the pitch, 3 % with 6.1.
ELEMENTS_TO_AXIAL_PITCH, FEWEST_ELEMENTS, MOST_ELEMENTS = 6.0, 4, 16


@suggesting
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
    return parse_case(read_text(path, "case file"), name=path.stem, where=str(path), folder=path.parent)


def parse_case(text: str, name: str, where: str, folder: Path | None = None) -> Case:
    """Check the text of a case file.

    Parameters
    ----------
    text : str
        TOML text.
    name : str
        Name of the case, which results carry: unprintable characters, as in names of files, are escaped.
    where : str
        Name of the text in error messages, usually the path.
    folder : Path, optional
        Base of the names of files in it; without it they are whole paths.

    Returns
    -------
    Case
        Complete: every default is filled in.
    """
    document, name = flattened(parse_toml(text, where)), printable(name)
    document, coast = in_amounts(document, where)
    reader = Reader(where, {key: kind for key, kind in SECTIONS.items() if COAST not in key}, folder)
    names = ["title", *SECTIONS, CONDITION, LOADS]
    for key in SECTIONS:
        reader.refuse_value(key, document.get(key, {}))
    reader.refuse_unknown({key: value for key, value in document.items() if key not in names}, names, "")

    def section(key: str, given: Mapping[str, Any] = NOTHING, **filled: Any) -> Any:
        also = [MODIFICATION, COAST, BLANK] if key in GEARS else [HOLES] if key.endswith(BLANK) else []
        return reader.section(document.get(key, {}), SECTIONS[key], key, filled, given, also)

    title = reader.value(document.get("title", name), str, "title")
    load = section("load")
    torque_Nm = load.torque_Nm
    pinion = _with_blank(section("pinion", given=NO_BODY), section, document, reader)
    wheel = section("wheel", given=NO_BODY) if "wheel" in document else pinion
    wheel = _with_blank(wheel, section, document, reader, "wheel")
    misalignment, modifications = section("misalignment"), [section(f"{gear}.{MODIFICATION}") for gear in GEARS]
    others = [
        section(key, **vars(other_by_default(own, document[key])))
        if (key := f"{gear}.{COAST}") in document
        else own.alike
        for gear, own in zip(GEARS, modifications, strict=True)
    ]
    contact = section("contact")
    usual = {"torque_Nm": -torque_Nm if coast else torque_Nm, **vars(misalignment)}
    pair = _with_rack_tips(section("pair", {"pinion": pinion, "wheel": wheel}), document)
    across: dict[str, Any] = {"width_elements": _elements_across(pair)} if contact.kind == "line" else {}
    conditions = _read_conditions(reader, document.get(CONDITION, []), usual, modifications, others)
    reduction = section("reduction", shapes=DEFAULT_SHAPES.get(contact.scheme, OTHER_SHAPES))
    compared: dict[str, Any] = {"torques_Nm": _multiples(torque_Nm, COMPARE_TORQUES)}
    if reduction.shapes == "line_loads" and set(section("compare", **compared).models or ()) <= {"line"}:
        compared = {"torques_Nm": _multiples(torque_Nm, COMPARED_LOADS), "angles": EXACT_ANGLES}
    loads = tuple(reader.section(table, TimedLoad, LOADS) for table in reader.list_of(document.get(LOADS, []), LOADS))
    check_duty(loads, reader.refuse)
    swept = [(others if coast else modifications), *((condition.pinion, condition.wheel) for condition in conditions)]
    case = Case(
        name=name, title=title, torque_Nm=torque_Nm, speed_rpm=load.speed_rpm, pair=pair,
        pinion_modification=modifications[0], wheel_modification=modifications[1], other_flanks=(others[0], others[1]),
        conditions=conditions, loads=loads, lubricant=section("lubricant"),
        tolerances=section("tolerances") if "tolerances" in document else None,
        mesh=section("mesh", **across), contact=contact, misalignment=misalignment, reduction=reduction,
        offline=section("offline", torques_Nm=_multiples(torque_Nm, OFFLINE_TORQUES)),
        online=_with_loads(
            section("online", torques_Nm=_multiples(torque_Nm, ONLINE_TORQUES), **_whole_period(pair, swept)), loads
        ),
        compare=section("compare", **compared),
        results=section("results", harris_torques_Nm=_multiples(torque_Nm, HARRIS_TORQUES)),
        dynamics=section("dynamics", torques_Nm=_multiples(torque_Nm, DYNAMICS_TORQUES)), output=section("output"),
        text=text
    )  # fmt: skip
    case = other_flank(case) if coast else case
    if loads:
        refuse_beyond(case, "duty", f"{where}: [[{LOADS}]]")
    if case.tolerances is not None:
        refuse_beyond(case, "tolerances", f"{where}: [tolerances]")
    check_together(case, document, where)
    return case


def _with_loads(online: OnlineCase, loads: Sequence[TimedLoad]) -> OnlineCase:
    """Return a sweep with the torques of a duty cycle among its own."""
    return replace(online, torques_Nm=tuple(sorted({*online.torques_Nm, *(load.torque_Nm for load in loads)})))


def _read_conditions(
    reader: Reader, tables: Any, usual: Mapping[str, Any], drive: Sequence[Modification], coast: Sequence[Modification]
) -> tuple[ConditionCase, ...]:
    """Read the list of conditions; `usual` and the flanks are the case's own, for keys that they leave out."""
    conditions: list[ConditionCase] = []
    for number, table in enumerate(reader.list_of(tables, CONDITION), start=1):
        torque = table.get("torque_Nm", usual["torque_Nm"])
        if torque == 0 and not isinstance(torque, bool):
            reader.refuse(f"[{CONDITION}] torque_Nm = {torque}", f"must not be 0: {NO_LOAD}")
        backwards = isinstance(torque, int | float) and torque < 0
        flanks = {
            gear: reader.section(
                table.get(gear, {}),
                Modification,
                f"{CONDITION}.{gear}",
                vars(modification.changed(dict.fromkeys(other_places(_keys_in(table, gear))))),
            )
            for gear, modification in zip(GEARS, coast if backwards else drive, strict=True)
        }
        own = {key: value for key, value in table.items() if key not in GEARS}
        values = {**usual, "name": f"condition {number}"}
        condition = reader.section(own, ConditionCase, CONDITION, values, flanks, GEARS)
        if condition.name in [other.name for other in conditions]:
            reader.refuse(f"[{CONDITION}] name = {toml_text(condition.name)}", "is there twice: rename one")
        conditions.append(condition)
    return tuple(conditions)


def _with_blank(
    gear: GearCase, section: Callable[..., Any], document: Mapping[str, Any], reader: Reader, name: str = GEARS[0]
) -> GearCase:
    """Return a gear with the blank of its section, if there is one."""
    name = f"{name}.{BLANK}"
    holes, table = f"{name}.{HOLES}", document.get(name, {})
    if name not in document and holes not in document:
        return gear
    if not isinstance(table, Mapping) or not (MESH in table or MATRIX in table):
        blank: BlankCase = section(name, {HOLES: section(holes) if holes in document else None})
        return replace(gear, blank=blank, body=None)
    key: str = MESH if MESH in table else MATRIX
    if holes in document:
        reader.refuse(f"[{name}] {key}", f"a {key} has its holes: leave holes out")
    place = f"[{name}] {key} = {toml_text(table[key])}"
    if isinstance(table[key], str):
        path = reader.beside(table[key], place)
        from pmor.case.body_matrix import body_matrix  # only where there is one
        from pmor.case.body_mesh import body_mesh

        unit = table.get("unit", "mm")
        try:
            read = body_mesh if key == MESH else body_matrix
            content = read(path, unit if unit in UNITS else "mm")
        except CaseError as error:
            reader.refuse(place, str(error))
        table = {**table, key: content}
    if key == MESH:
        return replace(gear, blank=None, body=reader.section(table, BodyCase, name))
    return replace(gear, blank=None, body=reader.section(table, MatrixCase, name))


def _with_rack_tips(pair: PairCase, document: Mapping[str, Any]) -> PairCase:
    """Return the pair with the tip radii of racks that the file leaves out as large as the racks have room for."""
    gears: dict[str, Any] = {}
    for name, gear in zip(GEARS, (pair.pinion, pair.wheel), strict=True):
        written = document.get(name, document.get(GEARS[0], {}))
        room = largest_rack_tip_radius(math.radians(pair.pressure_angle_deg), gear.dedendum)
        if "rack_tip_radius" not in written and not gear.internal and 0.0 <= room < gear.rack_tip_radius:
            gears[name] = replace(gear, rack_tip_radius=room)
    return replace(pair, **gears)


def _keys_in(table: Mapping[str, Any], section: str) -> list[str]:
    inner = table.get(section, {})
    return list(inner) if isinstance(inner, Mapping) else []


def _multiples(torque_Nm: float, factors: tuple[float, ...]) -> tuple[float, ...]:
    """Multiples of the nominal torque, rid of the last digits' rounding; once itself it stays to the last digit."""
    return tuple(torque_Nm if factor == 1.0 else float(f"{factor * torque_Nm:.12g}") for factor in factors)


def _whole_period(pair: PairCase, flanks: Sequence[Sequence[Modification]]) -> dict[str, Any]:
    """Fewer angles to each pitch of a sweep until holes and teeth that differ stand as before; nothing without."""
    pitches = pair.repeats_with((pinion, wheel) for pinion, wheel in flanks)
    return {"angles_per_pitch": ANGLES_OF_MANY} if pitches > 1 else {}


def _elements_across(pair: PairCase) -> int:
    """Elements over the face width that lines of contact of a helix need; few where there is none."""
    widest = max(high - low for low, high in (gear.face(pair.face_width_mm) for gear in (pair.pinion, pair.wheel)))
    overlap = widest * math.sin(math.radians(abs(pair.helix_angle_deg))) / (math.pi * pair.module_mm)
    wanted = 2 * math.ceil(0.5 * ELEMENTS_TO_AXIAL_PITCH * overlap)
    return min(max(FEWEST_ELEMENTS, wanted), MOST_ELEMENTS)
