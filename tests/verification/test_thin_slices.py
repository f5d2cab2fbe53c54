"""Published figures of public pairs: thin slices beside full FE, and the load that a relief suits.

Programs for gear design commonly take a helical tooth for thin slices, each as stiff as a spur tooth after Weber and
Banaschek (1955), that know neither each other nor the neighbouring teeth, on a body without twist, in contact on the
path of contact alone. What full FE has beside that is switched off here, one thing at a time:

* *blank twist*: the twist of an annulus from bore to root circle under the torque, M / (4 pi G b) (1/r_1^2 - 1/r_2^2),
  is taken out of the compliance;
* *neighbouring teeth*: a tooth moves under its own load alone;
* *sections*: each section moves as under a load that is even over the width, whatever its neighbours carry;
* *tip contact*: corners that meet the mate beyond the path of contact carry nothing.

Slow, and prints the table of cases/manual/validation.md:
``pytest -n 0 -m slow tests/verification/test_thin_slices.py -s``.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pmor
from pmor.body.flank_compliance import FlankCompliance
from pmor.case import change_case, load_case
from pmor.gear.condition import at_torques
from pmor.gear.modification import UNMODIFIED, Modification
from pmor.lab.slices.run import SlicedPair, without_neighbours
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import online_angles

CASES = Path(__file__).parents[2] / "cases"
# Mean STE of thin slices and of a prototype of full FE on 16 x 8 linear elements, um.
PUBLISHED = {"fva_high_speed": (9.19, 11.58), "fva_low_speed": (10.42, 11.61)}
SWITCHES = ("blank twist", "neighbouring teeth", "sections", "tip contact")
TIP_EDGE_DEG = 1e-3


def without_twist(reduced):
    """Compliance less the twist of the blanks under unit forces at the flank nodes."""
    case, compliance, meshed = reduced.basis.case, reduced.basis.compliance, reduced.meshed
    left = []
    for blocks, gear, flank, tooth in zip(
        compliance.gears, (case.pair.pinion, case.pair.wheel), (meshed.pinion, meshed.wheel),
        (meshed.pair.pinion, meshed.pair.wheel), strict=True,
    ):  # fmt: skip
        shear_modulus = 1e3 * gear.youngs_modulus_GPa / (2.0 * (1.0 + gear.poisson_ratio))
        radii = gear.bore_radius_mm**-2 - tooth.root_radius**-2
        twist = radii / (4.0 * math.pi * shear_modulus * case.pair.face_width_mm)
        x, y, z = np.moveaxis(flank.nodes, -1, 0)
        moment = np.stack([-y, x, np.zeros_like(z)], axis=-1)[..., : compliance.components].ravel()
        left.append(blocks - twist * np.outer(moment, moment))
    return FlankCompliance(tuple(left), compliance.components)


def mean_ste_um(reduced, torque_Nm, off):
    """Mean STE over a pitch, with some of `SWITCHES` off."""
    compliance = without_twist(reduced) if "blank twist" in off else reduced.basis.compliance
    if "neighbouring teeth" in off:
        compliance = without_neighbours(compliance)
    changed = replace(reduced, basis=replace(reduced.basis, compliance=compliance))
    if "sections" in off:
        changed = SlicedPair(changed.basis, changed.meshed)
    flanks = {}
    if "tip contact" in off:
        for name in ("pinion", "wheel"):
            tip = math.degrees(getattr(reduced.meshed.pair, name).tip_roll_angle)
            flanks[name] = Modification(tip_relief_um=1000.0, tip_relief_start_roll_deg=tip - TIP_EDGE_DEG)
    phi = online_angles(reduced.meshed.pair.pitch, 100)
    sweep = sweep_line_loads(changed, phi, at_torques([1e3 * torque_Nm], **flanks))
    assert sweep.converged.all()
    return float(sweep.ste_um.mean()), float(np.ptp(sweep.ste_um))


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLISHED)
def test_full_fe_without_what_slices_leave_out_is_thin_slices(name):
    case = change_case(load_case(CASES / f"{name}.toml"), contact={"scheme": "line"},
                       reduction={"shapes": "line_loads"})  # fmt: skip
    reduced = pmor.train(case).reduced
    found = {off: mean_ste_um(reduced, case.torque_Nm, off) for off in ((), *((s,) for s in SWITCHES), SWITCHES)}
    expected, prototype = PUBLISHED[name]
    print(f"\n{case.title}, {case.torque_Nm:g} N m: mean and peak-to-peak STE, um")  # noqa: T201
    for off, (mean, spread) in found.items():
        print(f"| {' and '.join(off) or 'nothing'} | {mean:.2f} | {spread:.2f} |")  # noqa: T201
    print(f"| thin slices | {expected:.2f} | |")  # noqa: T201
    assert abs(found[()][0] / prototype - 1.0) < 0.04
    for switch in SWITCHES[:2]:
        assert found[(switch,)][0] < 0.97 * found[()][0]
    assert found[("tip contact",)][0] >= found[()][0]
    assert abs(found[SWITCHES][0] / expected - 1.0) < 0.1


@pytest.mark.slow
def test_relief_of_the_ohio_pair_suits_a_load_between_240_and_300_newton_metres():
    """Thin slices put the least peak-to-peak at 200 N m; the body, which couples the teeth, moves it up."""
    case = load_case(CASES / "osu_spur.toml")
    reduced = pmor.train(case).reduced
    phi, torques = online_angles(reduced.meshed.pair.pitch, 200), np.arange(100.0, 401.0, 10.0)

    def peak_to_peak(torques_Nm, pinion, wheel):
        sweep = sweep_line_loads(reduced, phi, at_torques(1e3 * torques_Nm, pinion=pinion, wheel=wheel))
        assert sweep.converged.all()
        return np.ptp(sweep.ste_um, axis=1)

    found = peak_to_peak(torques, case.pinion_modification, case.wheel_modification)
    plain = peak_to_peak(np.array([85.0, 340.0]), UNMODIFIED, UNMODIFIED)
    for torque, value in zip(torques, found, strict=True):
        print(f"{torque:5.0f} N m: {value:.3f} um")  # noqa: T201
    print(f"without relief: {plain[0]:.2f} um at 85, {plain[1]:.2f} um at 340 N m")  # noqa: T201
    assert 240.0 <= torques[found.argmin()] <= 300.0
    assert found.min() <= 0.8
    assert plain[1] > 3.0 * plain[0]
