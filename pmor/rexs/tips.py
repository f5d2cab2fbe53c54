"""Tip circles that a file does not say: shortened until they clear the teeth of the mate.

With an addendum of 1 tips can meet what the mate's tool leaves, above all where profile shifts are large or the mate is
a ring's pinion. Drawings then shorten the tips, by -k m_n (ISO 21771, 5.4); tips that a file says stay as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pmor.case import make_case
from pmor.core.errors import CaseError, GeometryError
from pmor.pair.model import gear_pair

NAMES = "pinion", "wheel"
# Modules by which tips are shortened at a time, and how often at most.
STEP, MOST_STEPS = 0.01, 60


def clear_tips(pair: dict[str, Any], teeth: Sequence[dict[str, Any]], labels: Sequence[str | None]) -> list[str]:
    """Lower the key `addendum` of gears until the pair runs, or what stops it is no tip of theirs; return notes.

    Parameters
    ----------
    pair, teeth : dict, two dicts
        Sections of a case.
    labels : two str or None
        Of the gears whose tips may be shortened, for the notes; None of the others.
    """
    begun = [keys.get("addendum", 1.0) for keys in teeth]
    steps, why = [0, 0], ["", ""]

    def stopped(gear: int, by: int) -> int | None:
        """The gear whose tips stop the pair with those of a gear shorter by so many steps."""
        steps[gear] = by
        if by:
            teeth[gear]["addendum"] = float(f"{begun[gear] - STEP * by:.12g}")
        try:
            gear_pair(make_case("pair", pair=pair, pinion=teeth[0], wheel=teeth[1], load={"torque_Nm": 1.0}))
        except CaseError:
            return None
        except GeometryError as error:
            found = _to_shorten(str(error), labels)
            if found is not None:
                why[found] = why[found] or _shown(str(error), found)
            return found
        return None

    gear = stopped(0, 0) if any(labels) else None
    while gear is not None and steps[gear] < MOST_STEPS:
        near, far = steps[gear], MOST_STEPS
        while far - near > 1:
            middle = (near + far) // 2
            near, far = (middle, far) if stopped(gear, middle) == gear else (near, middle)
        gear = stopped(gear, far)
    return [
        f"{label}: addendum shortened to {teeth[gear]['addendum']:.2f}, k = {-STEP * steps[gear]:.2f}: with "
        f"{begun[gear]:g}, which a file without tip_diameter leaves, {why[gear]}"
        for gear, label in enumerate(labels) if steps[gear]
    ]  # fmt: skip


def _to_shorten(reason: str, labels: Sequence[str | None]) -> int | None:
    """The gear whose tips stop a pair; where they pass through those of a mate that is longer by choice, the mate."""
    for gear, name in enumerate(NAMES):
        if reason.startswith(f"the {name}'s tip") or (reason.startswith(f"[{name}]") and "pointed" in reason):
            if labels[gear]:
                return gear
            return 1 - gear if labels[1 - gear] and "pass through" in reason else None
    return None


def _shown(reason: str, gear: int) -> str:
    """The reason of a refusal from the gear's own side."""
    said = reason.partition(", more than")[0].partition(", the tip clearance")[0].partition("; reduce")[0]
    return said.replace(f"the {NAMES[gear]}'s", "its").replace(f"the {NAMES[1 - gear]}'s", "its mate's")
