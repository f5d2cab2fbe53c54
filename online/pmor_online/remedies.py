"""Flanks that are tried: the tip relief, helix and end relief that lower a figure most, by the line contact itself.

A figure is lowered over two amounts, from the best of a few trials on, by simplexes (Nelder & Mead 1965), on few angles
under one load. Where it then grows under another load of the file, the amounts are sought again for all loads: for the
largest over them, and among those for the one. What was found is rounded as one writes it, and solved as a run does it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, TypeVar

import numpy as np

from pmor.case import Case
from pmor.case.document import COAST, GEARS, MODIFICATION
from pmor.core.arrays import FloatArray
from pmor.core.roots_and_minima import least_by_simplexes
from pmor.gear.modification import Modification, other_places
from pmor.results.quantities import TABLE
from pmor.results.verdict import Advice, Change, digits
from pmor_online.trials import Figures, Trial, Tried

# Amounts of relief that are tried first, over the largest transmission error; shares of the path at which it starts, %.
AMOUNTS, STARTS = (0.2, 0.45, 0.75, 1.2), (50.0, 62.0, 75.0, 88.0)
LATEST_START = 95.0
# Shares of the face, from each end, over which end relief goes.
LENGTHS = 0.1, 0.25
LONGEST = 0.4
# Of K_Hbeta: by which a second amount has to better it; from where the search goes on with so many slopes alone, and a
# simplex so much smaller.
HARDLY, LEVEL, SLOPES, FINER = 0.01, 1.1, 15, 0.2
# A figure has to get better by so much of itself, else there is no advice; worse by so much is told.
LEAST_GAIN, WORSE = 0.1, 0.05
# Of a figure under the one load, beside the largest over all.
OF_THE_ONE = 0.1
# What keys are, with their values.
WORDS = {
    "tip_relief_um": "tip relief of {:g} µm", "tip_relief_start_percent": "from {:g} % of the path",
    "helix_slope_um": "helix slope of {:g} µm", "helix_crowning_um": "crowning of {:g} µm",
    "end_relief_um": "end relief of {:g} µm", "end_relief_length_mm": "over {:g} mm",
}  # fmt: skip
# Other loads that are told; figures that are not to grow beside the one that is lowered.
MOST_TOLD = 3
WATCHED = ("ste_peak_to_peak_um", "k_h_beta", "flank_pressure_max_MPa")
AnyTried = TypeVar("AnyTried", bound=Tried)
#: from a trial to what is to be least
Aim = Callable[[Trial], float]


def remedy(tried: Tried, key: str, gear: str = "pinion") -> Advice | None:
    """Return the flanks that lower a figure most, by its key; None where none helps.

    Parameters
    ----------
    gear : str
        Whose helix or end relief is tried.
    """
    if key == "ste_peak_to_peak_um":
        return _for_loads(tried, key, lambda aim: tip_relief(tried, aim))
    if key == "tip_edge_load_N_per_mm":
        return _for_loads(tried, key, lambda aim: tip_relief(tried, aim), quiet=True)
    if not tried.over_width:
        return None
    if key == "k_h_beta":
        return _for_loads(tried, key, lambda aim: helix(tried, gear, aim))
    if key == "flank_pressure_max_MPa":
        return _for_loads(tried, key, lambda aim: end_relief(tried, gear, aim))
    return None


def with_first(tried: AnyTried, first: Advice | None, loads: Sequence[str] | None = None) -> AnyTried:
    """Return a mesh or a set whose file has the flanks of a first advice, under some loads alone."""
    if first is None:
        return tried
    changes = {change.section: dict(change.values) for change in first.changes}
    places = {gear: tried.sections(gear)[0] for gear in tried.gears}
    return tried.having({gear: changes[place] for gear, place in places.items() if place in changes}, loads)


def others_kept(advice: Advice, case: Case) -> Advice:
    """Return an advice on drive flanks that keeps the coast flanks as they are: by themselves they are alike."""
    kept = list[Change]()
    for change in advice.changes if case.flank == "drive" else ():
        place, _, section = change.section.rpartition(".")
        if section == MODIFICATION:
            flank = case.other_flanks[GEARS.index(place.rpartition(": ")[2])]
            values = {key: value for key in change.values if (value := getattr(flank, key)) is not None}
            kept.append(Change(f"{place}.{COAST}", values))
    return replace(advice, changes=(*advice.changes, *kept))


def _for_loads(tried: Tried, key: str, search: Callable[[Aim], Trial], quiet: bool = False) -> Advice | None:
    """Return what a search finds for the one load; for all loads, where it makes the figure of another grow.

    Parameters
    ----------
    quiet : bool
        The peak-to-peak transmission error is not to grow.
    """
    before, load = tried.solved({}), tried.load
    known = np.isfinite(before[key])
    if not before[key][load] > 0.0:
        return None

    def solved(figure: Callable[[Figures], float], every: bool) -> tuple[Trial, Figures, bool]:
        trial = search(_aim(tried, figure, every, quiet))
        after = tried.solved(trial)
        gains = after[key][load] <= (1.0 - LEAST_GAIN) * before[key][load] and np.isfinite(after[key][known]).all()
        return trial, after, bool(gains)

    def largest(found: Figures) -> float:
        share = found[key][known] / filed[known].max()
        own = share[place] * filed[known].max() / filed[load]
        return float(max(own, np.delete(share, place).max()) + OF_THE_ONE * own)

    trial, after, gains = solved(lambda found: float(found[key][0]), every=False)
    if not gains:
        return None
    one = advice_of(tried, key, trial, before, after)
    worst = max(np.flatnonzero(known), key=lambda number: _growth(before[key][number], after[key][number]))
    if not _grows(before[key][worst], after[key][worst]):
        return one
    filed, place = tried.quickly({}, every=True)[key], int(np.count_nonzero(known[:load]))
    whole, found, gains = solved(largest, every=True)
    most = np.max(found[key][known])
    # It has to be better for the largest, and for the load that the one would make worse.
    better = _grows(most, np.max(after[key][known])) and _grows(found[key][worst], after[key][worst])
    if not gains or not better:
        return one
    alone = f"{digits(after[key][load])} by {one.what[:1].lower()}{one.what[1:]}"
    takes = f"{one.load} alone would go to {alone}, and {tried.labels[worst]} to {digits(after[key][worst])}"
    told = advice_of(tried, key, whole, before, found)
    return replace(told, beside=(*told.beside, f"This is for the largest over all loads; {takes}."))


def _aim(tried: Tried, figure: Callable[[Figures], float], every: bool, quiet: bool) -> Aim:
    """From a trial to a figure on few angles; quiet: where the peak-to-peak transmission error does not grow."""
    if not quiet:
        return lambda trial: figure(tried.quickly(trial, every))
    filed, load = tried.quickly({}, every), tried.load if every else 0
    before, loud = figure(filed) or 1.0, float(filed["ste_peak_to_peak_um"][load])

    def aim(trial: Trial) -> float:
        found = tried.quickly(trial, every)
        spread = float(found["ste_peak_to_peak_um"][load]) / loud
        return figure(found) / before + 10.0 * max(spread - 1.0, 0.0)

    return aim


def off_most(tried: Tried, gears: Sequence[str]) -> str:
    """Return the gear whose helix has the largest amounts as filed; the first one where none has any."""
    keys = ("helix_slope_um", "helix_crowning_um")
    return max(gears, key=lambda gear: sum(abs(getattr(tried.filed(gear), key)) for key in keys))


def tip_relief(tried: Tried, aim: Aim) -> Trial:
    """Return the tip relief of all gears, of one amount and start, that is best for an aim."""

    def trial(x: FloatArray) -> Trial:
        values = {"tip_relief_um": float(x[0]), "tip_relief_start_percent": float(x[1])}
        return dict.fromkeys(tried.gears, values)

    most = tried.most_um
    size = 0.25 * most
    starts = [np.array([share * size, start]) for share, start in product(AMOUNTS, STARTS)]
    place = least(
        lambda x: aim(trial(x)), starts, (0.15 * size, -6.0), (0.0, STARTS[0] - 10.0), (most, LATEST_START),
        tried.evaluations,
    )  # fmt: skip
    return trial(np.array([_rounded(place[0], most), round(place[1])]))


def helix(tried: Tried, gear: str, aim: Aim) -> Trial:
    """Return helix slope and crowning of a gear that are best for an aim; crowning alone where halves are alike."""
    filed, size, most = tried.filed(gear), tried.size_um, max(tried.most_um, 2.0 * tried.size_um)
    keys = ("helix_slope_um", "helix_crowning_um")[0 if tried.whole_width else 1 :]
    base = np.array([getattr(filed, key) for key in keys])

    def trial(x: FloatArray) -> Trial:
        return {gear: dict(zip(keys, map(float, x), strict=True))}

    low = np.array([base[0] - most, min(0.0, base[-1])][-len(keys) :])
    moves = [(slope, crowning) for slope in (-0.5, 0.0, 0.5) for crowning in (0.0, 0.1)]
    starts = [base + size * np.array(move)[-len(keys) :] for move in dict.fromkeys(m[-len(keys) :] for m in moves)]
    plain = [np.append(start[:-1], 0.0) for start in starts if base[-1] > 0.0]
    spread = size * np.array([0.4, 0.2])[-len(keys) :]
    found = least(lambda x: aim(trial(x)), [*starts, *plain], spread, low, base + most, 2 * tried.evaluations)
    if not aim(trial(found)) < LEVEL and len(keys) > 1:  # a light load carries on a narrow band: its slope alone
        slopes = [base[:1] + size * share for share in np.linspace(-1.0, 1.0, SLOPES)]
        slope = least(
            lambda x: aim(trial(np.append(x, 0.0))), slopes, spread[:1] * FINER, low[:1], base[:1] + most,
            tried.evaluations,
        )  # fmt: skip
        found = min(found, np.append(slope, 0.0), key=lambda x: aim(trial(x)))
    whole = {key: _rounded(value, size) for key, value in zip(keys, found, strict=True)}
    # One amount, where the other one hardly matters.
    fewer = [{gear: {key: whole[key]}} for key in keys] if len(keys) > 1 else []
    best = aim({gear: whole})
    alone = [one for one in fewer if aim(one) < best + HARDLY]
    chosen: Trial = alone[0] if alone else {gear: whole}
    crowned = [name for name in tried.gears if tried.filed(name).helix_crowning_um > 0.0]
    plain_flanks = {name: {"helix_crowning_um": 0.0} for name in crowned}
    return plain_flanks if len(crowned) > 1 and aim(plain_flanks) < aim(chosen) else chosen


def end_relief(tried: Tried, gear: str, aim: Aim) -> Trial:
    """Return the end relief of a gear that is best for an aim."""
    most, width = tried.most_um, tried.width_mm

    def trial(x: FloatArray) -> Trial:
        return {gear: {"end_relief_um": float(x[0]), "end_relief_length_mm": float(x[1])}}

    starts = [np.array([0.25 * amount * most, length * width]) for amount, length in product(AMOUNTS[:3], LENGTHS)]
    found = least(
        lambda x: aim(trial(x)), starts, (0.04 * most, 0.05 * width), (0.0, 0.02 * width), (most, LONGEST * width),
        tried.evaluations,
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
    inside = [np.clip(start, low, high) for start in starts]
    place = min(inside, key=figure) if len(inside) > 1 else inside[0]
    simplex = np.clip(place + np.vstack([np.zeros(len(place)), np.diag(spread)]), low, high)
    return least_by_simplexes(figure, simplex, np.asarray(low), np.asarray(high), evaluations, (resolution, 1e-5))


def in_words(gears: Sequence[str], trial: Trial) -> str:
    """Return what is tried as an engineer says it."""
    values = next(iter(trial.values()))
    parts = [words.format(values[key]) if values[key] else f"no {words.partition(' of ')[0]}"
             for key, words in WORDS.items() if key in values]
    of = f"the {next(iter(trial))}" if len(trial) == 1 else "both gears" if len(gears) == 2 else "all gears"
    text = (" and " if "helix_crowning_um" in values else " ").join(parts)
    return f"{text[:1].upper()}{text[1:]} on {of}"


def advice_of(
    tried: Tried, key: str, trial: Trial, before: Mapping[str, FloatArray], after: Mapping[str, FloatArray]
) -> Advice:
    """Return a trial as advice, by all figures under all loads as filed and with it."""
    load = tried.load
    changes = tuple(
        _change(section, values, tried.filed(gear))
        for gear, values in trial.items() for section in tried.sections(gear)
    )  # fmt: skip
    beside = [
        f"{_capital(TABLE[name].symbol)} grows from {_told(name, before[name][load], after[name][load])}."
        for name in WATCHED if name != key and _grows(before[name][load], after[name][load])
    ]  # fmt: skip
    edges = "tip_edge_load_N_per_mm"
    if key == "ste_peak_to_peak_um" and after[edges][load] < before[edges][load]:
        beside.append(f"Load at tip edges goes from {_told(edges, before[edges][load], after[edges][load])}.")
    others = [n for n in np.flatnonzero(np.isfinite(before[key])).tolist() if n != load]
    others.sort(key=lambda number: -_growth(before[key][number], after[key][number]))
    gone = [f"under {tried.labels[n]} from {_told(key, before[key][n], after[key][n])}" for n in others[:MOST_TOLD]]
    beside += [f"It goes {', '.join(gone)}."] if gone else []
    under = tried.labels[load] if len(tried.labels) > 1 else ""
    was, now = float(before[key][load]), float(after[key][load])
    return Advice(in_words(tried.gears, trial), key, tried.part, under, was, now, changes, tuple(beside))


def _change(section: str, values: Mapping[str, float], flank: Modification) -> Change:
    filed = {key: value for key, value in vars(flank).items() if value not in (None, 0.0)}
    now = {key: filed[key] for key in values if key in filed}
    return Change(section, values, now, tuple(sorted(filed.keys() & other_places(values))))


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _growth(before: Any, after: Any) -> float:
    return float(after / before) if before > 0.0 else 1.0 if after == before else np.inf


def _grows(before: float, after: float) -> bool:
    return _growth(before, after) > 1.0 + WORSE


def _told(key: str, before: float, after: float) -> str:
    unit = TABLE[key].shown_unit
    return f"{digits(before)} to {digits(after)}" + (f" {unit}" if unit else "")


def _rounded(value: float, size: float) -> float:
    """Round a value to some thousandth of a size: to 0.01, 0.1 and so on."""
    digits = 2 - int(np.floor(np.log10(size)))
    return float(round(float(value), digits)) + 0.0
