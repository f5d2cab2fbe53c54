"""Displacement of whole sectors: by one sparse system for the whole gear, slow and obvious, and condensed."""

import numpy as np
import scipy.sparse.linalg as spla

from pmor.body.volume import sector_displacement
from pmor.core.conventions import rotation_z
from pmor.fe.assembly import assemble, degrees_of_freedom
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.whole_gear import whole_gear_mesh


def volume_displacement(gear, offset, flank_forces):
    """Displacement of all nodes of sector `offset` under forces on the flank of tooth 0, (n_nodes, 3), mm."""
    return sector_displacement(gear, offset, np.array([0]), flank_forces[None, :, None])[..., 0]


def whole_gear_displacement(mesh, youngs_modulus, poisson_ratio, element, flank_forces):
    """Displacement of each sector in its own frame under m load cases on tooth 0, (teeth, 3 x sector nodes, m), mm."""
    nodes, elements, numbers = whole_gear_mesh(mesh)
    stiffness = assemble(nodes, elements, youngs_modulus, poisson_ratio, element)
    load = np.zeros((3 * len(nodes), flank_forces.shape[1]))
    own = nodes_of_elements(mesh, mesh.flank)
    load[degrees_of_freedom(numbers[0, own])] = completion(mesh, mesh.flank).T @ flank_forces
    held = np.concatenate([numbers[:, mesh.bore].ravel(), numbers[:, mesh.middles].ravel()])
    free = np.setdiff1d(np.arange(3 * len(nodes)), degrees_of_freedom(held))
    factor = spla.splu(stiffness[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    solution = np.zeros_like(load)
    solution[free] = factor.solve(load[free])
    result = np.empty((mesh.teeth, 3 * len(mesh.nodes), flank_forces.shape[1]))
    every = np.arange(len(mesh.nodes))
    full, own = completion(mesh, every), degrees_of_freedom(nodes_of_elements(mesh, every))
    for k in range(mesh.teeth):
        vectors = solution.reshape(len(nodes), 3, -1)[numbers[k]]
        turned = np.einsum("ij,njm->nim", rotation_z(-k * mesh.angular_pitch), vectors)
        result[k] = full @ turned.reshape(3 * len(mesh.nodes), -1)[own]
    return result
