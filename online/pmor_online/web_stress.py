"""Stress on webs from the line loads of a sweep: a linear map, then its largest values over the load cycle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from pmor.body.web_stress import WebStress
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.threads import one_thread
from pmor.gear.condition import Condition, common_misalignment
from pmor.results.root_stress import EDGES, FACES, WebCycle, WebCycles
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import ReducedPair
from pmor_online.root_cycle import unlike_teeth, whole_pitches
from pmor_online.root_stress import SENSE, nodal_forces

# Directions in the surface over half a turn, of which normal stresses have their ranges: two at 45 degrees are among
# them, and the range in the best of all directions is at most 1.8 % larger in a state of shear.
DIRECTIONS = 12
# Stresses are found for so many angles at a time.
ANGLES_PER_BLOCK = 8


@one_thread()
def web_stress(
    reduced: ReducedPair, phi: FloatArray, conditions: Sequence[Condition], executor: Executor | None = None
) -> tuple[WebCycles, WebCycles]:
    """Find the stress on the webs of pinion and wheel.

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
    two dict of str to WebCycle
        Faces, and edges of holes; empty where the basis has none. NaN of torques with a position that did not converge.
    """
    found = dict[str, WebCycle](), dict[str, WebCycle]()
    if not any(reduced.basis.web_stress):
        return found
    sweep = sweep_line_loads(reduced, phi, conditions, executor, recorded=True)
    assert sweep.states is not None
    loads, pair = sweep.states.loads, reduced.layered.pair
    if not len(loads.pair):
        return found
    pairs, misalignment = np.arange(loads.pair.min(), loads.pair.max() + 1), common_misalignment(conditions)
    teeth, pitches = (pair.pinion.teeth, pair.wheel.teeth), whole_pitches(phi, pair.pitch)
    known = [web for web in reduced.basis.web_stress if web is not None]
    period = math.lcm(*(len(web.moved) for web in known), *unlike_teeth(reduced))
    cycles = [
        _Cycle(web, count, pitches if pitches % period == 0 else 0, len(conditions)) if web else None
        for web, count in zip(reduced.basis.web_stress, teeth, strict=True)
    ]
    for start in range(0, len(phi), ANGLES_PER_BLOCK):
        block = slice(start, min(start + ANGLES_PER_BLOCK, len(phi)))
        forces = nodal_forces(reduced.lines, phi, misalignment, loads, block, pairs)
        for gear, cycle in enumerate(cycles):
            if cycle is not None:
                cycle.take(phi[block], forces[gear], pairs * SENSE[gear])
    turned = -1.0 if reduced.basis.case.flank == "coast" else 1.0  # that case is the image of its pair
    for gear, cycle in enumerate(cycles):
        if cycle is not None:
            cycle.forget(np.flatnonzero(~sweep.converged.all(axis=1)))
            found[gear].update(cycle.found(-gear * np.pi / teeth[gear], turned))
    return found


class _Cycle:
    """Largest and least stresses of one gear so far."""

    def __init__(self, web: WebStress, teeth: int, pitches: int, torques: int) -> None:
        self.web, self.teeth, self.whole = web, teeth, pitches > 0
        cells, points = web.moved.shape[1], len(web.places)
        # After these pitches cell c takes the place of another one, so many cells on.
        self.unlike = math.gcd(cells, pitches * cells // teeth) if self.whole else cells
        angle = np.pi / DIRECTIONS * np.arange(DIRECTIONS)
        shares = np.stack([np.cos(angle) ** 2, np.sin(angle) ** 2, np.sin(2.0 * angle)], axis=1)
        self.normal = np.einsum("pia,di->pda", web.stress, shares).reshape(points * DIRECTIONS, -1)
        self.surface = web.stress.transpose(1, 0, 2).reshape(3 * points, -1)
        self.most, self.least = (
            np.full((torques, self.unlike, points * DIRECTIONS), sign) for sign in (-np.inf, np.inf)
        )  # fmt: skip
        self.mises, self.phi = np.zeros((torques, self.unlike, points)), np.zeros((torques, self.unlike, points))

    def take(self, phi: FloatArray, force: FloatArray, loaded: IntArray) -> None:
        """Take the stress by forces (D, A, P, n) on loaded teeth at some angles."""
        amplitude = amplitudes_in_cells(self.web, force, loaded, self.teeth)
        torques, angles, cells, _ = amplitude.shape
        alike = torques, angles * cells // self.unlike, self.unlike
        normal = (amplitude @ self.normal.T).reshape(*alike, -1)
        np.maximum(self.most, normal.max(axis=1), out=self.most)
        np.minimum(self.least, normal.min(axis=1), out=self.least)
        one, two, shear = np.moveaxis((amplitude @ self.surface.T).reshape(*alike, 3, -1), 3, 0)
        mises = np.sqrt(one**2 + two**2 - one * two + 3.0 * shear**2)
        place = mises.argmax(axis=1)[:, None]
        mises, when = np.take_along_axis(mises, place, axis=1)[:, 0], phi.repeat(cells // self.unlike)[place[:, 0]]
        self.phi, self.mises = np.where(mises > self.mises, when, self.phi), np.maximum(mises, self.mises)

    def forget(self, failed: IntArray) -> None:
        """Leave no values of torques with a position that did not converge."""
        for part in (self.mises, self.most, self.least):
            part[failed] = np.nan

    def found(self, first: float, turned: float) -> WebCycles:
        """Return the largest values of each part; angles, rad, count from a first one on."""
        parts = {FACES: ~self.web.edge, EDGES: self.web.edge}
        return {name: self._of(own, first, turned) for name, own in parts.items() if own.any()}

    def _of(self, own: BoolArray, first: float, turned: float) -> WebCycle:
        torques, rows = len(self.mises), np.arange(len(self.mises))
        points = np.flatnonzero(own)
        mises, phi = (part[:, :, points].reshape(torques, -1) for part in (self.mises, self.phi))
        best = mises.argmax(axis=1)
        most, least = (
            part.reshape(torques, self.unlike, -1, DIRECTIONS)[:, :, points].reshape(torques, -1)
            for part in (self.most, self.least)
        )
        span = (most - least).argmax(axis=1)
        unknown = 1.0 if self.whole else np.nan
        high, low = unknown * most[rows, span], unknown * least[rows, span]
        place, range_place = (
            self._place(points[where % len(points)], where // len(points), first, turned)
            for where in (best, span // DIRECTIONS)
        )
        place[np.isnan(mises[rows, best])] = np.nan
        range_place[np.isnan(high)] = np.nan
        return WebCycle(mises[rows, best], phi[rows, best], place, high - low, high, low, range_place)

    def _place(self, point: IntArray, cell: IntArray, first: float, turned: float) -> FloatArray:
        radius, angle, z = self.web.places[point].T
        angle = turned * np.degrees(angle + first + 2.0 * np.pi / self.web.moved.shape[1] * cell)
        return np.stack([radius, angle % 360.0, z], axis=1)


def amplitudes_in_cells(web: WebStress, force: FloatArray, loaded: IntArray, teeth: int) -> FloatArray:
    """Amplitudes of the patterns of stress in all cells, (D, A, m, a), by forces (D, A, P, n) on loaded teeth."""
    felt = force @ web.pattern.T
    period, cells = web.moved.shape[:2]
    found = np.zeros((*felt.shape[:2], cells, web.moved.shape[2]))
    for source in np.flatnonzero(force.any(axis=(0, 1, 3))).tolist():
        tooth = int(loaded[source]) % teeth
        moved = np.roll(web.moved[tooth % period], tooth // period * cells * period // teeth, axis=0)
        found += np.tensordot(felt[:, :, source], moved, axes=(2, 2))
    return found
