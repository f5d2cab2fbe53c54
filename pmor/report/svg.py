"""Charts as SVG: panels of the width of a telephone, so that words are as large there as beside text on a desk.

A page lays panels out side by side or below each other, as it has room. Colours are attributes, which a program for
drawings reads too; where dark is asked for, `DARK` replaces those that dark paper would swallow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from pmor.report.chart import Chart, Entry, Field, Mark, Panel, Style, palette
from pmor.report.svg_marks import (
    FAINT,
    GAP,
    GRID,
    INK,
    LINE,
    PAPER,
    SIZE,
    SMALL,
    WIDTH,
    Box,
    colour_of,
    line_svg,
    mark_svg,
    text_svg,
    width_of,
    words_at,
    wrapped,
)

#: colours on dark paper
DARK = {
    INK: "#e8edf2",
    FAINT: "#a9b4bf",
    GRID: "#38424c",
    PAPER: "#14191f",
    "#0072B2": "#4ba9e8",
    "#D55E00": "#f08a3c",
    "#009E73": "#2fc79a",
    "#332288": "#8f86e6",
    "#882255": "#d2649a",
    "#661100": "#d98068",
    "#bbbbbb": "#5d6873",
    "#999999": "#77828d",
    "#440154": "#a06bc0",
    "#33414d": "#b9c6d2",
    "#eef3f7": "#27313a",
    "#44525c": "#8d9aa6",
}
# Heights over widths of the room of a panel.
LOW, HIGH, EQUAL = 0.5, 1.0, 1.25
TICKS = 5
ROUND = 1e-9


def ticks(low: float, high: float, most: int = TICKS) -> list[float]:
    """Return round numbers between limits."""
    if not (math.isfinite(low) and math.isfinite(high) and high > low):
        return [low] if math.isfinite(low) else []
    raw = (high - low) / most
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(power * digit for digit in (1.0, 2.0, 2.5, 5.0, 10.0) if power * digit >= raw * (1.0 - ROUND))
    first = math.ceil(low / step - ROUND)
    return [step * n for n in range(first, math.floor(high / step + ROUND) + 1)]


def log_ticks(low: float, high: float) -> list[float]:
    """Return powers of ten between limits, within two decades their 2 and 5 too, as few as have room."""
    digits = (1, 2, 5) if high < 100.0 * low else (1,)
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    found = [digit * 10.0**power for power in powers for digit in digits]
    found = [value for value in found if low * (1.0 - ROUND) <= value <= high * (1.0 + ROUND)]
    return found[:: max(1, math.ceil(len(found) / (TICKS + 2)))]


def numbers(values: Sequence[float]) -> list[str]:
    """Return numbers of an axis with as many decimals as tell them apart."""
    top, step = max(map(abs, values), default=0.0), min(np.diff(values), default=1.0)
    if not values or top >= 1e6 or 0.0 < top < 1e-4:
        return [f"{value:g}" for value in values]
    digits = max(0, -math.floor(math.log10(step) + ROUND)) if step > 0.0 else 0
    digits += bool(step > 0.0 and abs(round(step * 10**digits) - step * 10**digits) > 1e-6)
    return [
        f"{value + 0.0:.{digits}f}".replace("-0" + "." * bool(digits) + "0" * digits, "0")
        if not round(value, 9)
        else f"{value:.{digits}f}"
        for value in values
    ]


def chart_svgs(chart: Chart) -> list[str]:
    """Return a chart as elements to be laid out one after the other: its panels, then its key."""
    rows = max(1, len(chart.panels) // chart.columns)
    ratio = (chart.size_in[1] / rows) / (chart.size_in[0] / chart.columns)
    drawn = [_svg(*_panel(panel, ratio)) for panel in chart.panels if panel.shown]
    key = _key(chart)
    return [*drawn, *([_svg(*key)] if key else [])]


def chart_file(chart: Chart) -> bytes:
    """Return a chart as a file of its own, panels in its columns."""
    rows = max(1, len(chart.panels) // chart.columns)
    ratio = (chart.size_in[1] / rows) / (chart.size_in[0] / chart.columns)
    shown = [_panel(panel, ratio) for panel in chart.panels if panel.shown]
    columns = min(chart.columns, len(shown)) or 1
    placed, y, wide = list[str](), 0.0, WIDTH
    for row in (shown[n : n + columns] for n in range(0, len(shown), columns)):
        x = 0.0
        for inside, width, _ in row:
            placed.append(f'<g transform="translate({x:.1f} {y:.1f})">{inside}</g>')
            x += width
        y, wide = y + max(height for _, _, height in row), max(wide, x)
    key = _key(chart)
    if key:
        placed.append(f'<g transform="translate({0.5 * (wide - WIDTH):.1f} {y:.1f})">{key[0]}</g>')
        y += key[2]
    style = (
        f"<style>@media (prefers-color-scheme: dark) {{ svg {{ background: {DARK[PAPER]} }} {dark_rules()} }}</style>"
    )
    font = 'font-family="Helvetica, Arial, sans-serif"'
    text = (
        f'<?xml version="1.0" encoding="utf-8"?>\n<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.0f}" '
        f'height="{y:.0f}" viewBox="0 0 {wide:.0f} {y:.0f}" {font}>{style}{"".join(placed)}</svg>\n'
    )
    return text.encode()


def dark_rules() -> str:
    """Return rules that replace colours on dark paper."""
    return "".join(
        f'[stroke="{light}"] {{ stroke: {dark} }} [fill="{light}"] {{ fill: {dark} }} ' for light, dark in DARK.items()
    )


def _svg(inside: str, width: float, height: float) -> str:
    return f'<svg viewBox="0 0 {width:.0f} {height:.0f}" role="img">{inside}</svg>'


def _panel(panel: Panel, ratio: float) -> tuple[str, float, float]:
    """A panel as SVG, with its width and height."""
    said = panel.said
    if said.get("frame", True) is False:
        return _frameless(panel)
    logs = (said.get("xscale") == "log", said.get("yscale") == "log")
    x, y = (_limits(panel, axis, log) for axis, log in zip("xy", logs, strict=True))  # type: ignore[arg-type]
    field = next((mark.style["field"] for mark in panel.marks if mark.kind == "field"), None)
    marks_y, names_y = _ticks(said, "y", y, logs[1])
    room = 0.42 * WIDTH if "yticklabels" in said else WIDTH
    lines_y = [wrapped(name, room, SMALL) for name in names_y]
    beside = max((width_of(line, SMALL) for lines in lines_y for line in lines), default=0.0) + GAP
    right = GAP + max((_overhang(mark) for mark in panel.marks), default=0.0)
    height_guess = min(max(ratio, LOW), HIGH) * (WIDTH - 70.0)
    label_y = wrapped(str(said.get("ylabel", "")), height_guess, SIZE) if said.get("ylabel") else []
    left = beside + LINE * SIZE * len(label_y) + GAP
    width = WIDTH - left - right - 2.0
    height = height_guess
    if said.get("aspect") == "equal":
        wanted = width * (y[1] - y[0]) / (x[1] - x[0])
        height = min(wanted, EQUAL * width)
        width *= height / wanted
    if "row_px" in said:
        height = said["row_px"] * len(marks_y)
    title = wrapped(str(said.get("title", "")), WIDTH - 20.0) if said.get("title") else []
    second = said.get("second_x")
    top = LINE * SIZE * len(title) + GAP + (LINE * (SIZE + SMALL) + GAP if second else 0.0)
    box = Box(left, top, width, height, x, y, logs)
    parts = [*_axes(panel, box, marks_y, lines_y)]
    clip = f'<svg x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{height:.1f}" '
    clip += f'viewBox="{left:.1f} {top:.1f} {width:.1f} {height:.1f}">'
    inside = sorted((mark for mark in panel.marks if mark.kind != "text"), key=_order)
    parts += [clip, *(mark_svg(mark, box) for mark in inside), "</svg>"]
    parts += [text_svg(mark, box) for mark in panel.marks if mark.kind == "text"]
    for number, line in enumerate(title):
        at = LINE * SIZE * (number + 1) - 2.0
        parts.append(words_at(max(0.5 * WIDTH, 0.0), at, line, colour=said.get("title_colour", INK)))
    middle = left + 0.5 * width
    if second:
        parts += _second(box, second, LINE * SIZE * len(title))
    for number, line in enumerate(label_y):
        parts.append(words_at(LINE * SIZE * (number + 1) - 3.0, top + 0.5 * height, line, turned=True))
    bottom = top + height + LINE * SMALL + 4.0
    for line in wrapped(str(said["xlabel"]), WIDTH - 8.0) if said.get("xlabel") else []:
        bottom += LINE * SIZE
        half = 0.5 * width_of(line)
        at = min(max(middle, half), WIDTH - half) if 2 * half < WIDTH else 0.5 * WIDTH
        parts.append(words_at(at, bottom - 2.0, line))
    if field is not None:
        scale, high = _scale(field, bottom + GAP)
        parts.append(scale)
        bottom += GAP + high
    return "".join(parts), WIDTH, bottom + GAP


def _order(mark: Mark) -> float:
    behind = {"field": 0.0, "area": 1.0, "polygon": 1.0, "polygons": 1.0, "bars": 1.0}
    return float(mark.style.get("zorder", behind.get(mark.kind, 2.0)))


def _limits(panel: Panel, axis: Literal["x", "y"], logarithmic: bool) -> tuple[float, float]:
    low, high = panel.limits(axis)
    if logarithmic:
        low, high = math.log10(max(low, 1e-300)), math.log10(max(high, 1e-300))
    if not high > low:
        low, high = low - 0.5, low + 0.5
    return low, high


def _ticks(said: Style, axis: str, limits: tuple[float, float], log: bool) -> tuple[list[float], list[str]]:
    """Places of ticks that are within limits, and their words."""
    low, high = (10.0 ** limits[0], 10.0 ** limits[1]) if log else limits
    asked = said.get(f"{axis}ticks")
    values = [float(v) for v in asked] if asked is not None else log_ticks(low, high) if log else ticks(low, high)
    names = said.get(f"{axis}ticklabels")
    wanted = [f"{value:g}" for value in values] if log or asked is not None else numbers(values)
    wide = 1e-6 * (high - low)
    kept = [
        (value, name) for value, name in zip(values, names or wanted, strict=True) if low - wide <= value <= high + wide
    ]
    return [value for value, _ in kept], [name for _, name in kept]


def _axes(panel: Panel, box: Box, marks_y: list[float], lines_y: list[list[str]]) -> list[str]:
    """Grid, frame, ticks."""
    said, parts = panel.said, list[str]()
    marks_x, names_x = _ticks(said, "x", box.x, box.logs[0])
    below = box.top + box.height
    at_x, at_y = box.px(np.array(marks_x)), box.py(np.array(marks_y))
    if said.get("grid", True):
        grid = "".join(f"M{box.left:.1f} {y:.1f}h{box.width:.1f}" for y in at_y)
        if not said.get("rows_only"):
            grid += "".join(f"M{x:.1f} {box.top:.1f}v{box.height:.1f}" for x in at_x)
        parts.append(f'<path d="{grid}" stroke="{GRID}" stroke-width="0.8" fill="none"/>')
    frame = f"M{box.left:.1f} {box.top:.1f}V{below:.1f}H{box.left + box.width:.1f}"
    frame += "".join(f"M{x:.1f} {below:.1f}v3" for x in at_x)
    parts.append(f'<path d="{frame}" stroke="{FAINT}" fill="none"/>')
    end = -math.inf
    for x, name in zip(at_x, names_x, strict=True):
        half = 0.5 * width_of(name, SMALL)
        if x - half > end + 2.0:
            parts.append(words_at(min(x, WIDTH - half), below + LINE * SMALL + 1.0, name, size=SMALL))
            end = x + half
    for y, lines in zip(at_y, lines_y, strict=True):
        first = y - 0.5 * LINE * SMALL * (len(lines) - 1) + 0.35 * SMALL
        for number, line in enumerate(lines):
            parts.append(words_at(box.left - GAP, first + number * LINE * SMALL, line, "end", SMALL))
    return parts


def _second(box: Box, second: tuple[float, str], top: float) -> list[str]:
    """What x times a factor is, above."""
    factor, label = second
    marks = ticks(box.x[0] * factor, box.x[1] * factor)
    at = box.left + box.width * (np.array(marks) / factor - box.x[0]) / (box.x[1] - box.x[0])
    line = f"M{box.left:.1f} {box.top:.1f}h{box.width:.1f}" + "".join(f"M{x:.1f} {box.top:.1f}v-3" for x in at)
    parts = [f'<path d="{line}" stroke="{FAINT}" fill="none"/>']
    parts += [
        words_at(min(x, WIDTH - 0.5 * width_of(name, SMALL)), box.top - GAP, name, size=SMALL)
        for x, name in zip(at, numbers(marks), strict=True)
    ]
    return [*parts, words_at(box.left + 0.5 * box.width, top + LINE * SIZE, label)]


def _overhang(mark: Mark) -> float:
    """Room that words need to the right of the axes, px."""
    if mark.kind != "text":
        return 0.0
    if mark.style.get("outside") or mark.style.get("column") is not None:
        lines = str(mark.style["words"]).split("\n")
        lead = 22.0 if mark.style.get("column") is not None else 4.0
        return lead + max(width_of(line, SMALL) for line in lines)
    return 0.0


def _frameless(panel: Panel) -> tuple[str, float, float]:
    """A drawing without axes."""
    x, y = panel.limits("x"), panel.limits("y")
    title = wrapped(str(panel.said.get("title", "")), WIDTH - 10.0) if panel.said.get("title") else []
    top, width = LINE * SIZE * len(title) + GAP, WIDTH
    height = width * (y[1] - y[0]) / (x[1] - x[0])
    if height > EQUAL * WIDTH:
        width, height = width * EQUAL * WIDTH / height, EQUAL * WIDTH
    box = Box(0.5 * (WIDTH - width), top, width, height, x, y, (False, False))
    parts = [words_at(0.5 * WIDTH, LINE * SIZE * (n + 1) - 2.0, line) for n, line in enumerate(title)]
    parts += [
        text_svg(mark, box) if mark.kind == "text" else mark_svg(mark, box) for mark in sorted(panel.marks, key=_order)
    ]
    return "".join(parts), WIDTH, top + height + GAP


def _scale(field: Field, top: float) -> tuple[str, float]:
    """The scale of the colours below a panel, and its height."""
    left, wide, high = 40.0, WIDTH - 80.0, 11.0
    count = field.steps or 32
    shares = np.linspace(0.0, 1.0, count)
    parts = [
        f'<rect x="{left + wide * n / count:.1f}" y="{top:.1f}" width="{wide / count + 0.4:.1f}" height="{high}" '
        f'fill="rgb({",".join(str(int(v)) for v in colour)})"/>'
        for n, colour in enumerate(palette(shares))
    ]
    values = log_ticks(field.low, field.high) if field.logarithmic else ticks(field.low, field.high)
    names = [f"{value:g}" for value in values] if field.logarithmic else numbers(values)
    if field.beyond:
        x = left + wide
        parts.append(f'<path d="M{x:.1f} {top:.1f}l{high} {0.5 * high}l{-high} {0.5 * high}z" fill="#fde725"/>')
    for value, name in zip(values, names, strict=True):
        share = (
            math.log(value / field.low) / math.log(field.high / field.low)
            if field.logarithmic
            else (value - field.low) / (field.high - field.low)
        )
        parts.append(words_at(left + wide * share, top + high + LINE * SMALL - 1.0, name, size=SMALL))
    below = top + high + LINE * (SMALL + SIZE)
    parts.append(words_at(0.5 * WIDTH, below, field.label))
    return "".join(parts), high + LINE * (SMALL + SIZE) + 4.0


def _key(chart: Chart) -> tuple[str, float, float] | None:
    """The key as rows of samples and words, its title before them, with width and height."""
    entries = chart.entries()
    if not entries:
        return None
    parts, x, y = list[str](), 0.0, LINE * SIZE
    if chart.key_title:
        for line in chart.key_title.split("\n"):
            parts.append(words_at(0.0, y - 3.0, line, "start", SIZE, FAINT))
            y += LINE * SIZE
    for entry in entries:
        lines = wrapped(entry.words.strip(), WIDTH - 40.0)
        wide = 34.0 + max(width_of(line) for line in lines) + 14.0
        if x > 0.0 and x + wide > WIDTH + 14.0:
            x, y = 0.0, y + LINE * SIZE + 2.0
        parts.append(_sample(entry, x, y - 0.35 * SIZE - 3.0))
        for number, line in enumerate(lines):
            parts.append(words_at(x + 30.0, y - 3.0 + number * LINE * SIZE, line, "start"))
        y, x = y + LINE * SIZE * (len(lines) - 1), x + wide
    return "".join(parts), WIDTH, y + 4.0


def _sample(entry: Entry, x: float, y: float) -> str:
    """What a row of the key is of."""
    mark = entry.mark
    style = {name: value for name, value in mark.style.items() if name != "label"}
    if mark.kind in ("bars", "area", "polygon", "polygons"):
        colour = colour_of(style, "facecolor", "color")
        return f'<rect x="{x + 4:.1f}" y="{y - 5:.1f}" width="16" height="10" fill="{colour}"/>'
    ends, middle = np.array([x, x + 24.0]), np.array([x + 12.0])
    line = line_svg(ends, np.full(2, y), style | {"marker": ""})
    return line + (line_svg(middle, np.full(1, y), style) if style.get("marker") else "")
