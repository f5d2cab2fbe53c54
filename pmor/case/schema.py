"""Sections of a case file: one dataclass each, the allowed range of each number beside its type.

The ranges are wide enough for extreme gears; they exist to catch slips, above all wrong units.
"""

import math
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Literal, Self

from pmor.case.blank import BlankCase, HolesCase
from pmor.case.duty import Lubricant, TimedLoad
from pmor.case.dynamics import DynamicsCase
from pmor.case.gears import GearCase, PairCase
from pmor.case.reader import INLINE
from pmor.case.tolerances import PairTolerances
from pmor.case.training import OfflineCase, Positions, ReductionCase
from pmor.core.ranges import Range, SignedTorque, Torque, Torques
from pmor.core.shown import html_table
from pmor.gear.condition import Misalignment
from pmor.gear.modification import UNMODIFIED, Modification

Subdivisions = Annotated[int, Range(1, 64)]
Width = Literal["half", "whole", "plane_strain"]
Scheme = Literal["line", "direct", "paper", "facet"]
PictureFormat = Literal["png", "svg", "pdf"]


@dataclass(frozen=True, kw_only=True)
class MeshCase:
    """The finite-element mesh of one tooth sector (section `[mesh]`).

    Parameters
    ----------
    profile_elements : int
        Elements along one flank, from the start of the involute to the tip.
    width_elements : int
        Elements over the whole face width, of each gear.
    element : {"hex20", "hex8i", "hex8"}
        Quadratic hexahedron, or linear ones with or without incompatible modes.
    width : {"half", "whole", "plane_strain"}
        `half`: half of the face width where the pair is symmetric, else the whole. `plane_strain`: one layer of
        elements without axial displacement.
    spacing : {"arc_length", "roll_angle"}
        Measure in which the flank nodes are equally spaced along the profile.
    share_identical : bool
        Mesh gears of one shape once, and solve the finite elements of identical gears once.
    error_bar : bool
        Solve the gears on half as many elements too, for an error bar of the mesh on the STE; of sets and gearboxes
        where they ask for it.
    """

    profile_elements: Annotated[int, Range(2, 512)] = 8
    width_elements: Annotated[int, Range(1, 512)] = 4
    width: Width = "half"
    element: Literal["hex20", "hex8i", "hex8"] = "hex20"
    spacing: Literal["arc_length", "roll_angle"] = "arc_length"
    share_identical: bool = True
    error_bar: bool = True

    @property
    def order(self) -> int:
        """Intervals between nodes along the edge of an element."""
        return 2 if self.element == "hex20" else 1

    @property
    def profile_intervals(self) -> int:
        """Intervals between nodes along one flank."""
        return self.order * self.profile_elements


@dataclass(frozen=True, kw_only=True)
class ContactCase:
    """Contact surface and contact law (section `[contact]`).

    Parameters
    ----------
    scheme : {"line", "direct", "paper", "facet"}
        `line`: exact flanks, a line load per section, local compliance in closed form. By penalty: `direct`: points of
        Hermite patches through the deformed nodes, projected on the mate's; `paper`: on its bilinear facets (Cosco et
        al. 2016); `facet`: facets all through.
    slave : {"tip", "pinion", "wheel", "both"}
        Gear whose points are projected on its mate: the one whose tip is nearer, a fixed one, or both with half the
        penalty each.
    edge_normals : {"parabolic", "average"} or None
        Node normals at the edges of Hermite patches: one-sided parabolic fit, or the plain average, which the scheme
        `paper` takes by default.
    lodm_profile : int
        Level-of-detail magnification of the penalty schemes: subdivisions of an element over the profile.
    lodm_width : int
        The same over the width.
    penalty_N_mm3 : float
        Contact penalty in N/mm3: pressure per penetration. Lines have none.
    layer_depth : float
        Depth, in modules, of the layer below the flank that the closed form of `line` replaces.
    """

    scheme: Scheme = "line"
    slave: Literal["tip", "pinion", "wheel", "both"] = "tip"
    edge_normals: Literal["parabolic", "average"] | None = None
    lodm_profile: Subdivisions = 4
    lodm_width: Subdivisions = 1
    penalty_N_mm3: Annotated[float, Range(0.0, 1e15, "N/mm3", low_excluded=True)] = 1e6
    layer_depth: Annotated[float, Range(0.05, 1.0, "modules")] = 0.4

    @property
    def kind(self) -> Literal["line", "nodal"]:
        """Unknowns of contact: lines on exact flanks, or points of surfaces through nodes."""
        return "line" if self.scheme == "line" else "nodal"


@dataclass(frozen=True, kw_only=True)
class ConditionCase:
    """One of a list of conditions that are swept beside the case's own (section `[[condition]]`).

    `[condition.pinion]` and `[condition.wheel]` hold keys of modifications: they replace those of the case.

    Parameters
    ----------
    name : str
        Names the condition in results; no two have the same.
    torque_Nm : float
        Torque on the pinion in N m; a negative one loads the coast flanks.
    misalignment : Misalignment
        Its keys stand among those of the condition.
    pinion, wheel : Modification
        Of their flanks, complete.
    """

    name: str
    torque_Nm: SignedTorque
    misalignment: Annotated[Misalignment, INLINE]
    pinion: Modification
    wheel: Modification


@dataclass(frozen=True, kw_only=True)
class OnlineCase:
    """The reduced sweep (section `[online]`).

    Parameters
    ----------
    angles_per_pitch : int
        Positions per angular pitch; by default 32 of a sweep that by default spans several pitches.
    pitches : int, "revolution" or "hunting", or None
        Angular pitches that the sweep spans; None is as many as it takes until holes, or teeth with deviations, stand
        as before: one where all are alike. `revolution`: one of the pinion. `hunting`: until the same two teeth meet
        again.
    torques_Nm : tuple of float
        Torques in N m, increasing; the nominal one is among them, and those of `[[loads]]` are.
    extrapolate : bool
        Allow torques and a misalignment beyond the training, where only the error bar tells the accuracy.
    """

    angles_per_pitch: Positions = 200
    pitches: Annotated[int, Range(1, 100_000)] | Literal["revolution", "hunting"] | None = None
    torques_Nm: Torques
    extrapolate: bool = False


@dataclass(frozen=True, kw_only=True)
class CompareCase:
    """Comparison of the reduced with the full model (section `[compare]`).

    Parameters
    ----------
    angles : int
        Number of angles that were not trained, spread over one pitch by a seeded draw.
    torques_Nm : tuple of float
        Torques in N m, increasing.
    models : tuple of {"line", "direct", "paper", "facet"} or None
        Reduced models held against each other, by their contact schemes: `paper` has the shapes `positions`, `line`
        `line_loads`, the others `flank_lines`. The case's own is always among them.
    largest_error_percent : float
        Largest difference of STE between reduced model and full FE, in percent of the deflection: a larger one is
        named, with exit code 3.
    """

    angles: Annotated[int, Range(1, 10_000)] = 40
    torques_Nm: Torques
    models: tuple[Scheme, ...] | None = None
    largest_error_percent: Annotated[float, Range(0.0, 1e6, "%", low_excluded=True)] = 1.0


@dataclass(frozen=True, kw_only=True)
class ResultsCase:
    """Results of the sweep of exact line loads beside the transmission error (section `[results]`).

    Parameters
    ----------
    maps : bool
        Largest line load, pressure and half-width at each point of the flanks, and the contact pattern at a hundredth
        of the nominal torque.
    harris_torques_Nm : tuple of float
        Torques in N m, increasing, of the Harris map: transmission error and its peak-to-peak over torque.
    root_stress : bool
        Stress along both root fillets of the loaded teeth. The basis then holds its shapes.
    """

    maps: bool = True
    harris_torques_Nm: Torques
    root_stress: bool = True


@dataclass(frozen=True, kw_only=True)
class OutputCase:
    """Files of `pmor run` beside numbers (section `[output]`).

    Parameters
    ----------
    plots : bool
        Pictures of the curves, the mesh and the contact pattern.
    report : bool
        One self-contained HTML page.
    live_page : bool
        The page solves the pair anew as its reader changes flanks, load and axes, on the whole width.
    format : tuple of {"png", "svg", "pdf"}
        Format of the picture files; the page holds SVG.
    """

    plots: bool = True
    report: bool = True
    live_page: bool = True
    format: tuple[PictureFormat, ...] = ("svg",)


@dataclass(frozen=True, kw_only=True)
class LoadCase:
    """The nominal load (section `[load]`).

    Parameters
    ----------
    torque_Nm : float
        Torque on the pinion in N m. In a file, a negative one loads the coast flanks.
    speed_rpm : float or None
        Speed of the pinion in revolutions per minute, for the frequencies of the data sheet; None is left out.
    """

    torque_Nm: Torque
    speed_rpm: Annotated[float, Range(0.0, 1e7, "1/min", low_excluded=True)] | None = None


@dataclass(frozen=True, kw_only=True, repr=False)
class Case:
    """Content of a case file, checked.

    Parameters
    ----------
    name : str
        Stem of the file name; it names the output folder.
    title : str
        One line for the report.
    torque_Nm : float
        Nominal torque on the pinion in N m.
    speed_rpm : float or None
        Speed of the pinion in revolutions per minute.
    pair, mesh, contact, misalignment, reduction, offline, online, compare, results, dynamics, output
        One dataclass per section of the file.
    pinion_modification, wheel_modification : Modification
        Of the loaded flanks (sections `[pinion.modification]` and `[wheel.modification]`).
    conditions : tuple of ConditionCase
        Swept beside the case's own condition.
    loads : tuple of TimedLoad
        Of a duty cycle (sections `[[loads]]`).
    lubricant : Lubricant
    tolerances : PairTolerances or None
        Without them no pairs are drawn.
    flank : {"drive", "coast"}
        Flanks that carry. A case of coast flanks is the mirrored pair (`pmor.case.coast`), its torques are amounts.
    other_flanks : (Modification, Modification)
        Of the flanks of pinion and wheel that do not carry.
    text : str
        The text of the file, for provenance.
    """

    name: str
    title: str
    torque_Nm: float
    speed_rpm: float | None = None
    pair: PairCase
    pinion_modification: Modification = UNMODIFIED
    wheel_modification: Modification = UNMODIFIED
    conditions: tuple[ConditionCase, ...] = ()
    loads: tuple[TimedLoad, ...] = ()
    lubricant: Lubricant = Lubricant()
    tolerances: PairTolerances | None = None
    flank: Literal["drive", "coast"] = "drive"
    other_flanks: tuple[Modification, Modification] = (UNMODIFIED, UNMODIFIED)
    mesh: MeshCase
    contact: ContactCase
    misalignment: Misalignment
    reduction: ReductionCase
    offline: OfflineCase
    online: OnlineCase
    compare: CompareCase
    results: ResultsCase
    dynamics: DynamicsCase
    output: OutputCase
    text: str

    @property
    def pitches(self) -> int:
        """Angular pitches that the sweep spans."""
        pinion, wheel = self.pair.pinion.teeth, self.pair.wheel.teeth
        if isinstance(self.online.pitches, str):
            return {"revolution": pinion, "hunting": math.lcm(pinion, wheel)}[self.online.pitches]
        return self.online.pitches or self.repeats_after

    @property
    def repeats_after(self) -> int:
        """Angular pitches after which holes, lugs and teeth that differ stand to the mesh as before."""
        listed = ((condition.pinion, condition.wheel) for condition in self.conditions)
        return self.pair.repeats_with([(self.pinion_modification, self.wheel_modification), *listed])

    @property
    def asked_torques_Nm(self) -> dict[str, tuple[float, ...]]:
        """All torques that training, sweeps, comparison and motion ask for, N m, by the key that says them."""
        asked = {
            "[load] torque_Nm": (self.torque_Nm,), "[online] torques_Nm": self.online.torques_Nm,
            "[compare] torques_Nm": self.compare.torques_Nm,
        }  # fmt: skip
        if self.reduction.trained:
            asked["[offline] torques_Nm"] = self.offline.torques_Nm
        if self.conditions:
            asked["[[condition]] torque_Nm"] = tuple(abs(condition.torque_Nm) for condition in self.conditions)
        if self.contact.kind == "line":
            asked["[results] harris_torques_Nm"] = self.results.harris_torques_Nm
            asked["[dynamics] torques_Nm"] = self.dynamics.torques_Nm
        return asked

    @property
    def root_stress(self) -> bool:
        """Whether the basis holds the stress along the root fillets: of exact line loads, unless it is not wanted."""
        return self.results.root_stress and self.contact.kind == "line"

    @property
    def web_stress(self) -> bool:
        """Whether the basis holds the stress on the web of a gear."""
        gears = self.pair.pinion, self.pair.wheel
        return any(gear.blank is not None and gear.blank.stress for gear in gears)

    def without_stress(self) -> Self:
        """Return the case without the stress along root fillets and on webs."""
        case = self.without_web_stress()
        return replace(case, results=replace(case.results, root_stress=False))

    def without_web_stress(self) -> Self:
        """Return the case without the stress on webs."""
        pinion, wheel = (
            replace(gear, blank=gear.blank and replace(gear.blank, stress=False))
            for gear in (self.pair.pinion, self.pair.wheel)
        )
        return replace(self, pair=replace(self.pair, pinion=pinion, wheel=wheel))

    def _repr_html_(self) -> str:
        pinion, wheel = (asdict(gear) for gear in (self.pair.pinion, self.pair.wheel))
        columns = {"": list(pinion), "pinion": list(pinion.values()), "wheel": list(wheel.values())}
        return html_table(repr(self), columns)

    def __repr__(self) -> str:
        pair, mesh = self.pair, self.mesh
        return (
            f"<Case {self.name!r}: {pair.pinion.teeth}/{pair.wheel.teeth} teeth, module {pair.module_mm:g} mm,"
            f" face width {pair.face_width_mm:g} mm, {self.torque_Nm:g} N m, {self.contact.scheme},"
            f" {mesh.profile_elements} x {mesh.width_elements} elements>"
        )


#: sections of a case file, in their order
SECTIONS: dict[str, type] = {
    "load": LoadCase,
    "pair": PairCase,
    "pinion": GearCase,
    "wheel": GearCase,
    "pinion.modification": Modification,
    "wheel.modification": Modification,
    "pinion.coast_modification": Modification,
    "wheel.coast_modification": Modification,
    "pinion.blank": BlankCase,
    "wheel.blank": BlankCase,
    "pinion.blank.holes": HolesCase,
    "wheel.blank.holes": HolesCase,
    "mesh": MeshCase,
    "contact": ContactCase,
    "misalignment": Misalignment,
    "reduction": ReductionCase,
    "offline": OfflineCase,
    "online": OnlineCase,
    "compare": CompareCase,
    "results": ResultsCase,
    "dynamics": DynamicsCase,
    "lubricant": Lubricant,
    "tolerances": PairTolerances,
    "output": OutputCase,
}
