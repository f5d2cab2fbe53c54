"""The live section of a machine in motion: lines of all forces over the speed, and modes as lines that move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.dynamics.whine.figures import SPREAD
from pmor.dynamics.whine.pictures import as_gearbox, moving_bodies, places_of
from pmor.dynamics.whine.readings import Data, bearing_names, order_words
from pmor.dynamics.whine.response import LoadResponse
from pmor.machine.bodies import Body, Detail
from pmor.machine.loader import GearboxFile
from pmor.machine.view import camera
from pmor.report.live.motion import MotionSection, packed_forces, packed_shapes
from pmor.sets.loader import SetFile

# Modes that the page has, the lowest; points of a circle; share of the machine's size that the largest displacement is.
MOST_MODES, CIRCLE, REACH = 40, 24, 0.08
# Bore over outside of a ring.
HOLLOW = 0.8
OUTLINE = Detail(circle=CIRCLE, profile=2, fillet=1, planes=2)
NOTE = "Lines that the run has found, with stiffness that varies: nothing is solved anew here."


def motion_section(
    file: GearboxFile | SetFile, responses: Sequence[LoadResponse], shown: LoadResponse, rows: Sequence[Data]
) -> MotionSection:
    """Return the section; its modes, told by `rows`, and the load shown first are those of one response."""
    return MotionSection({
        "loads": [response.solved.load.name for response in responses],
        "load": next(number for number, response in enumerate(responses) if response is shown),
        "speeds": shown.speeds_rpm.tolist(), "spread": SPREAD,
        "readings": [*bearing_names(shown), *(f"mesh {name}" for name in shown.mesh_names)],
        "by_load": [_by_load(response) for response in responses],
        "modes": _modes(file, shown, rows[:MOST_MODES]),
    }, NOTE)  # fmt: skip


def _by_load(response: LoadResponse) -> dict[str, Any]:
    lines, forces = list[dict[str, Any]](), list[FloatArray]()
    for source in response.sources:
        own = np.sqrt(2.0) * abs(source.lines.mesh_forces) * source.told[..., None]
        forces.append(np.concatenate([response.force_lines(source), own], axis=2))
        lines += [
            {"source": source.name, "name": order_words(response, source, number),
             "order": source.orders[number].order} for number in range(len(source.places))
        ]
    return {"lines": lines} | packed_forces(np.concatenate(forces, axis=1).transpose(2, 1, 0))


def _modes(file: GearboxFile | SetFile, response: LoadResponse, rows: Sequence[Data]) -> dict[str, Any]:
    own, (model, machine) = places_of(response, [row["mode"] for row in rows]), as_gearbox(file, response.machine)
    found, by = moving_bodies(model, machine, OUTLINE)
    lines, points, moves = list[dict[str, Any]](), list[FloatArray](), list[FloatArray]()
    for body in found:
        outline = _outline(body)
        first, rings = sum(map(len, points)), outline.rings
        moved = np.stack([outline.displacement(by @ shape).reshape(-1, 3) for shape in response.modes.shape[:, own].T])
        points.append(rings.reshape(-1, 3))
        moves.append(moved)
        sizes = [rings.shape[1]] * len(rings) if body.kind != "shaft" else [len(rings)]
        for size in sizes:
            lines.append({"kind": body.kind, "first": first, "count": size, "closed": body.kind != "shaft"})
            first += size
    every, place = np.concatenate(moves, axis=1), np.concatenate(points)
    seen, size = camera(model), float(np.ptp(place, axis=0).max())
    largest = np.linalg.norm(every, axis=2).max(axis=1, initial=0.0)
    return {
        "names": [f"{row['mode']}: {row['natural_frequency_Hz']:.4g} Hz, {row['kind']} of {row['moves_most']}"
                  for row in rows], "lines": lines,
        "points": place.round(2).ravel().tolist(), "across": seen[0].tolist(), "up": seen[1].tolist(),
        "reach": REACH * size, **packed_shapes(every.reshape(len(own), -1) / largest[:, None]),
    }  # fmt: skip


def _outline(body: Body) -> Body:
    """A shaft as its axis, a bearing as its bore, a gear as circles through its tips at both faces, with a radius."""
    if body.kind == "shaft":
        node, first = np.unique(body.node, return_index=True)
        return replace(body, rings=body.centre[first][:, None], node=node, centre=body.centre[first])
    across = np.linalg.norm(body.rings[..., 1:] - body.rings[..., 1:].mean(axis=1, keepdims=True), axis=2).max(axis=1)
    tips = np.flatnonzero(across > (1.0 - 1e-9) * across.max())
    own = [0] if body.kind == "bearing" else [tips[0], tips[-1]]
    angle, middle = 2.0 * np.pi * np.arange(CIRCLE + 2) / CIRCLE, body.rings[own].mean(axis=1)
    around = np.stack([np.zeros(CIRCLE + 2), np.cos(angle), np.sin(angle)], axis=1)
    rings = middle[:, None] + across[own][:, None, None] * around
    # The last point of a circle is its middle, but of a ring: a radius that shows how the gear turns.
    solid = body.kind == "gear" and across.min() < HOLLOW * across.max()
    rings[:, -1] = middle if solid else rings[:, 0]
    return replace(body, rings=rings, node=body.node[own], centre=body.centre[own], teeth=None)
