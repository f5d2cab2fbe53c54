"""The value of a variant: results under each torque, the objective with its derivatives, as drawn or over scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray
from pmor.design.measures import draw_weights, order_amplitude, order_of, peak_to_peak, smooth_peak_to_peak
from pmor.design.settings import Design
from pmor.design.variables import AS_DRAWN, Draw, assembly_at, drawn
from pmor.gear.condition import Assembly
from pmor.gear.deviation_rates import deviation_rates
from pmor.line.hubs import Hubs
from pmor.pair.conditions import conditions_of_assembly
from pmor.results.load_distribution import face_load_factor
from pmor_online.model import ReducedPair, online_angles
from pmor_online.root_stress import root_stress
from pmor_online.variants import VariantSolver, VariantState


@dataclass(frozen=True)
class Verdict:
    """Results of a variant; NaN where a position did not converge."""

    x: FloatArray  # shape (n,): Values of the variables
    results: FloatArray  # shape (T, R): Nominal, under each torque, in the order of `Design.results`
    objective: float  # Over scatter where the design asks for it
    limits: FloatArray  # shape (C,): Constrained results, the largest over the torques, of the same kind


class Judge:
    """Judges variants of a design; threads may share it.

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
    """

    def __init__(
        self, reduced: ReducedPair, design: Design, base: Assembly, solver: VariantSolver | None = None,
        hubs: Sequence[Hubs] = (),
    ) -> None:  # fmt: skip
        self.reduced, self.design, self.base = reduced, design, base
        # Pitches after which holes stand to the mesh as before; 1 without holes.
        self.pitches = reduced.basis.case.pair.repeats_after
        phi = online_angles(reduced.meshed.pair.pitch, design.search.angles, self.pitches)
        self.solver = solver or VariantSolver(reduced, phi, design.load.torques_Nm, hubs)
        weights = np.array(design.load.weights)
        self.weights = weights / weights.sum()
        self.draws = drawn(design.scatter, design.scatter.draws) if design.scatters else (AS_DRAWN,)
        self._over_width = meshed_width(reduced.basis.case) != "plane_strain"

    def alike(self, design: Design) -> Judge:
        """Return the judge of another design of the same pair with as many angles."""
        own, load = self.design.load, design.load
        if (load.torques_Nm, load.names) == (own.torques_Nm, own.names):
            return Judge(self.reduced, design, self.base, self.solver)
        hubs = [self.solver.hubs[own.names.index(name)] for name in load.names if self.solver.hubs]
        return Judge(self.reduced, design, self.base, hubs=hubs)

    def at_torques(self, torques_Nm: Sequence[float] | FloatArray) -> Judge:
        """Return the judge of the same design, as drawn, under other torques that count the same."""
        torques = tuple(map(float, torques_Nm))
        load = replace(self.design.load, torques_Nm=torques, weights=(1.0,) * len(torques))
        return self.alike(replace(nominal(self.design), load=load))

    def assembly(self, x: Sequence[float] | FloatArray, draw: Draw = AS_DRAWN) -> Assembly:
        """Return the pair at some values of the variables."""
        return assembly_at(self.base, self.design.variables, x, draw)

    def results(self, assembly: Assembly) -> FloatArray:
        """Return all results of a pair under each torque, (T, R)."""
        return self.results_of(self.solver.solve(assembly), assembly)

    def results_of(self, state: VariantState, assembly: Assembly) -> FloatArray:
        """Return all results of a pair in a state, (T, R)."""
        found = [self._result(key, state, assembly) for key in self.design.results]
        table = np.stack(found, axis=1)
        table[~state.converged.all(axis=1)] = np.nan
        return table

    def verdict(self, x: FloatArray) -> Verdict:
        """Judge one variant."""
        nominal = self.results(self.assembly(x))
        return self.verdict_of(x, nominal, self.scattered(x) if self.design.scatters else nominal[None])

    def scattered(self, x: FloatArray) -> FloatArray:
        """Return all results of each pair that is drawn, (draws, T, R)."""
        return np.stack([self.results(self.assembly(x, draw)) for draw in self.draws])

    def verdict_of(self, x: FloatArray, nominal: FloatArray, over: FloatArray) -> Verdict:
        """Return the verdict on a variant by its results as drawn, (T, R), and over scatter, (draws, T, R)."""
        design, keys = self.design, self.design.results
        objective = over[:, :, keys.index(design.objective.minimise)] @ self.weights
        limited = [over[:, :, keys.index(c.result)].max(axis=1) for c in design.constraints]
        limits = np.array([self._value(values) for values in limited])
        return Verdict(np.asarray(x, dtype=float), nominal, self._value(objective), limits)

    def _value(self, values: FloatArray) -> float:
        """Return the mean or percentile of the values of all draws, as the design asks; NaN where one is."""
        return float(draw_weights(values, self.design.objective.value) @ values)

    def objective_of(self, x: FloatArray, draws: Sequence[Draw]) -> FloatArray:
        """Return the objective of each pair that is drawn, (m,)."""
        column = self.design.results.index(self.design.objective.minimise)
        return np.array([self.results(self.assembly(x, draw))[:, column] @ self.weights for draw in draws])

    def smooth(self, x: FloatArray, sharpness: float) -> tuple[float, FloatArray, FloatArray]:
        """Return the objective made smooth, its exact derivative by each variable, and the limits (C,).

        The sharpness, 1/um, is that of `pmor.design.measures`.
        """
        values, slopes, limited = [], [], []
        for draw in self.draws:
            assembly = self.assembly(x, draw)
            state = self.solver.solve(assembly, differentiated=True)
            measure, by_ste = self._measure(state.ste_um, sharpness)
            values.append(measure @ self.weights)
            slopes.append(np.einsum("t,ta,kta->k", self.weights, by_ste, self.ste_rates(state, assembly)))
            limited.append([self._result(c.result, state, assembly).max() for c in self.design.constraints])
        found = np.array(values)
        weights = draw_weights(found, self.design.objective.value)
        limits = np.array([self._value(row) for row in np.array(limited).reshape(len(found), -1).T])
        return float(weights @ found), np.asarray(weights @ np.array(slopes)), limits

    def limits(self, x: FloatArray) -> FloatArray:
        """Return the constrained results alone, (C,)."""
        found = []
        for draw in self.draws:
            assembly = self.assembly(x, draw)
            state = self.solver.solve(assembly)
            found.append([self._result(c.result, state, assembly).max() for c in self.design.constraints])
        return np.array([self._value(values) for values in np.array(found).T])

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

    def objective_rates(self, x: FloatArray) -> dict[str, float]:
        """Return the derivatives of the nominal objective, not smoothed, by each parameter of the modifications."""
        assembly = self.assembly(x)
        state = self.solver.solve(assembly, differentiated=True)
        order = self._order(self.design.objective.minimise)
        if order is None:
            torque = np.arange(len(state.ste_um))
            weights = np.zeros(state.ste_um.shape)
            weights[torque, state.ste_um.argmax(axis=1)] = 1.0
            weights[torque, state.ste_um.argmin(axis=1)] -= 1.0
        else:
            weights = order_amplitude(state.ste_um, order)[1]
        return {
            name: float(np.einsum("t,ta,ta->", self.weights, weights, rate))
            for name, rate in self._rates(state, assembly).items()
        }

    def _rates(self, state: VariantState, assembly: Assembly, wanted: Sequence[str] = ()) -> dict[str, FloatArray]:
        assert state.sensitivity is not None
        rates = deviation_rates(self.reduced.meshed, assembly, state, self._over_width, wanted)  # type: ignore[arg-type]
        return {name: np.einsum("daps,aps->da", state.sensitivity, rate) for name, rate in rates.items()}

    def _order(self, key: str) -> int | None:
        """Return the order of the curve over all pitches that a result is of; None of others."""
        order = order_of(key)
        return None if order is None else order * self.pitches

    def _measure(self, ste_um: FloatArray, sharpness: float) -> tuple[FloatArray, FloatArray]:
        order = self._order(self.design.objective.minimise)
        return smooth_peak_to_peak(ste_um, sharpness) if order is None else order_amplitude(ste_um, order)

    def _result(self, key: str, state: VariantState, assembly: Assembly) -> FloatArray:
        """Return one result under each torque, (T,)."""
        order = self._order(key)
        if order is not None:
            return order_amplitude(state.ste_um, order)[0]
        if key == "peak_to_peak_um":
            return peak_to_peak(state.ste_um)
        if key == "pressure_MPa":
            return np.asarray(state.pressure_MPa.max(axis=1))
        if key == "tip_edge_load_N_per_mm":
            return np.asarray(state.edge_load_N_per_mm.max(axis=1))
        if key == "k_h_beta":
            return face_load_factor(state)
        found = []
        for pair, torques in self.solver.supported:
            stress = root_stress(pair, self.solver.phi, conditions_of_assembly(assembly, torques))
            assert stress is not None
            found.append(np.nanmax(stress.max_principal_MPa.reshape(len(torques), -1), axis=1))
        return np.concatenate(found)


def nominal(design: Design) -> Design:
    """Return a design whose values are those of the pair as drawn."""
    return replace(design, objective=replace(design.objective, value="nominal"))


def at_load(design: Design, number: int) -> Design:
    """Return a design for one load alone, as drawn."""
    return replace(nominal(design), load=design.load.only(number))
