"""Files of a set, its page, and its summary on the screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.pair.samples import Samples
from pmor.report.bearing_figure import element_pictures
from pmor.report.data_sheet import data_sheets
from pmor.report.machine_tables import LOSS_COLUMNS, LOSSES, rolling_tables, spectrum_tables, tolerance_table
from pmor.report.page import THEMES, Block, Picture, Warning, by_theme, themed
from pmor.report.table import Columns, Table, heads, screen_text, table, told_tables
from pmor.report.torque_figures import tolerance_figure
from pmor.report.verdict import verdict_blocks
from pmor.results.load_distribution import PRESSURE
from pmor.sets.figures import (
    face_load_figure,
    path_figure,
    pin_figure,
    ring_figure,
    root_stress_figure,
    set_figure,
    share_figure,
    ste_figure,
)
from pmor.sets.loader import SetFile
from pmor.sets.preview import pairs_of
from pmor.sets.readings import Data
from pmor.sets.solution import SetSolution
from pmor.work.results import Report

if TYPE_CHECKING:
    from pmor.report.chart import Chart

#: files of a result
FILES = (
    "set.json", "set.md", "report.html", "set.svg", "ste.svg", "shares.svg", "face_load.svg", "root_stress.svg",
    "ring.svg", "ste.csv", "torques.csv", "meshes.csv", "results.h5", "set.vtkhdf",
)  # fmt: skip
#: further ones with tolerances
SAMPLE_FILES = ("tolerances.csv", "tolerances.svg")
#: with pins
PIN_FILES = ("pins.svg",)
#: with planets on bearings by inner geometry
BEARING_FILES = ("bearings.svg", "bearings.csv")
#: where REXS has words for the set
REXS_FILES = ("set.rexs",)

TORQUE_COLUMNS: Columns = heads("torque_Nm", "ste_mean_um", "ste_peak_to_peak_um", "k_gamma", "losses_W")
PLANET_COLUMNS: Columns = {"planet": "name", **heads("share_mean", "share_max", "pin_force_mean_N", "pin_force_max_N")}
PIN_COLUMNS: Columns = {
    "planet": "name",
    **heads("outwards_um", "around_um", "outwards_tilt_mrad", "around_tilt_mrad"),
    "force on bearings [N]": lambda row: _forces(row["bearings"]),
}
MESH_COLUMNS: Columns = {"mesh": "name", **heads(
    "contact_ratio", "phase_pitches", "share_mean", "force_mean_N", "force_peak_to_peak_N", "line_load_max_N_per_mm",
    "k_h_beta", "flank_pressure_max_MPa",
)}  # fmt: skip
#: at each torque
LOAD_COLUMNS: Columns = {**heads("torque_Nm"), "mesh": "name", **heads(
    "k_h_beta", "flank_pressure_max_MPa", "line_load_max_N_per_mm", "carrying_face_percent", "effective_contact_ratio",
)}  # fmt: skip
STRESS_COLUMNS: Columns = {
    "gear": "name",
    **heads("max_principal_MPa"),
    "on the side of the": "loaded_by",
    **heads("range_MPa"),
    "from, to [MPa]": lambda row: _limits(row, "range"),
    **heads("range_other_side_MPa"),
    "from, to there [MPa]": lambda row: _limits(row, "range_other_side"),
}


ORDER_COLUMNS: Columns = {
    **heads("mesh_order", "amplitude_um"),
    "times a turn, or a mesh cycle": lambda row: _times(row),
}
STE = (
    "By how much the first gear runs ahead along its line of action, held members at rest. K_γ: the largest mean load "
    "of a planet in a mesh cycle over the mean of all."
)
PLANETS = "Of the torque that the pins carry, mean and largest over the mesh cycle, at the nominal torque."
PINS = (
    "Displacement of each planet and slope of its axis along z, outwards and in the sense in which the torque turns "
    "the sun, means over the mesh cycle at the nominal torque; of each bearing from -z to +z."
)
MESHES = (
    "At the nominal torque. Phase: where in its mesh cycle each mesh is at angle 0. Share: in the torque of all meshes "
    "that one gear drives, or that drive it. K_Hβ: over the mesh cycle. Pressure: "
    f"{PRESSURE}."
)
STRESS = (
    "At the nominal torque, of all teeth over the mesh cycle, with the loads of both flanks added up. Range: of the "
    "stress across the root of one tooth over a turn of the gear, on the same side and on the other one, each at the "
    "point where it is largest, and the limits between which it changes there. Side: of the flank that this mate "
    "loads; –: no mate."
)
SHAFT_ORDERS = (
    "Of the transmission error between the orders of the first mesh, at the nominal torque; turns of the members "
    "against the carrier, and cycles of the other meshes, or sums and differences of two."
)
MODEL = (
    "All meshes are solved at once: exact line loads on the finite-element compliance of every member, which couples "
    "the flanks of one body; one rotation for each gear that is free to turn. A planetary set is seen from its carrier."
)


def set_report(file: SetFile, solved: SetSolution, samples: Samples | None, data: Data) -> Report:
    """Return numbers and page."""
    first, nominal = list[Block](), nominal_torque(file, solved)
    if solved.converged[nominal].any():
        angle = int(np.flatnonzero(solved.converged[nominal])[0])
        first.append(Picture("set.svg", "All gears as the calculation places them.",
                             set_figure(solved, nominal, angle)))  # fmt: skip
    shown = np.array([row["torque_Nm"] for row in data["torques"]])
    first.append(Picture("ste.svg", "Static transmission error over all mesh cycles, and its orders.",
                         ste_figure(solved, shown)))  # fmt: skip
    face = "Line load over the face, added up over tooth pairs, at the nominal torque."
    first.append(Picture("face_load.svg", face, face_load_figure(solved, nominal)))
    turned = ["The first gear is loaded clockwise: angles and tooth numbers count clockwise."] * solved.plan.clockwise
    sheets = {"Gear data": data_sheets(file.cases, pairs_of(file))}
    blocks = [
        *verdict_blocks(data), *map(Warning, _warnings(file, solved, data)), *first, _ste_table(data),
        *themed(sheets, _pictures(file, solved, samples, shown), element_pictures(data, "at the nominal torque"),
                _tables(data)), MODEL, *turned, *told_tables(data),
    ]  # fmt: skip
    return Report("set", data, f"Set: {file.sections.title}", blocks)


def _pictures(
    file: SetFile, solved: SetSolution, samples: Samples | None, torques_Nm: FloatArray
) -> dict[str, list[Block]]:
    """Pictures but those of the beginning, by theme."""
    nominal, found = nominal_torque(file, solved), {theme: list[Block]() for theme in THEMES}

    def draw(theme: str, name: str, caption: str, figure: Chart) -> None:
        found[theme].append(Picture(name, caption, figure))

    sharing, supports = "Stiffness and load sharing", "Shafts and bearings"
    if solved.plan.planets:
        words = "Share of each planet, and the orbit of the sun, at the nominal torque."
        draw(sharing, "shares.svg", words, share_figure(solved, nominal))
    elif any(len(meshes) > 1 for meshes in solved.beside):
        words = "Share of each path in the torque, at the nominal one."
        draw(sharing, "shares.svg", words, path_figure(solved, nominal))
    if file.sections.pins is not None:
        words = (
            "Pins, and the axes of the planets on them (dashed), against where they stand without load, means over the "
            "mesh cycle at the nominal torque; dots: bearings."
        )
        draw(supports, "pins.svg", words, pin_figure(file.sections.pins, solved, nominal))
    if samples is not None:
        words = "Sets within tolerances, each solved; dashed: 95 % stay below."
        draw("Tolerances", "tolerances.svg", words, tolerance_figure(samples, torques_Nm))
    if solved.root_stress:
        words = (
            "Stress across the root of a tooth of each member, on the side of its largest principal stress, where the "
            "range is largest, at the nominal torque."
        )
        draw("Root stress", "root_stress.svg", words, root_stress_figure(solved, nominal))
    if solved.ring_deflection is not None and not solved.converged[nominal, 0]:
        found[supports].append("ring.svg is left out: angle 0 did not converge.")
    elif solved.ring_deflection is not None:
        words = (
            "Displacement of the ring's root between its teeth at angle 0, mean over the width, beyond that of its "
            "hub, at the nominal torque; lines: planets."
        )
        draw(supports, "ring.svg", words, ring_figure(solved, nominal))
    return found


def set_text(file: SetFile, solved: SetSolution, data: Data) -> str:
    """Return the tables for the screen."""
    tables = [_ste_table(data), *chain(*by_theme(_tables(data)).values())]
    return screen_text(f"Set: {file.sections.title}", tables, data, _warnings(file, solved, data))


def nominal_torque(file: SetFile, solved: SetSolution) -> int:
    """Return the number of the nominal torque among those that were solved."""
    return int(np.argmin(np.abs(solved.torque_Nm - file.plan.torque_Nm)))


def _ste_table(data: Data) -> Table:
    return table("Transmission error", TORQUE_COLUMNS, data["torques"], STE)


def _tables(data: Data) -> dict[str, list[Table]]:
    """Tables but the first one, by theme."""
    found = tables_of_sets([data], {})
    if data["tolerances"]:
        found["Tolerances"] = [tolerance_table({"": data["tolerances"]}, "sets")]
    if data["shaft_orders"]:
        found["Transmission error"] = [table("Orders of shafts", ORDER_COLUMNS, data["shaft_orders"], SHAFT_ORDERS)]
    of_torques = [{**mesh, "torque_Nm": row["torque_Nm"]} for row in data["torques"] for mesh in row["meshes"]]
    if len(data["torques"]) > 1:
        found["Flanks"] = [table("Meshes at each torque", LOAD_COLUMNS, of_torques, f"Pressure: {PRESSURE}.")]
    rolling = rolling_tables(by_torques(data), data["duty"])
    found.setdefault("Shafts and bearings", []).extend(rolling)
    columns = {**heads("torque_Nm"), "mesh": "name", **LOSS_COLUMNS}
    found["Losses and duty cycle"] = [
        *([table("Losses of the meshes", columns, of_torques, LOSSES)] if data["losses_W"] is not None else []),
        *(spectrum_tables(data["duty"]) if data["duty"] else []),
    ]
    return found


def by_torques(data: Data) -> dict[str, Data]:
    """Return the figures of a set by its torques, as tables of bearings name loads."""
    return {f"{row['torque_Nm']:.6g} N m": row for row in data["torques"]}


def tables_of_sets(sets: Sequence[Data], of: Columns, what: str = "") -> dict[str, list[Table]]:
    """Return the tables of planets, meshes and root stress of sets, by theme.

    Parameters
    ----------
    sets : sequence of mapping
        Data of a set under a load.
    of : mapping
        Columns that tell them apart.
    what : str
        What the titles say of meshes and root stress.
    """

    def rows(key: str) -> list[Data]:
        return [{**one, **entry} for one in sets for entry in one[key]]

    planets, meshes, stress = rows("planets"), rows("meshes"), rows("root_stress")
    rigid = {"K_Hβ, rigid": "rigid_k_h_beta"} if meshes and "rigid_k_h_beta" in meshes[0] else {}
    words = f"{MESHES} Rigid: with the hubs of sun, carrier and ring held." if rigid else MESHES
    found = {"Stiffness and load sharing": [table(f"Meshes{what}", {**of, **MESH_COLUMNS, **rigid}, meshes, words)]}
    if planets:
        found["Stiffness and load sharing"].insert(0, table("Planets", {**of, **PLANET_COLUMNS}, planets, PLANETS))
    if any(planet["bearings"] for planet in planets):
        found["Shafts and bearings"] = [table("Planets on their pins", {**of, **PIN_COLUMNS}, planets, _wound(sets))]
    if stress:
        found["Root stress"] = [table(f"Root stress{what}", {**of, **STRESS_COLUMNS}, stress, STRESS)]
    return found


def _warnings(file: SetFile, solved: SetSolution, data: Data) -> list[str]:
    changed = (f"Changed, as these gears would not run as filed: {sentence}" for sentence in file.changed)
    said = [*data["failures"], *data["bounds"], *changed]
    if not solved.repeats:
        said.append(
            f"{solved.pitches} pitches of the first gear are solved, and the set repeats after "
            f"{solved.plan.cycle}: there are no orders, and means and ranges are those of what is solved."
        )
    return said


def _wound(sets: Sequence[Data]) -> str:
    """What the table of pins tells, and the wind-up of the carrier of a single set that has one."""
    wound = [one["carrier_windup_mrad"] for one in sets]
    if len(wound) != 1 or wound[0] is None:
        return PINS
    return f"{PINS} Cheeks of the carrier turn against each other by {wound[0]:.4g} mrad."


def _forces(bearings: Sequence[Data]) -> str | None:
    ordered = sorted(bearings, key=lambda bearing: float(bearing["at_mm"]))
    forces = [bearing["force_mean_N"] for bearing in ordered]
    return None if None in forces else " / ".join(f"{force:.4g}" for force in forces)


def _times(order: Data) -> str:
    """Meshes of which an order is a whole one, else two of which it is a sum, else members."""
    of_meshes = _whole(order["per_cycle"], "mesh ")
    combined = " ".join(f"{times:+d} of the mesh {mesh}" for mesh, times in order["combined"].items())
    return of_meshes or combined or _whole(order["per_turn"], "") or "of all together"


def _whole(named: Mapping[str, float], kind: str) -> str:
    whole = {name: round(times) for name, times in named.items() if abs(times % 1.0 - 0.5) > 0.4999}
    return ", ".join(f"{times} of the {kind}{name}" for name, times in whole.items())


def _limits(row: Data, name: str) -> str | None:
    """Limits of a range."""
    ends = [row[f"{name}_{end}_MPa"] for end in ("least", "most")]
    return None if None in ends else ", ".join(f"{end:.4g}" for end in ends)
