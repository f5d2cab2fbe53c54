"""Whether the teeth of a pair clear each other away from the working flanks: tips, roots and fillets.

Everything is transverse, of the unloaded pair with its working flanks in contact, and holds for the other flanks as
well: backlash only moves these apart. Sources: ISO 21771:2007 (tip clearance, tip land); Litvin & Fuentes, Gear
Geometry and Applied Theory (2004), ch. 6 (the fillet that the rack leaves). The tip corner is followed on its way
through the mate's tooth space, since no circle says where a fillet is; of a chamfered or rounded tip its ends are.

Working geometry: a pair whose wheel's axis is off or tilted, checked as it stands.

In each transverse section the axes have a distance of their own (`pmor.gear.kernels.motion.section_offset`), and the
pair there is the one of that centre distance. Drawings without backlash have it from the allowances of tooth
thickness; where a case does not say them, coast flanks may overlap by the least backlash that ISO/TR 10064-2
recommends, j_bn = 2/3 (0.06 + 0.0005 a + 0.03 m_n).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import GeometryError
from pmor.gear.condition import Misalignment
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tip_edge import TipEdge
from pmor.gear.tooth import Tooth, angle_from_centre_line

# In modules. Less tip clearance than this is unusual (rack of ISO 53: 0.25), and a narrower tip land breaks off when
# the teeth are hardened (ISO 21771).
USUAL_TIP_CLEARANCE, USUAL_TIP_LAND = 0.1, 0.2
# Depth in modules below which teeth count as just touching: round-off, and chords of the fillet.
TOUCHING = 1e-7
# Depth in mm below which a cut comes of rounded dimensions: drawings and files give lengths to a tenth of a micrometre.
ROUNDED = 1e-4
# Steps in modules in which a remedy is looked for, most of them, what of one is round-off; the least that is proposed.
REMEDY_STEP, MOST_STEPS, SAME_STEP, LEAST_ADDENDUM = 0.01, 64, 1e-6, 0.5
FILLET_POINTS, POSITIONS, REFINEMENTS, CUTTER_POSITIONS = 4001, 201, 3, 2001
NAMES = "pinion", "wheel"


def refuse_interference(pair: GearPair) -> None:
    """Raise GeometryError when a tip meets the mate's root circle, or cuts into its fillet or flank.

    Raises
    ------
    GeometryError
        Also where the tips of a pinion and a ring pass through each other beyond the path of contact, and where the
        ring's shaper trims its tips so.
    """
    if pair.wheel.internal:
        _refuse_trimming(pair.wheel)
    for gear in range(2):
        fault = _fault(pair, gear)
        if fault is not None:
            raise GeometryError(f"{fault.text}: {_remedies(pair, gear, fault.depth)}")


class _Fault(NamedTuple):
    """What a tip meets, and by how much, mm."""

    text: str
    depth: float


@lru_cache(maxsize=256)  # readers, plans and meshes ask again
def _fault(pair: GearPair, gear: int) -> _Fault | None:
    """Return what the tip of a gear meets; None where it is clear."""
    name, mate = NAMES[gear], NAMES[1 - gear]
    clearance = tip_clearance(pair, gear)
    if clearance < -ROUNDED:
        below = f"{-clearance:.4g} mm below the {mate}'s root circle, the tip clearance must not be below 0"
        return _Fault(f"the {name}'s tip circle reaches {below}", -clearance)
    gap, at = least_gap(pair, gear)
    if gap >= -ROUNDED:
        return None
    if at > form_radius(_own_and_mate(pair, gear)[1]):
        beside = f"by {-gap:.3g} mm beside the path of contact, more than 0"
        return _Fault(f"the {name}'s tips pass through those of the {mate} {beside}", -gap)
    return _Fault(f"the {name}'s tip cuts {-gap:.3g} mm into the {mate}'s fillet, more than 0", -gap)


def _remedies(pair: GearPair, gear: int, depth: float) -> str:
    """Return the changes of one key each after which nothing is met any more, in steps of `REMEDY_STEP`."""
    changes, first = [], math.ceil(depth / (REMEDY_STEP * pair.pinion.module))
    for key, sign, whose in (("addendum", -1, gear), ("addendum", -1, 1 - gear), ("dedendum", 1, 1 - gear)):
        steps = _least_steps(pair, (whose,), key, sign, first)
        if steps:
            value = _stepped((pair.pinion, pair.wheel)[whose], key, sign * steps)
            changes.append(f"{'reduce' if sign < 0 else 'raise'} [{NAMES[whose]}] {key} to {value:.4g}")
    if not changes and (steps := _least_steps(pair, (0, 1), "addendum", -1, first)):
        values = [_stepped(tooth, "addendum", -steps) for tooth in (pair.pinion, pair.wheel)]
        changes.append(f"reduce [pinion] addendum to {values[0]:.4g} and [wheel] addendum to {values[1]:.4g}")
    distance = f"{'lower' if pair.wheel.internal else 'raise'} centre_distance_mm"
    return ", or ".join(changes) or f"{distance}, or change teeth or profile_shift"


def _least_steps(pair: GearPair, whose: tuple[int, ...], key: str, sign: int, first: int) -> int:
    """Return how many steps of a key of one or both gears clear the teeth; 0 where none do. The first try is given."""
    near, far = 0, first
    while not _clears(pair, whose, key, sign * far):
        near, far = far, 2 * far
        if far > MOST_STEPS:
            return 0
    while far - near > 1:
        middle = (near + far) // 2
        near, far = (near, middle) if _clears(pair, whose, key, sign * middle) else (middle, far)
    return far


def _stepped(tooth: Tooth, key: str, steps: int) -> float:
    """Return an addendum or dedendum so many steps away, on the grid of steps."""
    own = getattr(tooth, key) / REMEDY_STEP
    return REMEDY_STEP * (steps + (math.ceil(own - SAME_STEP) if steps < 0 else math.floor(own + SAME_STEP)))


def _clears(pair: GearPair, whose: tuple[int, ...], key: str, steps: int) -> bool:
    """Whether nothing of a pair is met with another addendum or dedendum."""
    changed: dict[str, Any] = {}
    try:
        for gear in whose:
            tooth = (pair.pinion, pair.wheel)[gear]
            value: dict[str, Any] = {key: _stepped(tooth, key, steps)}
            if value[key] < LEAST_ADDENDUM:
                return False
            changed |= {NAMES[gear]: replace(tooth, **value), f"{NAMES[gear]}_edge": None}
        other = replace(pair, **changed)
        return all(_fault(other, gear) is None for gear in range(2))
    except GeometryError:
        return False


def _refuse_trimming(ring: Tooth) -> None:
    """Raise GeometryError where the shaper's tips cut into the ring's, beside the path on which they generate it."""
    if ring.shaper is None:
        return
    tips = ring.ring_root.tips(CUTTER_POSITIONS)
    place = np.stack([tips.real, tips.imag], axis=-1)
    distance, angle = np.copysign(np.abs(tips), ring.base_radius), angle_from_centre_line(place, ring.base_radius)
    depth = -float(_gaps(np.array([distance, angle]), *_profile(ring)).min())
    if depth > TOUCHING * ring.module:
        raise GeometryError(
            f"shaper teeth = {ring.shaper.teeth}: its tips trim those of the ring by {depth:.3g} mm as it turns, more "
            "than 0: lower it, or reduce [wheel] addendum"
        )


def clearance_warnings(pair: GearPair) -> tuple[str, ...]:
    """Warn of unusual teeth of a valid pair: each warning with the number and the usual range."""
    warnings = []
    module = pair.pinion.module
    for gear, (name, mate) in enumerate((NAMES, NAMES[::-1])):
        clearance, land = tip_clearance(pair, gear), tip_land((pair.pinion, pair.wheel)[gear])
        if clearance < (USUAL_TIP_CLEARANCE - TOUCHING) * module:
            warnings.append(
                f"tip clearance of the {name} is {clearance:.3g} mm, {clearance / module:.2g} modules, below the "
                f"{USUAL_TIP_CLEARANCE:g} that deflection and tolerances need: reduce [{name}] addendum or raise "
                f"[{mate}] dedendum"
            )
        if land < (USUAL_TIP_LAND - TOUCHING) * module:
            warnings.append(
                f"tip land of the {name} is {land:.3g} mm, {land / module:.2g} modules, below the {USUAL_TIP_LAND:g} "
                f"that hardened teeth need: reduce [{name}] addendum or profile_shift"
            )
        excess = below_form_circle(pair, gear)
        if excess > TOUCHING * module:
            warnings.append(
                f"the {mate}'s tip reaches {excess:.3g} mm of the line of action beyond the {name}'s form circle, "
                f"where its flank ends (undercut): contact ends there, with a contact ratio of {pair.contact_ratio:.3f}"
            )
    return tuple(warnings)


def tip_clearance(pair: GearPair, gear: int) -> float:
    """Return the distance of a gear's tip circle (0 pinion, 1 wheel) from the mate's root circle, mm."""
    own, mate = _own_and_mate(pair, gear)
    return pair.centre_distance - own.tip_radius - mate.root_radius


def tip_land(tooth: Tooth) -> float:
    """Return the width of a tooth at its tip circle in the transverse section, mm (arc)."""
    return 2.0 * tooth.tip_radius * tooth.half_thickness_angle(tooth.tip_roll_angle)


def below_form_circle(pair: GearPair, gear: int) -> float:
    """Return how far on the line of action the mate's tip reaches beyond a gear's form point, mm; 0 if it does not."""
    own, mate = _own_and_mate(pair, gear)
    length = own.base_radius * own.form_roll_angle + mate.base_radius * mate.tip_roll_angle
    return max(0.0, length - pair.action_length)


def form_radius(tooth: Tooth) -> float:
    """Return the radius at which the involute ends towards the root, mm; negative of an internal gear."""
    return tooth.base_radius * math.hypot(1.0, tooth.form_roll_angle)


def least_gap(pair: GearPair, gear: int) -> tuple[float, float]:
    """Return the smallest gap between a gear's tip corner, or its edge, and the mate, and where that is, mm.

    The gap is negative where the corner cuts into the mate's flank or fillet, and 0 where the path of contact ends at
    the tip; the place is the mate's signed radius.

    Parameters
    ----------
    gear : int
        Whose corner: 0 pinion, 1 wheel.
    """
    own, mate = _own_and_mate(pair, gear)
    # Within the mate's tip circle the corner is no further than this from the line of centres.
    cosine = own.tip_radius**2 + pair.centre_distance**2 - mate.tip_radius**2
    widest = math.acos(min(1.0, cosine / (2.0 * own.tip_radius * pair.centre_distance)))
    profile = _profile(mate)
    smallest = math.inf, 0.0
    for corner in _tip_corners(own, pair.tip_edges[gear]):
        middle, half = 0.0, widest
        for _ in range(REFINEMENTS + 1):
            angle = np.linspace(middle - half, middle + half, POSITIONS)
            place = _in_mate(pair, gear, corner, angle)
            gaps = _gaps(place, *profile)
            lowest = int(np.argmin(gaps))
            smallest = min(smallest, (float(gaps[lowest]), float(place[0, lowest])))
            middle, half = float(angle[lowest]), 2.0 * half / (POSITIONS - 1)
    return smallest


def _tip_corners(tooth: Tooth, edge: TipEdge) -> list[complex]:
    """What of a tooth's tip can touch the mate: its corner, both ends of a chamfer, ends and middle of a rounding."""
    end, tip = complex(*tooth.flank_section(np.array(edge.roll_angle))), tooth.tip_radius
    if edge.radius > 0.0:
        normal = complex(*tooth.flank_normal(np.array(edge.roll_angle), np.array(0.0))[:2])
        centre = end - edge.radius * normal / abs(normal)
        land = centre * abs(tip) / abs(centre)
        middle = end + land - 2.0 * centre
        return [end, centre + edge.radius * middle / abs(middle), land]
    if edge.roll_angle == tooth.tip_roll_angle:
        return [end]
    height = abs(tip) - abs(end)
    land_angle = tooth.half_thickness_angle(tooth.tip_roll_angle) - abs(height) / tip
    return [end, complex(tip * np.exp(1j * (0.5 * math.pi + land_angle)))]


def _own_and_mate(pair: GearPair, gear: int) -> tuple[Tooth, Tooth]:
    return (pair.wheel, pair.pinion) if gear else (pair.pinion, pair.wheel)


def _in_mate(pair: GearPair, gear: int, corner: complex, angle: FloatArray) -> FloatArray:
    """Carry a tip corner that stands at angles (rad) from the line of centres into the frame of the mating tooth.

    Returns
    -------
    ndarray, shape (2, n)
        Distance from the mate's axis (mm, negative of an internal gear) and angle from the centre line of its tooth
        (rad).
    """
    own, mate = _own_and_mate(pair, gear)
    turned = angle - own.half_thickness_angle(own.tip_roll_angle)
    # The relation is mutual: turn the drawing by 180 degrees.
    foot = turned + own.base_half_angle + pair.working_pressure_angle
    mate_roll = (pair.action_length - foot * own.base_radius) / mate.base_radius
    mate_turned = mate_roll - mate.base_half_angle - pair.working_pressure_angle
    seen = (corner * np.exp(1j * turned) - 1j * pair.centre_distance) / np.exp(1j * (math.pi + mate_turned))
    place = np.stack([seen.real, seen.imag], axis=-1)
    distance = np.copysign(np.abs(seen), mate.base_radius)
    return np.array([distance, angle_from_centre_line(place, mate.base_radius)])


def _profile(tooth: Tooth) -> tuple[FloatArray, FloatArray]:
    """Return signed radii, rising, and half angles of a tooth from its root circle to its tip."""
    fillet = tooth.root_section(np.linspace(1.0, 0.0, FILLET_POINTS))
    flank = tooth.flank_section(np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, FILLET_POINTS)[1:])
    points = np.concatenate([fillet, flank])
    radius = np.copysign(np.hypot(points[:, 0], points[:, 1]), tooth.base_radius)
    return radius, angle_from_centre_line(points, tooth.base_radius)


def _gaps(place: FloatArray, radius: FloatArray, half: FloatArray) -> FloatArray:
    """Gaps of points from a profile, normal to it to first order, mm; infinite beyond its radii."""
    distance, angle = place
    inside = (distance > radius[0]) & (distance < radius[-1])
    interval = np.clip(np.searchsorted(radius, distance) - 1, 0, len(radius) - 2)
    run = radius[interval + 1] - radius[interval]
    slope = (half[interval + 1] - half[interval]) / run
    arc = (angle - half[interval] - slope * (distance - radius[interval])) * distance
    return np.where(inside, arc / np.hypot(1.0, distance * slope), np.inf)


# Working centre distances are checked to this step, mm: scattered ones share their checks.
STEP = 1e-3


def least_usual_backlash(pair: GearPair) -> float:
    """Return the least normal backlash that is recommended, mm (ISO/TR 10064-2:1996, table A.1)."""
    distance = abs(zero_backlash_centre_distance(pair.pinion, pair.wheel))
    return 2.0 / 3.0 * (0.06 + 0.0005 * distance + 0.03 * pair.pinion.module)


class WorkingPair(GearPair):
    """A pair at its working centre distance, whose teeth may use up the allowances of their thickness."""

    @property
    def least_centre_distance(self) -> float:
        """Centre distance below which the teeth jam, mm."""
        if self.pinion.thickness_allowance or self.wheel.thickness_allowance:
            return super().least_centre_distance
        drawn = zero_backlash_centre_distance(self.pinion, self.wheel)
        transverse = least_usual_backlash(self) / math.cos(self.base_helix_angle)
        return drawn - 0.5 * transverse / math.sin(math.acos(self.base_distance / drawn))


def refuse_working_geometry(pair: GearPair, misalignments: Iterable[Misalignment]) -> None:
    """Raise GeometryError where a pair does not mesh with its wheel's axis out of place.

    Parameters
    ----------
    pair : GearPair
        As drawn.
    """
    checked = dict[float, Misalignment]()
    for misalignment in misalignments:
        middle, *ends = (section_distance(pair, misalignment, z) for z in (0.0, *pair.common_face))
        checked |= {middle: misalignment, min(ends): misalignment}
        if not overlap_of_tips(pair, max(ends)) > 0.0:  # nan too
            raise GeometryError(
                f"{_place(misalignment)}: at a face the axes are {abs(max(ends)):.6g} mm apart, where tips do not "
                f"reach the mate's flank: {'raise' if pair.wheel.internal else 'lower'} it"
            )
    # Teeth jam and tips interfere at the shortest distance, contact is lost at the longest one.
    for distance in {min(checked), max(checked)} if checked else ():
        change = (distance - pair.centre_distance) / STEP
        reason = _reason(pair, math.floor(change) if change < 0.0 else math.ceil(change))
        if reason:
            raise GeometryError(f"{_place(checked[distance])}: at the working centre distance, {reason}")


def section_distance(pair: GearPair, misalignment: Misalignment, z: float) -> float:
    """Return the distance of the axes in the transverse section at z (mm), mm."""
    share = z / pair.face_width
    across = 1e-3 * misalignment.out_of_plane_um * share
    along = 1e-3 * (misalignment.centre_distance_um + misalignment.in_plane_um * share)
    return math.copysign(math.hypot(across, abs(pair.centre_distance) + along), pair.centre_distance)


def overlap_of_tips(pair: GearPair, distance: float) -> float:
    """Return by how much the tips at a centre distance overlap along the line of action, mm."""
    action_length = math.copysign(math.sqrt(max(distance**2 - pair.base_distance**2, 0.0)), distance)
    pinion, wheel = pair.tip_edges
    reached = pinion.roll_angle * pair.pinion.base_radius + wheel.roll_angle * pair.wheel.base_radius
    return reached - action_length


@lru_cache(maxsize=4096)
def _reason(pair: GearPair, steps: int) -> str:
    """Return why a pair does not mesh so many steps from its centre distance; empty where it does."""
    distance = pair.centre_distance + STEP * steps
    faces = pair.pinion_face, pair.wheel_face
    try:
        refuse_interference(WorkingPair(pair.pinion, pair.wheel, pair.face_width, distance, *faces, *pair.tip_edges))
    except GeometryError as error:
        return str(error)
    return ""


def _place(misalignment: Misalignment) -> str:
    values = {name: getattr(misalignment, name) for name in misalignment.__dataclass_fields__}
    return ", ".join(f"{name} = {value:g}" for name, value in values.items() if value)
