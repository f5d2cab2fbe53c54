"""What is told of flanks that part: sentences, tables, a picture, rows of a file, arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pmor.dynamics.integration import SAMPLES
from pmor.dynamics.whine.parting import BALANCE, SPEEDS, TOLD, Course, Parting
from pmor.dynamics.whine.readings import bearing_names
from pmor.dynamics.whine.response import LoadResponse
from pmor.report.chart import COLOURS, Chart, Panel, panels
from pmor.report.page import Block, Heading, Picture
from pmor.report.table import Columns, table

Data = dict[str, Any]
WAYS = {"run_up": "running up", "run_down": "running down"}


def parting_data(response: LoadResponse) -> Data:
    """Return what `dynamics.json` has of it beside the linear answer of a load; nothing where it was not asked for."""
    found = response.parting
    if found is None:
        return {}
    names, bearings = [response.mesh_names[number] for number in found.numbers], bearing_names(response)
    stable = [(course, place) for course in found.courses for place in np.flatnonzero(course.stable).tolist()]
    linear_meshes, linear_bearings = response.rms.meshes, response.rms.bearings
    return {"nonlinear": {
        "meshes_that_part": names, "solved_by": found.by or None,
        "least_force_share": {
            name: float(share) for name, share in zip(response.mesh_names, found.least.min(axis=0), strict=False)
        },
        "ranges_rpm": [list(one) for one in found.ranges_rpm], "harmonics": list(found.harmonics),
        "backlash_um": [one if np.isfinite(one) else None for one in found.backlash_um],
        "jumps": [{"speed_rpm": speed, "kind": kind} for speed, kind in found.jumps],
        "period_doublings_rpm": list(found.doublings_rpm), "swaying_rpm": list(found.swaying_rpm),
        "meshes": [
            {"name": name, "linear_force_rms_max_N": float(linear_meshes[:, found.numbers[n]].max()),
             **_largest(stable, n)}
            for n, name in enumerate(names) if stable
        ],
        "bearings": [
            {"name": name, "force_rms_max_N": max(float(course.bearings[place, n]) for course, place in stable),
             "linear_force_rms_max_N": float(linear_bearings[:, n].max())}
            for n, name in enumerate(bearings) if stable
        ],
        "lost": list(found.lost),
    }}  # fmt: skip


def _largest(stable: Sequence[tuple[Course, int]], mesh: int) -> Data:
    """The extremes of what is told of a mesh over its stable motion, and the speed of the largest force."""
    told = np.array([course.meshes[place, mesh] for course, place in stable])
    speeds = [float(course.speeds_rpm[place]) for course, place in stable]
    ends = {key: float((np.min if key.startswith("least") else np.max)(told[:, n])) for n, key in enumerate(TOLD)}
    return {**ends, "at_rpm": speeds[int(told[:, TOLD.index("force_rms_N")].argmax())]}


def sentences(response: LoadResponse, found: Parting) -> list[str]:
    """Return what was solved under a load, how, and why."""
    load, least = response.solved.load.name, found.least
    if not found.numbers:
        if not least.size:
            return [f"Under {load} meshes of sets stay in contact in this answer: nonlinear motion takes two gears."]
        place, number = np.unravel_index(least.argmin(), least.shape)
        share, mesh, speed = 100.0 * least[place, number], response.mesh_names[int(number)], response.speeds_rpm[place]
        return [
            f"Under {load} no flanks part: the least force of the linear answer is {share:.3g} % of the mean one, in "
            f"{mesh} at {speed:.4g} rpm. The linear answer stands."
        ]
    names = ", ".join(response.mesh_names[number] for number in found.numbers)
    where = ", ".join(f"{low:.4g} to {high:.4g}" for low, high in found.ranges_rpm)
    text = f"Under {load} the least force of {names} is not above zero in the linear answer: flanks part. "
    if found.by == BALANCE:
        orders = ", ".join(map(str, found.harmonics)) or "no"
        text += (
            f"Their motion repeats with the mesh and is found by harmonic balance ({orders} harmonics), followed over "
            f"{where} rpm, with gyroscopic moments of the middle of each range. "
        )
    else:
        text += (
            "They have different periods, so that no motion repeats: it is integrated over time, at "
            f"{SPEEDS} speeds of {where} rpm, upwards and downwards, {SAMPLES} samples a mesh cycle, without "
            "gyroscopic moments. "
        )
    backs = [
        f"{response.mesh_names[number]}: backs of teeth touch beyond {one:.4g} µm of backlash under the load"
        if np.isfinite(one) else
        f"{response.mesh_names[number]}: backs of teeth carry nothing, as there is no backlash in the file, or flanks "
        "and backs differ"
        for number, one in zip(found.numbers, found.backlash_um, strict=True)
    ]  # fmt: skip
    return [
        text + "All other meshes keep their mean stiffness; what they and other sources excite is added to the "
        "bearings' forces by its squares.",
        "; ".join(backs) + ".",
    ]


def parting_lines(data: Data) -> list[str]:
    """Return what the screen tells."""
    lines = list[str]()
    for load in (one for one in data["loads"] if "nonlinear" in one):
        parted = load["nonlinear"]
        names = ", ".join(parted["meshes_that_part"])
        solved = f"flanks part ({names}): {parted['solved_by']}" if names else "no flanks part"
        lines.append(f"  {load['load']}: {solved}")
        lines += [
            f"    {row['name']}: {row['force_rms_N']:.4g} N rms at {row['at_rpm']:.4g} rpm, linear "
            f"{row['linear_force_rms_max_N']:.4g}; no contact {100.0 * row['contact_loss']:.3g} % of the cycle"
            for row in parted["meshes"]
        ]
    return lines


def parting_blocks(responses: Sequence[LoadResponse]) -> list[Block]:
    """Return the part of the page on flanks that part; nothing where it was not asked for."""
    answers = [(response, response.parting) for response in responses if response.parting]
    if not answers:
        return []
    rows = [(response, parting_data(response)["nonlinear"]) for response, _ in answers]
    blocks: list[Block] = [Heading("Where flanks part"), *(text for one in answers for text in sentences(*one))]
    solved = [one for one, (_, data) in zip(answers, rows, strict=True) if data["meshes"]]
    if not solved:
        return blocks
    meshes: Columns = {
        "load": lambda row: row[0], "mesh": lambda row: row[1]["name"],
        "largest dynamic force, rms, N": lambda row: row[1]["force_rms_N"], "at, rpm": lambda row: row[1]["at_rpm"],
        "linear, N": lambda row: row[1]["linear_force_rms_max_N"],
        "dynamic factor": lambda row: row[1]["dynamic_factor"],
        "no contact, % of the cycle": lambda row: 100.0 * row[1]["contact_loss"],
        "backs push, % of the cycle": lambda row: 100.0 * row[1]["back_contact"],
        "flanks part by, µm": lambda row: row[1]["separation_um"],
    }  # fmt: skip
    bearings: Columns = {
        "load": lambda row: row[0], "bearing": lambda row: row[1]["name"],
        "largest force, rms, N": lambda row: row[1]["force_rms_max_N"],
        "linear, N": lambda row: row[1]["linear_force_rms_max_N"],
    }  # fmt: skip
    jumps: Columns = {
        "load": lambda row: row[0], "speed, rpm": lambda row: row[1]["speed_rpm"],
        "motion jumps": lambda row: WAYS[row[1]["kind"]],
    }  # fmt: skip
    note = (
        "Stable motion alone, with harmonics above the highest frequency too. The linear answer has flanks that pull "
        "where they would part."
    )
    for title, columns, key, text in (
        ("Meshes that part", meshes, "meshes", note),
        ("Bearings where flanks part", bearings, "bearings", "The linear answer up to the highest frequency."),
        ("Jumps", jumps, "jumps", "There stable motion ends: the next one is larger or smaller."),
    ):  # fmt: skip
        told = [(response.solved.load.name, row) for response, data in rows for row in data[key]]
        blocks += [table(title, columns, told, text)] if told else []
    caption = (
        "Dynamic force of meshes that part, and of the bearing with the largest force, root mean square. Lines: stable "
        "motion, points: unstable, circles: integrated over time. Thin: the linear answer."
    )
    return [*blocks, Picture("parting.svg", caption, parting_figure(solved))]


def parting_figure(answers: Sequence[tuple[LoadResponse, Parting]]) -> Chart:
    """A row for each load: its parting meshes together, and the most loaded bearing."""
    rows = len(answers)
    with panels(2, 9.2, 2.8 * rows, rows=rows) as (figure, each):
        for axes, (response, found) in zip(zip(each[::2], each[1::2], strict=True), answers, strict=True):
            bearing = int(np.max([course.bearings.max(axis=0) for course in found.courses], axis=0).argmax())
            for colour, (n, number) in zip(COLOURS, enumerate(found.numbers), strict=False):
                axes[0].plot(response.speeds_rpm, response.rms.meshes[:, number], color=colour, lw=0.6)
                for course in found.courses:
                    label = response.mesh_names[number] if course is found.courses[0] else None
                    _course(axes[0], course, course.meshes[:, n, 0], colour, label)
            axes[1].plot(response.speeds_rpm, response.rms.bearings[:, bearing], color=COLOURS[0], lw=0.6)
            for course in found.courses:
                _course(axes[1], course, course.bearings[:, bearing], COLOURS[0], None)
            speed = f"Speed of {response.speed_of} [rpm]"
            axes[0].set(title=f"{response.solved.load.name}: mesh force", ylabel="Force, rms [N]", xlabel=speed)
            axes[1].set(title=bearing_names(response)[bearing], ylabel="Force, rms [N]", xlabel=speed)
    return figure


def _course(axes: Panel, course: Course, force: np.ndarray, colour: str, label: str | None) -> None:
    if not course.period:
        axes.plot(course.speeds_rpm, force, "o", ms=2.5, mfc="none", color=colour, label=label)
        return
    axes.plot(course.speeds_rpm, np.where(course.stable, force, np.nan), color=colour, lw=1.4, label=label)
    axes.plot(course.speeds_rpm, np.where(course.stable, np.nan, force), ".", ms=1.5, color=colour)


def parting_rows(responses: Sequence[LoadResponse]) -> list[Data]:
    """Return the rows of `parting.csv`: each point of each branch and run."""
    rows = list[Data]()
    for response, found in ((one, one.parting) for one in responses if one.parting):
        for course in found.courses:
            for place, speed in enumerate(course.speeds_rpm.tolist()):
                rows.append({
                    "load": response.solved.load.name, "motion": course.name, "speed_rpm": speed,
                    "period_mesh_cycles": course.period or None, "stable": bool(course.stable[place]),
                    **{f"mesh {response.mesh_names[number]}, {key}": float(course.meshes[place, n, k])
                       for n, number in enumerate(found.numbers) for k, key in enumerate(TOLD)},
                    **{f"bearing {name}, rms_N": float(course.bearings[place, n])
                       for n, name in enumerate(bearing_names(response))},
                })  # fmt: skip
    return rows


def parting_arrays(response: LoadResponse) -> dict[str, np.ndarray]:
    """Return the arrays of a load in `results.h5`; none where no flanks part."""
    courses = response.parting.courses if response.parting else ()
    if not courses:
        return {}
    meshes = np.concatenate([course.meshes for course in courses])
    return {
        "nonlinear/speed": np.concatenate([course.speeds_rpm for course in courses]),
        "nonlinear/branch": np.concatenate([np.full(len(c.stable), n) for n, c in enumerate(courses)]),
        "nonlinear/stable": np.concatenate([course.stable for course in courses]),
        "nonlinear/bearing_force": np.concatenate([course.bearings for course in courses]),
        **{f"nonlinear/{key.removesuffix('_N').removesuffix('_um')}": meshes[..., n] for n, key in enumerate(TOLD)},
    }  # fmt: skip
