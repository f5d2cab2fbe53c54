"""Sections of a design file: one dataclass each, the allowed range of each number beside its type."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from typing import Annotated, Literal

from pmor.core.ranges import Range, micrometres
from pmor.gear.modification import AmountKey, ExtentKey

VariableKey = Literal[AmountKey, ExtentKey]
Objective = Literal[
    "peak_to_peak_um", "order_1_um", "order_2_um", "order_3_um", "k_h_beta", "k_gamma", "mesh_force_N",
    "bearing_force_N", "radiated_power_mW",
]  # fmt: skip
ResultKey = Literal[Objective, "pressure_MPa", "tip_edge_load_N_per_mm", "root_stress_MPa"]
MISALIGNMENT_KEYS = ("in_plane_um", "out_of_plane_um", "centre_distance_um")
#: results of each variant under each torque
RESULTS: tuple[ResultKey, ...] = (
    "peak_to_peak_um", "order_1_um", "order_2_um", "order_3_um", "pressure_MPa", "k_h_beta", "tip_edge_load_N_per_mm",
    "root_stress_MPa", "k_gamma", "mesh_force_N", "bearing_force_N", "radiated_power_mW",
)  # fmt: skip
# Results of sets alone.
RESULTS_OF_SETS = ("k_gamma",)
# Results of a gearbox in motion: its meshes are solved for them where they are asked for.
RESULTS_OF_MOTION = ("mesh_force_N", "bearing_force_N", "radiated_power_mW")
# What an objective is of several meshes, unless it is that of one of them.
OVER_MESHES = ("sum", "worst")

Bounds = Annotated[tuple[float, ...], Range(-1000.0, 1000.0, in_order=True)]
Torques = Annotated[tuple[float, ...], Range(0.0, 1e12, "N m", low_excluded=True, in_order=True)]
Weights = Annotated[tuple[float, ...], Range(0.0, 1e6, in_order=True)]
Deviation = Annotated[float, micrometres(0.0, 200.0)]
Angle = Annotated[float, Range(0.0, 10.0, "deg")]
Step = Annotated[float, Range(0.0, 1000.0, low_excluded=True)]


@dataclass(frozen=True, kw_only=True)
class Variable:
    """A parameter of the modifications that is searched for (section `[[variables]]`).

    Parameters
    ----------
    key : str
        Key of a modification.
    gear : str
        Gear that it is of: `pinion`, `wheel`, or the same value on both; of a set a member: `sun`, `planet` (all
        alike), `ring`, or the name of a gear.
    mesh : str or None
        Mesh of a gearbox whose gear it is; None where one mesh is designed, or for the same value in all of them.
    flank : {"both", "drive", "coast"}
        Section `modification`, `coast_modification`, or the same value in both.
    range : tuple of float
        Lowest and highest value, in the unit of the key.
    step : float or None
        Step of manufacture: values are the lowest one plus whole steps; None is any value.
    """

    key: VariableKey
    gear: str = "both"
    mesh: str | None = None
    flank: Literal["both", "drive", "coast"] = "both"
    range: Bounds
    step: Step | None = None

    @property
    def name(self) -> str:
        """Key, after mesh, gear and flank where it is of one alone."""
        of = (part for part in (self.mesh, self.gear, self.flank) if part not in ("both", None))
        return ".".join([*map(str, of), self.key])

    @property
    def gears(self) -> tuple[str, ...]:
        """Gears that it is of."""
        return ("pinion", "wheel") if self.gear == "both" else (self.gear,)

    @property
    def flanks(self) -> tuple[str, ...]:
        """Flanks that it is of."""
        return ("drive", "coast") if self.flank == "both" else (self.flank,)


@dataclass(frozen=True, kw_only=True)
class Load:
    """Loads under which a design is judged (section `[load]`).

    Parameters
    ----------
    torques_Nm : tuple of float
        Torques on the pinion; by default those of the sweep of the case. Of a set, amounts of the torque of its file;
        by default that one and those of its sweep.
    names : tuple of str
        Load cases of the gearbox in the place of torques; by default all that carry on the same flanks as its first.
    weights : tuple of float
        How much each counts; by default as its time in the duty cycle of the gearbox, or all the same.
    """

    torques_Nm: Torques = ()
    names: tuple[str, ...] = ()
    weights: Weights = ()

    @property
    def labels(self) -> tuple[str, ...]:
        """Loads in words."""
        return self.names or tuple(f"{torque:g} N m" for torque in self.torques_Nm)

    @property
    def columns(self) -> tuple[str, ...]:
        """Loads as ends of the names of columns."""
        return tuple(re.sub(r"[^\w.+-]+", "_", label.replace(" N m", "_Nm")) for label in self.labels)

    def only(self, number: int) -> Load:
        """Return one of the loads alone."""
        chosen = slice(number, number + 1)
        return Load(torques_Nm=self.torques_Nm[chosen], names=self.names[chosen], weights=(1.0,))


@dataclass(frozen=True, kw_only=True)
class Goal:
    """The objective (section `[objective]`): the weighted mean of a result over the torques.

    Parameters
    ----------
    minimise : str
        `peak_to_peak_um`, `order_1_um` to `order_3_um`: STE, or an order of it. `k_h_beta`: largest face load factor of
        the meshes. `k_gamma`: mesh load factor of a set. Of a gearbox in motion `mesh_force_N`, `bearing_force_N`,
        `radiated_power_mW` (`[motion]`).
    meshes : str
        What counts of several meshes of a gearbox: `sum` of the result over them, `worst`, the largest one, or that of
        the mesh with this name.
    value : {"nominal", "expected", "percentile_95"}
        Without scatter; mean over it, or 95 % quantile. Constraints are on the same value.
    """

    minimise: Objective = "peak_to_peak_um"
    meshes: str = "sum"
    value: Literal["nominal", "expected", "percentile_95"] = "nominal"

    @property
    def key(self) -> str:
        """The result among those of a design, which names its mesh."""
        return self.minimise if self.meshes in OVER_MESHES else f"{self.meshes}.{self.minimise}"

    @property
    def unit(self) -> str:
        """Unit of the objective, as pages write it; empty of a factor."""
        units = {"um": "µm", "N": "N", "mW": "mW"}
        return units.get(self.minimise.rpartition("_")[2], "")

    @property
    def column(self) -> str:
        """Key of the objective in tables and plain data."""
        return "objective_um" if self.unit == "µm" else "objective"


@dataclass(frozen=True, kw_only=True)
class Constraint:
    """An upper bound (section `[[constraints]]`), under each torque.

    Parameters
    ----------
    result : str
        An objective, or `pressure_MPa`: largest of Hertz where no sharp tip edge carries; `tip_edge_load_N_per_mm`:
        largest line load at the edge of a tip, 0 keeps it clear; `root_stress_MPa`: largest principal stress at the
        roots. Of a set the largest of all meshes.
    mesh : str or None
        Mesh of a gearbox that it is of; None is the largest of all.
    at_most : float
        Limit in the unit of the result.
    """

    result: ResultKey
    mesh: str | None = None
    at_most: Annotated[float, Range(0.0, 1e6)]

    @property
    def key(self) -> str:
        """The result among those of a design, which names its mesh."""
        return self.result if self.mesh is None else f"{self.mesh}.{self.result}"


@dataclass(frozen=True, kw_only=True)
class InMotion:
    """The gearbox in motion (section `[motion]`), by `[dynamics]` of its file: where results of motion count.

    `mesh_force_N` is the dynamic force of the mesh, `bearing_force_N` that of a bearing, `radiated_power_mW` the
    equivalent radiated power of the housing: root mean square of all lines, over the speeds.

    Parameters
    ----------
    bearing : str or None
        Bearing of the gearbox; None is the one that the mesh loads most.
    percentile : float
        Percentile over the speeds: 100 is the largest.
    speeds : int
        Number of speeds over the range.
    """

    bearing: str | None = None
    percentile: Annotated[float, Range(0.0, 100.0, "%")] = 100.0
    speeds: Annotated[int, Range(2, 10_000)] = 100


@dataclass(frozen=True, kw_only=True)
class Scatter:
    """Standard deviations of manufacture and mounting (section `[scatter]`), normal and independent of each other.

    Of a set of all flanks of all gears, and pins by its `[tolerances]`. Under a nominal objective for the best variant
    alone.

    Parameters
    ----------
    tip_relief_um, root_relief_um, profile_crowning_um, profile_slope_um : float
        Tolerance of the amount of this name, um.
    helix_crowning_um, helix_slope_um, end_relief_um, twist_um : float
        Tolerance of the amount of this name, um.
    tip_relief_start_roll_deg, root_relief_end_roll_deg : float
        Tolerance of where reliefs start and end, degrees, where a roll angle says it.
    in_plane_um, out_of_plane_um, centre_distance_um : float
        Tolerance of the place of the axes, um.
    draws : int
        Pairs or sets that are drawn, the same for all variants.
    """

    tip_relief_um: Deviation = 0.0
    root_relief_um: Deviation = 0.0
    profile_crowning_um: Deviation = 0.0
    profile_slope_um: Deviation = 0.0
    helix_crowning_um: Deviation = 0.0
    helix_slope_um: Deviation = 0.0
    end_relief_um: Deviation = 0.0
    twist_um: Deviation = 0.0
    tip_relief_start_roll_deg: Angle = 0.0
    root_relief_end_roll_deg: Angle = 0.0
    in_plane_um: Deviation = 0.0
    out_of_plane_um: Deviation = 0.0
    centre_distance_um: Deviation = 0.0
    draws: Annotated[int, Range(8, 4096)] = 64

    @property
    def modifications(self) -> dict[str, float]:
        """Standard deviations of the keys of a modification that scatter."""
        keys = [field.name for field in fields(self) if field.name not in (*MISALIGNMENT_KEYS, "draws")]
        return {key: getattr(self, key) for key in keys if getattr(self, key) > 0.0}

    @property
    def axes(self) -> dict[str, float]:
        """Standard deviations of the axes that scatter."""
        return {key: getattr(self, key) for key in MISALIGNMENT_KEYS if getattr(self, key) > 0.0}


@dataclass(frozen=True, kw_only=True)
class Search:
    """The effort of the search (section `[search]`).

    Parameters
    ----------
    samples : int
        Variants spread evenly over the ranges by a Sobol sequence.
    descents : int
        Number of the best samples from which a descent starts.
    angles : int
        Pinion angles per pitch.
    """

    samples: Annotated[int, Range(2, 1_000_000)] = 256
    descents: Annotated[int, Range(1, 1000)] = 4
    angles: Annotated[int, Range(8, 400)] = 32


@dataclass(frozen=True, kw_only=True)
class Trade:
    """The trade against a second result (section `[pareto]`).

    Parameters
    ----------
    against : str
        The second result: its largest value over the torques.
    points : int
        Number of bounds on it; the objective is minimised under each.
    """

    against: ResultKey = "pressure_MPa"
    points: Annotated[int, Range(0, 100)] = 5


@dataclass(frozen=True, kw_only=True)
class Design:
    """Everything that a design file says, checked.

    Parameters
    ----------
    title : str
        One line for the report; by default the name of the file.
    case : str
        Case file, relative to this one.
    gearbox : str
        Gearbox file in place of a case, TOML or REXS, relative to this one.
    mesh : tuple of str
        Meshes of the gearbox that are designed together, on what their hubs stand on under each load; without it all.
    set : str
        Set file in place of a case, TOML or REXS, relative to this one, whose members are designed.
    variables : tuple of Variable
    load, objective, constraints, motion, scatter, search, pareto
        One dataclass per section of the file.
    """

    title: str
    case: str | None = None
    gearbox: str | None = None
    mesh: tuple[str, ...] = ()
    set: str | None = None
    variables: tuple[Variable, ...] = ()
    load: Load
    objective: Goal
    constraints: tuple[Constraint, ...] = ()
    motion: InMotion = InMotion()
    scatter: Scatter
    search: Search
    pareto: Trade

    @property
    def scatters(self) -> bool:
        """Whether the objective is a value over scatter."""
        return self.objective.value != "nominal"

    @property
    def results(self) -> tuple[str, ...]:
        """Results of each variant; root stress only if a constraint or the front needs it.

        Of several meshes after those of all of them also each one's, behind the name of the mesh.
        """
        asked = {c.result for c in self.constraints} | {self.pareto.against, self.objective.minimise}
        left_out = {"root_stress_MPa", *RESULTS_OF_MOTION, *(() if self.set else RESULTS_OF_SETS)} - asked
        keys = tuple(key for key in RESULTS if key not in left_out)
        return keys + tuple(f"{mesh}.{key}" for mesh in self.several for key in keys)

    @property
    def moves(self) -> bool:
        """Whether results of motion are asked for."""
        return bool({key.rpartition(".")[2] for key in self.results} & set(RESULTS_OF_MOTION))

    @property
    def several(self) -> tuple[str, ...]:
        """Meshes that are designed together; empty of one, and of a set, which is solved as a whole."""
        return self.mesh if len(self.mesh) > 1 else ()
