"""Rules for the section `[dynamics]` of a case."""

from __future__ import annotations

from pmor.case.schema import Case, DynamicsCase
from pmor.case.values import toml_text
from pmor.core.errors import CaseError

DEGREES_OF_FREEDOM = (1, 6, 12)
# Values that lists by direction hold, by the degrees of freedom.
DIRECTIONS = {6: 2, 12: 3}
DIRECTION_NAMES = "x, y, z"
TILTING_AXES = 2
GEARS = ("pinion", "wheel")


def check_dynamics(case: Case, where: str) -> None:
    """Raise CaseError where values of `[dynamics]` do not go together; see `pmor.case.checks.check_together`."""
    dynamics = case.dynamics
    if dynamics.degrees_of_freedom not in DEGREES_OF_FREEDOM:
        raise _refused(where, dynamics, "degrees_of_freedom", "must be 1, 6 or 12: write one of them")
    _check_frequencies(dynamics, where)
    for gear in GEARS:
        _check_bearings(dynamics, gear, where)


def _check_frequencies(dynamics: DynamicsCase, where: str) -> None:
    for key in ("mesh_frequency_ratio", "mesh_frequency_Hz"):
        values = getattr(dynamics, key)
        if values is not None and len(values) != 2:
            rule = f"must be two values, the lowest and the highest, not {len(values)}: write both, as in [0.3, 1.3]"
            raise _refused(where, dynamics, key, rule)
    for value, other in (("mesh_frequency_Hz", "mesh_frequency_ratio"), ("mesh_damping_N_s_mm", "damping_ratio")):
        if getattr(dynamics, value) is not None and getattr(dynamics, other) != getattr(DynamicsCase, other):
            raise _refused(where, dynamics, value, f"{other} says it too: leave one of them out")


def _check_bearings(dynamics: DynamicsCase, gear: str, where: str) -> None:
    stiffness, damping = f"{gear}_bearing_stiffness_N_um", f"{gear}_bearing_damping_N_s_mm"
    tilting, freedom = f"{gear}_tilting_stiffness_kNm_rad", dynamics.degrees_of_freedom
    for key in (stiffness, damping, tilting):
        if getattr(dynamics, key) is not None and freedom == 1:
            rule = "with degrees_of_freedom = 1 bearings are rigid: write 6 or 12 there, or leave this out"
            raise _refused(where, dynamics, key, rule)
    if getattr(dynamics, tilting) is not None and freedom == DEGREES_OF_FREEDOM[1]:
        raise _refused(where, dynamics, tilting, "with degrees_of_freedom = 6 gears do not tilt: write 12 there")
    if getattr(dynamics, damping) is not None and getattr(dynamics, stiffness) is None:
        raise _refused(where, dynamics, damping, f"without {stiffness} bearings are rigid: give it, or leave this out")
    for key in (stiffness, damping):
        values = getattr(dynamics, key)
        if values is not None and len(values) != DIRECTIONS[freedom]:
            names = ", ".join(DIRECTION_NAMES.split(", ")[: DIRECTIONS[freedom]])
            rule = f"must be {DIRECTIONS[freedom]} values with degrees_of_freedom = {freedom}: one each for {names}"
            raise _refused(where, dynamics, key, rule)
    values = getattr(dynamics, tilting)
    if values is not None and len(values) != TILTING_AXES:
        raise _refused(where, dynamics, tilting, "must be two values: one each about x and y")


def _refused(where: str, dynamics: DynamicsCase, key: str, rule: str) -> CaseError:
    return CaseError(f"{where}: [dynamics] {key} = {toml_text(getattr(dynamics, key))}: {rule}")
