"""One line load for each section, nonlinear in the approach of the flanks (`pmor.contact.line_contact`)."""

from __future__ import annotations

import numpy as np

from pmor.contact.kernels.compiling import compiled
from pmor.contact.kernels.deviation import flank_deviation
from pmor.contact.kernels.sections import carry, closest_approach, gap_change, list_point, roll_of
from pmor.contact.kernels.state import Found


@compiled
def line_load(penetration, compliance, constant, least):
    """Line load and its derivative for an approach of the flanks.

    Solves penetration = C w (A - ln(w) / 2), C the compliance, A the constant. Below the load `least` the logarithm is
    held (the contact is then narrower than any roughness); where the half-width comes near the depth of the layer,
    beyond A - ln(w) / 2 = 1, the law goes on linearly, so that Newton finds its way back from there.

    Returns
    -------
    load, slope : float
        N/mm, N/mm^2.
    """
    secant = compliance * (constant - 0.5 * np.log(least))
    if penetration <= secant * least:
        return max(penetration, 0.0) / secant, 1.0 / secant
    widest = np.exp(2.0 * constant - 2.0)
    if penetration >= compliance * widest:
        return widest + 2.0 * (penetration / compliance - widest), 2.0 / compliance
    load = penetration / secant
    for _ in range(50):
        shape = constant - 0.5 * np.log(load)
        step = (penetration - compliance * load * shape) / (compliance * (shape - 0.5))
        load = min(load + step, widest)
        if abs(step) <= 1e-15 * load:
            break
    return load, 1.0 / (compliance * (constant - 0.5 * np.log(load) - 0.5))


@compiled
def line_law(gears, meeting, carriers):
    """Compliance and constant of `line_load` where two flanks meet, and the load below which it is linear.

    Of helical flanks along the transverse line of action: the approach normal to the flanks over the cosine of the base
    helix angle, at the curvature and the depth of the layer normal to them.
    """
    compliance, constant, curvature = 0.0, 0.0, 0.0
    cosine = 1.0 / np.sqrt(1.0 + (gears[0].twist * gears[0].base_radius) ** 2)
    for gear in range(2):
        flank, value = gears[gear], 0.0
        for a in range(4):
            row = min(carriers.row[gear] + a, len(flank.line_constant) - 1)
            value += carriers.weight[gear, a] * flank.line_constant[row]
        compliance += flank.line_compliance
        constant += flank.line_compliance * value
        roll = roll_of(meeting, gear)
        on_edge = flank.edge_radius > 0.0 and roll >= flank.tip_roll
        radius = flank.edge_radius if on_edge else flank.base_radius * max(roll, 1e-3)
        curvature += 1.0 / radius
    curvature *= cosine
    constant = constant / compliance + np.log(cosine) - 0.5 * np.log(2.0 * compliance / curvature)
    return compliance / cosine, constant, 1e-9 / (compliance * curvature)


@compiled
def _meet(kinematics, gears, windows, roll_position, z, room):
    """Meeting in the section at z, whether it is inside both windows, and the law there."""
    meeting = closest_approach(kinematics, gears, roll_position, 0.0, z, room.forward, room.back)
    inside = carry(gears, windows, meeting, room.carriers)
    return meeting, inside, line_law(gears, meeting, room.carriers)


@compiled
def section_deviation(deviations, meeting, z, tooth_pair):
    """What both flanks deviate by where they meet in the section at z (mm), mm."""
    pinion = flank_deviation(deviations[0], meeting.pinion_roll, z, tooth_pair)
    # The wheel's teeth count against the pinion's.
    return pinion + flank_deviation(deviations[1], meeting.wheel_roll, z, -tooth_pair)


@compiled
def sections_alike(kinematics, gears):
    """Whether undeformed flanks meet in the same way in all sections."""
    return kinematics.slope_x == 0.0 and kinematics.slope_y == 0.0 and gears[0].twist == 0.0


@compiled
def search_line(pair, reach, p, lead, moved, largest_gap, count, room):
    """List the sections of tooth pair `p`, one point each, at the closest approach; see `search_all`.

    To first order in the displacements, flanks meet where their kinematic position has it, and the gap is linear in the
    lead; only under a pinion's corner, whose lever turns with it, it is quadratic. The load is not proportional to the
    gap. Listed are the tangent stiffness and the gap that, times it, gives the load: a Newton step on these is the
    exact tangent of the nonlinear law.
    """
    kinematics, gears, windows = pair.kinematics, pair.gears, reach.windows[p]
    roll_position = reach.phi + reach.tooth_pair[p] * kinematics.pitch
    z, width = pair.sections.z, pair.sections.width
    alike = sections_alike(kinematics, gears)
    images = 2.0 if pair.scheme.mirrored else 1.0
    smallest, border = np.inf, False
    meeting, inside, law = _meet(kinematics, gears, windows, roll_position, z[0], room)
    for section in range(len(z)):
        if section > 0 and not alike:
            meeting, inside, law = _meet(kinematics, gears, windows, roll_position, z[section], room)
        gap = meeting.gap + section_deviation(pair.deviations, meeting, z[section], reach.tooth_pair[p])
        gap += meeting.lever * lead
        gap += 0.5 * meeting.lever_slope * max(lead - meeting.corner_lead, 0.0) ** 2
        gap += gap_change(moved, gears, pair.sections, windows, meeting, room.carriers, section)
        smallest = min(smallest, gap)
        if gap >= largest_gap:
            continue
        border = border or (gap < 0.0 and not inside)
        load, slope = line_load(-gap, *law)
        effective = gap if gap >= 0.0 else -load / slope
        stiffness = images * slope * width[section]
        list_point(
            gears, pair.sections, windows, meeting, room.carriers, section, 0, effective, stiffness, lead, count,
            room.points,
        )  # fmt: skip
        count += 1
    return Found(count, smallest, border)
