"""Laws that tie the arrays of a basis to its case and to each other.

A checksum finds accidents. These laws keep kernels within their arrays and results meaningful, whoever wrote the file:
flanks lie on the involutes of the case, the energy products of the shapes are the work of their forces, and the
compliance of the flanks moves them as stored.

Products of large matrices are compared with the stored ones for one random combination of their rows, which finds a
wrong entry as surely (Freivalds, IFIP 1977, 839). The laws take less than a twentieth of the time of reading a file;
`pmor.work.verify` compares all entries with full FE.
"""

from __future__ import annotations

import math

import numpy as np

from pmor.body.flank_compliance import FlankCompliance
from pmor.case import Case, GearCase
from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth, twist_sections
from pmor.line.hertz import approach_constants, line_compliance
from pmor.line.layered_pair import SurfaceLayer
from pmor.line.sections import loaded_components
from pmor.pair.conditions import DEVIATIONS, training_values
from pmor.reduction.basis import Basis, Training
from pmor.reduction.contact_shapes import ContactShapes, energy_products
from pmor.reduction.flank_lines import FlankLineShapes, GearLines
from pmor.storage.basis_layout import GEARS
from pmor.storage.layout import require

# Relative: the same products in another order, on another computer.
ROUND_OFF = 1e-9
# The same where forces are first found from displacements.
SOLVED = 1e-6
# Nodes that are held have a compliance below this fraction of the largest.
LEAST_COMPLIANCE = 1e-14
# Of the random combinations.
SEED = 19770839
# Of coordinates, in modules.
PLACE = 1e-9


def check_basis(basis: Basis, pair: GearPair) -> None:
    """Raise Damaged where a basis breaks a law.

    Parameters
    ----------
    basis : Basis
        Of arrays whose types, shapes and ranges are checked already.
    pair : GearPair
        Of its case.
    """
    case = basis.case
    for gear, (name, tooth) in enumerate(zip(GEARS, (pair.pinion, pair.wheel), strict=True)):
        nodes, roll = basis.flank_nodes[gear], basis.flank_roll_angle[gear]
        _check_flank(name, tooth, roll)
        z = _columns(pair.faces[gear], nodes.shape[1], meshed_width(case) == "half")
        involute = twist_sections(tooth.flank_section(roll)[:, None], z[None], tooth.twist_per_length)
        on_involute = np.abs(nodes - involute).max() <= PLACE * tooth.module
        require(on_involute, f"the flank nodes of the {name} are not on its involutes")
    for layer, blank in zip(basis.layers, (case.pair.pinion, case.pair.wheel), strict=False):
        _check_layer(layer, blank)
    if isinstance(basis.shapes, ContactShapes):
        _check_positions(case, pair, basis.shapes)
        if basis.compliance is not None:
            _check_forces_behind(basis.shapes, basis.compliance)
    elif basis.shapes is not None:
        _check_lines(basis.shapes, basis.compliance)
    if basis.compliance is not None:
        _check_compliance(case, basis.compliance)
    _check_root_stress(basis, pair)
    _check_web_stress(basis)
    _check_training(case, pair, basis.training)
    for further in (basis.coarser, basis.whole):
        if further is not None:
            check_basis(further, pair)


def _check_flank(name: str, tooth: Tooth, roll: FloatArray) -> None:
    ends = np.array([tooth.form_roll_angle, tooth.tip_roll_angle])
    on_ends = np.abs(roll[[0, -1]] - ends).max() * abs(tooth.base_radius) <= PLACE * tooth.module
    require(on_ends and (tooth.base_radius * np.diff(roll) > 0.0).all(),
            f"the roll angles of the {name} do not go from the start of its involute to its tip")  # fmt: skip


def _columns(face: tuple[float, float], count: int, half: bool) -> FloatArray:
    """Places of the columns of nodes along z, mm."""
    low, high = face
    return np.linspace(low, 0.5 * (low + high) if half else high, count)


def _check_layer(layer: SurfaceLayer, gear: GearCase) -> None:
    expected = line_compliance(gear.youngs_modulus_GPa * 1e3, gear.poisson_ratio)
    constant = approach_constants(layer.depth, gear.poisson_ratio)
    same = math.isclose(layer.compliance, expected, rel_tol=ROUND_OFF)
    require(same and _same(layer.constant, constant), "its surface layer is not of the material of the case")
    require(layer.columns >= 1, f"its surface layer is {layer.columns} elements deep")


def _check_lines(shapes: FlankLineShapes, compliance: FlankCompliance | None) -> None:
    for gear, lines in enumerate(shapes.gears):
        name, count = GEARS[gear], len(lines.force)
        require(lines.start[0] == 0 and lines.start[-1] == count, f"the lines of the {name} do not share its shapes")
        rows = len(lines.start) - 1
        belongs = np.repeat(np.arange(rows), np.diff(lines.start))
        by_line = np.asarray(lines.force.reshape(count, rows, -1).any(axis=2))
        alone = by_line[np.arange(count), belongs].all() and by_line.sum() == count
        require(alone, f"shapes of the {name} carry load on other lines than their own")
        mixed = _mix(count)
        work = (mixed @ lines.displacement) @ lines.force.T
        require(_same(mixed @ lines.gram.transpose(0, 2, 1), work),
                f"the energy products of the {name} are not those of its shapes")  # fmt: skip
        own = lines.gram[shapes.neighbours]
        require(_same(own, own.T) and (np.diagonal(own) > 0.0).all(), f"shapes of the {name} store no energy")
        if compliance is not None:
            require(_moves(compliance, gear, lines), f"shapes of the {name} are not what its compliance makes of them")


def _moves(compliance: FlankCompliance, gear: int, lines: GearLines) -> bool:
    """Whether the compliance moves the loaded flank components as the shapes say."""
    parts, blocks = compliance.components, compliance.gears[gear]
    force = lines.force.reshape(len(lines.force), -1, 3)
    mixed = _mix(len(force))
    loads, neighbours = mixed @ force[..., :parts].reshape(len(force), -1), len(blocks) - 1
    moved = [blocks[k] @ loads if k >= 0 else loads @ blocks[-k] for k in range(-neighbours, neighbours + 1)]
    moved_as = (mixed @ lines.displacement).reshape(2 * neighbours + 1, -1, 3)[..., :parts]
    return _same(moved_as.reshape(2 * neighbours + 1, -1), np.stack(moved))


def _check_positions(case: Case, pair: GearPair, shapes: ContactShapes) -> None:
    moving = case.reduction.shapes != "global_pod"
    require(shapes.angles_per_pitch == (case.offline.angles_per_pitch if moving else 0),
            f"it has {shapes.angles_per_pitch} angles per pitch, and its case another number")  # fmt: skip
    roll, (first, last) = shapes.roll_position, pair.meshing_range
    held = len(roll) >= 2 and roll[0] < first and roll[-1] > last
    require(held, "its roll positions do not hold the path of contact")
    require(np.abs(roll).max() <= pair.pinion.teeth * pair.pitch, "its roll positions go beyond a revolution")
    if moving:
        step = pair.pitch / case.offline.angles_per_pitch
        off = (roll - first) / step
        require(np.abs(off - np.round(off)).max() <= 1e-6 and np.allclose(np.diff(off), 1.0, rtol=0.0, atol=1e-6),
                "its roll positions are not those of the training")  # fmt: skip
    moved = shapes.displacement.any(axis=(2, 3, 4))
    require(np.array_equal(moved, shapes.loaded), "shapes are there where no load is, or are not where there is")
    require(not shapes.loaded[[0, -1]].any() or not moving, "its first or last roll position carries load")
    gram = shapes.gram
    require(_same(gram[:, 1:, :-1, :-1], gram[:, :-1, 1:, 1:]), "its energy products contradict each other")
    before = shapes.stencil // 2 - 1
    own = np.diagonal(gram[0, :, before, before], axis1=1, axis2=2)
    require(np.array_equal(own > 0.0, shapes.loaded), "its shapes store no energy, or do so without load")


def _check_forces_behind(shapes: ContactShapes, compliance: FlankCompliance) -> None:
    """Find the forces that move a loaded flank as the shapes say: they must move other teeth, and do work, so too."""
    parts, neighbours, mixed = compliance.components, shapes.neighbours, _mix(shapes.displacement.shape[1])
    positions, count, _, offsets, size = shapes.displacement.shape
    displacement = (mixed @ shapes.displacement.reshape(positions, count, -1)).reshape(positions, 2, offsets, size)
    force = np.zeros((positions, 2, size))
    identical = compliance.gears[1] is compliance.gears[0]
    for gears in (slice(0, 2),) if identical else (slice(0, 1), slice(1, 2)):
        blocks, name = compliance.gears[gears.start], GEARS[gears.start]
        moves = np.diagonal(blocks[0]) > LEAST_COMPLIANCE * np.diagonal(blocks[0]).max(initial=0.0)
        require(moves.any(), "its compliance moves nothing")
        flank = displacement[:, gears].reshape(-1, offsets, size // 3, 3)[..., :parts]
        flank = flank.reshape(len(flank), offsets, -1)
        loads = np.zeros((len(flank), len(moves)))
        loads[:, moves] = np.linalg.solve(blocks[0][np.ix_(moves, moves)], flank[:, neighbours, moves].T).T
        of_all = _mix(len(flank))
        load = of_all @ loads
        again = [blocks[k] @ load if k >= 0 else load @ blocks[-k] for k in range(-neighbours, neighbours + 1)]
        fits = _same(np.tensordot(of_all, flank, axes=1), np.stack(again), SOLVED)
        require(fits, f"shapes of the {name} are not what its compliance makes of any forces")
        of_gears = force[:, gears].reshape(positions, -1, size // 3, 3)
        of_gears[..., :parts] = loads.reshape(positions, -1, size // 3, parts)
        force[:, gears] = of_gears.reshape(positions, -1, size)
    work = energy_products(force[:, None], displacement[:, None], shapes.angles_per_pitch, neighbours, shapes.stencil)
    require(
        _same(shapes.gram @ mixed @ mixed, work[..., 0, 0], SOLVED), "its energy products are not those of its shapes"
    )


def _check_compliance(case: Case, compliance: FlankCompliance) -> None:
    components = loaded_components(case.contact.kind != "nodal", case.pair.helix_angle_deg != 0.0)
    require(compliance.components == components, "its compliance has other components than its contact")
    for blocks in compliance.gears:
        mixed = _mix(len(blocks[0]))
        require(_same(blocks[0] @ mixed, mixed @ blocks[0]), "the compliance of a flank is not symmetric")
        require((np.diagonal(blocks[0]) >= 0.0).all(), "its compliance moves a flank against its load")
    for name, gear, support in zip(GEARS, (case.pair.pinion, case.pair.wheel), compliance.supports, strict=True):
        pieces, what = gear.repeats(case.pair.face_width_mm), "holes" if gear.lugs is None else "lugs"
        require((support is None) == (pieces == 0), f"{what} of the {name} are not those of the case")
        if support is not None:
            own, period = support.compliance[:, 0], gear.teeth // math.gcd(gear.teeth, pieces)
            require(len(own) == period, f"{what} of the {name} do not repeat after {period} teeth")
            require(_same(own, own.transpose(0, 2, 1)), f"{what} of the {name} make its compliance unsymmetric")
            least = np.linalg.eigvalsh(own).min(initial=0.0)
            require(least >= -ROUND_OFF * np.abs(own).max(initial=0.0), f"{what} of the {name} move against its load")


def _check_root_stress(basis: Basis, pair: GearPair) -> None:
    if basis.root_stress is None:
        return
    for gear, (name, tooth) in enumerate(zip(GEARS, (pair.pinion, pair.wheel), strict=True)):
        shapes, flank = basis.root_stress[gear], basis.flank_nodes[gear][0, :, 2]
        ends = np.stack([tooth.root_section(np.zeros(1))[0], _middle_of_space(tooth)])
        on_fillet = np.abs(shapes.section[[0, -1]] - ends).max() <= PLACE * tooth.module
        require(on_fillet, f"the root stress of the {name} is not along its fillet")
        on_face = np.abs(shapes.z[[0, -1]] - flank[[0, -1]]).max() <= PLACE * tooth.module
        require(on_face, f"the root stress of the {name} is not along its face")
        mixed = _mix(len(shapes.pattern))
        alone = _same(shapes.pattern @ (mixed @ shapes.pattern), mixed)
        require(alone, f"the patterns of forces on the {name} are not apart from each other")
        own, reach = (basis.case.pair.pinion, basis.case.pair.wheel)[gear], shapes.rim_moved.shape[1] // 2
        require(shapes.repeats == own.unlike_teeth(basis.case.pair.face_width_mm),
                f"the stress by the rim of the {name} does not repeat as its holes do")  # fmt: skip
        require(2 * reach <= max(own.teeth, 1), f"the stress by the rim of the {name} is of more teeth than it has")


def _check_web_stress(basis: Basis) -> None:
    width = basis.case.pair.face_width_mm
    for name, gear, web in zip(GEARS, (basis.case.pair.pinion, basis.case.pair.wheel), basis.web_stress, strict=True):
        blank = gear.light_blank(width)
        require(
            (web is not None) == (blank is not None and blank.stress), f"it has no web of the {name}, or one too many"
        )
        if web is not None and blank is not None:
            around = web.moved.shape[1] == (gear.teeth if blank.holes is None else blank.holes.count)
            alike = around and len(web.moved) == gear.unlike_teeth(width)
            require(alike, f"the stress of the web of the {name} does not repeat as its teeth and holes do")
            inside = (web.places[:, 0] > blank.hub_radius_mm).all()
            require(inside, f"the stress of the web of the {name} is within its hub")


def _middle_of_space(tooth: Tooth) -> FloatArray:
    half = 0.5 * tooth.angular_pitch
    return tooth.root_radius * np.array([-math.sin(half), math.cos(half)])


def _check_training(case: Case, pair: GearPair, training: Training) -> None:
    require(math.isfinite(training.seconds) and training.seconds >= 0.0, f"it took {training.seconds} s to make")
    solved = np.array_equal(np.isfinite(training.ste_um), training.converged)
    require(solved, "its training has numbers where it did not converge, or none where it did")
    if not case.reduction.trained:
        require(not len(training.phi), "it was trained, and its shapes need none")
        return
    first, pitch = pair.meshing_range[0], pair.pitch
    inside = (training.phi >= first - PLACE * pitch) & (training.phi <= first + pitch * (1.0 + PLACE))
    require(len(training.phi) and inside.all(), "its training is not within one pitch")
    require(len(training.conditions) == len(training.phi), "its training has angles without conditions")
    ranges = np.array([(values[0], values[-1]) for values in training_values(case.offline)])
    states = np.array([
        [*(getattr(c.misalignment, name) for name in DEVIATIONS), 1e-3 * c.torque]
        for there in training.conditions for c in there
    ])  # fmt: skip
    slack = ROUND_OFF * np.abs(ranges).max(axis=1)
    inside = (states >= ranges[:, 0] - slack) & (states <= ranges[:, 1] + slack)
    require(inside.all(), "its training has other conditions than its case")


def _same(values: FloatArray, expected: FloatArray, tolerance: float = ROUND_OFF) -> bool:
    scale = np.abs(expected).max(initial=0.0)
    return bool(np.abs(values - expected).max(initial=0.0) <= tolerance * scale)


def _mix(count: int) -> FloatArray:
    """Weights of a random combination, the same whenever a file is read."""
    return np.random.default_rng(SEED).uniform(1.0, 2.0, count)
