"""The results file of a run and its tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pmor.case import text_of
from pmor.export.tables import line_arrays, sweep_arrays
from pmor.report.data_files import write_table_csv
from pmor.results.flank_maps import FlankMap
from pmor.results.load_distribution import line_states
from pmor.results.root_stress import GEARS
from pmor.results.sweep import SteSweep, peak_to_peak_um
from pmor.storage.results_file import ResultsFile, write_results_file
from pmor_online.run import OnlineResult

RESULTS, HARRIS = "results.h5", "harris.csv"

Arrays = dict[str, np.ndarray]


def write_results_data(result: OnlineResult, out: Path) -> None:
    """Write the results file and its tables into a folder; OutputError where that fails."""
    arrays = sweep_arrays(result.sweep, result.reduced.meshed.pair) | _readings(result) | _root_stress(result)
    parameters = result.readings.sensitivities.parameter if result.readings else ()
    case = result.case
    write_results_file(out / RESULTS, ResultsFile(case.name, text_of(case), arrays, {"parameters": parameters}))
    if result.readings is not None:
        write_table_csv(out / HARRIS, _harris_rows(result.readings.harris))


def _readings(result: OnlineResult) -> Arrays:
    """Quantities derived from line loads: lines, face, forces, sensitivities, flank maps and Harris map."""
    readings = result.readings
    if readings is None:
        return {}
    lines, rates, harris = line_states(result.sweep), readings.sensitivities, readings.harris
    arrays = line_arrays(lines, readings.figures) | {
        "forces/force": readings.forces.force_N, "forces/moment": readings.forces.moment_Nm,
        "sensitivity/ste": rates.ste, "sensitivity/mean": rates.mean, "sensitivity/peak_to_peak": rates.peak_to_peak,
        "harris/phi": harris.phi_rad, "harris/torque": harris.torque_Nm, "harris/ste": harris.ste_um,
        "harris/peak_to_peak": peak_to_peak_um(harris),
    }  # fmt: skip
    if readings.light is not None:
        arrays |= _flanks("maps", readings.maps) | _flanks("light", (readings.light,))
    return arrays


def _root_stress(result: OnlineResult) -> Arrays:
    stress = result.root_stress
    if stress is None:
        return {}
    arrays: Arrays = {
        "root_stress/pair_index": stress.pair_index, "root_stress/max_principal": stress.max_principal_MPa,
        "root_stress/von_mises": stress.von_mises_MPa, "root_stress/radius": stress.radius_mm,
        "root_stress/z": stress.z_mm,
    }  # fmt: skip
    for name, fillet in zip(GEARS, stress.envelope, strict=True):
        arrays |= {
            f"root_stress/{name}/arc": fillet.arc_mm, f"root_stress/{name}/z": fillet.z_mm,
            f"root_stress/{name}/max_principal": fillet.max_principal_MPa,
            f"root_stress/{name}/von_mises": fillet.von_mises_MPa,
        }  # fmt: skip
    return arrays


def _flanks(folder: str, maps: Sequence[tuple[FlankMap, FlankMap]]) -> Arrays:
    stacked = {
        "torque": "torque_Nm", "load": "load_N_per_mm", "half_width": "half_width_mm", "pressure": "pressure_MPa"
    }  # fmt: skip
    all_arrays: Arrays = {}
    for gear, name in enumerate(GEARS):
        of_gear = [both[gear] for both in maps]
        arrays = {key: np.stack([getattr(flank, field) for flank in of_gear]) for key, field in stacked.items()}
        arrays |= {"roll": of_gear[0].roll_rad, "z": of_gear[0].z_mm}
        all_arrays |= {f"{folder}/{name}/{key}": array for key, array in arrays.items()}
    return all_arrays


def _harris_rows(sweep: SteSweep) -> list[dict[str, float]]:
    """Mean and peak-to-peak over torque; at torque 0 those of rigid flanks, where they have any."""
    curves = list(zip(sweep.torque_Nm, sweep.ste_um, strict=True))
    if sweep.unloaded_um is not None:
        curves.insert(0, (0.0, sweep.unloaded_um[0]))
    return [
        {"torque_Nm": float(torque), "ste_mean_um": float(np.mean(ste)), "ste_peak_to_peak_um": float(np.ptp(ste))}
        for torque, ste in curves
    ]
