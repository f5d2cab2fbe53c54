"""Schemes on surfaces through nodes: deviations of the flanks move the nodes, and nothing else."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.app.full import full_model
from pmor.app.training import load_model, train
from pmor.case import change_case, parse_case
from pmor.core.conventions import rotation_z
from pmor.core.errors import CaseError
from pmor.gear.condition import PLAIN, Assembly, at_torques
from pmor.gear.kernels.deviation import flank_deviation
from pmor.gear.modification import UNMODIFIED, Modification
from pmor.gear.topography import Topography
from pmor.lab.rivals.deviated_mesh import flank_shift
from pmor.pair.model import mesh_model
from pmor.penalty.position import active_patches
from pmor.penalty.solve import solve_position
from pmor_online.model import reduced_pair
from pmor_online.sweep import sweep_reduced_pair
from tests.support.gear_models import WIDTH, gear_pair, meshed_pair, tooth
from tests.support.loaded_pair import rigid_advance
from tests.support.small_case import case_text, small_case

PAIR = gear_pair(tooth(17, 0.4), tooth(31, 0.1))
# Relief that reaches well into the path of contact, and deviations that differ over the width and from tooth to tooth.
RELIEVED = Modification(
    tip_relief_um=20.0, tip_relief_start_roll_deg=30.0, helix_crowning_um=5.0, helix_slope_um=-8.0,
    pitch_deviations_um=tuple(3.0 * math.sin(2.0 * j) for j in range(17)),
)  # fmt: skip
ROOTED = Modification(root_relief_um=10.0, root_relief_end_roll_deg=18.0, profile_crowning_um=4.0, twist_um=6.0)
SLOPED = Modification(profile_slope_um=-10.0, profile_crowning_um=-2.0)
SMALL_RELIEF = Modification(tip_relief_um=20.0, tip_relief_start_roll_deg=24.0, helix_crowning_um=5.0)


def even(amount_um):
    """Everywhere the same amount."""
    return Modification(topography=Topography((0.0, 60.0), (-WIDTH, WIDTH), ((amount_um,) * 2,) * 2))


def rigid_ste_um(meshed, phi, assembly=PLAIN):
    """Transmission error at which the undeformed flanks just touch."""
    return rigid_advance(meshed, phi, assembly) * meshed.pair.pinion.base_radius * 1e3


@pytest.mark.parametrize("slave", ["pinion", "wheel"])
@pytest.mark.parametrize("surface", ["hermite", "facet"])
def test_the_same_amount_everywhere_delays_the_contact_by_it(surface, slave):
    projection = "patch" if surface == "hermite" else "facet"
    meshed = meshed_pair(PAIR, 12, 2, surface=surface, projection=projection, slave=slave)
    phi = 0.5 * sum(PAIR.roll_position_range)
    plain = rigid_ste_um(meshed, phi)
    for assembly in (
        Assembly(pinion=even(7.0)),
        Assembly(wheel=even(7.0)),
        Assembly(pinion=even(12.0), wheel=even(-5.0)),
    ):
        # The parallel curve of an involute is the same involute, turned: exact but for the surface's own error.
        assert rigid_ste_um(meshed, phi, assembly) - plain == pytest.approx(
            7.0, abs=0.01 if surface == "hermite" else 0.1
        )


def test_where_one_pair_touches_the_gap_has_opened_by_the_deviation():
    meshed, assembly = meshed_pair(PAIR, 24, 1, slave="pinion", lodm_profile=32), Assembly(pinion=SLOPED)
    deviation = meshed.for_kernels(assembly).deviations[0]
    start, end = PAIR.roll_position_range
    for phi in np.linspace(end - PAIR.pitch, start + PAIR.pitch, 6)[1:-1]:
        roll = float(PAIR.contact_roll_angles(phi)[0])
        expected = 1e3 * flank_deviation(deviation, roll, 0.0, 0)
        found = rigid_ste_um(meshed, float(phi), assembly) - rigid_ste_um(meshed, float(phi))
        # A sloped flank is the same flank turned a little: it touches a little off, where the gap is a little less.
        assert found == pytest.approx(expected, abs=0.02)
    assert expected < -1.0


@pytest.mark.parametrize("flanks", [(SMALL_RELIEF, UNMODIFIED), (SMALL_RELIEF, SMALL_RELIEF)], ids=["one", "both"])
def test_compiled_sweep_and_its_slow_twin_agree_on_modified_flanks(small_basis, flanks):
    reduced, phi = reduced_pair(small_basis), np.linspace(0.0, 0.28, 4)
    conditions = at_torques([6e4, 1e5], pinion=flanks[0], wheel=flanks[1])
    fast = sweep_reduced_pair(reduced, phi, conditions, tolerance=1e-10)
    plain = sweep_reduced_pair(reduced, phi, at_torques([6e4, 1e5]), tolerance=1e-10)
    assert fast.converged.all()
    assert np.abs(fast.ste_um - plain.ste_um).max() > 1.0
    for i, angle in enumerate(phi):
        slow = solve_position(reduced.meshed, float(angle), conditions, reduced.elasticity_at)
        found = [e.advance * reduced.meshed.pair.pinion.base_radius * 1e3 for e in slow.equilibria]
        assert_allclose(fast.ste_um[:, i], found, rtol=1e-8)


def test_shapes_are_trained_on_flanks_that_differ_over_the_width(tmp_path):
    crowned = change_case(small_case("half"), pinion={"modification": {"helix_crowning_um": 10.0}})
    full = full_model(crowned)
    model = train(crowned, full)
    found = {c.pinion for there in model.basis.training.conditions for c in there}
    assert found == {Modification(helix_crowning_um=10.0)}
    model.save(tmp_path / "basis.h5")
    assert load_model(tmp_path / "basis.h5").basis.training.conditions == model.basis.training.conditions
    relieved = replace(crowned.pinion_modification, tip_relief_um=15.0, tip_relief_start_roll_deg=25.0)
    # Measured with six trained angles: 2.7e-3 and 1.9e-3.
    for flanks, allowed in (({}, 4e-3), ({"pinion": relieved}, 4e-3)):
        expected, got = full.sweep(angles=3, **flanks), model.sweep(angles=3, **flanks)
        assert_allclose(got.ste_um, expected.ste_um, rtol=allowed)
    with pytest.raises(CaseError, match="load the width otherwise"):
        model.sweep(angles=3, pinion=UNMODIFIED)
    with pytest.raises(CaseError, match="below the tip circle"):
        model.sweep(angles=3, pinion=replace(relieved, tip_relief_start_roll_deg=50.0))
    beyond = model.sweep(angles=3, pinion=UNMODIFIED, extrapolate=True)
    plain = full.sweep(angles=3, pinion=UNMODIFIED)
    assert np.abs(beyond.ste_um / plain.ste_um - 1.0).max() > 5e-3


@pytest.mark.parametrize("helix_deg", [0.0, 25.0])
def test_whole_gears_for_other_programs_have_their_flank_nodes_in_the_same_places(helix_deg):
    """Tooth by tooth, pitch deviations and all; the mates of a pair are tooth j of the pinion and -j of the wheel."""
    text = case_text(
        pair={"helix_angle_deg": helix_deg}, pinion={"teeth": 17, "profile_shift": 0.4},
        wheel={"teeth": 31, "bore_radius_mm": 30.0},
        mesh={"profile_elements": 4, "width_elements": 2, "width": "whole"},
    )  # fmt: skip
    mesh = mesh_model(parse_case(text, "small", "small"))
    meshed, assembly = mesh.meshed, Assembly(pinion=RELIEVED, wheel=ROOTED)
    phi = meshed.pair.meshing_range[0] + 0.5 * meshed.pair.pitch - 2.0 * meshed.pair.pitch
    plain, position = (active_patches(meshed, phi, 5.0, b) for b in (PLAIN, assembly))
    compared = 0
    for gear, (sector, toothing, deviation) in enumerate(
        zip(
            (mesh.pinion, mesh.wheel), (meshed.pair.pinion, meshed.pair.wheel), meshed.deviations(assembly), strict=True
        )
    ):
        shift = flank_shift(sector, toothing, deviation)
        for p, number in enumerate(position.pair_index):
            index = int(number if gear == 0 else -number) % toothing.teeth
            slices = plain.window_slice(p, gear), position.window_slice(p, gear)
            expected = position.nodes[slices[1]] - plain.nodes[slices[0]]
            own = shift[index] @ rotation_z(index * toothing.angular_pitch)
            found = own.reshape(-1, 3)[position.flank_nodes[p][gear]]
            assert_allclose(found, expected, rtol=0.0, atol=1e-13)
            compared += len(found)
    assert compared > 30
