"""Sections of a gearbox file: one dataclass each.

Axes of shafts are x, as in REXS; y and z are across. Places along a shaft count from its beginning.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from pmor.body.bearing import AnyBearing
from pmor.body.bearing_faults import InnerGeometry
from pmor.body.play import BearingWithPlay
from pmor.body.roller_bearing import SphericalRollerBearing
from pmor.case.duty import Lubricant
from pmor.case.motion import Motion
from pmor.case.reader import Keys, Sections
from pmor.core import ranges
from pmor.machine.load_settings import Gravity, LoadCase, Mass
from pmor.sets.settings import Member

Play = Annotated[float, ranges.Range(0.0, 5.0, "mm")]
HOUSING = "housing"


@dataclass(frozen=True, kw_only=True)
class ShaftSection:
    """A length of a shaft of one diameter (section `sections` of `[[shafts]]`).

    Parameters
    ----------
    length_mm : float
        Length along the shaft.
    outer_mm : float
        Outer diameter.
    inner_mm : float
        Diameter of its bore; 0 is solid.
    """

    length_mm: ranges.Length
    outer_mm: ranges.Length
    inner_mm: ranges.Diameter = 0.0


@dataclass(frozen=True, kw_only=True)
class Shaft:
    """A shaft (section `[[shafts]]`).

    Parameters
    ----------
    name : str
        Name of the shaft; bearings, meshes and loads refer to it.
    at_mm : (float, float)
        y and z of its axis.
    start_mm : float
        x where it begins.
    sections : tuple of ShaftSection
        From its beginning on.
    youngs_modulus_GPa : float
        Young's modulus of the shaft, by default of steel.
    poisson_ratio : float
        Poisson's ratio of the shaft, by default of steel.
    density_kg_m3 : float
        Density of the shaft, for its weight.
    """

    name: str
    at_mm: ranges.Places = (0.0, 0.0)
    start_mm: ranges.Place = 0.0
    sections: tuple[ShaftSection, ...]
    youngs_modulus_GPa: ranges.YoungsModulus = 210.0
    poisson_ratio: ranges.PoissonRatio = 0.3
    density_kg_m3: ranges.Density = 7810.0

    @property
    def length(self) -> float:
        """mm."""
        return sum(section.length_mm for section in self.sections)

    def section_at(self, place: float) -> ShaftSection:
        """Return the section at a place along the shaft, mm: where two meet the first one."""
        end = 0.0
        for section in self.sections:
            end += section.length_mm
            if place < end or math.isclose(place, end):
                return section
        return self.sections[-1]


def _spring(stiffness: float | str) -> float:
    return 0.0 if isinstance(stiffness, str) else stiffness


@dataclass(frozen=True, kw_only=True)
class Bearing(AnyBearing):
    """A bearing of a shaft, or a coupling between two of one axis (section `[[bearings]]`).

    Parameters
    ----------
    name : str
        Name of the bearing.
    shaft : str
        Shaft that it carries.
    to : str
        "housing", which is rigid, or another shaft, in which it stands.
    at_mm : float
        Place of the bearing along the shaft.
    radial_N_per_mm : float, "rigid" or "free"
        Stiffness across the axis.
    axial_N_per_mm : float, "rigid" or "free"
        Stiffness along the axis.
    tilt_Nmm_per_rad : float, "rigid" or "free"
        Stiffness against tilting, about axes across the shaft's.
    torsion_Nmm_per_rad : float, "rigid" or "free"
        Stiffness about the axis of a coupling, key, spline or press fit between two shafts: it carries torque, rigidly
        from `at_mm` to the end of the other shaft.
    clearance_mm : float
        Radial clearance of a bearing by its stiffness, from one end to the other.
    axial_clearance_mm : float
        Axial clearance of a bearing by its stiffness, from one end to the other.
    ball, roller, spherical_roller : BallBearing, RollerBearing, SphericalRollerBearing
        Of a bearing by its inner geometry.
    catalogue : CatalogueBearing
        Of a bearing by its sizes alone: the stiffness across is estimated under its largest load, good to a factor of
        two; along the axis and against tilting it is as the other keys say.
    """

    name: str
    shaft: str
    to: str = HOUSING
    at_mm: ranges.Place
    axial_N_per_mm: ranges.Stiffness = "free"
    torsion_Nmm_per_rad: ranges.TiltStiffness = "free"
    clearance_mm: Play = 0.0
    axial_clearance_mm: Play = 0.0

    @property
    def law(self) -> InnerGeometry | BearingWithPlay | None:
        """Its law where that is no spring: by its inner geometry, or with its clearance."""
        if not self.clearance_mm and not self.axial_clearance_mm:
            return self.inner
        return BearingWithPlay(
            _spring(self.radial_N_per_mm), _spring(self.axial_N_per_mm), _spring(self.tilt_Nmm_per_rad),
            self.clearance_mm, self.axial_clearance_mm,
        )  # fmt: skip

    @property
    def beyond_one_row(self) -> bool:
        """Whether it is more than springs, or one row by inner geometry, without clearance and preload in keys."""
        inner = self.inner
        if inner is None:
            return self.law is not None
        return isinstance(inner, SphericalRollerBearing) or inner.rows > 1 or inner.preloaded

    @property
    def couples(self) -> bool:
        """Whether both shafts turn together."""
        return self.torsion_Nmm_per_rad != "free"


@dataclass(frozen=True, kw_only=True)
class GearPlace:
    """Place of a gear (section `pinion` and `wheel` of `[[meshes]]`).

    Parameters
    ----------
    shaft : str
        Shaft that carries the gear.
    at_mm : float
        Place along the shaft of the middle of the pair's face width.
    gear : mapping
        Keys of this gear in the case that are otherwise here, or all of them where the mesh names no case.
    """

    shaft: str
    at_mm: ranges.Place
    gear: Keys = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """A gear pair (section `[[meshes]]`).

    Parameters
    ----------
    name : str
        Name of the mesh, and of its basis file.
    case : Path or None
        Case file of the pair, beside the gearbox file. Without it the sections of a case stand here. Loads, speeds and
        the lubricant are those of the gearbox; pairs within its `[tolerances]` are solved under each load.
    pinion, wheel : GearPlace
    changes : mapping
        Sections of the case that are otherwise here: `pair = { helix_angle_deg = -10.0 }`; all of them without a case.
    """

    name: str
    case: Path | None = None
    pinion: GearPlace
    wheel: GearPlace
    changes: Sections = field(default_factory=dict)

    @property
    def sections(self) -> dict[str, Keys]:
        """Sections of a case that are here, with those of both gears."""
        gears = {"pinion": self.pinion.gear, "wheel": self.wheel.gear}
        return {**self.changes, **{name: keys for name, keys in gears.items() if keys}}


@dataclass(frozen=True, kw_only=True)
class MemberPlace:
    """Place of a member of a planetary set (section `sun`, `carrier` and `ring` of `[[sets]]`).

    Parameters
    ----------
    shaft : str
        Shaft that carries the member.
    at_mm : float
        Place along the shaft: of the sun of the middle of its face width, of carrier and ring where they join it.
    """

    shaft: str
    at_mm: ranges.Place


AnyMember = MemberPlace | Literal["housing"]


@dataclass(frozen=True, kw_only=True)
class PlanetarySet:
    """A planetary set on shafts (section `[[sets]]`).

    Parameters
    ----------
    name : str
        Name of the set.
    set : Path
        Set file, beside the gearbox file. The sign of its torque says which flanks carry, `held` which member stands
        still. `[supports]` of members on shafts, bearings of a `[carrier]` on one, `[masses]`, `[dynamics]` and
        `[sweep] torques_Nm` are left aside; `[tolerances]` are solved under each load.
    sun, carrier, ring : MemberPlace or "housing"
        Two of them stand on shafts, on one axis. "housing" is the member that the set file has `held`.
    """

    name: str
    set: Path
    sun: AnyMember
    carrier: AnyMember
    ring: AnyMember = "housing"

    @property
    def members(self) -> dict[Member, MemberPlace]:
        """Those on shafts."""
        places: dict[Member, AnyMember] = {"sun": self.sun, "carrier": self.carrier, "ring": self.ring}
        return {name: place for name, place in places.items() if isinstance(place, MemberPlace)}


@dataclass(frozen=True, kw_only=True)
class Housing:
    """What bearings stand on (section `[housing]`).

    Parameters
    ----------
    stiffness : Path or None
        CSV file beside the gearbox file: the stiffness matrix of all seats, without head; for each bearing to the
        housing, in the order of the file, displacements along and rotations about x, y, z; N/mm, N, N mm/rad. Further
        coordinates of the housing may follow, such as those of Craig and Bampton. Without it the housing is rigid.
    mass : Path or None
        CSV file likewise: the mass matrix of the same coordinates, for motion; t, t mm, t mm2. Without it the housing
        has stiffness alone.
    surface : Path or None
        CSV file likewise: integrals of the products of the normal displacements over the surface by unit coordinates,
        mm2; the equivalent radiated power follows from it.
    """

    stiffness: Path | None = None
    mass: Path | None = None
    surface: Path | None = None


@dataclass(frozen=True, kw_only=True)
class GearboxSections:
    """A gearbox file.

    Parameters
    ----------
    title : str
        Of the page.
    shafts : tuple of Shaft
    bearings : tuple of Bearing
    meshes : tuple of Mesh
    sets : tuple of PlanetarySet
    loads : tuple of LoadCase
    gravity : Gravity
    lubricant : Lubricant
    housing : Housing
    masses : tuple of Mass
    dynamics : Motion
    """

    title: str
    shafts: tuple[Shaft, ...]
    bearings: tuple[Bearing, ...]
    meshes: tuple[Mesh, ...] = ()
    sets: tuple[PlanetarySet, ...] = ()
    loads: tuple[LoadCase, ...]
    gravity: Gravity = Gravity()
    lubricant: Lubricant = Lubricant()
    housing: Housing = Housing()
    masses: tuple[Mass, ...] = ()
    dynamics: Motion = Motion()
