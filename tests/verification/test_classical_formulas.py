"""Classical gear formulas against printed values, closed forms and limits; the tooth as a beam."""

import warnings
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.classical import energy_method, formulas, iso6336, weber_banaschek
from pmor.gear.classical.formulas import GearBody
from pmor.gear.classical.tooth_beam import beam_integrals, tooth_beam, tooth_load
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from tests.support.beams import ALPHA, paper_beam, prismatic_beam

E, NU = 210_000.0, 0.3
STEEL = GearBody(20.0), GearBody(20.0)
TORQUE = 100.0
PRINTED = 1e-2  # literature values are printed with two or three figures


@pytest.fixture(autouse=True)
def _quiet_extrapolation():
    """The paper's tooth is just outside the body polynomials' fit; the warning has its own test."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Sainsot body polynomials")
        yield


def gear_pair(teeth=(21, 21), module=4.0, shifts=(0.0, 0.0), helix=0.0, distance=None):
    pinion, wheel = (
        Tooth(z, module, ALPHA, hand * helix, shift) for z, shift, hand in zip(teeth, shifts, (1, -1), strict=True)
    )
    return GearPair(pinion, wheel, 20.0, distance or zero_backlash_centre_distance(pinion, wheel))


def paper_path():
    return formulas.path_of_contact(gear_pair())


def results(bodies=STEEL, torque=TORQUE, **pair):
    return formulas.classical_results(gear_pair(**pair), bodies, torque)


def test_weber_banaschek_factors_for_poisson_0_3():
    """The printed factors 10.92, 3.1 (1 + 0.294 tan^2), 5.2, 1, 1.4 (1 + 0.294 tan^2) belong to nu = 0.3."""
    beam = paper_beam()
    radius = np.array([41.0, 45.0])
    load = tooth_load(beam, radius)
    cos2, tan2 = np.cos(load.angle_rad) ** 2, np.tan(load.angle_rad) ** 2
    bending, shear = beam_integrals(beam, load.y_centre_line_mm, load.y_centre_line_mm)
    printed_tooth = cos2 / E * (10.92 * bending + 3.1 * (1 + 0.294 * tan2) * shear)
    u = (load.y_centre_line_mm - beam.y_mm[0]) / (2 * beam.half_thickness_mm[0])
    printed_body = cos2 / E * (5.2 * u**2 + u + 1.4 * (1 + 0.294 * tan2))
    assert_allclose(weber_banaschek.tooth_compliance(beam, radius, E, NU), printed_tooth, rtol=PRINTED)
    # 1.04 is printed as 1, 1.39 as 1.4
    assert_allclose(weber_banaschek.body_compliance(beam, radius, E, NU), printed_body, rtol=0.02)


def test_stubby_tooth_is_timoshenkos_cantilever_with_compression():
    """Closed forms on a prismatic tooth: P l^3/3EI-type bending, 6/5 P/(G A) shear and P/(E A) compression."""
    beam = prismatic_beam(3.0, 40.0, 47.0)
    load = tooth_load(beam, [45.0])
    angle, lever, top = load.angle_rad, load.y_centre_line_mm - 40.0, load.y_mm - 40.0
    inertia, area, shear_modulus = 6.0**3 / 12, 6.0, E / (2 * (1 + NU))
    bending = np.cos(angle) ** 2 * (lever**3 - (lever - top) ** 3) / (3 * E * inertia)
    shear, compression = 1.2 * np.cos(angle) ** 2 * top / (shear_modulus * area), np.sin(angle) ** 2 * top / (E * area)
    expected = bending + shear + compression
    assert_allclose(energy_method.tooth_compliance(beam, [45.0], E, NU), expected, rtol=1e-6)


def test_weber_tooth_is_the_energy_tooth_in_plane_strain():
    """On a slender tooth both are the same cantilever; plane strain stiffens it by 1 - nu^2."""
    beam = prismatic_beam(0.05, 5.0, 46.0)
    ratio = weber_banaschek.tooth_compliance(beam, [46.0], E, NU) / energy_method.tooth_compliance(beam, [46.0], E, NU)
    assert_allclose(ratio, 1 - NU**2, rtol=2e-3)


def test_hertz_half_width_of_two_steel_cylinders():
    """Roark's a = 1.52 sqrt(p K_D / E) for equal materials with nu = 0.3: the half width of the strip."""
    expected = 1.52 * np.sqrt(120.0 * (15.0 * 15.0 / 30.0) / E)
    assert_allclose(weber_banaschek.hertz_half_width(120.0, 15.0, 15.0, E, NU, E, NU), expected, rtol=PRINTED)


def test_hertz_approach_falls_logarithmically_with_the_half_width():
    first, second = (float(weber_banaschek.hertz_compliance(a, 3.0, E, NU)) for a in (0.1, 0.2))
    assert_allclose(first - second, 2 * np.log(2) * (1 - NU**2) / (np.pi * E), rtol=1e-9)


def test_yang_sun_contact_stiffness_of_steel():
    """k_h = pi E b / (4 (1 - nu^2)): 181 N/(mm um) for E = 210 GPa."""
    assert_allclose(1e-3 / energy_method.hertz_compliance(E, NU, E, NU), 181.25, rtol=1e-4)


def test_body_compliance_reproduces_the_half_plane_limit():
    """A thin tooth on a large disc: Sainsot's L*, M*, P* come near Weber's 5.2, 1.04, 1.4 of the half-plane."""
    beam = replace(paper_beam(), root_half_angle_rad=0.06)
    sainsot = energy_method.body_compliance(beam, [44.0], E, 37.0 / 4)
    half_chord = beam.root_radius_mm * np.sin(0.06)
    outline = beam.half_thickness_mm.copy()
    outline[0] = half_chord
    weber = weber_banaschek.body_compliance(replace(beam, half_thickness_mm=outline), [44.0], E, NU)
    assert 0.9 < (sainsot / weber).item() < 1.6


def test_body_polynomials_warn_outside_their_fit():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UserWarning, match="theta_f = 0.1435"):
            energy_method.body_compliance(paper_beam(), [44.0], E, 20.0)
    assert "half angle" in energy_method.body_fit_note(paper_beam(), 20.0)
    assert "radius ratio 1.00" in energy_method.body_fit_note(replace(paper_beam(), root_half_angle_rad=0.1), 37.0)
    assert energy_method.body_fit_note(replace(paper_beam(), root_half_angle_rad=0.1), 20.0) == ""


def test_equal_springs_share_equally():
    path = paper_path()
    cycle = formulas.mesh_cycle(lambda s, load: np.full_like(s, 1e-4), path, 100.0, n_positions=1000)
    assert_allclose(np.unique(cycle.ste_um.round(12)), [5.0, 10.0])
    assert_allclose(cycle.ste_um.mean(), 10.0 - 5.0 * (path.contact_ratio - 1), rtol=2e-3)


def test_load_dependent_pairs_reach_equilibrium():
    """Each pair deflects by the common STE and the loads add up: checked against a root search."""
    from scipy.optimize import brentq

    path = paper_path()

    def compliance(s, load):
        return (1.0 + 0.05 * s) * 1e-4 * (3.0 - 0.2 * np.log(load))

    cycle = formulas.mesh_cycle(compliance, path, 100.0, n_positions=8)
    for first, ste in zip(cycle.position_mm, cycle.ste_um, strict=True):
        positions = [s for s in (first, first + path.base_pitch_mm) if s <= path.length_mm]

        def residual(x, positions=positions):
            return 100.0 - sum(
                brentq(lambda f, s=s: f * compliance(s, f) - x, 1e-6, 300.0, xtol=1e-12) for s in positions
            )

        assert_allclose(ste, 1e3 * brentq(residual, 1e-3, 0.05, xtol=1e-14), rtol=1e-7)


def test_load_sharing_that_does_not_settle_raises():
    flip = iter(np.tile([1e-4, 3e-4], 200))
    with pytest.raises(RuntimeError, match="did not settle"):
        formulas.mesh_cycle(lambda s, load: next(flip) * (1 + s), paper_path(), 100.0, tolerance=0.0)
    with pytest.raises(ValueError, match="positive"):
        formulas.mesh_cycle(lambda s, load: s, paper_path(), 0.0)


def test_paper_pair_lies_where_it_is_known_to_lie():
    iso, energy, weber = results()
    assert_allclose(iso.mesh_stiffness_N_per_mm_um, 16.63, rtol=1e-3)
    assert iso.ste_peak_to_peak_um is None
    for row in (energy, weber):
        assert 16.6 <= row.mesh_stiffness_N_per_mm_um <= 19.6
        assert 2.7 <= row.ste_peak_to_peak_um / 1.267 <= 3.6  # um per 100 N/mm


def test_rows_say_why_they_are_empty():
    helical = results(helix=np.radians(15))
    assert helical[0].mesh_stiffness_N_per_mm_um > 0
    assert "contact ratio 1.502, overlap ratio 0.412" in helical[0].note
    assert [row.note for row in helical[1:]] == ["not applicable: for spur gears only"] * 2


def test_notes_name_low_load_and_other_materials():
    assert "lowered for the specific load of 60 N/mm" in results(torque=50.0)[0].note
    titanium = results((GearBody(20.0, 110e3), GearBody(20.0, 110e3)))[0]
    assert "E/E_steel = 0.534" in titanium.note


def test_iso_single_stiffness_of_the_paper_pair():
    """By hand: q' = 0.04723 + (0.15551 + 0.25791)/21 = 0.066917, c' = 0.8 * 0.975 / q' = 11.656 N/(mm um)."""
    assert_allclose(iso6336.single_stiffness(21, 21), 0.78 / 0.0669167, rtol=1e-5)


def test_iso_single_stiffness_of_racks_and_standard_gears():
    """The standard's own round figures: c' about 14 N/(mm um) and c_gamma about 20 for common gears."""
    assert 10 < iso6336.single_stiffness(20, 40) < 15
    assert_allclose(iso6336.single_stiffness(1e9, 1e9, dedendum=1.2), 0.8 / 0.04723, rtol=1e-6)


def test_iso_low_load_factor():
    full = iso6336.single_stiffness(21, 21, specific_load_N_per_mm=100.0)
    assert_allclose(full, iso6336.single_stiffness(21, 21))
    assert_allclose(iso6336.single_stiffness(21, 21, specific_load_N_per_mm=50.0), full * 0.5**0.25)
    assert_allclose(iso6336.single_stiffness(21, 21, specific_load_N_per_mm=99.999), full, rtol=1e-5)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"x_1": 0.1, "x_2": 0.2}, "below x_2"),
        ({"x_1": 1.5, "x_2": 1.0}, "not in -0.5 to 2"),
        ({"helix_angle_rad": 0.9}, "helix"),
        ({"specific_load_N_per_mm": 2000.0}, "1600"),
    ],
)
def test_iso_warns_outside_its_range(arguments, text):
    with pytest.warns(UserWarning, match=text):
        iso6336.single_stiffness(21, 21, **arguments)


def test_iso_warns_of_a_small_contact_ratio():
    with pytest.warns(UserWarning, match="below 1.2"):
        iso6336.mesh_stiffness(14.0, 1.1)


def test_virtual_tooth_number():
    assert iso6336.virtual_tooth_number(21, 0.0, ALPHA) == 21
    # z_n is close to z / cos^3(beta)
    beta = np.radians(15)
    assert_allclose(iso6336.virtual_tooth_number(21, beta, ALPHA), 21 / np.cos(beta) ** 3, rtol=0.01)


QUADRATURE = 2e-4  # trapezoidal rule over the 800 points of the tooth outline


@pytest.mark.parametrize(("z", "shift"), list(product([10, 12, 21, 60], [-0.2, 0.0, 0.5])))
def test_outline_is_that_of_the_generated_tooth_which_shares_no_code_with_it(z, shift):
    beam, tooth = tooth_beam(z, 4.0, ALPHA, shift, addendum=0.8), Tooth(z, 4.0, ALPHA, 0.0, shift, addendum=0.8)
    roll = np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, 2001)
    x, y = np.concatenate([tooth.root_section(np.linspace(1.0, 0.0, 4001)), tooth.flank_section(roll[1:])]).T
    radius = np.hypot(beam.y_mm, beam.half_thickness_mm)
    # Chords of 400 points; the crossing of an undercut fillet and the involute falls between two of them.
    place = 2e-2 if tooth.is_undercut else 1e-5
    assert_allclose(beam.half_thickness_mm, np.interp(radius, np.hypot(x, y), -x), rtol=0.0, atol=place)
    assert_allclose(beam.start_radius_mm, np.linalg.norm(tooth.flank_section(roll[0])), rtol=0.0, atol=place)
    assert_allclose(radius[[0, -1]], [tooth.root_radius, tooth.tip_radius])
    assert (np.diff(beam.y_mm) > 0).all(), "it does not fold"


def test_impossible_teeth_are_refused():
    with pytest.raises(ValueError, match="tip radius"):
        tooth_beam(21, 4.0, ALPHA, rack_tip_radius=0.5)
    with pytest.raises(ValueError, match="pointed"):
        tooth_beam(12, 4.0, ALPHA, profile_shift=1.0)


def test_contact_outside_the_involute_is_refused():
    with pytest.raises(ValueError, match="leaves the involute"):
        tooth_load(paper_beam(), [38.0])


def test_prismatic_beam_gives_the_cantilever_formula():
    """int (l - y)^2 / d^3 dy = l^3 / (3 d^3): times 12 that is the tip deflection P l^3 / (3 E I)."""
    beam = prismatic_beam(2.0, 37.0, 47.0)
    bending, shear = beam_integrals(beam, np.array([45.0]), np.array([45.0]))
    assert_allclose(bending, 8.0**3 / (3 * 4.0**3), rtol=1e-6)
    assert_allclose(shear, 8.0 / 4.0, rtol=1e-12)


def test_integrals_agree_with_direct_quadrature_of_one_load():
    """Slow twin: integrate (y_l - y)^2 / d^3 itself on a fine grid instead of assembling it from moments."""
    beam = paper_beam()
    load = tooth_load(beam, [44.0])
    y = np.linspace(beam.y_mm[0], load.y_mm[0], 200_001)
    thickness = 2 * np.interp(y, beam.y_mm, beam.half_thickness_mm)
    bending, shear = beam_integrals(beam, load.y_centre_line_mm, load.y_mm)
    assert_allclose(bending, np.trapezoid((load.y_centre_line_mm - y) ** 2 / thickness**3, y), rtol=QUADRATURE)
    assert_allclose(shear, np.trapezoid(1 / thickness, y), rtol=QUADRATURE)
