"""Loads with their time: the duty cycle of a pair, a set or a gearbox, and what friction in it depends on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, NoReturn

from pmor.core.ranges import Range

# By which the shares of a duty cycle may miss 1: they are rounded.
ROUNDED_SHARE = 5e-3


@dataclass(frozen=True, kw_only=True)
class Timed:
    """A load with its time.

    Parameters
    ----------
    name : str
        Name of the load.
    fraction : float or None
        Share of the operating time: all loads have one, or none has. They add up to 1.
    hours : float or None
        Operating time in this load, h, instead of its share.
    """

    name: str
    fraction: Annotated[float, Range(0.0, 1.0, low_excluded=True)] | None = None
    hours: Annotated[float, Range(0.0, 1e9, "h", low_excluded=True)] | None = None


@dataclass(frozen=True, kw_only=True)
class TimedLoad(Timed):
    """A load of the duty cycle of a pair or a set (section `[[loads]]`), solved beside the nominal one.

    Parameters
    ----------
    name : str
        Name of the load.
    torque_Nm : float
        Amount of the torque of `[load]`, or of the first gear of a train; it loads the same flanks.
    speed_rpm : float or None
        Speed in this load, as in `[load]`, whose it is by default.
    fraction : float or None
        Share of the operating time: all loads have one, or none has. They add up to 1.
    hours : float or None
        Operating time in this load, h, instead of its share.
    """

    torque_Nm: Annotated[float, Range(0.0, 1e12, "N m", low_excluded=True)]
    speed_rpm: Annotated[float, Range(0.0, 1e7, "1/min", low_excluded=True)] | None = None


@dataclass(frozen=True, kw_only=True)
class Lubricant:
    """What friction in the meshes depends on (section `[lubricant]`).

    Parameters
    ----------
    friction : "schlenk" or float
        Mean coefficient of friction: after Schlenk (1995), or a number. Formulas differ by up to a factor of two.
    viscosity_mPas : float
        Dynamic viscosity at the temperature of the oil.
    roughness_um : float
        Ra of the flanks, mean of both gears.
    lubricant_factor : float
        X_L of Schlenk's formula: 1 of mineral oil.
    """

    friction: Annotated[float, Range(0.0, 1.0)] | Literal["schlenk"] = "schlenk"
    viscosity_mPas: Annotated[float, Range(0.1, 1e5, "mPa s")] = 20.0
    roughness_um: Annotated[float, Range(0.01, 100.0, "um")] = 0.4
    lubricant_factor: Annotated[float, Range(0.1, 3.0)] = 1.0


def shares(loads: Sequence[Timed]) -> tuple[float, ...]:
    """Return the shares of the loads in the operating time, which add up to 1; empty without a duty cycle."""
    parts = [load.hours or load.fraction or 0.0 for load in loads]
    return tuple(part / sum(parts) for part in parts) if all(parts) else ()


def check_duty(loads: Sequence[Timed], refuse: Callable[[str, str], NoReturn]) -> None:
    """Refuse a duty cycle that is not whole."""
    given = [[load for load in loads if getattr(load, key) is not None] for key in ("fraction", "hours")]
    for key, those in zip(("fraction", "hours"), given, strict=True):
        if those and len(those) < len(loads):
            other = next(load for load in loads if load not in those)
            rule = f"has no {key}, and others have one: a duty cycle needs it in all load cases, or in none"
            refuse(f'[[loads]] "{other.name}"', rule)
    if all(given):
        refuse("[[loads]]: fraction, hours", "say the same: leave one of them out")
    total = sum(load.fraction or 0.0 for load in loads)
    if given[0] and abs(total - 1.0) > ROUNDED_SHARE:
        rule = f"adds up to {total:.4g}, and must to 1: correct one of them, or write hours"
        refuse("[[loads]]: fraction", rule)
