"""From the cases of the meshes to a train that can be solved: each member's finite elements once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from pmor.body.far_compliance import FarTeeth
from pmor.body.flank_compliance import loaded_support
from pmor.body.root_stress import RootStressShapes, other_hand, root_stress_shapes
from pmor.body.section_compliance import section_compliance
from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.gear.condition import Assembly
from pmor.line.layered_pair import LayeredPair, as_layered
from pmor.line.pair import LinePair
from pmor.line.sections import loaded_components
from pmor.line.several import GearTrain, TrainBody, TrainMesh
from pmor.pair.conditions import assembly_of
from pmor.pair.model import mesh_model, solved_gear
from pmor.sets.kinematics import Centre, Meeting, Placement, placements

if TYPE_CHECKING:
    from pmor.body.elastic_gear import ElasticGear

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
    """

    name: str
    member: str
    x: float
    y: float


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
    compliance: FloatArray,
) -> GearTrain:  # fmt: skip
    """Solve the finite elements of all members, and put a train together.

    Parameters
    ----------
    cases : mapping of str to Case
        Of the meshes, in the frame of each pair: of line contact.
    free, compliance : ndarray
        As in `pmor.line.several.GearTrain`.

    Raises
    ------
    CaseError, GeometryError, MeshError
    """
    models = {name: mesh_model(case) for name, case in cases.items()}
    meetings = [Meeting(models[mesh.case].meshed.pair, mesh.pinion, mesh.wheel) for mesh in meshes]
    placed = placements([Centre(body.name, body.x, body.y) for body in bodies], meetings)
    uses = _uses(bodies, meshes, placed)
    # A gear that has flanks of both sides in mesh is modelled as it is, another one as its meshes see it.
    own = {member: min(found, key=lambda use: use.image) for member, found in uses.items()}
    solved = {}
    for member, use in own.items():
        case, model = cases[use.case], models[use.case]
        sector, gear = ((model.pinion, case.pair.pinion), (model.wheel, case.pair.wheel))[use.gear]
        asked = _far_teeth(member, bodies, meshes, meetings, placed, use.image)
        if gear.lugs is not None:
            ring = next(n for n, mesh in enumerate(meshes) if bodies[mesh.wheel].member == member)
            first_deg = gear.lugs.first_deg - _from_the_axis_deg(meetings[ring], placed[ring])
            gear = replace(gear, held=replace(gear.lugs, first_deg=first_deg))
        solved[member] = solved_gear(case, model, sector, gear, far=asked)
    pairs = {}
    for name, model in models.items():
        gears = [_near(solved[member], use.image != own[member].image) for member, use in _gears_of(name, uses)]
        pairs[name] = _line_pair(as_layered(model.meshed), (gears[0], gears[1]))
    stress = {member: _root_stress(body) for member, body in solved.items()}
    uneven = {member: loaded_support(body, _components(body)) for member, body in solved.items()}
    train_bodies = tuple(
        TrainBody(
            body.name,
            of_member.mesh.teeth,
            of_member.far,
            own[body.member].image,
            stress[body.member],
            uneven[body.member],
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
    """Prepare a pair for line loads from the compliance of its flanks, three components at each node."""
    components = loaded_components(True, meshed.pair.pinion.helix_angle != 0.0)
    used = [(3 * np.arange(blocks.shape[1] // 3)[:, None] + np.arange(components)).ravel() for blocks in gears]
    pinion, wheel = (
        np.ascontiguousarray(blocks[:, rows[:, None], rows]) for blocks, rows in zip(gears, used, strict=True)
    )
    return LinePair(meshed, section_compliance((pinion, wheel), components, *meshed.carriers), components)


def _root_stress(body: ElasticGear) -> RootStressShapes | None:
    if body.fillet is None:
        return None
    return root_stress_shapes(body.fillet, _components(body))


def _components(body: ElasticGear) -> int:
    return loaded_components(True, body.mesh.twist_per_length != 0.0)


def _near(body: ElasticGear, flipped: bool) -> FloatArray:
    """Compliance of a gear's flanks, of the tooth 0, 1, ... counter-clockwise from the loaded one, (teeth, n, n).

    That of the gear with the other hand is the image in the plane at mid width.
    """
    blocks = body.compliance[body.neighbours :]
    if not flipped or body.mesh.twist_per_length == 0.0:
        return blocks
    order, sign = other_hand(blocks.shape[1], len(body.mesh.z))
    return np.asarray(blocks[:, order[:, None], order] * sign[:, None] * sign)


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


def _from_the_axis_deg(meeting: Meeting, place: Placement) -> float:
    """Return how far, at angle 0, a ring stands ahead of where it is in its pair at pinion angle 0, from the y axis."""
    side = -1.0 if place.image else 1.0
    turned = meeting.pair.wheel_tooth_rotation(place.start) - meeting.pair.wheel_tooth_rotation(0.0)
    return math.degrees(side * place.direction + turned)


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
