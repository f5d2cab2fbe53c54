"""Charts as SVG: panels of the width of a telephone, so that words are as large there as beside text on a desk.

A page lays panels out side by side or below each other, as it has room. Colours are attributes, which a program for
drawings reads too; where dark is asked for, `DARK` replaces those that dark paper would swallow.
"""

from __future__ import annotations

import base64
import math
import struct
import zlib
from collections.abc import Sequence
from html import escape
from typing import Literal, NamedTuple

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.report.chart import Chart, Entry, Field, Mark, Panel, Style, palette

# Width of a panel, sizes of words, px.
WIDTH, SIZE, SMALL = 420.0, 12.5, 11.5
# Of a line of words over their size, and least distance of words.
LINE, GAP = 1.25, 6.0
INK, FAINT, GRID, PAPER = "#000000", "#555555", "#dddddd", "#ffffff"
#: colours on dark paper
DARK = {
    INK: "#e8edf2", FAINT: "#a9b4bf", GRID: "#38424c", PAPER: "#14191f", "#0072B2": "#4ba9e8", "#D55E00": "#f08a3c",
    "#009E73": "#2fc79a", "#332288": "#8f86e6", "#882255": "#d2649a", "#661100": "#d98068", "#bbbbbb": "#5d6873",
    "#999999": "#77828d", "#440154": "#a06bc0", "#33414d": "#b9c6d2", "#eef3f7": "#27313a", "#44525c": "#8d9aa6",
}  # fmt: skip
DASHES = {"--": "6 4", ":": "1.5 3", "-.": "7 3 1.5 3"}
# Heights over widths of the room of a panel.
LOW, HIGH, EQUAL = 0.5, 1.0, 1.25
# Points of a line beyond which each place shows only its extremes, and cells of a coloured field.
MOST_POINTS, CELLS = 900, (320, 240)
TICKS = 5
ROUND = 1e-9


class _Box(NamedTuple):
    """Room of a panel in px, and limits of its axes, of logarithmic ones as powers of ten."""

    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    y: tuple[float, float]
    logs: tuple[bool, bool]

    def px(self, x: FloatArray) -> FloatArray:
        return self.left + self.width * (_scaled(x, self.logs[0]) - self.x[0]) / (self.x[1] - self.x[0])

    def py(self, y: FloatArray) -> FloatArray:
        return self.top + self.height * (self.y[1] - _scaled(y, self.logs[1])) / (self.y[1] - self.y[0])


def _scaled(values: FloatArray, logarithmic: bool) -> FloatArray:
    values = np.asarray(values, float)
    return np.log10(np.maximum(values, 1e-300)) if logarithmic else values


def width_of(words: str, size: float = SIZE) -> float:
    """Return about how wide words are, px; rather too wide."""
    return size * sum(0.32 if c in "ijltfI.,:;'|!()[] /" else 0.9 if c in "mwMW%@" else 0.58 for c in words)


def wrapped(words: str, room: float, size: float = SIZE) -> list[str]:
    """Break words into lines that have room."""
    lines = list[str]()
    for part in words.split("\n"):
        line = ""
        for word in part.split(" "):
            longer = f"{line} {word}" if line else word
            if line and width_of(longer, size) > room:
                lines.append(line)
                longer = word
            line = longer
        lines.append(line)
    return lines


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
    return [f"{value + 0.0:.{digits}f}".replace("-0" + "." * bool(digits) + "0" * digits, "0") if not round(value, 9)
            else f"{value:.{digits}f}" for value in values]  # fmt: skip


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
        for inside, width, height in row:
            placed.append(f'<g transform="translate({x:.1f} {y:.1f})">{inside}</g>')
            x += width
        y, wide = y + max(height for _, _, height in row), max(wide, x)
    key = _key(chart)
    if key:
        placed.append(f'<g transform="translate({0.5 * (wide - WIDTH):.1f} {y:.1f})">{key[0]}</g>')
        y += key[2]
    style = f"<style>@media (prefers-color-scheme: dark) {{ svg {{ background: {DARK[PAPER]} }} {dark_rules()} }}</style>"
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


def _words(x: float, y: float, words: str, anchor: str = "middle", size: float = SIZE, colour: str = INK,
           turned: bool = False) -> str:  # fmt: skip
    at = f'transform="translate({x:.1f} {y:.1f}) rotate(-90)"' if turned else f'x="{x:.1f}" y="{y:.1f}"'
    return f'<text {at} text-anchor="{anchor}" font-size="{size:g}" fill="{colour}">{escape(words)}</text>'


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
    box = _Box(left, top, width, height, x, y, logs)
    parts = [*_axes(panel, box, marks_y, lines_y)]
    clip = f'<svg x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{height:.1f}" '
    clip += f'viewBox="{left:.1f} {top:.1f} {width:.1f} {height:.1f}">'
    inside = sorted((mark for mark in panel.marks if mark.kind != "text"), key=_order)
    parts += [clip, *(_mark(mark, box) for mark in inside), "</svg>"]
    parts += [_text(mark, box) for mark in panel.marks if mark.kind == "text"]
    for number, line in enumerate(title):
        at = LINE * SIZE * (number + 1) - 2.0
        parts.append(_words(max(0.5 * WIDTH, 0.0), at, line, colour=said.get("title_colour", INK)))
    middle = left + 0.5 * width
    if second:
        parts += _second(box, second, LINE * SIZE * len(title))
    for number, line in enumerate(label_y):
        parts.append(_words(LINE * SIZE * (number + 1) - 3.0, top + 0.5 * height, line, turned=True))
    bottom = top + height + LINE * SMALL + 4.0
    for line in wrapped(str(said["xlabel"]), WIDTH - 8.0) if said.get("xlabel") else []:
        bottom += LINE * SIZE
        half = 0.5 * width_of(line)
        parts.append(_words(min(max(middle, half), WIDTH - half) if 2 * half < WIDTH else 0.5 * WIDTH, bottom - 2.0, line))
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
    low, high = (10.0**limits[0], 10.0**limits[1]) if log else limits
    asked = said.get(f"{axis}ticks")
    values = [float(v) for v in asked] if asked is not None else log_ticks(low, high) if log else ticks(low, high)
    names = said.get(f"{axis}ticklabels")
    wanted = [f"{value:g}" for value in values] if log or asked is not None else numbers(values)
    wide = 1e-6 * (high - low)
    kept = [(value, name) for value, name in zip(values, names or wanted, strict=True)
            if low - wide <= value <= high + wide]  # fmt: skip
    return [value for value, _ in kept], [name for _, name in kept]


def _axes(panel: Panel, box: _Box, marks_y: list[float], lines_y: list[list[str]]) -> list[str]:
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
            parts.append(_words(min(x, WIDTH - half), below + LINE * SMALL + 1.0, name, size=SMALL))
            end = x + half
    for y, lines in zip(at_y, lines_y, strict=True):
        first = y - 0.5 * LINE * SMALL * (len(lines) - 1) + 0.35 * SMALL
        for number, line in enumerate(lines):
            parts.append(_words(box.left - GAP, first + number * LINE * SMALL, line, "end", SMALL))
    return parts


def _second(box: _Box, second: tuple[float, str], top: float) -> list[str]:
    """What x times a factor is, above."""
    factor, label = second
    marks = ticks(box.x[0] * factor, box.x[1] * factor)
    at = box.left + box.width * (np.array(marks) / factor - box.x[0]) / (box.x[1] - box.x[0])
    line = f"M{box.left:.1f} {box.top:.1f}h{box.width:.1f}" + "".join(f"M{x:.1f} {box.top:.1f}v-3" for x in at)
    parts = [f'<path d="{line}" stroke="{FAINT}" fill="none"/>']
    parts += [_words(min(x, WIDTH - 0.5 * width_of(name, SMALL)), box.top - GAP, name, size=SMALL)
              for x, name in zip(at, numbers(marks), strict=True)]  # fmt: skip
    return [*parts, _words(box.left + 0.5 * box.width, top + LINE * SIZE, label)]


def _overhang(mark: Mark) -> float:
    """Room that words need to the right of the axes, px."""
    if mark.kind != "text":
        return 0.0
    if mark.style.get("outside") or mark.style.get("column") is not None:
        lines = str(mark.style["words"]).split("\n")
        lead = 22.0 if mark.style.get("column") is not None else 4.0
        return lead + max(width_of(line, SMALL) for line in lines)
    return 0.0


def _stroke(style: Style, colour: str, usual: float = 1.6) -> str:
    dash = style.get("ls", "-")
    if isinstance(dash, tuple):
        dash = " ".join(f"{2 * part:g}" for part in dash[1])
    else:
        dash = DASHES.get(dash, "")
    width = style.get("lw") or usual
    text = f'stroke="{colour}" stroke-width="{width:g}"'
    if dash:
        text += f' stroke-dasharray="{dash}"'
    if style.get("alpha") is not None:
        text += f' stroke-opacity="{style["alpha"]:g}"'
    return text


def _colour(style: Style, *names: str) -> str:
    for name in names or ("color",):
        value = style.get(name)
        if value is not None:
            return {"black": INK, "white": PAPER, "k": INK}.get(value, value)
    return INK


def _course(x: FloatArray, y: FloatArray) -> str:
    """The path of a line through points in px, with gaps; of very many points each place keeps its extremes."""
    known = np.isfinite(x) & np.isfinite(y)
    if len(x) > MOST_POINTS and known.all() and (np.diff(x) >= 0.0).all():
        bins = np.array_split(np.arange(len(x)), MOST_POINTS // 2)
        kept = [np.sort([part[0] + np.argmin(y[part]), part[0] + np.argmax(y[part])]) for part in bins]
        places = np.unique(np.concatenate([[0], *kept, [len(x) - 1]]))
        x, y, known = x[places], y[places], known[places]
    path, pen = list[str](), "M"
    for here, across, up in zip(known, np.clip(x, -2e3, 4e3), np.clip(y, -2e3, 4e3), strict=True):
        if here:
            path.append(f"{pen}{across:.1f} {up:.1f}")
        pen = "L" if here else "M"
    return "".join(path)


def _mark(mark: Mark, box: _Box) -> str:
    """A mark within the axes."""
    style, arrays = mark.style, mark.arrays
    if mark.kind == "line":
        return _line(box.px(arrays[0]), box.py(arrays[1]), style)
    if mark.kind == "area":
        x, low, high = arrays
        known = np.isfinite(low) & np.isfinite(high)
        around = np.concatenate([x[known], x[known][::-1]]), np.concatenate([low[known], high[known][::-1]])
        fill = f'fill="{_colour(style)}" fill-opacity="{style.get("alpha", 1.0):g}"'
        return f'<path d="{_course(box.px(around[0]), box.py(around[1]))}Z" {fill}/>' if known.any() else ""
    if mark.kind in ("polygon", "polygons"):
        outlines = [np.stack(arrays, axis=-1)] if mark.kind == "polygon" else list(arrays[0])
        path = "".join(f"{_course(box.px(one[:, 0]), box.py(one[:, 1]))}Z" for one in outlines)
        face = "none" if style.get("fill", True) is False else _colour(style, "facecolor")
        opacity = f' fill-opacity="{style["alpha"]:g}"' if "alpha" in style else ""
        edge = _stroke(style | {"alpha": None}, _colour(style, "edgecolor"), 0.8) if "edgecolor" in style else ""
        return f'<path d="{path}" fill="{face}"{opacity} {edge}/>'
    if mark.kind == "bars":
        return _bars(mark, box)
    if mark.kind == "segments":
        x, low, high = box.px(arrays[0]), box.py(arrays[1]), box.py(arrays[2])
        path = "".join(f"M{a:.1f} {b:.1f}V{c:.1f}" for a, b, c in zip(x, low, high, strict=True) if a + b + c == a + b + c)
        return f'<path d="{path}" fill="none" {_stroke(style, _colour(style))}/>'
    if mark.kind == "v":
        return f'<path d="M{box.px(arrays[0])[0]:.1f} {box.top:.1f}v{box.height:.1f}" {_stroke(style, _colour(style))}/>'
    if mark.kind == "h":
        return f'<path d="M{box.left:.1f} {box.py(arrays[0])[0]:.1f}h{box.width:.1f}" {_stroke(style, _colour(style))}/>'
    if mark.kind == "arrows":
        ends = arrays[0] + arrays[1]
        pairs = zip(box.px(arrays[0][:, 0]), box.py(arrays[0][:, 1]), box.px(ends[:, 0]), box.py(ends[:, 1]), strict=True)
        return "".join(_arrow(*pair, _colour(style)) for pair in pairs)
    return _image(style["field"], box)


def _bars(mark: Mark, box: _Box) -> str:
    (x, height), style = mark.arrays, mark.style
    bottom, half = style["bottom"], 0.5 * style["width"]
    path = ""
    for place, value in zip(x.tolist(), height.tolist(), strict=True):
        if value != value:
            continue
        across, up = np.array([place - half, place + half]), np.array([bottom, bottom + value])
        a, b = (box.px(up), box.py(across)) if style["lying"] else (box.px(across), box.py(up))
        path += f"M{a[0]:.1f} {b[0]:.1f}H{a[1]:.1f}V{b[1]:.1f}H{a[0]:.1f}Z"
    return f'<path d="{path}" fill="{_colour(style)}"/>'


def _line(x: FloatArray, y: FloatArray, style: Style) -> str:
    colour, parts = _colour(style), list[str]()
    label = f"<title>{escape(str(style['label']).strip())}</title>" if style.get("label") else ""
    if style.get("ls", "-") not in ("", "none") and len(x) > 1:
        parts.append(f'<path d="{_course(x, y)}" fill="none" stroke-linejoin="round" {_stroke(style, colour)}>{label}</path>')
    if style.get("marker"):
        known = np.isfinite(x) & np.isfinite(y)
        parts.append(_markers(x[known], y[known], style))
    return "".join(parts)


def _markers(x: FloatArray, y: FloatArray, style: Style) -> str:
    """Markers about points; `ms` is their width."""
    shape, size = style["marker"], float(style.get("ms", 5.0))
    r = 0.5 * size * (0.5 if shape == "." else 1.0)
    outline = {
        "s": f"m{-r:.1f} {-r:.1f}h{2 * r:.1f}v{2 * r:.1f}h{-2 * r:.1f}z",
        "^": f"m0 {-r:.1f}l{r:.1f} {2 * r:.1f}h{-2 * r:.1f}z",
        "v": f"m0 {r:.1f}l{r:.1f} {-2 * r:.1f}h{-2 * r:.1f}z",
        "D": f"m0 {-r:.1f}l{r:.1f} {r:.1f}l{-r:.1f} {r:.1f}l{-r:.1f} {-r:.1f}z",
        "*": "m" + "l".join(f"{a:.1f} {b:.1f}" for a, b in _star(r)) + "z",
    }.get(shape, f"m{-r:.1f} 0a{r:.1f} {r:.1f} 0 1 0 {2 * r:.1f} 0a{r:.1f} {r:.1f} 0 1 0 {-2 * r:.1f} 0z")
    path = "".join(f"M{a:.1f} {b:.1f}{outline}" for a, b in zip(x, y, strict=True))
    face = _colour(style, "mfc", "color")
    edge = _colour(style, "mec", "color")
    return f'<path d="{path}" fill="{face}" stroke="{edge}" stroke-width="{style.get("mew", 1.0):g}"/>'


def _star(r: float) -> list[tuple[float, float]]:
    """Steps from the middle to the first corner of a star, and from corner to corner."""
    angle = 0.5 * np.pi + np.pi / 5.0 * np.arange(10)
    radius = np.where(np.arange(10) % 2, 0.45 * r, r)
    corners = np.stack([radius * np.cos(angle), -radius * np.sin(angle)], axis=-1)
    return [(float(a), float(b)) for a, b in [corners[0], *np.diff(corners, axis=0)]]


def _arrow(x0: float, y0: float, x1: float, y1: float, colour: str) -> str:
    length = math.hypot(x1 - x0, y1 - y0)
    if length < 1.0:
        return ""
    a, b = (x1 - x0) / length, (y1 - y0) / length
    head, half = min(7.0, 0.5 * length), 3.0
    base = x1 - head * a, y1 - head * b
    return (
        f'<path d="M{x0:.1f} {y0:.1f}L{base[0]:.1f} {base[1]:.1f}" stroke="{colour}" stroke-width="1.6"/>'
        f'<path d="M{x1:.1f} {y1:.1f}L{base[0] - half * b:.1f} {base[1] + half * a:.1f}'
        f'L{base[0] + half * b:.1f} {base[1] - half * a:.1f}Z" fill="{colour}"/>'
    )


def _text(mark: Mark, box: _Box) -> str:
    """Words at a point, or in a column beside the axes with a line to their point."""
    style = mark.style
    words, size, colour = str(style["words"]).split("\n"), style.get("size", SMALL), _colour(style)
    x, y = float(mark.arrays[0][0]), float(mark.arrays[1][0])
    if style.get("inside"):
        across, up = box.left + x * box.width, box.top + (1.0 - y) * box.height
    else:
        across, up = float(box.px(np.array([x]))[0]), float(box.py(np.array([y]))[0])
    line, anchor = "", {"left": "start", "right": "end"}.get(style.get("ha", "left"), "middle")
    if (height := style.get("column")) is not None:
        to = box.left + box.width + 18.0, box.top + (1.0 - height) * box.height
        line = f'<path d="M{across:.1f} {up:.1f}L{to[0]:.1f} {to[1]:.1f}" stroke="#999999" stroke-width="0.7"/>'
        across, up = to[0] + 3.0, to[1]
    across += {"start": 2.0, "end": -2.0}.get(anchor, 0.0) + style.get("dx", 0.0)
    up += {"bottom": -3.0, "top": size}.get(style.get("va", "center"), 0.35 * size)
    up -= 0.5 * LINE * size * (len(words) - 1) * (style.get("va", "center") == "center")
    if style.get("turned"):
        return line + _words(across, up, words[0], anchor, size, colour, turned=True)
    wide = max(width_of(word, size) for word in words)
    if style.get("column") is None and anchor == "start" and across + wide > WIDTH:
        across = WIDTH - wide
    if anchor == "middle" and not style.get("loose"):
        across = min(max(across, 0.5 * wide), WIDTH - 0.5 * wide) if wide < WIDTH else across
    return line + "".join(
        _words(across, up + number * LINE * size, word, anchor, size, colour) for number, word in enumerate(words)
    )


def _frameless(panel: Panel) -> tuple[str, float, float]:
    """A drawing without axes."""
    x, y = panel.limits("x"), panel.limits("y")
    title = wrapped(str(panel.said.get("title", "")), WIDTH - 10.0) if panel.said.get("title") else []
    top, width = LINE * SIZE * len(title) + GAP, WIDTH
    height = width * (y[1] - y[0]) / (x[1] - x[0])
    if height > EQUAL * WIDTH:
        width, height = width * EQUAL * WIDTH / height, EQUAL * WIDTH
    box = _Box(0.5 * (WIDTH - width), top, width, height, x, y, (False, False))
    parts = [_words(0.5 * WIDTH, LINE * SIZE * (n + 1) - 2.0, line) for n, line in enumerate(title)]
    parts += [_text(mark, box) if mark.kind == "text" else _mark(mark, box) for mark in sorted(panel.marks, key=_order)]
    return "".join(parts), WIDTH, top + height + GAP


def _shares(field: Field, values: FloatArray) -> FloatArray:
    """Where values are on the scale of colours, 0 to 1."""
    if field.logarithmic:
        values = np.log(np.maximum(values, 1e-300) / field.low) / math.log(field.high / field.low)
    else:
        values = (values - field.low) / ((field.high - field.low) or 1.0)
    shares = np.clip(values, 0.0, 1.0)
    if field.steps:
        shares = np.minimum(np.floor(shares * field.steps), field.steps - 1) / max(field.steps - 1, 1)
    return shares


def _cells(edges: FloatArray, limits: tuple[float, float], log: bool, most: int) -> tuple[FloatArray, BoolArray]:
    """Which cell each point of an even grid between limits is in, and whether it is in one."""
    count = min(most, max(2, 4 * len(edges)))
    at = limits[0] + (limits[1] - limits[0]) * (np.arange(count) + 0.5) / count
    own = _scaled(edges, log)
    return np.clip(np.searchsorted(own, at) - 1, 0, len(edges) - 2), (at >= own[0]) & (at <= own[-1])


def _image(field: Field, box: _Box) -> str:
    """Coloured cells as a picture of few bytes over the whole axes."""
    across, in_x = _cells(field.x, box.x, box.logs[0], CELLS[0])
    up, in_y = _cells(field.y, box.y, box.logs[1], CELLS[1])
    values = field.values[np.ix_(up, across)][::-1]
    there = np.isfinite(values) & (in_y[::-1, None] & in_x)
    pixels = np.zeros(values.shape, np.uint8)
    pixels[there] = 2 + (253 * _shares(field, values[there])).astype(np.uint8)
    if field.missing is not None:
        pixels[np.isnan(values)] = 1
    missing = [int((field.missing or "#000000")[place : place + 2], 16) for place in (1, 3, 5)]
    colours = np.concatenate([[[0, 0, 0], missing], palette(np.linspace(0.0, 1.0, 254))]).astype(np.uint8)
    data = base64.b64encode(_png(pixels, colours)).decode()
    return (
        f'<image x="{box.left:.1f}" y="{box.top:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" '
        f'preserveAspectRatio="none" href="data:image/png;base64,{data}"/>'
    )


def _png(pixels: FloatArray, colours: FloatArray) -> bytes:
    """A PNG of a palette, whose first colour is clear."""
    height, width = pixels.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels], axis=1).tobytes()
    head = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    parts = (b"IHDR", head), (b"PLTE", colours.tobytes()), (b"tRNS", b"\0"), (b"IDAT", zlib.compress(rows, 6)), (b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in parts
    )


def _scale(field: Field, top: float) -> tuple[str, float]:
    """The scale of the colours below a panel, and its height."""
    left, wide, high = 40.0, WIDTH - 80.0, 11.0
    count = field.steps or 32
    shares = np.linspace(0.0, 1.0, count)
    parts = [
        f'<rect x="{left + wide * n / count:.1f}" y="{top:.1f}" width="{wide / count + 0.4:.1f}" height="{high}" '
        f'fill="#{"".join(f"{int(v):02x}" for v in colour)}"/>'
        for n, colour in enumerate(palette(shares))
    ]
    values = log_ticks(field.low, field.high) if field.logarithmic else ticks(field.low, field.high)
    names = [f"{value:g}" for value in values] if field.logarithmic else numbers(values)
    if field.beyond:
        x = left + wide
        parts.append(f'<path d="M{x:.1f} {top:.1f}l{high} {0.5 * high}l{-high} {0.5 * high}z" fill="#fde725"/>')
    for value, name in zip(values, names, strict=True):
        share = (math.log(value / field.low) / math.log(field.high / field.low) if field.logarithmic
                 else (value - field.low) / (field.high - field.low))  # fmt: skip
        parts.append(_words(left + wide * share, top + high + LINE * SMALL - 1.0, name, size=SMALL))
    below = top + high + LINE * (SMALL + SIZE)
    parts.append(_words(0.5 * WIDTH, below, field.label))
    return "".join(parts), high + LINE * (SMALL + SIZE) + 4.0


def _key(chart: Chart) -> tuple[str, float, float] | None:
    """The key as rows of samples and words, its title before them, with width and height."""
    entries = chart.entries()
    if not entries:
        return None
    parts, x, y = list[str](), 0.0, LINE * SIZE
    if chart.key_title:
        for line in chart.key_title.split("\n"):
            parts.append(_words(0.0, y - 3.0, line, "start", SIZE, FAINT))
            y += LINE * SIZE
    for entry in entries:
        lines = wrapped(entry.words.strip(), WIDTH - 40.0)
        wide = 34.0 + max(width_of(line) for line in lines) + 14.0
        if x > 0.0 and x + wide > WIDTH + 14.0:
            x, y = 0.0, y + LINE * SIZE + 2.0
        parts.append(_sample(entry, x, y - 0.35 * SIZE - 3.0))
        for number, line in enumerate(lines):
            parts.append(_words(x + 30.0, y - 3.0 + number * LINE * SIZE, line, "start"))
        y, x = y + LINE * SIZE * (len(lines) - 1), x + wide
    return "".join(parts), WIDTH, y + 4.0


def _sample(entry: Entry, x: float, y: float) -> str:
    """What a row of the key is of."""
    mark = entry.mark
    style = {name: value for name, value in mark.style.items() if name != "label"}
    if mark.kind in ("bars", "area", "polygon"):
        return f'<rect x="{x + 4:.1f}" y="{y - 5:.1f}" width="16" height="10" fill="{_colour(style, "facecolor", "color")}"/>'
    ends, middle = np.array([x, x + 24.0]), np.array([x + 12.0])
    line = _line(ends, np.full(2, y), style | {"marker": ""})
    return line + (_line(middle, np.full(1, y), style) if style.get("marker") else "")
