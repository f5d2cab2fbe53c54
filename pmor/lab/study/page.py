"""The report of a study, from its table and its pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pmor.lab.study.paper import claim_blocks
from pmor.lab.study.settings import Study
from pmor.lab.study.solve import CONDENSED_ANGLES, REDUCED_ANGLES, REPEATS
from pmor.lab.study.table import Row, StudyTable
from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.table import Columns, Table, percent, table

INTRODUCTION = (
    "How fine a mesh, how much refinement, how many shapes? Cells are written elements over the profile @ LoDM "
    "(contact points per element). Three models solve each: (a) conventional full FE, both whole gears in one sparse "
    "system that is factored in every Newton step; (b) condensed full FE, the same equations on the flank compliance "
    "obtained once from one sector; (c) the reduced model. STE is in micrometres along the line of action."
)
MEASURES = (
    ("mean error", "mean over the angles of STE minus reference STE"),
    ("peak-to-peak error", "peak-to-peak STE minus that of the reference"),
    ("shape error", "standard deviation over the angles of STE minus reference STE: blind to a constant offset"),
    ("numerical noise", "standard deviation about a smooth curve where one pair carries the load; needs no reference"),
    ("load-share error", "largest difference of a tooth pair's share of the torque to the reference at the same angle"),
    (
        "reduced against full",
        "STE of the reduced over that of the condensed model on the same mesh, minus 1, at angles and torques that "
        "were never trained: largest magnitude and root mean square",
    ),
)


def study_blocks(study: Study, result: StudyTable, pictures: Sequence[Picture]) -> list[Block]:
    """Return the report, in the order of reading."""
    if study.reference is None:
        return [*(Warning(text) for text in result.failures), *_variants(study, result, pictures)]

    def picture(name: str) -> list[Block]:
        return [picture for picture in pictures if picture.file_name == f"{name}.png"]

    figure5 = picture("figure5")
    return [
        *(Warning(text) for text in result.failures),
        INTRODUCTION,
        *([Heading("Transmission error over one pitch"), *figure5] if figure5 else []),
        *(_ladder(study, result) if study.rungs else []),
        *claim_blocks([*result.claims, *result.time_claims]),
        Heading("Error against run time"),
        *picture("error_run_time"),
        Heading("Mesh against reference"),
        Table("Error measures", ("measure", "definition"), MEASURES),
        _mesh_errors(result),
        *_reference(result.reference),
        Heading("Reduced against full FE on the same mesh"),
        _reduced_errors(result),
        Heading("Run times"),
        *_run_times(result),
        *(_peer(study, result.peer) if study.peer else []),
    ]


def _variants(study: Study, result: StudyTable, pictures: Sequence[Picture]) -> list[Block]:
    """The report of a study of variants alone: other gears or meshes, compared with each other."""
    columns: Columns = {
        "variant": "variant",
        "elements, profile x width": lambda row: f"{row['n_profile']} x {row['n_width']}",
        "contact ratio": "contact_ratio",
        "overlap ratio": "overlap_ratio",
        "STE mean, µm": "ste_mean_um",
        "peak-to-peak, µm": "ste_peak_to_peak_um",
        "of the first, %": lambda row: 100.0 * row["ste_peak_to_peak_um"] / result.rows[0]["ste_peak_to_peak_um"],
        "FE unknowns": "fe_unknowns",
    }
    text = (
        f"Full FE at nominal torque, {study.grid.angles_per_pitch} angles per pitch. STE is along the line of action."
    )
    return [text, table("Variants", columns, result.rows), *pictures]


def _ladder(study: Study, result: StudyTable) -> list[Block]:
    """The schemes one step at a time, condensed and reduced beside each other."""
    both = [(result.row(cell, "condensed"), result.row(cell, "reduced")) for cell in study.ladder_cells]
    columns: Columns = {
        "scheme": lambda r: r[0]["variant"],
        "elements": lambda r: r[0]["n_profile"],
        "mean, µm": lambda r: r[0]["ste_mean_um"],
        "mean error, µm": lambda r: r[0]["mean_error_um"],
        "shape error, µm": lambda r: r[0]["shape_error_um"],
        "of (c)": lambda r: r[1]["shape_error_um"],
        "numerical noise, µm": lambda r: r[0]["ripple_um"],
        "numerical noise of (c)": lambda r: r[1]["ripple_um"],
        "(c) vs (b), max %": lambda r: percent("rom_vs_full_ste_max_rel")(r[1]),
        "(b) ms": lambda r: r[0]["ms_per_position"],
        "(c) ms": lambda r: r[1]["ms_per_position"],
    }
    rows = [pair for pair in both if None not in pair]
    return [Heading("The ladder of contact schemes"), table("One step at a time", columns, rows)]


def _mesh_errors(result: StudyTable) -> Table:
    columns: Columns = {
        "cell": "cell",
        "E": "detail",
        "STE mean, µm": "ste_mean_um",
        "mean error, µm": "mean_error_um",
        "peak-to-peak, µm": "ste_peak_to_peak_um",
        "peak-to-peak error, µm": "peak_to_peak_error_um",
        "shape error, µm": "shape_error_um",
        "numerical noise, µm": "ripple_um",
        "load-share error": "load_share_error",
    }
    note = "Condensed full FE at nominal torque on a regular grid of angles; model (a) solves the same equations."
    return table("Condensed full FE against the reference", columns, result.rows_of("condensed"), note)


def _reference(reference: Row) -> list[Block]:
    meshes: Columns = {
        "elements, profile x width": lambda m: f"{m['n_profile']} x {m['n_width']}",
        "LoDM": "lodm",
        "STE mean, µm": "ste_mean_um",
        "peak-to-peak, µm": "ste_peak_to_peak_um",
        "numerical noise, µm": "ripple_um",
        "FE unknowns": "fe_unknowns",
        "s": lambda m: m["elastic_s"] + m["solve_s"],
    }
    estimates: Columns = {
        "quantity": lambda name: name.replace("_", "-"),
        "error, µm": lambda name: reference[f"{name}_error_um"],
        "observed order": lambda name: reference.get(f"{name}_order"),
        "differences to the finest, µm": lambda name: ", ".join(
            f"{d:.4g}" for d in reference[f"{name}_differences_um"]
        ),
    }
    known = [name for name in ("mean", "peak_to_peak", "shape") if reference[f"{name}_error_um"] is not None]
    note = (
        "From the differences of the coarser meshes to the finest, with the observed order of convergence where there "
        "is one, at most that of linear elements, 2. A dash: no order can be observed, and the estimate is the last "
        "difference itself."
    )
    return [
        table("The reference's family of meshes; the last is the reference", meshes, reference["meshes"]),
        table("Estimated discretisation error of the reference", estimates, known, note),
    ]


def _reduced_errors(result: StudyTable) -> Table:
    columns: Columns = {
        "cell": "cell",
        "E": "detail",
        "max, %": percent("rom_vs_full_ste_max_rel"),
        "rms, %": percent("rom_vs_full_ste_rms_rel"),
        "unseen positions": "n_unseen_positions",
        "trained angles x torques": lambda row: f"{row['n_angles_trained']} x {row['n_torques_trained']}",
        "unknowns at most": "rom_size",
        "FE unknowns": "fe_unknowns",
        "basis, MiB": "basis_mib",
    }
    note = "This is the error of the reduction; that of the mesh is in the table above."
    title = "STE of the reduced model against condensed full FE, same mesh"
    return table(title, columns, result.rows_of("reduced"), note)


def _run_times(result: StudyTable) -> list[Block]:
    text = (
        "One position is one angle at nominal torque. (b) and (c) were timed in one phase of one process after a "
        f"warm-up, cells in turn, {REPEATS} rounds of {CONDENSED_ANGLES} and {REDUCED_ANGLES} "
        "positions; the median counts. Linear algebra ran on as many threads as stated below; (c) also on all cores. "
        "(a) was timed in the same process, once, where the study asks for it."
    )
    rivals = {(row["cell"], row["model"]): row for row in result.rows}

    def of(model: str, key: str) -> Callable[[Row], Any]:
        return lambda row: rivals.get((row["cell"], model), {}).get(key)

    columns: Columns = {
        "cell": "cell",
        "(a) ms": of("conventional", "ms_per_position"),
        "(b) ms": of("condensed", "ms_per_position"),
        "(c) ms": "ms_per_position",
        "(c) all threads, ms": lambda row: row.get("ms_per_position_all_threads"),
        "a / c": lambda row: row.get("time_ratio_conventional_to_reduced"),
        "b / c": lambda row: row.get("time_ratio_condensed_to_reduced"),
        "offline, s": "offline_s",
        "break-even a": lambda row: row.get("time_break_even_positions_conventional"),
        "break-even b": lambda row: row.get("time_break_even_positions_condensed"),
    }
    note = "Break-even: positions from which the offline stage has paid."
    title = "Run times per position, ratios, and cost of the offline stage"
    return [text, table(title, columns, result.rows_of("reduced"), note)]


def _peer(study: Study, peer: Mapping[str, Any] | None) -> list[Block]:
    heading, settings = Heading("An independent solver"), study.peer
    assert settings is not None
    if peer is None:
        return [heading, "CalculiX is not installed here, so it was not run."]
    rows = [
        (f"{phi:.5g}", theirs, ours, None if theirs is None or ours is None else 100.0 * (theirs / ours - 1.0), seconds)
        for phi, theirs, ours, seconds in zip(
            peer["phi_rad"], peer["ste_um"], peer["condensed_ste_um"], peer["solve_s"], strict=True
        )
    ]
    columns = ("pinion angle, rad", f"STE, {peer['program']}, µm", "STE, condensed, um", "difference, %",
               f"{peer['program']}, s")  # fmt: skip
    changes = ", ".join(f"{k} = {v}" for keys in settings.changes.values() for k, v in keys.items())
    note = f"Both whole gears on the mesh of {settings.cell.label} ({changes}); {peer['unknowns']} unknowns."
    return [heading, Table(f"{peer['program']} on the same mesh", columns, rows, note)]
