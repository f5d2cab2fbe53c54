"""The force of a mesh on both hubs wherever they stand, one position after the other, as motion asks for it.

The gaps are those of `pmor.line.hubs` with the displacements given: g_0 + L u + l advance + D F + delta(w). The wrench
on the hubs is L^T F.
"""

from __future__ import annotations

import math

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.core.keeping import entry_of
from pmor.gear.condition import Assembly
from pmor.line.hertz import WIDEST, mean_layer_constant
from pmor.line.hubs import axes_of
from pmor.line.kernels.flexibility import Flexibility
from pmor.line.kernels.hubs import ROWS, Contact, Placed, contact_of_hubs
from pmor.line.kernels.places import empty_lines
from pmor.line.pair import LinePair, no_results


class HubForce:
    """The exact force law of a pair by where both gears are; each position starts from the loads of the one before.

    Parameters
    ----------
    pair : LinePair
        Without a support. Of one half of the width tilts have no answer, and moments across the axes are those of it.
    assembly : Assembly
        Axes that displacements count from, and flanks.

    Attributes
    ----------
    overloaded : bool
        Whether contact of some section was ever too wide for the law (`pmor.line.hertz.WidthLimit`).
    """

    def __init__(self, pair: LinePair, assembly: Assembly) -> None:
        meshed = pair.meshed
        self._base_radius = pair.base_radius
        self._contact = Contact(
            axes_of(meshed.pair), meshed.kinematics(assembly.misalignment), meshed.gears, meshed.kernel_layers,
            meshed.deviations(assembly), assembly.modified, meshed.sections.z, meshed.width, meshed.tooth_pair_count,
            pair.components, meshed.expected_approach(1.0), pair.compliance, meshed.corners,
            0.25 * WIDEST**2 * math.exp(1.0 - 2.0 * mean_layer_constant(meshed)),
        )  # fmt: skip
        angles, size = 1, meshed.tooth_pair_count * len(meshed.width)
        self._placed = Placed(
            np.full(angles, np.nan), empty_lines(angles, size, pair.components), np.zeros((angles, size, ROWS)),
            np.zeros((angles, size)), np.zeros((angles, size)),
            Flexibility(np.zeros((angles, size, size)), np.zeros((angles, size), dtype=bool)),
            no_results(1, angles, size, meshed.tooth_pair_count, False), np.zeros(ROWS),
        )  # fmt: skip
        self._solve = entry_of(contact_of_hubs, self._contact, self._placed, 0.0, 0.0, np.zeros(ROWS))
        self.overloaded = False

    def at(self, phi: float, advance: float, displacement: FloatArray) -> FloatArray:
        """Return the forces and moments on pinion and wheel in axes of the pair, shape (12,), N and N mm.

        The next call overwrites them.

        Parameters
        ----------
        phi : float
            Kinematic angle of the pinion, to which the wheel is turned, rad.
        advance : float
            By which the pinion is ahead of it, rad.
        displacement : ndarray, shape (12,)
            Of both hubs, mm and rad, beside these rotations.

        Raises
        ------
        ConvergenceError
            Where contact was not found.
        """
        converged, overloaded = self._solve(self._contact, self._placed, phi, advance, displacement)
        if not converged:
            raise ConvergenceError(
                f"no equilibrium at a pinion angle of {math.degrees(phi):.6g} deg, an advance of "
                f"{1e3 * self._base_radius * advance:.6g} um along the line of action and displacements of the "
                f"hubs up to {1e3 * float(np.abs(displacement).max()):.3g} um or mrad"
            )
        self.overloaded |= overloaded
        return self._placed.wrench
