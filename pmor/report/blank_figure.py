"""Picture of the blanks of a pair: section through the axis, and front view with teeth and holes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pmor.case import Case
from pmor.case.blank import ROUND_OFF, HolesCase
from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.pair.drawn import DrawnGear, drawn_gears
from pmor.report.chart import Chart, Panel, panels

NAMES = "Pinion", "Wheel"
FILL = {"teeth": "#c9d6df", "rim": "#9fb7c9", "web": "#d9b48f", "hub": "#b7c4a1"}
EDGE, HELD = "#33414d", "#b03a2e"
# Of the height of a section: least distance of two of its names.
NAME_HEIGHT = 0.085
# Of a section in characters, twice as high as wide.
COLUMNS, LEAST_ROWS, MOST_ROWS = 32, 12, 24
CIRCLE = np.linspace(0.0, 2.0 * math.pi, 181)


def blank_figure(case: Case, pair: GearPair) -> Chart | None:
    """Draw rim, web, hub and holes of the gears that have them; None where both are solid."""
    gears = [(place, gear) for place, gear in enumerate(drawn_gears(case, pair)) if gear.light]
    if not gears:
        return None
    turned = -1.0 if case.flank == "coast" else 1.0  # that case is the image of its pair
    with panels(2, 9.0, 4.6 * len(gears), rows=len(gears)) as (figure, axes):
        for (place, gear), section, front in zip(gears, axes[::2], axes[1::2], strict=True):
            _section(section, gear, NAMES[place])
            _front(front, gear, place, turned)
    return figure


def _section(axes: Panel, gear: DrawnGear, name: str) -> None:
    """Half of the section through the axis, and in a column beside it what each part measures."""
    for ring in gear.rings:
        radii, low, high = ring.stations.T
        axes.fill([*low, *high[::-1]], [*radii, *radii[::-1]], facecolor=FILL[ring.name], edgecolor=EDGE, lw=0.9)
    if (holes := gear.holes) is not None:
        web, ends = gear.rings[-2], (holes.on_radius_mm - holes.radius_mm, holes.on_radius_mm + holes.radius_mm)
        corners = np.array([web.low, web.high, web.high, web.low]), np.repeat(ends, 2)
        axes.fill(*corners, facecolor="white", edgecolor=EDGE, lw=0.9)
        axes.plot([web.low - 2.0, web.high + 2.0], [holes.on_radius_mm] * 2, "-.", color=EDGE, lw=0.7)
    axes.plot(gear.held, [gear.rings[-1].inner] * 2, color=HELD, lw=3.0)
    axes.axhline(0.0, color=EDGE, ls="-.", lw=0.9)
    wide = max(ring.high for ring in gear.rings)
    top, reach = gear.rings[0].outer, 1.25 * wide
    axes.set(xlabel="z from mid face [mm]", ylabel="Radius [mm]", aspect="equal", title=f"{name}: section")
    axes.set(xlim=(-reach, reach), ylim=(-0.04 * top, 1.04 * top))
    names = sorted(_dimensions(gear), key=lambda dimension: dimension[1])
    heights = np.array([radius for _, radius, _ in names]) / top
    for _ in range(200):  # neighbours that are too close push each other apart
        overlap = np.maximum(NAME_HEIGHT - np.diff(heights), 0.0)
        heights[:-1] -= 0.5 * overlap
        heights[1:] += 0.5 * overlap
    for (z, radius, text), height in zip(names, heights, strict=True):
        axes.text(z, radius, text, column=(height + 0.04) / 1.08)
        axes.plot(z, radius, ".", ms=4, color=EDGE)


def _dimensions(gear: DrawnGear) -> list[tuple[float, float, str]]:
    """Points of a section, z and radius, and what is measured there."""
    teeth, rim, web, hub = gear.rings
    middle, holes = 0.5 * (web.low + web.high), gear.holes
    named = web.inner + 0.8 * (web.outer - web.inner)
    thick = web.stations[:, 2] - web.stations[:, 1]
    thickness = " to ".join(dict.fromkeys(f"{width:.4g}" for width in (thick.min(), thick.max())))
    part = gear.held[1] - gear.held[0]
    over = f" over {part:.4g} mm" if part < (hub.high - hub.low) * (1.0 - ROUND_OFF) else ""
    offset = f", offset {middle:+.4g} mm" if middle and not web.profile else ""
    dimensions = [
        (teeth.high, teeth.outer, f"tip ⌀ {2.0 * teeth.outer:.5g} mm"),
        (rim.high, rim.outer, f"root ⌀ {2.0 * rim.outer:.5g} mm, face {rim.high - rim.low:.4g} mm"),
        (rim.high, 0.5 * (rim.inner + rim.outer), f"rim {rim.outer - rim.inner:.4g} mm thick"),
        (web.faces(named)[1], named, f"web {thickness} mm thick{offset}"),
        (hub.high, hub.outer, f"hub ⌀ {2.0 * hub.outer:.5g} mm, {hub.high - hub.low:.4g} mm wide"),
        (gear.held[1], hub.inner, f"bore ⌀ {2.0 * hub.inner:.5g} mm, held{over}"),
    ]
    if holes is not None:
        text = f"{holes.count} holes ⌀ {2.0 * holes.radius_mm:.4g} mm"
        if holes.length_deg:
            text = f"{holes.count} slots {2.0 * holes.radius_mm:.4g} mm wide, {holes.length_deg:.4g}° long"
        text += f"\non ⌀ {2.0 * holes.on_radius_mm:.5g} mm"
        dimensions.append((web.high, holes.on_radius_mm, text))
    return dimensions


def section_text(gear: DrawnGear) -> list[str]:
    """Return half of the section through the axis in characters, from tip to bore, for the screen."""
    wide = max(ring.high for ring in gear.rings)
    step = 2.0 * wide / COLUMNS
    top, bottom = gear.rings[0].outer, gear.rings[-1].inner
    rows = min(max(math.ceil((top - bottom) / (2.0 * step)), LEAST_ROWS), MOST_ROWS)
    height = (top - bottom) / rows
    z = -wide + step * (np.arange(COLUMNS) + 0.5)
    lines = []
    for row in range(rows):
        radius = top - (row + 0.5) * height
        drawn = np.full(COLUMNS, " ")
        for ring in gear.rings:
            # Thin parts have a row and a column at least.
            if ring.inner - 0.5 * height < radius < ring.outer:
                low, high = ring.faces(radius)
                drawn[(z > low - 0.5 * step) & (z < high + 0.5 * step)] = "|" if ring.name == "teeth" else "#"
        if gear.holes is not None and abs(radius - gear.holes.on_radius_mm) < gear.holes.radius_mm:
            drawn[drawn == "#"] = "."
        lines.append("".join(drawn))
    places = list[int]()
    names = [(radius, text.replace("\n", " ")) for _, radius, text in sorted(_dimensions(gear), key=lambda d: -d[1])]
    for number, (radius, _) in enumerate(names):
        lowest = max(places[-1] + 1 if places else 0, int((top - radius) / height))
        places.append(min(lowest, rows - len(names) + number))
    for place, (_, text) in zip(places, names, strict=True):
        lines[place] += f"  {text}"
    return [line.rstrip() for line in lines]


def _front(axes: Panel, gear: DrawnGear, place: int, turned: float) -> None:
    """The gear as it stands at pinion angle 0, seen from +z."""
    # Tooth 0 of the pinion stands on the line of centres; of the wheel it is a tooth space, on the other side.
    to_mate = 0.5 * math.pi + place * math.pi
    first = to_mate + place * math.pi / gear.tooth.teeth
    outline = _tooth_outline(gear.tooth)
    angles = first + gear.tooth.angular_pitch * np.arange(gear.tooth.teeth) - 0.5 * math.pi
    around = np.concatenate([_turn(outline, angle) for angle in angles])
    axes.fill(*around.T, facecolor=FILL["teeth"], edgecolor=EDGE, lw=0.7)
    _, rim, web, hub = gear.rings
    for ring in (rim, web, hub):
        axes.fill(ring.outer * np.cos(CIRCLE), ring.outer * np.sin(CIRCLE), facecolor=FILL[ring.name], edgecolor=EDGE,
                  lw=0.7)  # fmt: skip
    white: dict[str, Any] = {"facecolor": "white", "edgecolor": EDGE, "lw": 0.7}
    axes.fill(hub.inner * np.cos(CIRCLE), hub.inner * np.sin(CIRCLE), **white)
    if (holes := gear.holes) is not None:
        for number in range(holes.count):
            angle = to_mate + turned * (math.radians(holes.first_deg) + 2.0 * math.pi * number / holes.count)
            x, y = holes.on_radius_mm * math.cos(angle), holes.on_radius_mm * math.sin(angle)
            axes.fill(*hole_outline(holes, angle).T, **white)
            if number == 0:
                axes.text(x, y, "1", ha="center")
    end = 1.12 * gear.rings[0].outer
    side = math.sin(to_mate)
    axes.arrows(np.zeros((1, 2)), np.array([[0.0, 1.1 * end * side]]), color=EDGE)
    axes.text(0.04 * end, 1.09 * end * side, "to its mate")
    axes.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]", title="Seen from +z, at pinion angle 0")
    axes.set(xlim=(-1.1 * end, 1.1 * end), ylim=(-1.15 * end, 1.15 * end))
    axes.set(grid=False)


def hole_outline(holes: HolesCase, angle: float) -> FloatArray:
    """Outline of a hole whose middle is at an angle: two half circles, and of a slot the arcs between them."""
    middle = len(CIRCLE) // 2
    cap = holes.on_radius_mm * np.array([1.0, 0.0]) + holes.radius_mm * np.stack(
        [np.cos(CIRCLE), np.sin(CIRCLE)], axis=-1
    )
    turn = 0.5 * math.radians(holes.length_deg)
    ends = _turn(cap[: middle + 1], angle + turn), _turn(cap[middle:], angle - turn)
    reach = [holes.on_radius_mm + side * holes.radius_mm for side in (-1.0, 1.0)]
    over = angle + np.linspace(turn, -turn, len(CIRCLE))
    inner, outer = (
        r * np.stack([np.cos(a), np.sin(a)], axis=-1) for r, a in zip(reach, (over, over[::-1]), strict=True)
    )
    return np.concatenate([ends[0], inner, ends[1], outer])


def _tooth_outline(tooth: Tooth) -> FloatArray:
    """Outline of tooth 0 from space to space, counter-clockwise, its middle on +y."""
    roll = np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, 12)
    # From the tip down the counter-clockwise flank; the other one is its image.
    left = np.concatenate([tooth.flank_section(roll)[::-1], tooth.root_section(np.linspace(0.0, 1.0, 12))])
    return np.concatenate([left[::-1] * [-1.0, 1.0], left])


def _turn(points: FloatArray, angle: float) -> FloatArray:
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(points @ np.array([[c, s], [-s, c]]))
