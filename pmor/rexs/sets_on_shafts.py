"""Planetary stages of a REXS file on the shafts of its gearbox."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pmor.core.errors import printable
from pmor.machine.checks import names_a_file
from pmor.rexs.joints import joints, shafts_of, stages
from pmor.rexs.model import BEARINGS, Component, Gearbox
from pmor.rexs.set_supports import RexsSupports, cheek_of, on_casing
from pmor.rexs.sets import STAGE, PlanetaryStage
from pmor.sets.settings import Member

# Of a gear on a shaft that it joins elsewhere, along this shaft: a name of ours.
JOINED_AT = "custom_pmor_joined_at"


@dataclass(frozen=True)
class StageOnShafts:
    """A planetary stage as its gearbox has it.

    Parameters
    ----------
    name : str
        Of the set.
    stage : PlanetaryStage
        With its gears; each of its texts is read anew.
    seats : mapping of str to (Component, float)
        Of the members that turn: their shafts, and places along these, mm.
    own : set of int
        Shafts that are parts of the stage: of planets, pins, the member that is held; of the carrier, without bearings.
    bridges : tuple of (Component, float, Component)
        Further shafts of a carrier that stands on several: the shaft, the place of its cheek, mm, and the first shaft.
    """

    name: str
    stage: PlanetaryStage
    seats: dict[Member, tuple[Component, float]]
    own: set[int]
    bridges: tuple[tuple[Component, float, Component], ...] = ()


def stage_names(gearbox: Gearbox) -> dict[int, str]:
    """Return what meshes and sets of a gearbox are called, by the numbers of their stages.

    The name of the stage, where files may have it, no other stage has it, and it says more than kind and number.
    """
    found = [*(gearbox.components[number] for number in stages(gearbox)), *gearbox.of_kind(STAGE)]
    by_number, names = {one.number: f"stage_{one.number}" for one in found}, Counter(one.name for one in found)
    own = {
        one.number: one.name for one in found
        if names_a_file(one.name) and printable(one.name) == one.name and names[one.name] == 1
        and f"[{one.number}]" not in one.name and one.name not in by_number.values()
    }  # fmt: skip
    return by_number | own


def stages_on_shafts(gearbox: Gearbox, path: Path, note: Callable[[str], None]) -> list[StageOnShafts]:
    """Return all planetary stages of a gearbox.

    Raises
    ------
    CaseError
        When the file does not say enough of one.
    """
    names = stage_names(gearbox)
    return [
        _on_shafts(names[part.number], PlanetaryStage(gearbox, path, part), note) for part in gearbox.of_kind(STAGE)
    ]


def _on_shafts(name: str, stage: PlanetaryStage, note: Callable[[str], None]) -> StageOnShafts:
    gearbox, shafts, held = stage.gearbox, stage.member_shafts(), stage.held()
    own = {shaft.number for planet in stage.planets for shaft in shafts_of(gearbox, planet)}
    own |= {relation.role("shaft") or 0 for relation in gearbox.relations
            if relation.kind == "planet_pin" and relation.role(STAGE) == stage.stage.number}  # fmt: skip
    own |= {shaft.number for shaft in shafts[held]}
    along = RexsSupports(gearbox, stage.path, [], 1).along
    seats: dict[Member, tuple[Component, float]] = {}
    bridges = list[tuple[Component, float, Component]]()
    gears: dict[Member, Component] = {"sun": stage.sun, "ring": stage.ring}
    for member, gear in gears.items():
        if member != held:
            joined = gear.number_of(JOINED_AT)
            seats[member] = shafts[member][0], along(gear, shafts[member][0]) if joined is None else joined
    if held != "carrier":
        borne, cheeks = _carrier(stage, shafts["carrier"])
        seats["carrier"] = borne[0], along(cheeks[0], borne[0])
        bridges = [(shaft, along(cheek, shaft), borne[0]) for shaft, cheek in zip(borne[1:], cheeks[1:], strict=True)]
        for shaft, _, first in bridges:
            note(f"{shaft.label} and {first.label}: the carrier between them is rigid")
        bare = [shaft for shaft in shafts["carrier"] if shaft not in borne]
        between = {other for shaft in shafts["carrier"] for _, other in joints(gearbox, shaft)}
        bare += [gearbox.components[n] for n in between if n in gearbox.components and not _borne(gearbox, n)]
        for part in bare:
            if part.kind == "shaft":
                own.add(part.number)
                note(f"{part.label}: without bearings: a part of the carrier, which is rigid but for its wind-up")
    return StageOnShafts(name, stage, seats, own, tuple(bridges))


def _carrier(stage: PlanetaryStage, shafts: list[Component]) -> tuple[list[Component], list[Component]]:
    """Return the shafts in bearings that the carrier stands on, and what joins its cheeks to them."""
    on = {shaft.number: len(on_casing(stage.gearbox, shaft)) for shaft in shafts}
    borne = sorted((shaft for shaft in shafts if _borne(stage.gearbox, shaft.number)), key=lambda one: -on[one.number])
    if not borne:
        rule = "no shaft of its carrier has bearings: write a gearbox file with [[sets]], which names one"
        raise stage.stage.refusal(rule)
    cheeks = [cheek_of(stage.gearbox, shaft) for shaft in borne]
    if None in cheeks:
        raise borne[cheeks.index(None)].refusal("is joined to no side_plate: where is the carrier on it?")
    return borne, [cheek for cheek in cheeks if cheek is not None]


def _borne(gearbox: Gearbox, number: int) -> bool:
    """Whether a shaft stands in bearings."""
    return any(joint.kind in BEARINGS for joint, _ in joints(gearbox, gearbox.components[number]))
