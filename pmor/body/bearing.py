"""A bearing as files describe it, on a shaft or on a pin: by its stiffness, inner geometry, or sizes in a catalogue."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NoReturn, Self

from pmor.body.bearing_estimate import CatalogueBearing
from pmor.body.bearing_faults import InnerGeometry, impossible
from pmor.body.roller_bearing import RollerBearing, SphericalRollerBearing
from pmor.body.rolling_bearing import RADIAL, TILT, BallBearing
from pmor.core.ranges import Stiffness, TiltStiffness
from pmor.core.roots_and_minima import root

# Keys of kinds; those of them that are solved under each load.
SOLVED = ("ball", "roller", "spherical_roller")
KINDS = (*SOLVED, "catalogue")
# By which an inner ring is pressed to see what its bearing resists, mm.
PRESSED_MM = 0.1


@dataclass(frozen=True, kw_only=True)
class AnyBearing:
    """What a bearing does.

    Parameters
    ----------
    radial_N_per_mm, tilt_Nmm_per_rad : float, "rigid" or "free"
        Of a bearing by its stiffness.
    ball, roller, spherical_roller : BallBearing, RollerBearing, SphericalRollerBearing
        Of a bearing by its inner geometry.
    catalogue : CatalogueBearing
        Of a bearing by its sizes alone: the stiffness across is estimated under its load, good to a factor of two.
    """

    radial_N_per_mm: Stiffness = "rigid"
    tilt_Nmm_per_rad: TiltStiffness = "free"
    ball: BallBearing | None = None
    roller: RollerBearing | None = None
    spherical_roller: SphericalRollerBearing | None = None
    catalogue: CatalogueBearing | None = None

    @property
    def inner(self) -> InnerGeometry | None:
        """Its inner geometry; None of one by its stiffness."""
        return next((inner for kind in SOLVED if (inner := getattr(self, kind)) is not None), None)

    def estimated(self, load_N: float) -> Self:
        """Return a bearing by its stiffness across under a load, where it is known by its sizes alone; else itself."""
        if self.catalogue is None:
            return self
        return replace(self, catalogue=None, radial_N_per_mm=self.catalogue.radial_N_per_mm(load_N))

    def linear(self, load_N: float) -> Self:
        """Return a bearing by its stiffness across and against tilting under a load across."""
        if (inner := self.inner) is None:
            return self.estimated(load_N)
        most = 1.0
        while inner.state(RADIAL * most).force @ RADIAL < load_N:
            most *= 2.0
        moved = root(lambda amount: float(inner.state(RADIAL * amount).force @ RADIAL) - load_N, 0.0, most)
        tangent = inner.state(RADIAL * moved).stiffness
        across, tilt = float(RADIAL @ tangent @ RADIAL), float(TILT @ tangent @ TILT)
        held = {"radial_N_per_mm": across, "tilt_Nmm_per_rad": tilt if tilt > 0.0 else "free"}
        return replace(self, **dict.fromkeys(SOLVED), **held)  # type: ignore[arg-type]


def holds_tilt(bearing: AnyBearing) -> bool:
    """Return whether a bearing by its inner geometry resists tilting where its inner ring is pressed across."""
    inner = bearing.inner
    if inner is None:
        return False
    pressed = inner.state(RADIAL * (abs(inner.clearance_mm) + PRESSED_MM)).stiffness
    return float(TILT @ pressed @ TILT) > 0.0


def check_bearing(bearing: AnyBearing, where: str, stiffness: tuple[str, ...], refuse: Callable[..., NoReturn]) -> None:
    """Refuse a bearing of two kinds, and one that cannot be made.

    Parameters
    ----------
    stiffness : tuple of str
        Keys of its stiffness.
    """
    kinds = [kind for kind in KINDS if getattr(bearing, kind) is not None]
    usual = {name: item.default for name, item in type(bearing).__dataclass_fields__.items()}
    # Sizes in a catalogue say nothing of thrust and tilting.
    keys = stiffness if bearing.inner is not None else ("radial_N_per_mm",)
    given = [key for key in keys if kinds and getattr(bearing, key) != usual[key]]
    if len(kinds) > 1 or given:
        refuse(f"{where}: {', '.join(kinds + given)}", "a bearing has one kind: leave out all but one")
    for kind in SOLVED:
        inner = getattr(bearing, kind)
        if inner is not None and (fault := impossible(inner)) is not None:
            refuse(f"{where}: {kind}: {fault[0]}", fault[1])
    if bearing.catalogue is not None and (fault := bearing.catalogue.fault) is not None:
        refuse(f"{where}: catalogue: {fault[0]}", fault[1])
