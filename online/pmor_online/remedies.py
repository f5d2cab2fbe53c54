"""Flanks that are tried: the tip relief, helix and end relief that lower a figure most, by the line contact itself.

A figure is lowered over two amounts, from the best of a few trials on, by simplexes (Nelder & Mead 1965), on few angles
under one load. What was found is rounded as one writes it, and then solved as a run does it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Protocol

import numpy as np

from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray
from pmor.gear.condition import Assembly
from pmor.gear.modification import Modification, other_places
from pmor.line.hubs import Hubs
from pmor.pair.conditions import assembly_of
from pmor.results.load_distribution import face_load_factor, largest_pressure
from pmor.results.quantities import TABLE
from pmor.results.verdict import Advice, Change, digits
from pmor_online.model import ReducedPair, online_angles
from pmor_online.variants import VariantSolver, VariantState

#: keys of modifications with their values, by gear
Trial = Mapping[str, Mapping[str, float]]
# Angles of a pitch on which flanks are tried, and numbers of positions and sections beyond which none are.
FEW_ANGLES, MOST_NUMBERS = 16, 30_000_000
# Amounts of relief that are tried first, over the largest transmission error; shares of the path at which it starts, %.
AMOUNTS, STARTS = (0.2, 0.45, 0.75, 1.2), (50.0, 62.0, 75.0, 88.0)
LATEST_START = 95.0
# Of the module: relief and crowning of more are no modifications any more.
MOST_IN_MODULES = 0.02
# Shares of the face, from each end, over which end relief goes.
LENGTHS = 0.1, 0.25
LONGEST = 0.4
# Of K_Hbeta: by which a second amount has to better it.
HARDLY = 0.01
# A figure has to get better by so much of itself, else there is no advice; worse by so much is told.
LEAST_GAIN, WORSE = 0.1, 0.05
# What keys are, with their values.
WORDS = {
    "tip_relief_um": "tip relief of {:g} µm", "tip_relief_start_percent": "from {:g} % of the path",
    "helix_slope_um": "helix slope of {:g} µm", "helix_crowning_um": "crowning of {:g} µm",
    "end_relief_um": "end relief of {:g} µm", "end_relief_length_mm": "over {:g} mm",
}  # fmt: skip
# Other loads that are told; figures that are not to grow beside the one that is lowered.
MOST_TOLD = 3
WATCHED = ("ste_peak_to_peak_um", "k_h_beta", "flank_pressure_max_MPa")


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

    def quickly(self, key: str, trial: Trial) -> float:
        """Return a figure under the one load, on few angles; infinite where it is not known."""

    def solved(self, trial: Trial) -> Mapping[str, FloatArray]:
        """Return all figures under all loads, as a run has them, each (D,)."""

    def sections(self, gear: str) -> Sequence[str]:
        """Return the sections of the file that have the flanks of a gear."""


@dataclass(frozen=True)
class MeshTrials:
    """A mesh by itself, its hubs held or on what they stand on under each load.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    torques_Nm : tuple of float
    labels : tuple of str
        Loads in words.
    load : int
        Number of the one that flanks are sought for.
    hubs : tuple of Hubs
        Under each load; empty: they are held.
    part : str
        Name of the mesh; empty where there is one alone.
    """

    reduced: ReducedPair
    torques_Nm: tuple[float, ...]
    labels: tuple[str, ...]
    load: int
    hubs: tuple[Hubs, ...] = ()
    part: str = ""
    gears: tuple[str, ...] = ("pinion", "wheel")
    evaluations: int = 30

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
        off, flanks = self._filed.misalignment, (self._filed.pinion, self._filed.wheel)
        moved = 0.0
        if self.hubs:
            moved = 1e3 * self.width_mm * float(np.abs(np.diff(self._moved(self.load), axis=0)[0, 3:5]).sum())
        return moved + abs(off.in_plane_um) + abs(off.out_of_plane_um) + sum(
            abs(flank.helix_slope_um) + abs(flank.helix_crowning_um) for flank in flanks
        ) + 1.0  # fmt: skip

    def _moved(self, load: int) -> FloatArray:
        return self.hubs[load].offset.reshape(2, -1)

    @property
    def width_mm(self) -> float:
        """Common face width."""
        return self.reduced.meshed.pair.common_width

    @property
    def most_um(self) -> float:
        """Largest amount of a relief."""
        return MOST_IN_MODULES * 1e3 * self.reduced.basis.case.pair.module_mm

    @property
    def _filed(self) -> Assembly:
        return assembly_of(self.reduced.basis.case)

    def filed(self, gear: str) -> Modification:
        """Return the flanks of a gear as they are filed."""
        flank: Modification = getattr(self._filed, gear)
        return flank

    @property
    def beyond(self) -> bool:
        """Whether so many positions take longer than an advice is worth."""
        case, pairs = self.reduced.basis.case, self.reduced.layered.tooth_pair_count
        size = pairs * len(self.reduced.layered.sections.z)
        return case.online.angles_per_pitch * case.pitches * len(self.torques_Nm) * size**2 > MOST_NUMBERS

    @cached_property
    def _few(self) -> VariantSolver:
        chosen = slice(self.load, self.load + 1)
        return self._solver(FEW_ANGLES, chosen)

    @cached_property
    def _all(self) -> VariantSolver:
        return self._solver(self.reduced.basis.case.online.angles_per_pitch, slice(None))

    def _solver(self, angles: int, loads: slice) -> VariantSolver:
        phi = online_angles(self.reduced.meshed.pair.pitch, angles, self.reduced.basis.case.pitches)
        return VariantSolver(self.reduced, phi, self.torques_Nm[loads], self.hubs[loads])

    def _with(self, trial: Trial) -> Assembly:
        pinion, wheel = (self.filed(gear).changed(trial.get(gear, {})) for gear in self.gears)
        return Assembly(self._filed.misalignment, pinion, wheel)

    def quickly(self, key: str, trial: Trial) -> float:
        """Return a figure under the one load, on few angles; infinite where it is not known."""
        state = self._few.solve(self._with(trial))
        found = float(FIGURES[key](state)[0])
        return found if state.converged.all() and np.isfinite(found) else np.inf

    def solved(self, trial: Trial) -> Mapping[str, FloatArray]:
        """Return all figures under all loads, as a run has them."""
        state = self._all.solve(self._with(trial))
        there = state.converged.all(axis=1)
        return {key: np.where(there, figure(state), np.nan) for key, figure in FIGURES.items()}

    def sections(self, gear: str) -> Sequence[str]:
        """Return the section of the file that has the flanks of a gear which carry."""
        flank = "coast_modification" if self.reduced.basis.case.flank == "coast" else "modification"
        return [f"{self.part}: {gear}.{flank}" if self.part else f"{gear}.{flank}"]


FIGURES: Mapping[str, Callable[[VariantState], FloatArray]] = {
    "ste_peak_to_peak_um": lambda state: np.ptp(state.ste_um, axis=1),
    "k_h_beta": face_load_factor,
    "flank_pressure_max_MPa": lambda state: largest_pressure(state.pressure_MPa, 1),
    "tip_edge_load_N_per_mm": lambda state: state.edge_load_N_per_mm.max(axis=1),
}  # fmt: skip


def remedy(tried: Tried, key: str, gear: str = "pinion") -> Advice | None:
    """Return the flanks that lower a figure most, by its key; None where none helps.

    Parameters
    ----------
    gear : str
        Whose helix or end relief is tried.
    """
    if key in ("ste_peak_to_peak_um", "tip_edge_load_N_per_mm"):
        found = advice_of(tried, "ste_peak_to_peak_um", tip_relief(tried, "ste_peak_to_peak_um"))
        if found is None and key == "tip_edge_load_N_per_mm":
            found = advice_of(tried, key, tip_relief(tried, key))
        return found
    if not tried.over_width:
        return None
    if key == "k_h_beta":
        return advice_of(tried, key, helix(tried, gear))
    if key == "flank_pressure_max_MPa":
        return advice_of(tried, key, end_relief(tried, gear))
    return None


def off_most(tried: Tried, gears: Sequence[str]) -> str:
    """Return the gear whose helix has the largest amounts as filed; the first one where none has any."""
    keys = ("helix_slope_um", "helix_crowning_um")
    return max(gears, key=lambda gear: sum(abs(getattr(tried.filed(gear), key)) for key in keys))


def tip_relief(tried: Tried, key: str) -> Trial:
    """Return the tip relief of all gears, of one amount and start, that lowers a figure most.

    Of the load at tip edges, where the peak-to-peak transmission error does not grow.
    """
    before = {name: tried.quickly(name, {}) for name in (key, "ste_peak_to_peak_um")}

    def trial(x: FloatArray) -> Trial:
        values = {"tip_relief_um": float(x[0]), "tip_relief_start_percent": float(x[1])}
        return dict.fromkeys(tried.gears, values)

    def figure(x: FloatArray) -> float:
        found = tried.quickly(key, trial(x)) / before[key]
        if key != "ste_peak_to_peak_um":
            spread = tried.quickly("ste_peak_to_peak_um", trial(x)) / before["ste_peak_to_peak_um"]
            found += 10.0 * max(spread - 1.0, 0.0)
        return found

    most = tried.most_um
    size = 0.25 * most
    starts = [np.array([share * size, start]) for share, start in product(AMOUNTS, STARTS)]
    place = least(figure, starts, (0.15 * size, -6.0), (0.0, STARTS[0] - 10.0), (most, LATEST_START), tried.evaluations)
    return trial(np.array([_rounded(place[0], most), round(place[1])]))


def helix(tried: Tried, gear: str) -> Trial:
    """Return helix slope and crowning of a gear that lower K_Hbeta most; crowning alone where halves are alike."""
    filed, size, most = tried.filed(gear), tried.size_um, max(tried.most_um, 2.0 * tried.size_um)
    keys = ("helix_slope_um", "helix_crowning_um")[0 if tried.whole_width else 1 :]
    base = np.array([getattr(filed, key) for key in keys])

    def trial(x: FloatArray) -> Trial:
        return {gear: dict(zip(keys, map(float, x), strict=True))}

    low = np.array([base[0] - most, min(0.0, base[-1])][-len(keys) :])
    moves = [(slope, crowning) for slope in (-0.5, 0.0, 0.5) for crowning in (0.0, 0.1)]
    starts = [base + size * np.array(move)[-len(keys) :] for move in dict.fromkeys(m[-len(keys) :] for m in moves)]
    spread = size * np.array([0.4, 0.2])[-len(keys) :]
    most_often = 2 * tried.evaluations
    found = least(lambda x: tried.quickly("k_h_beta", trial(x)), starts, spread, low, base + most, most_often)
    whole = {key: _rounded(value, size) for key, value in zip(keys, found, strict=True)}
    # One amount, where the other one hardly matters.
    fewer = [{gear: {key: whole[key]}} for key in keys] if len(keys) > 1 else []
    best = tried.quickly("k_h_beta", {gear: whole})
    alone = [one for one in fewer if tried.quickly("k_h_beta", one) < best + HARDLY]
    return alone[0] if alone else {gear: whole}


def end_relief(tried: Tried, gear: str) -> Trial:
    """Return the end relief of a gear that lowers the largest pressure most."""
    most, width = tried.most_um, tried.width_mm

    def trial(x: FloatArray) -> Trial:
        return {gear: {"end_relief_um": float(x[0]), "end_relief_length_mm": float(x[1])}}

    starts = [np.array([0.25 * amount * most, length * width]) for amount, length in product(AMOUNTS[:3], LENGTHS)]
    found = least(
        lambda x: tried.quickly("flank_pressure_max_MPa", trial(x)), starts, (0.04 * most, 0.05 * width),
        (0.0, 0.02 * width), (most, LONGEST * width), tried.evaluations,
    )  # fmt: skip
    return trial(np.array([_rounded(found[0], most), _rounded(found[1], width)]))


def least(
    figure: Callable[[FloatArray], float], starts: Sequence[FloatArray], spread: Sequence[float] | FloatArray,
    low: Sequence[float] | FloatArray, high: Sequence[float] | FloatArray, evaluations: int, resolution: float = 0.0,
) -> FloatArray:  # fmt: skip
    """Return where a figure is least near the best of some starts, each (n,), within bounds.

    Parameters
    ----------
    spread : sequence of float
        Sides of the first simplex.
    evaluations : int
        Of the figure, beside those of the starts.
    resolution : float
        To which places are sought; 0 is as fine as the evaluations allow.
    """
    from scipy.optimize import minimize

    inside = [np.clip(start, low, high) for start in starts]
    place = min(inside, key=figure) if len(inside) > 1 else inside[0]
    simplex = np.clip(place + np.vstack([np.zeros(len(place)), np.diag(spread)]), low, high)
    found = minimize(
        figure, place, method="Nelder-Mead", bounds=list(zip(low, high, strict=True)),
        options={"initial_simplex": simplex, "xatol": resolution, "fatol": 1e-5, "maxfev": evaluations},
    )  # fmt: skip
    return np.asarray(found.x)


def in_words(gears: Sequence[str], trial: Trial) -> str:
    """Return what is tried as an engineer says it."""
    values = next(iter(trial.values()))
    parts = [words.format(values[key]) for key, words in WORDS.items() if key in values]
    of = f"the {next(iter(trial))}" if len(trial) == 1 else "both gears" if len(gears) == 2 else "all gears"
    text = (" and " if "helix_crowning_um" in values else " ").join(parts)
    return f"{text[:1].upper()}{text[1:]} on {of}"


def advice_of(tried: Tried, key: str, trial: Trial) -> Advice | None:
    """Return a trial as advice, solved as a run does it; None where a figure gains too little."""
    before, after = tried.solved({}), tried.solved(trial)
    load, was, now = tried.load, float(before[key][tried.load]), float(after[key][tried.load])
    if not now <= (1.0 - LEAST_GAIN) * was:
        return None
    changes = tuple(
        _change(section, values, tried.filed(gear))
        for gear, values in trial.items() for section in tried.sections(gear)
    )  # fmt: skip
    beside = [
        f"{_capital(TABLE[name].symbol)} grows from {_told(name, before[name][load], after[name][load])}."
        for name in WATCHED if name != key and _grows(before[name][load], after[name][load])
    ]  # fmt: skip
    worse = [
        f"Under {label} it grows from {_told(key, one, other)}."
        for label, one, other in zip(tried.labels, before[key], after[key], strict=True)
        if _grows(one, other)
    ]
    beside += worse[:MOST_TOLD]
    under = tried.labels[load] if len(tried.labels) > 1 else ""
    return Advice(in_words(tried.gears, trial), key, tried.part, under, was, now, changes, tuple(beside))


def _change(section: str, values: Mapping[str, float], flank: Modification) -> Change:
    filed = {key: value for key, value in vars(flank).items() if value not in (None, 0.0)}
    now = {key: filed[key] for key in values if key in filed}
    return Change(section, values, now, tuple(sorted(filed.keys() & other_places(values))))


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _grows(before: float, after: float) -> bool:
    return bool(after > (1.0 + WORSE) * before)


def _told(key: str, before: float, after: float) -> str:
    unit = TABLE[key].shown_unit
    return f"{digits(before)} to {digits(after)}" + (f" {unit}" if unit else "")


def _rounded(value: float, size: float) -> float:
    """Round a value to some thousandth of a size: to 0.01, 0.1 and so on."""
    digits = 2 - int(np.floor(np.log10(size)))
    return float(round(float(value), digits)) + 0.0
