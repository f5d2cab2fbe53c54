"""The finite elements of a design solved, and solvers of its meshes under loads.

Of a gearbox meshes are searched on the compliance and the displacement of their hubs (`pmor.line.hubs`) as the gearbox
has them with the flanks of the cases, planetary sets under their mean loads. Of linear supports that is exact but for
what the meshes' own changes do to the places of their forces. Flanks that were found are judged by the gearbox solved
anew with them (`pmor.design.in_gearbox`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace

import numpy as np

from pmor.case import Case
from pmor.case.models import halved
from pmor.case.width import elements_across
from pmor.core.errors import CaseError
from pmor.core.progress import stage
from pmor.core.threads import in_order
from pmor.design.files import DesignFile
from pmor.design.settings import Load
from pmor.design.solvers import MeshSolver, Solver, TrainSolver
from pmor.dynamics.whine.quiet import QuietMesh
from pmor.dynamics.whine.respond import respond
from pmor.dynamics.whine.response import LoadResponse
from pmor.dynamics.whine.ringing import KeptModes
from pmor.dynamics.whine.run import speeds_of
from pmor.line.several import GearTrain
from pmor.machine.coupled import MEAN_ANGLES, SolvedLoad, SolvedMesh, solve_load
from pmor.machine.run import trains_of
from pmor.pair.model import refuse_loads
from pmor.sets.run import train_of_variants
from pmor.work.cost import meshed_within_memory, refuse_large_sweep
from pmor_offline.gears import line_basis
from pmor_online.model import ReducedPair, reduced_pair


@dataclass(frozen=True)
class Elements:
    """A design whose finite elements are solved.

    Parameters
    ----------
    file : DesignFile
        Of a gearbox with the torques of its loads on the pinion of the first mesh.
    pairs : mapping of str to ReducedPair
        Of all meshes, by the names of their cases; empty of a set.
    train : GearTrain or None
        Of a set.
    loads : tuple of SolvedLoad
        A gearbox in equilibrium under the loads of the design.
    motions : tuple of LoadResponse
        The same in motion, where the design asks for it.
    """

    file: DesignFile
    pairs: Mapping[str, ReducedPair] = field(default_factory=dict)
    train: GearTrain | None = None
    loads: tuple[SolvedLoad, ...] = ()
    motions: tuple[LoadResponse, ...] = ()

    def meshes(self, name: str) -> list[SolvedMesh]:
        """Return a mesh of the gearbox under each load."""
        return [mesh for load in self.loads for mesh in load.meshes if mesh.meshing.settings.name == name]

    def solvers(
        self, load: Load, angles: int, on_supports: bool = True, coarser: Sequence[Solver] = (),
        stays: bool = False,
    ) -> tuple[Solver, ...]:  # fmt: skip
        """Return solvers of all that is solved by itself, under some of the loads, on so many angles to a mesh cycle.

        Parameters
        ----------
        on_supports : bool
            Whether hubs stand on what the gearbox makes of them under each load; else they are held.
        coarser : sequence of Solver, optional
            Of half as many angles.
        stays : bool
            As of `pmor.design.solvers.FineSolver`.
        """
        if self.train is not None:
            assert self.file.set is not None
            return (TrainSolver(self.file.set, self.train, angles, load.torques_Nm),)
        half, found = [one.variants for one in coarser if isinstance(one, MeshSolver)], []
        for number, name in enumerate(self.file.meshes):
            of_loads = zip(self.loads, self.meshes(name), strict=True)
            meshes = [mesh for one, mesh in of_loads if one.load.name in load.names]
            torques = [1e-3 * mesh.torque for mesh in meshes] if meshes else load.torques_Nm
            found.append(MeshSolver(
                name, number, self.pairs[name], angles, self.file.repeats_after(name), torques,
                [mesh.hubs for mesh in meshes if on_supports], half[number] if half else None, stays,
                self._quiet(name, load.names),
            ))  # fmt: skip
        return tuple(found)


    def _quiet(self, name: str, loads: tuple[str, ...]) -> list[QuietMesh]:
        """A mesh of the gearbox in motion under some loads."""
        chosen = [motion for motion in self.motions if motion.solved.load.name in loads]
        said = self.file.design.motion
        return [QuietMesh(one, one.mesh_names.index(name), said.bearing, said.percentile)
                for one in chosen]  # fmt: skip


def in_motion(elements: Elements) -> Elements:
    """Return a gearbox in equilibrium in motion, where its design asks for it."""
    box, design = elements.file.box, elements.file.design
    if box is None or not design.moves:
        return elements
    speeds = speeds_of(box)
    chosen = np.linspace(speeds[0], speeds[-1], design.motion.speeds)
    said, kept = box.model.sections.dynamics, KeptModes()
    motions = [respond(box.model, load, elements.pairs, said, chosen, kept) for load in elements.loads]
    return replace(elements, motions=tuple(motions))


def elements_of(file: DesignFile, reduced: ReducedPair | None = None, executor: Executor | None = None) -> Elements:
    """Solve the finite elements of a design on threads, and its gearbox under the loads of the design.

    Parameters
    ----------
    reduced : ReducedPair, optional
        Of the only mesh, by line loads; by default it is made.

    Raises
    ------
    CaseError, ConvergenceError, GeometryError
    """
    if file.set is not None:
        return Elements(file, train=train_of_variants(file.set, executor))
    torques = () if file.box is not None else file.design.load.torques_Nm
    if reduced is not None:
        _refuse_unfit(file, reduced)
        pairs = {file.meshes[0]: reduced}
    else:
        cases = file.cases if file.box is None else file.box.model.reduced_cases(file.cases)
        trained = in_order(lambda case: trained_pair(case, torques), cases.values(), executor)
        pairs = dict(zip(cases, trained, strict=True))
    elements = Elements(file, pairs)
    if file.box is not None:
        elements = _in_equilibrium(elements)
    for name in file.meshes:
        angles = file.design.search.angles * file.repeats_after(name)
        refuse_large_sweep(file.name, elements.pairs[name].meshed, angles, len(file.design.load.labels))
    return elements


def _in_equilibrium(elements: Elements) -> Elements:
    file = elements.file
    assert file.box is not None
    model, by_name = file.box.model, {load.name: load for load in file.box.model.sections.loads}
    chosen = [by_name[name] for name in file.design.load.names]
    trains = trains_of(model, chosen)
    loads = tuple(solve_load(model, load, elements.pairs, MEAN_ANGLES, trains=trains) for load in chosen)
    solved = replace(elements, loads=loads)
    for name in file.meshes:
        if any(mesh.meshing.other for mesh in solved.meshes(name)):
            rule = "is on other flanks than the first load of the gearbox: list a load on these first there"
            raise CaseError(f"{file.name}: [load] names: mesh {name} {rule}")
    torques_Nm = tuple(1e-3 * mesh.torque for mesh in solved.meshes(file.meshes[0]))
    design = replace(file.design, load=replace(file.design.load, torques_Nm=torques_Nm))
    return in_motion(replace(solved, file=replace(file, design=design)))


def trained_pair(case: Case, torques_Nm: tuple[float, ...] = ()) -> ReducedPair:
    """Return the reduced pair of a case, by line loads; CaseError where one of the torques is beyond their range."""
    mesh = meshed_within_memory(case)
    if torques_Nm:
        refuse_loads(replace(case, online=replace(case.online, torques_Nm=torques_Nm)), mesh.meshed)
    with stage(f"finite elements of {case.name}"):
        return reduced_pair(line_basis(case, mesh=mesh))


def _refuse_unfit(file: DesignFile, reduced: ReducedPair) -> None:
    """Raise CaseError where a model that was trained for another purpose does not suffice."""
    case = reduced.basis.case
    if "root_stress_MPa" in file.design.results and reduced.basis.root_stress is None:
        raise CaseError(f"{file.name}: root_stress_MPa: the model holds none: train with [results] root_stress = true")
    refuse_loads(replace(case, online=replace(case.online, torques_Nm=file.design.load.torques_Nm)), reduced.meshed)


def coarse_design(file: DesignFile) -> DesignFile | None:
    """Return a design whose gears have half as many elements over profile and width; None where there are no such.

    They have no stress at the roots. Where finite elements take long, the first result does not wait for all of them.
    """
    if "root_stress_MPa" in file.design.results:
        return None
    cases = dict[str, Case]()
    for name, case in file.cases.items():
        fewer = halved(case)
        if fewer is None or elements_across(fewer) > elements_across(case):
            return None
        cases[name] = fewer
    return replace(file, cases=cases, set=None if file.set is None else replace(file.set, cases=cases))
