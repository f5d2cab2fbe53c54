"""The transmission error of a case on finer and finer meshes of each element, and its limit."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import asdict
from functools import partial
from pathlib import Path

import numpy as np

from pmor.case import Case, change_case
from pmor.case.width import elements_across, meshed_width
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, ConvergenceError
from pmor.gear.pair import GearPair
from pmor.lab.convergence.result import ELEMENTS, FILES, PLANE, PROFILE_ELEMENTS, QUANTITIES, Convergence, Level
from pmor.pair.conditions import conditions_of
from pmor.pair.model import elastic_model, gear_pair, mesh_model
from pmor.work.cost import FINITE_ELEMENTS, refuse_beyond_memory, stages
from pmor.work.pieces import Piece, Result, run_pieces
from pmor.work.results import pieces_folder
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import online_angles, reduced_pair

# Meshes whose finite elements take longer, by the estimate of `pmor plan`, are skipped.
LONGEST_S = 90.0
# Ratio of the differences between successive meshes, at most: that of first order.
SLOWEST = 0.5
# Pinion angles over the pitch.
ANGLES = 48


def run(
    case: Case, *, profile_elements: Sequence[int] = PROFILE_ELEMENTS, folder: Path | str | None = None,
    overwrite: bool = False, executor: Executor | None = None, progress: Callable[[int], None] | None = None,
) -> Convergence:  # fmt: skip
    """Solve a case on a ladder of meshes, in plane strain and over its width.

    Parameters
    ----------
    case : Case
        Of line contact.
    profile_elements : sequence of int
        Elements over the profile of each rung.
    folder, overwrite, executor, progress
        As in `pmor.app.capabilities`; the seconds of a mesh count only without an executor.

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
    gear_pair(case)  # refused before there is a folder
    with pieces_folder(folder, FILES, overwrite=overwrite) as parts:
        results, failures = run_pieces(pieces, parts, executor=executor, progress=progress, what="meshes")
    lost = {"reason": "did not converge"}
    levels = tuple(Level(**results.get(piece.name, asdict(_level(piece.cases["case"])) | lost)) for piece in pieces)
    widths = dict.fromkeys(level.width for level in levels)
    limits = {(w, q): _limit([v for v in levels if v.width == w], q) for w in widths for q in QUANTITIES}
    return Convergence(case, levels, {key: limit for key, limit in limits.items() if limit is not None}, failures)


def _pieces(case: Case, profile_elements: Sequence[int]) -> Iterator[Piece]:
    for width in dict.fromkeys((PLANE, "half" if case.mesh.width == PLANE else case.mesh.width)):
        for element in ELEMENTS:
            for n in profile_elements:
                # As fine over the width as helps: half as many elements, and an even number.
                mesh = {"profile_elements": n, "width_elements": max(2, n // 2), "width": width, "element": element,
                        "error_bar": False}  # fmt: skip
                level_case = change_case(case, mesh=mesh, compare={"models": None}, reduction={"shapes": "line_loads"},
                                  results={"root_stress": False})  # fmt: skip
                yield Piece(f"{width} {element} {n}", {"case": level_case}, ANGLES, partial(_solve, level_case))


def _level(case: Case) -> Level:
    return Level(meshed_width(case), case.mesh.element, case.mesh.profile_elements, elements_across(case))


def _solve(case: Case) -> Result:
    level = _level(case)
    seconds = next(stage.seconds for stage in stages(case) if stage.name == FINITE_ELEMENTS)
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
    if not np.isfinite(ste).all():
        raise ConvergenceError(f"{int(np.isnan(ste).sum())} of {len(phi)} positions did not converge", [])
    figures = (*ste[:2].tolist(), float(np.mean(ste[2:])), float(np.ptp(ste[2:])))
    return asdict(level) | dict(zip(QUANTITIES, figures, strict=True)) | {"offline_s": seconds}


def compared_angles(pair: GearPair) -> FloatArray:
    """Return the pinion angles of contact at the pitch point, and of the middle of double contact, rad."""
    start, end = pair.roll_position_range
    pitch_point = pair.roll_position(math.tan(pair.working_pressure_angle))
    return np.array([pitch_point, 0.5 * (start + end - pair.pitch)])


def _limit(levels: Sequence[Level], quantity: str) -> float | None:
    """Limit of a quantity by the three finest meshes of the first element that has them (Aitken's extrapolation).

    Differences that fall by less than half from mesh to mesh are extrapolated as if they fell by half.
    """
    for element in ELEMENTS:
        values = [getattr(level, quantity) for level in levels if level.element == element]
        # Of meshes that follow each other in the ladder: one between them may have failed.
        known = [three for i in range(len(values) - 2) if None not in (three := values[i : i + 3])]
        if not known:
            continue
        first, second, third = known[-1]
        ratio = (third - second) / (second - first) if second != first else 0.0
        ratio = min(max(ratio, 0.0), SLOWEST)
        return float(third + (third - second) * ratio / (1.0 - ratio))
    return None
