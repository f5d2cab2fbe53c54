"""Read a set file: TOML -> `SetSections` -> the plan of a set, with the cases of its meshes."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

from pmor.body.bearing_faults import InnerGeometry
from pmor.case import Case
from pmor.case.document import joined_files
from pmor.case.reader import parse_toml, read_text, sections_in
from pmor.case.slips import case_slips, slips
from pmor.core.errors import CaseError, GeometryError, printable
from pmor.core.shown import Written
from pmor.gear.pair import GearPair
from pmor.sets.layout import Layout
from pmor.sets.plan import SetPlan, set_plan
from pmor.sets.reader import SetReader
from pmor.sets.settings import Carrier, Member, SetSections, Supports
from pmor.sets.support_checks import check_cheeks


@dataclass(frozen=True)
class OnShafts:
    """What a gearbox says of a set that is a part of it.

    Parameters
    ----------
    members : collection of {"sun", "ring", "carrier"}
        That stand on shafts: the plan holds their hubs, whatever the file says in `[supports]`.
    most_Nm : float or None
        Largest amount of the torque on the sun; None is that of the file.
    """

    members: Collection[Member]
    most_Nm: float | None = None


@dataclass(frozen=True)
class SetFile(Written):
    """A set file that was read.

    Parameters
    ----------
    name : str
        Stem of the file name.
    text : str
        Of the set file, or of one that says what a REXS file does.
    cases : dict of str to Case
        Of the meshes, by the members that mesh: `sun-planet`.
    inputs : tuple of Path
        Files that were read.
    notes : tuple of str
        Assumptions about what a REXS file does not say.
    changed : tuple of str
        What was changed of it, as its gears would not run.
    pitches : int
        Mesh cycles that are solved.
    sample_pitches : int
        Mesh cycles over which sets within tolerances are solved.
    housed_pitches : int
        Mesh cycles until the housing stands before the carrier as at first too: of a set on shafts.
    """

    name: str
    text: str
    sections: SetSections
    plan: SetPlan
    cases: dict[str, Case]
    inputs: tuple[Path, ...]
    notes: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    pitches: int = 1
    sample_pitches: int = 1
    housed_pitches: int = 1

    @property
    def teeth(self) -> tuple[float, float]:
        """Teeth of sun and ring, as `pmor.sets.kinematics.member_speeds` takes them."""
        inner, outer = (case.pair for case in self.cases.values())
        return inner.pinion.teeth, outer.wheel.teeth * inner.wheel.teeth / outer.pinion.teeth

    @property
    def angles_per_pitch(self) -> int:
        """Positions to a mesh cycle: as many as the file says, or more (`alike_from`)."""
        return self.alike_from(self.sections.sweep.angles_per_pitch)

    def alike_from(self, asked: int) -> int:
        """Return how many positions to a mesh cycle, so many at least, are the same ones for planets that are equal.

        Sun and ring meet planets in N equal places by z / N of a pitch after each other.
        """
        planets = self.sections.planets
        if not self.plan.planets or planets.positions_deg:
            return asked
        inner, outer = (case.pair for case in self.cases.values())
        teeth = inner.pinion.teeth, outer.wheel.teeth
        step = math.lcm(*(planets.count // math.gcd(planets.count, count) for count in teeth))
        return -(-asked // step) * step

    @property
    def rounded(self) -> list[str]:
        """A sentence where more angles are solved than the file says."""
        asked = self.sections.sweep.angles_per_pitch
        if self.angles_per_pitch == asked:
            return []
        return [
            f"[sweep] angles_per_pitch = {asked}: {self.angles_per_pitch} are solved, so that all planets pass the "
            "same positions."
        ]

    @property
    def held(self) -> Member:
        """Member of a planetary set that stands still."""
        assert self.sections.load is not None
        return self.sections.load.held

    @property
    def torques_Nm(self) -> list[float]:
        """Amounts of the torque that are solved, rising: of the nominal one, and of those of the sweep."""
        return sorted({self.plan.nominal_Nm, *_further_torques(self.sections)})

    @property
    def slips(self) -> list[str]:
        """A sentence for each value that is likely one in another unit."""
        said = self.sections
        own = {"planets": said.planets, "eccentricity": said.eccentricity, "tolerances": said.tolerances}
        of_meshes = (f"mesh {name}: {text}" for name, case in self.cases.items() for text in case_slips(case))
        return [*slips({name: section for name, section in own.items() if section is not None}), *of_meshes]

    @property
    def whole_text(self) -> str:
        """Text of the set file and of those that it names."""
        if self.sections.carrier.stiffness is None:
            return self.text
        return joined_files(self.text, {"carrier": self.inputs[-1].read_text(encoding="utf-8-sig")})


def load(path: Path | str, shafts: OnShafts | None = None) -> SetFile:
    """Read and check a set file.

    Parameters
    ----------
    shafts : OnShafts, optional
        Where the set is a part of a gearbox.

    Raises
    ------
    CaseError, GeometryError, FileFormatError
        One line with file, place, rule and remedy.
    """
    path = Path(path)
    name = printable(path.stem)
    return parse_set(read_text(path, "set file"), name, str(path), (path,), shafts=shafts)


def sections_of(text: str, path: Path) -> SetSections:
    """Return the sections of the text of a set file: gears are not put together yet.

    Raises
    ------
    CaseError, GeometryError
    """
    reader = SetReader(str(path), sections_in(SetSections), path.parent)
    return reader.section(parse_toml(text, str(path)), SetSections, filled={"title": printable(path.stem)})


def parse_set(
    text: str, name: str, where: str, inputs: tuple[Path, ...] = (), shafts: OnShafts | None = None
) -> SetFile:
    """Check the text of a set file; `where` names it in messages.

    Raises
    ------
    CaseError, GeometryError
    """
    reader = SetReader(where, sections_in(SetSections), inputs[0].parent if inputs else None)
    said = reader.section(parse_toml(text, where), SetSections, filled={"title": name})
    return checked_set(reader, said, name, text, inputs, shafts=shafts)


def with_sections(file: SetFile, said: SetSections) -> SetFile:
    """Return a set that was read with other sections, checked as those of a file; the errors of `parse_set`."""
    where, folder = (str(file.inputs[0]), file.inputs[0].parent) if file.inputs else (file.name, None)
    reader = SetReader(where, sections_in(SetSections), folder)
    found = checked_set(reader, said, file.name, file.text, file.inputs, file.notes, file.changed)
    if file.plan.on_pins is None or found.plan.on_pins is None or found.plan.on_pins.rolling:
        return found
    return replace(found, plan=_on_rolling(found.plan, file.plan.on_pins.rolling))


def checked_set(
    reader: SetReader, said: SetSections, name: str, text: str, inputs: tuple[Path, ...], notes: tuple[str, ...] = (),
    changed: tuple[str, ...] = (), shafts: OnShafts | None = None,
) -> SetFile:  # fmt: skip
    """Return the set of sections that were read, checked as a whole, that which costs least first.

    Raises
    ------
    CaseError, GeometryError
    """
    if shafts is not None:
        said = _part_of_a_gearbox(said, shafts)
    try:
        layout = reader.layout(said, shafts is not None)
        pairs = reader.pairs(said, layout)
        reader.check_distances(said, layout, pairs)
        carrier = reader.carrier_stiffness(said)
        plan = set_plan(said, layout, pairs, carrier)
        if said.pins is not None and (pins := said.pins.linear(_on_planet_N(layout, plan, pairs))) != said.pins:
            rolling = tuple(bearing.inner for bearing in said.pins.bearings)
            said = replace(said, pins=pins)
            plan = _on_rolling(set_plan(said, layout, pairs, carrier), rolling)
    except (CaseError, GeometryError) as error:
        raise type(error)(f"{reader.where}: {str(error).removeprefix(f'{reader.where}: ')}") from None
    further = _further_torques(said) if shafts is None else ()
    most = max((plan.nominal_Nm, *further)) / plan.nominal_Nm
    most = most if shafts is None or shafts.most_Nm is None else shafts.most_Nm / plan.torque_Nm
    torques_Nm = {key: most * torque for key, torque in plan.mesh_torques_Nm.items()}
    cases = reader.cases(said, layout, torques_Nm)
    plan = reader.own_teeth(said, layout, plan, torques_Nm)
    reader.check_errors(said, plan, cases, pairs)
    check_cheeks(said, plan, cases, reader.refuse)
    pitches = reader.pitches(said, plan, cases), reader.sample_pitches(said, plan, cases)
    housed = 1 if shafts is None else reader.pitches(said, plan, cases, housed=True)
    if said.carrier.stiffness is not None:
        inputs = (*inputs[:1], (reader.folder or Path()) / said.carrier.stiffness)
    notes = tuple(dict.fromkeys((*notes, *reader.idle_teeth(layout, cases))))
    return SetFile(name, text, said, plan, cases, inputs, notes, changed, *pitches, housed)


def _on_rolling(plan: SetPlan, rolling: tuple[InnerGeometry | None, ...]) -> SetPlan:
    """Return a plan whose planets stand on bearings of an inner geometry, by which they are as stiff as they are."""
    assert plan.on_pins is not None
    return replace(plan, on_pins=replace(plan.on_pins, rolling=rolling))


def _on_planet_N(layout: Layout, plan: SetPlan, pairs: Mapping[str, GearPair]) -> float:
    """Force of both meshes on a planet, N, by the torque on the sun at its reference circle."""
    name = layout.shares[0].name
    return 2e3 * abs(plan.mesh_torques_Nm[name]) / pairs[name].pinion.reference_radius


def _part_of_a_gearbox(said: SetSections, shafts: OnShafts) -> SetSections:
    """Leave out what shafts and load cases of a gearbox say: tolerances and the carrier's own stiffness stay."""
    given = {key.name: key.default for key in fields(Supports) if key.name.split("_")[0] in shafts.members}
    supports, carrier = replace(said.supports, **given), said.carrier  # type: ignore[arg-type]
    if "carrier" in shafts.members:
        carrier = replace(
            carrier, radial_N_per_mm="rigid", tilt_Nmm_per_rad="rigid", bearings_at_mm=Carrier().bearings_at_mm
        )
    return replace(said, supports=supports, carrier=carrier, loads=(), masses=())


def _further_torques(said: SetSections) -> tuple[float, ...]:
    """Amounts of the torque beside the nominal one."""
    return (*said.sweep.torques_Nm, *(load.torque_Nm for load in said.loads))
