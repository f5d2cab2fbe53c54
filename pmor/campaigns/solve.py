"""One design: from the keys that it changes to its row of the table."""

from __future__ import annotations

from collections.abc import Mapping

from pmor.body.flank_compliance import FlankCompliance, flank_compliance
from pmor.body.root_stress import root_stress_shapes
from pmor.campaigns.figures import figures_of, known, peaks_of
from pmor.campaigns.relations import case_of, why_infeasible, with_relations
from pmor.campaigns.relief import best_relief
from pmor.campaigns.rows import NAME, Row, Task, plain_row
from pmor.campaigns.settings import OF_RELIEF, Number
from pmor.campaigns.store import Store, key_of
from pmor.case import Case, GearCase
from pmor.case.coarser import coarser
from pmor.core.errors import CaseError, ConvergenceError, GeometryError, InsufficientMemoryError, MeshError
from pmor.fe.sector import SectorMesh
from pmor.line.layered_pair import LayeredPair, layers_of
from pmor.line.sections import loaded_components
from pmor.pair.blank import blank_below
from pmor.pair.model import neighbouring_teeth, per_gear, solved_gear
from pmor.reduction.basis import Basis, untrained
from pmor.storage.compliance_file import SolvedGear
from pmor.work.cost import meshed_within_memory
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
    components = loaded_components(isinstance(mesh.meshed, LayeredPair), mesh.meshed.pair.pinion.helix_angle != 0.0)

    def solved(sector: SectorMesh, gear: GearCase) -> SolvedGear:
        pair, layers = mesh.meshed.pair, layers_of(mesh.meshed)
        place, tooth = (0, pair.pinion) if sector is mesh.pinion else (1, pair.wheel)
        material = gear.youngs_modulus_GPa, gear.poisson_ratio, case.mesh.element
        key = key_of(sector, tooth, material, neighbouring_teeth(pair), layers[place].columns, components,
                     case.root_stress, blank_below(case, gear, tooth, sector, place))  # fmt: skip

        def solve() -> SolvedGear:
            body = solved_gear(case, mesh, sector, gear)
            stress = None if body.fillet is None else root_stress_shapes(body.fillet, components)
            found = flank_compliance((body, body), components)
            return SolvedGear(found.gears[0], stress, found.supports[0])

        return store.get(key, solve)

    pinion, wheel = per_gear(case, mesh, solved)
    coarse, stresses = coarser(case), (pinion.root_stress, wheel.root_stress)
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
