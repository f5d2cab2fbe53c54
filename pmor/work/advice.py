"""The verdict on a pair: its figures under the nominal torque, and what helps where one is not good."""

from __future__ import annotations

from dataclasses import replace

from pmor.case import Case, change_case
from pmor.case.change import said_gears
from pmor.case.coast import as_drawn, flank_of
from pmor.case.document import GEARS
from pmor.core.errors import PmorError
from pmor.gear.clearance import clearance_warnings
from pmor.pair.backlash import backlash_remarks
from pmor.pair.conditions import assembly_of, listed_conditions
from pmor.pair.model import gear_pair
from pmor.report.torque_table import condition_rows, torque_row
from pmor.report.verdict import Finding, Seen, findings, verdict_of
from pmor.results.verdict import Advice, Change
from pmor_online.remedies import off_most, others_kept, remedy, with_first
from pmor_online.run import OnlineResult
from pmor_online.trials import FIGURES, MeshTrials, Under

# Of the basic rack, in modules: by how much higher teeth are tried, the highest ones first, and the least gain.
# Higher teeth are tried where the transverse contact ratio is not above `ENOUGH`.
ENOUGH = 1.3
HIGHER, LEAST_GAIN = (0.25, 0.2, 0.15, 0.1, 0.05), 0.05


def with_verdict(found: OnlineResult) -> OnlineResult:
    """Return a result with its verdict."""
    case = found.case
    several = len(case.online.torques_Nm) > 1 or case.conditions
    seen = [Seen(f"{case.torque_Nm:g} N m" if several else "", "", torque_row(found, found.nominal))]
    seen += [Seen(one.name, "", condition_rows(one)[one.own]) for one in found.conditions]
    drawn = backlash_remarks(as_drawn(case))
    said = verdict_of(findings(seen), lambda one, first: _tried(found, one, first), found.failures, drawn)
    return replace(found, verdict=said)


def _tried(found: OnlineResult, one: Finding, first: Advice | None) -> Advice | str | None:
    case = found.case
    if case.reduction.shapes != "line_loads":
        return 'flanks are tried by line contact alone: write scheme = "line" in [contact]'
    if one.key == "effective_contact_ratio":
        rigid = found.reduced.meshed.pair.contact_ratio
        if rigid > ENOUGH:
            return f"relief takes contact off: teeth without it have a contact ratio of {rigid:.3g}"
        return higher_teeth(case)
    if first is not None and first.figure not in FIGURES:
        return None  # another body: it would have to be condensed anew
    under = _loads(found)
    load = next((n for n, load in enumerate(under) if load.label == one.load), found.nominal)
    if one.load in {other.name for other in found.conditions} - {load.label for load in under}:
        return f"flanks are tried for torques of one sign: {one.load} loads the other ones"
    tried = MeshTrials(found.reduced, under, load)
    if tried.beyond:
        return "flanks are not tried, since each trial takes as long as this run: lower [online] angles_per_pitch"
    tried = with_first(tried, first)
    found_one = remedy(tried, one.key, off_most(tried, GEARS))
    both = any(flank_of(condition) != case.flank for condition in case.conditions)
    return others_kept(found_one, case) if both and found_one is not None else found_one


def _loads(found: OnlineResult) -> tuple[Under, ...]:
    """Torques of the sweep, and conditions that load the same flanks."""
    case, own = found.case, assembly_of(found.case)
    torques = [Under(f"{torque:g} N m", torque, own) for torque in case.online.torques_Nm]
    listed = zip(case.conditions, listed_conditions(case), strict=True)
    return (*torques, *(Under(one.name, 1e-3 * solved.torque, solved.assembly)
                        for one, solved in listed if flank_of(one) == case.flank))  # fmt: skip


def higher_teeth(case: Case) -> Advice | None:
    """Return higher teeth of both gears, with the tip clearance that they have; None where there is no room for any."""
    before = gear_pair(case).contact_ratio
    gears = dict(zip(GEARS, (case.pair.pinion, case.pair.wheel), strict=True))
    for more in HIGHER:
        keys = {
            name: {"addendum": round(gears[name].addendum + more, 3), "dedendum": round(gears[name].dedendum + more, 3)}
            for name in said_gears(case)
        }
        try:
            changed = change_case(case, **keys)
            pair = gear_pair(changed)
        except PmorError:
            continue
        if not clearance_warnings(pair):
            filed = {name: {key: getattr(gears[name], key) for key in values} for name, values in keys.items()}
            changes = tuple(Change(name, values, filed[name]) for name, values in keys.items())
            if pair.contact_ratio - before > LEAST_GAIN:
                return Advice("Higher teeth", "contact_ratio", "", "", before, pair.contact_ratio, changes)
    return None
