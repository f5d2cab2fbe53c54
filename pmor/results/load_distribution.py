r"""How the load is spread over the face width and over tooth pairs, and what it loses by sliding.

*Face load factor.* ISO 6336-1 compares the largest load per face width with the mean one, K_Hbeta = w_max / w_m, over
the width alone: the variation along the profile, as teeth take over from each other, is left to other factors.
Here w(z) is the line load that the section at z carries, added up over all tooth pairs and over the mesh cycle:

    K_Hbeta = max_z w(z) / mean_z w(z),    w(z) = \sum_{angles, pairs} w(z; angle, pair),

the mean over the common face, parts of it that carry nothing included. On spur gears, whose sections do the same at the
same time, it is also that of each state, but for the mesh stiffness's change with the number of pairs. On helical gears
a state by itself has a contact line that ends somewhere, which no crowning mends, and its own factor says little.

*Losses.* The friction force of a section is mu times its normal force F / cos(beta_b), and acts through the sliding
velocity; with the roll angles u_1, u_2 at the point of contact that is omega_1 r_b1 |u_1 - u_2|. Over the power of the
mesh, F_bt omega_1 r_b1,

    P_V = P mu H_VL,    H_VL = mean over the cycle of sum F |u_1 - u_2| / (F_bt cos(beta_b)).

Rigid spur pairs that share the load equally have H_V of Ohlendorf (Dissertation, TH Munich, 1958). Friction is mean
over the mesh: that of Schlenk (Dissertation, TU Munich, 1995), from measurements on gears; other formulas give up to
twice as much. Churning and bearings are left out.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
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


def effective_contact_ratio(lines: LineStates) -> FloatArray:
    """Return by how many tooth pairs load is carried on average, shape (D,); NaN where nothing converged.

    It is the angle over which a pair carries over the pitch: a loaded pair begins earlier and ends later than rigid
    flanks do, a relieved one later and earlier. Known to one position in a pitch.
    """
    carrying = (lines.load_N_per_mm > 0.0).any(axis=3).sum(axis=2)
    count = lines.converged.sum(axis=1)
    total = (carrying * lines.converged).sum(axis=1)
    return np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)


def carrying_face_percent(lines: SectionLoads) -> FloatArray:
    """Return the share of the face that carries anywhere in the mesh cycle under each torque, (D,)."""
    carries = (lines.load_N_per_mm > 0.0).any(axis=(1, 2))
    return np.asarray(100.0 * (carries * lines.width_mm).sum(axis=1) / lines.width_mm.sum())


def face_line(lines: LineStates, torque: int) -> tuple[FloatArray, FloatArray]:
    """Return places over the whole face, mm, and the mean over the mesh cycle of the line load there, N/mm.

    That is added up over tooth pairs, of the positions that converged under a torque by its number; NaN without any.
    """
    there = lines.converged[torque]
    load = lines.load_N_per_mm[torque, there].sum(axis=1)
    return over_the_whole_face(lines, load.mean(axis=0) if len(load) else np.full(load.shape[1:], np.nan))


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


# A patch of contact that is off its middle by more than this has been cut off, or carried round, by an edge, mm.
OFF_MIDDLE = 1e-9
# Of the face width, at each end.
AT_ENDS = 0.15


def at_tip_edges(load_N_per_mm: FloatArray, offset_mm: FloatArray) -> FloatArray:
    """Return the line loads of those sections in which the edge at a tip is in contact, 0 of the others."""
    return np.where(np.abs(offset_mm) > OFF_MIDDLE, load_N_per_mm, 0.0)


def tip_edge_load(lines: LineStates) -> FloatArray:
    """Return the largest line load at the edge of a tip under each torque, (D,), N/mm; 0 where tips stay clear."""
    return np.asarray(at_tip_edges(lines.load_N_per_mm, lines.offset_mm).max(axis=(1, 2, 3)))


def tip_edge_percent(lines: LineStates) -> FloatArray:
    """Return over how much of the mesh cycle an edge at a tip carries under each torque, (D,), %."""
    carries = (at_tip_edges(lines.load_N_per_mm, lines.offset_mm) > 0.0).any(axis=(2, 3)).sum(axis=1)
    count = lines.converged.sum(axis=1)
    return np.divide(100.0 * carries, count, out=np.full(count.shape, np.nan), where=count > 0)


def end_pressure_ratio(lines: LineStates) -> FloatArray:
    """Return the largest pressure at the ends of the face over the largest between them, (D,); NaN without either."""
    half = 0.5 * lines.width_mm.sum() * (2.0 if lines.mirrored else 1.0)
    at_ends = np.abs(lines.z_mm) > (1.0 - 2.0 * AT_ENDS) * half
    if at_ends.all() or not at_ends.any():
        return np.full(len(lines.converged), np.nan)
    ends, between = (largest_pressure(lines.pressure_MPa[..., part], (1, 2, 3)) for part in (at_ends, ~at_ends))
    return np.divide(ends, between, out=np.full(between.shape, np.nan), where=between > 0.0)


def over_the_whole_face(lines: LineStates, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places over the whole face (mm) and values there, the sections along the last axis.

    Sections at mid width have no image.
    """
    if not lines.mirrored:
        return lines.z_mm, values
    imaged = np.flatnonzero(lines.z_mm < 0.0)[::-1]
    z = np.concatenate([lines.z_mm, -lines.z_mm[imaged]])
    return z, np.concatenate([values, values[..., imaged]], axis=-1)


class SlidingLoads(SectionLoads, Protocol):
    """Fields of line contact states that a loss factor needs, such as `pmor.results.loads.LineStates`."""

    @property
    def roll_rad(self) -> FloatArray: ...  # noqa: D102


def loss_factor(pair: GearPair, lines: SlidingLoads) -> FloatArray:
    """Return H_VL of each torque, shape (D,), of the positions that carry; NaN where none does.

    Parameters
    ----------
    pair : GearPair
        External or internal: flanks of a ring slide by the difference of the roll angles too, as their signs have it.
    lines : SlidingLoads
        Of a sweep over whole pitches, over the whole width or half of it.
    """
    sliding = np.abs(lines.roll_rad[..., 0] - lines.roll_rad[..., 1])
    force = lines.load_N_per_mm * lines.width_mm
    total = force.sum(axis=(2, 3))
    lost = np.einsum("daps,aps->da", force, np.where(np.isfinite(sliding), sliding, 0.0))
    share, count = np.divide(lost, total, out=np.zeros(total.shape), where=total > 0.0), (total > 0.0).sum(axis=1)
    mean = np.divide(share.sum(axis=1), count, out=np.full(count.shape, np.nan), where=count > 0)
    return np.asarray(mean / math.cos(pair.base_helix_angle))


def friction_schlenk(
    pair: GearPair, force_N: float, pinion_rpm: float, viscosity_mPas: float, roughness_um: float,
    lubricant_factor: float,
) -> float:  # fmt: skip
    """Return the mean coefficient of friction of a mesh after Schlenk (1995).

    Parameters
    ----------
    pair : GearPair
    force_N : float
        In the transverse plane.
    pinion_rpm : float
    viscosity_mPas : float
        Dynamic viscosity at the temperature of the oil.
    roughness_um : float
        Ra, mean of both gears.
    lubricant_factor : float
        X_L; 1 of mineral oil.
    """
    omega = 2.0 * math.pi * abs(pinion_rpm) / 60.0
    tangential = 1e-3 * omega * pair.pinion.base_radius / math.cos(pair.working_pressure_angle)
    sum_velocity = 2.0 * tangential * math.sin(pair.working_pressure_angle)
    radius = pair.pitch_point_radius / math.cos(pair.base_helix_angle)
    load = force_N / pair.common_width / (sum_velocity * radius)
    return float(0.048 * load**0.2 * viscosity_mPas**-0.05 * roughness_um**0.25 * lubricant_factor)
