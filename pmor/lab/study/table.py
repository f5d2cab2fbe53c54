"""From the parts of a study to the rows of its tables and to `study.json`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pmor.lab.core.measures import max_and_rms
from pmor.lab.study import measures
from pmor.lab.study.measures import Curve, StudyParts
from pmor.lab.study.paper import checked_claims, checked_time_claims
from pmor.lab.study.settings import Cell
from pmor.pair.model import gear_pair

Row = dict[str, Any]

SURFACES = {"facet": "facet", "paper": "hermite", "direct": "hermite", "line": "exact"}
ERRORS = {
    "mean_error_um": measures.mean_error_um,
    "peak_to_peak_error_um": measures.peak_to_peak_error_um,
    "shape_error_um": measures.shape_error_um,
}
# Keys that a part and the row of its reduced model share.
REDUCED = ("n_angles_trained", "n_torques_trained", "rom_size", "basis_mib", "offline_s")
# Keys that every row has, and that say something about the reduced model alone.
REDUCED_ONLY = ("n_angles_trained", "n_torques_trained", "rom_vs_full_ste_max_rel", "rom_vs_full_ste_rms_rel")


@dataclass(frozen=True)
class StudyTable:
    """Everything that a study found, as plain data.

    Keys that depend on the clock start with ``ms_`` or ``time_`` or end in ``_s``; all others, and `machine`, are the
    same in every run.
    """

    rows: list[Row]  # One per cell and model
    reference: Row  # Empty in a study of variants alone
    claims: list[Row]
    time_claims: list[Row]
    peer: Mapping[str, Any] | None  # None when it is not asked for or not installed
    machine: Row  # Of the run times; empty when there are none
    failures: tuple[str, ...]

    def row(self, cell: Cell, model: str) -> Row | None:
        """Return the row of a cell and a model, if there is one."""
        found = [row for row in self.rows if (row["cell"], row["model"]) == (cell.label, model)]
        return found[0] if found else None

    def rows_of(self, model: str) -> list[Row]:
        """Return the rows of a model."""
        return [row for row in self.rows if row["model"] == model]


def study_table(parts: StudyParts) -> StudyTable:
    """Gather the parts of a study."""
    peer = parts.study.peer
    rows, reference = grid_rows(parts), reference_row(parts) if parts.study.meshes else {}
    return StudyTable(
        rows=rows,
        reference=reference,
        claims=checked_claims(rows, parts.study),
        time_claims=checked_time_claims(rows),
        peer=parts.results.get(f"peer {peer.cell.label}") if peer is not None else None,
        machine=dict(parts.results.get("run times", {}).get("machine", {})),
        failures=failed_positions(parts),
    )


def curve_of(data: Mapping[str, Any], torque: int = 0) -> Curve:
    """Return the curve at one torque of a sweep as part files keep it."""
    ste = np.array(data["ste_um"][torque], dtype=float)
    share = np.array(data["pair_share"][torque], dtype=float).reshape(len(ste), -1)
    return Curve(ste, share, np.array(data["pair_index"], dtype=np.int64))


def reference_row(parts: StudyParts) -> Row:
    """Describe the reference and estimate its own discretisation error from the coarser meshes of its family."""
    meshes = parts.study.meshes
    found = [(m, parts.results[f"reference {m.label}"]) for m in meshes if f"reference {m.label}" in parts.results]
    row: Row = {
        "meshes": [
            asdict(m)
            | _statistics(curve_of(part["full"]))
            | {
                "ripple_um": part["full_ripple_um"],
                **{key: part[key] for key in ("fe_unknowns", "elastic_s", "solve_s")},
            }
            for m, part in found
        ]
    }
    if len(found) < len(meshes):
        return row | dict.fromkeys(ERRORS)
    curves = [curve_of(part["full"]) for _, part in found]
    fine = curves[-1]
    spacing = [1.0 / m.n_profile for m in meshes]
    for name, measure in ERRORS.items():
        distances = [measure(curve, fine) for curve in curves[:-1]]
        estimate = measures.richardson(spacing, distances)
        row |= {
            name: estimate.error,
            name.replace("error_um", "order"): estimate.order,
            name.replace("error_um", "differences_um"): distances,
        }
    return row


def grid_rows(parts: StudyParts) -> list[Row]:
    """Return one row per cell and model: accuracy, sizes, run times; variants have the condensed model alone."""
    reference = parts.results.get(f"reference {parts.study.meshes[-1].label}") if parts.study.meshes else None
    fine = curve_of(reference["full"]) if reference else None
    rows: list[Row] = []
    for cell in parts.cases.cells:
        part = parts.results.get(f"cell {cell.label}")
        if part is None:
            continue
        case = parts.cases.cells[cell]
        contact, pair = case.contact, gear_pair(case)
        common = {
            "cell": cell.label,
            "variant": cell.variant or None,
            "scheme": contact.scheme,
            "surface": SURFACES[contact.scheme],
            "quadrature": contact.kind,
            "n_profile": cell.n_profile,
            "n_width": case.mesh.width_elements,
            "lodm": cell.lodm,
            "detail": cell.detail,
            "fe_unknowns": part["fe_unknowns"],
            "contact_ratio": pair.contact_ratio,
            "overlap_ratio": pair.overlap_ratio,
            **dict.fromkeys(REDUCED_ONLY),
        }
        times = parts.results.get("run times", {}).get("cells", {}).get(cell.label, {})
        condensed = common | _against_reference(curve_of(part["full"]), fine) | {
            "model": "condensed",
            "unknowns": part["fe_unknowns"],
            "ripple_um": part["full_ripple_um"],
            "newton_steps_mean": float(np.mean(part["full"]["newton_steps"])),
            "ms_per_position": times.get("ms_condensed"),
            "offline_s": part["elastic_s"],
        }  # fmt: skip
        rows.append(condensed)
        if "reduced" not in part:
            continue
        conventional = _conventional(cell, condensed, parts)
        fast = common | _against_reference(curve_of(part["reduced"]), fine) | {
            "model": "reduced",
            "unknowns": part["rom_size"],
            "ripple_um": part["reduced_ripple_um"],
            **{key: part[key] for key in REDUCED},
            "n_unseen_positions": int(np.size(part["comparison"]["full"]["ste_um"])),
            "rom_vs_full_ste_max_rel": part["comparison"]["max_rel"],
            "rom_vs_full_ste_rms_rel": part["comparison"]["rms_rel"],
            "ms_per_position": times.get("ms_reduced"),
            "ms_per_position_all_threads": times.get("ms_reduced_all_threads"),
        }  # fmt: skip
        for rival, name in ((conventional, "conventional"), (condensed, "condensed")):
            fast |= _compared_times(fast, rival, name)
        rows += [fast] if conventional is None else [conventional, fast]
    return rows


def failed_positions(parts: StudyParts) -> tuple[str, ...]:
    """Name everything that did not converge."""
    failures = list(parts.failures)
    for name, part in parts.results.items():
        failures += [f"{name}: {text}" for text in part.get("training_failures", [])]
        for label, data in _sweeps(part):
            for torque, ste in zip(data["torque_Nm"], data["ste_um"], strict=True):
                failures += [
                    f"{name}: {label}: phi = {phi:.6g} rad, torque = {torque:g} N m did not converge"
                    for phi, value in zip(data["phi_rad"], ste, strict=True)
                    if value is None
                ]
    return tuple(failures)


def _sweeps(part: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    found: list[tuple[str, Mapping[str, Any]]] = []
    for label, data in part.items():
        if isinstance(data, Mapping):
            found += [(label, data)] if "ste_um" in data else [(f"{label} {k}", v) for k, v in _sweeps(data)]
    return found


def _compared_times(fast: Row, slow: Row | None, name: str) -> Row:
    """How much faster the reduced model is than another, and from how many positions on its offline stage pays."""
    if slow is None or slow["ms_per_position"] is None or fast["ms_per_position"] is None:
        return {}
    positions = measures.break_even(fast["offline_s"], slow["ms_per_position"], fast["ms_per_position"])
    return {
        f"time_ratio_{name}_to_reduced": slow["ms_per_position"] / fast["ms_per_position"],
        f"time_break_even_positions_{name}": positions,
    }


def _statistics(curve: Curve) -> Row:
    return {"ste_mean_um": curve.mean_um, "ste_peak_to_peak_um": curve.peak_to_peak_um}


def _against_reference(curve: Curve, fine: Curve | None) -> Row:
    row = _statistics(curve)
    for name, measure in {**ERRORS, "load_share_error": measures.load_share_error}.items():
        row[name] = measure(curve, fine) if fine is not None else math.nan
    return row


def _conventional(cell: Cell, condensed: Row, parts: StudyParts) -> Row | None:
    """The conventional model solves the same equations as the condensed one: it has its accuracy, and its own time."""
    solved = parts.results.get(f"conventional {cell.label}")
    if solved is None:
        return None
    slow, fast = np.array(solved["ste_um"]), np.array(solved["condensed_ste_um"], dtype=float)
    return condensed | {
        "model": "conventional",
        "unknowns": solved["unknowns"],
        "newton_steps_mean": float(np.mean(solved["newton_steps"])),
        "n_positions_solved": len(solved["ste_um"]),
        "conventional_vs_condensed_ste_max_rel": max_and_rms(slow / fast - 1.0)[0],
        "offline_s": solved["assembly_s"],
        "newton_step_s": solved["factor_s"],
        "ms_per_position": solved["ms_per_position"],
    }
