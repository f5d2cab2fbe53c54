"""The data sheet of a gear pair, as ISO 21771:2007 names it: what stands on a drawing, and how the pair meshes.

Diameters, thicknesses and lengths on the line of action are those of the transverse section unless they say otherwise.
Those of an internal pair are written positive, as on a drawing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pmor.gear.clearance import tip_clearance, tip_land
from pmor.gear.inertia import Inertia
from pmor.gear.modification import RELIEF_PLACES, UNMODIFIED, Modification
from pmor.gear.pair import GearPair
from pmor.gear.profile import Profile, ProfilePoint, profiles
from pmor.gear.tooth import Tooth


@dataclass(frozen=True, kw_only=True)
class GearData:
    """Data of one gear; None where there is no such number.

    Parameters
    ----------
    teeth : int
        z.
    profile_shift, generating_profile_shift : float
        x; x_E, with which the rack makes the tooth thickness: in modules.
    tip_alteration : float
        k, in modules.
    reference_diameter_mm, base_diameter_mm, working_pitch_diameter_mm : float
        d, d_b, d_w.
    tip_diameter_mm, tip_form_diameter_mm : float
        d_a; d_Fa, where a rounding or chamfer begins.
    root_diameter_mm, root_form_diameter_mm : float
        d_f; d_Ff, where the fillet begins.
    start_of_active_profile_diameter_mm, end_of_active_profile_diameter_mm : float
        d_Nf, d_Na: between them the mate touches.
    tip_clearance_mm : float
        c, from the tip circle to the mate's root circle.
    normal_tooth_thickness_mm, tooth_thickness_mm : float
        s_n, s_t: arcs of the reference circle.
    tip_tooth_thickness_mm, base_tooth_thickness_mm : float
        s_at, s_bt: arcs of the tip circle and of the base circle.
    span_teeth : int or None
        k, nearest to contact half way up the flank; None of a ring, or where the face is too narrow, or flanks too
        short.
    span_mm : float or None
        W_k, base tangent length over k teeth.
    least_span_mm, largest_span_mm : float or None
        Over as many teeth with the lower and the upper allowance of the tooth thickness; None without two of them.
    angular_backlash_deg : float
        j_phi, of this gear while its mate stands still.
    speed_rpm, rotational_frequency_Hz : float or None
        None without a speed.
    mass_kg, polar_inertia_kg_m2 : float or None
        Rim, web, hub and holes as drawn; teeth count as a full ring up to the reference circle.
    start_of_active_profile, pitch_point, end_of_active_profile, tip : ProfilePoint
        A, C and E of the path of contact on this flank, and its tip circle.
    tip_relief_start, root_relief_end : ProfilePoint or None
        None without relief.
    lowest_single_contact, highest_single_contact : ProfilePoint or None
        LPSTC and HPSTC, B and D on the pinion's flank; None where the transverse section never has one pair in contact
        or never two.
    """

    teeth: int
    profile_shift: float
    generating_profile_shift: float
    tip_alteration: float
    reference_diameter_mm: float
    base_diameter_mm: float
    working_pitch_diameter_mm: float
    tip_diameter_mm: float
    tip_form_diameter_mm: float
    root_diameter_mm: float
    root_form_diameter_mm: float
    start_of_active_profile_diameter_mm: float
    end_of_active_profile_diameter_mm: float
    tip_clearance_mm: float
    normal_tooth_thickness_mm: float
    tooth_thickness_mm: float
    tip_tooth_thickness_mm: float
    base_tooth_thickness_mm: float
    span_teeth: int | None
    span_mm: float | None
    least_span_mm: float | None
    largest_span_mm: float | None
    angular_backlash_deg: float
    speed_rpm: float | None
    rotational_frequency_Hz: float | None
    mass_kg: float | None
    polar_inertia_kg_m2: float | None
    start_of_active_profile: ProfilePoint
    lowest_single_contact: ProfilePoint | None
    pitch_point: ProfilePoint
    highest_single_contact: ProfilePoint | None
    end_of_active_profile: ProfilePoint
    tip: ProfilePoint
    tip_relief_start: ProfilePoint | None
    root_relief_end: ProfilePoint | None


@dataclass(frozen=True, kw_only=True)
class DataSheet:
    """Data of a pair.

    Parameters
    ----------
    gear_ratio : float
        u = z_2 / z_1, negative of an internal pair, whose gears turn the same way.
    normal_module_mm, transverse_module_mm : float
        m_n, m_t.
    normal_pressure_angle_deg, transverse_pressure_angle_deg : float
        alpha_n, alpha_t at the reference circles.
    helix_angle_deg, base_helix_angle_deg : float
        beta, beta_b of the pinion: positive where it is right-handed.
    sum_of_profile_shifts : float
        x_1 + x_2, in modules.
    centre_distance_mm, reference_centre_distance_mm, zero_backlash_centre_distance_mm : float
        a_w, a_d = (d_1 + d_2) / 2, and that at which these teeth have no backlash.
    working_transverse_pressure_angle_deg, working_normal_pressure_angle_deg : float
        alpha_wt, alpha_wn.
    normal_backlash_mm, transverse_backlash_mm, circumferential_backlash_mm : float
        j_bn, normal to the flanks; j_bt, along the transverse line of action; j_wt, along the working pitch circles.
    least_normal_backlash_mm, largest_normal_backlash_mm : float or None
        j_bn with the upper and the lower allowances of the tooth thicknesses; None without two of them.
    base_pitch_mm, path_of_contact_mm : float
        p_et, g_alpha.
    common_face_width_mm : float
        b_w.
    transverse_contact_ratio, overlap_ratio, total_contact_ratio : float
        eps_alpha, eps_beta, eps_gamma.
    mesh_frequency_Hz : float or None
        f_z; None without a speed.
    """

    pinion: GearData
    wheel: GearData
    gear_ratio: float
    normal_module_mm: float
    transverse_module_mm: float
    normal_pressure_angle_deg: float
    transverse_pressure_angle_deg: float
    helix_angle_deg: float
    base_helix_angle_deg: float
    sum_of_profile_shifts: float
    centre_distance_mm: float
    reference_centre_distance_mm: float
    zero_backlash_centre_distance_mm: float
    working_transverse_pressure_angle_deg: float
    working_normal_pressure_angle_deg: float
    normal_backlash_mm: float
    transverse_backlash_mm: float
    circumferential_backlash_mm: float
    least_normal_backlash_mm: float | None
    largest_normal_backlash_mm: float | None
    base_pitch_mm: float
    path_of_contact_mm: float
    common_face_width_mm: float
    transverse_contact_ratio: float
    overlap_ratio: float
    total_contact_ratio: float
    mesh_frequency_Hz: float | None


@dataclass(frozen=True)
class OneGear:
    """What a data sheet says of a gear beside the geometry of its teeth.

    Parameters
    ----------
    flank : Modification
    allowances : (float, float)
        Lower and upper one of the normal tooth thickness, mm; the teeth of the pair have their mean.
    inertia : Inertia or None
    """

    flank: Modification = UNMODIFIED
    allowances: tuple[float, float] = (0.0, 0.0)
    inertia: Inertia | None = None

    @property
    def tolerance(self) -> float:
        """Half the range of the tooth thickness, mm."""
        return 0.5 * (self.allowances[1] - self.allowances[0])


def data_sheet(
    pair: GearPair, speed_rpm: float | None = None, gears: tuple[OneGear, OneGear] = (OneGear(), OneGear())
) -> DataSheet:
    """Return the data sheet of a pair.

    Parameters
    ----------
    speed_rpm : float, optional
        Of the pinion, revolutions per minute.
    gears : (OneGear, OneGear)
    """
    pinion = pair.pinion
    helix = math.cos(pair.base_helix_angle)
    normal = pair.backlash * helix
    varied = sum(gear.tolerance for gear in gears) * math.cos(pinion.pressure_angle)
    return DataSheet(
        pinion=_gear_data(pair, 0, speed_rpm, gears[0]), wheel=_gear_data(pair, 1, speed_rpm, gears[1]),
        gear_ratio=pair.wheel.teeth / pinion.teeth,
        normal_module_mm=pinion.module, transverse_module_mm=pinion.transverse_module,
        normal_pressure_angle_deg=math.degrees(pinion.pressure_angle),
        transverse_pressure_angle_deg=math.degrees(pinion.transverse_pressure_angle),
        helix_angle_deg=math.degrees(pinion.helix_angle), base_helix_angle_deg=math.degrees(pair.base_helix_angle),
        sum_of_profile_shifts=pinion.profile_shift + pair.wheel.profile_shift,
        centre_distance_mm=abs(pair.centre_distance),
        reference_centre_distance_mm=abs(pinion.reference_radius + pair.wheel.reference_radius),
        zero_backlash_centre_distance_mm=abs(pair.least_centre_distance),
        working_transverse_pressure_angle_deg=math.degrees(pair.working_pressure_angle),
        working_normal_pressure_angle_deg=math.degrees(math.asin(math.sin(pair.working_pressure_angle) * helix)),
        normal_backlash_mm=normal, transverse_backlash_mm=pair.backlash,
        circumferential_backlash_mm=pair.backlash / math.cos(pair.working_pressure_angle),
        least_normal_backlash_mm=max(normal - varied, 0.0) if varied else None,
        largest_normal_backlash_mm=normal + varied if varied else None,
        base_pitch_mm=pinion.base_pitch, path_of_contact_mm=pair.contact_ratio * pinion.base_pitch,
        common_face_width_mm=pair.common_width, transverse_contact_ratio=pair.contact_ratio,
        overlap_ratio=pair.overlap_ratio, total_contact_ratio=pair.total_contact_ratio,
        mesh_frequency_Hz=None if speed_rpm is None else pinion.teeth * speed_rpm / 60.0,
    )  # fmt: skip


def _gear_data(pair: GearPair, gear: int, pinion_speed_rpm: float | None, made: OneGear) -> GearData:
    tooth, profile, edge = (pair.pinion, pair.wheel)[gear], profiles(pair)[gear], pair.tip_edges[gear]
    drawn = made.inertia
    low, high = pair.faces[gear]
    span_teeth = teeth_to_span(tooth, high - low, edge.roll_angle)
    teeth, base = abs(tooth.teeth), abs(tooth.base_radius)
    speed = None if pinion_speed_rpm is None else pinion_speed_rpm * pair.pinion.teeth / teeth
    lowest, highest = _single_contact(profile, tooth.angular_pitch)
    tip_relief, root_relief = (
        profile.relief_roll(made.flank, amount) if getattr(made.flank, amount) else None for amount in RELIEF_PLACES
    )
    length = None if span_teeth is None else span(tooth, span_teeth)
    varied = made.tolerance * math.cos(tooth.pressure_angle)
    spread = (length - varied, length + varied) if length is not None and varied else None
    thickness = 2.0 * tooth.reference_radius * tooth.half_thickness_angle(math.tan(tooth.transverse_pressure_angle))
    return GearData(
        teeth=teeth, profile_shift=tooth.profile_shift,
        generating_profile_shift=tooth.generating_profile_shift, tip_alteration=-tooth.tip_shortening / tooth.module,
        reference_diameter_mm=2.0 * abs(tooth.reference_radius), base_diameter_mm=2.0 * base,
        working_pitch_diameter_mm=2.0 * base / math.cos(pair.working_pressure_angle),
        tip_diameter_mm=2.0 * abs(tooth.tip_radius), tip_form_diameter_mm=profile.point(edge.roll_angle).diameter_mm,
        root_diameter_mm=2.0 * abs(tooth.root_radius),
        root_form_diameter_mm=profile.point(tooth.form_roll_angle).diameter_mm,
        start_of_active_profile_diameter_mm=profile.point(profile.start).diameter_mm,
        end_of_active_profile_diameter_mm=profile.point(profile.end).diameter_mm,
        tip_clearance_mm=tip_clearance(pair, gear),
        normal_tooth_thickness_mm=thickness * math.cos(tooth.helix_angle), tooth_thickness_mm=thickness,
        tip_tooth_thickness_mm=tip_land(tooth),
        base_tooth_thickness_mm=2.0 * tooth.base_radius * tooth.base_half_angle,
        span_teeth=span_teeth, span_mm=length, least_span_mm=None if spread is None else spread[0],
        largest_span_mm=None if spread is None else spread[1],
        angular_backlash_deg=math.degrees(pair.backlash / base),
        speed_rpm=speed, rotational_frequency_Hz=None if speed is None else speed / 60.0,
        mass_kg=None if drawn is None else drawn.mass_kg,
        polar_inertia_kg_m2=None if drawn is None else drawn.polar_kg_m2,
        start_of_active_profile=profile.point(profile.start),
        lowest_single_contact=_point(profile, lowest),
        pitch_point=profile.point(math.tan(pair.working_pressure_angle)),
        highest_single_contact=_point(profile, highest),
        end_of_active_profile=profile.point(profile.end), tip=profile.point(profile.tip),
        tip_relief_start=_point(profile, tip_relief), root_relief_end=_point(profile, root_relief),
    )  # fmt: skip


def _point(profile: Profile, roll: float | None) -> ProfilePoint | None:
    return None if roll is None else profile.point(roll)


def _single_contact(profile: Profile, pitch: float) -> tuple[float | None, float | None]:
    """Roll angles between which a flank of a spur pair carries alone, rad."""
    lowest, highest = profile.end - pitch, profile.start + pitch
    side = math.copysign(1.0, pitch)
    alone = side * profile.start < side * lowest <= side * highest < side * profile.end
    return (lowest, highest) if alone else (None, None)


def span(tooth: Tooth, teeth: int) -> float:
    """Return the base tangent length over a number of teeth, in the normal section, mm (ISO 21771, 7.5: W_k)."""
    transverse = (teeth - 1) * tooth.base_pitch + 2.0 * tooth.base_radius * tooth.base_half_angle
    return transverse * math.cos(math.atan(tooth.base_radius * tooth.twist_per_length))


def teeth_to_span(tooth: Tooth, face_width: float, end_roll: float) -> int | None:
    """Return the number of teeth whose span touches the flanks nearest to the circle d + 2 x m_n.

    None of a ring, whose flanks are hollow, and where anvils that touch both flanks would leave the face of a helical
    gear, or the flanks end before, at the form circle or at a roll angle towards the tip.
    """
    base_helix = math.atan(tooth.base_radius * tooth.twist_per_length)
    middle = tooth.roll_angle_at(tooth.reference_radius + tooth.profile_shift * tooth.module)
    # The anvils touch where roll angles of both flanks add up to the transverse span; by symmetry each has half of it.
    usable = []
    for teeth in range(1, tooth.teeth // 2 + 1):
        length = span(tooth, teeth)
        roll = 0.5 * length * math.cos(base_helix) / tooth.base_radius
        if tooth.form_roll_angle < roll < end_roll and length * abs(math.sin(base_helix)) < face_width:
            usable.append((abs(roll - middle), teeth))
    return min(usable)[1] if usable else None
