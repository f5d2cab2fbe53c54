"""Inertias of gears as discs."""

import numpy as np

from pmor.dynamics.gear_model import Inertia, disc, equivalent_mass, gear_model
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
