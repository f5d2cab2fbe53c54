"""Sections of a gearbox file that say what acts on its shafts: loads, gravity, masses beside the drawing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pmor.case.duty import Timed
from pmor.case.motion import Body
from pmor.core import ranges

AnyTorque = ranges.SignedTorque | Literal["balance"]
Force = Annotated[float, ranges.Range(-1e12, 1e12, "N")]
Acceleration = Annotated[float, ranges.Range(-1e3, 1e3, "m/s2")]


@dataclass(frozen=True, kw_only=True)
class Ripple:
    """A torque that swings with the turns of its shaft (section `ripple` of `torques` of `[[loads]]`), for motion.

    Parameters
    ----------
    order : float
        Swings to a turn of the shaft.
    amplitude_Nm : float
        Amplitude about the mean torque, from zero to peak.
    phase_deg : float
        Phase at angle 0 of the shaft.
    """

    order: Annotated[float, ranges.Range(0.0, 1e4, low_excluded=True)]
    amplitude_Nm: Annotated[float, ranges.Range(0.0, 1e12, "N m")]
    phase_deg: Annotated[float, ranges.Range(-360.0, 360.0, "deg")] = 0.0


@dataclass(frozen=True, kw_only=True)
class ShaftTorque:
    """A torque on a shaft (section `torques` of `[[loads]]`).

    Parameters
    ----------
    shaft : str
        Shaft that it acts on.
    at_mm : float
        Place of the torque along the shaft.
    torque_Nm : float or "balance"
        Torque about x. "balance", at one place of a train, holds against all others.
    ripple : tuple of Ripple
        What swings about it in motion.
    """

    shaft: str
    at_mm: ranges.Place
    torque_Nm: AnyTorque
    ripple: tuple[Ripple, ...] = ()


@dataclass(frozen=True, kw_only=True)
class ShaftForce:
    """A force on a shaft (section `forces` of `[[loads]]`).

    Parameters
    ----------
    shaft : str
        Shaft that it acts on.
    at_mm : float
        Place of the force along the shaft.
    x_N : float
        Force along x of the machine.
    y_N : float
        Force along y of the machine.
    z_N : float
        Force along z of the machine.
    turns : bool
        Whether it turns with the shaft: y and z are those at the start then. Otherwise it stands in the housing.
    """

    shaft: str
    at_mm: ranges.Place
    x_N: Force = 0.0
    y_N: Force = 0.0
    z_N: Force = 0.0
    turns: bool = False


@dataclass(frozen=True, kw_only=True)
class ShaftMoment:
    """A bending moment on a shaft (section `moments` of `[[loads]]`).

    Parameters
    ----------
    shaft : str
        Shaft that it acts on.
    at_mm : float
        Place of the moment along the shaft.
    y_Nm : float
        Moment about y of the machine.
    z_Nm : float
        Moment about z of the machine.
    turns : bool
        Whether it turns with the shaft: y and z are those at the start then. Otherwise it stands in the housing.
    """

    shaft: str
    at_mm: ranges.Place
    y_Nm: ranges.SignedTorque = 0.0
    z_Nm: ranges.SignedTorque = 0.0
    turns: bool = False


@dataclass(frozen=True, kw_only=True)
class LoadCase(Timed):
    """What acts on the shafts at once (section `[[loads]]`).

    Parameters
    ----------
    name : str
        Name of the load case.
    torques : tuple of ShaftTorque
    forces : tuple of ShaftForce
    moments : tuple of ShaftMoment
    speed_rpm : float or None
        Speed of the shaft of the first torque, about x.
    fraction : float or None
        Share of the operating time, of a duty cycle: all loads have one, or none has. They add up to 1.
    hours : float or None
        Operating time in this load case, h, instead of its share.
    """

    torques: tuple[ShaftTorque, ...]
    forces: tuple[ShaftForce, ...] = ()
    moments: tuple[ShaftMoment, ...] = ()
    speed_rpm: Annotated[float, ranges.Range(-1e6, 1e6, "rpm")] | None = None

    @property
    def places(self) -> tuple[tuple[str, float], ...]:
        """Shafts and places along them, mm, of all torques, forces and moments."""
        acting: tuple[ShaftTorque | ShaftForce | ShaftMoment, ...] = (*self.torques, *self.forces, *self.moments)
        return tuple((one.shaft, one.at_mm) for one in acting)


@dataclass(frozen=True, kw_only=True)
class Gravity:
    """By what shafts and gears are heavy (section `[gravity]`); without it they have no weight.

    Gears weigh as drawn, of `density_kg_m3` in `[dynamics]` of their case.

    Parameters
    ----------
    x_m_s2 : float
        Acceleration along x of the machine: -9.81 where x points upwards.
    y_m_s2 : float
        Acceleration along y of the machine: -9.81 where y points upwards.
    z_m_s2 : float
        Acceleration along z of the machine: -9.81 where z points upwards.
    """

    x_m_s2: Acceleration = 0.0
    y_m_s2: Acceleration = 0.0
    z_m_s2: Acceleration = 0.0

    @property
    def vector(self) -> tuple[float, float, float]:
        """m/s2."""
        return self.x_m_s2, self.y_m_s2, self.z_m_s2


@dataclass(frozen=True, kw_only=True)
class Mass(Body):
    """A rigid body on a shaft that the drawing does not show (section `[[masses]]`): motor, coupling, brake, load.

    Parameters
    ----------
    name : str
        Name of the body.
    shaft : str
        Shaft that carries it.
    at_mm : float
        Place of its middle along the shaft.
    mass_kg : float
        Its mass.
    polar_inertia_kg_m2 : float
        Moment of inertia about the axis.
    tilting_inertia_kg_m2 : float
        Moment of inertia about an axis across the shaft's, through its middle.
    unbalance_kg_mm : float
        Unbalance, for motion: mass times the distance of its centre from the axis.
    unbalance_deg : float
        Place of the centre of an unbalanced body, from y towards z.
    """

    name: str
    shaft: str
    at_mm: ranges.Place
    unbalance_kg_mm: Annotated[float, ranges.Range(0.0, 1e9, "kg mm")] = 0.0
    unbalance_deg: Annotated[float, ranges.Range(-360.0, 360.0, "deg")] = 0.0
