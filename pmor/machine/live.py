"""The live page of a gearbox: its shafts and bearings in as few displacements as meshes and bearings take.

Displacements at which nothing acts that a reader may change, all but those of hubs, of bearings, of held torques and
of seats in the housing, are condensed, which is exact. Bearings stay by themselves, so that the page may change them:
those with a stiffness by a factor, rigid ones by how far they give way. Rolling bearings count by their tangent in each
solved load case.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from pmor.body.beam import NODE
from pmor.case.capability import why_not
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.machine.coupled import MEAN_ANGLES, MOST_ROUNDS, SolvedLoad
from pmor.machine.loaded import ABOUT_AXIS, AXIAL, BEARING_ROWS, RADIAL, TILT, LoadedGearbox, Supported
from pmor.machine.model import other_key
from pmor.machine.system import ARM
from pmor.report.live.section import Control, LiveSection, curve, live_pair_mesh, notes, section_data
from pmor.report.page import Heading
from pmor.results.sweep import ste_mean_um
from pmor.sets.live import set_section
from pmor.work.live import live_pair
from pmor_online.model import ReducedPair

# Ranges of the sliders: of load and stiffness over those of the file, and of what rigid bearings give, um per kN.
LEAST_LOAD, MOST_LOAD = 0.05, 2.0
STIFFNESS, MOST_GIVE = 10.0, 20.0
KEYS = {"axial_N_per_mm": AXIAL, "radial_N_per_mm": RADIAL, "tilt_Nmm_per_rad": TILT}
# What the page adds to the stiffness along its constraints: about that of a mesh, N/mm.
ADDED = 1e6
# As that of `pmor.machine.coupled`; below it the rounded compliance of the flanks moves the forces.
SETTLED = 1e-7
STILL = -1


def live_blocks(loads: Sequence[SolvedLoad], pairs: Mapping[str, ReducedPair]) -> list[Heading | LiveSection | str]:
    """Return the blocks of the page that solve the gearbox, and its sets; parameters as of `machine_section`."""
    found = machine_section(loads, pairs) if loads else None
    blocks = list[Heading | LiveSection | str]()
    if found is not None:
        blocks = [Heading("Change the gearbox"), f"Left out: {found}." if isinstance(found, str) else found]
    for solved in loads[0].sets if loads else ():
        name, file = solved.meshing.settings.name, solved.meshing.file
        why = why_not(file, "page")
        text = f"On its shafts under the load case {loads[0].load.name}, with the torque that arrives there."
        blocks += [Heading(f"Change the set {name}"), text]
        blocks.append(f"Left out: {why}." if why else set_section(file, solved.solution))
    return blocks


def machine_section(loads: Sequence[SolvedLoad], pairs: Mapping[str, ReducedPair]) -> LiveSection | str | None:
    """Return the section of a gearbox, or the reason for its absence; None where a case asks for none.

    Parameters
    ----------
    loads : sequence of SolvedLoad
        At least one, compared with rigid supports.
    pairs : mapping of str to ReducedPair
        Of the meshes, by name.
    """
    if not loads[0].meshes:
        return None
    found, meshes = list[ReducedPair](), [mesh.meshing.settings.name for mesh in loads[0].meshes]
    for name in meshes:
        if other_key(name) in pairs:
            return f"mesh {name}: the page solves one side of its flanks, and loads are on both"
        if name not in pairs:
            return f"mesh {name}: the page solves meshes whose gears have no other one"
        pair = live_pair(pairs[name])
        if not isinstance(pair, ReducedPair):
            return pair and f"mesh {name}: {pair}"
        if any(pair.lines.supports):
            return f"mesh {name}: its teeth differ, and shafts bend under the mean force of all of them"
        found.append(pair)
    shown = []
    for number, (name, pair) in enumerate(zip(meshes, found, strict=True)):
        curves = [curve(solved.meshes[number].sweep, 0) for solved in loads]
        rigid = loads[0].rigid[number]
        shown.append(live_pair_mesh(name, pair, float(ste_mean_um(rigid.sweep)[rigid.row]), curves))
    machine = machine_data(loads)
    bearings = [0.0 if bearing["rigid"] else 1.0 for bearing in machine["bearings"]]
    setting = {"load": 0, "share": 1.0, "stiffness": 1.0, "give": 0.0, "bearings": bearings}
    data = section_data([data for _, data in shown], setting, machine)
    controls = tuple(_controls(loads, machine))
    names = tuple((name, number) for number, name in enumerate(meshes))
    return LiveSection(controls, tuple(mesh for mesh, _ in shown), names, data, _note(loads, found))


def machine_data(loads: Sequence[SolvedLoad]) -> dict[str, Any]:
    """Return shafts and bearings under some load cases as plain numbers, m displacements.

    Returns
    -------
    dict
        `stiffness`: of shafts and housing, the upper triangle of (m, m). `bearings`: `rows`, for each direction the
        displacement of the shaft and that of what it stands on, -1 where this stands still; the directions `held`;
        whether all that it bears is `rigid`, and the keys that it `gives` then. `meshes`: `hubs`, the displacements of
        both, and the numbers of their `shafts`; `turned`: a rotation about the axis of each shaft. `loads`: `force` and
        `weight` on all displacements; rotations `held` by a torque; of each bearing its `stiffness` (6 x 6) and its
        `force` at displacement 0; of each mesh its `axes` and the mean `wrench` on its hubs by a unit force; of each
        set what it does to its hubs by a unit torque, pairs of displacements and wrenches.
    """
    gearbox = loads[0].gearbox
    kept, whole = _kept(loads), gearbox.structure
    place = np.where(kept, np.cumsum(kept) - 1, STILL)
    inside = np.asarray(np.linalg.solve(whole[np.ix_(~kept, ~kept)], whole[np.ix_(~kept, kept)]), dtype=float)
    stiffness = whole[np.ix_(kept, kept)] - whole[np.ix_(kept, ~kept)] @ inside
    firsts = np.array([*gearbox.first.values()])
    turned = [first + ABOUT_AXIS + NODE * int(kept[first + ABOUT_AXIS :: NODE].argmax()) for first in firsts]
    held = _independent(gearbox)
    return {
        "size": len(stiffness),
        "stiffness": stiffness[np.triu_indices(len(stiffness))].tolist(),
        "bearings": [_bearing(*pair, place) for pair in zip(gearbox.bearings, held, strict=True)],
        "meshes": [
            {
                "hubs": [place[hub + np.arange(NODE)].tolist() for hub in mesh.hubs],
                "shafts": [int(firsts.searchsorted(hub, "right")) - 1 for hub in mesh.hubs],
            }
            for mesh in gearbox.meshes
        ],
        "turned": place[turned].tolist(),
        "loads": [_load(solved, kept, inside, place) for solved in loads],
        "arm": ARM, "added": ADDED, "mean_angles": MEAN_ANGLES, "settled": SETTLED, "most_rounds": MOST_ROUNDS,
    }  # fmt: skip


def _kept(loads: Sequence[SolvedLoad]) -> BoolArray:
    """Which displacements the page has."""
    gearbox = loads[0].gearbox
    kept = np.zeros(len(gearbox.load), dtype=bool)
    for bearing in gearbox.bearings:
        kept |= bearing.rows.any(axis=0)
    hubs = [hub for mesh in gearbox.meshes for hub in mesh.hubs]
    hubs += [hub for one in gearbox.sets for hub in one.hubs if hub is not None]
    for hub in hubs:
        kept[hub : hub + NODE] = True
    for solved in loads:
        for held in solved.gearbox.balances:
            kept |= held != 0.0
    return kept


def _independent(gearbox: LoadedGearbox) -> list[list[int]]:
    """Directions in which each bearing is rigid, without those in which others hold the same place."""
    held, found = np.zeros((0, len(gearbox.load))), list[list[int]]()
    for bearing in gearbox.bearings:
        found.append([])
        for direction in bearing.rigid:
            more = np.vstack([held, bearing.rows[direction]])
            if np.linalg.matrix_rank(more) == len(more):
                held = more
                found[-1].append(direction)
    return found


def _bearing(bearing: Supported, held: Sequence[int], place: IntArray) -> dict[str, Any]:
    said = bearing.settings
    given = {key: getattr(said, key) for key in KEYS if bearing.law is None}
    gives = [key for key, value in given.items() if value == "rigid" and KEYS[key] != TILT]
    rows = [[int(place[row.argmax()]), int(place[row.argmin()]) if row.min() < 0.0 else STILL] for row in bearing.rows]
    return {
        "name": said.name, "rows": rows, "held": held, "rolling": bearing.law is not None,
        "rigid": bool(gives) and not bearing.springs.any(), "gives": gives,
        "given": {key: value for key, value in given.items() if not isinstance(value, str)},
    }  # fmt: skip


def _load(solved: SolvedLoad, kept: BoolArray, inside: FloatArray, place: IntArray) -> dict[str, Any]:
    gearbox, states = solved.gearbox, iter(solved.equilibrium.bearings)
    bearings = list[dict[str, Any]]()
    for bearing in gearbox.bearings:
        stiffness, force = np.diag(bearing.springs), np.zeros(NODE)
        if bearing.law is not None:
            state, moved = next(states), bearing.rows[list(BEARING_ROWS)] @ solved.equilibrium.displacement
            stiffness[np.ix_(BEARING_ROWS, BEARING_ROWS)] = state.stiffness
            force[list(BEARING_ROWS)] = state.force - state.stiffness @ moved
        bearings.append({"stiffness": stiffness.ravel().tolist(), "force": force.tolist()})
    force, weight = (acting[kept] - inside.T @ acting[~kept] for acting in (gearbox.load, gearbox.weight))
    meshes = [
        {"axes": mesh.meshing.frame.axes.tolist(), "wrench": mesh.meshing.wrenches.ravel().tolist()}
        for mesh in solved.meshes
    ]
    held = [int(place[row.argmax()]) for row in gearbox.balances]
    sets = [
        [[int(place[hub + way]), float(value)] for hub, wrench in zip(one.hubs, one.wrenches, strict=True)
         if hub is not None for way, value in enumerate(wrench)] for one in gearbox.sets
    ]  # fmt: skip
    return {
        "name": solved.load.name, "force": force.tolist(), "weight": weight.tolist(), "held": held,
        "bearings": bearings, "meshes": meshes, "sets": sets,
    }  # fmt: skip


def _controls(loads: Sequence[SolvedLoad], machine: Mapping[str, Any]) -> Iterator[Control]:
    names = tuple(solved.load.name for solved in loads)
    if len(names) > 1:
        yield Control("load", "load", "load case", names[0], choices=names)
    label = "torques and forces, times those of the load case"
    yield Control("load", "share", label, "1", LEAST_LOAD, MOST_LOAD, 0.01)
    for rigid, key, unit in ((False, "stiffness", "times the stiffness"), (True, "give", "µm per kN, 0 is rigid")):
        kinds = ("rigid",) if rigid else ("given", "rolling")
        bearings = [(n, one) for n, one in enumerate(machine["bearings"]) if one["rigid"] == rigid]
        own = {str(n): bearing["name"] for n, bearing in bearings if any(bearing[kind] for kind in kinds)}
        common = {key: "all rigid bearings" if rigid else "all with a stiffness"} if len(own) > 1 else {}
        for number, name in (common | own).items():
            label = f"{name}, {unit}"
            if rigid:
                yield Control("bearings", number, label, "0", 0.0, MOST_GIVE, 0.1)
            else:
                yield Control("bearings", number, label, "1", 1.0 / STIFFNESS, STIFFNESS, 0.01, logarithmic=True)


def _note(loads: Sequence[SolvedLoad], pairs: Sequence[ReducedPair]) -> str:
    found = [
        "The page carries shafts and bearings with all meshes, and solves them together as a slider moves: the same "
        "equations as the run, each mesh on its hubs' compliance under the mean forces of the others."
    ]
    if any(bearing.law is not None for bearing in loads[0].gearbox.bearings):
        found.append(
            "Rolling bearings count by their stiffness under the solved load case: exact there, a tangent elsewhere."
        )
    if loads[0].sets:
        found.append(
            "Sets press on their shafts as under the solved load case, in the ratio of their torque: exact there."
        )
    for pair, mesh in zip(pairs, loads[0].meshes, strict=True):
        found += notes(pair.basis.case, pair.meshed, len(mesh.sweep.phi_rad))
    return " ".join(dict.fromkeys(found))
