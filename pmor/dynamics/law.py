"""The force law of the pair of a case: in a table that is held against the line loads it stands for."""

from __future__ import annotations

import logging
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, ConvergenceError
from pmor.dynamics.force_law import LoadLimit, load_limit, shifted, static_displacement
from pmor.dynamics.force_table import TableError, Watched, range_under, table_error, tabulate
from pmor.dynamics.gear_model import GearModel
from pmor.dynamics.kernels.laws import ForceTable
from pmor.dynamics.moved_axes import assembly_under, shift_of
from pmor.gear.condition import Assembly, at_torques
from pmor.gear.pair import ROUNDING, GearPair
from pmor.line.hertz import TOO_WIDE
from pmor.line.layered_pair import as_layered, place_flanks_of
from pmor.pair.conditions import assembly_of, backs_mirror_flanks
from pmor.pair.model import refuse_loads
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.mesh_force import mesh_force_of
from pmor_online.model import ReducedPair

LOG = logging.getLogger("pmor")
# Allowed errors of a table: of the force, over the largest; of the static transmission error under the torques of the
# case, over its peak-to-peak value; the force that this allows, at least, over the load.
TOLERANCE, STATIC_TOLERANCE, LEAST_TOLERANCE = 5e-5, 5e-5, 4e-6
# How far a table goes: multiples of the displacement under the largest torque. At 2 % damping motion without relief
# goes to six or seven times that.
MULTIPLE = 10.0
# Places where a table is held against its law: their number squared; angles of a static transmission error per mesh
# cycle.
CHECKED, STATIC_ANGLES, SEED = 60, 100, 18
# Mesh cycles after which a law with pitch deviations or holes repeats, at most.
MOST_CYCLES = 1000


@dataclass(frozen=True)
class MeshLaw:
    """The force law of a pair under a torque, and the error of its table."""

    torque_Nm: float
    table: ForceTable
    error: TableError  # Over the largest force
    largest_force: float  # In the table, N
    assembly: Assembly  # With the axes where the mean mesh force holds them
    # Displacement of the oscillator less that of the line loads, mm: the first counts the displacements of the bearings
    # too; see `pmor.dynamics.moved_axes`
    shift: float
    # Of the static transmission error of the table under the torque, and that of the line loads
    static_error_um: float
    static_peak_to_peak_um: float
    limit: LoadLimit  # Of the motion in which no section is overloaded


def mesh_laws(
    case: Case, reduced: ReducedPair, model: GearModel, executor: Executor | None = None
) -> tuple[tuple[MeshLaw, ...], tuple[str, ...]]:
    """Tabulate the force laws of the pair of a case, one per torque; on rigid bearings all share one table.

    Returns laws, at least one, and the torques without a law, with the reason. Errors are those of `force_law`, where
    no torque has a law.
    """
    laws, failures = list[MeshLaw](), list[str]()
    first: ConvergenceError | None = None
    if not model.supports:
        LOG.info("the force law is tabulated, which takes minutes for helical pairs")
    shared = None if model.supports else _limited_law(case, reduced, executor, assembly_of(case))
    for torque in case.dynamics.torques_Nm:
        assembly = assembly_under(case, model, reduced.meshed.pair, torque)
        try:
            if shared is None:
                LOG.info("the force law is tabulated, with the axes displaced by %g N m", torque)
            limited = shared or _limited_law(_under(case, torque), reduced, executor, assembly)
            (table, error, largest), limit = limited
            static = static_error_um(table, reduced, torque, assembly)
        except ConvergenceError as lost:
            failures.append(f"{torque:g} N m: {lost}")
            first = first or lost
        else:
            shift = shift_of(case, reduced.meshed.pair, assembly.misalignment)
            limit = limit.shifted(shift)
            laws.append(MeshLaw(torque, shifted(table, shift), error, largest, assembly, shift, *static, limit))
    if first and not laws:
        raise first
    return tuple(laws), tuple(failures)


def _under(case: Case, torque_Nm: float) -> Case:
    return replace(case, dynamics=replace(case.dynamics, torques_Nm=(torque_Nm,)))


def _limited_law(
    case: Case, reduced: ReducedPair, executor: Executor | None, assembly: Assembly
) -> tuple[tuple[ForceTable, TableError, float], LoadLimit]:
    law = force_law(case, reduced, executor, assembly)
    return law, load_limit(reduced, assembly, law[0], alike_cycles(reduced, assembly))


def force_law(
    case: Case, reduced: ReducedPair, executor: Executor | None = None, assembly: Assembly | None = None
) -> tuple[ForceTable, TableError, float]:
    """Tabulate the force law of a case, or of its pair in another assembly, and hold the table against the law.

    Returns the table, its error, and the largest force in it, N.

    Raises
    ------
    CaseError
        Where a torque is beyond the range of the contact.
    ConvergenceError
        Where the law has no force within the range that it needs.
    """
    torques, assembly = case.dynamics.torques_Nm, assembly or assembly_of(case)
    refuse_loads(replace(case, online=replace(case.online, torques_Nm=torques)), reduced.meshed)
    forces, alike = mesh_force_of(reduced, assembly), alike_cycles(reduced, assembly)
    load = 1e3 * torques[-1] / reduced.meshed.pair.pinion.base_radius
    touch = reduced.meshed.pair.pinion.base_radius * reduced.meshed.kinematics(assembly.misalignment).first_touch
    low, high = range_under(forces, load, assembly.spread, MULTIPLE, touch)
    # That looked at the first mesh cycle alone.
    limits = low, high if len(alike) == 1 else high + assembly.spread
    backlash = backlash_of(case, reduced.meshed.pair)
    table = tabulate(
        forces, *limits, _watched(reduced, torques, assembly, alike), TOLERANCE,
        np.inf if backlash is None else backlash, alike, executor,
    )  # fmt: skip
    error = table_error(table, forces, CHECKED, np.random.default_rng(SEED))
    return table, error, float(table.values.max())


def static_error_um(
    table: ForceTable, reduced: ReducedPair, torque_Nm: float, assembly: Assembly
) -> tuple[float, float]:
    """Return by how much the table of an assembly misses the static transmission error, um, and its peak-to-peak value.

    ConvergenceError where the torque is borne by the table or by the line loads alone.
    """
    radius = reduced.meshed.pair.pinion.base_radius
    phase = np.random.default_rng(SEED).uniform(0.0, 2.0 * np.pi * len(table.root), STATIC_ANGLES * len(table.root))
    exact, _ = _static(reduced, phase, (torque_Nm,), assembly)
    displacement = static_displacement(table, 1e3 * torque_Nm / radius, phase, (table.low, table.high))
    return 1e3 * float(np.abs(displacement - exact[0]).max()), 1e3 * float(np.ptp(exact[0]))


def backlash_of(case: Case, pair: GearPair) -> float | None:
    """Return from where drive flanks touch to where coast flanks do, along the line of action, mm.

    None, and motion goes on without coast flanks, where the drawing has no backlash and the case gives none, or where
    tilted axes, flanks whose halves differ, pitch deviations or holes make the backs no mirror images of the flanks.
    """
    if case.dynamics.backlash_um is not None:
        return 1e-3 * case.dynamics.backlash_um
    if pair.backlash <= ROUNDING * pair.pinion.module or not backs_mirror_flanks(case):
        return None
    if with_pitch(assembly_of(case)) or any(case.pair.holes):
        return None
    return pair.backlash


def with_pitch(assembly: Assembly) -> bool:
    """Whether teeth are out of their places."""
    return assembly.uneven


def cycles_of(case: Case, pair: GearPair) -> int:
    """Return after how many mesh cycles the force law of a case repeats.

    CaseError where they are too many, or coast flanks are asked for: pitch deviations are those of drive flanks.
    """
    flanks = case.pinion_modification, case.wheel_modification
    cycles = case.pair.repeats_with([flanks])
    keys = flanks[0].tooth_keys + flanks[1].tooth_keys
    what = keys[0] if keys else "holes" if case.pair.wheel.lugs is None else "lugs"
    where = f"case {case.name}: {what}"
    if cycles > MOST_CYCLES:
        raise CaseError(
            f"{where}: of both gears, the mesh repeats after {cycles} mesh cycles only, and motion takes {MOST_CYCLES} "
            "at most: give those of one gear"
        )
    if cycles > 1 and case.dynamics.backlash_um is not None:
        raise CaseError(
            f"{where}: they say nothing of the coast flanks, which [dynamics] backlash_um needs: leave one out"
        )
    return cycles


def alike_cycles(reduced: ReducedPair, assembly: Assembly) -> tuple[int, ...]:
    """Return the kind of each mesh cycle of the period of a force law; kinds are numbered as they first come.

    Two cycles are of one kind where the teeth that can touch have the same deviations, those of the neighbouring
    cycles too, and holes stand alike.
    """
    meshed, holes = reduced.meshed, reduced.basis.case.pair.repeats_after
    flanks, gears = (assembly.pinion, assembly.wheel), (meshed.pair.pinion, meshed.pair.wheel)
    pinion, wheel = (flank.pitch_deviations_um for flank in flanks)
    if not with_pitch(assembly):
        return tuple(range(holes))
    cycles = reduced.basis.case.pair.repeats_with([flanks])
    others = [
        replace(flank, pitch_deviations_um=()).repeats_after(abs(gear.teeth))
        for flank, gear in zip(flanks, gears, strict=True)
    ]
    pitch = meshed.pair.pitch
    lines = place_flanks_of(meshed, np.array([0.0, np.nextafter(pitch, 0.0)]), assembly.misalignment)
    pair_count = lines.gap.shape[1] // len(as_layered(meshed).sections.z)
    pairs = range(int(lines.first_pair.min()), int(lines.first_pair.max()) + pair_count)

    def apart(tooth_pair: int) -> tuple[float, ...]:
        deviation = pinion[tooth_pair % len(pinion)] if pinion else 0.0
        deviation += wheel[-tooth_pair % len(wheel)] if wheel else 0.0
        return deviation, *(tooth_pair % other for other in others)

    teeth = [tuple(apart(pair - cycle) for pair in pairs) for cycle in range(cycles)]
    kinds: dict[object, int] = {}
    return tuple(
        kinds.setdefault((teeth[cycle - 1], teeth[cycle], teeth[(cycle + 1) % cycles], cycle % holes), len(kinds))
        for cycle in range(cycles)
    )


def _watched(
    reduced: ReducedPair, torques_Nm: tuple[float, ...], assembly: Assembly, alike: tuple[int, ...]
) -> list[Watched]:
    """Loads, and the errors of the force that displace the pair at rest by the allowed share of peak-to-peak."""
    radius, first = reduced.meshed.pair.pinion.base_radius, np.unique(alike, return_index=True)[1]
    cycle = np.arange(STATIC_ANGLES) / STATIC_ANGLES
    exact, stiffness = _static(reduced, 2.0 * np.pi * np.add.outer(first, cycle).ravel(), torques_Nm, assembly)
    loads = 1e3 * np.array(torques_Nm) / radius
    allowed = STATIC_TOLERANCE * np.ptp(exact, axis=1) * stiffness.min(axis=1)
    return [Watched(*pair) for pair in zip(loads, np.maximum(allowed, LEAST_TOLERANCE * loads), strict=True)]


def _static(
    reduced: ReducedPair, phase: FloatArray, torques_Nm: tuple[float, ...], assembly: Assembly
) -> tuple[FloatArray, FloatArray]:
    """Displacements at rest under torques, mm, and stiffnesses, N/mm, both (torques, phases)."""
    torques = at_torques(
        (1e3 * torque for torque in torques_Nm), assembly.misalignment, assembly.pinion, assembly.wheel
    )
    sweep = sweep_line_loads(reduced, phase / (2.0 * np.pi) * reduced.meshed.pair.pitch, torques)
    if sweep.overloaded is not None and sweep.overloaded.any():
        raise ConvergenceError(f"at rest a torque {TOO_WIDE}")
    if not sweep.converged.all():
        raise ConvergenceError("no equilibrium at rest under a torque at some angles: lower the torque")
    assert sweep.stiffness_N_per_um is not None, "line loads have one"
    return np.asarray(1e-3 * sweep.ste_um), np.asarray(1e3 * sweep.stiffness_N_per_um)
