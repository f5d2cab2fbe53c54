"""Transmission error on shafts by its parts: rigid motion is of bearings, what bends between them of shafts."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.machine.loader import load
from pmor.machine.model import loaded
from pmor.machine.ste_parts import ste_parts
from tests.support.gearboxes import SMALL, written

ROUND_OFF = 1e-9


@pytest.fixture(scope="module", params=[2, 1])
def box(request, tmp_path_factory):
    """The small box, on two bearings to a shaft, or on one that holds tilt too."""
    text = SMALL
    if request.param == 1:
        second = text[text.index('[[bearings]]\nname = "B"') : text.index('[[bearings]]\nname = "C"')]
        axial = "axial_N_per_mm = 1e5\n"
        text = text.replace(second, "").replace(axial, f"{axial}tilt_Nmm_per_rad = 1e8\n")
    path = written(tmp_path_factory.mktemp("box"), text)
    model = load(path).model
    return loaded(model, model.sections.loads[0])


def moved_rigidly(box, rng):
    """All nodes of each shaft as a rigid body, without rotation about its axis."""
    found = np.zeros(len(box.load))
    for name, beam in box.beams.items():
        origin, turn = rng.standard_normal(3), np.array([0.0, *rng.standard_normal(2)])
        for node, place in enumerate(beam.stations):
            first = box.first[name] + 6 * node
            found[first : first + 6] = [*(origin + np.cross(turn, [place, 0.0, 0.0])), *turn]
    return found


def test_shafts_that_move_as_rigid_bodies_are_carried_by_their_bearings(box):
    moved = moved_rigidly(box, np.random.default_rng(5))
    (mesh,) = box.meshes
    parts = ste_parts(box, moved, mesh)
    expected = sum(wrench @ moved[hub : hub + 6] for hub, wrench in zip(mesh.hubs, mesh.wrenches, strict=True))
    assert_allclose(parts.bearings_um, 1e3 * expected, rtol=ROUND_OFF)
    assert abs(parts.shafts_um) < ROUND_OFF * abs(parts.bearings_um)


def test_what_bends_between_bearings_that_stand_still_is_of_the_shafts(box):
    rng = np.random.default_rng(6)
    bent = rng.standard_normal(len(box.load))
    for bearing in box.bearings:
        bent[np.nonzero(bearing.rows.any(axis=0))[0]] = 0.0
    (mesh,) = box.meshes
    parts = ste_parts(box, bent, mesh)
    assert parts.bearings_um == 0.0
    assert parts.shafts_um != 0.0
    twisted = bent.copy()
    for hub in mesh.hubs:
        twisted[hub + 3] += 1.0
    assert ste_parts(box, twisted, mesh) == parts, "rotation about the axes is left out"
