"""What the blank of a gear adds to its compliance from tooth to tooth: holes, which turn with the teeth.

A gear of equal sectors on a blank of revolution is cyclic. Holes make its teeth differ: by a part of low rank,

    C_ik = C_cyclic(i - k) + B S_ik B^T,                  D = D_cyclic + L S L^T.                           (A)

B holds the q patterns of forces on a flank that the holes feel, S_ik how they then move the patterns of another tooth.
S repeats after as many teeth as the blank does. L has one row for each placed section: the gradient of its gap times B.
It is symmetric and not negative: D stays symmetric and positive definite. What stands still while the gears turn, such
as shafts, bearings and housing, is no part of it: see `hubs` of `pmor.line.layered_pair.LayeredPair`.

With Y the amplitudes that the circles of the web have under forces on the flank of tooth 0, without holes, Z those
under unit loads on these circles, and K what the holes take off the web's stiffness (`pmor.fe.perforated_web`),

    C_ik - C_cyclic(i - k) = Y_i^H M Y_k,    M = -K (1 + Z K)^-1,    Y_k = Y e^(-2 pi i n k / z),                    (B)

after Sherman, Morrison and Woodbury. Lugs that hold a ring are such a change too: Y are the forces on its outside while
all of it is held, M how it moves under forces there while the lugs alone are (`pmor.fe.lugs`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.linalg as la

from pmor.body.far_compliance import ROWS, section_shares
from pmor.core.arrays import ComplexArray, FloatArray, IntArray
from pmor.fe.lugs import Lugs

# What makes teeth differ: what holes take off a stiffness, or lugs.
Change = ComplexArray | Lugs

# Patterns of forces that are felt less at the circles, of the one that is felt most there, are left out. Of the others
# as many are kept as tell how any tooth moves by holes to this share of the largest such movement. *Measured*, wheel of
# 50 teeth with 8 or 5 holes: 8 patterns, whose STE is that of 16 to 1e-8.
LEAST_FELT, LEAST_MOVED = 1e-9, 1e-4


@dataclass(frozen=True)
class Support:
    """The part of low rank of a gear's compliance.

    Parameters
    ----------
    rows : ndarray, shape (n, q)
        B: patterns over the unknowns of a flank, in the tooth's frame.
    compliance : ndarray, shape (p, neighbours + 1, q, q)
        S: movement of the patterns of tooth i + k under forces on tooth i, mm/N, for teeth i = 0 ... p - 1, after which
        it repeats, and k = 0 ... neighbours.
    backs : ndarray, shape (n, q), or None
        The same patterns over the unknowns of the other flank of the tooth, in its image, where it carries.
    """

    rows: FloatArray
    compliance: FloatArray
    backs: FloatArray | None = None

    def between(self, moved: int, loaded: int) -> FloatArray:
        """Return S between two teeth, (q, q); teeth beyond the neighbours do not move."""
        if abs(moved - loaded) >= self.compliance.shape[1]:
            return np.zeros_like(self.compliance[0, 0])
        if moved >= loaded:
            return np.asarray(self.compliance[loaded % len(self.compliance), moved - loaded])
        return np.asarray(self.compliance[moved % len(self.compliance), loaded - moved].T)

    def of_teeth(self, moved: IntArray, loaded: IntArray, teeth: int) -> FloatArray:
        """Return S between teeth (A,) of a gear with so many, whose numbers go round, (A, q, q)."""
        period, covered = self.compliance.shape[:2]
        ahead, behind = (moved - loaded) % teeth, (loaded - moved) % teeth
        between = np.zeros((len(moved), *self.compliance.shape[2:]))
        near = ahead < covered
        between[near] = self.compliance[loaded[near] % period, ahead[near]]
        near = ~near & (behind < covered)
        between[near] = self.compliance[moved[near] % period, behind[near]].transpose(0, 2, 1)
        return between


def support_of_holes(
    felt: ComplexArray, flexibility: ComplexArray, softening: Change, teeth: int, holes: int, neighbours: int,
    reach: int | None = None,
) -> Support:  # fmt: skip
    """Return what holes add to the compliance of a gear: equation (B).

    Parameters
    ----------
    felt, teeth
        As in `support_of`.
    flexibility : ndarray, shape (2 N + 1, c, 2 N + 1, c)
        Z.
    softening : ndarray, shape ((2 N + 1) c, (2 N + 1) c), or Lugs
        K, or what M is taken from.
    teeth : int
        Negative where they follow each other clockwise.
    neighbours : int
        Teeth whose movement says which patterns are told.
    reach : int, optional
        Teeth that the compliance covers; by default the neighbours.
    """
    amplitudes = felt.reshape(-1, felt.shape[2])
    _, sizes, rows = np.linalg.svd(np.concatenate([amplitudes.real, amplitudes.imag]), full_matrices=False)
    patterns = rows[sizes > LEAST_FELT * sizes[0]].T
    period = abs(teeth) // math.gcd(teeth, holes)
    moved = _on_teeth(felt, patterns, teeth)
    forces = _of_loads(moved[:, :period], flexibility, softening)
    kept = _telling(_between_teeth(moved, forces, neighbours))
    reach = neighbours if reach is None else reach
    return Support(patterns @ kept, _between_teeth(moved @ kept, forces @ kept, reach))


def _between_teeth(moved: ComplexArray, forces: ComplexArray, reach: int) -> FloatArray:
    """S of patterns by their amplitudes Y_k (amplitudes, teeth, q) and the forces M Y_i (amplitudes, p, q)."""
    (_, teeth, count), period = moved.shape, forces.shape[1]
    between = np.empty((period, reach + 1, count, count))
    for i in range(period):
        for k in range(reach + 1):
            between[i, k] = (moved[:, (i + k) % teeth].conj().T @ forces[:, i]).real
    between[:, 0] = 0.5 * (between[:, 0] + between[:, 0].transpose(0, 2, 1))
    return between


def forces_of_holes(
    felt: ComplexArray, flexibility: ComplexArray, softening: Change, teeth: int, holes: int, patterns: FloatArray
) -> ComplexArray:
    """Return the forces M Y_i of equation (B) under patterns of forces on teeth i = 0 ... p - 1, N.

    Parameters
    ----------
    felt, flexibility, softening
        As in `support_of_holes`.
    patterns : ndarray, shape (n, q)

    Returns
    -------
    ndarray, shape ((2 N + 1) c, p, q)
    """
    return _of_loads(_on_unlike_teeth(felt, patterns, teeth, holes), flexibility, softening)


def moved_elsewhere(elsewhere: ComplexArray, forces: ComplexArray, teeth: int) -> FloatArray:
    """Return how far places of tooth i + k move by what makes teeth differ under loads on tooth i, (p, z, e, q), mm.

    Parameters
    ----------
    elsewhere : ndarray, shape (2 N + 1, c, e)
        Amplitudes under unit forces at these places of tooth 0.
    forces : ndarray, shape ((2 N + 1) c, p, q)
        As `forces_of_holes` gives them.
    teeth : int
        As in `support_of_holes`.
    """
    there, period = _on_teeth(elsewhere, np.eye(elsewhere.shape[2]), teeth), forces.shape[1]
    tooth = (np.arange(period)[:, None] + np.arange(abs(teeth))) % abs(teeth)
    return np.stack([
        np.einsum("ake,aq->keq", there[:, ks].conj(), forces[:, i], optimize=True).real for i, ks in enumerate(tooth)
    ])  # fmt: skip


def amplitudes_by_holes(
    felt: ComplexArray, flexibility: ComplexArray, softening: ComplexArray, teeth: int, holes: int, patterns: FloatArray
) -> ComplexArray:
    """Return the amplitudes (1 + Z K)^-1 Y_i of a web with its holes under patterns of forces on teeth 0 ... p - 1, mm.

    Parameters
    ----------
    felt, flexibility, softening
        As in `support_of_holes`.
    patterns : ndarray, shape (n, q)

    Returns
    -------
    ndarray, shape ((2 N + 1) c, p, q)
    """
    loaded = _on_unlike_teeth(felt, patterns, teeth, holes)
    return _eased(loaded.reshape(len(loaded), -1), flexibility, softening).reshape(loaded.shape)


def added_by_the_last(
    felt: ComplexArray, flexibility: ComplexArray, softening: Change, teeth: int, holes: int
) -> FloatArray:
    """Return what the last harmonics, one to a hole on either side, add to how far loads move themselves by holes.

    Parameters
    ----------
    felt, flexibility, softening
        As in `support_of_holes`, of k loads on a tooth.

    Returns
    -------
    ndarray, shape (k,)
        Mean over all teeth, mm/N.
    """
    assert not isinstance(softening, Lugs), "the harmonics of lugs are given"
    count, parts, loads = felt.shape
    harmonics = np.repeat(np.arange(count) - count // 2, parts)
    size, loaded = len(harmonics), _on_unlike_teeth(felt, np.eye(loads), teeth, holes)
    flexible, moved = flexibility.reshape(size, size), []
    for most in (harmonics[-1], harmonics[-1] - holes):
        own = np.flatnonzero(np.abs(harmonics) <= most)
        forces = _of_loads(loaded[own], flexible[own[:, None], own], softening[own[:, None], own])
        moved.append(np.einsum("itk,itk->tk", loaded[own].conj(), forces).real)
    return np.asarray((moved[0] - moved[1]).mean(axis=0))


def _on_unlike_teeth(felt: ComplexArray, patterns: FloatArray, teeth: int, holes: int) -> ComplexArray:
    """Those of teeth 0 ... p - 1, after which holes stand as before."""
    return _on_teeth(felt, patterns, teeth)[:, : abs(teeth) // math.gcd(teeth, holes)]


def _on_teeth(felt: ComplexArray, patterns: FloatArray, teeth: int) -> ComplexArray:
    """Amplitudes Y_k under patterns of forces, (amplitudes, teeth, patterns)."""
    harmonics = np.arange(len(felt)) - len(felt) // 2
    turned = np.exp(-2j * np.pi * np.outer(harmonics, np.arange(abs(teeth))) / teeth).repeat(felt.shape[1], axis=0)
    amplitudes = felt.reshape(-1, felt.shape[2]) @ patterns
    return np.asarray(amplitudes[:, None, :] * turned[:, :, None])


def _of_loads(amplitudes: ComplexArray, flexibility: ComplexArray, softening: Change) -> ComplexArray:
    """Forces M Y on the circles by amplitudes Y, (amplitudes, teeth, patterns)."""
    size = len(amplitudes)
    loaded = amplitudes.reshape(size, math.prod(amplitudes.shape[1:]))
    if isinstance(softening, Lugs):
        return softening.eased(-flexibility, loaded).reshape(amplitudes.shape)
    return np.asarray(-(softening @ _eased(loaded, flexibility, softening)).reshape(amplitudes.shape))


def _eased(loaded: ComplexArray, flexibility: ComplexArray, softening: ComplexArray) -> ComplexArray:
    size = len(loaded)
    matrix = np.eye(size) + flexibility.reshape(size, size) @ softening
    return np.asarray(la.solve(matrix, loaded, check_finite=False))


def _telling(compliance: FloatArray) -> FloatArray:
    """Patterns, in columns, that are enough of those of a compliance, (p, neighbours + 1, q, q)."""
    _, patterns = np.linalg.eigh(compliance[:, 0].mean(axis=0))
    ordered = patterns[:, ::-1].T @ compliance @ patterns[:, ::-1]
    count, largest = 1, np.abs(ordered).max(initial=0.0)
    while count < len(patterns):
        left_out = max(np.abs(ordered[..., count:, :]).max(), np.abs(ordered[..., count:]).max())
        if left_out <= LEAST_MOVED * largest:
            break
        count += 1
    return np.asarray(patterns[:, ::-1][:, :count])


def support_flexibility(
    support: Support, teeth: int, rows: Sequence[FloatArray], tooth: Sequence[IntArray]
) -> FloatArray:
    """Return L S L^T of placed sections on a gear, (A, N, N), mm/N.

    Parameters
    ----------
    teeth : int
        Of the gear.
    rows : ndarrays, shape (A, S, q)
        Of the sections of each of its loaded teeth, as `carried_rows` gives them: N sections in all.
    tooth : ndarrays of int, shape (A,)
        Its number.
    """
    ends = np.cumsum([0, *(of_tooth.shape[1] for of_tooth in rows)])
    parts = [slice(first, last) for first, last in pairwise(ends.tolist())]
    flexibility = np.zeros((len(tooth[0]), ends[-1], ends[-1]))
    for a, part in enumerate(parts):
        for b, other in enumerate(parts[: a + 1]):
            eased = support.of_teeth(tooth[a], tooth[b], teeth)
            if eased.any():
                block = rows[a] @ eased @ rows[b].transpose(0, 2, 1)
                flexibility[:, part, other] = block
                flexibility[:, other, part] = block.transpose(0, 2, 1)
    return flexibility


def carried_rows(
    shapes: FloatArray, carriers: tuple[IntArray, FloatArray], node_rows: int, row: IntArray, gradient: FloatArray
) -> FloatArray:
    """Return what a unit force in each placed section does to shapes of a flank.

    Parameters
    ----------
    shapes : ndarray, shape (n, r)
        Over the unknowns of the flank.
    carriers : (ndarray of int, shape (S,); ndarray, shape (S, b))
        First column of nodes that carries each section of the gear, and the shares of b columns from there on.
    node_rows : int
        Rows of nodes on the flank.
    row : ndarray of int, shape (A, N)
        First of the four rows of nodes that carry a section.
    gradient : ndarray, shape (A, N, 4 c)
        Gradient of the gap by the c components of displacement in these rows.

    Returns
    -------
    ndarray, shape (A, N, r)
    """
    section = np.arange(row.shape[1]) % len(carriers[0])
    carried = carried_shapes(shapes, carriers, node_rows, gradient.shape[2] // ROWS)
    by_node = carried[section[:, None], row[..., None] + np.arange(ROWS)].reshape(*gradient.shape, -1)
    return np.asarray(np.einsum("ing,ingr->inr", gradient, by_node))


def carried_shapes(shapes: FloatArray, carriers: tuple[IntArray, FloatArray], node_rows: int, parts: int) -> FloatArray:
    """Return shapes of a flank at the rows of nodes of each section, (S, rows, c, r), four rows at least.

    Parameters
    ----------
    shapes, carriers, node_rows
        As in `carried_rows`.
    parts : int
        c, components of displacement.
    """
    columns, rank = len(shapes) // (node_rows * parts), shapes.shape[1]
    nodes = shapes.reshape(node_rows, columns, parts, rank)
    carried = np.zeros((len(carriers[0]), max(node_rows, ROWS), parts, rank))
    carried[:, :node_rows] = np.tensordot(section_shares(*carriers, columns), nodes, axes=(1, 1))
    return carried
