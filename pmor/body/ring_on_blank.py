"""A ring of sectors on the interface of a blank: equation (2) of `pmor.body.blank`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from pmor.core.arrays import ComplexArray, FloatArray


class BlankResponse(NamedTuple):
    """A blank at the interface's columns of nodes, and where it is loaded within.

    Over radial, circumferential and axial amplitudes of equation (1), column by column, for the energy over a
    revolution; of harmonic -n all of it is conjugate.

    Attributes
    ----------
    stiffness : ndarray, shape (largest + 1, 3 l, 3 l)
        N/mm.
    passed_on : ndarray, shape (N + 1, 3 l, c)
        Forces on the interface, held, under unit loads within, of harmonics 0 ... N.
    flexibility : ndarray, shape (N + 1, c, c)
        Displacement where they are under these loads, the interface held, mm/N.
    shown : ndarray, shape (largest + 1, 3 l, g)
        Transposed and conjugate: what gauges show by these amplitudes, MPa/mm.
    """

    stiffness: ComplexArray
    passed_on: ComplexArray
    flexibility: ComplexArray
    shown: ComplexArray = np.zeros((0, 0, 0), dtype=complex)


class Ring(NamedTuple):
    """What loads on the faces of sector 0 do.

    Attributes
    ----------
    moved : ndarray, shape (2 neighbours + 1, 2 s + p 3 l, m)
        Displacement of the faces of sectors -neighbours ... neighbours, mm.
    felt : ndarray, shape (2 N + 1, c, m)
        Amplitudes of harmonics -N ... N where the blank is loaded within.
    flexibility : ndarray, shape (2 N + 1, c, 2 N + 1, c)
        The same under unit loads there, mm/N.
    far : ndarray, shape (2 reach + 1, 2 s + p 3 l, q)
        Displacement of the faces of further sectors under patterns of loads, mm.
    pressed : ndarray, shape (2 s + p 3 l, 2 N + 1, c)
        Of the faces of sector 0 under unit loads within; of no loads where no patterns were asked for.
    added : ndarray, shape (k,)
        By the last harmonics to how far each of k sums of the loads moves itself, mm/N: equation (3).
    shown : ndarray, shape (2 largest + 1, g, q)
        Amplitudes of what gauges show under patterns of loads, MPa.
    """

    moved: FloatArray
    felt: ComplexArray
    flexibility: ComplexArray
    far: FloatArray
    pressed: ComplexArray
    added: FloatArray
    shown: ComplexArray


def ring_on_blank(
    stiffness: FloatArray, sides: int, teeth: int, shares: ComplexArray, blank: BlankResponse, load: FloatArray,
    neighbours: int, lines: FloatArray, patterns: FloatArray | None = None, reach: int = 0,
) -> Ring:  # fmt: skip
    """Return how the faces of sectors, and the blank within, move under loads on the faces of sector 0: equation (2).

    Parameters
    ----------
    stiffness, load : ndarray
        As in `Blank.ring`.
    sides : int
        s.
    teeth : int
        Negative where sectors follow each other clockwise.
    shares : ndarray, shape (p, 2 largest + 1)
        Of the interface's functions in the harmonics.
    neighbours : int
        Sectors to cover, on either side.
    lines, patterns, reach
        As in `Blank.ring`.
    """
    largest, loads, per = len(blank.stiffness) - 1, load.shape[1], blank.stiffness.shape[1]
    within, count = max(len(blank.flexibility) - 1, 0), blank.passed_on.shape[2]
    left, right, below = slice(0, sides), slice(sides, 2 * sides), slice(2 * sides, None)
    sector = np.arange(-neighbours, neighbours + 1)[:, None, None]
    face_compliance = np.zeros((2 * neighbours + 1, *load.shape))
    felt = np.zeros((2 * within + 1, count, loads), dtype=complex)
    flexibility = np.zeros((2 * within + 1, count, 2 * within + 1, count), dtype=complex)
    further = np.arange(-reach, reach + 1)[:, None, None]
    far = np.zeros((2 * reach + 1, len(load), 0 if patterns is None else patterns.shape[1]))
    pressed = np.zeros((len(load), 2 * within + 1, 0 if patterns is None else count), dtype=complex)
    shown = np.zeros((2 * largest + 1, blank.shown.shape[2], far.shape[2]), dtype=complex)
    added, sectors = np.zeros(lines.shape[1]), abs(teeth)
    for h in range(sectors // 2 + 1):
        turn = np.exp(-2j * np.pi * h / teeth)
        n = np.arange(-largest, largest + 1)
        own = n[(n - h) % sectors == 0]
        at = shares[:, own + largest].conj().T
        # Rows, then columns, of the interface's functions to harmonics; of both side faces to the left one.
        half = np.concatenate([stiffness[left] + np.conj(turn) * stiffness[right], _gathered(at, stiffness[below])])
        half = half.conj().T
        matrix = np.concatenate([half[left] + np.conj(turn) * half[right], _gathered(at, half[below])])
        loaded = np.concatenate([load[left] + np.conj(turn) * load[right], _gathered(at, load[below])])
        places = {harmonic: slice(sides + per * j, sides + per * (j + 1)) for j, harmonic in enumerate(own.tolist())}
        for harmonic, place in places.items():
            matrix[place, place] += _of(blank.stiffness, harmonic) / sectors
        inner = [harmonic for harmonic in places if abs(harmonic) <= within and count]
        passed = np.zeros((len(matrix), count * len(inner)), dtype=complex)
        for j, harmonic in enumerate(inner):
            passed[places[harmonic], count * j : count * (j + 1)] = _of(blank.passed_on, harmonic)
        rows = np.arange(len(matrix))
        last = np.concatenate([rows[place] for n, place in places.items() if abs(n) > largest - sectors])
        held = np.zeros((len(matrix), len(last)))
        held[last, np.arange(len(last))] = 1.0
        both = np.hstack([loaded, passed, held])
        moved = la.solve(matrix, both, assume_a="pos", overwrite_a=True, overwrite_b=True, check_finite=False)
        moved, eased = moved[:, : -len(last)], moved[last, -len(last) :]
        own_part = moved[last, :loads] @ lines
        back = passed.conj().T @ moved / sectors
        for j, harmonic in enumerate(inner):
            rows = back[count * j : count * (j + 1)]
            felt[within + harmonic], felt[within - harmonic] = rows[:, :loads], rows[:, :loads].conj()
            for k, other in enumerate(inner):
                block = rows[:, loads + count * k : loads + count * (k + 1)]
                block = block + (_of(blank.flexibility, harmonic) if k == j else 0.0)
                flexibility[within + harmonic, :, within + other] = block
                flexibility[within - harmonic, :, within - other] = block.conj()
        faces = np.concatenate([moved[left], turn * moved[left], _gathered(at.conj().T, moved[sides:])])
        weight = (1.0 if h in (0, sectors / 2) else 2.0) / sectors
        added += weight * np.einsum("ik,ik->k", own_part.conj(), la.solve(eased, own_part, assume_a="pos")).real
        turned = weight * np.conj(turn) ** sector
        face_compliance += turned.real * faces[:, :loads].real - turned.imag * faces[:, :loads].imag
        if patterns is not None:
            turned, shaped = weight * np.conj(turn) ** further, faces[:, :loads] @ patterns
            far += turned.real * shaped.real - turned.imag * shaped.imag
            for harmonic, place in places.items() if blank.shown.size else ():
                told = _of(blank.shown, harmonic).conj().T @ moved[place, :loads] @ patterns / sectors
                shown[largest + harmonic], shown[largest - harmonic] = told, told.conj()
            for j, harmonic in enumerate(inner):
                under = faces[:, loads + count * j : loads + count * (j + 1)] / sectors
                pressed[:, within + harmonic], pressed[:, within - harmonic] = under, under.conj()
    return Ring(face_compliance, felt, flexibility, far, pressed, added, shown)


def _of(amplitudes: ComplexArray, harmonic: int) -> ComplexArray:
    """Entry of a harmonic: of negative ones that of the positive one, conjugate."""
    return np.asarray(amplitudes[harmonic] if harmonic >= 0 else amplitudes[-harmonic].conj())


def _gathered(shares: ComplexArray, rows: FloatArray | ComplexArray) -> ComplexArray:
    """Sums of blocks of rows by shares (to, from)."""
    blocks = rows.reshape(shares.shape[1], -1)
    return np.asarray(shares @ blocks).reshape(-1, rows.shape[1])
