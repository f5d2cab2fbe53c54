"""Range of the root stress of each tooth over its load cycle, while all teeth in mesh bend the rim below it.

Where it is largest is found between the points at which stresses are known, by the largest and the least ones at each.
These do not come at one time: the range is that of the stress at this place, followed over the cycle once more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pmor.body.root_stress import RootStressShapes
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.threads import one_thread
from pmor.gear.condition import Condition, Misalignment, common_misalignment
from pmor.gear.tooth import Tooth
from pmor.results.loads import ContactLoads
from pmor.results.root_stress import LoadCycle, RootStress, arc_lengths
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import ReducedPair
from pmor_online.root_stress import (
    ANGLES_PER_BLOCK,
    LoadedTeeth,
    amplitudes_by_flank,
    loaded_teeth,
    patterns_of_stress,
    place_on_fillet,
    root_stress_of,
    tooth_by_tooth,
)

# Of a pitch, by which the angles of a sweep may be off even ones over whole pitches.
EVEN = 1e-6


@one_thread()
def root_stress_and_cycles(
    reduced: ReducedPair, phi: FloatArray, conditions: Sequence[Condition], executor: Executor | None = None
) -> RootStress | None:
    """Find the stress along the root fillets, and the load cycles of all teeth; as `pmor_online.root_stress`."""
    if reduced.basis.root_stress is None:
        return None
    states = sweep_line_loads(reduced, phi, conditions, executor, recorded=True).states
    assert states is not None
    found = root_stress_of(reduced, phi, conditions, states.loads)
    assert found is not None
    return replace(found, cycle=load_cycles(reduced, phi, common_misalignment(conditions), states.loads))


def load_cycles(
    reduced: ReducedPair, phi: FloatArray, misalignment: Misalignment, loads: ContactLoads
) -> tuple[LoadCycle, LoadCycle] | None:
    """Return the load cycles of the teeth of pinion and wheel.

    Parameters
    ----------
    phi : ndarray, shape (A,)
        Pinion angles, rad.
    loads : ContactLoads
        At these angles.

    Returns
    -------
    two LoadCycle or None
        None where the angles are not even ones over as many whole pitches as the pair takes to repeat.
    """
    shapes, pair = reduced.basis.root_stress, reduced.layered.pair
    assert shapes is not None
    pitches = whole_pitches(phi, pair.pitch)
    period = math.lcm(*(shape.repeats for shape in shapes), *unlike_teeth(reduced))
    if pitches == 0 or pitches % period or not len(loads.pair):
        return None
    pairs = np.arange(loads.pair.min(), loads.pair.max() + 1)
    gears = [
        MeshingGear([(0, gear)], abs(tooth.teeth), [across_the_root(shape, tooth)], shape,
                    math.gcd(abs(tooth.teeth), pitches))
        for gear, (shape, tooth) in enumerate(zip(shapes, (pair.pinion, pair.wheel), strict=True))
    ]  # fmt: skip

    def blocks() -> Iterator[Block]:
        for start in range(0, len(phi), ANGLES_PER_BLOCK):
            block = slice(start, min(start + ANGLES_PER_BLOCK, len(phi)))
            lost = np.zeros((len(loads.count), block.stop - start), dtype=bool)
            yield lost, [loaded_teeth(reduced.lines, phi, misalignment, loads, block, pairs, shapes)]

    pinion, wheel = cycles_of(gears, blocks)
    return pinion, wheel


#: states that did not converge, (D, a), and the teeth of both gears of each mesh, for a block of angles
Block = tuple[BoolArray, Sequence[tuple[LoadedTeeth, LoadedTeeth]]]


class MeshingGear(NamedTuple):
    """A gear in its meshes.

    Attributes
    ----------
    uses : sequence of (int, int)
        Mesh, and side in it: 0 as pinion, 1 as wheel.
    teeth : int
    normal : sequence of ndarray
        Stress across its root by the amplitudes of each of these, as `across_the_root` gives it.
    shapes : RootStressShapes
    unlike : int
        Teeth that differ: the others repeat them.
    """

    uses: Sequence[tuple[int, int]]
    teeth: int
    normal: Sequence[FloatArray]
    shapes: RootStressShapes
    unlike: int

    def loaded(self, meshes: Sequence[tuple[LoadedTeeth, LoadedTeeth]]) -> list[LoadedTeeth]:
        """Return its teeth in each of its meshes."""
        return [meshes[mesh][side] for mesh, side in self.uses]


def cycles_of(
    gears: Sequence[MeshingGear], blocks: Callable[[], Iterator[Block]],
    first: Callable[[int, list[LoadedTeeth]], None] = lambda gear, loaded: None,
    then: Callable[[int, FloatArray], None] = lambda gear, stress: None,
) -> list[LoadCycle]:  # fmt: skip
    """Return the load cycle of the teeth of each gear, loads of all its meshes added up.

    Parameters
    ----------
    blocks : callable
        Gives all angles, block by block, each time that it is called.
    first, then : callable
        Called with the number of a gear and, of each block, its loaded teeth, or the stress at the places of its
        largest ranges, (D, a, T, 2), NaN where not converged.
    """
    everywhere, there = ([Extremes(gear.unlike) for gear in gears] for _ in range(2))
    for lost, meshes in blocks():
        for number, gear in enumerate(gears):
            loaded = gear.loaded(meshes)
            first(number, loaded)
            everywhere[number].add(_known(lost, stress_of_all_teeth(loaded, gear.normal, gear.teeth)))
    places = [places_of_ranges(gear.shapes, extremes) for gear, extremes in zip(gears, everywhere, strict=True)]
    for lost, meshes in blocks():
        for number, gear in enumerate(gears):
            weights = places[number].weights
            stress = _known(lost, stress_at_places(gear.loaded(meshes), gear.normal, weights, gear.teeth))
            there[number].add(stress)
            then(number, stress)
    return [place.cycle(extremes) for place, extremes in zip(places, there, strict=True)]


def _known(lost: BoolArray, stress: FloatArray) -> FloatArray:
    """Make stresses (D, a, ...) NaN where there is no solution: no load is none there."""
    stress[lost] = np.nan
    return stress


class Extremes:
    """Largest and least of what comes in, over angles and teeth that repeat each other; NaN does not count.

    Parameters
    ----------
    unlike : int
        Teeth that differ.
    """

    def __init__(self, unlike: int) -> None:
        self.unlike, self.most, self.least = unlike, np.array(np.nan), np.array(np.nan)

    def add(self, stress: FloatArray) -> None:
        """Take stresses (D, A, T, ...)."""
        alike = stress.reshape(*stress.shape[:2], -1, self.unlike, *stress.shape[3:])
        self.most = np.fmax(self.most, np.fmax.reduce(alike, axis=(1, 2)))
        self.least = np.fmin(self.least, np.fmin.reduce(alike, axis=(1, 2)))


def stress_of_all_teeth(loaded: Sequence[LoadedTeeth], normal: Sequence[FloatArray], teeth: int) -> FloatArray:
    """Return the normal stress across the root of all teeth of a gear, whichever carry, (D, A, T, 2, p, c), MPa.

    Parameters
    ----------
    loaded : sequence of LoadedTeeth
        Of all meshes of the gear.
    normal : sequence of ndarray, shape (2, p, c, s)
        For each of them, as `across_the_root` gives it.
    teeth : int
        Of the gear.
    """
    felt = _felt(loaded, teeth)
    rows = {id(one.shapes): own for one, own in zip(loaded, normal, strict=True)}
    stress = np.sum([
        amplitudes @ rows[id(shapes)].reshape(-1, amplitudes.shape[3]).T
        for shapes, amplitudes in amplitudes_by_flank(loaded, felt, teeth)
    ], axis=0)  # fmt: skip
    hidden = tooth_by_tooth(felt, [(one.teeth % teeth, one.hidden) for one in loaded])
    total = np.zeros((*stress.shape[:2], teeth, *normal[0].shape[:3]))
    total[:, :, felt] = stress.reshape(*stress.shape[:3], *normal[0].shape[:3]) * ~hidden[:, :, :, None]
    return total


def whole_pitches(phi: FloatArray, pitch: float) -> int:
    """Return the pitches that even angles span, 0 where they are not even or span no whole ones."""
    if len(phi) < 2:
        return 0
    step = (phi[-1] - phi[0]) / (len(phi) - 1)
    pitches = len(phi) * step / pitch
    even = np.abs(phi - phi[0] - step * np.arange(len(phi))).max() < EVEN * pitch
    return round(pitches) if even and abs(pitches - round(pitches)) < EVEN * len(phi) else 0


def unlike_teeth(reduced: ReducedPair) -> list[int]:
    """Return the tooth numbers of gears whose teeth differ by their flanks."""
    case = reduced.basis.case
    modified = (case.pinion_modification, case.pair.pinion), (case.wheel_modification, case.pair.wheel)
    return [gear.teeth for modification, gear in modified if modification.pitch_deviations_um]


def across_the_root(shapes: RootStressShapes, tooth: Tooth) -> FloatArray:
    """Normal stress across the root, perpendicular to the teeth's trace, by each amplitude, (2, p, c, s)."""
    along = np.gradient(shapes.section, arc_lengths(shapes.section), axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    # Of the trace: its part in the section, where its part along the axis is 1.
    trace = tooth.twist_per_length * shapes.section[:, ::-1] * [-1.0, 1.0]
    first = (trace * along).sum(axis=1)
    second = np.sqrt(1.0 + (trace**2).sum(axis=1) - first**2)
    one, two = second / np.hypot(first, second), -first / np.hypot(first, second)
    shares = np.stack([one**2, two**2, 2.0 * one * two], axis=1)
    return np.asarray(np.einsum("spctm,pt->spcm", patterns_of_stress(shapes), shares))


class Places(NamedTuple):
    """Where the range of the stress across the root is largest: D torques, U teeth that differ, both fillets.

    Attributes
    ----------
    weights : ndarray, shape (D, U, 2, p, c)
        Of the points of a fillet.
    radius, z : ndarray, shape (D, U, 2)
        mm.
    """

    weights: FloatArray
    radius: FloatArray
    z: FloatArray

    def cycle(self, extremes: Extremes) -> LoadCycle:
        """Return the load cycle between stresses at these places."""
        return LoadCycle(extremes.most - extremes.least, extremes.most, extremes.least, self.radius, self.z)


def places_of_ranges(shapes: RootStressShapes, extremes: Extremes) -> Places:
    """Return where ranges of stresses at all points are largest on each fillet."""
    span = extremes.most - extremes.least
    found = place_on_fillet(shapes, span.reshape(-1, *span.shape[2:]))
    weights, radius, z = (values.reshape(*span.shape[:2], *values.shape[1:]) for values in found)
    return Places(weights, radius, z)


def stress_at_places(
    loaded: Sequence[LoadedTeeth], normal: Sequence[FloatArray], weights: FloatArray, teeth: int
) -> FloatArray:
    """Return the stress that `stress_of_all_teeth` has, at one place of each fillet, (D, A, T, 2), MPa.

    Parameters
    ----------
    weights : ndarray, shape (D, U, 2, p, c)
        As in `Places`: of the teeth that differ, which the others repeat.
    """
    felt = _felt(loaded, teeth)
    which, nearest = felt % weights.shape[1], np.abs(weights).reshape(*weights.shape[:3], -1).argmax(axis=3)
    rows = {
        id(one.shapes): np.einsum("duepc,epcs->dues", weights, own) for one, own in zip(loaded, normal, strict=True)
    }
    stress = np.sum([
        np.einsum("dafs,dfes->dafe", amplitudes, rows[id(shapes)][:, which], optimize=True)
        for shapes, amplitudes in amplitudes_by_flank(loaded, felt, teeth)
    ], axis=0)  # fmt: skip
    hidden = tooth_by_tooth(felt, [(one.teeth % teeth, one.hidden) for one in loaded])
    there = np.take_along_axis(hidden.reshape(*hidden.shape[:3], -1), nearest[:, None, which], axis=3)
    total = np.zeros((*stress.shape[:2], teeth, 2))
    total[:, :, felt] = np.where(there, 0.0, stress)
    return total


def _felt(loaded: Sequence[LoadedTeeth], teeth: int) -> IntArray:
    """Teeth that any of the loaded ones reach."""
    reach = max(max(one.shapes.neighbours, one.shapes.rim_moved.shape[1] // 2) for one in loaded)
    numbers = np.concatenate([one.teeth for one in loaded])
    return np.unique((numbers[:, None] + np.arange(-reach, reach + 1)) % teeth)
