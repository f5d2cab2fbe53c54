"""The lubricant of a REXS gearbox: viscosity at its temperature, roughness of the flanks; and the other way."""

from __future__ import annotations

import math
from collections.abc import Callable

from pmor.case.duty import Lubricant
from pmor.rexs.document import Attributes
from pmor.rexs.model import Component, Gearbox

# Keys of ours by the names of ours.
OWN = {
    "custom_pmor_viscosity": "viscosity_mPas", "custom_pmor_roughness": "roughness_um",
    "custom_pmor_lubricant_factor": "lubricant_factor", "custom_pmor_friction": "friction",
}  # fmt: skip
TEMPERATURES = ("temperature_lubricant", "operating_temperature_lubricant")
ROUGHNESS = ("arithmetic_mean_roughness_flank_iso_4287_1997", "arithmetic_average_roughness_flank")
# Kelvin at 0 deg C; ASTM D341: added to a viscosity in mm^2/s; of mineral oil, kg/dm^3 by K.
KELVIN, ADDED, EXPANSION = 273.15, 0.7, 6.5e-4


def lubricant_attributes(lubricant: Lubricant) -> Attributes:
    """Return what says a lubricant in a file: names of ours, as REXS has no dynamic viscosity at a temperature."""
    return {name: getattr(lubricant, key) for name, key in OWN.items()}


def read_lubricant(gearbox: Gearbox, note: Callable[[str], None]) -> Lubricant:
    """Return the lubricant of the gearbox, with a note on what is assumed."""
    found = gearbox.of_kind("lubricant")
    own = [{key: value for name, key in OWN.items() if (value := _value(one, name)) is not None} for one in found]
    if any(own):
        return Lubricant(**next(keys for keys in own if keys))  # type: ignore[arg-type]
    usual = Lubricant()
    viscosity, roughness = _viscosity(gearbox, found, note), _roughness(gearbox)
    assumed = [f"{usual.viscosity_mPas:g} mPa s"] if viscosity is None else []
    assumed += [f"flanks of Ra {usual.roughness_um:g} um"] if roughness is None else []
    if assumed:
        note(f"losses: {' and '.join(assumed)} assumed, as the file does not say them")
    return Lubricant(viscosity_mPas=viscosity or usual.viscosity_mPas, roughness_um=roughness or usual.roughness_um)


def _value(component: Component, name: str) -> float | str | None:
    value, _ = component.values.get(name, (None, ""))
    return value if isinstance(value, float | str) and value != "" else None


def _viscosity(gearbox: Gearbox, found: list[Component], note: Callable[[str], None]) -> float | None:
    """Dynamic viscosity at the temperature of the oil, mPa s (ASTM D341); None where the file leaves it open."""
    for one in found:
        low, high = one.number_of("viscosity_at_40_degree_celsius"), one.number_of("viscosity_at_100_degree_celsius")
        density = one.number_of("density_at_15_degree_celsius")
        parts = gearbox.of_kind("cylindrical_stage") + gearbox.of_kind("gear_unit")
        said = (part.number_of(*TEMPERATURES) for part in parts)
        temperature = next((value for value in said if value is not None), None)
        if not low or not high or not density or low <= high or temperature is None or temperature <= -KELVIN:
            continue
        (x, y), (u, v) = ((math.log10(t + KELVIN), math.log10(math.log10(nu + ADDED)))
                          for t, nu in ((40.0, low), (100.0, high)))  # fmt: skip
        at = y + (v - y) / (u - x) * (math.log10(temperature + KELVIN) - x)
        kinematic = 10.0**10.0**at - ADDED
        dynamic = float(f"{kinematic * (density - EXPANSION * (temperature - 15.0)):.4g}")
        note(f"{one.label}: {dynamic:g} mPa s at {temperature:g} deg C, by ASTM D341 from its viscosities")
        return dynamic
    return None


def _roughness(gearbox: Gearbox) -> float | None:
    """Mean Ra of the flanks, um; None where no gear has it."""
    said = [value for gear in gearbox.of_kind("cylindrical_gear") if (value := gear.number_of(*ROUGHNESS))]
    return float(f"{1e3 * sum(said) / len(said):.4g}") if said else None
