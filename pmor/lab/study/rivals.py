"""The pieces of work that run other ways to the same answer: conventional full FE, and an independent solver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pmor.case import Case
from pmor.case.width import whole_width
from pmor.core.arrays import FloatArray
from pmor.lab.core.models import ModelStore
from pmor.lab.rivals.calculix import calculix_ste
from pmor.lab.rivals.conventional import conventional_pair, solve_conventional
from pmor.lab.study.solve import full_sweep
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import ElasticModel
from pmor_online.model import online_angles

# Positions over a pitch that are solved. The conventional one takes minutes for each.
CONVENTIONAL_ANGLES, PEER_ANGLES = 1, 3


def conventional_cell(case: Case, store: ModelStore) -> dict[str, Any]:
    """Solve a cell with the conventional full FE, at nominal torque; `ms_per_position` is without the assembly."""
    case = whole_width(case)
    model, _ = store.model(case)
    pair = conventional_pair(case, model.mesh)
    phi = online_angles(model.mesh.meshed.pair.pitch, CONVENTIONAL_ANGLES)
    solutions = [solve_conventional(pair, float(angle), nominal_condition(case)) for angle in phi]
    factored = sum(solution.factorisations for solution in solutions)
    return _solved(case, model, phi, solutions) | {
        "newton_steps": [solution.steps for solution in solutions],
        "factorisations": [solution.factorisations for solution in solutions],
        "unknowns": pair.unknowns,
        "assembly_s": pair.assembly_seconds,
        "factor_s": sum(solution.factor_seconds for solution in solutions) / factored,
    }


def peer_cell(case: Case, store: ModelStore) -> dict[str, Any]:
    """Solve positions over one pitch with CalculiX on the case's mesh, and with our condensed full FE.

    CalculiX knows facets alone, so the case should ask for them: then both solve the same discrete problem. The
    positions start half a step after a pair comes into mesh: right there a tip corner is at work, which the two codes
    treat differently.
    """
    case = whole_width(case)
    model, _ = store.model(case)
    pair = model.mesh.meshed.pair
    phi = pair.roll_position_range[0] + pair.pitch * (np.arange(PEER_ANGLES) + 0.5) / PEER_ANGLES
    solutions = [calculix_ste(case, model.mesh, float(angle), 1e3 * case.torque_Nm) for angle in phi]
    return _solved(case, model, phi, solutions) | {
        "program": "CalculiX",
        "unknowns": solutions[0].unknowns,
        "iterations": [solution.iterations for solution in solutions],
    }


def _solved(case: Case, model: ElasticModel, phi: FloatArray, solutions: Sequence[Any]) -> dict[str, Any]:
    """Data of both: STE, beside that of the condensed model, and times."""
    seconds = [solution.seconds for solution in solutions]
    return {
        "phi_rad": phi.tolist(),
        "ste_um": [solution.ste_um for solution in solutions],
        "condensed_ste_um": full_sweep(model, phi, [nominal_condition(case)]).ste_um[0].tolist(),
        "solve_s": seconds,
        "ms_per_position": 1e3 * sum(seconds) / len(seconds),
    }
