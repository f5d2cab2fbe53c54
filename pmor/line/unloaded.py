"""Transmission error without load: where rigid flanks touch.

The pinion stops where the first transverse section of any tooth pair closes: its advance is the lower envelope of those
of all sections. Contact of modified helical flanks moves over the face width as the gears turn: sections are closer
there than those of the line loads, and between them the advance is taken for a parabola, with the smaller of the
curvatures at both ends (minmod, as in ENO schemes; Harten et al., J. Comput. Phys. 71 (1987) 231). Where a line of
contact or a relief ends, the advance bends sharply, and a parabola through three sections would swing below the
envelope. Under ever smaller torques the loaded transmission error comes down to the envelope of its own sections.
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
# Of helical pairs, sections for each of the line loads': with reliefs of 10 to 40 um over four columns of elements the
# envelope is known to 0.1 um, and to 1.5 um from those of the line loads.
FINER = 8


def with_unloaded(sweep: SteSweep, meshed: MeshedPair, conditions: Sequence[Condition]) -> SteSweep:
    """Return a sweep with the transmission error without load beside the loaded one, where it is not zero.

    Parameters
    ----------
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
    """Return the transmission error of rigid flanks.

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
    z, helical = _places(meshed), meshed.pair.overlap_ratio > 0.0
    angles, advance = np.ascontiguousarray(phi, dtype=float), np.empty((len(assemblies), len(phi)))
    for start in range(0, len(angles), ANGLES_PER_BLOCK):
        block = slice(start, start + ANGLES_PER_BLOCK)
        places = place_flanks_of(meshed, angles[block], misalignment, z)
        for number, flanks in enumerate(deviations):
            removed = np.zeros_like(places.gap)
            if flanks is not None:
                line_deviations(places, z, *flanks, removed)
            closing = _touching_advance(places, removed).reshape(len(removed), -1, len(z))
            advance[number, block] = _envelope(z, closing) if helical else closing.min(axis=(1, 2))
    return np.asarray(1e3 * meshed.pair.pinion.base_radius * advance)


def _places(meshed: MeshedPair) -> FloatArray:
    """Sections in which rigid flanks are looked at, mm: those of the line loads on spur gears, whose contact stays."""
    z = sections_of(meshed).z
    return z if meshed.pair.overlap_ratio == 0.0 else np.linspace(*meshed.pair.common_face, FINER * len(z) + 1)


def _envelope(z: FloatArray, advance: FloatArray) -> FloatArray:
    """Least advance, (A,), over tooth pairs and over the face width, between sections too; `advance` is (A, P, S)."""
    lowest = advance.min(axis=(1, 2))
    with np.errstate(invalid="ignore"):
        slope = np.diff(advance) / np.diff(z)
        bend = 2.0 * np.diff(slope) / (z[2:] - z[:-2])
    # Between the inner sections: those at the ends of the face have no bend of their own.
    bend, slope, step = np.minimum(bend[..., 1:], bend[..., :-1]), slope[..., 1:-1], np.diff(z)[1:-1]
    inside = np.abs(slope) < 0.5 * bend * step  # false where sections never close
    middle = 0.5 * (advance[..., 1:-2] + advance[..., 2:-1])[inside]
    bend, slope, step = bend[inside], slope[inside], np.broadcast_to(step, inside.shape)[inside]
    np.minimum.at(lowest, np.nonzero(inside)[0], middle - 0.125 * bend * step**2 - 0.5 * slope**2 / bend)
    return np.asarray(lowest)


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
