"""Ring gears of a REXS file: teeth, cutter and rim as keys of a case, and the other way.

Numbers of teeth and diameters are positive in files; a profile shift is taken to be positive towards the tip, as by
ISO 21771. No attribute of a ring is its outside: it is that of the shaft that carries it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from pmor.case import GearCase
from pmor.gear.tooth import Tooth
from pmor.rexs.document import Value
from pmor.rexs.model import Component
from pmor.rexs.units import rounded

CUTTER = "cutter_wheel_tool"
# Modules, of a rim of which nothing is said.
USUAL_RIM = 3.0


def ring_keys(
    gear: Component, cutters: Sequence[Component], sizes: tuple[int, float, float, float], outside_mm: float | None
) -> tuple[dict[str, Any], list[str]]:
    """Return the keys of a ring but profile shift, addendum and modifications of flanks, and notes.

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
    root = gear.number_of("root_diameter")
    if cutters and (cutter := cutters[-1]).number_of("number_of_teeth"):
        keys["shaper"], said = _shaper(cutter, module)
        notes += said
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
    return keys | {"rim_thickness_mm": rounded(rim)}, notes


def cutter_attributes(said: GearCase, tooth: Tooth) -> dict[str, Value]:
    """Return the attributes of the tool of a ring; none without a shaper."""
    if (shaper := said.shaper) is None:
        return {}
    return {
        "number_of_teeth": shaper.teeth, "addendum_coefficient_reference_profile": shaper.addendum,
        "tip_corner_radius_factor_reference_profile": rounded(shaper.tip_radius_mm / tooth.module),
        "addendum_modification_coefficient": shaper.profile_shift,
    }  # fmt: skip


def ring_attributes(said: GearCase, tooth: Tooth) -> dict[str, Value]:
    """Return the attributes of a ring that an external gear does not have."""
    found: dict[str, Value] = {
        "root_diameter": rounded(-2.0 * tooth.root_radius), "custom_pmor_rim_thickness": said.rim_thickness_mm or 0.0
    }  # fmt: skip
    # The root circle has the allowance of the tooth thickness in it.
    own: dict[str, Value] = {"custom_pmor_root_fillet": rounded(tooth.root_fillet),
                             "custom_pmor_dedendum": said.dedendum}  # fmt: skip
    return found if said.shaper else found | own


def _shaper(cutter: Component, module: float) -> tuple[dict[str, Any], list[str]]:
    """Keys of a cutter wheel, and a note on those that the file does not say: those of a new one with sharp corners."""
    addendum = cutter.number_of("addendum_coefficient_reference_profile")
    if addendum is None and (length := cutter.number_of("addendum_reference_profile")) is not None:
        addendum = length / module
    rounding = cutter.number_of("tip_corner_radius_reference_profile", "tip_corner_radius_cutter")
    if rounding is None and (factor := cutter.number_of("tip_corner_radius_factor_reference_profile")) is not None:
        rounding = factor * module
    shift = cutter.number_of("addendum_modification_coefficient")
    said = {"addendum 1.25": addendum, "sharp corners": rounding, "profile shift 0": shift}
    assumed = [words for words, value in said.items() if value is None]
    keys: dict[str, Any] = {
        "teeth": cutter.whole_number_of("number_of_teeth"), "addendum": rounded(1.25 if addendum is None else addendum),
        "tip_radius_mm": rounded(rounding or 0.0), **({"profile_shift": rounded(shift)} if shift else {}),
    }  # fmt: skip
    return keys, [f"{cutter.label}: {', '.join(assumed)} assumed"] if assumed else []
