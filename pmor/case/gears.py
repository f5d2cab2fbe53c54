"""Sections of a case file for the gear pair: `[pair]`, `[pinion]`, `[wheel]`."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from pmor.case.blank import BlankCase
from pmor.case.body import BodyCase, MatrixCase, repetition
from pmor.core.ranges import METRES, PASCALS, RADIANS, TAKEN_OFF, Length, Range


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
    lugs : int
        Number of lugs, evenly around the axis.
    lug_deg : float
        Angle in degrees that each of them takes of the outside.
    first_deg : float
        Place of the middle of the first one at pinion angle 0, in degrees: from the line from the ring's centre to its
        pinion's, of a set from the y axis, counter-clockwise seen from +z.
    """

    lugs: Annotated[int, Range(1, 1000)]
    lug_deg: Annotated[float, Range(0.1, 360.0, "deg", mistaken_for=(RADIANS,))]
    first_deg: Annotated[float, Range(-360.0, 360.0, "deg")] = 0.0


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
        Profile shift coefficient, in modules: positive towards the tip, so that it makes the teeth thicker, those of a
        ring too (ISO 21771).
    addendum, dedendum : float
        Of the basic rack, in modules; with a shaper, that makes the dedendum.
    rack_tip_radius : float
        Tip radius of the generating rack, in modules; it makes the root fillet. In a ring with neither of the two
        following keys, the radius of the fillet.
    root_fillet_mm : float or None
        Radius in mm of the arc between flank and root circle of a ring that no shaper is given for.
    shaper : ShaperCase or None
        The cutter that generates a ring, as in shaper = {teeth = 23, addendum = 1.25, tip_radius_mm = 0.5}.
    bore_radius_mm : float or None
        Radius in mm at which the body is rigid on its shaft. A ring has none.
    one_piece : bool
        Whether the gear is of one piece with a solid shaft as thick as its bore, which then deforms: what is held, or
        moves with a shaft in a gearbox, is the mean motion of the bore.
    rim_thickness_mm : float or None
        Of a ring, in mm: from its root circle to its outside.
    held : {"outside"} or LugsCase
        Where a ring is rigid: all over its outside, or at lugs alone, as in held = {lugs = 8, lug_deg = 10.0}.
    face_width_mm : float or None
        Face width in mm; None is that of the pair.
    face_offset_mm : float
        Along the axis, from the middle of the pair to the middle of this gear's face, in mm.
    tip_rounding_mm : float
        Radius in mm of the rounded edge between flank and tip; in line contact.
    tip_chamfer_mm : float
        Height in mm, along the radius, that a chamfer takes off the flank at its tip; in line contact.
    tip_shortening_mm : float
        By which the tip circle's radius is less than addendum and profile shift make it, in mm: -k m_n of ISO 21771.
    tooth_thickness_allowance_um : tuple of float
        Of the normal tooth thickness at the reference cylinder, in um, negative: one, or the lower and the upper one,
        whose mean is solved. It is cut by the rack, so that teeth get thinner and roots deeper, for backlash.
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
    face_width_mm: Length | None = None
    face_offset_mm: Annotated[float, Range(-1e5, 1e5, "mm")] = 0.0
    tip_rounding_mm: Annotated[float, Range(0.0, 1e3, "mm", mistaken_for=(METRES,))] = 0.0
    tip_chamfer_mm: Annotated[float, Range(0.0, 1e3, "mm", mistaken_for=(METRES,))] = 0.0
    tip_shortening_mm: Annotated[float, Range(0.0, 1e3, "mm", mistaken_for=(METRES,))] = 0.0
    tooth_thickness_allowance_um: Annotated[tuple[float, ...], Range(-1e4, 0.0, "um", mistaken_for=(TAKEN_OFF,))] = ()
    youngs_modulus_GPa: Annotated[float, Range(1e-3, 1e4, "GPa", mistaken_for=PASCALS)] = 210.0
    poisson_ratio: Annotated[float, Range(0.0, 0.5, high_excluded=True)] = 0.3
    blank: BlankCase | None = None
    body: BodyCase | MatrixCase | None = None

    @property
    def sign(self) -> int:
        """Of tooth number, radii and centre distance by ISO 21771: -1 of a ring."""
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

    def solid(self, pair_width_mm: float) -> bool:
        """Return whether this gear in a pair of a face width has all its body in its sectors, held at their ends."""
        return self.lugs is None and self.body is None and self.light_blank(pair_width_mm) is None

    def repeats(self, pair_width_mm: float) -> int:
        """Return how many equal pieces make its teeth differ, holes or lugs; 0 of teeth that are alike."""
        if self.lugs is not None:
            return self.lugs.lugs
        blank = self.light_blank(pair_width_mm)
        return repetition(self.body, None if blank is None else blank.holes)

    def unlike_teeth(self, pair_width_mm: float) -> int:
        """Return after how many teeth this gear repeats: 1 where its teeth do not differ."""
        repeats = self.repeats(pair_width_mm)
        return self.teeth // math.gcd(self.teeth, repeats) if repeats else 1

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
        a ring has the hand of its pinion.
    face_width_mm : float
        Face width in mm of both gears, unless they have their own; misalignments count over it.
    centre_distance_mm : float or None
        Centre distance in mm; None is the one without backlash.
    pinion, wheel : GearCase
        The two gears; the pinion drives.
    """

    module_mm: Annotated[float, Range(0.05, 100.0, "mm", mistaken_for=(METRES,))]
    pressure_angle_deg: Annotated[float, Range(10.0, 35.0, "deg", mistaken_for=(RADIANS,))] = 20.0
    helix_angle_deg: Annotated[float, Range(-60.0, 60.0, "deg")] = 0.0
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
