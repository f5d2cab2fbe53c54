"""Sections of a set file: one dataclass each.

A planetary set has its members in the sections `[sun]`, `[planet]` and `[ring]`, a train of gears on fixed axes in
sections of the names that `[[gears]]` give. They have the keys of a gear in a case file, modifications included;
`[pair]`, `[mesh]` and `[contact]` are those of a case. The helix angle is that of the sun, or of the first gear.
Stepped planets have a second gear, `[second_planet]`, that meshes with the ring; `[second_pair]` is what differs there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from pmor.body.bearing import AnyBearing
from pmor.case.duty import Lubricant, TimedLoad
from pmor.case.motion import Body, Motion
from pmor.case.reader import Sections
from pmor.case.tolerances import Grade, WavesPerPitch
from pmor.case.training import Positions
from pmor.core import ranges

Deviations = Annotated[tuple[float, ...], ranges.micrometres(-1e4, 1e4, in_order=True)]
Amount = Annotated[float, ranges.micrometres(0.0, 1e4)]
Amounts = Annotated[tuple[float, ...], ranges.micrometres(0.0, 1e4, in_order=True)]
Angle = Annotated[float, ranges.Range(-100.0, 100.0, "mrad")]
Angles = Annotated[tuple[float, ...], ranges.Range(-100.0, 100.0, "mrad", in_order=True)]
Direction = Annotated[float, ranges.Range(-360.0, 360.0, "deg")]
Directions = Annotated[tuple[float, ...], ranges.Range(-360.0, 360.0, "deg", in_order=True)]
Torsion = Annotated[float, ranges.Range(1e-3, 1e18, "N mm/rad")] | Literal["rigid"]
Member = Literal["sun", "ring", "carrier"]
# Along the axis, from the middle of the face width.
Place = Annotated[float, ranges.Range(-1e5, 1e5, "mm")]
Cheek = Literal["-z", "+z"]


@dataclass(frozen=True, kw_only=True)
class Planets:
    """The planets of a set (section `[planets]`).

    Parameters
    ----------
    count : int
        Number of planets, equally spaced unless `positions_deg` says otherwise.
    positions_deg : tuple of float
        Places of all planets, counter-clockwise from the y axis, in degrees.
    missing : tuple of int
        Numbers of planets, from 1 on, that are left out.
    radial_um : tuple of float
        How far each pin is off its place outwards, a number for each planet.
    tangential_um : tuple of float
        How far each pin is off its place in the sense in which the torque turns the sun, a number for each planet.
    second_z_mm : float or None
        Mid width of `[second_planet]`, and of the ring, from that of `[planet]` along z; by default beside it.
    timing_mrad : tuple of float
        Angle by which the second gear of each stepped planet is ahead on the shaft, in the sense in which the torque
        turns the planet.
    """

    count: Annotated[int, ranges.Range(1, 24)] = 3
    positions_deg: Directions = ()
    missing: Annotated[tuple[int, ...], ranges.Range(1, 24)] = ()
    radial_um: Deviations = ()
    tangential_um: Deviations = ()
    second_z_mm: ranges.Place | None = None
    timing_mrad: Angles = ()


@dataclass(frozen=True, kw_only=True)
class Eccentricity:
    """By how much the gears of a set are off the axes that they turn about (section `[eccentricity]`).

    The runout of a gear is about twice its eccentricity. A set with one is solved until all of its gears that have one
    stand as before.

    Parameters
    ----------
    sun_um : float
        Distance of the sun from the axis that it turns about.
    ring_um : float
        Distance of the ring from its axis.
    sun_deg : float
        Direction of the sun's eccentricity at angle 0, counter-clockwise from the y axis, in degrees.
    ring_deg : float
        Direction of the ring's eccentricity at angle 0, counter-clockwise from the y axis, in degrees.
    planets_um : tuple of float
        Distance of each planet from the axis of its pin, one number for each; of stepped ones of the first gear.
    planets_deg : tuple of float
        Direction of each planet's eccentricity at angle 0, counted from where the pin lies outwards.
    """

    sun_um: Amount = 0.0
    sun_deg: Direction = 0.0
    ring_um: Amount = 0.0
    ring_deg: Direction = 0.0
    planets_um: Amounts = ()
    planets_deg: Directions = ()


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Standard deviations of the errors of a set (section `[tolerances]`), normal and independent.

    They are about the errors that `[planets]`, `[eccentricity]` and `[[gears]]` say. Each sample is a set of its own,
    solved as any other: percentiles of the peak-to-peak transmission error, of the mesh load factor, or of trains the
    largest share of a path, of K_Hbeta and pressure come out.

    Parameters
    ----------
    pins_radial_um : float
        Radial place of each pin in the carrier.
    pins_tangential_um : float
        Tangential place of each pin in the carrier.
    timing_mrad : float
        Angle of the second gear of each stepped planet on its shaft, and of gears of a train that share one.
    sun_eccentricity_um, ring_eccentricity_um, planets_eccentricity_um : float
        Both components of the eccentricity, in any direction; the runout is about twice the eccentricity.
    gears_eccentricity_um : float
        Both components of the eccentricity of all gears of a train on fixed axes.
    flank_tolerance_class : int or None
        Flank tolerance class of ISO 1328-1:2013 to which all gears are made, besides, as in a case file; both flanks
        of a gear by themselves. Samples are solved over a turn of the gear that takes longest.
    waves_per_pitch : tuple of float
        Deviations of form of that class, as in a case file.
    samples : int
        Sets that are drawn.
    seed : int
        Seed of the draws: the same one draws the same sets.
    """

    pins_radial_um: Amount = 0.0
    pins_tangential_um: Amount = 0.0
    timing_mrad: Annotated[float, ranges.Range(0.0, 100.0, "mrad")] = 0.0
    sun_eccentricity_um: Amount = 0.0
    ring_eccentricity_um: Amount = 0.0
    planets_eccentricity_um: Amount = 0.0
    gears_eccentricity_um: Amount = 0.0
    flank_tolerance_class: Grade | None = None
    waves_per_pitch: WavesPerPitch = ()
    samples: Annotated[int, ranges.Range(8, 100_000)] = 200
    seed: Annotated[int, ranges.Range(0, 1_000_000)] = 0

    @property
    def deviations(self) -> tuple[float, ...]:
        """All standard deviations."""
        return (
            self.pins_radial_um, self.pins_tangential_um, self.timing_mrad, self.sun_eccentricity_um,
            self.ring_eccentricity_um, self.planets_eccentricity_um, self.gears_eccentricity_um,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Gear:
    """A gear of a train on fixed axes (section `[[gears]]`).

    Parameters
    ----------
    name : str
        Name of the gear, and of the section with its teeth.
    at_mm : (float, float) or (float, float, float)
        x and y of its axis, and z of its mid width.
    shaft : str or None
        Name of the shaft that it shares with others, which turn together; None is one of its own.
    torque_Nm : float, "balance" or None
        Torque on the gear from outside, counter-clockwise; "balance" holds against the others, None is an idler.
    timing_mrad : float
        Angle by which the gear is ahead of its place on a shared shaft, in the sense in which it is driven.
    torsion_Nmm_per_rad : float or "rigid"
        Torsional stiffness of a shared shaft between this gear and the one of it that meshes first.
    eccentricity_um : float
        Distance of the gear from the axis that it turns about.
    eccentricity_deg : float
        Direction of the gear's eccentricity at angle 0, counter-clockwise from the y axis, in degrees.
    """

    name: str
    at_mm: ranges.Places
    shaft: str | None = None
    torque_Nm: ranges.SignedTorque | Literal["balance"] | None = None
    timing_mrad: Angle = 0.0
    torsion_Nmm_per_rad: Torsion = "rigid"
    eccentricity_um: Amount = 0.0
    eccentricity_deg: Direction = 0.0


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """A mesh of a train on fixed axes (section `[[meshes]]`), in the order in which power flows.

    Parameters
    ----------
    gears : (str, str)
        Names of driving and driven gear.
    pair : str
        Section with keys of its pair that differ from those of `[pair]`.
    """

    gears: tuple[str, ...]
    pair: str = "pair"


@dataclass(frozen=True, kw_only=True)
class SetLoad:
    """The load of a planetary set (section `[load]`).

    Parameters
    ----------
    torque_Nm : float
        Torque on one of its members from outside. A positive one on the sun loads its drive flanks, a negative one its
        coast flanks.
    on : {"sun", "ring", "carrier"}
        Member that the torque is on.
    held : {"sun", "ring", "carrier"}
        Member that stands still.
    speed_rpm : float or None
        Speed of the member that the torque is on, for frequencies; None is left out.
    """

    torque_Nm: ranges.SignedTorque
    on: Member = "sun"
    held: Member = "ring"
    speed_rpm: Annotated[float, ranges.Range(0.0, 1e7, "1/min", low_excluded=True)] | None = None


@dataclass(frozen=True, kw_only=True)
class Supports:
    """What members of a planetary set stand on (section `[supports]`).

    Parameters
    ----------
    sun_radial_N_per_mm : float, "rigid" or "free"
        Stiffness across the axis of what the sun stands on; "free" floats.
    ring_radial_N_per_mm : float, "rigid" or "free"
        Stiffness across the axis of what the ring stands on; "free" floats.
    planet_radial_N_per_mm : float or "rigid"
        Stiffness across the axis of the bearing of a planet and its pin, in place of `[pins]`.
    sun_tilt_Nmm_per_rad, ring_tilt_Nmm_per_rad, planet_tilt_Nmm_per_rad : float or "rigid"
        Stiffness against tilting, about axes across; that of planets in place of `[pins]`.
    planet_torsion_Nmm_per_rad : float or "rigid"
        Torsional stiffness between both gears of a stepped planet.
    """

    sun_radial_N_per_mm: ranges.Stiffness = "rigid"
    ring_radial_N_per_mm: ranges.Stiffness = "rigid"
    planet_radial_N_per_mm: ranges.Stiffness = "rigid"
    sun_tilt_Nmm_per_rad: ranges.TiltStiffness = "rigid"
    ring_tilt_Nmm_per_rad: ranges.TiltStiffness = "rigid"
    planet_tilt_Nmm_per_rad: ranges.TiltStiffness = "rigid"
    planet_torsion_Nmm_per_rad: Torsion = "rigid"


@dataclass(frozen=True, kw_only=True)
class PinBearing(AnyBearing):
    """A bearing of each planet on its pin (`bearings = [{at_mm = 0.0}]` in `[pins]`).

    Parameters
    ----------
    at_mm : float
        Place along the axis, from the middle of the face width.
    radial_N_per_mm : float or "rigid"
        Stiffness of the bearing across the axis.
    tilt_Nmm_per_rad : float, "rigid" or "free"
        Stiffness against tilting, about axes across, as of a single bearing that holds the planet alone.
    ball, roller, spherical_roller : BallBearing, RollerBearing, SphericalRollerBearing
        Of a bearing by its inner geometry, whose rows take thrust both ways or none: as stiff as under its share of the
        forces of both meshes at the torque of `[load]`.
    catalogue : CatalogueBearing
        Of a bearing by its sizes alone: the stiffness across is estimated under that load, good to a factor of two.
    """

    at_mm: Place


@dataclass(frozen=True, kw_only=True)
class Pins:
    """The pins of the planets: equal beams with shear (section `[pins]`), in place of planets in `[supports]`.

    Parameters
    ----------
    diameter_mm : float
        Outer diameter of the pin.
    inner_mm : float
        Inner diameter; 0 is a solid pin.
    length_mm : float
        Length between both cheeks of the carrier, or from the only one to the free end.
    middle_mm : float
        Place of the middle of this length along the axis, from the middle of the face width.
    cheeks : {"both", "-z", "+z"}
        Cheeks that hold the pin: both, or the one on that side (flying pins).
    ends : {"clamped", "supported"}
        How it ends in the cheeks: pressed in, or free to tilt.
    bearings : tuple of PinBearing
        That the planet runs on.
    youngs_modulus_GPa : float
        Young's modulus of the pin, by default of steel.
    poisson_ratio : float
        Poisson's ratio of the pin, by default of steel.
    """

    diameter_mm: ranges.Length
    inner_mm: ranges.Diameter = 0.0
    length_mm: ranges.Length
    middle_mm: Place = 0.0
    cheeks: Literal["both", "-z", "+z"] = "both"
    ends: Literal["clamped", "supported"] = "clamped"
    bearings: tuple[PinBearing, ...]
    youngs_modulus_GPa: ranges.YoungsModulus = 210.0
    poisson_ratio: ranges.PoissonRatio = 0.3

    @property
    def ends_mm(self) -> tuple[float, float]:
        """Along the axis, from the middle of the face width."""
        return self.middle_mm - 0.5 * self.length_mm, self.middle_mm + 0.5 * self.length_mm

    def linear(self, load_N: float) -> Pins:
        """Return the pins with bearings by their stiffness under a force on the planet, which they share."""
        share = load_N / len(self.bearings)
        return replace(self, bearings=tuple(bearing.linear(share) for bearing in self.bearings))


@dataclass(frozen=True, kw_only=True)
class Carrier:
    """What the pins stand on (section `[carrier]`); rigid without it.

    Parameters
    ----------
    windup_Nmm_per_rad : float or "rigid"
        Stiffness of one cheek against the other about the axis: winding up tilts all pins around. Clamped pins resist
        it beside that.
    torque_at : {"-z", "+z"} or None
        Side of the cheek that leads the torque out; the other one turns.
    stiffness : Path or None
        CSV file beside the set file, in place of the wind-up: the carrier's stiffness matrix at the seats of its pins,
        its shaft held, without head; for each planet, its seat at -z first, displacements along and rotations about x,
        y, z of the set at angle 0; N/mm, N, N mm/rad.
    radial_N_per_mm : float, "rigid" or "free"
        Stiffness of the carrier's bearings across the axis; "free" floats.
    tilt_Nmm_per_rad : float or "rigid"
        Stiffness of the carrier's bearings against tilting, about axes across.
    bearings_at_mm : float
        Place along the axis, from the middle of the face width, where a force across does not tilt the carrier.
    """

    windup_Nmm_per_rad: ranges.TiltStiffness = "rigid"
    torque_at: Cheek | None = None
    stiffness: Path | None = None
    radial_N_per_mm: ranges.Stiffness = "rigid"
    tilt_Nmm_per_rad: ranges.TiltStiffness = "rigid"
    bearings_at_mm: Place = 0.0


@dataclass(frozen=True, kw_only=True)
class MemberMass(Body):
    """What turns with a member and the drawing does not show (section `[[masses]]`), for motion: carrier, motor, load.

    Parameters
    ----------
    on : {"sun", "ring", "carrier"}
        Member that it moves with. The inertia of one that is not held lets it swing about the axis; without any, the
        carrier, and the ring beside a sun that is not held, turn evenly.
    mass_kg : float
        Mass of what turns with the member.
    polar_inertia_kg_m2 : float
        Moment of inertia about the axis of the set.
    tilting_inertia_kg_m2 : float
        Moment of inertia about an axis across it through mid width.
    """

    on: Member


@dataclass(frozen=True, kw_only=True)
class SetSweep:
    """Positions and loads that are solved (section `[sweep]`).

    Parameters
    ----------
    angles_per_pitch : int
        Positions to a mesh cycle; rounded up until equal planets pass the same ones.
    torques_Nm : tuple of float
        Amounts of the torque of `[load]`, or of the first gear, in N m, increasing; the nominal one is among them.
    pitches : int or None
        Pitches of the first gear that are solved; None is as many as it takes until meshes, unequal teeth and eccentric
        gears stand as before.
    """

    angles_per_pitch: Positions = 60
    torques_Nm: ranges.Torques = ()
    pitches: Annotated[int, ranges.Range(1, 100_000)] | None = None


@dataclass(frozen=True, kw_only=True)
class SetSections:
    """A set file.

    Parameters
    ----------
    title : str
        Of the page.
    load : SetLoad or None
        Of a planetary set.
    loads : tuple of TimedLoad
        Of a duty cycle.
    planets : Planets
    eccentricity : Eccentricity
    tolerances : Tolerances or None
        Without them a set is solved once.
    supports : Supports
    pins : Pins or None
    carrier : Carrier
    lubricant : Lubricant
    gears : tuple of Gear
        Of a train on fixed axes, in place of sun, planets and ring.
    meshes : tuple of Mesh
    sweep : SetSweep
    masses : tuple of MemberMass
    dynamics : Motion
        Of a planetary set.
    members : mapping
        Sections of a case file, and those of the members.
    """

    title: str
    load: SetLoad | None = None
    loads: tuple[TimedLoad, ...] = ()
    planets: Planets = Planets()
    eccentricity: Eccentricity = Eccentricity()
    tolerances: Tolerances | None = None
    supports: Supports = Supports()
    pins: Pins | None = None
    carrier: Carrier = Carrier()
    lubricant: Lubricant = Lubricant()
    gears: tuple[Gear, ...] = ()
    meshes: tuple[Mesh, ...] = ()
    sweep: SetSweep = SetSweep()
    masses: tuple[MemberMass, ...] = ()
    dynamics: Motion = Motion()
    members: Sections
