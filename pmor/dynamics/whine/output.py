"""Files of a gearbox or a set in motion, its page, and its summary on the screen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from pmor.dynamics.whine.cycle import GEARS
from pmor.dynamics.whine.figures import (
    bearings_figure,
    campbell_figure,
    compliance_figure,
    meshes_figure,
    orders_figure,
    waterfall_figure,
)
from pmor.dynamics.whine.gradient import Target, changes, passing_at
from pmor.dynamics.whine.live import motion_section
from pmor.dynamics.whine.parting_output import parting_blocks, parting_data, parting_lines
from pmor.dynamics.whine.pictures import drawn_modes, modes_figure
from pmor.dynamics.whine.readings import (
    bearing_names,
    housing_rows,
    main_load,
    mode_rows,
    moved_bearings,
    peak_rows,
    shown_modes,
    swing,
)
from pmor.dynamics.whine.response import LoadResponse
from pmor.dynamics.whine.rigid_gears import rigid_gears
from pmor.dynamics.whine.tables import (
    bearings_table,
    housing_table,
    meshes_table,
    micrometres_table,
    modes_table,
    peaks_table,
)
from pmor.machine.loader import GearboxFile
from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.parameter_words import parameter_words
from pmor.report.table import text_lines
from pmor.report.verdict import verdict_text
from pmor.results.verdict import Verdict, digits
from pmor.sets.loader import SetFile
from pmor.work.results import Report

Data = dict[str, Any]
MovingFile = GearboxFile | SetFile
# Members in the meshes of a set.
OF_MESHES = ("sun", "planet"), ("planet", "ring")
#: files of a result
FILES = (
    "dynamics.json", "dynamics.md", "report.html", "response.csv", "lines.csv", "results.h5", "bearings.svg",
    "meshes.svg", "campbell.svg", "waterfall.svg", "orders.svg", "compliance.svg", "modes.png", "modes.vtkhdf",
    "parting.csv", "parting.svg",
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
    return max(responses, key=lambda response: float(response.rms.bearings.max()))


def micrometre_data(response: LoadResponse) -> Data:
    """Return what a micrometre of each modification does to the mesh's own force and the largest bearing forces."""
    rows, speeds = list[Data](), dict[str, float]()
    names, total = bearing_names(response), response.rms.bearings
    largest = total.max(axis=0).argsort()[::-1][:MOST_TARGETS]
    told = len(response.solved.meshes) if response.machine.gearbox.beams else None
    for number, name in enumerate(response.mesh_names[:told]):
        source, motion, _ = passing_at(response, number)
        if motion.cycle.pitches > 1 or motion.standing is None or motion.standing.parts[0].pitches > 1:
            continue
        own = response.force_lines(source)
        at = (own**2).sum(axis=1).argmax(axis=0)
        tops = {names[n]: (int(n), float(response.speeds_rpm[at[n]])) for n in largest}
        force = (abs(source.lines.mesh_forces[..., number]) ** 2 * source.told).sum(axis=1)
        if not force.any():  # lines above the highest frequency
            continue
        targets = [Target("mesh", float(response.speeds_rpm[force.argmax()]))]
        targets += [Target("bearing", speed, n) for n, speed in tops.values()]
        for change in changes(response, number, targets):
            values = dict(zip(("mesh", *tops), change.targets, strict=True))
            rows.append({"mesh": name, "parameter": of_member(response, number, change.parameter), "force_N": values,
                         "transmission_error_um": change.transmission_error_um})  # fmt: skip
        speeds |= {f"{bearing}, {name}": speed for bearing, (_, speed) in tops.items()}
    return {"micrometres": rows, "micrometre_targets": speeds, "micrometre_bearings": [names[n] for n in largest]}


def of_member(response: LoadResponse, number: int, parameter: str) -> str:
    """Return a parameter of a mesh with the name of the gear, of sets the member."""
    gear, _, key = parameter.partition(".")
    further = number - len(response.solved.meshes)
    members = GEARS if further < 0 else OF_MESHES[further % len(OF_MESHES)]
    return f"{members[GEARS.index(gear)]}.{key}"


def _load_data(response: LoadResponse) -> Data:
    total, forces, swings = response.rms.bearings, response.rms.meshes, swing(response)
    constant = response.constant_rms.bearings, response.constant_rms.meshes
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


def whine_report(file: MovingFile, responses: Sequence[LoadResponse], data: Data) -> Report:
    """Return numbers and page; `data` as `whine_data` gives them."""
    title, blocks, live = f"In motion: {file.sections.title}", _blocks(file, data, responses), list[Any]()
    if responses:
        section = motion_section(file, responses, loudest(responses), shown_modes(data))
        live = [Heading("Through the speeds"), section]
    return Report("dynamics", data, title, blocks, page_only=live)


def whine_verdict(data: Data) -> list[Verdict]:
    """Return the verdict on motion under the load with the largest bearing force; none where nothing is solved."""
    if not data["loads"]:
        return []
    load = main_load(data)
    factor, mesh = max((row["dynamic_factor"], row["name"]) for row in load["meshes"])
    contact = f"dynamic factor at most {factor:.3g} ({mesh})"
    parts, bad = factor > MOST_FACTOR, list[str]()
    if parts:
        bad.append(f"Flanks would part: {contact}.")
    good = "Nothing, while flanks do not stay in contact." if parts else f"Flanks stay in contact: {contact}."
    top = max(load["peaks"], key=lambda row: float(row["force_rms_N"]), default=None)
    if top is None:
        return [Verdict(good, " ".join(bad) or "No peak of a bearing force lies within the speeds.", "Nothing.")]
    bearing, at = top["bearing"], f"{top['speed_rpm']:.4g} rpm"
    bad.append(f"Largest peak: {digits(top['force_rms_N'])} N (rms) of {bearing} at {at}, by {top['line']}.")
    rows = [row for row in load["micrometres"] if row["force_N"].get(bearing)]
    if not rows:
        return [Verdict(good, " ".join(bad), f"No flank that was tried moves the force of {bearing}.")]
    best = max(rows, key=lambda row: abs(float(row["force_N"][bearing])))
    change, words = float(best["force_N"][bearing]), parameter_words(best["parameter"]).removesuffix(" [µm]")
    words = words[:1].lower() + words[1:]
    speed = load["micrometre_targets"][f"{bearing}, {best['mesh']}"]
    way = "less" if change > 0.0 else "more"
    text = (
        f"A micrometre {way} of {best['mesh']}, {words}: {digits(abs(change))} N off what that mesh's own lines "
        f"cause at {bearing} at {speed:.4g} rpm, by the derivative there. A design with minimise "
        '= "bearing_force_N" goes on from there.'
    )
    return [Verdict(good, " ".join(bad), text)]


def whine_text(data: Data) -> str:
    """Return the tables for the screen."""
    lines = [f"The {kind} in motion: {data[kind]}" for kind in ("gearbox", "set") if kind in data]
    lines += [line for verdict in whine_verdict(data) for line in verdict_text(verdict.data)]
    for shown in (meshes_table(data), peaks_table(data, [main_load(data)["load"]] if data["loads"] else [])):
        if shown.rows:
            lines += [f"  {shown.title}", *(f"    {line}" for line in text_lines(shown))]
    return "\n".join([*lines, *parting_lines(data), *(f"  ! {sentence}" for sentence in data["failures"])])


def _blocks(file: MovingFile, data: Data, responses: Sequence[LoadResponse]) -> list[Block]:
    motion, blocks = file.sections.dynamics, list[Block](whine_verdict(data))
    blocks.append(
        f"{OF_A_SET if isinstance(file, SetFile) else OF_SHAFTS}, and line contact on finite elements whose stiffness "
        "varies over the mesh cycle. Flanks stay in contact. Speeds are those of "
        f"{responses[0].speed_of if responses else 'the load'}. Each mode has a damping of "
        f"{100.0 * motion.damping_ratio:g} % of the critical one, which no calculation gives: peaks are inverse to it."
    )
    if isinstance(file, SetFile) and not file.plan.even and file.sections.load and file.sections.load.held != "carrier":
        blocks.append(BALANCED)
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
    (_, of_all), (_, of_last) = moved_bearings(responses), moved_bearings([last])
    blocks += [
        meshes_table(data), bearings_table(data), peaks_table(data, [name]),
        peaks_table(data, [load["load"] for load in data["loads"] if load["load"] != name], folded=True),
        *([housing_table(data)] if last.machine.heavy_housing else []),
        *parting_blocks(responses), Heading("Over the speed"),
        Picture("bearings.svg", "Dynamic forces of the bearings, root mean square of all lines. Dashed: with a mesh of "
                f"constant stiffness, as is usual.{_unmoved(of_all)}", bearings_figure(responses)),
        Picture("meshes.svg", "Dynamic forces of the meshes. Dashed: with a mesh of constant stiffness.",
                meshes_figure(responses)),
        Picture("campbell.svg", f"Natural frequencies, and harmonics of the meshes, under {name}. "
                "Circles: where a harmonic meets a mode that strains its mesh, the larger the more. Natural "
                "frequencies part with the speed by gyroscopic moments. Below: orders of each shaft's turn.",
                campbell_figure(last, highest)),
        Picture("waterfall.svg", f"Lines of the bearing forces under {name}.{_unmoved(of_last)}",
                waterfall_figure(last, highest)),
        Picture("orders.svg", f"Order cuts under {name}: the largest lines of the bearing forces by themselves."
                f"{_unmoved(of_last)}",
                orders_figure(last)),
    ]  # fmt: skip
    if last.solved.meshes:
        blocks += [
            Heading("Each mesh of two gears" if last.cycles else "Each mesh"),
            Picture("compliance.svg", f"Compliance of both gears in the direction of the mesh force under "
                    f"{name}, the mesh open, and the mesh force by transmission error, the mesh closed; "
                    "shafts at rest.", compliance_figure(last, highest)),
        ]  # fmt: skip
    if last.solved.meshes or not last.machine.gearbox.beams:
        blocks.append(micrometres_table(data))
    if last.cycles and last.machine.gearbox.beams:
        blocks.append(MICROMETRES_OF_SETS)
    shafts = ": as they move (lines), and at rest (dash-dotted); bearings are grey"
    shafts = shafts if last.machine.gearbox.beams else ""
    caption = (
        f"Modes under {name} that make the peaks, and that strain meshes most{shafts}. modes.vtkhdf has them in motion."
    )
    if last.machine.ringing:
        caption += " Rims and webs that ring are drawn stiff."
    if last.of_sets and last.machine.sets[0].coordinates.blades.carried:
        caption += " Planets and supports as seen from the carrier."
    pictures = list[Block]()
    if drawn := drawn_modes(data):
        pictures.append(Picture("modes.png", caption, modes_figure(file, last, drawn)))
    return [*blocks, Heading("Modes"), *pictures, modes_table(data, last.mesh_names)]


def _unmoved(names: Sequence[str]) -> str:
    return f" Left out, as no dynamic force reaches them: {', '.join(names)}." if names else ""


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
# Of sets in gearboxes.
MICROMETRES_OF_SETS = (
    "What a micrometre does on flanks of planetary sets is told of their own files (pmor dynamics SET.toml): here it "
    "would take as long as all else."
)
# Of planets that are not evenly spaced around a carrier that turns.
BALANCED = (
    "Planets are not evenly spaced, or few: their weight is taken as balanced by that of the carrier, which the file "
    "does not have. A force at the carrier's turn by what is left of it is not in."
)
# Bearings, the most loaded, whose force is told by modifications.
MOST_TARGETS = 2
# Largest dynamic factor of flanks that stay in contact.
MOST_FACTOR = 2.0
