"""Plan of a gearbox: its parts, what is solved with sizes and time, what is left out and why; nothing is solved."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from pmor.case import Case
from pmor.case.duty import shares
from pmor.case.width import sections_across, whole_width
from pmor.core.errors import ConvergenceError
from pmor.gear.pair import GearPair
from pmor.machine.carrier_turn import MEAN_PLACES as MEAN_OF_TURN
from pmor.machine.coupled import MEAN_ANGLES
from pmor.machine.coupled_sets import MEAN_PLACES
from pmor.machine.left_out import left_out
from pmor.machine.loaded import loaded
from pmor.machine.loader import GearboxFile
from pmor.machine.model import pinion_torques, set_torques
from pmor.machine.settings import Bearing
from pmor.sets.loader import SetFile
from pmor.sets.preview import (
    LINE_S,
    MODES_S,
    PER_HARMONIC,
    SETTLED,
    STRESS,
    SWEEP,
    TOLERANCES,
    MotionCost,
    law_seconds,
    motion_page_seconds,
    refuse_large_set,
    set_seconds,
    stages_of_set,
    sweep_seconds,
    teeth_of_set,
    times,
)
from pmor.work.cost import (
    COMPILING,
    FINITE_ELEMENTS,
    KERNEL_BYTES,
    PAGE_BYTES,
    START,
    Plan,
    Stage,
    drawn_seconds,
    left_out_lines,
    loaded_bytes,
    plan_texts,
    refuse_beyond_memory,
    seconds_of,
    stage_lines,
    stages,
)

TRAINING, LOADS = "training", "{} loads"
# *Measured*, seconds: of a position, of two sections in contact in it; times of that for a position placed anew;
# rounds in which mean forces settle; positions that take as long as the flank that fits, of a mesh under a load; page
# and pictures.
POSITION_S, SECTIONS_S, PLACED, ROUNDS, FIT_POSITIONS, PAGE_S = 3e-5, 2.2e-7, 3, 4, 700, 4.0
# *Measured*: times of a set in a position by itself to one on its shafts, and to one over a turn of its carrier; rounds
# there.
ON_SHAFTS, OVER_A_TURN, TURNED_ROUNDS = 3, 6, 16
# Of motion: cycles of a mesh about a load, and of what a micrometre of its flanks does; angles of the mean deflection.
CYCLES, CHANGED, MEAN_DEFLECTION = 4, 32, 32


def plan(file: GearboxFile) -> Plan:
    """Return the plan of a gearbox.

    Its parts raise InsufficientMemoryError where the finite elements of a mesh take more memory than there is, and
    GeometryError where a shaft can move away.
    """
    found, motion = stages_of_gearbox(file), motion_of_gearbox(file)

    def parts() -> Iterator[str]:
        for case in file.cases.values():
            refuse_beyond_memory(_alone(case))
        for one in file.model.sets.values():
            refuse_large_set(one)
        yield from plan_texts(
            _machine(file), _meshes(file), _sets(file), _loads(file),
            stage_lines(found, "; bases that are there take none"), motion.lines if motion else (),
            left_out_lines(left_out(file)), [f"! {note}" for note in file.notes],
        )  # fmt: skip

    return Plan(parts, times(found, motion), seconds_of(found, COMPILING))


def _alone(case: Case) -> Case:
    """A case without the comparison with full FE, which a gearbox has none of."""
    return replace(case, compare=replace(case.compare, angles=0))


def _machine(file: GearboxFile) -> Iterator[str]:
    said = file.model.sections
    yield f"Gearbox {file.name}: {said.title}"
    for shaft in said.shafts:
        y, z = shaft.at_mm
        places = f"x = {shaft.start_mm:g} to {shaft.start_mm + shaft.length:g}, y = {y:g}, z = {z:g} mm"
        yield f"  {'shaft ' + shaft.name:<34} {places}, {len(shaft.sections)} sections"
    for bearing in said.bearings:
        yield f"  {'bearing ' + bearing.name:<34} on {bearing.shaft} at {bearing.at_mm:g} mm: {_kind(bearing)}"
    rigid = file.model.housing is None
    yield f"  {'housing':<34} {'rigid' if rigid else f'stiffness of {file.model.seats} seats'}"


def _kind(bearing: Bearing) -> str:
    if bearing.law is not None:
        return bearing.law.words
    ways = [
        ("radial", bearing.radial_N_per_mm), ("axial", bearing.axial_N_per_mm), ("tilt", bearing.tilt_Nmm_per_rad),
        *([("torsion", bearing.torsion_Nmm_per_rad)] if bearing.couples else []),
    ]  # fmt: skip
    return ", ".join(f"{name} {value if isinstance(value, str) else f'{value:g}'}" for name, value in ways)


def _sets(file: GearboxFile) -> Iterator[str]:
    if file.model.sets:
        yield "Planetary sets: all meshes at once, on the compliance of the hubs of sun, carrier and ring"
    for one in file.model.sections.sets:
        said = file.model.sets[one.name]
        (sun, ring), count = said.teeth, len(said.plan.planets)
        planet = next(iter(said.cases.values())).pair.wheel.teeth
        on = ", ".join(f"{name} on {place.shaft} at {place.at_mm:g} mm" for name, place in one.members.items())
        yield f"  {one.name:<34} {sun:g}/{planet}/{ring:g} teeth, {count} planets, {said.held} held, {on}"


def _meshes(file: GearboxFile) -> Iterator[str]:
    if not file.cases:
        return
    yield "Meshes: each of line loads on the compliance of both hubs, beside the same pair on rigid supports"
    for mesh in file.model.sections.meshes:
        pair, case = file.model.pairs[mesh.name], file.cases[mesh.name]
        teeth = f"{pair.pinion.teeth}/{pair.wheel.teeth} teeth, m {case.pair.module_mm:g} mm"
        teeth += f", {case.pair.helix_angle_deg:g} deg" if case.pair.helix_angle_deg else ""
        ratios = f"contact ratio {pair.contact_ratio:.3f} + {pair.overlap_ratio:.3f}"
        yield f"  {mesh.name:<34} {teeth}, {ratios}, {case.online.angles_per_pitch} angles a pitch"


def _loads(file: GearboxFile) -> Iterator[str]:
    model = file.model
    yield f"Loads: torques of pinions{' and suns' if model.sets else ''} without losses"
    parts = shares(model.sections.loads)
    for number, load in enumerate(model.sections.loads):
        torques = [f"{name} {torque:.4g} N m" for name, torque in pinion_torques(model, load).items()]
        torques += [f"sun of {name} {torque:.4g} N m" for name, torque in set_torques(model, load).items()]
        torques += [f"{rpm:g} rpm" for rpm in [load.speed_rpm] if rpm is not None]
        torques += [f"{100.0 * parts[number]:.3g} % of the time"] if parts else []
        yield f"  {load.name:<34} {', '.join(torques)}"
        try:
            loaded(model, load).solve()
        except ConvergenceError as error:
            yield f"  ! {error}"


def stages_of_gearbox(file: GearboxFile) -> list[Stage]:
    """Return the stages of a gearbox: finite elements and training of each mesh, its loads, the page."""
    loads, held = len(file.model.sections.loads), 0  # bases that are there are held to the end
    found, more = list[Stage](), list[tuple[str, float]]()
    for name, case in file.cases.items():
        for stage in stages(_alone(case)):
            if stage.name in (COMPILING, START) and stage.name not in [one.name for one in found]:
                found.append(stage)
            elif stage.name in (FINITE_ELEMENTS, TRAINING):
                found.append(replace(stage, name=f"{stage.name}, {name}", memory=stage.memory + held))
        held += loaded_bytes(case)
        seconds = _position_seconds(file.model.pairs[name], case)
        positions = case.repeats_after * (case.online.angles_per_pitch + ROUNDS * MEAN_ANGLES)
        more.append((f"{LOADS.format(loads)}, {name}", loads * positions * placed_seconds(file, name)))
        more.append((f"the flank that fits, {name}", loads * FIT_POSITIONS * seconds))
        if drawn := drawn_seconds(case, case.online.angles_per_pitch, 1, seconds):
            more.append((f"{TOLERANCES}, {name}", loads * drawn))
    of_sets = 0
    for name, one in file.model.sets.items():
        for stage in stages_of_set(one):
            if stage.name in (COMPILING, START) and stage.name not in [each.name for each in found]:
                found.append(stage)
            elif stage.name.startswith(FINITE_ELEMENTS):
                found.append(replace(stage, name=f"{stage.name}, {name}", memory=stage.memory + held))
            elif stage.name == SWEEP:
                of_sets += stage.memory - KERNEL_BYTES
            elif stage.name == TOLERANCES:
                amounts = len(one.torques_Nm)
                more.append((f"{TOLERANCES}, {name}", loads * ON_SHAFTS * stage.seconds / amounts))
        pitches, seconds = _set_pitches_and_seconds(file, one)
        more.append((f"{LOADS.format(loads)}, {name}", loads * seconds))
        if stress := set_seconds(one).stress:
            more.append((f"{STRESS}, {name}", loads * pitches * one.angles_per_pitch * stress))
    held += of_sets + KERNEL_BYTES
    found += [Stage(name, held, seconds) for name, seconds in more]
    found.append(Stage("page", held + PAGE_BYTES, PAGE_S))
    return found


def motion_of_gearbox(file: GearboxFile) -> MotionCost | None:
    """Return what `pmor dynamics` does with a gearbox, where the file says at which speeds."""
    said = file.model.sections
    motion = said.dynamics
    if motion.over(load.speed_rpm for load in said.loads) is None:
        return None
    loads, meshes = len(motion.loads or said.loads), len(file.cases) + len(file.model.sets)
    seconds = loads * (MODES_S + meshes * motion.speeds * motion.harmonics * LINE_S)
    changed = 0.0
    for name, case in file.cases.items():
        cycle = case.repeats_after * PER_HARMONIC * motion.harmonics
        position = POSITION_S + _position_seconds(file.model.pairs[name], case)
        seconds += loads * (CYCLES * cycle + MEAN_DEFLECTION + ROUNDS * MEAN_ANGLES) * position
        changed += CHANGED * cycle * position
    for one in file.model.sets.values():
        law = law_seconds(one, set_seconds(one), motion.harmonics)
        seconds += loads * (_set_pitches_and_seconds(file, one)[1] + SETTLED * law)
    teeth = sum(float(abs(gear.teeth)) for pair in file.model.pairs.values() for gear in (pair.pinion, pair.wheel))
    teeth += sum(map(teeth_of_set, file.model.sets.values()))
    words = f"{loads} loads, {motion.speeds} speeds, {motion.harmonics} harmonics of {meshes} meshes and sets"
    return MotionCost(words, seconds, changed + motion_page_seconds(len(said.bearings), teeth))


def _set_pitches_and_seconds(file: GearboxFile, one: SetFile) -> tuple[int, float]:
    """Mesh cycles over which a set on its shafts is solved under a load, and the time of its rounds and of these.

    On bearings with a law its mean in each round and the turn itself are found over turns of the carrier.
    """
    own, angles, cycle = set_seconds(one), one.angles_per_pitch, one.plan.cycle
    if one.held == "carrier" or all(bearing.law is None for bearing in file.model.sections.bearings):
        pitches, rounds = one.housed_pitches, ON_SHAFTS * ROUNDS * MEAN_PLACES * MEAN_ANGLES * cycle
    else:
        pitches, rounds = one.pitches, OVER_A_TURN * (TURNED_ROUNDS * MEAN_OF_TURN + one.housed_pitches)
    placed = (angles + ROUNDS * MEAN_ANGLES) * cycle * own.place
    solved = (rounds + ON_SHAFTS * pitches * angles) * own.position
    return pitches, placed + solved + sweep_seconds(one, own, 1, angles)


def placed_seconds(file: GearboxFile, name: str) -> float:
    """Return the time of a mesh of a gearbox in a position that is placed anew."""
    return PLACED * _position_seconds(file.model.pairs[name], file.cases[name])


def _position_seconds(pair: GearPair, case: Case) -> float:
    sections = sections_across(whole_width(case))  # hubs tilt
    return POSITION_S + SECTIONS_S * (pair.total_contact_ratio * sections) ** 2
