"""From numbers to a machine: the values of the variables and their scatter, as flanks, axes and places of pins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from pmor.case.flanks import EXTENTS
from pmor.core.arrays import FloatArray
from pmor.core.sobol import sobol_points
from pmor.design.files import PINS, DesignFile
from pmor.design.settings import Scatter, Variable
from pmor.gear.condition import Assembly, Misalignment
from pmor.gear.modification import Modification
from pmor.sets.plan import planetary_errors

# Of samples and draws: a run is the same every time.
SEED = 19
# Of the range of a variable without steps, how far its neighbours are.
NEAR = 0.01
# Decimals to which values are rounded: further digits are noise of the steps.
DECIMALS = 9


@dataclass(frozen=True)
class Draw:
    """By how much one mesh of those that are made is off its drawing, by the keys of a modification, and its axes."""

    pinion: Mapping[str, float] = field(default_factory=dict)
    wheel: Mapping[str, float] = field(default_factory=dict)
    misalignment: Misalignment = field(default_factory=Misalignment)


AS_DRAWN = Draw()


@dataclass(frozen=True, eq=False)
class Made:
    """By how much a machine of those that are made is off: its meshes, and hubs of a set as they stand (6 B,), mm."""

    meshes: tuple[Draw, ...]
    displacement: FloatArray | None = None


def assembly_at(
    base: Assembly, variables: Sequence[Variable], x: Sequence[float] | FloatArray, draw: Draw = AS_DRAWN
) -> Assembly:
    """Return a pair with values for its variables, everything else as in the base, off by a draw."""
    flanks = [
        _modified(getattr(base, gear), {v.key: float(value) for v, value in zip(variables, x, strict=True)
                                        if gear in v.gears}, getattr(draw, gear))
        for gear in ("pinion", "wheel")
    ]  # fmt: skip
    off, misalignment = draw.misalignment, base.misalignment
    moved = Misalignment(
        misalignment.in_plane_um + off.in_plane_um, misalignment.out_of_plane_um + off.out_of_plane_um,
        misalignment.centre_distance_um + off.centre_distance_um,
    )  # fmt: skip
    return Assembly(moved, flanks[0], flanks[1])


def _modified(modification: Modification, values: Mapping[str, float], off: Mapping[str, float]) -> Modification:
    chosen = modification.changed(values)
    absent = _absent(chosen)
    moved = {key: (getattr(chosen, key) or 0.0) + by for key, by in off.items() if key not in absent}
    return replace(chosen, **moved) if moved else chosen  # type: ignore[arg-type]


def _absent(flank: Modification) -> set[str]:
    """Keys of reliefs that nothing says the extent of: a flank as filed may have none that scatters."""
    absent = set[str]()
    for amount, extents, _ in EXTENTS:
        missing = {key for key in extents if getattr(flank, key) is None}
        absent |= missing | ({amount} if len(missing) == len(extents) else set())
    return absent


def corners(variables: Sequence[Variable]) -> Iterator[tuple[float, ...]]:
    """Yield the ends of the ranges, each with each."""
    yield from product(*(v.range for v in variables))


def limits(variables: Sequence[Variable]) -> tuple[FloatArray, FloatArray]:
    """Return lowest and highest values, each (n,)."""
    low, high = np.array([v.range for v in variables]).T
    return low, high


def to_steps(variables: Sequence[Variable], x: FloatArray) -> FloatArray:
    """Return values (..., n) moved to the nearest step that can be made, within the ranges."""
    low, high = limits(variables)
    moved = np.array(x, dtype=float)
    for n, v in enumerate(variables):
        if v.step is not None:
            most = np.floor((v.range[1] - v.range[0]) / v.step + 1e-9)
            moved[..., n] = low[n] + v.step * np.clip(np.round((moved[..., n] - low[n]) / v.step), 0.0, most)
    return np.asarray(np.round(np.clip(moved, low, high), DECIMALS))


def steps_around(variables: Sequence[Variable], x: FloatArray) -> FloatArray:
    """Return the values (m, n) that can be made next to some x (n,): below and above of each variable with a step."""
    choices = []
    for n, v in enumerate(variables):
        if v.step is None:
            choices.append([x[n]])
            continue
        below = v.range[0] + v.step * np.floor((x[n] - v.range[0]) / v.step + 1e-9)
        choices.append([below, below + v.step])
    return np.unique(to_steps(variables, np.array(list(product(*choices)))), axis=0)


def neighbours(variables: Sequence[Variable], x: FloatArray) -> FloatArray:
    """Return the values (m, n) next to some x (n,): one step further either way, of two variables in each combination.

    A variable without steps moves by a hundredth of its range.
    """
    low, high = limits(variables)
    steps = np.array([v.step or NEAR * (v.range[1] - v.range[0]) for v in variables])
    count = len(variables)
    ways = (
        np.array(list(product((-1.0, 0.0, 1.0), repeat=count)))
        if count < 3
        else np.vstack([np.eye(count), -np.eye(count)])
    )
    moved = to_steps(variables, np.clip(x + ways * steps, low, high))
    return np.unique(moved[(moved != x).any(axis=1)], axis=0)


def spread_evenly(variables: Sequence[Variable], count: int, seed: int = SEED) -> FloatArray:
    """Return `count` values (count, n) of a Sobol sequence over the ranges, moved to steps; the same every time.

    Another seed gives other ones.
    """
    low, high = limits(variables)
    points = sobol_points(len(variables), int(np.ceil(np.log2(count))), seed)[:count]
    return to_steps(variables, low + points * (high - low))


def normal_points(dimensions: int, count: int, seed: int) -> FloatArray:
    """Return `count` points of independent normal numbers, (count, dimensions), as even as a Sobol sequence.

    Of no dimension there are none.
    """
    from scipy.special import ndtri

    if not dimensions:
        return np.zeros((0, 0))
    return np.asarray(ndtri(sobol_points(dimensions, int(np.ceil(np.log2(count))), seed)[:count]))


def drawn(file: DesignFile, scatter: Scatter, count: int, seed: int = SEED) -> tuple[Made, ...]:
    """Return `count` draws of a scatter, as even as a Sobol sequence; another seed gives fresh ones.

    What is made at once (`DesignFile.sides`) is off alike in all its meshes; axes are those of each mesh, and each
    planet has a pin of its own. None of a scatter of nothing.
    """
    sizes, axes, pins = np.array(list(scatter.modifications.values())), scatter.axes, file.pins
    places = {side: n for n, side in enumerate(dict.fromkeys(side for both in file.sides for side in both))}
    meshes = len(file.meshes)
    planets = file.set.sections.planets.count if file.set is not None else 0
    ends = np.cumsum([len(places) * len(sizes), meshes * len(axes), planets * len(pins)])
    made = []
    for point in normal_points(int(ends[-1]), count, seed):
        on_sides, of_axes, of_pins = np.split(point, ends[:-1])
        amounts = [
            {key: float(value) for key, value in zip(scatter.modifications, sizes * part, strict=True)}
            for part in on_sides.reshape(len(places), -1)
        ]
        tilts = [
            Misalignment(**{key: float(axes[key] * z) for key, z in zip(axes, part, strict=True)})
            for part in of_axes.reshape(meshes, -1)
        ]
        draws = tuple(
            Draw(amounts[places[pinion]], amounts[places[wheel]], tilt)
            for (pinion, wheel), tilt in zip(file.sides, tilts, strict=True)
        )
        made.append(Made(draws, _displaced(file, dict(zip(pins, of_pins.reshape(len(pins), planets), strict=True)))))
    return tuple(made)


def _displaced(file: DesignFile, moved: Mapping[str, FloatArray]) -> FloatArray | None:
    """Hubs of a set whose pins are off by so many standard deviations, of each planet; None of no pins."""
    if file.set is None or not moved:
        return None
    plan, sections = file.set.plan, file.set.sections
    off: dict[str, Any] = {
        PINS[key]: tuple((file.pins[key] * values + (getattr(sections.planets, PINS[key]) or 0.0)).tolist())
        for key, values in moved.items()
    }
    errors = replace(sections, planets=replace(sections.planets, **off))
    return np.asarray(planetary_errors(errors, plan.bodies, plan.clockwise)[0])
