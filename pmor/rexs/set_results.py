"""What was solved of a planetary set or a train under a torque, by the attributes of REXS 2.0."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.results.load_distribution import face_line
from pmor.rexs.document import Attributes
from pmor.sets.lost import known
from pmor.sets.solution import SetSolution


def gear_forces(solved: SetSolution, torque: int, body: int, turn: FloatArray) -> Attributes:
    """Force and moment of the meshes on a gear in axes of the file, mean over the mesh cycle, seen from the carrier."""
    wrench = solved.hub_wrench[torque, solved.converged[torque], body].mean(axis=0)
    image = np.diag([-1.0 if solved.plan.clockwise else 1.0, 1.0, 1.0])  # moments in a mirror keep their other part
    force, moment = turn @ image @ wrench[:3], 1e-3 * np.linalg.det(image) * turn @ image @ wrench[3:]
    return {
        **{f"force_acting_on_shaft_{way}": float(part) for way, part in zip("uvw", force, strict=True)},
        **{f"torque_acting_on_shaft_{way}": float(part) for way, part in zip("uvw", moment, strict=True)},
    }


def stage_results(solved: SetSolution, torque: int) -> Attributes:
    """Transmission error of the sun over a mesh cycle, where positions converged."""
    there = solved.converged[torque]
    return {
        "custom_pmor_pinion_angle": np.degrees(solved.phi_rad[there]),
        "custom_pmor_transmission_error": solved.ste_um[torque, there],
        "custom_pmor_transmission_error_peak_to_peak": known(np.ptp, solved.ste_um[torque]),
    }


def mesh_attributes(solved: SetSolution, torque: int, mesh: int) -> Attributes:
    """Load over the face from its beginning, K_Hβ, K_γ of the set, force, and share in the torque."""
    meshed = solved.train.meshes[mesh].pair.meshed
    z, load = face_line(solved.lines(mesh), torque)
    numbers: dict[str, float] = {
        "face_load_factor_contact_stress": float(solved.k_h_beta(mesh)[torque]),
        "mesh_load_factor_iso_6336_2019": float(solved.k_gamma[torque]),
        "nominal_tangential_force_at_base_diameter": known(np.mean, solved.mesh_force_N[torque, :, mesh]),
        "custom_pmor_share": known(np.mean, solved.mesh_share[torque, :, mesh]),
    }
    return {
        **{name: value for name, value in numbers.items() if np.isfinite(value)},
        "load_distribution_node_positions": z - meshed.pair.common_face[0], "load_distribution_along_face_width": load,
    }  # fmt: skip
