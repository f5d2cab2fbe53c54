"""Shafts and couplings: closed forms, and the two-stage box of the FVA with forces at mid face."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.beam import NODE, Beam, CircularSection, ShaftMaterial
from pmor.core.errors import CaseError
from pmor.machine.load_settings import ShaftForce, ShaftMoment
from pmor.machine.loaded import loaded
from pmor.machine.loader import load
from pmor.machine.mesh_force import f_beta_um
from pmor.machine.model import pinion_torques, speeds_rpm
from pmor.machine.readings import bearing_data
from pmor.machine.settings import Bearing
from tests.support.gearboxes import SMALL, drive, fva_box, written

STEEL = ShaftMaterial(210e3, 0.3)
SOLID, HOLLOW = CircularSection(50.0), CircularSection(70.0, 58.0)
EXACT = 1e-9
# Digits of the table.
PRINTED = 0.005
PRINTED_UM = 6e-4
# A shear coefficient so large that shear moves no digit.
STIFF_IN_SHEAR = 1e9


def held(section, lengths, fixed, force):
    """Displacements of a beam of one section that is held in some directions, under forces at its nodes."""
    beam = Beam(np.cumsum([0.0, *lengths]), [section] * len(lengths), STEEL)
    free = np.setdiff1d(np.arange(NODE * len(beam.stations)), fixed)
    found = np.zeros(NODE * len(beam.stations))
    found[free] = np.linalg.solve(beam.stiffness()[np.ix_(free, free)], force[free])
    return found


@pytest.mark.parametrize("section", [SOLID, HOLLOW])
def test_a_cantilever_bends_shears_stretches_and_twists_as_in_closed_form(section):
    length, load = 120.0, np.zeros(24)
    load[18:] = [3e3, -800.0, 500.0, 7e4, 2e4, -9e4]
    found = held(section, [30.0, 50.0, 40.0], np.arange(6), load)[18:]
    bending = STEEL.youngs_modulus * section.second_moment
    sheared = length / (section.shear_coefficient(0.3) * STEEL.shear_modulus * section.area)
    along, y, z, torque, about_y, about_z = load[18:]
    expected = [
        along * length / (STEEL.youngs_modulus * section.area),
        y * (length**3 / (3.0 * bending) + sheared) + about_z * length**2 / (2.0 * bending),
        z * (length**3 / (3.0 * bending) + sheared) - about_y * length**2 / (2.0 * bending),
        torque * length / (2.0 * STEEL.shear_modulus * section.second_moment),
        -z * length**2 / (2.0 * bending) + about_y * length / bending,
        y * length**2 / (2.0 * bending) + about_z * length / bending,
    ]
    assert_allclose(found, expected, rtol=EXACT)


def test_shear_coefficients_are_cowper_s():
    assert_allclose(SOLID.shear_coefficient(0.3), 6.0 * 1.3 / (7.0 + 6.0 * 0.3), rtol=EXACT)
    thin = CircularSection(1.0, 1.0 - 1e-9)
    assert_allclose(thin.shear_coefficient(0.3), 2.0 * 1.3 / (4.0 + 3.0 * 0.3), rtol=1e-8)


# Slopes of pinion and wheel along the line of action, urad, F_beta, um, and displacements y, z of both, um, of the high
# and of the low speed: calculated independently, and checked there against a beam integrated anew.
WITHOUT_SHEAR = "rigid", "rigid", "free", "without shear"
TABLE = {
    ("rigid", "rigid", "free"): (
        (-11.59, -28.04, 0.822, (-2.653, 1.386), (-1.078, -0.812)),
        (16.98, -12.70, 2.197, (-4.496, -1.457), (4.503, 2.020)),
    ),
    ("rigid", "rigid", "rigid"): ((-11.58, -12.45, 0.044, None, None), (0.64, -12.71, 0.988, None, None)),
    WITHOUT_SHEAR: (
        (-7.93, -27.00, 0.954, (-1.552, 0.775), (-1.337, -0.290)),
        (16.56, 7.72, 0.654, (-3.185, -0.684), (1.980, 0.607)),
    ),
    (5e5, 5e5, "free"): (
        (-21.40, -105.28, 4.194, (-6.725, 11.927), (-0.873, -9.778)),
        (-50.58, -41.04, -0.706, (-12.728, -8.969), (13.002, 11.660)),
    ),
    (2e5, 2e5, "free"): (
        (-36.12, -221.15, 9.251, (-12.834, 27.738), (-0.564, -23.228)),
        (-151.92, -83.54, -5.060, (-25.077, -20.236), (25.750, 26.121)),
    ),
}
FORCES_N = (2949.5, -7602.3, 3196.7), (2194.0, -12318.8, -4921.0)


@pytest.mark.parametrize("supports", TABLE)
def test_the_two_stage_box_with_point_forces_deflects_as_calculated_independently(supports, monkeypatch):
    if supports == WITHOUT_SHEAR:
        monkeypatch.setattr(CircularSection, "shear_coefficient", lambda *_: STIFF_IN_SHEAR)
    box = fva_box(*supports[:3]).model
    gearbox = loaded(box, box.sections.loads[0])
    found = gearbox.solve()
    for mesh, expected, force_N, force in zip(
        gearbox.meshes, TABLE[supports], FORCES_N, found.reactions[-2:], strict=True
    ):
        assert_allclose(force * mesh.wrenches[0, :3], force_N, atol=0.1)
        moved = np.array([found.displacement[hub : hub + NODE] for hub in mesh.hubs])
        turned = np.concatenate([moved[:, :3] @ mesh.frame.axes, moved[:, 3:] @ mesh.frame.axes], axis=1)
        along = mesh.frame.along
        angle = mesh.pair.working_pressure_angle
        slopes = [along * (-math.cos(angle) * one[4] - math.sin(angle) * one[3]) for one in turned]
        assert_allclose(np.array(slopes) * 1e6, expected[:2], atol=PRINTED)
        assert_allclose(along * f_beta_um(mesh.pair, turned), expected[2], atol=PRINTED_UM)
        for one, places in zip(moved, expected[3:], strict=True):
            if places is not None:
                assert_allclose(1e3 * one[1:3], places, atol=PRINTED_UM)


def test_bearings_carry_what_meshes_and_torques_ask_for():
    box = fva_box(5e5, 5e5).model
    gearbox = loaded(box, box.sections.loads[0])
    found = gearbox.solve()
    reactions = dict.fromkeys(("in", "mid", "out"), np.zeros(3))
    solved = type("Solved", (), {"sets": (), "gearbox": gearbox, "equilibrium": found})
    for bearing in bearing_data(solved):
        force = np.array(bearing["force_N"])
        reactions[bearing["shaft"]] = reactions[bearing["shaft"]] - force
        if bearing["to"] != "housing":
            reactions[bearing["to"]] = reactions[bearing["to"]] + force
    high, low = (force * mesh.wrenches[:, :3] for mesh, force in zip(gearbox.meshes, found.reactions[-2:], strict=True))
    loads = {"in": high[0], "mid": high[1] + low[0], "out": low[1]}
    for name, force in loads.items():
        assert_allclose(reactions[name], -force, atol=1e-6 * np.abs(force).max())


def test_an_axle_under_forces_alone_is_a_shaft_whose_rotation_is_held(tmp_path):
    axle = """[[shafts]]
name = "axle"
at_mm = [0.0, 200.0]
sections = [{ length_mm = 80.0, outer_mm = 20.0 }]
[[bearings]]
name = "E"
shaft = "axle"
at_mm = 10.0
axial_N_per_mm = 1e5
radial_N_per_mm = 2e5
[[bearings]]
name = "F"
shaft = "axle"
at_mm = 70.0
radial_N_per_mm = 2e5
[[loads]]
"""
    held = '\n    { shaft = "axle", at_mm = 0.0, torque_Nm = "balance" },\n]\n'
    force = 'forces = [{ shaft = "axle", at_mm = 25.0, z_N = 800.0 }]\n'
    text = SMALL.replace("[[loads]]\n", axle).replace("\n]\n", held + force)
    box = load(written(tmp_path, text))
    gearbox = loaded(box.model, box.model.sections.loads[0])
    found = gearbox.solve()
    solved = type("Solved", (), {"sets": (), "gearbox": gearbox, "equilibrium": found})
    bearings = {bearing["name"]: bearing for bearing in bearing_data(solved)}
    assert_allclose([abs(bearings[name]["force_N"][2]) for name in "EF"], [600.0, 200.0], rtol=1e-9)
    with pytest.raises(CaseError, match='nothing holds the rotation of shaft "axle": add a torque'):
        load(written(tmp_path, text.replace(held, "\n]\n")))


def bearing_displacements(box):
    gearbox = loaded(box, box.sections.loads[0])
    found = gearbox.solve()
    return {b.settings.name: b.rows[:3] @ found.displacement for b in gearbox.bearings}, found.displacement, gearbox


def test_a_housing_of_springs_is_in_series_with_the_bearings():
    seats = sum(bearing.to == "housing" for bearing in fva_box().model.sections.bearings)
    springs = np.diag([3e5, 3e5, 3e5, 1e12, 1e12, 1e12] * seats)
    on_springs = replace(fva_box(6e5, 6e5).model, housing=springs)
    in_series = fva_box(2e5, 2e5).model
    needle = {"radial_N_per_mm": 6e5}  # between the shafts, not to the housing
    bearings = tuple(replace(b, **needle) if b.name == "2" else b for b in in_series.sections.bearings)
    in_series = replace(in_series, sections=replace(in_series.sections, bearings=bearings))
    _, found, gearbox = bearing_displacements(on_springs)
    _, expected, _ = bearing_displacements(in_series)
    shafts = len(found) - len(gearbox.housing)
    assert_allclose(found[:shafts], expected, rtol=0.0, atol=1e-6 * np.abs(expected[:shafts]).max())


def test_a_bending_moment_is_a_couple_of_forces():
    """On the output beyond its last bearing: what is on the other side of both forces moves alike."""
    box, arm = fva_box(2e5, 2e5), 10.0
    bent = replace(drive("bent", 500.0), moments=(ShaftMoment(shaft="out", at_mm=185.0, y_Nm=30.0, z_Nm=-20.0),))
    pairs = [ShaftForce(shaft="out", at_mm=185.0 + s * arm, y_N=s * -1e3, z_N=s * -1.5e3) for s in (1.0, -1.0)]
    pushed = replace(drive("pushed", 500.0), forces=tuple(pairs))
    model = replace(box.model, sections=replace(box.model.sections, loads=(bent, pushed)))
    found, expected, without = (loaded(model, load) for load in (bent, pushed, drive("none", 500.0)))
    solved = [one.solve().displacement for one in (found, expected, without)]
    beam, first = found.beams["out"], found.first["out"]
    places = [first + NODE * beam.node_at(place) + i for place in (13.0, 65.0, 140.0, 170.0) for i in range(NODE)]
    change, by_forces = ((one - solved[2])[places] for one in solved[:2])
    assert np.abs(change).max() > 1e-4
    assert_allclose(change, by_forces, rtol=0.0, atol=EXACT * np.abs(change).max())


STIFFNESSES = "radial_N_per_mm", "axial_N_per_mm", "tilt_Nmm_per_rad", "torsion_Nmm_per_rad"
# The middle shaft turns against the input.
CARRIED_NM = -500.0 * 51 / 27
# Round-off of the equations of the whole box, whose springs differ by 1e11, of the largest displacement.
ROUND_OFF = 1e-5


def cut(sections, place, **joint):
    """The two-stage box with its middle shaft in two, joined at a place between its gears."""
    (shaft,) = (one for one in sections.shafts if one.name == "mid")
    first, second, third = shaft.sections
    left = replace(shaft, sections=(first, second, replace(third, length_mm=place - 105.0)))
    right = replace(shaft, name="right", start_mm=shaft.start_mm + place,
                    sections=(replace(third, length_mm=270.0 - place),))  # fmt: skip

    def moved(one):
        return replace(one, shaft="right", at_mm=one.at_mm - place) if one.shaft == "mid" and one.at_mm > place else one

    return replace(
        sections, shafts=(sections.shafts[0], left, right, sections.shafts[2]),
        bearings=(*map(moved, sections.bearings), Bearing(name="joint", shaft="mid", to="right", at_mm=place, **joint)),
        meshes=tuple(replace(mesh, pinion=moved(mesh.pinion), wheel=moved(mesh.wheel)) for mesh in sections.meshes),
    )  # fmt: skip


def solved(model):
    gearbox = loaded(model, model.sections.loads[0])
    return gearbox, gearbox.solve()


def test_a_shaft_that_is_cut_and_joined_again_bends_twists_and_turns_as_before():
    whole = fva_box(5e5, 5e5, 1e8).model
    parted = replace(whole, sections=cut(whole.sections, 130.0, **dict.fromkeys(STIFFNESSES, "rigid")))
    (one, first), (two, second) = solved(whole), solved(parted)
    for mesh, other in zip(one.meshes, two.meshes, strict=True):
        for hub, there in zip(mesh.hubs, other.hubs, strict=True):
            assert_allclose(second.displacement[there : there + 6], first.displacement[hub : hub + 6],
                            atol=ROUND_OFF * np.abs(first.displacement).max())  # fmt: skip
    load = replace(parted.sections.loads[0], speed_rpm=900.0)
    assert pinion_torques(parted, load) == pytest.approx(pinion_torques(whole, load))
    assert speeds_rpm(parted, load)["right"] == pytest.approx(speeds_rpm(whole, load)["mid"])
    entry = bearing_data(type("Solved", (), {"sets": (), "gearbox": two, "equilibrium": second}))[-1]
    assert entry["torque_Nm"] == pytest.approx(CARRIED_NM, rel=1e-6)


def test_a_coupling_of_a_torsional_stiffness_twists_by_the_torque_over_it():
    whole = fva_box(5e5, 5e5, 1e8).model
    joint = dict.fromkeys(STIFFNESSES, "rigid")
    gearbox, stiff = solved(replace(whole, sections=cut(whole.sections, 130.0, **joint)))
    _, soft = solved(replace(whole, sections=cut(whole.sections, 130.0, **joint | {"torsion_Nmm_per_rad": 1e7})))
    row = gearbox.bearings[-1].rows[3]
    assert abs(row @ stiff.displacement) < 1e-9
    assert row @ soft.displacement == pytest.approx(1e3 * CARRIED_NM / 1e7, rel=1e-6)


@pytest.mark.parametrize(("keys", "words"), [
    ('torsion_Nmm_per_rad = "rigid"\n', 'couples two shafts: name the other one in to, or write torque_Nm = "balance"'),
    ('torsion_Nmm_per_rad = 1e6\nball = { balls = 9, ball_diameter_mm = 9.0, pitch_diameter_mm = 44.0 }\n',
     "a bearing has one kind"),
], ids=["to the housing", "with balls"])  # fmt: skip
def test_what_is_no_coupling_is_refused(tmp_path, keys, words):
    plain = SMALL.replace("axial_N_per_mm = 1e5\nradial_N_per_mm = 2e5\n", "", 1)
    with pytest.raises(CaseError, match=words):
        load(written(tmp_path, plain.replace("at_mm = 10.0\n", f"at_mm = 10.0\n{keys}", 1)))
