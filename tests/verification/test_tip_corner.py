"""Line contact at a tip corner: against strips of pressure on the wedge, and against the solid that it stands for.

Lengths are in depths of the layer, loads in W = C w: for the paper's gear W = 1e-3 is 150 N/mm. Strips are free to
choose where they carry; they know the layer's end by the function H that finite elements gave, and the other gear as a
bonded layer without an end.
"""

import math
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.condition import PLAIN
from pmor.line.bonded_layer import bonded_layer_constant
from pmor.line.kernels.law import approach_of, load_at, widest_load
from pmor.line.kernels.places import place_lines
from pmor.line.kernels.pressure import edge_pressure
from pmor.line.kernels.tip_corner import LineLaw, contact_patch, corner_approach, single_mean
from pmor.line.tip_corner import INFLUENCE_LENGTH, corner_coefficients, wedge_softness
from pmor.pair.conditions import nominal_condition
from tests.programs.ended_layer import ended_layer, patch_means, smooth_rest
from tests.support.line_laws import corner_law, corner_of, corners_of
from tests.support.line_pairs import small_pair
from tests.support.small_case import case_with, full_fe
from tests.support.states import states_at

ANGLE, POISSON, RADIUS = math.radians(121.0), 0.3, 5.0  # the paper's tip, a flank of 8 mm on a layer of 1.6 mm
OPENING = bonded_layer_constant(POISSON) + math.log(2.0)
LOADS = (1e-5, 1e-4, 1e-3, 1e-2)
ANGLES_DEG = (-3.0, -1.0, -0.3, 0.0, 0.3, 1.0, 2.0)
# 0, 0.1 and 0.5 mm on the paper's gear.
ROUNDINGS = (0.0, 0.0625, 0.3125)


@cache
def layer_end():
    return ended_layer(ANGLE, POISSON)


def law_at(angle_deg, rounding):
    """Corner and law; a rounding takes its tangent's length off the flank."""
    corner = corner_of(ANGLE, POISSON, place=rounding / math.tan(0.5 * ANGLE))
    return corner, corner_law(corner, 1.0, OPENING, math.radians(angle_deg), 1.0 / RADIUS, rounding)


def gap_of(law, s):
    """Gap along the flank of the corner, less that where the flanks would touch."""
    curvature = np.where(s < 0.0, law.edge_curvature, law.curvature)
    touching = law.curvature if law.angle < 0.0 else law.edge_curvature
    least = 0.5 * law.angle**2 / touching if touching > 0.0 else 0.0
    return law.angle * s + 0.5 * curvature * s**2 + least


def strips(law, size, count=240):
    """Approach, pressure and its places under a load, by strips of even pressure that carry where they want to.

    Twice as many strips move the approach by less than 1e-5.
    """
    patch = contact_patch(size, law.angle, law.curvature, law.edge_curvature)
    ends = patch.middle - 1.3 * patch.length, patch.middle + 1.3 * patch.length
    if law.edge_curvature == 0.0 and ends[0] < 0.0:  # finer towards the corner, where the pressure is singular
        edges = ends[1] * np.linspace(0.0, 1.0, count + 1) ** 2
    else:
        edges = np.linspace(max(ends[0], 1e-9 - law.place), ends[1], count + 1)
    middle, width = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    across = edges - middle[:, None]
    integral = np.diff(across * (np.log(np.abs(across)) - 1.0), axis=1)  # of ln|x - s| over each strip
    ending = layer_end()(law.place + middle[:, None], np.broadcast_to(law.place + middle, (count, count)))
    moves = -integral + (OPENING - math.log(2.0) + law.share * ending) * width
    gap, carries = gap_of(law, middle), np.abs(middle - patch.middle) < patch.length
    for _ in range(60):
        index = np.flatnonzero(carries)
        matrix = np.zeros((len(index) + 1,) * 2)
        matrix[:-1, :-1], matrix[:-1, -1], matrix[-1, :-1] = moves[np.ix_(index, index)], -1.0, width[index]
        *pressure, approach = np.linalg.solve(matrix, np.append(-gap[index], size))
        whole = np.zeros(count)
        whole[index] = pressure
        inside = whole[index] > 0.0
        if inside.all():
            closed = ~carries & (gap + moves @ whole < approach)
            if not closed.any():
                return approach, middle, whole
            carries |= closed
        else:
            carries[index[~inside]] = False
    raise AssertionError("strips do not settle")


# --- the layer's end -----------------------------------------------------------------------------------------------


def test_a_layer_is_bonded_far_from_its_end_and_a_wedge_at_it():
    """Flamant's wedge by finite elements, and the constant of the layer from its Fourier transform."""
    loads = np.array([1e-4, 1e-3, 4.0])
    along, down = smooth_rest(ANGLE, POISSON, loads, taper=0.0)
    under = [np.interp(s, along, column) for s, column in zip(loads, down.T, strict=True)]
    # Measured 7e-4, with a load 4 from the end and from the other, held one.
    assert_allclose(under[2], bonded_layer_constant(POISSON), atol=2e-3)
    # Measured 0.2 %, of R - 1 another 0.6 %: at 1e-3 the layer is felt a little.
    assert_allclose(1.0 + (under[0] - under[1]) / math.log(10.0), wedge_softness(ANGLE), rtol=4e-3)


def test_softness_of_the_half_plane_is_one_and_of_the_quarter_the_known_one():
    assert_allclose(wedge_softness(math.pi), 1.0, rtol=1e-14)
    # A quarter-plane: cos^2 = sin^2 = 1/2 over pi/4 +- 1/2.
    assert_allclose(wedge_softness(0.5 * math.pi), 0.25 * math.pi * (1 / (math.pi / 4 + 0.5) + 1 / (math.pi / 4 - 0.5)))


@pytest.mark.parametrize(
    ("middle", "spread"), [pytest.param(0.03, 1.0, marks=pytest.mark.slow), (0.3, 0.0), (0.3, 0.5), (0.8, 0.3)]
)
def test_table_holds_what_finite_elements_give(middle, spread):
    """At an angle between those that were solved. The fit is within 0.006, of the 8 to 13 of the whole approach."""
    y, coefficients = middle / INFLUENCE_LENGTH, corner_coefficients(ANGLE, POISSON)
    found = []
    for k in range(3):
        powers = np.outer(y ** np.arange(5), spread ** (2 * np.arange(3)))
        found.append(spread**k * (1.0 - y) ** 2 * np.sum(coefficients[k] * powers))
    found[0] += (wedge_softness(ANGLE) - 1.0) * (-math.log(y) - (1.0 - y) - 0.5 * (1.0 - y) ** 2)
    assert_allclose(found, patch_means(layer_end(), middle, spread), rtol=0.0, atol=0.008)
    if spread == 0.0:
        assert_allclose(single_mean(corner_of(ANGLE, POISSON), y), found[0], rtol=1e-12)


# --- the law -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rounding", ROUNDINGS)
@pytest.mark.parametrize("angle", ANGLES_DEG)
def test_approach_is_that_of_strips_on_the_wedge(angle, rounding):
    corner, law = law_at(angle, rounding)
    for size in LOADS:
        approach, _ = corner_approach(size, law, corner)
        # Measured: 0.34 % at a sharp edge, 0.27 % at 0.1 mm, 0.05 % at 0.5 mm; without the layer's end up to 12 %,
        # with its mean over the patch alone 0.8 %.
        assert_allclose(approach, strips(law, size)[0], rtol=5e-3)


@pytest.mark.parametrize(("angle", "rounding"), [(-0.3, 0.0625), (0.3, 0.0625), (1.0, 0.3125), (-1.0, 0.3125)])
def test_peak_pressure_and_length_at_a_rounded_edge_are_those_of_strips(angle, rounding):
    _, law = law_at(angle, rounding)
    patch = contact_patch(1e-3, law.angle, law.curvature, law.edge_curvature)
    _, place, pressure = strips(law, 1e-3, 480)
    # Pressure and length are those of half-planes: on the wedge the patch is 1 to 3 % longer, its peak 1 to 4 % lower.
    assert_allclose(edge_pressure(patch, law), pressure.max(), rtol=0.05)
    assert_allclose(2.0 * patch.length, np.ptp(place[pressure > 0.0]), rtol=0.04)


@pytest.mark.parametrize("rounding", ROUNDINGS)
@pytest.mark.parametrize("angle", ANGLES_DEG)
def test_no_patch_is_longer_than_the_load_allows(angle, rounding):
    _, law = law_at(angle, rounding)
    for half_length in (0.01, 0.1, 0.5):
        size = law.compliance * load_at(half_length, law)
        patch = contact_patch(size, law.angle, law.curvature, law.edge_curvature)
        assert patch.length <= half_length * (1.0 + 1e-12)
        assert patch.length > 0.3 * half_length or rounding > 0.0  # an arc that carries alone is far shorter


@pytest.mark.parametrize("rounding", ROUNDINGS)
@pytest.mark.parametrize("angle", ANGLES_DEG)
def test_approach_rises_with_its_slope(angle, rounding):
    corner, law = law_at(angle, rounding)
    corners = corners_of(corner)
    for load in np.geomspace(law.least, 2.0 * widest_load(law), 25):
        approach, slope = approach_of(load, law, corners)
        step = 1e-5 * load
        below, above = (approach_of(load + side * step, law, corners)[0] for side in (-1.0, 1.0))
        assert slope > 0.0
        if load > 1.01 * law.least:  # where the straight part ends the slope jumps
            assert_allclose((above - below) / (2.0 * step), slope, rtol=1e-5)


@pytest.mark.parametrize("rounding", ROUNDINGS)
@pytest.mark.parametrize("size", LOADS)
def test_law_is_continuous_with_hertz_where_the_edge_leaves(size, rounding):
    """On flank and arc; the slope jumps a little, for it takes the end of the patch from half-planes."""
    corner, law = law_at(0.0, rounding)
    leaves = [-math.sqrt(2.0 * size * law.curvature)]
    if rounding > 0.0:
        leaves.append(math.sqrt(2.0 * size * law.edge_curvature))
    for angle in leaves:
        (inner, inner_slope), (outer, outer_slope) = (
            corner_approach(size, law._replace(angle=angle * f), corner) for f in (1.0 - 1e-7, 1.0 + 1e-7)
        )
        assert_allclose(inner, outer, rtol=1e-6)
        # Measured: 0.38 to 0.68 % at a sharp edge, 0.015 % at rounded ones.
        assert_allclose(inner_slope, outer_slope, rtol=8e-3 if rounding == 0.0 else 3e-4)


def test_a_small_rounding_comes_down_to_the_sharp_edge():
    corner, sharp = law_at(0.3, 0.0)
    _, rounded = law_at(0.3, 1e-7)
    for size in LOADS:
        expected = corner_approach(size, sharp, corner)
        found = corner_approach(size, rounded._replace(place=0.0), corner)
        # The touching point of the arc is 1e-8 beside the edge.
        assert_allclose(found, expected, rtol=1e-4)


# --- on gears ------------------------------------------------------------------------------------------------------


@cache
def plane_pair(**pinion):
    mesh = {"element": "hex20", "profile_elements": 6, "width_elements": 1, "width": "plane_strain"}
    case = case_with(
        pinion=pinion, contact={"scheme": "line"}, reduction=None, mesh=mesh, results={"root_stress": False}
    )
    return case, full_fe(case)


@pytest.mark.parametrize("end", ["entry", "exit"])
@pytest.mark.parametrize(
    "pinion", [{}, {"tip_rounding_mm": 0.2}, pytest.param({"tip_chamfer_mm": 0.2}, marks=pytest.mark.slow)]
)
def test_gap_and_approach_go_on_smoothly_over_the_end_of_the_path(end, pinion):
    """Where the contact passes from the flank to its edge, under one load."""
    meshed = plane_pair(**pinion)[1].mesh.meshed
    gears, kinematics, z = meshed.gears, meshed.kinematics(PLAIN.misalignment), np.zeros(1)
    start, stop = meshed.pair.roll_position_range
    at, step = (start, 1e-5) if end == "entry" else (stop, -1e-5)
    gear, total = int(end == "exit") ^ 1, []
    for n in (-2, -1, 1, 2):
        position = np.array([at + n * step])
        lines = place_lines(position, kinematics, gears, meshed.kernel_layers, z, 3, 2)
        own = -lines.first_pair[0]
        gap, law = lines.gap[0, own], LineLaw(*lines.law[0, own])
        assert law.corner == gear
        assert (law.angle > 0.0) == (n < 0)
        total.append(gap + corner_approach(120.0, law, meshed.kernel_layers[gear].tip)[0])
    outer, across, inner = np.diff(total) / [1.0, 2.0, 1.0]
    assert_allclose([outer, inner], across, rtol=0.02, atol=2e-7)


def test_law_goes_on_where_the_end_of_the_layer_begins_to_see_the_patch():
    """Where the approach jumps an advance has no solution; at the first phase the last line asks for such a one."""
    lines = small_pair().lines
    pair, corners = lines.meshed.pair, lines.meshed.corners
    start, stop = pair.roll_position_range
    inside = np.geomspace(1e-9, 0.03, 12)  # rad: from the edge to a third of the depth
    phi = np.array([0.5338541666666666 * pair.pitch, *(start + inside), *(stop - inside)])
    placed = lines.place(phi, PLAIN.misalignment)
    laws = [law for row in placed.lines.law for law in map(LineLaw._make, row) if 0.0 < law.plain < math.inf]
    assert len(laws) > 2 * len(inside)
    for law in laws:
        below, above = (approach_of(law.plain * f, law, corners)[0] for f in (1.0 - 1e-9, 1.0 + 1e-9))
        assert_allclose(above, below, rtol=1e-8)
    assert placed.solve(np.array([3.302487946341336e-06 / pair.pinion.base_radius]), held=True).converged.all()


def test_work_of_both_torques_is_the_same_over_a_mesh_cycle():
    """What is stored comes back: the wheel does on average what the pinion is given."""
    case, model = plane_pair()
    meshed, ratio = model.mesh.meshed, []
    pair = meshed.pair
    for phi in pair.pitch * (np.arange(60) + 0.5) / 60:
        (state,) = states_at(model, phi, [nominal_condition(case)])
        ratio.append(state.wheel_torque / (1e3 * case.torque_Nm) * pair.pinion.teeth / pair.wheel.teeth)
    # Where a corner carries the torques differ by up to 1 %; measured on average 2e-6.
    assert np.ptp(ratio) > 5e-3
    assert_allclose(np.mean(ratio), 1.0, atol=2e-5)
