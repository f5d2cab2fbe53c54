"""Sets whose ring is held at lugs: what symmetry says over a turn of the carrier, and against pairs."""

import math
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import elastic_model, mesh_model
from pmor.sets.model import SetBody, SetMesh, build_train
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import reduced_pair
from tests.support.small_sets import MODULE, SMALL_SET, line_case, planetary, rotations, written_set

TORQUE, ANGLES = 1e5, 3
COARSE = {"profile_elements": 3, "width_elements": 1, "element": "hex8i"}
# Of the mean: what rounding leaves of orders that symmetry forbids.
FORBIDDEN = 1e-8
TEETH = {"in phase": (18, 18, 54), "one after the other": (17, 22, 61)}


@cache
def over_a_turn(teeth, lugs, floating=False, **mesh):
    """STE, um, and the load of each planet on the sun, N, over a turn of the carrier against the ring."""
    built = planetary(3, floating, teeth, lugs=lugs, **COARSE | mesh)[1]
    pair = built.meshes[0].pair.meshed.pair
    placed = built.place(pair.pitch * np.arange(teeth[2] * ANGLES) / ANGLES)
    found = placed.solve(np.r_[TORQUE, np.zeros(len(built.free) - 1)])
    assert found.converged.all()
    forces = np.stack([found.force[0][:, one.part].sum(axis=1) for one in placed.placed[::2]], axis=1)
    return 1e3 * pair.pinion.base_radius * found.movement[0, :, 0], forces


@pytest.mark.slow
@pytest.mark.parametrize(
    ("teeth", "count"),
    [
        ("in phase", 4),
        ("in phase", 9),
        ("one after the other", 5),
    ],
)
def test_orders_over_the_turn_of_the_carrier_are_those_that_lugs_teeth_and_planets_share(teeth, count):
    """Planets feel lugs and teeth: multiples of gcd(lugs, teeth); what all of them move, of their number too."""
    teeth = TEETH[teeth]
    ste, forces = over_a_turn(teeth, (count, 10.0, 7.0))
    of_a_planet = math.gcd(count, teeth[2])
    for values, step in ((ste, math.lcm(of_a_planet, 3)), *((force, of_a_planet) for force in forces.T)):
        orders = np.abs(np.fft.rfft(values)) / len(values)
        allowed = np.arange(len(orders)) % step == 0
        assert orders[~allowed].max(initial=0.0) < FORBIDDEN * orders[0]
    between = np.arange(1, len(ste) // ANGLES)  # below the order of the mesh
    assert np.abs(np.fft.rfft(ste))[between].max() > 1e-3 * np.abs(ste.sum())


@pytest.mark.slow
def test_lugs_turned_by_a_tooth_shift_all_by_a_pitch():
    teeth = TEETH["in phase"]
    (one, _), (turned, _) = (over_a_turn(teeth, (4, 10.0, first)) for first in (7.0, 7.0 + 360.0 / teeth[2]))
    # Lugs count in the frame of the mesh, in which the ring turns counter-clockwise.
    assert_allclose(turned, np.roll(one, -ANGLES), rtol=1e-8)
    assert np.abs(turned - one).max() > 1e-4 * one.mean()


@pytest.mark.parametrize("bend_deg", [pytest.param(0.0, marks=pytest.mark.slow), 50.0])
def test_a_single_mesh_is_the_pair_at_lugs(bend_deg):
    """Lugs at unequal places on seats that give way, wherever the ring stands to the y axis, which they count from."""
    ring = {"teeth": 41, "internal": True, "addendum": 0.8, "root_fillet_mm": 0.6, "rim_thickness_mm": 12.0}
    ring |= {"seat_radial_N_per_mm": 2e6, "seat_tangential_N_per_mm": 1e6}
    pinion = {"teeth": 17, "bore_radius_mm": 17.0}

    def case(first_deg):
        return line_case(
            pinion,
            ring | {"held": {"at_deg": [0.0, 50.0, 160.0, 300.0], "lug_deg": 10.0, "first_deg": first_deg}},
            mesh=COARSE,
        )

    distance, bend = 0.5 * MODULE * (41 - 17), math.radians(bend_deg)
    bodies = [SetBody("pinion", "pinion", 0.0, 0.0),
              SetBody("ring", "ring", distance * math.sin(bend), -distance * math.cos(bend))]  # fmt: skip
    # A pair counts from its line of centres; lugs turn with the ring until the pinion stands there.
    cases = {"mesh": case(11.0 + bend_deg - bend_deg * 17 / 41)}
    built = build_train(cases, bodies, [SetMesh("mesh", 0, 1)], rotations(2, held=(1,)), np.zeros((12, 12)))
    pair = built.meshes[0].pair.meshed.pair
    phi = pair.pitch * np.arange(41 * ANGLES) / ANGLES
    placed = built.place((phi - built.meshes[0].start) / built.meshes[0].rate)
    found = placed.solve(np.array([[1e5]]))
    own = case(11.0)
    reduced = reduced_pair(train(own, elastic_model(own, mesh_model(own))).basis)
    expected = sweep_line_loads(reduced, phi, [nominal_condition(own)]).ste_um[0]
    ste = 1e3 * pair.pinion.base_radius * found.movement[0, :, 0]
    assert_allclose(ste, expected, rtol=1e-8)
    assert np.ptp(expected.reshape(-1, ANGLES).mean(axis=1)) > 1e-2 * expected.mean()


@pytest.mark.slow
def test_a_pitch_later_a_set_is_as_it_is_where_it_is_placed():
    built = planetary(3, False, TEETH["in phase"], lugs=(4, 10.0, 7.0), **COARSE)[1]
    pitch, load = built.meshes[0].pair.meshed.pair.pitch, np.r_[TORQUE, np.zeros(len(built.free) - 1)]
    phi = pitch * np.arange(ANGLES) / ANGLES
    for pitches in (1, 40):
        later, there = built.place(phi).solve(load, pitch=pitches), built.place(phi + pitches * pitch).solve(load)
        assert_allclose(later.force.sum(axis=2), there.force.sum(axis=2), rtol=1e-8)
        assert_allclose(later.movement[..., 0], there.movement[..., 0], rtol=1e-8)


@pytest.mark.slow
def test_a_set_whose_ring_gives_way_all_around_shares_equally_and_comes_to_one_that_is_held(tmp_path):
    text = SMALL_SET.replace("[10.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]").replace("torques_Nm = [100.0]", "")
    text, found = text.replace("hex8i", "hex20"), []
    for stiffness in ('"rigid"', "1e12", "1e7"):
        seats = f"teeth = 54\nseat_radial_N_per_mm = {stiffness}\nseat_tangential_N_per_mm = {stiffness}"
        found.append(pmor.run(written_set(tmp_path, text.replace("teeth = 54", seats))))
    assert_allclose(found[1].ste_um, found[0].ste_um, rtol=2e-3)
    assert (found[2].ste_um > found[0].ste_um).all()
    assert_allclose(found[2].planet_share.mean(axis=1), 1.0 / 3.0, rtol=1e-6)
    assert found[2].data["pitches"] == 1
    stress = [one.data["root_stress"][1]["range_MPa"] for one in found]
    assert stress[0] == pytest.approx(stress[1], rel=5e-3)
    assert stress[2] > 1.1 * stress[0]
    assert "1e+07 N/mm radially, 1e+07 N/mm around" in pmor.plan(tmp_path / "small.toml")


def from_file(folder, first_deg, change=("", ""), side=1.0):
    """Pairs of lugs, twice around."""
    at = [side * place for place in (0.0, 50.0, 180.0, 230.0)]
    held = f"rim_thickness_mm = 12.0\nheld = {{at_deg = {at}, lug_deg = 10.0, first_deg = {first_deg}}}"
    text = SMALL_SET.replace("rim_thickness_mm = 12.0", held).replace("[10.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]")
    text = text.replace("torques_Nm = [100.0]", "").replace("_pitch = 6", "_pitch = 4").replace(*change)
    text += "[results]\nroot_stress = false\n"
    return pmor.run(written_set(folder, text))


@pytest.mark.slow
@pytest.mark.parametrize(("torque", "side"), [("300.0", 1.0), ("-300.0", -1.0)])
def test_a_ring_on_soft_seats_moves_as_its_springs_say(torque, side, tmp_path):
    """Two of three planets push it aside, and turn it; what is left is its own bending, a tenth."""
    stiffness = 2_000.0
    held = "held = {lugs = 4, lug_deg = 20.0, first_deg = 10.0}\nrim_thickness_mm = 40.0"
    seats = f"\nseat_radial_N_per_mm = {stiffness}\nseat_tangential_N_per_mm = {stiffness}"
    text = SMALL_SET.replace("rim_thickness_mm = 12.0", held + seats).replace("[10.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]")
    text = text.replace("torques_Nm = [100.0]", "pitches = 1").replace("count = 3", "count = 3\nmissing = [3]")
    text = text.replace("width_elements = 2", "width_elements = 1") + "[results]\nroot_stress = false\n"
    result = pmor.run(written_set(tmp_path, text.replace("300.0", torque)))
    found, solved = result.data["ring"], result.solution
    force, moment = solved.hub_wrench[-1, 0, 1, :2] * [side, 1.0], side * solved.hub_wrench[-1, 0, 1, 5]
    place = np.radians(found["place_deg"])
    outwards, around = np.stack([-np.sin(place), np.cos(place)]), np.stack([-np.cos(place), -np.sin(place)])
    moved = 1e3 * force / (4.0 * stiffness)  # half of the seats' sum of both stiffnesses
    ring = solved.train.meshes[1].pair.meshed.pair.wheel
    turned = 1e3 * moment / (4.0 * stiffness * (40.0 - ring.root_radius) ** 2) * abs(ring.root_radius)
    largest = np.linalg.norm(moved) + abs(turned)
    assert_allclose(found["radial_um"], moved @ outwards, atol=0.1 * largest)
    assert_allclose(found["around_um"], moved @ around + turned, atol=0.1 * largest)


@pytest.mark.slow
def test_lugs_of_a_file_count_from_the_y_axis_counter_clockwise(tmp_path):
    """With 54 teeth and lugs that repeat twice all stands as before after 27 pitches; coast flanks mirror it."""
    first = from_file(tmp_path, 7.0)
    assert first.data["pitches"] == 27
    image = from_file(tmp_path, -7.0, ("torque_Nm = 300.0", "torque_Nm = -300.0"), -1.0)
    assert_allclose(image.ste_um, first.ste_um, rtol=1e-8)
    # All planets and lugs turned by the sun's pitch: the set a pitch later, but for what the ring turns in one.
    turned = from_file(tmp_path, 7.0 + 20.0 + 360.0 / 54, ("count = 3", "count = 3\npositions_deg = [20, 140, 260]"))
    assert_allclose(turned.ste_um, np.roll(first.ste_um, 4, axis=1), rtol=1e-8)
    assert np.ptp(first.ste_um.reshape(-1, 4), axis=0).max() > 1e-3 * first.ste_um.mean()
