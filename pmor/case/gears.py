"""Sections of a case file for the gear pair: `[pair]`, `[pinion]`, `[wheel]`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Literal

from pmor.case.blank import BlankCase
from pmor.case.body import BodyCase, MatrixCase, repetition
from pmor.core.ranges import METRES, RADIANS, TAKEN_OFF, Length, PoissonRatio, Range, Stiffness, YoungsModulus
from pmor.gear.modification import Modification

# Angles of lugs that are equal.
SAME_DEG = 1e-9
# Helix angles below this, degrees, are rare, and usual in radians.
LEAST_HELIX = 0.8


@dataclass(frozen=True, kw_only=True)
class ShaperCase:
    """The shaper cutter that generates a ring (`shaper = {teeth = ...}` in `[wheel]`).

    Parameters
    ----------
    teeth : int
        Number of teeth.
    addendum : float
        In modules.
    tip_radius_mm : float
        Radius in mm of the rounding between its flanks and its tip, in the transverse section; it makes the fillet.
    profile_shift : float
        Profile shift coefficient, in modules.
    """

    teeth: Annotated[int, Range(6, 1000)]
    addendum: Annotated[float, Range(0.1, 4.0, "modules")] = 1.25
    tip_radius_mm: Annotated[float, Range(0.0, 1e3, "mm", mistaken_for=(METRES,))] = 0.0
    profile_shift: Annotated[float, Range(-3.0, 3.0, "modules")] = 0.0


@dataclass(frozen=True, kw_only=True)
class LugsCase:
    """Lugs that hold a ring: equal pieces of its outside, over its width (`held = {lugs = ...}` in `[wheel]`).

    Parameters
    ----------
    lugs : int or None
        Number of lugs, evenly around the axis.
    at_deg : tuple of float
        Middles of lugs or bolts, in place of their number,, in degrees from `first_deg` on: teeth then differ over a
        whole turn.
    lug_deg : float
        Angle in degrees that each of them takes of the outside.
    first_deg : float
        Place of the middle of the first one, as `first_deg` of holes.
    """

    lugs: Annotated[int, Range(1, 1000)] | None = None
    at_deg: Annotated[tuple[float, ...], Range(-360.0, 360.0, "deg", in_order=True)] = ()
    lug_deg: Annotated[float, Range(0.1, 360.0, "deg", mistaken_for=(RADIANS,))]
    first_deg: Annotated[float, Range(-360.0, 360.0, "deg")] = 0.0

    @property
    def middles_deg(self) -> tuple[float, ...]:
        """Places of the middles of all lugs."""
        places = self.at_deg or tuple(360.0 * n / (self.lugs or 1) for n in range(self.lugs or 0))
        return tuple(self.first_deg + place for place in places)

    @property
    def gaps_deg(self) -> list[float]:
        """Angles between the middles of neighbours, all around."""
        ordered = sorted(place % 360.0 for place in self.middles_deg)
        return [b - a for a, b in pairwise([*ordered, ordered[0] + 360.0])]

    @cached_property
    def repeats(self) -> int:
        """How often they repeat around the axis."""
        gaps = self.gaps_deg
        steps = (step for step in range(1, len(gaps) + 1) if len(gaps) % step == 0)
        return next(
            len(gaps) // step for step in steps
            if all(abs(a - b) < SAME_DEG for a, b in zip(gaps, gaps[step:] + gaps[:step], strict=True))
        )  # fmt: skip

    @property
    def image(self) -> LugsCase:
        """Those of the mirrored ring."""
        at = tuple(-place or 0.0 for place in self.at_deg)
        return replace(self, at_deg=at, first_deg=-self.first_deg or 0.0)


@dataclass(frozen=True, kw_only=True)
class GearCase:
    """One gear (sections `[pinion]` and `[wheel]`).

    Parameters
    ----------
    teeth : int
        Number of teeth.
    internal : bool
        Whether the wheel is a ring with teeth on its inside: its number of teeth is written positive all the same.
    profile_shift : float
        Profile shift coefficient, in modules: positive makes the teeth thicker, those of a ring too (ISO 21771).
    addendum : float
        Addendum of the basic rack, in modules.
    dedendum : float
        Dedendum of the basic rack, in modules; a shaper makes it, where there is one.
    rack_tip_radius : float
        Tip radius of the generating rack, in modules; it makes the root fillet. Of a ring with neither of the next two,
        the fillet's radius.
    root_fillet_mm : float or None
        Radius in mm of the arc between flank and root circle of a ring that no shaper is given for.
    shaper : ShaperCase or None
        The cutter that generates a ring, as in shaper = {teeth = 23, addendum = 1.25, tip_radius_mm = 0.5}.
    bore_radius_mm : float or None
        Radius in mm at which the body is rigid on its shaft. A ring has none.
    one_piece : bool
        Whether the gear is of one piece with a solid shaft as thick as its bore: the mean motion of the bore is then
        the shaft's.
    rim_thickness_mm : float or None
        Thickness of a ring from its root circle to its outside, in mm.
    held : {"outside"} or LugsCase
        Where a ring is held: all over its outside, or at lugs alone, as in held = {lugs = 8, lug_deg = 10.0}.
    seat_radial_N_per_mm : float, "rigid" or "free"
        Radial stiffness of the housing below a ring, spread evenly over each lug, or over all of its outside; of the
        whole area, moved alike.
    seat_tangential_N_per_mm : float, "rigid" or "free"
        The same around and along the axis.
    face_width_mm : float or None
        Face width in mm; None is that of the pair.
    face_offset_mm : float
        Way along the axis from the middle of the pair to the middle of this gear's face, in mm.
    tip_rounding_mm : float
        Radius in mm of the rounded edge between flank and tip; in line contact.
    tip_chamfer_mm : float
        Height in mm, along the radius, that a chamfer takes off the flank at its tip; in line contact.
    tip_shortening_mm : float
        Length by which the tip circle's radius is less than addendum and profile shift make it, in mm: -k m_n of
        ISO 21771.
    tooth_thickness_allowance_um : tuple of float
        Allowance of the normal tooth thickness at the reference cylinder, in um, negative: one, or the lower and the
        upper one, whose mean is solved. The rack cuts deeper for it.
    youngs_modulus_GPa : float
        Young's modulus in GPa.
    poisson_ratio : float
        Poisson's ratio.
    blank : BlankCase or None
        Rim, web and hub (section `[pinion.blank]`, `[wheel.blank]`); None is solid down to the bore.
    body : BodyCase, MatrixCase or None
        All below the rim as a mesh or a stiffness matrix (the same section with `mesh` or `matrix`).
    """

    teeth: Annotated[int, Range(6, 1000)]
    internal: bool = False
    profile_shift: Annotated[float, Range(-3.0, 3.0, "modules")] = 0.0
    addendum: Annotated[float, Range(0.1, 3.0, "modules")] = 1.0
    dedendum: Annotated[float, Range(0.1, 4.0, "modules")] = 1.25
    rack_tip_radius: Annotated[float, Range(0.0, 1.0, "modules")] = 0.38
    root_fillet_mm: Length | None = None
    shaper: ShaperCase | None = None
    bore_radius_mm: Length | None = None
    one_piece: bool = False
    rim_thickness_mm: Length | None = None
    held: Literal["outside"] | LugsCase = "outside"
    seat_radial_N_per_mm: Stiffness = "rigid"
    seat_tangential_N_per_mm: Stiffness = "rigid"
    face_width_mm: Length | None = None
    face_offset_mm: Annotated[float, Range(-1e5, 1e5, "mm")] = 0.0
    tip_rounding_mm: Annotated[float, Range(0.0, 1e3, "mm", mistaken_for=(METRES,))] = 0.0
    tip_chamfer_mm: Annotated[float, Range(0.0, 1e3, "mm", mistaken_for=(METRES,))] = 0.0
    tip_shortening_mm: Annotated[float, Range(0.0, 1e3, "mm", mistaken_for=(METRES,))] = 0.0
    tooth_thickness_allowance_um: Annotated[tuple[float, ...], Range(-1e4, 0.0, "um", mistaken_for=(TAKEN_OFF,))] = ()
    youngs_modulus_GPa: YoungsModulus = 210.0
    poisson_ratio: PoissonRatio = 0.3
    blank: BlankCase | None = None
    body: BodyCase | MatrixCase | None = None

    @property
    def sign(self) -> int:
        """Sign of tooth number, radii and centre distance by ISO 21771: -1 of a ring."""
        return -1 if self.internal else 1

    @property
    def thickness_allowances_mm(self) -> tuple[float, float]:
        """Lower and upper allowance of the normal tooth thickness, mm."""
        allowances = self.tooth_thickness_allowance_um or (0.0,)
        return 1e-3 * allowances[0], 1e-3 * allowances[-1]

    def light_blank(self, pair_width_mm: float) -> BlankCase | None:
        """Return the blank of this gear in a pair of a face width; None where it is solid down to its bore."""
        solid = self.blank is None or self.blank.fills(self.face_width_mm or pair_width_mm)
        return None if solid else self.blank

    @property
    def lugs(self) -> LugsCase | None:
        """What holds a ring; None where all of its outside is held."""
        return None if isinstance(self.held, str) else self.held

    @property
    def seats_give(self) -> bool:
        """Whether what holds a ring gives way."""
        return (self.seat_radial_N_per_mm, self.seat_tangential_N_per_mm) != ("rigid", "rigid")

    @property
    def rim_gives(self) -> bool:
        """Whether the rim of a ring is not rigid all over its outside."""
        return self.lugs is not None or self.seats_give

    def solid(self, pair_width_mm: float) -> bool:
        """Return whether this gear in a pair of a face width has all its body in its sectors, held at their ends."""
        return not self.rim_gives and self.body is None and self.light_blank(pair_width_mm) is None

    def repeats(self, pair_width_mm: float) -> int:
        """Return how many equal pieces make its teeth differ, holes or lugs; 0 of teeth that are alike."""
        if self.lugs is not None:
            return self.lugs.repeats
        blank = self.light_blank(pair_width_mm)
        return repetition(self.body, None if blank is None else blank.holes)

    def unlike_teeth(self, pair_width_mm: float) -> int:
        """Return after how many teeth this gear repeats: 1 where its teeth do not differ."""
        repeats = self.repeats(pair_width_mm)
        return self.teeth // math.gcd(self.teeth, repeats) if repeats else 1

    def turned(self, angle_deg: float) -> GearCase:
        """Return the gear with holes, lugs or body so far ahead of its teeth, counter-clockwise."""
        if self.lugs is not None:
            return replace(self, held=replace(self.lugs, first_deg=self.lugs.first_deg + angle_deg))
        if self.body is not None:
            return replace(self, body=replace(self.body, x_axis_deg=self.body.x_axis_deg + angle_deg))
        if self.blank is None or self.blank.holes is None:
            return self
        holes = replace(self.blank.holes, first_deg=self.blank.holes.first_deg + angle_deg)
        return replace(self, blank=replace(self.blank, holes=holes))

    def face(self, pair_width_mm: float) -> tuple[float, float]:
        """Return where the face begins and ends along z, mm, in a pair of a face width."""
        half_mm = 0.5 * (self.face_width_mm or pair_width_mm)
        return self.face_offset_mm - half_mm, self.face_offset_mm + half_mm


@dataclass(frozen=True, kw_only=True)
class PairCase:
    """The gear pair (section `[pair]`, and the two gears).

    Parameters
    ----------
    module_mm : float
        Normal module in mm.
    pressure_angle_deg : float
        Normal pressure angle at the reference cylinder, in degrees.
    helix_angle_deg : float
        Helix angle at the reference cylinder, in degrees: positive with a right-handed pinion and a left-handed wheel;
        of a ring that of its pinion.
    face_width_mm : float
        Face width in mm of both gears, unless they have their own; misalignments count over it.
    centre_distance_mm : float or None
        Centre distance in mm; None is the one without backlash.
    pinion, wheel : GearCase
        The two gears; the pinion drives.
    """

    module_mm: Annotated[float, Range(0.05, 100.0, "mm", mistaken_for=(METRES,))]
    pressure_angle_deg: Annotated[float, Range(10.0, 35.0, "deg", mistaken_for=(RADIANS,))] = 20.0
    helix_angle_deg: Annotated[float, Range(-60.0, 60.0, "deg", mistaken_for=(RADIANS,), least=LEAST_HELIX)] = 0.0
    face_width_mm: Length
    centre_distance_mm: Length | None = None
    pinion: GearCase
    wheel: GearCase

    @property
    def blanks(self) -> tuple[BlankCase | None, BlankCase | None]:
        """Blanks of pinion and wheel; None of a gear that is solid down to its bore."""
        return self.pinion.light_blank(self.face_width_mm), self.wheel.light_blank(self.face_width_mm)

    @property
    def holes(self) -> tuple[int, int]:
        """Numbers of holes in the webs of pinion and wheel; of a body that is a mesh, how often it repeats; lugs."""
        return self.pinion.repeats(self.face_width_mm), self.wheel.repeats(self.face_width_mm)

    @property
    def repeats_after(self) -> int:
        """Pitches after which the bodies of both gears stand to the mesh as before: 1 without holes and lugs."""
        return math.lcm(*(gear.unlike_teeth(self.face_width_mm) for gear in (self.pinion, self.wheel)))

    def repeats_with(self, flanks: Iterable[tuple[Modification, Modification]]) -> int:
        """Return the pitches after which all is as before, with flanks of pinion and wheel whose teeth may differ."""
        differ = {
            flank.repeats_after(gear.teeth)
            for both in flanks
            for gear, flank in zip((self.pinion, self.wheel), both, strict=True)
        }
        return math.lcm(self.repeats_after, *differ)
