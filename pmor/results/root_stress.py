"""Stress along the root fillets over a sweep, and on webs over the load cycle: where and when it is largest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.shown import Columns, brief
from pmor.results.tabular import Tabular

GEARS = ("pinion", "wheel")
SIDES = ("tension", "compression")


def arc_lengths(section: FloatArray) -> FloatArray:
    """Arc length along points of a section, (p, 2), from the first one on, (p,)."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(section, axis=0), axis=1)))


class Largest(NamedTuple):
    """The largest root stress of a gear at one torque: where and when.

    Parameters
    ----------
    phi_rad : float
        Pinion angle.
    tooth : int
        Tooth pair.
    side : {"tension", "compression"}
    """

    max_principal_MPa: float
    phi_rad: float
    tooth: int
    side: str
    radius_mm: float
    z_mm: float


@brief
@dataclass(frozen=True, eq=False)
class FilletEnvelope:
    """Largest stresses along the fillets of one gear over the mesh cycle: D torques, p points, c columns.

    Attributes
    ----------
    section_mm : (p, 2)
        Points of the loaded side in the section z = 0, from the start of the involute to the middle of the tooth space.
    z_mm : (c,)
    max_principal_MPa, von_mises_MPa : (D, 2, p, c)
        On the side of the loaded flank, in tension, and on the other one.
    """

    section_mm: FloatArray
    z_mm: FloatArray
    max_principal_MPa: FloatArray
    von_mises_MPa: FloatArray

    @property
    def arc_mm(self) -> FloatArray:
        """Arc length along the fillet, from the start of the involute on, (p,)."""
        return arc_lengths(self.section_mm)


@brief
@dataclass(frozen=True, eq=False)
class LoadCycle:
    """Range of the stress across the root of each tooth, while all teeth take their turn in mesh: D torques, T teeth.

    The normal stress perpendicular to the teeth's trace in the surface of the fillet, of which the largest value less
    the least one over the cycle is largest at one point of each fillet: on the side of the loaded flank, and on the
    other one. Teeth that do not differ are one; else they are numbered counter-clockwise.

    Attributes
    ----------
    range_MPa, most_MPa, least_MPa : (D, T, 2)
        Largest range on each fillet, and the largest and the least stress there, whose difference it is.
    radius_mm, z_mm : (D, T, 2)
        Where.
    """

    range_MPa: FloatArray
    most_MPa: FloatArray
    least_MPa: FloatArray
    radius_mm: FloatArray
    z_mm: FloatArray

    def largest(self, torque: int) -> tuple[int, int]:
        """Return tooth and side of the largest range at a torque."""
        tooth, side = np.unravel_index(int(self.range_MPa[torque].argmax()), self.range_MPa.shape[1:])
        return int(tooth), int(side)


@brief
@dataclass(frozen=True, eq=False)
class RootStress(Tabular):
    """The largest stress at both fillets of each loaded tooth: D torques, A angles, 2 gears, P tooth pairs, 2 sides.

    Attributes
    ----------
    phi_rad : (A,)
    torque_Nm : (D,)
    pair_index : (P,) int
        Tooth pairs that ever carry load.
    max_principal_MPa, von_mises_MPa : (D, A, 2, P, 2)
        Largest on the fillet, on the side of the loaded flank and on the other one; NaN of teeth without load.
    radius_mm, z_mm : (D, A, 2, P, 2)
        Where: of the largest principal stress in tension, of von Mises's on the other side.
    envelope : two FilletEnvelope
        Of pinion and wheel.
    cycle : two LoadCycle or None
        Of pinion and wheel, where they were asked for and the sweep covers what repeats.
    """

    phi_rad: FloatArray
    torque_Nm: FloatArray
    pair_index: IntArray
    max_principal_MPa: FloatArray
    von_mises_MPa: FloatArray
    radius_mm: FloatArray
    z_mm: FloatArray
    envelope: tuple[FilletEnvelope, FilletEnvelope]
    cycle: tuple[LoadCycle, LoadCycle] | None = None

    def columns(self) -> Columns:
        """All of it by the names of columns, for `to_dataframe`: one for each position and loaded fillet."""
        place = np.nonzero(np.isfinite(self.max_principal_MPa))
        torque, angle, gear, pair, side = place
        return {
            "phi_rad": self.phi_rad[angle], "torque_Nm": self.torque_Nm[torque], "gear": np.array(GEARS)[gear],
            "tooth": self.pair_index[pair], "side": np.array(SIDES)[side],
            "max_principal_MPa": self.max_principal_MPa[place], "von_mises_MPa": self.von_mises_MPa[place],
            "radius_mm": self.radius_mm[place], "z_mm": self.z_mm[place],
        }  # fmt: skip

    def _shown(self) -> Columns:
        rows = [(torque, name, place) for t, torque in enumerate(self.torque_Nm) for g, name in enumerate(GEARS)
                if (place := self.largest(t, g))]  # fmt: skip
        return {
            "torque, N m": [torque for torque, _, _ in rows], "gear": [name for _, name, _ in rows],
            "largest, MPa": [place.max_principal_MPa for _, _, place in rows],
            "pinion angle, rad": [place.phi_rad for _, _, place in rows], "side": [place.side for _, _, place in rows],
            "radius, mm": [place.radius_mm for _, _, place in rows], "z, mm": [place.z_mm for _, _, place in rows],
        }  # fmt: skip

    def largest(self, torque: int, gear: int) -> Largest | None:
        """Return the largest principal stress of a gear over the cycle at a torque, by its place; None without load."""
        stress = self.max_principal_MPa[torque, :, gear]
        if not np.isfinite(stress).any():
            return None
        angle, pair, side = np.unravel_index(int(np.nanargmax(stress)), stress.shape)
        place = torque, angle, gear, pair, side
        return Largest(
            float(stress[angle, pair, side]), float(self.phi_rad[angle]), int(self.pair_index[pair]), SIDES[side],
            float(self.radius_mm[place]), float(self.z_mm[place]),
        )  # fmt: skip


#: parts of a web
FACES, EDGES = "web", "hole_edge"


@brief
@dataclass(frozen=True, eq=False)
class WebCycle:
    """Stress on the faces of a web, or at the edges of its holes, over the load cycle: D torques.

    Places are radius, mm, angle, degrees, and z, mm. Angles count from the line from the gear's centre to its mate's,
    counter-clockwise seen from +z, at pinion angle 0, as `first_deg` of holes does. Where nothing makes teeth differ
    they are places of one tooth's sector, and all sectors are alike.

    Attributes
    ----------
    von_mises_MPa : (D,)
        Largest of all points at all angles.
    phi_rad : (D,)
        Pinion angle at which it is.
    place : (D, 3)
        Where it is.
    range_MPa : (D,)
        Largest less least normal stress in one direction in the surface, largest over points and directions; NaN where
        the angles do not cover what repeats.
    most_MPa, least_MPa : (D,)
        Of this point and direction.
    range_place : (D, 3)
        Where it is.
    """

    von_mises_MPa: FloatArray
    phi_rad: FloatArray
    place: FloatArray
    range_MPa: FloatArray
    most_MPa: FloatArray
    least_MPa: FloatArray
    range_place: FloatArray


#: of one gear, by the parts that it has; none of gears without a web, or where it was not asked for
WebCycles = dict[str, WebCycle]
