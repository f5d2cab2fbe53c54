r"""How the load is spread: over the face width, and over tooth pairs.

*Face load factor.* ISO 6336-1 compares the largest load per face width with the mean one, K_Hbeta = w_max / w_m, over
the width alone: the variation along the profile, as teeth take over from each other, is left to other factors.
Here w(z) is the line load that the section at z carries, added up over all tooth pairs and over the mesh cycle:

    K_Hbeta = max_z w(z) / mean_z w(z),    w(z) = \sum_{angles, pairs} w(z; angle, pair),

the mean over the common face, parts of it that carry nothing included. On spur gears, whose sections do the same at the
same time, it is also that of each state, but for the mesh stiffness's change with the number of pairs. On helical gears
a state by itself has a contact line that ends somewhere, which no crowning mends, and its own factor says little.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.results.loads import LineStates
from pmor.results.sweep import SteSweep


def line_states(sweep: SteSweep) -> LineStates:
    """Return the line contact of a recorded sweep.

    Raises
    ------
    ValueError
        When it was not recorded, or made by a model that has no line loads.
    """
    if sweep.states is None or sweep.states.lines is None:
        raise ValueError("the sweep keeps no line loads: sweep a model of line loads with recorded=True")
    return sweep.states.lines


class SectionLoads(Protocol):
    """Fields of line contact states that a face load factor needs, such as `pmor.results.loads.LineStates`."""

    @property
    def load_N_per_mm(self) -> FloatArray: ...  # noqa: D102

    @property
    def width_mm(self) -> FloatArray: ...  # noqa: D102


def face_load_factor(lines: SectionLoads) -> FloatArray:
    """Return K_Hbeta of each torque, shape (D,), see the module; NaN where nothing carries."""
    load = lines.load_N_per_mm.sum(axis=(1, 2))
    mean = load @ lines.width_mm / lines.width_mm.sum()
    return np.divide(load.max(axis=-1), mean, out=np.full(mean.shape, np.nan), where=mean > 0.0)


def effective_contact_ratio(sweep: SteSweep) -> FloatArray:
    """Return by how many tooth pairs load is carried on average, shape (D,); NaN where nothing converged.

    It is the angle over which a pair carries over the pitch: a loaded pair begins earlier and ends later than rigid
    flanks do, a relieved one later and earlier. Known to one position in a pitch.
    """
    carrying = (line_states(sweep).load_N_per_mm > 0.0).any(axis=3).sum(axis=2)
    count = sweep.converged.sum(axis=1)
    total = (carrying * sweep.converged).sum(axis=1)
    return np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)


#: what the largest pressure is, wherever it is told
PRESSURE = "largest of Hertz over flanks and mesh cycle, where no sharp tip edge carries: there it has no bound"


def largest_pressure(pressure: FloatArray, axis: int | tuple[int, ...]) -> FloatArray:
    """Return the largest of pressures as `LineStates` has them over some axes, MPa.

    Sections in which a sharp edge carries do not count. NaN where these carry alone, 0 where nothing carries.
    """
    found = np.fmax.reduce(pressure, axis=axis)
    if (nothing := found == 0.0).any():
        found = np.where(nothing & np.isnan(pressure).any(axis=axis), np.nan, found)
    return np.asarray(found)


def over_the_whole_face(lines: LineStates, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places over the whole face (mm) and values there, the sections along the last axis.

    Sections at mid width have no image.
    """
    if not lines.mirrored:
        return lines.z_mm, values
    imaged = np.flatnonzero(lines.z_mm < 0.0)[::-1]
    z = np.concatenate([lines.z_mm, -lines.z_mm[imaged]])
    return z, np.concatenate([values, values[..., imaged]], axis=-1)
