"""Stress along the root fillets from the line loads of a sweep: a linear map, then principal stresses."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pmor.body.root_stress import RootStressShapes
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.threads import one_thread
from pmor.gear.condition import ALIGNED, PLAIN, Assembly, Condition, Misalignment, common_misalignment
from pmor.line.layered_pair import place_sections
from pmor.line.pair import LinePair
from pmor.pair.conditions import conditions_of_assembly
from pmor.results.loads import ContactLoads
from pmor.results.root_stress import FilletEnvelope, RootStress, arc_lengths
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import ReducedPair

# Points that are nearer to a line of contact, in modules, are left out: the load on a few nodes dominates there.
NEAR_CONTACT = 0.5
# Places over the width for each column, to which the largest stress is interpolated.
BETWEEN = 8
# Tooth pairs count counter-clockwise on the pinion, clockwise on the wheel.
SENSE = (1, -1)
# Stresses are found for so many angles at a time: few enough for those of all points to stay in megabytes.
ANGLES_PER_BLOCK = 25


class LoadedTeeth(NamedTuple):
    """Teeth of a gear under the line loads of one of its meshes: D torques, A angles, P tooth pairs.

    Attributes
    ----------
    shapes : RootStressShapes
        Of the gear, over forces on the flank that this mesh loads.
    teeth : ndarray of int, shape (P,)
        Their numbers, counter-clockwise.
    force : ndarray, shape (D, A, P, n)
        On the unknowns of the flanks, N.
    hidden : ndarray of bool, shape (D, A, P, p, c)
        Points so near to a line of contact that they show the load.
    """

    shapes: RootStressShapes
    teeth: IntArray
    force: FloatArray
    hidden: BoolArray


@one_thread()
def root_stress(
    reduced: ReducedPair, phi: FloatArray, conditions: Sequence[Condition], executor: Executor | None = None
) -> RootStress | None:
    """Find the stress along the root fillets of all loaded teeth.

    Parameters
    ----------
    phi : ndarray, shape (A,)
        Pinion angles, rad.
    conditions : sequence of Condition
        Torques with the same axes and flanks.
    executor : concurrent.futures.Executor, optional
        Of threads, for the line loads.

    Returns
    -------
    RootStress or None
        None where the basis has no root stress. Points near a line of contact do not count.
    """
    if reduced.basis.root_stress is None:
        return None
    states = sweep_line_loads(reduced, phi, conditions, executor, recorded=True).states
    assert states is not None
    return root_stress_of(reduced, phi, conditions, states.loads)


def root_stress_of(
    reduced: ReducedPair, phi: FloatArray, conditions: Sequence[Condition], loads: ContactLoads
) -> RootStress | None:
    """Find the stress along the root fillets from the line loads of all teeth; see `root_stress`."""
    shapes = reduced.basis.root_stress
    if shapes is None:
        return None
    loaded, (torques, angles) = loads.pair, (len(conditions), len(phi))
    pairs = np.arange(loaded.min(), loaded.max() + 1) if len(loaded) else np.empty(0, dtype=np.int64)
    size, tooth_counts = (torques, angles, 2, len(pairs), 2), _tooth_counts(reduced)
    found = [np.full(size, np.nan) for _ in range(4)]
    most = [[np.full((torques, 2, *shape.stress.shape[2:4]), 0.0) for _ in range(2)] for shape in shapes]
    for start in range(0, angles, ANGLES_PER_BLOCK):
        block = slice(start, min(start + ANGLES_PER_BLOCK, angles))
        misalignment = common_misalignment(conditions)
        both = loaded_teeth(reduced.lines, phi, misalignment, loads, block, pairs, shapes)
        for gear, (shape, one) in enumerate(zip(shapes, both, strict=True)):
            carries, *measures = stress_of_teeth((one,), one.teeth, tooth_counts[gear])
            for torque in range(torques):
                own = np.nonzero(carries)[0] == torque
                for kind, values in zip(most[gear], measures, strict=True):
                    kind[torque] = np.maximum(kind[torque], values[own].max(axis=0, initial=0.0))
            for whole, values in zip(found, _largest(shape, *measures), strict=True):
                whole[:, block, gear][carries] = values
    envelopes = [FilletEnvelope(shape.section, shape.z, *kinds) for shape, kinds in zip(shapes, most, strict=True)]
    swept = np.array([condition.torque_Nm for condition in conditions])
    principal, mises, radius, z = found
    return RootStress(
        np.asarray(phi, dtype=float), swept, pairs, principal, mises, radius, z, (envelopes[0], envelopes[1])
    )


def root_stress_causes(
    reduced: ReducedPair, phi: FloatArray, assembly: Assembly, torque_Nm: float, executor: Executor | None = None
) -> dict[str, tuple[float, float]]:
    """Find the largest root stress without what modifications and axes add, MPa.

    Returns
    -------
    dict of str to (float, float)
        Of pinion and wheel: ``root_stress_nominal_flanks_MPa`` with nominal flanks on aligned axes, and
        ``root_stress_aligned_axes_MPa`` with the flanks of the assembly; without those that are the assembly itself.
    """
    without = {"root_stress_nominal_flanks_MPa": PLAIN}
    if assembly.modified:
        without["root_stress_aligned_axes_MPa"] = replace(assembly, misalignment=ALIGNED)
    found = dict[str, tuple[float, float]]()
    for name, other in without.items():
        if other == assembly:
            continue
        stress = root_stress(reduced, phi, conditions_of_assembly(other, (torque_Nm,)), executor)
        both = [] if stress is None else [stress.largest(0, gear) for gear in range(2)]
        values = [one.max_principal_MPa for one in both if one is not None]
        if len(values) == 2:
            found[name] = values[0], values[1]
    return found


def _tooth_counts(reduced: ReducedPair) -> tuple[int, int]:
    pair = reduced.layered.pair
    return abs(pair.pinion.teeth), abs(pair.wheel.teeth)


def loaded_teeth(
    pair: LinePair, phi: FloatArray, misalignment: Misalignment, loads: ContactLoads, block: slice, pairs: IntArray,
    shapes: tuple[RootStressShapes, RootStressShapes],
) -> tuple[LoadedTeeth, LoadedTeeth]:  # fmt: skip
    """Return the teeth of pinion and wheel under the line loads at a block of the angles."""
    forces = nodal_forces(pair, phi, misalignment, loads, block, pairs)
    hidden = [under_contact(pair, shape, loads, block, pairs, gear) for gear, shape in enumerate(shapes)]
    pinion, wheel = map(LoadedTeeth, shapes, (pairs * sense for sense in SENSE), forces, hidden)
    return pinion, wheel


def nodal_forces(
    pair: LinePair, phi: FloatArray, misalignment: Misalignment, loads: ContactLoads, block: slice, pairs: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Forces on the unknowns of the flanks of pinion and wheel, each (D, A, P, n), N, equivalent to the line loads."""
    meshed, sections = pair.meshed, pair.meshed.sections
    lines = place_sections(meshed, np.ascontiguousarray(phi[block], dtype=float), misalignment, pair.components)
    torque, angle = np.divmod(np.repeat(np.arange(loads.count.size), loads.count.ravel()), loads.count.shape[1])
    here = np.flatnonzero((angle >= block.start) & (angle < block.stop))
    angle, section = angle[here] - block.start, loads.column[here]
    place = (loads.pair[here] - lines.first_pair[angle]) * len(sections.z) + section
    grid = len(loads.count), block.stop - block.start, len(pairs)
    state = np.ravel_multi_index((torque[here], angle, loads.pair[here] - pairs[0]), grid) if len(here) else here
    found = []
    for gear, flank in enumerate((meshed.pinion, meshed.wheel)):
        rows, columns = flank.nodes.shape[:2]
        components = pair.components
        force = loads.force_N[here, None] * lines.gradient[angle, place, gear]
        row = lines.row[angle, place, gear][:, None] + np.arange(force.shape[1] // components)
        column = sections.column[gear][section][:, None] + np.arange(sections.share[gear].shape[1])
        share = np.where(column < columns, sections.share[gear][section], 0.0)
        force = np.where((row >= 0)[..., None], force.reshape(*row.shape, components), 0.0)
        node = np.clip(row, 0, None)[:, :, None] * columns + np.minimum(column, columns - 1)[:, None, :]
        unknown = components * node[..., None] + np.arange(components)
        values = force[:, :, None, :] * share[:, None, :, None]
        size = rows * columns * components
        index = state[:, None, None, None] * size + unknown
        added = np.bincount(index.ravel(), values.ravel(), int(np.prod(grid)) * size)
        found.append(np.asarray(added, dtype=float).reshape(*grid, size))
    return found[0], found[1]


def under_contact(
    pair: LinePair, shapes: RootStressShapes, loads: ContactLoads, block: slice, pairs: IntArray, gear: int
) -> BoolArray:
    """Which points of a fillet are so near to a line of contact that they show the load, (D, A, P, p, c)."""
    tooth = (pair.meshed.pair.pinion, pair.meshed.pair.wheel)[gear]
    radius = NEAR_CONTACT * tooth.module
    states = loads.count.shape
    torque, angle = np.divmod(np.repeat(np.arange(loads.count.size), loads.count.ravel()), states[1])
    above = 0.5 * tooth.base_radius * (loads.roll_rad[:, gear] ** 2 - tooth.form_roll_angle**2)
    near = np.flatnonzero((above < radius) & (angle >= block.start) & (angle < block.stop))
    hidden = np.zeros((states[0], block.stop - block.start, len(pairs), len(shapes.section), len(shapes.z)), dtype=bool)
    along = above[near, None] + arc_lengths(shapes.section)
    across = loads.z_mm[near, None] - shapes.z
    close = np.hypot(along[:, :, None], across[:, None]) < radius
    np.logical_or.at(hidden, (torque[near], angle[near] - block.start, loads.pair[near] - pairs[0]), close)
    return hidden


def stress_of_teeth(
    loaded: Sequence[LoadedTeeth], felt: IntArray, teeth: int
) -> tuple[BoolArray, FloatArray, FloatArray]:
    """Return which of the teeth `felt` carry load, (D, A, F), and two measures of the stress in these m ones.

    Parameters
    ----------
    loaded : sequence of LoadedTeeth
        Of all meshes of a gear.
    felt : ndarray of int, shape (F,)
        By the numbers of the loaded teeth.
    teeth : int
        Of the gear.

    Returns
    -------
    carries : ndarray of bool, shape (D, A, F)
    principal, von_mises : ndarray, shape (m, 2, p, c)
        Largest principal stress and von Mises's, MPa; 0 under contact.
    """
    carries = tooth_by_tooth(felt, [(one.teeth, np.asarray(one.force.any(axis=3))) for one in loaded])
    hidden = tooth_by_tooth(felt, [(one.teeth, one.hidden) for one in loaded])[carries]
    of_flanks = [
        _stress(shapes, amplitudes[carries]) for shapes, amplitudes in amplitudes_by_flank(loaded, felt, teeth)
    ]
    principal, von_mises = (np.where(hidden[:, None], 0.0, values) for values in _measures(np.sum(of_flanks, axis=0)))
    return carries, principal, von_mises


def tooth_by_tooth(felt: IntArray, flags: Sequence[tuple[IntArray, BoolArray]]) -> BoolArray:
    """Sort flags of loaded teeth, (P,) and (D, A, P, ...), by the teeth `felt`, (D, A, F, ...)."""
    first = flags[0][1]
    found = np.zeros((*first.shape[:2], len(felt), *first.shape[3:]), dtype=bool)
    for numbers, given in flags:
        for column, number in enumerate(numbers.tolist()):
            found[:, :, felt == number] |= given[:, :, column, None]
    return found


def amplitudes_by_flank(
    loaded: Sequence[LoadedTeeth], felt: IntArray, teeth: int
) -> list[tuple[RootStressShapes, FloatArray]]:
    """Return the amplitudes of all meshes that share shapes, added up: those that load one side of a gear's teeth."""
    found: dict[int, tuple[RootStressShapes, FloatArray]] = {}
    for one in loaded:
        own = amplitudes_of_patterns(one.shapes, one.force, one.teeth, felt, teeth)
        before = found.get(id(one.shapes))
        found[id(one.shapes)] = one.shapes, own if before is None else before[1] + own
    return list(found.values())


def amplitudes_of_patterns(
    shapes: RootStressShapes, force: FloatArray, loaded: IntArray, felt: IntArray, teeth: int
) -> FloatArray:
    """Amplitudes of all patterns of stress in teeth `felt` by forces (D, A, P, n) on `loaded` ones, (D, A, F, s).

    Teeth are numbered counter-clockwise; s amplitudes are those of forces on the teeth around, then those by the rim.
    """
    own, on_rim = force @ shapes.pattern.T, force @ shapes.rim_pattern.T
    near, count = shapes.neighbours, own.shape[3]
    reach, by_rim = shapes.rim_moved.shape[1] // 2, (2 * near + 1) * count
    found = np.zeros((*own.shape[:2], len(felt), by_rim + shapes.rim_moved.shape[2]))
    for source in np.flatnonzero(force.any(axis=(0, 1, 3))).tolist():
        # Stress in a tooth by the load on the one that it is so many teeth ahead of.
        ahead = (felt - loaded[source] + teeth // 2) % teeth - teeth // 2
        for place, offset in enumerate(ahead.tolist()):
            if abs(offset) <= near:
                start = (offset + near) * count
                found[:, :, place, start : start + count] += own[:, :, source]
            if abs(offset) <= reach:
                moved = shapes.rim_moved[loaded[source] % shapes.repeats, offset + reach]
                found[:, :, place, by_rim:] += on_rim[:, :, source] @ moved.T
    return found


def patterns_of_stress(shapes: RootStressShapes) -> FloatArray:
    """Stress in the surface by each amplitude, (2, p, c, 3, s)."""
    near = np.moveaxis(shapes.stress, 0, -2)
    return np.concatenate([near.reshape(*near.shape[:-2], -1), shapes.rim_stress], axis=-1)


def _stress(shapes: RootStressShapes, amplitudes: FloatArray) -> FloatArray:
    """Stress in the surface of m teeth, (m, 2, p, c, 3), MPa."""
    patterns = patterns_of_stress(shapes)
    flat = amplitudes @ patterns.reshape(-1, patterns.shape[-1]).T
    return np.asarray(flat.reshape(len(amplitudes), *patterns.shape[:-1]))


def _measures(stress: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Largest principal stress and von Mises's of states of stress in a free surface, (m, 2, p, c)."""
    along, across, shear = np.moveaxis(stress, -1, 0)
    principal = 0.5 * (along + across) + np.hypot(0.5 * (along - across), shear)
    von_mises = np.sqrt(along**2 + across**2 - along * across + 3.0 * shear**2)
    return np.maximum(principal, 0.0), von_mises  # the third one, normal to the surface, is 0


def _largest(
    shapes: RootStressShapes, principal: FloatArray, von_mises: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Largest values at both fillets of m teeth, radius and z of the one that counts on each side, each (m, 2)."""
    (weights, arc, z), (mises_weights, mises_arc, mises_z) = (_peaks(shapes, of) for of in (principal, von_mises))
    peak, mises = (weights * principal).sum(axis=(2, 3)), (mises_weights * von_mises).sum(axis=(2, 3))
    compressed = np.array([False, True])
    arc, z = np.where(compressed, mises_arc, arc), np.where(compressed, mises_z, z)
    return peak, mises, _radius(shapes, arc), z


def place_on_fillet(shapes: RootStressShapes, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return where values (m, 2, p, c) are largest: weights of the points, (m, 2, p, c), radius and z, each (m, 2)."""
    weights, arc, z = _peaks(shapes, values)
    return weights, _radius(shapes, arc), z


def largest_on_fillet(shapes: RootStressShapes, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the largest of values (m, 2, p, c) at both fillets of m teeth, and radius and z of it, each (m, 2)."""
    weights, radius, z = place_on_fillet(shapes, values)
    return (weights * values).sum(axis=(2, 3)), radius, z


def _radius(shapes: RootStressShapes, arc: FloatArray) -> FloatArray:
    return np.interp(arc, arc_lengths(shapes.section), np.linalg.norm(shapes.section, axis=1))


def _peaks(shapes: RootStressShapes, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where values (m, 2, p, c) are largest: weights of the points, (m, 2, p, c), arc length and z, each (m, 2).

    It is at the top of each column, on a cubic spline through these. On the columns alone the largest stress would fall
    and rise while a line of contact moves from one to the next. *Measured*, helical pair on 8 elements, stress at the
    columns of nodes and between them: 0.8 % too low with columns alone, 0.7 % too high with the spline.
    """
    columns = values.swapaxes(2, 3)
    of_points, arcs = _tops(arc_lengths(shapes.section), columns)
    tops = (of_points * columns).sum(axis=3)
    z = shapes.z[0] + (shapes.z[-1] - shapes.z[0]) * np.linspace(0.0, 1.0, BETWEEN * (len(shapes.z) - 1) + 1)
    smooth = _spline(shapes.z, z)
    linear = np.stack([np.interp(z, shapes.z, column) for column in np.eye(len(shapes.z))], axis=1)
    whole = (tops > 0.0).all(axis=2)[..., None]  # a column of which nothing counts would bend the spline
    best = np.where(whole, tops @ smooth.T, tops @ linear.T).argmax(axis=2)
    of_columns = np.where(whole, smooth[best], linear[best])
    nearest = np.abs(z[:, None] - shapes.z).argmin(axis=1)[best][..., None]
    weights = (of_points * of_columns[..., None]).swapaxes(2, 3)
    return weights, np.take_along_axis(arcs, nearest, axis=2)[..., 0], z[best]


def _spline(x: FloatArray, places: FloatArray) -> FloatArray:
    """Values at places of the cubic splines that are 1 at one of x and 0 at the others, (places, x).

    Not-a-knot, in truncated powers. SciPy's is the same, to 1e-10 for 65 columns, and takes 0.15 s to import.
    """
    start, span = x[0], x[-1] - x[0]
    powers, knots = np.arange(min(len(x), 4)), (x[2:-2] - start) / span

    def terms(at: FloatArray) -> FloatArray:
        s = ((at - start) / span)[:, None]
        return np.hstack([s**powers, np.maximum(s - knots, 0.0) ** 3])

    return np.asarray(np.linalg.solve(terms(x).T, terms(places).T).T)


def _tops(x: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where values (..., p) are largest over x, by a parabola through three points that all count: weights, place."""
    points, place = len(x), values.argmax(axis=-1)
    first = np.clip(place - 1, 0, points - 3)
    x_of = [x[first + i] for i in range(3)]
    y = [np.take_along_axis(values, (first + i)[..., None], axis=-1)[..., 0] for i in range(3)]
    slope, further = (y[1] - y[0]) / (x_of[1] - x_of[0]), (y[2] - y[1]) / (x_of[2] - x_of[1])
    bend = (further - slope) / (x_of[2] - x_of[0])
    inside = (place > 0) & (place < points - 1) & (bend < 0.0) & (np.minimum(y[0], y[2]) > 0.0)
    middle = 0.5 * (x_of[0] + x_of[1]) - 0.5 * slope / np.where(inside, bend, 1.0)
    top, weights = np.where(inside, middle, x[place]), np.zeros(values.shape)
    for i, (one, two) in enumerate(((1, 2), (0, 2), (0, 1))):
        own = (top - x_of[one]) * (top - x_of[two]) / ((x_of[i] - x_of[one]) * (x_of[i] - x_of[two]))
        np.put_along_axis(weights, (first + i)[..., None], own[..., None], axis=-1)
    return weights, top
