"""What is meshed of the face width: half of it is the whole by symmetry, one layer is plane strain."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor.penalty.equilibrium
import pmor.penalty.solve
from pmor.body.elastic_gear import elastic_gear
from pmor.case.width import elements_across, meshed_width, mirrors_at_mid_width, whole_width
from pmor.core.errors import MeshError
from pmor.fe.sector import build_sector
from pmor.gear.condition import at_torques
from pmor.lab.rivals.conventional import conventional_pair
from pmor.pair.model import mesh_model
from pmor.pair.sweep import sweep_ste
from pmor.storage.basis_file import read_basis
from pmor_online.model import reduced_pair
from pmor_online.sweep import sweep_reduced_pair
from tests.support.gear_models import POISSON, WIDTH, YOUNG, tooth
from tests.support.small_case import case_with, full_fe

TWO_ROUTES = 1e-12  # of the largest compliance; measured 2e-14
SAME_ANSWER = 1e-9
ACROSS = 4
TORQUE = 1e5
MIRROR = np.array([1.0, 1.0, -1.0])

SCHEMES = {
    "line": {"scheme": "line"},
    "direct": {"scheme": "direct", "lodm_profile": 2},
}


def case_of(width, across=ACROSS, contact=None, **sections):
    mesh = {"profile_elements": 6, "width_elements": across, "width": width}
    sections |= {"results": {"root_stress": False}}
    return case_with(mesh=mesh, contact=contact or SCHEMES["line"], **sections)


def ste_um(case, angles=5, torque=TORQUE):
    model = full_fe(case)
    meshed = model.mesh.meshed
    sweep = sweep_ste(meshed, model.elasticity_at, meshed.pair.pitch * np.arange(angles) / angles, at_torques([torque]))
    assert sweep.converged.all()
    return sweep.ste_um[0]


@pytest.fixture(autouse=True)
def tight(monkeypatch):
    """Equilibria to a tenth of what is compared."""
    monkeypatch.setattr(pmor.penalty.equilibrium, "LINEAR", 0.1 * SAME_ANSWER)
    solve = partial(pmor.penalty.solve.solve_equilibrium, tolerance=0.1 * SAME_ANSWER)
    monkeypatch.setattr(pmor.penalty.solve, "solve_equilibrium", solve)


# --- which width -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("width", "across", "meshed", "elements"),
    [
        ("half", 2, "half", 1), ("half", 8, "half", 4), ("half", 1, "whole", 1), ("half", 3, "whole", 3),
        ("whole", 4, "whole", 4), ("plane_strain", 4, "plane_strain", 1), ("plane_strain", 1, "plane_strain", 1),
    ],
)  # fmt: skip
def test_half_is_meshed_where_nodes_are_in_the_plane_of_symmetry(width, across, meshed, elements):
    case = case_of(width, across)
    assert meshed_width(case) == meshed
    assert mirrors_at_mid_width(case) == (meshed == "half")
    assert elements_across(case) == elements
    model = mesh_model(case)
    assert (model.pinion.width, model.pinion.mirrored, model.meshed.mirrored) == (meshed, *(meshed == "half",) * 2)
    assert len(model.pinion.z) == model.meshed.pinion.columns == elements + 1
    ends = model.pinion.z[[0, -1]]
    assert_allclose(ends, [-10.0, 0.0 if meshed == "half" else 10.0], rtol=0.0, atol=1e-12)


def test_whole_gears_are_made_of_the_whole_width_only():
    for width in ("half", "plane_strain"):
        case = case_of(width, contact=SCHEMES["direct"])
        with pytest.raises(MeshError, match='write .* width = "whole"'):
            conventional_pair(case, mesh_model(case))
        assert mesh_model(whole_width(case)).pinion.width == "whole"


# --- half the width --------------------------------------------------------------------------------------------------


def shared(compliance):
    """Compliance of a whole gear, (k, lines, columns, 3, lines, columns, 3): nodes and their images share forces."""
    mirrored = compliance[..., ::-1, :] * MIRROR
    half = compliance.shape[2] // 2 + 1
    return 0.5 * (compliance + mirrored)[:, :, :half, :, :, :half]


@pytest.mark.parametrize("layer_columns", [0, 2])
@pytest.mark.parametrize("element", ["hex8", "hex8i", "hex20"])
def test_compliance_of_half_the_width_is_that_of_the_whole_under_mirrored_forces(element, layer_columns):
    half, whole = (
        elastic_gear(mesh, YOUNG, POISSON, element, neighbours=2, layer_columns=layer_columns)
        for mesh in (
            build_sector(tooth(12, 0.2), 8.0, WIDTH, 3, ACROSS, width=w, order=2 if element == "hex20" else 1)
            for w in ("half", "whole")
        )
    )
    lines, columns = whole.mesh.flank.shape
    expected = shared(whole.compliance.reshape(5, lines, columns, 3, lines, columns, 3))
    assert_allclose(
        half.compliance.reshape(expected.shape), expected, rtol=0.0, atol=TWO_ROUTES * np.abs(expected).max()
    )


# --- plane strain ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", ["line", "direct"])
def test_plane_strain_is_what_ever_wider_gears_come_to(scheme):
    """It is stiffer than the gear that is free at its faces: by 3.1 % in the paper's pair, 20 mm wide.

    What the free faces give way is confined to them: the difference halves with twice the width. Measured 2.0, 1.1 and
    0.6 % at 40, 80 and 160 mm on 16 elements over the profile.
    """
    plane = ste_um(case_of("plane_strain", contact=SCHEMES[scheme]))
    missing = []
    for share, across in ((1, 8), (2, 8), (4, 12)):
        sections = {"contact": SCHEMES[scheme], "pair": {"face_width_mm": 20.0 * share}}
        missing.append(1.0 - plane / ste_um(case_of("half", across, **sections), torque=TORQUE * share))
    assert np.all(np.array(missing) > 0.0)
    assert np.max(missing[0]) < 0.04
    assert np.max(missing[1]) < 0.025
    assert np.max(missing[2]) < 0.015


# --- half a pair ----------------------------------------------------------------------------------------------------

FAMILIES = [{}, {"shapes": "positions"}]


@pytest.fixture(scope="module", params=FAMILIES, ids=["flank lines", "positions"])
def pairs(request, small_basis_file):
    """Half and whole width of the small model, each solved and reduced by itself."""
    files = [small_basis_file(width, **request.param) for width in ("half", "whole")]
    return tuple(reduced_pair(read_basis(path)) for path in files)


# With one element in the half, its outer normals come from a chord where the whole has a parabola through three nodes:
# measured 3.6e-8, and 1e-11 with that parabola.
@pytest.mark.parametrize("slave", ["tip", "both"])
def test_half_the_width_gives_the_ste_and_the_shares_of_the_whole(slave, pairs):
    sweeps = []
    for reduced in pairs:
        meshed = replace(reduced.meshed, scheme=replace(reduced.meshed.scheme, slave=slave))
        phi = meshed.pair.pitch * np.arange(8) / 8
        conditions = at_torques([60e3, 100e3])
        sweeps.append(sweep_reduced_pair(replace(reduced, meshed=meshed), phi, conditions, tolerance=1e-9))
    half, whole = sweeps
    assert half.converged.all()
    assert whole.converged.all()
    assert_allclose(half.ste_um, whole.ste_um, rtol=SAME_ANSWER)
    assert np.array_equal(half.pair_index, whole.pair_index)
    assert_allclose(half.pair_share, whole.pair_share, rtol=0.0, atol=SAME_ANSWER)
    assert (half.pair_share > 0.05).sum(axis=2).max() == 2, "two pairs shared the load somewhere"
