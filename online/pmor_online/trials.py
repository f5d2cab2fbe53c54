"""A mesh with other flanks: its figures under all loads of its file, and the sections into which a trial goes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Protocol, Self

import numpy as np

from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray
from pmor.gear.condition import Assembly
from pmor.gear.modification import Modification
from pmor.line.hubs import Hubs
from pmor.results.load_distribution import face_load_factor, largest_pressure
from pmor_online.model import ReducedPair, online_angles
from pmor_online.variants import VariantSolver, VariantState

#: keys of modifications with their values, by gear
Trial = Mapping[str, Mapping[str, float]]
#: figures by their keys, under one load or all
Figures = Mapping[str, FloatArray]
# Angles of a pitch on which flanks are tried, and numbers of positions and sections beyond which none are.
FEW_ANGLES, MOST_NUMBERS = 16, 30_000_000
# Of the module: relief and crowning of more are no modifications any more.
MOST_IN_MODULES = 0.02


class Tried(Protocol):
    """A mesh, or a set of meshes, with other flanks: D loads, of which flanks are sought for one."""

    @property
    def gears(self) -> tuple[str, ...]:
        """Names of the gears."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Loads in words."""

    @property
    def load(self) -> int:
        """Number of the load that flanks are sought for."""

    @property
    def part(self) -> str:
        """What figures are of; empty where there is one part alone."""

    @property
    def evaluations(self) -> int:
        """Of a search."""

    @property
    def whole_width(self) -> bool:
        """Whether both halves of the face may differ."""

    @property
    def over_width(self) -> bool:
        """Whether anything differs over the face."""

    @property
    def most_um(self) -> float:
        """Largest amount of a relief."""

    @property
    def size_um(self) -> float:
        """By how much flanks stand askew, about."""

    @property
    def width_mm(self) -> float:
        """Common face width."""

    def filed(self, gear: str) -> Modification:
        """Return the flanks of a gear as they are filed."""

    def having(self, trial: Trial, loads: Sequence[str] | None = None) -> Self:
        """Return it with a trial in its file, under some loads alone."""

    def quickly(self, trial: Trial, every: bool = False) -> Figures:
        """Return all figures on few angles under the one load, or under all, each (D,); infinite where not known."""

    def solved(self, trial: Trial) -> Figures:
        """Return all figures under all loads, as a run has them, each (D,)."""

    def sections(self, gear: str) -> Sequence[str]:
        """Return the sections of the file that have the flanks of a gear."""


class Under(NamedTuple):
    """A load in words, with its torque, and the axes and flanks of the mesh under it; None: hubs are held."""

    label: str
    torque_Nm: float
    assembly: Assembly
    hubs: Hubs | None = None


@dataclass(frozen=True)
class MeshTrials:
    """A mesh by itself, its hubs held or on what they stand on under each load.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    under : tuple of Under
        Loads. What their flanks have in common with those of the first one is changed.
    load : int
        Number of the one that flanks are sought for.
    part : str
        Name of the mesh; empty where there is one alone.
    """

    reduced: ReducedPair
    under: tuple[Under, ...]
    load: int
    part: str = ""
    gears: tuple[str, ...] = ("pinion", "wheel")
    evaluations: int = 30
    _solvers: dict[tuple[int, tuple[int, ...]], VariantSolver] = field(default_factory=dict, repr=False)

    @property
    def labels(self) -> tuple[str, ...]:
        """Loads in words."""
        return tuple(one.label for one in self.under)

    @property
    def whole_width(self) -> bool:
        """Whether both halves of the face may differ."""
        return not self.reduced.layered.mirrored

    @property
    def over_width(self) -> bool:
        """Whether anything differs over the face."""
        return meshed_width(self.reduced.basis.case) != "plane_strain"

    @property
    def size_um(self) -> float:
        """By how much flanks stand askew, about."""
        one = self.under[self.load]
        off, flanks = one.assembly.misalignment, (one.assembly.pinion, one.assembly.wheel)
        moved = 0.0
        if one.hubs is not None:
            offset = one.hubs.offset.reshape(2, -1)
            moved = 1e3 * self.width_mm * float(np.abs(np.diff(offset, axis=0)[0, 3:5]).sum())
        return moved + abs(off.in_plane_um) + abs(off.out_of_plane_um) + sum(
            abs(flank.helix_slope_um) + abs(flank.helix_crowning_um) for flank in flanks
        ) + 1.0  # fmt: skip

    @property
    def width_mm(self) -> float:
        """Common face width."""
        return self.reduced.meshed.pair.common_width

    @property
    def most_um(self) -> float:
        """Largest amount of a relief."""
        return MOST_IN_MODULES * 1e3 * self.reduced.basis.case.pair.module_mm

    def filed(self, gear: str) -> Modification:
        """Return the flanks of a gear as they are filed."""
        flank: Modification = getattr(self.under[0].assembly, gear)
        return flank

    @property
    def beyond(self) -> bool:
        """Whether so many positions take longer than an advice is worth."""
        case, pairs = self.reduced.basis.case, self.reduced.layered.tooth_pair_count
        size = pairs * len(self.reduced.layered.sections.z)
        return case.online.angles_per_pitch * case.pitches * len(self.under) * size**2 > MOST_NUMBERS

    def _with(self, assembly: Assembly, trial: Trial) -> Assembly:
        """Flanks with a trial, but for keys that those of a load have otherwise than the first ones."""
        flanks = {}
        for gear, values in trial.items():
            own, filed = getattr(assembly, gear), self.filed(gear)
            alike = {key: value for key, value in values.items() if getattr(own, key) == getattr(filed, key)}
            flanks[gear] = own.changed(alike)
        return replace(assembly, **flanks)

    def having(self, trial: Trial, loads: Sequence[str] | None = None) -> MeshTrials:
        """Return it with a trial in its file, under some loads alone: others carry on the other flanks."""
        under = tuple(one._replace(assembly=self._with(one.assembly, trial))
                      if loads is None or one.label in loads else one for one in self.under)  # fmt: skip
        return replace(self, under=under)

    def _states(self, trial: Trial, angles: int, loads: Sequence[int]) -> dict[int, tuple[VariantState, int]]:
        """State of each load, and its row there: those that are built alike are solved together."""
        alike = dict[tuple[Assembly, bool], list[int]]()
        for number in loads:
            alike.setdefault((self.under[number].assembly, self.under[number].hubs is None), []).append(number)
        found = dict[int, tuple[VariantState, int]]()
        for (assembly, _), numbers in alike.items():
            state = self._solver(angles, tuple(numbers)).solve(self._with(assembly, trial))
            found |= {number: (state, row) for row, number in enumerate(numbers)}
        return found

    def _solver(self, angles: int, numbers: tuple[int, ...]) -> VariantSolver:
        if (angles, numbers) not in self._solvers:
            phi = online_angles(self.reduced.meshed.pair.pitch, angles, self.reduced.basis.case.pitches)
            loads = [self.under[number] for number in numbers]
            hubs = [one.hubs for one in loads if one.hubs is not None]
            self._solvers[angles, numbers] = VariantSolver(self.reduced, phi, [one.torque_Nm for one in loads], hubs)
        return self._solvers[angles, numbers]

    def quickly(self, trial: Trial, every: bool = False) -> Figures:
        """Return all figures on few angles under the one load, or under all, each (D,); infinite where not known."""
        loads = range(len(self.under)) if every else [self.load]
        found = self._figures(trial, FEW_ANGLES, loads)
        return {key: np.where(np.isfinite(values), values, np.inf) for key, values in found.items()}

    def solved(self, trial: Trial) -> Figures:
        """Return all figures under all loads, as a run has them."""
        return self._figures(trial, self.reduced.basis.case.online.angles_per_pitch, range(len(self.under)))

    def _figures(self, trial: Trial, angles: int, loads: Sequence[int]) -> Figures:
        states = self._states(trial, angles, loads)
        return {key: np.array([_figure(key, *states[load]) for load in loads]) for key in FIGURES}

    def sections(self, gear: str) -> Sequence[str]:
        """Return the section of the file that has the flanks of a gear which carry."""
        flank = "coast_modification" if self.reduced.basis.case.flank == "coast" else "modification"
        return [f"{self.part}: {gear}.{flank}" if self.part else f"{gear}.{flank}"]


def _figure(key: str, state: VariantState, row: int) -> float:
    return float(FIGURES[key](state)[row]) if state.converged[row].all() else np.nan


FIGURES: Mapping[str, Callable[[VariantState], FloatArray]] = {
    "ste_peak_to_peak_um": lambda state: np.ptp(state.ste_um, axis=1),
    "k_h_beta": face_load_factor,
    "flank_pressure_max_MPa": lambda state: largest_pressure(state.pressure_MPa, 1),
    "tip_edge_load_N_per_mm": lambda state: state.edge_load_N_per_mm.max(axis=1),
}  # fmt: skip
