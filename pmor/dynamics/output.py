"""Files of a pair in motion, its page, and its summary on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from pmor.case import Case
from pmor.dynamics.figures import contact_figure, motion_figure, response_figure, waterfall_figure
from pmor.dynamics.force_law import cycles_of
from pmor.dynamics.law import MeshLaw
from pmor.dynamics.measure import RUNS, Data, rpm, with_speeds
from pmor.dynamics.peaks import NO_SINGLE, PROMINENCE
from pmor.dynamics.quantities import ORDERS
from pmor.dynamics.rating import by_range, rated
from pmor.dynamics.solution import Dynamics
from pmor.pair.conditions import backs_mirror_flanks
from pmor.report.page import Block, Picture, Warning
from pmor.report.table import Columns, Table, table, text_lines
from pmor.work.results import Report

#: files of a result; without runs or branches some are not written
FILES = (
    "dynamics.json", "dynamics.md", "report.html", "response.csv", "response.svg", "contact.svg", "waterfall.svg",
    "motion.svg",
)  # fmt: skip
KINDS = {"run_up": "running up", "run_down": "running down"}


def dynamics_report(solved: Dynamics) -> Report:
    """Return numbers and page."""
    title = f"The pair in motion: {solved.case.title}"
    return Report("dynamics", dynamics_data(solved), title, _blocks(solved), solved.case)


def dynamics_data(solved: Dynamics) -> Data:
    """Return the content of `dynamics.json`."""
    model, teeth = solved.model, solved.pair.pinion.teeth
    return {
        "case": solved.case.name,
        "flank": solved.case.flank,
        "degrees_of_freedom": solved.case.dynamics.degrees_of_freedom,
        "pinion": asdict(model.inertias[0]),
        "wheel": asdict(model.inertias[1]),
        "equivalent_mass_kg": 1e3 * model.mass,
        "supports": [support.name for support in model.supports],
        "backlash_um": None if solved.backlash is None else 1e3 * solved.backlash,
        "force_table_error_max_N": max(law.error.largest * law.largest_force for law in solved.laws),
        "force_table_error_rms_N": max(law.error.rms * law.largest_force for law in solved.laws),
        "force_table_largest_N": max(law.largest_force for law in solved.laws),
        "force_table_ste_error_um": [law.static_error_um for law in solved.laws],
        "branch_law": solved.case.dynamics.law,
        "repeats_after_mesh_cycles": cycles_of(solved.laws[0].table),
        "axes_um": [asdict(law.assembly.misalignment) for law in solved.laws],
        "responses": [
            response | {"iso_6336": with_speeds(rated(solved.case, solved.pair, model.mass, response), teeth)}
            for response in solved.responses
        ],
    }


def dynamics_text(solved: Dynamics) -> str:
    """Return the tables for the screen."""
    lines = [f"The pair in motion: {solved.case.title}"]
    for shown in (_peaks(solved.responses), *_tables(solved)):
        if shown.rows:
            lines += [f"  {shown.title}", *(f"    {line}" for line in text_lines(shown))]
    lines += [f"  ! {sentence}" for sentence in solved.failures]
    return "\n".join(lines)


def _blocks(solved: Dynamics) -> list[Block]:
    case, model, responses = solved.case, solved.model, solved.responses
    one, two = model.inertias
    how = "on rigid bearings" if not model.supports else f"on bearings ({', '.join(s.name for s in model.supports)})"
    blocks: list[Block] = [
        f"Two gears of {one.mass_kg:.4g} and {two.mass_kg:.4g} kg, {one.polar_kg_m2:.4g} and {two.polar_kg_m2:.4g} "
        f"kg m², {how}; reduced mass {1e3 * model.mass:.4g} kg along the line of action. Speeds are those of the "
        "pinion.",
        *(["The coast flanks carry: torques are amounts."] if case.flank == "coast" else []),
        _assumed_paragraph(solved),
        "Displacements count along the transverse line of action from where the nominal flanks touch, the dynamic "
        f"transmission error about its mean. {_backs(solved)}",
        *map(Warning, solved.failures),
    ]
    if responses:
        factors = [rated(case, solved.pair, model.mass, response) for response in responses]
        blocks += [
            Picture("response.svg", "Response over the mesh frequency; dotted: natural frequencies with the mean "
                    "stiffness, numbered as in the table of modes; one excited by order k of the mesh peaks at a k-th "
                    "of it. Between jump frequencies motion is unstable; the marks are the runs, which jump there. "
                    "Dash-dotted below: K_v of ISO 6336-1:2006, method B, tolerance class "
                    f"{case.dynamics.accuracy_grade}.",
                    response_figure(responses, factors)),
            _peaks(responses),
            _modes(responses),
        ]  # fmt: skip
    if any(response["branches"] for response in responses):
        blocks.append(Picture("contact.svg", "Loss of contact, and force on the bearings.", contact_figure(responses)))
    for name, caption, figure in (
        ("waterfall.svg", _orders_sentence(solved), waterfall_figure(responses)),
        ("motion.svg", "The stable motion of the largest transmission error of each torque: left of the dashed line, "
         "or below it, the nominal flanks are separated.", motion_figure(responses)),
    ):  # fmt: skip
        if figure is not None:
            blocks.append(Picture(name, caption, figure))
    return [*blocks, *_tables(solved), _law_paragraph(case, solved.laws, responses)]


def _orders_sentence(solved: Dynamics) -> str:
    """Return what a waterfall shows, and the orders of both shafts in it."""
    cycles = cycles_of(solved.laws[0].table)
    said = "Orders of the transmission error along the run-up, each spectrum over whole periods without a window; "
    if cycles == 1:
        return said + "broken orders are motion that does not repeat with the mesh."
    return (
        f"{said}the mesh repeats after {cycles} cycles. Once to a turn of the pinion is order "
        f"1/{solved.pair.pinion.teeth} of the mesh frequency, of the wheel 1/{abs(solved.pair.wheel.teeth)}; sidebands "
        "lie so far from whole orders, or at multiples of it."
    )


def _law_paragraph(case: Case, laws: Sequence[MeshLaw], responses: Sequence[Data]) -> str:
    """Return where the mesh force comes from, how well a table stands for it, and how motion was found."""
    worst = max(laws, key=lambda law: law.error.largest * law.largest_force)
    static = max(law.static_error_um for law in laws)
    share = max(law.static_error_um / law.static_peak_to_peak_um for law in laws)
    sentences = [
        "The mesh force by phase and displacement is a table of line loads on the reduced finite elements. Between its "
        "values the table differs from the line loads by "
        f"{worst.error.largest * worst.largest_force:.2g} N at most and {worst.error.rms * worst.largest_force:.2g} N "
        f"in the mean, of {worst.largest_force:.4g} N at its end; the static transmission error under the torques by "
        f"{1e3 * static:.2g} nm, {share:.1g} of its peak-to-peak value.",
    ]
    cycles = cycles_of(laws[0].table)
    if cycles > 1:
        sentences.append(
            f"Teeth differ: the mesh repeats after {cycles} cycles. Branches are motion that repeats "
            "with the mesh, so there are none: run-up and run-down are by integration over time."
        )
    else:
        whence = "the line loads themselves, solved at each sample" if case.dynamics.law == "exact" else "the table"
        sentences.append(
            f"Branches are by harmonic balance on {whence}, their stability by Floquet multipliers, run-up and "
            "run-down by integration over time on the table."
        )
    return " ".join([*sentences, *_axes_sentence(laws, responses)])


def _axes_sentence(laws: Sequence[MeshLaw], responses: Sequence[Data]) -> list[str]:
    shares = [share for response in responses if (share := response["axes_motion_force_error_share"]) is not None]
    if not shares:
        return []
    axes = laws[-1].assembly.misalignment
    return [
        "Line loads are solved with the axes displaced by the mean mesh force (under the largest torque "
        f"{axes.centre_distance_um:+.3g} µm of centre distance, over the face width {axes.in_plane_um:+.3g} µm of "
        f"in-plane and {axes.out_of_plane_um:+.3g} µm of out-of-plane misalignment); motion about it acts through "
        "levers at the pitch point. At some instants of the largest motion, with the axes displaced as they are then, "
        f"the mesh force differs by {100.0 * max(shares):.2g} % of its mean at most."
    ]


def _tables(solved: Dynamics) -> Sequence[Table]:
    rows = [(response, fold) for response in solved.responses for fold in response["folds"]]
    folds: Columns = {
        "torque, N m": lambda row: row[0]["torque_Nm"],
        "jump when": lambda row: KINDS[row[1]["kind"]],
        "mesh frequency, Hz": lambda row: row[1]["mesh_frequency_Hz"],
        "speed, rpm": lambda row: row[1]["speed_rpm"],
        "over the natural one": lambda row: row[1]["mesh_frequency_Hz"] / row[0]["natural_frequency_Hz"],
        "DTE rms there, µm": lambda row: row[1]["dte_rms_um"],
    }
    torques: Columns = {
        "torque, N m": "torque_Nm",
        "natural frequency, Hz": "natural_frequency_Hz",
        "at a speed of, rpm": "natural_speed_rpm",
        "mean mesh stiffness, N/µm": "mesh_stiffness_mean_N_per_um",
        "STE rms, µm": "ste_rms_um",
        "largest DTE rms, µm": lambda row: _most(row, "dte_rms_um"),
        "dynamic factor": lambda row: _most(row, "dynamic_factor"),
        "contact lost, %": lambda row: _percent(_most(row, "contact_loss")),
        "largest flank separation, µm": lambda row: _most(row, "separation_um"),
    }
    note = "Largest values of stable motion within the speeds. Dynamic factor: largest over mean mesh force."
    return [
        table("Torques", torques, solved.responses, note),
        table("Jump frequencies", folds, rows),
        _ratings(solved),
    ]


def _peaks(responses: Sequence[Data]) -> Table:
    rows = [(response, peak) for response in responses for peak in response["peaks"]]
    columns: Columns = {
        "torque, N m": lambda row: row[0]["torque_Nm"],
        "speed, rpm": lambda row: row[1]["speed_rpm"],
        "mesh frequency, Hz": lambda row: row[1]["mesh_frequency_Hz"],
        "DTE rms, µm": lambda row: row[1]["dte_rms_um"],
        "peak-to-peak, µm": lambda row: row[1]["dte_peak_to_peak_um"],
        "dynamic factor": lambda row: row[1]["dynamic_factor"],
        "harmonic": lambda row: NO_SINGLE if row[1]["made_by_one"] is False else row[1]["order"],
        "its amplitude, µm": lambda row: row[1]["order_um"],
        "mode": lambda row: row[1]["mode"],
        "harmonic × mesh frequency over its natural one": lambda row: row[1]["over_natural"],
        "DTE rms without that harmonic, µm": lambda row: row[1]["dte_rms_without_um"],
        "next harmonic": lambda row: row[1]["further_order"],
        "DTE rms without that one, µm": lambda row: row[1]["dte_rms_without_further_um"],
    }
    note = (
        "Of stable motion; amplitudes zero to peak. Each harmonic of the excitation that comes near to a mode was "
        f"switched off in turn, those above the {ORDERS}th where none of the others makes the peak: that of a peak is "
        "the one without which motion is least, and the mode is the nearest to it, however little of its energy is in "
        "the mesh. Where flanks part, peaks lie below the mode."
    )
    if any(peak["made_by_one"] is False for _, peak in rows):
        note += (
            f" {NO_SINGLE}: no single harmonic makes this peak, which is as high without any of them but for "
            f"{100.0 * PROMINENCE:g} %; what is told is of the one without which it is least."
        )
    return table("Peaks of the response", columns, rows, note)


def _modes(responses: Sequence[Data]) -> Table:
    modes = [(response, number, mode) for response in responses for number, mode in enumerate(response["modes"], 1)]
    rows = modes if len(modes) > len(responses) else []  # a single one stands beside its torque
    columns: Columns = {
        "torque, N m": lambda row: row[0]["torque_Nm"],
        "mode": lambda row: row[1],
        "natural frequency, Hz": lambda row: row[2]["natural_frequency_Hz"],
        "at a speed of, rpm": lambda row: row[2]["natural_speed_rpm"],
        "strain energy in the mesh, %": lambda row: 100.0 * row[2]["mesh_strain_energy_share"],
        "moves most": lambda row: row[2]["moves_most"],
    }
    return table("Modes, with the mean mesh stiffness", columns, rows)


def _assumed_paragraph(solved: Dynamics) -> str:
    """Return which damping and bearings motion has, and what hangs on them."""
    dynamics, teeth = solved.case.dynamics, solved.pair.pinion.teeth
    given = dynamics.mesh_damping_N_s_mm
    damping = f"{100.0 * dynamics.damping_ratio:g} % of the critical one" if given is None else f"{given:g} N s/mm"
    sentences = [
        f"The mesh has a damping of {damping}, which no calculation gives. Where flanks stay in contact, peaks are "
        "inverse to it; where they part, it decides how far. Solve with half and with twice of it before you trust a "
        "peak."
    ]
    if solved.model.supports:
        sentences.append(
            f"Bearings have the stiffness of the case and a damping ratio of {dynamics.bearing_damping_ratio:g}; take "
            "the slope of their load over deflection at the working load, shaft and housing in series with them."
        )
    elif solved.responses:
        lowest = min(response["natural_frequency_Hz"] for response in solved.responses)
        sentences.append(
            f"Bearings are rigid: real ones lower the natural frequency of {lowest:.4g} Hz ({rpm(lowest, teeth):.4g} "
            "rpm) and add modes below it ([dynamics] degrees_of_freedom, pinion_bearing_stiffness_N_um)."
        )
    return " ".join(sentences)


def _ratings(solved: Dynamics) -> Table:
    case = solved.case
    rows = [row for response in solved.responses for row in by_range(case, solved.pair, solved.model.mass, response)]
    grade = case.dynamics.accuracy_grade
    columns: Columns = {
        "torque, N m": "torque_Nm",
        "range": "range",
        "resonance ratio from": "from",
        "to": "to",
        "dynamic factor": "dynamic_factor",
        f"K_v, class {grade}": "k_v",
        "K_v without deviations": "k_v_without_deviations",
    }
    note = (
        "Largest of each range: of stable motion (where it jumps, the motion when running down), and K_v of "
        "ISO 6336-1:2006, method B. K_v takes the mean mesh stiffness of this pair and its masses on rigid bearings, a "
        f"damping that is built into its formulas, and deviations within ISO 1328-1:2013, class {grade} ([dynamics] "
        "accuracy_grade), not run in. Motion is that of the flanks of the case: compare it with K_v without "
        "deviations."
    )
    return table("Dynamic factor beside K_v", columns, rows, note)


def _most(response: Data, key: str) -> float | None:
    """Largest value of stable motion; of the runs, where there are no branches."""
    values = [point[key] for branch in response["branches"] for point in branch if point["stable"]]
    if not response["branches"]:
        values = [point[key] for run in RUNS for point in response[run] or ()]
    return max(values, default=None)


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def _backs(solved: Dynamics) -> str:
    if solved.backlash is not None:
        whence = "of the nominal pair" if solved.case.dynamics.backlash_um is None else "of the case"
        struck = [f"{response['torque_Nm']:g}" for response in solved.responses if _strikes(response)]
        seen = f"Stable motion touches them under {', '.join(struck)} N m." if struck else "No stable motion does."
        return f"The coast flanks touch {1e3 * solved.backlash:.4g} µm beyond, the backlash {whence}. {seen}"
    why = "the nominal pair has no backlash"
    if not backs_mirror_flanks(solved.case):
        why = "they are no mirror images of the drive flanks"
    return (
        f"Contact of the back flanks is neglected: {why}. They would touch where flanks separate by more than the "
        "backlash ([dynamics] backlash_um)."
    )


def _strikes(response: Data) -> bool:
    """Whether the coast flanks push in any stable motion."""
    points = (point for branch in response["branches"] for point in branch if point["stable"])
    return any(point["smallest_force_N"] < 0.0 for point in points)
