"""Results of sweeps in Python: named arrays, the figures derived from them, pictures and tables."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.export.tables import ResultArray, line_entries, sweep_entries
from pmor.gear.condition import PLAIN, Assembly
from pmor.gear.pair import GearPair
from pmor.report.curves import Drawn, joined
from pmor.report.data_files import ste_columns, write_ste_csv
from pmor.report.flank_figures import flank_maps_figure
from pmor.report.replay import figure_of
from pmor.report.sweep_figures import load_sharing_figure, spectrum_figure, ste_figure
from pmor.report.torque_figures import harris_figure, revolution_figure
from pmor.results.flank_maps import FlankMap
from pmor.results.load_distribution import effective_contact_ratio, face_load_factor, line_states
from pmor.results.loads import LineStates
from pmor.results.mesh_forces import MeshForces
from pmor.results.root_stress import GEARS
from pmor.results.sensitivity import Sensitivities
from pmor.results.shaft_orders import MOST_LISTED, ShaftOrder, shaft_orders
from pmor.results.solution import MeshView, PartView, place_of
from pmor.results.sweep import MeshStiffness, SteSweep, mesh_orders, mesh_stiffness, peak_to_peak_um, ste_mean_um
from pmor_online.model import ReducedPair
from pmor_online.readings import derivatives, flank_maps, forces_on_gears

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pmor.core.shown import Columns

# Orders of the mesh frequency in a notebook.
SHOWN_ORDERS = 3


@dataclass(frozen=True, eq=False, repr=False)
class SweepResult(Drawn):
    """Static transmission error, load sharing and stiffness over T torques and N pinion angles.

    A position that did not converge is NaN in the arrays of floats, and ``converged`` is false there.

    Parameters
    ----------
    reduced : ReducedPair, optional
        Model of the sweep, where it keeps its line loads.
    assembly : Assembly
        Axes and flanks of the sweep, as its flanks see them.
    flank : {"drive", "coast"}
        Flanks that carry. Of coast flanks torques are amounts, angles and transmission error count clockwise, from
        where plain coast flanks touch: the backlash between both flanks is not in it.
    holes : (int, int)
        Numbers of holes in the webs of pinion and wheel.
    """

    sweep: SteSweep
    pair: GearPair
    reduced: ReducedPair | None = None
    assembly: Assembly = PLAIN
    flank: str = "drive"
    holes: tuple[int, int] = (0, 0)

    @property
    def phi_rad(self) -> FloatArray:
        """Pinion angles, shape (N,), rad."""
        return self.sweep.phi_rad

    @property
    def torque_Nm(self) -> FloatArray:
        """Pinion torques, shape (T,), N m."""
        return self.sweep.torque_Nm

    @property
    def ste_um(self) -> FloatArray:
        """Static transmission error along the line of action, shape (T, N), um; positive: the pinion runs ahead.

        It counts from the kinematic position of the pair with unmodified flanks.
        """
        return self.sweep.ste_um

    @property
    def ste_urad(self) -> FloatArray:
        """Static transmission error as rotation of the pinion, shape (T, N), urad."""
        return np.asarray(1e3 * self.sweep.ste_um / self.pair.pinion.base_radius)

    @property
    def ste_error_um(self) -> FloatArray | None:
        """Estimated error of the reduction, shape (T, N), um; None of full FE, or where not kept."""
        return self.sweep.ste_error_um

    @property
    def mesh_error_percent(self) -> FloatArray | None:
        """Estimated error of the mesh, shape (T,), % of the mean STE; None where it is not estimated."""
        return self.sweep.mesh_error_percent

    @property
    def error_bar_um(self) -> FloatArray | None:
        """Error bar of reduction and mesh together, shape (T, N), um; None where neither is estimated."""
        return self.sweep.error_bar_um

    @property
    def unloaded_um(self) -> FloatArray:
        """Transmission error of the rigid flanks without load, shape (N,), um; 0 of unmodified flanks."""
        unloaded = self.sweep.unloaded_um
        return np.zeros_like(self.phi_rad) if unloaded is None else np.asarray(unloaded[0])

    @property
    def pair_share(self) -> FloatArray:
        """Share of the pinion torque that each of P tooth pairs carries, shape (T, N, P)."""
        return self.sweep.pair_share

    @property
    def pair_index(self) -> IntArray:
        """Tooth pairs of ``pair_share``, shape (P,): pair j is at its own roll position phi + 2 pi j / z1."""
        return self.sweep.pair_index

    @property
    def converged(self) -> BoolArray:
        """Whether a position converged, shape (T, N)."""
        return self.sweep.converged

    @property
    def newton_steps(self) -> IntArray:
        """Newton steps of each position, shape (T, N)."""
        return self.sweep.newton_steps

    @property
    def mean_um(self) -> FloatArray:
        """Mean STE over the angles, shape (T,), um."""
        return ste_mean_um(self.sweep)

    @property
    def peak_to_peak_um(self) -> FloatArray:
        """Largest minus smallest STE over the angles, shape (T,), um."""
        return peak_to_peak_um(self.sweep)

    @property
    def stiffness(self) -> MeshStiffness:
        """Secant and tangent mesh stiffness per face width, N/(mm um)."""
        return mesh_stiffness(self.sweep, self.pair.pinion.base_radius, self.pair.common_width)

    @property
    def line_loads(self) -> LineStates:
        """Line load, half-width of contact and pressure of each section in all states.

        Raises
        ------
        ValueError
            Of a model without exact line loads (``shapes = "line_loads"``), or of a sweep too long to keep them. So do
            all properties and methods below that stand on them.
        """
        return line_states(self.sweep)

    @property
    def k_h_beta(self) -> FloatArray:
        """Face load factor, largest over mean line load of the face, shape (T,) (`pmor.results.load_distribution`)."""
        return face_load_factor(self.line_loads)

    @property
    def effective_contact_ratio(self) -> FloatArray:
        """Tooth pairs that carry load on average over the angles, shape (T,)."""
        return effective_contact_ratio(self.line_loads)

    def mesh(self, name: str = "pinion - wheel") -> MeshView:
        """Return the mesh, with all that is read off its line contact; as of sets and gearboxes, which have several."""
        place_of("mesh", name, ["pinion - wheel"])
        return MeshView(name, self.pair, self.line_loads)

    def gear(self, name: str) -> PartView:
        """Return force and moment of the mesh on the hub of `pinion` or `wheel`, which is held."""
        forces, place = self.mesh_forces(), place_of("gear", name, GEARS)
        wrench = np.concatenate([forces.force_N[:, :, place], 1e3 * forces.moment_Nm[:, :, place]], axis=2)
        return PartView(name, wrench, np.zeros_like(wrench))

    support = gear

    def mesh_forces(self) -> MeshForces:
        """Return forces of the mesh on both gears and their moments about the axes at mid width, for the bearings."""
        return forces_on_gears(self._reduced().meshed, self.sweep)

    def sensitivities(self) -> Sensitivities:
        """Return exact derivatives of the STE, its mean and peak-to-peak by each parameter of the modifications."""
        return derivatives(self._reduced(), self.sweep, self.assembly)

    def flank_maps(self, torque_index: int = -1) -> tuple[FlankMap, FlankMap]:
        """Return the largest line load and pressure over the cycle on the flanks of pinion and wheel."""
        return flank_maps(self._reduced().meshed, self.sweep, range(len(self.torque_Nm))[torque_index])

    def _reduced(self) -> ReducedPair:
        line_states(self.sweep)  # names missing data
        assert self.reduced is not None
        return self.reduced

    def orders_um(self, count: int = 10) -> FloatArray:
        """Amplitudes, zero to peak, of the first orders of the mesh frequency, shape (T, count), um.

        Raises
        ------
        ValueError
            When the angles do not divide one pitch, or several, uniformly.
        """
        return np.stack([mesh_orders(self.sweep, t, count) for t in range(len(self.torque_Nm))])

    def shaft_orders(self, torque_index: int = -1, count: int = MOST_LISTED) -> list[ShaftOrder]:
        """Return the largest orders over the pitches of the sweep, named by mesh, holes and sidebands.

        Raises
        ------
        ValueError
            When the angles do not divide one pitch, or several, uniformly.
        """
        return shaft_orders(self.sweep, torque_index, self._teeth, self.holes, count)

    @property
    def _teeth(self) -> tuple[int, int]:
        return self.pair.pinion.teeth, abs(self.pair.wheel.teeth)

    def plot_ste(self, full: SweepResult | None = None) -> Figure:
        """Draw the STE over the angle, a curve for each torque; another result, such as full FE, as markers."""
        helical = self.pair.pinion.helix_angle != 0.0
        return figure_of(ste_figure(self.sweep, full.sweep if full else None, about_mean=helical))

    def plot_load_sharing(self) -> Figure:
        """Draw the share of the torque that each tooth pair carries."""
        return figure_of(load_sharing_figure(self.sweep))

    def plot_orders(self) -> Figure:
        """Draw the amplitudes of the orders of the mesh frequency."""
        return figure_of(spectrum_figure(self.sweep))

    def plot_revolution(self, torque_index: int = -1) -> Figure:
        """Draw the STE over all pitches of the sweep, and its orders with the sidebands of holes."""
        return figure_of(revolution_figure(self.sweep, torque_index, self._teeth, self.holes))

    def plot_flank_maps(self, torque_index: int = -1) -> Figure:
        """Draw the largest pressure and line load over the cycle on the flanks of pinion and wheel."""
        return figure_of(flank_maps_figure(self.flank_maps(torque_index)))

    def plot_harris_map(self) -> Figure:
        """Draw the STE over the angle at all torques, and its peak-to-peak over the torque."""
        return figure_of(harris_figure(self.sweep, about_mean=self.pair.pinion.helix_angle != 0.0))

    def to_csv(self, path: Path | str) -> None:
        """Write the table ``ste.csv`` of a run: a row for each torque and angle, units in the header."""
        write_ste_csv(Path(path), self.sweep)

    def columns(self) -> Columns:
        """All of it by the names of columns, for `to_dataframe`: a value for each torque and angle."""
        return ste_columns(self.sweep)

    def _labelled(self) -> dict[str, ResultArray]:
        lines = {} if self.sweep.states is None else line_entries(self.line_loads, self.mesh().figures)
        return sweep_entries(self.sweep, self.pair) | lines

    def _shown(self) -> Columns:
        mean, span = self.mean_um, self.peak_to_peak_um
        columns = {"torque, N m": self.torque_Nm, "STE mean, um": mean, "peak-to-peak, um": span}
        try:
            orders = self.orders_um(SHOWN_ORDERS)
        except ValueError:  # angles of the user's own
            return columns
        return columns | {f"order {n + 1}, um": orders[:, n] for n in range(SHOWN_ORDERS)}

    def __repr__(self) -> str:
        torques = ", ".join(f"{torque:g}" for torque in self.torque_Nm)
        spans = ", ".join(f"{span:.4g}" for span in self.peak_to_peak_um)
        failed = int(np.count_nonzero(~self.converged))
        ending = f"; {failed} positions did not converge" if failed else ""
        torques += " N m" + (" on coast flanks" if self.flank == "coast" else "")
        return f"<SweepResult: {len(self.phi_rad)} angles x {torques}, STE peak-to-peak {spans} um{ending}>"


@dataclass(frozen=True, eq=False, repr=False)
class ConditionsResult(Drawn):
    """Static transmission error of B assemblies of a pair, over T torques and N pinion angles.

    Parameters
    ----------
    results : tuple of SweepResult
        One for each.
    names : tuple of str
        Of the assemblies in tables; none: their numbers.
    """

    assemblies: tuple[Assembly, ...]
    results: tuple[SweepResult, ...]
    names: tuple[str, ...] = ()

    @property
    def ste_um(self) -> FloatArray:
        """Static transmission error along the line of action, shape (B, T, N), um."""
        return np.stack([result.ste_um for result in self.results])

    @property
    def mean_um(self) -> FloatArray:
        """Mean STE over the angles, shape (B, T), um."""
        return np.stack([result.mean_um for result in self.results])

    @property
    def peak_to_peak_um(self) -> FloatArray:
        """Largest minus smallest STE over the angles, shape (B, T), um."""
        return np.stack([result.peak_to_peak_um for result in self.results])

    @property
    def converged(self) -> BoolArray:
        """Whether a position converged, shape (B, T, N)."""
        return np.stack([result.converged for result in self.results])

    def orders_um(self, count: int = 10) -> FloatArray:
        """Amplitudes of the first orders of the mesh frequency, shape (B, T, count), um; see `SweepResult`."""
        return np.stack([result.orders_um(count) for result in self.results])

    def columns(self) -> Columns:
        """All of it by the names of columns, for `to_dataframe`: a value for each assembly and torque."""
        torques = self.results[0].torque_Nm
        keys = {
            f"{part}.{item.name}": [getattr(getattr(one, part), item.name) for one in self.assemblies]
            for part in ("misalignment", "pinion", "wheel") for item in fields(getattr(self.assemblies[0], part))
        }  # fmt: skip
        varied = {key: values for key, values in keys.items() if any(value != values[0] for value in values)}
        return {
            "assembly": np.repeat(self.names or np.arange(len(self.assemblies)), len(torques)),
            **{key: [value for value in values for _ in torques] for key, values in varied.items()},
            "torque_Nm": np.tile(torques, len(self.assemblies)),
            "ste_mean_um": self.mean_um.ravel(), "ste_peak_to_peak_um": self.peak_to_peak_um.ravel(),
            "converged": self.converged.all(axis=2).ravel(),
        }  # fmt: skip

    def _drawn(self) -> Columns:
        names = self.names or map(str, range(len(self.results)))
        return joined({name: one.columns() for name, one in zip(names, self.results, strict=True)})

    def __repr__(self) -> str:
        failed = int(np.count_nonzero(~self.converged))
        ending = f"; {failed} positions did not converge" if failed else ""
        return f"<ConditionsResult: {len(self.assemblies)} assemblies, the first {self.results[0]!r}{ending}>"
