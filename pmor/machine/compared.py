"""Meshes of a gearbox beside the same pairs on rigid supports, and the stress at the roots of both.

Rigid supports do not depend on the load: all loads of a mesh are swept there at once. Hubs that give way move teeth as
rigid bodies, so that stress follows from the line loads alone (`pmor_online.root_stress`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from pmor.gear.condition import Condition
from pmor.line.several import GearTrain
from pmor.machine.coupled import RigidMesh, RootStresses, SolvedLoad, condition_of, swept_angles
from pmor.machine.coupled_sets import sets_on_rigid_supports
from pmor.results.root_stress import RootStress
from pmor.results.sweep import SteSweep
from pmor_online.model import ReducedPair
from pmor_online.root_stress import root_stress_of
from pmor_online.sweep import sweep_reduced_pair

# Angles of a pitch, at least, at which stress is found, of those that are swept. *Measured* on two helical pairs: the
# largest is up to 0.5 % below that of 200.
STRESS_ANGLES = 32


def with_rigid_supports(
    loads: Sequence[SolvedLoad], pairs: Mapping[str, ReducedPair], trains: Mapping[str, GearTrain], angles: int
) -> tuple[SolvedLoad, ...]:
    """Return solved loads with root stress, and with the same pairs and sets on rigid supports.

    Parameters
    ----------
    pairs : mapping of str to ReducedPair
        Of the meshes, by name.
    trains : mapping of str to GearTrain
        Of the planetary sets, by name.
    angles : int
        Of a pitch, in the sweeps.
    """
    found = list(loads)
    for number in range(len(loads[0].meshes) if loads else 0):
        meshes = [load.meshes[number] for load in loads]
        reduced = pairs[meshes[0].meshing.settings.name]
        conditions = [condition_of(reduced, mesh.torque) for mesh in meshes]
        sweep = sweep_reduced_pair(reduced, swept_angles(reduced, angles), conditions, recorded=True)
        stress = _largest(reduced, conditions, sweep)
        for row, (mesh, condition) in enumerate(zip(meshes, conditions, strict=True)):
            (own,) = _largest(reduced, [condition], mesh.sweep)
            before = found[row]
            solved = (*before.meshes[:number], mesh._replace(root_stress=own), *before.meshes[number + 1 :])
            rigid = (*before.rigid, RigidMesh(sweep, row, stress[row]))
            found[row] = replace(before, meshes=solved, rigid=rigid)
    names = [one.settings.name for one in loads[0].gearbox.sets] if loads else []
    by_set = [
        sets_on_rigid_supports([load.sets[number] for load in loads], trains[name]) for number, name in enumerate(names)
    ]
    return tuple(replace(load, sets=tuple(sets[row] for sets in by_set)) for row, load in enumerate(found))


def _largest(reduced: ReducedPair, conditions: Sequence[Condition], sweep: SteSweep) -> list[RootStresses]:
    """Largest root stress of pinion and wheel under each condition, MPa; none where the basis holds no root stress."""
    assert sweep.states is not None
    some = slice(None, None, max(len(sweep.phi_rad) // (STRESS_ANGLES * sweep.pitches), 1))
    stress = root_stress_of(reduced, sweep.phi_rad[some], conditions, sweep.states.loads.at_angles(some))
    return [None] * len(conditions) if stress is None else [_of_both(stress, i) for i in range(len(conditions))]


def _of_both(stress: RootStress, torque: int) -> RootStresses:
    pinion, wheel = (stress.largest(torque, gear) for gear in range(2))
    return None if pinion is None or wheel is None else (pinion.max_principal_MPa, wheel.max_principal_MPa)
