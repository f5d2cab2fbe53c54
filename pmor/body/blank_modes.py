"""Natural modes of a gear on a light blank, by nodal diameters: rim, web and hub of `pmor.fe.blank_section` with mass.

Of a ring of z equal sectors on a body of revolution the harmonics n + j z alone feel each other. Those with waves as
short as a tooth die within the rim, and their mass counts for nothing. With U_n their amplitudes at the interface,

    K = K_n + z T_n^H (S + K_v / z) T_n,    M = M_n + z T_n^H M_s T_n,    T_n = (-(S + K_v / z)_vv^-1 S_vU, 1),     (1)

v all others, of sectors and interface, with the blank's K_v at rest, and with S of a sector whose side faces follow
each other by e^(i n 2 pi / z) (Guyan, AIAA J. 3 (1965) 380). Teeth are much stiffer than the blank: the frequencies are
a little too high. *Measured*, wheel d 73 x 10 mm with a web of 2.5 mm: if K_v is rigid, that of n = 2 is 1 % too high.

The displacement of a mode is Re((a - i b) phi e^(i n theta)): two modes, a and b, of each n above 0. Where the bore is
held they are beside what the hub does as a rigid body (Craig & Bampton, AIAA J. 6 (1968) 1313), with which those of 0
and 1 alone share mass.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.linalg import block_diag, cho_factor, cho_solve
from scipy.sparse.linalg import eigsh, splu

from pmor.body.blank import Blank, blank_response, cylindrical, interpolation, signed_teeth
from pmor.core.arrays import ComplexArray, FloatArray, IntArray
from pmor.fe.assembly import added_up, degrees_of_freedom
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.condensation import CondensedSector, back_substitute, condense_loads, condense_sector
from pmor.fe.element import QUADRATIC_NODES
from pmor.fe.hexahedron import element_mass
from pmor.fe.section_matrices import section_matrices
from pmor.fe.sector import SectorMesh

# Nodal diameters that are looked at.
DIAMETERS = range(8)
# Of the square of the highest frequency: below zero, where modes are looked for around it; rigid ones are below it.
SHIFT, RIGID = 1e-2, 1e-6
# Modes of a harmonic that are looked for at first.
AT_FIRST = 6
# Of the largest compliance: functions of the sector that are the same within.
ALIKE = 1e-9
# Directions of a rigid body, along and about x, y and z.
HUB = 6


@dataclass(frozen=True)
class BlankModes:
    """Modes of a gear with n nodal diameters, m of them, rising in each n.

    Parameters
    ----------
    diameters : ndarray of int, shape (m,)
        n; of those above 0 each stands for two modes.
    square : ndarray, shape (m,)
        Angular frequencies, squared; modal masses are 1 t.
    flank : ndarray of complex, shape (3 f, m)
        Of the nodes of the flank of tooth 0, in its frame.
    inertia : ndarray, shape (m, 2, 6)
        Mass that amplitudes a and b share with motions of the hub along and about x, y and z, z = 0; of unit modal
        mass: t^(1/2), t^(1/2) mm.
    axial : ndarray, shape (m,)
        Share of the motion along the axis in the kinetic energy.
    coriolis : ndarray, shape (m,)
        c: at W about z amplitudes in the gear's own frame have the forces -2 c W (b', -a') by each other's velocity, of
        unit modal mass; of thin rings in their plane -2 n / (n^2 + 1) (Bryan, Proc. Camb. Phil. Soc. 7 (1890) 101).
    """

    diameters: IntArray
    square: FloatArray
    flank: ComplexArray
    inertia: FloatArray
    axial: FloatArray
    coriolis: FloatArray

    @property
    def frequency_Hz(self) -> FloatArray:
        """Natural frequencies, (m,)."""
        return np.asarray(np.sqrt(self.square) / (2.0 * math.pi))


@dataclass(frozen=True)
class _RingOnHarmonic:
    """All sectors over the amplitudes of the interface's columns of nodes, and one of them in its own frame."""

    stiffness: ComplexArray
    mass: ComplexArray
    moved: ComplexArray
    by_mass: ComplexArray


def blank_modes(
    mesh: SectorMesh, blank: Blank, density: float, element: str, highest_Hz: float, held: bool = True,
    diameters: Sequence[int] = DIAMETERS,
) -> BlankModes:  # fmt: skip
    """Return the modes of a gear up to a frequency.

    Parameters
    ----------
    mesh : SectorMesh
        Over the whole width.
    blank : Blank
        Of revolution.
    density : float
        t/mm^3.
    element : {"hex8", "hex8i", "hex20"}
        Of the sectors.
    held : bool
        At its bore; else the gear is free, and its motions as a rigid body are left out.
    """
    if not rings(blank) or mesh.mirrored:
        raise ValueError("modes are those of a whole blank of revolution by its dimensions")
    material, teeth = (blank.youngs_modulus, blank.poisson_ratio), abs(signed_teeth(mesh))
    elements = mesh.elements[:, :QUADRATIC_NODES]
    # Flanks are free.
    sector = condense_sector(replace(mesh, flank=mesh.flank[:0]), *material, element, keep_rows=True)
    mass = sp.csr_array(sp.kron(added_up(element_mass(mesh.nodes, elements, density), elements, len(mesh.nodes)),
                                np.eye(3)))  # fmt: skip
    section = section_matrices(blank.blocks, *material, density, mesh.twist_per_length)
    columns, at_rest = 3 * len(mesh.z), blank_response(mesh, blank).stiffness
    # The outermost row of nodes follows the interface's columns, the others are free, or held.
    outer = degrees_of_freedom(section.last)
    still = np.union1d(outer, section.held(blank.held)) if held and blank.bedding is None else outer
    own = np.setdiff1d(np.arange(3 * len(section.nodes)), still)
    shares = np.kron(interpolation(mesh.z, mesh.order, section.nodes[section.last, 1]), np.eye(3))
    bedding = section.on_bedding(blank.bedding) if held and blank.bedding is not None else None
    found, onto = list[BlankModes](), completion(mesh, mesh.flank)
    for n in diameters:
        ring = _ring_on(mesh, sector, mass, at_rest, n)
        to = sp.lil_array((3 * len(section.nodes), len(own) + len(ring.mass)))
        to[own, np.arange(len(own))] = 1.0
        to[outer[:, None], len(own) + np.arange(columns)] = shares
        to, half, stiffness = to.tocsr(), 0.5 if n else 1.0, section.of_harmonic(n)
        stiffness = stiffness if bedding is None else stiffness + bedding
        both = [to.T @ matrix @ to + sp.block_diag([sp.csr_array((len(own), len(own))), part])
                for matrix, part in ((stiffness, ring.stiffness), (section.mass, ring.mass))]  # fmt: skip
        square, shape = _lowest(both[0], both[1], (2.0 * math.pi * highest_Hz) ** 2)
        shape = shape / np.sqrt(half * np.einsum("ik,ik->k", shape.conj(), both[1] @ shape).real)
        there = slice(len(own) + columns)
        if n == 0:  # of a real displacement U, i V, W
            turned = shape[there] * np.tile([1.0, 1.0j, 1.0], there.stop // 3)[:, None]
            largest = turned[abs(turned).argmax(axis=0), np.arange(len(square))]
            shape = shape * (abs(largest) / largest)
        sectors = shape[len(own) :]
        axial = half * ((both[1] @ shape).conj() * shape)[there][2::3].sum(axis=0).real
        flank = onto @ ring.moved[degrees_of_freedom(nodes_of_elements(mesh, mesh.flank))] @ sectors
        rigid, moved = _rigid(n, section.nodes, mesh.twist_per_length), to @ shape
        below_mass, sector_mass = section.mass @ moved, ring.by_mass @ sectors
        inertia = half * (rigid.conj().T @ below_mass + teeth * _rigid_sector(mesh, n).conj().T @ sector_mass)
        crossed = -1j * (moved[::3].conj() * below_mass[1::3] + moved[1::3].conj() * below_mass[::3]).sum(axis=0)
        moved = (ring.moved @ sectors).conj()
        crossed += teeth * (moved[1::3] * sector_mass[::3] - moved[::3] * sector_mass[1::3]).sum(axis=0)
        found.append(BlankModes(
            np.full(len(square), n), square, flank, np.stack([inertia.real.T, inertia.imag.T], axis=1), axial,
            half * crossed.imag,
        ))  # fmt: skip
    return BlankModes(*(np.concatenate([getattr(one, name) for one in found], axis=-1 if name == "flank" else 0)
                        for name in ("diameters", "square", "flank", "inertia", "axial", "coriolis")))  # fmt: skip


def rings(blank: Blank) -> bool:
    """Return whether the modes of a blank are found: of revolution, by its dimensions, on its bore or a bedding."""
    return blank.web is None and blank.body is None and blank.lugs is None and not blank.core


def _lowest(stiffness: sp.csr_array, mass: sp.csr_array, most: float) -> tuple[FloatArray, ComplexArray]:
    """Squares of the frequencies up to a limit, rigid motions left out, and shapes."""
    size, count = stiffness.shape[0], AT_FIRST
    start = np.random.default_rng(40).standard_normal(size)
    shift = -SHIFT * most
    factor = splu((stiffness - shift * mass).tocsc().astype(complex), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0)
    inverse = sp.linalg.LinearOperator((size, size), matvec=factor.solve, dtype=complex)
    while True:
        square, shape = eigsh(stiffness.astype(complex), min(count, size - 2), mass.astype(complex), sigma=shift,
                              OPinv=inverse, v0=start.astype(complex))  # fmt: skip
        if square.max() > most or count >= size - 2:
            break
        count *= 2
    order = np.argsort(square)
    order = order[(square[order] <= most) & (square[order] > RIGID * most)]
    return square[order], shape[:, order]


def _ring_on(
    mesh: SectorMesh, sector: CondensedSector, mass: sp.csr_array, at_rest: ComplexArray, n: int
) -> _RingOnHarmonic:
    """Sectors on harmonic n of the interface, and on those that it brings along: equation (1)."""
    layers, teeth = len(mesh.z), signed_teeth(mesh)
    pitch = 2.0 * math.pi / teeth
    left, right, interface = (part[::3] // 3 for part in (sector.left, sector.right, sector.interface))
    frames = cylindrical(mesh, np.arange(len(mesh.nodes))).transpose(0, 2, 1)
    angle, layer = np.divmod(np.flatnonzero(np.isin(mesh.bore, interface)), layers)
    theta, count = pitch * (0.5 - angle / (len(mesh.bore) // layers - 1)), abs(teeth)
    most = (len(at_rest) - 1 - n) // count
    short = [n + j * count for j in range(-most, most + 1) if j]
    faces, three = len(left), np.arange(3)
    parts = [(np.arange(faces), frames[left]), (np.arange(faces), frames[right] * np.exp(-1j * n * pitch))]
    to = np.zeros((len(sector.retained) // 3, 3, faces + layers * (len(short) + 1), 3), dtype=complex)
    first = 0
    for follows, block in parts:
        rows = np.arange(first, first + len(follows))
        to[rows[:, None, None], three[:, None], follows[:, None, None], three] = block
        first += len(follows)
    rows = np.arange(first, first + len(interface))
    for place, harmonic in enumerate([*short, n]):
        parted = np.array([1.0, 1j if harmonic == n else 1.0, 1.0]) * np.exp(1j * harmonic * theta)[:, None]
        follows = faces + layers * place + layer
        to[rows[:, None, None], three[:, None], follows[:, None, None], three] = frames[interface] * parted[:, None, :]
    every = to.reshape(len(sector.retained), -1)
    matrix = every.conj().T @ _complex(sector.stiffness @ _columns(every))
    free = every.shape[1] - 3 * layers
    for place, harmonic in enumerate(short):
        own = slice(3 * (faces + layers * place), 3 * (faces + layers * (place + 1)))
        matrix[own, own] += (at_rest[harmonic] if harmonic > 0 else at_rest[-harmonic].conj()) / count
    factor, size = cho_factor(matrix[:free, :free]), 3 * len(mesh.nodes)
    brought = -cho_solve(factor, matrix[:free, free:])
    at_rest = matrix[free:, free:] + matrix[free:, :free] @ brought
    moved = _within(sector, every[:, free:] + every[:, :free] @ brought, size)
    # Under the forces by their mass, the interface held.
    pushed = mass @ _columns(moved)
    condensed, forward = condense_loads(sector, pushed)
    own = every[:, :free] @ cho_solve(factor, every[:, :free].conj().T @ _complex(condensed))
    second = _within(sector, own, size, forward)
    gives, directions = np.linalg.eigh(_complex(pushed).conj().T @ second)
    kept = gives > ALIKE * gives[-1]
    second = second @ (directions[:, kept] / np.sqrt(gives[kept]))
    every_moved = np.hstack([moved, second])
    by_mass = np.hstack([_complex(pushed), _complex(mass @ _columns(second))])
    whole = block_diag(0.5 * (at_rest + at_rest.conj().T), np.eye(second.shape[1]))
    return _RingOnHarmonic(count * whole, np.asarray(count * every_moved.conj().T @ by_mass), every_moved, by_mass)


def _within(
    sector: CondensedSector, retained: ComplexArray, size: int, forward: FloatArray | None = None
) -> ComplexArray:
    return _complex(back_substitute(sector, _columns(retained), size, forward))


def _columns(values: ComplexArray) -> FloatArray:
    return np.hstack([values.real, values.imag])


def _complex(columns: FloatArray) -> ComplexArray:
    half = columns.shape[1] // 2
    return np.asarray(columns[:, :half] + 1j * columns[:, half:], dtype=np.complex128)


def _rigid(n: int, nodes: FloatArray, twist: float) -> ComplexArray:
    """Amplitudes U, V, W of unit motions as a rigid body along and about x, y, z, (3 m, 6); theta counts from y."""
    found = np.zeros((len(nodes), 3, HUB), dtype=complex)
    r, z = nodes.T
    turned = np.exp(1j * n * twist * z)
    if n == 0:
        found[:, 2, 2], found[:, 1, 5] = 1.0, -1j * r
    if n == 1:
        for along, about, phase, tilt in ((0, 4, 1j, 1j), (1, 3, 1.0, -1.0)):
            found[:, :2, along] = phase * turned[:, None]
            found[:, :2, about], found[:, 2, about] = tilt * (z * turned)[:, None], -tilt * r * turned
    return np.asarray(found.reshape(-1, HUB))


def _rigid_sector(mesh: SectorMesh, n: int) -> ComplexArray:
    """The same of the nodes of sector 0, along x, y and z, (3 N, 6)."""
    # Teeth of a ring are drawn on the other side.
    x, y = math.copysign(1.0, mesh.angular_pitch) * mesh.nodes[:, :2].T
    z = mesh.nodes[:, 2]
    amplitudes = _rigid(n, np.column_stack([np.hypot(x, y), z]), 0.0).reshape(-1, 3, HUB)
    around = np.array([1.0, 1j, 1.0]) * np.exp(1j * n * np.arctan2(-x, y))[:, None]
    frames = cylindrical(mesh, np.arange(len(mesh.nodes))).transpose(0, 2, 1)
    return np.asarray((frames @ (amplitudes * around[..., None])).reshape(-1, HUB))
