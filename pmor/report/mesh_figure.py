"""Picture of a tooth sector's mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.report.panels import panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOADED_FLANK_COLOUR = "#D55E00"
# Of a curved edge.
CHORDS = 6


def mesh_figure(nodes_xy_mm: FloatArray, quads: IntArray, flank_nodes_xy_mm: FloatArray) -> Figure:
    """Transverse section of one tooth sector, the loaded flank highlighted, with a close-up of flank and fillet.

    Parameters
    ----------
    nodes_xy_mm : (n, 2)
    quads : (m, 4) or (m, 8) int
        Nodes around the elements' section: corners, or corners and the middles of the edges between them in turn.
    flank_nodes_xy_mm : (k, 2)
        Nodes of the loaded flank, in order along the profile.
    """
    from matplotlib.patches import Rectangle

    with panels(2, 8.2, 5.2, legend=1, width_ratios=(1.0, 1.7)) as (figure, (whole, zoom)):
        for axes, width in ((whole, 0.35), (zoom, 0.6)):
            _draw_mesh(axes, nodes_xy_mm, quads, width)
            axes.plot(*flank_nodes_xy_mm.T, color=LOADED_FLANK_COLOUR, lw=2.2, label="loaded flank", gid="flank")
            axes.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
            axes.grid(False)
        whole.set_title(f"One tooth sector:\n{len(quads)} elements, {len(np.unique(quads))} nodes")
        zoom.plot(*flank_nodes_xy_mm.T, "o", ms=3, color=LOADED_FLANK_COLOUR)
        zoom.set_title("Loaded flank and root fillet")
        low, high = flank_nodes_xy_mm.min(axis=0), flank_nodes_xy_mm.max(axis=0)
        size = 1.5 * float((high - low).max())
        # The fillet lies on the axis' side of the flank, so the window is moved towards the axis.
        middle = 0.5 * (low + high)
        centre = middle - 0.12 * size * middle / np.linalg.norm(middle)
        corner = centre - size / 2
        zoom.set(xlim=(corner[0], corner[0] + size), ylim=(corner[1], corner[1] + size))
        whole.add_patch(Rectangle(tuple(corner), size, size, fill=False, ec="#777777", lw=0.8, ls="--"))
        whole.autoscale_view()
    return figure


def _draw_mesh(axes: Axes, nodes: FloatArray, quads: IntArray, line_width: float) -> None:
    from matplotlib.collections import PolyCollection

    outlines = list(_outlines(nodes[quads]))
    axes.add_collection(PolyCollection(outlines, facecolors="#eef3f7", edgecolors="#44525c", linewidths=line_width))


def _outlines(around: FloatArray) -> FloatArray:
    """Points around sections of elements, (m, points, 2); edges with a node in their middle are parabolas."""
    if around.shape[1] == 4:
        return around
    start, middle = around[:, ::2, None], around[:, 1::2, None]
    end, t = np.roll(start, -1, axis=1), np.linspace(0.0, 1.0, CHORDS, endpoint=False)[:, None]
    points = (1.0 - t) * (1.0 - 2.0 * t) * start + 4.0 * t * (1.0 - t) * middle + t * (2.0 * t - 1.0) * end
    return np.asarray(points.reshape(len(around), -1, 2))
