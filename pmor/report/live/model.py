"""Data of a pair for the solver on the page: numbers by the names that they have here."""

from __future__ import annotations

from typing import Any

import numpy as np

from pmor.gear.condition import ALIGNED, Assembly
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.tooth import Tooth
from pmor.line import bonded_layer
from pmor.line.hertz import mean_layer_constant
from pmor.line.kernels import contact_point, law, loads, places, pressure, tip_corner
from pmor.line.kernels.tip_corner import Corner
from pmor.line.layered_pair import LayeredPair
from pmor.report.live.compliance import packed_compliance, packed_coupling
from pmor_online.model import ReducedPair

# Round-off of finite elements, over the largest compliance: bodies that differ by less are mirror images.
ALIKE = 1e-9


#: of the kernels that the page's solver transcribes
CONSTANTS = {
    name: getattr(module, name)
    for module, names in (
        (loads, ("MAX_STEPS", "PATIENCE", "TOLERANCE", "BALANCED", "NEARBY", "ROUND_OFF", "LAST_DIGITS", "BEGINNING")),
        (tip_corner, ("SHORT", "LONGEST", "NEAREST")), (contact_point, ("CORNER", "LEAST_ROLL")),
        (places, ("LEAST_LEVER",)), (bonded_layer, ("WIDEST",)), (pressure, ("PRESSURES",)),
        (law, ("FLATTEST", "LEAST_SLOPE")),
    ) for name in names
}  # fmt: skip


def live_model(reduced: ReducedPair, assembly: Assembly, angles: int) -> dict[str, Any]:
    """Return the reduced model as plain numbers.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads, on the whole width.
    assembly : Assembly
        Its pitch deviations and topographies stay as they are.
    angles : int
        Over a pitch.

    Returns
    -------
    dict
        `model`, `bodies` (packed compliances) and `body_of` (which one pinion and wheel have, and whether mirrored).
    """
    meshed = reduced.layered
    bodies, body_of = _bodies(reduced)
    sections = meshed.sections
    model = {
        "angles": angles,
        "pair_count": meshed.tooth_pair_count,
        "rate": meshed.expected_approach(1.0),
        "layer_constant": mean_layer_constant(meshed),
        "kinematics": _kinematics(meshed),
        "common_face": list(meshed.pair.common_face),
        "pinion_roll_range": list(meshed.pair.pinion_roll_range),
        "sections": {
            "z": sections.z.tolist(),
            "first_z": meshed.pair.common_face[0],
            "width": sections.width.tolist(),
            "column": sections.column.tolist(),
            "share": sections.share.tolist(),
        },
        "gears": [_gear(meshed, assembly, gear) for gear in range(2)],
        "layer_coupling": [packed_coupling(added) for added in meshed.layer_coupling] if meshed.free_ends else None,
    }
    return {"model": model, "bodies": bodies, "body_of": body_of}


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
    points = {"roll": deviation.grid_roll, "z": deviation.grid_z, "points": deviation.grid}
    return {
        "tip_circle_roll": tooth.tip_roll_angle, "form_roll": tooth.form_roll_angle,
        "active_roll": list(pair.active_rolls[number]), "middle_z": deviation.middle_z, "width": deviation.width,
        "pitch": deviation.pitch.tolist(),
        "grid": {name: array.tolist() for name, array in points.items()} if deviation.grid.size else None
    }  # fmt: skip


def _bodies(reduced: ReducedPair) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Compliances that differ, and which gear has which."""
    compliance, gears = reduced.flank_compliance, reduced.meshed.gears
    pinion, wheel = compliance.gears
    own = packed_compliance(pinion, gears[0])
    same = {"body": 0, "mirrored": False}
    if wheel is pinion:
        return [own], [same, same]
    if _mirror_images(reduced):
        return [own], [same, {"body": 0, "mirrored": True}]
    return [own, packed_compliance(wheel, gears[1])], [same, {"body": 1, "mirrored": False}]


def _mirror_images(reduced: ReducedPair) -> bool:
    """Whether the wheel is the pinion of the other hand."""
    (pinion, wheel), components = reduced.flank_compliance.gears, reduced.components
    gears = reduced.meshed.gears
    if pinion.shape != wheel.shape or gears[0].nodes.shape != gears[1].nodes.shape:
        return False
    if gears[0].twist != -gears[1].twist or not np.array_equal(gears[0].roll, gears[1].roll):
        return False
    rows, columns = gears[0].nodes.shape[:2]
    shape = len(pinion), rows, columns, components, rows, columns, components
    sign = np.array([1.0, 1.0, -1.0])[:components]
    turned = wheel.reshape(shape)[:, :, ::-1, :, :, ::-1] * sign[:, None, None, None] * sign
    return bool(np.abs(turned - pinion.reshape(shape)).max() < ALIKE * np.abs(pinion).max())
