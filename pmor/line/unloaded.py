"""Transmission error without load: where rigid flanks touch.

Of all sections of all tooth pairs that can touch the one that closes first stops the pinion: its advance is the lower
envelope of theirs. Under ever smaller torques the loaded transmission error comes down to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.condition import PLAIN, Assembly, Condition, common_misalignment
from pmor.gear.meshed_pair import MeshedPair
from pmor.line.kernels.places import Places, line_deviations
from pmor.line.layered_pair import place_flanks_of, sections_of
from pmor.results.sweep import SteSweep

# Sections are placed for so many angles at a time: their arrays stay within megabytes.
ANGLES_PER_BLOCK = 500


def with_unloaded(sweep: SteSweep, meshed: MeshedPair, conditions: Sequence[Condition]) -> SteSweep:
    """Return a sweep with the transmission error without load beside the loaded one, where it is not zero.

    Parameters
    ----------
    sweep : SteSweep
    meshed : MeshedPair
    conditions : sequence of Condition
        Those of the sweep, with the same axes.
    """
    assemblies = [condition.assembly for condition in conditions]
    if all(one == PLAIN for one in assemblies):
        return sweep
    different = list(dict.fromkeys(assemblies))
    found = dict(zip(different, unloaded_ste_um(meshed, sweep.phi_rad, different), strict=True))
    return replace(sweep, unloaded_um=np.stack([found[one] for one in assemblies]))


def unloaded_ste_um(meshed: MeshedPair, phi: FloatArray, assemblies: Sequence[Assembly]) -> FloatArray:
    """Return the transmission error of rigid flanks, of the sections in which line contact is evaluated.

    Parameters
    ----------
    meshed : MeshedPair
        Of any contact scheme: its flanks are taken for the involutes that they stand for.
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    assemblies : sequence of Assembly
        How the pair is built, m times, with the same axes.

    Returns
    -------
    ndarray, shape (m, n)
        um along the line of action, from where the loaded one counts.
    """
    misalignment = common_misalignment(assemblies)
    deviations = [meshed.deviations(one) if one.modified else None for one in assemblies]
    z = sections_of(meshed).z
    angles, advance = np.ascontiguousarray(phi, dtype=float), np.empty((len(assemblies), len(phi)))
    for start in range(0, len(angles), ANGLES_PER_BLOCK):
        block = slice(start, start + ANGLES_PER_BLOCK)
        places = place_flanks_of(meshed, angles[block], misalignment, z)
        for number, flanks in enumerate(deviations):
            removed = np.zeros_like(places.gap)
            if flanks is not None:
                line_deviations(places, z, *flanks, removed)
            advance[number, block] = _touching_advance(places, removed).min(axis=1)
    return np.asarray(1e3 * meshed.pair.pinion.base_radius * advance)


def _touching_advance(places: Places, removed: FloatArray) -> FloatArray:
    """Advance at which each section closes, (A, N), rad; infinite where it never does.

    Under the pinion's corner the lever turns with the advance, and the gap is a parabola.
    """
    advance, near = np.full(places.gap.shape, np.inf), np.isfinite(places.gap)
    gap, lever = places.gap[near] + removed[near], places.lever[near]
    slope, corner = places.lever_slope[near], places.corner_advance[near]
    straight, at_corner = gap / -lever, gap + lever * corner
    root = lever**2 - 2.0 * slope * at_corner
    turned = corner + 2.0 * at_corner / (np.sqrt(np.maximum(root, 0.0)) - lever)
    advance[near] = np.where(straight <= corner, straight, np.where(root >= 0.0, turned, np.inf))
    return advance
