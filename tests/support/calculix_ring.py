"""Whole rings of C3D20 for CalculiX: sectors on rows of their own, put together, and lines of its input."""

from contextlib import contextmanager
from dataclasses import dataclass, replace
from unittest.mock import patch

import numpy as np

from pmor.core.conventions import rotation_z
from pmor.fe import sector
from pmor.fe.outline import tooth_outline


@contextmanager
def flank_rows(roll, fillet, upper=lambda _, points: points):
    """Sectors are built with flank nodes at roll angles and with so many elements along a fillet.

    ``upper(tooth, points)`` may place the nodes of the upper fillet anew.
    """

    def outline(tooth, _, spacing, order):
        made = tooth_outline(tooth, fillet, spacing, order)
        placed = upper(tooth, made.upper_fillet)
        return replace(made, flank=tooth.flank_section(roll), flank_roll_angle=roll, upper_fillet=placed)

    with patch.object(sector, "tooth_outline", outline):
        yield


@dataclass(frozen=True)
class Ring:
    """A gear: nodes as placed, their numbers by sector, elements and which are kept, nodes in use and on the bore."""

    nodes: np.ndarray
    numbers: list
    elements: np.ndarray
    used: np.ndarray
    bore: np.ndarray
    kept: np.ndarray


def ring_of(meshes, angle=0.0, height=0.0):
    """Sectors put together, the first at an angle (rad), on an axis at a height (mm); they share their side faces."""
    numbers, nodes, count = [], [], 0
    for k, mesh in enumerate(meshes):
        own = np.setdiff1d(np.arange(len(mesh.nodes)), np.concatenate([mesh.right, mesh.bore[-len(mesh.z) :]]))
        numbers.append(np.full(len(mesh.nodes), -1))
        numbers[-1][own] = count + np.arange(len(own))
        count += len(own)
        turn = rotation_z(k * mesh.angular_pitch + angle)
        nodes.append(mesh.nodes[own] @ turn.T + np.array([0.0, height, 0.0]))
    for k, mesh in enumerate(meshes):
        right, before = np.concatenate([mesh.right, mesh.bore[-len(mesh.z) :]]), meshes[k - 1]
        numbers[k][right] = numbers[k - 1][np.concatenate([before.left, before.bore[: len(before.z)]])]
    elements = np.concatenate([n[mesh.elements[:, :20]] for n, mesh in zip(numbers, meshes, strict=True)])
    used = np.unique(elements)
    bore = np.intersect1d(np.concatenate([n[mesh.bore] for n, mesh in zip(numbers, meshes, strict=True)]), used)
    return Ring(np.concatenate(nodes), numbers, elements, used, bore, np.ones(len(elements), dtype=bool))


def mesh_lines(ring, nodes, elements, node=1, element=1):
    """Nodes and elements by the names of their sets, numbered from `node` and `element` on."""
    yield f"*NODE,NSET={nodes}"
    yield from (f"{node + n},{fields(ring.nodes[n])}" for n in ring.used)
    yield f"*ELEMENT,TYPE=C3D20,ELSET={elements}"
    for e, corners in enumerate((ring.elements + node).tolist()):
        if not ring.kept[e]:
            continue
        yield f"{element + e}," + ",".join(map(str, corners[:15])) + ","
        yield ",".join(map(str, corners[15:]))


def material_lines(name, elements, youngs_mpa, poisson):
    yield from (f"*MATERIAL,NAME={name}", "*ELASTIC", fields([youngs_mpa, poisson]))
    yield f"*SOLID SECTION,ELSET={elements},MATERIAL={name}"


def fields(values):
    return ",".join(f"{value:.13e}" for value in values)
