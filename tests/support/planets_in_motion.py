"""Planetary sets of springs in one plane, as the literature has them, for tests of motion: kg, N/m, equal planets."""

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import eigh, null_space

from pmor.body.beam import NODE
from pmor.core.conventions import rotation_z
from pmor.dynamics.whine.blades import Blades
from pmor.dynamics.whine.moving import MovingMachine
from pmor.dynamics.whine.planets import CENTRAL, HUBS, MovingSet, PlanetCoordinates, PlanetMatrices, planet_matrices
from pmor.gear.inertia import Inertia
from pmor.machine.load_settings import LoadCase
from pmor.machine.loaded import LoadedGearbox

# Any: inertias and torsional springs are given over the square of the radius, mm.
RADIUS = 100.0
X, Y, ABOUT = 0, 1, 5
SUN, CARRIER, RING, PLANET = "s", "c", "r", "p"
COLUMN = {SUN: 0, CARRIER: NODE, RING: 2 * NODE}


@dataclass(frozen=True)
class PlanarSet:
    """Masses, inertias over r^2, kg; springs, N/m, by member; `across` on the housing along x and y."""

    planets: int
    mass: dict
    inertia: dict
    mesh: tuple
    bearing: dict
    torsion: dict
    alpha_deg: float = 0.0
    across: dict = field(default_factory=dict)
    held: tuple = ()
    carrier: float = 0.0
    spins: tuple = (0.0, 0.0, 0.0)
    first_deg: float = 0.0

    @property
    def blades(self):
        return Blades(math.radians(self.first_deg) + 2.0 * math.pi * np.arange(self.planets) / self.planets)

    @property
    def coordinates(self):
        carried = np.zeros((NODE * (CENTRAL + self.planets), HUBS))
        carried[:NODE, :NODE] = carried[NODE : 2 * NODE, 2 * NODE :] = np.eye(NODE)
        for number, psi in enumerate(self.blades.directions):
            rows = slice(NODE * (CENTRAL + number), NODE * (CENTRAL + number + 1))
            arm = RADIUS * np.array([-math.sin(psi), math.cos(psi), 0.0])
            carried[rows, NODE : 2 * NODE] = np.eye(NODE)
            carried[rows.start : rows.start + 3, NODE + 3 : 2 * NODE] = np.cross(np.eye(3), arm).T
        return PlanetCoordinates(self.blades, carried)

    @property
    def columns(self):
        """Closing of the meshes sun - planet and planet - ring of each planet (Lin & Parker 1999, eq. 2)."""
        sine, cosine = math.sin(math.radians(self.alpha_deg)), math.cos(math.radians(self.alpha_deg))
        found = np.zeros((NODE * (CENTRAL + self.planets), 2 * self.planets))
        for number, psi in enumerate(self.blades.directions):
            turn = np.kron(np.eye(2), rotation_z(psi))
            planet = NODE * (CENTRAL + number)
            for mesh, (body, side, spin) in enumerate(((0, sine, RADIUS), (NODE, -sine, -RADIUS))):
                own = np.zeros((2, NODE))
                own[0, [X, Y, ABOUT]] = -cosine, side, RADIUS
                own[1, [X, Y, ABOUT]] = cosine, -side, spin
                found[body : body + NODE, 2 * number + mesh] = turn @ own[0]
                found[planet : planet + NODE, 2 * number + mesh] = turn @ own[1]
        return found

    @property
    def compliance(self):
        """What planets stand on in the carrier."""
        found = np.zeros((NODE * (CENTRAL + self.planets),) * 2)
        if PLANET in self.bearing:
            across = NODE * (CENTRAL + np.arange(self.planets))[:, None] + np.array([X, Y])
            found[across, across] = 1e3 / self.bearing[PLANET]
        return found

    @property
    def free(self):
        found = np.zeros((self.planets, NODE * (CENTRAL + self.planets)))
        found[np.arange(self.planets), NODE * (CENTRAL + np.arange(self.planets)) + ABOUT] = 1.0
        return found

    @property
    def matrices(self):
        """Of the set, and of the carrier and what central members stand on beside it; meshes closed."""
        order = [SUN, RING, *[PLANET] * self.planets]
        own = planet_matrices(
            self.coordinates, [self._inertia(name) for name in order], self.compliance, self.free, self.carrier,
            [self.spins[0], self.spins[1], *[self.spins[2]] * self.planets],
        )  # fmt: skip
        mass, stiffness = own.mass.copy(), own.stiffness + self.ports.T @ self.tangent @ self.ports
        held = [*own.constraints]
        for name, first in COLUMN.items():
            mass[[first + X, first + Y], [first + X, first + Y]] += 1e-3 * self.mass.get(name, 0.0) * (name == CARRIER)
            mass[first + ABOUT, first + ABOUT] += 1e-3 * RADIUS**2 * self.inertia.get(name, 0.0) * (name == CARRIER)
            ways = [2, 3, 4] + ([X, Y] if name in self.held else [])
            held += list(np.eye(len(mass))[[first + way for way in ways]])
            one, other = self.across.get(name, (self.bearing.get(name, 0.0),) * 2)
            stiffness[first + X, first + X] += 1e-3 * one
            stiffness[first + Y, first + Y] += 1e-3 * other
            torsion = self.torsion.get(name, 0.0)
            if torsion == "rigid":
                held.append(np.eye(len(mass))[first + ABOUT])
            else:
                stiffness[first + ABOUT, first + ABOUT] += 1e-3 * RADIUS**2 * torsion
        return mass, stiffness, own.gyroscopic, own.centrifugal, np.array(held)

    @property
    def ports(self):
        return self.coordinates.ports(self.columns)

    @property
    def tangent(self):
        """Of the meshes, in the coordinates of planets."""
        blades = np.kron(self.blades.matrix, np.eye(2))
        return blades.T @ np.diag(np.tile(1e-3 * np.array(self.mesh), self.planets)) @ blades

    def modes(self):
        """Natural frequencies by family, Hz, and shapes."""
        mass, stiffness, _, _, held = self.matrices
        found = []
        for family in self.coordinates.families:
            basis = null_space(np.concatenate([held, np.diag(1.0 - family)]))
            square = eigh(basis.T @ stiffness @ basis, basis.T @ mass @ basis, eigvals_only=True) if basis.size else []
            found.append(np.sqrt(np.maximum(square, 0.0)) / (2.0 * math.pi))
        return found

    def _inertia(self, name):
        polar = 1e-6 * RADIUS**2 * self.inertia[name]
        return Inertia(self.mass.get(name, 0.0), polar, 0.5 * polar)


def machine_of(one, teeth=17):
    """A planar set as a machine by itself; its speed is that at which the carrier turns `one.carrier` times."""
    mass, stiffness, gyroscopic, centrifugal, held = one.matrices
    ports, none = one.ports, np.zeros((0, 0))
    stiffness = stiffness - ports.T @ one.tangent @ ports
    alone = LoadedGearbox({}, {}, (), (), (), (), np.zeros(0), np.zeros(0), none)
    moving = MovingSet(
        "set", one.coordinates, PlanetMatrices(mass, stiffness, gyroscopic, centrifugal, held), np.eye(len(mass)),
        len(mass), 0, len(ports), one.carrier, teeth * (one.spins[0] - one.carrier), teeth,
    )  # fmt: skip
    load = LoadCase(name="set", torques=())
    return MovingMachine(alone, load, mass, stiffness, gyroscopic, ports, {}, 1.0, none, (moving,))
