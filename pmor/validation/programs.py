"""Transmission error of public pairs beside that of an independent finite-element program.

That program has linear elements, 16 on a flank and 4 to 8 over the width, and lends its bodies to the same law of line
contact: the tolerances are those of its meshes.

Load over the face and relief without load, beside what independent slices and rigid flanks give in closed form.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pmor.case import Case, make_case
from pmor.gear.condition import Assembly, at_torques
from pmor.gear.modification import UNMODIFIED, Modification
from pmor.line.kernels.types import Sections
from pmor.line.layered_pair import LayeredPair
from pmor.line.unloaded import with_unloaded
from pmor.pair.conditions import conditions_of_assembly
from pmor.results.load_distribution import face_load_factor
from pmor.validation.check import Check
from pmor.validation.machines import DRAWINGS, drawn, full
from pmor.validation.sheets import HS, LS, OSU
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import ReducedPair, online_angles, reduced_pair

# Mean under the torque of the drawing, um.
MEAN = {HS: 11.58, LS: 11.61}
MEAN_RTOL = 0.04
# Peak-to-peak of the Ohio State pair over torques in N m, um: without relief, and with RELIEF on both gears.
PLAIN = {85.0: 1.41, 170.0: 2.70, 340.0: 4.80}
RELIEVED = {85.0: 3.13, 170.0: 1.84, 200.0: 1.40, 230.0: 0.96, 340.0: 1.24}
RELIEF = Modification(tip_relief_um=10.0, tip_relief_start_roll_deg=22.2)
PEAK_UM = 0.08
SOURCE = "independent FE, linear elements"


def reduced(case: Case) -> ReducedPair:
    """Return the line loads of a case."""
    return reduced_pair(train(case, full(case)).basis)


def public_pairs() -> list[Check]:
    """Return the checks of public pairs."""
    checks = []
    for name, theirs in MEAN.items():
        case = make_case(name, **DRAWINGS[name], mesh={"width_elements": 8, "error_bar": False}, root_stress=False)
        ours = _ste_um(reduced(case), [case.torque_Nm], UNMODIFIED).mean()
        words = f"mean STE, {name}, {case.torque_Nm:g} N m"
        checks.append(Check(words, "µm", theirs, float(ours), SOURCE, MEAN_RTOL))
    rig = reduced(make_case(OSU, **DRAWINGS[OSU], mesh={"error_bar": False}, root_stress=False))
    for flanks, words, published in ((UNMODIFIED, "plain", PLAIN), (RELIEF, "10 µm from 22.2 deg", RELIEVED)):
        spread = np.ptp(_ste_um(rig, list(published), flanks), axis=1)
        checks += [
            Check(
                f"peak-to-peak STE, {OSU}, {words}, {torque:g} N m", "µm", theirs, float(ours), SOURCE, PEAK_UM / theirs
            )
            for (torque, theirs), ours in zip(published.items(), spread, strict=True)
        ]
    return checks


def _ste_um(pair: ReducedPair, torques_Nm: list[float], flanks: Modification) -> np.ndarray:
    phi = online_angles(pair.meshed.pair.pitch, 100)
    conditions = at_torques([1e3 * torque for torque in torques_Nm], pinion=flanks, wheel=flanks)
    return sweep_line_loads(pair, phi, conditions).ste_um


SLICES, WIDTH, AMOUNT_UM = 100, 20.0, 20.0  # over the face, mm, of the deviation
# A bed so soft that Hertz's law, in series with it, is nothing: N/(mm um).
STIFFNESS = 2e-4
# The trapezoidal rule over the slices, and Hertz's law: measured 2e-4 together.
SLICE_LAW = 1e-3
# F c / w of a misalignment F over the face, C c / w of a crowning C at both ends.
MISALIGNED = 0.4, 4.0 / 3.0, 2.0, 8.0 / 3.0, 16.0 / 3.0, 32.0 / 3.0
CROWNED = 0.3, 1.5, 8.0 / 3.0, 10.0
RELIEF_UM = 10.0
# Angles beside the middle of single contact, where rigid flanks advance by half of the relief.
ANGLES_RTOL = 1e-3


def bed_of_slices() -> ReducedPair:
    """Return a small spur pair with springs beside each other in place of its gears, each tooth pair on its own."""
    mesh = {"element": "hex8i", "profile_elements": 5, "width_elements": 4, "width": "whole", "error_bar": False}
    pair = {"module_mm": 4.0, "face_width_mm": WIDTH, "teeth": 21, "bore_radius_mm": 20.0}
    small = reduced(make_case("bed", **pair, torque_Nm=100.0, mesh=mesh, root_stress=False))
    z = np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, SLICES + 1)
    width = np.full(SLICES + 1, WIDTH / SLICES)
    width[[0, -1]] *= 0.5
    sections = Sections(z, width, np.zeros((2, SLICES + 1), dtype=np.int64), np.ones((2, SLICES + 1, 1)))
    rows = len(small.meshed.pinion.roll_angle)
    # Moves all rows of nodes alike, half of it in each gear.
    rigid = np.kron(np.ones((rows, rows)), np.eye(2))
    between = np.zeros((1, SLICES + 1, SLICES + 1, 2 * rows, 2 * rows))
    for n in range(SLICES + 1):
        between[0, n, n] = 0.5 / (1e3 * STIFFNESS * width[n]) * rigid
    changed = ReducedPair(small.basis, replace(small.meshed))
    changed.meshed.__dict__["sections"] = sections
    changed.__dict__["section_compliance"] = between, between
    return changed


def k_h_beta(bed: ReducedPair, load: float, flank: Modification) -> float:
    """Return K_Hbeta at a line load (N/mm) where one tooth pair carries it."""
    pair = bed.meshed.pair
    phi = np.array([0.5 * sum(pair.roll_position_range)])
    torque = 1e-3 * load * WIDTH * pair.pinion.base_radius
    sweep = sweep_line_loads(bed, phi, conditions_of_assembly(Assembly(pinion=flank), [torque]), recorded=True)
    assert sweep.states is not None
    assert sweep.states.lines is not None
    return float(face_load_factor(sweep.states.lines)[0])


def load_over_the_face() -> list[Check]:
    """Return the checks of K_Hbeta: ISO 6336-1, method C, and a parabola of crowning."""
    bed, checks = bed_of_slices(), list[Check]()
    for ratio in MISALIGNED:
        exact = 1.0 + 0.5 * ratio if ratio <= 2.0 else math.sqrt(2.0 * ratio)
        ours = k_h_beta(bed, AMOUNT_UM * STIFFNESS / ratio, Modification(helix_slope_um=AMOUNT_UM))
        checks.append(Check(f"K_Hβ of independent slices, F_βy c / w = {ratio:.4g}", "1", exact, ours,
                           "ISO 6336-1, method C", SLICE_LAW))  # fmt: skip
    for ratio in CROWNED:
        exact = 1.0 + ratio / 3.0 if ratio <= 1.5 else 1.5 / (1.5 / ratio) ** (1.0 / 3.0)
        ours = k_h_beta(bed, AMOUNT_UM * STIFFNESS / ratio, Modification(helix_crowning_um=AMOUNT_UM))
        checks.append(Check(f"K_Hβ of independent slices, C_β c / w = {ratio:.4g}", "1", exact, ours,
                           "closed form", SLICE_LAW))  # fmt: skip
    return checks


def relief_without_load() -> list[Check]:
    """Return the check of rigid flanks: relief E from the highest point of single contact has E/2 peak-to-peak."""
    pair = drawn(OSU)
    start = math.degrees(pair.active_rolls[0][0] + pair.pitch)
    relief = Modification(tip_relief_um=RELIEF_UM, tip_relief_start_roll_deg=start)
    mesh = {"profile_elements": 4, "width_elements": 1, "error_bar": False}
    case = make_case("rig", **DRAWINGS[OSU] | {"bore_radius_mm": 60.0}, mesh=mesh)
    rig, phi = reduced(case), online_angles(pair.pitch, 2000)
    conditions = at_torques([1e3], pinion=relief, wheel=relief)
    meshed = rig.meshed
    assert isinstance(meshed, LayeredPair)
    sweep = with_unloaded(sweep_line_loads(rig, phi, conditions), meshed, conditions)
    assert sweep.unloaded_um is not None
    words = f"STE without load, peak-to-peak, {RELIEF_UM:g} µm linear from the HPSTC"
    return [Check(words, "µm", 0.5 * RELIEF_UM, float(np.ptp(sweep.unloaded_um[0])), "closed form", ANGLES_RTOL)]
