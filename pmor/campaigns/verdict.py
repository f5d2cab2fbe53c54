"""The verdict on a campaign: designs that hold the limits, what spreads most and by which key, the design to take."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

from pmor.campaigns.bands import bands_of
from pmor.campaigns.columns import Columns
from pmor.campaigns.page import label_of, shown_results
from pmor.campaigns.rows import STATUSES
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.report.verdict import JUDGED, sentence_of
from pmor.results.quantities import MESHES, TABLE, Quantity
from pmor.results.verdict import Verdict, digits

# Classes of the values of a key, and designs in each on average, with which its share in a variance is found.
MOST_CLASSES, LEAST_IN_CLASS = 8, 3
# Of a variance: a key that explains less by itself does not decide.
LEAST_SHARE = 0.3
# A result that differs by less of its median hardly spreads.
LEAST_SPREAD = 0.05


def campaign_verdict(result: Columns) -> Verdict:
    """Return the verdict on the designs of a campaign, by its table of results alone."""
    solved = np.flatnonzero(result.codes == STATUSES.index("ok"))
    lost = [f"{result.count(status)} {status}" for status in STATUSES[1:] if result.count(status)]
    if not len(solved):
        return Verdict("No design has results.", f"{', '.join(lost)}.", "What the reasons of the designs say.")
    excess = excesses(result, solved)
    worst = np.max([*excess.values(), np.full(len(solved), -np.inf)], axis=0)
    holds, beyond = worst < 1.0, Counter[str]()
    for (part, key), values in excess.items():
        beyond[f"{TABLE[key].symbol}{f' of {part}' * bool(part)}"] += int(np.count_nonzero(values >= 1.0))
    good = "None of the results is judged by a limit."
    if excess:
        count, within = np.count_nonzero(holds), " and ".join(symbol for symbol, n in beyond.items() if not n)
        if count:
            good = f"{count} of {len(solved)} solved designs {'is' if count == 1 else 'are'} within all limits"
            good += f"; all are within that of {within}." if within else "."
        else:
            good = f"All designs are within the limit of {within}." if within else "No limit holds in all designs."
    every = {len(solved): "all"}
    found = ["no design is within all limits"] * bool(excess and not holds.any())
    found += [f"{symbol} is beyond its limit in {every.get(n, n)}" for symbol, n in beyond.most_common() if n]
    found += [*_spread(result), *lost]
    bad = sentence_of("; ".join(found)) if found else "No result is beyond its limit."
    return Verdict(good, bad, _advice(result, solved, holds, worst, excess))


def excesses(result: Columns, solved: IntArray) -> Mapping[tuple[str, str], FloatArray]:
    """Return how far the figures of solved designs are beyond their limits, (n,), by part and key; 1 is the limit."""
    parts = dict[str, dict[str, FloatArray]]()
    for name in result.results:
        part, key = _part_and_key(name)
        parts.setdefault(part, {})[key] = result.judged(name)
    found = dict[tuple[str, str], FloatArray]()
    for part, columns in parts.items():
        # The mean transmission error of a gearbox is that of its shafts too: there the limit is not known.
        judged = [key for key in JUDGED if key in columns and not (part and key == "ste_peak_to_peak_um")]
        rows = [{key: float(values[i]) for key, values in columns.items() if np.isfinite(values[i])} for i in solved]
        for key in judged:
            values = [JUDGED[key](row) if key in row else None for row in rows]
            if any(values):
                found[part, key] = np.array([-np.inf if one is None else one[0] for one in values])
    return found


def _part_and_key(name: str) -> tuple[str, str]:
    part, _, key = name.rpartition(".")
    mesh = next((mesh for mesh in MESHES if key.endswith(f"_{mesh}")), "")
    return (MESHES[mesh], key.removesuffix(f"_{mesh}")) if mesh else (part, key)


def _spread(result: Columns) -> list[str]:
    """The result that spreads most over the solved designs, of those that are looked at first, and what decides it."""
    figures, widest = [one for one in shown_results(result) if one.key in result.campaign.kind.first], 0.0
    most: Quantity | None = None
    for figure in figures:
        known = result.judged(figure.key)
        known = known[np.isfinite(known)]
        if np.median(known) and (width := float(np.ptp(known) / abs(np.median(known)))) > max(widest, LEAST_SPREAD):
            most, widest = figure, width
    if most is None:
        return []
    values = result.judged(most.key)
    unit = f" {most.shown_unit}" if most.shown_unit else ""
    said = f"{most.symbol} spreads most, {digits(np.nanmin(values))} to {digits(np.nanmax(values))}{unit}"
    band = next((band for band in bands_of(result) if band.key == most.key), None)
    if band is not None:
        low, high = band.spans[band.decides]
        return [f"{said}: {label_of(band.decides)} decides, {digits(low)} to {digits(high)}{unit} by itself"]
    shares = {name: explained(column, values) for name, column in result.inputs.items()}
    name = max(shares, key=lambda name: shares[name])
    by = f": {label_of(name)} decides, with {100.0 * shares[name]:.0f} % of its variance"
    return [said + by * (shares[name] >= LEAST_SHARE)]


def explained(key: FloatArray, result: FloatArray) -> float:
    """Return the share of the variance of a result that a key explains by itself, whatever its law; 0: not known.

    Correlation ratio over classes of the key, (Fisher 1925), less what as many classes explain by chance.
    """
    known = np.isfinite(key) & np.isfinite(result)
    key, result = key[known], result[known]
    values, place = np.unique(key, return_inverse=True)
    if len(values) > MOST_CLASSES:
        place = np.argsort(np.argsort(key, kind="stable")) * MOST_CLASSES // len(key)
    count, classes = len(result), len(np.unique(place))
    if classes < 2 or count < LEAST_IN_CLASS * classes or not np.ptp(result) > 0.0:
        return 0.0
    sizes = np.bincount(place)
    means = np.bincount(place, result) / sizes
    within = float(((result - means[place]) ** 2).sum() / ((result - result.mean()) ** 2).sum())
    return max(1.0 - within * (count - 1) / (count - classes), 0.0)


def _advice(
    result: Columns, solved: IntArray, holds: BoolArray, worst: FloatArray,
    excess: Mapping[tuple[str, str], FloatArray],
) -> str:  # fmt: skip
    """The design to take: the least of the first result within the limits, else the one nearest to these."""
    campaign = result.campaign
    write = f"pmor campaign {campaign.inputs[0].name} --case"
    if not holds.any():
        place = int(np.argmin(worst))
        (part, key), _ = max(excess.items(), key=lambda one: float(one[1][place]))
        of, number = f" of {part}" * bool(part), solved[place] + 1
        return (f"Design {number} is nearest to the limits, furthest beyond that of {TABLE[key].symbol}{of}. "
                f"{write} {number} writes it: the verdict on its file tries flanks and supports.")  # fmt: skip
    first = next((one for one in shown_results(result) if one.key in campaign.kind.first), None)
    if first is None:
        return f"Nothing: results do not differ. {write} {solved[int(np.argmax(holds))] + 1} writes a design."
    values = result.judged(first.key)
    inside = [int(i) for i, fine in zip(solved, holds, strict=True) if fine and np.isfinite(values[i])]
    if not inside:
        return f"Nothing: no design within the limits has {first.symbol}."
    best = min(inside, key=lambda i: values[i])
    unit = f" {first.shown_unit}" if first.shown_unit else ""
    within = ", the least of those within the limits" if excess else ", the least"
    keys = ", ".join(f"{name} = {value:g}" for name, value in result.design(best).items())
    figure = f"{first.symbol} {digits(values[best])}{unit}{within}"
    return f"Design {best + 1}, {figure}: {keys}. {write} {best + 1} writes it."
