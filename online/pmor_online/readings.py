"""Results derived from the sweep of line loads of a case: all of them from the same solution."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass

from pmor.case import Case
from pmor.case.width import meshed_width
from pmor.gear.condition import Assembly
from pmor.gear.deviation_rates import deviation_rates
from pmor.gear.meshed_pair import MeshedPair
from pmor.line.layered_pair import as_layered
from pmor.line.unloaded import with_unloaded
from pmor.pair.conditions import assembly_of, conditions_of
from pmor.results.flank_maps import FlankMap, flank_map
from pmor.results.load_distribution import line_states
from pmor.results.mesh_forces import MeshForces, mesh_forces
from pmor.results.quantities import Figures, figures_of_mesh
from pmor.results.sensitivity import Sensitivities, sensitivities
from pmor.results.sweep import SteSweep
from pmor_online.model import ReducedPair, sweep_angles
from pmor_online.sweep import sweep_reduced_pair

# Numbers of sections in states that a sweep keeps at most: ten arrays of so many are some hundred megabytes.
MOST_KEPT = 4_000_000
# Of the nominal torque, at which contact patterns are taken: the flanks as they are made, hardly deformed.
LIGHT = 0.01


@dataclass(frozen=True)
class Readings:
    """Results derived from a recorded sweep of D torques and A angles.

    Attributes
    ----------
    figures : mapping of str to (D,)
        Of the mesh, by keys of `pmor.results.quantities`.
    maps : tuple of (FlankMap, FlankMap)
        Of pinion and wheel at each torque; empty where they are not asked for.
    light : (FlankMap, FlankMap) or None
        At a hundredth of the nominal torque.
    harris : SteSweep
        Over the torques of the Harris map, at the angles of the case's sweep.
    """

    figures: Figures
    forces: MeshForces
    sensitivities: Sensitivities
    maps: tuple[tuple[FlankMap, FlankMap], ...]
    light: tuple[FlankMap, FlankMap] | None
    harris: SteSweep


def can_record(meshed: MeshedPair, case: Case, angles: int, torques: int) -> bool:
    """Return whether a sweep is one of line loads, and short enough to keep all its states."""
    if case.reduction.shapes != "line_loads":
        return False
    return angles * torques * meshed.tooth_pair_count * len(as_layered(meshed).sections.z) <= MOST_KEPT


def read_off(reduced: ReducedPair, sweep: SteSweep, executor: Executor | None = None) -> Readings:
    """Read everything that a case asks for off its recorded sweep.

    Parameters
    ----------
    sweep : SteSweep
        Recorded, of the case's own condition.
    executor : concurrent.futures.Executor, optional
        Of threads, for further sweeps.
    """
    case, lines = reduced.basis.case, line_states(sweep)
    maps = tuple(flank_maps(reduced.meshed, sweep, d) for d in range(len(sweep.torque_Nm))) if case.results.maps else ()
    return Readings(
        figures=figures_of_mesh(reduced.meshed.pair, lines),
        forces=forces_on_gears(reduced.meshed, sweep), sensitivities=derivatives(reduced, sweep, assembly_of(case)),
        maps=maps, light=_light_maps(reduced, executor) if case.results.maps else None,
        harris=harris_sweep(reduced, executor),
    )  # fmt: skip


def forces_on_gears(meshed: MeshedPair, sweep: SteSweep) -> MeshForces:
    """Return forces and moments of the mesh in a recorded sweep."""
    pair, mirrored = meshed.pair, line_states(sweep).mirrored
    assert sweep.states is not None
    return mesh_forces(
        sweep.states.loads, mirrored, pair.pinion.base_radius, pair.centre_distance, pair.pinion.twist_per_length
    )


def derivatives(reduced: ReducedPair, sweep: SteSweep, assembly: Assembly) -> Sensitivities:
    """Return the derivatives of a recorded sweep by each parameter of the modifications that it was built with."""
    whole = meshed_width(reduced.basis.case) != "plane_strain"
    return sensitivities(sweep, deviation_rates(reduced.meshed, assembly, line_states(sweep), whole))


def flank_maps(meshed: MeshedPair, sweep: SteSweep, torque_index: int) -> tuple[FlankMap, FlankMap]:
    """Return the maps of the flanks of pinion and wheel at one of the torques of a recorded sweep."""
    pinion, wheel = (flank_map(sweep, torque_index, gear, meshed.pair.active_rolls[gear]) for gear in range(2))
    return pinion, wheel


def harris_sweep(reduced: ReducedPair, executor: Executor | None = None) -> SteSweep:
    """Sweep over the angles of the case and the torques of its Harris map, with the transmission error without load."""
    case = reduced.basis.case
    conditions = conditions_of(case, case.results.harris_torques_Nm)
    sweep = sweep_reduced_pair(reduced, sweep_angles(case), conditions, executor)
    return with_unloaded(sweep, reduced.meshed, conditions)


def _light_maps(reduced: ReducedPair, executor: Executor | None) -> tuple[FlankMap, FlankMap]:
    case = reduced.basis.case
    conditions = conditions_of(case, (LIGHT * case.torque_Nm,))
    sweep = sweep_reduced_pair(reduced, sweep_angles(case), conditions, executor, recorded=True)
    return flank_maps(reduced.meshed, sweep, 0)
