"""Which capability takes which case: those that take some cases alone, and why."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from pmor.case.schema import Case
from pmor.core.errors import CaseError

Capability = Literal[
    "campaign", "classical", "design", "dynamics", "exudyn", "fmu", "gearbox", "page", "rexs", "set", "stability",
    "vtkhdf",
]  # fmt: skip

NAMES: dict[Capability, str] = {
    "campaign": "a campaign", "classical": "the table of classical formulas", "design": "a design",
    "dynamics": "the force law of dynamics", "exudyn": "a mesh in exudyn",
    "fmu": "the force law of a unit for co-simulation", "gearbox": "a gearbox",
    "page": "the live page", "rexs": "a REXS file", "set": "a set", "stability": "the matrix of stability",
    "vtkhdf": "a VTKHDF file",
}  # fmt: skip
# Nodes of a flank beyond which its compliance takes more of a page than all else: 8 x 8 quadratic elements have 289.
MOST_NODES = 600


def _shapes(case: Case) -> str:
    if case.reduction.shapes == "line_loads":
        return ""
    return (
        f'line loads, not "{case.reduction.shapes}": set [contact] scheme = "line", [reduction] shapes = "line_loads"'
    )


def _uneven_teeth(case: Case) -> str:
    uneven = any(m.pitch_deviations_um for m in (case.pinion_modification, case.wheel_modification))
    return "no pitch deviations, with which it does not repeat each mesh cycle: leave them out" if uneven else ""


def _coast(case: Case) -> str:
    if case.flank == "drive":
        return ""
    return "drive flanks: give [load] torque_Nm positive, and the coast flanks as a [[condition]]"


def _ring(case: Case) -> str:
    return "external gears, and the wheel is a ring: take the pair alone" if case.pair.wheel.internal else ""


def _many_nodes(case: Case) -> str:
    across = 1 if case.mesh.width == "plane_strain" else case.mesh.width_elements
    nodes = (case.mesh.profile_intervals + 1) * (case.mesh.order * across + 1)
    return f"flanks of {MOST_NODES} nodes at most, and these have {nodes} nodes" if nodes > MOST_NODES else ""


def _bodies(case: Case) -> str:
    brought = case.pair.pinion.body is not None or case.pair.wheel.body is not None
    return "no body of one's own, a mesh or a matrix: give the blank by dimensions, or leave it out" if brought else ""


def _one_piece(case: Case) -> str:
    one_piece = case.pair.pinion.one_piece or case.pair.wheel.one_piece
    return "gears that are rigid at their bores: leave one_piece out" if one_piece else ""


def _holes(case: Case) -> str:
    return "no holes, with which it does not repeat each mesh cycle: leave them out" if any(case.pair.holes) else ""


def _lugs(case: Case) -> str:
    rule = "rings that are rigid all over their outside: leave held and seats out of [wheel]"
    return rule if case.pair.wheel.rim_gives else ""


# A rule says which cases its capabilities take, for a case that they do not take; of others it is empty.
LIMITS: tuple[tuple[Callable[[Case], str], tuple[Capability, ...]], ...] = (
    (_shapes, ("campaign", "design", "dynamics", "exudyn", "fmu", "gearbox", "page", "rexs", "set")),
    (_coast, ("campaign", "design", "exudyn", "fmu", "gearbox", "page", "rexs", "vtkhdf")),
    (_uneven_teeth, ("exudyn", "fmu")),
    (_ring, ("campaign", "gearbox", "stability")),
    (_many_nodes, ("page",)),
    (_lugs, ("classical", "exudyn", "fmu", "page", "rexs", "vtkhdf")),
    (_bodies, ("rexs",)),
    (_one_piece, ("rexs", "set", "vtkhdf")),
    (_holes, ("classical", "exudyn", "fmu", "gearbox", "page", "vtkhdf")),
)


def why_not(case: Case, capability: Capability) -> str:
    """Return the reason why a capability does not take a case, with a remedy; empty where it does."""
    reasons = (limit(case) for limit, limited in LIMITS if capability in limited)
    return next((f"{NAMES[capability]} takes {reason}" for reason in reasons if reason), "")


def refuse_beyond(case: Case, capability: Capability, where: str | None = None) -> None:
    """Raise CaseError for a case that a capability does not take, with a place, by default the name of the case."""
    if reason := why_not(case, capability):
        raise CaseError(f"{where or case.name}: {reason}")
