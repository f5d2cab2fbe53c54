"""The verdict on a pair: its figures under the nominal torque, and what helps where one is not good."""

from __future__ import annotations

from dataclasses import replace

from pmor.case import Case, change_case
from pmor.case.document import GEARS
from pmor.core.errors import PmorError
from pmor.gear.clearance import clearance_warnings
from pmor.pair.model import gear_pair
from pmor.report.torque_table import torque_row
from pmor.report.verdict import Finding, Seen, findings, verdict_of
from pmor.results.verdict import Advice, Change
from pmor_online.remedies import MeshTrials, off_most, remedy
from pmor_online.run import OnlineResult

# Of the basic rack, in modules: by how much higher teeth are tried, the highest ones first, and the least gain.
# Higher teeth are tried where the transverse contact ratio is not above `ENOUGH`.
ENOUGH = 1.3
HIGHER, LEAST_GAIN = (0.25, 0.2, 0.15, 0.1, 0.05), 0.05


def with_verdict(found: OnlineResult) -> OnlineResult:
    """Return a result with its verdict."""
    case, nominal = found.case, found.nominal
    several = len(case.online.torques_Nm) > 1
    seen = Seen(f"{case.torque_Nm:g} N m" if several else "", "", torque_row(found, nominal))
    return replace(found, verdict=verdict_of(findings([seen]), lambda one: _tried(found, one), found.failures))


def _tried(found: OnlineResult, one: Finding) -> Advice | str | None:
    case, torques = found.case, found.case.online.torques_Nm
    if case.reduction.shapes != "line_loads":
        return 'flanks are tried by line contact alone: write scheme = "line" in [contact]'
    if one.key == "effective_contact_ratio":
        rigid = found.reduced.meshed.pair.contact_ratio
        if rigid > ENOUGH:
            return f"relief takes contact off: teeth without it have a contact ratio of {rigid:.3g}"
        return higher_teeth(case)
    tried = MeshTrials(found.reduced, torques, tuple(f"{torque:g} N m" for torque in torques), found.nominal)
    if tried.beyond:
        return "flanks are not tried, since each trial takes as long as this run: lower [online] angles_per_pitch"
    return remedy(tried, one.key, off_most(tried, GEARS))


def higher_teeth(case: Case) -> Advice | None:
    """Return higher teeth of both gears, with the tip clearance that they have; None where there is no room for any."""
    before = gear_pair(case).contact_ratio
    gears = dict(zip(GEARS, (case.pair.pinion, case.pair.wheel), strict=True))
    for more in HIGHER:
        keys = {
            name: {"addendum": round(gear.addendum + more, 3), "dedendum": round(gear.dedendum + more, 3)}
            for name, gear in gears.items()
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
