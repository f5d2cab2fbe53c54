"""Picture of the contact pressure on unrolled flanks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from pmor.arrays import FloatArray
from pmor.report.style import new_figure, plot_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def contact_pattern_figure(pressures: Sequence[tuple[str, FloatArray, FloatArray, FloatArray]]) -> Figure:
    """Contact pressure on the unrolled flank, a panel per tooth pair at one position.

    Parameters
    ----------
    pressures : sequence of (title, roll_angle_deg (n,), width_mm (m,), pressure_MPa (n, m))
        Sample points over the profile and over the width; NaN or 0 where there is no contact.
    """
    with plot_style():
        n = len(pressures)
        if n == 0:
            raise ValueError("no tooth pair to show a contact pattern for")
        figure = new_figure(1.6 + 3.0 * n, 4.2)
        panels = np.atleast_1d(figure.subplots(1, n, sharey=True))
        top = max([float(np.nanmax(p)) for *_, p in pressures if np.isfinite(p).any()] + [0.0])
        for panel, (title, roll, width, pressure) in zip(panels, pressures, strict=True):
            loaded = np.ma.masked_where(~(np.nan_to_num(pressure) > 0), pressure)
            image = panel.pcolormesh(
                _cell_edges(width), _cell_edges(roll), loaded, vmin=0.0, vmax=top or 1.0, edgecolors="none"
            )
            panel.set_facecolor("#f4f4f4")
            panel.grid(False)
            peak = float(loaded.max()) if loaded.count() else 0.0
            panel.set_title(f"{title}\n" + (f"peak {peak:.0f} MPa" if peak else "no contact"))
            panel.set_xlabel("Position over face width [mm]")
        panels[0].set_ylabel("Roll angle along the profile [deg]\n(root to tip)")
        figure.colorbar(image, ax=list(panels), label="Contact pressure [MPa]", shrink=0.9)
    return figure


def _cell_edges(points: ArrayLike) -> FloatArray:
    """Edges (n + 1,) of cells around sample points (n,), halfway between neighbours."""
    x = np.asarray(points, float)
    if len(x) == 1:
        return np.array([x[0] - 0.5, x[0] + 0.5])
    middle = 0.5 * (x[1:] + x[:-1])
    return np.concatenate([[2 * x[0] - middle[0]], middle, [2 * x[-1] - middle[-1]]])
