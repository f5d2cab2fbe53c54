"""One line load for each section, nonlinear in the approach of the flanks (`pmor.line.hertz`)."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import compiled
from pmor.line.kernels.contact_point import roll_of
from pmor.line.kernels.tip_corner import NEAREST, SHORT, LineLaw, corner_approach, corner_at, single_mean

# Least relative curvature, over the curvatures of both flanks. A tip far beyond the path meets a ring where the ring is
# more curved than the tip: within the patch the wedge between them counts, and not that they would meet further inside.
FLATTEST = 0.01
# Least slope of the approach, over the compliance. Where the half-width comes near the depth of the layer the law would
# be flatter, and end; it goes on straight, so that the energy is convex on the way to any solution.
LEAST_SLOPE = 0.5


@compiled
def _smooth_approach(load, law, corners, mesh):
    """Approach of the flanks under a line load above the least one, and its derivative."""
    if load <= law.plain:
        shape = law.constant - 0.5 * np.log(load)
        if shape < 0.5 + LEAST_SLOPE:
            widest = np.exp(2.0 * (law.constant - 0.5 - LEAST_SLOPE))
            return law.compliance * (LEAST_SLOPE * load + 0.5 * widest), LEAST_SLOPE * law.compliance
        return law.compliance * load * shape, law.compliance * (shape - 0.5)
    return corner_approach(load, law, corner_at(corners, mesh, int(law.corner)))


@compiled
def load_at(half_length, law):
    """Return the line load (N/mm) that a patch of some half-length (mm) needs at least.

    Hertz's on flank or arc, or that of a wedge: (4) of `pmor.line.kernels.tip_corner`, Q >= kappa / 2 and Q >= P / 2.
    """
    wedge = law.angle
    if law.edge_curvature > 0.0:
        wedge = min(wedge, law.edge_curvature * half_length)
    return 0.5 * half_length * max(law.curvature * half_length, wedge) / law.compliance


@compiled
def widest_load(law):
    """Line load where the half-width comes near the depth of the layer, N/mm: A - ln(w) / 2 is 1/2 + `LEAST_SLOPE`."""
    return load_at(np.exp(law.opening - LEAST_SLOPE), law)


@compiled
def approach_of(load, law, corners, mesh=0):
    """Approach of flanks under a line load (N/mm) and its derivative; linear below the least, past the widest.

    `corners` are those of several meshes.
    """
    if load <= law.least:
        slope = _smooth_approach(law.least, law, corners, mesh)[0] / law.least
        return slope * load, slope
    if load > law.plain:
        widest = widest_load(law)
        if load > widest:
            approach, slope = _smooth_approach(widest, law, corners, mesh)
            return approach + slope * (load - widest), slope
    return _smooth_approach(load, law, corners, mesh)


@compiled
def line_law(gears, layers, contact_point, carriers):
    """`LineLaw` where two flanks meet.

    Of helical flanks along the transverse line of action: the approach normal to the flanks over the cosine of the base
    helix angle, at the curvature and the depth of the layer normal to them.
    """
    compliance, constant, curvature, bent = 0.0, 0.0, 0.0, 0.0
    cosine = 1.0 / np.sqrt(1.0 + (gears[0].twist * gears[0].base_radius) ** 2)
    near, nearest, inside = -1, 1.0, 0.0
    for number in range(4):
        distance, influence_length = _from_corner(gears, layers, contact_point, number, cosine)
        if distance < nearest * influence_length:
            near, nearest, inside = number, distance / influence_length, distance
    for gear in range(2):
        flank, layer, value, roll = gears[gear], layers[gear], 0.0, roll_of(contact_point, gear)
        for a in range(4):
            row = min(carriers.row[gear] + a, len(layer.constant) - 1)
            value += carriers.weight[gear, a] * layer.constant[row]
        for number in range(gear, 4, 2):
            if number != near:
                corner = _corner(layers, number)
                distance, influence_length = _from_corner(gears, layers, contact_point, number, cosine)
                value += single_mean(corner, max((corner.place + distance) / influence_length, NEAREST))
        compliance += layer.compliance
        constant += layer.compliance * value
        own = 1.0 / (flank.base_radius * max(roll, 1e-3))
        curvature, bent = curvature + own, bent + abs(own)
    curvature = max(curvature, FLATTEST * bent)
    constant = constant / compliance + np.log(cosine)
    least = 1e-9 / (compliance * curvature * cosine)
    law = LineLaw(
        compliance=compliance / cosine, constant=constant - 0.5 * np.log(2.0 * compliance / (cosine * curvature)),
        least=least, plain=np.inf, corner=0.0, opening=constant - 0.5, angle=0.0, curvature=curvature,
        edge_curvature=0.0, place=0.0, influence_length=1.0, share=0.0,
    )  # fmt: skip
    return law if near < 0 else _law_near_corner(gears, layers, contact_point, near, inside, cosine, law)


@compiled
def _corner(layers, number):
    layer = layers[number % 2]
    return layer.tip if number < 2 else layer.undercut


@compiled
def _from_corner(gears, layers, contact_point, number, cosine):
    """Distance along the flank from a corner, by its number in `LineLaw`, and that over which it is felt, mm."""
    flank, corner, roll = gears[number % 2], _corner(layers, number), roll_of(contact_point, number % 2)
    distance = np.inf
    if number < 2:
        distance = 0.5 * max(flank.base_radius * (flank.tip_roll**2 - roll**2), 0.0)
    elif flank.undercut_roll > 0.0:
        distance = 0.5 * flank.base_radius * max(roll**2 - flank.undercut_roll**2, 0.0)
    return distance, corner.influence_length * corner.depth * cosine


@compiled
def _law_near_corner(gears, layers, contact_point, near, inside, cosine, law):
    """Complete a law with the corner `near`; the flanks meet `inside` (mm) of its edge or at it."""
    gear, corner = near % 2, _corner(layers, near)
    flank, mate = gears[gear], gears[1 - gear]
    share = layers[gear].compliance / (layers[0].compliance + layers[1].compliance)
    place, influence_length, edge = corner.place, corner.influence_length * corner.depth * cosine, 0.0
    if near < 2 and flank.edge_radius > 0.0:
        edge = 1.0 / flank.edge_radius + 1.0 / (mate.base_radius * max(roll_of(contact_point, 1 - gear), 1e-3))
    if inside > 0.0:
        angle, short = -law.curvature * inside, min(SHORT * (place + inside), inside)
        constant = law.constant + share * single_mean(corner, (place + inside) / influence_length)
    else:
        angle, short, constant = contact_point.slant, 0.0, law.constant
    plain = 0.5 * law.curvature * short**2 / law.compliance
    return LineLaw(
        compliance=law.compliance, constant=constant, least=law.least, plain=plain, corner=float(near),
        opening=law.opening, angle=angle, curvature=law.curvature, edge_curvature=edge, place=place,
        influence_length=influence_length, share=share,
    )  # fmt: skip


@compiled
def sections_alike(kinematics, gears):
    """Whether undeformed flanks meet in the same way in all sections."""
    return kinematics.slope_x == 0.0 and kinematics.slope_y == 0.0 and gears[0].twist == 0.0
