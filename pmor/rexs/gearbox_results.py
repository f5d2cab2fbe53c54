"""What was found of a gearbox under a load, by the components and attributes of REXS 2.0.

There is what the standard has names for: deflection lines of shafts, forces, displacements, tilts and stiffness of
bearings, forces on shafts at gears, load over the face, face load factors. What it has none for stands under names of
our own, as it provides. Loads on single points of flanks and rolling elements are left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pmor.body.beam import NODE
from pmor.body.rolling_bearing import BearingState
from pmor.core.arrays import FloatArray
from pmor.gear.classical.iso6336 import running_in
from pmor.gear.pair import GearPair
from pmor.machine.coupled import SolvedLoad, SolvedMesh
from pmor.machine.loaded import BEARING_ROWS, Supported
from pmor.machine.readings import Data
from pmor.results.load_distribution import line_states
from pmor.results.sweep import mesh_stiffness
from pmor.rexs.document import Attributes, Value

GEARS = ("pinion", "wheel")
# Rows and columns of the stiffness of a bearing; forces over displacements are in N/m there, all else as here.
FORCES, MOVES = ("f_u", "f_v", "f_w", "m_v", "m_w"), ("d_u", "d_v", "d_w", "rot_v", "rot_w")
UNIT = {("f", "d"): 1e3, ("f", "r"): 1.0, ("m", "d"): 1.0, ("m", "r"): 1.0}


@dataclass(kw_only=True)
class Numbers:
    """Numbers of the components of a file by the names of their parts; of gears and their data by mesh and gear."""

    shafts: dict[str, int] = field(default_factory=dict)
    bearings: dict[str, int] = field(default_factory=dict)
    stages: dict[str, int] = field(default_factory=dict)
    gears: dict[tuple[str, str], int] = field(default_factory=dict)
    data: dict[tuple[str, str], int] = field(default_factory=dict)


def found_attributes(numbers: Numbers, solved: SolvedLoad, entry: Data) -> dict[int, Attributes]:
    """Return what was found of a load case, by component; `entry` is that of the load in `gearbox.json`."""
    found: dict[int, Attributes] = {}
    for shaft in entry["shafts"]:
        moved = np.array(shaft["displacement_um"])
        found[numbers.shafts[shaft["name"]]] = {
            "u_coordinates_of_beam_nodes": shaft["at_mm"],
            **{f"displacement_{way}_of_nodes": moved[:, i] for i, way in enumerate("uvw")},
            "torsion_u": np.degrees(1e-3 * np.array(shaft["twist_mrad"])),
            **({"rotational_speed": rpm} if (rpm := entry["speeds_rpm"].get(shaft["name"])) is not None else {}),
        }
    states = iter(solved.equilibrium.bearings)
    for bearing, one in zip(solved.gearbox.bearings, entry["bearings"], strict=True):
        state = None if bearing.law is None else next(states)
        found[numbers.bearings[one["name"]]] = _bearing(solved, bearing, one, state)
    for mesh, one in zip(solved.meshes, entry["meshes"], strict=True):
        name = one["name"]
        found[numbers.stages[name]] = _stage(mesh, one)
        for gear, wrench in zip(GEARS, mesh.force * mesh.meshing.wrenches, strict=True):
            found[numbers.gears[name, gear]] = {
                **{f"force_acting_on_shaft_{way}": float(wrench[i]) for i, way in enumerate("uvw")},
                **{f"torque_acting_on_shaft_{way}": 1e-3 * float(wrench[3 + i]) for i, way in enumerate("uvw")},
            }
            found[numbers.data[name, gear]] = {"torque": (-1e-3 if gear == "pinion" else 1e-3) * float(wrench[3])}
    return found


def _bearing(solved: SolvedLoad, bearing: Supported, entry: Data, state: BearingState | None) -> Attributes:
    """Forces on both parts that a bearing joins, what they do, and its stiffness there."""
    first, said = solved.gearbox.first[bearing.settings.shaft], bearing.settings
    node = first + NODE * solved.gearbox.beams[said.shaft].node_at(said.at_mm)
    inner = solved.equilibrium.displacement[node : node + NODE]
    outer = inner - bearing.rows @ solved.equilibrium.displacement
    found: dict[str, Value] = {
        "axial_deflection": entry["displacement_um"][0],
        "radial_deflection_in_v": entry["displacement_um"][1],
        "radial_deflection_in_w": entry["displacement_um"][2],
        "angular_deflection_in_v": 1e-3 * entry["tilt_mrad"][0],
        "angular_deflection_in_w": 1e-3 * entry["tilt_mrad"][1],
    }
    for side, moved, sign in (("inner", inner, -1.0), ("outer", outer, 1.0)):
        for i, way in enumerate("uvw"):
            found[f"displacement_{side}_side_{way}"] = 1e3 * float(moved[i])
            found[f"force_acting_on_{side}_component_{way}"] = sign * entry["force_N"][i]
        for i, way in enumerate("vw"):
            found[f"tilting_{side}_side_{way}"] = math.degrees(float(moved[4 + i]))
            found[f"torque_acting_on_{side}_component_{way}"] = sign * 1e-3 * entry["moment_Nmm"][i]
    stiffness = np.diag(bearing.springs)[np.ix_(BEARING_ROWS, BEARING_ROWS)]
    if state is not None:
        stiffness = state.stiffness
        found["maximum_hertzian_pressure"] = state.pressure
    if not bearing.rigid:
        found |= {
            f"operating_point_stiffness_{row}_{column}": UNIT[row[0], column[0]] * float(stiffness[i, j])
            for i, row in enumerate(FORCES)
            for j, column in enumerate(MOVES)
        }
    return found


def _stage(mesh: SolvedMesh, entry: Data) -> Attributes:
    """Load over the face from its beginning along x, stiffness, transmission error over all pitches, misalignment."""
    pair, lines, along = mesh.meshing.pair, line_states(mesh.sweep), int(mesh.meshing.frame.along)
    crude = entry["iso_f_beta_um"]
    found: dict[str, Value | None] = {
        "load_distribution_node_positions": _from_the_beginning(pair, along * lines.z_mm[::along], along),
        "load_distribution_along_face_width": lines.load_N_per_mm[0].sum(axis=1).mean(axis=0)[::along],
        "face_load_factor_contact_stress": entry["k_h_beta"],
        "effective_equivalent_misalignment_iso_6336_2006": crude and crude - running_in(crude),
        "face_load_factor_contact_stress_iso_6336_2006": entry["iso_k_h_beta"],
        "nominal_tangential_force_at_base_diameter": entry["force_N"],
        "custom_pmor_f_beta": entry["f_beta_um"], "custom_pmor_in_plane": entry["in_plane_um"],
        "custom_pmor_out_of_plane": entry["out_of_plane_um"],
        "custom_pmor_centre_distance": entry["centre_distance_um"],
        "custom_pmor_flank_pressure": entry["flank_pressure_max_MPa"],
        "custom_pmor_root_stress": entry["root_stress_max_MPa"],
        "custom_pmor_losses": entry["losses_W"],
    }  # fmt: skip
    if entry["converged"]:
        secant = mesh_stiffness(mesh.sweep, pair.pinion.base_radius, pair.common_width).secant[0]
        found |= {
            "meshing_stiffness_characteristic": 1e3 * secant * pair.common_width,
            "custom_pmor_pinion_angle": np.degrees(mesh.sweep.phi_rad),
            "custom_pmor_transmission_error": mesh.sweep.ste_um[0],
            "custom_pmor_transmission_error_peak_to_peak": entry["ste_peak_to_peak_um"],
        }
    return {name: value for name, value in found.items() if value is not None}


def _from_the_beginning(pair: GearPair, x: FloatArray, along: int) -> FloatArray:
    return x - min(along * end for end in pair.common_face)
