"""Marks of charts as SVG: lines, areas, markers, words, and coloured cells as small pictures."""

from __future__ import annotations

import base64
import math
import re
import struct
import zlib
from html import escape
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pmor.core.arrays import BoolArray, FloatArray
from pmor.report.chart import Field, Mark, Style, palette

# Width of a panel, sizes of words, px.
WIDTH, SIZE, SMALL = 420.0, 12.5, 11.5
# Of a line of words over their size, and least distance of words.
LINE, GAP = 1.25, 6.0
INK, FAINT, GRID, PAPER = "#000000", "#555555", "#dddddd", "#ffffff"
# Is never broken.
UNIT = re.compile(r"\[[^]]+\]|\d N m")
DASHES = {"--": "6 4", ":": "1.5 3", "-.": "7 3 1.5 3"}
# Points of a line beyond which each place shows only its extremes, and cells of a coloured field.
MOST_POINTS, CELLS = 900, (320, 240)


class Box(NamedTuple):
    """Room of a panel in px, and limits of its axes, of logarithmic ones as powers of ten."""

    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    y: tuple[float, float]
    logs: tuple[bool, bool]

    def px(self, x: FloatArray) -> FloatArray:
        """Places across."""
        return self.left + self.width * (scaled(x, self.logs[0]) - self.x[0]) / (self.x[1] - self.x[0])

    def py(self, y: FloatArray) -> FloatArray:
        """Places from above."""
        return self.top + self.height * (self.y[1] - scaled(y, self.logs[1])) / (self.y[1] - self.y[0])


def scaled(values: FloatArray, logarithmic: bool) -> FloatArray:
    """Return values, along logarithmic axes their powers of ten."""
    values = np.asarray(values, float)
    return np.log10(np.maximum(values, 1e-300)) if logarithmic else values


def width_of(words: str, size: float = SIZE) -> float:
    """Return about how wide words are, px; rather too wide."""
    return size * sum(0.32 if c in "ijltfI.,:;'|!()[] /" else 0.9 if c in "mwMW%@" else 0.58 for c in words)


def unbroken(words: str) -> str:
    """Return words whose units no line breaks."""
    return UNIT.sub(lambda unit: unit.group().replace(" ", "\u00a0"), words)


def wrapped(words: str, room: float, size: float = SIZE) -> list[str]:
    """Break words into lines that have room."""
    lines = list[str]()
    for part in unbroken(words).split("\n"):
        line = ""
        for word in part.split(" "):
            longer = f"{line} {word}" if line else word
            if line and width_of(longer, size) > room:
                lines.append(line)
                longer = word
            line = longer
        lines.append(line)
    return lines


def words_at(
    x: float, y: float, words: str, anchor: str = "middle", size: float = SIZE, colour: str = INK, turned: bool = False
) -> str:
    """Return words at a place; `turned` they rise."""
    at = f'transform="translate({x:.1f} {y:.1f}) rotate(-90)"' if turned else f'x="{x:.1f}" y="{y:.1f}"'
    return f'<text {at} text-anchor="{anchor}" font-size="{size:g}" fill="{colour}">{escape(words)}</text>'


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


def colour_of(style: Style, *names: str) -> str:
    """Return the first colour that a style says by these names."""
    for name in names or ("color",):
        value = style.get(name)
        if value is not None:
            return str({"black": INK, "white": PAPER, "k": INK}.get(value, value))
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


def mark_svg(mark: Mark, box: Box) -> str:
    """Return a mark within the axes."""
    style, arrays = mark.style, mark.arrays
    if mark.kind == "line":
        return line_svg(box.px(arrays[0]), box.py(arrays[1]), style)
    if mark.kind == "area":
        x, low, high = arrays
        known = np.isfinite(low) & np.isfinite(high)
        around = np.concatenate([x[known], x[known][::-1]]), np.concatenate([low[known], high[known][::-1]])
        fill = f'fill="{colour_of(style)}" fill-opacity="{style.get("alpha", 1.0):g}"'
        return f'<path d="{_course(box.px(around[0]), box.py(around[1]))}Z" {fill}/>' if known.any() else ""
    if mark.kind in ("polygon", "polygons"):
        outlines = [np.stack(arrays, axis=-1)] if mark.kind == "polygon" else list(arrays[0])
        path = "".join(f"{_course(box.px(one[:, 0]), box.py(one[:, 1]))}Z" for one in outlines)
        face = "none" if style.get("fill", True) is False else colour_of(style, "facecolor")
        opacity = f' fill-opacity="{style["alpha"]:g}"' if "alpha" in style else ""
        edge = _stroke(style | {"alpha": None}, colour_of(style, "edgecolor"), 0.8) if "edgecolor" in style else ""
        return f'<path d="{path}" fill="{face}"{opacity} {edge}/>'
    if mark.kind == "bars":
        return _bars(mark, box)
    if mark.kind == "segments":
        x, low, high = box.px(arrays[0]), box.py(arrays[1]), box.py(arrays[2])
        path = "".join(
            f"M{a:.1f} {b:.1f}V{c:.1f}" for a, b, c in zip(x, low, high, strict=True) if a + b + c == a + b + c
        )
        return f'<path d="{path}" fill="none" {_stroke(style, colour_of(style))}/>'
    if mark.kind == "v":
        return (
            f'<path d="M{box.px(arrays[0])[0]:.1f} {box.top:.1f}v{box.height:.1f}" {_stroke(style, colour_of(style))}/>'
        )
    if mark.kind == "h":
        return (
            f'<path d="M{box.left:.1f} {box.py(arrays[0])[0]:.1f}h{box.width:.1f}" {_stroke(style, colour_of(style))}/>'
        )
    if mark.kind == "arrows":
        ends = arrays[0] + arrays[1]
        pairs = zip(
            box.px(arrays[0][:, 0]), box.py(arrays[0][:, 1]), box.px(ends[:, 0]), box.py(ends[:, 1]), strict=True
        )
        return "".join(_arrow(*pair, colour_of(style)) for pair in pairs)
    return _image(style["field"], box)


def _bars(mark: Mark, box: Box) -> str:
    (x, height), style = mark.arrays, mark.style
    bottom, half = style["bottom"], 0.5 * style["width"]
    path = ""
    for place, value in zip(x.tolist(), height.tolist(), strict=True):
        if value != value:
            continue
        across, up = np.array([place - half, place + half]), np.array([bottom, bottom + value])
        a, b = (box.px(up), box.py(across)) if style["lying"] else (box.px(across), box.py(up))
        path += f"M{a[0]:.1f} {b[0]:.1f}H{a[1]:.1f}V{b[1]:.1f}H{a[0]:.1f}Z"
    return f'<path d="{path}" fill="{colour_of(style)}"/>'


def line_svg(x: FloatArray, y: FloatArray, style: Style) -> str:
    """Return a line through points in px, with its markers."""
    colour, parts = colour_of(style), list[str]()
    label = f"<title>{escape(str(style['label']).strip())}</title>" if style.get("label") else ""
    if style.get("ls", "-") not in ("", "none") and len(x) > 1:
        parts.append(
            f'<path d="{_course(x, y)}" fill="none" stroke-linejoin="round" {_stroke(style, colour)}>{label}</path>'
        )
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
    face = colour_of(style, "mfc", "color")
    edge = colour_of(style, "mec", "color")
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


def text_svg(mark: Mark, box: Box) -> str:
    """Return words at a point, or in a column beside the axes with a line to their point."""
    style = mark.style
    words, size, colour = str(style["words"]).split("\n"), style.get("size", SMALL), colour_of(style)
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
        return line + words_at(across, up, words[0], anchor, size, colour, turned=True)
    wide = max(width_of(word, size) for word in words)
    if style.get("column") is None and anchor == "start" and across + wide > WIDTH:
        across = WIDTH - wide
    if anchor == "middle" and not style.get("loose"):
        across = min(max(across, 0.5 * wide), WIDTH - 0.5 * wide) if wide < WIDTH else across
    return line + "".join(
        words_at(across, up + number * LINE * size, word, anchor, size, colour) for number, word in enumerate(words)
    )


def shares_of(field: Field, values: FloatArray) -> FloatArray:
    """Return where values are on the scale of colours, 0 to 1."""
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
    own = scaled(edges, log)
    return np.clip(np.searchsorted(own, at) - 1, 0, len(edges) - 2), (at >= own[0]) & (at <= own[-1])


def _image(field: Field, box: Box) -> str:
    """Coloured cells as a picture of few bytes over the whole axes."""
    across, in_x = _cells(field.x, box.x, box.logs[0], CELLS[0])
    up, in_y = _cells(field.y, box.y, box.logs[1], CELLS[1])
    values = field.values[np.ix_(up, across)][::-1]
    there = np.isfinite(values) & (in_y[::-1, None] & in_x)
    pixels = np.zeros(values.shape, np.uint8)
    pixels[there] = 2 + (253 * shares_of(field, values[there])).astype(np.uint8)
    if field.missing is not None:
        pixels[np.isnan(values)] = 1
    missing = [int((field.missing or "#000000")[place : place + 2], 16) for place in (1, 3, 5)]
    colours = np.concatenate([[[0, 0, 0], missing], palette(np.linspace(0.0, 1.0, 254))]).astype(np.uint8)
    data = base64.b64encode(_png(pixels, colours)).decode()
    return (
        f'<image x="{box.left:.1f}" y="{box.top:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" '
        f'preserveAspectRatio="none" href="data:image/png;base64,{data}"/>'
    )


def _png(pixels: NDArray[np.uint8], colours: NDArray[np.uint8]) -> bytes:
    """A PNG of a palette, whose first colour is clear."""
    height, width = pixels.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels], axis=1).tobytes()
    head = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    parts = (
        (b"IHDR", head),
        (b"PLTE", colours.tobytes()),
        (b"tRNS", b"\0"),
        (b"IDAT", zlib.compress(rows, 6)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in parts
    )
