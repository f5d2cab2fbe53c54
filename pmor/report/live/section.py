"""The section of the report in which flanks, load and axes can be changed: its controls and initial values."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import numpy as np

from pmor.case import Case
from pmor.case.coast import mirrored_flank
from pmor.core.arrays import FloatArray
from pmor.core.errors import GeometryError
from pmor.gear.clearance import refuse_working_geometry
from pmor.gear.condition import ALIGNED, Misalignment
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.modification import UNMODIFIED, Modification
from pmor.gear.pair import GearPair
from pmor.gear.profile import profiles
from pmor.line.layered_pair import LayeredPair
from pmor.pair.conditions import assembly_of
from pmor.pair.limits import LARGE_APPROACH, PRESSURE_OVER_MODULUS, hertz_pressure
from pmor.report.live.model import CONSTANTS, live_model
from pmor.results.sweep import SteSweep, ste_mean_um
from pmor_online.model import ReducedPair
from pmor_online.run import OnlineResult

# Angles over a pitch: ten orders take 21. Of helical pairs, whose many sections take longer, fewer: their transmission
# error is smoother.
SPUR_ANGLES, HELICAL_ANGLES = 100, 40
MODEL = (
    "The page carries the flanks' compliance from the finite elements and solves contact anew as a slider moves: the "
    "same equations as the run, exact for any torque, axes and flanks that linear elasticity covers."
)
# Deviation of the axes, um, to which sliders reach at least.
LEAST_DEVIATION = 1.0
# Upper limits of sliders: over the nominal torque, over the mean transmission error, over the amounts of the case.
TORQUE_RANGE, AMOUNT_RANGE, BEYOND_CASE = 2.0, 4.0, 1.5
# Least start of tip relief as a share of the active profile, and its start where the case has none.
EARLIEST_RELIEF, USUAL_RELIEF = 0.3, 0.7


@dataclass(frozen=True)
class Control:
    """A slider with a number field, or a choice.

    Parameters
    ----------
    group : {"load", "bearings", "pins", "eccentricity", "pinion", "wheel", "axes"}
    key : str
        As in a case file.
    initial : str
        Value of the case.
    choices : tuple of str
        Instead of a range.
    logarithmic : bool
        Steps of the slider multiply.
    """

    group: str
    key: str
    label: str
    initial: str
    low: float = 0.0
    high: float = 0.0
    step: float = 1.0
    choices: tuple[str, ...] = ()
    logarithmic: bool = False

    @property
    def slider(self) -> tuple[float, float]:
        """Ends of the slider: of a logarithmic one powers of ten."""
        return (math.log10(self.low), math.log10(self.high)) if self.logarithmic else (self.low, self.high)


@dataclass(frozen=True)
class LiveMesh:
    """A pair of gears in the section's template.

    Parameters
    ----------
    name : str
        Of the mesh of a gearbox, or of a kind of mesh of a set; empty of a pair by itself.
    controls : tuple of Control
        Of its flanks and axes.
    same : bool
        Both gears start alike.
    gears : (str, str)
    """

    name: str
    controls: tuple[Control, ...]
    same: bool
    gears: tuple[str, str]


@dataclass(frozen=True)
class LiveSection:
    """Content of the section's template.

    Parameters
    ----------
    controls : tuple of Control
        Of the load, of the bearings of a gearbox, and of the errors of a set.
    shown : tuple of (str, int)
        Meshes that can be looked at, and the one of `meshes` that each is.
    data : dict
        Data of the solver, and the results of the case.
    """

    controls: tuple[Control, ...]
    meshes: tuple[LiveMesh, ...]
    shown: tuple[tuple[str, int], ...]
    data: dict[str, Any]
    note: str


def live_section(result: OnlineResult, pair: ReducedPair) -> LiveSection:
    """Return the section of a pair.

    Parameters
    ----------
    result : OnlineResult
        Of the case, to compare with.
    pair : ReducedPair
        Of line loads, on the whole width: the model that the page solves.
    """
    case, ste = result.case, float(ste_mean_um(result.sweep)[result.nominal])
    torque = torque_control("torque on the pinion, N m", case.torque_Nm, case.online.torques_Nm)
    mesh, data = live_pair_mesh("", pair, ste, [curve(result.sweep, result.nominal)])
    swept = *case.online.torques_Nm, *(condition.torque_Nm for condition in case.conditions)
    data["limits"]["torque_Nm"] = [min(swept), max(swept)]
    setting = {"torque_Nm": case.torque_Nm, "load": 0}
    note = " ".join([MODEL, *notes(case, pair.meshed, case.online.angles_per_pitch)])
    return LiveSection((torque,), (mesh,), (("", 0),), section_data([data], setting), note)


def torque_control(label: str, nominal_Nm: float, swept_Nm: Sequence[float]) -> Control:
    """Return the slider of a torque, to beyond those of the run."""
    highest = rounded(max(TORQUE_RANGE * nominal_Nm, *swept_Nm))
    step = rounded(highest) / 200.0
    return Control("load", "torque_Nm", label, _written(nominal_Nm), step, highest, step)


def section_data(
    meshes: Sequence[dict[str, Any]], setting: dict[str, Any], machine: dict[str, Any] | None = None,
    train: dict[str, Any] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Return the data of a section: `setting` begins it, beside the axes and modifications of the meshes."""
    return {
        "constants": CONSTANTS,
        "defaults": {"axes": asdict(ALIGNED), "modification": _amounts(UNMODIFIED)},
        "meshes": list(meshes),
        "setting": {**setting, "meshes": [mesh["case"]["setting"] for mesh in meshes]},
        "machine": machine,
        "train": train,
    }


def live_pair_mesh(
    name: str, pair: ReducedPair, ste_um: float, curves: list[list[list[float]]]
) -> tuple[LiveMesh, dict[str, Any]]:
    """Return a pair in the section, and its data; parameters as of `live_mesh`."""
    case, meshed = pair.basis.case, pair.layered
    model = live_model(pair.lines, assembly_of(case), _angles(meshed))
    return live_mesh(name, case, meshed, model, ste_um, curves)


def live_mesh(
    name: str, case: Case, meshed: LayeredPair, model: dict[str, Any], ste_um: float, curves: list[list[list[float]]],
    members: tuple[str, str] | None = None,
) -> tuple[LiveMesh, dict[str, Any]]:  # fmt: skip
    """Return a mesh of the section, and its data.

    Parameters
    ----------
    model : dict
        As `pmor.report.live.model.live_model` gives it.
    ste_um : float
        Mean transmission error, which the amounts of sliders go by.
    curves : list
        Transmission error of the case under each load (`curve`).
    members : (str, str), optional
        Sections of both gears in the file of a set, whose axes the errors of its pins move.
    """
    own, gears = _own(case, meshed.pair), members or ("pinion", "wheel")
    controls = tuple(_controls(case, meshed, ste_um, members is None))
    starts = [{c.key: c.initial for c in controls if c.group == group} for group in ("pinion", "wheel")]
    coast = case.flank == "coast"
    data = model | {
        "name": name,
        "gears": gears,
        "coast": coast,
        "case": {
            "setting": {"axes": asdict(case.misalignment), "modifications": [_amounts(flank) for flank in own]},
            "kept": [_kept(mirrored_flank(flank) if coast else flank) for flank in own],
            "curves": curves,
        },
        "limits": _limits(case, meshed),
    }
    return LiveMesh(name, controls, starts[0] == starts[1] and own[0] == own[1], gears), data


def _own(case: Case, pair: GearPair) -> tuple[Modification, Modification]:
    """Modifications of the case, their reliefs by roll angles, which the page knows."""
    pinion, wheel = profiles(pair)
    return pinion.in_roll_angles(case.pinion_modification), wheel.in_roll_angles(case.wheel_modification)


def _amounts(modification: Modification) -> dict[str, Any]:
    """Parameters of a modification that the page may change."""
    kept = "topography", "pitch_deviations_um", "waves"
    return {key: value for key, value in asdict(modification).items() if key not in kept}


def _kept(modification: Modification) -> dict[str, Any]:
    waves = list(map(asdict, modification.waves))
    kept = {"pitch_deviations_um": list(modification.pitch_deviations_um), "waves": waves}
    return {key: value for key, value in kept.items() if value}


def curve(sweep: SteSweep, torque_index: int) -> list[list[float]]:
    """Return the transmission error over the first pitch, (deg, um)."""
    ste = sweep.ste_um[torque_index]
    shown = sweep.phi_rad < sweep.pitch_rad * (1.0 - 1e-9)
    return written_curve(np.stack([np.degrees(sweep.phi_rad[shown]), ste[shown]], axis=1))


def written_curve(points: FloatArray) -> list[list[float]]:
    """Return the points of a curve, (n, 2), that have a value, as a page has them."""
    return [[float(f"{value:.7g}") for value in point] for point in points[np.isfinite(points[:, 1])]]


def _limits(case: Case, meshed: MeshedPair) -> dict[str, Any]:
    """Limits of a linear model."""
    _, modulus = hertz_pressure(case, meshed.pair)
    return {"pressure_MPa": PRESSURE_OVER_MODULUS * modulus, "approach_um": 1e3 * LARGE_APPROACH * case.pair.module_mm}


def _controls(case: Case, meshed: LayeredPair, ste: float, axes: bool) -> Iterable[Control]:
    flanks = _own(case, meshed.pair)
    present = [abs(getattr(flank, key)) for flank in flanks for key in _SLID]
    deviations = asdict(case.misalignment)
    amount = rounded(max(AMOUNT_RANGE * ste if math.isfinite(ste) else 0.0, BEYOND_CASE * max(present), 10.0))
    even = meshed.plane_strain or meshed.mirrored
    for number, group in enumerate(("pinion", "wheel")):
        start = _relief_start(group, flanks[number], meshed, number)
        yield from _flank_controls(group, flanks[number], start, amount, even)
    if not axes:
        return
    names = {"centre_distance_um": "centre distance, µm further apart"}
    if not even:
        names |= {
            "in_plane_um": "in-plane misalignment, µm over the face",
            "out_of_plane_um": "out-of-plane misalignment, µm over the face",
        }
    present_off = max(map(abs, deviations.values()))
    far = max(present_off, _meshing(meshed.pair, rounded(max(amount, BEYOND_CASE * present_off)), tuple(names)))
    for key, label in names.items():
        yield Control("axes", key, label, _written(deviations[key]), -far, far, far / 100.0)


def _meshing(pair: GearPair, far: float, names: Sequence[str]) -> float:
    """Return the largest deviation of the axes up to `far`, by halves of it, at which a pair still meshes, um."""
    signs = list(product((-1.0, 1.0), repeat=len(names)))
    while far > LEAST_DEVIATION:
        corners = [dict(zip(names, (far * sign for sign in each), strict=True)) for each in signs]
        try:
            refuse_working_geometry(pair, [Misalignment(**corner) for corner in corners])
        except GeometryError:
            far *= 0.5
        else:
            break
    return far


#: amounts with a slider: label, whether negative values are allowed, whether they vary over the width
_SLID = {
    "tip_relief_um": ("tip relief, µm", False, False),
    "profile_crowning_um": ("profile crowning, µm", True, False),
    "profile_slope_um": ("profile slope, µm", True, False),
    "helix_crowning_um": ("helix crowning, µm", True, True),
    "helix_slope_um": ("helix slope, µm", True, True),
}


def _flank_controls(
    group: str, modification: Modification, relief_start: Control, amount: float, even: bool
) -> Iterable[Control]:
    for key, (label, signed, over_width) in _SLID.items():
        value = getattr(modification, key)
        low = -amount if signed or value < 0.0 else 0.0
        if not (over_width and even):
            yield Control(group, key, label, _written(value), low, amount, amount / 200.0)
        if key == "tip_relief_um":
            shape, shapes = modification.tip_relief_shape, ("linear", "parabolic")
            yield relief_start
            yield Control(group, "tip_relief_shape", "shape of the tip relief", shape, choices=shapes)


def _relief_start(group: str, modification: Modification, meshed: MeshedPair, number: int) -> Control:
    first, last = (math.degrees(roll) for roll in meshed.pair.active_rolls[number])
    given = modification.tip_relief_start_roll_deg
    value = round(first + USUAL_RELIEF * (last - first), 1) if given is None else given
    ends = round(first + EARLIEST_RELIEF * (last - first), 1), round(last - math.copysign(0.2, last - first), 1)
    low, high = min(*ends, value), max(*ends, value)
    return Control(group, "tip_relief_start_roll_deg", "its start, deg of roll", _written(value), low, high, 0.1)


def _written(value: float) -> str:
    """A number as in a case file, to the last digit that is meant."""
    return f"{value:.15g}"


def rounded(value: float) -> float:
    """Return the next larger of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(power * factor for factor in (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0) if power * factor >= value)


def notes(case: Case, meshed: MeshedPair, angles: int) -> list[str]:
    """Return sentences on how the page takes a case that the run sweeps at so many angles to a pitch."""
    sentences = [
        "Amounts of the flanks count along the transverse line of action and remove material where they are positive."
    ]
    own = _angles(meshed)
    if own != angles:
        sentences.append(
            f"It solves {own} angles to a pitch, the run {angles}: largest values differ by what lies between."
        )
    if case.pitches > 1:
        sentences.append("It solves the first pitch of the run's sweep.")
    if case.mesh.width == "plane_strain":
        sentences.append("In plane strain nothing differs over the width: sliders of the helix and of tilted axes are "
                     "left out.")  # fmt: skip
    flanks = case.pinion_modification, case.wheel_modification
    if case.flank == "coast":
        sentences.append("Coast flanks are solved in their image, as in the run: the torque is an amount, and the "
                         "wheel's axis is out of plane to the other side.")  # fmt: skip
    if any(flank.topography is not None or flank.tooth_keys for flank in flanks):
        sentences.append("Topographies, pitch deviations and waves stay as they are in the case.")
    return sentences


def _angles(meshed: MeshedPair) -> int:
    return HELICAL_ANGLES if meshed.pair.pinion.helix_angle else SPUR_ANGLES
