"""Planetary stages of a REXS file on the shafts of its gearbox."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pmor.core.errors import CaseError
from pmor.export.rexs.joints import joints
from pmor.export.rexs.model import BEARINGS, Component, Gearbox
from pmor.sets.rexs import STAGE, PlanetaryStage
from pmor.sets.rexs_supports import RexsSupports, cheek_of
from pmor.sets.settings import Member


@dataclass(frozen=True)
class StageOnShafts:
    """A planetary stage as its gearbox has it.

    Parameters
    ----------
    stage : PlanetaryStage
        With its gears; each of its texts is read anew.
    seats : mapping of str to (Component, float)
        Of the members that turn: their shafts, and places along these, mm.
    own : set of int
        Shafts that are parts of the stage: of planets, pins, the member that is held; of the carrier, without bearings.
    """

    stage: PlanetaryStage
    seats: dict[Member, tuple[Component, float]]
    own: set[int]

    @property
    def name(self) -> str:
        """Of the set."""
        return f"stage_{self.stage.stage.number}"


def stages_on_shafts(gearbox: Gearbox, path: Path, note: Callable[[str], None]) -> list[StageOnShafts]:
    """Return all planetary stages of a gearbox.

    Raises
    ------
    CaseError
        When the file does not say enough of one, or has a carrier on two shafts.
    """
    return [_on_shafts(PlanetaryStage(gearbox, path, part), note) for part in gearbox.of_kind(STAGE)]


def _on_shafts(stage: PlanetaryStage, note: Callable[[str], None]) -> StageOnShafts:
    gearbox, shafts, held = stage.gearbox, stage.member_shafts(), stage.held()
    own = {shaft.number for planet in stage.planets for shaft in stage.shafts(planet)}
    own |= {relation.role("shaft") or 0 for relation in gearbox.relations
            if relation.kind == "planet_pin" and relation.role(STAGE) == stage.stage.number}  # fmt: skip
    own |= {shaft.number for shaft in shafts[held]}
    along = RexsSupports(gearbox, stage.path, [], 1).along
    seats: dict[Member, tuple[Component, float]] = {}
    gears: dict[Member, Component] = {"sun": stage.sun, "ring": stage.ring}
    for member, gear in gears.items():
        if member != held:
            seats[member] = shafts[member][0], along(gear, shafts[member][0])
    if held != "carrier":
        carrier, cheek = _carrier(stage, shafts["carrier"])
        seats["carrier"] = carrier, along(cheek, carrier)
        bare = [shaft for shaft in shafts["carrier"] if shaft is not carrier]
        between = {other for shaft in shafts["carrier"] for _, other in joints(gearbox, shaft)}
        bare += [gearbox.components[n] for n in between if n in gearbox.components and not _borne(gearbox, n)]
        for part in bare:
            if part.kind == "shaft":
                own.add(part.number)
                note(f"{part.label}: without bearings: a part of the carrier, which is rigid but for its wind-up")
    return StageOnShafts(stage, seats, own)


def _carrier(stage: PlanetaryStage, shafts: list[Component]) -> tuple[Component, Component]:
    """Return the shaft that the carrier stands on, and what joins its cheek to it."""
    borne = [shaft for shaft in shafts if _borne(stage.gearbox, shaft.number)]
    if len(borne) != 1:
        count = "no shaft of its carrier has" if not borne else "both shafts of its carrier have"
        rule = f"{count} bearings: it is read where one has: write a gearbox file with [[sets]]"
        raise stage.refuse(stage.stage, rule)
    cheek = cheek_of(stage.gearbox, borne[0])
    if cheek is None:
        raise stage.refuse(borne[0], "is joined to no side_plate: where is the carrier on it?")
    return borne[0], cheek


def _borne(gearbox: Gearbox, number: int) -> bool:
    """Whether a shaft stands in bearings."""
    return any(joint.kind in BEARINGS for joint, _ in joints(gearbox, gearbox.components[number]))


def refuse_bearing(path: Path, bearing: Component) -> CaseError:
    """Return the error of a bearing in a part of a stage that is no shaft of its own."""
    rule = "stands in a part of the carrier that is no shaft of its own: write a gearbox file with [[sets]]"
    return CaseError(f"{path}: {bearing.label}: {rule}")
