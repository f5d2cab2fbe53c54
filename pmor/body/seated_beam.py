"""A beam on its seats, bent in one plane: how it gives way to loads, and how it follows seats that move.

Displacements are deflection and slope, loads force and moment, at places along the axis. The beam is exact
(`pmor.body.beam`); a seat holds it across and against tilting, each rigidly, by a spring, or not at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pmor.body.beam import NODE, Beam
from pmor.core.arrays import FloatArray

# Deflection along y and turn about z, of the displacements of a node.
PLANE = (1, 5)


class BeamSeat(NamedTuple):
    """What holds a beam: its place along it, mm, and stiffness across and against tilting, N/mm and N mm/rad.

    A stiffness of infinity is rigid, one of 0 none.
    """

    place: float
    radial: float
    tilt: float


class SeatedBeam(NamedTuple):
    """A beam on m seats, at n places.

    Attributes
    ----------
    flexibility : ndarray, shape (2 n, 2 n)
        Deflection and slope of place by place under unit forces and moments, mm/N and so on.
    carried : ndarray, shape (2 n, 2 m)
        The same by unit displacements and tilts of the seats.
    stiffness : ndarray, shape (2 m, 2 m)
        Forces and moments that such displacements take at the seats, N/mm and so on.
    """

    flexibility: FloatArray
    carried: FloatArray
    stiffness: FloatArray


def seated_beam(beam: Beam, seats: Sequence[BeamSeat], places: Sequence[float]) -> SeatedBeam | None:
    """Return how a beam on its seats gives way at places; None where nothing holds it.

    Parameters
    ----------
    places : sequence of float, length n
        Along the beam, mm; stations of it, as those of the seats are.
    """
    if sum((seat.radial > 0.0) + (seat.tilt > 0.0) for seat in seats) < 2:
        return None
    rows = (NODE * np.arange(len(beam.stations))[:, None] + PLANE).ravel()
    stiffness = beam.stiffness()[np.ix_(rows, rows)]
    size = len(rows)
    springs = np.array([[seat.radial, seat.tilt] for seat in seats]).ravel()
    at = np.concatenate([2 * beam.node_at(seat.place) + np.arange(2) for seat in seats])
    rigid = np.isinf(springs)
    held, moves = at[rigid], np.setdiff1d(np.arange(size), at[rigid])
    yielding = np.where(rigid, 0.0, springs)
    stiffness[at, at] += yielding
    moved = np.zeros((size, 2 * len(seats)))
    moved[held, np.flatnonzero(rigid)] = 1.0
    forces = -stiffness @ moved
    forces[at, np.arange(len(at))] += yielding
    solved = np.linalg.inv(stiffness[np.ix_(moves, moves)])
    moved[moves] = solved @ forces[moves]
    apart = moved[at] - np.eye(len(at))
    own = moved.T @ (stiffness @ moved) - moved[at].T @ (yielding[:, None] * moved[at])
    own += apart.T @ (yielding[:, None] * apart)
    found = np.zeros((size, size))
    found[np.ix_(moves, moves)] = solved
    told = np.concatenate([2 * beam.node_at(place) + np.arange(2) for place in places])
    return SeatedBeam(found[np.ix_(told, told)], moved[told], own)
