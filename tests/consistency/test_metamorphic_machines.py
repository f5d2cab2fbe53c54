"""What must not change the results of a gearbox or a planetary set, or change them in a known way.

Each relation compares two ways to write the same machine, none of which needs to be right. Relations of pairs stand in
`test_metamorphic`.
"""

import copy
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from tests.support.gearboxes import INLINE
from tests.support.small_sets import SMALL_SET
from tests.support.toml import parsed, toml

# Newton of the supports ends at 1e-8 of the load, and each way to write a machine ends it elsewhere.
SAME = 1e-6
STIFFNESSES = ("radial_N_per_mm", "axial_N_per_mm")
LENGTHS = ("at_mm", "length_mm", "outer_mm", "inner_mm", "start_mm", "module_mm", "face_width_mm", "bore_radius_mm")


def box():
    """The small box on linear bearings, on a coarse mesh."""
    found = parsed(INLINE)
    for mesh in found["meshes"]:
        mesh |= {"results": {"root_stress": False}, "mesh": {"profile_elements": 2, "width_elements": 2}}
        mesh["online"] = {"angles_per_pitch": 6}
    for bearing in found["bearings"]:
        bearing.pop("roller", None)
        if bearing.pop("ball", None):
            bearing["axial_N_per_mm"] = 6e4
        bearing["radial_N_per_mm"] = {"A": 2e5, "B": 1.5e5, "C": 3e5, "D": 2.5e5}[bearing["name"]]
    found["loads"][0]["forces"] = [{"shaft": "output", "at_mm": 55.0, "x_N": 90.0, "y_N": 250.0, "z_N": -400.0}]
    found["gravity"] = {"x_m_s2": 20.0, "y_m_s2": -50.0, "z_m_s2": 30.0}
    return found


def loaded(folder, document):
    """What the gearbox file tells of its load: scalars of its mesh, and force and displacement of its bearings."""
    path = folder / "box.toml"
    path.write_text(toml(document))
    (load,) = pmor.run(path).data["loads"]
    (mesh,) = load["meshes"]
    keys = ("ste_mean_um", "ste_peak_to_peak_um", "f_beta_um", "k_h_beta", "centre_distance_um", "force_N")
    bearings = {one["name"]: np.array([one["force_N"], one["displacement_um"]]) for one in load["bearings"]}
    return {key: mesh[key] for key in keys}, bearings


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return loaded(tmp_path_factory.mktemp("plain"), box())


def same(found, expected):
    for key, value in expected.items():
        assert_allclose(found[key], value, rtol=SAME, err_msg=key)


def test_a_gearbox_turned_in_space_is_the_same(plain, tmp_path):
    scalars, bearings = plain
    turned, angle = box(), 0.7
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    for shaft in turned["shafts"]:
        shaft["at_mm"] = (turn @ shaft.get("at_mm", [0.0, 0.0])).tolist()
    for force in turned["loads"][0]["forces"]:
        force["y_N"], force["z_N"] = (turn @ [force["y_N"], force["z_N"]]).tolist()
    gravity = turned["gravity"]
    gravity["y_m_s2"], gravity["z_m_s2"] = (turn @ [gravity["y_m_s2"], gravity["z_m_s2"]]).tolist()
    found, of_bearings = loaded(tmp_path, turned)
    same(found, scalars)
    for name, vectors in bearings.items():
        expected = np.concatenate([vectors[:, :1], vectors[:, 1:] @ turn.T], axis=1)
        assert_allclose(of_bearings[name], expected, rtol=SAME, atol=SAME * np.abs(expected).max())


def test_a_gearbox_in_a_mirror_is_the_same(plain, tmp_path):
    """Across the plane of both axes: hands of helices and senses of torques change, forces across turn round."""
    scalars, bearings = plain
    image = box()
    for mesh in image["meshes"]:
        mesh["pair"]["helix_angle_deg"] *= -1.0
    for torque in image["loads"][0]["torques"]:
        if torque["torque_Nm"] != "balance":
            torque["torque_Nm"] *= -1.0
    for force in image["loads"][0]["forces"]:
        force["z_N"] *= -1.0
    image["gravity"]["z_m_s2"] *= -1.0
    found, of_bearings = loaded(tmp_path, image)
    same(found, scalars)
    for name, vectors in bearings.items():
        expected = vectors * [1.0, 1.0, -1.0]
        assert_allclose(of_bearings[name], expected, rtol=SAME, atol=SAME * np.abs(expected).max())


def test_split_sections_halved_bearings_and_another_order_are_the_same_gearbox(plain, tmp_path):
    scalars, bearings = plain
    other = box()
    for shaft in other["shafts"]:
        pieces = []
        for section in shaft["sections"]:
            pieces += [{**section, "length_mm": share * section["length_mm"]} for share in (0.3, 0.7)]
        shaft["sections"] = pieces
    halves = []
    for bearing in other["bearings"]:
        for number in range(2):
            half = {key: 0.5 * bearing[key] for key in STIFFNESSES if key in bearing}
            halves.append({**bearing, **half, "name": f"{bearing['name']}{number}"})
    other["bearings"] = halves[::-1]
    other["shafts"] = other["shafts"][::-1]
    other["loads"][0]["torques"] = other["loads"][0]["torques"][::-1]
    found, of_bearings = loaded(tmp_path, other)
    same(found, scalars)
    for name, (force, displacement) in bearings.items():
        both = of_bearings[f"{name}0"] + of_bearings[f"{name}1"]
        assert_allclose(both, [force, 2.0 * displacement], rtol=SAME, atol=SAME * np.abs(both).max())


def test_a_gearbox_scales_with_its_lengths_and_with_the_cube_of_its_torques(plain, tmp_path):
    scalars, _ = plain
    scale, larger = 1.7, box()
    for part in (*larger["shafts"], *larger["bearings"], *larger["meshes"], *larger["loads"]):
        _scale(part, scale)
    for key in larger["gravity"]:  # weights grow with the square of lengths, as all forces
        larger["gravity"][key] /= scale
    found, _ = loaded(tmp_path, larger)
    powers = {"f_beta_um": 1, "ste_mean_um": 1, "ste_peak_to_peak_um": 1, "centre_distance_um": 1, "force_N": 2}
    same(found, {key: value * scale ** powers.get(key, 0) for key, value in scalars.items()})


def _scale(part, scale):
    powers = {**dict.fromkeys(LENGTHS, 1), **dict.fromkeys(STIFFNESSES, 1), "torque_Nm": 3}
    powers |= dict.fromkeys(("x_N", "y_N", "z_N"), 2)
    for key, value in part.items():
        if isinstance(value, dict):
            _scale(value, scale)
        elif isinstance(value, list):
            inner = [one for one in value if isinstance(one, dict)]
            for one in inner:
                _scale(one, scale)
            part[key] = value if inner or key not in powers else [scale ** powers[key] * one for one in value]
        elif key in powers and value != "balance":
            part[key] = scale ** powers[key] * value


def planets(helix=0.0):
    """A small set with a pin out of place and a floating sun, on a coarse mesh."""
    found = parsed(SMALL_SET)
    found["pair"]["helix_angle_deg"] = helix
    found["mesh"] = {"profile_elements": 2, "width_elements": 2}
    found["results"] = {"root_stress": False}
    found["sweep"] = {"angles_per_pitch": 6}
    found["planets"] = {"count": 4, "tangential_um": [9.0, -4.0, 0.0, 2.0], "radial_um": [0.0, 5.0, 0.0, -3.0]}
    found["supports"] = {"sun_radial_N_per_mm": 5e4}
    return found


def solved(folder, document):
    path = folder / "set.toml"
    path.write_text(toml(document))
    found = pmor.run(path)
    assert found.failures == ()
    return found


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    return solved(tmp_path_factory.mktemp("set"), planets())


def told(found):
    return {"ste": found.ste_um, "shares": found.planet_share, "k_gamma": found.k_gamma}


def test_a_set_turned_about_its_axis_is_the_same(base, tmp_path):
    """By a whole number of pitches of the sun, so that its teeth face the planets as before."""
    turned = planets()
    turned["planets"]["positions_deg"] = [60.0 + 90.0 * number for number in range(4)]
    assert 60.0 * turned["sun"]["teeth"] / 360.0 == 3.0
    same(told(solved(tmp_path, turned)), told(base))


def test_a_set_in_a_mirror_is_the_same(base, tmp_path):
    """Its planets stand in the other order, and the torque turns round."""
    image = planets()
    image["load"]["torque_Nm"] *= -1.0
    for key in ("tangential_um", "radial_um"):
        listed = image["planets"][key]
        image["planets"][key] = [listed[0], *listed[:0:-1]]
    expected = told(base)
    expected["shares"] = expected["shares"][..., [0, 3, 2, 1]]
    same(told(solved(tmp_path, image)), expected)


@pytest.mark.parametrize(("member", "ratio"), [("ring", 54 / 18), ("carrier", -1.0 - 54 / 18)])
def test_a_set_is_the_same_whichever_member_its_torque_is_said_of(base, tmp_path, member, ratio):
    other = planets()
    other["load"] |= {"on": member, "held": "sun", "torque_Nm": other["load"]["torque_Nm"] * ratio}
    found = solved(tmp_path, other)
    assert_allclose(found.planet_share, base.planet_share, rtol=SAME)
    assert_allclose(np.ptp(found.ste_um), np.ptp(base.ste_um), rtol=SAME)


def test_a_set_scales_with_its_lengths_and_with_the_cube_of_its_torque(base, tmp_path):
    scale = 1.7
    larger = copy.deepcopy(planets())
    for part in ("pair", "sun", "planet", "ring"):
        _scale_gear(larger[part], scale)
    for key in ("tangential_um", "radial_um"):
        larger["planets"][key] = [scale * one for one in larger["planets"][key]]
    larger["load"]["torque_Nm"] *= scale**3
    larger["supports"]["sun_radial_N_per_mm"] *= scale
    expected = told(base)
    same(told(solved(tmp_path, larger)), {**expected, "ste": scale * expected["ste"]})


def _scale_gear(part, scale):
    for key, value in part.items():
        if key.endswith("_mm"):
            part[key] = scale * value
