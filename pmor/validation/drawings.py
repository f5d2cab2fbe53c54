"""Geometry, stiffness and nominal root stress after standards, beside published ones of the same drawings."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pmor.gear.classical.iso6336 import mesh_stiffness, single_stiffness, virtual_tooth_number
from pmor.gear.classical.iso6336_root import nominal_root_stress, root_factors
from pmor.gear.data_sheet import data_sheet
from pmor.gear.inertia import disc
from pmor.gear.pair import GearPair
from pmor.gear.profile import ProfilePoint
from pmor.validation.check import Check
from pmor.validation.pairs import drawn

HS, LS, HELICAL, SPUR, TR, OSU, PAPER = (
    "FVA high-speed stage 27/51", "FVA low-speed stage 23/34", "helical pair 17/43", "spur pair 17/43",
    "ISO/TR 6336-30, example 1, 17/103", "Ohio State rig 50/50", "paper's pair 21/21",
)  # fmt: skip
FVA = "drawing, REXS example of the FVA"
PUBLIC = "printed by a public gear program"
APART = "independent script"
STANDARD = "printed in ISO/TR 6336-30"
# Quantity, unit, how we have it, and what others say: pair, figure, source, half a unit of its last digit.
Ours = Callable[[GearPair], float]
Said = tuple[str, float, str, float]
GEOMETRY: list[tuple[str, str, Ours, list[Said]]] = [
    ("centre distance without backlash", "mm", lambda pair: pair.least_centre_distance,
     [(HS, 190.0, FVA, 2e-4), (LS, 190.0, FVA, 2e-4), (HELICAL, 31.9253, PUBLIC, 5e-5)]),
    ("working transverse pressure angle", "deg", lambda pair: math.degrees(pair.working_pressure_angle),
     [(HS, 22.8062, APART, 2e-4), (LS, 21.7751, APART, 2e-4), (TR, 21.0661, APART, 5e-5)]),
    ("transverse contact ratio", "1", lambda pair: pair.contact_ratio,
     [(HS, 1.4705, APART, 6e-5), (LS, 1.5376, APART, 6e-5), (SPUR, 1.6211, APART, 5e-5),
      (TR, 1.5493, APART, 6e-5)]),
    ("overlap ratio", "1", lambda pair: pair.overlap_ratio,
     [(HS, 1.2675, APART, 5e-5), (LS, 0.6293, APART, 5e-5), (TR, 1.0834, APART, 5e-5)]),
    ("roll angle, SAP", "deg", lambda pair: data_sheet(pair).pinion.start_of_active_profile.roll_deg,
     [(OSU, 14.540, APART, 4e-3)]),
    ("roll angle, LPSTC", "deg", lambda pair: _roll(data_sheet(pair).pinion.lowest_single_contact),
     [(OSU, 19.970, APART, 4e-3)]),
    ("roll angle, HPSTC", "deg", lambda pair: _roll(data_sheet(pair).pinion.highest_single_contact),
     [(OSU, 21.740, APART, 4e-3)]),
    ("roll angle, tip", "deg", lambda pair: data_sheet(pair).pinion.tip.roll_deg, [(OSU, 27.170, APART, 4e-3)]),
]  # fmt: skip
# ISO 6336-1, N/(mm um): pair, dedendum of the rack, c' and c_gamma alpha, each with its digits, source. The contact
# ratio of the standard's example is that of tip diameters in round figures.
STIFFNESS = [
    (SPUR, 1.25, 12.5049, 5e-5, 18.3300, 5e-5, PUBLIC), (HELICAL, 1.25, 12.2176, 5e-5, 16.7248, 5e-5, APART),
    (HS, 1.25, 13.7622, 5e-5, 18.6182, 5e-5, APART), (LS, 1.25, 13.2130, 5e-5, 18.5409, 5e-5, APART),
    (TR, 1.4, 12.37047, 5e-6, 17.46485, 3e-3, STANDARD),
]  # fmt: skip
# ISO 6336-3, MPa: pair, torque in N m, stress of pinion and wheel; to one decimal, by another program.
ROOT = [
    (PAPER, 100.0, 89.1, 89.1), (OSU, 340.0, 190.2, 190.2), (HS, 500.0, 70.0, 72.1), (LS, 1000.0, 66.8, 66.4),
    (SPUR, 20.0, 710.4, 648.9),
]  # fmt: skip
FACTORS = [(PAPER, 1.6686, 1.7940), (OSU, 1.1916, 2.1132)]


def geometry() -> list[Check]:
    """Return the checks of geometry."""
    return [
        Check(f"{quantity}, {name}", unit, theirs, ours(drawn(name)), source, digits / theirs)
        for quantity, unit, ours, said in GEOMETRY for name, theirs, source, digits in said
    ]  # fmt: skip


def standards() -> list[Check]:
    """Return the checks of ISO 6336 and of the inertia of discs."""
    found = []
    for name, dedendum, single, digits, mesh, mesh_digits, source in STIFFNESS:
        pair = drawn(name)
        gears = pair.pinion, pair.wheel
        helix = abs(pair.pinion.helix_angle)
        virtual = [virtual_tooth_number(gear.teeth, helix, gear.pressure_angle) for gear in gears]
        ours = single_stiffness(
            virtual[0], virtual[1], *(g.profile_shift for g in gears), dedendum=dedendum, helix_angle_rad=helix
        )
        of_mesh = mesh_stiffness(ours, pair.contact_ratio)
        found += [
            Check(f"c' (ISO 6336-1, B), {name}", "N/(mm µm)", single, ours, source, digits / single),
            Check(f"c_γα (ISO 6336-1, B), {name}", "N/(mm µm)", mesh, of_mesh, source, mesh_digits / mesh),
        ]
    program = "another program"
    for name, torque, *stresses in ROOT:
        ours_of: Any = nominal_root_stress(drawn(name), torque)
        found += [
            Check(f"σ_F0 (ISO 6336-3, B), {gear}, {name}", "MPa", theirs, float(ours), program, 0.06 / theirs)
            for gear, theirs, ours in zip(("pinion", "wheel"), stresses, ours_of, strict=True)
        ]
    for name, form, correction in FACTORS:
        factors = root_factors(drawn(name).pinion, drawn(name))
        found += [
            Check(f"Y_F (ISO 6336-3, B), {name}", "1", form, factors.form, program, 5e-5),
            Check(f"Y_S (ISO 6336-3, B), {name}", "1", correction, factors.stress_correction, program, 5e-5),
        ]
    steel = disc(75.0, 0.0, 20.0, 7810.0)
    return [
        *found,
        Check("mass, steel disc 150 x 20 mm", "kg", 2.760, steel.mass_kg, "closed form", 2e-4),
        Check("polar inertia, steel disc 150 x 20 mm", "kg m²", 0.007763, steel.polar_kg_m2, "closed form", 2e-4),
    ]


def _roll(point: ProfilePoint | None) -> float:
    return math.nan if point is None else point.roll_deg
