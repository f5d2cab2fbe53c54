"""Kinematics of a pair of involute gears: working geometry, contact ratio, where each tooth pair touches.

Source: ISO 21771:2007; derivation of the frames in `pmor.core.conventions`. Transverse quantities
hold in the section z = 0.
The section at z of a helical pair is the same spur pair at another roll position (`GearPair.section_roll_position`), so
that over the face width a tooth pair comes into mesh earlier at one end and leaves it later at the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.errors import GeometryError
from pmor.gear.involute import inverse_involute, involute_function
from pmor.gear.tip_edge import TipEdge, tip_edge
from pmor.gear.tooth import Tooth

# Modules by which a centre distance may be tighter than without backlash: profile shifts on drawings are rounded.
ROUNDING = 1e-4
# Pitches by which tooth pairs are counted beyond where they can touch: more than round-off of `touching_pairs`, and of
# the kernel that cuts windows, can add.
ROUND_OFF_PITCHES = 1e-9
# Hundredths of a module by which addenda are thought raised, to find how much a contact ratio lacks.
MOST_RAISED = 100


@dataclass(frozen=True)
class GearPair:
    """A pinion and a wheel on parallel axes.

    Where a tip would reach below the mate's form circle the path of contact ends at the form circle. Whether tips clear
    roots and fillets, `pmor.gear.clearance` says.

    Parameters
    ----------
    pinion, wheel : Tooth
        Of one module and pressure angle (taken on trust) and opposite helix angles: a right-handed pinion, with a
        positive helix angle, meshes with a left-handed wheel. An internal wheel has negative teeth and radii, and is
        right-handed with a negative helix angle.
    face_width : float
        Face width of both gears unless given separately; reference length of misalignments, mm.
    centre_distance : float
        Distance of the axes, mm; negative of an internal pair.
    pinion_face, wheel_face : (float, float), optional
        Where a gear's face begins and ends along z, mm; by default the face width, half of it on either side of z = 0.
    pinion_edge, wheel_edge : TipEdge, optional
        Where the gears' flanks end towards the tip; by default at the tip circle.

    Raises
    ------
    GeometryError
        When the flanks cannot mesh: below the sum of the base radii, teeth that jam, a total contact ratio below 1,
        helix angles that are not opposite, or faces beside each other.
    """

    pinion: Tooth
    wheel: Tooth
    face_width: float
    centre_distance: float
    pinion_face: tuple[float, float] | None = None
    wheel_face: tuple[float, float] | None = None
    pinion_edge: TipEdge | None = None
    wheel_edge: TipEdge | None = None

    def __post_init__(self) -> None:
        if abs(self.pinion.helix_angle + self.wheel.helix_angle) > 1e-12:
            raise GeometryError(
                f"helix angles {math.degrees(self.pinion.helix_angle):g} and {math.degrees(self.wheel.helix_angle):g} "
                "deg: on parallel axes they must be opposite: give one of them the other sign"
            )
        if self.common_width <= 0.0:
            (low_1, high_1), (low_2, high_2) = self.faces
            raise GeometryError(
                f"faces from z = {low_1:g} to {high_1:g} mm and from {low_2:g} to {high_2:g} mm: lie beside each "
                "other: move one of them (face_offset_mm), or widen it"
            )
        drawn, inside = abs(self.centre_distance), self.wheel.internal
        if self.centre_distance / self.base_distance < 1.0:
            raise GeometryError(
                f"centre_distance_mm = {drawn:g}: below the {'difference' if inside else 'sum'} of the base radii "
                f"{abs(self.base_distance):.6g} mm; raise it"
            )
        tightest = self.least_centre_distance
        if self.centre_distance < tightest - ROUNDING * self.pinion.module:
            side, remedy = ("above", "lower") if inside else ("below", "raise")
            raise GeometryError(
                f"centre_distance_mm = {drawn:g}: the teeth jam {side} {abs(tightest):.6g} mm (no backlash); "
                f"{remedy} it or reduce the profile shifts"
            )
        if self.contact_ratio <= 0.0 or self.total_contact_ratio < 1.0:
            raise GeometryError(
                f"contact ratio {min(self.contact_ratio, self.total_contact_ratio):.3f} is below 1: "
                f"{self._longer_path()}"
            )

    def _longer_path(self) -> str:
        """Return what lengthens the path of contact to a contact ratio of 1."""
        raised = np.arange(1, MOST_RAISED + 1) * 0.01
        reached = np.full(MOST_RAISED, -self.action_length)
        for tooth in (self.pinion, self.wheel):
            tips = tooth.tip_radius + raised * tooth.module
            reached = reached + np.copysign(np.sqrt(np.maximum(tips**2 - tooth.base_radius**2, 0.0)), tooth.base_radius)
        enough = np.asarray(reached / self.pinion.base_pitch + self.overlap_ratio) >= 1.0
        nearer = f"{'raise' if self.wheel.internal else 'reduce'} centre_distance_mm, "
        tight = abs(self.centre_distance - self.least_centre_distance) <= ROUNDING * self.pinion.module
        by = f" by {raised[enough][0]:.2g} or more" if enough.any() else ""
        return f"{'' if tight else nearer}raise [pinion] addendum and [wheel] addendum{by}"

    @property
    def base_distance(self) -> float:
        """Sum of the base radii, mm."""
        return self.pinion.base_radius + self.wheel.base_radius

    @property
    def least_centre_distance(self) -> float:
        """Centre distance below which the teeth jam, mm."""
        return tight_centre_distance(self.pinion, self.wheel)

    @cached_property
    def working_pressure_angle(self) -> float:
        """Transverse pressure angle at the working pitch circles, rad."""
        return math.acos(self.base_distance / self.centre_distance)

    @property
    def backlash(self) -> float:
        """Backlash of the drawing along the transverse line of action, mm (ISO 21771, 6.3: j_bt)."""
        tightest = tight_centre_distance(self.pinion, self.wheel)
        return max(transverse_backlash(self.base_distance, tightest, self.centre_distance), 0.0)

    @cached_property
    def action_length(self) -> float:
        """Distance between the tangent points of the line of action on the base circles, mm."""
        return self.centre_distance * math.sin(self.working_pressure_angle)

    @property
    def pitch(self) -> float:
        """Pinion rotation per mesh cycle, rad."""
        return self.pinion.angular_pitch

    @cached_property
    def pinion_roll_range(self) -> tuple[float, float]:
        """Roll angles at the start and the end of the pinion's active profile, rad."""
        pinion, wheel = self.tip_edges
        start = max(self._mate_roll(wheel.roll_angle), self.pinion.form_roll_angle)
        end = min(pinion.roll_angle, self._mate_roll(self.wheel.form_roll_angle))
        return start, end

    @cached_property
    def active_rolls(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Roll angles at which the active profiles of pinion and wheel start and end, rad."""
        start, end = self.pinion_roll_range
        first, last = (float(self.contact_roll_angles(np.array(self.roll_position(u)))[1]) for u in (end, start))
        return (start, end), (first, last)

    @cached_property
    def contact_ratio(self) -> float:
        """Transverse contact ratio."""
        start, end = self.pinion_roll_range
        return self.pinion.base_radius * (end - start) / self.pinion.base_pitch

    @cached_property
    def faces(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Where the faces of pinion and wheel begin and end along z, mm."""
        middle = -0.5 * self.face_width, 0.5 * self.face_width
        return self.pinion_face or middle, self.wheel_face or middle

    @cached_property
    def tip_edges(self) -> tuple[TipEdge, TipEdge]:
        """Where the flanks of pinion and wheel end towards the tip."""
        return self.pinion_edge or tip_edge(self.pinion), self.wheel_edge or tip_edge(self.wheel)

    @cached_property
    def common_face(self) -> tuple[float, float]:
        """First and last z at which both gears have teeth, mm."""
        (low_1, high_1), (low_2, high_2) = self.faces
        return max(low_1, low_2), min(high_1, high_2)

    @property
    def common_width(self) -> float:
        """Face width that both gears share, mm."""
        low, high = self.common_face
        return high - low

    @property
    def base_helix_angle(self) -> float:
        """Helix angle of the pinion at its base cylinder, rad; the wheel has the opposite one."""
        return math.atan(self.pinion.base_radius * self.pinion.twist_per_length)

    @property
    def overlap_ratio(self) -> float:
        """Common face width times tan(base helix angle) over the base pitch; 0 for spur gears."""
        return self.common_width * math.tan(abs(self.base_helix_angle)) / self.pinion.base_pitch

    @property
    def total_contact_ratio(self) -> float:
        """Transverse contact ratio and overlap ratio together: tooth pairs in mesh on average."""
        return self.contact_ratio + self.overlap_ratio

    @property
    def most_touching_pairs(self) -> int:
        """Largest number of tooth pairs that can touch together, up to half a pitch beyond the path of contact."""
        return math.floor(self.total_contact_ratio + 1.0 + ROUND_OFF_PITCHES) + 1

    @property
    def neighbouring_teeth(self) -> int:
        """How many neighbouring teeth can be loaded together with a tooth, contact beyond the path counted."""
        return self.most_touching_pairs - 1

    @property
    def pitch_point_radius(self) -> float:
        """Relative radius of curvature of the flanks at the pitch point, mm."""
        tangent = math.tan(self.working_pressure_angle)
        return tangent / (1.0 / self.pinion.base_radius + 1.0 / self.wheel.base_radius)

    @cached_property
    def roll_position_range(self) -> tuple[float, float]:
        """Roll positions at which the section z = 0 of a tooth pair enters and leaves the path of contact, rad."""
        start, end = self.pinion_roll_range
        return self.roll_position(start), self.roll_position(end)

    @cached_property
    def meshing_range(self) -> tuple[float, float]:
        """Roll positions of a tooth pair between which some section of the common face is on the path of contact, rad.

        That of spur gears is `roll_position_range`; a helix makes it longer by the overlap ratio, in pitches.
        """
        first, last = self.roll_position_range
        ahead = [self.pinion.twist_per_length * z for z in self.common_face]
        return first - max(ahead), last - min(ahead)

    def section_roll_position(self, roll_position: FloatArray, z: FloatArray) -> FloatArray:
        """Return the roll position of the spur pair that a tooth pair is in its transverse section at z (mm), rad."""
        return np.asarray(roll_position + self.pinion.twist_per_length * np.asarray(z, dtype=float))

    def roll_position(self, pinion_roll_angle: float) -> float:
        """Return the roll position of the pinion tooth whose contact point has the given roll angle, rad."""
        return pinion_roll_angle - self.pinion.base_half_angle - self.working_pressure_angle

    def contact_roll_angles(self, roll_position: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the roll angles of the contact point on the pinion's and the wheel's flank.

        Parameters
        ----------
        roll_position : ndarray
            Roll position of the pinion tooth, rad.

        Returns
        -------
        u_pinion, u_wheel : ndarray
            rad; outside the active profile the values continue the line of action.
        """
        u1 = np.asarray(roll_position, float) + self.pinion.base_half_angle + self.working_pressure_angle
        return u1, (self.action_length - u1 * self.pinion.base_radius) / self.wheel.base_radius

    def wheel_tooth_rotation(self, roll_position: float) -> float:
        """Return the kinematic rotation of the mating wheel tooth from the line of centres, rad.

        The wheel tooth's frame is carried into the global frame by a rotation of pi plus this angle and the shift
        ``(0, a, 0)``. At this rotation the perfect flanks touch without load, whatever the backlash.
        """
        u2 = float(self.contact_roll_angles(np.array(roll_position))[1])
        return u2 - self.wheel.base_half_angle - self.working_pressure_angle

    def touching_pairs(self, phi: float, margin: float) -> IntArray:
        """Return the indices j of the tooth pairs that can touch somewhere on their width at pinion angle `phi`.

        Parameters
        ----------
        phi : float
            Pinion angle, rad.
        margin : float
            By how much a pair may touch before and after the path of contact (deflected teeth do), rad of roll
            position.
        """
        first, last = self.meshing_range
        low = math.ceil((first - margin - phi) / self.pitch - 1e-12)
        high = math.floor((last + margin - phi) / self.pitch + 1e-12)
        return np.arange(low, high + 1)

    def _mate_roll(self, wheel_roll_angle: float) -> float:
        return (self.action_length - wheel_roll_angle * self.wheel.base_radius) / self.pinion.base_radius


def zero_backlash_centre_distance(pinion: Tooth, wheel: Tooth) -> float:
    """Return the centre distance at which teeth without allowances mesh without backlash, mm (ISO 21771, 6.2)."""
    return _tight_distance(pinion, wheel, pinion.profile_shift + wheel.profile_shift)


def tight_centre_distance(pinion: Tooth, wheel: Tooth) -> float:
    """Return the centre distance at which the teeth as generated, with their allowances, have no backlash, mm."""
    return _tight_distance(pinion, wheel, pinion.generating_profile_shift + wheel.generating_profile_shift)


def _tight_distance(pinion: Tooth, wheel: Tooth, shift: float) -> float:
    bases = pinion.base_radius + wheel.base_radius
    return tight_distance(
        pinion.teeth + wheel.teeth, bases, shift, pinion.pressure_angle, pinion.transverse_pressure_angle
    )


def tight_distance(teeth: int, bases: float, shift: float, normal: float, transverse: float) -> float:
    """Return the centre distance at which teeth mesh without backlash, mm (ISO 21771, 6.2).

    Parameters
    ----------
    teeth, bases, shift
        Sums of both gears: of teeth, of base radii in mm, of profile shifts; signed, those of a ring negative.
    normal, transverse : float
        Pressure angles, rad.

    Raises
    ------
    GeometryError
    """
    target = involute_function(transverse) + 2.0 * math.tan(normal) * shift / teeth
    if target <= 0.0:
        if teeth < 0:
            raise GeometryError(f"profile shifts add up to {shift:g}: too much for {teeth} teeth; lower them")
        raise GeometryError(f"profile shifts add up to {shift:g}: too negative for {teeth} teeth; raise them")
    return bases / math.cos(inverse_involute(target))


def transverse_backlash(bases: float, tightest: float, distance: float) -> float:
    """Return the backlash along the transverse line of action at a centre distance, mm (ISO 21771, 6.3: j_bt).

    Parameters
    ----------
    bases, tightest
        Sum of both base radii; centre distance without backlash; mm, negative of an internal pair.
    """
    tight, open_ = (involute_function(math.acos(bases / distance_mm)) for distance_mm in (tightest, distance))
    return 2.0 * (open_ - tight) * bases


def tight_shift(teeth: int, bases: float, distance: float, normal: float, transverse: float) -> float:
    """Return the sum of profile shifts for a centre distance beyond that of the base circles: see `tight_distance`."""
    working = math.acos(bases / distance)
    return teeth * (involute_function(working) - involute_function(transverse)) / (2.0 * math.tan(normal))
