"""One design: from the keys that it changes to its row of the table."""

from __future__ import annotations

from collections.abc import Mapping

from pmor.body.flank_compliance import FlankCompliance
from pmor.campaigns.figures import figures_of, known, peaks_of
from pmor.campaigns.relations import case_of, why_infeasible, with_relations
from pmor.campaigns.relief import best_relief
from pmor.campaigns.rows import NAME, Row, Task, plain_row
from pmor.campaigns.settings import OF_RELIEF, Number
from pmor.campaigns.store import Store
from pmor.case import Case, GearCase
from pmor.case.coarser import coarser
from pmor.core.errors import CaseError, ConvergenceError, GeometryError, InsufficientMemoryError, MeshError
from pmor.fe.sector import SectorMesh
from pmor.line.layered_pair import layers_of
from pmor.line.sections import loaded_components
from pmor.pair.model import per_gear
from pmor.reduction.basis import Basis, untrained
from pmor.storage.compliance_file import SolvedGear
from pmor.work.cost import meshed_within_memory
from pmor.work.line_gear import line_gear
from pmor_online.compare import failed_positions
from pmor_online.model import reduced_pair
from pmor_online.run import root_stress_of_case, sweep_case


def row_of(task: Task, number: int, design: Mapping[str, Number], store: Store) -> Row:
    """Solve a design, numbered from 1; return its row, plain data, always the same for the same design."""
    complete = dict(design)
    try:
        complete = with_relations(task.base_text, design, task.relations)
        case = case_of(task.base_text, complete, f"{NAME} {number}").without_web_stress()
        if task.fine:
            return plain_row(task, number, complete, "ok", "", peaks_of(reduced_pair(basis_of(case, store))))
        results, failures = results_of(case, store, not set(OF_RELIEF).isdisjoint(task.results))
    except InsufficientMemoryError as error:
        reason = str(error)
        if task.workers.memory_GiB is not None:
            reason = reason.replace("ulimit -d", "[workers] memory_GiB")
        return plain_row(task, number, complete, "lost", reason)
    except (CaseError, GeometryError, MeshError) as error:
        reason = why_infeasible(str(error), task.base_text, complete, task.relations)
        return plain_row(task, number, complete, "infeasible", reason)
    except ConvergenceError as error:
        return plain_row(task, number, complete, "not converged", str(error))
    if failures:  # a cycle with gaps is no result to compare designs by
        reason = f"{len(failures)} positions did not converge, first: {failures[0]}"
        return plain_row(task, number, complete, "not converged", reason)
    return plain_row(task, number, complete, "ok", "", results)


def results_of(case: Case, store: Store, relief: bool = False) -> tuple[dict[str, float | None], tuple[str, ...]]:
    """Return the figures of a case, and the positions of its sweep that did not converge.

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
    return figures, tuple(failed_positions(sweep, "line loads"))


def basis_of(case: Case, store: Store) -> Basis:
    """Return the basis of line loads of a case, its gears from the store where they are there."""
    mesh = meshed_within_memory(case)

    def solved(sector: SectorMesh, gear: GearCase) -> SolvedGear:
        return line_gear(case, mesh, sector, gear, store.get)

    pinion, wheel = per_gear(case, mesh, solved)
    coarse, stresses = coarser(case), (pinion.root_stress, wheel.root_stress)
    components = loaded_components(True, mesh.meshed.pair.pinion.helix_angle != 0.0)
    return Basis(
        case=case,
        flank_nodes=(mesh.pinion.flank_nodes, mesh.wheel.flank_nodes),
        flank_roll_angle=(mesh.pinion.flank_roll_angle, mesh.wheel.flank_roll_angle),
        layers=layers_of(mesh.meshed),
        shapes=None,
        training=untrained(),
        compliance=FlankCompliance((pinion.compliance, wheel.compliance), components, (pinion.support, wheel.support)),
        coarser=None if coarse is None else _coarser_basis(coarse, store),
        root_stress=None if stresses[0] is None or stresses[1] is None else (stresses[0], stresses[1]),
    )


def _coarser_basis(coarse: Case, store: Store) -> Basis:
    """Basis of line loads on half as many elements, for the error bar of the mesh."""
    try:
        return basis_of(coarse, store)
    except MeshError as error:
        remedy = "take more elements, or write [mesh] error_bar = false"
        raise MeshError(f"half as many elements, for the error bar of the mesh: {error}; {remedy}") from error
