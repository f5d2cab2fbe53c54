"""What the report of a study says, from its table and its pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pmor.lab.study.cells import ENTRY_EXIT_MARGIN
from pmor.lab.study.run import StudyParts
from pmor.lab.study.settings import Study
from pmor.lab.study.table import StudyTable
from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Cells = tuple[str | float | int | bool | None, ...]

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
    ("ripple", "standard deviation about a quartic where one pair carries the load; needs no reference"),
    ("load-share error", "largest difference of a tooth pair's share of the torque to the reference at the same angle"),
    (
        "torque ratio error",
        "largest |T2 z1 / (T1 z2) - 1| of the contact torques, all loaded pairs at least "
        f"{ENTRY_EXIT_MARGIN:g} of a pitch inside the path of contact",
    ),
    (
        "reduced against full",
        "STE of the reduced over that of the condensed model on the same mesh, minus 1, at angles and torques that "
        "were never trained: largest magnitude and root mean square",
    ),
)


def study_blocks(
    parts: StudyParts, table: StudyTable, figures: Sequence[tuple[str, str, Figure]]
) -> list[Block]:
    """Return the report's blocks, in the order of reading."""
    study = parts.study
    pictures = {name: Picture(name, caption, figure) for name, caption, figure in figures}

    def picture(name: str) -> list[Block]:
        return [pictures[f"{name}.png"]] if f"{name}.png" in pictures else []

    def section(heading: str, blocks: list[Block]) -> list[Block]:
        return [Heading(heading), *blocks] if blocks else []

    return [
        *(Warning(text) for text in table.failures),
        INTRODUCTION,
        *section("Transmission error over one pitch", picture("figure5")),
        *_ladder(study, table),
        *picture("ladder"),
        *section("The paper's claims, checked", [_claims(table)] if table.claims or table.time_claims else []),
        Heading("Error against run time"),
        *picture("error_run_time"),
        Heading("Mesh against reference"),
        Table("Error measures", ("measure", "definition"), MEASURES),
        _mesh_errors(table),
        *_reference(table),
        Heading("Reduced against full FE on the same mesh"),
        _reduced_errors(table),
        *picture("error_over_angle"),
        *picture("training"),
        _trainings(table),
        Heading("Run times"),
        *_run_times(study, table),
        *picture("cost"),
        *_peer(study, table),
        Heading("Provenance"),
        Table("Machine and software", ("item", "value"), tuple(table.machine.items())),
    ]


def _claims(table: StudyTable) -> Table:
    rows = [
        (
            claim["claim"],
            "confirmed" if claim["confirmed"] else "not confirmed",
            claim["criterion"],
            "; ".join(f"{_words(key)} {_beside(value, claim.get('yardstick', {}).get(key))}"
                      for key, value in claim["measured"].items()),
        )
        for claim in (*table.claims, *table.time_claims)
    ]  # fmt: skip
    return Table("Claims", ("claim", "verdict", "criterion", "measured"), rows)


def _ladder(study: Study, table: StudyTable) -> list[Block]:
    """The schemes one step at a time, condensed and reduced beside each other."""
    if not study.rungs:
        return []
    rows = []
    for rung in study.rungs:
        for cell in rung.cells:
            full, fast = table.row(cell, "condensed"), table.row(cell, "reduced")
            if full is not None and fast is not None:
                rows.append(
                    (rung.name, cell.n_profile, full["ste_mean_um"], full["mean_error_um"], full["shape_error_um"],
                     fast["shape_error_um"], full["ripple_um"], fast["ripple_um"],
                     100.0 * _number(fast["rom_vs_full_ste_max_rel"]), full["ms_per_position"], fast["ms_per_position"])
                )  # fmt: skip
    columns = ("scheme", "elements", "mean, um", "mean error, um", "shape error, um", "of (c)", "ripple, um", "of (c)",
               "(c) vs (b), max %", "(b) ms", "(c) ms")  # fmt: skip
    return [Heading("The ladder of contact schemes"), Table("One step at a time", columns, rows)]


def _mesh_errors(table: StudyTable) -> Table:
    keys = {
        "STE mean, um": "ste_mean_um",
        "mean error, um": "mean_error_um",
        "peak-to-peak, um": "ste_peak_to_peak_um",
        "peak-to-peak error, um": "peak_to_peak_error_um",
        "shape error, um": "shape_error_um",
        "ripple, um": "ripple_um",
        "load-share error": "load_share_error",
        "torque ratio error": "torque_ratio_error",
    }
    rows = [
        (row["cell"], row["detail"], *(row[key] for key in keys.values()))
        for row in table.rows
        if row["model"] == "condensed"
    ]
    note = "Condensed full FE at nominal torque on a regular grid of angles; model (a) solves the same equations."
    return Table("Condensed full FE against the reference", ("cell", "E", *keys), rows, note)


def _reference(table: StudyTable) -> list[Block]:
    reference = table.reference
    members = [
        (f"{m['n_profile']} x {m['n_width']}", m["lodm"], m["ste_mean_um"], m["ste_peak_to_peak_um"], m["ripple_um"],
         m["fe_unknowns"], m["elastic_s"] + m["solve_s"])
        for m in reference["members"]
    ]  # fmt: skip
    estimates = [
        (name, reference[f"{key}_error_um"], reference.get(f"{key}_order"), _list(reference[f"{key}_differences_um"]))
        for name, key in (("mean", "mean"), ("peak-to-peak", "peak_to_peak"), ("shape", "shape"))
        if reference[f"{key}_error_um"] is not None
    ]
    note = (
        "From the differences of the coarser meshes to the finest, with the observed order of convergence where there "
        "is one, at most that of linear elements, 2. A dash: no order can be observed, and the estimate is the last "
        "difference itself."
    )
    columns = ("elements, profile x width", "LoDM", "STE mean, um", "peak-to-peak, um", "ripple, um", "FE unknowns",
               "s")  # fmt: skip
    return [
        Table("The reference's family of meshes; the last is the reference", columns, members),
        Table("Estimated discretisation error of the reference",
              ("quantity", "error, um", "observed order", "differences to the finest, um"), estimates, note),
    ]  # fmt: skip


def _reduced_errors(table: StudyTable) -> Table:
    rows = [
        (
            row["cell"], row["detail"], 100.0 * _number(row["rom_vs_full_ste_max_rel"]),
            100.0 * _number(row["rom_vs_full_ste_rms_rel"]), row["n_unseen_positions"],
            f"{row['n_angles_trained']} x {row['n_torques_trained']}", row["rom_size"], row["fe_unknowns"],
            row["basis_mib"],
        )
        for row in table.rows
        if row["model"] == "reduced"
    ]  # fmt: skip
    columns = ("cell", "E", "max, %", "rms, %", "unseen positions", "trained angles x torques", "unknowns at most",
               "FE unknowns", "basis, MiB")  # fmt: skip
    note = "This says what the reduction costs, and nothing about the mesh: that is the table above."
    return Table("STE of the reduced model against condensed full FE, same mesh", columns, rows, note)


def _trainings(table: StudyTable) -> Table:
    rows = [
        (row["label"], row["cell"], row["n_angles_trained"], _list(row["torques_Nm"]),
         100.0 * _number(row["rom_vs_full_ste_max_rel"]), 100.0 * _number(row["rom_vs_full_ste_rms_rel"]),
         row["rom_size"], row["basis_mib"])
        for row in table.trainings
    ]  # fmt: skip
    columns = ("shapes", "cell", "angles", "torques, N m", "max, %", "rms, %", "unknowns at most", "basis, MiB")
    note = "All compared with full FE at the same positions, which none of them has seen."
    return Table("Trainings", columns, rows, note)


def _run_times(study: Study, table: StudyTable) -> list[Block]:
    timing, known = study.timing, {cell.label: seconds for cell, seconds in study.paper.seconds}
    text = (
        "One position is one angle at nominal torque. (b) and (c) were timed in one phase of one process after a "
        f"warm-up, cells in turn, {timing.repeats} rounds of {timing.condensed_angles} and {timing.reduced_angles} "
        "positions; the median counts. Linear algebra ran on as many threads as stated below; (c) also on all cores. "
        "(a) was timed in the same process, once. Where it was not solved to the end, its time is that of a Newton "
        "step, extrapolated from arcs of the gears, times the Newton steps counted in (b), which starts alike."
    )
    blocks: list[Block] = [text, *(_table3(study, table, model) for model in ("conventional", "condensed", "reduced"))]
    rows = []
    for row in table.rows:
        if row["model"] != "reduced":
            continue
        slow = {r["model"]: r for r in table.rows if r["cell"] == row["cell"]}
        conventional = slow.get("conventional", {})
        rows.append(
            (row["cell"], conventional.get("ms_per_position"),
             {None: "", 0: "extrapolated"}.get(conventional.get("n_positions_solved"), "solved"),
             slow["condensed"]["ms_per_position"], row["ms_per_position"], row.get("ms_per_position_all_threads"),
             row.get("time_ratio_conventional_to_reduced"), row.get("time_ratio_condensed_to_reduced"),
             row["offline_s"], row.get("time_break_even_positions_conventional"),
             row.get("time_break_even_positions_condensed"), known.get(row["cell"]))
        )  # fmt: skip
    columns = ("cell", "(a) ms", "(a) how", "(b) ms", "(c) ms", "(c) all threads, ms", "a / c", "b / c", "offline, s",
               "break-even a", "break-even b", "paper, s")  # fmt: skip
    note = (
        "Break-even: positions from which the offline stage has paid. The paper's seconds are for its own, unstated "
        "number of positions; those of the other cells are not available to us."
    )
    blocks.append(Table("Run times per position, ratios, and what the offline stage costs", columns, rows, note))
    if table.paper_ratios:
        ratios = [
            (f"{r['cell']} / {r['to']}", f"{'more than' if r['kind'] == 'above' else 'about'} {r['paper']:g}",
             *(r[f"time_ratio_{model}"] for model in ("conventional", "condensed", "reduced")))
            for r in table.paper_ratios
        ]  # fmt: skip
        note = "The paper does not say what its seconds cover, so there is no verdict."
        title = "Ratios of run times that the paper states, and ours"
        blocks.append(Table(title, ("cells", "paper", "(a)", "(b)", "(c)"), ratios, note))
    return blocks


def _table3(study: Study, table: StudyTable, model: str) -> Table:
    """The paper's Table 3: elements down, LoDM across, seconds in the cells."""
    cells = study.grid.cells
    lodms = sorted({cell.lodm for cell in cells})
    seconds = {
        (row["n_profile"], row["lodm"]): 1e-3 * row["ms_per_position"]
        for row in table.rows
        if row["model"] == model and row["variant"] is None and row["ms_per_position"] is not None
    }
    rows = [(n, *(seconds.get((n, lodm)) for lodm in lodms)) for n in sorted({cell.n_profile for cell in cells})]
    names = {"conventional": "(a) conventional", "condensed": "(b) condensed", "reduced": "(c) reduced"}
    columns = ("elements \\ LoDM", *(f"{lodm}x" for lodm in lodms))
    return Table(f"Seconds per position, {names[model]}", columns, rows if seconds else [])


def _peer(study: Study, table: StudyTable) -> list[Block]:
    if study.peer is None:
        return []
    peer = table.peer
    if peer is None:
        return [Heading("An independent solver"), "CalculiX is not installed here, so it was not run."]
    rows = [
        (f"{phi:.5g}", theirs, ours, 100.0 * (_number(theirs) / _number(ours) - 1.0), seconds)
        for phi, theirs, ours, seconds in zip(
            peer["phi_rad"], peer["ste_um"], peer["condensed_ste_um"], peer["solve_s"], strict=True
        )
    ]
    columns = ("pinion angle, rad", f"STE, {peer['program']}, um", "STE, condensed, um", "difference, %",
               f"{peer['program']}, s")  # fmt: skip
    changes = ", ".join(f"{k} = {v}" for keys in study.peer.changes.values() for k, v in keys.items())
    note = f"Both whole gears on the mesh of {study.peer.cell.label} ({changes}); {peer['unknowns']} unknowns."
    return [Heading("An independent solver"), Table(f"{peer['program']} on the same mesh", columns, rows, note)]


def _words(key: str) -> str:
    """A key as the report's reader says it: `shape_error_um` becomes shape error (um)."""
    name, unit = (key[:-3], " (um)") if key.endswith("_um") else (key.removeprefix("time_ratio_"), "")
    return name.replace("_", " ") + unit


def _beside(value: float, yardstick: float | None) -> str:
    return f"{value:.3g}" if yardstick is None else f"{value:.3g} against {yardstick:.3g}"


def _list(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)
