"""Factors of ISO 6336 for the blanks of a case."""

from __future__ import annotations

from dataclasses import dataclass

from pmor.case import Case
from pmor.gear.classical.iso6336 import LEAST_RIM, WEB, rim_factor, web_factor
from pmor.gear.pair import GearPair


@dataclass(frozen=True)
class IsoBlank:
    """Factors of one gear.

    Parameters
    ----------
    stiffness : float
        C_R of ISO 6336-1.
    root_stress : float or None
        Y_B of ISO 6336-3; None where the rim is thinner than it allows.
    rim_over_height, rim_in_modules, web_over_width : float
        What they were found from.
    """

    stiffness: float = 1.0
    root_stress: float | None = 1.0
    rim_over_height: float = 2.0
    rim_in_modules: float = LEAST_RIM
    web_over_width: float = 1.0

    @property
    def in_range(self) -> bool:
        """Whether the formula of C_R is stated for it."""
        return WEB[0] <= self.web_over_width <= WEB[1] and self.rim_in_modules >= LEAST_RIM


def iso_blanks(case: Case, pair: GearPair) -> tuple[IsoBlank, IsoBlank] | None:
    """Return the factors of pinion and wheel, 1 of a gear that is solid down to its bore; None where both are."""
    factors, light = [IsoBlank(), IsoBlank()], False
    for place, (gear, tooth) in enumerate(
        zip((case.pair.pinion, case.pair.wheel), (pair.pinion, pair.wheel), strict=True)
    ):
        blank = gear.light_blank(case.pair.face_width_mm)
        if blank is None:
            continue
        low, high = gear.face(case.pair.face_width_mm)
        rim, web = blank.rim_thickness_mm, blank.thinnest_web_mm / (high - low)
        height, modules = rim / (tooth.tip_radius - tooth.root_radius), rim / tooth.module
        factors[place] = IsoBlank(web_factor(web, modules), rim_factor(height), height, modules, web)
        light = True
    return (factors[0], factors[1]) if light else None


def blank_factor(case: Case, pair: GearPair) -> float:
    """Return C_R of a pair: the mean of its gears'."""
    both = iso_blanks(case, pair)
    return 1.0 if both is None else 0.5 * (both[0].stiffness + both[1].stiffness)
