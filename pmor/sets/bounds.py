"""Where a solved set leaves what its equations stand for: the bounds of all meshes (`pmor.pair.bounds`)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from pmor.case import Case
from pmor.core.arrays import BoolArray, FloatArray
from pmor.core.errors import GeometryError
from pmor.gear.pair import GearPair
from pmor.line.hubs import HUB
from pmor.pair.bounds import Bound, mesh_bounds, refuse_moved_axes
from pmor.pair.model import approach_estimate
from pmor.sets.plan import SetPlan

if TYPE_CHECKING:
    from pmor.sets.loader import SetFile
    from pmor.sets.solution import SetSolution


# Of an equal share of the load, below which a planet is named.
LITTLE = 0.1


def named_bounds(file: SetFile, solved: SetSolution, torques_Nm: list[float]) -> tuple[str, ...]:
    """Return what leaves its bounds under all torques, which are those of the member that the file names."""
    return tuple(
        f"{torque:g} N m, {place}: {bound.text}"
        for number, torque in enumerate(torques_Nm)
        for place, bound in set_bounds(file, solved, number)
    )


def set_bounds(file: SetFile, solved: SetSolution, number: int) -> Iterator[tuple[str, Bound]]:
    """Yield what leaves its bounds under a torque by its number: of meshes alike, which leave the same, the worst.

    With it its place: the mesh, by the names of the gears, and of how many meshes it is; or the planet, or the mesh of
    a path, that carries little.
    """
    found: dict[tuple[str, str], list[tuple[str, Bound]]] = {}
    for mesh, one in enumerate(solved.plan.meshes):
        for bound in _bounds(file, solved, number, mesh):
            name = " - ".join(solved.train.bodies[body].name for body in (one.pinion, one.wheel))
            found.setdefault((one.case, bound.kind), []).append((name, bound))
    for those in found.values():
        name, worst = max(those, key=lambda pair: pair[1].size)
        yield f"mesh {name}, worst of {len(those)}" if len(those) > 1 else f"mesh {name}", worst
    yield from _light(solved, number)


def _light(solved: SetSolution, number: int) -> Iterator[tuple[str, Bound]]:
    """Planets, or paths of a train, that carry little of an equal share of the load."""
    bodies, at = solved.train.bodies, solved.converged[number]
    shares = solved.planet_share if solved.plan.planets else solved.mesh_share
    if solved.plan.planets:
        names = [solved.plan.bodies[planet].name for planet in solved.plan.planets]
        beside = [len(names)] * len(names)
    else:
        names = ["mesh " + " - ".join(bodies[body].name for body in mesh.bodies) for mesh in solved.train.meshes]
        beside = [len(meshes) for meshes in solved.beside]
    for place, (name, count) in enumerate(zip(names, beside, strict=True)):
        known = shares[number, at, place]
        mean = float(known[np.isfinite(known)].mean()) if np.isfinite(known).any() else math.nan
        if count > 1 and mean < LITTLE / count:
            text = (
                f"carries {100.0 * mean:.2g} % of the load on average, less than a tenth of an equal share, "
                f"{100.0 / count:.3g} %: the others carry it"
            )
            yield name, Bound("a path of the load carries little", -mean, text)


def _bounds(file: SetFile, solved: SetSolution, number: int, mesh: int) -> Iterator[Bound]:
    if not solved.carrying[number, mesh] or not solved.converged[number].any():
        return iter(())
    whole, pair = solved.converged[number].all(), solved.train.meshes[mesh].pair.meshed.pair
    return mesh_bounds(
        file.cases[solved.plan.meshes[mesh].case], pair, solved.mesh_displacement(mesh)[number],
        float(np.mean(solved.ste_um[number])) if whole else None,
        float(solved.mesh_figures[mesh]["carrying_face_percent"][number]) if whole else None,
        float(solved.mesh_figures[mesh]["flank_pressure_max_MPa"][number]),
    )  # fmt: skip


def refuse_errors(plan: SetPlan, cases: Mapping[str, Case], pairs: Mapping[str, GearPair]) -> None:
    """Raise GeometryError where errors bring gears to a centre distance at which no pair runs."""
    apart = distances(plan, pairs)
    for mesh in np.flatnonzero((apart != apart[:, :1]).any(axis=1)).tolist():
        approach = approach_estimate(cases[plan.meshes[mesh].case], pairs[plan.meshes[mesh].case])
        _refuse(plan, pairs, mesh, float(apart[mesh, 1]), float(apart[mesh, 2]), approach)


def refuse_draws(plan: SetPlan, drawn: Iterable[SetPlan], pairs: Mapping[str, GearPair]) -> None:
    """Raise GeometryError where errors that are drawn take gears out of mesh; that they jam is a bound."""
    found = np.array([distances(one, pairs)[:, 2] for one in drawn])
    for mesh, farthest in enumerate(found.max(axis=0).tolist()):
        nominal = pairs[plan.meshes[mesh].case].centre_distance
        _refuse(plan, pairs, mesh, nominal, max(farthest, nominal), 0.0)


def distances(plan: SetPlan, pairs: Mapping[str, GearPair]) -> FloatArray:
    """Return signed centre distances, without errors, the least and the largest with them, (M, 3), mm.

    Of gears that float the solution says where they go: without errors too. It says as well whether gears that are off
    their axes jam in a part of the turn: the least distance is that of their axes.
    """
    moved, off = plan.displacement.reshape(-1, HUB), np.hypot(*plan.eccentricity.T)
    floating = floats(plan)
    found = np.empty((len(plan.meshes), 3))
    for row, mesh in zip(found, plan.meshes, strict=True):
        one, other, distance = plan.bodies[mesh.pinion], plan.bodies[mesh.wheel], pairs[mesh.case].centre_distance
        row[:] = distance
        if not (floating[mesh.pinion] or floating[mesh.wheel]):
            between = np.array([other.x - one.x, other.y - one.y])
            further = np.linalg.norm(between + moved[mesh.wheel, :2] - moved[mesh.pinion, :2]) - np.linalg.norm(between)
            row[1:] += math.copysign(1.0, distance) * further
            row[2] += off[mesh.pinion] + off[mesh.wheel]
    return found


def room_of_axes(case: Case, pair: GearPair, most: float) -> list[float]:
    """Return by how much the signed distance of axes may fall and rise until no pair runs, mm.

    At most by `most`, of which it is known to a millionth.
    """
    found, approach = [], approach_estimate(case, pair)
    for sign in (-1.0, 1.0):
        room, step = 0.0, most
        for _ in range(20):
            moved = pair.centre_distance + sign * (room + step)
            try:
                refuse_moved_axes(pair, moved, moved, approach)
                room += step
            except GeometryError:
                pass
            if room >= most:
                break
            step *= 0.5
        found.append(room)
    return found


def floats(plan: SetPlan) -> BoolArray:
    """Return which bodies are free to move across their axes, (B,)."""
    return np.asarray((plan.free.reshape(len(plan.free), -1, HUB)[:, :, :2] != 0.0).any(axis=(0, 2)))


def _refuse(
    plan: SetPlan, pairs: Mapping[str, GearPair], mesh: int, nearest: float, farthest: float, approach: float
) -> None:
    of, pair = plan.meshes[mesh], pairs[plan.meshes[mesh].case]
    try:
        refuse_moved_axes(pair, nearest, farthest, approach)
    except GeometryError as error:
        names = f"{plan.bodies[of.pinion].name} and {plan.bodies[of.wheel].name}"
        raise GeometryError(
            f"errors bring the axes of {names} from {abs(pair.centre_distance):.6g} to {error}: lower them"
        ) from None
