"""One pair built in very many ways: its state at the same few angles and torques, in some hundred microseconds each.

Where sections are and how flexible they are to each other does not depend on the flanks: it is found once for each
place of the axes and kept from one variant to the next. A state starts cold all the same, so that it depends on nothing
that was solved before, to the last bit.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.gear.condition import Assembly, Misalignment
from pmor.line.hubs import Hubs
from pmor.line.kernels.places import Lines
from pmor.line.kernels.types import LineResults
from pmor.line.layered_pair import LayeredPair
from pmor.line.pair import PlacedSections, joined_results
from pmor.results.load_distribution import at_tip_edges, largest_pressure
from pmor_online.line_sweep import loads_and_patches
from pmor_online.model import ReducedPair, on_hubs

# Memory of sections that stay placed for further variants on the same axes: a tolerance analysis draws thousands of
# axes, and a helical pair takes megabytes for each.
MOST_IDLE_BYTES = 1 << 29


@dataclass(frozen=True)
class VariantState:
    """State of one assembly: D torques, A angles, P tooth pairs that can touch, S sections over the width.

    Attributes
    ----------
    ste_um : (D, A)
        NaN where not converged.
    converged : (D, A) bool
    overloaded : (D, A) bool
        Whether a section is beyond the range of contact: those did not converge.
    load_N_per_mm : (D, A, P, S)
        Line load of each section; 0 where nothing is carried, or the position did not converge.
    edge_load_N_per_mm : (D, A)
        Largest line load of those sections in which the edge at a tip is in contact; 0 where there is none.
    pressure_MPa : (D, A)
        Largest of the sections, as `pmor.results.load_distribution.largest_pressure` has it.
    sensitivity : (D, A, P, S) or None
        Derivative of the STE by the deviation of the section, um/um.
    roll_rad : (A, P, S, 2)
        Roll angles on pinion and wheel.
    pair : (A, P) int
        Tooth pairs.
    z_mm, width_mm : (S,)
        Positions and widths of the sections.
    mirrored : bool
        Whether they have images.
    """

    ste_um: FloatArray
    converged: BoolArray
    overloaded: BoolArray
    load_N_per_mm: FloatArray
    edge_load_N_per_mm: FloatArray
    pressure_MPa: FloatArray
    sensitivity: FloatArray | None
    roll_rad: FloatArray
    pair: IntArray
    z_mm: FloatArray
    width_mm: FloatArray
    mirrored: bool


class Placed(NamedTuple):
    """Sections on some axes, on each support, and the memory that they take."""

    sections: list[PlacedSections]
    nbytes: int


class VariantSolver:
    """Solves variants of a pair at fixed angles and torques; threads may share it.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    phi : ndarray, shape (A,)
        Pinion angles, rad: all of them are kept in memory with their flexibilities, for the axes used last.
    torques_Nm : sequence of float
    hubs : sequence of Hubs
        What the hubs stand on under each torque; empty: they are held.
    """

    def __init__(
        self, reduced: ReducedPair, phi: FloatArray, torques_Nm: Sequence[float], hubs: Sequence[Hubs] = ()
    ) -> None:
        self.reduced, self.phi = reduced, np.ascontiguousarray(phi, dtype=float)
        self.torques_Nm, self.hubs = tuple(torques_Nm), tuple(hubs)
        # For each thread that was on the same axes, one for each of `supported`; the axes used last at the end.
        self._idle: OrderedDict[Misalignment, list[Placed]] = OrderedDict()
        self._idle_bytes = 0
        self._lock = threading.Lock()

    @cached_property
    def supported(self) -> tuple[tuple[ReducedPair, tuple[float, ...]], ...]:
        """The pair on each of its supports, with the torques on the pinion there, N m."""
        if not self.hubs:
            return ((self.reduced, self.torques_Nm),)
        on_supports = (on_hubs(self.reduced, hubs) for hubs in self.hubs)
        return tuple((pair, (torque,)) for pair, torque in zip(on_supports, self.torques_Nm, strict=True))

    def solve(self, assembly: Assembly, differentiated: bool = False) -> VariantState:
        """Return the state of the pair as it is built in one way.

        Parameters
        ----------
        assembly : Assembly
            Checked (`pmor.case.flanks`, `pmor.pair.modifications`).
        differentiated : bool
            With the derivatives of the STE.
        """
        with self._placed(assembly.misalignment) as (placed, _):
            first = placed[0]
            deviation = first.deviation(assembly)
            parts = [
                one.solve(1e3 * np.array(torques), False, deviation, differentiated)
                for one, (_, torques) in zip(placed, self.supported, strict=True)
            ]
        found = parts[0] if len(parts) == 1 else joined_results(parts, axis=0)
        wide = first.width_limit.exceeded(found.force)
        return self._state(first.lines, found._replace(converged=found.converged & ~wide), wide)

    def _state(self, lines: Lines, found: LineResults, wide: BoolArray) -> VariantState:
        meshed, sections = self.reduced.layered, self.reduced.layered.sections
        load, patches = loads_and_patches(lines.law, found.force, found.converged, meshed.width)
        pressure, edge_load = largest_of(load, patches[..., 1], patches[..., 2])
        radius = meshed.pair.pinion.base_radius
        return VariantState(
            ste_um=np.where(found.converged, 1e3 * radius * found.advance, np.nan), converged=found.converged,
            overloaded=wide,
            load_N_per_mm=load, edge_load_N_per_mm=edge_load, pressure_MPa=pressure,
            sensitivity=radius * found.sensitivity.reshape(load.shape) if found.sensitivity.size else None,
            roll_rad=lines.roll.reshape(*load.shape[1:], 2), pair=lines.first_pair[:, None] + np.arange(load.shape[2]),
            z_mm=sections.z, width_mm=sections.width, mirrored=meshed.mirrored,
        )  # fmt: skip

    @contextmanager
    def _placed(self, misalignment: Misalignment) -> Iterator[Placed]:
        """Lend the sections on some axes, on each support.

        Solving makes flexibilities ready in them, which is for one at a time.
        """
        with self._lock:
            placed = self._take(misalignment)
        if placed is None:
            made = self._place(misalignment)
            placed = Placed(made, _size(made))
        try:
            yield placed
        finally:
            with self._lock:
                self._keep(misalignment, placed)

    def _place(self, misalignment: Misalignment) -> list[PlacedSections]:
        """Place the sections; loads share flexibilities where their supports are as flexible, as linear ones are."""
        found = list[PlacedSections]()
        for pair, _ in self.supported:
            alike = (one for one in found if _as_flexible(one.pair.meshed, pair.layered))
            one = next(alike, None)
            found.append(pair.lines.place(self.phi, misalignment) if one is None else one.on(pair.lines))
        return found

    def _take(self, misalignment: Misalignment) -> Placed | None:
        alike = self._idle.get(misalignment)
        if not alike:
            return None
        placed = alike.pop()
        self._idle_bytes -= placed.nbytes
        return placed

    def _keep(self, misalignment: Misalignment, placed: Placed) -> None:
        """Keep the sections for the next variant on these axes; the axes not used for longest go."""
        self._idle.setdefault(misalignment, []).append(placed)
        self._idle.move_to_end(misalignment)
        self._idle_bytes += placed.nbytes
        while len(self._idle) > 1 and self._idle_bytes > MOST_IDLE_BYTES:
            _, longest = self._idle.popitem(last=False)
            self._idle_bytes -= sum(placed.nbytes for placed in longest)


def largest_of(load: FloatArray, offset: FloatArray, pressure: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return pressure (MPa) and line load at an edge (N/mm) as `VariantState` has them, each (D, A).

    Parameters are (D, A, P, S), as `LineStates` has them.
    """
    return largest_pressure(pressure, (2, 3)), at_tip_edges(load, offset).max(axis=(2, 3))


def _as_flexible(one: LayeredPair, other: LayeredPair) -> bool:
    return (
        one.hubs is not None and other.hubs is not None and np.array_equal(one.hubs.compliance, other.hubs.compliance)
    )


def _size(placed: list[PlacedSections]) -> int:
    return sum({id(array): array.nbytes for one in placed for array in one.arrays}.values())
