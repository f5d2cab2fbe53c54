"""A gear of a REXS file as a section of a case: teeth, tool, bore, blank, material; notes on what it leaves open."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from pmor.core.errors import CaseError
from pmor.rexs.blanks import blank_keys
from pmor.rexs.joints import RING, shafts_of
from pmor.rexs.model import Component, Gearbox
from pmor.rexs.rings import CUTTER, ring_keys
from pmor.rexs.shifts import Rack, profile_shifts, said_shift
from pmor.rexs.stage import middle_on_shaft
from pmor.rexs.units import rounded

# Bore over reference diameter where nothing says it; modules.
BORE_SHARE, USUAL_ADDENDUM, USUAL_DEDENDUM = 0.2, 1.0, 1.25
# Modules between root circle and bore below which a blank cannot be meshed: the gear is cut into its shaft.
LEAST_RIM = 1.5
# Largest profile shift of a case, either way.
MOST_SHIFT = 3.0


@dataclass
class GearInFile:
    """A gear with the flank that carries, and the keys of its section.

    Parameters
    ----------
    rack : Rack
        Of its stage.
    where : str
        For messages.
    notes : list of str
        Assumptions: further ones are added.
    tip_is_open : bool
        Whether the file leaves its tip circle open.
    """

    gearbox: Gearbox
    gear: Component
    flank: Component
    rack: Rack
    where: str
    notes: list[str]
    tip_is_open: bool = False
    keys: dict[str, Any] = field(init=False)

    def __post_init__(self) -> None:
        shift, ring = self._shift(), self.gear.kind == RING
        teeth, module = self.needed("number_of_teeth"), self.rack.module
        radius = 0.5 * teeth * module / math.cos(self.rack.helix_angle)
        keys: dict[str, Any] = {"teeth": int(teeth), **({"profile_shift": rounded(shift)} if shift else {})}
        keys |= self._addendum(shift, radius, -1.0 if ring else 1.0)
        if ring:
            sizes = int(teeth), module, math.degrees(self.rack.helix_angle), shift
            cutters = tools_of(self.gearbox, self.gear, self.flank)
            found, notes = ring_keys(self.gear, cutters, sizes, self._shaft_diameter())
            keys |= found
            self.notes += notes
        else:
            keys |= self._tool(shift, radius)
            depth = module * (keys.get("dedendum", USUAL_DEDENDUM) - shift)
            keys["bore_radius_mm"] = self._bore(radius - depth, radius)
            keys |= blank_keys(self.gear)
        if chamfer := self.flank.number_of("tooth_tip_chamfer"):
            keys["tip_chamfer_mm"] = chamfer
        if rounding := self.flank.number_of("custom_pmor_tip_rounding"):
            keys["tip_rounding_mm"] = rounding
        if allowances := self.flank.numbers_of("custom_pmor_tooth_thickness_allowances"):
            keys["tooth_thickness_allowance_um"] = [rounded(1e3 * allowance) for allowance in allowances]
        self.keys = keys | self._material()

    def needed(self, attribute: str) -> float:
        """Return a number of the gear; CaseError where the file does not say it."""
        value = self.gear.whole_number_of(attribute)
        if value is None:
            raise CaseError(f"{self.where}: {self.gear.label}: {attribute} is missing: a case needs it")
        return value

    def note(self, sentence: str) -> None:
        """Say something of this gear."""
        self.notes.append(f"{self.gear.label}: {sentence}")

    def _shift(self) -> float:
        """Profile shift coefficient: as the flank that carries says it, else as the file says it another way."""
        found = profile_shifts(self.gearbox)[self.gear.number]
        if not found.how and (said := said_shift(self.gear, [self.flank])) is not None:
            return said
        if abs(found.coefficient) > MOST_SHIFT:
            rule = f"must be between {-MOST_SHIFT:g} and {MOST_SHIFT:g}: check teeth, module and distance of the stage"
            raise CaseError(f"{self.where}: {self.gear.label}: {found.how}: {rule}")
        if found.how:
            self.note(found.how)
        return found.coefficient

    def _addendum(self, shift: float, radius: float, outwards: float) -> dict[str, float]:
        """Addendum of the basic rack: from the tip circle or the tooth height, else that of a rack, to be shortened."""
        module = self.rack.module
        tip, height = self.gear.number_of("tip_diameter"), self.gear.number_of("tooth_tip_height")
        above = None if tip is None else outwards * (0.5 * abs(tip) - radius)
        if above is not None and above > -module:
            return {"addendum": rounded(above / module - shift)}
        if above is None and height is not None:
            return {"addendum": rounded(height / module - shift)}
        self.tip_is_open = True
        why = "no tip_diameter" if tip is None else f"tip_diameter = {tip:g} mm is below its teeth"
        if (said := self.flank.number_of("addendum_coefficient_basic_profile")) is not None:
            self.note(f"{why}: addendum {said:g}, addendum_coefficient_basic_profile of its flank")
            return {"addendum": said}
        self.note(f"{why}: addendum {USUAL_ADDENDUM:g} assumed")
        return {}

    def _tool(self, shift: float, radius: float) -> dict[str, float]:
        """Dedendum and tip radius of the rack: from its tool, else from the root circle."""
        keys, module = dict[str, float](), self.rack.module
        if tools := tools_of(self.gearbox, self.gear, self.flank):
            tool = tools[-1]  # the last step makes the flank
            for key, size, factor in (
                ("dedendum", "addendum", "addendum_coefficient"),
                ("rack_tip_radius", "tip_corner_radius", "tip_corner_radius_factor"),
            ):
                value = tool.number_of(f"{factor}_reference_profile")
                length = tool.number_of(f"{size}_reference_profile")
                if value is None and length is not None:
                    value = length / module
                if value is not None:
                    keys[key] = rounded(value)
            if tool.number_of("protuberance_amount", "protuberance_amount_factor"):
                self.notes.append(f"{tool.label}: its protuberance is left out: the fillet begins where the rack ends")
        root = self.gear.number_of("root_diameter")
        if "dedendum" not in keys and root is not None:
            keys["dedendum"] = rounded((radius - 0.5 * root) / module + shift)
        if missing := [key for key in ("dedendum", "rack_tip_radius") if key not in keys]:
            self.note(f"no tool says {' and '.join(missing)}: that of ISO 53 A assumed")
        return keys

    def _bore(self, root_radius: float, radius: float) -> float:
        """Radius at which the body is held: of its bore, or of the shaft that it sits on."""
        if own := self.gear.number_of("custom_pmor_thin_rim_bore"):
            return rounded(0.5 * own)
        bodies = self.gearbox.beside(self.gear.number, "gear_body")
        said = (part.number_of("inner_diameter") for part in (self.gear, *bodies))
        bore = next((diameter for diameter in said if diameter), None) or self._shaft_diameter()
        if bore and 0.5 * bore < root_radius - LEAST_RIM * self.rack.module:
            return rounded(0.5 * bore)
        assumed = float(f"{BORE_SHARE * 2.0 * radius:.3g}")
        why = f"{bore:g} mm leaves no rim" if bore else "nothing says its bore"
        self.note(f"{why}: bore radius {assumed:g} mm assumed")
        return assumed

    def _shaft_diameter(self) -> float | None:
        """Diameter of the shaft below the middle of the face."""
        for shaft in shafts_of(self.gearbox, self.gear):
            middle = middle_on_shaft(self.gearbox, self.gear, shaft)
            for section in self.gearbox.beside(shaft.number, "shaft_section"):
                start, length = section.number_of("u_coordinate_on_shaft"), section.number_of("length")
                ends = [section.number_of(f"outer_diameter_{end}") for end in ("begin", "end")]
                if middle is None or start is None or not length or not start <= middle <= start + length:
                    continue
                low, high = (next((end for end in order if end), None) for order in (ends, ends[::-1]))
                return low and high and low + (high - low) * (middle - start) / length
        return None

    def _material(self) -> dict[str, float]:
        keys = dict[str, float]()
        for material in self.gearbox.beside(self.gear.number, "material"):
            if modulus := material.number_of("elastic_modulus"):
                keys["youngs_modulus_GPa"] = rounded(1e-3 * modulus)
            if (ratio := material.number_of("poisson_ratio")) is not None:
                keys["poisson_ratio"] = ratio
        if not keys:
            self.note("refers to no material: steel assumed, 210 GPa and 0.3")
        return keys


def tools_of(gearbox: Gearbox, gear: Component, flank: Component) -> list[Component]:
    """Return what cuts a flank, in the order of the steps."""
    kind = CUTTER if gear.kind == RING else "rack_shaped_tool"
    return gearbox.beside(flank.number, kind) or gearbox.beside(gear.number, kind)
