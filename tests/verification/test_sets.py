"""Several meshes at once: against pairs by themselves, and a slow twin of the coupled solution."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.errors import GeometryError
from pmor.gear.condition import ALIGNED
from pmor.line.kernels.law import approach_of
from pmor.line.kernels.tip_corner import LineLaw
from pmor.sets.kinematics import Centre, Meeting, placements
from tests.support.small_sets import chain, levers_at

TORQUE = 1e5
# Solutions by two ways of Newton's method, to its tolerance.
SOLVED = 1e-9
WAYS = pytest.mark.parametrize(("helix", "width"), [(0.0, "half"), (15.0, "whole")])


def angles(train, count=5):
    return np.linspace(0.0, train.meshes[0].pair.meshed.pair.pitch, count, endpoint=False)


def rigid(train):
    """The same gears, whose flanks do not feel each other through their bodies."""
    return replace(train, bodies=tuple(replace(body, far=None) for body in train.bodies))


def alone(mesh, phi, torque):
    """A mesh of a train by itself."""
    return mesh.pair.place(mesh.start + mesh.rate * phi, ALIGNED).solve(np.array([torque]))


@WAYS
def test_a_train_of_one_mesh_is_the_pair(helix, width):
    _, train = chain((21, 25), helix, width=width)
    phi = angles(train)
    found, expected = train.place(phi).solve([[TORQUE]]), alone(train.meshes[0], phi, TORQUE)
    assert found.converged.all()
    assert_allclose(found.movement[0, :, 0], expected.advance[0], rtol=SOLVED)
    assert_allclose(found.force[0], expected.force[0], rtol=0.0, atol=SOLVED * expected.force.max())


@WAYS
@pytest.mark.parametrize("bend_deg", [0.0, 40.0])
def test_two_meshes_of_a_rigid_idler_are_two_pairs(helix, width, bend_deg):
    """The idler is ahead by the deflection of the second mesh: corners meet their mates a little elsewhere."""
    _, train = chain((21, 25, 19), helix, bend_deg, width=width)
    phi, (first, second) = angles(train), train.meshes
    found = rigid(train).place(phi).solve([[TORQUE, 0.0]])
    ahead = found.movement[0, :, 0] * first.pair.base_radius
    apart = [alone(mesh, phi, torque) for mesh, torque in ((first, TORQUE), (second, TORQUE * 25 / 21))]
    expected = sum(one.advance[0] * mesh.pair.base_radius for one, mesh in zip(apart, train.meshes, strict=True))
    assert_allclose(ahead, expected, rtol=2e-3 if helix else SOLVED)
    near = train.place(phi).placed
    smooth = np.ones(len(phi), dtype=bool)
    for placed, one in zip(near, apart, strict=True):
        off = np.abs(placed.lines.lever + placed.mesh.pair.base_radius) > 1e-9
        off |= np.abs(np.abs(placed.lines.mate_lever) - placed.mesh.pair.meshed.pair.wheel.base_radius) > 1e-9
        smooth &= ~(off & (one.force[0] > 0.0)).any(axis=1)
    assert smooth.any()
    assert_allclose(ahead[smooth], expected[smooth], rtol=SOLVED)


@WAYS
def test_an_elastic_idler_couples_its_meshes_and_keeps_its_balance(helix, width):
    _, train = chain((21, 25, 19), helix, 40.0, width=width)
    phi = angles(train)
    placed = train.place(phi)
    found, without = placed.solve([[TORQUE, 0.0]]), rigid(train).place(phi).solve([[TORQUE, 0.0]])
    assert found.converged.all()
    change = found.movement[0, :, 0] / without.movement[0, :, 0] - 1.0
    assert ((np.abs(change) > 1e-3) & (np.abs(change) < 0.05)).all()
    held = np.einsum("ank,an->ak", levers_at(placed, found.movement[0]), found.force[0])
    assert_allclose(held, np.broadcast_to([-TORQUE, 0.0], held.shape), rtol=0.0, atol=1e-8 * TORQUE)


def slow_solution(placed, workspace, loads):
    """Forces and movements by Newton's method on all of them together, levers taken as they are."""
    found = []
    for i in range(len(placed.phi)):
        laws = [LineLaw(*row) for row in placed.lines.law[i].tolist()]
        rows, gap, width = placed.rows[i], placed.lines.gap[i], placed.train.joined.width
        ready, between = workspace.ready[i], workspace.between[i]
        corners, mesh = placed.train.joined.corners, placed.train.joined.mesh
        force, moved = np.where(ready, 1.0, 0.0), np.zeros(rows.shape[1])
        for _ in range(200):
            active = np.flatnonzero(force > 0.0)
            law = np.array([approach_of(force[n] / width[n], laws[n], corners, mesh[n]) for n in active])
            matrix = between[np.ix_(active, active)] + np.diag(law[:, 1] / width[active])
            free = gap[active] + law[:, 0] - law[:, 1] * force[active] / width[active]
            block = np.block([[matrix, rows[active]], [rows[active].T, np.zeros((rows.shape[1],) * 2)]])
            solution = np.linalg.lstsq(block, -np.concatenate([free, loads]), rcond=1e-15)[0]
            new = np.zeros_like(force)
            new[active] = np.maximum(solution[: len(active)], 0.0)
            moved = solution[len(active) :]
            closed = ready & (new == 0.0) & (gap + rows @ moved + between @ new < -1e-12)
            new[closed] = 1e-3
            if np.abs(new - force).max() < 1e-10 * new.max():
                break
            force = new
        found.append((new, moved))
    return found


def test_the_compiled_solution_is_that_of_a_slow_twin():
    _, train = chain((21, 25, 19), 0.0, 40.0, width="half")
    # Levers do not turn in the twin.
    placed = train.place(angles(train))
    placed.lines.lever_slope[:] = 0.0
    workspace = placed.workspace()
    found = placed.solve([[TORQUE, 0.0]], workspace=workspace)
    for i, (force, moved) in enumerate(slow_solution(placed, workspace, np.array([TORQUE, 0.0]))):
        assert_allclose(found.force[0, i], force, rtol=0.0, atol=1e-6 * force.max())
        assert_allclose(found.movement[0, i], moved, rtol=1e-6)


def test_bodies_couple_sections_as_their_nodes_do():
    """The slow twin of `couple`: compliance between nodes of both flanks, section by section."""
    _, train = chain((21, 25, 19), 15.0, 40.0, width="whole")
    placed = train.place(angles(train, 2))
    everything = np.isfinite(placed.lines.gap)
    workspace = placed.workspace()
    placed.make_ready(workspace, everything)
    far, (one, other) = train.bodies[1].far, placed.placed
    assert not one.mesh.image
    assert other.mesh.image

    def nodes(part, gear, i, n):
        """Forces on the nodes of a flank by a unit force in a section, and the number of the tooth."""
        meshed, lines = part.mesh.pair.meshed, part.lines
        flank, sections = (meshed.pinion, meshed.wheel)[gear], meshed.sections
        weights, place = np.zeros((*flank.nodes.shape[:2], 3)), n % len(sections.z)
        for a, gradient in enumerate(lines.gradient[i, n, gear].reshape(4, 3)):
            for b, share in enumerate(sections.share[gear, place]):
                if share != 0.0 and gradient.any():
                    weights[lines.row[i, n, gear] + a, sections.column[gear, place] + b] += share * gradient
        return weights.ravel(), lines.first_pair[i] + n // len(sections.z)

    for i in range(2):
        size = one.rows.shape[1]
        for n in np.flatnonzero(everything[i, :size])[::7]:
            for m in np.flatnonzero(everything[i, size:])[::7]:
                (by, pair), (to, tooth) = nodes(one, 1, i, n), nodes(other, 0, i, m)
                # The tooth 0 of either pair faces its pinion; the second pair counts clockwise.
                apart = (-(tooth + other.mesh.first_tooth[0]) - (one.mesh.first_tooth[1] - pair)) % 25
                expected = to @ far.shapes @ far.backs[apart] @ far.shapes.T @ by
                assert_allclose(workspace.between[i, n, size + m], expected, rtol=1e-10)


def test_teeth_that_miss_each_other_are_refused():
    _, train = chain((21, 25), 0.0)
    pair = train.meshes[0].pair.meshed.pair
    distance, turned = pair.centre_distance, np.radians(10.0)
    centres = [Centre("sun", 0.0, 0.0), Centre("idler", 0.0, distance), Centre("other", 0.0, 0.0)]
    centres[2] = Centre("sun's twin", -distance * np.sin(turned), distance * (1.0 + np.cos(turned)))
    meetings = [Meeting(pair, 0, 1), Meeting(pair, 0, 1)]
    placements(centres, meetings)
    with pytest.raises(GeometryError, match="drives before anything drives it"):
        placements(centres, [Meeting(pair, 0, 1), Meeting(pair, 2, 1)])
