"""The value of a variant: results under each torque, the objective with its derivatives, as drawn or over scatter."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, Protocol, Self, TypeVar

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.design.measures import (
    draw_weights,
    order_amplitude,
    order_of,
    order_rates,
    peak_to_peak,
    smooth_peak_to_peak,
)
from pmor.design.settings import Design
from pmor.design.variables import SEED


@dataclass(frozen=True)
class Verdict:
    """Results of a variant; NaN where a position did not converge."""

    x: FloatArray  # shape (n,): Values of the variables; NaN of what the file has
    results: FloatArray  # shape (T, R): Nominal, under each torque, in the order of `Design.results`
    objective: float  # Over scatter where the design asks for it
    limits: FloatArray  # shape (C,): Constrained results, the largest over the torques, of the same kind


class State(Protocol):
    """Attributes of a solved variant that all judges need: T torques, A angles."""

    @property
    def ste_um(self) -> FloatArray: ...  # noqa: D102

    @property
    def converged(self) -> BoolArray: ...  # noqa: D102


Built = TypeVar("Built")
Solved = TypeVar("Solved", bound=State)


class Judge(ABC, Generic[Built, Solved]):
    """Judges variants of a design; threads may share it.

    Parameters
    ----------
    base
        What is designed, as its file builds it.
    phi : ndarray, shape (A,)
        Angles that are solved, rad.
    pitches : int
        Mesh cycles that they cover: after so many it stands as before.
    """

    def __init__(self, design: Design, base: Built, phi: FloatArray, pitches: int) -> None:
        self.design, self.base, self.phi, self.pitches = design, base, phi, pitches
        weights = np.array(design.load.weights)
        self.weights = weights / weights.sum()
        self.draws = self.drawn(design.scatter.draws) if design.scatters else (None,)

    @property
    def moving_supports(self) -> bool:
        """Whether each load has supports of its own, so that no others can be judged."""
        return False

    @abstractmethod
    def alike(self, design: Design) -> Self:
        """Return the judge of another design of the same gears with as many angles."""

    @abstractmethod
    def on_angles(self, angles: int) -> Self:
        """Return the judge of the same design on so many angles per pitch."""

    @abstractmethod
    def drawn(self, count: int, seed: int = SEED) -> tuple[Any, ...]:
        """Return by how much so many of those that are made are off; none where nothing scatters."""

    @abstractmethod
    def assembly(self, x: Sequence[float] | FloatArray | None, draw: Any = None) -> Built:
        """Return what is built at some values of the variables, or with the flanks of the file, off by a draw."""

    @abstractmethod
    def solve(self, built: Built, differentiated: bool = False) -> Solved:
        """Return the state of what is built in one way; with derivatives where `measured` is to be asked of it."""

    @abstractmethod
    def lost(self, state: Solved) -> list[str]:
        """Return a sentence for each torque under which positions have no solution: why, and what to do."""

    @abstractmethod
    def measured(self, state: Solved, built: Built, sharpness: float) -> tuple[FloatArray, FloatArray]:
        """Return the objective made smooth under each torque, (T,), and the derivatives of its mean, (n,)."""

    @abstractmethod
    def rates(self, state: Solved, built: Built, sharpness: float) -> dict[str, float]:
        """Return the derivatives of the mean of the objective by all parameters of the modifications, by name."""

    @abstractmethod
    def result(self, key: str, state: Solved, built: Built) -> FloatArray:
        """Return one result, none of the STE, under each torque, (T,)."""

    def at_torques(self, torques_Nm: Sequence[float] | FloatArray) -> Self:
        """Return the judge of the same design, as drawn, under other torques that count the same."""
        torques = tuple(map(float, torques_Nm))
        load = replace(self.design.load, torques_Nm=torques, weights=(1.0,) * len(torques))
        return self.alike(replace(nominal(self.design), load=load))

    def results(self, built: Built, left: bool = False) -> FloatArray:
        """Return all results of what is built under each torque, (T, R), as `results_of` does."""
        return self.results_of(self.solve(built), built, left)

    def results_of(self, state: Solved, built: Built, left: bool = False) -> FloatArray:
        """Return all results of a state, (T, R).

        NaN under torques with a position that did not converge; where `left`, those of the positions that did.
        """
        found = [self._result(key, state, built) for key in self.design.results]
        table = np.stack(found, axis=1)
        there = state.converged.any(axis=1) if left else state.converged.all(axis=1)
        table[~there] = np.nan
        return table

    def figure(self, key: str, built: Built) -> FloatArray:
        """Return one result of what is built under each torque, (T,), as `results` has it; others are not found."""
        state = self.solve(built)
        return np.where(state.converged.all(axis=1), self._result(key, state, built), np.nan)

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
        objective = over[:, :, keys.index(design.objective.minimise)] @ self.weights
        limited = [over[:, :, keys.index(c.result)].max(axis=1) for c in design.constraints]
        limits = np.array([self._value(values) for values in limited])
        values = np.full(len(design.variables), np.nan) if x is None else np.asarray(x, dtype=float)
        return Verdict(values, nominal, self._value(objective), limits)

    def _value(self, values: FloatArray) -> float:
        """Return the mean or percentile of the values of all draws, as the design asks; NaN where one is."""
        return float(draw_weights(values, self.design.objective.value) @ values)

    def objective_of(self, x: FloatArray, draws: Sequence[Any]) -> FloatArray:
        """Return the objective of each of some draws, (m,)."""
        key = self.design.objective.minimise
        return np.array([self.figure(key, self.assembly(x, draw)) @ self.weights for draw in draws])

    def smooth(self, x: FloatArray, sharpness: float) -> tuple[float, FloatArray, FloatArray]:
        """Return the objective made smooth, its exact derivative by each variable, and the limits (C,).

        The sharpness, 1/um, or 1 of a factor, is that of `pmor.design.measures`.
        """
        values, slopes, limited = [], [], []
        for draw in self.draws:
            built = self.assembly(x, draw)
            state = self.solve(built, differentiated=True)
            measure, slope = self.measured(state, built, sharpness)
            values.append(measure @ self.weights)
            slopes.append(slope)
            limited.append([self._result(c.result, state, built).max() for c in self.design.constraints])
        found = np.array(values)
        weights = draw_weights(found, self.design.objective.value)
        limits = np.array([self._value(row) for row in np.array(limited).reshape(len(found), -1).T])
        return float(weights @ found), np.asarray(weights @ np.array(slopes)), limits

    def limits(self, x: FloatArray) -> FloatArray:
        """Return the constrained results alone, (C,)."""
        found = []
        for draw in self.draws:
            built = self.assembly(x, draw)
            state = self.solve(built)
            found.append([self._result(c.result, state, built).max() for c in self.design.constraints])
        return np.array([self._value(values) for values in np.array(found).T])

    def objective_rates(self, x: FloatArray) -> dict[str, float]:
        """Return the derivatives of the nominal objective, not smoothed, by each parameter of the modifications."""
        built = self.assembly(x)
        return self.rates(self.solve(built, differentiated=True), built, math.inf)

    def _result(self, key: str, state: Solved, built: Built) -> FloatArray:
        """Return one result under each torque, (T,)."""
        order = self._order(key)
        if order is not None:
            return order_amplitude(state.ste_um, order)
        return peak_to_peak(state.ste_um) if key == "peak_to_peak_um" else self.result(key, state, built)

    def _order(self, key: str) -> int | None:
        """Return the order of the curve over all pitches that a result is of; None of others."""
        order = order_of(key)
        return None if order is None else order * self.pitches

    def _of_ste(self, state: Solved, sharpness: float) -> tuple[FloatArray, FloatArray]:
        """Return a smooth figure of the STE under each torque, (T,), and its derivatives by the STE, (T, A)."""
        order = self._order(self.design.objective.minimise)
        return smooth_peak_to_peak(state.ste_um, sharpness) if order is None else order_rates(state.ste_um, order)


def nominal(design: Design) -> Design:
    """Return a design whose values are those of what is drawn."""
    return replace(design, objective=replace(design.objective, value="nominal"))


def at_load(design: Design, number: int) -> Design:
    """Return a design for one load alone, as drawn."""
    return replace(nominal(design), load=design.load.only(number))
