"""Data of a pair for the solver on the page, the flanks' compliance in as few bytes as a page can spare.

A contact force acts along the line of action: in the frame of a node, turned with the tooth's twist, nearly along the
flank's normal there, the more so the nearer the node. So the displacements of a node are taken along its normal (on
helical flanks with the axial part that goes with it), at right angles to it in the transverse plane, which counts for
little, and of helical flanks along the axis, without the axial part that turns with the normal, which counts for less.
Each is scaled by its largest contribution, and all entries are rounded to one step, 2^-21 of the largest: as integers,
as differences and deflated, they take a tenth of the bytes of double precision. Between teeth compliance is
smooth and of low rank: sums of products of a few vectors.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from pmor.body.far_compliance import FarCompliance
from pmor.body.support import Support
from pmor.core.arrays import FloatArray
from pmor.core.threads import one_thread
from pmor.gear.condition import ALIGNED, Assembly
from pmor.gear.kernels.deviation import Deviation
from pmor.gear.kernels.types import Gear
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.tooth import Tooth
from pmor.line import bonded_layer
from pmor.line.hertz import mean_layer_constant
from pmor.line.kernels import contact_point, law, loads, movements, places, pressure, starts, tip_corner
from pmor.line.kernels.tip_corner import Corner
from pmor.line.layered_pair import LayeredPair
from pmor.line.pair import LinePair

# Steps to the largest entry.
STEPS = 2**21
# A block between teeth has fewer vectors than this; they are rounded to a part of a step.
MOST_VECTORS, FINER = 64, 4.0
# Rotation of the normal between a node and the contact that it carries, over the distance of the nodes, and at the tip,
# where a corner meets the mate's flank at an angle, rad; the axial part as a share of the square of the former, since
# the shares of four nodes nearly cancel.
TURN, CORNER_TURN, AXIAL = 1.0, 0.1, 0.2


def packed_compliance(blocks: FloatArray, gear: Gear) -> dict[str, Any]:
    """Pack the compliance of a gear's flanks.

    Parameters
    ----------
    blocks : ndarray, shape (neighbours + 1, n, n)
        Of teeth 0, 1, ... apart (`pmor.body.flank_compliance.FlankCompliance`), mm/N.

    Returns
    -------
    dict
        `step`, mm/N; `scale` of each displacement: along the normals of the nodes, at right angles to them, and of
        helical flanks along the axis; `own`, the upper triangle as packed integers; `neighbours`: for each tooth
        `rank`, `factors` and the packed vectors `left` and `right`. Nodes go column by column.
    """
    columns = gear.nodes.shape[1]
    local = _local(blocks, gear)
    turns = TURN * np.gradient(gear.roll)
    axial = AXIAL * turns**2
    turns[-1], axial[-1] = CORNER_TURN, 0.5 * CORNER_TURN**2
    parts = [np.ones_like(turns), turns, axial]
    scale = np.concatenate([np.tile(part, columns) for part in parts])[: local.shape[1]]
    scaled = local * scale[:, None] * scale
    step = float(np.abs(scaled[0]).max()) / STEPS
    return {
        "step": step,
        "scale": scale.tolist(),
        "own": packed_integers(_differences(scaled[0] / step)[np.triu_indices(len(scale))]),
        "neighbours": [_products(block, step) for block in scaled[1:]],
    }


def packed_array(array: FloatArray) -> dict[str, Any]:
    """Pack numbers of an array, one after the other: `step`, and `numbers` of steps as packed integers."""
    step = float(np.abs(array).max(initial=0.0)) / STEPS or 1.0
    return {"step": step, "numbers": packed_integers(np.round(array / step))}


def packed_shapes(shapes: FloatArray, gear: Gear) -> dict[str, Any]:
    """Pack vectors over the components of displacement of a flank's nodes, (n, r), in the nodes' own directions."""
    return {"rank": shapes.shape[1], **packed_array(_along(shapes, gear).T)}


def packed_far(far: FarCompliance | None) -> dict[str, Any] | None:
    """Pack the movement of shapes of far teeth; teeth that are in no mesh together have none."""
    if far is None:
        return None
    return {name: packed_array(np.nan_to_num(getattr(far, name))) for name in ("flanks", "images", "backs")}


def packed_support(support: Support | None) -> dict[str, Any] | None:
    """Pack the movement of patterns by what makes teeth differ."""
    if support is None:
        return None
    period, covered = support.compliance.shape[:2]
    return {"period": period, "covered": covered, "blocks": packed_array(support.compliance)}


def _local(blocks: FloatArray, gear: Gear) -> FloatArray:
    """Compliance in the nodes' own directions: (teeth, n, n)."""
    return np.stack([_along(_along(block, gear).T, gear).T for block in blocks])


def _along(array: FloatArray, gear: Gear) -> FloatArray:
    """Displacements of all nodes, the first axis, in the nodes' own directions, column by column."""
    rows, columns = gear.nodes.shape[:2]
    nodes, components = rows * columns, array.shape[0] // (rows * columns)
    angle = (gear.half_angle - gear.roll[:, None] + gear.twist * gear.nodes[0, :, 2]).T.ravel()
    cosine, sine, axial = np.cos(angle)[:, None], np.sin(angle)[:, None], gear.twist * gear.base_radius
    by_column = components * np.arange(nodes).reshape(rows, columns).T.ravel()
    x, y = array[by_column], array[by_column + 1]
    normal, tangential = cosine * x + sine * y, cosine * y - sine * x
    if components == 2:
        return np.concatenate([normal, tangential])
    z = axial * array[by_column + 2]
    return np.concatenate([normal + z, tangential, z])


def _products(block: FloatArray, step: float) -> dict[str, Any]:
    """A smooth block as a sum of products of vectors, each rounded according to its contribution."""
    left, size, right = _leading_vectors(block)
    kept = size > step
    largest = np.abs(left).max(axis=0), np.abs(right).max(axis=1)
    levels = np.ceil(FINER * size * largest[0] * largest[1] / step)[kept]
    factors = (size * largest[0] * largest[1])[kept] / levels**2
    return {
        "rank": int(np.count_nonzero(kept)),
        "factors": factors.tolist(),
        "left": packed_integers(np.round((left / largest[0]).T[kept] * levels[:, None])),
        "right": packed_integers(np.round((right / largest[1][:, None])[kept] * levels[:, None])),
    }


@one_thread()
def _leading_vectors(block: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Singular vectors of a smooth matrix, from its products with a few random ones (Halko et al., SIAM Rev. 53)."""
    samples = np.random.default_rng(2011).standard_normal((len(block), min(len(block), MOST_VECTORS)))
    range_of, _ = np.linalg.qr(block @ (block.T @ (block @ samples)))
    left, size, right = np.linalg.svd(range_of.T @ block, full_matrices=False)
    return range_of @ left, size, right


def _differences(matrix: FloatArray) -> FloatArray:
    """Differences of the rounded entries along both axes, which the one before the first is 0 of."""
    rounded = np.round(matrix)
    for axis in range(2):
        rounded = np.diff(rounded, axis=axis, prepend=0.0)
    return np.asarray(rounded)


def packed_integers(numbers: FloatArray) -> str:
    """Pack whole numbers of up to 23 bits, most of them small: the sign last, bytes apart, deflated, in base64."""
    whole = np.ravel(numbers).astype("<i4")
    unsigned = np.where(whole >= 0, 2 * whole, -2 * whole - 1).astype("<i4")
    planes = unsigned.view(np.uint8).reshape(-1, 4)[:, :3].T
    return base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode("ascii")


# Round-off of finite elements, over the largest compliance: bodies that differ by less are mirror images.
ALIKE = 1e-9


#: of the kernels that the page's solver transcribes
CONSTANTS = {
    name: getattr(module, name)
    for module, names in (
        (loads, ("PATIENCE", "MOST_SINGLE_STEPS", "TOLERANCE", "ROUND_OFF", "LAST_DIGITS", "BEGINNING", "NOTHING")),
        (starts, ("NEARBY",)), (movements, ("BALANCED", "LOOSE", "ROUNDING")),
        (tip_corner, ("SHORT", "LONGEST", "NEAREST")), (contact_point, ("CORNER", "LEAST_ROLL")),
        (places, ("LEAST_LEVER",)), (bonded_layer, ("WIDEST",)), (pressure, ("PRESSURES",)),
        (law, ("FLATTEST", "LEAST_SLOPE")),
    ) for name in names
}  # fmt: skip


def live_model(
    lines: LinePair, assembly: Assembly, angles: int, far: Sequence[FarCompliance | None] = (None, None),
    supports: Sequence[Support | None] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Return the reduced model of a mesh as plain numbers.

    Parameters
    ----------
    lines : LinePair
    assembly : Assembly
        Its pitch deviations and topographies stay as they are.
    angles : int
        Over a pitch.
    far, supports : sequence
        What pinion and wheel share with other meshes, and by what their teeth differ; by default that of the pair.

    Returns
    -------
    dict
        `model`, `bodies` (packed compliances), `body_of` (which one pinion and wheel have, and whether mirrored),
        `shapes` (of far teeth and of teeth that differ, on either gear), `supports` (of a pair by itself).
    """
    meshed = lines.meshed
    bodies, body_of = _bodies(lines)
    sections = meshed.sections
    model = {
        "angles": angles,
        "pair_count": meshed.tooth_pair_count,
        "softness": meshed.expected_approach(lines.base_radius),
        "layer_constant": mean_layer_constant(meshed),
        "kinematics": _kinematics(meshed),
        "common_face": list(meshed.pair.common_face),
        "pinion_roll_range": list(meshed.pair.pinion_roll_range),
        "mirrored": meshed.mirrored,
        "sections": {
            "z": sections.z.tolist(),
            "first_z": meshed.pair.common_face[0],
            "width": meshed.width.tolist(),
            "column": sections.column.tolist(),
            "share": sections.share.tolist(),
        },
        "gears": [_gear(meshed, assembly, gear) for gear in range(2)],
        "layer_coupling": [_coupling(added) for added in meshed.layer_coupling] if meshed.free_ends else None,
    }
    teeth = abs(meshed.pair.pinion.teeth), abs(meshed.pair.wheel.teeth)
    own = zip(teeth, lines.supports, strict=True)
    shapes = [
        {"far": each and packed_shapes(each.shapes, gear), "support": _patterns(support, gear)}
        for each, support, gear in zip(far, supports or lines.supports, meshed.gears, strict=True)
    ]
    return {
        "model": model, "bodies": bodies, "body_of": body_of, "shapes": shapes,
        "supports": [{"teeth": count, "far": None, "support": packed_support(support)} for count, support in own],
    }  # fmt: skip


def _patterns(support: Support | None, gear: Gear) -> list[dict[str, Any]]:
    """Patterns on the flanks, and on the other ones in their image, where these carry."""
    found = () if support is None else (support.rows, support.backs)
    return [packed_shapes(patterns, gear) for patterns in found if patterns is not None]


def _coupling(added: FloatArray) -> dict[str, Any]:
    """What the layer of a gear adds between sections: upper triangles of `LayeredPair.layer_coupling`, (n, S, S)."""
    upper = np.triu_indices(added.shape[1])
    return packed_array(added[:, upper[0], upper[1]])


def _kinematics(meshed: MeshedPair) -> dict[str, float]:
    kinematics = meshed.kinematics(ALIGNED)
    names = "action_length", "pressure_angle", "centre_distance", "pitch", "path_start", "path_end"
    return {name: float(getattr(kinematics, name)) for name in names} | {"face_width": meshed.pair.face_width}


def _gear(meshed: LayeredPair, assembly: Assembly, number: int) -> dict[str, Any]:
    gear, layer = meshed.gears[number], meshed.kernel_layers[number]
    names = "base_radius", "half_angle", "tip_roll", "twist", "edge_radius", "undercut_roll"
    return {
        **{name: float(getattr(gear, name)) for name in names},
        "roll": gear.roll.tolist(),
        "line_compliance": float(layer.compliance),
        "line_constant": layer.constant.tolist(),
        "column_z": gear.nodes[0, :, 2].tolist(),
        "tip": _corner(layer.tip),
        "undercut": _corner(layer.undercut),
        "flank": _flank(meshed, assembly, number),
    }


def _corner(corner: Corner) -> dict[str, Any]:
    return {name: np.asarray(value).tolist() for name, value in corner._asdict().items()}


def _flank(meshed: MeshedPair, assembly: Assembly, number: int) -> dict[str, Any]:
    """Reference of the deviations of a gear's flank, and those that stay constant."""
    pair, deviation = meshed.pair, meshed.deviations(assembly)[number]
    tooth: Tooth = (pair.pinion, pair.wheel)[number]
    modification = (assembly.pinion, assembly.wheel)[number]
    return {
        "tip_circle_roll": tooth.tip_roll_angle, "form_roll": tooth.form_roll_angle,
        "active_roll": list(pair.active_rolls[number]), "width": deviation.width,
        "alike": modification.repeats_after(abs(tooth.teeth)) == 1, **tooth_deviation(deviation),
    }  # fmt: skip


def tooth_deviation(deviation: Deviation) -> dict[str, Any]:
    """Return what can differ from tooth to tooth, as `toothDeviation` of `live/flanks.js` takes it."""
    points = {"roll": deviation.grid_roll, "z": deviation.grid_z, "teeth": deviation.grid}
    return {
        "middle_z": deviation.middle_z, "pitch": deviation.pitch.tolist(), "angular_pitch": deviation.angular_pitch,
        "waves": deviation.waves.tolist(),
        "grid": {name: array.tolist() for name, array in points.items()} if deviation.grid.size else None,
    }  # fmt: skip


def _bodies(lines: LinePair) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Compliances that differ, and which gear has which."""
    (pinion, wheel), gears = lines.flanks, lines.meshed.gears
    own = packed_compliance(pinion, gears[0])
    same = {"body": 0, "mirrored": False}
    if wheel is pinion:
        return [own], [same, same]
    if _mirror_images(lines):
        return [own], [same, {"body": 0, "mirrored": True}]
    return [own, packed_compliance(wheel, gears[1])], [same, {"body": 1, "mirrored": False}]


def _mirror_images(lines: LinePair) -> bool:
    """Whether the wheel is the pinion of the other hand."""
    (pinion, wheel), components, gears = lines.flanks, lines.components, lines.meshed.gears
    if pinion.shape != wheel.shape or gears[0].nodes.shape != gears[1].nodes.shape:
        return False
    if gears[0].twist != -gears[1].twist or not np.array_equal(gears[0].roll, gears[1].roll):
        return False
    rows, columns = gears[0].nodes.shape[:2]
    shape = len(pinion), rows, columns, components, rows, columns, components
    sign = np.array([1.0, 1.0, -1.0])[:components]
    turned = wheel.reshape(shape)[:, :, ::-1, :, :, ::-1] * sign[:, None, None, None] * sign
    return bool(np.abs(turned - pinion.reshape(shape)).max() < ALIKE * np.abs(pinion).max())
