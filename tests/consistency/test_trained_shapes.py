"""Trained shapes: what a basis is made of, and the reduced model against full FE where it was trained and where not."""

from functools import cache, partial
from itertools import product
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor_offline.train
from pmor.case import change_case, load_case, parse_case
from pmor.core.conventions import rotation_z
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import at_torques
from pmor.pair.sweep import sweep_ste
from pmor.penalty.elasticity import full_elasticity, shape_elasticity
from pmor.penalty.kernels.shapes import shape_weights
from pmor.penalty.kernels.types import ELEMENT_ROWS, FIRST_ROW
from pmor.penalty.position import active_patches
from pmor.penalty.solve import solve_position
from pmor.reduction.contact_shapes import ContactShapes, contact_shapes, shapes_of
from pmor.reduction.flank_lines import LEAST_LOAD, flank_line_shapes
from pmor.reduction.pod import local_modes
from pmor.storage.basis_file import read_basis
from pmor.work.offline import run_offline
from pmor_online.compare import compare_models
from pmor_online.model import reduced_pair, unseen_angles
from pmor_online.sweep import sweep_reduced_pair
from tests.support.gear_models import body, gear_pair, meshed_pair, sector, tooth
from tests.support.small_case import case_text, full_fe, small_case

NEWTON = 1e-8  # the equilibrium is solved to a relative residual of 1e-9; a different path may leave some of it
TRAINED = 1e-6  # a trained state lies in the basis, what is left is interpolation round-off
# One load distribution stands for all that a line carried in the training. Measured on these coarse meshes: 4e-4, and
# 1.4e-3 at the one state in which a pair has just come into mesh.
ONE_DISTRIBUTION = 2e-3
CASES = Path(__file__).parents[2] / "cases"


def advance_um(meshed, solved):
    """STE of each torque at a solved position, um."""
    return np.array([e.advance * meshed.pair.pinion.base_radius * 1e3 for e in solved.equilibria])


def assert_training_is_reproduced(reduced, rtol):
    training = reduced.basis.training
    sweep = sweep_ste(reduced.meshed, reduced.elasticity_at, training.phi, at_torques(training.torque[:, 0]))
    assert sweep.converged.all()
    assert_allclose(sweep.ste_um, training.ste_um, rtol=rtol)
    fast = sweep_reduced_pair(reduced, training.phi, at_torques(training.torque[:, 0]), tolerance=1e-9)
    assert_allclose(fast.ste_um, training.ste_um, rtol=rtol)
    return sweep


@pytest.mark.parametrize(
    "name", [pytest.param("positions", marks=pytest.mark.slow), "positions, whole width", "cubic positions"]
)
def test_training_positions_are_reproduced(name, reduced_by):
    assert_training_is_reproduced(reduced_by(name), TRAINED)


@pytest.mark.parametrize("name", ["lines", "lines, whole width"])
def test_lines_with_one_distribution_nearly_reproduce_the_training(name, reduced_by):
    reduced = reduced_by(name)
    sweep = assert_training_is_reproduced(reduced, ONE_DISTRIBUTION)
    # Less freedom to deform: no softer than full FE at the trained states, but for those that hardly carry load.
    assert np.median(sweep.ste_um / reduced.basis.training.ste_um) < 1.0


def test_one_pitch_on_the_same_happens_to_the_next_pair(reduced):
    meshed, conditions = reduced.meshed, at_torques([60e3, 100e3])
    for phi in (0.013, 0.21):
        angles = phi, phi + meshed.pair.pitch
        here, there = (solve_position(meshed, p, conditions, reduced.elasticity_at) for p in angles)
        assert_allclose(advance_um(meshed, there), advance_um(meshed, here), rtol=NEWTON)
        assert_allclose(there.position.pair_index, here.position.pair_index - 1)
        for a, b in zip(here.equilibria, there.equilibria, strict=True):
            n = len(here.position.pair_index)
            assert_allclose(b.pair_torque(n), a.pair_torque(n), rtol=0.0, atol=1e-7 * conditions[-1].torque)


@pytest.fixture(scope="module")
def unlike_model():
    case = parse_case(unlike_text("flank_lines"), "unlike", "unlike")
    return full_fe(case)


def unlike_text(shapes):
    return case_text(
        pinion={"teeth": 17, "bore_radius_mm": 15.0},
        wheel={"teeth": 31, "bore_radius_mm": 35.0, "youngs_modulus_GPa": 120.0},
        reduction={"shapes": shapes},
        compare={"angles": 2},
    )


@pytest.fixture(scope="module")
def unlike_pair(unlike_model, tmp_path_factory):
    """The pair reduced by a family of shapes."""
    folder = tmp_path_factory.mktemp("unlike")

    @cache
    def reduce(shapes):
        case, path = parse_case(unlike_text(shapes), "unlike", "unlike"), folder / f"{shapes}.h5"
        assert run_offline(case, unlike_model, path).failed == ()
        return reduced_pair(read_basis(path))

    return reduce


# Four angles per pitch on a coarse mesh: measured 2.1e-2 and 5.7e-4. A wrong tooth or gear: 30 %.
@pytest.mark.parametrize(("shapes", "bound"), [("positions", 0.06), ("flank_lines", 2e-3)])
def test_unlike_gears_agree_with_full_fe_between_the_training_angles(shapes, bound, unlike_model, unlike_pair):
    reduced = unlike_pair(shapes)
    comparison = compare_models(reduced, unlike_model)
    assert comparison.full.converged.all()
    assert comparison.reduced.converged.all()
    assert comparison.max_relative_error < bound
    for equilibrium in solve_position(reduced.meshed, 0.03, at_torques([100e3]), reduced.elasticity_at).equilibria:
        assert_allclose(equilibrium.pair_torque(4).sum(), 100e3, rtol=NEWTON)


# Measured 6.7e-5 and 1.3e-5; the second is the paper's own family of shapes on its own contact.
@pytest.mark.jit
@pytest.mark.parametrize(
    ("name", "changes", "most", "rms_most"),
    [
        ("paper_spur", {}, 2e-4, 5e-5),
        pytest.param("paper_hermite", {"reduction": {"shapes": "positions"}}, 3e-3, 1e-3, marks=pytest.mark.slow),
    ],
)
def test_paper_case_reduced_against_full_at_unseen_positions(name, changes, most, rms_most, tmp_path):
    case = change_case(load_case(CASES / f"{name}.toml"), **changes)
    assert case.compare.angles >= 40
    assert case.compare.torques_Nm == (30.0, 100.0, 160.0)
    model = full_fe(case)
    assert run_offline(case, model, tmp_path / "basis.h5").failed == ()
    comparison = compare_models(reduced_pair(read_basis(tmp_path / "basis.h5")), model)
    assert comparison.full.converged.all()
    assert comparison.reduced.converged.all()
    assert comparison.max_relative_error <= most
    assert comparison.rms_relative_error <= rms_most


SAME_SPAN = 1e-9  # the equilibrium is solved to a relative residual of 1e-9
# Unit forces in the transverse plane on all active nodes; only forces along the axis are left out, which a curved
# surface between unevenly displaced nodes makes. Measured on these coarse meshes: 8e-9.
EXACT = 5e-8


def unseen(model, count=12):
    meshed = model.mesh.meshed
    return unseen_angles(meshed.pair.roll_position_range[0], meshed.pair.pitch, count, 6)


def ste_of(meshed, elasticity_at, phi, torques=(60e3, 100e3)):
    sweep = sweep_ste(meshed, elasticity_at, phi, at_torques(torques))
    assert sweep.converged.all()
    return sweep.ste_um


@cache
def model_of(scheme, width):
    return full_fe(change_case(small_case(width), scheme=scheme))


def errors_of(folder, scheme="direct", width="half", **reduction):
    """Reduced against full STE at unseen positions, by the slow twin."""
    model, path = model_of(scheme, width), folder / "basis.h5"
    assert run_offline(change_case(small_case(width, **reduction), scheme=scheme), model, path).failed == ()
    reduced, phi = reduced_pair(read_basis(path)), unseen(model)
    full = ste_of(model.mesh.meshed, model.elasticity_at, phi)
    return np.abs(ste_of(reduced.meshed, reduced.elasticity_at, phi) / full - 1.0)


@pytest.mark.parametrize(
    ("scheme", "width"),
    [("direct", "half"), ("facet", "whole"), pytest.param("direct", "whole", marks=pytest.mark.slow),
     pytest.param("facet", "half", marks=pytest.mark.slow)],
)
def test_static_modes_are_full_fe(scheme, width, tmp_path):
    assert errors_of(tmp_path, scheme, width, shapes="static_modes").max() < EXACT


def test_static_modes_need_no_full_solve(small_model, tmp_path, monkeypatch):
    def solve(*_):
        raise AssertionError("a full solve")

    monkeypatch.setattr(pmor_offline.train, "solve_snapshots", solve)
    case, path = small_case(shapes="static_modes"), tmp_path / "basis.h5"
    done = run_offline(case, small_model[1], path)
    assert (done.solved, done.resumed, done.failed) == (0, 0, ())
    basis = read_basis(path)
    assert basis.training.ste_um.size == basis.training.converged.size == len(basis.training.phi) == 0
    with h5py.File(path) as file:
        assert file["training/force"].shape[0] == 0
    comparison = compare_models(reduced_pair(basis), small_model[1])
    assert comparison.reduced.converged.all()
    assert comparison.max_relative_error < 1e-4  # the compiled sweep's last step


@pytest.fixture(scope="module")
def training(small_model, small_basis_file):
    """Case, model, roll positions and forces of the small model's training."""
    case, model = small_model
    path = small_basis_file(shapes="positions")
    with h5py.File(path) as file:
        force = file["training/force"][()]
    reduced = reduced_pair(read_basis(path))
    return reduced, model, (model.pinion, model.wheel), reduced.basis.shapes.roll_position, force


def elasticity(shapes):
    return partial(shape_elasticity, shapes.family)


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_pod_that_discards_nothing_spans_the_raw_snapshots(interpolation, training):
    reduced, _, bodies, grid, force = training
    meshed, phi = reduced.meshed, reduced.basis.training.phi
    modes = local_modes(bodies, force, 1e-15)
    assert modes.shape[1] == force.shape[1]
    shapes = shapes_of(bodies, grid, 6, modes, interpolation)
    raw = contact_shapes(*bodies, grid, 6, force)
    expected = ste_of(meshed, elasticity(raw), phi)
    assert_allclose(ste_of(meshed, elasticity(shapes), phi), expected, rtol=SAME_SPAN)
    # At the training torques both are full FE.
    trained = reduced.basis.training
    found = ste_of(meshed, elasticity(shapes), phi, trained.torque[:, 0])
    assert_allclose(found, trained.ste_um, rtol=1e-6)


def test_the_compiled_sweep_of_cubics_through_pod_modes_is_its_slow_twin(small_model, small_basis_file):
    """The other families: test_compiled_sweep."""
    reduced = reduced_pair(read_basis(small_basis_file(shapes="pod", interpolation="cubic")))
    phi = unseen(small_model[1], 5)
    fast = sweep_reduced_pair(reduced, phi, at_torques([60e3, 100e3]), tolerance=1e-9)
    assert_allclose(fast.ste_um, ste_of(reduced.meshed, reduced.elasticity_at, phi), rtol=1e-8)


WHOLE_FLANK = 100.0  # mm: an approach so large that the windows hold the whole flanks


@pytest.mark.parametrize("fraction", [0.0, 0.3, 0.75], ids=["on the grid", "between", "nearer to the next"])
def test_basis_is_orthonormal_and_made_of_force_fields_with_their_displacements(
    fraction, whole_model, forces, reduced_by
):
    _, model = whole_model
    reduced = reduced_by("positions, whole width")
    shapes, meshed = reduced.basis.shapes, reduced.meshed
    step = shapes.roll_position[1] - shapes.roll_position[0]
    phi = float(reduced.basis.training.phi[2] + fraction * step)
    position = active_patches(meshed, phi, WHOLE_FLANK)
    # Rebuilt from the stored forces alone: the active shapes of each pair, interpolated by hand.
    active_shapes = []
    for p, index in enumerate(position.pair_index):
        place = (phi + index * meshed.pair.pitch - shapes.roll_position[0]) / step
        below = int(np.floor(place + 1e-6))
        for t in range(shapes.loaded.shape[1]):
            weights = {below: 1.0 - fraction, below + 1: fraction}
            weights = {k: w for k, w in weights.items() if w > 0.0 and forces[k, t].any()}
            if not weights:
                continue
            force = np.zeros((len(position.nodes), 3))
            for k, w in weights.items():
                for gear in range(2):
                    nodes = position.flank_nodes[p][gear]
                    share = w / sum(weights.values())
                    force[position.window_slice(p, gear)] += share * forces[k, t, gear].reshape(-1, 3)[nodes]
            active_shapes.append(force.ravel())
    fields = np.array(active_shapes).T
    moved = full_elasticity(model.pinion, model.wheel, position).compliance @ fields
    basis = shape_elasticity(shapes.family, position).basis.reshape(len(moved), -1)
    assert basis.shape == fields.shape, "none of the active_shapes depends on the others here"
    combination, *_ = np.linalg.lstsq(moved, basis, rcond=None)
    assert_allclose(moved @ combination, basis, rtol=0.0, atol=1e-9 * np.abs(basis).max())
    energy = (fields @ combination).T @ basis
    assert_allclose(
        energy, np.eye(len(energy)), rtol=0.0, atol=1e-8
    )  # active shapes are nearly parallel: two digits lost


def shapes_for_weights(stencil=2, loaded=((0, 0), (0, 1), (1, 1), (1, 1), (1, 0), (0, 0))):
    count, grid = len(loaded), 0.1 + 0.05 * np.arange(len(loaded))
    gram = np.zeros((2, count, stencil, stencil, 2, 2))
    return ContactShapes(grid, 3, np.array(loaded, dtype=bool), np.zeros((count, 2, 2, 3, 1)), gram)


def weights_at(shapes, roll_position):
    """First grid position of the stencil, and the weights, (S, T)."""
    weights = np.full((shapes.stencil, shapes.loaded.shape[1]), np.nan)
    return shape_weights(shapes.family.positions, roll_position, weights), weights


@pytest.mark.parametrize(
    ("place", "below", "expected"),
    [
        (2.25, 2, [[0.75, 0.75], [0.25, 0.25]]),  # linear between two loaded positions
        (1.25, 1, [[0.0, 0.75], [1.0, 0.25]]),  # idle below at the first torque: the position above alone
        (3.75, 3, [[0.25, 1.0], [0.75, 0.0]]),  # idle above at the second torque: the position below alone
        (0.5, 0, [[0.0, 0.0], [0.0, 1.0]]),  # idle on both sides: nothing
        (-0.5, 0, [[0.0, 0.0], [0.0, 0.0]]),  # outside of what was trained: nothing
        (5.5, 4, [[0.0, 0.0], [0.0, 0.0]]),
    ],
)
def test_weights_are_linear_and_skip_idle_positions(place, below, expected):
    shapes = shapes_for_weights()
    k, weights = weights_at(shapes, 0.1 + 0.05 * place)
    assert k == below
    assert_allclose(weights, expected, rtol=0.0, atol=1e-12)  # round-off of the division by the step


def on_the_grid(shapes, roll_position):
    """Weights of all grid positions, shape (M, T)."""
    below, weights = weights_at(shapes, roll_position)
    count = len(shapes.roll_position)
    found = np.zeros((count, 2))
    for a, weight in enumerate(weights):
        if 0 <= below + a < count:
            found[below + a] = weight
        else:
            assert not weight.any(), "beyond the grid"
    return found


@pytest.mark.parametrize("place", [2.0, 2.25, 2.9, 3.5])
def test_cubic_weights_are_exact_for_cubics(place):
    weights = on_the_grid(shapes_for_weights(4, [(0, 0), *6 * [(1, 1)], (0, 0)]), 0.1 + 0.05 * place)
    for power in range(4):
        assert_allclose(np.arange(8.0) ** power @ weights, place**power, rtol=1e-12)


@pytest.mark.parametrize("torque", [0, 1])
@pytest.mark.parametrize("place", [-0.5, 0.5, 1.25, 3.75, 4.5, 6.5, 7.5])
def test_cubic_weights_are_linear_where_one_of_the_four_is_idle(place, torque):
    loaded = [(0, 0), (0, 1), (1, 1), (1, 1), (0, 0), (1, 1), (1, 1), (0, 0)]
    cubic, linear = (on_the_grid(shapes_for_weights(stencil, loaded), 0.1 + 0.05 * place) for stencil in (4, 2))
    assert np.array_equal(cubic[:, torque], linear[:, torque])


ROUND_OFF = 1e-12  # of the largest: products of a few hundred terms
TOLERANCE = 0.05
GEARS = tooth(17, 0.4), tooth(31, 0.1)  # unlike, so that pinion and wheel cannot be mixed up
MESH = 5, 2
LINES, COLUMNS = MESH[0] + 1, MESH[1] + 1


@pytest.fixture(scope="module")
def bodies():
    return tuple(body(gear, *MESH) for gear in GEARS)


@pytest.fixture(scope="module")
def flank_nodes():
    return tuple(sector(gear, *MESH).flank_nodes for gear in GEARS)


def normal_loads(flank_nodes, rng, states=4, unlike=0.0):
    """Forces along the normals, shape (states, 2, f); `unlike`: how much distributions of the odd lines change."""
    force = np.zeros((states, 2, LINES, COLUMNS, 3))
    for gear, (shape, nodes) in enumerate(zip(GEARS, flank_nodes, strict=True)):
        roll = np.array([shape.roll_angle_at(np.hypot(*nodes[i, 0, :2])) for i in range(LINES)])
        normal = np.array([shape.flank_normal(u, 0.0) for u in roll])
        load = rng.uniform(0.5, 1.0, (states, LINES, 1)) * rng.uniform(0.5, 1.0, (1, 1, COLUMNS))
        load[:, 1::2] += unlike * rng.uniform(0.0, 1.0, load[:, 1::2].shape)
        force[:, gear] = -100.0 * load[..., None] * normal[None, :, None]
    return force.reshape(states, 2, -1)


@pytest.fixture(scope="module")
def shapes(bodies, flank_nodes):
    """Shapes with one distribution on some lines and two on others."""
    force = normal_loads(flank_nodes, np.random.default_rng(1), unlike=1.0)
    made = flank_line_shapes(bodies, force, flank_nodes, TOLERANCE)
    for gear in made.gears:
        assert np.diff(gear.start)[::2].tolist() == [1, 1, 1]
        assert (np.diff(gear.start)[1::2] > 1).all(), "otherwise lines and shapes could be mixed up"
    return made


def by_line(gear):
    """Forces of each shape, shape (m, lines, columns, 3), and the line that it belongs to."""
    return gear.force.reshape(-1, LINES, COLUMNS, 3), np.repeat(np.arange(LINES), np.diff(gear.start))


def test_shapes_are_orthonormal_and_each_sits_on_its_own_line(shapes):
    for gear in shapes.gears:
        force, line = by_line(gear)
        assert_allclose(gear.force @ gear.force.T, np.eye(len(force)), rtol=0.0, atol=ROUND_OFF)
        for i, j in product(range(len(force)), range(LINES)):
            assert force[i, j].any() == (line[i] == j)


@pytest.mark.parametrize("depth", [0.02, 100.0], ids=["windows", "whole flanks"])
def test_basis_of_a_position_is_orthonormal_and_made_of_line_loads_with_their_displacements(depth, shapes, bodies):
    """Rebuilt from the full compliance of the windows: line loads, what they move, and the energy of both."""
    meshed = meshed_pair(gear_pair(*GEARS), *MESH)
    position = active_patches(meshed, meshed.pair.roll_position_range[0] + 0.1 * meshed.pair.pitch, depth)
    assert len(position.pair_index) == 2
    active_shapes = []
    for gear, lines in enumerate(shapes.gears):
        force, line = by_line(lines)
        for p in range(2):
            first, rows = position.windows[p, gear, [FIRST_ROW, ELEMENT_ROWS]]
            for member in force[(line >= first) & (line <= first + rows)]:
                embedded = np.zeros((len(position.nodes), 3))
                nodes = position.flank_nodes[p][gear]
                embedded[position.window_slice(p, gear)] = member.reshape(-1, 3)[nodes]
                assert_allclose(np.linalg.norm(embedded), 1.0, rtol=ROUND_OFF)
                active_shapes.append(embedded.ravel())
    fields = np.array(active_shapes).T
    moved = full_elasticity(*bodies, position).compliance @ fields
    basis = shape_elasticity(shapes.family, position).basis.reshape(len(moved), -1)
    assert basis.shape == fields.shape
    combination, *_ = np.linalg.lstsq(moved, basis, rcond=None)
    assert_allclose(moved @ combination, basis, rtol=0.0, atol=1e-9 * np.abs(basis).max())
    # Conditioned like the loads of neighbouring lines, which move much the same: two digits lost.
    assert_allclose((fields @ combination).T @ basis, np.eye(basis.shape[1]), rtol=0.0, atol=1e-8)


@pytest.mark.parametrize(("share", "kept"), [(1.2, 2), (0.8, 1)])
def test_a_second_distribution_is_kept_from_a_share_of_the_first_on(share, kept, bodies, flank_nodes, rng):
    one, two = np.linalg.qr(rng.normal(size=(3 * COLUMNS, 2)))[0].T
    force = normal_loads(flank_nodes, rng, 2).reshape(2, 2, LINES, 3 * COLUMNS)
    force[1] = force[0]
    force[0, 0, 3], force[1, 0, 3] = 100.0 * one, 100.0 * share * TOLERANCE * two
    pinion, wheel = flank_line_shapes(bodies, force.reshape(2, 2, -1), flank_nodes, TOLERANCE).gears
    assert np.diff(pinion.start)[3] == kept
    assert np.diff(wheel.start).tolist() == [1] * LINES
    found = pinion.force[pinion.start[3] : pinion.start[4]].reshape(kept, LINES, -1)[:, 3]
    assert_allclose(found, np.array([one, two])[:kept], rtol=0.0, atol=ROUND_OFF)


@pytest.mark.parametrize("trace", [0.0, 0.5 * LEAST_LOAD])
def test_lines_that_were_hardly_loaded_borrow_from_their_neighbour_turned_with_the_flank(
    trace, bodies, flank_nodes, rng
):
    force = normal_loads(flank_nodes, rng)
    full = flank_line_shapes(bodies, force, flank_nodes, TOLERANCE)
    lines = force.reshape(*force.shape[:2], LINES, -1)
    load = np.linalg.norm(lines, axis=(0, 3)).max()
    idle = [0, 1, LINES - 1]
    lines[:, :, idle] = trace * load * rng.normal(size=lines[:, :, idle].shape) / np.sqrt(lines[:, 0, 0].size)
    made = flank_line_shapes(bodies, force, flank_nodes, TOLERANCE)
    for number, gear in enumerate(made.gears):
        force, line = by_line(gear)
        assert line.tolist() == list(range(LINES))
        expected, _ = by_line(full.gears[number])
        for i, lender in ((0, 2), (1, 2), (LINES - 1, LINES - 2)):
            turn = unit(expected[i, i].sum(axis=0))
            away = np.arccos(turn @ unit(force[lender, lender].sum(axis=0)))
            off = np.arccos(min(turn @ unit(force[i, i].sum(axis=0)), 1.0))
            # Differences of nodes, one-sided at the ends: half an element's turn is missing there.
            assert off < 0.6 * away, "along the normal of its own line"
            # Turned about the gear's axis and nothing else: the distribution is the lender's.
            angle = turn_between(force[lender, lender], force[i, i])
            assert abs(angle) > 0.4 * away
            assert_allclose(force[i, i] @ rotation_z(angle), force[lender, lender], rtol=0.0, atol=ROUND_OFF)


def unit(vector):
    return vector / np.linalg.norm(vector)


def turn_between(one, two):
    """Angle about the axis by which the resultant of `one` has to turn to become that of `two`."""
    (x1, y1, _), (x2, y2, _) = one.sum(axis=0), two.sum(axis=0)
    return np.arctan2(y2, x2) - np.arctan2(y1, x1)


@pytest.mark.parametrize("idle", [[0, 1], [1]], ids=["both", "wheel"])
def test_a_gear_without_a_loaded_state_is_refused(idle, bodies, flank_nodes, rng):
    force = normal_loads(flank_nodes, rng)
    force[:, idle] = 0.0
    with pytest.raises(ConvergenceError, match="no training state loads a flank"):
        flank_line_shapes(bodies, force, flank_nodes, TOLERANCE)
