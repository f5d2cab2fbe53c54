"""The mesh of a pair as a connector of two bodies in exudyn, by exact line loads.

exudyn (J. Gerstmayr, Multibody Syst. Dyn. 60 (2024) 533) moves rigid and flexible bodies. There a mesh is an object of
its own, without mass, that shares the coordinates of two gears. Each evaluation solves the line loads anew where both
gears then are: nothing is tabulated, and shifts and tilts of the gears move the load over the flanks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from pmor.case.capability import refuse_beyond
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, ConvergenceError, ExternalProgramError
from pmor.core.keeping import entry_of
from pmor.core.shown import brief
from pmor.dynamics.gear_model import levers
from pmor.dynamics.kernels import bodies as kernels
from pmor.dynamics.kernels.bodies import MM, GearBody, Meshing
from pmor.dynamics.law import backlash_of
from pmor.gear.pair import GearPair
from pmor.line.hub_force import contact_of, nothing_placed
from pmor.line.kernels.hubs import Contact, Placed
from pmor.pair.conditions import assembly_of
from pmor_online.model import ReducedPair

# Coordinates of rotation, by the type of a body's node.
ROTATIONS = {
    "1D": kernels.ANGLE, "RigidBodyEP": kernels.EULER_PARAMETERS, "RigidBodyRxyz": kernels.XYZ,
    "RigidBodyRotVecLG": kernels.ROTATION_VECTOR,
}  # fmt: skip
ROTOR = "RotationalMass1D"
Place = Sequence[float] | FloatArray


@brief
@dataclass(frozen=True)
class ExudynMesh:
    """A mesh in a system of exudyn.

    Parameters
    ----------
    object_number, sensor_number : int
        In the system. The sensor stores the transmission error, um, and the force along the line of action, N.
    connector : Connector
        The forces, evaluation after evaluation.
    """

    object_number: int
    sensor_number: int
    connector: Connector

    @property
    def overloaded(self) -> bool:
        """Whether contact was ever too wide for its law in some section: results are none from there on."""
        return self.connector.overloaded


def connect(
    mbs: Any, reduced: ReducedPair, bodies: tuple[Any, Any], axis: Place, at_m: tuple[Place, Place] | None,
    damping_N_s_mm: float,
) -> ExudynMesh:  # fmt: skip
    """Add a mesh to a system of exudyn; arguments and errors as of `pmor.exudyn_mesh`."""
    try:
        import exudyn
        from exudyn.itemInterface import ObjectGenericODE2, SensorUserFunction
    except ImportError:
        raise ExternalProgramError(
            "exudyn_mesh: the package exudyn is not installed: pip install 'pmor-gear[exudyn]'"
        ) from None
    refuse_beyond(reduced.basis.case, "exudyn")
    described = [described_body(mbs.GetObject(body), mbs.GetNode(mbs.GetObject(body)["nodeNumber"])) for body in bodies]
    mesh = connector(reduced, described, axis, at_m, damping_N_s_mm)
    nodes = [mbs.GetObject(body)["nodeNumber"] for body in bodies]

    def forces(mbs: Any, time: float, number: int, coordinates: list[float], rates: list[float]) -> FloatArray:
        return mesh.forces(coordinates, rates)

    def sensed(mbs: Any, time: float, sensors: list[int], factors: list[float], configuration: Any) -> list[float]:
        kind = exudyn.OutputVariableType.Coordinates
        current = (np.asarray(mbs.GetNodeOutput(node, kind, configuration)) for node in nodes)
        return mesh.reading([one for each in current for one in each.ravel().tolist()])

    massless = np.zeros((mesh.size, mesh.size))
    number = mbs.AddObject(ObjectGenericODE2(nodeNumbers=nodes, massMatrix=massless, forceUserFunction=forces))
    sensor = mbs.AddSensor(SensorUserFunction(sensorUserFunction=sensed, storeInternal=True, writeToFile=False))
    return ExudynMesh(number, sensor, mesh)


class BodyOfExudyn(NamedTuple):
    """What exudyn knows of a body, in metres and its axes.

    Attributes
    ----------
    node_type : str
        One of `ROTATIONS`.
    reference : ndarray, shape (n,)
        Coordinates of its node where displacements are zero.
    place : ndarray, shape (3,)
        Of its own point there.
    direction : ndarray, shape (3,)
        About which the angle of a rotor counts.
    """

    node_type: str
    reference: FloatArray
    place: FloatArray
    direction: FloatArray


def described_body(body: dict[str, Any], node: dict[str, Any]) -> BodyOfExudyn:
    """Return a body from the dictionaries that exudyn has of it and its node; CaseError for one that is no gear."""
    kind, reference = node["nodeType"], np.array(node["referenceCoordinates"], dtype=float)
    if kind not in ROTATIONS or (kind == "1D") != (body["objectType"] == ROTOR):
        raise CaseError(
            f"exudyn_mesh: body {body['name']} is a {body['objectType']} on a node of type {kind}: must be a {ROTOR}, "
            f"or a body on a node {', '.join(list(ROTATIONS)[1:-1])} or {list(ROTATIONS)[-1]}"
        )
    if kind == "1D":
        turned = np.array(body["referenceRotation"])
        return BodyOfExudyn(kind, reference, np.array(body["referencePosition"]), turned[:, 2])
    return BodyOfExudyn(kind, reference, reference[:3], np.array([0.0, 0.0, 1.0]))


def turn_alone(mbs: Any, bodies: tuple[Any, Any]) -> bool:
    """Return whether bodies of exudyn neither shift nor tilt."""
    return all(mbs.GetObject(body)["objectType"] == ROTOR for body in bodies)


def connector(
    reduced: ReducedPair, bodies: Sequence[BodyOfExudyn], axis: Place, at_m: tuple[Place, Place] | None, damping: float
) -> Connector:
    """Return the forces of a mesh on two bodies; arguments and errors as of `pmor.exudyn_mesh`."""
    case, pair = reduced.basis.case, reduced.meshed.pair
    middles = [np.array(place, dtype=float) for place in (at_m or [body.place for body in bodies])]
    axes, misplaced = _axes(pair, axis, middles, all(body.node_type == "1D" for body in bodies))
    gears, first = list[GearBody](), 0
    for body, middle, off in zip(bodies, middles, (np.zeros(3), misplaced), strict=True):
        last, kind = first + len(body.reference), ROTATIONS[body.node_type]
        if kind == kernels.ANGLE:
            reference = np.copysign(np.ones(1), body.direction @ axes[:, 2])
            turned, spins = np.eye(3), np.eye(3)
        else:
            reference = body.reference[3:]
            turned, spins = kernels.orientation(kind, reference)
        arm = middle - body.place
        gears.append(
            GearBody(
                kind, first, last, reference, np.ascontiguousarray(turned.T @ axes), turned.T @ arm,
                axes.T @ (off - arm), np.zeros(3), np.zeros_like(spins),
            )
        )  # fmt: skip
        first = last
    backlash = backlash_of(case, pair)
    meshing = Meshing(axes, closing_of(pair), pair.pitch, math.inf if backlash is None else backlash, damping)
    contact = contact_of(reduced.lines, assembly_of(case))
    return Connector((gears[0], gears[1]), meshing, contact, nothing_placed(reduced.lines))


def _axes(pair: GearPair, axis: Place, middles: list[FloatArray], rotors: bool) -> tuple[FloatArray, FloatArray]:
    """Axes of the pair, columns, and where the wheel's middle is, seen from where the drawing has it, m."""
    z = np.array(axis, dtype=float)
    z /= np.linalg.norm(z)
    # Rotors may have no place: any direction across the axis does.
    across = np.eye(3)[np.abs(z).argmin()] if rotors else middles[1] - middles[0]
    along = float(across @ z)
    across -= along * z
    distance, drawn = float(np.linalg.norm(across)), abs(pair.centre_distance) / MM
    apart = MM * abs(distance - drawn) > pair.pinion.module or MM * abs(along) > pair.common_width
    if apart and not rotors:
        raise CaseError(
            f"exudyn_mesh: the middles of the gears are {distance:.6g} m apart across the axis and {abs(along):.6g} m "
            f"along it, and the pair has a centre distance of {drawn:.6g} m: place bodies in metres, or give the "
            "middles of their teeth, at_m"
        )
    # The wheel's axis is where the drawing has it: a ring's centre distance is negative.
    y = math.copysign(1.0, pair.centre_distance) / distance * across
    return np.column_stack([np.cross(y, z), y, z]), (distance - drawn) / distance * across + along * z


def closing_of(pair: GearPair) -> FloatArray:
    """Return the approach of the flanks along the line of action per displacement and rotation of both hubs, (12,)."""
    rows = zip(levers(pair), (pair.pinion, pair.wheel), strict=True)
    return np.concatenate([[*row[:3], *(tooth.base_radius * row[3:]), tooth.base_radius] for row, tooth in rows])


class Connector:
    """The forces of a mesh on the coordinates of both gears, evaluation after evaluation.

    Attributes
    ----------
    size : int
        Number of coordinates of both bodies.
    overloaded : bool
        Whether contact of some section was ever too wide for the law (`pmor.line.hertz.WidthLimit`).
    """

    def __init__(
        self, bodies: tuple[GearBody, GearBody], meshing: Meshing, contact: Contact, placed: Placed
    ) -> None:  # fmt: skip
        self.size, self.overloaded = bodies[1].last, False
        self._radius, self._wrench = meshing.closing[5], placed.wrench
        self._coordinates, self._rates, self._forces = np.full((3, self.size), np.nan)
        displacement = np.zeros_like(meshing.closing)
        self._arguments = bodies, meshing, contact, placed, self._coordinates, self._rates, displacement, self._forces
        self._solve = entry_of(kernels.mesh_of_gears, *self._arguments)
        self._last, self._advance = list[float](), math.nan

    def forces(self, coordinates: list[float], rates: list[float]) -> FloatArray:
        """Return the generalised forces, N and N m, shape (n,), overwritten by the next evaluation.

        ConvergenceError where contact was not found.
        """
        self._last, self._coordinates[:], self._rates[:] = coordinates, coordinates, rates
        converged, overloaded, phi, self._advance = self._solve(*self._arguments)
        if not converged:
            raise ConvergenceError(
                f"no equilibrium at a pinion angle of {math.degrees(phi):.6g} deg and an advance of "
                f"{1e3 * self._radius * self._advance:.6g} um along the line of action: take shorter steps of time"
            )
        self.overloaded |= overloaded
        return self._forces

    def reading(self, coordinates: list[float]) -> list[float]:
        """Return the transmission error, um, and the force along the line of action without damping, N."""
        if coordinates != self._last:
            self.forces(coordinates, [0.0] * self.size)
        return [1e3 * self._radius * self._advance, -self._wrench[5] / self._radius]
