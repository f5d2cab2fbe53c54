"""Designs that are gear pairs: the figures of each are the same, to the last bit, as a run of its case gives."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pmor.campaigns.keys import split
from pmor.campaigns.kind import PEAKS, Cost, Kind, Solved
from pmor.campaigns.peaks import settled_peaks
from pmor.campaigns.relations import text_of_design, why_infeasible, with_relations
from pmor.campaigns.relief import best_relief
from pmor.campaigns.settings import OF_RELIEF, USUAL, PairCampaign, Relations
from pmor.case import Case, change_case, changed_text, parse_case, text_of
from pmor.case.capability import why_not
from pmor.case.reader import parse_toml, read_text
from pmor.case.schema import SECTIONS
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError
from pmor.design.fine import fine_angles
from pmor.design.plan import position_seconds
from pmor.pair.conditions import conditions_of
from pmor.pair.drawn import gear_inertias
from pmor.pair.model import gear_pair, refuse_loads_unmeshed
from pmor.reduction.basis import Basis
from pmor.report.torque_table import figures_at
from pmor.results.load_distribution import line_states
from pmor.results.quantities import TABLE, figures_of_mesh
from pmor.results.root_stress import RootStress
from pmor.results.sweep import SteSweep, peak_to_peak_um
from pmor.storage.gear_store import Store
from pmor.work.cost import body_seconds, meshed_within_memory, refuse_beyond_memory, seconds_of, stages
from pmor_offline.gears import line_basis
from pmor_online.compare import failed_positions
from pmor_online.model import ReducedPair, online_angles, reduced_pair
from pmor_online.run import root_stress_of_case, sweep_case
from pmor_online.sweep import sweep_reduced_pair

FIRST = (
    PEAKS[0], "mass_kg", "flank_pressure_max_MPa", "root_stress_pinion_MPa", "root_stress_wheel_MPa", "k_h_beta",
    "effective_contact_ratio",
)  # fmt: skip
SWEEP = "sweep"
# Sweeps on fine angles in which the relief that suits a design is found.
RELIEF_SWEEPS = 10


def _base_text(base: Path, relations: Relations, fixed: Mapping[str, Any], place: str) -> str:
    case = parse_case(_freed(base, relations), base.stem, str(base), base.parent)
    if case.compare.models is not None:
        case = change_case(case, compare={"models": None})
    text = text_of_design(text_of(case), fixed)
    if reason := why_not(parse_case(text, case.name, f"{place}: {base}"), "campaign"):
        raise CaseError(f"{place}: {base}: {reason} there, or with their sections below [designs]")
    return text


def _freed(base: Path, relations: Relations) -> str:
    """Text of a base case without the keys that give way to relations, which may make gears fit that do not there."""
    text = read_text(base, "case file")
    for name in relations.frees:
        section, key = split(name)
        said = parse_toml(text, str(base)).get(section)
        if isinstance(said, Mapping) and key in said:
            text = changed_text(text, {section: {key: None}})
    return text


def _refuse(text: str, name: str) -> None:
    case = parse_case(text, name, name)
    refuse_loads_unmeshed(case)
    refuse_beyond_memory(case)


def _cost(text: str, name: str, keys: tuple[str, ...]) -> Cost:
    case = parse_case(text, name, name)
    position, torques = position_seconds(gear_pair(case), case), len(case.online.torques_Nm)
    swept = fine_angles(case.online.angles_per_pitch) * torques * position
    relieved = 0.0 if set(OF_RELIEF).isdisjoint(keys) else RELIEF_SWEEPS * swept
    elements = {repr((case.pair, case.mesh)): body_seconds(case)}
    return Cost(seconds_of(stages(case), SWEEP) + relieved, elements, swept)


def _solve(text: str, name: str, store: Store, keys: tuple[str, ...]) -> Solved:
    case = parse_case(text, name, name).without_web_stress()
    return results_of(case, store, not set(OF_RELIEF).isdisjoint(keys))


def _peaks(text: str, name: str, store: Store) -> Mapping[str, float]:
    return peaks_of(reduced_pair(basis_of(parse_case(text, name, name).without_web_stress(), store)))


def results_of(case: Case, store: Store, relief: bool = False) -> Solved:
    """Return the figures of a case; a failure names positions of its sweep that did not converge.

    Raises
    ------
    CaseError, GeometryError, MeshError
        When there is no such pair.
    """
    reduced = reduced_pair(basis_of(case, store))
    sweep = sweep_case(reduced)
    if sweep.states is None:
        raise CaseError(
            f"{case.name}: [online] {len(sweep.phi_rad)} angles: too many to keep the loads of all: lower them"
        )
    figures = figures_of(reduced, sweep, root_stress_of_case(reduced))
    if relief:
        figures |= {key: known(value) for key, value in best_relief(reduced, sweep).items()}
    failures = failed_positions(sweep, "line loads")
    return Solved(figures, f"{len(failures)} positions did not converge, first: {failures[0]}" if failures else "")


def basis_of(case: Case, store: Store) -> Basis:
    """Return the basis of line loads of a case, its gears from the store where they are there."""
    return line_basis(case, store.get, meshed_within_memory(case))


def figures_of(reduced: ReducedPair, sweep: SteSweep, stress: RootStress | None) -> dict[str, float | None]:
    """Return all figures at the nominal torque of a recorded sweep; None where the case does not ask for it."""
    case, pair = reduced.basis.case, reduced.meshed.pair
    own = figures_of_mesh(pair, line_states(sweep))
    pinion, wheel = gear_inertias(case, pair)
    numbers = figures_at(sweep, pair, own, stress, case.online.torques_Nm.index(case.torque_Nm)) | {
        PEAKS[1]: peak_to_peak_um(sweep).max(),
        "contact_ratio": pair.contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "centre_distance_mm": abs(pair.centre_distance),
        "mass_kg": pinion.mass_kg + wheel.mass_kg,
        "mass_pinion_kg": pinion.mass_kg,
        "mass_wheel_kg": wheel.mass_kg,
        "inertia_pinion_kg_m2": pinion.polar_kg_m2,
        "inertia_wheel_kg_m2": wheel.polar_kg_m2,
    }
    return {key: known(numbers[key]) for key in USUAL}


def peaks_of(reduced: ReducedPair) -> dict[str, float]:
    """Return the peak-to-peak STE of the pair of a case on fine angles: see `pmor.campaigns.kind`.

    Raises
    ------
    ConvergenceError
    """
    case = reduced.basis.case

    def spans(angles: int) -> FloatArray:
        phi = online_angles(reduced.meshed.pair.pitch, angles, case.pitches)
        return peak_to_peak_um(sweep_reduced_pair(reduced, phi, conditions_of(case, case.online.torques_Nm)))

    return settled_peaks(spans, case.online.angles_per_pitch, case.online.torques_Nm.index(case.torque_Nm))


def known(value: float | None) -> float | None:
    """Return a plain number; None for one that is none."""
    return float(value) if value is not None and np.isfinite(value) else None

PAIRS = Kind(
    key="case", gear="pinion", sections=PairCampaign, known=SECTIONS, first=FIRST,
    figures=tuple(TABLE[key] for key in (*USUAL, *OF_RELIEF)),
    base_text=_base_text, complete=with_relations, text=text_of_design, why=why_infeasible, refuse=_refuse,
    cost=_cost, solve=_solve, peaks=_peaks,
)  # fmt: skip
