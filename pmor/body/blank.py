"""Sectors that stand on a blank: the ring of teeth down into the rim, and below it rim, web and hub as one body.

Sectors end at a cylinder within the rim. The displacement of that interface is a sum of Fourier's harmonics over the
angle, times the sector's columns of nodes over the width,

    u(theta, z_l) = sum_n U_n(z_l) e^(i n (theta - tau z_l)),                                                        (1)

theta around the axis from the middle of tooth 0, tau the twist of the teeth along the axis. Of a ring of z equal
sectors the harmonics n = h + j z alone belong together, h = 0 ... z - 1; a blank of revolution couples none of them.
With S the stiffness of a sector that is condensed onto side faces and interface, E_h the values of its harmonics at the
interface's nodes, and K_n the blank's stiffness over a revolution (`pmor.fe.blank_section`),

    A_h = T_h^H S T_h + diag(0, K_n / z),    T_h (v, U) = (v, v e^(-2 pi i h / z), E_h U),                           (2)

v the displacement of the left side face. So the gear remains cyclic, and its compliance takes one inverse for each h.
Harmonics die within a depth of r / n on either side of the interface. *Measured*, 50 teeth, interface 1 module below
the root circle: a flank's own compliance with n up to 1.5 z is 6e-5 too low, to 2.5 z 2e-7; at half a module 1.8e-5 and
1.5e-6 with 2.5 z and 3.5 z. As many are taken as it needs for the last z on either side to add less than `LEFT_OUT` to
how far a line load on the flank moves itself,

    y^H ((A_h^-1)_tt)^-1 y / z, summed over h,                                                                     (3)

t their rows, y what they move by: those that are left out, each z of which adds less than half of the z before, then
add less in all. So much has the error bar of the mesh for them (`pmor_online.mesh_error`).

Of a gear of one piece with its shaft the blank goes on to the axis, and what is held is the mean motion of its bore as
a rigid body: displacements are those beside it, and the shaft's may be added to them (`pmor.line.hubs`).

Of a web with holes the same blank is taken without them. What they change is found from the amplitudes where the web
meets hub and rim, under loads on a flank and under loads there (`Ring`, `pmor.body.support`). A body that is brought as
a mesh (`pmor.fe.body_condensation`) is one of revolution too, K_nn, and what couples its harmonics is such a change, at
the interface itself. Harmonics that its mesh does not see are those of a solid disc, as they die within the rim.

The rim around an internal gear is such a blank too, outside of the sectors. On an elastic bedding all around it is one
of revolution. With lugs all amplitudes of its outside are held first; what lugs change is found from the forces on them
and from their stiffness (`pmor.fe.lugs`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pmor.body.ring_on_blank import BlankResponse, Ring, ring_on_blank
from pmor.case.blank import CLEAR
from pmor.core.arrays import ComplexArray, FloatArray, IntArray
from pmor.fe.blank_section import ALL, Amplitudes, Block, Gauges, Span, ring_stiffness
from pmor.fe.body_condensation import Condensed
from pmor.fe.completion import nodes_of_elements
from pmor.fe.lugs import Lugs
from pmor.fe.perforated_web import PerforatedWeb
from pmor.fe.sector import SectorMesh

# Singular values of the harmonics at the nodes of a sector's interface, over the largest, that are left out.
ROUND_OFF = 1e-13
# Share that harmonics which are left out have in a gear's own compliance, at most.
LEFT_OUT = 5e-5


@dataclass(frozen=True)
class MeshedBody:
    """A body on the columns of nodes of an interface.

    Parameters
    ----------
    own : Condensed
        On harmonics.
    shapes : ndarray, shape (c, 3 l)
        Amplitudes of the shapes in which its harmonics feel each other, of those of the columns.
    repeats : int
        How often it repeats around its axis; 0 where its harmonics do not feel each other.
    """

    own: Condensed
    shapes: FloatArray
    repeats: int


@dataclass(frozen=True)
class Blank:
    """What a ring of sectors stands on: a body of revolution.

    Parameters
    ----------
    blocks : tuple of Block
        From the bore out to the sectors, or from the outside of a ring in to them.
    youngs_modulus : float
        MPa.
    largest : int
        Harmonics of the interface go from minus it to it.
    most : int
        As many as the elements of the sectors see.
    web : PerforatedWeb or None
        Where it has holes.
    body : MeshedBody or None
        Where it is brought as a mesh: the blocks then stand for it in harmonics that the mesh does not see.
    core : float
        Radius of a solid core, whose mean motion is held, mm; else the bore is.
    lugs : Lugs or None
        Of a ring.
    held : (float, float)
        Between these z its bore is held, mm.
    bedding : (float, float) or None
        Of a ring whose outside gives way, radially and along the surface, N/mm^3; lugs have their own.
    stress : bool
        Whether the stress on the surfaces of the web, the last block but one, is asked for.
    """

    blocks: tuple[Block, ...]
    youngs_modulus: float
    poisson_ratio: float
    largest: int
    most: int
    web: PerforatedWeb | None = None
    body: MeshedBody | None = None
    core: float = 0.0
    lugs: Lugs | None = None
    held: Span = ALL
    bedding: tuple[float, float] | None = None
    stress: bool = False

    @property
    def gauges(self) -> Gauges | None:
        """Points on the faces of a web without holes: where parabolas have the right slope, and clear of corners."""
        if not self.stress or self.web is not None:
            return None
        place = len(self.blocks) - 2
        web, faces = self.blocks[place], 1 if self.blocks[-1].z[-1] == 0.0 else 2
        row, side, upper = (part.ravel() for part in np.indices((len(web.radii) - 1, 2, faces)))
        points = Gauges(place, row, (2.0 * side - 1.0) / np.sqrt(3.0), upper == 1)
        radius = points.places(web)[:, 0]
        apart = np.minimum(radius - web.radii[0], web.radii[-1] - radius)
        kept = apart >= min(CLEAR * np.ptp(web.z) * (2 // faces), apart.max())  # of short webs the middle
        return Gauges(place, row[kept], points.across[kept], points.upper[kept])

    def wider(self, teeth: int) -> Blank | None:
        """Return the blank with more harmonics; None where it has all that elements see, or they are given."""
        if self.body is not None or self.lugs is not None:
            return None
        web = self.web and replace(self.web, largest=min(self.web.largest + self.web.count, self.largest))
        if self.largest == self.most and web == self.web:
            return None
        return replace(self, largest=min(self.largest + teeth, self.most), web=web)

    @property
    def harmonics(self) -> IntArray:
        """Numbers n of equation (1)."""
        return np.arange(-self.largest, self.largest + 1)

    def coordinates(self, mesh: SectorMesh) -> FloatArray:
        """Return functions of a sector's interface that span all harmonics, over its nodes, (p 3 l, 3 nodes)."""
        return interface_shares(mesh, self._functions(mesh), nodes_of_elements(mesh, mesh.interface)).T

    def change(self, twist: float) -> tuple[ComplexArray | Lugs, int] | None:
        """Return what makes teeth differ, over the amplitudes where it is felt, and how often it repeats."""
        if self.body is not None:
            return (self.body.own.coupling, self.body.repeats) if self.body.repeats else None
        if self.lugs is not None:
            return self.lugs, self.lugs.repeats
        if self.web is None:
            return None
        return self.web.softening(self.youngs_modulus, self.poisson_ratio, twist), self.web.count

    def ring(
        self, mesh: SectorMesh, stiffness: FloatArray, load: FloatArray, neighbours: int, lines: FloatArray,
        patterns: FloatArray | None = None, reach: int = 0,
    ) -> Ring:  # fmt: skip
        """Return how the faces of sectors -neighbours ... neighbours move under loads on those of sector 0.

        Parameters
        ----------
        stiffness : ndarray, shape (2 s + p 3 l, 2 s + p 3 l)
            Of a sector, over its left and its right side face, in coordinates that neighbours share, and the functions
            of its interface, N/mm.
        load : ndarray, shape (2 s + p 3 l, m)
            N.
        lines : ndarray, shape (m, k)
            Sums of these loads, of which `Ring.added` tells.
        patterns : ndarray, shape (m, q), optional
            Of these loads, under which the faces of sectors -reach ... reach and the web's stress are asked for too.
        """
        columns = self._functions(mesh)
        count = len(stiffness) - columns.shape[1] * 3 * len(mesh.z)
        shares = columns.T @ np.exp(1j * np.outer(_angles(mesh), self.harmonics))
        response, teeth = blank_response(mesh, self), signed_teeth(mesh)
        return ring_on_blank(stiffness, count // 2, teeth, shares, response, load, neighbours, lines, patterns, reach)

    def _functions(self, mesh: SectorMesh) -> FloatArray:
        """Real functions of the angle that span all harmonics, at the angles of a sector's nodes, (a, p)."""
        values = np.exp(1j * np.outer(_angles(mesh), self.harmonics))
        left, sizes, _ = np.linalg.svd(np.hstack([values.real, values.imag]), full_matrices=False)
        return np.asarray(left[:, sizes > ROUND_OFF * sizes[0]])


def signed_teeth(mesh: SectorMesh) -> int:
    """Number of teeth; negative of an internal gear, whose sectors follow each other clockwise."""
    return round(2.0 * np.pi / mesh.angular_pitch)


def _angles(mesh: SectorMesh) -> FloatArray:
    """Angles of the columns of nodes of a sector's interface, from the tooth's middle on, rad."""
    return np.linspace(0.5, -0.5, len(mesh.bore) // len(mesh.z)) * mesh.angular_pitch


def blank_response(mesh: SectorMesh, blank: Blank) -> BlankResponse:
    """Return the response of a blank below a ring of sectors."""
    material, twist = (blank.youngs_modulus, blank.poisson_ratio), mesh.twist_per_length
    shares = np.kron(interpolation(mesh.z, mesh.order, blank.blocks[-1].nodes_z), np.diag([1.0, 1j, 1.0]).conj())
    if mesh.mirrored:
        shares[:-1, -1] = 0.0  # the last column's nodes keep their z, which the nodes beside them do not feel
    harmonics, web = np.arange(blank.largest + 1), blank.web
    none = np.zeros((0, 0, 0), dtype=complex)
    if (body := blank.body) is not None:
        stiffness: Amplitudes = body.own.stiffness
        if (rest := harmonics[len(stiffness) :]).size:
            further = ring_stiffness(blank.blocks, *material, rest, mesh.mirrored, twist)
            stiffness = np.concatenate([stiffness, shares.conj().T @ further @ shares])
        if not body.repeats:
            return BlankResponse(np.asarray(stiffness), none, none)
        count = len(body.shapes)
        felt = len(body.own.coupling) // (2 * count) + 1
        passed_on = np.broadcast_to(body.shapes.T, (felt, *body.shapes.T.shape)).astype(complex)
        return BlankResponse(np.asarray(stiffness), passed_on, np.zeros((felt, count, count), dtype=complex))
    if (lugs := blank.lugs) is not None:
        own = ring_stiffness(blank.blocks, *material, harmonics, mesh.mirrored, twist, lugs.loads(twist), held=None)
        return _held(_over_amplitudes(own, shares, np.array([1.0, 1j, 1.0])[lugs.parts]))
    if web is None:
        gauges, bedded = blank.gauges, blank.bedding is not None
        own = ring_stiffness(blank.blocks, *material, harmonics, mesh.mirrored, twist, core=blank.core, gauges=gauges,
                             held=None if bedded else blank.held, bedding=blank.bedding or (0.0, 0.0))  # fmt: skip
        if gauges is None:
            return BlankResponse(np.asarray(shares.conj().T @ own @ shares), none, none)
        response = _over_amplitudes(own, shares, np.tile(np.array([1.0, 1.0, 1j]), len(gauges.row)))
        return BlankResponse(response.stiffness, none, none, response.passed_on)
    loads = web.loads()
    own = ring_stiffness(blank.blocks, *material, harmonics[: web.largest + 1], mesh.mirrored, twist, loads, blank.core,
                         blank.held)  # fmt: skip
    response = _over_amplitudes(own, shares, np.tile(np.array([1.0, 1j, 1.0])[web.parts], len(loads)))
    if not (rest := harmonics[web.largest + 1 :]).size:
        return response
    further = ring_stiffness(blank.blocks, *material, rest, mesh.mirrored, twist, held=blank.held)
    return response._replace(stiffness=np.concatenate([response.stiffness, shares.conj().T @ further @ shares]))


def _over_amplitudes(own: Amplitudes, shares: Amplitudes, parts: ComplexArray) -> BlankResponse:
    """Response of the matrix of a body's last row of nodes and its loads, (h, 3 m + c, 3 m + c)."""
    size = len(shares)
    return BlankResponse(
        np.asarray(shares.conj().T @ own[:, :size, :size] @ shares),
        np.asarray(shares.conj().T @ -own[:, :size, size:] * parts.conj()),
        np.asarray(parts[:, None] * -own[:, size:, size:] * parts.conj()),
    )


def _held(free: BlankResponse) -> BlankResponse:
    """Response where all amplitudes that loads work on are held: forces for displacements, and the other way round.

    `passed_on` are then forces on the interface by unit displacements there, `flexibility` minus the forces on these.
    """
    inverse = np.linalg.inv(free.flexibility)
    own = 0.5 * (inverse + inverse.conj().swapaxes(-1, -2))
    passed = free.passed_on @ own
    interface = free.stiffness + passed @ free.passed_on.conj().swapaxes(-1, -2)
    return BlankResponse(np.asarray(interface), np.asarray(passed), np.asarray(-own))


def interpolation(z: FloatArray, order: int, fine: FloatArray) -> FloatArray:
    """Shares of columns of nodes in the displacement at places along the width, (places, columns)."""
    shares = np.zeros((len(fine), len(z)))
    element = np.clip(np.searchsorted(z[::order], fine, side="right") - 1, 0, (len(z) - 1) // order - 1)
    for place, e in enumerate(element.tolist()):
        nodes = np.arange(order * e, order * e + order + 1)
        for a in nodes:
            others = nodes[nodes != a]
            shares[place, a] = np.prod((fine[place] - z[others]) / (z[a] - z[others]))
    return shares


def cylindrical(mesh: SectorMesh, nodes: IntArray) -> FloatArray:
    """Return radial, circumferential and axial directions at nodes, (n, 3, 3), rows over x, y, z."""
    radial = mesh.nodes[nodes, :2] / np.linalg.norm(mesh.nodes[nodes, :2], axis=1)[:, None]
    frames = np.zeros((len(nodes), 3, 3))
    frames[:, 0, :2], frames[:, 2, 2] = radial, 1.0
    frames[:, 1, 0], frames[:, 1, 1] = -radial[:, 1], radial[:, 0]
    return frames


def interface_shares(mesh: SectorMesh, columns: FloatArray, nodes: IntArray) -> FloatArray:
    """Return the displacement x y z of the interface's nodes over functions of the angle, (3 n, p 3 l)."""
    layers = len(mesh.z)
    place = np.full(len(mesh.nodes), -1)
    place[mesh.bore] = np.arange(len(mesh.bore))
    angle, layer = np.divmod(place[nodes], layers)
    functions = columns.shape[1]
    displacement = np.zeros((len(nodes), 3, functions, layers, 3))
    frames = cylindrical(mesh, nodes).transpose(0, 2, 1)
    displacement[np.arange(len(nodes)), :, :, layer, :] = frames[:, :, None, :] * columns[angle][:, None, :, None]
    return displacement.reshape(3 * len(nodes), -1)
