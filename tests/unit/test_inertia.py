"""Inertias of gears as drawn: discs, and blanks with rim, web, hub and holes."""


import numpy as np
import pytest

from pmor import make_case
from pmor.dynamics.gear_model import equivalent_mass, gear_model
from pmor.gear.inertia import Inertia, disc
from pmor.pair.drawn import gear_inertias
from pmor.pair.model import gear_pair
from tests.support.small_case import case_with


def test_a_ring_is_its_disc_without_the_bore():
    ring, whole, bore = (disc(*radii, 20.0, 7810.0) for radii in ((75.0, 25.0), (75.0, 0.0), (25.0, 0.0)))
    np.testing.assert_allclose(ring.mass_kg, whole.mass_kg - bore.mass_kg, rtol=1e-14)
    np.testing.assert_allclose(ring.polar_kg_m2, whole.polar_kg_m2 - bore.polar_kg_m2, rtol=1e-14)


def test_a_ring_tilts_with_the_second_moment_of_its_mass_about_a_diameter():
    """The integral of density (y^2 + z^2), by Gauss points over radius and width and even steps over the angle."""
    outer, inner, width, density = 0.06, 0.035, 0.05, 7810.0
    points, weights = np.polynomial.legendre.leggauss(4)
    radius = 0.5 * (outer + inner) + 0.5 * (outer - inner) * points[:, None, None]
    z, angle = 0.5 * width * points[:, None], 2.0 * np.pi * np.arange(8) / 8
    mass = (
        density * radius * 0.25 * (outer - inner) * width * np.multiply.outer(weights, weights)[..., None] * np.pi / 4
    )
    expected = (mass * ((radius * np.sin(angle)) ** 2 + z**2)).sum()
    np.testing.assert_allclose(disc(60.0, 35.0, 50.0, density).tilting_kg_m2, expected, rtol=1e-12)


def test_the_mass_along_the_line_of_action_is_that_of_two_masses_on_it():
    """1 / m is the sum of 1 / (I / rb^2), in t."""
    pinion, wheel = Inertia(1.0, 0.002, 0.001), Inertia(5.0, 0.03, 0.02)
    exact = 1e-3 / (0.05**2 / 0.002 + 0.11**2 / 0.03)
    np.testing.assert_allclose(equivalent_mass(pinion, wheel, (50.0, 110.0)), exact, rtol=1e-14)


def test_an_inertia_that_is_given_tilts_with_half_of_what_it_adds_to_that_of_the_disc():
    """A body of revolution, I_tilt = I_polar / 2 + the integral of z^2: the length of the gear is that of its disc."""
    drawn, given = (
        gear_model(case, gear_pair(case)).inertias[0]
        for case in (case_with(dynamics=keys) for keys in ({}, {"pinion_inertia_kg_m2": 0.02}))
    )
    assert given.polar_kg_m2 == 0.02 > 2.0 * drawn.polar_kg_m2
    added = 0.5 * (given.polar_kg_m2 - drawn.polar_kg_m2)
    np.testing.assert_allclose(given.tilting_kg_m2 - drawn.tilting_kg_m2, added, rtol=1e-12)


BLANK = {"rim_thickness_mm": 3.0, "web_thickness_mm": 4.0, "hub_radius_mm": 12.0, "hub_width_mm": 16.0}


def blank_case(**further):
    return make_case(teeth=24, bore_radius_mm=8.0, module_mm=2.5, face_width_mm=10.0, torque_Nm=50.0, scheme="line",
                     pinion={"blank": BLANK | {"web_offset_mm": 1.5} | further})  # fmt: skip


@pytest.mark.parametrize("long", [0.0, 35.0])
def test_a_blank_has_the_mass_of_its_body_point_by_point(long):
    """All of rim, web, hub and holes as points of a fine grid, without a formula of a ring."""
    holes = {"count": 5, "radius_mm": 2.0, "on_radius_mm": 17.5, "length_deg": long, "first_deg": 20.0}
    case = blank_case(holes=holes)
    pair = gear_pair(case)
    found = gear_inertias(case, pair)[0]
    outer, rim = pair.pinion.reference_radius, pair.pinion.root_radius - 3.0
    step = outer / 300.0
    x, y = np.meshgrid(*[(np.arange(-300, 300) + 0.5) * step] * 2)
    r = np.hypot(x, y)
    turn = np.radians(20.0 + 72.0 * np.arange(5))[:, None, None]
    # The nearest place that the middle of a hole comes to as it goes along its slot.
    beside = np.angle(np.exp(1j * (np.arctan2(y, x) - turn)))
    turn = turn + np.clip(beside, -0.5 * np.radians(long), 0.5 * np.radians(long))
    hole = (np.hypot(x - 17.5 * np.cos(turn), y - 17.5 * np.sin(turn)) < 2.0).any(axis=0)
    parts = (
        ((r < outer) & (r > rim), -5.0, 5.0), ((r < rim) & (r > 12.0) & ~hole, -0.5, 3.5),
        ((r < 12.0) & (r > 8.0), -8.0, 8.0),
    )  # fmt: skip
    cell = 7810.0 * 1e-9 * step**2
    mass = sum(cell * inside.sum() * (high - low) for inside, low, high in parts)
    polar = 1e-6 * sum(cell * (r**2)[inside].sum() * (high - low) for inside, low, high in parts)
    long = 1e-6 * sum(cell * inside.sum() * (high**3 - low**3) / 3.0 for inside, low, high in parts)
    # A circle over squares of a 300th of the radius.
    np.testing.assert_allclose((found.mass_kg, found.polar_kg_m2), (mass, polar), rtol=1e-3)
    np.testing.assert_allclose(found.tilting_kg_m2, 0.5 * polar + long, rtol=1e-3)


def test_a_web_with_a_profile_has_the_mass_of_its_closed_form():
    """Cone between radii of 13 and 19 mm, steps beside it: t = a + b r, its mass 2 pi rho (a r^2 / 2 + b r^3 / 3)."""
    stations = [[13.0, -4.0, 4.0], [19.0, -1.0, 2.0], [19.0, -0.5, 1.0]]
    case = blank_case(web_thickness_mm=None, web_offset_mm=None, web_profile=stations)
    pair = gear_pair(case)
    found, rim = gear_inertias(case, pair)[0], pair.pinion.root_radius - 3.0
    slope = (3.0 - 8.0) / 6.0
    at_axis = 8.0 - 13.0 * slope
    web, polar = (
        2.0 * np.pi * (8.0 * (13.0**n - 12.0**n) / n + at_axis * (19.0**n - 13.0**n) / n
                       + slope * (19.0 ** (n + 1) - 13.0 ** (n + 1)) / (n + 1) + 1.5 * (rim**n - 19.0**n) / n)
        for n in (2, 4)
    )  # fmt: skip
    rest = disc(pair.pinion.reference_radius, rim, 10.0, 7810.0) + disc(12.0, 8.0, 16.0, 7810.0)
    np.testing.assert_allclose(found.mass_kg - rest.mass_kg, 7810e-9 * web, rtol=1e-12)
    np.testing.assert_allclose(found.polar_kg_m2 - rest.polar_kg_m2, 7810e-15 * polar, rtol=1e-12)
    along = 0.5 * 7810e-15 * polar
    r = 12.0 + (np.arange(200_000) + 0.5) * (rim - 12.0) / 200_000
    low, high = (np.interp(r, *np.array([[s[0], s[k]] for s in stations]).T) for k in (1, 2))
    along += 7810e-15 * (2.0 * np.pi * r * (high**3 - low**3) / 3.0).sum() * (rim - 12.0) / 200_000
    np.testing.assert_allclose(found.tilting_kg_m2 - rest.tilting_kg_m2, along, rtol=1e-6)  # by so many rings


def test_motion_takes_the_inertia_of_the_blank():
    case = blank_case()
    pair = gear_pair(case)
    assert gear_model(case, pair).inertias == gear_inertias(case, pair)
