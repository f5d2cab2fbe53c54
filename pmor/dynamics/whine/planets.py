"""A planetary set as rigid bodies in small motion: sun, carrier, ring and planets, on a carrier that turns evenly.

Axes are those of the set's plan, z along its axis. Hubs of sun, carrier and ring are seen in the housing, and planets
against the carrier, along their own radius, in the coordinates of `pmor.dynamics.whine.blades`: together y. What a
body's hub does in axes that turn with the carrier at W is u = E exp(S W t) y, so that in the housing its velocity has
u' + W J u, J the turn by a right angle, and

    M = E^T m E,    G = 2 E^T m D + s E^T g E,    K = E^T m (J D + D S) + s E^T g D,    D = J E + E S,            (1)

at W = 1, with the bodies' masses m, gyroscopic moments g and spins s: inertia and Coriolis forces, and centrifugal ones
that go with W^2. Seen from the carrier (`Blades.carried`) S = 0, hubs of sun, carrier and ring turn with it, and what
they do in the housing is found by `MovingSet.in_housing`. That loads turn with the carrier as it moves is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import null_space, orth

from pmor.body.beam import NODE
from pmor.core.arrays import ComplexArray, FloatArray
from pmor.core.conventions import rotation_z
from pmor.dynamics.whine.blades import SIDEBANDS, Blades
from pmor.dynamics.whine.discs import disc_matrices
from pmor.gear.inertia import Inertia
from pmor.machine.set_frame import MEMBERS
from pmor.machine.system import ARM

# Sun and ring before the planets, among bodies; displacements of sun, carrier and ring before those of planets.
CENTRAL, HUBS = 2, NODE * len(MEMBERS)
# Turn by a right angle of displacements and rotations across the axis.
TURN = np.kron(np.eye(2), np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
# Of the largest compliance: what is rigid.
RIGID = 1e-12
# In coordinates of like size, a hub's displacements and rotations.
LIKE = np.repeat([1.0, ARM], 3)


@dataclass(frozen=True)
class PlanetCoordinates:
    """Coordinates y of a set, L of them.

    Parameters
    ----------
    carried : ndarray, shape (6 B, 18)
        Displacements of the hubs of all bodies by those of sun, carrier and ring (`pmor.machine.set_frame`); bodies
        are sun, ring, all planets, and their second gears.
    """

    blades: Blades
    carried: FloatArray

    @property
    def gears(self) -> int:
        """Gears of a planet."""
        return (len(self.carried) // NODE - CENTRAL) // self.blades.count

    @property
    def size(self) -> int:
        """L."""
        return HUBS + NODE * self.gears * self.blades.count

    @cached_property
    def standing(self) -> FloatArray:
        """Displacements of the hubs of planets against the carrier by y, (6 N g, L), in axes of the plan at time 0."""
        count, gears = self.blades.count, self.gears
        found = np.zeros((gears, count, NODE, self.size))
        for number, direction in enumerate(self.blades.directions):
            turned = np.kron(np.eye(2), rotation_z(direction))
            for gear in range(gears):
                for blade, share in enumerate(self.blades.matrix[number]):
                    first = HUBS + NODE * (gears * blade + gear)
                    found[gear, number, :, first : first + NODE] = share * turned
        return found.reshape(-1, self.size)

    @cached_property
    def bodies(self) -> FloatArray:
        """E: displacements of the hubs of all bodies by y, (6 B, L)."""
        found = np.zeros((len(self.carried), self.size))
        found[:, :HUBS] = self.carried
        found[NODE * CENTRAL :] += self.standing
        return found

    @cached_property
    def turning(self) -> FloatArray:
        """S, (L, L)."""
        found = np.zeros((self.size, self.size))
        if not self.blades.carried:
            found[:HUBS, :HUBS] = np.kron(np.eye(len(MEMBERS)), -TURN)
        found[HUBS:, HUBS:] = np.kron(self.blades.turning, np.eye(NODE * self.gears))
        return found

    @cached_property
    def families(self) -> FloatArray:
        """Whether a coordinate belongs to each family, (3, L): motion of hubs about and along the axis, across it."""
        across = np.tile(np.diag(TURN @ TURN) != 0.0, len(MEMBERS)).astype(int)
        number = np.concatenate([across, np.repeat(self.blades.family, NODE * self.gears)])
        return np.asarray(number == np.arange(3)[:, None], dtype=float)

    def ports(self, columns: FloatArray) -> FloatArray:
        """Return what meshes do as planets do in (1) of `blades`, (P, L).

        Parameters
        ----------
        columns : ndarray, shape (6 B, P)
            Wrenches on all hubs by unit forces on the coordinates of the meshes, planet by planet, at time 0.
        """
        each = columns.shape[1] // self.blades.count
        return np.asarray(np.linalg.inv(np.kron(self.blades.matrix, np.eye(each))) @ columns.T @ self.bodies)


@dataclass(frozen=True)
class PlanetMatrices:
    """Matrices of a set, (L, L), at a unit speed of the machine; t, N, mm.

    Parameters
    ----------
    constraints : ndarray, shape (c, L)
        Rows of the displacements that rigid supports hold.
    """

    mass: FloatArray
    stiffness: FloatArray
    gyroscopic: FloatArray
    centrifugal: FloatArray
    constraints: FloatArray


@dataclass(frozen=True)
class MovingSet:
    """A set in a machine of n displacements, at least.

    Parameters
    ----------
    by : ndarray, shape (L, n)
        y by the displacements of the machine.
    added : int
        Displacements that it brings, the last ones of n.
    first : int
        Of its P coordinates among those of all meshes; planet by planet in (1) of `blades`.
    carrier, rate : float
        Speed of the carrier, and pitches of the sun that pass by its turn against the carrier, over the machine's
        speed; counter-clockwise in the plan.
    teeth : int
        Of the sun.
    housed : tuple of int
        Members that stand in the housing, by their number in `MEMBERS`.
    """

    name: str
    coordinates: PlanetCoordinates
    matrices: PlanetMatrices
    by: FloatArray
    added: int
    first: int
    size: int
    carrier: float
    rate: float
    teeth: int
    housed: tuple[int, ...] = ()

    @property
    def own(self) -> slice:
        """Its coordinates among those of all meshes."""
        return slice(self.first, self.first + self.size)

    @cached_property
    def on_supports(self) -> FloatArray:
        """Forces and moments on what holds sun, carrier and ring, in axes of the plan, by forces on y, (18, L).

        Of sun and ring on shafts none; on a shaft that is the carrier those of all planets on its hub.
        """
        found = np.eye(HUBS, self.coordinates.size)
        if MEMBERS.index("carrier") in self.housed:
            return found
        moved = np.linalg.lstsq(self.coordinates.standing[:, HUBS:], self.coordinates.carried[NODE * CENTRAL :])[0]
        found[NODE : 2 * NODE] = 0.0
        found[NODE : 2 * NODE, HUBS:] = moved[:, NODE : 2 * NODE].T
        return found

    def in_housing(self, readings: ComplexArray) -> ComplexArray:
        """Return readings seen from the carrier of a set by itself, (S, K, o), as three lines each, (S, 3 K, o).

        By the orders of the carrier's turn beside them: forwards whirl is a turn faster in the housing, backwards one a
        turn slower, what goes along or about the axis is the same. All forces are then among those of supports.
        """
        held = self.on_supports @ self.matrices.constraints.T
        forces = (readings[..., :HUBS] - readings[..., HUBS:] @ held.T).reshape(*readings.shape[:2], 1, -1, NODE)
        across = -TURN @ TURN
        whirl = [0.5 * (across - 1j * j * TURN) if j else np.eye(NODE) - across for j in SIDEBANDS]
        seen = np.concatenate([forces @ part.T for part in whirl], axis=2)
        shown = seen.reshape(len(readings), -1, HUBS)
        return np.asarray(np.pad(shown, ((0, 0), (0, 0), (0, held.shape[1]))))

    def families(self, shape: FloatArray) -> FloatArray:
        """Return the kinetic energy of each family, twice, of modes (n, m) at 1 rad/s: (3, m)."""
        moved = self.coordinates.families[..., None] * (self.by @ shape[: self.by.shape[1]])
        return np.asarray(np.einsum("flm,lk,fkm->fm", moved, self.matrices.mass, moved))


class Further(NamedTuple):
    """What moves with a member beside the gears: displacements of its node by y, (6, L), and how it turns.

    Attributes
    ----------
    along, spin : float
        Of its middle from that node, mm; its speed as that of bodies.
    """

    rows: FloatArray
    inertia: Inertia
    along: float
    spin: float


def planet_matrices(
    coordinates: PlanetCoordinates, inertias: Sequence[Inertia], compliance: FloatArray, free: FloatArray,
    carrier: float, spins: Sequence[float], own: Sequence[int] = (), further: Sequence[Further] = (),
) -> PlanetMatrices:  # fmt: skip
    """Return the matrices of a set: equation (1), and what planets stand on in the carrier.

    Parameters
    ----------
    inertias : sequence of Inertia, length B
    compliance, free : ndarray, shape (6 B, 6 B) and (K, 6 B), or of one body more, the carrier
        Of what hubs of planets stand on in the carrier, and of `own` members in the housing, in axes of the plan: as of
        `pmor.line.several.GearTrain`.
    carrier, spins : float, sequence of float, length B
        Speeds of the carrier and of all bodies, counter-clockwise in the plan, over that of the machine.
    own : sequence of int
        Members that no shaft carries, by their number in `MEMBERS`.
    further : sequence of Further
        What moves with members beside the gears.
    """
    size, bodies = coordinates.size, len(inertias)
    mass, gyroscopic, centrifugal = np.zeros((3, size, size))
    every = [(coordinates.bodies[NODE * number : NODE * (number + 1)], inertia, 0.0, spins[number])
             for number, inertia in enumerate(inertias)]  # fmt: skip
    for rows, inertia, along, spin in (*every, *further):
        moved = carrier * (TURN @ rows + rows @ coordinates.turning)
        inert, spinning = disc_matrices(inertia, along, axis=2)
        mass += rows.T @ inert @ rows
        gyroscopic += rows.T @ (2.0 * inert @ moved + spin * spinning @ rows)
        faster = carrier * (TURN @ moved + moved @ coordinates.turning)
        centrifugal += rows.T @ (inert @ faster + spin * spinning @ moved)
    stand = np.concatenate([hub_rows(coordinates, member) for member in own] + [coordinates.standing])
    places = [(0, bodies, 1)[member] for member in own] + list(range(CENTRAL, bodies))
    taken = (NODE * np.array(places)[:, None] + np.arange(NODE)).ravel()
    inner, held = _springs(compliance[np.ix_(taken, taken)], free[:, taken])
    return PlanetMatrices(mass, stand.T @ inner @ stand, gyroscopic, centrifugal, held @ stand)


def uneven(matrix: FloatArray, left: FloatArray, right: FloatArray) -> float:
    """Return by how much a matrix changes as the carrier turns, over its size; `left` and `right` turn its sides."""
    return float(np.abs(left.T @ matrix + matrix @ right).max() / (np.abs(matrix).max() or 1.0))


def hub_rows(coordinates: PlanetCoordinates, member: int) -> FloatArray:
    """Return the displacements of the hub of a member, by its number in `MEMBERS`, by y, (6, L)."""
    return np.eye(coordinates.size)[NODE * member : NODE * (member + 1)]


def _springs(compliance: FloatArray, free: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Stiffness of supports by compliance C and free movements, and rows of what is rigid.

    Forces that do no work on free movements, w = Z b, move hubs by Z^T u = Z^T C Z b.
    """
    like = np.tile(LIKE, len(compliance) // NODE)
    soft, moves = like[:, None] * compliance * like, free * like
    values, vectors = np.linalg.eigh(soft)
    gives = vectors[:, values > RIGID * max(values.max(initial=0.0), 1e-300)]
    moves = moves[np.abs(moves).max(axis=1, initial=0.0) > 0.0]
    basis = orth(np.concatenate([gives, moves.T], axis=1)) if len(moves) else gives
    loaded = basis @ null_space(moves @ basis) if len(moves) else basis
    inner = loaded @ np.linalg.solve(loaded.T @ soft @ loaded, loaded.T) if loaded.size else np.zeros_like(soft)
    # Where nothing moves all is held.
    held = null_space(basis.T).T if basis.size else np.eye(len(soft))
    return like[:, None] * inner * like, held * like
