"""Ring gears of a REXS file: teeth, cutter and rim as keys of a case, and the other way.

Numbers of teeth and diameters are positive in files; a profile shift is taken to be positive towards the tip, as by
ISO 21771. No attribute of a ring is its outside: it is that of the shaft that carries it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from pmor.case import GearCase, make_case
from pmor.core.errors import GeometryError
from pmor.export.rexs.document import Value
from pmor.export.rexs.model import Component
from pmor.gear.tooth import Tooth
from pmor.pair.model import gear_pair

CUTTER = "cutter_wheel_tool"
# Modules: of a rim of which nothing is said; steps by which tips are shortened until they clear the mate's fillets.
USUAL_RIM, STEP, MOST_STEPS = 3.0, 0.01, 60


def ring_keys(
    gear: Component, cutters: Sequence[Component], sizes: tuple[int, float, float, float], outside_mm: float | None
) -> tuple[dict[str, Any], list[str]]:
    """Return the keys of a ring but profile shift and modifications of flanks, and notes.

    Parameters
    ----------
    cutters : sequence of Component
        Its tools that are cutter wheels.
    sizes : (int, float, float, float)
        Teeth, normal module (mm), helix angle (deg), profile shift.
    outside_mm : float or None
        Diameter of the shaft that carries it.
    """
    teeth, module, helix, shift = sizes
    radius = 0.5 * teeth * module / math.cos(math.radians(helix))
    keys: dict[str, Any] = {"teeth": teeth, "internal": True}
    notes = [f"{gear.label}: its profile shift counts towards the tip, as by ISO 21771"] if shift else []
    tip, height = gear.number_of("tip_diameter"), gear.number_of("tooth_tip_height")
    if tip is not None:
        keys["addendum"] = _rounded((radius - 0.5 * abs(tip)) / module - shift)
    elif height is not None:
        keys["addendum"] = _rounded(height / module - shift)
    else:
        notes.append(f"{gear.label}: no tip_diameter: addendum 1 assumed")
    root = gear.number_of("root_diameter")
    if cutters and (cutter := cutters[-1]).number_of("number_of_teeth"):
        keys["shaper"] = _shaper(cutter, module)
    else:
        if own := gear.number_of("custom_pmor_dedendum"):
            keys["dedendum"] = own
        elif root is not None:
            keys["dedendum"] = float(f"{(0.5 * abs(root) - radius) / module + shift:.9g}")
        if fillet := gear.number_of("custom_pmor_root_fillet"):
            keys["root_fillet_mm"] = fillet
        else:
            notes.append(f"{gear.label}: no cutter wheel with its teeth: a fillet of the radius of ISO 53 A assumed")
    deepest = radius + module * (keys.get("dedendum", keys.get("shaper", {}).get("addendum", 1.25)) - shift)
    rim = gear.number_of("custom_pmor_rim_thickness")
    if rim is None and outside_mm is not None and 0.5 * outside_mm > deepest + module:
        rim = 0.5 * outside_mm - deepest
    if rim is None:
        rim = USUAL_RIM * module
        notes.append(f"{gear.label}: nothing says its outside: a rim of {rim:g} mm below the teeth assumed")
    return keys | {"rim_thickness_mm": _rounded(rim)}, notes


def cleared(pair: dict[str, Any], teeth: Sequence[dict[str, Any]], label: str) -> tuple[float, str] | None:
    """Return an addendum of a ring whose assumed tips would cut into fillets, and a note; None where they clear them.

    Parameters
    ----------
    pair, teeth : mapping, two mappings
        Sections of a case.
    """
    why = ""
    for step in range(MOST_STEPS):
        addendum = 1.0 - STEP * step
        both = {"pinion": teeth[0], "wheel": teeth[1] | {"addendum": addendum}, "load": {"torque_Nm": 1.0}}
        try:
            gear_pair(make_case("pair", pair=pair, **both))
        except GeometryError as error:
            if "the wheel's tip" in str(error):
                said = str(error).partition(", more than")[0]
                why = why or said.replace("the wheel's", "its").replace("the pinion's", "its mate's")
                continue
        return (_rounded(addendum), f"{label}: addendum shortened to {addendum:.2f}: with 1, which a file without "
                f"tip_diameter leaves, {why}") if step else None  # fmt: skip
    return None


def cutter_attributes(said: GearCase, tooth: Tooth) -> dict[str, Value]:
    """Return the attributes of the tool of a ring; none without a shaper."""
    if (shaper := said.shaper) is None:
        return {}
    return {
        "number_of_teeth": shaper.teeth, "addendum_coefficient_reference_profile": shaper.addendum,
        "tip_corner_radius_factor_reference_profile": _rounded(shaper.tip_radius_mm / tooth.module),
        "addendum_modification_coefficient": shaper.profile_shift,
    }  # fmt: skip


def ring_attributes(said: GearCase, tooth: Tooth) -> dict[str, Value]:
    """Return the attributes of a ring that an external gear does not have."""
    found: dict[str, Value] = {
        "root_diameter": _rounded(-2.0 * tooth.root_radius), "custom_pmor_rim_thickness": said.rim_thickness_mm or 0.0
    }  # fmt: skip
    # The root circle has the allowance of the tooth thickness in it.
    own: dict[str, Value] = {"custom_pmor_root_fillet": _rounded(tooth.root_fillet),
                             "custom_pmor_dedendum": said.dedendum}  # fmt: skip
    return found if said.shaper else found | own


def _shaper(cutter: Component, module: float) -> dict[str, Any]:
    keys: dict[str, Any] = {"teeth": cutter.whole_number_of("number_of_teeth")}
    if (addendum := cutter.number_of("addendum_coefficient_reference_profile")) is None:
        length = cutter.number_of("addendum_reference_profile")
        addendum = 1.25 if length is None else length / module
    factor = cutter.number_of("tip_corner_radius_factor_reference_profile") or 0.0
    rounding = cutter.number_of("tip_corner_radius_reference_profile", "tip_corner_radius_cutter")
    shift = cutter.number_of("addendum_modification_coefficient") or 0.0
    keys |= {
        "addendum": _rounded(addendum),
        "tip_radius_mm": _rounded(factor * module if rounding is None else rounding),
    }
    return keys | ({"profile_shift": _rounded(shift)} if shift else {})


def _rounded(value: float) -> float:
    return float(f"{value:.12g}")
