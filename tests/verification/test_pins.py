"""Planets on pins in a carrier: beams in closed form, one stiffness matrix of all parts, sets whose planets tilt."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.beam import NODE, Beam, CircularSection, ShaftMaterial
from pmor.line.hubs import HUB
from pmor.sets.loader import load
from pmor.sets.model import SetBody
from pmor.sets.pins import pin_shapes, planet_on_pin
from pmor.sets.run import run
from pmor.sets.settings import Carrier, PinBearing, Pins, SetSections
from pmor.sets.settings import Planets as PlanetsKeys
from pmor.sets.supports import planets_in_carrier
from tests.support.line_pairs import sections_on_columns
from tests.support.small_sets import NO_STRESS, SMALL_SET, written_set

# Closed forms, and rounding of small systems.
EXACT = 1e-9
# Solutions by Newton's method, to its tolerance.
SOLVED = 1e-8
LENGTH, DIAMETER, RADIUS = 60.0, 30.0, 78.0
MODULUS, POISSON = 210e3, 0.3
BEND = MODULUS * np.pi * DIAMETER**4 / 64.0
SHEAR = 6.0 * 1.3 / (7.0 + 6.0 * POISSON) * MODULUS / 2.6 * np.pi * DIAMETER**2 / 4.0
PINS = Pins(
    diameter_mm=DIAMETER, length_mm=LENGTH, bearings=(PinBearing(at_mm=-12.0), PinBearing(at_mm=12.0))
)  # fmt: skip
MIDDLE = (PinBearing(at_mm=0.0, tilt_Nmm_per_rad="rigid"),)


def across(pins):
    """Displacement and slope of a planet along x under a force and a moment."""
    return planet_on_pin(pins).compliance[np.ix_([0, 4], [0, 4])]


def test_a_bearing_in_the_middle_of_a_supported_pin_gives_as_the_beam_in_the_book():
    found = across(replace(PINS, ends="supported", bearings=MIDDLE))
    expected = [[LENGTH**3 / (48.0 * BEND) + LENGTH / (4.0 * SHEAR), 0.0],
                [0.0, LENGTH / (12.0 * BEND) + 1.0 / (LENGTH * SHEAR)]]  # fmt: skip
    assert_allclose(found, expected, rtol=EXACT, atol=1e-20)


def test_a_clamped_pin_with_two_bearings_gives_as_the_beam_in_the_book():
    """Two equal forces F: the moment of the clamp is F a (L - a) / L, and shear ends at the bearings."""
    a = 0.5 * LENGTH - 12.0
    clamp = a * (LENGTH - a) / LENGTH
    bends = (clamp * a**2 / 2.0 - a**3 / 6.0) / BEND
    assert across(PINS)[0, 0] == pytest.approx(0.5 * (bends + a / SHEAR), rel=EXACT)
    soft = (PinBearing(at_mm=-12.0, radial_N_per_mm=1e5), PinBearing(at_mm=12.0, radial_N_per_mm=1e5))
    assert across(replace(PINS, bearings=soft))[0, 0] == pytest.approx(across(PINS)[0, 0] + 0.5e-5, rel=EXACT)


@pytest.mark.parametrize(("cheek", "side"), [("-z", 1.0), ("+z", -1.0)])
def test_a_flying_pin_tilts_its_planet_away_from_the_cheek(cheek, side):
    a = 0.5 * LENGTH
    found = across(replace(PINS, cheeks=cheek, bearings=MIDDLE))
    both = side * a**2 / (2.0 * BEND)
    assert_allclose(found, [[a**3 / (3.0 * BEND) + a / SHEAR, both], [both, a / BEND]], rtol=EXACT)


def planets(said, clockwise=False, stiffness=None):
    """Three planets on a circle, as a plan has them."""
    angles = (-1.0 if clockwise else 1.0) * 2.0 * np.pi / 3.0 * np.arange(3)
    bodies = [SetBody(f"{a}", "planet", -RADIUS * np.sin(a), RADIUS * np.cos(a)) for a in angles]
    return planets_in_carrier(said, bodies, clockwise, stiffness)


def sections(pins, **carrier):
    return SetSections(title="", pins=pins, planets=PlanetsKeys(count=3), carrier=Carrier(**carrier), members={})


def test_planets_pins_and_carrier_are_one_stiffness_matrix_of_all_parts():
    """With bearings that tilt and a third one, whose forces statics alone does not tell; the work is all stored."""
    rng = np.random.default_rng(5)
    bearings = (
        PinBearing(at_mm=-12.0, radial_N_per_mm=2e5, tilt_Nmm_per_rad=4e7), PinBearing(at_mm=1.0, radial_N_per_mm=3e5),
        PinBearing(at_mm=13.0, radial_N_per_mm=4e5, tilt_Nmm_per_rad=1e7),
    )  # fmt: skip
    root = rng.normal(size=(36, 36))
    scale = np.tile([1e3, 1e3, 1e3, 1e5, 1e5, 1e5], 6)
    stiffness = scale[:, None] * (root @ root.T + 36.0 * np.eye(36)) * scale
    found = planets(sections(replace(PINS, bearings=bearings, middle_mm=4.0)), stiffness=stiffness)
    beam = Beam(np.array([-26.0, -12.0, 1.0, 13.0, 34.0]), [CircularSection(DIAMETER)] * 4,
                ShaftMaterial(MODULUS, POISSON))  # fmt: skip
    hubs, seats = 3 * HUB, 36
    whole = np.zeros((hubs + seats + 3 * 3 * NODE,) * 2)
    gaps, strained = 1e-2 * rng.normal(size=(3, 3, 4)) * [1.0, 1.0, 1e-2, 1e-2], np.zeros(len(whole))
    whole[hubs : hubs + seats, hubs : hubs + seats] = stiffness
    # Axes of the beam x, y, z are z, x, y of the set.
    order = np.array([1, 2, 0, 4, 5, 3])
    to_set = np.kron(np.eye(5), np.eye(6)[order])
    in_set = to_set @ beam.stiffness() @ to_set.T
    lateral = np.array([0, 1, 3, 4])
    for planet in range(3):
        inner = hubs + seats + 3 * NODE * planet
        nodes = [hubs + 12 * planet, inner, inner + 6, inner + 12, hubs + 12 * planet + 6]
        rows = np.concatenate([node + lateral for node in nodes])
        own = np.concatenate([6 * n + lateral for n in range(5)])
        whole[np.ix_(rows, rows)] += in_set[np.ix_(own, own)]
        for number, (bearing, node) in enumerate(zip(bearings, nodes[1:4], strict=True)):
            gap = np.zeros((4, len(whole)))
            for plane, (shift, turn, sign) in enumerate(((0, 4, 1.0), (1, 3, -1.0))):
                hub = HUB * planet
                gap[plane, [hub + shift, hub + turn, node + shift]] = 1.0, sign * bearing.at_mm, -1.0
                gap[2 + plane, [hub + turn, node + turn]] = sign, -sign
            tilt = 0.0 if bearing.tilt_Nmm_per_rad == "free" else bearing.tilt_Nmm_per_rad
            springs = np.diag([bearing.radial_N_per_mm] * 2 + [tilt] * 2)
            whole += gap.T @ springs @ gap
            strained += gap.T @ springs @ gaps[planet, number]
    kept = np.flatnonzero(np.diagonal(whole))
    wrench = np.zeros(len(whole))
    wrench[:hubs].reshape(3, HUB)[:, lateral] = rng.normal(size=(3, 4)) * [1e3, 1e3, 1e4, 1e4]
    moved = np.zeros(len(whole))
    moved[kept] = np.linalg.solve(whole[np.ix_(kept, kept)], wrench[kept])
    told = found.compliance @ wrench[:hubs]
    places = (HUB * np.arange(3)[:, None] + lateral).ravel()
    assert_allclose(told[places], moved[places], rtol=EXACT)
    assert wrench @ moved == pytest.approx(moved @ whole @ moved, rel=EXACT)
    loads = found.on_bearings(wrench[:hubs].reshape(3, HUB))
    for planet in range(3):
        for number, bearing in enumerate(bearings):
            node = hubs + seats + 3 * NODE * planet + 6 * number
            hub = HUB * planet
            apart = moved[hub] + bearing.at_mm * moved[hub + 4] - moved[node]
            assert loads[planet, number, 0] == pytest.approx(bearing.radial_N_per_mm * apart, rel=1e-6)
    apart = np.zeros(len(whole))
    apart[kept] = np.linalg.solve(whole[np.ix_(kept, kept)], strained[kept])
    told = found.moved(np.zeros((3, HUB)), gaps).ravel()
    assert_allclose(told[places], apart[places], rtol=EXACT, atol=EXACT * np.abs(apart).max())
    moved += apart
    loads = found.on_bearings(wrench[:hubs].reshape(3, HUB), gaps)
    for planet in range(3):
        for number, bearing in enumerate(bearings):
            node = hubs + seats + 3 * NODE * planet + 6 * number
            hub = HUB * planet
            way = moved[hub] + bearing.at_mm * moved[hub + 4] - moved[node] - gaps[planet, number, 0]
            assert loads[planet, number, 0] == pytest.approx(bearing.radial_N_per_mm * way, rel=1e-6)


def test_a_pin_and_its_planet_part_at_bearings_by_what_these_give_and_meet_the_carrier_at_the_ends():
    soft = (PinBearing(at_mm=-12.0, radial_N_per_mm=2e5), PinBearing(at_mm=15.0, radial_N_per_mm=4e5))
    said = sections(replace(PINS, bearings=soft), windup_Nmm_per_rad=3e9, torque_at="-z")
    found, rng = planets(said), np.random.default_rng(4)
    wrench = np.zeros((3, HUB))
    wrench[:, [0, 1, 3, 4]] = rng.normal(size=(3, 4)) * [5e3, 5e3, 1e4, 1e4]
    shapes = pin_shapes(said.pins, found, wrench, np.array([-12.0, 15.0, -30.0, 30.0]))
    moved, loads = (found.compliance @ wrench.ravel()).reshape(3, HUB), found.on_bearings(wrench)
    for number, bearing in enumerate(soft):
        x, y = moved[:, 0] + bearing.at_mm * moved[:, 4], moved[:, 1] - bearing.at_mm * moved[:, 3]
        expected = np.stack([x, y], axis=1) - loads[:, number, :2] / bearing.radial_N_per_mm
        assert_allclose(shapes[..., number], expected, rtol=EXACT)
    assert_allclose(shapes[..., 2], 0.0, atol=1e-15)
    assert_allclose(np.linalg.norm(shapes[..., 3], axis=1), RADIUS * abs(found.windup_angle(wrench)), rtol=EXACT)


EQUAL = SMALL_SET.replace("torques_Nm = [100.0]", "").replace("tangential_um = [10.0, 0.0, 0.0]", "") + NO_STRESS
ON_PINS = "[pins]\ndiameter_mm = 30.0\nlength_mm = 30.0\nbearings = [{at_mm = -6.0}, {at_mm = 6.0}]\n"
WINDUP = '[carrier]\nwindup_Nmm_per_rad = 1e10\ntorque_at = "-z"\n'


def solved(folder, text):
    found = run(load(written_set(folder, text)))
    assert not found.failures
    return found.solution


@pytest.fixture(scope="module")
def sets(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pins")
    stiff = ON_PINS.replace("30.0\nlength", "3000.0\nlength") + "youngs_modulus_GPa = 1e4\n"
    texts = {"held": "", "stiff": stiff, "pins": ON_PINS, "wound": ON_PINS + WINDUP}
    found = {name: solved(folder, EQUAL + text) for name, text in texts.items()}
    with sections_on_columns():  # there are more at the ends of the whole
        found["whole"] = solved(folder, EQUAL.replace("[mesh]", '[mesh]\nwidth = "whole"') + ON_PINS)
    return found


@pytest.mark.slow
def test_very_stiff_pins_are_a_set_without_pins(sets):
    assert_allclose(sets["stiff"].ste_um, sets["held"].ste_um, rtol=1e-6)
    assert (sets["pins"].ste_um > sets["held"].ste_um).all()


@pytest.mark.slow
def test_a_carrier_that_winds_up_loads_the_side_where_its_torque_leads_out(sets):
    """The other cheek runs ahead with its ends of the pins. Equal planets still share equally."""
    wound = sets["wound"]
    assert_allclose(wound.planet_share.mean(axis=1), 1.0 / 3.0, rtol=1e-6)
    assert (wound.planet_tilt_rad[..., 1] > 0.0).all()
    for mesh in range(6):
        assert wound.k_h_beta(mesh)[0] > 1.05 * sets["whole"].k_h_beta(mesh)[0]
        load = wound.face_loads(mesh).load_N_per_mm.sum(axis=2).mean(axis=(0, 1))
        assert load[0] > 1.05 * load[-1]
    forces = np.linalg.norm(wound.bearing_loads[..., :2], axis=4)
    assert (forces[..., 0] > forces[..., 1]).all()
    assert_allclose(wound.bearing_loads[..., :2].sum(axis=3), wound.planet_wrench[..., :2], rtol=SOLVED, atol=1e-6)


def test_helical_planets_tilt_in_the_plane_of_their_axial_forces(tmp_path):
    """Sun and ring push one planet along its axis in opposite senses, twice the pitch radius apart."""
    text = EQUAL.replace("module_mm = 4.0", "module_mm = 4.0\nhelix_angle_deg = 15.0")
    found = solved(tmp_path, text + ON_PINS)
    pair = found.train.meshes[0].pair.meshed.pair
    axial = found.mesh_force_N[0, :, 0] * np.tan(pair.base_helix_angle)
    moment = 2.0 * axial.mean() * 0.5 * pair.centre_distance
    outwards, _ = found.planet_tilt_rad[0].mean(axis=0)[0]
    gives = found.plan.on_pins.pin.compliance[4, 4]
    # Forces wander over the flank in the mesh cycle: the share of the arm that a mean misses.
    assert abs(outwards) == pytest.approx(gives * moment, rel=0.02)


@pytest.mark.slow
def test_a_carrier_as_a_matrix_is_the_image_in_the_other_sense(tmp_path):
    rng = np.random.default_rng(2)
    root = rng.normal(size=(36, 36))
    scale = np.tile([300.0] * 3 + [3e4] * 3, 6)
    matrix = scale[:, None] * (root @ root.T + 36.0 * np.eye(36)) * scale
    image = np.tile([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0], 6)
    # Planets 2 and 3 are each other's images.
    swapped = np.concatenate([np.arange(12), np.arange(24, 36), np.arange(12, 24)])
    found = []
    for sense, values in (("", matrix), ("-", (image[:, None] * matrix * image)[np.ix_(swapped, swapped)])):
        np.savetxt(tmp_path / "carrier.csv", values, delimiter=",", fmt="%.17g")
        text = EQUAL.replace("torque_Nm = 300.0", f"torque_Nm = {sense}300.0")
        found.append(solved(tmp_path, f'{text}{ON_PINS}[carrier]\nstiffness = "carrier.csv"\n'))
    assert_allclose(found[0].ste_um, found[1].ste_um, rtol=SOLVED)
    assert_allclose(found[0].planet_share[..., [0, 2, 1]], found[1].planet_share, rtol=1e-6)
    assert np.ptp(found[0].planet_share.mean(axis=1)) > 1e-3
