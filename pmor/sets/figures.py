"""Pictures of a set: its gears with the forces of their teeth, transmission error, planets' shares, the sun's orbit."""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import MeshError
from pmor.fe.outline import tooth_outline
from pmor.gear.tooth import Tooth
from pmor.report.blank_figure import hole_outline
from pmor.report.chart import COLOURS, MARGIN, Chart, Panel, panels
from pmor.report.table import format_cell
from pmor.results.load_distribution import face_line
from pmor.sets.lost import known
from pmor.sets.pins import pin_shapes
from pmor.sets.root_stress import GearStress
from pmor.sets.settings import Pins
from pmor.sets.shafts import shaft_of
from pmor.sets.solution import SetSolution

# Widths of lines that may lie on each other, and points of an orbit between two that are solved.
THIN, WIDER, BETWEEN = 1.2, 0.9, 8
# Length of the longest arrow, over the size of the picture.
ARROW = 0.09
POINTS, PIN_POINTS = 8, 81
# Pitches whose curves are drawn with full lines.
FEW = 12
# Orders of the mesh between which those of shafts are shown.
SHOWN = 3
# Heights of axes that are shown at least: share of the load, per cent, and way of the sun, um.
LEAST_SHARE, LEAST_ORBIT = 0.1, 0.1


def set_figure(solved: SetSolution, torque: int, angle: int = 0) -> Chart:
    """All gears at an angle, and the force of each tooth pair on the driven gear, at its point of contact."""
    side = -1.0 if solved.plan.clockwise else 1.0
    colours = {member: COLOURS[n % len(COLOURS)] for n, member in enumerate(_members(solved))}
    bodies = solved.plan.bodies
    with panels(1, 7.4, 7.4) as (figure, (axes,)):
        for number, (tooth, turn) in _gears(solved, angle).items():
            body = bodies[number]
            outline = _outline(tooth, turn) * [side, 1.0] + [side * body.x, body.y]
            inside = tooth.teeth < 0
            colour = colours[body.member]
            axes.fill(*outline.T, fill=not inside, facecolor=colour, alpha=0.15, edgecolor=colour, lw=0.9)
            for hole in _holes(solved, number, turn):
                axes.fill(
                    *(hole * [side, 1.0] + [side * body.x, body.y]).T, facecolor="white", edgecolor=colour, lw=0.9
                )
            if not inside:  # names of gears on one shaft below each other
                names = [one.name for one, on in zip(bodies, shaft_of(bodies), strict=True) if on == number]
                if names:
                    axes.text(side * body.x, body.y, "\n".join(names), ha="center")
        points, forces = _tooth_forces(solved, torque, angle)
        size = max(float(np.ptp(axes.limits(way))) for way in ("x", "y")) / (1.0 + 2.0 * MARGIN)
        largest = max(float(np.linalg.norm(forces, axis=1).max(initial=0.0)), 1e-300)
        arrows = forces * ARROW * size / largest * [side, 1.0]
        axes.arrows(points * [side, 1.0], arrows, color="black", zorder=5)
        axes.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]", grid=False,
                 title=f"Tooth forces on driven gears; longest: {format_cell(float(f'{largest:.4g}'))} N")  # fmt: skip
    return figure


def ste_figure(solved: SetSolution, shown_Nm: FloatArray) -> Chart:
    """Transmission error over all mesh cycles at each torque, about its mean, and its orders."""
    with panels(2, 9.2, 4.2) as (figure, (curve, spectrum)):
        width = 0.8 / len(shown_Nm)
        for number, torque in enumerate(shown_Nm):
            ste = solved.ste_um[number]
            colour = COLOURS[number % len(COLOURS)]
            pitches, lw = solved.phi_rad / solved.pitch_rad, 1.5 if solved.pitches <= FEW else 0.7
            curve.plot(pitches, ste - known(np.mean, ste), color=colour, label=f"{torque:g} N m", lw=lw)
            if not solved.repeats:
                continue
            if solved.pitches > 1:
                found = solved.ste_orders(number).amplitude[: SHOWN * solved.pitches]
                places = np.arange(1, len(found) + 1) / solved.pitches
                spectrum.vlines(places, 0.0, found, color=colour, lw=2.5 - 1.5 * number / len(shown_Nm))
                continue
            found = solved.mesh_orders(number)[:POINTS]
            spectrum.bar(np.arange(1, len(found) + 1) + width * (number + 0.5) - 0.4, found, width, color=colour)
        curve.set(xlabel="Angle of the first gear [pitches]", ylabel="STE about its mean [µm]")
        which = "mesh" if solved.plan.cycle == 1 else "first mesh"
        spectrum.set(xlabel=f"Order of the {which} [-]", ylabel="Amplitude of the STE [µm]")
        spectrum.set(xticks=np.arange(1, (SHOWN if solved.pitches > 1 else POINTS) + 1))
        spectrum.set_ylim(bottom=0.0)
    return figure


def _beneath(number: int, count: int) -> float:
    """Width of one of many lines that may lie on each other: the first ones stand out beneath the last."""
    return THIN + WIDER * (count - 1 - number)


def at_least(axes: Panel, axis: Literal["x", "y"], height: float) -> None:
    """Show at least so much of an axis about its middle, so that round-off is a line."""
    low, high = axes.limits(axis)
    if high - low < height:
        middle = 0.5 * (low + high)
        axes.set(**{f"{axis}lim": (middle - 0.5 * height, middle + 0.5 * height)})


def share_figure(solved: SetSolution, torque: int) -> Chart:
    """Share of each planet over a mesh cycle, and where the sun moves."""
    with panels(2, 9.2, 4.2) as (figure, (shares, orbit)):
        pitches, count = solved.phi_rad / solved.pitch_rad, len(solved.plan.planets)
        for place, number in enumerate(solved.plan.planets):
            name = (solved.plan.bodies[number].name)
            shares.plot(pitches, 100.0 * solved.planet_share[torque, :, place], label=name, lw=_beneath(place, count))
        at_least(shares, "y", LEAST_SHARE)
        shares.set(xlabel="Angle of the sun against the carrier [pitches]", ylabel="Share of the load [%]")
        side = -1.0 if solved.plan.clockwise else 1.0
        path = 1e3 * solved.hub_displacement[torque, :, 0, :2] * [side, 1.0]
        curve = _rounded(path)
        orbit.plot(curve[:, 0], curve[:, 1], "-", color=COLOURS[-1])
        orbit.plot(path[:, 0], path[:, 1], "o", color=COLOURS[-1], ms=2.0)
        orbit.plot(path[:1, 0], path[:1, 1], "o", color=COLOURS[1], ms=4)
        # Alike along both axes: equal axes take the whole room.
        wide = max(LEAST_ORBIT, *(float(np.ptp(orbit.limits(axis))) for axis in ("x", "y")))
        for way in ("x", "y"):
            at_least(orbit, way, wide)
        orbit.set(xlabel="x of the sun [µm]", ylabel="y of the sun [µm]", aspect="equal",
                  title=f"Sun over {'the mesh cycle' if solved.pitches == 1 else f'{solved.pitches} mesh cycles'}; "
                  "dot: angle 0")  # fmt: skip
    return figure


def _rounded(path: FloatArray) -> FloatArray:
    """Return points on a smooth closed curve through those of a path, by Catmull and Rom (1974)."""
    before, start, end, after = (np.roll(path, move, axis=0)[:, None] for move in (1, 0, -1, -2))
    t = np.linspace(0.0, 1.0, BETWEEN, endpoint=False)[:, None]
    curve = start + 0.5 * t * (end - before + t * (2 * before - 5 * start + 4 * end - after
                                                   + t * (3 * (start - end) + after - before)))  # fmt: skip
    curve = curve.reshape(-1, 2)
    return np.concatenate([curve, curve[:1]])


def path_figure(solved: SetSolution, torque: int) -> Chart:
    """Share of each mesh in the torque of those that share it, over all mesh cycles; of a train on fixed axes."""
    with panels(1, 7.4, 4.2) as (figure, (axes,)):
        for number, (one, beside) in enumerate(zip(solved.train.meshes, solved.beside, strict=True)):
            if len(beside) > 1:
                name = (" - ".join(solved.train.bodies[body].name for body in one.bodies))
                share = 100.0 * solved.mesh_share[torque, :, number]
                axes.plot(solved.phi_rad / solved.pitch_rad, share, "-" if one.bodies[0] == 0 else "--", label=name)
        axes.set(xlabel="Angle of the first gear [pitches]", ylabel="Share of the torque [%]")
    return figure


def pin_figure(pins: Pins, solved: SetSolution, torque: int) -> Chart:
    """Deflection of all pins and of the axes of the planets on them, mean over the mesh cycle."""
    plan = solved.plan
    assert plan.on_pins is not None
    z = np.linspace(*pins.ends_mm, PIN_POINTS)
    inner, outer = (mesh.pair.meshed.pair for mesh in solved.train.meshes[:2])
    faces = np.array([inner.faces[1], np.add(outer.faces[0], plan.bodies[plan.meshes[1].pinion].z)])
    face = np.array([faces.min(), faces.max()])  # of both gears where the planets are stepped
    there = solved.left(torque)
    wrenches = solved.planet_wrench[torque, there]
    shapes = np.mean([pin_shapes(pins, plan.on_pins, wrench, z) for wrench in wrenches], axis=0)
    bent = solved.outwards_and_around(shapes.transpose(2, 0, 1))
    middle, slope = (
        values[torque, there].mean(axis=0) for values in (solved.planet_displacement_mm, solved.planet_tilt_rad)
    )
    bearings = np.sort(plan.on_pins.pin.bearings_mm)
    with panels(2, 9.2, 4.2) as (figure, each):
        for way, (axes, name) in enumerate(zip(each, ("Outwards", "In the sense of the sun's torque"), strict=True)):
            for place, number in enumerate(plan.planets):
                colour, pin = COLOURS[place % len(COLOURS)], 1e3 * bent[:, place, way]
                axes.plot(z, pin, color=colour, label=(plan.bodies[number].name))
                axes.plot(bearings, np.interp(bearings, z, pin), "o", color=colour, ms=4)
                axes.plot(face, 1e3 * (middle[place, way] + slope[place, way] * face), "--", color=colour, lw=1.0)
            axes.set(xlabel="z from mid width [mm]", ylabel="Displacement [µm]", title=name)
    return figure


def ring_figure(solved: SetSolution, torque: int) -> Chart:
    """Displacement of the root of a ring between its teeth, around the axis, at angle 0."""
    found = solved.ring_deflection
    assert found is not None
    side = -1.0 if solved.plan.clockwise else 1.0
    with panels(1, 7.4, 4.2) as (figure, (axes,)):
        for way, name in enumerate(("outwards", "counter-clockwise")):
            axes.plot(found.place_deg, found.displacement_um[torque, :, way], color=COLOURS[way], label=name)
        for body in (solved.plan.bodies[number] for number in solved.plan.planets):
            place = np.degrees(np.arctan2(-side * body.x, body.y)) % 360.0
            axes.axvline(place, color="#999999", lw=0.8, ls="--")
        axes.set(xlabel="Place, counter-clockwise from the y axis [deg]", ylabel="Displacement [µm]", xlim=(0.0, 360.0))
        axes.set(xticks=range(0, 361, 60))
    return figure


def face_load_figure(solved: SetSolution, torque: int) -> Chart:
    """Line load over the face of each mesh, added up over tooth pairs, mean over the mesh cycle."""
    with panels(1, 7.2, 4.2) as (figure, (axes,)):
        meshes = solved.train.meshes
        for number, one in enumerate(meshes):
            z, load = face_line(solved.lines(number), torque)
            name = " - ".join(solved.train.bodies[body].name for body in one.bodies)
            axes.plot(z, load, "-" if one.bodies[0] == 0 else "--", label=name, lw=_beneath(number, len(meshes)))
        axes.set(xlabel="z from mid width [mm]", ylabel="Line load, mean over the mesh cycle [N/mm]")
        axes.set_ylim(0.0, 1.15 * axes.limits("y")[1])
    return figure


def root_stress_figure(solved: SetSolution, torque: int) -> Chart:
    """Stress across the root of a tooth of each member over a turn: of its gear with the largest range."""
    with panels(1, 9.2, 4.2) as (figure, (axes,)):
        for member in _members(solved):
            gears = [n for n, body in enumerate(solved.plan.bodies) if body.member == member]
            ranges = [solved.root_stress[n].cycle.range_MPa[torque].max() for n in gears]
            worst = gears[int(np.argmax(np.round(ranges, 3)))]  # equal ones differ by round-off
            stress = _worst_turn(solved.root_stress[worst], torque)
            turn = np.arange(len(stress)) / len(stress)
            axes.plot(turn, stress, label=(solved.plan.bodies[worst].name), lw=1.2)
        axes.axhline(0.0, color="black", lw=0.6)
        about = " against the carrier" if solved.plan.planets else ""
        axes.set(xlabel=f"Turn of the gear{about} [-]", ylabel="Stress across the root [MPa]", xlim=(0.0, 1.0))
    return figure


def _worst_turn(stress: GearStress, torque: int) -> FloatArray:
    """Stress over that turn of a gear in which the range is largest."""
    over = stress.over_turns_MPa[torque]
    ends = np.rint(np.linspace(0.0, len(over), stress.turns + 1)).astype(int)
    turns = [over[first:last] for first, last in pairwise(ends)]
    return max(turns, key=lambda turn: known(np.ptp, turn))


def _members(solved: SetSolution) -> list[str]:
    return list(dict.fromkeys(body.member for body in solved.plan.bodies))


def _gears(solved: SetSolution, angle: int) -> dict[int, tuple[Tooth, float]]:
    """Each body's teeth, and the angle of its first tooth from the y axis, rad."""
    found: dict[int, tuple[Tooth, float]] = {}
    for one in solved.train.meshes:
        pair, side = one.pair.meshed.pair, -1.0 if one.image else 1.0
        phi = one.start + one.rate * float(solved.phi_rad[angle])
        turned = phi, np.pi + pair.wheel_tooth_rotation(phi)
        for body, tooth, turn, first in zip(
            one.bodies, (pair.pinion, pair.wheel), turned, one.first_tooth, strict=True
        ):
            found.setdefault(body, (tooth, one.direction + side * (turn - first * tooth.angular_pitch)))
    return found


def _holes(solved: SetSolution, number: int, turn: float) -> list[FloatArray]:
    """Outlines of the holes of a body whose first tooth is turned by an angle, mm."""
    body = solved.train.bodies[number]
    if (holes := body.holes) is None:
        return []
    side = -1.0 if body.image else 1.0
    first = 0.5 * np.pi + turn + side * np.radians(holes.first_deg)
    return [hole_outline(holes, first + 2.0 * np.pi * n / holes.count) for n in range(holes.count)]


def _outline(tooth: Tooth, turn: float) -> FloatArray:
    """Points around a whole gear, its first tooth turned by an angle, mm."""
    try:
        found = tooth_outline(tooth, POINTS, "arc_length")
        half = np.concatenate([found.lower_fillet, found.upper_fillet[1:], found.flank[1:]])
    except MeshError:  # no fillet to put nodes on
        half = tooth.flank_section(np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, POINTS))
    whole = np.concatenate([half, half[::-1] * [-1.0, 1.0]])
    angles = turn - tooth.angular_pitch * np.arange(abs(tooth.teeth))
    turned = [whole @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) for a in angles]
    return np.concatenate(turned)


def _tooth_forces(solved: SetSolution, torque: int, angle: int) -> tuple[FloatArray, FloatArray]:
    """Points of contact of all tooth pairs that carry, and forces there on the driven gears, (n, 2), mm and N."""
    points, forces = [], []
    for one in solved.placed.placed:
        pair, sections = one.mesh.pair.meshed.pair, len(one.mesh.pair.meshed.width)
        alpha, radius = pair.working_pressure_angle, pair.pinion.base_radius
        own = solved.found.force[torque, angle, one.part].reshape(-1, sections)
        roll = one.lines.roll[angle % len(one.lines.roll), :, 0].reshape(-1, sections)
        turn = np.array([[np.cos(one.mesh.direction), -np.sin(one.mesh.direction)],
                         [np.sin(one.mesh.direction), np.cos(one.mesh.direction)]])  # fmt: skip
        centre = solved.plan.bodies[one.mesh.bodies[0]]
        for force, u in zip(own, roll, strict=True):
            if force.sum() <= 0.0:
                continue
            mean = float(u @ force / force.sum())
            place = radius * np.array([np.sin(alpha) - mean * np.cos(alpha), np.cos(alpha) + mean * np.sin(alpha)])
            side = np.array([-1.0 if one.mesh.image else 1.0, 1.0])
            points.append(turn @ (side * place) + [centre.x, centre.y])
            forces.append(turn @ (side * force.sum() * np.array([-np.cos(alpha), np.sin(alpha)])))
    return np.array(points).reshape(-1, 2), np.array(forces).reshape(-1, 2)
