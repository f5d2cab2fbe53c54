"""The verdict at the top of a page and a screen: what is good, what is not, and what to try first.

Figures of the table of quantities are held against limits of our own: where an engineer would look twice, and no limit
of a standard. What levels the load over planets and face is tried before what is found on such flanks; then what is
worst comes first. Where a remedy does not help, that of the next figure is tried; where it does, the next one's too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from pmor.pair.backlash import Remark
from pmor.results.quantities import TABLE
from pmor.results.verdict import Advice, Verdict

# Where an engineer would look twice: K_gamma, K_Hbeta, peak-to-peak over mean STE, load at a tip edge over the largest,
# pressure at the ends of the face over that between, face that carries (%), tooth pairs that carry on average.
MOST_K_GAMMA, MOST_K_H_BETA, MOST_SPREAD, MOST_AT_EDGE, MOST_AT_ENDS = 1.1, 1.3, 0.1, 0.3, 1.2
LEAST_FACE, LEAST_PAIRS, USUAL_PAIRS = 95.0, 1.1, 1.2
# Of an even share: planets that carry less hardly carry.
HARDLY = 0.5
# A light mesh or load has no say: transmission errors below are as good as none, um.
LEAST_SPREAD_UM = 0.05


class Seen(NamedTuple):
    """Figures by their keys in the table of quantities, of a load and a part of a machine; empty where there is one."""

    load: str
    part: str
    figures: Mapping[str, Any]


class Finding(NamedTuple):
    """A figure of one load and part that was judged: 1 and more of `excess` is beyond the limit."""

    key: str
    load: str
    part: str
    excess: float
    words: str
    figures: Mapping[str, Any] = MappingProxyType({})

    @property
    def text(self) -> str:
        """With its part and load."""
        of = ", ".join(filter(None, (self.part, self.load)))
        return f"{self.words} ({of})" if of else self.words

    def still(self, value: float) -> bool:
        """Whether it is beyond its limit with another value."""
        judged = JUDGED[self.key]({**self.figures, self.key: value})
        return judged is not None and judged[0] >= 1.0


#: from figures to how far one is beyond its limit, and words; None where it is not known
Judged = Callable[[Mapping[str, Any]], tuple[float, str] | None]


def _k_gamma(figures: Mapping[str, Any]) -> tuple[float, str] | None:
    value = figures.get("k_gamma")
    if value is None or math.isnan(value):
        return None
    shares = {planet["name"]: planet["share_mean"] for planet in figures.get("planets", ())}
    words = f"planets carry evenly, K_γ {value:.3g}"
    if value > MOST_K_GAMMA and shares and None not in shares.values():
        light = [name for name, share in shares.items() if share < HARDLY / len(shares)]
        most = max(shares, key=lambda name: shares[name])
        words = f"{most} carries {100.0 * shares[most]:.3g} % of the torque of {len(shares)} planets"
        if shares[most] * len(shares) < 1.0 + 0.5 * (value - 1.0):
            words = "shares of the planets swing around the carrier"
        elif light:
            words += f", {' and '.join(light)} {' and '.join(f'{100.0 * shares[name]:.2g} %' for name in light)}"
        words += f": K_γ {value:.3g}"
    return (value - 1.0) / (MOST_K_GAMMA - 1.0), words


def _k_h_beta(figures: Mapping[str, Any]) -> tuple[float, str] | None:
    value = figures.get("k_h_beta")
    if value is None:
        return None
    excess = (value - 1.0) / (MOST_K_H_BETA - 1.0)
    face = figures.get("carrying_face_percent")
    if face is not None and face < LEAST_FACE:
        return max(excess, 1.0), f"K_Hβ {value:.3g}: {100.0 - face:.2g} % of the face carries nothing"
    return excess, f"K_Hβ {value:.3g}"


def _spread(figures: Mapping[str, Any]) -> tuple[float, str] | None:
    spread, teeth = figures.get("ste_peak_to_peak_um"), figures.get("ste_of_teeth_um")
    mean = figures.get("ste_mean_um") if teeth is None else teeth
    if spread is None or not mean or not math.isfinite(spread / mean):
        return None
    share = abs(spread / mean)
    excess = share / MOST_SPREAD if spread > LEAST_SPREAD_UM else 0.0
    of = "its mean" if teeth is None else "the deflection of the teeth"
    return excess, f"STE p-p {spread:.3g} µm, {_percent(share)} of {of}"


def _at_edges(figures: Mapping[str, Any]) -> tuple[float, str] | None:
    edge, most = figures.get("tip_edge_load_N_per_mm"), figures.get("line_load_max_N_per_mm")
    if edge is None or not most:
        return None
    if edge == 0.0:
        return 0.0, "tip edges stay clear"
    over = f"over {figures['tip_edge_percent']:.0f} % of the mesh cycle"
    return edge / most / MOST_AT_EDGE, f"tip edges carry up to {edge:.3g} N/mm {over}"


def _at_ends(figures: Mapping[str, Any]) -> tuple[float, str] | None:
    ratio = figures.get("end_pressure_ratio")
    if ratio is None:
        return None
    words = f"pressure at the ends of the face {ratio:.3g} times that between"
    return (ratio - 1.0) / (MOST_AT_ENDS - 1.0), words


def _pairs(figures: Mapping[str, Any]) -> tuple[float, str] | None:
    value = figures.get("effective_contact_ratio")
    if value is None:
        return None
    words = f"{value:.3g} tooth pairs carry on average"
    return max((USUAL_PAIRS - value) / (USUAL_PAIRS - LEAST_PAIRS), 0.0), words


#: by the figure that a remedy is to change
JUDGED: Mapping[str, Judged] = {
    "k_gamma": _k_gamma, "k_h_beta": _k_h_beta, "ste_peak_to_peak_um": _spread, "tip_edge_load_N_per_mm": _at_edges,
    "flank_pressure_max_MPa": _at_ends, "effective_contact_ratio": _pairs,
}  # fmt: skip


#: whose remedies are tried before others: relief that is found on flanks askew does not fit true ones
BEFORE_OTHERS = ("k_gamma", "k_h_beta")
#: that have one remedy
BY_TIP_RELIEF = {"ste_peak_to_peak_um", "tip_edge_load_N_per_mm"}
NONE_GOOD = "None of the figures that are judged is within its limit."
#: those that are told where they are good
PRAISED = ("k_gamma", "k_h_beta", "ste_peak_to_peak_um", "tip_edge_load_N_per_mm")


def findings(seen: Iterable[Seen]) -> list[Finding]:
    """Return the worst of each figure over all loads and parts, the worst figure first."""
    worst = dict[str, Finding]()
    for load, part, figures in seen:
        for key, judge in JUDGED.items():
            if (judged := judge(figures)) is not None and (key not in worst or judged[0] > worst[key].excess):
                worst[key] = Finding(key, load, part, *judged, figures)
    return sorted(worst.values(), key=lambda finding: -finding.excess)


def verdict_of(
    found: Sequence[Finding], tried: Callable[[Finding, Advice | None], Advice | str | None], lost: Sequence[str] = (),
    drawn: Sequence[Remark] = (),
) -> Verdict:
    """Return the verdict on findings.

    Parameters
    ----------
    tried : callable
        From a finding, and a first advice that is in the file, to what helps; None where nothing does, a sentence where
        nothing is tried.
    lost : sequence of str
        What did not converge: nothing is tried then.
    drawn : sequence of Remark
        Of the drawing: what is left open in it is said where all is good.
    """
    bad = [one for one in found if one.excess >= 1.0]
    good = [one for one in found if one.excess < 1.0 and one.key in PRAISED]
    wrong = [sentence_of(one.text) for one in drawn if one.bad]
    said = _told(good) if good else NONE_GOOD if bad else "No figure is known that could be judged."
    if lost:
        return Verdict(said, " ".join([sentence_of(lost[0]), *([_told(bad)] if bad else [])]), "What did not converge.")
    if not bad:
        open_ = [sentence_of(one.text) for one in drawn if not one.bad]
        not_good = " ".join(wrong) or "No figure is beyond its limit."
        return Verdict(said, not_good, " ".join(["Nothing: no figure asks for it.", *open_]))
    told = " ".join([_told(bad), *wrong])
    first, unhelped = None, list[str]()
    for one in sorted(bad, key=lambda one: (*BEFORE_OTHERS, one.key).index(one.key)):
        if first is not None and {first.figure, one.key} <= BY_TIP_RELIEF:
            continue
        answer = tried(one, first)
        if not isinstance(answer, Advice):
            unhelped.append(answer or f"no change that was tried betters {TABLE[one.key].symbol} by a tenth")
        elif first is None:
            first = answer
        elif one.still(answer.before) and not answer.again(first):
            return Verdict(said, told, first.text, first, answer.text, answer)
    return Verdict(said, told, first.text if first else sentence_of("; ".join(dict.fromkeys(unhelped))), first)


def verdict_blocks(data: Mapping[str, Any]) -> list[Verdict]:
    """Return the verdict of plain data of a machine as a block of its page; none without one."""
    said = data["verdict"]
    return [] if said is None else [Verdict(said["good"], said["not_good"], said["try_first"], then=said["then"])]


def verdict_text(verdict: Mapping[str, Any] | None) -> list[str]:
    """Return the verdict of plain data as lines for the screen; none without one."""
    shown = verdict_blocks({"verdict": verdict})
    return [f"  {head + ':':<10} {text}" for one in shown for head, text in one.lines]


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if share >= 1.0 else f"{100.0 * share:.2g} %"


def _told(found: Sequence[Finding]) -> str:
    """Findings as a sentence; the load stands first where it is that of all."""
    loads = {one.load for one in found}
    if len(loads) == 1 and (load := loads.pop()):
        return f"Under {load}: {'; '.join(one._replace(load='').text for one in found)}."
    return sentence_of("; ".join(one.text for one in found))


def sentence_of(text: str) -> str:
    """Return words as a sentence."""
    return f"{text[:1].upper()}{text[1:]}."
