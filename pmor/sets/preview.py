"""What a set file has solved, at what cost, and what is left out; nothing is solved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from pmor.case.capability import left_out
from pmor.case.gears import GearCase
from pmor.case.width import meshed_width
from pmor.core.progress import format_time
from pmor.gear.pair import GearPair
from pmor.pair.model import gear_pair
from pmor.sets.loader import SetFile
from pmor.sets.pins import PlanetsOnPins
from pmor.sets.remedies import FEW_ANGLES, MOST_POSITIONS
from pmor.sets.settings import SetSections
from pmor.work.cost import (
    COMPILING,
    FINITE_ELEMENTS,
    KERNEL_BYTES,
    PAGE_BYTES,
    START,
    Plan,
    Stage,
    body_seconds,
    left_out_lines,
    plan_texts,
    refuse_beyond_memory,
    seconds_of,
    stage_lines,
    stages,
)
from pmor.work.finite_element_cost import held_bytes
from pmor.work.sizes import pair_size

# *Measured*, seconds: of a mesh in a position, and of all sections in contact in it to the second power; of a mesh that
# is placed at an angle; root stress of both gears of a mesh in a position, by its sections; page and pictures.
POSITION_S, SECTIONS_S, PLACE_S, STRESS_S, PAGE_S = 5e-6, 6e-8, 1.2e-4, 1.4e-4, 3.0
SWEEP, STRESS, TOLERANCES, PAGE = "sweep of all meshes", "root stress", "tolerances", "page"
# *Measured*: solutions of flanks that are tried for the verdict; share of a sweep on half as many elements.
TRIED, COARSE = 70, 0.5
# *Measured* of motion: seconds of modes of a load, a line at a speed, a mesh in a position between hubs that stand, for
# which there are so many solutions; of page and pictures, a bearing and a tooth in them. Laws until a load is the mean,
# and of what a micrometre of its flanks does, for a kind of mesh.
MODES_S, LINE_S, LAW_S, LAW_SOLUTIONS, MOTION_PAGE_S, BEARING_S, TOOTH_S = 0.3, 2e-5, 8e-5, 2, 3.0, 0.1, 0.008
SETTLED, CHANGED = 5, 24
# Angles of a mesh cycle to each harmonic.
PER_HARMONIC = 16
# Members of a planetary set that stand on something.
MEMBERS = 3


def plan(file: SetFile) -> Plan:
    """Return the plan of a set.

    Its parts raise InsufficientMemoryError where the finite elements of a mesh take more memory than there is.
    """
    found = stages_of_set(file)
    motion = _motion(file, found)

    def parts() -> Iterator[str]:
        refuse_large_set(file)
        costs = stage_lines(found), motion.lines if motion else (), left_out_lines(left_out(file))
        notes = [f"! {note}" for note in (*file.changed, *file.notes)]
        yield from plan_texts(_gears(file), _meshes(file), _loads(file), *costs, notes)

    return Plan(parts, times(found, motion), seconds_of(found, COMPILING))


@dataclass(frozen=True)
class MotionCost:
    """Time of motion, beside finite elements.

    Parameters
    ----------
    words : str
        The numbers that it goes with.
    seconds, page_s : float
        Of equilibrium, modes and lines; of what a micrometre of flanks does, page and pictures.
    """

    words: str
    seconds: float
    page_s: float

    @property
    def lines(self) -> list[str]:
        """What a plan says."""
        return [
            "In motion, by pmor dynamics: beside finite elements",
            f"  {'equilibrium, modes, lines':<34} {self.words}, about {format_time(self.seconds)}",
            f"  {'a micrometre of each flank, page':<34} about {format_time(self.page_s)}",
        ]


def times(found: Sequence[Stage], motion: MotionCost | None) -> dict[str, float]:
    """Return the time of a run with these stages, and of motion on its finite elements."""
    bodies = seconds_of(found, START, FINITE_ELEMENTS)
    moved = {} if motion is None else {"dynamics": bodies + motion.seconds + motion.page_s}
    return {"run": seconds_of(found), **moved}


def _motion(file: SetFile, found: Sequence[Stage]) -> MotionCost | None:
    """What `pmor dynamics` does, where the file says at which speeds."""
    motion, load, torques = file.sections.dynamics, file.sections.load, len(file.torques_Nm)
    if load is None or motion.over([load.speed_rpm]) is None:
        return None
    law = law_seconds(file, set_seconds(file), motion.harmonics)
    solved = torques * (MODES_S + SETTLED * law + motion.speeds * motion.harmonics * LINE_S)
    solved += seconds_of(found, SWEEP)
    words = f"{torques} torques, {motion.speeds} speeds, {motion.harmonics} harmonics"
    changed = len(file.cases) * CHANGED * law * (file.plan.cycle == 1)
    return MotionCost(words, solved, changed + motion_page_seconds(MEMBERS, teeth_of_set(file)))


def law_seconds(file: SetFile, own: SetSeconds, harmonics: int) -> float:
    """Return the time of a law of all meshes of a set in motion, over the cycle after which they stand as before."""
    positions = file.plan.cycle * PER_HARMONIC * (harmonics + 1)
    return positions * (LAW_S * len(file.plan.meshes) + LAW_SOLUTIONS * own.position)


def motion_page_seconds(bearings: int, teeth: float) -> float:
    """Return the time of a page of motion with its pictures."""
    return MOTION_PAGE_S + bearings * BEARING_S + teeth * TOOTH_S


def teeth_of_set(file: SetFile) -> float:
    """Return the number of teeth of all gears of a planetary set."""
    planet = abs(next(iter(file.cases.values())).pair.wheel.teeth)
    return planet * len(file.plan.planets) + sum(map(abs, file.teeth))


def refuse_large_set(file: SetFile) -> None:
    """Raise InsufficientMemoryError where the finite elements of a mesh take more memory than there is."""
    for case in file.cases.values():
        refuse_beyond_memory(replace(case, compare=replace(case.compare, angles=0)))


def pairs_of(file: SetFile) -> dict[str, GearPair]:
    """Return the geometry of the meshes by the names of their cases."""
    return {name: gear_pair(case) for name, case in file.cases.items()}


def _gears(file: SetFile) -> Iterator[str]:
    plan = file.plan
    yield f"Set {file.name}: {file.sections.title}"
    for body in plan.bodies:
        side = -1.0 if plan.clockwise else 1.0
        x, y = (round(place, 6) + 0.0 for place in (side * body.x, body.y))
        yield f"  {body.name:<34} at x = {x:.6g}, y = {y:.6g}{f', z = {body.z:.6g}' if body.z else ''} mm"
    if plan.on_pins is not None:
        yield from _supports(file.sections, plan.on_pins)
        yield from _seats(file.cases[plan.meshes[1].case].pair.wheel)


def _supports(said: SetSections, on_pins: PlanetsOnPins) -> Iterator[str]:
    """What members of a planetary set stand on."""
    supports, pins, carrier = said.supports, said.pins, said.carrier
    rows = [("sun", supports.sun_radial_N_per_mm), ("ring", supports.ring_radial_N_per_mm)]
    rows.append(("carrier", carrier.radial_N_per_mm))
    if pins is None:
        rows.append(("planets", supports.planet_radial_N_per_mm))
    for name, value in rows:
        yield f"  {f'{name}, across':<34} {value if isinstance(value, str) else f'{value:.4g} N/mm'}"
    if pins is not None:
        cheeks = "both cheeks" if pins.cheeks == "both" else f"the cheek at {pins.cheeks}"
        own = 1.0 / on_pins.pin.compliance[[0, 4], [0, 4]]
        yield (
            f"  {'planets on pins':<34} d {pins.diameter_mm:g} x {pins.length_mm:g} mm, {pins.ends} in {cheeks}, "
            f"{own[0]:.4g} N/mm across, {own[1]:.4g} N mm/rad against tilting"
        )
    if carrier.stiffness is not None:
        yield f"  {'carrier at the seats of its pins':<34} {carrier.stiffness}"
    if isinstance(carrier.windup_Nmm_per_rad, float):
        rule = f"{carrier.windup_Nmm_per_rad:.4g} N mm/rad, torque out at {carrier.torque_at}"
        yield f"  {'wind-up of the carrier':<34} {rule}"


def _seats(ring: GearCase) -> Iterator[str]:
    """What holds the outside of a ring, where it is not rigid."""
    if (lugs := ring.lugs) is not None:
        yield f"  {'ring held':<34} at {len(lugs.middles_deg)} lugs of {lugs.lug_deg:g} deg"
    if ring.seats_give:
        seats = [
            f"{value if isinstance(value, str) else f'{value:.4g} N/mm'} {way}"
            for way, value in (("radially", ring.seat_radial_N_per_mm), ("around", ring.seat_tangential_N_per_mm))
        ]
        name = "seat of the ring" if lugs is None else "seat of each lug"
        yield f"  {name:<34} {', '.join(seats)}"


def _meshes(file: SetFile) -> Iterator[str]:
    yield "Meshes: all at once, by line loads on the compliance of every member"
    for name, pair in pairs_of(file).items():
        count = sum(mesh.case == name for mesh in file.plan.meshes)
        teeth = f"{count} x {pair.pinion.teeth}/{abs(pair.wheel.teeth)} teeth, m {pair.pinion.module:g} mm"
        torque = f"{file.plan.mesh_torques_Nm[name]:.4g} N m on the pinion"
        yield f"  {name:<34} {teeth}, contact ratio {pair.contact_ratio:.3f} + {pair.overlap_ratio:.3f}, {torque}"


def _loads(file: SetFile) -> Iterator[str]:
    amounts = file.torques_Nm
    angles = file.pitches * file.angles_per_pitch
    yield f"Positions: {angles} angles x {len(amounts)} torques: {', '.join(f'{amount:g}' for amount in amounts)} N m"
    if file.plan.cycle > 1:
        yield f"Mesh cycles differ: the set repeats after {file.plan.cycle} pitches of the first gear"
    if file.sections.tolerances is not None:
        angles = file.sample_pitches * file.angles_per_pitch
        yield f"Tolerances: {file.sections.tolerances.samples} sets x {angles} angles x {len(amounts)} torques"


def stages_of_set(file: SetFile) -> list[Stage]:
    """Return the stages of a set: finite elements of each mesh, the sweep, tolerances, page.

    All bodies stay in memory to the end.
    """
    found, held = list[Stage](), 0
    for name, case in file.cases.items():
        for stage in stages(case):
            if stage.name in (COMPILING, START) and stage.name not in [one.name for one in found]:
                found.append(stage)
            elif stage.name == FINITE_ELEMENTS:
                named = f"{stage.name}, {name}"
                found.append(replace(stage, name=named, memory=stage.memory + held, seconds=body_seconds(case)))
        held += held_bytes(pair_size(case, gear_pair(case)))
    held += KERNEL_BYTES
    torques, own = len(file.torques_Nm), set_seconds(file)
    in_a_pitch = torques * file.angles_per_pitch
    swept = (1.0 + COARSE) * sweep_seconds(file, own, torques, file.angles_per_pitch)
    found.append(Stage(SWEEP, held, swept))
    if own.stress:
        found.append(Stage(STRESS, held, file.pitches * in_a_pitch * own.stress))
    if (said := file.sections.tolerances) is not None:
        found.append(Stage(TOLERANCES, held, said.samples * file.sample_pitches * in_a_pitch * own.position))
    if file.pitches * file.angles_per_pitch <= MOST_POSITIONS:
        tried = sweep_seconds(file, own, 1, FEW_ANGLES) + TRIED * file.pitches * FEW_ANGLES * own.position
        found.append(Stage("flanks that are tried", held, tried))
    return [*found, Stage(PAGE, held + PAGE_BYTES, PAGE_S)]


def sweep_seconds(file: SetFile, own: SetSeconds, torques: int, angles: float) -> float:
    """Return the time of a set at so many angles to a pitch, under so many torques."""
    return angles * (file.plan.placed_pitches(file.pitches) * own.place + file.pitches * torques * own.position)


class SetSeconds(NamedTuple):
    """Time of all meshes of a set, s: in a position, placed at an angle, root stress in a position where asked for."""

    position: float
    place: float
    stress: float


def set_seconds(file: SetFile) -> SetSeconds:
    """Return the time of all meshes of a set."""
    pairs, sections, meshes = pairs_of(file), 0.0, len(file.plan.meshes)
    for mesh in file.plan.meshes:
        case = file.cases[mesh.case]
        elements = case.mesh.width_elements / (2 if meshed_width(case) == "half" else 1)
        sections += pairs[mesh.case].total_contact_ratio * (case.mesh.order * elements + 1)
    stress = STRESS_S * sections * all(case.results.root_stress for case in file.cases.values())
    return SetSeconds(POSITION_S * meshes + SECTIONS_S * sections**2, PLACE_S * meshes, stress)
