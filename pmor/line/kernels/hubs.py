"""Wrenches of line contact on both hubs, and the contact of hubs that stand anywhere (`pmor.line.hubs`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.compiling import allocating, compiled
from pmor.gear.kernels.deviation import Deviation
from pmor.gear.kernels.types import Gear, Kinematics
from pmor.line.kernels.flexibility import Compliance, Flexibility
from pmor.line.kernels.law import load_at
from pmor.line.kernels.loads import WARM, solve_lines
from pmor.line.kernels.places import Lines, fill_lines, line_deviations
from pmor.line.kernels.tip_corner import stored_law
from pmor.line.kernels.types import Layer, LineResults, Meshes

ROWS = 12
# Turn of the gears within which sections stay placed, rad: a mesh force changes by less than the same share.
SAME = 1e-7


class Axes(NamedTuple):
    """Axes of a pair: centre distance, base radii of pinion and wheel, mm; tangent of the base helix angle."""

    centre_distance: float
    base_radius: float
    mate_base_radius: float
    tan_base_helix: float


class Contact(NamedTuple):
    """All that the line loads of a pair depend on beside its angles and the places of its hubs.

    Attributes
    ----------
    gears, layers, deviations : two of each
        Of pinion and wheel.
    modified : bool
        Whether there are deviations.
    z : ndarray, shape (S,)
        Of the sections, mm.
    meshes, compliance
        As in `solve_lines`.
    widest : float
        Half-width beyond which contact is too wide for the layer, over exp(opening) of a law.
    """

    axes: Axes
    kinematics: Kinematics
    gears: tuple[Gear, Gear]
    layers: tuple[Layer, Layer]
    deviations: tuple[Deviation, Deviation]
    modified: bool
    z: FloatArray
    meshes: Meshes
    compliance: Compliance
    widest: float


@compiled
def fill_hub_rows(lines, z, axes, rows):
    """Fill the wrenches on both hubs by a unit force in each section, shape (A, N, 12), N and N mm; 0 off the path."""
    sections = len(z)
    for i in range(rows.shape[0]):
        for n in range(rows.shape[1]):
            row = rows[i, n]
            if not np.isfinite(lines.gap[i, n]):
                for k in range(ROWS):
                    row[k] = 0.0
                continue
            lever, mate_lever = -lines.lever[i, n], lines.mate_lever[i, n]
            cosine = min(max((lever + mate_lever) / axes.centre_distance, -1.0), 1.0)
            sine = np.sqrt(1.0 - cosine**2)
            # From the tangent points of the line of action: on the pinion's base circle forwards, on the wheel's
            # backwards.
            along = axes.base_radius * lines.roll[i, n, 0]
            if abs(lever - axes.base_radius) > abs(mate_lever - axes.mate_base_radius):
                along = axes.centre_distance * sine - axes.mate_base_radius * lines.roll[i, n, 1]
            x, y = lever * sine - along * cosine, lever * cosine + along * sine
            _fill_wrench(row, 6, x, y - axes.centre_distance, z[n % sections], cosine, sine, axes.tan_base_helix)
            _fill_wrench(row, 0, x, y, z[n % sections], -cosine, -sine, -axes.tan_base_helix)


@compiled
def _fill_wrench(row, start, x, y, z, cosine, sine, tangent):
    row[start], row[start + 1], row[start + 2] = -cosine, sine, -tangent
    row[start + 3], row[start + 4] = -y * tangent - z * sine, x * tangent - z * cosine
    row[start + 5] = x * sine + y * cosine


class Placed(NamedTuple):
    """A position whose sections are placed, and the loads found there last: room that the next position takes over.

    Attributes
    ----------
    phi : ndarray, shape (1,)
        Pinion angle; NaN where nothing is placed.
    lines : Lines
        At one angle.
    rows : ndarray, shape (1, N, 12)
        Wrenches on both hubs by a unit force in each section.
    deviation, opening : ndarray, shape (1, N)
        Of the flanks, and with what displaced hubs add to it, mm.
    flexibility : Flexibility
    results : LineResults
        Of one advance.
    wrench : ndarray, shape (12,)
        Forces and moments on both hubs, N and N mm.
    """

    phi: FloatArray
    lines: Lines
    rows: FloatArray
    deviation: FloatArray
    opening: FloatArray
    flexibility: Flexibility
    results: LineResults
    wrench: FloatArray


@allocating
def contact_of_hubs(contact, placed, phi, advance, displacement):
    """Solve the line loads at one position whose hubs are displaced; warm from the position before.

    Sections stay placed while the gears turn by less than `SAME`: gaps are linear there.

    Parameters
    ----------
    contact : Contact
    placed : Placed
        Its results and its wrench are filled.
    phi, advance : float
        Kinematic angle of the pinion, to which the wheel is turned, and its own angle beyond that, rad.
    displacement : ndarray, shape (12,)
        Of both hubs, mm and rad, beside these rotations.

    Returns
    -------
    tuple of (bool, bool)
        Whether it converged, and whether some section is overloaded.
    """
    if not abs(phi - placed.phi[0]) <= SAME:
        _place(contact, placed, phi)
    axes, lines, rows, results, force = contact.axes, placed.lines, placed.rows[0], placed.results, placed.results.force
    size, meshes = lines.gap.shape[1], contact.meshes
    turned = phi - placed.phi[0]
    for n in range(size):
        opening = placed.deviation[0, n] - rows[n, 11] * axes.base_radius / axes.mate_base_radius * turned
        for k in range(ROWS):
            opening += rows[n, k] * displacement[k]
        placed.opening[0, n] = opening
    solve_lines(
        lines, lines.lever.reshape((1, size, 1)), meshes, contact.compliance, placed.flexibility, placed.opening,
        np.full((1, 1, 1), advance + turned), True, WARM, results,
    )  # fmt: skip
    overloaded, wrench = False, placed.wrench
    wrench[:] = 0.0
    for n in range(size):
        load = force[0, 0, n]
        if load > 0.0:
            law = stored_law(lines.law[0, n])
            overloaded |= load > load_at(contact.widest * np.exp(law.opening), law) * meshes.width[n]
            for k in range(ROWS):
                wrench[k] += load * rows[n, k]
    # Under a corner the lever turns with the advance.
    wrench[5] = -results.torque.sum()
    return results.converged[0, 0], overloaded


@allocating
def _place(contact, placed, phi):
    """Place the sections at an angle; the loads found last go with their tooth pairs."""
    lines, force, sections = placed.lines, placed.results.force[0, 0], len(contact.z)
    first, placed.phi[0] = lines.first_pair[0], phi
    lines.gradient[:] = 0.0
    fill_lines(lines, placed.phi, contact.kinematics, contact.gears, contact.layers, contact.z)
    fill_hub_rows(lines, contact.z, contact.axes, placed.rows)
    if contact.modified:
        line_deviations(lines, contact.z, contact.deviations[0], contact.deviations[1], placed.deviation)
    placed.flexibility.between[:] = 0.0
    placed.flexibility.ready[:] = False
    later = (lines.first_pair[0] - first) * sections
    if later != 0:
        before = force.copy()
        for n in range(len(force)):
            force[n] = before[n + later] if 0 <= n + later < len(force) else 0.0
