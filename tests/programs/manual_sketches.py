"""Sketches of the manual, drawn from pmor's own geometry.

    python -m tests.programs.manual_sketches [FOLDER]

writes them to `cases/manual`, or a folder.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

from pmor.case import make_case
from pmor.core.conventions import rotation_z
from pmor.gear.condition import Misalignment
from pmor.gear.flank_deviation import MICROMETRE, kernel_deviation
from pmor.gear.kernels.deviation import deviations_at
from pmor.gear.kernels.motion import section_offset
from pmor.gear.modification import Modification
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.pair.model import gear_pair, mesh_model
from pmor.report.chart import COLOURS
from pmor.report.style import new_figure, plot_style

PINION, WHEEL, LOAD, AXIS = COLOURS[0], COLOURS[1], COLOURS[2], "#777777"
# The pair of the tutorial.
PAIR = {
    "module_mm": 2.5, "face_width_mm": 30.0, "torque_Nm": 120.0, "pinion": {"teeth": 23, "bore_radius_mm": 12.0},
    "wheel": {"teeth": 57, "bore_radius_mm": 25.0},
}  # fmt: skip
ARROW = {"arrowstyle": "-|>", "shrinkA": 0.0, "shrinkB": 0.0}


def tutorial_pair() -> GearPair:
    """Return the geometry of the tutorial's pair."""
    return gear_pair(make_case("manual", **PAIR))


def outline(tooth: Tooth, radius: float | None = None) -> np.ndarray:
    """Return the outline of a tooth centred on +y from its counter-clockwise root to the clockwise one, (n, 2)."""
    roll = np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, 40)
    root = tooth.root_section(np.linspace(0.0, 1.0, 30))
    side = np.concatenate([root[np.linalg.norm(root, axis=1).argsort()], tooth.flank_section(roll)])
    return np.concatenate([side, side[::-1] * [-1.0, 1.0]])


def drawn_gear(axes, tooth, place, turned, colour, teeth):
    """Draw some teeth of a gear: `place` its centre, `turned` its rotation."""
    for index in teeth:
        turn = rotation_z(turned + index * tooth.angular_pitch)[:2, :2]
        axes.plot(*(outline(tooth) @ turn.T + place).T, color=colour, lw=1.3)


def turned_wheel(pair, phi, index):
    """Rotation of the wheel's tooth that meets the pinion's tooth `index`, from +y."""
    return math.pi + pair.wheel_tooth_rotation(phi + index * pair.pitch)


def contact_points(pair, phi):
    """Points of the loaded flanks that touch, in the global frame."""
    found = []
    for index in pair.touching_pairs(phi, 0.0):
        roll, _ = pair.contact_roll_angles(np.array(phi + index * pair.pitch))
        point = pair.pinion.flank_section(np.array([roll]))[0]
        found.append(rotation_z(phi + index * pair.pitch)[:2, :2] @ point)
    return np.array(found)


def line_of_action(pair):
    """Tangent points of the line of action on both base circles, (2, 2)."""
    alpha, a = pair.working_pressure_angle, pair.centre_distance
    pinion = pair.pinion.base_radius * np.array([math.sin(alpha), math.cos(alpha)])
    wheel = np.array([0.0, a]) - pair.wheel.base_radius * np.array([math.sin(alpha), math.cos(alpha)])
    return np.array([pinion, wheel])


def bare(axes):
    """Take away the frame of a sketch."""
    axes.set_aspect("equal")
    axes.axis("off")


def arrow(axes, start, end, text="", colour="black", **more):
    """Draw an arrow with its name at the head."""
    axes.annotate("", end, start, arrowprops={**ARROW, "color": colour})
    if text:
        axes.annotate(text, end, textcoords="offset points", color=colour, **{"xytext": (4, 3), **more})


def pair_figure():
    """Frames and signs of the pair, in the transverse section, seen against +z."""
    pair, phi = tutorial_pair(), 0.05
    a, rb = pair.centre_distance, pair.pinion.base_radius
    figure = new_figure(6.4, 6.6)
    axes = figure.add_subplot()
    drawn_gear(axes, pair.pinion, [0.0, 0.0], phi, PINION, range(-3, 4))
    drawn_gear(axes, pair.wheel, [0.0, a], turned_wheel(pair, phi, 0), WHEEL, range(-4, 5))
    angle = np.linspace(0.0, math.pi, 200)
    axes.plot(rb * np.cos(angle), rb * np.sin(angle), color=PINION, lw=0.7, ls=":")
    angle = np.linspace(1.28 * math.pi, 1.72 * math.pi, 200)
    rb2 = pair.wheel.base_radius
    axes.plot(rb2 * np.cos(angle), a + rb2 * np.sin(angle), color=WHEEL, lw=0.7, ls=":")
    tangent = line_of_action(pair)
    axes.plot(*tangent.T, color=LOAD, lw=1.0)
    for point in contact_points(pair, phi):
        axes.plot(*point, "o", color=LOAD, ms=4)
    arrow(axes, (0, 0), (16, 0), "x", AXIS)
    arrow(axes, (0, 0), (0, 16), "y", AXIS)
    words = {"textcoords": "offset points", "va": "top", "ha": "center"}
    axes.annotate("pinion axis (0, 0), z towards you", (0, 0), (0, -8), color=PINION, **words)
    turn = np.radians(np.linspace(20.0, 75.0, 40))
    curve = 11.0 * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    axes.plot(*curve.T, color=PINION, lw=1.0)
    arrow(axes, curve[-2], curve[-1], "", PINION)
    axes.annotate("φ and torque T > 0", (9.5, 8.5), color=PINION)
    ahead = np.subtract(*tangent[::-1]) / np.linalg.norm(np.subtract(*tangent))
    arrow(axes, np.array([-21.0, 13.0]), np.array([-21.0, 13.0]) + 8.0 * ahead, "", LOAD)
    axes.annotate("STE > 0: the pinion is ahead,\nalong the line of action", (-35.0, 8.5), color=LOAD, fontsize=9)
    axes.annotate("line of action", tangent[1], (2, 4), textcoords="offset points", color=LOAD, fontsize=9)
    axes.annotate("loaded flanks touch here", contact_points(pair, phi)[0], (15.0, 24.0), color=LOAD, fontsize=9,
                  arrowprops={"arrowstyle": "-", "color": LOAD, "lw": 0.6})  # fmt: skip
    axes.annotate(f"wheel axis (0, a), a = {a:g} mm: above", (0, 53), ha="center", color=WHEEL)
    axes.set(xlim=(-36, 36), ylim=(-6, 56))
    bare(axes)
    return figure


def roll_figure():
    """The roll angle on one flank, and what lies at which one."""
    pair = tutorial_pair()
    tooth, rb = pair.pinion, pair.pinion.base_radius
    start, tip = pair.active_rolls[0][0], tooth.tip_roll_angle
    figure = new_figure(7.6, 5.0)
    axes = figure.add_subplot()
    axes.plot(*outline(tooth).T, color=PINION)
    arc = np.radians(np.linspace(70.0, 108.0, 100))
    axes.plot(rb * np.cos(arc), rb * np.sin(arc), color=AXIS, lw=0.8, ls=":")
    axes.annotate("base circle, r_b", (rb * math.cos(arc[-1]), rb * math.sin(arc[-1])), (-8, -14), ha="right",
                  textcoords="offset points", color=AXIS)  # fmt: skip
    highest = start + pair.pitch
    names = {"start of active profile (SAP)": start, "pitch point": math.tan(pair.working_pressure_angle),
             "highest point of single contact (HPSTC)": highest, "tip": tip}  # fmt: skip
    for name, roll in names.items():
        point = tooth.flank_section(np.array([roll]))[0]
        axes.plot(*point, "o", color=LOAD, ms=4)
        words = f"{name}: {math.degrees(roll):.2f} deg"
        lower = -8 if name.startswith("pitch") else 4
        axes.annotate(
            words, point, (-12, lower), textcoords="offset points", ha="right", va="center", color=LOAD, fontsize=9
        )
    roll = 0.5 * (highest + tip)
    point = tooth.flank_section(np.array([roll]))[0]
    direction = -tooth.flank_normal(np.array(roll), np.array(0.0))[:2]
    foot = point + rb * roll * direction
    axes.plot(*np.array([point, foot]).T, color=WHEEL)
    axes.plot(*np.array([0.86 * foot, foot]).T, color=AXIS, lw=0.8)
    axes.annotate("to the gear's centre", 0.86 * foot, (6, 4), textcoords="offset points", color=AXIS, fontsize=9)
    words = "roll length r_b u,\ntangent to the base circle"
    axes.annotate(words, 0.5 * (point + foot), (8, 6), textcoords="offset points", color=WHEEL, fontsize=9)
    axes.annotate("u = roll angle = roll length / r_b = tan α_y\nr_y = r_b √(1 + u²)", (-14.5, 22.6), fontsize=10)
    axes.set(xlim=(-15, 13), ylim=(22.0, 32.0))
    bare(axes)
    return figure


def path_figure():
    """The path of contact, with the roll angles of both gears at its points."""
    pair = tutorial_pair()
    start, end = pair.pinion_roll_range
    rb, pitch = pair.pinion.base_radius, pair.pitch
    points = {"A: SAP pinion, tip wheel": start, "B: LPSTC pinion": end - pitch,
              "C: pitch point": math.tan(pair.working_pressure_angle), "D: HPSTC pinion": start + pitch,
              "E: tip pinion, SAP wheel": end}  # fmt: skip
    figure = new_figure(8.2, 3.4)
    axes = figure.add_subplot()
    zero = rb * start
    axes.plot([0.0, rb * end - zero], [0.0, 0.0], color=LOAD, lw=3)
    for first, last, text in ((start, end - pitch, "two tooth pairs"), (end - pitch, start + pitch, "one tooth pair"),
                              (start + pitch, end, "two tooth pairs")):  # fmt: skip
        axes.annotate(text, (rb * 0.5 * (first + last) - zero, 0.0), (0, 8), textcoords="offset points", ha="center",
                      fontsize=9)  # fmt: skip
    for place, (name, roll) in enumerate(points.items()):
        mate = float(pair.contact_roll_angles(np.array(pair.roll_position(roll)))[1])
        text = f"{name}\n{rb * roll - zero:.2f} mm\n{math.degrees(roll):.2f} deg\n{math.degrees(mate):.2f} deg"
        axes.plot(rb * roll - zero, 0.0, "o", color=LOAD)
        below = {"xytext": (0, -14 - 52 * (place % 2)), "textcoords": "offset points", "ha": "center", "va": "top"}
        axes.annotate(text, (rb * roll - zero, 0.0), fontsize=8.5, **below)
    axes.annotate(
        "each point: length from A, roll angle of the pinion, roll angle of the wheel", (0.0, 1.2), fontsize=9
    )
    axes.set(xlim=(-1.5, rb * (end - start) + 1.5), ylim=(-4.3, 1.6))
    axes.axis("off")
    return figure


def removed_um(pair, modification, roll, z):
    """Material that a modification removes at points of the pinion's flank, um."""
    deviation, out = kernel_deviation(modification, pair.pinion, pair.active_rolls[0], pair.faces[0]), np.empty(len(z))
    deviations_at(deviation, roll, z, np.zeros(len(z), dtype=np.int64), out)
    return out / MICROMETRE


def modification_figure():
    """Deviations over roll angle and width as pmor evaluates them: positive removes material."""
    pair = tutorial_pair()
    active, face = pair.active_rolls[0], pair.faces[0]
    start, tip = (math.degrees(value) for value in active)
    highest = math.degrees(active[0] + pair.pitch)
    roll, z = np.radians(np.linspace(start, tip, 200)), np.linspace(*face, 200)
    profile = {
        "tip relief, linear": {"tip_relief_um": 10.0, "tip_relief_start_roll_deg": highest},
        "tip relief, parabolic": {"tip_relief_um": 10.0, "tip_relief_start_roll_deg": highest,
                                  "tip_relief_shape": "parabolic"},
        "root relief": {"root_relief_um": 6.0, "root_relief_end_roll_deg": math.degrees(active[1] - pair.pitch)},
        "profile crowning": {"profile_crowning_um": 5.0}, "profile slope": {"profile_slope_um": 6.0},
    }  # fmt: skip
    helix = {
        "helix crowning": {"helix_crowning_um": 6.0}, "helix slope": {"helix_slope_um": 10.0},
        "end relief": {"end_relief_um": 8.0, "end_relief_length_mm": 5.0},
    }  # fmt: skip
    figure = new_figure(9.0, 3.8)
    left, right = figure.subplots(1, 2)
    for axes, laws, x in ((left, profile, np.degrees(roll)), (right, helix, z)):
        for name, keys in laws.items():
            places = (roll, np.zeros_like(roll)) if axes is left else (np.full_like(z, roll[100]), z)
            axes.plot(x, removed_um(pair, Modification(**keys), *places), label=name)
        axes.legend(fontsize=8)
    left.set(xlabel="Roll angle of the gear [deg]: SAP ... tip", ylabel="Material removed [µm]")
    right.set(xlabel="z from the gear's own mid width [mm]")
    return figure


def axes_figure():
    """Where misalignment puts the wheel's axis, section by section."""
    figure = new_figure(9.0, 3.9)
    half = 0.5 * PAIR["face_width_mm"]
    z = np.linspace(-1.5 * half, 1.5 * half, 2)
    moved = Misalignment(in_plane_um=40.0, out_of_plane_um=40.0, centre_distance_um=20.0)
    meshed = mesh_model(make_case("manual", **PAIR)).meshed
    place = [section_offset(meshed.kinematics(moved), meshed.gears, value)[:2] for value in (*z, half)]
    for axes, axis, key in zip(figure.subplots(1, 2), (1, 0), ("in_plane_um", "out_of_plane_um"), strict=True):
        low, high, at_face = (offset[axis] / MICROMETRE for offset in place)
        middle = 0.5 * (low + high)
        axes.axhline(0.0, color=AXIS, ls="--", lw=1.0)
        axes.plot(z, [low, high], color=WHEEL)
        words = {"textcoords": "offset points", "fontsize": 9}
        axes.annotate("nominal axis of the wheel", (z[0], 0.0), (0, -12), color=AXIS, **words)
        axes.annotate("misaligned", (z[1], high), (-4, 2), ha="right", va="bottom", color=WHEEL, **words)
        for side in (-half, half):
            axes.axvline(side, color=AXIS, lw=0.7)
        arrow(axes, (half, middle), (half, at_face), f"{key} / 2", LOAD, ha="left", xytext=(4, -14))
        if middle > 1.0:
            arrow(axes, (0.0, 0.0), (0.0, middle), "centre_distance_um", LOAD, ha="right", xytext=(-4, -10))
        words = "y, in the plane of the axes [µm]" if axis else "x, across that plane [µm]"
        axes.set(xlabel="z [mm], vertical lines: ends of the face", ylabel=words)
        axes.set_ylim(-45.0, 65.0)
    return figure


FIGURES = {
    "pair": pair_figure, "roll_angle": roll_figure, "path_of_contact": path_figure,
    "modifications": modification_figure, "misalignment": axes_figure,
}  # fmt: skip


def main(folder: str = "cases/manual") -> None:
    """Write all sketches."""
    import matplotlib

    for name, draw in FIGURES.items():
        with plot_style():
            matplotlib.rcParams["svg.fonttype"] = "none"
            draw().savefig(Path(folder) / f"{name}.svg", metadata={"Date": None})


if __name__ == "__main__":
    main(*sys.argv[1:])
