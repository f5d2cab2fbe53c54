"""Tables of a gearbox or a set in motion, by the content of `dynamics.json`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from pmor.dynamics.peaks import NO_SINGLE
from pmor.dynamics.whine.readings import Data, main_load, shown_modes
from pmor.report.parameter_words import parameter_words
from pmor.report.table import Columns, Table, table

# Of a force: shares of modes that are shown.
SHOWN = 0.05


def meshes_table(data: Data) -> Table:
    """Return the forces of the meshes under each load, with what each mesh is."""
    rows = [(load, mesh) for load in data["loads"] for mesh in load["meshes"]]
    columns: Columns = {
        "load": lambda row: row[0]["load"], "mesh": lambda row: row[1]["name"],
        "mean force, N": lambda row: row[1]["mean_force_N"],
        "largest dynamic force, rms, N": lambda row: row[1]["force_rms_max_N"],
        "with constant stiffness, N": lambda row: row[1]["constant_stiffness_rms_max_N"],
        "dynamic factor": lambda row: row[1]["dynamic_factor"],
        "mean stiffness between hubs, N/µm": lambda row: row[1]["mean_tangent_N_per_um"],
    }  # fmt: skip
    note = "Dynamic factor: 1 and the sum of all lines over the mean force, at most."
    for _, mesh in rows:
        words = f" The mesh {mesh['name']} repeats after {mesh.get('repeats_after_pitches')} pitches"
        if mesh.get("repeats_after_pitches", 1) > 1 and words not in note:
            note += (
                f"{words}: orders of its shafts are among its lines. What a micrometre of its modifications does is "
                "not found, as that asks for its law over all pitches."
            )
        if mesh.get("why_constant") and mesh["why_constant"] not in note:
            note += f" {mesh['name']}: with its mean stiffness, as {mesh['why_constant']}."
    for names in dict.fromkeys(tuple(names) for load in data["loads"] for names in load["in_step"]):
        note += (
            f" {' and '.join(names)} keep step: their lines add up with their phases, as tooth numbers and centres "
            "have it; of gears on one shaft a tooth each stands in line."
        )
    return table("Meshes", columns, rows, note)


def bearings_table(data: Data) -> Table:
    """Return the largest forces of the bearings under each load."""
    rows = [(load, bearing) for load in data["loads"] for bearing in load["bearings"]]
    columns: Columns = {
        "load": lambda row: row[0]["load"], "bearing": lambda row: row[1]["name"],
        "largest dynamic force, rms, N": lambda row: row[1]["force_rms_max_N"],
        "at, rpm": lambda row: row[1]["at_rpm"],
        "with constant stiffness, N": lambda row: row[1]["constant_stiffness_rms_max_N"],
    }  # fmt: skip
    note = "With constant stiffness: each mesh by its mean stiffness, as is usual; the largest over the speed likewise."
    return replace(table("Bearings", columns, rows, note), folded=len(data["loads"]) > 1)


def peaks_table(data: Data, loads: Sequence[str], folded: bool = False) -> Table:
    """Return the peaks of the bearing forces under some loads, with their lines and modes."""
    rows = [(load, peak) for load in data["loads"] if load["load"] in loads for peak in load["peaks"]]
    told = {"load": lambda row: row[0]["load"]} if len(loads) > 1 else {}
    columns: Columns = {
        **told, "bearing": lambda row: row[1]["bearing"],
        "speed, rpm": lambda row: row[1]["speed_rpm"],
        "force, rms, N": lambda row: row[1]["force_rms_N"],
        "by": lambda row: row[1]["line"] if row[1]["made_by_one"] else f"{NO_SINGLE}, most by {row[1]['line']}",
        "at, Hz": lambda row: row[1]["frequency_Hz"],
        "without this line, N": lambda row: row[1]["without_line_rms_N"],
        "mode": lambda row: row[1]["mode"],
        "shares of modes, %": lambda row: ", ".join(
            f"{one['mode']}: {100.0 * one['share']:.0f}" for one in row[1]["mode_shares"] if abs(one["share"]) > SHOWN
        ),
        "which it meets at, rpm": lambda row: row[1]["resonance_rpm"],
        "with constant stiffness, N": lambda row: row[1]["constant_stiffness_rms_N"],
    }  # fmt: skip
    note = (
        "The mode is the one that gives most of the line's force on the bearing. Shares are in the direction and phase "
        "of that force: of all modes and their static rest they add up to 100; opposite ones are negative."
    )
    if not all(peak["made_by_one"] for _, peak in rows):
        note += f" {NO_SINGLE}: no single line makes this peak, which is about as high without any of them."
    words = "Peaks of the bearing forces under " + ("the other loads" if folded else ", ".join(loads))
    return replace(table(words, columns, rows, note), folded=folded)


def housing_table(data: Data) -> Table:
    """Return the largest accelerations of the seats, and the radiated power, under each load."""
    rows = [(load, row) for load in data["loads"] for row in load["housing"]]
    columns: Columns = {
        "load": lambda row: row[0]["load"], "seat of": lambda row: row[1]["seat"],
        "largest acceleration, rms, m/s²": lambda row: row[1]["acceleration_rms_max_m_s2"],
        "at, rpm": lambda row: row[1]["at_rpm"],
        "largest radiated power, dB re 1e-12 W": lambda row: row[1]["radiated_power_max_dB"],
    }  # fmt: skip
    note = "Equivalent radiated power of the whole housing, radiation efficiency 1: that of its surface matrix."
    return table("The housing", columns, rows, note)


def micrometres_table(data: Data) -> Table:
    """Return what a micrometre of each modification does under the load with the largest bearing force."""
    load = main_load(data)
    heads = {"mesh": "its own dynamic force, N"} | {key: f"force of {key}, N" for key in load["micrometre_bearings"]}

    def force(key: str) -> Callable[[Data], float]:
        return lambda row: float(row["force_N"][key])

    columns: Columns = {
        "mesh": "mesh", "modification": lambda row: parameter_words(row["parameter"]).removesuffix(" [µm]"),
        **{words: force(key) for key, words in heads.items()},
        "STE, rms, µm": "transmission_error_um",
    }  # fmt: skip
    speeds = ", ".join(f"{name} at {speed:.4g} rpm" for name, speed in load["micrometre_targets"].items())
    planets = ", of a set on all planets" if load["modes"][0]["families"] else ""
    note = (
        f"By a micrometre more{planets}, under {load['load']}: to the forces that the mesh's own lines "
        f"cause where they are largest ({speeds}). What lowers the transmission error can raise a force."
    )
    return table("What a micrometre of each modification does", columns, load["micrometres"], note)


def _family(name: str) -> Callable[[Data], str]:
    return lambda row: str(row["families"][name]["family"])


def modes_table(data: Data, names: Sequence[str]) -> Table:
    """Return the modes up to the highest frequency; meshes by their names."""
    load, rows = main_load(data), shown_modes(data)

    def strain(number: int) -> Callable[[Data], float]:
        return lambda row: 100.0 * float(row["mesh_strain_energy_share"][number])

    def kinetic(name: str) -> Callable[[Data], float]:
        return lambda row: 100.0 * float(row["kinetic_energy_share"][name])

    columns: Columns = {
        "mode": "mode", "natural frequency, Hz": "natural_frequency_Hz", "motion": "kind",
        "moves most": "moves_most",
        **{f"strain energy in {name}, %": strain(number) for number, name in enumerate(names)},
        **{f"kinetic energy of {name}, %": kinetic(name) for name in load["modes"][0]["kinetic_energy_share"]},
        **{f"family in {name}": _family(name) for name in load["modes"][0]["families"]},
    }  # fmt: skip
    note = f"Under {load['load']}, meshes with their mean stiffness, shafts at rest."
    return table("Natural modes", columns, rows, note)
