"""The report page and the pictures of a run."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pmor.case import Case, GearCase, describe, model_names, short_list
from pmor.case.capability import left_out, why_not
from pmor.fe.sector import SectorMesh
from pmor.gear.classical.formulas import GearBody, classical_results
from pmor.pair.conditions import nominal_condition
from pmor.pair.iso_blank import blank_factor
from pmor.report.blank_figure import blank_figure
from pmor.report.chart import Chart
from pmor.report.data_sheet import sheet_of, sheet_tables
from pmor.report.drawing import draw
from pmor.report.iso_blank_rows import iso_root_stress
from pmor.report.live.section import LiveSection, live_section
from pmor.report.machine_tables import tolerance_table
from pmor.report.page import Block, Picture, Warning, provenance, themed, write_page
from pmor.report.readings_blocks import readings_picture_names, readings_pictures, sensitivities_table
from pmor.report.run_figures import (
    MODEL_PICTURES,
    conditions_figure,
    contact_pattern_figure,
    cycle_figure,
    fillet_figure,
    mesh_figure,
    model_pictures,
)
from pmor.report.screen import advice, model_table
from pmor.report.style import write_picture
from pmor.report.summary import (
    COUNTS_FROM,
    ROUND_OFF,
    Row,
    accuracy_rows,
    ms_per_position,
    pitches_words,
    root_stress_figures,
    summary_rows,
    tolerances_of,
    warnings,
)
from pmor.report.sweep_figures import (
    MOST_PITCHES,
    error_figure,
    load_sharing_figure,
    spectrum_figure,
    ste_figure,
    stiffness_figure,
)
from pmor.report.table import Table, told_tables
from pmor.report.torque_figures import revolution_figure, tolerance_figure, waterfall_figure
from pmor.report.torque_table import (
    causes_table,
    condition_table,
    duty_of,
    load_table,
    loss_tables,
    shaft_order_table,
    ste_table,
    torque_row,
    torque_rows,
)
from pmor.results.sweep import SteSweep, mesh_stiffness, single_pair_zone
from pmor_online.contact_pattern import ContactPattern, contact_patterns
from pmor_online.model import ReducedPair
from pmor_online.run import OnlineResult

#: names of all pictures that a run of one model can have
PICTURES = (
    "ste", "load_sharing", "stiffness", "spectrum", "error", "conditions", "contact_pattern", "root_stress",
    "root_stress_cycle", "mesh", "blanks", "revolution", "waterfall", "tolerances",
)  # fmt: skip
#: pictures by the parts of the page: before all else, by theme, after all else
FIRST = ("ste.svg", "load_sharing.svg")
DRAWN = {
    "Gear data": ("blanks.svg",),
    "Transmission error": ("revolution.svg", "waterfall.svg", "spectrum.svg", "harris.svg", "conditions.svg"),
    "Stiffness and load sharing": ("stiffness.svg",),
    "Flanks": ("flank_maps.svg", "flank_pattern.svg", "contact_pattern.svg"),
    "Tolerances": ("tolerances.svg",),
    "Root stress": ("root_stress.svg", "root_stress_cycle.svg"),
}
# The first that there is stands beside the curve of the beginning.
PATTERNS = ("contact_pattern", "flank_maps")
LAST = ("error.svg", "models.svg", "error_time.svg", "mesh.svg")
OVER_PITCHES = "revolution", "waterfall"
ROOT_STRESS = ("root_stress", "root_stress_cycle")


def page_files(case: Case) -> list[str]:
    """Return the names of the files that `write_pages` may write."""
    drawn = [name for name in PICTURES if name != "conditions" or case.conditions]
    drawn = [name for name in drawn if name != "contact_pattern" or case.pair.helix_angle_deg]
    drawn = [name for name in drawn if name not in ROOT_STRESS or case.root_stress]
    drawn = [name for name in drawn if name != "blanks" or any(case.pair.blanks)]
    drawn = [name for name in drawn if name not in OVER_PITCHES or case.pitches > 1]
    drawn = [name for name in drawn if name != "tolerances" or case.tolerances is not None]
    drawn += MODEL_PICTURES if model_names(case) else ()
    drawn += readings_picture_names(case)
    pictures = [f"{name}.{kind}" for name in drawn for kind in case.output.format] if case.output.plots else []
    return [*pictures, "report.html"] if case.output.report else pictures


def run_pictures(result: OnlineResult, mesh: SectorMesh | None) -> list[Picture]:
    """Return the pictures of a run.

    Parameters
    ----------
    mesh : SectorMesh or None
        The pinion's mesh, when there is one to show.
    """
    sweep, comparison, nominal = result.sweep, result.comparison, result.case.torque_Nm
    pair = result.reduced.meshed.pair
    helical = pair.pinion.helix_angle != 0.0
    stiffness = mesh_stiffness(sweep, pair.pinion.base_radius, pair.common_width)
    pictures = [
        Picture(
            FIRST[0], f"Static transmission error over {pitches_words(sweep)}{', about its mean' if helical else ''}"
            f"{_bars(sweep)}{_rigid(result)}.",
            ste_figure(sweep, nominal_Nm=nominal, about_mean=helical),
        ),
        Picture("load_sharing.svg", "Share of the pinion torque that each tooth pair carries"
                + (f", over the first {MOST_PITCHES} pitches." if sweep.pitches > MOST_PITCHES else "."),
                load_sharing_figure(sweep, nominal)),
        Picture("stiffness.svg", "Mesh stiffness over the cycle: force along the line of action per face width over "
                "the STE less that without load (secant)"
                + ("." if sweep.stiffness_N_per_um is None else ", and its derivative (tangent)."),
                stiffness_figure(sweep, stiffness, nominal)),
    ]  # fmt: skip
    if sweep.converged.all():
        caption = "Transmission error over orders of the mesh frequency."
        pictures.append(Picture("spectrum.svg", caption, spectrum_figure(sweep, nominal_Nm=nominal)))
        pictures += _over_pitches(result) if sweep.pitches > 1 else []
    if comparison is not None and not comparison.max_relative_error < ROUND_OFF:
        full, estimate = comparison.full, comparison.reduced.ste_error_um
        relative = None if estimate is None else estimate / full.ste_um
        figure = error_figure(full.phi_rad, full.torque_Nm, comparison.relative_error, relative)
        bars = "" if relative is None else ", and the error bar of the reduced model itself"
        pictures.append(Picture("error.svg", f"Reduced against full FE at unseen angles{bars}.", figure))
    pictures += model_pictures(result)
    if result.conditions:
        caption = "Conditions that the case lists: peak-to-peak STE over the torque, and STE at their own torques."
        pictures.append(Picture("conditions.svg", caption, conditions_figure(sweep, result.nominal, result.conditions)))
    pictures += readings_pictures(result)
    # A spur pair's lines of contact are straight across the face: its flank maps say more.
    patterns = _patterns(result) if helical else []
    if patterns:
        caption = f"Contact pressure on the unrolled flanks at {nominal:g} N m{_places(result)}; mean over each cell."
        pictures.append(Picture("contact_pattern.svg", caption, contact_pattern_figure(patterns)))
    pictures += _root_stress(result)
    if result.samples is not None:
        caption = "Pairs within tolerances, each solved; dashed: 95 % stay below."
        pictures.append(Picture("tolerances.svg", caption, tolerance_figure(result.samples, sweep.torque_Nm)))
    if (blanks := blank_figure(result.case, pair)) is not None:
        caption = "Blanks by dimensions: sections through the axis, and fronts. Mass and inertia are in the gear data."
        pictures.append(Picture("blanks.svg", caption, blanks))
    if mesh is not None:
        caption = "Section of the pinion's sector mesh, loaded flank marked."
        pictures.append(Picture("mesh.svg", caption, _mesh_figure(mesh)))
    return pictures


def _over_pitches(result: OnlineResult) -> list[Picture]:
    """Pictures of a sweep whose teeth may differ."""
    sweep, pair = result.sweep, result.case.pair
    teeth = pair.pinion.teeth, pair.wheel.teeth
    caption = (
        f"Transmission error over {pitches_words(sweep)}, and its orders: those of the mesh, and beside them those of "
        "holes and of teeth that differ, with sidebands about each order of the mesh. The table names them."
    )
    pictures = [Picture("revolution.svg", caption, revolution_figure(sweep, result.nominal, teeth, pair.holes))]
    if (figure := waterfall_figure(sweep, teeth, pair.holes)) is not None:
        caption = "Orders at each torque; from one torque to the next amplitudes rise by four decades."
        pictures.append(Picture("waterfall.svg", caption, figure))
    return pictures


def _root_stress(result: OnlineResult) -> list[Picture]:
    stress, pair = result.root_stress, result.reduced.meshed.pair
    if stress is None:
        return []
    return [
        Picture(
            "root_stress.svg",
            f"Root stress along the fillets at {result.case.torque_Nm:g} N m, largest over the cycle and the width.",
            fillet_figure(stress, result.nominal, iso_root_stress(result)),
        ),
        Picture(
            "root_stress_cycle.svg",
            "Root stress on the loaded side of a tooth while it rolls through the mesh, largest on the fillet.",
            cycle_figure(stress, pair.pitch, result.nominal),
        ),
    ]


def _bars(sweep: SteSweep) -> str:
    """Words of the caption on the bands about the curves."""
    errors = {"reduction": sweep.ste_error_um, "mesh": sweep.mesh_error_um}
    kinds = " and the ".join(name for name, error in errors.items() if error is not None)
    return f"; bands: error bar of the {kinds}, often no wider than the line" if kinds else ""


def _rigid(result: OnlineResult) -> str:
    """Words of the caption on the curve without load and on the datum."""
    unloaded = "" if result.sweep.unloaded_um is None else ", and that of rigid flanks without load (dashed)"
    return f"{unloaded}. {COUNTS_FROM}"


def write_pages(
    result: OnlineResult, mesh: SectorMesh | None, out: Path, live: ReducedPair | str | None = None
) -> None:
    """Write the pictures and the report page, as far as the case asks for them; OutputError where that fails.

    Parameters
    ----------
    live : ReducedPair or str, optional
        Model of line loads that the page solves, or the reason why there is none (`pmor.work.live`).
    """
    write_drawn(result, drawn_pictures(result, mesh), out, live)


def drawn_pictures(result: OnlineResult, mesh: SectorMesh | None) -> list[Picture]:
    """Return the pictures of a run, drawn in the formats that the case asks for; none where it asks for none."""
    output = result.case.output
    if not (output.plots or output.report):
        return []
    pictures = run_pictures(result, mesh)
    draw(pictures, output.format if output.plots else ())
    return pictures


def write_drawn(
    result: OnlineResult, pictures: Sequence[Picture], out: Path, live: ReducedPair | str | None = None
) -> None:
    """Write pictures and the report page with them; parameters as of `write_pages`."""
    case = result.case
    if case.output.plots:
        for picture in pictures:
            for picture_format in case.output.format:
                target = (out / picture.file_name).with_suffix(f".{picture_format}")
                write_picture(picture.content(picture_format), target)
    if case.output.report:
        write_page(out / "report.html", case.title, run_blocks(result, pictures, live))


#: of a case of coast flanks
COAST_FLANKS = (
    "The coast flanks carry, as a negative torque loads them. Torques are amounts; angles, tooth numbers and "
    "transmission error count clockwise, the way in which the torque turns the pinion. The error counts "
    "from where plain coast flanks touch: the backlash between both flanks is not in it."
)


def run_blocks(
    result: OnlineResult, pictures: Sequence[Picture], live: ReducedPair | str | None = None
) -> list[Block | LiveSection]:
    """Return the blocks of a run's page: STE and figures, gear data, live model, themes, accuracy, settings."""
    case, rows = result.reduced.basis.case, torque_rows(result)
    tables: dict[str, Sequence[Block]] = {
        "Transmission error": [
            *([condition_table(result)] if result.conditions else []),
            *sensitivities_table(result),
            *shaft_order_table(result),
        ],
        "Stiffness and load sharing": [load_table(result, rows), *_classical_tables(result)],
        "Losses and duty cycle": loss_tables(rows, duty_of(result)),
        "Tolerances": [tolerance_table({"": drawn}, "pairs")] if (drawn := tolerances_of(result)) else [],
        "Root stress": causes_table(root_stress_figures(result) | {"torque_Nm": case.torque_Nm}),
        "Gear data": [*sheet_tables(sheet_of(case, result.reduced.meshed.pair))],
        "Accuracy and run time": [
            _quantities("Held against full FE, and run time", accuracy_rows(result)), *_error_tables(result),
            model_table(result), Table("Which model to take", ("model", "take it"), advice(result)),
            *_shown(pictures, LAST),
        ],
    }
    beside = _beside(pictures)
    later = [picture for picture in pictures if picture not in beside]
    pictured = {theme: _shown(later, names) for theme, names in DRAWN.items()}
    left = [f"{what}: {why}" for what, why in left_out(case)]
    settings = [
        (key, _cell(value), "default" if is_default else "case file") for key, value, is_default in describe(case)
    ]
    return [
        *([result.verdict] if result.verdict else []), *map(Warning, warnings(result)),
        *([COAST_FLANKS] if case.flank == "coast" else []), *_shown(pictures, FIRST), *beside,
        _quantities("Results at nominal torque", summary_rows(result)), ste_table(rows),
        *themed(pictured, tables, {"Change the pair": _live(result, live)}), *told_tables({"left_out": left}),
        *provenance(case), Table("Case settings", ("setting", "value", "source"), settings, folded=True),
    ]  # fmt: skip


def _shown(pictures: Sequence[Picture], names: Sequence[str]) -> list[Block]:
    return [picture for picture in pictures if picture.file_name in names]


def _beside(pictures: Sequence[Picture]) -> list[Picture]:
    """The contact pattern, that stands beside the curve: of helical flanks, else pressure over the flanks."""
    by_name = {Path(picture.file_name).stem: picture for picture in pictures}
    return [by_name[name] for name in PATTERNS if name in by_name][:1]


def _quantities(title: str, rows: Sequence[Row]) -> Table:
    shown = [
        (label, value, _micrometres(unit).replace(" ", "\u00a0"), _micrometres(note))
        for label, value, unit, note in rows
    ]
    return Table(title, ("quantity", "value", "unit", "note"), shown)


def _micrometres(text: str) -> str:
    return re.sub(r"\bum\b", "µm", text)


def _live(result: OnlineResult, live: ReducedPair | str | None) -> list[Block | LiveSection]:
    """The live section, or why there is none."""
    if live is None:
        return []
    return [f"Left out: {live}." if isinstance(live, str) else live_section(result, live)]


def _cell(value: object) -> str | float | int | bool | None:
    if isinstance(value, tuple):
        return short_list(value)
    return value if isinstance(value, (str, float, int, bool)) or value is None else str(value)


def _error_tables(result: OnlineResult) -> list[Table]:
    comparison = result.comparison
    if comparison is None:
        return []
    full, columns = comparison.full, ("torque, N m", "error max, %", "error rms, %")
    rows = [
        (torque, *_error_in_percent(error))
        for torque, error in zip(full.torque_Nm.tolist(), comparison.relative_error, strict=True)
    ]
    note = (
        f"Of the STE, over {full.ste_um.shape[1]} unseen angles. Reduced model "
        f"{ms_per_position(comparison.reduced):.3g} ms, full FE {ms_per_position(full):.3g} ms per position (condensed "
        f"compliance, same solver); offline {result.reduced.basis.training.seconds:.3g} s."
    )
    return [Table("Reduced against full FE at each torque", columns, rows, note, folded=True)]


def _error_in_percent(error: np.ndarray) -> tuple[float | None, float | None]:
    """Largest and root-mean-square relative error in per cent; None where nothing could be compared."""
    known = 100.0 * error[np.isfinite(error)]
    return (float(np.abs(known).max()), float(np.sqrt(np.mean(known**2)))) if len(known) else (None, None)


def _classical_tables(result: OnlineResult) -> list[Table]:
    case, i = result.reduced.basis.case, result.nominal
    if why_not(case, "classical"):
        return []
    pair, own = result.reduced.meshed.pair, torque_row(result, i)
    deflection = own["ste_mean_um"] - (own["unloaded_ste_mean_um"] or 0.0)
    load = 1e3 * case.torque_Nm / pair.pinion.base_radius / pair.common_width
    rows: list[tuple[str | float | None, ...]] = [
        ("reduced FE model, this run", load / deflection, deflection,
         own["ste_peak_to_peak_um"], "flanks and axes of the case")
    ]  # fmt: skip
    bodies = _gear_body(case.pair.pinion), _gear_body(case.pair.wheel)
    for row in classical_results(pair, bodies, case.torque_Nm, blank_factor(case, pair)):
        rows.append((row.method, row.mesh_stiffness_N_per_mm_um, row.ste_mean_um, row.ste_peak_to_peak_um, row.note))
    columns = ["method", "load over mean deflection, N/(mm µm)", "mean deflection, µm", "STE peak-to-peak, µm", "note"]
    note = (
        "Deflection: STE less that without load. Load over its mean is a little less than the mesh stiffness of the "
        "results, the mean of load over deflection. "
        "The formulas add the body's compliance once per tooth pair, finite elements share it between the pairs: "
        "expect finite elements to be softer, more so with a small bore."
    )
    return [Table("Classical formulas for the same pair", columns, rows, note, folded=True)]


def _gear_body(gear: GearCase) -> GearBody:
    return GearBody(gear.bore_radius_mm or 0.0, 1e3 * gear.youngs_modulus_GPa, gear.poisson_ratio)


def _middles(result: OnlineResult) -> list[int]:
    """Positions in the middle of the double and of the single contact, or one where there are not both."""
    n, single = len(result.sweep.phi_rad), single_pair_zone(result.sweep, result.nominal)
    if len(single) in (0, n):
        return [n // 2]
    return [int(single[len(single) // 2] + n // 2) % n, int(single[len(single) // 2])]


def _places(result: OnlineResult) -> str:
    middles = _middles(result)
    if len(middles) == 2:
        return ", with two pairs and with one pair in mesh"
    return f", a panel for each tooth pair in mesh at {np.degrees(result.sweep.phi_rad[middles[0]]):.3g} deg"


def _patterns(result: OnlineResult) -> list[ContactPattern]:
    phi, condition = result.sweep.phi_rad, nominal_condition(result.reduced.basis.case)
    return [p for i in _middles(result) for p in contact_patterns(result.reduced, float(phi[i]), condition)]


def _mesh_figure(mesh: SectorMesh) -> Chart:
    layers = len(mesh.z)
    section = mesh.nodes[::layers, :2]
    around = [0, 1, 2, 3] if mesh.order == 1 else [0, 8, 1, 9, 2, 10, 3, 11]
    quads = mesh.elements[:: (layers - 1) // mesh.order, around] // layers
    return mesh_figure(section, quads, mesh.flank_nodes[:, 0, :2])
