"""What must not change a result, or change it in a known way: pairs in line contact, and one in each other scheme.

Each relation compares two ways to the same answer, none of which needs to be right. Tolerances are three times what was
measured. `test_reduced_relations` has the same for reduced models.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.gear.condition import Misalignment, at_torques
from pmor.pair.model import ElasticModel, mesh_model
from tests.support.line_pairs import sections_on_columns
from tests.support.small_case import full_fe
from tests.support.states import states_at

SCHEMES = ("line", "direct", "paper", "facet")
NODAL = SCHEMES[1:]
STIFF_N_MM3 = 1e6
TORQUES = [60.0, 100.0]
ANGLES = 3
# Eight elements: on five, the averaged edge normals of "paper" are so far off that rows of points with a gap hide
# others behind them that touch, in all but the largest windows, and a larger torque in the company then changes the
# STE.
ELEMENTS = 8
# Other coordinates and factors are rounded otherwise: 7e-12 here, by other amounts on other processors.
ROUNDED = 1e-10
# Another path through Newton, which ends at corrections of 1e-9 of the energy, or 1e-8 where these fall slowly.
NEWTON = 1e-8
# Points that only just touch come in another order, and Newton ends a step earlier or later.
TILTED = 1.3e-7
# Half the width has another condensation.
HALVED = 2e-9
# Both: the torque is the one that was found on the other side.
SWAPPED = 6e-7
# A reduced sweep starts each angle from its neighbour, and ends a step behind a residual of 1e-4. Line loads do not.
LAST_STEP = {"line": ROUNDED, "direct": 3e-6}

PAIRS = {
    "paper": {"pinion": {"teeth": 21, "bore_radius_mm": 20.0}},
    "unequal": {
        "pinion": {"teeth": 17, "profile_shift": 0.3, "bore_radius_mm": 14.0},
        "wheel": {"teeth": 31, "bore_radius_mm": 30.0, "youngs_modulus_GPa": 120.0, "poisson_ratio": 0.25},
    },
    "backlash": {
        "pair": {"centre_distance_mm": 81.2},
        "pinion": {"teeth": 23, "bore_radius_mm": 22.0},
        "wheel": {"teeth": 17, "profile_shift": 0.2, "bore_radius_mm": 12.0},
    },
}
LENGTHS = ("module_mm", "face_width_mm", "centre_distance_mm", "bore_radius_mm")
every_scheme = pytest.mark.parametrize("scheme", SCHEMES)
# Each pair in line contact, and each of the other schemes on one of them; of each kind one runs always.
ALWAYS = ("unequal", "line"), ("paper", "direct")
every_relation = pytest.mark.parametrize(
    ("name", "scheme"),
    [both if both in ALWAYS else pytest.param(*both, marks=pytest.mark.slow)
     for both in (*((name, "line") for name in PAIRS), *zip(PAIRS, NODAL, strict=True))],
)


def sections(name, scheme, **changes):
    """Sections of the case of a pair; each change is a section with the keys that differ."""
    contact = {"scheme": scheme} | ({"lodm_profile": 2} if scheme in NODAL else {})
    contact |= {} if scheme == "line" else {"penalty_N_mm3": STIFF_N_MM3}
    torques = {"torques_Nm": TORQUES}
    found = {
        "load": {"torque_Nm": 100.0}, "pair": {"module_mm": 4.0, "face_width_mm": 20.0},
        "mesh": {"profile_elements": ELEMENTS, "width_elements": 2, "element": "hex8i"}, "contact": contact,
        "offline": torques, "online": torques, "compare": torques,
    }  # fmt: skip
    for part in (PAIRS[name], changes):
        for section, keys in part.items():
            found[section] = found.get(section, {}) | keys
    return found


@cache
def bodies(pair, mesh, lines):
    """Gears of full FE: the same for all schemes but line contact, which takes a layer below the flank out of them."""
    case = pmor.make_case(**sections("paper", "line" if lines else "direct"))
    case = replace(case, pair=pair, mesh=mesh)
    model = full_fe(case)
    return model.pinion, model.wheel


def model_of(documents):
    case = pmor.make_case("case", **documents)
    gears = bodies(case.pair, case.mesh, case.contact.kind == "line")
    return pmor.FullModel(case, ElasticModel(mesh_model(case), *gears))


@cache
def base(name, scheme, width="half"):
    """Full FE of a pair, and its STE."""
    model = model_of(sections(name, scheme, mesh={"width": width}))
    return model, ste(model)


def angles_of(model):
    """Angles that fall on no border of anything by chance."""
    first, _ = model.elastic.mesh.meshed.pair.roll_position_range
    return first + model.elastic.mesh.meshed.pair.pitch * (np.arange(ANGLES) + 0.317) / ANGLES


def ste(model, torques=TORQUES, angles=None, **options):
    result = model.sweep(torques, angles_of(model) if angles is None else angles, **options)
    assert result.converged.all()
    return result.ste_um


def state(model, phi, torque):
    """The only equilibrium at an angle, under a torque in N mm."""
    return states_at(model.elastic, float(phi), at_torques([torque]))[0]


# --- the same model, asked otherwise -------------------------------------------------------------------------------


@every_relation
def test_asked_otherwise_it_answers_the_same(name, scheme):
    model, expected = base(name, scheme)
    phi, pitch = angles_of(model), model.elastic.mesh.meshed.pair.pitch
    teeth = model.case.pair.pinion.teeth
    assert_allclose(ste(model), expected, rtol=0, atol=0, err_msg="asked again")
    assert_allclose(ste(model, angles=phi[::-1])[:, ::-1], expected, rtol=0, atol=0, err_msg="angles in reverse")
    for pitches in (1, -3, teeth):
        shifted = ste(model, angles=phi + pitches * pitch)
        assert_allclose(shifted, expected, rtol=ROUNDED, err_msg=f"{pitches} pitches on")
    halves = [ste(model, angles=part) for part in (phi[:2], phi[2:])]
    assert_allclose(np.hstack(halves), expected, rtol=0, atol=0, err_msg="angles split in two calls")
    finer = ste(model, angles=np.sort(np.append(phi, phi + 0.1 * pitch)))
    assert_allclose(finer[:, ::2], expected, rtol=0, atol=0, err_msg="more angles")
    with ThreadPoolExecutor(2) as threads:
        assert_allclose(ste(model, executor=threads), expected, rtol=0, atol=0, err_msg="two threads")
    assert_allclose(
        ste(model, misalignment=Misalignment(0.0, 0.0, 0.0)), expected, rtol=0, atol=0, err_msg="no misalignment"
    )
    more = ste(model, [0.01, 30.0, *TORQUES, 300.0])
    assert_allclose(more[2:4], expected, rtol=NEWTON, err_msg="more torques")
    assert_allclose(ste(model, TORQUES[::-1])[::-1], expected, rtol=NEWTON, err_msg="torques in reverse")
    single = np.vstack([ste(model, [torque]) for torque in TORQUES])
    assert_allclose(single, expected, rtol=NEWTON, err_msg="one torque at a time")
    assert_allclose(ste(model, [100.0, 100.0])[1], expected[1], rtol=NEWTON, err_msg="a torque twice")


# --- another model of the same thing -------------------------------------------------------------------------------


@every_relation
def test_length_scales_with_the_cube_of_torque(name, scheme):
    """All lengths and the STE times s, torques times s cubed, penalty over s: the stresses are the same."""
    scale = 0.37
    found = sections(name, scheme)
    for section in ("pair", "pinion", "wheel"):
        if section in found:
            found[section] = {k: v * scale if k in LENGTHS else v for k, v in found[section].items()}
    if scheme != "line":
        found["contact"]["penalty_N_mm3"] /= scale
    scaled = ste(model_of(found), [torque * scale**3 for torque in TORQUES])
    assert_allclose(scaled, scale * base(name, scheme)[1], rtol=ROUNDED)


@every_relation
def test_modulus_torque_and_penalty_scale_together(name, scheme):
    factor = 3.7
    found = sections(name, scheme)
    found["wheel"] = dict(found.get("wheel", found["pinion"]))
    for gear in ("pinion", "wheel"):
        found[gear] = found[gear] | {"youngs_modulus_GPa": factor * found[gear].get("youngs_modulus_GPa", 210.0)}
    if scheme != "line":
        found["contact"]["penalty_N_mm3"] *= factor
    scaled = ste(model_of(found), [factor * torque for torque in TORQUES])
    assert_allclose(scaled, base(name, scheme)[1], rtol=ROUNDED)


@every_relation
def test_half_the_width_stands_for_the_whole(name, scheme):
    with sections_on_columns():  # there are more at the ends of the whole
        whole = ste(model_of(sections(name, scheme, mesh={"width": "whole"})))
    assert_allclose(whole, base(name, scheme)[1], rtol=HALVED)


@every_scheme
def test_opposite_tilts_mirror_each_other(scheme):
    model, _ = base("paper", scheme, "whole")
    for tilt in (Misalignment(in_plane_um=12.0), Misalignment(out_of_plane_um=7.0), Misalignment(-5.0, 9.0, 3.0)):
        opposite = Misalignment(-tilt.in_plane_um, -tilt.out_of_plane_um, tilt.centre_distance_um)
        assert_allclose(
            ste(model, misalignment=opposite), ste(model, misalignment=tilt), rtol=TILTED, err_msg=str(tilt)
        )


@every_relation
def test_in_plane_strain_width_and_torque_go_together(name, scheme):
    wider = sections(name, scheme, mesh={"width": "plane_strain"})
    wider["pair"] = wider["pair"] | {"face_width_mm": 50.0}
    found = ste(model_of(wider), [2.5 * torque for torque in TORQUES])
    assert_allclose(found, base(name, scheme, "plane_strain")[1], rtol=ROUNDED)


@every_relation
def test_pinion_and_wheel_change_places(name, scheme):
    """A state is another one seen from the wheel, turned so far and under the torque that it found there.

    Line contact is where the flanks meet kinematically, whatever the advance (tip corners: test_line_contact). Not with
    the slave "tip", which goes by that place as well, but whose points do not: up to 2 % where the flanks change over.
    """
    found = sections(name, scheme, contact={} if scheme == "line" else {"slave": "both"})
    model = model_of(found)
    found["pinion"], found["wheel"] = found.get("wheel", found["pinion"]), found["pinion"]
    swapped = model_of(found)
    pair, other = model.elastic.mesh.meshed.pair, swapped.elastic.mesh.meshed.pair
    for phi in angles_of(model):
        there = state(model, phi, 1e3 * TORQUES[1])
        advance = 0.0 if scheme == "line" else there.advance
        _, wheel_roll = pair.contact_roll_angles(np.array(phi + advance))
        turned = float(wheel_roll) - other.pinion.base_half_angle - other.working_pressure_angle
        back = state(swapped, turned, there.wheel_torque)
        assert_allclose(back.advance * other.pinion.base_radius, there.advance * pair.pinion.base_radius, rtol=SWAPPED)
        assert_allclose(back.wheel_torque, 1e3 * TORQUES[1], rtol=SWAPPED)


@every_scheme
def test_identical_gears_are_one_or_two_models(scheme):
    _, expected = base("paper", scheme)
    two = sections("paper", scheme, mesh={"share_identical": False})
    assert_allclose(ste(model_of(two)), expected, rtol=ROUNDED, err_msg="a mesh each")
    written = sections("paper", scheme, wheel=PAIRS["paper"]["pinion"])
    assert_allclose(ste(model_of(written)), expected, rtol=0, atol=0, err_msg="[wheel] written out")


# --- trained models ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", ["line", "direct"])
def test_reduced_relations(scheme):
    found = sections("paper", scheme, offline={"angles_per_pitch": 6, "torques_Nm": [40.0, 160.0]})
    case = pmor.make_case(**found)
    full, _ = base("paper", scheme)
    model = pmor.train(case, full)
    phi, pitch = angles_of(full), full.elastic.mesh.meshed.pair.pitch
    expected = ste(model, angles=phi)
    last_step = LAST_STEP[scheme]
    assert_allclose(ste(model, angles=phi), expected, rtol=0, atol=0, err_msg="asked again")
    assert_allclose(ste(model, angles=phi + pitch), expected, rtol=last_step, err_msg="a pitch on")
    assert_allclose(ste(model, angles=phi[::-1])[:, ::-1], expected, rtol=last_step, err_msg="angles in reverse")
    halves = [ste(model, angles=part) for part in (phi[:2], phi[2:])]
    assert_allclose(np.hstack(halves), expected, rtol=last_step, err_msg="angles split in two calls")
    more = ste(model, [50.0, *TORQUES, 140.0], angles=phi)
    assert_allclose(more[1:3], expected, rtol=last_step, err_msg="more torques")
    with ThreadPoolExecutor(2) as threads:
        assert_allclose(ste(model, angles=phi, executor=threads), expected, rtol=0, atol=0, err_msg="two threads")
        again = pmor.train(case, full, executor=threads)
    assert_allclose(ste(again, angles=phi), expected, rtol=0, atol=0, err_msg="trained on two threads")
