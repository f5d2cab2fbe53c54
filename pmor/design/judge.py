"""The value of a variant: results under each load, the objective with its derivatives, as drawn or over scatter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.design.elements import Elements
from pmor.design.files import of_case, parameter_names
from pmor.design.measures import draw_weights, order_amplitude, order_of, peak_to_peak, smooth_top
from pmor.design.settings import Design
from pmor.design.solvers import Built, Solver, State, Wanted
from pmor.design.variables import AS_DRAWN, SEED, Made, assembly_at, drawn

# Of the range of a variable, for the derivative of a figure that has no exact one.
DIFFERENCE = 1e-3
#: state of each solver
States = tuple[Any, ...]


@dataclass(frozen=True)
class Verdict:
    """Results of a variant; NaN where a position did not converge."""

    x: FloatArray  # shape (n,): Values of the variables; NaN of what the file has
    results: FloatArray  # shape (T, R): Nominal, under each load, in the order of `Design.results`
    objective: float  # Over scatter where the design asks for it
    limits: FloatArray  # shape (C,): Constrained results, the largest over the loads, of the same kind


class Judge:
    """Judges variants of a design; threads may share it.

    Parameters
    ----------
    elements : Elements
    design : Design
        That of the file, by default, or another one of the same gears.
    on_supports : bool
        As of `Elements.solvers`.
    known : dict, optional
        Solvers by their loads and the angles to a mesh cycle: they keep what is placed.
    """

    def __init__(
        self, elements: Elements, design: Design | None = None, on_supports: bool = True,
        known: dict[tuple[object, ...], tuple[Solver, ...]] | None = None,
    ) -> None:  # fmt: skip
        self.elements, self.file, self.on_supports = elements, elements.file, on_supports
        self.design = elements.file.design if design is None else design
        self._known = {} if known is None else known
        self.solvers = self._solvers()
        weights = np.array(self.design.load.weights)
        self.weights = weights / weights.sum()
        base = self.file.base
        self.base = Built(tuple(base[name] for name in self.file.meshes))
        self._variables = {name: of_case(self.design.variables, self.file.flanks, name) for name in base}
        self.draws = self.drawn(self.design.scatter.draws) if self.design.scatters else (None,)

    def _solvers(self) -> tuple[Solver, ...]:
        load, angles = self.design.load, self.design.search.angles
        loads = load.torques_Nm, load.names
        if (loads, angles) not in self._known:
            half = () if angles % 2 else self._known.get((loads, angles // 2), ())
            searched = self.file.design.search.angles == angles
            solvers = self.elements.solvers(load, angles, self.on_supports, half, searched)
            self._known.setdefault((loads, angles), solvers)  # threads share the first ones
        return self._known[loads, angles]

    @property
    def phi(self) -> FloatArray:
        """Angles of the first solver, rad."""
        return self.solvers[0].phi

    @property
    def pitches(self) -> int:
        """Mesh cycles of the first solver: after so many it stands as before."""
        return self.solvers[0].pitches

    @property
    def positions(self) -> int:
        """Positions of a variant under one load."""
        return sum(len(solver.phi) for solver in self.solvers)

    @property
    def moving_supports(self) -> bool:
        """Whether each load has supports of its own, so that no others can be judged."""
        return bool(self.elements.loads) and self.on_supports

    def alike(self, design: Design) -> Judge:
        """Return the judge of another design of the same gears."""
        return Judge(self.elements, design, self.on_supports, self._known)

    def on_angles(self, angles: int) -> Judge:
        """Return the judge of the same design on so many angles per pitch."""
        return self.alike(replace(self.design, search=replace(self.design.search, angles=angles)))

    def at_torques(self, torques_Nm: Sequence[float] | FloatArray) -> Judge:
        """Return the judge of the same design, as drawn, under other torques that count the same."""
        torques = tuple(map(float, torques_Nm))
        load = replace(self.design.load, torques_Nm=torques, names=(), weights=(1.0,) * len(torques))
        return Judge(self.elements, replace(nominal(self.design), load=load), self.on_supports)

    def drawn(self, count: int, seed: int = SEED) -> tuple[Made, ...]:
        """Return by how much so many of those that are made are off; none where nothing scatters."""
        return drawn(self.file, self.design.scatter, count, seed)

    def assembly(self, x: Sequence[float] | FloatArray | None, draw: Made | None = None) -> Built:
        """Return what is built at some values of the variables, or with the flanks of the file, off by a draw."""
        off = (AS_DRAWN,) * len(self.base.flanks) if draw is None else draw.meshes
        flanks = []
        for name, base, of_mesh in zip(self.file.meshes, self.base.flanks, off, strict=True):
            own = {} if x is None else self._variables[name]
            values = [] if x is None else [x[number] for number in own]
            flanks.append(assembly_at(base, list(own.values()), values, of_mesh))
        return Built(tuple(flanks), None if draw is None else draw.displacement)

    def solve(self, built: Built, differentiated: bool = False) -> States:
        """Return the states of what is built in one way; with derivatives where those of a figure are asked for."""
        return tuple(solver.solve(built, differentiated) for solver in self.solvers)

    def lost(self, states: States) -> list[str]:
        """Return a sentence for each load under which positions have no solution: why, and what to do."""
        sentences = []
        for solver, state in zip(self.solvers, states, strict=True):
            names = [f"{solver.name}, {label}" if self.design.several else label for label in self.design.load.labels]
            sentences += solver.lost(state, names)
        return sentences

    def results(self, built: Built, left: bool = False) -> FloatArray:
        """Return all results of what is built under each load, (T, R), as `results_of` does."""
        return self.results_of(self.solve(built), built, left)

    def results_of(self, states: States, built: Built, left: bool = False) -> FloatArray:
        """Return all results of the states, (T, R).

        NaN under loads with a position that did not converge; where `left`, those of the positions that did.
        """
        table = np.stack([self._result(key, states, built) for key in self.design.results], axis=1)
        table[~self._there(states, left)] = np.nan
        return table

    def _there(self, states: States, left: bool = False) -> Any:
        there = [state.converged.any(axis=1) if left else state.converged.all(axis=1) for state in states]
        return np.all(there, axis=0)

    def figure(self, key: str, built: Built) -> FloatArray:
        """Return one result of what is built under each load, (T,), as `results` has it; others are not found."""
        states = self.solve(built)
        return np.where(self._there(states), self._result(key, states, built), np.nan)

    def verdict(self, x: FloatArray | None, left: bool = False) -> Verdict:
        """Judge one variant, None is what the file has; of the positions that converged where `left`."""
        nominal = self.results(self.assembly(x), left)
        return self.verdict_of(x, nominal, self.scattered(x, left) if self.design.scatters else nominal[None])

    def scattered(self, x: FloatArray | None, left: bool = False) -> FloatArray:
        """Return all results of each draw, (draws, T, R), as `results_of` does."""
        return np.stack([self.results(self.assembly(x, draw), left) for draw in self.draws])

    def verdict_of(self, x: FloatArray | None, nominal: FloatArray, over: FloatArray) -> Verdict:
        """Return the verdict on a variant by its results as drawn, (T, R), and over scatter, (draws, T, R)."""
        design, keys = self.design, self.design.results
        objective = over[:, :, keys.index(design.objective.key)] @ self.weights
        limited = [over[:, :, keys.index(c.key)].max(axis=1) for c in design.constraints]
        limits = np.array([self._value(values) for values in limited])
        values = np.full(len(design.variables), np.nan) if x is None else np.asarray(x, dtype=float)
        return Verdict(values, nominal, self._value(objective), limits)

    def _value(self, values: FloatArray) -> float:
        """Return the mean or percentile of the values of all draws, as the design asks; NaN where one is."""
        return float(draw_weights(values, self.design.objective.value) @ values)

    def objective_of(self, x: FloatArray, draws: Sequence[Any]) -> FloatArray:
        """Return the objective of each of some draws, (m,)."""
        key = self.design.objective.key
        return np.array([self.figure(key, self.assembly(x, draw)) @ self.weights for draw in draws])

    def smooth(self, x: FloatArray, sharpness: float) -> tuple[float, FloatArray, FloatArray]:
        """Return the objective made smooth, its derivative by each variable, and the limits (C,).

        The derivative is exact, but of the face load factor of meshes that are solved by themselves. The sharpness,
        1/um, or 1 of a factor, is that of `pmor.design.measures`.
        """
        wanted: Wanted = {
            name: {f"{gear}.{variable.key}" for variable in own.values() for gear in variable.gears}
            for name, own in self._variables.items() if own
        }  # fmt: skip
        values, slopes, limited = [], [], []
        for draw in self.draws:
            built = self.assembly(x, draw)
            states = self.solve(built, differentiated=True)
            measure, rates = self._measured(states, built, sharpness, wanted)
            values.append(measure)
            slopes.append(self._quotients(x, draw, sharpness) if rates is None else self._by_variables(rates))
            limited.append([self._result(c.key, states, built).max() for c in self.design.constraints])
        measured = np.array(values)
        weights = draw_weights(measured, self.design.objective.value)
        limits = np.array([self._value(row) for row in np.array(limited).reshape(len(measured), -1).T])
        return float(weights @ measured), np.asarray(weights @ np.array(slopes)), limits

    def _measured(
        self, states: States, built: Built, sharpness: float, wanted: Wanted | None
    ) -> tuple[float, dict[str, dict[str, float]] | None]:
        """Return the mean of the smooth objective, and its derivatives by parameters where it has exact ones."""
        goal = self.design.objective
        chosen = [(solver, state) for solver, state in zip(self.solvers, states, strict=True)
                  if goal.key == goal.minimise or solver.name == goal.meshes]  # fmt: skip
        pairs = [solver.measured(goal.minimise, state, built, sharpness) for solver, state in chosen]
        measures = np.array([measure for measure, _ in pairs])
        total, shares = measures.sum(axis=0), np.ones(measures.shape)
        if goal.meshes == "worst" and len(pairs) > 1:
            total, by_mesh = smooth_top(measures.T, sharpness)
            shares = by_mesh.T
        value = float(total @ self.weights)
        if wanted is None or any(slope is None for _, slope in pairs):
            return value, None
        rates: dict[str, dict[str, float]] = {}
        for (solver, state), (_, slope), share in zip(chosen, pairs, shares, strict=True):
            rates |= solver.rates(state, built, slope, self.weights * share, wanted)
        return value, rates

    def _by_variables(self, rates: dict[str, dict[str, float]]) -> FloatArray:
        sums = np.zeros(len(self.design.variables))
        for name, own in self._variables.items():
            for number, variable in own.items():
                # By where a relief starts that there is none of yet: nothing.
                sums[number] += sum(rates.get(name, {}).get(f"{gear}.{variable.key}", 0.0) for gear in variable.gears)
        return sums

    def _quotients(self, x: FloatArray, draw: Made | None, sharpness: float) -> FloatArray:
        """Return the derivatives of the smooth objective of a draw by each variable, as quotients of differences."""
        quotients = np.zeros(len(x))
        for number, variable in enumerate(self.design.variables):
            low, high = variable.range
            step, ends = DIFFERENCE * (high - low), []
            for way in (-0.5, 0.5):
                further = np.array(x, dtype=float)
                further[number] = min(max(x[number] + way * step, low), high)
                built = self.assembly(further, draw)
                ends.append((further[number], self._measured(self.solve(built), built, sharpness, None)[0]))
            quotients[number] = (ends[1][1] - ends[0][1]) / (ends[1][0] - ends[0][0])
        return quotients

    def limits(self, x: FloatArray) -> FloatArray:
        """Return the constrained results alone, (C,)."""
        rows = []
        for draw in self.draws:
            built = self.assembly(x, draw)
            states = self.solve(built)
            rows.append([self._result(c.key, states, built).max() for c in self.design.constraints])
        return np.array([self._value(values) for values in np.array(rows).T])

    def objective_rates(self, x: FloatArray) -> dict[str, float]:
        """Return the exact derivatives of the nominal objective by all parameters of the modifications, by name."""
        built, names, totals = self.assembly(x), parameter_names(self.file.flanks), dict[str, float]()
        states = self.solve(built, differentiated=True)
        rates = self._measured(states, built, math.inf, dict.fromkeys(self._variables, ()))[1]
        for name, of_parameters in (rates or {}).items():
            for parameter, rate in of_parameters.items():
                gear, _, key = parameter.partition(".")
                told = f"{names[name, gear]}.{key}"
                totals[told] = totals.get(told, 0.0) + rate
        return totals

    def _result(self, key: str, states: States, built: Built) -> FloatArray:
        """Return one result under each load, (T,): of one mesh, or over all of them."""
        mesh, _, plain = key.rpartition(".")
        results = [
            _figure(plain, solver, state, built) for solver, state in zip(self.solvers, states, strict=True)
            if mesh in ("", solver.name)
        ]  # fmt: skip
        goal = self.design.objective
        if len(results) > 1 and key == goal.minimise and goal.meshes == "sum":
            return np.asarray(np.sum(results, axis=0))
        return results[0] if len(results) == 1 else np.fmax.reduce(results)


def _figure(key: str, solver: Solver, state: State, built: Built) -> FloatArray:
    """Return one result of a solver under each load, (T,)."""
    order = order_of(key)
    if order is not None:  # of the curve over all mesh cycles
        return order_amplitude(state.ste_um, order * solver.pitches)
    return peak_to_peak(state.ste_um) if key == "peak_to_peak_um" else solver.result(key, state, built)


def nominal(design: Design) -> Design:
    """Return a design whose values are those of what is drawn."""
    return replace(design, objective=replace(design.objective, value="nominal"))


def at_load(design: Design, number: int) -> Design:
    """Return a design for one load alone, as drawn."""
    return replace(nominal(design), load=design.load.only(number))
