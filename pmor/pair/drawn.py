"""The gears of a case as they are drawn: rings of teeth, rim, web and hub, and holes; their mass and inertia."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.case import Case, GearCase
from pmor.case.blank import HolesCase
from pmor.case.body import BodyCase, MatrixCase
from pmor.core.arrays import FloatArray
from pmor.gear.inertia import Inertia, about_the_axis, disc, tapered_disc
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.pair.model import held_radii


@dataclass(frozen=True)
class Ring:
    """A part of a gear: radii, and z from the middle of its face, mm.

    Of a web with a profile `low` and `high` are its furthest, and `profile` has radius and z of both faces at stations.
    """

    name: str
    inner: float
    outer: float
    low: float
    high: float
    profile: tuple[tuple[float, float, float], ...] = ()

    @property
    def stations(self) -> FloatArray:
        """Radius and z of both faces, rising, (stations, 3), mm."""
        plain = (self.inner, self.low, self.high), (self.outer, self.low, self.high)
        return np.array(self.profile or plain)

    def faces(self, radius: float) -> tuple[float, float]:
        """Return z of both faces at a radius, mm."""
        radii, low, high = self.stations.T
        return float(np.interp(radius, radii, low)), float(np.interp(radius, radii, high))


@dataclass(frozen=True)
class DrawnGear:
    """Parts of a gear.

    Parameters
    ----------
    rings : tuple of Ring
        From the tip circle to the bore; of a solid gear, or of a ring, teeth and body.
    holes : HolesCase or None
        Through the web, the last ring but one.
    body : BodyCase, MatrixCase or None
        Below the rings.
    held : (float, float)
        Ends of the length of a light gear's bore that is held, z from the middle of its face, mm.
    """

    tooth: Tooth
    rings: tuple[Ring, ...]
    holes: HolesCase | None = None
    body: BodyCase | MatrixCase | None = None
    held: tuple[float, float] = (0.0, 0.0)

    @property
    def light(self) -> bool:
        """Whether it has rim, web and hub."""
        return len(self.rings) > 2

    def inertia(self, density_kg_m3: float) -> Inertia:
        """Return mass and moments of inertia; teeth count as a full ring up to the reference circle."""
        teeth, *below = self.rings
        reference, root = abs(self.tooth.reference_radius), abs(self.tooth.root_radius)
        outer, inner = (root, reference) if self.tooth.internal else (reference, root)
        total = _solid(outer, inner, teeth, density_kg_m3)
        for ring in below:
            total += _solid(ring.outer, ring.inner, ring, density_kg_m3)
        if self.body is not None:
            total += _brought(self.body, density_kg_m3)
        if self.holes is not None:
            web, radius, on_radius = self.rings[-2], self.holes.radius_mm, self.holes.on_radius_mm
            hole = _solid(radius, 0.0, web, density_kg_m3)
            total += about_the_axis(hole, on_radius).times(-self.holes.count)
            # Both ends of a slot are a round hole about the axis; the share of a ring is between them.
            between = _solid(on_radius + radius, on_radius - radius, web, density_kg_m3)
            total += between.times(-self.holes.count * self.holes.length_deg / 360.0)
        return total


def drawn_gears(case: Case, pair: GearPair) -> tuple[DrawnGear, DrawnGear]:
    """Return pinion and wheel of a case."""
    held, width = held_radii(case, pair), case.pair.face_width_mm
    return (
        _drawn(case.pair.pinion, pair.pinion, abs(held[0]), width),
        _drawn(case.pair.wheel, pair.wheel, abs(held[1]), width),
    )


def gear_inertias(case: Case, pair: GearPair) -> tuple[Inertia, Inertia]:
    """Return the inertias of pinion and wheel as drawn, of the density of `[dynamics] density_kg_m3`."""
    pinion, wheel = (gear.inertia(case.dynamics.density_kg_m3) for gear in drawn_gears(case, pair))
    return pinion, wheel


def _drawn(gear: GearCase, tooth: Tooth, held: float, pair_width: float) -> DrawnGear:
    half, blank = 0.5 * (gear.face_width_mm or pair_width), gear.light_blank(pair_width)
    root, tip = abs(tooth.root_radius), abs(tooth.tip_radius)
    teeth = Ring("teeth", min(root, tip), max(root, tip), -half, half)
    if gear.body is not None:
        below_teeth = Ring("body", gear.body.found.interface_radius_mm, root, -half, half)
        return DrawnGear(tooth, (teeth, below_teeth), body=gear.body)
    if blank is None:
        return DrawnGear(tooth, (teeth, Ring("body", min(held, root), max(held, root), -half, half)))
    rim, hub, wide = root - blank.rim_thickness_mm, blank.hub_radius_mm, 0.5 * (blank.hub_width_mm or 2.0 * half)
    stations = blank.web_stations(rim)
    low, high = min(low for _, low, _ in stations), max(high for _, _, high in stations)
    web = Ring("web", hub, rim, low, high, stations if blank.web_profile else ())
    below = Ring("rim", rim, root, -half, half), web, Ring("hub", held, hub, -wide, wide)
    grip = 0.5 * (blank.held_length_mm or 2.0 * wide)
    return DrawnGear(
        tooth, (teeth, *below), blank.holes, held=(blank.held_offset_mm - grip, blank.held_offset_mm + grip)
    )


def _brought(body: BodyCase | MatrixCase, density: float) -> Inertia:
    if isinstance(body, MatrixCase):
        return Inertia(body.mass_kg, body.polar_inertia_kg_m2, body.tilting_inertia_kg_m2)
    mesh, mass = body.mesh, 1e-9 * density
    return Inertia(mass * mesh.volume_mm3, 1e-6 * mass * mesh.polar_moment_mm5, 1e-6 * mass * mesh.tilting_moment_mm5)


def _solid(outer: float, inner: float, ring: Ring, density: float) -> Inertia:
    if ring.profile:
        return tapered_disc(ring.profile, density)
    return disc(outer, inner, ring.high - ring.low, density, 0.5 * (ring.low + ring.high))
