"""Meshes solved in many variants: each by itself, held or on its supports, or all of a set at once.

Both answer the same questions: the state of what is built in one way, results that are read off it, and the derivatives
of a figure. Those of the STE are exact. Of a set all figures have exact ones, from one right-hand side for each state
(`pmor.line.kernels.loads`, eq. 2): the STE moves with the rotation of the first gear, the mesh load factor and face
load factors with the forces. The face load factor of a mesh by itself has none here.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Protocol

import numpy as np

from pmor.case.width import meshed_width
from pmor.core.arrays import BoolArray, FloatArray
from pmor.design.measures import order_of, order_rates, smooth_peak_to_peak, smooth_top
from pmor.dynamics.whine.quiet import RESULTS as IN_MOTION
from pmor.dynamics.whine.quiet import QuietMesh
from pmor.gear.condition import Assembly
from pmor.gear.deviation_rates import deviation_rates
from pmor.line.hubs import Hubs
from pmor.line.lost import lost_of_pair
from pmor.line.several import GearTrain
from pmor.pair.conditions import conditions_of_assembly
from pmor.results.load_distribution import face_load_factor, largest_pressure
from pmor.sets.loader import SetFile
from pmor.sets.lost import lost_positions
from pmor.sets.variants import BuiltSet, SetVariant, SetVariants
from pmor_online.model import ReducedPair, online_angles
from pmor_online.root_stress import root_stress
from pmor_online.variants import VariantSolver, VariantState

# Angles whose flexibilities are in memory together, where they do not stay there.
BLOCK = 256
# Memory of sections that stay placed for further variants, for each thread, and of states that stay known.
MOST_PLACED_BYTES, MOST_KNOWN_BYTES = 1 << 26, 1 << 26
# Flanks whose motion stays known.
MOST_LOUD = 64
# Numbers of a section beside its flexibilities to the others, about: gradients, laws.
SECTION_NUMBERS = 64
# Fields of a state by the axis that counts angles.
ANGLE_AXIS = {"ste_um": 1, "converged": 1, "overloaded": 1, "load_N_per_mm": 1, "edge_load_N_per_mm": 1,
              "pressure_MPa": 1, "sensitivity": 1, "roll_rad": 0, "pair": 0}  # fmt: skip
#: parameters of modifications by case, and by ``gear.key`` in it, each with a derivative, or those that are wanted
Rates = dict[str, dict[str, float]]
Wanted = Mapping[str, set[str] | tuple[()]]


@dataclass(frozen=True, eq=False)
class Built:
    """A machine as it is built in one way: flanks and axes of its meshes, and the hubs of a set, mm; None as filed."""

    flanks: tuple[Assembly, ...]
    displacement: FloatArray | None = None


class State(Protocol):
    """Attributes of all solved variants: T loads, A angles."""

    @property
    def ste_um(self) -> FloatArray: ...  # noqa: D102

    @property
    def converged(self) -> BoolArray: ...  # noqa: D102


class Solver(Protocol):
    """What is solved by itself: one mesh, or a set; at A angles over so many mesh cycles, under T loads."""

    name: str
    phi: FloatArray
    pitches: int

    def solve(self, built: Built, differentiated: bool = False) -> Any:
        """Return the state of what is built in one way; with derivatives where `rates` are to be asked for."""

    def lost(self, state: Any, labels: Sequence[str]) -> list[str]:
        """Return a sentence for each load under which positions have no solution: why, and what to do."""

    def result(self, key: str, state: Any, built: Built) -> FloatArray:
        """Return one result, none of the STE, under each load, (T,)."""

    def measured(self, key: str, state: Any, built: Built, sharpness: float) -> tuple[FloatArray, Any]:
        """Return a result made smooth under each load, (T,), and its slope for `rates`; None where it has none."""

    def rates(self, state: Any, built: Built, slope: Any, weights: FloatArray, wanted: Wanted) -> Rates:
        """Return the derivatives of a measure, weighted over the loads (T,), by parameters; all of a case by ``()``."""


class FineSolver(VariantSolver):
    """Solves variants of a mesh on many angles, block by block; threads may share it.

    The angles of twice as many are among those, and a state depends on nothing that was solved before, to the last bit:
    what is known is not solved again.

    Parameters
    ----------
    reduced, phi, torques_Nm, hubs
        As of `VariantSolver`.
    coarser : FineSolver, optional
        Of every second of these angles, from the first one on.
    stays : bool
        Whether sections stay placed however many they are.
    """

    def __init__(
        self, reduced: ReducedPair, phi: FloatArray, torques_Nm: Sequence[float], hubs: Sequence[Hubs] = (),
        coarser: FineSolver | None = None, stays: bool = False,
    ) -> None:  # fmt: skip
        super().__init__(reduced, phi, torques_Nm, hubs)
        self._coarser = coarser
        own = self.phi if coarser is None else self.phi[1::2]
        self._blocks = [own] if stays else [own[i : i + BLOCK] for i in range(0, len(own), BLOCK)]
        size = reduced.layered.tooth_pair_count * len(reduced.layered.width)
        placed = 8 * len(own) * size * (size + SECTION_NUMBERS) * max(1, len(self.hubs))
        stays = stays or placed <= MOST_PLACED_BYTES
        self._staying = [self._solver_of(phi) for phi in self._blocks] if stays else None
        self._known: OrderedDict[Assembly, VariantState] = OrderedDict()
        self._known_bytes, self._lock_of_known = 0, threading.Lock()

    def solve(self, assembly: Assembly, differentiated: bool = False) -> VariantState:
        """Return the state of the pair as it is built in one way; see `VariantSolver.solve`."""
        if differentiated:
            return self._solve(assembly, True)
        with self._lock_of_known:
            found = self._known.get(assembly)
        if found is None:
            found = self._solve(assembly, False)
            self._keep_known(assembly, found)
        return found

    def _solve(self, assembly: Assembly, differentiated: bool) -> VariantState:
        solvers = self._staying or map(self._solver_of, self._blocks)
        found = _joined([solver.solve(assembly, differentiated) for solver in solvers], np.concatenate)
        if self._coarser is None:
            return found
        return _joined([self._coarser.solve(assembly, differentiated), found], _alternating)

    def _solver_of(self, phi: FloatArray) -> VariantSolver:
        return VariantSolver(self.reduced, phi, self.torques_Nm, self.hubs)

    def _keep_known(self, assembly: Assembly, state: VariantState) -> None:
        with self._lock_of_known:
            if assembly not in self._known:
                self._known[assembly] = state
                self._known_bytes += _size(state)
            while self._known_bytes > MOST_KNOWN_BYTES:
                self._known_bytes -= _size(self._known.popitem(last=False)[1])


class MeshSolver:
    """One mesh, held at its hubs or on what they stand on under each load.

    Parameters
    ----------
    name : str
        Of its case.
    number : int
        Among the meshes of what is built.
    reduced : ReducedPair
        Of line loads.
    angles, pitches : int
        Of a mesh cycle, and mesh cycles.
    torques_Nm, hubs
        As of `VariantSolver`.
    coarser, stays
        As of `FineSolver`.
    quiet : sequence of QuietMesh
        The mesh in motion under each load, where that is asked for.
    """

    def __init__(
        self, name: str, number: int, reduced: ReducedPair, angles: int, pitches: int, torques_Nm: Sequence[float],
        hubs: Sequence[Hubs] = (), coarser: FineSolver | None = None, stays: bool = False,
        quiet: Sequence[QuietMesh] = (),
    ) -> None:  # fmt: skip
        self.quiet, self._loud = tuple(quiet), OrderedDict[Assembly, list[dict[str, float]]]()
        self.name, self.number, self.reduced, self.pitches = name, number, reduced, pitches
        phi = online_angles(reduced.meshed.pair.pitch, angles, pitches)
        self.variants = FineSolver(reduced, phi, torques_Nm, hubs, coarser, stays)
        self.phi = self.variants.phi
        self._over_width = meshed_width(reduced.basis.case) != "plane_strain"

    def solve(self, built: Built, differentiated: bool = False) -> VariantState:
        """Return the state of the mesh."""
        return self.variants.solve(built.flanks[self.number], differentiated)

    def lost(self, state: VariantState, labels: Sequence[str]) -> list[str]:
        """Return a sentence for each load under which positions have no solution."""
        return lost_of_pair(labels, state.converged, state.overloaded)

    def result(self, key: str, state: VariantState, built: Built) -> FloatArray:
        """Return one result, none of the STE, under each load, (T,)."""
        if key == "pressure_MPa":
            return largest_pressure(state.pressure_MPa, 1)
        if key == "tip_edge_load_N_per_mm":
            return np.asarray(state.edge_load_N_per_mm.max(axis=1))
        if key == "k_h_beta":
            return face_load_factor(state)
        if self.quiet and key in IN_MOTION:
            return np.array([results[key] for results in self._in_motion(built.flanks[self.number])])
        found = []
        for pair, torques in self.variants.supported:
            stress = root_stress(pair, self.phi, conditions_of_assembly(built.flanks[self.number], torques))
            assert stress is not None
            found.append(np.nanmax(stress.max_principal_MPa.reshape(len(torques), -1), axis=1))
        return np.concatenate(found)

    def _in_motion(self, assembly: Assembly) -> list[dict[str, float]]:
        """Results of motion under each load; those of the last flanks stay known."""
        if assembly not in self._loud:
            self._loud[assembly] = [mesh.results(assembly) for mesh in self.quiet]
        while len(self._loud) > MOST_LOUD:
            self._loud.popitem(last=False)
        return self._loud[assembly]

    def measured(
        self, key: str, state: VariantState, built: Built, sharpness: float
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return a result made smooth under each load, (T,), and its derivatives by the STE, (T, A)."""
        if key == "k_h_beta":
            ratio = _over_the_face(state.load_N_per_mm, state.width_mm)[0]
            return smooth_top(ratio, sharpness)[0], None
        if key in IN_MOTION:
            return self.result(key, state, built), None
        return of_ste(key, state.ste_um, self.pitches, sharpness)

    def rates(self, state: VariantState, built: Built, slope: FloatArray, weights: FloatArray, wanted: Wanted) -> Rates:
        """Return the derivatives of a measure, weighted over the loads (T,), by parameters."""
        if self.name not in wanted:
            return {}
        found = self.ste_rates(state, built, wanted[self.name])
        return {self.name: {name: float(np.einsum("t,ta,ta->", weights, slope, rate)) for name, rate in found.items()}}

    def ste_rates(self, state: VariantState, built: Built, wanted: set[str] | tuple[()] = ()) -> dict[str, FloatArray]:
        """Return d STE / d parameter, (T, A), by ``gear.key``, of a state that was solved with derivatives."""
        assert state.sensitivity is not None
        assembly = built.flanks[self.number]
        rates = deviation_rates(self.reduced.meshed, assembly, state, self._over_width, wanted)  # type: ignore[arg-type]
        return {name: np.einsum("daps,aps->da", state.sensitivity, rate) for name, rate in rates.items()}


class TrainSolver:
    """All meshes of a set at once.

    Parameters
    ----------
    file : SetFile
    train : GearTrain
        Of `pmor.sets.run.train_of_variants`.
    angles : int
        Of a mesh cycle.
    torques_Nm : sequence of float
        Amounts of the torque of the file.
    """

    def __init__(self, file: SetFile, train: GearTrain, angles: int, torques_Nm: Sequence[float]) -> None:
        self.name, self.train, self.pitches, self.plan = "", train, file.pitches, file.plan
        on_first = np.array(torques_Nm) * self.plan.torque_Nm / self.plan.nominal_Nm
        self.variants = SetVariants(self.plan, train, on_first, angles, file.pitches)
        self.phi = self.variants.phi
        self._over_width = meshed_width(next(iter(file.cases.values()))) != "plane_strain"

    def solve(self, built: Built, differentiated: bool = False) -> SetVariant:
        """Return the state of the set."""
        moved = self.plan.displacement if built.displacement is None else built.displacement
        return self.variants.solve(BuiltSet(built.flanks, moved, self.plan.eccentricity))

    def lost(self, state: SetVariant, labels: Sequence[str]) -> list[str]:
        """Return a sentence for each load under which positions have no solution."""
        return lost_positions(state.solution, labels)

    def result(self, key: str, state: SetVariant, built: Built) -> FloatArray:
        """Return one result, none of the STE, under each load, (T,)."""
        if key == "k_gamma":
            return state.solution.k_gamma
        return np.asarray(getattr(state, "edge_load_N_per_mm" if key == "tip_edge_load_N_per_mm" else key))

    def measured(
        self, key: str, state: SetVariant, built: Built, sharpness: float
    ) -> tuple[FloatArray, tuple[FloatArray, ...]]:
        """Return a result made smooth, (T,), and its derivatives by movements (T, A, K) and forces (T, A, N)."""
        found = state.solution.found
        by_movement, by_force = np.zeros(found.movement.shape), np.zeros(found.force.shape)
        if key == "k_gamma":
            measure, by_force = self._of_planets(state, sharpness)
        elif key == "k_h_beta":
            measure, by_force = self._of_faces(state, sharpness)
        else:
            measure, by_ste = of_ste(key, state.ste_um, self.pitches, sharpness)
            by_movement[..., self.plan.driver] = 1e3 * self.train.meshes[0].pair.base_radius * by_ste
        return measure, (by_movement, by_force)

    def rates(
        self, state: SetVariant, built: Built, slope: tuple[FloatArray, ...], weights: FloatArray, wanted: Wanted
    ) -> Rates:
        """Return the derivatives of a measure, weighted over the loads (T,), by parameters."""
        weighted = [weights[:, None, None] * by for by in slope]
        by_deviation = self.variants.differentiate(state, *weighted)
        return self.variants.by_parameters(state, by_deviation, self._over_width, wanted)

    def _of_planets(self, state: SetVariant, sharpness: float) -> tuple[FloatArray, FloatArray]:
        """Return the smooth mesh load factor under each load, (T,), and its derivatives by forces, (T, A, N)."""
        solved = state.solution
        share, (torques, angles) = solved.planet_share, solved.converged.shape
        count, a_pitch = len(solved.plan.planets), angles // solved.pitches
        mean = count * share.reshape(torques, solved.pitches, a_pitch, count).mean(axis=2)
        measure, weights = smooth_top(mean.reshape(torques, -1), sharpness)
        by_share = np.repeat(weights.reshape(torques, solved.pitches, count) * count / a_pitch, a_pitch, axis=1)
        total = solved.tangential_pin_force_N.sum(axis=2, keepdims=True)
        by_pin = (by_share - (by_share * share).sum(axis=2, keepdims=True)) / total
        of_pins = np.tile(solved.tangential_rows, (solved.cycles, 1, 1))
        return measure, np.einsum("tap,anp->tan", by_pin, of_pins)

    def _of_faces(self, state: SetVariant, sharpness: float) -> tuple[FloatArray, FloatArray]:
        """Return the smooth largest face load factor of the meshes, (T,), and its derivatives by forces, (T, A, N)."""
        solved, found = state.solution, []
        for number in range(len(solved.train.meshes)):
            loads = solved.face_loads(number)
            found.append((*_over_the_face(loads.load_N_per_mm, loads.width_mm, solved.carrying[:, number]),
                          loads.width_mm))  # fmt: skip
        measure, weights = smooth_top(np.concatenate([ratio for ratio, _, _ in found], axis=1), sharpness)
        by_force, first = np.zeros(solved.found.force.shape), 0
        for one, (ratio, share, width) in zip(solved.placed.placed, found, strict=True):
            own = weights[:, first : first + len(width)]
            first += len(width)
            by_load = own / width - (own * ratio).sum(axis=1, keepdims=True) / width.sum()
            pairs = one.rows.shape[1] // len(width)
            by_force[..., one.part] = np.tile(by_load * share, (1, pairs))[:, None, :]
        return measure, by_force


def of_ste(key: str, ste_um: FloatArray, pitches: int, sharpness: float) -> tuple[FloatArray, FloatArray]:
    """Return a smooth figure of the STE over so many pitches under each load, (T,), and its derivatives, (T, A)."""
    order = order_of(key)
    if order is None:
        return smooth_peak_to_peak(ste_um, sharpness)
    return order_rates(ste_um, order * pitches)


def _over_the_face(
    load: FloatArray, width: FloatArray, carrying: BoolArray | bool = True
) -> tuple[FloatArray, FloatArray]:
    """Return line loads (T, A, P, S), added up over positions, over their mean, (T, S), and 1 over that, (T, 1).

    Both are 0 of loads under which nothing is carried, which have no such factor.
    """
    over_face = load.sum(axis=(1, 2))
    mean = over_face @ width / width.sum()
    share = np.divide(1.0, mean, out=np.zeros(mean.shape), where=carrying & (mean > 0.0))[:, None]
    return over_face * share, share


def _joined(parts: Sequence[VariantState], join: Any) -> VariantState:
    """Return states at several angles as one."""
    if len(parts) == 1:
        return parts[0]
    there = {name: axis for name, axis in ANGLE_AXIS.items() if getattr(parts[0], name) is not None}
    arrays: dict[str, Any] = {
        name: join([getattr(part, name) for part in parts], axis=axis) for name, axis in there.items()
    }
    return replace(parts[0], **arrays)


def _alternating(parts: Sequence[np.ndarray], axis: int) -> np.ndarray:
    """Return two arrays as one, by turns along an axis."""
    first, second = (np.moveaxis(part, axis, 0) for part in parts)
    found = np.empty((2 * len(first), *first.shape[1:]), dtype=first.dtype)
    found[0::2], found[1::2] = first, second
    return np.ascontiguousarray(np.moveaxis(found, 0, axis))


def _size(state: VariantState) -> int:
    return sum(value.nbytes for one in fields(state) if isinstance(value := getattr(state, one.name), np.ndarray))
