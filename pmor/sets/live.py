"""The live page of a set: all its meshes, and what its gears stand on, as plain numbers, with sliders of its errors.

What a reader may change moves gaps alone: the torque, flanks, pins and gears off their places. What gears stand on
stays as it is.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from pmor.case.capability import why_not
from pmor.core.arrays import FloatArray
from pmor.gear.condition import ALIGNED
from pmor.pair.conditions import assembly_of
from pmor.report.live.model import live_model, packed_far, packed_support, tooth_deviation
from pmor.report.live.section import (
    Control,
    LiveSection,
    live_mesh,
    rounded,
    section_data,
    torque_control,
    written_curve,
)
from pmor.report.page import Heading
from pmor.sets.bounds import floats, room_of_axes
from pmor.sets.loader import SetFile
from pmor.sets.lost import known
from pmor.sets.plan import with_errors
from pmor.sets.shafts import shaft_of
from pmor.sets.solution import SetSolution

# Angles that the page solves at most, of many sections as many as take a second or two, by the cube of their number;
# and at least.
MOST_ANGLES, MOST_WORK, LEAST_ANGLES = 240, 1.5e10, 6
# Ends of sliders: um, and mrad of a gear on its shaft; over the errors of the file.
LEAST_ERROR, LEAST_TIMING, BEYOND_FILE = 50.0, 0.5, 2.0
# Of the module: changes of a centre distance that are looked at.
MOST_ROOM = 0.5
MODEL = (
    "The page carries the compliance of all members and what they stand on, and solves all meshes at once as a slider "
    "moves: the same equations as the run."
)
PITCH = (
    "Gears that are off their axes turn: the page solves mesh cycles from the chosen one on, and K_γ is that of these."
)


@dataclass(frozen=True)
class _Error:
    """An error with a slider, and what the solver does with it.

    Parameters
    ----------
    section, key : str
        Of the file.
    place : int, str or None
        In the list of all planets, or the name of a gear on a fixed axis.
    ends : (float, float, float)
        Of the slider, and its step.
    """

    group: str
    label: str
    section: str
    key: str
    place: int | str | None
    value: float
    ends: tuple[float, float, float]
    data: dict[str, Any]


def live_blocks(file: SetFile, solved: SetSolution) -> list[Heading | LiveSection | str]:
    """Return the blocks of the page that solve the set."""
    why = why_not(file, "page")
    return [Heading("Change the set"), f"Left out: {why}." if why else set_section(file, solved)]


def set_section(file: SetFile, solved: SetSolution) -> LiveSection:
    """Return the section of a set, which begins as it was solved under its nominal torque."""
    plan, nominal, kinds = solved.plan, int(np.argmin(np.abs(solved.torque_Nm - file.plan.torque_Nm))), list(file.cases)
    most = _most_angles(solved)
    angles = min(solved.angles_per_pitch, most)
    pitches = min(plan.cycle, max(most // angles, 1))
    points = np.stack([np.degrees(solved.phi_rad), solved.ste_um[nominal]], axis=1)[: pitches * solved.angles_per_pitch]
    ste, curve = abs(known(np.mean, solved.ste_um[nominal])), written_curve(points)
    meshes = [_kind(file, solved, name, ste, curve) for name in kinds]
    errors = list(_trained_errors(file, solved) if file.sections.gears else _planetary_errors(file, solved))
    amounts = [float(f"{torque:.12g}") for torque in solved.torque_Nm * plan.nominal_Nm / plan.torque_Nm]
    for _, data in meshes if len(amounts) > 1 else ():
        data["limits"]["torque_Nm"] = [min(amounts), max(amounts)]
    setting = {"torque_Nm": amounts[nominal], "load": 0, "pitch": 0, "errors": [error.value for error in errors]}
    train = {
        "angles": angles, "pitches": pitches, "repeats": pitches % plan.cycle == 0, "cycle": plan.cycle,
        "step": plan.cycle if pitches == plan.cycle else 1,
        "torques": _torques(file), "count": file.sections.planets.count, "per_torque": plan.torque_Nm / plan.nominal_Nm,
        "errors": [error.data for error in errors], "toml": [_in_file(error) for error in errors],
        "still": (plan.displacement - _by_sliders(errors)).tolist(), "eccentric": _turning(errors),
        **_train_data(file, solved, kinds),
    }  # fmt: skip
    names = solved.mesh_names if plan.planets else [f"{n}: {name}" for n, name in enumerate(solved.mesh_names, start=1)]
    return LiveSection(
        tuple(_controls(file, solved, errors, amounts[nominal], amounts, train["step"])),
        tuple(mesh for mesh, _ in meshes),
        tuple((name, kinds.index(mesh.case)) for name, mesh in zip(names, plan.meshes, strict=True)),
        section_data([data for _, data in meshes], setting, train=train),
        " ".join([MODEL, PITCH, *_notes(solved, angles, pitches)]),
    )


def _most_angles(solved: SetSolution) -> int:
    """Angles that the page solves at most; beyond a mesh cycle of these it solves the first cycles."""
    size = sum(mesh.pair.size for mesh in solved.train.meshes)
    return max(min(MOST_ANGLES, int(MOST_WORK / size**3)), LEAST_ANGLES)


def _controls(
    file: SetFile, solved: SetSolution, errors: Sequence[_Error], torque_Nm: float, amounts: Sequence[float],
    step: int,
) -> Iterator[Control]:  # fmt: skip
    load = file.sections.load
    member = file.sections.gears[0].name if load is None else load.on
    amount = ", amount" if load is not None and load.torque_Nm < 0.0 else ""
    yield torque_control(f"torque on the {member}{amount}, N m", torque_Nm, amounts)
    last = max(solved.pitches, abs(solved.train.meshes[0].pair.meshed.pair.pinion.teeth)) - 1
    if last >= step:
        yield Control("load", "pitch", "first mesh cycle that is shown", "0", 0.0, last // step * step, step)
    for number, error in enumerate(errors):
        yield Control(error.group, str(number), error.label, f"{error.value:.12g}", *error.ends)


def _torques(file: SetFile) -> list[str]:
    """Lines of the file that say the torque, whose amount is left open."""
    load = file.sections.load
    if load is None:
        return [f"# Torques of [[gears]]: as {{}} N m on {file.sections.gears[0].name}, in the ratio of the file", ""]
    return ["[load]", f'on = "{load.on}"', f"torque_Nm = {'-' if load.torque_Nm < 0.0 else ''}{{}}", ""]


def _in_file(error: _Error) -> dict[str, Any]:
    """Where an error is in the file: of which section, of what name, in which place of a list."""
    named = isinstance(error.place, str)
    return {"section": error.section, "name": error.place if named else None, "key": error.key,
            "place": None if named else error.place}  # fmt: skip


def _kind(file: SetFile, solved: SetSolution, name: str, ste_um: float, curve: list[list[float]]) -> Any:
    """A mesh of a kind in the section, and its data: what differs from tooth to tooth is of the meshes."""
    number = next(n for n, mesh in enumerate(solved.plan.meshes) if mesh.case == name)
    mesh, case = solved.train.meshes[number], file.cases[name]
    bodies = [solved.train.bodies[body] for body in mesh.bodies]
    far, supports = [body.far for body in bodies], [body.support for body in bodies]
    model = live_model(mesh.pair, assembly_of(case).alike, solved.angles_per_pitch, far, supports)
    pinion, wheel = (solved.plan.bodies[body].member for body in mesh.bodies)
    return live_mesh(name, case, mesh.pair.meshed, model, ste_um, [curve], (pinion, wheel))


def _train_data(file: SetFile, solved: SetSolution, kinds: Sequence[str]) -> dict[str, Any]:
    """Bodies, meshes and movements as the solver takes them."""
    train, plan = solved.train, solved.plan
    joined, cycles = train.joined, train.mesh_cycles(1)
    pairs = {mesh.case: of.pair.meshed.pair for mesh, of in zip(plan.meshes, train.meshes, strict=True)}
    room = {name: room_of_axes(file.cases[name], pair, MOST_ROOM * pair.pinion.module) for name, pair in pairs.items()}
    floating, meshes = floats(plan), list[dict[str, Any]]()
    for number, (mesh, of_plan) in enumerate(zip(train.meshes, plan.meshes, strict=True)):
        image = [int(mesh.image != train.bodies[body].image) for body in mesh.bodies]
        teeth = mesh.pair.meshed.deviations(mesh.assembly.of_teeth) if mesh.assembly.uneven else ()
        meshes.append({
            "model": kinds.index(of_plan.case), "bodies": list(mesh.bodies), "image": image,
            "to_train": mesh.to_train.ravel().tolist(), "start": mesh.start, "rate": mesh.rate,
            "first_tooth": list(mesh.first_tooth), "cycles": float(cycles[number]),
            "ahead": joined.ahead[number].tolist(), "share": joined.share[number].tolist(),
            "teeth": [tooth_deviation(flank) for flank in teeth],
        })  # fmt: skip
    for data, of_plan in zip(meshes, plan.meshes, strict=True):
        one, other = plan.bodies[of_plan.pinion], plan.bodies[of_plan.wheel]
        free = floating[[of_plan.pinion, of_plan.wheel]].any()
        data |= {"name": f"{one.name} - {other.name}", "between": [other.x - one.x, other.y - one.y],
                 "room": None if free else room[of_plan.case]}  # fmt: skip
    shafts, housing = shaft_of(plan.bodies), plan.in_housing
    planets = [
        {"name": plan.bodies[on].name, "bodies": [body for body, shaft in enumerate(shafts) if shaft == on],
         "around": _around(plan.bodies[on].x, plan.bodies[on].y)} for on in plan.planets
    ]  # fmt: skip
    return {
        "aligned": asdict(ALIGNED), "driver": plan.driver, "load": plan.load.tolist(), "free": train.free.tolist(),
        "root": train.support_root.tolist(), "rates": train.rates.tolist(), "meshes": meshes, "planets": planets,
        "beside": solved.beside, "sides": [math.copysign(1.0, pairs[name].centre_distance) for name in kinds],
        "bodies": [
            {"teeth": body.teeth, "far": packed_far(body.far), "support": packed_support(body.support)}
            for body in train.bodies
        ],
        "housing": housing and {
            "body": housing.housing, "real": housing.displacement.real.tolist(),
            "imaginary": housing.displacement.imag.tolist(),
        },
    }  # fmt: skip


def _around(x: float, y: float) -> list[float]:
    return [-y / math.hypot(x, y), x / math.hypot(x, y)]


def _planetary_errors(file: SetFile, solved: SetSolution) -> Iterator[_Error]:
    """Pins off their places, and gears off their axes."""
    said, plan = file.sections, solved.plan
    there = [number for number in range(said.planets.count) if number + 1 not in said.planets.missing]
    stepped = any(body.on is not None for body in plan.bodies)
    kinds = {"tangential_um": "tangential, µm", "radial_um": "radial, µm"}
    kinds |= {"timing_mrad": "second gear ahead, mrad"} if stepped else {}
    for key, label in kinds.items():
        given = getattr(said.planets, key) or (0.0,) * said.planets.count
        ends = _ends(given, LEAST_TIMING if key == "timing_mrad" else LEAST_ERROR)
        for number in there:
            alone = tuple(float(n == number) for n in range(said.planets.count))
            none = dict.fromkeys(kinds, ()) | {key: alone}
            unit = with_errors(plan, replace(said, planets=replace(said.planets, **none))).displacement  # type: ignore[arg-type]
            yield _Error("pins", f"planet {number + 1}, {label}", "planets", key, number, given[number], ends,
                         {"unit": unit.tolist()})  # fmt: skip
    off = said.eccentricity
    for body, member in enumerate(("sun", "ring")):
        yield from _eccentric(plan.clockwise, member, body, 0.0, getattr(off, f"{member}_um"),
                              getattr(off, f"{member}_deg"), ("eccentricity", f"{member}_", None))  # fmt: skip
    amounts, directions = off.planets_um or (0.0,) * said.planets.count, off.planets_deg or (0.0,) * said.planets.count
    for body, number in zip(plan.planets, there, strict=True):
        outwards = math.degrees(math.atan2(-plan.bodies[body].x, plan.bodies[body].y))
        yield from _eccentric(plan.clockwise, f"planet {number + 1}", body, outwards, amounts[number],
                              directions[number], ("eccentricity", "planets_", number))  # fmt: skip


def _trained_errors(file: SetFile, solved: SetSolution) -> Iterator[_Error]:
    """Gears of a train off their axes, and ahead of their places on a shaft."""
    for body, gear in enumerate(file.sections.gears):
        if gear.shaft is not None:
            alone = tuple(replace(one, timing_mrad=float(one is gear)) for one in file.sections.gears)
            unit = with_errors(solved.plan, replace(file.sections, gears=alone)).displacement
            ends = _ends([gear.timing_mrad], LEAST_TIMING)
            yield _Error("pins", f"{gear.name} ahead on its shaft, mrad", "[gears]", "timing_mrad", gear.name,
                         gear.timing_mrad, ends, {"unit": unit.tolist()})  # fmt: skip
        yield from _eccentric(solved.plan.clockwise, gear.name, body, 0.0, gear.eccentricity_um,
                              gear.eccentricity_deg, ("[gears]", "eccentricity_", gear.name))  # fmt: skip


def _eccentric(
    clockwise: bool, name: str, body: int, outwards_deg: float, amount: float, direction: float,
    place: tuple[str, str, int | str | None],
) -> Iterator[_Error]:  # fmt: skip
    """Amount and direction of the eccentricity of a gear; the solver takes them together."""
    section, key, number = place
    _, most, step = _ends([amount], LEAST_ERROR)
    turning = {"body": body, "from": outwards_deg, "side": -1.0 if clockwise else 1.0}
    yield _Error("eccentricity", f"{name}, µm", section, f"{key}um", number, amount, (0.0, most, step),
                 {"turning": turning})  # fmt: skip
    yield _Error("eccentricity", f"{name}, its direction, deg", section, f"{key}deg", number, direction,
                 (-360.0, 360.0, 1.0), {})  # fmt: skip


def _ends(values: Sequence[float], least: float) -> tuple[float, float, float]:
    most = rounded(max(least, *(BEYOND_FILE * abs(value) for value in values)))
    return -most, most, most / 100.0


def _by_sliders(errors: Sequence[_Error]) -> FloatArray:
    """Displacement of all hubs by the errors of the file that have a slider."""
    return np.sum([error.value * np.array(error.data["unit"]) for error in errors if "unit" in error.data], axis=0)


def _turning(errors: Sequence[_Error]) -> list[dict[str, Any]]:
    """Eccentric gears, with the numbers of the errors that say amount and direction."""
    return [
        {**error.data["turning"], "amount": number, "direction": number + 1}
        for number, error in enumerate(errors) if "turning" in error.data
    ]  # fmt: skip


def _notes(solved: SetSolution, angles: int, pitches: int) -> Iterator[str]:
    cycle, of_run = solved.plan.cycle, solved.angles_per_pitch
    if angles < of_run:
        yield f"The page solves {angles} angles to a mesh cycle, the run {of_run}."
    if pitches < cycle:
        yield f"The set repeats after {cycle} mesh cycles, of which the page solves {pitches}: there are no orders."
    if solved.train.meshes[0].pair.meshed.mirrored:
        yield 'Half the width stands for the whole: for sliders of the helix write [mesh] width = "whole".'
    if solved.plan.clockwise:
        yield "The first gear is loaded clockwise: angles count clockwise."
    if any(mesh.assembly.uneven for mesh in solved.train.meshes):
        yield "What differs from tooth to tooth stays as it is in the file."
