"""Results of a sweep over roll angles and torques, and the figures derived from them.

Full and reduced model return the same `SteSweep`. A position that did not converge is NaN in ``ste_um`` and stays
visible as such: means and peaks over the pitch use the converged positions, the mesh orders need them all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.shown import brief
from pmor.results.loads import SweepStates

MIN_RIPPLE_POINTS = 8  # a quartic takes five; fewer than three beyond that say nothing about ripple


@brief
@dataclass(frozen=True, eq=False)
class SteSweep:
    """Static transmission error and load sharing over one pitch, or over several of them.

    Attributes
    ----------
    phi_rad : (n_angles,)
        Pinion roll position over the pitches: uniform, end point excluded (the plots accept other spacings too).
    torque_Nm : (n_torques,)
        At the pinion.
    ste_um : (n_torques, n_angles)
        (theta_1 - theta_1,kinematic) r_b1 along the line of action, from where plain flanks on aligned axes touch; NaN
        where not converged.
    pair_share : (n_torques, n_angles, n_pairs)
        Fraction of the pinion's contact torque carried by tooth pair ``pair_index[j]``; 0 for idle pairs.
    pair_index : (n_pairs,) int
        Tooth pair j is at its own roll position phi + 2 pi j / z1.
    newton_steps : (n_torques, n_angles) int
    converged : (n_torques, n_angles) bool
    seconds : float
        Wall time of the sweep, or of its positions, added up.
    pitch_rad : float
        2 pi / z1.
    ste_error_um : (n_torques, n_angles) or None
        Estimated error of the reduced model's STE (`pmor.penalty.kernels.estimate`), um; None where there is none.
    states : SweepStates or None
        Advances, amplitudes and contact forces of a reduced sweep that was asked to keep them.
    unloaded_um : (n_torques, n_angles) or None
        Transmission error of the same flanks without load, um; None where it is zero.
    mesh_error_percent : (n_torques,) or None
        Estimated error of the mesh over the mean STE (`pmor_online.mesh_error`), %; None where there is none.
    stiffness_N_per_um : (n_torques, n_angles) or None
        Tangent of the force along the line of action, T / r_b1, over the STE, from the factor of the solution; NaN
        where not converged. None of models that do not know it.
    overloaded : (n_torques, n_angles) bool or None
        Positions that count as not converged since contact is too wide for the law of line contact in some section.
    """

    phi_rad: FloatArray
    torque_Nm: FloatArray
    ste_um: FloatArray
    pair_share: FloatArray
    pair_index: IntArray
    newton_steps: IntArray
    converged: BoolArray
    seconds: float
    pitch_rad: float
    ste_error_um: FloatArray | None = None
    states: SweepStates | None = None
    unloaded_um: FloatArray | None = None
    mesh_error_percent: FloatArray | None = None
    stiffness_N_per_um: FloatArray | None = None
    overloaded: BoolArray | None = None

    def __post_init__(self) -> None:
        """Refuse arrays that do not belong together: a wrong shape would broadcast silently further on."""
        grid = (len(self.torque_Nm), len(self.phi_rad))
        expected = {
            "ste_um": grid, "pair_share": (*grid, len(self.pair_index)), "newton_steps": grid, "converged": grid
        }  # fmt: skip
        for name in ("ste_error_um", "unloaded_um", "stiffness_N_per_um", "overloaded"):
            if getattr(self, name) is not None:
                expected[name] = grid
        if self.mesh_error_percent is not None:
            expected["mesh_error_percent"] = grid[:1]
        for name, shape in expected.items():
            if getattr(self, name).shape != shape:
                raise ValueError(f"{name} has shape {getattr(self, name).shape}, expected {shape}")

    @property
    def deflection_um(self) -> FloatArray:
        """Transmission error less that without load, (n_torques, n_angles), um."""
        return self.ste_um if self.unloaded_um is None else self.ste_um - self.unloaded_um

    @property
    def first_touch_um(self) -> FloatArray | None:
        """Least transmission error without load over the angles, (n_torques,), um; None without `unloaded_um`."""
        return None if self.unloaded_um is None else np.asarray(self.unloaded_um.min(axis=1))

    def at_torques(self, rows: slice | IntArray) -> SteSweep:
        """Return a sweep with some of the torques, by their place; it keeps no states."""
        ste = self.ste_um[rows]
        optional = ("ste_error_um", "unloaded_um", "mesh_error_percent", "stiffness_N_per_um", "overloaded")
        kept = {name: values[rows] for name in optional if (values := getattr(self, name)) is not None}
        return replace(
            self, torque_Nm=self.torque_Nm[rows], ste_um=ste, pair_share=self.pair_share[rows],
            newton_steps=self.newton_steps[rows], converged=self.converged[rows],
            seconds=self.seconds * len(ste) / len(self.ste_um), states=None, **kept,
        )  # fmt: skip

    @property
    def mesh_error_um(self) -> FloatArray | None:
        """Error of the mesh (n_torques,), um; None where not estimated."""
        if self.mesh_error_percent is None:
            return None
        return np.asarray(0.01 * self.mesh_error_percent * np.abs(ste_mean_um(self)))

    @property
    def error_bar_um(self) -> FloatArray | None:
        """Error of reduction and mesh together (n_torques, n_angles), um; None where neither is estimated."""
        of_mesh = self.mesh_error_um
        if self.ste_error_um is None and of_mesh is None:
            return None
        total = np.zeros_like(self.ste_um) if self.ste_error_um is None else np.abs(self.ste_error_um)
        return np.asarray(total if of_mesh is None else total + of_mesh[:, None])

    @property
    def pitches(self) -> int:
        """Angular pitches that the sweep spans; teeth with pitch deviations differ from one to the next."""
        return max(1, math.ceil(float(np.ptp(self.phi_rad)) / self.pitch_rad - 1e-9)) if len(self.phi_rad) else 1

    @property
    def span_rad(self) -> float:
        """Angle that they take, rad."""
        return self.pitches * self.pitch_rad


@brief
@dataclass(frozen=True, eq=False)
class MeshStiffness:
    """Mesh stiffness per face width, N/(mm um); NaN where it is undefined.

    Attributes
    ----------
    secant : (n_torques, n_angles)
        F_n / b over the STE at each torque, less that without load.
    tangent : (n_torques, n_angles), (n_torques - 1, n_angles) or None
        Derivative of F_n / b by the STE at each torque, of sweeps that know it; else its change over that of the STE
        between neighbouring torques, and None with a single one.
    tangent_torque_Nm : (n_torques,), (n_torques - 1,) or None
        Those torques, or the middle of neighbours.
    """

    secant: FloatArray
    tangent: FloatArray | None
    tangent_torque_Nm: FloatArray | None


def ste_mean_um(sweep: SteSweep) -> FloatArray:
    """Mean STE over the pitch (n_torques,), um; NaN for a torque at which nothing converged."""
    return _over_angles(sweep.ste_um, np.nanmean)


def peak_to_peak_um(sweep: SteSweep) -> FloatArray:
    """Largest minus smallest STE over the pitch (n_torques,), um."""
    return _over_angles(sweep.ste_um, lambda ste: np.nanmax(ste) - np.nanmin(ste))


def largest_error_um(sweep: SteSweep) -> float | None:
    """Return the largest magnitude of a sweep's error estimate, um; None where it has none."""
    if sweep.ste_error_um is None or not np.isfinite(sweep.ste_error_um).any():
        return None
    return float(np.nanmax(np.abs(sweep.ste_error_um)))


def torque_exponent(sweep: SteSweep) -> float:
    """Return d ln(mean) / d ln(torque) of the STE less that without load, over the torques; NaN for one torque alone.

    1 for a linear pair; Hertz contact stiffens, which makes it a little less.
    """
    mean = _over_angles(sweep.deflection_um, np.nanmean)
    known = mean > 0.0
    if np.count_nonzero(known) < 2:
        return float("nan")
    return float(np.polyfit(np.log(sweep.torque_Nm[known]), np.log(mean[known]), 1)[0])


def mesh_orders(sweep: SteSweep, torque_index: int, n_orders: int = 10) -> FloatArray:
    """Amplitudes (zero to peak, um) of the orders 1 ... ``n_orders`` of the mesh frequency (n_orders,).

    Orders that the sampling cannot resolve (from half the number of angles upwards) are NaN, and all of them are when a
    position is missing: a spectrum over a gap would be invented.

    Raises
    ------
    ValueError
        When the angles do not divide the pitches uniformly.
    """
    whole, pitches = orders_of(sweep, torque_index), sweep.pitches
    amplitudes = np.full(n_orders, np.nan)
    resolved = min(n_orders, len(whole.amplitude) // pitches)
    amplitudes[:resolved] = whole.amplitude[pitches - 1 :: pitches][:resolved]
    return amplitudes


def orders_of(sweep: SteSweep, torque_index: int) -> Orders:
    """Orders of the STE over all pitches of a sweep, um; they count periods per turn of the pinion.

    Over a whole revolution, or the period after which the same teeth meet again, they hold the long-period transmission
    error that pitch deviations make, beside the orders of the mesh at multiples of the number of teeth.

    Raises
    ------
    ValueError
        When the angles do not divide the pitches uniformly.
    """
    n, span = len(sweep.phi_rad), sweep.span_rad
    uniform = sweep.phi_rad[0] + span * np.arange(n) / n
    if not np.allclose(sweep.phi_rad, uniform, rtol=0.0, atol=1e-6 * span / n):
        raise ValueError("mesh orders need angles that divide one pitch, or several, uniformly, end point excluded")
    return orders(sweep.phi_rad, sweep.ste_um[torque_index], span)


def single_pair_zone(sweep: SteSweep, torque_index: int) -> IntArray:
    """Indices of the angles in the longest run in which exactly one pair carries load, in order of rolling.

    The sweep is periodic, so a run may wrap around its end: indices then jump from the last to the first.
    """
    single = (sweep.pair_share[torque_index] > 0).sum(axis=1) == 1
    single &= sweep.converged[torque_index] & np.isfinite(sweep.ste_um[torque_index])
    n = len(single)
    if single.all():
        return np.arange(n)
    # Start right after a position outside the zone: no run can wrap then.
    order = (np.arange(n) + int(np.flatnonzero(~single)[0]) + 1) % n
    runs = np.split(order, np.flatnonzero(~single[order]))
    runs = [run[single[run]] for run in runs]
    return max(runs, key=len)


def ripple_um(sweep: SteSweep, torque_index: int) -> float:
    """Standard deviation (um) of the STE about a quartic over the single-pair zone; NaN below eight positions.

    One pair in contact has a smooth STE, so the remainder of a quartic fit is the discretisation of the flank surfaces.
    """
    zone = single_pair_zone(sweep, torque_index)
    if len(zone) < MIN_RIPPLE_POINTS:
        return float("nan")
    phi = sweep.phi_rad[zone]
    phi = phi + sweep.span_rad * (phi < phi[0])
    ste = sweep.ste_um[torque_index, zone]
    fit = np.polynomial.Polynomial.fit(phi, ste, deg=4)
    return float(np.std(ste - fit(phi)))


def mesh_stiffness(sweep: SteSweep, base_radius_mm: float, face_width_mm: float) -> MeshStiffness:
    """Secant and tangent mesh stiffness per face width from torque and STE.

    Parameters
    ----------
    base_radius_mm : float
        Of the pinion: F_n = T / r_b1.
    """
    load = 1e3 * sweep.torque_Nm / base_radius_mm / face_width_mm
    secant = _positive_ratio(np.broadcast_to(load[:, None], sweep.ste_um.shape), sweep.deflection_um)
    if sweep.stiffness_N_per_um is not None:
        return MeshStiffness(secant, sweep.stiffness_N_per_um / face_width_mm, sweep.torque_Nm)
    if len(load) < 2:
        return MeshStiffness(secant, None, None)
    rising = np.argsort(sweep.torque_Nm, kind="stable")
    step = np.broadcast_to(np.diff(load[rising])[:, None], (len(load) - 1, len(sweep.phi_rad)))
    tangent = _positive_ratio(step, np.diff(sweep.ste_um[rising], axis=0))
    torque = sweep.torque_Nm[rising]
    return MeshStiffness(secant, tangent, 0.5 * (torque[1:] + torque[:-1]))


def _positive_ratio(load: FloatArray, deflection: FloatArray) -> FloatArray:
    """Load over deflection, NaN where either is missing or not positive (a stiffness there means nothing)."""
    ratio = np.full(deflection.shape, np.nan)
    usable = (load > 0) & (deflection > 0)
    ratio[usable] = load[usable] / deflection[usable]
    return ratio


def _over_angles(values: FloatArray, statistic: Callable[[FloatArray], float]) -> FloatArray:
    """One number per torque, NaN (without numpy's warning) where no angle converged."""
    return np.array([statistic(row) if np.isfinite(row).any() else np.nan for row in values])


@dataclass(frozen=True, eq=False)
class Orders:
    """Harmonics of a curve over the angle of a shaft.

    The curve is ``mean + sum_k amplitude[k] cos(order[k] angle + phase[k])``: an order is a number of periods per turn
    of the shaft, an amplitude goes from zero to peak.

    Parameters
    ----------
    mean : float
        In the unit of the curve.
    order : ndarray, shape (n,)
        Ascending; multiples of 2 pi over the period.
    amplitude : ndarray, shape (n,)
        In the unit of the curve; NaN where a value was missing, as is the mean.
    phase : ndarray, shape (n,)
        rad, between -pi and pi.
    """

    mean: float
    order: FloatArray
    amplitude: FloatArray
    phase: FloatArray


def orders(angle: FloatArray, values: FloatArray, period: float) -> Orders:
    """Find all orders that a curve's samples resolve: those of fewer than half as many periods as there are samples.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        They divide one period uniformly, its end excluded, rad.
    values : ndarray, shape (n,)
    period : float
        rad.
    """
    n = len(values)
    order = np.asarray(2.0 * math.pi / period * np.arange(1, (n - 1) // 2 + 1), dtype=float)
    spectrum = np.fft.rfft(values) / n
    complex_orders = 2.0 * spectrum[1 : len(order) + 1] * np.exp(-1j * order * angle[0])
    return Orders(float(spectrum[0].real), order, np.abs(complex_orders), np.angle(complex_orders))
