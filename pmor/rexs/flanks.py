"""Flank modifications of a REXS gear, as those of a case.

Both count amounts along the transverse line of action (ISO 21771). REXS says places on the profile as diameters or
lengths on that line, places over the width from the middle of the face, away from the datum face; a case says roll
angles, and z. Quadratics over profile and width are exact for any range; a note names each modification without a key.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from pmor.gear.profile import Profile
from pmor.rexs.model import Component

#: shapes of relief that a case knows, by those of REXS
SHAPES = {"": "linear", "linear": "linear", "parabolic": "parabolic"}
UM = 1e3  # per mm
# Amounts that are left where two cancel, um.
ROUND_OFF = 1e-9
# Of half a face: coordinates are rounded.
ROUNDED = 1e-3


@dataclass(frozen=True)
class FileFlank(Profile):
    """The flank that modifications lie on.

    Parameters
    ----------
    face_width : float
        mm.
    datum : int
        1 where the datum face has the larger z, else -1.
    """

    face_width: float
    datum: int

    def at(self, diameter: float) -> float:
        """Return the roll angle at a diameter, rad."""
        return self.roll_at("diameter_mm", diameter)

    def z_at(self, coordinate: float) -> float:
        """Return z of a coordinate over the width, mm: both count from the middle of the face."""
        return -self.datum * coordinate

    def origin(self, coordinates: Sequence[float | None], component: Component, found: Found) -> float:
        """Return where coordinates over the width count from, mm from the middle: some programs take the datum face."""
        known, half = [one for one in coordinates if one is not None], 0.5 * self.face_width
        slack = ROUNDED * half
        if not known or min(known) < -slack or max(known) <= half + slack:
            return 0.0
        found.notes.append(f"{component.label}: coordinates up to {max(known):g} mm: taken from the datum face on")
        return -half


@dataclass
class Found:
    """Modification of a flank as read from a file.

    Parameters
    ----------
    keys : dict
        Of a section `[pinion.modification]`.
    """

    keys: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def add(self, key: str, amount: float) -> None:
        """Add to an amount; zero is left out."""
        total = float(f"{self.keys.get(key, 0.0) + amount:.12g}")
        if abs(total) > ROUND_OFF:
            self.keys[key] = total
        else:
            self.keys.pop(key, None)


def read_flank(components: list[Component], profile: FileFlank) -> Found:
    """Take over the modifications of a flank.

    Parameters
    ----------
    components : list of Component
        Modifications that the flank refers to.
    """
    found, ends = Found(), list[Component]()
    for component in components:
        reader = READERS.get(component.kind)
        if component.kind.startswith("end_relief"):
            ends.append(component)
        elif reader is None:
            found.notes.append(f"{component.label}: a case has no such modification: left out")
        else:
            reader(component, profile, found)
        if component.text_of("specify_tangential_transition") == "true":
            found.notes.append(f"{component.label}: the rounded transition of the relief is left out")
    if ends:
        _end_reliefs(ends, profile, found)
    return found


def _place(component: Component, diameter: str, length: str, flank: FileFlank, sign: float, end: float) -> float | None:
    """Roll angle at a diameter, or at a length on the line of action from an end of the flank."""
    place = component.number_of(diameter)
    if place is not None:
        return flank.at(place)
    place = component.number_of(length)
    return None if place is None else end + sign * place / flank.base_radius


def _relief(component: Component, profile: FileFlank, found: Found) -> None:
    """A relief of tip or root: it begins at a roll angle and has its depth at another one, or at the flank's end."""
    which, shape = component.kind.removesuffix("_relief"), SHAPES.get(component.text_of("shape_of_relief"))
    sign, end, extent = {
        "tip": (-1.0, profile.tip, "tip_relief_start_roll_deg"),
        "root": (1.0, profile.start, "root_relief_end_roll_deg"),
    }[which]
    depth = component.number_of(f"{which}_relief_depth")
    begins, at = (
        _place(component, f"{which}_relief_{diameter}", f"{which}_relief_{length}", profile, sign, end)
        for diameter, length in (
            ("datum_diameter", "datum_length"), ("evaluation_reference", "evaluation_reference_length"),
        )
    )  # fmt: skip
    if not depth:
        return
    if begins is None or shape is None:
        reason = "its start is missing" if begins is None else "its shape is neither linear nor parabolic"
        found.notes.append(f"{component.label}: {reason}: left out")
        return
    if extent in found.keys:
        found.notes.append(f"{component.label}: a second relief there: left out")
        return
    share = 1.0 if at is None or at == begins else (end - begins) / (at - begins)
    found.add(f"{which}_relief_um", UM * depth * share ** (2 if shape == "parabolic" else 1))
    found.keys[extent] = float(f"{math.degrees(begins):.12g}")
    if shape != "linear":
        found.keys[f"{which}_relief_shape"] = shape


def _quadratic(points: tuple[tuple[float, float], ...], span: tuple[float, float]) -> tuple[float, float]:
    """Crowning and slope over a span of the quadratic through three points: at its ends, and from end to end.

    It counts from the middle of the span: a constant is no modification.
    """
    (a, f), (b, g), (c, h) = points
    bend = (h - g) / (c - b) / (c - a) - (g - f) / (b - a) / (c - a)
    slope = (g - f) / (b - a) - bend * (a + b)
    low, high = span
    return bend * (high - low) ** 2 / 4.0, (slope + bend * (low + high)) * (high - low)


def _profile_crowning(component: Component, profile: FileFlank, found: Found) -> None:
    low, high = profile.start, profile.end
    ends = [
        _place(component, f"diameter_where_profile_crowning_{end}_is_specified",
               f"length_where_profile_crowning_{end}_is_specified", profile, sign, usual) or usual
        for end, sign, usual in (("root", 1.0, low), ("tip", -1.0, high))
    ]  # fmt: skip
    amounts = _both(component, [f"profile_crowning_at_{end}" for end in ("root", "tip")], found)
    top = component.number_of("profile_highest_point")
    middle = 0.5 * sum(ends) if top is None else profile.at(top)
    if not min(ends) < middle < max(ends):  # roll angles of a ring fall towards its tips
        found.notes.append(f"{component.label}: its highest point is not between its ends: left out")
        return
    points = (ends[0], UM * amounts[0]), (middle, 0.0), (ends[1], UM * amounts[1])
    crowning, slope = _quadratic(points, (profile.start, profile.end))
    _add_crowning(component, "profile", crowning, slope, found)


def _profile_slope(component: Component, profile: FileFlank, found: Found) -> None:
    low, high = profile.start, profile.end
    start = component.number_of("profile_evaluation_start")
    end = component.number_of("diameter_where_profile_slope_amount_is_specified", "profile_evaluation_end")
    span = (high if end is None else profile.at(end)) - (low if start is None else profile.at(start))
    amount = component.number_of("profile_slope")
    if amount and span * (high - low) > 0.0:
        found.add("profile_slope_um", UM * amount * (high - low) / span)
        found.notes.append(f"{component.label}: taken as removed at the tip where it is positive: check the sign")


def _helix_crowning(component: Component, profile: FileFlank, found: Found) -> None:
    half = 0.5 * profile.face_width
    ends = (f"coordinate_where_helix_crowning_is_specified_{face}_face" for face in ("datum", "non_datum"))
    said = [component.number_of(name) for name in (*ends, "helix_highest_point")]
    origin = profile.origin(said, component, found)
    low, high, top = (None if one is None else one + origin for one in said)
    low, high = -half if low is None else low, half if high is None else high
    middle = 0.5 * (low + high) if top is None else top
    if not low < middle < high:
        found.notes.append(f"{component.label}: its highest point is not between its ends: left out")
        return
    datum, other = _both(component, [f"helix_crowning_amount_{face}_face" for face in ("datum", "non_datum")], found)
    points = tuple((profile.z_at(c), UM * a) for c, a in ((low, datum), (middle, 0.0), (high, other)))
    crowning, slope = _quadratic(points, (-half, half))
    _add_crowning(component, "helix", crowning, slope, found)


def _both(component: Component, names: list[str], found: Found) -> list[float]:
    """Amounts at both ends of a crowning; one that is not said is that of the other end."""
    said = [component.number_of(name) for name in names]
    known = [amount for amount in said if amount is not None]
    if len(known) == 1:
        found.notes.append(f"{component.label}: no {names[said.index(None)]}: as much as at the other end")
    return [known[0] if amount is None else amount for amount in said] if known else [0.0, 0.0]


def _add_crowning(component: Component, along: str, crowning: float, slope: float, found: Found) -> None:
    found.add(f"{along}_crowning_um", crowning)
    found.add(f"{along}_slope_um", slope)
    if component.text_of(f"shape_of_{along}_crowning") == "circular":
        found.notes.append(f"{component.label}: circular: taken as a parabola, equal to a millionth")


def _helix_slope(component: Component, profile: FileFlank, found: Found) -> None:
    amount = component.number_of("helix_slope")
    start, end = (component.number_of(f"helix_evaluation_{end}") for end in ("start", "end"))
    whole = start is None or end is None or component.text_of("helix_evaluation_reference") == "facewidth"
    span = profile.face_width if whole else abs((end or 0.0) - (start or 0.0))
    if amount and span > 0.0:
        found.add("helix_slope_um", -profile.datum * UM * amount * profile.face_width / span)
        found.notes.append(
            f"{component.label}: taken as removed at the non-datum face where it is positive: check the sign"
        )


def _profile_twist(component: Component, profile: FileFlank, found: Found) -> None:
    amount = component.number_of("profile_twist")
    if amount:
        found.add("twist_um", -profile.datum * UM * amount)
        found.notes.append(
            f"{component.label}: taken as the increase of the profile slope from the datum face to the other, over the "
            "whole active profile: check sign and range"
        )


def _end_reliefs(components: list[Component], profile: FileFlank, found: Found) -> None:
    """Straight end relief, the same on both faces, is the only one with a key."""
    said = {}
    for component in components:
        face = component.kind.removeprefix("end_relief_")
        depth, length = (component.number_of(f"end_relief_{size}_{face}") for size in ("depth", "length"))
        if SHAPES.get(component.text_of("shape_of_relief")) == "linear":
            said[face] = depth, length
    sides = set(said.values())
    if len(said) == 2 and len(sides) == 1 and None not in (only := sides.pop()):
        found.add("end_relief_um", UM * only[0])  # type: ignore[operator]
        found.keys["end_relief_length_mm"] = only[1]
        return
    for component in components:
        found.notes.append(f"{component.label}: a case has straight end relief alike on both faces: left out")


def _topography(component: Component, profile: FileFlank, found: Found) -> None:
    """A grid: points one by one, or the product of diameters and coordinates with the coordinates running first."""
    diameters, coordinates, amounts = (
        component.numbers_of(name)
        for name in (
            "diameters_of_topographical_modification", "coordinates_of_topographical_modification",
            "topographical_modification_amounts",
        )
    )  # fmt: skip
    origin = profile.origin(coordinates, component, found)
    if len(amounts) == len(diameters) * len(coordinates):
        places = [(d, c) for d in diameters for c in coordinates]
    elif len(amounts) == len(diameters) == len(coordinates):
        places = list(zip(diameters, coordinates, strict=True))
    else:
        places = []
    grid = {(profile.at(d), profile.z_at(c + origin)): UM * a for (d, c), a in zip(places, amounts, strict=False)}
    rolls, columns = (sorted({place[i] for place in grid}) for i in (0, 1))
    if min(len(rolls), len(columns)) < 2 or len(grid) != len(rolls) * len(columns) or "topography" in found.keys:
        found.notes.append(f"{component.label}: is no grid of diameters and coordinates, or the second one: left out")
        return
    found.keys["topography"] = {
        "roll_deg": [math.degrees(u) for u in rolls], "z_mm": columns,
        "amount_um": [[grid[u, z] for z in columns] for u in rolls],
    }  # fmt: skip
    if component.text_of("type_of_interpolation_topographical_modification") == "linear":
        found.notes.append(f"{component.label}: linear between its points: a case has a smooth surface through them")


READERS: dict[str, Callable[[Component, FileFlank, Found], None]] = {
    "tip_relief": _relief,
    "root_relief": _relief,
    "profile_crowning": _profile_crowning,
    "profile_slope": _profile_slope,
    "helix_crowning": _helix_crowning,
    "helix_slope": _helix_slope,
    "profile_twist": _profile_twist,
    "topographical_modification": _topography,
}
