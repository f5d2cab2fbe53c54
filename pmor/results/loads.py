"""What a sweep of the reduced model knows beside STE and load sharing: amplitudes and contact forces."""

from __future__ import annotations

from dataclasses import dataclass

from pmor.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class ContactLoads:
    """Forces at the contact points of all states of a sweep, n of them, one state behind the other.

    Of line contact each is the resultant of a section's line load. Where half the width is meshed, each stands for its
    mirror image too, force and all.

    Attributes
    ----------
    first, count : (n_torques, n_angles) int
        Where the points of a state are; none where it did not converge.
    pair : (n,) int
        Tooth pair.
    slave : (n,) int
        Gear whose surface point it is: 0 pinion, 1 wheel.
    column : (n,) int
        Column of that gear's surface points along +z; column of nodes on exact flanks.
    force_N : (n,)
        Normal force.
    lever_mm, mate_lever_mm : (n,)
        ``-force lever`` is the point's share of the torque on the pinion, ``force mate_lever`` of that on the wheel.
    roll_rad : (n, 2)
        Roll angles on pinion and wheel.
    z_mm : (n,)
        From mid width.
    """

    first: IntArray
    count: IntArray
    pair: IntArray
    slave: IntArray
    column: IntArray
    force_N: FloatArray
    lever_mm: FloatArray
    mate_lever_mm: FloatArray
    roll_rad: FloatArray
    z_mm: FloatArray

    def of(self, torque_index: int, angle_index: int) -> slice:
        """Return where the points of a state are."""
        first = int(self.first[torque_index, angle_index])
        return slice(first, first + int(self.count[torque_index, angle_index]))


@dataclass(frozen=True)
class SweepStates:
    """The states behind a sweep.

    Attributes
    ----------
    lead_rad : (n_torques, n_angles)
        Rotation of the pinion ahead of where the unloaded flanks first touch; NaN where not converged.
    pair : (n_angles, P) int
        Tooth pairs in reach at each angle; those behind the last one are one below the first.
    amplitude : (n_torques, n_angles, P, slots)
        Of each shape that a pair can have (flank lines: the pinion's, then the wheel's), in the units of the basis; 0
        for shapes out of reach.
    loads : ContactLoads
    """

    lead_rad: FloatArray
    pair: IntArray
    amplitude: FloatArray
    loads: ContactLoads
