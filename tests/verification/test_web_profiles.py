"""Webs with a profile, stepped, conical or dished: against plain webs, closed forms of twist, and their images."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import make_case
from pmor.fe.blank_section import Block, hookes_law, ring_stiffness, row_stiffness
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import elastic_model, mesh_model
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import reduced_pair
from tests.support.line_pairs import on_columns

E, NU = 206_000.0, 0.3
SHEAR = 0.5 * E / (1.0 + NU)
ROUND_OFF = 1e-9
SMALL = {
    "teeth": 13, "bore_radius_mm": 8.0, "module_mm": 2.5, "face_width_mm": 12.0, "torque_Nm": 50.0, "scheme": "line",
    "profile_elements": 3, "width_elements": 2, "results": {"root_stress": False}, "error_bar": False,
}  # fmt: skip
WEB = {"rim_thickness_mm": 1.6, "hub_radius_mm": 9.5}
# From one end of the face at the hub to the middle at the rim, with a step.
DISH = [[9.5, -5.0, -1.0], [10.5, -4.0, 0.0], [10.5, -3.0, 0.5], [11.4, 0.0, 2.0]]


def case_of(helix=0.0, **blank):
    return make_case(**SMALL, helix_angle_deg=helix, pinion={"blank": WEB | blank})


def compliance_of(case):
    return elastic_model(case, mesh_model(case)).pinion.compliance


@pytest.mark.parametrize("helix", [0.0, pytest.param(18.0, marks=pytest.mark.slow)])
def test_stations_of_a_straight_web_are_the_plain_web(helix):
    held = {"held_length_mm": 5.0, "hub_width_mm": 11.0}
    plain = compliance_of(case_of(helix, web_thickness_mm=4.0, web_offset_mm=1.0, **held))
    stations = [[9.5, -1.0, 3.0], [10.3, -1.0, 3.0], [11.0, -1.0, 3.0]]
    straight = compliance_of(case_of(helix, web_profile=stations, **held))
    assert_allclose(straight, plain, rtol=0.0, atol=ROUND_OFF * np.abs(plain).max())


@pytest.mark.parametrize("twist", [0.0, 0.02])
def test_rigid_motions_of_a_tapered_row_cost_nothing(twist):
    lines = np.array([[-4.0, 1.0, 5.0], [-1.5, 0.2, 4.0]])
    parts = row_stiffness(Block(np.array([30.0, 33.0]), lines), 0, hookes_law(E, NU), twist)
    r = np.repeat([30.0, 31.5, 33.0], 5)
    z = np.concatenate([[c[0], (c[0] + c[1]) / 2, c[1], (c[1] + c[2]) / 2, c[2]]
                        for c in (lines[0], lines.mean(axis=0), lines[1])])  # fmt: skip
    none, one = np.zeros_like(r), np.ones_like(r)
    motions = {1: [(one, one, none), (z, z, -r)], 0: [(none, r, none), (none, none, one)]}
    for n, listed in motions.items():
        stiffness = parts[0] + n * parts[1] + n * n * parts[2]
        for motion in listed:
            moved = (np.stack(motion, axis=1) * np.exp(1j * n * twist * z)[:, None]).ravel()
            # The twisted phase is no parabola.
            most = (1e-10 if twist == 0.0 else 5e-4) * np.abs(stiffness).max() * r.max()
            assert np.abs(stiffness @ moved).max() < most


def twisted(blocks):
    """Angle of the outermost row that turns as a rigid one, under 1 N mm."""
    stiffness = ring_stiffness(blocks, E, NU, np.array([0]), False)[0]
    turned = np.tile([0.0, blocks[-1].radii[-1], 0.0], len(stiffness) // 3)
    return 1.0 / (turned @ stiffness @ turned)


def disc_twist(radii, thickness):
    """Integral of dr / (2 pi r^3 t G) between radii, t straight between stations, by Simpson's rule."""
    found = 0.0
    for ends, widths in zip(zip(radii, radii[1:], strict=False), thickness, strict=True):
        r = np.linspace(*ends, 2001)
        y = 1.0 / (2.0 * np.pi * r**3 * SHEAR * np.interp(r, ends, widths))
        found += (r[1] - r[0]) / 3.0 * (y[0] + y[-1] + 4.0 * y[1:-1:2].sum() + 2.0 * y[2:-1:2].sum())
    return found


@pytest.mark.parametrize("dish", [0.0, 3.0])
def test_a_tapered_disc_twists_as_the_closed_form_says(dish):
    """4 mm thick at a radius of 25 mm, 2 mm at 71.25: what the closed form leaves out goes with the slope squared."""
    radii = np.linspace(25.0, 71.25, 25)
    share = ((radii - 25.0) / 46.25)[:, None]
    lines = (1.0 - share) * [-2.0, 0.0, 2.0] + share * [dish - 1.0, dish, dish + 1.0]
    # 0.02 squared of each face; 0.065 squared of the dish.
    assert_allclose(twisted((Block(radii, lines),)), disc_twist((25.0, 71.25), [(4.0, 2.0)]),
                    rtol=5e-4 if dish == 0.0 else 5e-3)  # fmt: skip


@cache
def loads_of(case):
    reduced = on_columns(reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis))
    phi = np.linspace(0.0, reduced.meshed.pair.pitch, 5, endpoint=False)
    return sweep_line_loads(reduced, phi, [nominal_condition(case)], recorded=True)


def test_a_mirrored_profile_mirrors_the_load_over_the_face():
    mirrored = [[radius, -high, -low] for radius, low, high in DISH]
    one, other = (loads_of(case_of(web_profile=stations)) for stations in (DISH, mirrored))
    loads, images = (found.states.lines.load_N_per_mm for found in (one, other))
    assert_allclose(images[..., ::-1], loads, rtol=0.0, atol=ROUND_OFF * loads.max())
    assert_allclose(one.ste_um, other.ste_um, rtol=ROUND_OFF)
    carried = loads.sum(axis=(0, 1, 2))
    assert abs(carried[-1] / carried[0] - 1.0) > 0.02, "else the image is none"
