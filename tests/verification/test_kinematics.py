"""The pair over the pitch: periodicity, windows, the rigid pair, and how loads approach it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pmor.case import change_case, load_case
from pmor.gear.condition import ALIGNED, PLAIN
from pmor.pair.model import mesh_model, neighbouring_teeth
from pmor.penalty.kernels.windows import place_windows
from pmor.penalty.position import active_patches, overshoot
from tests.support.gear_models import MODULE, WIDTH, helical_pair, meshed_pair
from tests.support.loaded_pair import DEPTH, PAIRS, Model, every_pair, rigid_advance


@every_pair
def test_pairs_in_reach_are_those_of_the_kinematics(pair):
    meshed = Model(pair).meshed
    margin = overshoot(meshed, DEPTH)
    for phi in np.linspace(-pair.pitch, pair.pitch, 9):
        position = active_patches(meshed, phi, DEPTH)
        assert position.pair_index.tolist() == pair.touching_pairs(phi, margin).tolist()
        assert len(position.pair_index) <= meshed.tooth_pair_count


def test_kernels_never_count_more_tooth_pairs_than_there_is_memory_for():
    """Contact ratios within 1e-12 of integers, at the angles where a pair comes and another one leaves.

    Beyond the rows that the windows of a position have, a kernel would write into foreign memory.
    """
    rng, plain = np.random.default_rng(3), helical_pair(MODULE, (21, 33), 20.0, 0.0, WIDTH)
    kernel = meshed_pair(plain, 6, 2).for_kernels(PLAIN)
    per_width = plain.overlap_ratio / WIDTH
    counted = set()
    for total in np.repeat([2.0, 3.0, 4.0], 40):
        width = (total + rng.uniform(-1e-12, 1e-12) - plain.contact_ratio) / per_width
        pair = replace(plain, face_width=width)
        kinematics = meshed_pair(pair, 6, 2).kinematics(ALIGNED)
        first, last = (end + side * 0.5 * pair.pitch for end, side in zip(pair.meshing_range, (-1, 1), strict=True))
        for end in (first, last):
            phi = end + pair.pitch * rng.integers(-40, 40)
            patches, _ = place_windows(phi, 10.0 * MODULE, 1.0, 12, kinematics, kernel.gears, kernel.limits)
            assert patches.pairs <= pair.most_touching_pairs == neighbouring_teeth(pair) + 1
            assert len(pair.touching_pairs(phi, 0.5 * pair.pitch)) <= pair.most_touching_pairs
            counted.add(pair.most_touching_pairs - patches.pairs)
    assert 0 in counted, "the angles are those of the largest number"


@pytest.mark.parametrize(("name", "count"), [("paper", 13), ("unequal, wide", 3)])
def test_rigid_pair_has_no_transmission_error(name, count):
    """64 Hermite elements in roll-angle spacing, gaps only: below 0.02 um over a pitch."""
    pair = PAIRS[name]
    meshed = meshed_pair(pair, 64, 1, lodm_profile=8)
    phi = pair.roll_position_range[0] + pair.pitch * np.linspace(0.0, 1.0, count)
    advance = [rigid_advance(meshed, angle) for angle in phi]
    assert np.abs(advance).max() * pair.pinion.base_radius * 1e3 < 0.02


@pytest.mark.parametrize(("elements", "most_um"), [(6, 5.0), (8, 1.5), (16, 0.4)])
def test_without_load_coarse_patches_miss_the_involute_by_what_the_readme_says(elements, most_um):
    case = load_case(Path(__file__).parents[2] / "cases" / "small_spur.toml")
    meshed = mesh_model(change_case(case, mesh={"profile_elements": elements})).meshed
    advance = [rigid_advance(meshed, meshed.pair.pitch * share) for share in np.arange(32) / 32]
    ste_um = np.array(advance) * meshed.pair.pinion.base_radius * 1e3
    assert 0.5 * most_um < np.abs(ste_um).max() < most_um
