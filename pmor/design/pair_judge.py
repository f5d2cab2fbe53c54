"""Variants of a pair, held at its hubs or on the supports of a gearbox, by its line loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray
from pmor.design.fine_solver import FineSolver
from pmor.design.judge import Judge
from pmor.design.settings import Design
from pmor.design.variables import AS_DRAWN, SEED, Draw, assembly_at, drawn
from pmor.gear.condition import Assembly
from pmor.gear.deviation_rates import deviation_rates
from pmor.line.hubs import Hubs
from pmor.line.lost import lost_of_pair
from pmor.pair.conditions import conditions_of_assembly
from pmor.results.load_distribution import face_load_factor, largest_pressure
from pmor_online.model import ReducedPair, online_angles
from pmor_online.root_stress import root_stress
from pmor_online.variants import VariantSolver, VariantState


class PairJudge(Judge[Assembly, VariantState]):
    """Judges variants of a pair.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    base : Assembly
        The pair of the case.
    solver : VariantSolver, optional
        Of the same pair, angles and loads, where there is one: it keeps sections that are placed.
    hubs : sequence of Hubs
        What the hubs stand on under each load; empty: they are held.
    fine : dict of int to FineSolver, optional
        Of the same pair and loads, by the angles to a pitch.
    """

    def __init__(
        self, reduced: ReducedPair, design: Design, base: Assembly, solver: VariantSolver | None = None,
        hubs: Sequence[Hubs] = (), fine: dict[int, FineSolver] | None = None,
    ) -> None:  # fmt: skip
        # After which holes, and teeth that differ, stand to the mesh as before.
        pitches = reduced.basis.case.pair.repeats_with([(base.pinion, base.wheel)])
        phi = online_angles(reduced.meshed.pair.pitch, design.search.angles, pitches)
        super().__init__(design, base, phi, pitches)
        self.reduced = reduced
        self.solver = solver or VariantSolver(reduced, phi, design.load.torques_Nm, hubs)
        self._fine: dict[int, FineSolver] = {} if fine is None else fine
        self._over_width = meshed_width(reduced.basis.case) != "plane_strain"

    @property
    def moving_supports(self) -> bool:
        """Whether hubs stand on supports that go with the loads."""
        return bool(self.solver.hubs)

    def alike(self, design: Design) -> PairJudge:
        """Return the judge of another design of the same pair with as many angles."""
        own, load = self.design.load, design.load
        if (load.torques_Nm, load.names) == (own.torques_Nm, own.names):
            return PairJudge(self.reduced, design, self.base, self.solver, fine=self._fine)
        hubs = [self.solver.hubs[own.names.index(name)] for name in load.names if self.solver.hubs]
        return PairJudge(self.reduced, design, self.base, hubs=hubs)

    def on_angles(self, angles: int) -> PairJudge:
        """Return the judge of the same design on so many angles per pitch."""
        design = replace(self.design, search=replace(self.design.search, angles=angles))
        if angles not in self._fine:
            phi = online_angles(self.reduced.meshed.pair.pitch, angles, self.pitches)
            half = None if angles % 2 else self._fine.get(angles // 2)
            solver = FineSolver(self.reduced, phi, self.solver.torques_Nm, self.solver.hubs, half)
            self._fine.setdefault(angles, solver)  # threads share the first one
        return PairJudge(self.reduced, design, self.base, self._fine[angles], fine=self._fine)

    def drawn(self, count: int, seed: int = SEED) -> tuple[Draw, ...]:
        """Return by how much the flanks and axes of so many pairs are off; none where nothing scatters."""
        return drawn(self.design.scatter, count, seed)

    def assembly(self, x: Sequence[float] | FloatArray | None, draw: Draw | None = None) -> Assembly:
        """Return the pair at some values of the variables, or with the flanks of its file, off by a draw."""
        if x is None:
            return assembly_at(self.base, (), (), draw or AS_DRAWN)
        return assembly_at(self.base, self.design.variables, x, draw or AS_DRAWN)

    def solve(self, built: Assembly, differentiated: bool = False) -> VariantState:
        """Return the state of a pair."""
        return self.solver.solve(built, differentiated)

    def lost(self, state: VariantState) -> list[str]:
        """Return a sentence for each torque under which positions have no solution."""
        return lost_of_pair(self.design.load.labels, state.converged, state.overloaded)

    def measured(self, state: VariantState, built: Assembly, sharpness: float) -> tuple[FloatArray, FloatArray]:
        """Return the objective made smooth under each torque, (T,), and the derivatives of its mean, (n,)."""
        measure, by_ste = self._of_ste(state, sharpness)
        return measure, np.einsum("t,ta,kta->k", self.weights, by_ste, self.ste_rates(state, built))

    def ste_rates(self, state: VariantState, assembly: Assembly) -> FloatArray:
        """Return d STE / d variable, (n, T, A), of a state that was solved with derivatives."""
        wanted = [f"{gear}.{variable.key}" for variable in self.design.variables for gear in variable.gears]
        rates = self._rates(state, assembly, wanted)
        found = np.zeros((len(self.design.variables), *state.ste_um.shape))
        for k, variable in enumerate(self.design.variables):
            for gear in variable.gears:
                # By where a relief starts that there is none of yet: nothing.
                rate = rates.get(f"{gear}.{variable.key}")
                if rate is not None:
                    found[k] += rate
        return found

    def rates(self, state: VariantState, built: Assembly, sharpness: float) -> dict[str, float]:
        """Return the derivatives of the mean of the objective by all parameters of the modifications, by name."""
        by_ste = self._of_ste(state, sharpness)[1]
        return {
            name: float(np.einsum("t,ta,ta->", self.weights, by_ste, rate))
            for name, rate in self._rates(state, built).items()
        }

    def _rates(self, state: VariantState, assembly: Assembly, wanted: Sequence[str] = ()) -> dict[str, FloatArray]:
        assert state.sensitivity is not None
        rates = deviation_rates(self.reduced.meshed, assembly, state, self._over_width, wanted)  # type: ignore[arg-type]
        return {name: np.einsum("daps,aps->da", state.sensitivity, rate) for name, rate in rates.items()}

    def result(self, key: str, state: VariantState, built: Assembly) -> FloatArray:
        """Return one result, none of the STE, under each torque, (T,)."""
        if key == "pressure_MPa":
            return largest_pressure(state.pressure_MPa, 1)
        if key == "tip_edge_load_N_per_mm":
            return np.asarray(state.edge_load_N_per_mm.max(axis=1))
        if key == "k_h_beta":
            return face_load_factor(state)
        found = []
        for pair, torques in self.solver.supported:
            stress = root_stress(pair, self.solver.phi, conditions_of_assembly(built, torques))
            assert stress is not None
            found.append(np.nanmax(stress.max_principal_MPa.reshape(len(torques), -1), axis=1))
        return np.concatenate(found)
