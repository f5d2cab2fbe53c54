"""Stress on the faces of webs and at the edges of their holes: equilibrium, a textbook hole, and plain webs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

import pmor.fe.perforated_web
from pmor.body.web_stress import surface_stress
from pmor.case import make_case
from pmor.fe.perforated_web import PerforatedWeb
from pmor.pair.model import elastic_model, mesh_model

E, NU = 206_000.0, 0.3
WEB = {"rim_thickness_mm": 1.6, "web_thickness_mm": 1.0, "hub_radius_mm": 9.0, "stress": True}
# Of the stress by parabolas in the web, beside their load.
PARABOLAS = 3e-3
# The hole's radius over that of its place: shear falls by as much across it; and points beside the largest stress.
SMALL_HOLE = 0.01
# Of elements of two meshes; the smaller ones have less than 0.5 % of the stress to themselves.
TWO_MESHES = 0.02
# Of displacement by parabolas over the width at hub and rim, 0.8 thicknesses away, and of a coarse mesh beside.
PARABOLAS_OF_CIRCLES = 0.05


def case_of(helix=0.0, **blank):
    return make_case(
        teeth=13, bore_radius_mm=8.0, module_mm=2.5, face_width_mm=12.0, torque_Nm=50.0, scheme="line",
        profile_elements=3, width_elements=2, results={"root_stress": False}, error_bar=False, helix_angle_deg=helix,
        pinion={"blank": WEB | blank}, wheel={"teeth": 13, "bore_radius_mm": 8.0},
    )  # fmt: skip


def solved(helix=0.0, **blank):
    case = case_of(helix, **blank)
    mesh = mesh_model(case)
    return mesh.pinion, elastic_model(case, mesh).pinion.web_stress


def mises_of(stress):
    one, two, shear = np.moveaxis(stress, -1, 0)
    return np.sqrt(one**2 + two**2 - one * two + 3.0 * shear**2)


def stress_by(web, force):
    """Stress in all cells by a force on the flank's unknowns of tooth 0, (m, p, 3)."""
    return np.einsum("pia,ca->cpi", web.stress, web.moved[0] @ (web.pattern @ force))


@pytest.mark.parametrize(("helix", "offset"), [(0.0, 0.0), (0.0, 1.5), pytest.param(15.0, 0.0, marks=pytest.mark.slow)])
def test_the_mean_shear_of_a_web_carries_the_torque(helix, offset):
    """T / (2 pi r^2 t) where the ends of the web are some thicknesses away."""
    sector, web = solved(helix, web_offset_mm=offset, web_thickness_mm=0.5)
    force = np.random.default_rng(3).standard_normal(web.pattern.shape[1])
    x, y, _ = sector.nodes[sector.flank.ravel()].T
    torque = np.sum(x * force[1::3] - y * force[::3])
    far = np.abs(web.places[:, 0] - 10.25) < 0.6
    radius = np.unique(web.places[far, 0].round(9))
    shear = stress_by(web, force)[..., 2]
    assert len(radius) > 1
    for r in radius:
        here = far & (np.abs(web.places[:, 0] - r) < 1e-6)
        assert_allclose(shear[:, here].mean(), torque / (2.0 * np.pi * r**2 * 0.5), rtol=PARABOLAS)


def in_twist(web, nu):
    """Stress in the surfaces of a web whose rim turns, over the shear at the circle of its holes."""
    outward = [k for k, (part, power) in enumerate(web._powers) if (part, power) == (1, 0)][0]
    moved = np.zeros((2 * web.largest + 1, 2, len(web.parts)), dtype=complex)
    moved[web.largest, 1, outward] = web.outer
    found = surface_stress(web, E, nu, 0.0)
    shear = E / (1.0 + nu) / (1.0 / web.inner**2 - 1.0 / web.outer**2) / web.on_radius**2
    return found, (found.stress @ moved.ravel()).real.reshape(-1, 3) / shear


@pytest.mark.parametrize("mirrored", [pytest.param(False, marks=pytest.mark.slow), True])
def test_stress_at_the_edge_of_a_small_hole_is_four_times_the_shear(mirrored):
    """Kirsch 1898; of a thin web, and of any without Poisson's ratio: else stress changes over the thickness."""
    for thickness, nu in ((0.1, NU), (4.0, 0.0)):
        faces = (-0.5 * thickness, 0.0 if mirrored else 0.5 * thickness)
        web = PerforatedWeb(35.0, 65.0, faces, 8, 0.5, 50.0, 0.3, mirrored, 12)
        found, stress = in_twist(web, nu)
        assert_allclose(mises_of(stress)[found.edge].max(), 4.0, rtol=SMALL_HOLE)
        assert_allclose(np.hypot(found.places[:, 0] * np.sin(found.places[:, 1] - 0.3),
                                 found.places[:, 0] * np.cos(found.places[:, 1] - 0.3) - 50.0)[found.edge],
                        0.5, rtol=SMALL_HOLE)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("length", [0.0, np.radians(12.0)])
def test_finer_meshes_around_a_hole_change_its_stress_little(length, monkeypatch):
    web = PerforatedWeb(35.0, 74.5, (-4.0, 0.0), 8, 12.0, 54.75, 0.3, True, 12, length)
    found = []
    for least, first, growth, through in ((6, 0.12, 1.6, 2), (12, 0.06, 1.3, 4)):
        for name, value in (("LEAST_FINE", least), ("FIRST_ROW", first), ("GROWTH", growth), ("THROUGH", through)):
            monkeypatch.setattr(pmor.fe.perforated_web, name, value)
        surfaces, stress = in_twist(web, NU)
        found.append(mises_of(stress)[surfaces.edge].max())
    assert_allclose(found[0], found[1], rtol=TWO_MESHES)


@pytest.mark.slow
@pytest.mark.parametrize(("helix", "offset"), [(0.0, 0.0), pytest.param(15.0, 1.5, marks=pytest.mark.slow)])
def test_a_web_with_tiny_holes_has_the_stress_of_the_plain_one(helix, offset):
    """By two meshes and two expansions, at the same angles in the gear; beside hub and rim they differ by 10 %."""
    _, plain = solved(helix, web_offset_mm=offset)
    holes = {"count": 3, "radius_mm": 0.1, "on_radius_mm": 10.25, "first_deg": 10.0}
    _, holed = solved(helix, web_offset_mm=offset, holes=holes)
    force = np.random.default_rng(5).standard_normal(plain.pattern.shape[1])
    for face in np.unique(plain.places[:, 2]):
        own = ~holed.edge & (np.abs(holed.places[:, 2] - face) < 1e-6)
        around = holed.places[own, 1] + 2.0 * np.pi / 3.0 * np.arange(3)[:, None]
        away = np.hypot(holed.places[own, 0] - 10.25, 10.25 * (holed.places[own, 1] - np.radians(10.0))) > 0.5
        away &= np.abs(holed.places[own, 0] - 10.25) < 0.45
        found = mises_of(stress_by(holed, force)[:, own])[:, away]
        expected = mises_of(at_places(plain, force, face, holed.places[own, 0], around))[:, away]
        assert found.size > 20
        assert np.abs(found - expected).max() < PARABOLAS_OF_CIRCLES * expected.max()


def at_places(web, force, face, radius, angle):
    """Stress of a plain web at places of a face, by its harmonics and by cubic splines over the radius."""
    own = np.flatnonzero(np.abs(web.places[:, 2] - face) < 1e-6)
    angles = len(np.unique(web.places[own, 1].round(9)))
    order = own[np.lexsort((web.places[own, 0], web.places[own, 1]))].reshape(angles, -1)
    rows, first = web.places[order[0], 0], web.places[order[0, 0], 1]
    stress = stress_by(web, force)[:, order].reshape(-1, len(rows), 3)
    amplitudes = np.fft.fft(stress, axis=0) / len(stress)
    n = np.fft.fftfreq(len(stress), 1.0 / len(stress))
    waves = np.exp(1j * n * (angle[..., None] - first))
    by_radius = CubicSpline(rows, amplitudes, axis=1)(np.clip(radius, rows[0], rows[-1]))
    return np.einsum("cpn,npi->cpi", waves, by_radius).real
