"""Limits of linear elasticity and small deformations, checked before anything is solved."""

from __future__ import annotations

import math
from collections.abc import Callable

from pmor.case import Case
from pmor.case.slips import case_slips
from pmor.case.values import wrong_unit_text
from pmor.core.errors import CaseError
from pmor.gear.clearance import clearance_warnings
from pmor.gear.pair import GearPair

# Hertz pressure over the modulus of the contact: 2.3 GPa for steel on steel, where hardened flanks begin to yield.
PRESSURE_OVER_MODULUS = 0.02
# Approach of the flanks, in modules, above which teeth no longer keep their shape, and above which no geometry of
# contact is left: they would be bent through their neighbours.
LARGE_APPROACH = 0.05
LARGEST_APPROACH = 0.5
# Largest round-off of the coordinates over the approach.
MOST_ROUND_OFF = 0.1
# Above it, plain linear hexahedra cannot deform without changing their volume: measured at 0.499, 25 % too stiff.
LOCKING_POISSON_RATIO = 0.45
# Sagitta that facets cut off helical flanks, over the approach, above which it shows in the transmission error.
LARGEST_BULGE = 0.05
# Axial deflection of a blank under a force F at its rim, over F L^2 / D, L from bore to tip and D the stiffness of the
# plate: measured with 21 teeth, 4 mm and a bore of 20 mm. A plate is linear up to about half its thickness.
RIM_DEFLECTION, LARGEST_DEFLECTION = 0.18, 0.5
# Columns of elements to an axial pitch below which lines of contact end between sections.
FEWEST_COLUMNS = 4.0


def refuse_impossible_load(case: Case, approach_mm: float) -> None:
    """Raise CaseError when the largest torque would bend teeth by more than the tooth spaces allow.

    Parameters
    ----------
    approach_mm : float
        Of the flanks, to expect under the nominal torque, mm.
    """
    torque, key = largest_torque(case)
    in_modules = approach_mm * torque / case.torque_Nm / case.pair.module_mm
    if in_modules > LARGEST_APPROACH:
        remedy = f"stay below {torque * LARGEST_APPROACH / in_modules:.3g} N m"
        if in_modules < 1e3 * LARGE_APPROACH:
            remedy += f", or {wrong_unit_text(torque, 'newton millimetres', 'N mm', 1e-3 * torque, 'N m')}"
        raise CaseError(
            f"torque of {torque:g} N m ({key}): the flanks would approach by {in_modules:.3g} modules, more than the "
            f"{LARGEST_APPROACH:g} that teeth have room for: {remedy}; or widen the face"
        )


def largest_torque(case: Case) -> tuple[float, str]:
    """Return the largest torque that a case asks for, N m, and the key that says it."""
    key, torques = max(case.asked_torques_Nm.items(), key=lambda item: max(item[1]))
    return max(torques), key


def refuse_bent_blank(case: Case, pair: GearPair, held_mm: tuple[float, float]) -> None:
    """Raise CaseError when helical flanks would bend a blank outside its held radius as no linear body bends."""
    torque, _ = largest_torque(case)
    force = 1e3 * torque / pair.pinion.base_radius * math.tan(abs(pair.base_helix_angle))
    gears = (("pinion", case.pair.pinion, pair.pinion), ("wheel", case.pair.wheel, pair.wheel))
    for (name, gear, tooth), (low, high), radius in zip(gears, pair.faces, held_mm, strict=True):
        thickness, overhang = high - low, abs(tooth.tip_radius - radius)
        plate = 1e3 * gear.youngs_modulus_GPa * thickness**3 / (12.0 * (1.0 - gear.poisson_ratio**2))
        deflection = RIM_DEFLECTION * force * overhang**2 / plate
        if deflection > LARGEST_DEFLECTION * thickness:
            raise CaseError(
                f"torque of {torque:g} N m: the axial force of the helical flanks, {force:.3g} N, would bend the "
                f"{name}'s blank, {thickness:.3g} mm thick, by about {deflection:.2g} mm, more than half of its "
                "thickness, beyond a linear body: lower the torque, widen the face, or enlarge bore_radius_mm"
            )


def refuse_lost_load(case: Case, round_off_at: Callable[[float], float]) -> None:
    """Raise CaseError when the smallest torque presses the flanks together by less than coordinates can tell.

    Parameters
    ----------
    round_off_at : callable
        Round-off of the coordinates over the approach of the flanks under a torque (N mm).
    """
    key, torques = min(case.asked_torques_Nm.items(), key=lambda item: min(item[1]))
    torque = min(torques)
    round_off = round_off_at(1e3 * torque)
    if round_off > MOST_ROUND_OFF:
        raise CaseError(
            f"torque of {torque:g} N m ({key}): the flanks approach by so little that round-off of the coordinates is "
            f"{round_off:.2g} of it, more than {MOST_ROUND_OFF:g}: stay above "
            f"{torque * round_off / MOST_ROUND_OFF:.2g} N m"
        )


def range_warnings(case: Case, pair: GearPair, approach_mm: float) -> tuple[str, ...]:
    """Warn of an unusual pair, and of a case beyond the range of linear elasticity or of its elements.

    Parameters
    ----------
    approach_mm : float
        As in `refuse_impossible_load`.

    Returns
    -------
    tuple of str
        Each with the number, the usual range and the consequence; empty for an ordinary case.
    """
    warnings = [*clearance_warnings(pair), *case_slips(case)]
    stiffest = max(case.pair.pinion.poisson_ratio, case.pair.wheel.poisson_ratio)
    if case.mesh.element == "hex8" and stiffest > LOCKING_POISSON_RATIO:
        warnings.append(
            f"poisson_ratio = {stiffest:g} with plain hexahedra: they lock above {LOCKING_POISSON_RATIO:g}, the teeth "
            'come out too stiff: write element = "hex8i" in [mesh]'
        )
    if case.mesh.order > 1 and case.contact.kind != "line":
        warnings.append(
            f'scheme = "{case.contact.scheme}" on quadratic elements: their corners and middles carry points unevenly, '
            'and pressures swing from node to node: write element = "hex8i" in [mesh], or scheme = "line"'
        )
    pressure, modulus = hertz_pressure(case, pair)
    if pressure > PRESSURE_OVER_MODULUS * modulus:
        warnings.append(
            f"Hertz pressure {pressure:.4g} N/mm2 is {100.0 * pressure / modulus:.2g} % of the modulus, above "
            f"{100.0 * PRESSURE_OVER_MODULUS:g} %: real flanks yield, the results are those of a linear material"
        )
    if approach_mm > LARGE_APPROACH * case.pair.module_mm:
        warnings.append(
            f"the flanks approach by about {approach_mm:.3g} mm, {approach_mm / case.pair.module_mm:.2g} modules, "
            f"above {LARGE_APPROACH:g}: beyond small deformations, the results are those of a linear body"
        )
    bulge = _cut_off_bulge(case, pair)
    if bulge > LARGEST_BULGE * approach_mm:
        warnings.append(
            f"facets between the layers of nodes cut {1e3 * bulge:.2g} um off the helicoids, "
            f"{100.0 * bulge / approach_mm:.2g} % of the approach, above {100.0 * LARGEST_BULGE:g} %: raise [mesh] "
            'width_elements, or write scheme = "direct", which has none'
        )
    columns = _columns_to_an_axial_pitch(case, pair)
    if columns < FEWEST_COLUMNS:
        warnings.append(
            f"{columns:.2g} columns of elements to an axial pitch, fewer than {FEWEST_COLUMNS:g}: lines of contact end "
            "between sections, and transmission error and load sharing ripple with them: raise [mesh] width_elements"
        )
    return tuple(warnings)


def _columns_to_an_axial_pitch(case: Case, pair: GearPair) -> float:
    """Return over how many columns of elements a line of contact goes on to the next tooth; infinite for spur gears."""
    widest = max(high - low for low, high in pair.faces)
    if pair.overlap_ratio == 0.0:
        return math.inf
    return pair.common_width / pair.overlap_ratio * case.mesh.width_elements / widest


def _cut_off_bulge(case: Case, pair: GearPair) -> float:
    """Sagittas of helical flanks between the edges of facets, both gears together, mm; 0 without facets."""
    contact, layers = case.contact, case.mesh.width_elements
    if contact.scheme not in ("paper", "facet"):
        return 0.0
    layers *= contact.lodm_width if contact.scheme == "paper" else 1
    teeth = zip((pair.pinion, pair.wheel), pair.faces, strict=True)
    return sum(tooth.helix_sagitta((high - low) / layers) for tooth, (low, high) in teeth)


def hertz_pressure(case: Case, pair: GearPair) -> tuple[float, float]:
    """Return Hertz pressure at the pitch point with one pair carrying the nominal load, and the contact's modulus, MPa.

    Line contact of cylinders (Johnson, Contact Mechanics, 1985, eq. 4.45): ``p = sqrt(w E* / (pi R))``.
    """
    gears = case.pair.pinion, case.pair.wheel
    modulus = 1.0 / sum((1.0 - g.poisson_ratio**2) / (1e3 * g.youngs_modulus_GPa) for g in gears)
    load = 1e3 * case.torque_Nm / pair.pinion.base_radius / pair.common_width
    return math.sqrt(load * modulus / (math.pi * pair.pitch_point_radius)), modulus
