"""Arrays of the results file of a set of gears that mesh with several others.

Meshes, gears and planets count from 0 in the order of `set.json`; the attributes `meshes` and `gears` of the file name
them. Tooth pairs and sections that a mesh has fewer of than another one are NaN.
"""

from __future__ import annotations

from pmor.storage.layout import Field

GEAR_STATE, MESH_STATE, PLANET_STATE = "torque, angle, body, xyz", "torque, angle, mesh", "torque, angle, planet"


def _of_gears(unit: str, description: str) -> Field:
    return Field(unit, GEAR_STATE, f"{description}, in axes of the set", finite=False)


SET_LAYOUT = {
    "ste/phi": Field("rad", "angle", "angle of the first gear, in the sense of its torque"),
    "ste/torque": Field("N m", "torque", "amount on the member that the file names", least=0.0),
    "ste/first_gear_torque": Field("N m", "torque", "amount on the first gear", least=0.0),
    "ste/ste": Field("um", "torque, angle", "by how much the first gear runs ahead; NaN where not converged",
                     finite=False),
    "ste/converged": Field("1", "torque, angle", "whether the position converged", kind=bool),
    "orders/order": Field("1", "order", "periods per turn of the first gear", optional=True, least=0.0),
    "orders/amplitude": Field("um", "torque, order", "of the STE, zero to peak; NaN where a position did not converge",
                              finite=False, optional=True, least=0.0),
    "orders/phase": Field("rad", "torque, order", "of the cosine at angle 0", finite=False, optional=True),
    "meshes/pinion": Field("1", "mesh", "number of the gear that drives", kind=int),
    "meshes/wheel": Field("1", "mesh", "number of the gear that is driven", kind=int),
    "meshes/force": Field("N", MESH_STATE, "in the transverse plane", finite=False),
    "meshes/share": Field("1", MESH_STATE, "in the torque of all that share a gear", finite=False),
    "gears/displacement": _of_gears("um", "of the hub from where a set without load has it"),
    "gears/rotation": _of_gears("urad", "of the hub from where a set without load has it"),
    "gears/force": _of_gears("N", "of the meshes on the hub"),
    "gears/moment": _of_gears("N m", "of the meshes on the hub about its middle"),
    "planets/gear": Field("1", "planet", "number of its first gear", kind=int),
    "planets/share": Field("1", PLANET_STATE, "in the torque that the pins carry", finite=False),
    "planets/pin_force": Field("N", PLANET_STATE, "across the pin", finite=False),
    "lines/z": Field("mm", "mesh, section", "sections over the width, from mid width; where each has an image, half "
                     "of it", finite=False),
    "lines/width": Field("mm", "mesh, section", "width of each, without its image", finite=False),
    "lines/first_pair": Field("1", "angle, mesh", "number of the first tooth pair; the others follow", kind=int),
    "lines/roll": Field("rad", "angle, mesh, pair, section, gear", "roll angles on pinion and wheel at which "
                        "undeformed flanks meet", finite=False),
    "lines/load": Field("N/mm", "torque, angle, mesh, pair, section", "line load", finite=False),
}  # fmt: skip
