"""What the meshes of a planetary set excite: lines h w_m + j W_c in the housing, of mesh and carrier.

The forces of all meshes at a harmonic h, seen from the carrier, are in coordinates that stand still (`blades`) forces
at three frequencies, j = -1, 0, 1: on what is alike in all planets and what moves no central member at j = 0, on cos
and sin at the others. Of equal planets the class h z mod N says which: each harmonic has one.

With the mean stiffness that is exact on any housing. Stiffness that varies over the cycle takes the motion that planets
see: where the housing is alike all around, N equal planets are one, with the receptance

    H_h = q^H H(h w_m + j W_c) q,    q = B_j^T v,    v_n = exp(-i h z psi_n) / sqrt(N),                              (1)

in Hill's equations (`hill`); planets that differ are solved all together, by the sum of what the housing does at the
three orders. Where it is not, motion at a harmonic strays to further lines. Planets of any kind around a carrier that
stands still, or seen from it, are solved all together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.dynamics.whine.blades import Blades
from pmor.dynamics.whine.coherent import CoherentMeshes
from pmor.dynamics.whine.hill import MeshCycle
from pmor.dynamics.whine.modal import Receptance
from pmor.dynamics.whine.orders import Order, along
from pmor.dynamics.whine.pitches import time_invariant
from pmor.dynamics.whine.planets import MovingSet
from pmor.dynamics.whine.set_cycle import SetCycle
from pmor.dynamics.whine.set_motion import ConstantSet, SetMotion, widened

# Of the largest force: lines that phasing forbids.
FORBIDDEN = 1e-9
# Of forces and stiffness: planets that are equal. Of the motion at a harmonic: what may stray.
EQUAL, STRAY = 1e-6, 1e-3
ASTRAY = "shafts and housing are not alike all around"
# Forces at harmonics of either sign that are solved together, of cycles of several pitches.
MOST_UNKNOWNS = 1000
# Beyond the highest mode nothing moves.
TINY = 1e-300


@dataclass(frozen=True)
class SetLine:
    """A line in the housing: harmonic of the cycle, order of the carrier's turn beside it, frequency over the speed."""

    harmonic: int
    sideband: int
    order: float


@dataclass(frozen=True)
class SetExcitation:
    """What a set excites at S speeds: L lines, and forces on its P coordinates of the closed machine.

    Parameters
    ----------
    varying, constant : ndarray, shape (S, L, P)
        By stiffness that varies, and by its mean.
    motion : SetMotion
        Equations of the first.
    why_constant : str
        Why stiffness that varies is not found, and both are the same; empty where it is.
    """

    lines: tuple[SetLine, ...]
    orders: tuple[Order, ...]
    varying: ComplexArray
    constant: ComplexArray
    motion: SetMotion
    why_constant: str = ""


def set_excitation(
    receptance: Receptance, at_rest: FloatArray, one: MovingSet, cycle: SetCycle, harmonics: int, speeds: FloatArray,
    sense: float, mean: bool = False,
) -> SetExcitation:  # fmt: skip
    """Return what a set excites.

    Parameters
    ----------
    at_rest : ndarray, shape (P, P)
        Receptance of its coordinates at rest.
    harmonics : int
        Of the sun's mesh.
    speeds : ndarray, shape (S,)
        rad/s.
    sense : float
        Of the machine's speed.
    mean : bool
        Whether by the mean stiffness alone.
    """
    meshes, parts = _passing(cycle.meshes, one.rate * sense), _parts(cycle.blades, one.carrier)
    by_mean, found, acts = time_invariant(meshes), list[SetLine](), list[ComplexArray]()
    largest = float(np.abs(by_mean[1:]).max())
    for harmonic in range(1, harmonics * cycle.pitches + 1):
        for sideband, part in parts.items():
            by = widened(part, cycle.each).T
            if np.abs(by @ by_mean[harmonic]).max() > FORBIDDEN * largest:
                found.append(_line(one, cycle, harmonic, sideband, sense))
                acts.append(by)
    orders = tuple(along(receptance, line.order, speeds, sense) for line in found)
    standing = cycle.standing and replace(cycle.standing, backwards=one.rate * sense < 0.0)
    together = CoherentMeshes((standing,), (cycle.pitches,)) if standing else None
    still = np.concatenate([np.zeros((1, one.size, one.size)), np.tile(np.eye(one.size), (len(found), 1, 1))])
    constant = ConstantSet(
        cycle, one.own, meshes, together, at_rest, tuple((order,) for order in orders), still[:, None].astype(complex),
        tuple((line, 0) for line in range(1, len(found) + 1)),
        harmonics=tuple(line.harmonic for line in found), acts=np.array(acts).reshape(-1, one.size, len(meshes.mean)),
    )  # fmt: skip
    acting = constant.answer()
    if mean:
        return SetExcitation(tuple(found), orders, acting, acting, constant)
    problem = _Planets(receptance, at_rest, one, cycle, meshes, parts, speeds, sense, together)
    motion, why = problem.as_one(found, orders)
    if motion is None and (not one.carrier or cycle.blades.carried or not why.startswith(ASTRAY)):
        motion, further = problem.each(found, orders)
        why = " and ".join(filter(None, (why, further)))
    if motion is None:
        return SetExcitation(tuple(found), orders, acting, acting, constant, why)
    return SetExcitation(tuple(found), orders, motion.answer(), acting, motion)


def over_planets(cycle: SetCycle, force: ComplexArray, moved: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return forces of the sun's and of the ring's meshes, N, and by how much they part, mm: mean of all planets.

    Root of the mean square over planets and a turn of the carrier.

    Parameters
    ----------
    force, moved : ndarray of complex, shape (..., P)
        At a line, on the coordinates of `blades` and by them.

    Returns
    -------
    (ndarray, ndarray), shape (..., 2) each
    """
    count, square = cycle.blades.count, np.diagonal(cycle.blades.matrix.T @ cycle.blades.matrix)
    found = []
    for values, weights in ((force, 1.0 / square), (moved, square)):
        each = abs(values.reshape(*values.shape[:-1], count, -1)) ** 2 * weights[:, None] / count
        found.append(np.sqrt(each.sum(axis=-2))[..., [0, cycle.each // 2]])
    return found[0], found[1]


def mesh_forces_of(
    one: MovingSet, cycle: SetCycle, lines: tuple[SetLine, ...], orders: tuple[Order, ...], acting: ComplexArray
) -> dict[tuple[int, int], ComplexArray]:
    """Return the forces of all meshes beside their means as planets see them, planet by planet, (S, P).

    By harmonic of the cycle, and order of the carrier's turn beside it: 0 alone on a housing that is alike all around.

    Parameters
    ----------
    acting : ndarray, shape (S, L, P)
        As in `SetExcitation`.
    """
    parts, found = _parts(cycle.blades, one.carrier), dict[tuple[int, int], ComplexArray]()
    inverse = np.linalg.inv(cycle.blades.matrix.T @ cycle.blades.matrix)
    for number, (line, order) in enumerate(zip(lines, orders, strict=True)):
        moved = np.einsum("sab,sb->sa", order.ports(one.own, one.own), acting[:, number])
        force = acting[:, number] - moved @ cycle.tangent.T
        for sideband, part in parts.items():
            key = line.harmonic, line.sideband + sideband
            shown = force @ widened(part @ inverse, cycle.each).T
            found[key] = found.get(key, 0.0) + shown
    return found


@dataclass(frozen=True)
class _Planets:
    """Hill's equations of the meshes of a set."""

    receptance: Receptance
    at_rest: FloatArray
    one: MovingSet
    cycle: SetCycle
    meshes: MeshCycle
    parts: Mapping[int, ComplexArray]
    speeds: FloatArray
    sense: float
    standing: CoherentMeshes | None

    def as_one(self, lines: list[SetLine], orders: tuple[Order, ...]) -> tuple[SetMotion | None, str]:
        """Return N planets as one, equation (1); or say why they are not one."""
        cycle, blades = self.cycle, self.cycle.blades
        if why := self._too_long(cycle.each):
            return None, why
        count, each, shapes = len(self.meshes.force), np.eye(cycle.each), self._shapes()
        whole = np.array([np.kron(shape[:, None], each) for shape in shapes])
        alike = np.einsum("hpq,hrq,hr->hp", whole, whole.conj(), self.meshes.force)
        apart = np.abs(alike - self.meshes.force)[1:].max() / np.abs(self.meshes.force[1:]).max()
        if not blades.even or max(apart, cycle.uneven) > EQUAL:
            return None, f"planets are not equal: their stiffness differs by {100.0 * cycle.uneven:.2g} %"
        known, stray = _known(lines, orders), 0.0
        moves, acting, beside = list[tuple[Order, ...]](), list[ComplexArray](), list[int]()
        for harmonic in range(count):
            sideband = max(self.parts, key=lambda j: float(np.abs(self.parts[j].T @ shapes[harmonic]).max()))
            by = widened(self.parts[sideband], cycle.each).T @ whole[harmonic]
            ports = np.asarray(self.at_rest[None], dtype=complex)
            if harmonic:
                order = known.get((harmonic, sideband)) or self._order(harmonic, sideband)
                ports = order.ports(self.one.own, self.one.own)
                moves.append((order,))
            moved = ports @ by
            own = by @ np.linalg.solve(by.conj().T @ by, by.conj().T @ moved)
            stray = max(stray, float(np.abs(moved - own).max() / max(np.abs(moved).max(), TINY)))
            acting.append(by)
            beside.append(sideband)
        if stray > STRAY:
            return None, _astray(stray)
        there = tuple((line.harmonic, 0) if beside[line.harmonic] == line.sideband else None for line in lines)
        return self._motion(tuple(moves), np.array(acting)[:, None], there, whole), ""

    def each(self, lines: list[SetLine], orders: tuple[Order, ...]) -> tuple[SetMotion | None, str]:
        """Return all planets together: around a carrier that stands still, seen from it, or where all is alike around.

        Or say why they see no constant receptance.
        """
        if why := self._too_long(len(self.meshes.mean)):
            return None, why
        known, acts = _known(lines, orders), {j: widened(part, self.cycle.each).T for j, part in self.parts.items()}
        if self.cycle.blades.carried:
            acts = {0: acts[0]}
        sidebands, stray, moves = list(acts), 0.0, list[tuple[Order, ...]]()
        for harmonic in range(1, len(self.meshes.force)):
            own = tuple(known.get((harmonic, j)) or self._order(harmonic, j) for j in sidebands)
            moves.append(own)
            for j, order in zip(sidebands, own, strict=True):
                moved = order.ports(self.one.own, self.one.own) @ acts[j]
                others = [np.abs(acts[k].T @ moved).max() for k in sidebands if k != -j]
                stray = max(stray, float(max(others, default=0.0) / max(np.abs(moved).max(), TINY)))
        if len(sidebands) > 1 and not self.cycle.blades.even:
            return None, "planets are not evenly spaced"
        if stray > STRAY:
            return None, _astray(stray)
        by = np.broadcast_to(np.array(list(acts.values())), (len(self.meshes.force), *np.shape(list(acts.values()))))
        there = tuple((line.harmonic, sidebands.index(line.sideband)) for line in lines)
        return self._motion(tuple(moves), by, there, None), ""

    def _shapes(self) -> ComplexArray:
        """v of (1) at all harmonics, (n + 1, N).

        A stepped planet is in a cycle of several pitches as far behind as both of its gears have it: by pitches more.
        """
        blades, pitches, harmonics = self.cycle.blades, self.cycle.pitches, np.arange(len(self.meshes.force))
        behind = self.one.teeth * (blades.directions - blades.directions[0])
        way = np.sign(self.one.rate * self.sense)
        force = self.meshes.force.reshape(len(harmonics), blades.count, -1)
        found = np.ones((len(harmonics), blades.count), dtype=complex)
        for planet in range(1, blades.count):
            more = (behind[planet] + 2.0 * np.pi * np.arange(pitches)) / pitches
            shifts = np.exp(-1j * way * harmonics[:, None] * more)
            left = np.abs(force[1:, planet, :, None] - force[1:, 0, :, None] * shifts[1:, None]).max(axis=(0, 1))
            found[:, planet] = shifts[:, left.argmin()]
        return found / np.sqrt(blades.count)

    def _too_long(self, unknowns: int) -> str:
        """Why so many unknowns at each harmonic of a long cycle are not solved."""
        if (2 * len(self.meshes.force) - 1) * unknowns <= MOST_UNKNOWNS or self.cycle.pitches == 1:
            return ""
        return f"both gears of a stepped planet mesh in cycles of their own, {self.cycle.pitches} pitches together"

    def _motion(
        self, orders: tuple[tuple[Order, ...], ...], by: ComplexArray, lines: tuple[tuple[int, int] | None, ...],
        shapes: ComplexArray | None,
    ) -> SetMotion:  # fmt: skip
        return SetMotion(self.cycle, self.one.own, self.meshes, self.standing, self.at_rest, orders, by, lines, shapes)

    def _order(self, harmonic: int, sideband: int) -> Order:
        line = _line(self.one, self.cycle, harmonic, sideband, self.sense)
        return along(self.receptance, line.order, self.speeds, self.sense)


def _known(lines: list[SetLine], orders: tuple[Order, ...]) -> dict[tuple[int, int], Order]:
    return {(line.harmonic, line.sideband): order for line, order in zip(lines, orders, strict=True)}


def _astray(share: float) -> str:
    return f"{ASTRAY}: {100.0 * share:.2g} % of motion goes astray"


def _line(one: MovingSet, cycle: SetCycle, harmonic: int, sideband: int, sense: float) -> SetLine:
    return SetLine(harmonic, sideband, harmonic * abs(one.rate) / cycle.pitches + sideband * sense * one.carrier)


def _passing(meshes: MeshCycle, rate: float) -> MeshCycle:
    """Harmonics over time of meshes that pass one way or the other."""
    return meshes.conj if rate < 0.0 else meshes


def _parts(blades: Blades, carrier: float) -> Mapping[int, ComplexArray]:
    """Parts of B by the order of the carrier's turn, B whole where it stands still."""
    return blades.by_order if carrier else {0: blades.matrix.astype(complex)}
