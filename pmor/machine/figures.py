"""Pictures of a gearbox: deflected shafts, transmission errors, and how loads lie over the faces."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pmor.body.beam import NODE
from pmor.core.arrays import FloatArray
from pmor.machine.coupled import SolvedLoad
from pmor.machine.coupled_sets import SolvedSet
from pmor.machine.model import GearboxModel
from pmor.machine.settings import PlanetarySet
from pmor.machine.turn_orders import mesh_misalignment, planet_rows, planet_shares
from pmor.pair.model import gear_pair
from pmor.report.chart import COLOURS, Chart, Panel, panels
from pmor.results.load_distribution import line_states
from pmor.sets.lost import known

# Share of the height of the gearbox that the largest displacement takes in the picture.
SHOWN = 0.06
SET_ORDERS = 12
VIEWS = (("y", 0, 1), ("z", 1, 2))


def deflection_figure(model: GearboxModel, solved: SolvedLoad) -> Chart:
    """Side views of all shafts, as drawn and deflected, exaggerated."""
    moved = solved.equilibrium.displacement.reshape(-1, NODE)
    factor = exaggeration(size_of(model), moved[:, 1:3])
    with panels(1, 8.2, 6.8, rows=2) as (figure, each):
        for axes, (name, coordinate, row) in zip(each, VIEWS, strict=True):
            for colour, shaft in zip(_colours(len(model.sections.shafts)), model.sections.shafts, strict=True):
                _outline(axes, model, shaft.name, coordinate, colour)
                beam, first = solved.gearbox.beams[shaft.name], solved.gearbox.first[shaft.name] // NODE
                line = shaft.at_mm[coordinate] + factor * moved[first : first + len(beam.stations), row]
                axes.plot(shaft.start_mm + beam.stations, line, color=colour, label=(shaft.name))
            for bearing in model.sections.bearings:
                shaft = model.shafts[bearing.shaft]
                place = shaft.start_mm + bearing.at_mm, shaft.at_mm[coordinate]
                axes.plot(*place, "^", color="black", ms=6, mfc="white")
            axes.set(xlabel="x [mm]", ylabel=f"{name} [mm]")
        figure.heading = f"{solved.load.name}: displacements {factor:g} times as large; triangles: bearings"
    return figure


def size_of(model: GearboxModel) -> float:
    """Return about how far the shafts of a gearbox go across their axes, mm."""
    places = [abs(value) for shaft in model.sections.shafts for value in shaft.at_mm]
    return max(places) + max(section.outer_mm for shaft in model.sections.shafts for section in shaft.sections)


def exaggeration(size_mm: float, moved: FloatArray) -> float:
    """Return by how much displacements (mm) are drawn larger than they are, one digit of it."""
    largest = float(np.abs(moved).max())
    return float(f"{SHOWN * size_mm / largest:.1g}") if largest > 0.0 else 1.0


def _outline(axes: Panel, model: GearboxModel, name: str, coordinate: int, colour: str) -> None:
    shaft = model.shafts[name]
    at, x = shaft.at_mm[coordinate], shaft.start_mm
    for section in shaft.sections:
        for side in (1.0, -1.0):
            axes.fill_between([x, x + section.length_mm], at + side * 0.5 * section.inner_mm,
                              at + side * 0.5 * section.outer_mm, color=colour, alpha=0.25, lw=0)  # fmt: skip
        x += section.length_mm
    for mesh in model.sections.meshes:
        pair = model.pairs[mesh.name]
        for gear, tooth, face in zip((mesh.pinion, mesh.wheel), (pair.pinion, pair.wheel), pair.faces, strict=True):
            if gear.shaft == name:
                middle = shaft.start_mm + gear.at_mm
                axes.fill_between([middle + face[0], middle + face[1]], at - tooth.tip_radius, at + tooth.tip_radius,
                                  color=colour, alpha=0.18, lw=0)  # fmt: skip
    for one in model.sections.sets:
        bands, (low, high) = member_bands(model, one)
        for member, place in one.members.items():
            if place.shaft == name:
                for near, far in ((-side * r for r in bands[member]) for side in (1.0, -1.0)):
                    axes.fill_between([low, high], at + near, at + far, color=colour, alpha=0.18, lw=0)


def member_bands(model: GearboxModel, one: PlanetarySet) -> tuple[dict[str, tuple[float, float]], tuple[float, float]]:
    """Return the radii between which the gears of each member of a set are, and the x of their faces, mm."""
    file = model.sets[one.name]
    inner, outer = (gear_pair(case) for case in file.cases.values())
    place = next(iter(one.members.values()))
    middle, half = model.shafts[place.shaft].start_mm + place.at_mm, 0.5 * inner.face_width
    distance, planet, ring = inner.centre_distance, inner.wheel.tip_radius, outer.wheel
    bands = {
        "sun": (0.0, inner.pinion.tip_radius), "carrier": (distance - planet, distance + planet),
        "ring": (abs(ring.tip_radius), abs(ring.root_radius)),
    }  # fmt: skip
    return bands, (middle - half, middle + half)


def ste_figure(loads: Sequence[SolvedLoad]) -> Chart:
    """Transmission error of each mesh about its mean, on its supports and on rigid ones."""
    return _by_mesh(loads, "Pinion angle, pitches [-]", "STE about its mean [µm]", _ste)


def set_ste_figure(loads: Sequence[SolvedLoad], number: int) -> Chart:
    """Transmission error of a set over the mesh cycle, within its limits over a turn of the carrier, and its orders."""
    with panels(2, 9.2, 4.2) as (figure, (curve, spectrum)):
        width = 0.8 / len(loads)
        for place, (colour, solved) in enumerate(zip(_colours(len(loads)), loads, strict=True)):
            one = solved.sets[number]
            assert one.rigid is not None
            ste = one.solution.ste_um[0].reshape(one.solution.pitches, -1)
            pitches, middle = np.arange(ste.shape[1]) / ste.shape[1], known(np.mean, ste)
            curve.fill_between(pitches, np.fmin.reduce(ste) - middle, np.fmax.reduce(ste) - middle, color=colour,
                               alpha=0.3, lw=0)  # fmt: skip
            mean = np.array([known(np.mean, of_angle) for of_angle in ste.T])
            curve.plot(pitches, mean - middle, color=colour, label=(solved.load.name))
            rigid = one.rigid.ste_um[one.row].reshape(one.rigid.pitches, -1).mean(axis=0)
            curve.plot(pitches, rigid - known(np.mean, rigid), ":", color=colour)
            found = one.solution.mesh_orders(0)[:SET_ORDERS]
            at = np.arange(1, len(found) + 1) + width * (place + 0.5) - 0.4
            spectrum.bar(at, found, width, color=colour)
        curve.set(xlabel="Angle of the sun against the carrier [pitches]", ylabel="STE about its mean [µm]")
        spectrum.set(xlabel="Order of the mesh [-]", ylabel="Amplitude of the STE [µm]")
        spectrum.set(xticks=np.arange(1, SET_ORDERS + 1))
    return figure


def turn_figure(one: SolvedSet) -> Chart:
    """Loads of the planets of a set over a turn of its carrier, rows of their bearings, and misalignment of meshes."""
    assert one.turn is not None
    share, rows = planet_shares(one.turn, one), planet_rows(one.turn)
    angle, plan = one.turn.angle_deg, one.solution.plan
    misaligned, meshes = mesh_misalignment(one.turn, one), one.solution.plan.meshes
    bearings = rows.shape[2] > 0  # planets on springs have none
    with panels(2 + bearings, 9.2 + 4.2 * bearings, 4.2) as (figure, axes):
        loads, tilted = axes[0], axes[-1]
        for number, planet in enumerate(plan.planets):
            colour = COLOURS[number % len(COLOURS)]
            loads.plot(angle, share.shape[1] * share[:, number], color=colour, label=plan.bodies[planet].name)
            for row, style in zip(range(rows.shape[2]), ("-", "--", ":", "-.") * rows.shape[2], strict=False):
                axes[1].plot(angle, 1e-3 * rows[:, number, row], style, color=colour)
            ends = [(n, mesh) for n, mesh in enumerate(meshes) if planet in (mesh.pinion, mesh.wheel)]
            for (mesh, _), style in zip(ends, ("-", "--") * len(ends), strict=False):
                tilted.plot(angle, misaligned[:, mesh], style, color=colour)
        loads.set(ylabel="Load of a planet over the mean [-]")
        axes[1].set(ylabel="Force across a bearing row [kN]")
        tilted.set(ylabel="Misalignment F_β [µm]")
        for one_axes in axes:
            one_axes.set(xlabel="Angle of the carrier [°]", xticks=one.turn.turns * np.arange(0.0, 361.0, 90.0))
    return figure


def face_load_figure(loads: Sequence[SolvedLoad]) -> Chart:
    """Line load over the face of each mesh, added up over its tooth pairs, mean over the mesh cycle."""
    return _by_mesh(loads, "x from mid width [mm]", "Line load, mean over the mesh cycle [N/mm]", _face_load)


def _ste(axes: Panel, solved: SolvedLoad, number: int, colour: str) -> None:
    mesh, rigid = solved.meshes[number], solved.rigid[number]
    for sweep, row, style in ((mesh.sweep, 0, "-"), (rigid.sweep, rigid.row, ":")):
        ste = sweep.ste_um[row]
        axes.plot(sweep.phi_rad / sweep.pitch_rad, ste - known(np.mean, ste), style, color=colour,
                  label=(solved.load.name) if style == "-" else None)  # fmt: skip


def _face_load(axes: Panel, solved: SolvedLoad, number: int, colour: str) -> None:
    mesh, rigid = solved.meshes[number], solved.rigid[number]
    for sweep, row, style in ((mesh.sweep, 0, "-"), (rigid.sweep, rigid.row, ":")):
        lines = line_states(sweep)
        load = lines.load_N_per_mm[row].sum(axis=1).mean(axis=0)
        axes.plot(mesh.meshing.frame.along * lines.z_mm, load, style, color=colour,
                  label=(solved.load.name) if style == "-" else None)  # fmt: skip


def _by_mesh(loads: Sequence[SolvedLoad], x: str, y: str, draw: Callable[[Panel, SolvedLoad, int, str], None]) -> Chart:
    count = len(loads[0].meshes)
    with panels(1, 6.0, 3.4 * count, rows=count) as (figure, each):
        for number, axes in enumerate(each):
            for colour, solved in zip(_colours(len(loads)), loads, strict=True):
                draw(axes, solved, number, colour)
            axes.set(xlabel=x, ylabel=y, title=f"mesh {loads[0].meshes[number].meshing.settings.name}")
    return figure


def _colours(count: int) -> list[str]:
    return [COLOURS[i % len(COLOURS)] for i in range(count)]
