"""What a set file has solved, at what cost, and what is left out; nothing is solved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from pmor.case.capability import left_out
from pmor.case.gears import GearCase
from pmor.case.width import meshed_width
from pmor.core.progress import format_time
from pmor.gear.pair import GearPair
from pmor.pair.model import gear_pair
from pmor.sets.loader import SetFile
from pmor.sets.pins import PlanetsOnPins
from pmor.sets.settings import SetSections
from pmor.work.cost import (
    COMPILING,
    FINITE_ELEMENTS,
    KERNEL_BYTES,
    PAGE_BYTES,
    START,
    Stage,
    left_out_lines,
    plan_text,
    refuse_beyond_memory,
    stage_lines,
    stages,
    whole,
)
from pmor.work.finite_element_cost import held_bytes
from pmor.work.sizes import pair_size

# *Measured*, seconds: of a mesh in a position, of the sections in contact in it to the third power; root stress of both
# gears of a mesh in a position; page and pictures.
POSITION_S, SECTIONS_S, STRESS_S, PAGE_S = 2e-5, 8e-10, 4e-4, 3.0
SWEEP, PAGE = "sweep of all meshes", "page"
# Members of a planetary set that stand on something.
MEMBERS = 3
# *Measured* of motion, seconds: modes of a load, a line at a speed, a set about a load; page, panel of a bearing, tooth
# in pictures of modes.
MODES_S, LINE_S, SET_S, MOTION_PAGE_S, PANEL_S, TOOTH_S = 0.3, 2e-5, 2.0, 6.0, 0.6, 0.035

def plan(file: SetFile) -> str:
    """Return the plan of a set.

    Raises
    ------
    InsufficientMemoryError
        When the finite elements of a mesh take more memory than there is.
    """
    refuse_large_set(file)
    motion = _motion(file)
    costs = stage_lines(stages_of_set(file)), motion.lines if motion else (), left_out_lines(left_out(file))
    notes = [f"! {note}" for note in (*file.changed, *file.notes)]
    return plan_text([_gears(file), _meshes(file), _loads(file), *costs, notes])


def seconds(file: SetFile) -> dict[str, float]:
    """Return the time that commands take with a set, s, by name; motion where the file says at which speeds."""
    found = stages_of_set(file)
    return times(found, _motion(file))


@dataclass(frozen=True)
class MotionCost:
    """Time of motion, beside finite elements.

    Parameters
    ----------
    words : str
        The numbers that it goes with.
    seconds, page_s : float
        Of equilibrium, modes and lines; of page and pictures.
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
            f"  {'page and pictures':<34} about {format_time(self.page_s)}",
        ]


def times(found: Sequence[Stage], motion: MotionCost | None) -> dict[str, float]:
    """Return the time of a run with these stages, and of motion on its finite elements."""
    bodies = sum(stage.seconds for stage in found if stage.name.startswith((START, FINITE_ELEMENTS)))
    moved = {} if motion is None else {"dynamics": bodies + motion.seconds + motion.page_s}
    return {"run": whole(found).seconds, **moved}


def _motion(file: SetFile) -> MotionCost | None:
    """What `pmor dynamics` does, where the file says at which speeds."""
    motion, load, torques = file.sections.dynamics, file.sections.load, len(file.torques_Nm)
    if load is None or motion.over([load.speed_rpm]) is None:
        return None
    solved = torques * (MODES_S + SET_S + motion.speeds * motion.harmonics * LINE_S)
    solved += sum(stage.seconds for stage in stages_of_set(file) if stage.name == SWEEP)
    words = f"{torques} torques, {motion.speeds} speeds, {motion.harmonics} harmonics"
    return MotionCost(words, solved, motion_page_seconds(MEMBERS, teeth_of_set(file)))


def motion_page_seconds(bearings: int, teeth: float) -> float:
    """Return the time of a page of motion with its pictures."""
    return MOTION_PAGE_S + bearings * PANEL_S + teeth * TOOTH_S


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
                found.append(replace(stage, name=f"{stage.name}, {name}", memory=stage.memory + held))
        held += held_bytes(pair_size(case, gear_pair(case)))
    held += KERNEL_BYTES
    pairs, sections = pairs_of(file), 0.0
    for mesh in file.plan.meshes:
        case = file.cases[mesh.case]
        elements = case.mesh.width_elements / (2 if meshed_width(case) == "half" else 1)
        sections += pairs[mesh.case].total_contact_ratio * (case.mesh.order * elements + 1)
    meshes, torques = len(file.plan.meshes), len(file.torques_Nm)
    in_a_pitch = torques * file.angles_per_pitch
    a_pitch = in_a_pitch * (POSITION_S * meshes + SECTIONS_S * sections**3)
    found.append(Stage(SWEEP, held, file.pitches * a_pitch))
    if all(case.results.root_stress for case in file.cases.values()):
        found.append(Stage("root stress", held, file.pitches * in_a_pitch * STRESS_S * meshes))
    if file.sections.tolerances is not None:
        found.append(Stage("tolerances", held, file.sections.tolerances.samples * file.sample_pitches * a_pitch))
    return [*found, Stage(PAGE, held + PAGE_BYTES, PAGE_S)]
