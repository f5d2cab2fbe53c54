"""Helical and modified pairs against CalculiX: facets on the same mesh, and line contact on flanks that resolve it.

CalculiX gets flank nodes where deviations put them. Its facets between layers of nodes cut off the helicoid's bulge,
and between rows the involute's: where they stand for the true flank, two thirds of both are given back, which is their
mean over a facet.

Slow: three positions of either pair, ``pytest -n 0 -m slow tests/verification/test_calculix_built_flanks.py -s``;
resolved flanks take CalculiX three to five minutes each. Measured, line contact over CalculiX: -0.34 % helical at 0.6,
-0.17 and -0.85 % modified at 0.6 and 0.85. With the sign of the axial forces turned it is 15 % off. At 0.85 the next
tooth of the helical pair touches with its tip corner before its time: -0.19 % (4.5 % too stiff before corners had a law
of their own). There CalculiX's facets count a node wholly or not at all, so that facets on the same mesh are left out.
"""

import math
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from unittest.mock import patch

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.fe import sector
from pmor.fe.outline import tooth_outline
from pmor.gear.topography import Topography
from pmor.lab.rivals.calculix import PROGRAM, calculix_available, calculix_ste
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import mesh_model
from tests.support.small_case import case_with, full_fe
from tests.support.states import states_at

SAME_MESH = 1e-3  # measured: 2e-4; 3e-3 is what is asked for
RESOLVED = 1.5e-2
ELEMENT_OVER_HALF_WIDTH = 0.45
STIFF_N_MM3 = 5e7  # flanks enter each other by 0.03 um
# Under more, coarse facets of the modified pair have no equilibrium at some positions.
FACET_TORQUE_NM = 80.0
# Shares of the pitch after a pair has come into mesh in the middle of the face, where no tip corner carries.
SHARES = {"helical": (0.2, 0.6, 0.7), "modified": (0.2, 0.6, 0.85)}
POSITIONS = [(name, share) for name, shares in SHARES.items() for share in shares]
TIP_CORNER = ("helical", 0.85)

pytestmark = [
    pytest.mark.jit,
    pytest.mark.skipif(not calculix_available(), reason=f"CalculiX ({PROGRAM}) is not installed"),
]

RELIEF = {"tip_relief_um": 30.0, "tip_relief_start_roll_deg": 27.0}
# Rims are thin, so that a ring can be cut beside the contact: one tooth beside it instead of two changes the STE by
# 2e-4. The helical wheel is wider: whether a node at the end of a face meets the mate, CalculiX answers with yes or no,
# and pmor with the part of its area that does.
PAIRS = {
    "helical": {
        "load": {"torque_Nm": 200.0},
        "pair": {"helix_angle_deg": 25.0, "face_width_mm": 6.0},
        "pinion": {"teeth": 17, "profile_shift": 0.2, "bore_radius_mm": 30.0},
        "wheel": {"teeth": 23, "bore_radius_mm": 42.5, "face_width_mm": 8.0},
    },
    "modified": {
        "load": {"torque_Nm": 250.0},
        "pair": {"face_width_mm": 8.0},
        "pinion": {"teeth": 21, "bore_radius_mm": 33.5},
        "wheel": {"teeth": 29, "bore_radius_mm": 49.5},
        "pinion.modification": RELIEF | {"helix_crowning_um": 10.0},
        "wheel.modification": RELIEF,
    },
}


def case_of(name, profile, width, **contact):
    sections = PAIRS[name] | {
        "mesh": {"profile_elements": profile, "width_elements": width, "width": "whole"},
        "contact": contact,
        "reduction": None,
    }
    torques = {"torques_Nm": [PAIRS[name]["load"]["torque_Nm"]]}
    return case_with(**sections, offline=torques, online=torques, compare=torques)


def angle(pair, share):
    return pair.roll_position_range[0] + share * pair.pitch


@cache
def solved_pair(name, profile, width, scheme):
    case = case_of(name, profile, width, scheme=scheme, lodm_profile=1, slave="pinion")
    if scheme == "facet":
        case = replace(case, mesh=replace(case.mesh, element="hex8"), torque_Nm=FACET_TORQUE_NM)
    return case, full_fe(case)


def solved(name, share, profile, width, scheme):
    case, model = solved_pair(name, profile, width, scheme)
    meshed = model.mesh.meshed
    return meshed, states_at(model, angle(meshed.pair, share), [nominal_condition(case)])[0]


def ste_um(name, share, profile, width, scheme):
    meshed, found = solved(name, share, profile, width, scheme)
    return 1e3 * found.advance * meshed.pair.pinion.base_radius


def same_mesh(name, share, profile, width, beside):
    """CalculiX over our facets on the same mesh, with the same elements."""
    case, model = solved_pair(name, profile, width, "facet")
    phi, torque = angle(model.mesh.meshed.pair, share), 1e3 * case.torque_Nm
    return calculix_ste(case, model.mesh, phi, torque, beside=beside).ste_um / ste_um(
        name, share, profile, width, "facet"
    )


# --- flanks that resolve the contact -------------------------------------------------------------------------------


def graded_rolls(pair, phi, fine, coarse, reach):
    """Roll angles of nodes on both flanks: `fine` (mm) apart up to `reach` from all that can touch, then coarser."""
    start, end = pair.roll_position_range
    z = np.linspace(*pair.common_face, 9)
    touching = (phi + pair.pitch * np.arange(-3, 4)[:, None] + pair.pinion.twist_per_length * z).ravel()
    touching = touching[(touching >= start) & (touching <= end)]
    found = []
    for tooth, rolls in zip((pair.pinion, pair.wheel), pair.contact_roll_angles(touching), strict=True):
        arc, marks = np.linspace(tooth.form_roll_angle**2, tooth.tip_roll_angle**2, 20001), 0.5 * tooth.base_radius
        distance = np.abs(arc[:, None] - rolls**2).min(axis=1) * marks
        spacing = np.minimum(fine + 0.4 * np.maximum(distance - reach, 0.0), coarse)
        density = marks / spacing
        found.append((arc, np.append(0.0, np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(arc)))))
    rows = math.ceil(max(count[-1] for _, count in found))
    return rows, [np.sqrt(np.interp(np.linspace(0.0, count[-1], rows + 1), count, arc)) for arc, count in found]


@contextmanager
def flank_rows(pair, rolls):
    """Let sectors be meshed with these rows of flank nodes, and columns that grow faster away from the flank."""

    def outline(tooth, _, spacing, order):
        roll = rolls[0] if tooth == pair.pinion else rolls[1]
        return replace(tooth_outline(tooth, 12, spacing, order), flank=tooth.flank_section(roll), flank_roll_angle=roll)

    with patch.object(sector, "tooth_outline", outline), patch.object(sector, "THICKNESS_GROWTH", 1.4):
        yield


def given_back(modification, tooth, face, fine, layer):
    """A modification with two thirds of the facets' sagittas added, along the transverse line of action."""
    roll_deg = np.linspace(4.0, 60.0, 57)
    roll = np.radians(roll_deg)
    sagitta = tooth.twist_per_length**2 * tooth.base_radius * roll * layer**2 / 8.0
    sagitta += fine**2 / (8.0 * tooth.base_radius * roll)
    amount = -1e3 * 2.0 / 3.0 * sagitta
    grid = Topography(tuple(roll_deg), face, tuple((float(a),) * 2 for a in amount))
    return replace(modification, topography=grid)


def resolved(name, share, fine, coarse=0.6, width=6):
    """CalculiX on arcs of the gears, integrating the pressure over facets of `fine` (mm) along the profile."""
    case = case_of(name, 16, width, scheme="facet", lodm_profile=1, slave="pinion", penalty_N_mm3=STIFF_N_MM3)
    pair = mesh_model(case).meshed.pair
    rows, rolls = graded_rolls(pair, angle(pair, share), fine, coarse, reach=5.0 * fine)
    layer, face = pair.face_width / width, (-pair.face_width, pair.face_width)
    case = replace(
        case, mesh=replace(case.mesh, profile_elements=rows),
        pinion_modification=given_back(case.pinion_modification, pair.pinion, face, fine, layer),
        wheel_modification=given_back(case.wheel_modification, pair.wheel, face, fine, layer),
    )  # fmt: skip
    with flank_rows(pair, rolls):
        mesh = mesh_model(case)
    return calculix_ste(case, mesh, angle(pair, share), 1e3 * case.torque_Nm, "surface_to_surface", beside=1)


@pytest.mark.slow
def test_helical_facets_give_the_ste_of_calculix():
    assert_allclose(same_mesh("helical", 0.6, 6, 2, beside=1), 1.0, rtol=SAME_MESH)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "share"), POSITIONS)
def test_facets_as_built_give_the_ste_of_calculix(name, share):
    ratio = same_mesh(name, share, 8, 4, beside=2)
    print(f"\n{name} at {share:g}: CalculiX over facets on the same mesh, less 1: {ratio - 1.0:.2e}")  # noqa: T201
    assert_allclose(ratio, 1.0, rtol=SAME_MESH)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "share"), [*POSITIONS, TIP_CORNER])
def test_line_contact_gives_the_ste_of_calculix_on_flanks_that_resolve_the_contact(name, share):
    _, found = solved(name, share, 16, 8, "line")
    half_width = np.average(found.patches()[:, 0], weights=found.line_load)
    ours = ste_um(name, share, 16, 8, "line")
    theirs = resolved(name, share, ELEMENT_OVER_HALF_WIDTH * half_width)
    print(  # noqa: T201
        f"\n{name} at {share:g}: line {ours:.3f} um, CalculiX {theirs.ste_um:.3f} um ({theirs.unknowns} unknowns, "
        f"{theirs.seconds:.0f} s): {100.0 * (ours / theirs.ste_um - 1.0):+.2f} %; half-width {half_width:.3f} mm"
    )
    assert_allclose(ours, theirs.ste_um, rtol=RESOLVED)
