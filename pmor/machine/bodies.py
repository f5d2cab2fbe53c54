"""Surfaces of the bodies of a gearbox and how they move: shafts, gears with their teeth, rings of bearings.

Each body is a row of rings along its axis, with the same number of points; a ring is carried by one node of the system,
and moves with it as a rigid body by small rotations.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from pmor.body.beam import NODE, Beam
from pmor.core.arrays import FloatArray, IntArray
from pmor.export.gear_surface import BEFORE, flank_columns, gear_rings, quads_between
from pmor.gear.pair import GearPair
from pmor.machine.coupled import SolvedLoad
from pmor.machine.loaded import ABOUT_AXIS, LoadedGearbox, Supported
from pmor.machine.mesh_force import MeshFrame
from pmor.machine.model import GearboxModel
from pmor.machine.set_bodies import gears_of_set, member_places
from pmor.machine.settings import Shaft
from pmor.results.flank_maps import flank_map

# Of a bearing without inner geometry: width over the shaft's diameter, outer over inner diameter.
WIDTH, OUTER = 0.3, 1.5
# Of one with it: rings over the rolling elements, along the axis and across.
RINGS_ALONG, RINGS_ACROSS = 1.4, 0.8
# A gear that is cut into its shaft: bore over root circle.
CUT = 0.9
# Outside of a ring over its root circle.
RIM = 1.15


class Detail(NamedTuple):
    """How finely surfaces are drawn.

    Attributes
    ----------
    circle, profile, fillet, planes : int
        Points of a circle, of an involute and of a fillet; transverse sections of a gear.
    """

    circle: int
    profile: int
    fillet: int
    planes: int


class Teeth(NamedTuple):
    """Teeth of a gear in axes of its mesh, in which its rings were made.

    Attributes
    ----------
    shaft, at_mm : str, float
        Where the gear is.
    frame : MeshFrame
        Of the mesh.
    roll : ndarray, shape (R,)
        Roll angles of points on both flanks, rad.
    z : ndarray, shape (Z,)
        Of the transverse sections, mm.
    fillet : int
        Points of a fillet.
    """

    shaft: str
    at_mm: float
    frame: MeshFrame
    teeth: int
    roll: FloatArray
    z: FloatArray
    fillet: int


@dataclass(frozen=True, eq=False)
class Body:
    """A shaft, a gear or a bearing.

    Parameters
    ----------
    rings : ndarray, shape (K, N, 3)
        N points of K rings in axes of the machine, mm, counter-clockwise about x.
    node : ndarray of int, shape (K,)
        First displacement of the node that carries each ring; the size of the system where it stands still.
    centre : ndarray, shape (K, 3)
        Places of these nodes, mm.
    teeth : Teeth, optional
        Of a gear.
    """

    name: str
    kind: Literal["shaft", "gear", "bearing"]
    rings: FloatArray
    node: IntArray
    centre: FloatArray
    teeth: Teeth | None = None

    @property
    def quads(self) -> IntArray:
        """Corners of the quadrilaterals between the rings, (m, 4), by the numbers of points; they look outwards."""
        quads, points = quads_between(self.rings), self.rings.shape[1]
        axis = np.linalg.norm(self.rings - self.rings.mean(axis=1, keepdims=True), axis=2).max(axis=1) < 1e-9
        return np.asarray(quads[~np.repeat(axis[1:] & axis[:-1], points)])

    def displacement(self, moved: FloatArray, twist: bool = True) -> FloatArray:
        """Return the displacement of all points, (K, N, 3), mm, by those of all nodes, (n,).

        Parameters
        ----------
        twist : bool
            With the rotation about the axis, which grows along a shaft and is no small one when it is exaggerated.
        """
        by_ring = np.append(moved, np.zeros(NODE))[self.node[:, None] + np.arange(NODE)]
        turn = by_ring[:, None, ABOUT_AXIS:] * np.array([float(twist), 1.0, 1.0])
        return np.asarray(by_ring[:, None, :ABOUT_AXIS] + np.cross(turn, self.rings - self.centre[:, None]))

    def line_load(self, solved: SolvedLoad) -> FloatArray:
        """Return the largest line load over the mesh cycle on the flanks, N/mm, (K, N): 0 elsewhere."""
        found = np.zeros(self.rings.shape[:2])
        teeth = self.teeth
        if teeth is None:
            return found
        outline = 2 * (len(teeth.roll) + teeth.fillet)
        of_tooth = np.zeros((len(teeth.z), outline))
        for mesh in solved.meshes:
            said, frame = mesh.meshing.settings, mesh.meshing.frame
            for number, gear in enumerate((said.pinion, said.wheel)):
                if (gear.shaft, gear.at_mm) != (teeth.shaft, teeth.at_mm):
                    continue
                largest = flank_map(mesh.sweep, 0, number, (teeth.roll[0], teeth.roll[-1]), len(teeth.roll))
                # Seen from its other end, or in the image, a gear carries on its other flanks.
                turned = frame.along != teeth.frame.along
                same = turned == (frame.hand != teeth.frame.hand)
                z = -teeth.z if turned else teeth.z
                load = np.stack([np.interp(z, largest.z_mm, row) for row in largest.load_N_per_mm], axis=-1)
                flank = flank_columns(0, same, len(teeth.roll), teeth.fillet)
                of_tooth[:, flank] = np.maximum(of_tooth[:, flank], load)
        found[BEFORE:-BEFORE] = _seen_along(np.tile(of_tooth, teeth.teeth), teeth.frame)
        return found


def bodies(model: GearboxModel, gearbox: LoadedGearbox, detail: Detail) -> list[Body]:
    """Return all bodies of a gearbox at rest, each mesh at pinion angle 0."""
    shafts = model.shafts
    found = [_shaft(shaft, gearbox.beams[name], gearbox.first[name], detail) for name, shaft in shafts.items()]
    found += [_bearing(model, gearbox, bearing, detail) for bearing in gearbox.bearings]
    there = set()
    for mesh in gearbox.meshes:
        said = mesh.settings
        for number, gear in enumerate((said.pinion, said.wheel)):
            if (gear.shaft, gear.at_mm) in there:
                continue
            there.add((gear.shaft, gear.at_mm))
            shaft, node = shafts[gear.shaft], mesh.hubs[number]
            centre = np.array([shaft.start_mm + gear.at_mm, *shaft.at_mm])
            bore = 0.5 * shaft.section_at(gear.at_mm).outer_mm
            rings, teeth = _gear(mesh.pair, number, mesh.frame, bore, detail)
            rings, nodes = rings + centre, np.full(len(rings), node)
            of_mesh = Teeth(gear.shaft, gear.at_mm, mesh.frame, *teeth)
            name = f"{said.name}, {('pinion', 'wheel')[number]}"
            found.append(Body(name, "gear", rings, nodes, np.tile(centre, (len(rings), 1)), of_mesh))
    for one in gearbox.sets:
        places = member_places(model, one)
        for part in gears_of_set(model, one, detail.profile, detail.fillet, detail.planes):
            hub, name = one.hubs[part.member], f"{one.settings.name}, {part.name}"
            nodes = np.full(len(part.rings), len(gearbox.load) if hub is None else hub)
            found.append(Body(name, "gear", part.rings, nodes, np.tile(places[part.member], (len(nodes), 1))))
    return found


def _revolved(profile: Sequence[tuple[float, float]], points: int) -> FloatArray:
    """Rings about x through points (x, radius) of a profile."""
    angle = 2.0 * math.pi * np.arange(points) / points
    x, radius = np.array(profile).T[..., None]
    return np.stack([np.broadcast_to(x, (len(x), points)), radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def _shaft(shaft: Shaft, beam: Beam, first: int, detail: Detail) -> Body:
    profile, node = list[tuple[float, float]](), list[int]()
    for element, section in enumerate(beam.sections):
        for station in (element, element + 1):
            profile.append((beam.stations[station], 0.5 * section.outer))
            node.append(station)
    for element, section in reversed(list(enumerate(beam.sections))):
        for station in (element + 1, element):
            profile.append((beam.stations[station], 0.5 * section.inner))
            node.append(station)
    profile.append(profile[0])
    node.append(0)
    axis = np.array([shaft.start_mm, *shaft.at_mm])
    centre = axis + np.outer(beam.stations[node], [1.0, 0.0, 0.0])
    return Body(shaft.name, "shaft", axis + _revolved(profile, detail.circle), first + NODE * np.array(node), centre)


def _bearing(model: GearboxModel, gearbox: LoadedGearbox, bearing: Supported, detail: Detail) -> Body:
    said, shafts = bearing.settings, model.shafts
    shaft = shafts[said.shaft]
    inner = 0.5 * shaft.section_at(said.at_mm).outer_mm
    width, outer = WIDTH * 2.0 * inner, OUTER * inner
    if (geometry := said.inner) is not None:
        size, length = geometry.element_mm
        length += geometry.row_places[-1] - geometry.row_places[0]
        width, outer = RINGS_ALONG * length, 0.5 * geometry.pitch_diameter_mm + RINGS_ACROSS * size
    if said.to in shafts:
        around = shafts[said.to]
        hollow = 0.5 * around.section_at(said.at_mm + shaft.start_mm - around.start_mm).inner_mm
        outer = hollow if hollow > inner else outer
    profile = [(x, max(radius, inner)) for x, radius in
               ((-width, inner), (-width, outer), (width, outer), (width, inner), (-width, inner))]  # fmt: skip
    centre = np.array([shaft.start_mm + said.at_mm, *shaft.at_mm])
    rings = centre + _revolved([(0.5 * x, radius) for x, radius in profile], detail.circle)
    row = bearing.rows[0]
    carried, carrier = int(row.argmax()), int(row.argmin()) if row.min() < 0.0 else len(gearbox.load)
    node = np.array([carried, carrier, carrier, carried, carried])
    return Body(said.name, "bearing", rings, node, np.tile(centre, (len(rings), 1)))


def _gear(
    pair: GearPair, number: int, frame: MeshFrame, bore: float, detail: Detail
) -> tuple[FloatArray, tuple[int, FloatArray, FloatArray, int]]:
    """Return rings of a gear about its middle at pinion angle 0, from bore to bore, and what `Teeth` takes."""
    tooth = (pair.pinion, pair.wheel)[number]
    turned = 0.0 if number == 0 else math.pi + pair.wheel_tooth_rotation(0.0)
    roll = np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, detail.profile)
    z = np.linspace(*pair.faces[number], detail.planes)
    within = min(bore, CUT * tooth.root_radius) if tooth.teeth > 0 else RIM * abs(tooth.root_radius)
    rings = gear_rings(tooth, turned, within, roll, detail.fillet, z) @ frame.axes.T
    return _seen_along(rings, frame), (abs(tooth.teeth), roll, z, detail.fillet)


def _seen_along(rings: FloatArray, frame: MeshFrame) -> FloatArray:
    """Rings counter-clockwise about z of a mesh as rings counter-clockwise about x, one after the other along x."""
    return rings[:: int(frame.along), :: int(frame.along * frame.hand)]
