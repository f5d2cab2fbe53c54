"""The transmission error of a case on finer and finer meshes of each element, and its limit."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np

from pmor.case import Case, change_case
from pmor.case.width import elements_across, meshed_width
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError
from pmor.gear.pair import GearPair
from pmor.pair.conditions import conditions_of
from pmor.pair.model import elastic_model, mesh_model
from pmor.work.cost import FINITE_ELEMENTS, refuse_beyond_memory, stages
from pmor.work.pieces import PARTS, Piece, Result, run_pieces
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import online_angles, reduced_pair

ELEMENTS = ("hex20", "hex8i", "hex8")
PROFILE_ELEMENTS = (4, 8, 16, 32, 64)
PLANE = "plane_strain"
# Finite elements that take longer, as `pmor plan` tells it, are left out.
LONGEST_S = 90.0
# Ratio of the differences between meshes one after the other, at most: that of first order.
SLOWEST = 0.5
# Pinion angles over the pitch.
ANGLES = 48
#: transmission errors that are held against their limits, and what to call them
QUANTITIES = {
    "ste_pitch_point_um": "pitch point",
    "ste_mid_double_contact_um": "double contact",
    "ste_mean_um": "mean",
    "ste_peak_to_peak_um": "peak-to-peak",
}


@dataclass(frozen=True)
class Level:
    """A mesh of the ladder, and what it gave.

    Parameters
    ----------
    width : str
        How much of the face width is meshed (`pmor.case.width`).
    element : str
    n_profile, n_width : int
        Elements over the profile, and over what is meshed of the width.
    ste_pitch_point_um, ste_mid_double_contact_um, ste_mean_um, ste_peak_to_peak_um : float or None
        At the pitch point, in the middle of double contact, over the pitch; None where it was left out.
    offline_s : float or None
        Wall time of meshing and finite elements.
    reason : str
        Why it was left out, if it was.
    """

    width: str
    element: str
    n_profile: int
    n_width: int
    ste_pitch_point_um: float | None = None
    ste_mid_double_contact_um: float | None = None
    ste_mean_um: float | None = None
    ste_peak_to_peak_um: float | None = None
    offline_s: float | None = None
    reason: str = ""


@dataclass(frozen=True)
class Convergence:
    """What a ladder of meshes gave.

    Parameters
    ----------
    case : Case
    levels : tuple of Level
    limits : dict of (str, str) to float
        Extrapolated, um, by width and quantity.
    """

    case: Case
    levels: tuple[Level, ...]
    limits: dict[tuple[str, str], float]

    def error_percent(self, level: Level, quantity: str) -> float | None:
        """Return how far a mesh is off the limit of a quantity, % of it."""
        value, limit = getattr(level, quantity), self.limits.get((level.width, quantity))
        return None if value is None or limit is None else 100.0 * (value / limit - 1.0)


def run_convergence(case: Case, out: Path, profile_elements: Sequence[int] = PROFILE_ELEMENTS) -> Convergence:
    """Solve a case on a ladder of meshes, in plane strain and over its width.

    Parameters
    ----------
    case : Case
        Of line contact.
    out : Path
        Folder of the results, where finished meshes are kept until these are written.
    profile_elements : sequence of int

    Raises
    ------
    CaseError
        When the case has another contact scheme.
    """
    if case.contact.kind != "line":
        raise CaseError(
            f'case {case.name}: [contact] scheme = "{case.contact.scheme}": has no limit on finer meshes: write "line"'
        )
    pieces = list(_pieces(case, profile_elements))
    results, _ = run_pieces(pieces, out / PARTS, what="meshes")
    levels = tuple(Level(**results[piece.name]) for piece in pieces)
    widths = dict.fromkeys(level.width for level in levels)
    limits = {(w, q): _limit([v for v in levels if v.width == w], q) for w in widths for q in QUANTITIES}
    return Convergence(case, levels, {key: limit for key, limit in limits.items() if limit is not None})


def _pieces(case: Case, profile_elements: Sequence[int]) -> Iterator[Piece]:
    for width in dict.fromkeys((PLANE, "half" if case.mesh.width == PLANE else case.mesh.width)):
        for element in ELEMENTS:
            for n in profile_elements:
                # As fine over the width as helps: half as many elements, and an even number.
                mesh = {"profile_elements": n, "width_elements": max(2, n // 2), "width": width, "element": element,
                        "error_bar": False}  # fmt: skip
                one = change_case(case, mesh=mesh, compare={"models": None}, reduction={"shapes": "line_loads"},
                                  results={"root_stress": False})  # fmt: skip
                yield Piece(f"{width} {element} {n}", {"case": one}, ANGLES, partial(_solve, one))


def _solve(case: Case) -> Result:
    level = Level(meshed_width(case), case.mesh.element, case.mesh.profile_elements, elements_across(case))
    needed = stages(case)
    seconds = next(stage.seconds for stage in needed if stage.name == FINITE_ELEMENTS)
    if seconds > LONGEST_S:
        return asdict(level) | {"reason": f"about {seconds / 60.0:.0f} min of finite elements"}
    try:
        refuse_beyond_memory(case)
    except CaseError:
        return asdict(level) | {"reason": "more memory than there is"}
    start = time.perf_counter()
    model = elastic_model(case, mesh_model(case))
    seconds = time.perf_counter() - start
    reduced = reduced_pair(train(case, model).basis)
    phi = np.append(compared_angles(reduced.meshed.pair), online_angles(reduced.meshed.pair.pitch, ANGLES))
    ste = sweep_line_loads(reduced, phi, conditions_of(case, [case.torque_Nm])).ste_um[0]
    found = (*ste[:2].tolist(), float(np.mean(ste[2:])), float(np.ptp(ste[2:])))
    return asdict(level) | dict(zip(QUANTITIES, found, strict=True)) | {"offline_s": seconds}


def compared_angles(pair: GearPair) -> FloatArray:
    """Return the pinion angles of contact at the pitch point, and of the middle of double contact, rad."""
    start, end = pair.roll_position_range
    pitch_point = pair.roll_position(math.tan(pair.working_pressure_angle))
    return np.array([pitch_point, 0.5 * (start + end - pair.pitch)])


def _limit(levels: Sequence[Level], quantity: str) -> float | None:
    """Limit of a quantity by the three finest meshes of the first element that has them (Aitken's extrapolation).

    Differences that fall by less than half from mesh to mesh are not followed further than that.
    """
    for element in ELEMENTS:
        known = [v for level in levels if level.element == element and (v := getattr(level, quantity)) is not None]
        if len(known) < 3:
            continue
        first, second, third = known[-3:]
        ratio = (third - second) / (second - first) if second != first else 0.0
        ratio = min(max(ratio, 0.0), SLOWEST)
        return float(third + (third - second) * ratio / (1.0 - ratio))
    return None
