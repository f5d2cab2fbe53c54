"""What no single key can know about what members of a set stand on: whether it holds them, and fits together."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import NoReturn

import numpy as np

from pmor.body.bearing import check_bearing, holds_tilt
from pmor.body.bearing_faults import overlap, takes_thrust_one_way
from pmor.case.schema import Case
from pmor.sets.plan import SetPlan
from pmor.sets.settings import Carrier, Pins, SetSections, Supports

Refuse = Callable[[str, str], NoReturn]
# Bearings on a pin that are closer stand at one place, mm.
APART_MM = 1e-3


def check_supports(said: SetSections, refuse: Refuse) -> None:
    """Refuse supports of a planetary set that do not hold, or are said twice."""
    supports, carrier = said.supports, said.carrier
    for key, name in (("planet_radial_N_per_mm", "planet"), ("sun_tilt_Nmm_per_rad", "sun"),
                      ("ring_tilt_Nmm_per_rad", "ring"), ("planet_tilt_Nmm_per_rad", "planet")):  # fmt: skip
        if getattr(supports, key) == "free":
            refuse(f'[supports] {key} = "free"', f'nothing would hold the {name}: write a number, or "rigid"')
    for key in ("tilt_Nmm_per_rad", "windup_Nmm_per_rad"):
        if getattr(carrier, key) == "free":
            refuse(f'[carrier] {key} = "free"', 'nothing would hold the carrier: write a number, or "rigid"')
    if {supports.sun_radial_N_per_mm, supports.ring_radial_N_per_mm, carrier.radial_N_per_mm} == {"free"}:
        refuse('[carrier] radial_N_per_mm = "free"', "sun, ring and carrier all float: hold one of them")
    if said.pins is not None:
        _check_pins(said.pins, supports, refuse)
    _check_carrier(carrier, said.pins, refuse)


def check_cheeks(said: SetSections, plan: SetPlan, cases: dict[str, Case], refuse: Refuse) -> None:
    """Refuse cheeks that would cut into the planets."""
    if (pins := said.pins) is None:
        return
    faces = []
    for mesh in plan.meshes:
        pair = cases[mesh.case].pair
        for number, gear in zip((mesh.pinion, mesh.wheel), (pair.pinion, pair.wheel), strict=True):
            if plan.bodies[number].x or plan.bodies[number].y:  # neither sun nor ring
                faces.append(np.array(gear.face(pair.face_width_mm)) + plan.bodies[number].z)
    ends = min(face[0] for face in faces), max(face[1] for face in faces)
    for cheek, end, face in zip(("-z", "+z"), pins.ends_mm, ends, strict=True):
        side = -1.0 if cheek == "-z" else 1.0
        if pins.cheeks in ("both", cheek) and side * end < side * face:
            refuse(
                f"[pins] length_mm = {pins.length_mm:g}",
                f"the cheek at {cheek} begins at {end:g} mm, within the planets' face, which ends at {face:g} mm: make "
                "the pins longer, or correct middle_mm",
            )


def _check_pins(pins: Pins, supports: Supports, refuse: Refuse) -> None:
    for key in ("planet_radial_N_per_mm", "planet_tilt_Nmm_per_rad"):
        if (value := getattr(supports, key)) != "rigid":
            refuse(f"[supports] {key} = {value}", "[pins] have what planets stand on: leave one of the two out")
    if pins.inner_mm >= pins.diameter_mm:
        refuse(f"[pins] inner_mm = {pins.inner_mm:g}", f"must be below diameter_mm = {pins.diameter_mm:g}: correct it")
    if pins.cheeks != "both" and pins.ends == "supported":
        rule = f'a pin in the cheek at {pins.cheeks} alone would tip over: write ends = "clamped"'
        refuse('[pins] ends = "supported"', rule)
    low, high = pins.ends_mm
    for bearing in pins.bearings:
        where = f"[pins] bearings at_mm = {bearing.at_mm:g}"
        check_bearing(bearing, where, ("radial_N_per_mm", "tilt_Nmm_per_rad"), refuse)
        if bearing.inner is not None and takes_thrust_one_way(bearing.inner):
            rule = "pins take bearings without one, or of two rows that take thrust both ways: give their stiffness"
            refuse(f"{where}: contact_angle_deg = {bearing.inner.contact_angle_deg:g}", rule)
        if not low < bearing.at_mm < high:
            rule = f"the pins go from {low:g} to {high:g} mm, and bearings stand between: correct it, or length_mm"
            refuse(where, rule)
    places = sorted(bearing.at_mm for bearing in pins.bearings)
    if min(np.diff(places), default=np.inf) < APART_MM:
        refuse(f"[pins] bearings at_mm = {places}", "two bearings are at one place: move one, or leave it out")
    for one, other in combinations(pins.bearings, 2):
        if overlap(one.inner, other.inner, abs(one.at_mm - other.at_mm)):
            rule = "their elements overlap along the pin: move one, or correct their sizes"
            refuse(f"[pins] bearings at_mm = {one.at_mm:g} and {other.at_mm:g}", rule)
    across = [bearing.at_mm for bearing in pins.bearings if bearing.radial_N_per_mm != "free"]
    if not across:
        refuse("[pins] bearings", "none holds the planet across: write bearings = [{at_mm = 0.0, ...}]")
    tips = all(bearing.tilt_Nmm_per_rad == "free" and not holds_tilt(bearing) for bearing in pins.bearings)
    if len(across) == 1 and tips:
        rule = "a single one lets the planet tip over: add another one, or its tilt_Nmm_per_rad"
        refuse(f"[pins] bearings at_mm = {across[0]:g}", rule)


def _check_carrier(carrier: Carrier, pins: Pins | None, refuse: Refuse) -> None:
    wound = carrier.windup_Nmm_per_rad != "rigid"
    if wound and carrier.stiffness is not None:
        refuse(f"[carrier] windup_Nmm_per_rad = {carrier.windup_Nmm_per_rad}", "the matrix has it: leave one out")
    for key in ("windup_Nmm_per_rad", "stiffness"):
        if getattr(carrier, key) not in ("rigid", None) and pins is None:
            refuse(f"[carrier] {key}", "moves the seats of the pins: add [pins]")
    if wound and pins is not None and pins.cheeks != "both":
        rule = f"the carrier has one cheek, at {pins.cheeks}, which turns as a whole: leave it out"
        refuse("[carrier] windup_Nmm_per_rad", rule)
    if wound and carrier.torque_at is None:
        refuse("[carrier] torque_at", 'is missing: write "-z" or "+z", the side of the cheek that leads the torque out')
    if not wound and carrier.torque_at is not None:
        refuse(f'[carrier] torque_at = "{carrier.torque_at}"', "matters to the wind-up: add windup_Nmm_per_rad")
