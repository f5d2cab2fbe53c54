"""Arrays of results files: of a run, and of a set of gears that mesh with several others.

Meshes, gears and planets of a set count from 0 in the order of `set.json`; the attributes `meshes` and `gears` of the
file name them. Tooth pairs and sections that a mesh has fewer of than another one are NaN.
"""

from __future__ import annotations

from pmor.results.quantities import QUANTITIES
from pmor.storage.layout import Field

# Of what is read off a mesh; others came later.
FIRST_OF_FACE = ("k_h_beta", "effective_contact_ratio")
STATE, SECTIONS, FLANK = "torque, angle", "torque, angle, pair, section", "torque, roll, place"
TEETH = "torque, angle, gear, pair, side"


def _curve(description: str, unit: str = "um") -> Field:
    return Field(unit, STATE, description, finite=False)


def _of_sections(unit: str, description: str, finite: bool = True) -> Field:
    return Field(unit, SECTIONS, description, finite=finite)


def _flank(folder: str) -> dict[str, Field]:
    fields = {
        "torque": Field("N m", "torque", "on the pinion", least=0.0),
        "roll": Field("rad", "roll", "the gear's own roll angle, over its active profile", least=0.0),
        "z": Field("mm", "place", "over the common face, from mid width", increasing=True),
        "load": Field("N/mm", FLANK, "largest line load over the mesh cycle; 0 where nothing touches"),
        "half_width": Field("mm", FLANK, "Hertz's half-width of contact"),
        "pressure": Field("MPa", FLANK, "largest pressure; NaN where a sharp edge carries", finite=False),
    }
    return {f"{folder}/{gear}/{name}": field for gear in ("pinion", "wheel") for name, field in fields.items()}


def _fillet(gear: str) -> dict[str, Field]:
    axes = "torque, side, point, column"
    fields = {
        "arc": Field("mm", "point", "along the fillet, from the start of the involute on", increasing=True),
        "z": Field("mm", "column", "from mid width", increasing=True),
        "max_principal": Field("MPa", axes, "largest over the cycle; sides: tension, compression", finite=False),
        "von_mises": Field("MPa", axes, "largest over the cycle", finite=False),
    }
    return {f"root_stress/{gear}/{name}": field for name, field in fields.items()}


RESULTS_LAYOUT = {
    "ste/phi": Field("rad", "angle", "pinion angle"),
    "ste/torque": Field("N m", "torque", "on the pinion", least=0.0),
    "ste/ste": _curve("static transmission error along the transverse line of action; NaN where not converged"),
    "ste/rotation": _curve("the same as rotation of the pinion", "urad"),
    "ste/unloaded": Field("um", STATE, "transmission error of rigid flanks", finite=False, optional=True),
    "ste/error_bar": Field("um", STATE, "estimated error of reduction and mesh", finite=False, optional=True),
    "ste/converged": Field("1", STATE, "whether the position converged", kind=bool),
    "ste/pair_index": Field("1", "pair", "tooth pair: at the roll position phi + 2 pi j / z1", kind=int),
    "ste/pair_share": Field("1", "torque, angle, pair", "share of the pinion torque", finite=False),
    "stiffness/secant": _curve("force per face width over STE less that without load", "N/(mm um)"),
    "stiffness/tangent": Field("N/(mm um)", STATE, "its derivative", finite=False, optional=True),
    "orders/order": Field("1", "order", "periods per turn of the pinion", optional=True, least=0.0),
    "orders/amplitude": Field("um", "torque, order", "of the STE, zero to peak", optional=True, least=0.0),
    "orders/phase": Field("rad", "torque, order", "of the cosine at pinion angle 0", optional=True),
    "lines/pair": Field("1", "angle, pair", "tooth pairs that can touch", kind=int),
    "lines/z": Field("mm", "section", "sections over the width, from mid width; where each has an image, half of it"),
    "lines/width": Field("mm", "section", "width of each, without its image"),
    "lines/roll": Field("rad", "angle, pair, section, gear", "roll angles at which undeformed flanks meet"),
    "lines/load": _of_sections("N/mm", "line load"),
    "lines/half_width": _of_sections("mm", "Hertz's half-width of contact"),
    "lines/pressure": _of_sections("MPa", "largest pressure; NaN where a sharp edge carries", finite=False),
    "lines/sensitivity": _of_sections("um/um", "derivative of the STE by the deviation of the section"),
    **{
        f"face/{one.key}": Field(one.unit, "torque", one.words, finite=False, optional=one.key not in FIRST_OF_FACE)
        for one in QUANTITIES if one.found is not None
    },
    "forces/force": Field("N", "torque, angle, gear, xyz", "of the mesh on each gear"),
    "forces/moment": Field("N m", "torque, angle, gear, xyz", "about the gear's axis at mid width"),
    "sensitivity/ste": Field("um per unit", "parameter, torque, angle", "d STE / d parameter", finite=False),
    "sensitivity/mean": Field("um per unit", "parameter, torque", "of the mean STE", finite=False),
    "sensitivity/peak_to_peak": Field("um per unit", "parameter, torque", "of its peak-to-peak", finite=False),
    "root_stress/pair_index": Field("1", "pair", "tooth pair: at the roll position phi + 2 pi j / z1", kind=int),
    **{
        f"root_stress/{name}": Field(unit, TEETH, f"{words}; NaN of teeth without load", finite=False)
        for name, (unit, words) in {
            "max_principal": ("MPa", "largest on the fillet; sides: tension, compression"),
            "von_mises": ("MPa", "largest on the fillet"),
            "radius": ("mm", "where, from the axis"),
            "z": ("mm", "where, from mid width"),
        }.items()
    },
    **_fillet("pinion"),
    **_fillet("wheel"),
    **_flank("maps"),
    **_flank("light"),
    "harris/phi": Field("rad", "angle", "pinion angle"),
    "harris/torque": Field("N m", "torque", "on the pinion", least=0.0, increasing=True),
    "harris/ste": _curve("static transmission error"),
    "harris/peak_to_peak": Field("um", "torque", "of it", finite=False),
}
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
    **{f"meshes/{one.key}": Field(one.unit, "torque, mesh", one.words, finite=False, optional=True)
       for one in QUANTITIES if one.found is not None},
    "meshes/share": Field("1", MESH_STATE, "in the torque of all that share a gear", finite=False),
    "gears/displacement": _of_gears("um", "of the hub from where a set without load has it"),
    "gears/rotation": _of_gears("urad", "of the hub from where a set without load has it"),
    "gears/force": _of_gears("N", "of the meshes on the hub"),
    "gears/moment": _of_gears("N m", "of the meshes on the hub about its middle"),
    "planets/gear": Field("1", "planet", "number of its first gear", kind=int),
    "planets/share": Field("1", PLANET_STATE, "in the torque that the pins carry", finite=False),
    "planets/pin_force": Field("N", PLANET_STATE, "across the pin", finite=False),
    "bearings/azimuth": Field("deg", "seat, row, element", "of the rolling elements of the planets' bearings, from "
                              "outwards on; NaN of those by their stiffness", finite=False, optional=True),
    "bearings/force": Field("N", "torque, planet, seat, row, element", "of these elements", finite=False,
                            optional=True),
    "lines/z": Field("mm", "mesh, section", "sections over the width, from mid width; where each has an image, half "
                     "of it", finite=False),
    "lines/width": Field("mm", "mesh, section", "width of each, with its image", finite=False),
    "lines/first_pair": Field("1", "angle, mesh", "number of the first tooth pair; the others follow", kind=int),
    "lines/roll": Field("rad", "angle, mesh, pair, section, gear", "roll angles on pinion and wheel at which "
                        "undeformed flanks meet", finite=False),
    "lines/load": Field("N/mm", "torque, angle, mesh, pair, section", "line load", finite=False),
}  # fmt: skip


LINES = "source, speed, harmonic"
MOTION_LAYOUT = {
    "speed/speed": Field("rpm", "speed", "of the shaft of the first torque", increasing=True),
    "speed/bearing_force": Field("N", "speed, bearing", "root mean square of all lines"),
    "speed/mesh_force": Field("N", "speed, mesh", "root mean square of all lines beside the mean"),
    "lines/frequency": Field("Hz", LINES, "of each line; NaN where the source has none", finite=False),
    "lines/mesh_force": Field("N", f"{LINES}, mesh", "amplitude from zero to peak", finite=False),
    "lines/mesh_force_phase": Field("rad", f"{LINES}, mesh", "ahead of the source's angle 0", finite=False),
    "lines/bearing_force": Field("N", f"{LINES}, bearing, xyz", "amplitude from zero to peak", finite=False),
    "lines/bearing_force_phase": Field("rad", f"{LINES}, bearing, xyz", "likewise", finite=False),
    "lines/order": Field("1", "source, harmonic", "frequency over the speed; NaN where none is told", finite=False),
    "lines/acting": Field("1", f"{LINES}, acting", "forces of the source on the ports, zero to peak", finite=False),
    "lines/acting_phase": Field("rad", f"{LINES}, acting", "likewise", finite=False),
    "nonlinear/speed": Field("rpm", "motion", "of points of branches, or of runs up and down", optional=True),
    "nonlinear/branch": Field("1", "motion", "number of the branch or run", kind=int, optional=True),
    "nonlinear/stable": Field("1", "motion", "whether motion is stable", kind=bool, optional=True),
    "nonlinear/bearing_force": Field("N", "motion, bearing", "root mean square of all sources", optional=True),
    "nonlinear/force_rms": Field("N", "motion, parting", "of meshes that part, beside the mean", optional=True),
    "nonlinear/largest_force": Field("N", "motion, parting", "of the mesh", optional=True),
    "nonlinear/least_force": Field("N", "motion, parting", "below 0 backs push", optional=True),
    "nonlinear/dynamic_factor": Field("1", "motion, parting", "largest force over the mean", optional=True),
    "nonlinear/contact_loss": Field("1", "motion, parting", "share of the time without contact", optional=True),
    "nonlinear/back_contact": Field("1", "motion, parting", "share of the time in which backs push", optional=True),
    "nonlinear/separation": Field("um", "motion, parting", "by how much flanks part at most", optional=True),
    "model/frequency": Field("Hz", "mode", "natural frequencies, meshes with their mean stiffness"),
    "model/damping_ratio": Field("1", "mode", "of each mode"),
    "model/ports": Field("1", "port, mode", "participation of the coordinates of the meshes, and of other sources"),
    "model/readings": Field("1", "reading, mode", "bearing forces, coordinates of the housing, rigid bearings"),
    "model/gyroscopic": Field("1", "mode, other", "at 1 rad/s of the shaft of the first torque, as it turns"),
    "model/centrifugal": Field("1", "mode, other", "adds to the stiffness with the square of that speed"),
    "model/bearing_force": Field("1", "bearing, xyz, mode", "of the readings: forces of bearings and members of sets"),
    "model/left_bearing_force": Field("1", "bearing, xyz, acting", "static part that is in no mode"),
    "model/left_ports": Field("1", "port, acting", "static part that is in no mode"),
    "model/left_readings": Field("1", "reading, acting", "static part that is in no mode"),
    "model/tangent": Field("1", "coordinate, along", "mean stiffness of the meshes on their coordinates"),
}

BEARING_LAYOUT = {
    "row/at": Field("mm", "row", "middles of the rows along x, from the bearing's place"),
    "row/force": Field("N", "row, xyz", "of the inner ring on each row"),
    "element/azimuth": Field("deg", "row, element", "of the rolling elements, from y towards z; of planets from "
                             "outwards on"),
    "element/force": Field("N", "row, element", "of the rolling elements", least=0.0),
}  # fmt: skip
