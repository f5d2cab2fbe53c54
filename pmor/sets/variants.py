"""One set with very many flanks: solved at the same angles and torques, its finite elements and places once.

What a variant changes are gaps alone. A state does not depend on what was solved before, to the last bit.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.gear.condition import Assembly
from pmor.gear.deviation_rates import deviation_rates
from pmor.line.kernels.types import LineResults
from pmor.line.pair import joined_results
from pmor.line.several import GearTrain, PlacedMesh, Workspaces
from pmor.results.load_distribution import largest_pressure
from pmor.sets.plan import SetPlan
from pmor.sets.solution import SetSolution, errors_of, solve_placed
from pmor_online.variants import largest_of


@dataclass(frozen=True)
class BuiltSet:
    """A set as it is built in one way.

    Parameters
    ----------
    flanks : tuple of Assembly
        Of each mesh; pitch deviations are those of the train.
    displacement, eccentricity : ndarray
        Errors of pins and gears, as in `pmor.sets.plan.SetPlan`.
    """

    flanks: tuple[Assembly, ...]
    displacement: FloatArray
    eccentricity: FloatArray


@dataclass(frozen=True, eq=False)
class SetVariant:
    """A set built in one way, solved under D torques at A angles in all; N sections.

    Parameters
    ----------
    built : BuiltSet
    solution : SetSolution
    deviation : sequence of lists of ndarray
        By how much flanks stand off each time that places are passed, in each block of angles, (a, N), mm.
    """

    built: BuiltSet
    solution: SetSolution
    deviation: Sequence[list[FloatArray]]

    @property
    def ste_um(self) -> FloatArray:
        """(D, A), NaN where not converged."""
        return self.solution.ste_um

    @property
    def converged(self) -> BoolArray:
        """(D, A)."""
        return self.solution.converged

    @cached_property
    def pressure_MPa(self) -> FloatArray:
        """Largest of all meshes, as `pmor.results.load_distribution.largest_pressure` has it, (D,)."""
        return self._edges[0]

    @cached_property
    def edge_load_N_per_mm(self) -> FloatArray:
        """Largest line load of sections in which the edge at a tip is in contact, (D,)."""
        return self._edges[1]

    @property
    def k_h_beta(self) -> FloatArray:
        """Largest face load factor of the meshes that carry, (D,)."""
        return np.fmax.reduce([self.solution.k_h_beta(mesh) for mesh in range(len(self.solution.train.meshes))])

    @property
    def root_stress_MPa(self) -> FloatArray:
        """Largest principal stress at the roots of all gears, (D,)."""
        return np.fmax.reduce([np.fmax.reduce(gear.max_principal_MPa, axis=1) for gear in self.solution.root_stress])

    @cached_property
    def _edges(self) -> tuple[FloatArray, FloatArray]:
        solved, largest = self.solution, list[tuple[FloatArray, FloatArray]]()
        for mesh in range(len(solved.placed.placed)):
            lines = solved.lines(mesh)
            found = largest_of(lines.load_N_per_mm, lines.offset_mm, lines.pressure_MPa)
            largest.append((largest_pressure(found[0], 1), found[1].max(axis=1)))
        return largest_pressure(np.array([of[0] for of in largest]), 0), np.max([of[1] for of in largest], axis=0)


@dataclass(frozen=True)
class _States:
    """Sections of a mesh, as `deviation_rates` needs them; `sensitivity` tells those that matter."""

    pair: IntArray
    z_mm: FloatArray
    mirrored: bool
    roll_rad: FloatArray
    sensitivity: FloatArray


class SetVariants:
    """Solves variants of a set at fixed angles and torques; threads may share it.

    Parameters
    ----------
    plan : SetPlan
    train : GearTrain
        Of `pmor.sets.run.train_of_variants`.
    torques_Nm : ndarray, shape (D,)
        On the first gear.
    angles : int
        Of a mesh cycle.
    pitches : int
        Mesh cycles.

    Attributes
    ----------
    phi : ndarray, shape (A,)
        Angles of the first gear, rad.
    """

    def __init__(self, plan: SetPlan, train: GearTrain, torques_Nm: FloatArray, angles: int, pitches: int) -> None:
        self.plan, self.train, self.torques_Nm = plan, train, np.asarray(torques_Nm, dtype=float)
        self.pitches = pitches
        pitch, cycle = train.meshes[0].pair.meshed.pair.pitch, plan.placed_pitches(pitches)
        self.phi = pitch * np.arange(pitches * angles) / angles
        self.placed = train.place(self.phi[: cycle * angles], plan.displacement)
        self._starts = range(0, pitches, cycle)
        self._workspaces = Workspaces(self.placed.blocks)

    @property
    def _loads(self) -> FloatArray:
        return np.asarray(1e3 * self.torques_Nm[:, None] * self.plan.load)

    def solve(self, built: BuiltSet) -> SetVariant:
        """Return the set as it is built in one way."""
        parts: list[list[LineResults]] = [[] for _ in self._starts]
        deviations: list[list[FloatArray]] = [[] for _ in self._starts]
        plan = replace(self.plan, displacement=built.displacement, eccentricity=built.eccentricity)
        for number, block in enumerate(self._workspaces.blocks):
            own = block.deviation(built.flanks)
            with self._workspaces.lent(number) as workspace:
                for start, pitch in enumerate(self._starts):
                    errors = errors_of(plan, block, pitch)
                    deviation = own + errors if errors.size else own
                    parts[start].append(solve_placed(block, self._loads, deviation, pitch, workspace))
                    deviations[start].append(deviation)
        found = joined_results([part for of_start in parts for part in of_start])
        return SetVariant(built, SetSolution(plan, self.placed, self.torques_Nm, found, self.pitches), deviations)

    def differentiate(self, variant: SetVariant, by_movement: FloatArray, by_force: FloatArray) -> FloatArray:
        """Return the derivatives of a figure by the deviation of each section, (D, A, N), per mm.

        Parameters
        ----------
        by_movement : ndarray, shape (D, A, K)
            Derivatives of the figure by the movements, per rad or mm.
        by_force : ndarray, shape (D, A, N)
            By the forces of the sections, per N.
        """
        rates, before = np.zeros(by_force.shape), 0
        for block, placed in enumerate(self._workspaces.blocks):
            with self._workspaces.lent(block) as workspace:
                for number, pitch in enumerate(self._starts):
                    first = number * len(self.placed.phi) + before
                    part = slice(first, first + len(placed.phi))
                    states = LineResults._make(
                        np.ascontiguousarray(values[:, part]) for values in variant.solution.found
                    )
                    rates[:, part] = placed.differentiate(
                        states, by_movement[:, part], by_force[:, part], variant.deviation[number][block], pitch,
                        workspace,
                    )  # fmt: skip
            before += len(placed.phi)
        return rates

    def by_parameters(
        self, variant: SetVariant, by_deviation: FloatArray, over_width: bool, wanted: Mapping[str, Collection[str]]
    ) -> dict[str, dict[str, float]]:
        """Return the derivatives of a figure by the parameters of all modifications, per unit of each.

        Parameters
        ----------
        by_deviation : ndarray, shape (D, A, N)
            As `differentiate` gives them.
        over_width, wanted
            As in `pmor.gear.deviation_rates.deviation_rates`, by the cases of the meshes: others are left out.

        Returns
        -------
        dict
            By case, and by ``gear.key`` in it.
        """
        # Places are the same each time.
        places = by_deviation.reshape(len(by_deviation), len(self._starts), len(self.placed.phi), -1)
        total = places.sum(axis=(0, 1))
        found: dict[str, dict[str, float]] = {}
        for mesh, one, assembly in zip(self.plan.meshes, self.placed.placed, variant.built.flanks, strict=True):
            if mesh.case not in wanted:
                continue
            states = _states(one, total[None, :, one.part])
            rates = deviation_rates(one.mesh.pair.meshed, assembly, states, over_width, wanted[mesh.case])
            of_case = found.setdefault(mesh.case, {})
            for name, rate in rates.items():
                # Deviations are in um, derivatives per mm.
                of_case[name] = of_case.get(name, 0.0) + 1e-3 * float(np.vdot(states.sensitivity[0], rate))
        return found


def _states(one: PlacedMesh, by_deviation: FloatArray) -> _States:
    """Return the sections of a mesh with the derivatives of a figure, (1, A, n)."""
    sections = one.mesh.pair.meshed.sections
    grid = len(one.lines.first_pair), -1, len(sections.z)
    roll = one.lines.roll.reshape(*grid, 2)
    pair = one.lines.first_pair[:, None] + np.arange(roll.shape[1])
    return _States(pair, sections.z, one.mesh.pair.meshed.mirrored, roll, by_deviation.reshape(1, *grid))
