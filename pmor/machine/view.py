"""The deflected machine in space: faces of all bodies, drawn from the farthest to the nearest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pmor.body.beam import NODE
from pmor.core.arrays import BoolArray, FloatArray
from pmor.machine.bodies import Body, Detail, bodies
from pmor.machine.coupled import SolvedLoad
from pmor.machine.figures import exaggeration, size_of
from pmor.machine.loaded import LoadedGearbox
from pmor.machine.model import GearboxModel
from pmor.report.chart import COLOURS
from pmor.report.style import MIDDLE, new_figure, plot_style, see_through

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

COARSE = Detail(circle=36, profile=3, fillet=1, planes=4)
# Of the viewer, along x, upwards and towards him; of the light, to the right, upwards and towards him.
EYE, LIGHT = np.array([-0.45, 0.45, 0.8]), np.array([-0.35, 0.5, 0.8])
# Light in the shadow, and lengths of the axes in the corner over the height of the picture.
AMBIENT, CORNER = 0.45, 0.08
# Steps of the scale and of the light: a picture's palette holds no more of both together.
STEPS, LIGHTS = 15, 12
BEARING, INK = (0.80, 0.81, 0.83, 1.0), "#22282e"
# Of the picture, and of the scale beside it.
HEIGHT_IN, BESIDE_IN, WIDTHS_IN = 6.0, 1.2, (5.5, 9.0)


class _Faces(NamedTuple):
    """Faces that look at the viewer: corners (m, 4, 3), and over each its share of light and its displacement, mm."""

    corners: FloatArray
    light: FloatArray
    moved: FloatArray


class Drawing(NamedTuple):
    """Moved bodies as seen: faces, which of them are bearings', camera, axes of shafts as they move and at rest."""

    faces: _Faces
    bearing: BoolArray
    camera: FloatArray
    shafts: tuple[list[FloatArray], list[FloatArray]]

    @property
    def largest(self) -> float:
        """Largest displacement of what is no bearing, mm."""
        return float(self.faces.moved[~self.bearing].max())


def machine_figure(model: GearboxModel, solved: SolvedLoad) -> Figure:
    """The deflected machine, exaggerated, coloured by how far each place moves; shafts and bearings at rest in outline.

    Without the rotations about the axes, which grow along a shaft and are none of its bending.
    """
    moved = solved.equilibrium.displacement
    factor = exaggeration(size_of(model), moved.reshape(-1, NODE)[:, :3])
    drawn = drawing(model, solved.gearbox, bodies(model, solved.gearbox, COARSE), moved, factor)
    with plot_style():
        from matplotlib.ticker import MaxNLocator

        scale = colour_scale(np.asarray(MaxNLocator(STEPS).tick_values(0.0, 1e3 * drawn.largest or 1.0)))
        width, height = np.ptp(drawn.faces.corners[..., :2].reshape(-1, 2), axis=0)
        figure = new_figure(float(np.clip(HEIGHT_IN * width / height + BESIDE_IN, *WIDTHS_IN)), HEIGHT_IN)
        axes = figure.subplots()
        draw(axes, drawn, scale, 1e3)
        _draw_axes(axes, drawn.camera)
        figure.colorbar(scale, ax=axes, label="displacement, without twist [µm]", shrink=0.6)
        figure.suptitle(f"{solved.load.name}: displacements {factor:g} times as large", fontsize=11)
        see_through(figure)
    return figure


def drawing(
    model: GearboxModel, gearbox: LoadedGearbox, found: Sequence[Body], moved: FloatArray, factor: float,
    twist: bool = False,
) -> Drawing:  # fmt: skip
    """Return how bodies look to the viewer that move so far, mm and rad, drawn `factor` times as large."""
    seen = camera(model)
    faces = [_faces(body, moved, factor, seen, twist) for body in found]
    bearing = np.repeat([body.kind == "bearing" for body in found], [len(one.light) for one in faces])
    shafts = [_shaft_axes(gearbox, moved, model, exaggerated, seen) for exaggerated in (factor, 0.0)]
    every = _Faces(*(np.concatenate(values) for values in zip(*faces, strict=True)))
    return Drawing(every, bearing, seen, (shafts[0], shafts[1]))


def colour_scale(levels: FloatArray) -> ScalarMappable:
    """Return the colours between levels of displacement."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm

    return ScalarMappable(BoundaryNorm(levels, 256), colormaps["viridis"])


def draw(axes: Axes, drawn: Drawing, scale: ScalarMappable, per_mm: float) -> None:
    """Draw bodies into axes, by a scale of displacements times `per_mm`."""
    from matplotlib.collections import LineCollection, PolyCollection

    faces, order = drawn.faces, np.argsort(drawn.faces.corners[..., 2].mean(axis=1))
    colours = np.where(drawn.bearing[:, None], BEARING, scale.to_rgba(per_mm * faces.moved))
    colours[:, :3] *= np.round(faces.light[:, None] * LIGHTS) / LIGHTS
    axes.add_collection(
        PolyCollection(
            list(faces.corners[order, :, :2]), facecolors=colours[order], edgecolors=colours[order], linewidths=0.3
        )
    )
    # Where a shaft hardly moves both lie on each other: dashes of one colour would be a solid line.
    for lines, style, colour in zip(drawn.shafts, ("solid", "dashdot"), (INK, COLOURS[1]), strict=True):
        axes.add_collection(LineCollection(lines, colors=colour, linewidths=1.1, linestyles=style, zorder=3))
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")


def camera(model: GearboxModel) -> FloatArray:
    """Return rows: to the right, upwards, and towards the viewer, who sees the shafts side by side."""
    places = np.array([shaft.at_mm for shaft in model.sections.shafts] or [(0.0, 0.0)])
    spread = np.ptp(places, axis=0)
    up = np.array([0.0, 1.0, 0.0] if spread[0] > spread[1] else [0.0, 0.0, 1.0])
    x = np.array([1.0, 0.0, 0.0])
    towards = EYE @ np.array([x, up, np.cross(x, up)]) / np.linalg.norm(EYE)
    right = np.cross(up, towards) / np.linalg.norm(np.cross(up, towards))
    return np.array([right, np.cross(towards, right), towards])


def _faces(body: Body, moved: FloatArray, factor: float, camera: FloatArray, twist: bool) -> _Faces:
    moved = body.displacement(moved, twist)
    corners = ((body.rings + factor * moved) @ camera.T).reshape(-1, 3)[body.quads]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    size = np.linalg.norm(normal, axis=1)
    seen = (normal[:, 2] > 0.0) & (size > 0.0)
    cosine = normal[seen] @ LIGHT / (np.linalg.norm(LIGHT) * size[seen])
    distance = np.linalg.norm(moved, axis=2).ravel()[body.quads[seen]].mean(axis=1)
    return _Faces(corners[seen], AMBIENT + (1.0 - AMBIENT) * np.maximum(cosine, 0.0), distance)


def _shaft_axes(
    gearbox: LoadedGearbox, moved: FloatArray, model: GearboxModel, factor: float, camera: FloatArray
) -> list[FloatArray]:
    found = []
    for shaft in model.sections.shafts:
        stations, first = gearbox.beams[shaft.name].stations, gearbox.first[shaft.name]
        own = moved[first : first + NODE * len(stations)].reshape(-1, NODE)[:, :3]
        at_rest = np.array([shaft.start_mm, *shaft.at_mm]) + np.outer(stations, [1.0, 0.0, 0.0])
        found.append((at_rest + factor * own) @ camera[:2].T)
    return found


def _draw_axes(axes: Axes, camera: FloatArray) -> None:
    """Directions of the machine's axes, in the lower left corner."""
    (left, _), (low, high) = axes.get_xlim(), axes.get_ylim()
    length = CORNER * (high - low)
    for name, (across, up) in zip("xyz", camera[:2].T, strict=True):
        tip = left + length * across, low + length * up
        axes.annotate("", tip, (left, low), arrowprops={"arrowstyle": "->", "color": MIDDLE}, annotation_clip=False)
        axes.text(left + 1.25 * length * across, low + 1.25 * length * up, name, ha="center", va="center")
