"""Sections of a campaign file: one dataclass each.

A campaign names a base case and varies keys of it; `pmor.case` checks these keys, with its own messages.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, get_args

from pmor.case.reader import Sections
from pmor.core.errors import printable
from pmor.core.ranges import Range

Method = Literal["grid", "list", "csv", "sobol"]
Solved = Literal["both", "pinion", "wheel"]
Number = int | float
ReliefKey = Literal[
    "best_tip_relief_um", "best_tip_relief_start_pinion_roll_deg", "best_tip_relief_start_wheel_roll_deg",
    "best_ste_peak_to_peak_um",
]  # fmt: skip
UsualKey = Literal[
    "ste_mean_um", "ste_peak_to_peak_um", "ste_peak_to_peak_worst_um", "ste_order_1_um", "ste_order_2_um",
    "ste_order_3_um", "ste_mesh_error_percent", "mesh_stiffness_mean_N_per_mm_um",
    "mesh_stiffness_tangent_mean_N_per_mm_um", "flank_pressure_max_MPa", "k_h_beta", "root_stress_pinion_MPa",
    "root_stress_wheel_MPa", "contact_ratio", "overlap_ratio", "effective_contact_ratio", "centre_distance_mm",
    "mass_kg", "mass_pinion_kg", "mass_wheel_kg", "inertia_pinion_kg_m2", "inertia_wheel_kg_m2",
]  # fmt: skip
ResultKey = Literal[UsualKey, ReliefKey]
#: results without those of the best relief
USUAL: tuple[UsualKey, ...] = get_args(UsualKey)
OF_RELIEF: tuple[ReliefKey, ...] = get_args(ReliefKey)
# Ten times the work of a thousand cores in a day, at a minute for each design.
MOST_DESIGNS = 10_000_000


@dataclass(frozen=True)
class Span:
    """Values between two bounds, which belong to them.

    Parameters
    ----------
    low, high : int or float
    whole : bool
        Whether all values are whole numbers.
    """

    low: Number
    high: Number
    whole: bool


@dataclass(frozen=True)
class Variable:
    """A key of the case that differs from design to design.

    Parameters
    ----------
    name : str
        Section and key, such as ``pinion.teeth``.
    values : tuple of numbers, or Span
        The latter in Sobol's sequence alone.
    """

    name: str
    values: tuple[Number, ...] | Span


@dataclass(frozen=True, kw_only=True)
class DesignsSection:
    """The designs (section `[designs]`, beside the keys of the case that it names).

    Parameters
    ----------
    method : {"grid", "list", "csv", "sobol"}
        `grid`: every value with every other. `list`: the first values of all keys, the second ones, and so on. `csv`:
        one design per line of a file. `sobol`: spread evenly over lists and ranges.
    count : int or None
        Number of designs of Sobol's sequence.
    file : str or None
        CSV file beside the campaign file: keys of the case in the first line, a design in each further one.
    keys : mapping
        Sections of the case. One value is the same for all designs; a list or a range `{ from, to, steps }` differs.
    """

    method: Method
    count: Annotated[int, Range(1, MOST_DESIGNS)] | None = None
    file: str | None = None
    keys: Sections


@dataclass(frozen=True, kw_only=True)
class Relations:
    """Relations that all designs keep (section `[relations]`); keys of the case follow from it.

    Parameters
    ----------
    ratio : float or None
        Teeth of the wheel over those of the pinion: the wheel takes the nearest whole number.
    ratio_tolerance_percent : float
        Largest deviation from the ratio by that rounding; a design beyond is infeasible.
    centre_distance_mm : float or None
        Reached without backlash by profile shifts.
    solve : {"both", "pinion", "wheel"}
        Gear whose profile shift is found for it; both with the same shift.
    """

    ratio: Annotated[float, Range(0.01, 100.0)] | None = None
    ratio_tolerance_percent: Annotated[float, Range(0.0, 50.0, "%")] = 3.0
    centre_distance_mm: Annotated[float, Range(0.1, 1e5, "mm")] | None = None
    solve: Solved = "both"

    @property
    def solved(self) -> tuple[str, ...]:
        """Keys of the case that follow from them, given nowhere else."""
        teeth = ("wheel.teeth",) if self.ratio is not None else ()
        gears = ("pinion", "wheel") if self.solve == "both" else (self.solve,)
        shifts = tuple(f"{gear}.profile_shift" for gear in gears) if self.centre_distance_mm is not None else ()
        return teeth + shifts

    @property
    def derived(self) -> tuple[str, ...]:
        """Keys of the case that stand in the row of a design beside its own: both shifts where one of them is found."""
        mate = {"pinion": ("wheel.profile_shift",), "wheel": ("pinion.profile_shift",), "both": ()}[self.solve]
        return self.solved + (mate if self.centre_distance_mm is not None else ())


@dataclass(frozen=True, kw_only=True)
class ResultsSection:
    """Which results are written (section `[results]`), those of a run without this section.

    Parameters
    ----------
    keys : tuple of str
        Keys that begin with `best_` are of the tip relief that suits each design under all torques of the sweep, the
        same amount on both gears: they take a search for each design.
    """

    keys: tuple[ResultKey, ...] = USUAL


@dataclass(frozen=True, kw_only=True)
class Workers:
    """Limits of a process that solves designs (section `[workers]`).

    Parameters
    ----------
    time_limit_s : float
        For one design: a process without an answer by then is ended.
    memory_GiB : float or None
        For one process; None is all that there is.
    """

    time_limit_s: Annotated[float, Range(0.1, 1e6, "s")] = 900.0
    memory_GiB: Annotated[float, Range(0.25, 1e5, "GiB")] | None = None


@dataclass(frozen=True, kw_only=True)
class StoreSection:
    """The store of compliances of single gears, for other designs and other campaigns (section `[store]`).

    Parameters
    ----------
    folder : str
        Relative to the folder in which the command runs.
    limit_GiB : float
        Its largest size: entries unused for longest go first. 0 is no store.
    """

    folder: str = "out/compliances"
    limit_GiB: Annotated[float, Range(0.0, 1e5, "GiB")] = 5.0


@dataclass(frozen=True, kw_only=True)
class CampaignSections:
    """A campaign file as it stands.

    Parameters
    ----------
    title : str
        One line for the report; by default the name of the file.
    case : str
        File of the base case, relative to this one.
    designs, relations, results, workers, store
        One dataclass per section.
    """

    title: str
    case: str
    designs: DesignsSection
    relations: Relations = Relations()
    results: ResultsSection = ResultsSection()
    workers: Workers = Workers()
    store: StoreSection = StoreSection()


@dataclass(frozen=True)
class Campaign:
    """A campaign, its base case and its table of designs read.

    Parameters
    ----------
    sections : CampaignSections
        The campaign file as it stands.
    inputs : tuple of Path
        Files that were read: of the campaign, of the base case, of the table of designs if it is a CSV file.
    source_text : str
        Of the campaign file.
    text : str
        All that the results are made from: campaign file, table of designs, base case.
    base_text : str
        TOML text of the base case with the keys that all designs have in common; it names no further file.
    variables : tuple of Variable
    count : int
        Number of designs.
    """

    sections: CampaignSections
    inputs: tuple[Path, ...]
    source_text: str
    text: str
    base_text: str
    variables: tuple[Variable, ...]
    count: int

    @property
    def name(self) -> str:
        """Stem of the file name."""
        return printable(self.inputs[0].stem)

    @property
    def results(self) -> tuple[str, ...]:
        """Keys of the results that are written, in the order of the tables."""
        return tuple(key for key in (*USUAL, *OF_RELIEF) if key in self.sections.results.keys)

    @property
    def whole(self) -> tuple[str, ...]:
        """Columns of whole numbers."""
        listed = {v.name: v.values for v in self.variables}
        kinds = {name: values.whole if isinstance(values, Span) else isinstance(values[0], int)
                 for name, values in listed.items()}  # fmt: skip
        return tuple(name for name in self.columns if kinds.get(name, name == "wheel.teeth"))

    @property
    def columns(self) -> tuple[str, ...]:
        """Keys of the case that differ between designs, or follow from relations."""
        named = tuple(variable.name for variable in self.variables)
        return named + tuple(name for name in self.sections.relations.derived if name not in named)
