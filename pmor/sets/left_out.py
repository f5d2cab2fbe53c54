"""What files of results of a set leave out, and why."""

from __future__ import annotations

from dataclasses import replace

from pmor.case.capability import why_not
from pmor.sets.layout import SECOND_PLANET
from pmor.sets.loader import SetFile
from pmor.sets.settings import Carrier, Eccentricity, Supports

# Keys of gears and flanks that differ from end to end: files of sets have one planet for both of its meshes.
ONE_WAY = ("face_offset_mm", "topography")


def why_no_rexs(file: SetFile) -> str:
    """Return why a set cannot be written as REXS, with a remedy; empty where it can."""
    said = file.sections
    if said.gears:
        return "REXS files take planetary sets, not trains on fixed axes: describe the shafts in a gearbox file"
    if SECOND_PLANET in said.members:
        return f"REXS files take no stepped planets: leave [{SECOND_PLANET}] out"
    if file.plan.clockwise:
        return "REXS files take sets whose torque turns the sun counter-clockwise: give it the other sign"
    held = replace(said.supports, sun_radial_N_per_mm="rigid", planet_radial_N_per_mm="rigid")
    if held != Supports():
        return "REXS files take [supports] of sun and planets across alone: leave the others out"
    if said.carrier != Carrier():
        return "REXS files take a rigid carrier: leave [carrier] out"
    if said.pins is not None and said.pins.cheeks != "both":
        return 'REXS files take pins in both cheeks: write [pins] cheeks = "both"'
    if said.eccentricity != Eccentricity():
        return "REXS files take gears that are centred: leave [eccentricity] out"
    for case in file.cases.values():
        if reason := why_not(replace(case, flank="drive"), "rexs"):
            return reason
        for gear, modification in (
            (case.pair.pinion, case.pinion_modification), (case.pair.wheel, case.wheel_modification)
        ):  # fmt: skip
            one_way = [key for key in (*ONE_WAY, "pitch_deviations_um")
                       if getattr(gear, key, None) or getattr(modification, key, None)]  # fmt: skip
            if one_way:
                return f"REXS files take gears of sets that are alike from both ends, and their teeth: no {one_way[0]}"
    return ""
