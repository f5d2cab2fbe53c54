"""Errors of sets and trains that are drawn within tolerances."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.condition import Assembly
from pmor.gear.made_flanks import MadeFlank, draw_flank, nominal_flanks, with_made
from pmor.sets.model import SetMesh
from pmor.sets.settings import Eccentricity, SetSections, Tolerances
from pmor.sets.solution import SetSolution


def drawn(said: SetSections) -> Iterator[SetSections]:
    """Draw sets within the tolerances of a file; the draws of one error do not depend on the others' sizes."""
    return _drawn_trains(said) if said.gears else _drawn_sets(said)


def _drawn_trains(said: SetSections) -> Iterator[SetSections]:
    sizes, shafts = said.tolerances, [gear.shaft for gear in said.gears if gear.shaft]
    assert sizes is not None
    rng, of_timing = np.random.default_rng(sizes.seed), np.random.default_rng([sizes.seed, 1])
    for _ in range(sizes.samples):
        off, ahead = rng.standard_normal((len(said.gears), 2)), of_timing.standard_normal(len(said.gears))
        gears = []
        for gear, moved, angle in zip(said.gears, sizes.gears_eccentricity_um * off, ahead, strict=True):
            keys = _eccentric("eccentricity", gear.eccentricity_um, gear.eccentricity_deg, moved)
            # Of a gear that is alone on its shaft an angle is none.
            timing = float(sizes.timing_mrad * angle) if shafts.count(gear.shaft or "") > 1 else 0.0
            gears.append(replace(gear, **keys, timing_mrad=gear.timing_mrad + timing))
        yield replace(said, gears=tuple(gears))


def _drawn_sets(said: SetSections) -> Iterator[SetSections]:
    sizes, pins, off = said.tolerances, said.planets, said.eccentricity
    assert sizes is not None
    rng, nothing = np.random.default_rng(sizes.seed), (0.0,) * pins.count
    of_timing = np.random.default_rng([sizes.seed, 1])
    for _ in range(sizes.samples):
        radial, tangential = rng.standard_normal((2, pins.count))
        planets, sun, ring = rng.standard_normal((pins.count, 2)), *rng.standard_normal((2, 2))
        yield replace(
            said,
            planets=replace(
                pins,
                radial_um=tuple((sizes.pins_radial_um * radial + (pins.radial_um or nothing)).tolist()),
                tangential_um=tuple((sizes.pins_tangential_um * tangential + (pins.tangential_um or nothing)).tolist()),
                timing_mrad=_timing(said, of_timing.standard_normal(pins.count)),
            ),
            eccentricity=Eccentricity(
                **_eccentric("sun", off.sun_um, off.sun_deg, sizes.sun_eccentricity_um * sun),
                **_eccentric("ring", off.ring_um, off.ring_deg, sizes.ring_eccentricity_um * ring),
                **_eccentric("planets", off.planets_um or nothing, off.planets_deg or nothing,
                             sizes.planets_eccentricity_um * planets),
            ),
        )  # fmt: skip


@dataclass(frozen=True)
class MadeOfSet:
    """Meshes of a set whose gears are made to a class, and their deviations by keys of a table."""

    meshes: tuple[SetMesh, ...]
    errors: dict[str, float]


def made_flanks(sizes: Tolerances, solved: SetSolution) -> Iterator[MadeOfSet]:
    """Draw the flanks of the gears of a set within its tolerances: those of a gear that carry in one direction once."""
    rng, meshes, of_train = np.random.default_rng([sizes.seed, 2]), solved.plan.meshes, solved.train.meshes
    for _ in range(sizes.samples):
        if sizes.flank_tolerance_class is None:
            yield MadeOfSet(meshes, {})
            continue
        made, found, errors = dict[tuple[int, bool], MadeFlank](), [], dict[str, float]()
        for mesh, placed in zip(meshes, of_train, strict=True):
            assembly = mesh.assembly or placed.assembly
            flanks = []
            nominal = nominal_flanks(placed.pair.meshed.pair)
            for body, flank, own in zip(placed.bodies, nominal, (assembly.pinion, assembly.wheel), strict=True):
                if (side := (body, placed.image)) not in made:
                    made[side] = draw_flank(flank, sizes.flank_tolerance_class, sizes.waves_per_pitch, rng)
                    name = f"{solved.plan.bodies[body].name} in {mesh.case}"
                    filed = made[side].reversed if placed.image else made[side]
                    errors |= {f"{name}.made_{key}": value for key, value in filed.errors().items()}
                # What all teeth have is in the placed set already.
                own = replace(own, topography=own.of_teeth.topography)
                flanks.append(with_made(own, made[side], flank))
            found.append(replace(mesh, assembly=Assembly(assembly.misalignment, *flanks)))
        yield MadeOfSet(tuple(found), errors)


def _timing(said: SetSections, drawn: FloatArray) -> tuple[float, ...]:
    """Timing errors of stepped planets with those that are drawn; none where neither is said."""
    size, given = said.tolerances.timing_mrad if said.tolerances else 0.0, said.planets.timing_mrad
    return tuple((size * drawn + (given or 0.0)).tolist()) if size or given else ()


def _eccentric(name: str, amount_um: Any, direction_deg: Any, moved: FloatArray) -> dict[str, Any]:
    """Keys of eccentricities that are moved by two components, the one along direction 0 first."""
    found = np.asarray(amount_um) * np.exp(1j * np.radians(direction_deg)) + moved[..., 0] + 1j * moved[..., 1]
    values = {f"{name}_um": np.abs(found), f"{name}_deg": np.degrees(np.angle(found))}
    return {key: tuple(value.tolist()) if value.ndim else float(value) for key, value in values.items()}
