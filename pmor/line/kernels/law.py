"""One line load for each section, nonlinear in the approach of the flanks (`pmor.line.hertz`)."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import allocating, compiled
from pmor.gear.kernels.deviation import flank_deviation
from pmor.gear.kernels.types import Motion
from pmor.line.kernels.contact_point import carry, closest_approach, cubic_rows, gap_change, list_point, roll_of
from pmor.line.kernels.tip_corner import LAW_FIELDS, SHORT, LineLaw, corner_approach, single_mean, store_law
from pmor.penalty.kernels.state import Carriers, Found


@compiled
def _smooth_approach(load, law, corners):
    """Approach of the flanks under a line load above the least one, and its derivative."""
    if load <= law.plain:
        shape = law.constant - 0.5 * np.log(load)
        return law.compliance * load * shape, law.compliance * (shape - 0.5)
    return corner_approach(load, law, corners[int(law.gear)])


@compiled
def widest_load(law):
    """Line load at which Hertz's half-width comes near the depth of the layer: A - ln(w) / 2 = 1, N/mm."""
    return 0.5 * law.curvature / law.compliance * np.exp(2.0 * law.opening - 1.0)


@compiled
def approach_of(load, law, corners):
    """Approach of the flanks under a line load (N/mm) and its derivative; linear below the least load.

    At a corner also beyond the widest, where there is no table.
    """
    if load <= law.least:
        slope = _smooth_approach(law.least, law, corners)[0] / law.least
        return slope * load, slope
    if load > law.plain:
        widest = widest_load(law)
        if load > widest:
            approach, slope = _smooth_approach(widest, law, corners)
            return approach + slope * (load - widest), slope
    return _smooth_approach(load, law, corners)


@compiled
def line_load(penetration, law, corners):
    """Line load and its derivative for an approach of the flanks.

    Away from corners penetration = C w (A - ln(w) / 2), C the compliance, A the constant. Below the least load the
    logarithm is held (the contact is then narrower than any roughness); where the half-width comes near the depth of
    the layer, beyond A - ln(w) / 2 = 1, the law goes on linearly, so that Newton finds its way back from there.

    Parameters
    ----------
    penetration : float
        mm.
    law : LineLaw
    corners : two Corner

    Returns
    -------
    load, slope : float
        N/mm, N/mm^2.
    """
    secant = _smooth_approach(law.least, law, corners)[0] / law.least
    if penetration <= secant * law.least:
        return max(penetration, 0.0) / secant, 1.0 / secant
    widest = widest_load(law)
    most, slope = _smooth_approach(widest, law, corners)
    if penetration >= most:
        return widest + (penetration - most) / slope, 1.0 / slope
    low, high, load = law.least, widest, min(penetration / secant, widest)
    for _ in range(60):
        approach, slope = _smooth_approach(load, law, corners)
        if approach < penetration:
            low = load
        else:
            high = load
        step = (penetration - approach) / slope
        load = load + step if low <= load + step <= high else 0.5 * (low + high)
        if abs(step) <= 1e-15 * load:
            break
    return load, 1.0 / _smooth_approach(load, law, corners)[1]


@compiled
def line_law(gears, contact_point, carriers):
    """`LineLaw` where two flanks meet.

    Of helical flanks along the transverse line of action: the approach normal to the flanks over the cosine of the base
    helix angle, at the curvature and the depth of the layer normal to them.
    """
    compliance, constant, curvature = 0.0, 0.0, 0.0
    cosine = 1.0 / np.sqrt(1.0 + (gears[0].twist * gears[0].base_radius) ** 2)
    near, nearest, inside = -1, 1.0, 0.0
    for gear in range(2):
        distance, influence_length = _from_corner(gears[gear], roll_of(contact_point, gear), cosine)
        if distance < nearest * influence_length:
            near, nearest, inside = gear, distance / influence_length, distance
    for gear in range(2):
        flank, value, roll = gears[gear], 0.0, roll_of(contact_point, gear)
        for a in range(4):
            row = min(carriers.row[gear] + a, len(flank.line_constant) - 1)
            value += carriers.weight[gear, a] * flank.line_constant[row]
        if gear != near:
            distance, influence_length = _from_corner(flank, roll, cosine)
            value += single_mean(flank.corner, (flank.corner.place + distance) / influence_length)
        compliance += flank.line_compliance
        constant += flank.line_compliance * value
        curvature += 1.0 / (flank.base_radius * max(roll, 1e-3))
    constant = constant / compliance + np.log(cosine)
    least = 1e-9 / (compliance * curvature * cosine)
    law = LineLaw(
        compliance / cosine, constant - 0.5 * np.log(2.0 * compliance / (cosine * curvature)), least, np.inf, 0.0,
        constant - 0.5, 0.0, curvature, 0.0, 0.0, 1.0, 0.0,
    )  # fmt: skip
    return law if near < 0 else _law_near_corner(gears, contact_point, near, inside, cosine, law)


@compiled
def _from_corner(flank, roll, cosine):
    """Distance from where the flank ends to the roll angle `roll`, and that over which the layer's end is felt, mm."""
    distance = 0.5 * flank.base_radius * max(flank.tip_roll**2 - roll**2, 0.0)
    return distance, flank.corner.influence_length * flank.corner.depth * cosine


@compiled
def _law_near_corner(gears, contact_point, near, inside, cosine, law):
    """Complete a law with the corner of the gear `near`, the flanks contact_point `inside` (mm) of its edge or at it."""
    flank, mate = gears[near], gears[1 - near]
    share = flank.line_compliance / (gears[0].line_compliance + gears[1].line_compliance)
    place, influence_length, edge = flank.corner.place, flank.corner.influence_length * flank.corner.depth * cosine, 0.0
    if flank.edge_radius > 0.0:
        edge = 1.0 / flank.edge_radius + 1.0 / (mate.base_radius * max(roll_of(contact_point, 1 - near), 1e-3))
    if inside > 0.0:
        angle, short = -law.curvature * inside, min(SHORT * (place + inside), inside)
        constant = law.constant + share * single_mean(flank.corner, (place + inside) / influence_length)
    else:
        angle, short, constant = contact_point.slant, 0.0, law.constant
    plain = 0.5 * law.curvature * short**2 / law.compliance
    return LineLaw(
        law.compliance, constant, law.least, plain, float(near), law.opening, angle, law.curvature, edge, place, influence_length,
        share,
    )  # fmt: skip


@allocating
def laws_of_lines(kinematics, gears, roll_positions, z):
    """Laws of sections at some roll positions of their tooth pairs (rad) and places z (mm), shape (n, `LAW_FIELDS`)."""
    laws = np.empty((len(z), LAW_FIELDS))
    forward, back = Motion(np.empty((3, 3)), np.empty(3)), Motion(np.empty((3, 3)), np.empty(3))
    carriers = Carriers(np.empty(2, dtype=np.int64), np.empty((2, 4)))
    for n in range(len(z)):
        contact_point = closest_approach(kinematics, gears, roll_positions[n], 0.0, z[n], forward, back)
        for gear in range(2):
            roll = gears[gear].roll
            last = len(roll) - 1
            carriers.row[gear] = cubic_rows(roll, roll_of(contact_point, gear), 0, last, carriers.weight[gear])
        store_law(line_law(gears, contact_point, carriers), laws[n])
    return laws


@compiled
def _meet(kinematics, gears, windows, roll_position, z, workspace):
    """ContactPoint in the section at z, whether it is inside both windows, and the law there."""
    contact_point = closest_approach(kinematics, gears, roll_position, 0.0, z, workspace.forward, workspace.back)
    inside = carry(gears, windows, contact_point, workspace.carriers)
    return contact_point, inside, line_law(gears, contact_point, workspace.carriers)


@compiled
def section_deviation(deviations, contact_point, z, tooth_pair):
    """What both flanks deviate by where they meet in the section at z (mm), mm."""
    pinion = flank_deviation(deviations[0], contact_point.pinion_roll, z, tooth_pair)
    # The wheel's teeth count against the pinion's.
    return pinion + flank_deviation(deviations[1], contact_point.wheel_roll, z, -tooth_pair)


@compiled
def sections_alike(kinematics, gears):
    """Whether undeformed flanks meet in the same way in all sections."""
    return kinematics.slope_x == 0.0 and kinematics.slope_y == 0.0 and gears[0].twist == 0.0


@compiled
def search_line(pair, patches, p, advance, moved, largest_gap, count, workspace):
    """List the sections of tooth pair `p`, one point each, at the closest approach; see `search_all`.

    To first order in the displacements, flanks meet where their kinematic position has it, and the gap is linear in the
    advance; only under a pinion's corner, whose lever turns with it, it is quadratic. The load is not proportional to the
    gap. Listed are the tangent stiffness and the gap that, times it, gives the load: a Newton step on these is the
    exact tangent of the nonlinear law.
    """
    kinematics, gears, windows = pair.kinematics, pair.gears, patches.windows[p]
    roll_position = patches.phi + patches.tooth_pair[p] * kinematics.pitch
    z, width = pair.sections.z, pair.sections.width
    alike = sections_alike(kinematics, gears)
    images, corners = 2.0 if pair.scheme.mirrored else 1.0, (gears[0].corner, gears[1].corner)
    smallest, border = np.inf, False
    contact_point, inside, law = _meet(kinematics, gears, windows, roll_position, z[0], workspace)
    for section in range(len(z)):
        if section > 0 and not alike:
            contact_point, inside, law = _meet(kinematics, gears, windows, roll_position, z[section], workspace)
        gap = contact_point.gap + section_deviation(pair.deviations, contact_point, z[section], patches.tooth_pair[p])
        gap += contact_point.lever * advance
        gap += 0.5 * contact_point.lever_slope * max(advance - contact_point.corner_advance, 0.0) ** 2
        gap += gap_change(moved, gears, pair.sections, windows, contact_point, workspace.carriers, section)
        smallest = min(smallest, gap)
        if gap >= largest_gap:
            continue
        border = border or (gap < 0.0 and not inside)
        load, slope = line_load(-gap, law, corners)
        effective = gap if gap >= 0.0 else -load / slope
        stiffness = images * slope * width[section]
        list_point(
            gears, pair.sections, windows, contact_point, workspace.carriers, section, 0, effective, stiffness, advance, count,
            workspace.points,
        )  # fmt: skip
        count += 1
    return Found(count, smallest, border)
