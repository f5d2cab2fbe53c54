"""States of a reduced sweep beside STE and load sharing: amplitudes and contact forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.shown import brief


@brief
@dataclass(frozen=True, eq=False)
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

    def at_angles(self, angles: slice) -> ContactLoads:
        """Return the forces at some of the angles."""
        first, count = self.first[:, angles], self.count[:, angles]
        after = np.cumsum(count.ravel())
        begin = after - count.ravel()
        points = np.arange(after[-1] if len(after) else 0) + np.repeat(first.ravel() - begin, count.ravel())
        chosen = {item.name: getattr(self, item.name)[points] for item in fields(self)[2:]}
        return ContactLoads(first=begin.reshape(count.shape), count=count, **chosen)


@brief
@dataclass(frozen=True, eq=False)
class LineStates:
    """Line contact in all states of a sweep: D torques, A angles, P tooth pairs, S sections over the width.

    Where half the width is meshed, sections stand for their mirror images too: these have the same line load. A state
    that did not converge carries nothing here.

    Attributes
    ----------
    pair : (A, P) int
        Tooth pairs.
    z_mm, width_mm : (S,)
        Where the sections are, from mid width of the pair, and the width that each stands for, without its image.
    mirrored : bool
        Whether they have images.
    converged : (D, A) bool
    roll_rad : (A, P, S, 2)
        Roll angles on pinion and wheel at which the undeformed flanks meet.
    load_N_per_mm : (D, A, P, S)
        Force along the transverse line of action per face width: also that along the inclined line of contact per
        length of it, normal to the flanks.
    half_width_mm : (D, A, P, S)
        Half of the width of contact, Hertz's b.
    offset_mm : (D, A, P, S)
        By how far its middle lies towards the tip of the pinion from where the undeformed flanks meet: not 0 where an
        edge at a tip is in contact.
    pressure_MPa : (D, A, P, S)
        Largest over the width of contact; NaN where a sharp edge is in contact, at which it has no bound.
    lever_mm : (D, A, P, S)
    mate_lever_mm : (A, P, S)
        Levers of the force, as in `ContactLoads`.
    sensitivity : (D, A, P, S)
        Derivative of the STE by the deviation of the section (both flanks together, its image too), um/um; empty of
        meshes that are solved with others.
    """

    pair: IntArray
    z_mm: FloatArray
    width_mm: FloatArray
    mirrored: bool
    converged: BoolArray
    roll_rad: FloatArray
    load_N_per_mm: FloatArray
    half_width_mm: FloatArray
    offset_mm: FloatArray
    pressure_MPa: FloatArray
    lever_mm: FloatArray
    mate_lever_mm: FloatArray
    sensitivity: FloatArray

    @property
    def images(self) -> int:
        """Sections that each stands for."""
        return 2 if self.mirrored else 1

    @property
    def force_N(self) -> FloatArray:
        """Force of each section, with its image's, along the transverse line of action, (D, A, P, S)."""
        return np.asarray(self.load_N_per_mm * (self.images * self.width_mm))


def together(parts: Sequence[LineStates]) -> LineStates:
    """Return line contact at the same angles under the torques of all parts, one behind the other."""
    of_torques = ("converged", "load_N_per_mm", "half_width_mm", "offset_mm", "pressure_MPa", "lever_mm", "sensitivity")
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in of_torques}
    return replace(parts[0], **arrays)  # type: ignore[arg-type]


@brief
@dataclass(frozen=True, eq=False)
class SweepStates:
    """The states behind a sweep.

    Attributes
    ----------
    advance_rad : (n_torques, n_angles)
        Rotation of the pinion ahead of where plain flanks on aligned axes touch; NaN where not converged.
    pair : (n_angles, P) int
        Tooth pairs that can touch at each angle; those behind the last one are one below the first.
    amplitude : (n_torques, n_angles, P, slots)
        Of each shape that a pair can have (flank lines: the pinion's, then the wheel's), in the units of the basis; 0
        for shapes that are not active.
    lines : LineStates or None
        Of line loads as unknowns; None of other models.
    """

    advance_rad: FloatArray
    pair: IntArray
    amplitude: FloatArray
    loads: ContactLoads
    lines: LineStates | None = None
