"""Weights of shafts and gears: closed forms, and what bearings carry more."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.beam import NODE, Beam, CircularSection, ShaftMaterial
from pmor.machine.loaded import loaded
from pmor.machine.mesh_force import mesh_frame
from pmor.machine.readings import carried
from pmor.machine.weights import gear_weight
from pmor.rexs.files import load_gearbox as load
from tests.support.gearboxes import SMALL, SMALL_CASE, written
from tests.support.set_gearboxes import one_stage, written_reducer

STEEL, SECTION = ShaftMaterial(210e3, 0.3), CircularSection(50.0, 20.0)
EXACT = 1e-9
# Equilibrium of rolling bearings, of some thousand newtons.
BALANCED_N = 1e-6
DENSITY = 7810.0


@pytest.mark.parametrize("lengths", [[200.0, 200.0], [60.0, 140.0, 30.0, 170.0]])
def test_a_shaft_on_two_bearings_sags_under_its_weight_as_in_closed_form(lengths):
    """Timoshenko's beam under an even load q: 5 q L^4 / (384 E I) + q L^2 / (8 kappa G A) at mid span."""
    beam = Beam(np.cumsum([0.0, *lengths]), [SECTION] * len(lengths), STEEL)
    force = beam.dead_load(np.array([0.0, 0.0, -8e-3]))
    held = [0, 1, 2, 3, len(force) - 5, len(force) - 4]
    free, found = np.setdiff1d(np.arange(len(force)), held), np.zeros(len(force))
    found[free] = np.linalg.solve(beam.stiffness()[np.ix_(free, free)], force[free])
    q, length = -8e-3 * SECTION.area, 400.0
    shear = SECTION.shear_coefficient(0.3) * STEEL.shear_modulus * SECTION.area
    expected = 5.0 * q * length**4 / (384.0 * 210e3 * SECTION.second_moment) + q * length**2 / (8.0 * shear)
    assert_allclose(found[NODE * beam.node_at(200.0) + 2], expected, rtol=EXACT)


def ring(outer, inner, length):
    """Mass of a ring, kg, by its diameters in mm."""
    return 1e-9 * DENSITY * math.pi / 4.0 * (outer**2 - inner**2) * length


def forces(file):
    """Forces of all bearings, N: bearing by bearing."""
    gearbox = loaded(file.model, file.model.sections.loads[0])
    return {one["name"]: np.array(one["force_N"]) for one in carried(gearbox, gearbox.solve())}


def by_weight(path, text, write):
    """What bearings carry more by a weight that has no share along the axis."""
    heavy = forces(load(write(path, text + "[gravity]\ny_m_s2 = 30.0\nz_m_s2 = -40.0\n")))
    light = forces(load(write(path, text)))
    return {name: force - light[name] for name, force in heavy.items()}


def test_bearings_carry_shafts_and_gears(tmp_path):
    """Gears are full to their reference circle; what the output shaft fills of its wheel is shaft."""
    found = by_weight(tmp_path, SMALL, written)
    module = 2.5 / math.cos(math.radians(15.0))
    pinion, wheel = ring(19 * module, 20.0, 16.0), ring(29 * module, 28.0, 16.0)
    masses = ring(20.0, 0.0, 80.0) + pinion, ring(28.0, 8.0, 80.0) + wheel
    for names, mass in zip(("AB", "CD"), masses, strict=True):
        assert_allclose(sum(found[name] for name in names), [0.0, 30.0 * mass, -40.0 * mass], atol=BALANCED_N)


def test_what_a_shaft_fills_of_its_gear_weighs_once(tmp_path):
    """A pinion held within its shaft, as one that is cut from it."""

    def narrow(folder, text):
        path = written(folder, text)
        (folder / "small.toml").write_text(SMALL_CASE.replace("bore_radius_mm = 10.0", "bore_radius_mm = 6.0"))
        return path

    found, expected = (by_weight(tmp_path, SMALL, write) for write in (narrow, written))
    for name, force in expected.items():
        assert_allclose(found[name], force, atol=BALANCED_N)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_gear_that_is_not_centred_weighs_in_the_middle_of_its_own_face(sense):
    """4 to 14 mm along z of its pair, which looks along x or against it: 9 mm from its hub."""
    frame = mesh_frame(np.zeros(2), np.array([60.0, 0.0]), sense)
    found = gear_weight(2.0, (4.0, 14.0), frame, (0.0, 3.0, -5.0))
    assert_allclose(found, [0.0, 6.0, -10.0, 0.0, sense * 9.0 * 10.0, sense * 9.0 * 6.0], atol=1e-12)


def test_a_weight_stands_on_linear_bearings_where_statics_puts_it(tmp_path):
    """The input shaft and its pinion by their levers; mesh forces do not change with a weight."""
    found = by_weight(tmp_path, SMALL, written)
    module, span = 2.5 / math.cos(math.radians(15.0)), 60.0
    moment = ring(20.0, 0.0, 80.0) * 30.0 + ring(19 * module, 20.0, 16.0) * 25.0
    assert_allclose(found["B"][1:], moment / span * np.array([30.0, -40.0]), atol=BALANCED_N)


def test_the_carrier_carries_its_planets(tmp_path):
    """A set seen from its other end has it too."""
    for torque in (300.0, -300.0):
        file = load(written_reducer(tmp_path, one_stage(torque=torque)))
        teeth = file.model.sets["stage"].cases.values()
        inner = next(iter(teeth)).pair
        module = inner.module_mm / math.cos(math.radians(inner.helix_angle_deg))
        bores = [2.0 * gear.bore_radius_mm for gear in (inner.pinion, inner.wheel)]
        gears = [
            ring(gear.teeth * module, bore, gear.face_width_mm or inner.face_width_mm)
            for gear, bore in zip((inner.pinion, inner.wheel), bores, strict=True)
        ]
        found = by_weight(tmp_path, one_stage(torque=torque), written_reducer)
        planets = len(file.model.sets["stage"].plan.planets)
        masses = ring(30.0, 0.0, 60.0) + gears[0], ring(50.0, 0.0, 60.0) + planets * gears[1]
        for name, mass in zip("AB", masses, strict=True):
            assert_allclose(found[name], [0.0, 30.0 * mass, -40.0 * mass], atol=BALANCED_N)
