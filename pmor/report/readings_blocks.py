"""Pictures and tables of quantities derived from exact line loads."""

from __future__ import annotations

import numpy as np

from pmor.case import Case
from pmor.report.flank_figures import flank_maps_figure, flank_pattern_figure, load_distribution_figure
from pmor.report.page import Picture
from pmor.report.table import Table
from pmor.report.torque_figures import harris_figure, waterfall_figure
from pmor.results.load_distribution import line_states
from pmor.results.sweep import mesh_stiffness, peak_to_peak_um
from pmor_online.readings import LIGHT
from pmor_online.run import OnlineResult

OVER_TORQUE = ("harris", "waterfall")
ON_FLANKS = ("flank_maps", "flank_pattern", "load_distribution")


# Units of derivatives of the STE by a key, by the end of its name.
RATES = {"um": "µm per µm", "deg": "µm per deg", "mm": "µm per mm", "percent": "µm per %"}


def readings_picture_names(case: Case) -> tuple[str, ...]:
    """Return the names of the pictures that a run of a case can have."""
    if case.reduction.shapes != "line_loads":
        return ()
    return (*OVER_TORQUE, *(ON_FLANKS if case.results.maps else ()))


def readings_pictures(result: OnlineResult) -> list[Picture]:
    """Return the pictures of quantities derived from line loads; none of other models."""
    readings = result.readings
    if readings is None:
        return []
    harris, found = readings.harris, list[Picture]()
    if harris.converged.all():
        caption = "Harris map: transmission error over the angle at rising torque, and its peak-to-peak over torque."
        found.append(Picture("harris.png", caption, harris_figure(harris, result.case.torque_Nm)))
        caption = "Orders of the mesh frequency in the transmission error over the torque."
        found.append(Picture("waterfall.png", caption, waterfall_figure(harris)))
    if readings.light is not None:
        maps, light = readings.maps[result.nominal], readings.light
        caption = "Largest pressure and line load on the flanks over a mesh cycle at nominal torque."
        found.append(Picture("flank_maps.png", caption, flank_maps_figure(maps)))
        caption = f"Contact pattern: area touched in a mesh cycle at nominal torque, and at {100 * LIGHT:g} % of it."
        found.append(Picture("flank_pattern.png", caption, flank_pattern_figure(maps, light)))
        caption = "Line load over the pinion's flank at nominal torque."
        found.append(Picture("load_distribution.png", caption, load_distribution_figure(maps[0])))
    return found


def readings_tables(result: OnlineResult) -> list[Table]:
    """Return the tables of quantities derived from line loads; none of other models."""
    return [_over_torque(result), _sensitivities(result)] if result.readings is not None else []


def _over_torque(result: OnlineResult) -> Table:
    readings, sweep, pair = result.readings, result.sweep, result.reduced.meshed.pair
    assert readings is not None
    stiffness = mesh_stiffness(sweep, pair.pinion.base_radius, pair.common_width)
    pressure, force = line_states(sweep).pressure_MPa, readings.forces.force_N
    rows = [
        (
            float(torque), float(np.nanmean(stiffness.secant[d])), _mean(stiffness.tangent, d),
            float(readings.face_load_factor[d]), float(readings.effective_contact_ratio[d]),
            float(np.nanmax(pressure[d])), *(float(np.abs(force[d, :, 0, axis]).max()) for axis in range(3)),
        )
        for d, torque in enumerate(sweep.torque_Nm)
    ]  # fmt: skip
    columns = [
        "torque, N m", "mesh stiffness, N/(mm µm)", "tangent, N/(mm µm)", "K_Hβ", "contact ratio, loaded",
        "flank pressure max, MPa", "force across the axes' plane, N", "along it, N", "axial, N",
    ]  # fmt: skip
    note = (
        "Stiffness: mean over the angles, per face width. K_Hβ: largest over mean line load of the face, added up over "
        "the cycle (ISO 6336-1's w_max / w_m). Forces of the mesh on either gear: largest over the cycle."
    )
    return Table("Stiffness, load distribution and forces over the torque", columns, rows, note)


def _mean(values: np.ndarray | None, d: int) -> float | None:
    return None if values is None else float(np.nanmean(values[d]))


def _sensitivities(result: OnlineResult) -> Table:
    assert result.readings is not None
    found, i = result.readings.sensitivities, result.nominal
    rows = [
        (name, RATES[name.rpartition("_")[2]], float(mean), float(span))
        for name, mean, span in zip(found.parameter, found.mean[:, i], found.peak_to_peak[:, i], strict=True)
    ]
    columns = ["parameter", "unit", "mean STE", "peak-to-peak STE"]
    note = (
        f"First derivatives at {result.case.torque_Nm:g} N m, where the peak-to-peak is "
        f"{float(peak_to_peak_um(result.sweep)[i]):.3g} µm: exact while the active set does not change. For a "
        "modification that the case does not have, they give the effect of the first micrometre."
    )
    return Table("Sensitivities to modifications", columns, rows, note)
