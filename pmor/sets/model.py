"""From the cases of the meshes to a train that can be solved: each member's finite elements once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from pmor.body.far_compliance import FarTeeth
from pmor.body.flank_compliance import SolvedGear
from pmor.body.root_stress import other_hand
from pmor.case import Case, GearCase
from pmor.case.blank import HolesCase
from pmor.core.arrays import FloatArray
from pmor.core.threads import in_order
from pmor.fe.sector import SectorMesh
from pmor.gear.condition import Assembly
from pmor.line.layered_pair import LayeredPair, as_layered
from pmor.line.pair import LinePair, line_compliance_between
from pmor.line.sections import loaded_components
from pmor.line.several import GearTrain
from pmor.line.train import TrainBody, TrainMesh
from pmor.pair.conditions import assembly_of
from pmor.pair.model import mesh_model
from pmor.sets.kinematics import Centre, Meeting, Placement, placements
from pmor.storage.gear_store import KeptGear, not_kept
from pmor_offline.gears import line_gear

# Of a tooth.
ROUNDING = 1e-6


@dataclass(frozen=True)
class SetBody:
    """A gear of a set.

    Parameters
    ----------
    name : str
    member : str
        Gears of one member are equal, and solved once.
    x, y : float
        Place of its axis, mm.
    z : float
        Of its mid width, mm.
    on : int or None
        Number of the gear before, on the same shaft, that stands for it; None of that one and of single gears.
    direction : float
        That the places of its holes count from, counter-clockwise from the y axis, rad.
    """

    name: str
    member: str
    x: float
    y: float
    z: float = 0.0
    on: int | None = None
    direction: float = 0.0

    @property
    def centre(self) -> Centre:
        """Its axis."""
        return Centre(self.name, self.x, self.y, self.member, self.on)


@dataclass(frozen=True)
class SetMesh:
    """A mesh of a set: its case, and the numbers of the bodies that are pinion and wheel; the pinion drives.

    Parameters
    ----------
    assembly : Assembly or None
        Flanks of both gears; None is that of the case.
    """

    case: str
    pinion: int
    wheel: int
    assembly: Assembly | None = None


@dataclass(frozen=True)
class _Use:
    """A member as a gear of a case: 0 its pinion, 1 its wheel; in the image or not."""

    case: str
    gear: int
    image: bool


def build_train(
    cases: Mapping[str, Case], bodies: Sequence[SetBody], meshes: Sequence[SetMesh], free: FloatArray,
    compliance: FloatArray, kept: KeptGear = not_kept, executor: Executor | None = None,
    placed: Sequence[Placement] | None = None,
) -> GearTrain:  # fmt: skip
    """Solve the finite elements of all members, and put a train together.

    Parameters
    ----------
    cases : mapping of str to Case
        Of the meshes, in the frame of each pair: of line contact.
    free, compliance : ndarray
        As in `pmor.line.several.GearTrain`.
    kept : callable
        Where gears are kept.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out the members.
    placed : sequence of Placement, optional
        How the meshes stand; by default each pinion drives, and the first one counter-clockwise.

    Raises
    ------
    CaseError, GeometryError, MeshError
    """
    models = {name: mesh_model(case) for name, case in cases.items()}
    meetings = [Meeting(models[mesh.case].meshed.pair, mesh.pinion, mesh.wheel) for mesh in meshes]
    placed = placed or placements([body.centre for body in bodies], meetings)
    uses = _uses(bodies, meshes, placed)
    # A gear that has flanks of both sides in mesh is modelled as it is, another one as its meshes see it.
    own = {member: min(found, key=lambda use: use.image) for member, found in uses.items()}
    sectors = {member: (models[use.case].pinion, models[use.case].wheel)[use.gear] for member, use in own.items()}

    def standing(member: str) -> GearCase:
        """Return the gear of a member with its holes, lugs or body where they stand to its teeth."""
        use = own[member]
        pair = cases[use.case].pair
        gear = (pair.pinion, pair.wheel)[use.gear]
        if not gear.repeats(pair.face_width_mm):
            return gear
        first = next(
            number for number, mesh in enumerate(meshes)
            if mesh.case == use.case and placed[number].image == use.image
            and bodies[(mesh.pinion, mesh.wheel)[use.gear]].member == member
        )  # fmt: skip
        body = bodies[(meshes[first].pinion, meshes[first].wheel)[use.gear]]
        return gear.turned(_ahead_of_the_pair_deg(meetings[first], placed[first], use.gear, body.direction))

    gears_of = {member: standing(member) for member in own}

    def solve(member: str) -> SolvedGear:
        use = own[member]
        asked = _far_teeth(member, bodies, meshes, meetings, placed, use.image)
        return line_gear(cases[use.case], models[use.case], sectors[member], gears_of[member], kept, asked)

    solved = dict(zip(own, in_order(solve, own, executor), strict=True))
    pairs = {}
    for name, model in models.items():
        gears = [
            _near(solved[member], sectors[member], use.image != own[member].image)
            for member, use in _gears_of(name, uses)
        ]
        pairs[name] = _line_pair(as_layered(model.meshed), (gears[0], gears[1]))
    train_bodies = tuple(
        TrainBody(
            body.name,
            sectors[body.member].teeth,
            of_member.far,
            own[body.member].image,
            of_member.root_stress,
            of_member.support,
            None if of_member.other is None else of_member.other.root_stress,
            _holes(gears_of[body.member], own[body.member].gear),
            of_member.rim_motion,
        )
        for body, of_member in ((body, solved[body.member]) for body in bodies)
    )
    train_meshes = tuple(
        TrainMesh(pairs[mesh.case], (mesh.pinion, mesh.wheel), *place, mesh.assembly or assembly_of(cases[mesh.case]))
        for mesh, place in zip(meshes, placed, strict=True)
    )
    return GearTrain(train_bodies, train_meshes, free, compliance)


def _uses(bodies: Sequence[SetBody], meshes: Sequence[SetMesh], placed: Sequence[Placement]) -> dict[str, list[_Use]]:
    """Members, and as what gears of cases they stand."""
    found: dict[str, list[_Use]] = {}
    for mesh, place in zip(meshes, placed, strict=True):
        for gear, body in enumerate((mesh.pinion, mesh.wheel)):
            known, use = found.setdefault(bodies[body].member, []), _Use(mesh.case, gear, place.image)
            if use not in known:
                known.append(use)
    return found


def _gears_of(case: str, uses: Mapping[str, Sequence[_Use]]) -> list[tuple[str, _Use]]:
    """Members that are pinion and wheel of a case."""
    found = {use.gear: (member, use) for member, known in uses.items() for use in known if use.case == case}
    return [found[0], found[1]]


def _line_pair(meshed: LayeredPair, gears: tuple[FloatArray, FloatArray]) -> LinePair:
    """Prepare a pair for line loads from the compliance of its flanks."""
    components = loaded_components(True, meshed.pair.pinion.helix_angle != 0.0)
    return LinePair(meshed, line_compliance_between(meshed, gears, components), components, gears)


def _near(solved: SolvedGear, sector: SectorMesh, flipped: bool) -> FloatArray:
    """Compliance of a gear's flanks, of the tooth 0, 1, ... counter-clockwise from the loaded one, (teeth, n, n).

    The other flanks are those of the gear with the other hand, the image in the plane at mid width, unless they are
    unlike.
    """
    blocks = solved.compliance
    if flipped and solved.other is not None:
        return solved.other.compliance
    if not flipped or sector.twist_per_length == 0.0:
        return blocks
    order, sign = other_hand(blocks.shape[1], len(sector.z))
    return np.ascontiguousarray(blocks[:, order[:, None], order] * sign[:, None] * sign)


def _far_teeth(
    member: str, bodies: Sequence[SetBody], meshes: Sequence[SetMesh], meetings: Sequence[Meeting],
    placed: Sequence[Placement], image: bool,
) -> FarTeeth | None:  # fmt: skip
    """Teeth of a member that are loaded together by different meshes; None where a single mesh has it."""
    alike: tuple[set[int], set[int]] = (set(), set())
    backs: set[int] = set()
    for body in (number for number, one in enumerate(bodies) if one.member == member):
        own = [
            (number, gear) for number, mesh in enumerate(meshes) for gear in range(2)
            if (mesh.pinion, mesh.wheel)[gear] == body
        ]  # fmt: skip
        for (one, gear), (other, mate) in product(own, own):
            if one == other:
                continue
            flipped = placed[one].image != image, placed[other].image != image
            place, loaded = _tooth(meetings[one], placed[one], gear), _tooth(meetings[other], placed[other], mate)
            touching = [meetings[mesh].pair.most_touching_pairs for mesh in (one, other)]
            if flipped[0] == flipped[1]:
                alike[flipped[0]].update(_near_to(place - loaded, 0.5 * sum(touching)))
            elif flipped[0]:
                backs.update(_near_to(-place - loaded, 0.5 * sum(touching)))
    if not (alike[0] or alike[1] or backs):
        return None
    return FarTeeth(tuple(sorted(alike[0])), tuple(sorted(alike[1])), tuple(sorted(backs)))


def _ahead_of_the_pair_deg(meeting: Meeting, place: Placement, gear: int, direction: float) -> float:
    """Return how far holes that count from a direction at angle 0 are ahead of those that count as in a pair.

    That is from the line to the mate's centre, with tooth 0 where it is at pinion angle 0; in the frame of the pair.
    """
    side, pair = -1.0 if place.image else 1.0, meeting.pair
    tooth, line, turned = pair.pinion, place.direction, place.start
    if gear == 1:
        tooth, turned = pair.wheel, pair.wheel_tooth_rotation(place.start) - pair.wheel_tooth_rotation(0.0)
        line += math.pi if tooth.teeth > 0 else 0.0
    return math.degrees(side * (direction - line) - turned + place.first_tooth[gear] * tooth.angular_pitch)


def _holes(gear: GearCase, place: int) -> HolesCase | None:
    """Holes of the pinion, place 0, or the wheel of a pair, counted from the middle of tooth 0."""
    if gear.blank is None or gear.blank.holes is None:
        return None
    holes = gear.blank.holes
    return replace(holes, first_deg=holes.first_deg + place * 180.0 / gear.teeth)


def _near_to(offset: float, reach: float) -> range:
    """Whole numbers about an offset, those that rounding may add included."""
    return range(math.ceil(offset - reach - ROUNDING), math.floor(offset + reach + ROUNDING) + 1)


def _tooth(meeting: Meeting, place: Placement, gear: int) -> float:
    """Number of the tooth of a gear that would be in the middle of the path at angle 0, a real one.

    As the train turns these numbers of one body change alike in all meshes.
    """
    first, last = meeting.pair.roll_position_range
    middle = (0.5 * (first + last) - place.start) / meeting.pair.pitch
    return place.first_tooth[0] + middle if gear == 0 else place.first_tooth[1] - middle
