"""Displacement and stress of whole sectors under forces on the flanks of a gear."""

from __future__ import annotations

from itertools import product

import numpy as np

from pmor.body.elastic_gear import ElasticGear
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.conventions import rotation_z
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.condensation import back_substitute
from pmor.fe.element import QUADRATIC_NODES, node_places
from pmor.fe.hexahedron import shape_functions, shape_gradient
from pmor.fe.sector import SectorMesh

# Of a symmetric tensor, in VTK's order.
COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
# Elements whose stresses are found at a time.
BLOCK = 128


def sector_displacement(gear: ElasticGear, sector: int, teeth: IntArray, forces: FloatArray) -> FloatArray:
    """Return the displacement of all nodes of a sector under forces on the flanks of some teeth.

    Parameters
    ----------
    gear : ElasticGear
        Assembly with ``keep_rows=True``, without a surface layer taken out. Teeth beyond its neighbours are not felt.
    sector : int
        Counted counter-clockwise.
    teeth : ndarray of int, shape (t,)
        Loaded ones, counted likewise.
    forces : ndarray, shape (t, n, m)
        On the flank nodes of each, in its frame, m load cases, N.

    Returns
    -------
    ndarray, shape (n_nodes, 3, m)
        In the frame of the sector, mm.

    Raises
    ------
    ValueError
        When a surface layer was taken out: the flank would not fit the material below it; of sectors on a web with
        holes.
    """
    if gear.support is not None:
        raise ValueError("the displacement of a sector is known of equal sectors alone, and holes make them differ")
    if gear.layer_columns:
        raise ValueError("the compliance is without its surface layer: build the gear with layer_columns=0")
    mesh, condensed = gear.mesh, gear.sector
    turn = np.kron(np.eye(len(condensed.left) // 3), rotation_z(-mesh.angular_pitch))
    shares, steps = completion(mesh, mesh.flank).T, forces.shape[2]
    flank = np.zeros((3 * len(mesh.nodes), steps))
    left, right, below = (
        np.zeros((len(face), steps)) for face in (condensed.left, condensed.left, condensed.interface)
    )
    for tooth, force in zip(teeth, forces, strict=True):
        # The nearest way round.
        offset = (sector - int(tooth) + mesh.teeth // 2) % mesh.teeth - mesh.teeth // 2
        if abs(offset) > gear.neighbours:
            continue
        index, on_elements = gear.neighbours + offset, shares @ force
        flank[degrees_of_freedom(mesh.flank)] += gear.tooth_compliance(offset) @ force
        left += gear.side_displacement[index + 1] @ on_elements
        right += turn @ (gear.side_displacement[index] @ on_elements)
        if gear.mesh.on_blank:
            below += gear.interface_displacement[index] @ on_elements
    retained = np.concatenate([flank[condensed.flank], left, right, below])
    solved = back_substitute(condensed, retained, len(flank))
    every = np.arange(len(mesh.nodes))
    displacement = completion(mesh, every) @ solved[degrees_of_freedom(nodes_of_elements(mesh, every))]
    return np.asarray(displacement).reshape(len(mesh.nodes), 3, steps)


def nodal_stress(mesh: SectorMesh, displacement: FloatArray, youngs_modulus: float, poisson_ratio: float) -> FloatArray:
    """Return the stress at the nodes: from 2 x 2 x 2 integration points, where it is best, out to them, and the mean.

    Parameters
    ----------
    displacement : ndarray, shape (n_nodes, 3, m)
        mm.
    youngs_modulus : float
        MPa.

    Returns
    -------
    ndarray, shape (n_nodes, 6, m)
        xx, yy, zz, xy, yz, xz, MPa; 0 at nodes that no element has.
    """
    order, elements = mesh.order, mesh.elements[:, :QUADRATIC_NODES]
    points = np.array(list(product((-1.0, 1.0), repeat=3))) / np.sqrt(3.0)
    slopes = np.stack([shape_gradient(point, order) for point in points])
    nodes = 2.0 * node_places(order)[: elements.shape[1]] / order - 1.0
    # Points of integration are the corners of a smaller cube, in the order of `product`, not of an element's nodes.
    corners = [int(np.flatnonzero((np.sign(points) == 2.0 * c - 1.0).all(axis=1))[0]) for c in node_places(1)]
    outwards = np.empty((len(nodes), len(points)))
    outwards[:, corners] = np.stack([shape_functions(np.sqrt(3.0) * node, 1) for node in nodes])
    shear = 0.5 * youngs_modulus / (1.0 + poisson_ratio)
    lame = 2.0 * shear * poisson_ratio / (1.0 - 2.0 * poisson_ratio)
    total, count = np.zeros((len(mesh.nodes), 6, displacement.shape[2])), np.zeros(len(mesh.nodes))
    np.add.at(count, elements, 1.0)
    for first in range(0, len(elements), BLOCK):
        block = elements[first : first + BLOCK]
        jacobian = slopes.transpose(0, 2, 1) @ mesh.nodes[block][:, None]
        gradients = slopes @ np.linalg.inv(jacobian).transpose(0, 1, 3, 2)
        slope = np.einsum("epka,ekim->epiam", gradients, displacement[block], optimize=True)
        strain = 0.5 * (slope + slope.swapaxes(2, 3))
        dilatation = np.einsum("epiim->epm", strain)
        stress = 2.0 * shear * np.stack([strain[:, :, i, j] for i, j in COMPONENTS], axis=2)
        stress[:, :, :3] += lame * dilatation[:, :, None]
        np.add.at(total, block, np.einsum("kp,epcm->ekcm", outwards, stress, optimize=True))
    return np.asarray(total / np.maximum(count, 1.0)[:, None, None])


def principal_and_von_mises(stress: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the largest principal stress and von Mises's of tensors (n, 6, m), each (n, m)."""
    tensor = np.empty((len(stress), stress.shape[2], 3, 3))
    for component, (i, j) in enumerate(COMPONENTS):
        tensor[..., i, j] = tensor[..., j, i] = stress[:, component]
    values = np.linalg.eigvalsh(tensor)
    low, middle, high = np.moveaxis(values, -1, 0)
    return high, np.sqrt(0.5 * ((high - middle) ** 2 + (middle - low) ** 2 + (high - low) ** 2))
