"""Both gears in motion as VTKHDF: displacement, stress and pressure on the elements, for ParaView and the like.

The mesh of the two sectors of a tooth pair is stored once, undeformed, in the middle of the path of contact. A step is
a pinion angle; the fields are elastic, without the rotation of the gears. Stress is that of the sector's mesh: the
notch at the root is resolved in `stress.csv`, not here. Of a gear with a blank by dimensions the sector ends within its
rim: what is below has no mesh of its own (`pmor.body.blank`); the attribute `shown` of the file says so.

The pressure on a flank is the force on it, spread over the faces of the elements about the line of contact: its
integral is that force, its largest value is not Hertz's.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import h5py
import numpy as np

from pmor.body.elastic_gear import ElasticGear, elastic_gear
from pmor.body.volume import nodal_stress, principal_and_von_mises, sector_displacement
from pmor.case import Case, GearCase, text_of
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.conventions import rotation_z
from pmor.core.errors import CaseError, ConvergenceError
from pmor.core.version import __version__
from pmor.export.gear_surface import HEXAHEDRON, QUADRATIC_HEXAHEDRON, Grid, hat_functions, write_grid
from pmor.fe.element import QUADRATIC_NODES
from pmor.fe.sector import SectorMesh
from pmor.line.full_model import solve_angle
from pmor.line.layered_pair import LayeredPair
from pmor.pair.blank import blank_below
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import mesh_model, per_gear
from pmor.penalty.pair import as_penalty
from pmor.penalty.solve import solve_position
from pmor.storage.atomic import atomic_path
from pmor_online.model import ReducedPair

STEPS_PER_PITCH = 20
# From the image of a pair that is turned backwards to the pair; nodes of its hexahedra, whose bottom becomes the top.
REFLECTION = np.diag([-1.0, 1.0, 1.0])
REFLECTED = np.array([4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19])
# How far beyond the path of contact the passage of a tooth pair is followed, in pitches.
BEYOND = 0.1
#: fields at the nodes, and their components
FIELDS = {
    "displacement_mm": 3, "stress_MPa": 6, "max_principal_MPa": 1, "von_mises_MPa": 1, "flank_pressure_MPa": 1,
}  # fmt: skip


#: of gears with blanks by dimensions
RIM_ALONE = "teeth and the outer part of the rim, on the elastic rim, web and hub below, which have no mesh here"


#: where sectors of pinion and wheel are in the undeformed pair: rotation (3, 3) and shift (3,), mm, of their frames; of
#: coast flanks, which are solved as their image, with the reflection back
Placed = Sequence[tuple[FloatArray, FloatArray]]


def export(reduced: ReducedPair, path_out: Path, overwrite: bool = False) -> None:
    """Write a tooth pair of a reduced pair from its entry into the mesh to its exit, at the nominal torque of its case.

    Parameters
    ----------
    reduced : ReducedPair
        The finite elements of its case are solved again for the volume.
    overwrite : bool
        As in `pmor.storage.atomic.atomic_path`.

    Raises
    ------
    ConvergenceError
        When a position has no equilibrium.
    OutputError
    CaseError
        For webs with holes, which make sectors differ.
    """
    if isinstance(reduced.meshed, LayeredPair) and any(reduced.flank_compliance.supports):
        raise CaseError(f"{reduced.basis.case.name}: VTKHDF shows sectors that are alike: leave the holes out")
    phi = step_angles(reduced)
    forces, pairs = flank_forces(reduced, phi)
    case = reduced.basis.case
    gears = _volumes(case)
    placed = _placed(reduced)
    with atomic_path(Path(path_out), overwrite) as temporary, h5py.File(temporary, "w") as file:
        file.attrs["pmor_version"], file.attrs["case_text"] = __version__, text_of(case)
        if any(case.pair.blanks):
            file.attrs["shown"] = RIM_ALONE
        write_grid(file, _grid(gears, placed), phi, FIELDS, _fields(case, gears, placed, forces, pairs))


def step_angles(reduced: ReducedPair) -> FloatArray:
    """Return the pinion angles of the steps, rad."""
    pair = reduced.meshed.pair
    step = pair.pitch / STEPS_PER_PITCH
    start, stop = pair.meshing_range
    start, stop = start - BEYOND * pair.pitch, stop + BEYOND * pair.pitch
    return np.asarray(start + step * np.arange(math.ceil((stop - start) / step) + 1))


def flank_forces(reduced: ReducedPair, phi: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the forces on the flanks of all tooth pairs that touch, at the nominal torque.

    Returns
    -------
    forces : ndarray, shape (2, pairs, n, steps)
        On all unknowns of the flanks of pinion and wheel, in each tooth's frame, N.
    pairs : ndarray of int, shape (pairs,)
    """
    meshed, condition = reduced.meshed, nominal_condition(reduced.basis.case)
    found = dict[int, FloatArray]()
    unknowns = 3 * meshed.pinion.nodes.shape[0] * meshed.pinion.nodes.shape[1]
    for step, angle in enumerate(phi):
        if isinstance(meshed, LayeredPair):
            found_here = solve_angle(meshed, reduced.flank_compliance, float(angle), [condition])
            (state,) = found_here.states
            if state is None:
                raise ConvergenceError(found_here.failures[0], [])
            for p, index in enumerate(state.loaded_pairs.tolist()):
                fields = found.setdefault(index, np.zeros((2, unknowns, len(phi))))
                for gear, nodal in enumerate(state.nodal_force):
                    of_nodes = fields[gear, :, step].reshape(-1, 3)
                    of_nodes[:, : nodal.shape[-1]] = nodal[p].reshape(-1, nodal.shape[-1])
            continue
        solved = solve_position(as_penalty(meshed), float(angle), [condition], reduced.elasticity_at)
        equilibrium, position = solved.equilibria[0], solved.position
        if equilibrium is None:
            raise ConvergenceError(f"no equilibrium at phi = {angle:.6g} rad: {solved.failures[0]}", [])
        nodal = equilibrium.contact.nodal_forces(equilibrium.contact.force, len(position.nodes))
        for p, index in enumerate(position.pair_index.tolist()):
            for gear in range(2):
                window = nodal[position.window_slice(p, gear)]
                if window.any():
                    fields = found.setdefault(index, np.zeros((2, unknowns, len(phi))))
                    rows = 3 * position.flank_nodes[p][gear][:, None] + np.arange(3)
                    fields[gear, rows, step] = window
    pairs = np.array(sorted(found))
    return np.stack([found[int(index)] for index in pairs], axis=1), pairs


def _volumes(case: Case) -> tuple[ElasticGear, ElasticGear]:
    """Solve the finite elements of both gears with their surface layers; keep the factors for back-substitution."""
    mesh = mesh_model(case)

    def build(sector: SectorMesh, gear: GearCase) -> ElasticGear:
        young, neighbours = gear.youngs_modulus_GPa * 1e3, mesh.meshed.pair.neighbouring_teeth
        place, tooth = (0, mesh.meshed.pair.pinion) if sector is mesh.pinion else (1, mesh.meshed.pair.wheel)
        blank = blank_below(case, gear, tooth, sector, place)
        return elastic_gear(sector, young, gear.poisson_ratio, case.mesh.element, neighbours, True, blank=blank)

    return per_gear(case, mesh, build)


def _placed(reduced: ReducedPair) -> Placed:
    """Sectors of tooth pair 0 in the middle of its path."""
    pair = reduced.meshed.pair
    middle = 0.5 * sum(pair.meshing_range)
    angles = middle, math.pi + float(pair.wheel_tooth_rotation(middle))
    shifts = np.zeros(3), np.array([0.0, pair.centre_distance, 0.0])
    image = REFLECTION if reduced.basis.case.flank == "coast" else np.eye(3)
    return [(image @ rotation_z(angle), shift) for angle, shift in zip(angles, shifts, strict=True)]


def _fields(
    case: Case, gears: tuple[ElasticGear, ElasticGear], placed: Placed, forces: FloatArray, pairs: IntArray
) -> Iterator[dict[str, FloatArray]]:
    """Fields of one sector after the other, at the nodes of its elements: (nodes, components, steps)."""
    materials = case.pair.pinion, case.pair.wheel
    for gear, (rotation, _) in enumerate(placed):
        body, material = gears[gear], materials[gear]
        teeth = pairs if gear == 0 else -pairs  # the wheel's teeth count against the pinion's
        displacement = sector_displacement(body, 0, teeth, forces[gear])
        stress = nodal_stress(body.mesh, displacement, material.youngs_modulus_GPa * 1e3, material.poisson_ratio)
        principal, von_mises = principal_and_von_mises(stress)
        own = np.unique(body.mesh.elements[:, :QUADRATIC_NODES])
        pressure = np.zeros((len(body.mesh.nodes), 1, displacement.shape[2]))
        for number in np.flatnonzero(teeth % body.mesh.teeth == 0):
            pressure[body.mesh.flank.ravel(), 0] += _pressure(body.mesh, forces[gear, number])
        yield {
            "displacement_mm": np.einsum("ij,njm->nim", rotation, displacement)[own],
            "stress_MPa": _turned(stress, rotation)[own], "max_principal_MPa": principal[own, None],
            "von_mises_MPa": von_mises[own, None], "flank_pressure_MPa": pressure[own]
        }  # fmt: skip


def _pressure(mesh: SectorMesh, force: FloatArray) -> FloatArray:
    """Spread forces on the nodes of a flank, (3 n, m), over its faces: pressure at its nodes, (n, m), MPa.

    It is linear between the corners of the faces, and its integral over the flank is the force on the tooth, with half
    of the width half of it. Forces are not divided by areas node by node: at the corners of quadratic faces and beside
    a line of contact, which cubics carry, consistent ones pull, and a flank does not.
    """
    vectors = force.reshape(-1, 3, force.shape[1])
    total = vectors.sum(axis=0)
    size = np.linalg.norm(total, axis=0)
    pressing = np.einsum("nim,im->nm", vectors, total / np.where(size > 0.0, size, 1.0))
    rows, columns = mesh.flank.shape
    along, across = (hat_functions(np.arange(n), np.arange(0, n, mesh.order)) for n in (rows, columns))
    of_corners = np.einsum("rp,zq,rzm->pqm", along, across, pressing.reshape(rows, columns, -1)).clip(min=0.0)
    carried = of_corners.sum(axis=(0, 1))
    of_corners *= np.divide(size, carried, out=np.zeros_like(size), where=carried > 0.0)
    pressure = of_corners / (2.0 if mesh.mirrored else 1.0) / _corner_areas(mesh)[..., None]
    return np.asarray(np.einsum("rp,zq,pqm->rzm", along, across, pressure).reshape(len(pressing), -1))


def _corner_areas(mesh: SectorMesh) -> FloatArray:
    """Area of a flank that each corner of its faces stands for, mm^2."""
    corner = mesh.flank_nodes[:: mesh.order, :: mesh.order]
    one, two = corner[1:, 1:] - corner[:-1, :-1], corner[1:, :-1] - corner[:-1, 1:]
    quarter = np.linalg.norm(np.cross(one, two), axis=-1) / 8.0
    return np.asarray(sum(np.pad(quarter, ((up, 1 - up), (right, 1 - right))) for up in (0, 1) for right in (0, 1)))


def _turned(stress: FloatArray, rotation: FloatArray) -> FloatArray:
    """Tensors (n, 6, m) in the frame of the pair."""
    tensor = stress[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]
    turned = np.einsum("ia,nabm,jb->nijm", rotation, tensor, rotation, optimize=True)
    return np.asarray(turned[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]])


def _grid(gears: tuple[ElasticGear, ElasticGear], placed: Placed) -> Grid:
    """Elements of both sectors, which share no points."""
    firsts, points, cells = [0], [], []
    for mesh, (rotation, shift) in zip((gear.mesh for gear in gears), placed, strict=True):
        elements = mesh.elements[:, :QUADRATIC_NODES]
        own, number = np.unique(elements, return_inverse=True)
        order = REFLECTED[: elements.shape[1]] if np.linalg.det(rotation) < 0.0 else slice(None)
        cells.append(firsts[-1] + number.reshape(elements.shape)[:, order])
        points.append(mesh.nodes[own] @ rotation.T + shift)
        firsts.append(firsts[-1] + len(own))
    nodes = np.concatenate(cells)
    kind = QUADRATIC_HEXAHEDRON if nodes.shape[1] == QUADRATIC_NODES else HEXAHEDRON
    numbers = np.repeat([0, 1], [len(gear.mesh.elements) for gear in gears])
    return Grid(np.concatenate(points), nodes, kind, {"gear": numbers})
