"""Sections of a campaign file: one dataclass each.

A campaign names a base case, or a base set, and varies keys of it; `pmor.case` and `pmor.sets` check these keys, with
their own messages.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from pmor.case.reader import Sections
from pmor.core.ranges import Range
from pmor.results.quantities import OF_MESHES

Method = Literal["grid", "list", "csv", "sobol", "one_at_a_time"]
Solved = Literal["both", "pinion", "wheel"]
#: results of a tip relief that suits a design (`pmor.campaigns.relief`), found where they are asked for
OF_RELIEF = (
    "best_tip_relief_um", "best_tip_relief_start_pinion_roll_deg", "best_tip_relief_start_wheel_roll_deg",
    "best_ste_peak_to_peak_um",
)  # fmt: skip
STE = (
    "ste_mean_um", "ste_peak_to_peak_um", "ste_peak_to_peak_worst_um", "ste_order_1_um", "ste_order_2_um",
    "ste_order_3_um",
)  # fmt: skip
#: other results of pairs, and all of sets, by keys of `pmor.results.quantities`
USUAL = (
    *STE, "ste_mesh_error_percent", "mesh_stiffness_mean_N_per_mm_um", "mesh_stiffness_tangent_mean_N_per_mm_um",
    *OF_MESHES, "root_stress_pinion_MPa", "root_stress_wheel_MPa", "contact_ratio", "overlap_ratio",
    "centre_distance_mm", "mass_kg", "mass_pinion_kg", "mass_wheel_kg", "inertia_pinion_kg_m2", "inertia_wheel_kg_m2",
)  # fmt: skip
OF_SETS = (
    *STE, "k_gamma", "pin_force_max_N", "line_load_max_sun_planet_N_per_mm", "line_load_max_planet_ring_N_per_mm",
    "k_h_beta_sun_planet", "k_h_beta_planet_ring", "flank_pressure_max_MPa", "root_stress_sun_MPa",
    "root_stress_planet_MPa", "root_stress_ring_MPa", "root_stress_range_planet_MPa", "contact_ratio_sun_planet",
    "contact_ratio_planet_ring", "overlap_ratio", "speed_ratio", "mesh_phase_pitches", "centre_distance_mm",
    "planets_gap_mm", "outside_diameter_mm", "mass_kg", "mass_sun_kg", "mass_planet_kg", "mass_ring_kg",
)  # fmt: skip
#: of trains on fixed axes: of the whole, then of each mesh and gear
OF_TRAINS = (
    *STE, "share_max", "k_h_beta", "flank_pressure_max_MPa", "line_load_max_N_per_mm", "contact_ratio",
    "max_principal_MPa", "mass_kg",
)  # fmt: skip
OF_GEARBOXES = (
    "ste_mean_um", "ste_peak_to_peak_um", "ste_order_1_um", "k_h_beta", "f_beta_um", "flank_pressure_max_MPa",
    "root_stress_pinion_MPa", "root_stress_wheel_MPa", "k_gamma", "row_force_max_N", "carrier_along_um",
    "radial_force_N", "axial_force_N", "losses_W", "mass_kg",
)  # fmt: skip
#: of gearboxes in motion, found where they are asked for
OF_MOTION = ("mesh_force_N", "bearing_force_N", "radiated_power_mW")
if TYPE_CHECKING:
    ResultKey = str
    SetResultKey = str
    GearboxResultKey = str
else:
    ResultKey, SetResultKey = Literal[(*USUAL, *OF_RELIEF)], Literal[(*OF_SETS, *OF_TRAINS)]
    GearboxResultKey = Literal[(*OF_GEARBOXES, *OF_MOTION)]
# Ten times the work of a thousand cores in a day, at a minute for each design.
MOST_DESIGNS = 10_000_000


@dataclass(frozen=True, kw_only=True)
class DesignsSection:
    """The designs (section `[designs]`, beside the keys of the base file that it names).

    Parameters
    ----------
    method : {"grid", "list", "csv", "sobol", "one_at_a_time"}
        `grid`: every value with every other. `list`: the first values of all keys, the second ones, ... `csv`: a design
        per line of a file. `sobol`: spread evenly over lists and ranges. `one_at_a_time`: the first values of all keys,
        then each further one alone; the page has the band of each result, and the key that decides it.
    count : int or None
        Number of designs of Sobol's sequence.
    file : str or None
        CSV file beside the campaign file: keys of the base file in the first line, a design in each further one.
    keys : mapping
        Sections of the base file. One value is the same for all designs; a list or a range `{ from, to, steps }`
        differs.
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
    def frees(self) -> tuple[str, ...]:
        """Keys of the case that give way to them."""
        return ("pair.centre_distance_mm",) if self.centre_distance_mm is not None else ()

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
        Those that begin with `best_` are of the tip relief, equal on both gears, that suits each design under all
        torques: a search for each.
    """

    keys: tuple[ResultKey, ...] = USUAL


@dataclass(frozen=True, kw_only=True)
class Workers:
    """Limits of a process that solves designs (section `[workers]`).

    Parameters
    ----------
    time_limit_s : float
        Time for one design: a process without an answer by then is ended.
    memory_GiB : float or None
        Memory for one process; None is all that there is.
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
class SetRelations:
    """Relations that all sets keep (section `[relations]`); but for the ratio, keys of the set follow from them.

    Parameters
    ----------
    ratio : float or None
        Speed of the member with the torque over that of the one that it drives, by amount.
    ratio_tolerance_percent : float
        Largest deviation from the ratio; a design beyond is infeasible.
    planet_teeth_fewer : int or None
        Number by which the planet has fewer teeth than half the difference of ring and sun, rounded down.
    ring_diameter_mm : float or None
        Diameter of the reference circle of the ring: the module follows.
    bore_share : float or None
        Radii of the bores of sun and planet over those of their reference circles.
    centre_distance_mm : float or None
        Reached without backlash in both meshes by the profile shifts of sun and ring.
    solve : {"sun", "ring"} or None
        Member whose profile shift follows, so that neither mesh has backlash.
    """

    ratio: Annotated[float, Range(0.001, 1000.0)] | None = None
    ratio_tolerance_percent: Annotated[float, Range(0.0, 50.0, "%")] = 3.0
    planet_teeth_fewer: Annotated[int, Range(0, 10)] | None = None
    ring_diameter_mm: Annotated[float, Range(0.1, 1e5, "mm")] | None = None
    bore_share: Annotated[float, Range(0.05, 0.95)] | None = None
    centre_distance_mm: Annotated[float, Range(0.1, 1e5, "mm")] | None = None
    solve: Literal["sun", "ring"] | None = None

    @property
    def solved(self) -> tuple[str, ...]:
        """Keys of the set that follow from them, given nowhere else."""
        both = self.centre_distance_mm is not None
        follow = {
            "planet.teeth": self.planet_teeth_fewer is not None,
            "pair.module_mm": self.ring_diameter_mm is not None,
            "sun.bore_radius_mm": self.bore_share is not None,
            "planet.bore_radius_mm": self.bore_share is not None,
            "sun.profile_shift": both or self.solve == "sun",
            "ring.profile_shift": both or self.solve == "ring",
        }
        return tuple(name for name, follows in follow.items() if follows)

    @property
    def derived(self) -> tuple[str, ...]:
        """Keys of the set that stand in the row of a design beside its own."""
        return self.solved

    @property
    def frees(self) -> tuple[str, ...]:
        """Keys of the set that give way to them."""
        sizes = self.centre_distance_mm, self.ring_diameter_mm, self.solve
        return ("pair.centre_distance_mm",) if any(size is not None for size in sizes) else ()


@dataclass(frozen=True, kw_only=True)
class SetResults:
    """Which results are written (section `[results]`), all of them without this section.

    Parameters
    ----------
    keys : tuple of str
        In the units of their names; those of a mesh are the largest ones over the planets. Of trains, of each mesh and
        gear by its name.
    """

    keys: tuple[SetResultKey, ...] = tuple(dict.fromkeys((*OF_SETS, *OF_TRAINS)))


@dataclass(frozen=True, kw_only=True)
class GearboxRelations:
    """Relations that all gearboxes keep (section `[relations]`); profile shifts follow from them.

    Parameters
    ----------
    shifts : tuple of str
        Meshes whose profile shifts are found, so that they have no backlash at the distance of their shafts.
    solve : {"both", "pinion", "wheel"}
        Gear whose profile shift is found; both with the same shift.
    shift_sums : tuple of str
        Sets whose sums of profile shifts stay those of the base, and with them axes and backlash: sun and ring follow
        from the shift of the planets.
    """

    shifts: tuple[str, ...] = ()
    solve: Solved = "both"
    shift_sums: tuple[str, ...] = ()

    @property
    def solved(self) -> tuple[str, ...]:
        """Keys that follow from them, given nowhere else."""
        gears = ("pinion", "wheel") if self.solve == "both" else (self.solve,)
        return tuple(f"{mesh}.{gear}.profile_shift" for mesh in self.shifts for gear in gears) + self._of_sums

    @property
    def _of_sums(self) -> tuple[str, ...]:
        return tuple(f"{one}.{member}.profile_shift" for one in self.shift_sums for member in ("sun", "ring"))

    @property
    def derived(self) -> tuple[str, ...]:
        """Keys that stand in the row of a design beside its own: both shifts where one of them is found."""
        both = (f"{mesh}.{gear}.profile_shift" for mesh in self.shifts for gear in ("pinion", "wheel"))
        return (*both, *self._of_sums)

    @property
    def frees(self) -> tuple[str, ...]:
        """Keys that give way to them: none, since shafts have no centre distance."""
        return ()


@dataclass(frozen=True, kw_only=True)
class GearboxResults:
    """Which results are written (section `[results]`), all of them without this section.

    Parameters
    ----------
    keys : tuple of str
        Of each mesh, set and bearing by its name, or of the gearbox: the largest amount over the load cases.
        `mesh_force_N`, `bearing_force_N` and `radiated_power_mW` are those of motion over the speeds of `[dynamics]`.
    loads : tuple of str
        Load cases whose own results, but for those of motion, are written too, behind their names.
    """

    keys: tuple[GearboxResultKey, ...] = OF_GEARBOXES
    loads: tuple[str, ...] = ()


AnyRelations = Relations | SetRelations | GearboxRelations
AnyResults = ResultsSection | SetResults | GearboxResults


@dataclass(frozen=True, kw_only=True)
class CampaignSections:
    """A campaign file as it stands: what those of pairs, sets and gearboxes have in common.

    Parameters
    ----------
    title : str
        One line for the report; by default the name of the file.
    designs, relations, results, workers, store
        One dataclass per section.
    """

    title: str
    designs: DesignsSection
    relations: AnyRelations
    results: AnyResults
    workers: Workers = Workers()
    store: StoreSection = StoreSection()


@dataclass(frozen=True, kw_only=True)
class PairCampaign(CampaignSections):
    """A campaign file of gear pairs.

    Parameters
    ----------
    title : str
        One line for the report; by default the name of the file.
    case : str
        File of the base case, relative to this one.
    designs, relations, results, workers, store
        One dataclass per section.
    """

    case: str
    relations: Relations = Relations()
    results: ResultsSection = ResultsSection()


@dataclass(frozen=True, kw_only=True)
class SetCampaign(CampaignSections):
    """A campaign file of planetary sets or trains; `[designs]`, `[workers]` and `[store]` as in one of pairs.

    Parameters
    ----------
    title : str
        One line for the report; by default the name of the file.
    set : str
        File of the base set, relative to this one: TOML, or REXS with a planetary stage. Places in lists count from 1:
        `planets.tangential_um.1`, `pins.bearings.2.radial_N_per_mm`. Of trains designs change sections of gears and
        pairs, `[sweep]`, and `gears.NAME.x_mm`, `y_mm` and the numbers of `[[gears]]`.
    designs, relations, results, workers, store
        One dataclass per section.
    """

    set: str
    relations: SetRelations = SetRelations()
    results: SetResults = SetResults()


@dataclass(frozen=True, kw_only=True)
class GearboxCampaign(CampaignSections):
    """A campaign file of gearboxes; `[designs]`, `[workers]` and `[store]` as in one of pairs.

    Parameters
    ----------
    title : str
        One line for the report; by default the name of the file.
    gearbox : str
        File of the base gearbox, relative to this one: TOML or REXS. `[designs]` has keys of its meshes and sets behind
        their names (`high_speed.pinion.teeth`), `shafts.NAME.y_mm`, `z_mm` and `sections.1.outer_mm`, numbers of
        `bearings.NAME` and of what is in it (`bearings.NAME.roller.clearance_mm`), and `places.MESH.shift_mm`, of both
        gears along their shafts. Places in lists count from 1.
    designs, relations, results, workers, store
        One dataclass per section.
    """

    gearbox: str
    relations: GearboxRelations = GearboxRelations()
    results: GearboxResults = GearboxResults()


#: by the kinds of `pmor.campaigns.kinds`
RELATIONS: dict[str, type[AnyRelations]] = {"case": Relations, "set": SetRelations, "gearbox": GearboxRelations}
