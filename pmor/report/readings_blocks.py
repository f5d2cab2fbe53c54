"""Pictures and tables of quantities derived from exact line loads."""

from __future__ import annotations

from pmor.case import Case
from pmor.report.flank_figures import flank_maps_figure, flank_pattern_figure
from pmor.report.page import Picture
from pmor.report.parameter_words import parameter_words
from pmor.report.table import Table
from pmor.report.torque_figures import harris_figure
from pmor.results.sweep import peak_to_peak_um
from pmor_online.readings import LIGHT
from pmor_online.run import OnlineResult

# Share of the flanks from which on a pattern covers them, and tells nothing.
WHOLE = 0.995
ON_FLANKS = ("flank_maps", "flank_pattern")


# Units of derivatives of the STE by a key, by the end of its name.
RATES = {"um": "µm per µm", "deg": "µm per deg", "mm": "µm per mm", "percent": "µm per %"}


def readings_picture_names(case: Case) -> tuple[str, ...]:
    """Return the names of the pictures that a run of a case can have."""
    if case.reduction.shapes != "line_loads":
        return ()
    return ("harris", *(ON_FLANKS if case.results.maps else ()))


def readings_pictures(result: OnlineResult) -> list[Picture]:
    """Return the pictures of quantities derived from line loads; none of other models."""
    readings = result.readings
    if readings is None:
        return []
    harris, pictures = readings.harris, list[Picture]()
    if harris.converged.all():
        caption = (
            "Harris map: transmission error over the angle at rising torque; over torque, its peak-to-peak and first "
            "orders of the mesh. Circles: torques of the case."
        )
        helical = result.reduced.meshed.pair.pinion.helix_angle != 0.0
        figure = harris_figure(harris, result.case.torque_Nm, result.sweep, helical)
        pictures.append(Picture("harris.svg", caption, figure))
    if readings.light is not None:
        maps, light = readings.maps[result.nominal], readings.light
        caption = (
            "Largest pressure and line load on the flanks over a mesh cycle at nominal torque. Cells over which a "
            "sharp tip edge passes have no largest pressure."
        )
        pictures.append(Picture("flank_maps.svg", caption, flank_maps_figure(maps)))
        if min(flank.contact_share for flank in light) < WHOLE:
            caption = (
                f"Contact pattern: area touched in a mesh cycle at nominal torque, and at {100 * LIGHT:g} % of it."
            )
            pictures.append(Picture("flank_pattern.svg", caption, flank_pattern_figure(maps, light)))
    return pictures


def sensitivities_table(result: OnlineResult) -> list[Table]:
    """Return the derivatives by parameters of modifications; none of models without line loads."""
    if result.readings is None:
        return []
    rates, i = result.readings.sensitivities, result.nominal
    rows = [
        (parameter_words(name), RATES[name.rpartition("_")[2]], float(mean), float(span))
        for name, mean, span in zip(rates.parameter, rates.mean[:, i], rates.peak_to_peak[:, i], strict=True)
    ]
    columns = ["parameter", "unit", "mean STE", "peak-to-peak STE"]
    note = (
        f"First derivatives at {result.case.torque_Nm:g} N m, where the peak-to-peak is "
        f"{float(peak_to_peak_um(result.sweep)[i]):.3g} µm: exact while the active set does not change. For a "
        "modification that the case does not have, they give the effect of the first micrometre."
    )
    return [Table("Sensitivities to modifications", columns, rows, note, folded=True)]
