"""Natural frequencies of geared machines against published ones: a rotor of two shafts, a pair on springs."""

import math

import numpy as np
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from pmor.body.beam import NODE, Beam, CircularSection, ShaftMaterial
from pmor.dynamics.gear_model import natural_modes
from pmor.dynamics.oscillator import Oscillator
from pmor.dynamics.whine.moving import disc_matrices
from pmor.gear.inertia import Inertia

# Of a shaft's modulus and shear modulus, 207 and 79.5 GPa; t/mm3.
STEEL, DENSITY = ShaftMaterial(207e3, 207.0 / 79.5 / 2.0 - 1.0), 7.8e-9
PRESSURE_ANGLE = math.radians(22.5)


def shaft(lengths_m, diameters_m, discs, bearings, parts):
    """Stiffness and mass of a shaft, so many elements a section, with discs (kg, kg m2) and bearings (N/m) at nodes."""
    borders = np.concatenate([[0.0], np.cumsum(lengths_m)]) * 1e3
    pieces = [np.linspace(*ends, parts, endpoint=False) for ends in zip(borders[:-1], borders[1:], strict=True)]
    sections = [CircularSection(1e3 * diameter) for diameter in diameters_m for _ in range(parts)]
    beam = Beam(np.concatenate([*pieces, borders[-1:]]), sections, STEEL)
    stiffness, mass = beam.stiffness(), beam.inertia(DENSITY).mass
    for node, kg, tilting, polar in discs:
        rows = slice(NODE * node * parts, NODE * node * parts + NODE)
        mass[rows, rows] += disc_matrices(Inertia(kg, polar, tilting), 0.0)[0]
    for node, *along in bearings:
        for direction, spring in enumerate(along, start=1):
            stiffness[NODE * node * parts + direction, NODE * node * parts + direction] += 1e-3 * spring
    return stiffness, mass


def geared_rotor(parts, mesh):
    """Frequencies of the rotor of Rao, and of Friswell, Penny, Garvey & Lees, with a mesh stiffness in N/m."""
    discs = ((1, 525.7, 16.1, 32.2), (2, 116.04, 3.115, 6.23), (4, 726.4, 56.95, 113.9))
    first = shaft([0.1, 4.24, 1.16, 0.3], [0.3, 0.3, 0.22, 0.22], discs,
                  ((0, 183.9e6, 200.4e6), (3, 183.9e6, 200.4e6)), parts)  # fmt: skip
    second = shaft([0.3, 5.0, 0.1], [0.15] * 3, ((0, 5.0, 0.002, 0.004), (2, 7.45, 0.0745, 0.149)),
                   ((1, 10.1e6, 41.6e6), (3, 10.1e6, 41.6e6)), parts)  # fmt: skip
    size = len(first[0])
    stiffness, mass = (np.block([[one, np.zeros((size, len(other)))], [np.zeros((len(other), size)), other]])
                       for one, other in zip(first, second, strict=True))  # fmt: skip
    row, wheel = np.zeros(len(mass)), NODE * 4 * parts
    row[[wheel + 1, wheel + 2, wheel + 3]] = math.sin(PRESSURE_ANGLE), math.cos(PRESSURE_ANGLE), 508.6
    row[[size + 1, size + 2, size + 3]] = -math.sin(PRESSURE_ANGLE), -math.cos(PRESSURE_ANGLE), 35.67
    stiffness += 1e-3 * mesh * np.outer(row, row)
    held = np.arange(len(mass)) % NODE != 0  # along the axis
    square = eigh(stiffness[np.ix_(held, held)], mass[np.ix_(held, held)], eigvals_only=True, subset_by_index=(1, 8))
    return np.sqrt(square) / (2.0 * np.pi)


def test_a_geared_rotor_of_many_elements_has_the_converged_frequencies():
    """Those of an independent computation, and with one element a section those that ROSS gives, within 0.1 %."""
    converged = [10.828, 11.241, 17.489, 17.594, 23.509, 35.008, 43.121, 51.613]
    assert_allclose(geared_rotor(16, 1e8), converged, rtol=1e-3)
    by_ross = [11.716, 12.207, 17.833, 17.946, 23.958, 37.709, 50.840, 52.536]
    assert_allclose(geared_rotor(1, 1e8), by_ross, rtol=1e-3)


def test_a_spur_pair_on_springs_has_the_frequencies_of_yi():
    """Yi 2019: two gears of 20 teeth, module 10, on bearings of 1e8 N/m; 482.85, 620.92 three times, 3238.66 Hz."""
    angle, radius, mesh, bearing = math.radians(20.0), 100.0 * math.cos(math.radians(20.0)), 5.17925e5, 1e5
    mass, inertia = 6.57e-3, 0.036528e3
    own = [-math.cos(angle), math.sin(angle)]
    lever = np.array([1.0, *own, *(-value for value in own)])
    springs = np.diag([0.0, *[bearing] * 4])
    masses = np.diag([inertia / (2.0 * radius**2), *[mass] * 4])
    modes = natural_modes(Oscillator(masses, np.zeros((5, 5)), springs, lever, np.zeros(5)), mesh)
    expected = [482.85, 620.92, 620.92, 620.92, 3238.66]
    assert_allclose(modes.frequency / (2.0 * np.pi), expected, rtol=1e-4)
