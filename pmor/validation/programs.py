"""Transmission error of public pairs beside that of an independent finite-element program.

That program has linear elements, 16 on a flank and 4 to 8 over the width, and lends its bodies to the same law of line
contact: the tolerances are those of its meshes.
"""

from __future__ import annotations

import numpy as np

from pmor.case import Case, make_case
from pmor.gear.condition import at_torques
from pmor.gear.modification import UNMODIFIED, Modification
from pmor.validation.check import Check
from pmor.validation.drawings import HS, LS, OSU
from pmor.validation.pairs import DRAWINGS, full
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
    found = []
    for name, theirs in MEAN.items():
        case = make_case(name, **DRAWINGS[name], mesh={"width_elements": 8, "error_bar": False}, root_stress=False)
        ours = _ste_um(reduced(case), [case.torque_Nm], UNMODIFIED).mean()
        words = f"mean STE, {name}, {case.torque_Nm:g} N m"
        found.append(Check(words, "µm", theirs, float(ours), SOURCE, MEAN_RTOL))
    rig = reduced(make_case(OSU, **DRAWINGS[OSU], mesh={"error_bar": False}, root_stress=False))
    for flanks, words, said in ((UNMODIFIED, "plain", PLAIN), (RELIEF, "10 µm from 22.2 deg", RELIEVED)):
        spread = np.ptp(_ste_um(rig, list(said), flanks), axis=1)
        found += [
            Check(
                f"peak-to-peak STE, {OSU}, {words}, {torque:g} N m", "µm", theirs, float(ours), SOURCE, PEAK_UM / theirs
            )
            for (torque, theirs), ours in zip(said.items(), spread, strict=True)
        ]
    return found


def _ste_um(pair: ReducedPair, torques_Nm: list[float], flanks: Modification) -> np.ndarray:
    phi = online_angles(pair.meshed.pair.pitch, 100)
    conditions = at_torques([1e3 * torque for torque in torques_Nm], pinion=flanks, wheel=flanks)
    return sweep_line_loads(pair, phi, conditions).ste_um
