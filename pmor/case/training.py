"""Sections of a case file for the training of a reduced model: `[reduction]`, `[offline]`."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pmor.core.ranges import Range, Torques

Deviations = Annotated[tuple[float, ...], Range(-1000.0, 1000.0, "um")]
Positions = Annotated[int, Range(4, 10_000)]
Shapes = Literal["line_loads", "flank_lines", "positions", "pod", "global_pod", "static_modes"]


@dataclass(frozen=True, kw_only=True)
class ReductionCase:
    """The reduced basis (section `[reduction]`).

    Parameters
    ----------
    shapes : {"line_loads", "flank_lines", "positions", "pod", "global_pod", "static_modes"}
        `line_loads`: compliance between flank nodes: exact, untrained; of the scheme `line` alone. `flank_lines`: a
        shape for each line of flank nodes, its load over the width trained. `positions`: one for each trained position
        and torque (the paper). `pod`: the same as modes at each position. `global_pod`: modes for all positions.
        `static_modes`: unit forces on all flank nodes: exact, untrained, most unknowns.
    interpolation : {"linear", "cubic"}
        Interpolation of shapes at positions and of modes (`pod`), over the roll position. The others are not
        interpolated.
    pod_tolerance : float
        Share of the energy of the snapshots that POD may discard.
    distribution_tolerance : float
        Tolerance of flank lines: a further load distribution over the width is kept where it carries more than this
        share of the first one's forces. Smaller for misaligned axes.
    error_estimate : bool
        Keep the data of an error bar of every online result in the basis. Line loads need none.
    """

    shapes: Shapes
    interpolation: Literal["linear", "cubic"] = "linear"
    pod_tolerance: Annotated[float, Range(0.0, 1.0, low_excluded=True, high_excluded=True)] = 1e-6
    distribution_tolerance: Annotated[float, Range(0.0, 1.0, low_excluded=True, high_excluded=True)] = 0.05
    error_estimate: bool = True

    @property
    def trained(self) -> bool:
        """Whether the shapes come from full solves."""
        return self.shapes not in ("line_loads", "static_modes")

    @property
    def by_line(self) -> bool:
        """Whether each shape belongs to a flank line, and not to a roll position."""
        return self.shapes in ("flank_lines", "static_modes")


@dataclass(frozen=True, kw_only=True)
class OfflineCase:
    """Training states of the basis (section `[offline]`).

    Parameters
    ----------
    sampling : {"grid", "sobol", "greedy"}
        `grid`: every angle with every torque and misalignment below. `sobol`: `solves` states spread evenly. `greedy`:
        one after the other where the error estimate is largest, until it is below the tolerance. The last two need
        shapes that are not interpolated.
    angles_per_pitch : int
        Training positions per angular pitch; of the greedy sampling, those that it begins with.
    torques_Nm : tuple of float
        Training torques in N m, increasing.
    in_plane_um, out_of_plane_um, centre_distance_um : tuple of float
        Misalignments of the wheel's axis in um (section `[misalignment]`), increasing.
    solves : int
        Full solves: of the Sobol sampling, and at most of the greedy one.
    tolerance_percent : float
        Largest error estimate over the STE at which the greedy sampling ends, per cent.
    """

    sampling: Literal["grid", "sobol", "greedy"] = "grid"
    angles_per_pitch: Positions = 40
    torques_Nm: Torques
    in_plane_um: Deviations = (0.0,)
    out_of_plane_um: Deviations = (0.0,)
    centre_distance_um: Deviations = (0.0,)
    solves: Annotated[int, Range(4, 10_000)] = 150
    tolerance_percent: Annotated[float, Range(0.0, 100.0, "%", low_excluded=True)] = 0.05
