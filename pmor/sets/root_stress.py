"""Root stress of the gears of a set, from the line loads of all their meshes together.

A planet's teeth are loaded on one flank by the sun and on the other one by the ring. Stresses of both are added up in
the numbers of its own teeth, as those of several tooth pairs are (`pmor_online.root_stress`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pmor.body.root_stress import RootStressShapes, of_the_other_flank
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.threads import one_thread
from pmor.gear.condition import ALIGNED
from pmor.line.kernels.several import SeveralResults
from pmor.line.several import PlacedMesh, PlacedTrain
from pmor.results.loads import ContactLoads
from pmor.results.root_stress import LoadCycle
from pmor_online.line_sweep import contact_loads, levers_of
from pmor_online.root_cycle import across_the_root, load_cycle, stress_of_all_teeth
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
    """Root stress of a gear over its load cycle, under D torques, at A angles of a pitch of the first gear.

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
        Of one tooth, as all are alike: arrays (D, 1, 2).
    over_turn_MPa : ndarray, shape (D, T A)
        Stress across the root of one of the T teeth over a turn of the gear: on the side of the largest principal
        stress, where its range is largest.
    """

    mates: tuple[tuple[int, ...], tuple[int, ...]]
    max_principal_MPa: FloatArray
    side: IntArray
    radius_mm: FloatArray
    z_mm: FloatArray
    cycle: LoadCycle
    over_turn_MPa: FloatArray


class _Mesh(NamedTuple):
    """A mesh with its forces: tooth pairs that ever carry, and the shapes of both gears as it loads them."""

    placed: PlacedMesh
    phi: FloatArray
    loads: ContactLoads
    pairs: IntArray
    shapes: tuple[RootStressShapes, RootStressShapes]
    flipped: tuple[bool, bool]

    def teeth(self, gear: int) -> IntArray:
        """Numbers of the teeth of the tooth pairs on their body."""
        one = self.placed.mesh
        tooth = (one.pair.meshed.pair.pinion, one.pair.meshed.pair.wheel)[gear]
        numbers = one.first_tooth[gear] + SENSE[gear] * self.pairs
        return np.asarray((-numbers if self.flipped[gear] else numbers) % abs(tooth.teeth))


class _Gear(NamedTuple):
    """A body in its meshes, (mesh, gear), and the normal stress across its root by the amplitudes of each."""

    uses: list[tuple[int, int]]
    teeth: int
    normal: list[FloatArray]
    shapes: RootStressShapes


@one_thread()
def root_stress_of_set(placed: PlacedTrain, found: SeveralResults) -> tuple[GearStress, ...]:
    """Find the root stress of all bodies of a train, placed over a pitch of its first gear.

    None without shapes, or where teeth differ.

    Parameters
    ----------
    found : SeveralResults
        Of that train.
    """
    if any(body.root_stress is None or body.root_stress.repeats > 1 for body in placed.train.bodies):
        return ()
    meshes = [_mesh(placed, found, number) for number in range(len(placed.placed))]
    gears = [_gear(placed, meshes, number) for number in range(len(placed.train.bodies))]
    most, least = [np.array(-np.inf)] * len(gears), [np.array(np.inf)] * len(gears)
    tops: list[list[FloatArray]] = [[] for _ in gears]
    for loaded in _blocks(placed, meshes):
        for number, gear in enumerate(gears):
            own = [loaded[mesh][place] for mesh, place in gear.uses]
            tops[number].append(_tops(gear, own))
            stress = stress_of_all_teeth(own, gear.normal, gear.teeth)
            most[number] = np.maximum(most[number], stress.max(axis=(1, 2))[:, None])
            least[number] = np.minimum(least[number], stress.min(axis=(1, 2))[:, None])
    joined = [np.concatenate(parts, axis=2) for parts in tops]
    turns = _over_turns(placed, meshes, gears, [
        _on_side(high - low, top) for high, low, top in zip(most, least, joined, strict=True)
    ])  # fmt: skip
    parts = zip(gears, joined, most, least, turns, strict=True)
    return tuple(_gear_stress(meshes, found, *part) for part in parts)


def _mesh(placed: PlacedTrain, found: SeveralResults, number: int) -> _Mesh:
    one, bodies = placed.placed[number], placed.train.bodies
    pair, helical = one.mesh.pair, one.mesh.pair.meshed.pair.pinion.helix_angle != 0.0
    levers = levers_of(one.lines, found.movement @ placed.levers.ahead[number])
    force = found.force[..., one.part]
    loads = contact_loads(one.lines, pair.meshed.sections.z, levers, force, found.converged)
    # Of a mesh that nothing loads one tooth pair stands for all.
    pairs = np.arange(loads.pair.min(), loads.pair.max() + 1) if len(loads.pair) else np.zeros(1, dtype=np.int64)
    flipped, shapes = [], []
    for body, flank in zip(one.mesh.bodies, (pair.meshed.pinion, pair.meshed.wheel), strict=True):
        own = bodies[body].root_stress
        assert own is not None
        flipped.append(one.mesh.image != bodies[body].image)
        shapes.append(of_the_other_flank(own, helical, flank.nodes.shape[1]) if flipped[-1] else own)
    phi = one.mesh.start + one.mesh.rate * placed.phi
    return _Mesh(one, phi, loads, pairs, (shapes[0], shapes[1]), (flipped[0], flipped[1]))


def _gear(placed: PlacedTrain, meshes: Sequence[_Mesh], number: int) -> _Gear:
    uses = [
        (place, gear) for place, one in enumerate(meshes) for gear in range(2)
        if one.placed.mesh.bodies[gear] == number
    ]  # fmt: skip
    own = next((place, gear) for place, gear in uses if not meshes[place].flipped[gear])
    pair = meshes[own[0]].placed.mesh.pair.meshed.pair
    tooth = (pair.pinion, pair.wheel)[own[1]]
    normal = [across_the_root(meshes[place].shapes[gear], tooth) for place, gear in uses]
    shapes = placed.train.bodies[number].root_stress
    assert shapes is not None
    return _Gear(uses, abs(tooth.teeth), normal, shapes)


def _blocks(placed: PlacedTrain, meshes: Sequence[_Mesh]) -> Iterator[list[tuple[LoadedTeeth, ...]]]:
    """Teeth of both gears of each mesh, by the numbers of their bodies, for blocks of the angles."""
    angles = len(placed.phi)
    for start in range(0, angles, ANGLES_PER_BLOCK):
        block, found = slice(start, min(start + ANGLES_PER_BLOCK, angles)), []
        for one in meshes:
            pair = one.placed.mesh.pair
            both = loaded_teeth(pair, one.phi, ALIGNED, one.loads, block, one.pairs, one.shapes)
            found.append(tuple(teeth._replace(teeth=one.teeth(gear)) for gear, teeth in enumerate(both)))
        yield found


def _tops(gear: _Gear, loaded: Sequence[LoadedTeeth]) -> FloatArray:
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


def _on_side(span: FloatArray, tops: FloatArray) -> FloatArray:
    """Ranges (D, 1, 2, p, c) on the side of the largest principal stress under each torque, none on the other."""
    principal, sides = tops[:2]
    side = np.take_along_axis(sides, principal.argmax(axis=1)[:, None], axis=1)
    return np.where(np.arange(2) == side, 1.0, -1.0)[:, None, :, None, None] * span


def _over_turns(
    placed: PlacedTrain, meshes: Sequence[_Mesh], gears: Sequence[_Gear], spans: Sequence[FloatArray]
) -> list[FloatArray]:
    """Stress of one tooth of each gear where its range, (D, 1, 2, p, c), is largest, over a turn, (D, T A)."""
    found: list[list[FloatArray]] = [[] for _ in gears]
    for loaded in _blocks(placed, meshes):
        for number, (gear, span) in enumerate(zip(gears, spans, strict=True)):
            of_torques = []
            for torque, values in enumerate(span[:, 0]):
                side, point, column = (slice(i, i + 1) for i in np.unravel_index(int(values.argmax()), values.shape))
                own = [loaded[mesh][place] for mesh, place in gear.uses]
                at_point = [
                    one._replace(force=one.force[torque, None], hidden=one.hidden[torque, None, ..., point, column])
                    for one in own
                ]
                normal = [rows[side, point, column] for rows in gear.normal]
                of_torques.append(stress_of_all_teeth(at_point, normal, gear.teeth)[0, ..., 0, 0, 0])
            found[number].append(np.stack(of_torques))
    turns = []
    for gear, blocks in zip(gears, found, strict=True):
        mesh, place = gear.uses[0]
        # What a tooth pair feels now, the one before it feels a pitch later.
        sense = -SENSE[place] if meshes[mesh].flipped[place] else SENSE[place]
        in_order = np.concatenate(blocks, axis=1)[:, :, sense * np.arange(gear.teeth) % gear.teeth]
        turns.append(in_order.transpose(0, 2, 1).reshape(len(in_order), -1))
    return turns


def _gear_stress(
    meshes: Sequence[_Mesh], found: SeveralResults, gear: _Gear, tops: FloatArray, most: FloatArray,
    least: FloatArray, turn: FloatArray,
) -> GearStress:  # fmt: skip
    """Put the results of a gear together; NaN where not converged."""
    mates: tuple[list[int], list[int]] = ([], [])
    for mesh, place in gear.uses:
        mates[meshes[mesh].flipped[place]].append(meshes[mesh].placed.mesh.bodies[1 - place])
    unknown = ~np.all(found.converged, axis=1)
    most[unknown] = least[unknown] = np.nan
    principal, side, radius, z = tops
    principal = np.where(found.converged, principal, np.nan)
    turn = np.where(np.tile(found.converged, gear.teeth), turn, np.nan)
    return GearStress(
        (tuple(mates[0]), tuple(mates[1])), principal, side.astype(np.int64), radius, z,
        load_cycle(gear.shapes, most, least), turn,
    )  # fmt: skip
