"""Root stress of the gears of a set, from the line loads of all their meshes together.

A planet's teeth are loaded on one flank by the sun and on the other one by the ring. Stresses of both are added up in
the numbers of its own teeth, as those of several tooth pairs are (`pmor_online.root_stress`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pmor.body.root_stress import RootStressShapes, of_the_other_flank
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.threads import one_thread
from pmor.gear.condition import ALIGNED
from pmor.line.kernels.types import LineResults
from pmor.line.several import LATER, WHOLE, PlacedMesh, PlacedTrain
from pmor.results.loads import ContactLoads
from pmor.results.root_stress import LoadCycle
from pmor_online.line_sweep import contact_loads, levers_of
from pmor_online.root_cycle import Block, MeshingGear, across_the_root, cycles_of
from pmor_online.root_stress import (
    ANGLES_PER_BLOCK,
    SENSE,
    LoadedTeeth,
    largest_on_fillet,
    loaded_teeth,
    stress_of_teeth,
)


@dataclass(frozen=True, eq=False)
class GearStress:
    """Root stress of a gear over its load cycle, under D torques, at all A angles of a set.

    Sides of a tooth are 0 and 1; `mates` says which meshes load the flank of each. NaN where not converged.

    Parameters
    ----------
    mates : (tuple of int, tuple of int)
        Bodies that press on the flank of each side.
    max_principal_MPa : ndarray, shape (D, A)
        Largest in any tooth that carries; 0 without load. Points near a line of contact do not count.
    side : ndarray of int, shape (D, A)
    radius_mm, z_mm : ndarray, shape (D, A)
        Where.
    cycle : LoadCycle
        Of the teeth that differ, (D, T, 2): those that a set without errors repeats with are one. Of the positions that
        converged; NaN where none did.
    turns : int
        Of the gear, after which a tooth meets the same again.
    over_turns_MPa : ndarray, shape (D, n)
        Stress across the root of the tooth with the largest range, over these turns: on the side of the largest
        principal stress, where the range is largest, between the limits of it.
    """

    mates: tuple[tuple[int, ...], tuple[int, ...]]
    max_principal_MPa: FloatArray
    side: IntArray
    radius_mm: FloatArray
    z_mm: FloatArray
    cycle: LoadCycle
    turns: int
    over_turns_MPa: FloatArray

    def worst_tooth(self, torque: int, side: int) -> int:
        """Return the tooth, among those that differ, whose range on a side is largest at a torque."""
        return int(np.argmax(self.cycle.range_MPa[torque, :, side]))


class _Mesh(NamedTuple):
    """A mesh: angles of its pinion, shapes of both gears as it loads them, and whether it loads their other flanks."""

    placed: PlacedMesh
    phi: FloatArray
    shapes: tuple[RootStressShapes, RootStressShapes]
    flipped: tuple[bool, bool]

    def teeth(self, gear: int, pairs: IntArray, later: int) -> IntArray:
        """Numbers, on their body, of the teeth of tooth pairs so many pitches later."""
        one = self.placed.mesh
        tooth = (one.pair.meshed.pair.pinion, one.pair.meshed.pair.wheel)[gear]
        numbers = one.first_tooth[gear] + SENSE[gear] * pairs + LATER[gear] * later
        return np.asarray((-numbers if self.flipped[gear] else numbers) % abs(tooth.teeth))


@one_thread()
def root_stress_of_set(placed: PlacedTrain, found: LineResults, pitches: int) -> tuple[GearStress, ...]:
    """Find the root stress of all bodies of a train; none without shapes.

    Parameters
    ----------
    placed : PlacedTrain
        Over a mesh cycle.
    found : LineResults
        Over one or several of these.
    pitches : int
        Of the first gear, in all.
    """
    if any(body.root_stress is None for body in placed.train.bodies):
        return ()
    flanks: dict[tuple[int, bool], RootStressShapes] = {}
    meshes = [_mesh(placed, one, flanks) for one in placed.placed]
    bodies = range(len(placed.train.bodies))
    gears, later = zip(*(_gear(placed, meshes, number, pitches) for number in bodies), strict=True)
    tops: list[list[FloatArray]] = [[] for _ in bodies]
    passed: list[list[FloatArray]] = [[] for _ in bodies]
    cycles = cycles_of(
        gears, lambda: _blocks(placed, meshes, found, pitches),
        lambda gear, loaded: tops[gear].append(_tops(gears[gear], loaded)),
        lambda gear, stress: passed[gear].append(stress),
    )  # fmt: skip
    return tuple(
        _gear_stress(meshes, found.converged, gear, shift, np.concatenate(top, axis=2), np.concatenate(stress, axis=1),
                     cycle)
        for gear, shift, top, stress, cycle in zip(gears, later, tops, passed, cycles, strict=True)
    )  # fmt: skip


def _mesh(placed: PlacedTrain, one: PlacedMesh, flanks: dict[tuple[int, bool], RootStressShapes]) -> _Mesh:
    """Return a mesh; meshes that load one side of a body's teeth share the shapes in `flanks`."""
    meshed, flipped, shapes = one.mesh.pair.meshed, [], []
    helical = meshed.pair.pinion.helix_angle != 0.0
    for number, flank in zip(one.mesh.bodies, (meshed.pinion, meshed.wheel), strict=True):
        body = placed.train.bodies[number]
        assert body.root_stress is not None
        flipped.append(one.mesh.image != body.image)
        if (number, flipped[-1]) not in flanks:
            other = body.other_stress or of_the_other_flank(body.root_stress, helical, flank.nodes.shape[1])
            flanks[number, flipped[-1]] = other if flipped[-1] else body.root_stress
        shapes.append(flanks[number, flipped[-1]])
    phi = one.mesh.start + one.mesh.rate * placed.phi
    return _Mesh(one, phi, (shapes[0], shapes[1]), (flipped[0], flipped[1]))


def _gear(placed: PlacedTrain, meshes: Sequence[_Mesh], number: int, pitches: int) -> tuple[MeshingGear, int]:
    """Return a body in its meshes, and by how much the number of a tooth in mesh changes over all that is solved.

    Teeth meet the same whose numbers differ by a multiple of those that differ.
    """
    uses = [
        (place, gear) for place, one in enumerate(meshes) for gear in range(2)
        if one.placed.mesh.bodies[gear] == number
    ]  # fmt: skip
    own, gear = next((place, gear) for place, gear in uses if not meshes[place].flipped[gear])
    pair = meshes[own].placed.mesh.pair.meshed.pair
    tooth = (pair.pinion, pair.wheel)[gear]
    normal = [across_the_root(meshes[place].shapes[side], tooth) for place, side in uses]
    cycles, teeth = placed.train.mesh_cycles(pitches)[own], abs(tooth.teeth)
    # Where the last mesh cycle is cut off, each tooth is what is solved of it.
    unlike = math.gcd(round(cycles), teeth) if abs(cycles - round(cycles)) < WHOLE else teeth
    return MeshingGear(uses, teeth, normal, meshes[own].shapes[gear], unlike), LATER[gear] * round(cycles)


def _blocks(placed: PlacedTrain, meshes: Sequence[_Mesh], found: LineResults, pitches: int) -> Iterator[Block]:
    """Yield for blocks of angles which states are lost, (D, a), and the loaded teeth of both gears of each mesh.

    A state is lost where it did not converge under a torque under which others did. Teeth have the numbers of their
    bodies.
    """
    lost = ~found.converged & found.converged.any(axis=1, keepdims=True)
    angles = len(placed.phi)
    cycles = found.converged.shape[1] // angles
    for cycle in range(cycles):
        at = slice(cycle * angles, (cycle + 1) * angles)
        own = LineResults._make(values[:, at] for values in found)
        later = np.rint(placed.train.mesh_cycles(cycle * pitches // cycles)).astype(int).tolist()
        loads = [_loads(placed, one, own, number) for number, one in enumerate(meshes)]
        for start in range(0, angles, ANGLES_PER_BLOCK):
            block, both = slice(start, min(start + ANGLES_PER_BLOCK, angles)), []
            for one, (load, pairs), shift in zip(meshes, loads, later, strict=True):
                sides = loaded_teeth(one.placed.mesh.pair, one.phi, ALIGNED, load, block, pairs, one.shapes)
                pinion, wheel = (side._replace(teeth=one.teeth(gear, pairs, shift)) for gear, side in enumerate(sides))
                both.append((pinion, wheel))
            yield lost[:, at][:, block], both


def _loads(placed: PlacedTrain, one: _Mesh, found: LineResults, number: int) -> tuple[ContactLoads, IntArray]:
    """Forces of a mesh by its number at the angles that a train is placed at, and the tooth pairs that ever carry."""
    levers = levers_of(one.placed.lines, found.movement @ placed.train.joined.ahead[number])
    z, force = one.placed.mesh.pair.meshed.sections.z, found.force[..., one.placed.part]
    loads = contact_loads(one.placed.lines, z, levers, force, found.converged)
    # Of a mesh that nothing loads one tooth pair stands for all.
    pairs = np.arange(loads.pair.min(), loads.pair.max() + 1) if len(loads.pair) else np.zeros(1, dtype=np.int64)
    return loads, pairs


def _tops(gear: MeshingGear, loaded: Sequence[LoadedTeeth]) -> FloatArray:
    """Largest principal stress at each angle, its side, radius and z, (4, D, a)."""
    felt = np.unique(np.concatenate([one.teeth for one in loaded]))
    carries, principal, _ = stress_of_teeth(loaded, felt, gear.teeth)
    sides = np.broadcast_to([0.0, 1.0], (*carries.shape, 2))
    values = [np.zeros((*carries.shape, 2)), sides, *(np.full((*carries.shape, 2), np.nan) for _ in range(2))]
    for whole, part in zip((values[0], *values[2:]), largest_on_fillet(gear.shapes, principal), strict=True):
        whole[carries] = part
    flat = [value.reshape(*carries.shape[:2], -1) for value in values]
    best = flat[0].argmax(axis=-1)[..., None]
    return np.stack([np.take_along_axis(value, best, axis=-1)[..., 0] for value in flat])


def _over_turns(gear: MeshingGear, later: int, tops: FloatArray, stress: FloatArray, cycle: LoadCycle) -> FloatArray:
    """Stress until a tooth meets the same again, of that with the largest range on a side under each torque, (D, n).

    The side is that of the largest principal stress, the place that of the range.
    """
    found = []
    for of_torque, ranges, (principal, sides) in zip(stress, cycle.range_MPa, tops[:2].swapaxes(0, 1), strict=True):
        side = int(sides[principal.argmax()])
        # What a tooth meets then, the one in the same place meets now.
        numbers = (ranges[:, side].argmax() - later * np.arange(gear.teeth // gear.unlike)) % gear.teeth
        found.append(of_torque[:, numbers, side].T.ravel())
    return np.stack(found)


def _gear_stress(
    meshes: Sequence[_Mesh], converged: BoolArray, gear: MeshingGear, later: int, tops: FloatArray, stress: FloatArray,
    cycle: LoadCycle,
) -> GearStress:  # fmt: skip
    """Put the results of a gear together; NaN where not converged."""
    mates: tuple[list[int], list[int]] = ([], [])
    for mesh, place in gear.uses:
        mates[meshes[mesh].flipped[place]].append(meshes[mesh].placed.mesh.bodies[1 - place])
    turns = _over_turns(gear, later, tops, stress, cycle)
    known = np.any(converged, axis=1)[:, None, None]
    cycle = LoadCycle(**{name: np.where(known, values, np.nan) for name, values in vars(cycle).items()})
    principal, side, radius, z = tops
    principal = np.where(converged, principal, np.nan)
    turns = np.where(np.tile(converged, gear.teeth // gear.unlike), turns, np.nan)
    return GearStress(
        (tuple(mates[0]), tuple(mates[1])), principal, side.astype(np.int64), radius, z,
        cycle, max(abs(later) // gear.unlike, 1), turns,
    )  # fmt: skip
