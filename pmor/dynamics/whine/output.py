"""Files of a gearbox or a set in motion, its page, and its summary on the screen."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.dynamics.whine.figures import (
    bearings_figure,
    campbell_figure,
    compliance_figure,
    meshes_figure,
    orders_figure,
    waterfall_figure,
)
from pmor.dynamics.whine.gradient import Target, changes
from pmor.dynamics.whine.live import motion_section
from pmor.dynamics.whine.parting_output import parting_blocks, parting_data, parting_lines
from pmor.dynamics.whine.pictures import drawn_modes, modes_figure
from pmor.dynamics.whine.readings import (
    bearing_names,
    bearing_rms,
    force_lines,
    housing_rows,
    main_load,
    mesh_rms,
    mode_rows,
    peak_rows,
    shown_modes,
    swing,
)
from pmor.dynamics.whine.response import LoadResponse, Source
from pmor.dynamics.whine.rigid_gears import rigid_gears
from pmor.machine.loader import GearboxFile
from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.parameter_words import parameter_words
from pmor.report.table import Columns, Table, table, text_lines
from pmor.sets.loader import SetFile
from pmor.work.results import Report

Data = dict[str, Any]
MovingFile = GearboxFile | SetFile
#: files of a result
FILES = (
    "dynamics.json", "dynamics.md", "report.html", "response.csv", "lines.csv", "results.h5", "bearings.png",
    "meshes.png", "campbell.png", "waterfall.png", "orders.png", "compliance.png", "modes.png", "modes.vtkhdf",
    "parting.csv", "parting.png",
)  # fmt: skip


def whine_data(file: MovingFile, responses: Sequence[LoadResponse], failures: Sequence[str]) -> Data:
    """Return the content of `dynamics.json`."""
    motion, loud = file.sections.dynamics, loudest(responses) if responses else None
    return {
        kind_of(file): file.name,
        "damping_ratio": motion.damping_ratio,
        "mesh_stiffness": motion.mesh_stiffness,
        "highest_frequency_Hz": motion.highest_frequency_Hz,
        "loads": [
            _load_data(response) | (micrometre_data(response) if response is loud else {}) | parting_data(response)
            for response in responses
        ],
        "rigid_gears": rigid_gears(file),
        "failures": list(failures),
    }


def kind_of(file: MovingFile) -> str:
    """Return "set" or "gearbox"."""
    return "set" if isinstance(file, SetFile) else "gearbox"


def loudest(responses: Sequence[LoadResponse]) -> LoadResponse:
    """Return the load with the largest bearing force."""
    return max(responses, key=lambda response: float(bearing_rms(response).max()))


def micrometre_data(response: LoadResponse) -> Data:
    """Return what a micrometre of each modification does to the mesh's own force and the largest bearing forces."""
    rows, speeds = list[Data](), dict[str, float]()
    names, total = bearing_names(response), bearing_rms(response)
    largest = total.max(axis=0).argsort()[::-1][:MOST_TARGETS]
    for number, name in enumerate(response.mesh_names[: len(response.solved.meshes)]):
        source, motion, _ = response.source_of(number)
        if motion.cycle.pitches > 1:
            continue
        own = force_lines(response, source, source.lines)
        at = (own**2).sum(axis=1).argmax(axis=0)
        tops = {names[n]: (int(n), float(response.speeds_rpm[at[n]])) for n in largest}
        force = (abs(source.lines.mesh_forces[..., number]) ** 2 * source.told).sum(axis=1)
        targets = [Target("mesh", float(response.speeds_rpm[force.argmax()]))]
        targets += [Target("bearing", speed, n) for n, speed in tops.values()]
        for change in changes(response, number, targets):
            values = dict(zip(("mesh", *tops), change.targets, strict=True))
            rows.append({"mesh": name, "parameter": change.parameter, "force_N": values,
                         "transmission_error_um": change.transmission_error_um})  # fmt: skip
        speeds |= {f"{bearing}, {name}": speed for bearing, (_, speed) in tops.items()}
    return {"micrometres": rows, "micrometre_targets": speeds, "micrometre_bearings": [names[n] for n in largest]}


def _load_data(response: LoadResponse) -> Data:
    total, forces, swings = bearing_rms(response), mesh_rms(response), swing(response)
    constant = bearing_rms(response, constant=True), mesh_rms(response, constant=True)
    return {
        "load": response.solved.load.name,
        "speeds_rpm": [float(response.speeds_rpm[0]), float(response.speeds_rpm[-1])],
        "unknowns": response.machine.free.shape[1],
        "modes": mode_rows(response),
        "peaks": peak_rows(response),
        "in_step": [
            list(source.mesh.standing.names) for source in response.sources
            if source.mesh is not None and len(source.mesh.standing.names) > 1
        ],
        "housing": housing_rows(response),
        "bearings": [
            {"name": name, "force_rms_max_N": float(total[:, n].max()),
             "at_rpm": float(response.speeds_rpm[total[:, n].argmax()]),
             "constant_stiffness_rms_max_N": float(constant[0][:, n].max())}
            for n, name in enumerate(bearing_names(response))
        ],
        "meshes": [
            {"name": name, "mean_force_N": standing["mean_force_N"],
             "force_rms_max_N": float(forces[:, n].max()),
             "constant_stiffness_rms_max_N": float(constant[1][:, n].max()),
             "dynamic_factor": 1.0 + float(swings[:, n].max() / standing["mean_force_N"]), **standing}
            for n, (name, standing) in enumerate(zip(response.mesh_names, _standing(response), strict=True))
        ],
    }  # fmt: skip


def _standing(response: LoadResponse) -> Iterator[Data]:
    """What each mesh is about which motion is small; of sets those of one planet, and why stiffness does not vary."""
    for number, solved in enumerate(response.solved.meshes):
        yield {
            "mean_force_N": float(solved.force),
            "mean_tangent_N_per_um": 1e-3 * float(response.tangent[2 * number, 2 * number]),
            "pitches_per_turn": response.machine.mesh_rate(number),
            "repeats_after_pitches": response.source_of(number)[1].cycle.pitches,
        }
    for source, cycle in zip(response.of_sets, response.cycles, strict=True):
        for first in (0, cycle.each // 2):
            yield {
                "mean_force_N": float(cycle.load[first]),
                "mean_tangent_N_per_um": 1e-3 * float(cycle.meshes.mean[first, first]),
                "pitches_per_turn": source.rate, "why_constant": source.why_constant or None,
            }  # fmt: skip


def response_rows(responses: Sequence[LoadResponse]) -> list[Data]:
    """Return the rows of `response.csv`: forces of meshes and bearings by load and speed."""
    rows = []
    for response in responses:
        bearings, meshes = bearing_rms(response), mesh_rms(response)
        for place, speed in enumerate(response.speeds_rpm.tolist()):
            row: Data = {"load": response.solved.load.name, "speed_rpm": speed}
            row |= {f"mesh {name}, rms_N": float(meshes[place, n]) for n, name in enumerate(response.mesh_names)}
            names = bearing_names(response)
            rows.append(row | {f"bearing {name}, rms_N": float(bearings[place, n]) for n, name in enumerate(names)})
    return rows


def line_columns(responses: Sequence[LoadResponse]) -> dict[str, np.ndarray]:
    """Return the columns of `lines.csv`: each line of each source by load and speed, amplitudes from zero to peak."""
    parts = list[dict[str, np.ndarray]]()
    for response in responses:
        for source in response.sources:
            count, harmonics = source.told.shape
            forces = force_lines(response, source, source.lines)
            own = {"load": response.solved.load.name, "source": source.name}
            told, orders = source.told[..., None], np.array([order.order for order in source.orders[:harmonics]])
            meshes = 2.0 * abs(source.lines.mesh_forces) * told, 2e3 * abs(source.lines.parted) * told
            parts.append({
                **{key: np.full(count * harmonics, text, dtype=object) for key, text in own.items()},
                "harmonic": np.tile([harmonic for harmonic, _ in source.places], count),
                "carrier_order": np.tile([sideband for _, sideband in source.places], count),
                "speed_rpm": np.repeat(response.speeds_rpm, harmonics),
                "frequency_Hz": source.frequency_Hz(response.speeds_rpm).ravel(),
                **{f"order of {shaft}": np.tile(np.round(orders / abs(rate), 9), count)
                   for shaft, rate in response.machine.rates.items() if rate},
                **{f"mesh {name}, {key}": values[..., n].ravel() for n, name in enumerate(response.mesh_names)
                   for key, values in zip(("force_N", "transmission_error_um"), meshes, strict=True)},
                **{f"bearing {name}, rms_N": forces[..., n].ravel() for n, name in enumerate(bearing_names(response))},
            })  # fmt: skip
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]} if parts else {}


def motion_arrays(response: LoadResponse) -> dict[str, np.ndarray]:
    """Return the arrays of a load in `results.h5`, lines that a source lacks as NaN."""
    model, sources, speeds = response.receptance, response.sources, response.speeds_rpm
    most = max(source.told.shape[1] for source in sources)

    def padded(values: np.ndarray, source: Source) -> np.ndarray:
        told = np.where(source.told.reshape(*source.told.shape, *(1,) * (values.ndim - 2)), values, np.nan)
        return np.pad(told, ((0, 0), (0, most - told.shape[1]), *((0, 0),) * (told.ndim - 2)), constant_values=np.nan)

    def on_bearings(readings: FloatArray) -> FloatArray:
        return response.bearing_forces(np.asarray(readings.T, dtype=complex)).real[..., :3].transpose(1, 2, 0)

    frequency = np.stack([padded(source.frequency_Hz(speeds), source) for source in sources])
    meshes = np.stack([padded(source.lines.mesh_forces, source) for source in sources])
    bearings = np.stack(
        [padded(response.bearing_forces(source.lines.readings)[..., :3], source) for source in sources]
    )
    acting = np.stack([padded(_on_all_ports(source, len(model.ports)), source) for source in sources])
    order = np.full((len(sources), most), np.nan)
    for number, source in enumerate(sources):
        order[number, : source.told.shape[1]] = [one.order for one in source.orders[: source.told.shape[1]]]
    return {
        "speed/speed": speeds, "speed/bearing_force": bearing_rms(response), "speed/mesh_force": mesh_rms(response),
        "lines/frequency": frequency, "lines/mesh_force": 2.0 * abs(meshes), "lines/mesh_force_phase": np.angle(meshes),
        "lines/bearing_force": 2.0 * abs(bearings), "lines/bearing_force_phase": np.angle(bearings),
        "lines/order": order, "lines/acting": 2.0 * abs(acting), "lines/acting_phase": np.angle(acting),
        "model/frequency": response.modes.frequency_Hz, "model/damping_ratio": model.damping_ratio,
        "model/ports": model.ports, "model/readings": model.readings,
        "model/gyroscopic": response.machine.sense * model.gyroscopic, "model/centrifugal": model.centrifugal,
        "model/bearing_force": on_bearings(model.readings),
        "model/left_bearing_force": on_bearings(model.left_readings),
        "model/left_ports": model.left_ports, "model/left_readings": model.left_readings,
        "model/tangent": response.tangent,
    }  # fmt: skip


def _on_all_ports(source: Source, ports: int) -> ComplexArray:
    """Forces of a source's lines on all ports, (S, K, p)."""
    found = np.zeros((*source.told.shape, ports), dtype=complex)
    found[..., source.ports] = source.lines.acting[:, : source.told.shape[1]]
    return found


def whine_report(file: MovingFile, responses: Sequence[LoadResponse], data: Data) -> Report:
    """Return numbers and page; `data` as `whine_data` gives them."""
    title, blocks, live = f"In motion: {file.sections.title}", _blocks(file, data, responses), list[Any]()
    if responses and not isinstance(file, SetFile):
        section = motion_section(file.model, responses, loudest(responses), shown_modes(data))
        live = [Heading("Through the speeds"), section]
    return Report("dynamics", data, title, blocks, page_only=live)


def whine_text(data: Data) -> str:
    """Return the tables for the screen."""
    lines = [f"The {kind} in motion: {data[kind]}" for kind in ("gearbox", "set") if kind in data]
    for shown in (_meshes(data), _peaks(data, [main_load(data)["load"]] if data["loads"] else [])):
        if shown.rows:
            lines += [f"  {shown.title}", *(f"    {line}" for line in text_lines(shown))]
    return "\n".join([*lines, *parting_lines(data), *(f"  ! {sentence}" for sentence in data["failures"])])


def _blocks(file: MovingFile, data: Data, responses: Sequence[LoadResponse]) -> list[Block]:
    motion, blocks = file.sections.dynamics, list[Block]()
    blocks.append(
        f"{OF_A_SET if isinstance(file, SetFile) else OF_SHAFTS}, and line contact on finite elements whose stiffness "
        "varies over the mesh cycle. Flanks stay in contact. Speeds are those of "
        f"{responses[0].speed_of if responses else 'the load'}. Each mode has a damping of "
        f"{100.0 * motion.damping_ratio:g} % of the critical one, which no calculation gives: peaks are inverse to it."
    )
    if data["rigid_gears"]:
        blocks.append(" ".join(data["rigid_gears"]))
    blocks += [*map(Warning, [*file.notes, *data["failures"]])]
    if not responses:
        return blocks
    last, highest = loudest(responses), motion.highest_frequency_Hz
    name = last.solved.load.name
    if not any(source.told.any() for source in last.sources):
        text = "No line lies below [dynamics] highest_frequency_Hz at these speeds: raise it, or lower the speeds."
        blocks.append(Warning(text))
    lost = [row for load in data["loads"] for row in load["meshes"] if row["dynamic_factor"] > MOST_FACTOR]
    if lost:
        names = ", ".join(sorted({row["name"] for row in lost}))
        text = f"Flanks would part ({names}): dynamic forces exceed the load, where small motion ends."
        if not last.parting and not isinstance(file, SetFile):
            text += ' [dynamics] motion = "nonlinear" goes on from there.'
        blocks.append(Warning(text))
    blocks += [
        _meshes(data), _bearings(data), _peaks(data, [name]),
        _peaks(data, [load["load"] for load in data["loads"] if load["load"] != name], folded=True),
        *([_housing(data)] if last.machine.heavy_housing else []),
        *parting_blocks(responses), Heading("Over the speed"),
        Picture("bearings.png", "Dynamic forces of the bearings, root mean square of all lines. Dashed: with a mesh of "
                "constant stiffness, as is usual.", bearings_figure(responses)),
        Picture("meshes.png", "Dynamic forces of the meshes. Dashed: with a mesh of constant stiffness.",
                meshes_figure(responses)),
        Picture("campbell.png", f"Natural frequencies, and harmonics of the meshes, under {name}. "
                "Circles: where a harmonic meets a mode that strains its mesh, the larger the more. Natural "
                "frequencies part with the speed by gyroscopic moments. Below: orders of each shaft's turn.",
                campbell_figure(last, highest)),
        Picture("waterfall.png", f"Lines of the bearing forces under {name}.",
                waterfall_figure(last, highest)),
        Picture("orders.png", f"Order cuts under {name}: the largest lines of the bearing forces by themselves.",
                orders_figure(last)),
    ]  # fmt: skip
    if last.solved.meshes:
        blocks += [
            Heading("Each mesh of two gears" if last.cycles else "Each mesh"),
            Picture("compliance.png", f"Compliance of both gears in the direction of the mesh force under "
                    f"{name}, the mesh open, and the mesh force by transmission error, the mesh closed; "
                    "shafts at rest.", compliance_figure(last, highest)),
            _micrometres(data),
        ]  # fmt: skip
    caption = (
        f"Modes under {name} that make the peaks, and that strain meshes most: as they move (lines), and at rest "
        "(dash-dotted); bearings are grey. modes.vtkhdf has them in motion."
    )
    if last.machine.ringing:
        caption += " Rims and webs that ring are drawn stiff."
    # A set by itself has no shafts on which it could be drawn.
    pictures = list[Block]()
    if not isinstance(file, SetFile) and (drawn := drawn_modes(data)):
        pictures.append(Picture("modes.png", caption, modes_figure(file.model, last, drawn)))
    return [*blocks, Heading("Modes"), *pictures, _modes(data, last.mesh_names)]


# What moves, of gearboxes and of sets by themselves.
OF_SHAFTS = (
    "Small motion of shafts, gears and bearings about each load: Timoshenko beams with their inertia and gyroscopic "
    "moments, gears as rigid discs, those on light blanks, and rings on a bedding, with the modes of rim and web, "
    "bearings by their stiffness under the load"
)
OF_A_SET = (
    "Small motion of a planetary set by itself about each torque: gears as rigid discs on the supports of the file. "
    "The carrier has the mass of its pins and of [[masses]]; members without inertia in [[masses]] turn evenly, but "
    "for the sun, or the ring beside a sun that is held"
)
# Bearings, the most loaded, whose force is told by modifications.
MOST_TARGETS = 2
# Of a force: shares of modes that are shown.
SHOWN = 0.05
# Largest dynamic factor of flanks that stay in contact.
MOST_FACTOR = 2.0


def _meshes(data: Data) -> Table:
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


def _bearings(data: Data) -> Table:
    rows = [(load, bearing) for load in data["loads"] for bearing in load["bearings"]]
    columns: Columns = {
        "load": lambda row: row[0]["load"], "bearing": lambda row: row[1]["name"],
        "largest dynamic force, rms, N": lambda row: row[1]["force_rms_max_N"],
        "at, rpm": lambda row: row[1]["at_rpm"],
        "with constant stiffness, N": lambda row: row[1]["constant_stiffness_rms_max_N"],
    }  # fmt: skip
    note = "With constant stiffness: each mesh by its mean stiffness, as is usual; the largest over the speed likewise."
    return replace(table("Bearings", columns, rows, note), folded=len(data["loads"]) > 1)


def _peaks(data: Data, loads: Sequence[str], folded: bool = False) -> Table:
    rows = [(load, peak) for load in data["loads"] if load["load"] in loads for peak in load["peaks"]]
    told = {"load": lambda row: row[0]["load"]} if len(loads) > 1 else {}
    columns: Columns = {
        **told, "bearing": lambda row: row[1]["bearing"],
        "speed, rpm": lambda row: row[1]["speed_rpm"],
        "force, rms, N": lambda row: row[1]["force_rms_N"],
        "by": lambda row: row[1]["line"],
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
    words = "Peaks of the bearing forces under " + ("the other loads" if folded else ", ".join(loads))
    return replace(table(words, columns, rows, note), folded=folded)


def _housing(data: Data) -> Table:
    rows = [(load, row) for load in data["loads"] for row in load["housing"]]
    columns: Columns = {
        "load": lambda row: row[0]["load"], "seat of": lambda row: row[1]["seat"],
        "largest acceleration, rms, m/s²": lambda row: row[1]["acceleration_rms_max_m_s2"],
        "at, rpm": lambda row: row[1]["at_rpm"],
        "largest radiated power, dB re 1e-12 W": lambda row: row[1]["radiated_power_max_dB"],
    }  # fmt: skip
    note = "Equivalent radiated power of the whole housing, radiation efficiency 1: that of its surface matrix."
    return table("The housing", columns, rows, note)


def _micrometres(data: Data) -> Table:
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
    note = (
        f"By a micrometre more, under {load['load']}: to the forces that the mesh's own lines cause where they are "
        f"largest ({speeds}). What lowers the transmission error can raise a force."
    )
    return table("What a micrometre of each modification does", columns, load["micrometres"], note)


def _family(name: str) -> Callable[[Data], str]:
    return lambda row: str(row["families"][name]["family"])


def _modes(data: Data, names: Sequence[str]) -> Table:
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
