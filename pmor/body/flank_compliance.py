"""What line loads need of an elastic gear: compliance of the flanks, stress along the fillets and on the web."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pmor.body.root_stress import RootStressShapes, root_stress_shapes
from pmor.core.arrays import FloatArray

if TYPE_CHECKING:
    from pmor.body.elastic_gear import ElasticGear, OtherFlank
    from pmor.body.far_compliance import FarCompliance
    from pmor.body.rim import RimMotion
    from pmor.body.support import Support
    from pmor.body.web_stress import WebStress


@dataclass(frozen=True)
class FlankCompliance:
    """Compliance between loaded flanks, where contact forces act.

    Parameters
    ----------
    gears : two ndarrays, shape (neighbours + 1, n, n)
        Of pinion and wheel: displacement of the tooth 0, 1, ... teeth counter-clockwise from the loaded one, mm/N; two
        or three components at each flank node. The same object for identical gears.
    supports : two Support or None
        The part of low rank of pinion and wheel, of holes; None without. `gears` are without it.
    """

    gears: tuple[FloatArray, FloatArray]
    components: int
    supports: tuple[Support | None, Support | None] = (None, None)

    def between(self, gear: int, offset: int) -> FloatArray:
        """Return the displacement of tooth `offset` of a gear under unit forces on tooth 0, shape (n, n), mm/N.

        Teeth beyond the neighbours do not move.
        """
        blocks = self.gears[gear]
        if abs(offset) >= len(blocks):
            return np.zeros(blocks.shape[1:])
        return np.asarray(blocks[offset] if offset >= 0 else blocks[-offset].T)


@dataclass(frozen=True)
class SolvedFlank:
    """The other flanks of a gear, in their image, where these are no images of its flanks.

    Parameters
    ----------
    compliance, root_stress
        As of `SolvedGear`, stress on the sides and the teeth of the gear itself.
    """

    compliance: FloatArray
    root_stress: RootStressShapes | None = None


@dataclass(frozen=True)
class SolvedGear:
    """Finite elements of a gear, solved for line loads.

    Parameters
    ----------
    compliance : ndarray, shape (neighbours + 1, n, n)
        As in `FlankCompliance`.
    root_stress : RootStressShapes or None
        Where it was asked for.
    support : Support or None
        The part of low rank, of holes.
    far : FarCompliance or None
        Of gears with several meshes.
    other : SolvedFlank or None
        Where the other flanks carry and may be unlike.
    rim_motion : RimMotion or None
        Of rings with several meshes.
    web_stress : WebStress or None
        Where it was asked for.
    """

    compliance: FloatArray
    root_stress: RootStressShapes | None = None
    support: Support | None = None
    far: FarCompliance | None = None
    other: SolvedFlank | None = None
    rim_motion: RimMotion | None = None
    web_stress: WebStress | None = None


def solved_gear_of(body: ElasticGear, components: int) -> SolvedGear:
    """Return what line loads need of an elastic gear.

    Parameters
    ----------
    components : int
        Of the displacement at a node, those of contact forces: 2 or 3.
    """
    used = (3 * np.arange(body.compliance.shape[1] // 3)[:, None] + np.arange(components)).ravel()

    def flank(side: ElasticGear | OtherFlank) -> SolvedFlank:
        compliance = np.ascontiguousarray(side.compliance[len(side.compliance) // 2 :, used[:, None], used])
        return SolvedFlank(compliance, None if side.fillet is None else root_stress_shapes(side.fillet, components))

    own, support, rim, web = flank(body), body.support, body.rim_motion, body.web_stress
    if support is not None:
        backs = None if support.backs is None else np.ascontiguousarray(support.backs[used])
        support = replace(support, rows=np.ascontiguousarray(support.rows[used]), backs=backs)
    return SolvedGear(
        own.compliance,
        own.root_stress,
        support,
        body.far,
        None if body.other is None else flank(body.other),
        None if rim is None else replace(rim, rows=np.ascontiguousarray(rim.rows[used])),
        None if web is None else web.of_components(components),
    )


def flank_compliance(gears: tuple[SolvedGear, SolvedGear], components: int) -> FlankCompliance:
    """Return the compliance of the flanks of pinion and wheel, with so many components at a node."""
    pinion, wheel = gears
    return FlankCompliance((pinion.compliance, wheel.compliance), components, (pinion.support, wheel.support))
