"""One stage of a gearbox: which gear drives, on which flank, under which torque, and where the gears are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.errors import CaseError
from pmor.rexs.drive import drives
from pmor.rexs.joints import RING, axis_of, shafts_of, stages, turning_together
from pmor.rexs.model import Component, Gearbox

# Sine of the angle between axes that count as parallel.
PARALLEL = 1e-6


# Of a stage whose wheel is off its place: names of ours, with a key of the case.
OFF_PLACE = "custom_pmor_misalignment_"
# Of a stage, a name of ours: which flanks of its case carry, drive or coast. REXS has left and right flanks alone.
CARRYING = "custom_pmor_carrying_flanks"


@dataclass(frozen=True)
class Stage:
    """A stage with two cylindrical gears, of which one may be a ring: then that is the wheel, whichever drives.

    Parameters
    ----------
    pinion, wheel : Component
        The driving gear, and the driven one.
    torques_Nm : tuple of float
        Of the load cases on the driving gear, ascending; none where the file does not say.
    loaded : str
        Flank of the driving gear that carries, "left" or "right", seen from its datum face with the tip up.
    loaded_known : bool
        Whether the file says so.
    coast : bool
        Whether the loaded flanks are those of coast: then z of the case looks along the datum face all the same.
    notes : tuple of str
        Assumptions.
    """

    component: Component
    pinion: Component
    wheel: Component
    torques_Nm: tuple[float, ...]
    loaded: str
    loaded_known: bool
    notes: tuple[str, ...]
    coast: bool = False


def find_stage(gearbox: Gearbox, wanted: int | None, where: str) -> Stage:
    """Find a stage by its number; the only one by default.

    Raises
    ------
    CaseError
        When there is none, or several to choose from.
    """
    found = stages(gearbox)
    listed = ", ".join(f"{number} ({_teeth(a)}/{_teeth(b)} teeth)" for number, (a, b) in sorted(found.items()))
    if not found:
        raise CaseError(f"{where}: has no stage of two cylindrical gears: nothing to make a case of")
    if wanted is None and len(found) > 1:
        raise CaseError(f"{where}: has several stages: pass stage=N: {listed}")
    number = next(iter(found)) if wanted is None else wanted
    if number not in found:
        raise CaseError(f"{where}: stage {number}: there is no such stage of cylindrical gears: choose from {listed}")
    torques, drivers, notes = _torques(gearbox, found)
    one, two = found[number]
    pinion, wheel = (two, one) if drivers.get(number, one.number) == two.number else (one, two)
    if pinion.kind == RING:
        pinion, wheel = wheel, pinion
    coast = gearbox.components[number].text_of(CARRYING) == "coast"
    flanks = {data.text_of("loaded_tooth_flank") for data in _gear_data(gearbox, number, pinion)} & {"left", "right"}
    said, known = "right" if coast else min(flanks, default="left"), coast or len(flanks) == 1
    return Stage(
        gearbox.components[number], pinion, wheel, tuple(sorted(torques.get(pinion.number, ()))),
        said, known, tuple(notes.get(number, ())), coast,
    )  # fmt: skip


def middle_on_shaft(gearbox: Gearbox, gear: Component, shaft: Component) -> float | None:
    """Return where the middle of a gear's face is along its shaft, mm; None where the file does not say it.

    Where both stand in space says it; else `u_coordinate_on_shaft`, which is the middle of a gear, and in REXS 1.0 the
    beginning of its face.
    """
    place, foot = gear.numbers_of("support_vector"), shaft.numbers_of("support_vector")
    if len(place) == len(foot) == 3:
        return float(np.dot(np.subtract(place, foot), axis_of(shaft)))
    along, width = gear.number_of("u_coordinate_on_shaft"), gear.number_of("face_width")
    if gearbox.version != "1.0" or along is None:
        return along
    return None if width is None else along + 0.5 * width


def face_middle(gearbox: Gearbox, gear: Component, along: list[float]) -> float | None:
    """Return where the middle of a gear's face is along an axis, mm; None where the file does not say it."""
    place = gear.numbers_of("support_vector")
    for shaft in shafts_of(gearbox, gear):
        foot, on_shaft = shaft.numbers_of("support_vector"), middle_on_shaft(gearbox, gear, shaft)
        if len(place) != 3 and len(foot) == 3 and on_shaft is not None:
            place = [f + on_shaft * a for f, a in zip(foot, axis_of(shaft), strict=True)]
    return sum(m * a for m, a in zip(place, along, strict=True)) if len(place) == 3 else None


def axes_apart(gearbox: Gearbox, pair: tuple[Component, Component]) -> float | None:
    """Return the distance of the axes of two gears in space, mm; None where the file does not say it, or they cross."""
    places = list[list[float]]()
    for gear in pair:
        parts = gear, *shafts_of(gearbox, gear)
        places.append(next((place for part in parts if len(place := part.numbers_of("support_vector")) == 3), []))
    one, other = (np.array(axis_of(gear)) for gear in pair)
    if not all(places) or np.linalg.norm(np.cross(one, other)) > PARALLEL:
        return None
    return float(np.linalg.norm(np.cross(np.subtract(places[1], places[0]), one))) or None


def _teeth(gear: Component) -> str:
    teeth = gear.whole_number_of("number_of_teeth")
    return "?" if teeth is None else str(teeth)


def _gear_data(gearbox: Gearbox, stage: int, gear: Component) -> list[Component]:
    """Data of a gear in a stage: for all load cases, and for each."""
    for relation in gearbox.relations:
        parts = relation.role("stage"), relation.role("gear"), relation.role("stage_gear_data")
        if relation.kind == "stage_gear_data" and parts[:2] == (stage, gear.number) and parts[2] is not None:
            found = (one.get(parts[2]) for one in (gearbox.components, *gearbox.load_cases))
            return [data for data in found if data is not None]
    return []


def _torques(
    gearbox: Gearbox, found: dict[int, tuple[Component, Component]]
) -> tuple[dict[int, set[float]], dict[int, int], dict[int, dict[str, None]]]:
    """Torques of the load cases by gear, N m; the driving gear of each stage; notes on stages.

    Torques given for gears in stages are taken; else the torque that enters at a shaft goes on from stage to stage
    without losses. Meshes that leave a shaft share its torque equally where their teeth are alike.
    """
    torques, drivers, notes = dict[int, set[float]](), dict[int, int](), dict[int, dict[str, None]]()
    for number, pair in found.items():
        for gear in pair:
            for data in _gear_data(gearbox, number, gear):
                if data.text_of("is_driving_gear") == "true":
                    drivers[number] = gear.number
                if said := data.number_of("torque"):
                    torques.setdefault(gear.number, set()).add(abs(said))
    given, passed = set(torques), dict[int, set[float]]()
    train = turning_together(gearbox)
    shaft_of = {
        gear.number: train[shaft.number]
        for pair in found.values() for gear in pair for shaft in shafts_of(gearbox, gear)
    }  # fmt: skip
    said_once = dict[str, None]()
    for loads in gearbox.load_cases or ({},):
        entering = dict[int, float]()
        for one in drives(gearbox, loads):
            if one.torque_Nm:
                shaft = train[one.shaft.number]
                entering[shaft] = entering.get(shaft, 0.0) + abs(one.torque_Nm)
            said_once |= {one.note: None} if one.note else {}
        for shaft, torque in entering.items():
            _pass_on(shaft, torque, found, shaft_of, passed, drivers, notes)
    for number in found:
        notes[number] = said_once | notes.get(number, {})
    return {**passed, **{gear: torques[gear] for gear in given}}, drivers, notes


def _pass_on(
    shaft: int, torque: float, found: dict[int, tuple[Component, Component]], shaft_of: dict[int, int],
    torques: dict[int, set[float]], drivers: dict[int, int], notes: dict[int, dict[str, None]],
) -> None:  # fmt: skip
    reached, waiting = {shaft}, [(shaft, torque)]
    while waiting:
        here, torque = waiting.pop()
        leaving = [
            (number, gear, mate, shaft_of[mate.number])
            for number, pair in found.items() for gear, mate in (pair, pair[::-1])
            if shaft_of.get(gear.number) == here and shaft_of.get(mate.number, here) not in reached
        ]  # fmt: skip
        teeth = [(gear.whole_number_of("number_of_teeth"), mate.whole_number_of("number_of_teeth"))
                 for _, gear, mate, _ in leaving]  # fmt: skip
        alike, count = len(set(teeth)) == 1, len(leaving)
        for (number, gear, _, there), (own, other) in zip(leaving, teeth, strict=True):
            drivers.setdefault(number, gear.number)
            reached.add(there)
            if count > 1:
                unknown = "how its torque divides is not said: write that of this stage into [load] torque_Nm"
                how = f"each takes 1/{count} of its torque" if alike else unknown
                notes.setdefault(number, {})[f"shaft {here} drives {count} meshes: {how}"] = None
            if alike and own and other:
                torques.setdefault(gear.number, set()).add(float(f"{torque / count:.12g}"))
                waiting.append((there, torque / count * other / own))
