"""Cyclic condensation against the whole gear in one sparse system, and the laws that any compliance obeys."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.elastic_gear import elastic_gear
from pmor.core.conventions import rotation_z
from pmor.fe.assembly import assemble, degrees_of_freedom
from pmor.fe.whole_gear import whole_gear_mesh
from tests.support.gear_models import POISSON, YOUNG, sector, tooth
from tests.support.whole_gear import volume_displacement, whole_gear_displacement

EQUAL = 1e-9  # relative to the largest entry: two exact routes; the stiffness is conditioned to 1e6
RECIPROCAL = 1e-12  # made to hold exactly by averaging round-off

GEARS = {"spur": tooth(12, 0.2), "undercut, odd": tooth(9), "helical": tooth(12, 0.2, 20.0)}
OFFSETS = (-2, -1, 0, 1, 2)


BOTH = [(g, e) for g in GEARS for e in ("hex8i", "hex20") if e == "hex8i" or g == "helical"]


@pytest.fixture(scope="module", params=BOTH, ids="-".join)
def gear(request):
    name, element = request.param
    mesh = sector(GEARS[name], 3, 2, order=2 if element == "hex20" else 1)
    return elastic_gear(mesh, YOUNG, POISSON, element, neighbours=2, keep_rows=True), element


@pytest.fixture(scope="module")
def whole(gear):
    """Displacements of the whole gear under a unit force on every fourth degree of freedom of tooth 0's flank."""
    elastic, element = gear
    size = elastic.compliance.shape[1]
    loads = np.eye(size)[:, ::4]
    return loads, whole_gear_displacement(elastic.mesh, YOUNG, POISSON, element, loads)


def test_flank_displacements_equal_the_whole_gear_on_all_teeth_in_reach(gear, whole):
    elastic, _ = gear
    loads, displacement = whole
    flank = degrees_of_freedom(elastic.mesh.flank)
    for offset in OFFSETS:
        expected = displacement[offset % elastic.mesh.teeth][flank]
        assert_allclose(elastic.tooth_compliance(offset) @ loads, expected, rtol=0, atol=EQUAL * np.abs(expected).max())


def test_volume_displacement_equals_the_whole_gear(gear, whole):
    elastic, _ = gear
    loads, displacement = whole
    for offset in OFFSETS:
        for load in (0, 7):
            expected = displacement[offset % elastic.mesh.teeth][:, load].reshape(-1, 3)
            found = volume_displacement(elastic, offset, loads[:, load])
            assert_allclose(found, expected, rtol=0, atol=EQUAL * np.abs(expected).max())
            assert_allclose(found[elastic.mesh.bore], 0.0, atol=0)


def test_reciprocity_between_teeth(gear):
    """Maxwell: tooth k moves under forces on tooth 0 as tooth 0 does under forces on tooth k."""
    elastic, _ = gear
    for k in (1, 2):
        assert_allclose(
            elastic.tooth_compliance(k),
            elastic.tooth_compliance(-k).T,
            rtol=0,
            atol=RECIPROCAL * np.abs(elastic.tooth_compliance(k)).max(),
        )


# --- forces and moments --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["undercut, odd", "helical odd"])
def ring(request):
    """A gear with few teeth whose compliance reaches all of them, with random forces on tooth 0."""
    mesh = sector(tooth(9, 0.0, 20.0 if "helical" in request.param else 0.0), 2, 1)
    elastic = elastic_gear(mesh, YOUNG, POISSON, "hex8i", neighbours=4, keep_rows=True)
    return elastic, np.random.default_rng(5).normal(size=(mesh.flank.size, 3))


def assembled(elastic, forces, loaded_tooth):
    """Displacement of the whole gear under forces on one tooth, in global axes, put together from all sectors."""
    mesh = elastic.mesh
    nodes, elements, numbers = whole_gear_mesh(mesh)
    displacement = np.zeros_like(nodes)
    for offset in range(-4, 5):
        k = (loaded_tooth + offset) % mesh.teeth
        own_frame = volume_displacement(elastic, offset, forces.ravel())
        displacement[numbers[k]] = own_frame @ rotation_z(2.0 * math.pi * k / mesh.teeth).T
    return nodes, elements, numbers, displacement


@pytest.mark.parametrize("loaded_tooth", [0, 3])
def test_displacements_of_all_sectors_balance_the_load_whichever_tooth_bears_it(ring, loaded_tooth):
    elastic, forces = ring
    mesh = elastic.mesh
    nodes, elements, numbers, displacement = assembled(elastic, forces, loaded_tooth)
    reaction = (assemble(nodes, elements, YOUNG, POISSON, "hex8i") @ displacement.ravel()).reshape(-1, 3)
    applied = np.zeros_like(nodes)
    applied[numbers[loaded_tooth, mesh.flank.ravel()]] = forces @ rotation_z(mesh_angle(mesh, loaded_tooth)).T
    free = np.setdiff1d(np.arange(len(nodes)), numbers[:, mesh.bore])
    scale = np.abs(forces).max()
    assert_allclose(reaction[free], applied[free], rtol=0, atol=EQUAL * scale)
    # The bore takes up the whole load: forces and moments about all axes.
    assert_allclose(reaction.sum(axis=0), 0.0, atol=EQUAL * scale)
    assert_allclose(np.cross(nodes, reaction).sum(axis=0), 0.0, atol=EQUAL * scale * 30.0)


def mesh_angle(mesh, k):
    return 2.0 * math.pi * k / mesh.teeth
