"""The layout of a set: which members mesh, in which sense they drive, before any geometry."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from pmor.core.errors import CaseError
from pmor.sets.settings import SetSections
from pmor.sets.supports import tilts_under_forces

# Sections of the pair, and of another one of stepped planets and the ring.
PAIR, SECOND_PAIR, SECOND_PLANET = "pair", "second_pair", "second_planet"
# Sections that are no gears.
SHARED = (PAIR, "mesh", "contact", "results")


@dataclass(frozen=True)
class Share:
    """A mesh as a case: what equal meshes share.

    Parameters
    ----------
    members : (str, str)
        That drives, and that is driven.
    sense, hand : int
        Of the driving one as it is drawn: 1 if the torque turns it counter-clockwise; 1 if it has the hand of the gear
        that its helix angle is written for, the first one that drives by the section.
    distance_mm : float or None
        Of the axes; None is that of the file, or without backlash.
    section : str
        With keys of the pair beside those of `[pair]`.
    """

    members: tuple[str, str]
    sense: int
    hand: int
    distance_mm: float | None = None
    whole_width: bool = False
    section: str = PAIR

    @property
    def name(self) -> str:
        """Name of the case."""
        return "-".join(self.members)


@dataclass(frozen=True)
class Layout:
    """Members of a set and the meshes that differ, before any geometry.

    Parameters
    ----------
    clockwise : bool
        Whether the first gear is loaded clockwise.
    senses : mapping of str to int
        Of gears on fixed axes as they are drawn: 1 where they are driven counter-clockwise.
    """

    shares: tuple[Share, ...]
    clockwise: bool
    senses: Mapping[str, int] = field(default_factory=dict)


def planetary_layout(said: SetSections, whole_width: bool = False) -> Layout:
    """Return the layout of a planetary set, seen from its carrier.

    Parameters
    ----------
    whole_width : bool
        Whether members may tilt, whatever the file says of what they stand on.
    """
    assert said.load is not None
    clockwise = said.load.torque_Nm * (-1.0 if said.load.on == "carrier" else 1.0) < 0.0
    sense = -1 if clockwise else 1
    stepped = SECOND_PLANET in said.members
    whole = whole_width or tilts_under_forces(said, stepped)
    inner = Share(("sun", "planet"), sense, 1, None, whole)
    if not stepped:
        return Layout((inner, Share(("planet", "ring"), -sense, -1, None, whole)), clockwise)
    section = SECOND_PAIR if SECOND_PAIR in said.members else PAIR
    hand = 1 if _says_helix(said, section) else -1
    return Layout((inner, Share((SECOND_PLANET, "ring"), -sense, hand, None, whole, section)), clockwise)


def _says_helix(said: SetSections, section: str) -> bool:
    """Whether a section of a pair has a helix angle of its own."""
    return section != PAIR and "helix_angle_deg" in said.members.get(section, {})


def train_layout(said: SetSections) -> Layout:
    """Return the layout of gears on fixed axes."""
    gears = {gear.name: gear for gear in said.gears}
    # Gears on one shaft are driven in one sense.
    shaft = {gear.name: gear.shaft or gear.name for gear in said.gears}
    first = said.meshes[0].gears[0]
    clockwise = float(gears[first].torque_Nm or 0.0) < 0.0  # type: ignore[arg-type]
    sense, shares = {shaft[first]: -1 if clockwise else 1}, []
    of_section: dict[str, int] = {}
    for mesh in said.meshes:
        one, other = mesh.gears
        if shaft[one] not in sense:
            raise CaseError(
                f'[[meshes]] gears = ["{one}", "{other}"]: nothing drives "{one}" yet: list it further down'
            )
        own, internal = sense[shaft[one]], bool(said.members.get(other, {}).get("internal", False))
        turned = own if internal else -own
        if sense.setdefault(shaft[other], turned) != turned:
            raise CaseError(f'[[meshes]] gears = ["{one}", "{other}"]: "{other}" is driven the other way already')
        distance = math.dist(gears[one].at_mm[:2], gears[other].at_mm[:2])
        hand = own * of_section.setdefault(mesh.pair if _says_helix(said, mesh.pair) else PAIR, own)
        shares.append(Share((one, other), own, hand, distance, section=mesh.pair))
    return Layout(tuple(shares), clockwise, {gear: sense[on] for gear, on in shaft.items() if on in sense})
