"""Files of a gearbox, its page, and its summary on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from itertools import chain

import numpy as np

from pmor.gear.classical.iso6336 import SLICE_STIFFNESS
from pmor.machine.bounds import named_bounds
from pmor.machine.coupled import SolvedLoad
from pmor.machine.figures import deflection_figure, face_load_figure, set_ste_figure, ste_figure, turn_figure
from pmor.machine.fit import Fit
from pmor.machine.left_out import left_out
from pmor.machine.loader import GearboxFile
from pmor.machine.readings import Data, duty_entry, load_data
from pmor.machine.turn_tables import turn_tables
from pmor.machine.view import machine_figure
from pmor.pair.losses import duty_data
from pmor.report.bearing_figure import element_pictures
from pmor.report.data_sheet import data_sheets
from pmor.report.machine_tables import LOSS_COLUMNS, LOSSES, of_gear, rolling_tables, spectrum_tables, tolerance_table
from pmor.report.page import THEMES, Block, Picture, Warning, by_theme, themed
from pmor.report.table import Column, Columns, Table, heads, screen_text, table, told_tables
from pmor.report.verdict import verdict_blocks
from pmor.results.load_distribution import PRESSURE
from pmor.results.root_stress import GEARS
from pmor.sets.figures import set_figure, share_figure
from pmor.sets.output import tables_of_sets
from pmor.sets.preview import pairs_of
from pmor.work.results import Report

#: files of a result beside the bases of its meshes
FILES = (
    "gearbox.json", "gearbox.md", "report.html", "machine.png", "deflection.svg", "ste.svg", "face_load.svg",
    "bearings.svg", "machine.vtkhdf", "gearbox.rexs", "ste.csv", "meshes.csv", "bearings.csv", "results.h5",
)  # fmt: skip

#: of all sets together; further ones of each set, after its name
TURN_ORDERS = "turn_orders.csv"
SET_FILES = ("gears.svg", "shares.svg", "ste.svg", "turn.svg", "gears.vtkhdf")
OF_MESH: Columns = {"load": "load", "mesh": "name"}
MISALIGNMENT_COLUMNS: Columns = {
    **OF_MESH, "pinion torque [N m]": "torque_Nm",
    **heads("f_beta_um", "in_plane_um", "out_of_plane_um", "centre_distance_um"),
}  # fmt: skip
PARTS = ("ste_mean_um", "ste_of_teeth_um", "ste_of_shafts_um", "ste_of_bearings_um", "ste_peak_to_peak_um")
MESH_COLUMNS: Columns = {
    **OF_MESH, **heads(*PARTS), "STE p-p, rigid [µm]": "rigid_ste_peak_to_peak_um", **heads("k_h_beta"),
    "K_Hβ, rigid": "rigid_k_h_beta", **heads("sliced_k_h_beta", "flank_pressure_max_MPa", "effective_contact_ratio"),
}  # fmt: skip
ISO_COLUMNS: Columns = {
    **OF_MESH, "amount of F_β [µm]": lambda row: abs(row["f_beta_um"]),
    **heads("iso_f_beta_um", "iso_f_sh_um", "k_h_beta", "iso_k_h_beta"),
}  # fmt: skip
SET_COLUMNS: Columns = {
    "load": "load", "set": "name", "torque on the sun [N m]": lambda row: row["torques_Nm"]["sun"], **heads(*PARTS),
    "STE p-p, rigid [µm]": "rigid_ste_peak_to_peak_um", **heads("k_gamma"), "K_γ, rigid": "rigid_k_gamma",
    **heads("losses_W"),
}  # fmt: skip
OF_SET: Columns = {"load": "load", "set": "set"}
POWER_COLUMNS: Columns = {"load": "name", **heads("power_W", "losses_W", "efficiency")}
DUTY_COLUMNS: Columns = {**POWER_COLUMNS, **heads("fraction", "hours")}


STRESS_COLUMNS: Columns = {**OF_MESH} | {
    f"{name}{rigid and ', rigid'} [MPa]": of_gear(f"{rigid}root_stress_max_MPa", gear)
    for gear, name in enumerate(GEARS) for rigid in ("", "rigid_")
}  # fmt: skip


def _component(key: str, place: int) -> Column:
    return lambda row: row[key][place]


BEARING_COLUMNS: Columns = {
    "load": "load", "bearing": "name", **heads("radial_force_N"), "axial [N]": _component("force_N", 0),
    **{f"along {axis} [µm]": _component("displacement_um", place) for place, axis in ((1, "y"), (2, "z"), (0, "x"))},
    "tilt about y [mrad]": _component("tilt_mrad", 0), "about z [mrad]": _component("tilt_mrad", 1),
}  # fmt: skip
MISALIGNMENT = (
    "F_β: face width times the difference of the slopes of both hubs along the transverse line of action; positive "
    "where flanks overlap more at the larger x. Rigid: the same pair on rigid supports. Displacements of the wheel's "
    "axis against the pinion's, over the face width, in axes of the pair."
)

FIT_COLUMNS: Columns = {
    "mesh": "mesh",
    "loads": lambda row: ", ".join(row["loads"]),
    "helix slope [µm]": "helix_slope_um",
    "helix crowning [µm]": "helix_crowning_um",
    "K_Hβ before": "before",
    "K_Hβ after": "after",
}
FIT = (
    "Of the pinion, beside the modifications of its case: the amounts that lower the largest K_Hβ of these loads "
    "most; the gearbox is solved anew with them. Tolerances ask for more crowning."
)
ISO = (
    "ISO 6336-1:2006, method C: f_sh of the smaller gear's shaft on rigid bearings, F_βx = 1.33 f_sh without "
    "deviations (f_ma = 0), K_Hβ after running-in of 0.15 F_βx. Crude, and without a sign: beside it stands the amount "
    "of F_β, whose sign the table of misalignment has."
)
SET_MODEL = (
    "A planetary set is solved with all its meshes at once, seen from its carrier, on the compliance of shafts, "
    "bearings and housing below the hubs of sun, carrier and ring; planets move with the carrier's hub as with a rigid "
    "body. Where the carrier turns, the mean of that compliance around the axis counts. What other loads do to hubs "
    "stands still in the housing and turns against the carrier: mesh cycles are solved until it stands as before. "
    "Shafts feel the mean forces of the set over a turn."
)
STRESS = "Largest principal stress along both fillets over the mesh cycle. Rigid: the same pair on rigid supports."
BEARINGS = "Of the shaft against what it stands in."
SETS = (
    "By how much the sun runs ahead along its line of action, the rotations of shafts left out. Its mean by "
    "its parts: bearings with what they stand in, shafts that bend between them, and teeth with pins and wind-up. "
    "Rigid: the same set with the hubs of sun, carrier and ring held."
)
MESHES = (
    "STE mean by its parts: bearings with what they stand in, shafts that bend between them (their twist left "
    "out), and what is left, of teeth. Rigid: the same pair on rigid supports. Slices: "
    f"independent ones of {SLICE_STIFFNESS:g} N/(mm µm), as other programs have them, under the same tilt and flanks; "
    f"kinks and ends load teeth more than that. Pressure: {PRESSURE}."
)
POWER = "What enters, and what the meshes lose."
DUTY = "All: means by time, the efficiency that of the work."


def gearbox_data(
    file: GearboxFile, loads: Sequence[SolvedLoad], failures: Sequence[str], fits: Sequence[Fit] = ()
) -> Data:
    """Return the content of `gearbox.json`, without a verdict."""
    entries = [load_data(file.model, file.cases, solved) for solved in loads]
    bounds = [text for pair in zip(loads, entries, strict=True) for text in named_bounds(file.cases, *pair)]
    rounded = [f"set {name}: {text}" for name, one in file.model.sets.items() for text in one.rounded]
    return {
        "title": file.model.sections.title,
        "verdict": None,
        "loads": entries,
        "duty": duty_data(file.model.sections.loads, [duty_entry(*pair) for pair in zip(loads, entries, strict=True)]),
        "fits": [asdict(fit) for fit in fits],
        "failures": list(failures),
        "bounds": [*bounds, *file.slips, *rounded],
        "left_out": [f"{what}: {why}" for what, why in left_out(file)],
        "assumptions": list(file.notes),
    }


def gearbox_report(file: GearboxFile, loads: Sequence[SolvedLoad], data: Data) -> Report:
    """Return numbers and page."""
    blocks: list[Block] = [*verdict_blocks(data), *map(Warning, (*data["failures"], *data["bounds"]))]
    if loads:
        cases, pairs = dict(file.cases), dict(file.model.pairs)
        for name, one in file.model.sets.items():
            cases |= {f"{name}, {mesh}": case for mesh, case in one.cases.items()}
            pairs |= {f"{name}, {mesh}": pair for mesh, pair in pairs_of(one).items()}
        of_sets = [_set_pictures(loads, number) for number in range(len(loads[0].sets))]
        blocks += [
            Picture("machine.png", "The machine under the first load, deflections exaggerated: axes at rest "
                    "(dash-dotted) and deflected. Bearings are grey, their size made up where it is not given.",
                    machine_figure(file.model, loads[0])),
            Picture("deflection.svg", "Shafts at rest, gears in outline, and their deflection lines under the first "
                    "load; bearings are triangles.", deflection_figure(file.model, loads[0])),
            *(_mesh_pictures(loads) if loads[0].meshes else ()), _first_table(data),
            *themed({"Gear data": data_sheets(cases, pairs)}, *of_sets,
                    element_pictures(data["loads"][0], f"under {loads[0].load.name}"), _tables(data)),
        ]  # fmt: skip
    housing = "the housing is rigid" if file.model.housing is None else "the housing is the stiffness of its seats"
    blocks += [
        f"Shafts are Timoshenko beams without the stiffness of gear bodies; {housing}. Gears are rigid at "
        "their bores; each mesh is solved by exact line loads on the compliance of its hubs, swept under the mean "
        "forces of all other meshes. Rolling bearings: ISO/TS 16281, without centrifugal loads."
    ]
    blocks += [SET_MODEL] * bool(file.model.sets)
    blocks += told_tables(data)
    return Report("gearbox", data, f"Gearbox: {file.model.sections.title}", blocks)


def _mesh_pictures(loads: Sequence[SolvedLoad]) -> list[Picture]:
    face = "Line load over the face, added up over tooth pairs; dotted: on rigid supports."
    ste = "Static transmission error over all pitches about its mean; dotted: on rigid supports."
    return [
        Picture("ste.svg", ste, ste_figure(loads)),
        Picture("face_load.svg", face, face_load_figure(loads)),
    ]


def set_files(file: GearboxFile) -> tuple[str, ...]:
    """Return the names of the files of all sets."""
    own = tuple(f"set_{name}_{what}" for name in file.model.sets for what in SET_FILES)
    return (*own, TURN_ORDERS) if own else ()


def _set_pictures(loads: Sequence[SolvedLoad], number: int) -> dict[str, list[Picture]]:
    first, one = loads[0], loads[0].sets[number]
    name, solution = one.meshing.settings.name, one.solution
    of, names = f"of set {name} under {first.load.name}", [f"set_{name}_{what}" for what in SET_FILES]
    found = list[Picture]()
    if solution.converged[0].any():
        angle = int(np.flatnonzero(solution.converged[0])[0])
        words = f"All gears {of}, and the forces of their tooth pairs."
        found.append(Picture(names[0], words, set_figure(solution, 0, angle)))
    words = f"Share of each planet {of} over all mesh cycles, and the orbit of the sun by its meshes alone."
    found.append(Picture(names[1], words, share_figure(solution, 0)))
    words = (
        f"Static transmission error of set {name}: mean of all mesh cycles, within their limits, and its orders; "
        "dotted: on rigid supports."
    )
    if one.turn is not None:
        turn = (
            f"Planets {of} over a turn of the carrier: what each takes of the mean, and forces across the rows of its "
            "bearings and misalignment of its meshes (the first one's solid, further ones' dashed)."
        )
        found.append(Picture(names[3], turn, turn_figure(one)))
    ste = Picture(names[2], words, set_ste_figure(loads, number))
    return {"Stiffness and load sharing": found, "Transmission error": [ste]}


def gearbox_text(data: Data) -> str:
    """Return the tables for the screen."""
    tables = [_first_table(data), *chain(*by_theme(_tables(data)).values())] if data["loads"] else []
    return screen_text(f"Gearbox: {data['title']}", tables, data, (*data["failures"], *data["bounds"]))


def _power_table(data: Data) -> Table:
    duty, rows = data["duty"], data["loads"]
    if duty is None:
        return table("Power", POWER_COLUMNS, rows, POWER)
    time = {row["load"]: row for row in duty["spectrum"]}
    timed = [{**row, **{key: time[row["name"]][key] for key in ("fraction", "hours")}} for row in rows]
    return table("Power", DUTY_COLUMNS, [*timed, {"name": "all", "fraction": 1.0, **duty}], f"{POWER} {DUTY}")


def _rows(data: Data, key: str) -> list[Data]:
    return [{"load": load["name"], **entry} for load in data["loads"] for entry in load[key]]


def _first_table(data: Data) -> Table:
    if meshes := _rows(data, "meshes"):
        return table("Misalignment of the meshes", MISALIGNMENT_COLUMNS, meshes, MISALIGNMENT)
    return table("Planetary sets", SET_COLUMNS, _rows(data, "sets"), SETS)


def _tables(data: Data) -> dict[str, list[Table]]:
    """Tables but the first one, by theme."""
    meshes, sets = _rows(data, "meshes"), [{**one, "set": one["name"]} for one in _rows(data, "sets")]
    found = {theme: list[Table]() for theme in THEMES}

    def add(theme: str, title: str, columns: Columns, rows: list[Data], words: str) -> None:
        if rows:
            found[theme].append(table(title, columns, rows, words))

    add("Transmission error", "Transmission error and load", MESH_COLUMNS, meshes, MESHES)
    add("Transmission error", "Planetary sets", SET_COLUMNS, sets if meshes else [], SETS)
    for theme, tables in turn_tables(sets).items():
        found[theme] += tables
    add("Root stress", "Root stress", STRESS_COLUMNS, [mesh for mesh in meshes if mesh["root_stress_max_MPa"]], STRESS)
    crude = [mesh for mesh in meshes if mesh["iso_f_sh_um"] is not None]
    add("Flanks", "Beside ISO 6336-1:2006", ISO_COLUMNS, crude, ISO)
    add("Flanks", "The flank that fits", FIT_COLUMNS, data["fits"], FIT)
    of_sets = [{**mesh, "load": one["load"], "name": f"{one['set']}: {mesh['name']}"} for one in sets
               for mesh in one["meshes"]]  # fmt: skip
    losses = "Losses and duty cycle"
    if any(mesh["losses_W"] is not None for mesh in (*meshes, *of_sets)):
        add(losses, "Losses of the meshes", {**OF_MESH, **LOSS_COLUMNS}, [*meshes, *of_sets], LOSSES)
        found[losses].append(_power_table(data))
    found[losses] += spectrum_tables(data["duty"]) if data["duty"] else []
    drawn = {f"{one['load']}, {one['name']}": one["tolerances"] for one in (*meshes, *sets) if one["tolerances"]}
    found["Tolerances"] += [tolerance_table(drawn, "pairs or sets")] if drawn else []
    bearings = _rows(data, "bearings")
    found["Shafts and bearings"] += rolling_tables({load["name"]: load for load in data["loads"]}, data["duty"])
    add("Shafts and bearings", "Bearings", BEARING_COLUMNS, bearings, BEARINGS)
    return by_theme(tables_of_sets(sets, OF_SET, " of planetary sets") if sets else {}, found)
