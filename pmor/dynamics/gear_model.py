"""From a case to masses on bearings: the model of one, six or twelve degrees of freedom of a pair in motion.

The gears are rigid, on axes that bearings let move. Of their rotations only the one against each other feels the mesh,
s = rb1 theta1 + rb2 theta2 with the mass m = I1 I2 / (I1 rb2^2 + I2 rb1^2); uniform rotation of both is left out, no
matter how it goes on. Displacements of a gear count x across the plane of the axes, y along the line of centres from
pinion to wheel, z along the axis; a tilt counts times the base radius, so that every coordinate is a length.

The pinion pushes the wheel along n = (-cos a, sin a, -tan b), a the working pressure angle, b the base helix angle,
positive with a right-handed pinion. At the pitch point P at mid width, r from a gear's centre, flanks run ahead by
x = s + n . (u1 - u2) + (r1 x n) . t1 - (r2 x n) . t2 under displacements u and tilts t: these are the levers.

How load moves over the width when gears tilt is not in it: the force law is that of the axes of the case.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.case import Case, DynamicsCase
from pmor.core.arrays import FloatArray
from pmor.dynamics.oscillator import Oscillator
from pmor.gear.inertia import Inertia
from pmor.gear.pair import GearPair
from pmor.pair.drawn import gear_inertias

GEARS = ("pinion", "wheel")
DIRECTIONS = ("x", "y", "z", "about x", "about y")
# Units of a case in those of the equations: mm, N, s, t.
N_UM, KG, KG_M2, KNM_RAD, NM = 1e3, 1e-3, 1e3, 1e6, 1e3
# Directions of the displacements of a gear, by the degrees of freedom.
MOVING = {1: 0, 6: 2, 12: 5}


@dataclass(frozen=True)
class Support:
    """A direction (`DIRECTIONS`) in which a gear, 0 pinion, 1 wheel, moves on its bearings."""

    gear: int
    direction: int
    mass: float
    stiffness: float
    damping: float
    lever: float

    @property
    def name(self) -> str:
        """For messages and tables."""
        return f"{GEARS[self.gear]} {DIRECTIONS[self.direction]}"


@dataclass(frozen=True)
class GearModel:
    """Masses and bearings of a pair; the mesh, its damping and the load are not in it."""

    inertias: tuple[Inertia, Inertia]  # Of pinion and wheel
    mass: float  # On the line of action, t
    supports: tuple[Support, ...]  # Of the directions that are not rigid
    # shape (2, 3): Levers of the displacements of both gears, and shares of the mesh force on rigid bearings
    rigid: FloatArray
    base_radius: float  # Of the pinion, mm

    def oscillator(self, torque_Nm: float, mesh_damping: float) -> Oscillator:
        """Return the equations of motion under a mean torque on the pinion; damping of the mesh in N s/mm."""
        lever = np.array([1.0, *(support.lever for support in self.supports)])
        load = np.zeros(len(lever))
        load[0] = NM * torque_Nm / self.base_radius
        return Oscillator(
            mass=np.diag([self.mass, *(support.mass for support in self.supports)]),
            damping=np.diag([0.0, *(s.damping for s in self.supports)]) + mesh_damping * np.outer(lever, lever),
            stiffness=np.diag([0.0, *(support.stiffness for support in self.supports)]),
            lever=lever,
            load=load,
        )

    def bearing_forces(self, oscillator: Oscillator, states: FloatArray, force: FloatArray) -> FloatArray:
        """Return the forces of both gears on their bearings, N.

        Parameters
        ----------
        states : ndarray, shape (s, 2n)
            Displacements and velocities.
        force : ndarray, shape (s,)
            Of the mesh.

        Returns
        -------
        ndarray, shape (s, 2, 3)
            By gear, and direction x, y, z.
        """
        size = oscillator.size
        mesh_damping = float(oscillator.damping[0, 0])
        along = force + mesh_damping * (states[:, size:] @ oscillator.lever)
        forces = -along[:, None, None] * self.rigid
        for place, support in enumerate(self.supports, start=1):
            if support.direction < forces.shape[2]:
                held = support.stiffness * states[:, place] + support.damping * states[:, size + place]
                forces[:, support.gear, support.direction] = held
        return forces


def gear_model(case: Case, pair: GearPair) -> GearModel:
    """Return masses and bearings of the pair of a case."""
    dynamics = case.dynamics
    drawn = gear_inertias(case, pair)
    inertias = _inertia(dynamics, "pinion", drawn[0]), _inertia(dynamics, "wheel", drawn[1])
    radii = pair.pinion.base_radius, pair.wheel.base_radius
    own = levers(pair)
    supports = [support for gear in range(2) for support in _supports(dynamics, gear, inertias[gear], radii, own)]
    mass = equivalent_mass(*inertias, radii)
    return GearModel(inertias, mass, tuple(supports), own[:, :3], radii[0])


def equivalent_mass(pinion: Inertia, wheel: Inertia, base_radii_mm: tuple[float, float]) -> float:
    """Return the mass in t that moves along the line of action when both gears turn against each other.

    m = I1 I2 / (I1 rb2^2 + I2 rb1^2).
    """
    first, second = (1e-3 * radius for radius in base_radii_mm)
    one, two = pinion.polar_kg_m2, wheel.polar_kg_m2
    return 1e-3 * one * two / (one * second**2 + two * first**2)


@dataclass(frozen=True)
class NaturalModes:
    """Small undamped vibrations of n degrees of freedom with a constant mesh stiffness."""

    frequency: FloatArray  # shape (n,): Angular, rising
    mesh_share: FloatArray  # shape (n,): Of the mesh in the strain energy
    kinetic: FloatArray  # shape (n, n): Share of each degree of freedom in the kinetic energy, by mode

    @property
    def of_mesh(self) -> int:
        """Number of the mode in which the mesh gives way most."""
        return int(self.mesh_share.argmax())


def natural_modes(oscillator: Oscillator, mesh_stiffness: float) -> NaturalModes:
    """Return the natural modes with a stiffness of the mesh in N/mm; masses and springs of bearings are diagonal."""
    springs = np.vstack([np.sqrt(oscillator.stiffness), math.sqrt(mesh_stiffness) * oscillator.lever])
    # As singular values slow modes beside fast ones are not lost in rounding.
    left, frequency, modes = np.linalg.svd(springs / np.sqrt(np.diagonal(oscillator.mass)), full_matrices=False)
    return NaturalModes(frequency[::-1], left[-1, ::-1] ** 2, modes[::-1] ** 2)


def levers(pair: GearPair) -> FloatArray:
    """Return the displacement along the line of action per displacement and tilt of each gear, shape (2, 5)."""
    angle, helix = pair.working_pressure_angle, pair.base_helix_angle
    normal = np.array([-math.cos(angle), math.sin(angle), -math.tan(helix)])
    rows = []
    for sign, tooth in ((1.0, pair.pinion), (-1.0, pair.wheel)):
        radius = tooth.base_radius / math.cos(angle)
        tilts = np.cross([0.0, sign * radius, 0.0], normal)[:2] / tooth.base_radius
        rows.append(sign * np.append(normal, tilts))
    return np.array(rows)


def _inertia(dynamics: DynamicsCase, gear: str, drawn: Inertia) -> Inertia:
    mass, polar = (getattr(dynamics, f"{gear}_{key}") for key in ("mass_kg", "inertia_kg_m2"))
    polar = drawn.polar_kg_m2 if polar is None else polar
    mass = drawn.mass_kg if mass is None else mass
    # A body of revolution tilts with half of its polar inertia and a part from its length.
    tilting = drawn.tilting_kg_m2 + 0.5 * (polar - drawn.polar_kg_m2)
    return Inertia(mass, polar + getattr(dynamics, f"{gear}_shaft_inertia_kg_m2"), tilting)


def _supports(
    dynamics: DynamicsCase, gear: int, inertia: Inertia, radii: tuple[float, float], levers: FloatArray
) -> list[Support]:
    name, radius, ratio = GEARS[gear], radii[gear], dynamics.bearing_damping_ratio
    stiffness = getattr(dynamics, f"{name}_bearing_stiffness_N_um") or ()
    damping = getattr(dynamics, f"{name}_bearing_damping_N_s_mm")
    tilting = getattr(dynamics, f"{name}_tilting_stiffness_kNm_rad") or ()
    supports = []
    for direction in range(MOVING[dynamics.degrees_of_freedom]):
        if direction < len(stiffness):
            mass, spring = KG * inertia.mass_kg, N_UM * stiffness[direction]
        elif direction >= 3 and tilting:
            mass = KG_M2 * inertia.tilting_kg_m2 / radius**2
            spring = KNM_RAD * tilting[direction - 3] / radius**2
        else:
            continue
        damper = 2.0 * ratio * math.sqrt(spring * mass)
        if damping is not None and direction < len(damping):
            damper = damping[direction]
        supports.append(Support(gear, direction, mass, spring, damper, float(levers[gear, direction])))
    return supports
