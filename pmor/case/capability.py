"""What can be asked of which machine: one table of limits, each with its reason and a remedy.

A limit belongs to something that gears, meshes or supports of a machine have. Case, set and gearbox files come here as
their readers return them; `tests.programs.capability_page` makes the page of the manual from the same table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from pmor.case.schema import Case
from pmor.core.errors import CaseError

Capability = Literal[
    "campaign", "classical", "design", "duty", "dynamics", "error_bar", "exudyn", "fmu", "full", "gearbox", "losses",
    "page", "plan", "pressure", "python", "quiet", "rexs", "root_stress", "set", "stability", "sweep", "tables",
    "tolerances", "vtkhdf", "what_if",
]  # fmt: skip

# In words, in the order of the page of the manual.
NAMES: dict[Capability, str] = {
    "sweep": "a sweep", "full": "the comparison with full FE", "error_bar": "the error bar of the mesh",
    "what_if": "a change of flanks without finite elements", "root_stress": "the root stress",
    "pressure": "the flank pressure", "losses": "the table of losses", "duty": "a duty cycle",
    "tolerances": "a run with tolerances", "design": "a design",
    "campaign": "a campaign", "page": "the live page", "vtkhdf": "a VTKHDF file", "rexs": "a REXS file",
    "tables": "the file of all numbers, results.h5,", "python": "a model in Python", "plan": "a plan",
    "dynamics": "motion", "fmu": "a unit for co-simulation",
    "exudyn": "a mesh in exudyn", "classical": "the table of classical formulas", "gearbox": "a gearbox",
    "set": "a set", "stability": "the matrix of stability", "quiet": "a design for quiet",
}  # fmt: skip
# Columns of the page of the manual: what is asked of every machine.
ASKED: tuple[Capability, ...] = tuple(NAMES)[:18]
# Nodes of a flank beyond which its compliance takes more of a page than all else: 8 x 8 quadratic elements have 289.
MOST_NODES = 600
# Pitches after which teeth and bodies of a mesh in motion stand as before: gears have up to some hundred teeth.
MOST_PITCHES = 250
# Keys of gears and flanks that differ from end to end: files of sets have one planet for both of its meshes.
ONE_WAY = ("face_offset_mm", "topography")


@dataclass(frozen=True)
class Limit:
    """What some capabilities do not take, and what they take instead.

    Parameters
    ----------
    of : callable
        Whether a machine, or a case of one, has it.
    asks : tuple
        Capabilities that do not take it.
    takes : str or callable
        What they take, with the reason, and a remedy; from the machine where that depends on it.
    """

    of: Callable[[Any], Any]
    asks: tuple[Capability, ...]
    takes: str | Callable[[Any], str]


def _always(machine: Any) -> bool:
    return True


def _gears(case: Case) -> tuple[Any, Any]:
    return case.pair.pinion, case.pair.wheel


def _nodes(case: Case) -> int:
    across = 1 if case.mesh.width == "plane_strain" else case.mesh.width_elements
    return (case.mesh.profile_intervals + 1) * (case.mesh.order * across + 1)


def _untrained(case: Case) -> str:
    return (
        f'line loads, not "{case.reduction.shapes}": set [contact] scheme = "line", [reduction] shapes = "line_loads"'
    )


OF_CASES = (
    Limit(lambda case: case.reduction.shapes != "line_loads",
          ("campaign", "design", "duty", "dynamics", "exudyn", "fmu", "gearbox", "page", "rexs", "set",
           "tolerances"), _untrained),
    Limit(lambda case: case.flank != "drive",
          ("exudyn", "fmu"),
          "drive flanks: give [load] torque_Nm positive, and the coast flanks as a [[condition]]"),
    Limit(lambda case: _tooth_keys(case), ("exudyn", "fmu"), lambda case: (
          "teeth that are alike, as it repeats with each mesh cycle: leave out " + " and ".join(_tooth_keys(case)))),
    Limit(lambda case: _measured(case), ("rexs",),
          lambda case: f"teeth that differ in their pitch alone: leave out {' and '.join(_measured(case))}"),
    Limit(lambda case: case.pair.wheel.internal, ("stability",),
          "external gears, and the wheel is a ring"),
    Limit(lambda case: _nodes(case) > MOST_NODES, ("page",),
          lambda case: f"flanks of {MOST_NODES} nodes at most, and these have {_nodes(case)}: lower "
          "[mesh] profile_elements or width_elements"),
    Limit(lambda case: case.pair.wheel.rim_gives, ("classical", "exudyn", "fmu"),
          "rings that are rigid all over their outside: leave held and seats out of [wheel]"),
    Limit(lambda case: case.pair.wheel.rim_gives, ("vtkhdf",),
          "rings that are rigid all over their outside, as it shows all teeth by one sector, and lugs make teeth "
          "differ: leave held and seats out of [wheel]"),
    Limit(lambda case: case.pair.wheel.rim_gives, ("rexs",),
          "rings that are rigid all over their outside, as REXS 2.0 has no attribute of what holds a ring: leave "
          "held and seats out of [wheel]"),
    Limit(lambda case: any(gear.body is not None for gear in _gears(case)), ("rexs",),
          "no body given by a mesh or a matrix: give the blank by dimensions, or leave it out"),
    Limit(lambda case: any(gear.one_piece for gear in _gears(case)), ("rexs", "vtkhdf"),
          "gears that are rigid at their bores: leave one_piece out"),
    Limit(lambda case: any(case.pair.holes), ("classical", "exudyn", "fmu"),
          "no holes, as it repeats with each mesh cycle, and holes make teeth differ: leave them out"),
    Limit(lambda case: any(case.pair.holes), ("vtkhdf",),
          "no holes, as it shows all teeth by one sector, and holes make teeth differ: leave them out"),
)  # fmt: skip


def _tooth_keys(case: Any) -> list[str]:
    return sorted({*case.pinion_modification.tooth_keys, *case.wheel_modification.tooth_keys})


def _measured(case: Any) -> list[str]:
    return [key for key in _tooth_keys(case) if key != "pitch_deviations_um"]


def _is_default(section: Any) -> bool:
    return bool(section == type(section)())


def _held_elsewhere(file: Any) -> bool:
    said = "sun_radial_N_per_mm", "planet_radial_N_per_mm", "planet_torsion_Nmm_per_rad"
    held = dict.fromkeys(said, "rigid")
    return not _is_default(replace(file.sections.supports, **held))


def _eccentric(file: Any) -> bool:
    gears = file.sections.gears
    return not _is_default(file.sections.eccentricity) or any(gear.eccentricity_um for gear in gears)


def _one_way(file: Any) -> str:
    """First key of a gear of a planetary set or its flanks that is not alike from both ends."""
    if file.sections.gears:
        return ""
    for case in file.cases.values():
        flanks = case.pinion_modification, case.wheel_modification
        for gear, flank in zip(_gears(case), flanks, strict=True):
            for key in (*ONE_WAY, "pitch_deviations_um", "waves"):
                if getattr(gear, key, None) or getattr(flank, key, None):
                    return key
    return ""


def _sets(file: Any) -> dict[str, Any]:
    """Planetary sets of a gearbox, or the one of a set file, by name."""
    return file.model.sets if hasattr(file, "model") else {file.name: file}


def _uneven(file: Any) -> str:
    """First set on a carrier that turns whose planets are too few or not even there."""
    turning = (name for name, one in file.model.sets.items() if one.held != "carrier")
    return next((name for name in turning if not file.model.sets[name].plan.even), "")


def _unlike_pitches(file: Any, most: int = 1) -> list[str]:
    """Meshes of two gears of a gearbox that stand as before after more pitches than so many."""
    return [name for name, case in file.cases.items() if hasattr(file, "model") and case.repeats_after > most]


def _long_periods(file: Any) -> str:
    """First mesh that stands as before after many pitches; set, or mesh that shares a gear, of more than one."""
    found = _unlike_pitches(file, MOST_PITCHES)
    if hasattr(file, "model"):
        found += [name for name in _unlike_pitches(file) if name in file.model.shared]
    return next(iter(found + [name for name, one in _sets(file).items() if one.pitches > one.plan.cycle]), "")


LONG_PERIODS = Limit(_long_periods, ("dynamics",), lambda file: (
    f"meshes that repeat with each mesh cycle, or after {MOST_PITCHES} pitches at most where no gear is shared, and "
    f"{_long_periods(file)} does not: teeth of one gear of such a mesh may differ (pitch_deviations_um, waves, a "
    "topography of each tooth, holes, lugs); leave that and eccentricities out of sets and of meshes that share gears"
))  # fmt: skip
NONLINEAR = 'write [dynamics] motion = "linear"'
ALL_FE = "reduced models alone, and this machine is solved on full finite elements"
OF_SETS = (
    Limit(_always, ("full",), ALL_FE),
    Limit(lambda file: file.sections.gears, ("dynamics",),
          "trains of gears on shafts: give gears, shafts and bearings in the file of a gearbox"),
    LONG_PERIODS,
    Limit(lambda file: file.sections.dynamics.motion == "nonlinear", ("dynamics",),
          f"flanks of sets that stay in contact: {NONLINEAR}"),
    Limit(lambda file: max(map(_nodes, file.cases.values())) > MOST_NODES, ("page",),
          f"flanks of {MOST_NODES} nodes at most: lower [mesh] profile_elements or width_elements"),
    Limit(lambda file: file.plan.clockwise and not file.sections.gears, ("rexs",),
          "planetary sets whose torque turns the sun counter-clockwise: give it the other sign"),
    Limit(_held_elsewhere, ("rexs",), "[supports] of sun and planets across their axes alone: leave the others out"),
    Limit(lambda file: not _is_default(file.sections.carrier), ("rexs",),
          "a rigid carrier, as REXS 2.0 has no stiffness of a carrier: leave [carrier] out"),
    Limit(lambda file: file.sections.pins is not None and file.sections.pins.cheeks != "both", ("rexs",),
          'pins in both cheeks: write [pins] cheeks = "both"'),
    Limit(_eccentric, ("rexs",),
          "gears that are centred, as REXS 2.0 has no eccentricity: leave [eccentricity] out"),
    Limit(_one_way, ("rexs",),
          lambda file: f"gears of sets that are alike from both ends: leave out {_one_way(file)}"),
)  # fmt: skip


def _beyond_rexs(file: Any) -> str:
    """Name of a bearing that REXS 2.0 has no words for, or that its reader here does not take."""
    return next((one.name for one in file.sections.bearings if one.beyond_one_row), "")


def _turning(file: Any) -> bool:
    """Whether a load is said to turn with its shaft."""
    return any(one.turns for load in file.model.sections.loads for one in (*load.forces, *load.moments))


OF_GEARBOXES = (
    Limit(_always, ("full",), ALL_FE),
    Limit(lambda file: file.never_back, ("sweep",),
          lambda file: "loads that turn with the carrier of a set, or with shafts that come back within 20 of its "
          f'turns, and those on {file.never_back} do neither: leave turns out of them, or ask for "pmor dynamics"'),
    Limit(_turning, ("rexs", "fmu"),
          "loads that stand in the housing, as it has none that turn with a shaft: leave turns out of them"),
    Limit(lambda file: file.model.groups, ("page", "rexs"),
          "gears with one mesh each, and some here have several"),
    Limit(lambda file: not set(file.cases) - set(file.model.shared), ("design",),
          "gears with one mesh each: design planetary sets, and gears with several meshes, as set files"),
    Limit(_uneven, ("dynamics",),
          lambda file: "three or more planets, evenly spaced, on a carrier that turns, as their stiffness is the same "
          f"at all its angles then, and those of {_uneven(file)} are not: change its [planets], or take its set file"),
    LONG_PERIODS,
    Limit(_unlike_pitches, ("quiet",),
          lambda file: f"meshes that repeat with each pitch, and {_unlike_pitches(file)[0]} does not: leave out "
          "pitch_deviations_um, waves, a topography of each tooth, holes and lugs"),
    Limit(lambda file: file.sections.dynamics.motion == "nonlinear" and (file.model.shared or _unlike_pitches(file)),
          ("dynamics",), "flanks that part where gears have one mesh each, which repeats with each mesh cycle: "
          f"{NONLINEAR}"),
    Limit(lambda file: file.model.sets or file.model.shared or _unlike_pitches(file), ("fmu",),
          "gears with one mesh each, which repeats with each mesh cycle: leave out planetary sets, gears in several "
          "meshes, and what makes pitches differ"),
    Limit(_beyond_rexs, ("rexs",),
          lambda file: "bearings by stiffness without clearance, or by inner geometry of one row without preload "
          f'along the axis, and "{_beyond_rexs(file)}" is neither: leave out what it has beyond that'),
    Limit(lambda file: file.model.turned, ("page",),
          "loads on one side of the flanks: write a gearbox file for each sense"),
)  # fmt: skip
LIMITS: Mapping[str, tuple[Limit, ...]] = {"Case": OF_CASES, "SetFile": OF_SETS, "GearboxFile": OF_GEARBOXES}
# What takes the parts of a machine one by one: what a case of it does not take, the machine does not either.
PART_BY_PART: tuple[Capability, ...] = ("rexs",)
# What no results of a kind have, beside what can be asked elsewhere: what, and why.
NEVER: Mapping[str, tuple[tuple[str, str], ...]] = {
    "SetFile": (
        ("contact of the other flanks", "each mesh is driven one way"),
        ("equal gears", "finite elements are solved once for each member, and kept beside the results"),
    ),
    "GearboxFile": (
        ("gear bodies on their shafts", "beams are as thick as their sections; bores are rigid without one_piece"),
        ("centrifugal loads of rolling elements", "ISO/TS 16281 has none"),
        ("losses of bearings, seals, churning", "losses are those of the line loads"),
        ("contact of coast flanks", "each mesh is driven one way by its mean force"),
        ("damage of gears", "the load spectrum is listed, without a life"),
        ("modified life of bearings", "L_10r alone: factors for reliability, lubricant and cleanliness are not known"),
    ),
}


def why_not(machine: Any, capability: Capability) -> str:
    """Return the reason why a capability does not take a case, a set or a gearbox, with a remedy; empty where it does.

    Parameters
    ----------
    machine : Case, SetFile or GearboxFile
    """
    limits = LIMITS[type(machine).__name__]
    takes = next((one.takes for one in limits if capability in one.asks and one.of(machine)), None)
    if takes is not None:
        return f"{NAMES[capability]} takes {takes if isinstance(takes, str) else takes(machine)}"
    return next(_reasons_of_parts(machine, capability), "") if capability in PART_BY_PART else ""


def _reasons_of_parts(machine: Any, capability: Capability) -> Iterator[str]:
    """Reasons of the cases of a set, or of the meshes and sets of a gearbox."""
    if type(machine).__name__ == "SetFile":
        yield from filter(None, (why_not(case, capability) for case in machine.cases.values()))
    elif type(machine).__name__ == "GearboxFile":
        for name, part in {**machine.cases, **machine.model.sets}.items():
            if reason := why_not(part, capability):
                yield f"{name}: {reason}"


def rule_of(kind: str, capability: Capability) -> str:
    """Return why a capability takes no machine of a kind, for readers that refuse before there is one."""
    takes = next(one.takes for one in LIMITS[kind] if capability in one.asks)
    assert isinstance(takes, str)
    return f"{NAMES[capability]} takes {takes}"


def left_out(machine: Any) -> list[tuple[str, str]]:
    """Return what cannot be asked of a machine, and what no results of its kind have: what, and why."""
    asked = ((NAMES[capability], why_not(machine, capability)) for capability in ASKED)
    listed = [(name, why.removeprefix(f"{name} ")) for name, why in asked if why]
    return [*listed, *NEVER.get(type(machine).__name__, ())]


def refuse_beyond(machine: Any, capability: Capability, where: str | None = None) -> None:
    """Raise CaseError for what a capability does not take, with a place, by default the name of the machine."""
    if reason := why_not(machine, capability):
        raise CaseError(f"{where or machine.name}: {reason}")
