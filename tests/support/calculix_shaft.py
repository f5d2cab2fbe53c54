"""A helical pinion in one piece with its solid shaft, overhung, against an arc of its wheel, for CalculiX.

Elements are C3D20. The shaft fills the bore of the pinion, all of whose nodes are its own, and goes on past one end of
the face. Rows of flank nodes follow the line of contact: each layer of a tooth that can touch has its own, `fine` (mm)
where it touches. Other teeth have few.

Where a beam has one displacement or rotation, a section of the shaft has their mean over its area: bearings hold it,
and the torque works on it. The rotation of the pinion is the mean one of its bore. Contact is surface to surface, under
a penalty; what each column of flank nodes bears follows from the stresses in the elements beside it.
"""

import math
import re
from contextlib import ExitStack
from dataclasses import dataclass, replace
from unittest.mock import patch

import numpy as np

from pmor.fe import sector
from pmor.fe.element import node_places
from pmor.fe.hexahedron import shape_gradient
from pmor.lab.rivals.calculix import run_deck
from tests.support.calculix_plane import arc_of, flank_faces, graded
from tests.support.calculix_ring import Ring, fields, flank_rows, material_lines, mesh_lines, ring_of

# Elements along a fillet and root land of teeth that can touch and of others, rows of these, growth of columns.
FILLET, FREE_FILLET, FREE_ROWS, COLUMN_GROWTH = 12, 1, 2, 1.7
# Rows of elements between root and bore, their growth; elements over the radius of the shaft, and their length (mm).
RIM_ROWS, RIM_GROWTH, SHAFT_ROWS, SHAFT_STEP = 3, 1.5, 2, 12.0
# Teeth of the wheel that are kept beside those that can touch, and the part of a pitch that these may be early or late.
BESIDE, MARGIN = 2, 0.1
# Share of the STE by which the pinion is ahead at first; of displacements, where Newton's iteration stops.
START, TOLERANCE = 0.12, 1e-4
SETS = "DRIVER", "ON_SHAFT", "BESIDE"


@dataclass(frozen=True)
class Overhang:
    """Places along the shaft from its overhung end, where the face begins, mm.

    The second bearing holds it axially too. Nothing acts on the section at `read`, up to which the shaft's twist is
    told; the torque acts at the end.
    """

    bearings: tuple[float, float]
    read: float
    end: float


@dataclass(frozen=True)
class Solved:
    """Rotation of the pinion, and of the shaft at `read` beyond that, times the base radius; forces by column (N)."""

    ahead_um: float
    twist_um: float
    z: np.ndarray
    column_N: np.ndarray


@dataclass(frozen=True)
class Shaft:
    """All nodes, those of the shaft by radius (from the axis), around and along; bricks, wedges about the axis."""

    nodes: np.ndarray
    grid: np.ndarray
    bricks: np.ndarray
    wedges: np.ndarray

    def section(self, place):
        """Corners of elements in the section at a place, and the shares of its area that they stand for."""
        z = self.nodes[self.grid[0, 0], 2]
        ids = self.grid[::2, ::2, np.abs(z - z[0] - place).argmin()]
        along, around = (np.roll(ids, -1, axis=axis) for axis in (0, 1))
        corners = np.stack([ids, along, np.roll(along, -1, axis=1), around])[:, :-1]
        x, y = np.moveaxis(self.nodes[corners, :2], -1, 0)
        area = 0.5 * np.abs((x[2] - x[0]) * (y[3] - y[1]) - (x[3] - x[1]) * (y[2] - y[0]))
        share = np.bincount(corners.ravel(), np.tile(0.25 * area, (4, 1, 1)).ravel())
        numbers = np.flatnonzero(share)
        return numbers, share[numbers] / share.sum()

    def turn(self, place):
        """Nodes of a section, and the factors of their displacements in its mean rotation about the axis, (n, 3)."""
        numbers, share = self.section(place)
        x, y = self.nodes[numbers, :2].T
        return numbers, np.stack([-y, x, 0.0 * x], axis=-1) * (share / (share @ (x**2 + y**2)))[:, None]

    def turn_of_bore(self, layers):
        """Nodes on the bore, and the factors of their displacements in its mean rotation about the axis, (n, 3)."""
        numbers = self.grid[-1, ::2, :layers]
        x, y = np.moveaxis(self.nodes[numbers, :2], -1, 0)
        around = np.angle(np.roll(x + 1j * y, -1, axis=0) / np.roll(x + 1j * y, 1, axis=0))
        share = around * _parabolic(self.nodes[numbers[0], 2])
        factors = np.stack([-y, x, 0.0 * x], axis=-1) * (share / share.sum() / (x**2 + y**2))[..., None]
        return numbers.ravel(), factors.reshape(-1, 3)


def _parabolic(places):
    """Simpson's weights of nodes at ends and middles of elements."""
    weights = np.zeros(len(places))
    for first in range(0, len(places) - 1, 2):
        weights[first : first + 3] += np.array([1.0, 4.0, 1.0]) / 6.0 * (places[first + 2] - places[first])
    return weights


def solve_overhung(case, pair, phi, overhang, fine, reach, layers, penalty, expected_um):
    """Solve a pinion angle with CalculiX; without an overhang the pinion's bore is rigid and turns in place.

    `fine` is the length of elements up to `reach` (both mm) from a contact, `penalty` is in N/mm^3.
    """
    ahead, index = 1e-3 * START * expected_um, pair.touching_pairs(phi, MARGIN * pair.pitch)
    angles = phi + ahead / pair.pinion.base_radius, math.pi + pair.wheel_tooth_rotation(phi)
    rings, faces, meshes = [], [], []
    for gear, tooth in enumerate((pair.pinion, pair.wheel)):
        teeth = [int(i) % tooth.teeth for i in (index if gear == 0 else -index)]
        touching = dict(zip(teeth, phi + index * pair.pitch, strict=True))
        meshes.append(_sectors(case, pair, gear, touching, fine, reach, layers))
        ring = ring_of(meshes[gear], angles[gear], (0.0, pair.centre_distance)[gear])
        rings.append(arc_of(ring, meshes[gear], teeth, BESIDE) if gear == 1 else ring)
        on_flank = flank_faces(meshes[gear])
        faces.append([on_flank[tooth] for tooth in teeth])
        if gear == 0:
            beside = [_beside_the_flank(meshes[0][tooth], ring.numbers[tooth]) for tooth in teeth]
    shaft = _shaft(meshes[0], rings[0], overhang)
    near = np.unique(np.concatenate([elements.ravel() for elements, _ in beside]))
    log, results = run_deck("\n".join([*_deck(case, pair, shaft, rings, faces, overhang, penalty, near)]) + "\n")
    assert "best solution" not in log, "no equilibrium"
    moved = np.zeros_like(shaft.nodes)
    for name in SETS[1:]:
        rows = _printed(results, name)
        moved[rows[:, 0].astype(int) - 1] = rows[:, 1:]
    if overhang is None:
        path = twist = _printed(results, "DRIVER")[0, 1]
    else:
        path, twist = (
            pair.pinion.base_radius * np.sum(factors * moved[numbers])
            for numbers, factors in (shaft.turn_of_bore(len(meshes[0][0].z)), shaft.turn(overhang.read))
        )
    moments = sum(_column_moments(case.pair.pinion, shaft.nodes, moved, *one) for one in beside)
    return Solved(1e3 * (ahead + path), 1e3 * (twist - path), meshes[0][0].z, moments / pair.pinion.base_radius)


def _sectors(case, pair, gear, touching, fine, reach, layers):
    """Sectors of a gear; those of some teeth, at their pairs' roll positions, have rows along the line of contact."""
    tooth, made_of = (pair.pinion, pair.wheel)[gear], (case.pair.pinion, case.pair.wheel)[gear]
    low, high = pair.faces[gear]
    depth = sector._graded(1.0, 1.0 / RIM_ROWS / RIM_GROWTH, RIM_ROWS, RIM_GROWTH)
    ends = tooth.form_roll_angle, tooth.tip_roll_angle
    half_width = abs(tooth.flank_section(np.array([np.mean(ends)]))[0, 0])
    across = sector._through_thickness(half_width, sector.LAYER_DEPTH * tooth.module, fine, COLUMN_GROWTH**2)

    def made(roll, fillet, columns):
        with ExitStack() as patches:
            patches.enter_context(flank_rows(roll, fillet))
            patches.enter_context(patch.object(sector, "_through_thickness", lambda *_: columns))
            patches.enter_context(patch.object(sector, "_rows_to_bore", lambda *_: depth))
            rows = (len(roll) - 1) // 2
            return sector.build_sector(tooth, made_of.bore_radius_mm, high - low, rows, layers, order=2)

    free = made(np.linspace(*ends, 2 * FREE_ROWS + 1), FREE_FILLET, np.array([0.0, 1.0]))
    meshes = [free] * tooth.teeth
    for number, position in touching.items():
        at = np.clip(position + pair.pinion.twist_per_length * free.z, *pair.roll_position_range)
        rows = _rows(tooth, np.clip(pair.contact_roll_angles(at)[gear], *ends), fine, reach)
        layered = [made(roll, FILLET, across) for roll in rows]
        nodes = [one.nodes.reshape(-1, len(free.z), 3)[:, k] for k, one in enumerate(layered)]
        meshes[number] = replace(layered[0], nodes=np.stack(nodes, axis=1).reshape(-1, 3))
    return meshes


def _rows(tooth, rolls, fine, reach):
    """Roll angles of nodes on a flank, shape (layers, nodes), that touches at another roll angle in each layer."""
    marks = 0.5 * tooth.base_radius
    arc = np.linspace(marks * tooth.form_roll_angle**2, marks * tooth.tip_roll_angle**2, 20001)
    away = [np.abs(arc - marks * roll**2) - reach for roll in rolls]
    elements = max(len(graded(arc, distance, fine)) // 2 for distance in away)
    return np.sqrt([graded(arc, distance, fine, elements) / marks for distance in away])


def _shaft(meshes, ring, overhang):
    """The shaft that fills the bore of a ring and goes on beyond its last layer; none without an overhang."""
    if overhang is None:
        return Shaft(ring.nodes, *(np.zeros((0, n), dtype=int) for n in (3, 20, 15)))
    z, columns = meshes[0].z, []
    for mesh, numbers in zip(meshes, ring.numbers, strict=True):  # clockwise within a sector
        columns.append(numbers[mesh.bore].reshape(-1, len(z))[:0:-1])
    on_bore = np.concatenate(columns)
    marks = [z[-1] - z[0], *sorted([*overhang.bearings, overhang.read]), overhang.end]
    steps = [2 * math.ceil((b - a) / SHAFT_STEP) + 1 for a, b in zip(marks, marks[1:], strict=False)]
    beyond = [np.linspace(a, b, n)[1:] for a, b, n in zip(marks, marks[1:], steps, strict=False)]
    place = np.concatenate([z, z[0] + np.concatenate(beyond)])
    layer = np.minimum(np.arange(len(place)), len(z) - 1)
    nodes = np.empty((2 * SHAFT_ROWS + 1, len(on_bore), len(place), 3))
    nodes[..., :2] = np.linspace(0.0, 1.0, len(nodes))[:, None, None, None] * ring.nodes[on_bore[:, layer], :2]
    nodes[..., 2] = place
    grid = len(ring.nodes) + np.arange(nodes[..., 0].size).reshape(nodes.shape[:3])
    grid[-1, :, : len(z)], grid[0] = on_bore, grid[0, 0]
    closed = np.concatenate([grid, grid[:, :1]], axis=1)
    elements = np.lib.stride_tricks.sliding_window_view(closed, (3, 3, 3))[::2, ::2, ::2]
    bricks = elements[1:].reshape(-1, 3, 3, 3)[(slice(None), *node_places(2)[:20].T)]
    corners, edges = [(0, 0), (2, 0), (2, 2)], [(1, 0), (2, 1), (1, 2)]
    order = [(*p, k) for places in (corners, edges) for k in (0, 2) for p in places] + [(*p, 1) for p in corners]
    wedges = elements[0].reshape(-1, 3, 3, 3)[(slice(None), *np.array(order).T)]
    return Shaft(np.concatenate([ring.nodes, nodes.reshape(-1, 3)]), grid, bricks, wedges)


def _beside_the_flank(mesh, numbers):
    """Nodes of the elements of a tooth that have nodes on its flank; and those of the flank."""
    elements = mesh.elements[:, :20]
    return numbers[elements[np.isin(elements, mesh.flank).any(axis=1)]], numbers[mesh.flank]


def _column_moments(gear, nodes, moved, elements, flank):
    """Moments about the axis that contact puts on a flank, by column of nodes, from the stresses, N mm."""
    shear = 1e3 * gear.youngs_modulus_GPa / (2.0 * (1.0 + gear.poisson_ratio))
    lame = 2.0 * shear * gear.poisson_ratio / (1.0 - 2.0 * gear.poisson_ratio)
    force, (abscissas, weights) = np.zeros_like(nodes), np.polynomial.legendre.leggauss(3)
    for point in np.ndindex(3, 3, 3):
        slopes = shape_gradient(abscissas[list(point)], 2)
        jacobian = np.einsum("na,eni->eai", slopes, nodes[elements])
        gradient = np.einsum("na,eia->eni", slopes, np.linalg.inv(jacobian))
        strain = np.einsum("eni,enj->eij", gradient, moved[elements])
        stress = shear * (strain + strain.transpose(0, 2, 1))
        stress += lame * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        volume = np.linalg.det(jacobian) * np.prod(weights[list(point)])
        np.add.at(force, elements, np.einsum("e,eni,eij->enj", volume, gradient, stress))
    return (nodes[:, 1] * force[:, 0] - nodes[:, 0] * force[:, 1])[flank].sum(axis=0)


def _deck(case, pair, shaft, rings, faces, overhang, penalty, near):
    pinion, wheel = rings
    elements = np.concatenate([pinion.elements, shaft.bricks])
    used = np.unique(np.concatenate([elements.ravel(), shaft.wedges.ravel()]))
    solid = Ring(shaft.nodes, [], elements, used, pinion.bore, np.ones(len(elements), dtype=bool))
    first = 1 + len(shaft.nodes), 1 + len(elements) + len(shaft.wedges)
    driver = first[0] + len(wheel.nodes)
    yield from mesh_lines(solid, "PINION_ALL", "PINION")
    if overhang is not None:
        yield "*ELEMENT,TYPE=C3D15,ELSET=PINION"
        for e, nodes in enumerate((shaft.wedges + 1).tolist(), 1 + len(elements)):
            yield f"{e}," + ",".join(map(str, nodes))
    yield from mesh_lines(wheel, "WHEEL_ALL", "WHEEL", *first)
    for name, gear in (("PINION", case.pair.pinion), ("WHEEL", case.pair.wheel)):
        yield from material_lines(name, name, 1e3 * gear.youngs_modulus_GPa, gear.poisson_ratio)
    yield from ("*NODE,NSET=DRIVER", f"{driver},0,0,0")
    yield from _set_lines("WHEEL_BORE", first[0] + wheel.bore)
    yield from _set_lines("PINION_BORE", 1 + pinion.bore)
    yield from _set_lines("BESIDE", 1 + near)
    yield from _set_lines("ON_SHAFT", 1 + (np.intersect1d(shaft.grid, used) if overhang else pinion.bore))
    yield from ("*BOUNDARY", "WHEEL_BORE,1,3", "DRIVER,2,3")
    yield from _support_lines(pair, shaft, pinion, overhang, driver)
    yield from ("*SURFACE INTERACTION,NAME=FLANKS", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR", fields([penalty]))
    for number, both in enumerate(zip(*faces, strict=True)):
        for name, flank, element in zip("PW", both, (1, first[1]), strict=True):
            yield f"*SURFACE,NAME={name}{number},TYPE=ELEMENT"
            yield from (f"{element + e},S{face}" for e, face in flank)
        yield from ("*CONTACT PAIR,INTERACTION=FLANKS,TYPE=SURFACE TO SURFACE", f"P{number},W{number}")
    force = 1e3 * case.torque_Nm / pair.pinion.base_radius
    yield from ("*STEP,INC=100", "*STATIC", "1,1", "*CONTROLS,PARAMETERS=FIELD", fields([TOLERANCE, TOLERANCE]))
    yield from ("*CLOAD", f"{driver},1,{fields([force])}")
    for name in SETS:
        yield from (f"*NODE PRINT,NSET={name}", "U")
    yield "*END STEP"


def _support_lines(pair, shaft, pinion, overhang, driver):
    """Bearings and torque on the shaft; or a rigid bore that turns, by the path of the base circle of the driver."""
    radius = pair.pinion.base_radius
    if overhang is None:
        yield from ("*BOUNDARY", "PINION_BORE,3,3")
        for n in pinion.bore.tolist():
            x, y = pinion.nodes[n, :2] / radius
            for direction, ratio in ((1, -y), (2, x)):
                yield from _equation([(1 + n, direction, -1.0), (driver, 1, ratio)])
        return
    for directions, place in zip(((0, 1), (0, 1, 2)), overhang.bearings, strict=True):
        numbers, share = shaft.section(place)
        for direction in directions:
            yield from _mean(shaft, numbers, share[:, None] * np.eye(3)[direction])
    numbers, factors = shaft.turn(overhang.end)
    yield from _mean(shaft, numbers, factors * radius, (driver, 1, -1.0))


def _mean(shaft, numbers, factors, *more):
    """A sum of factors (n, 3) times displacements, and more terms, is zero."""
    radius = np.linalg.norm(shaft.nodes[numbers, :2], axis=1)
    # The first term is eliminated: one on the circumference, for the node on the axis has many neighbours.
    places = np.argwhere(factors)
    order = np.argsort(-radius[places[:, 0]] * np.abs(factors[tuple(places.T)]))
    return _equation([*((1 + int(numbers[n]), 1 + int(d), factors[n, d]) for n, d in places[order]), *more])


def _equation(terms):
    yield from ("*EQUATION", str(len(terms)))
    for i in range(0, len(terms), 4):
        yield ",".join(f"{n},{d},{value:.13e}" for n, d, value in terms[i : i + 4])


def _set_lines(name, numbers):
    yield f"*NSET,NSET={name}"
    yield from map(str, numbers.tolist())


def _printed(results, name):
    """The last displacements of a set of nodes: number and x, y, z, shape (n, 4)."""
    tables = re.findall(rf"displacements.*for set {name} .*\n\s*\n((?:\s*\d+(?:\s+\S+){{3}}\n)+)", results)
    return np.array([line.split() for line in tables[-1].splitlines()], dtype=float)
