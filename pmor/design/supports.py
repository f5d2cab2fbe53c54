"""A mesh in its gearbox: what its hubs stand on under each load of a design, and flanks judged by the whole gearbox.

One mesh is designed at a time, the others and planetary sets under their mean loads. A search solves its contact on the
compliance and the displacement of its hubs (`pmor.line.hubs`) as the gearbox has them with the flanks of the case. Of
linear supports that is exact but for what the mesh's own changes do to the places of the other meshes' forces. Flanks
that were found are judged by the gearbox solved anew with them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from pmor.case import without_models
from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.core.threads import in_order
from pmor.design.files import PairDesign
from pmor.design.found import Found
from pmor.design.pair_judge import PairJudge
from pmor.design.search import trained_pair
from pmor.gear.condition import Assembly
from pmor.line.hubs import Hubs
from pmor.machine.coupled import MEAN_ANGLES, SolvedLoad, SolvedMesh, solve_load
from pmor.machine.fit import Helix, level, solved_anew
from pmor.sets.run import train_of
from pmor_online.model import ReducedPair


@dataclass(frozen=True)
class Supports:
    """A gearbox in equilibrium under the loads of a design, with the flanks of the cases.

    Parameters
    ----------
    file : PairDesign
        With the torques of these loads on the pinion.
    pairs : mapping of str to ReducedPair
        Of all meshes, by name.
    loads : tuple of SolvedLoad
    """

    file: PairDesign
    pairs: Mapping[str, ReducedPair]
    loads: tuple[SolvedLoad, ...]

    @property
    def reduced(self) -> ReducedPair:
        """The pair that is designed."""
        return self.pairs[self.file.mesh]

    @property
    def number(self) -> int:
        """Number of the mesh that is designed."""
        return list(self.pairs).index(self.file.mesh)

    @property
    def meshes(self) -> list[SolvedMesh]:
        """The mesh that is designed, under each load."""
        return [load.meshes[self.number] for load in self.loads]

    @property
    def hubs(self) -> list[Hubs]:
        """What its hubs stand on under each load."""
        return [mesh.hubs for mesh in self.meshes]


@dataclass(frozen=True)
class JudgedFlank:
    """A flank judged by the gearbox that is solved anew with it: L loads, R results, A angles, S sections."""

    name: str
    assembly: Assembly
    results: FloatArray  # shape (L, R)
    ste_um: FloatArray  # shape (L, A)
    face_load_N_per_mm: FloatArray  # shape (L, S): Added up over tooth pairs, mean over the angles that converged
    lost: tuple[str, ...]  # Loads under which positions did not converge, and why


@dataclass(frozen=True)
class InGearbox:
    """What the gearbox makes of the flanks of the case, of those that were found, and of those for aligned axes."""

    supports: Supports
    helix: Helix  # That levels the load
    flanks: tuple[JudgedFlank, ...]
    weights: FloatArray  # shape (L,)
    searched: FloatArray | None  # shape (L, R): Results of the best in the search
    failures: tuple[str, ...]  # Flanks with which the gearbox has no equilibrium, or positions did not converge

    def over_loads(self, flank: JudgedFlank, key: str) -> float:
        """Return the largest K_Hbeta of a flank over the loads, or the weighted mean of another result."""
        values = flank.results[:, self.supports.file.design.results.index(key)]
        return float(values.max() if key == "k_h_beta" else values @ self.weights)

    def moved(self, key: str) -> float | None:
        """Return by how much a result of the best in the search is off, over itself, under any load."""
        best = next((flank for flank in self.flanks if flank.name == BEST), None)
        if best is None or self.searched is None:
            return None
        column = self.supports.file.design.results.index(key)
        return float(np.abs(self.searched[:, column] / best.results[:, column] - 1.0).max())

    def ratio(self, key: str, names: tuple[str, str]) -> float | None:
        """Return a result of flanks over that of others, by their names; None without both."""
        by_name = {flank.name: flank for flank in self.flanks}
        if not by_name.keys() >= set(names):
            return None
        one, other = (self.over_loads(by_name[name], key) for name in names)
        return one / other


CASE, ALIGNED, BEST = "flanks of the case", "best for aligned axes", "best for the gearbox"
LEVEL_ALIGNED, LEVEL = "load levelled on aligned axes", "load levelled in the gearbox"
# Flanks that know nothing of the gearbox, and those that take its place.
COMPARED = ((ALIGNED, BEST), (LEVEL_ALIGNED, LEVEL))


def supports_of(file: PairDesign, executor: Executor | None = None) -> Supports:
    """Train all meshes of the gearbox of a design on threads, and solve it under the loads of the design.

    Raises
    ------
    CaseError, ConvergenceError, GeometryError
    """
    assert file.box is not None
    cases = {name: without_models(case) for name, case in file.box.cases.items()} | {file.mesh: file.case}
    pairs = dict(zip(cases, in_order(trained_pair, cases.values(), executor), strict=True))
    model, names = file.box.model, file.design.load.names
    by_name = {load.name: load for load in model.sections.loads}
    trains = {name: train_of(one) for name, one in model.sets.items()}
    loads = tuple(solve_load(model, by_name[name], pairs, MEAN_ANGLES, trains=trains) for name in names)
    found = Supports(file, pairs, loads)
    torques_Nm = tuple(1e-3 * mesh.torque for mesh in found.meshes)
    design = replace(file.design, load=replace(file.design.load, torques_Nm=torques_Nm))
    return replace(found, file=replace(file, design=design))


def judged_by_the_gearbox(
    supports: Supports, found: Found, aligned: Found, executor: Executor | None = None
) -> InGearbox:
    """Return the gearbox solved anew with the best of a search on its supports, and of one on aligned axes."""
    base = supports.file.base
    helix, without = (level(supports.reduced, supports.meshes, aligned) for aligned in (False, True))
    flanks = {CASE: base}
    for name, one in ((ALIGNED, aligned), (BEST, found)):
        if one.best is not None:
            flanks[name] = one.judge.assembly(one.variants.x[one.best])
    for name, amounts in ((LEVEL_ALIGNED, without), (LEVEL, helix)):
        flanks[name] = replace(base, pinion=amounts.on(base.pinion))
    judged, failures = list[JudgedFlank](), list[str]()
    for answer in in_order(lambda item: _judged(supports, found, *item), flanks.items(), executor):
        if isinstance(answer, str):
            failures.append(answer)
        elif answer is None:
            continue
        else:
            judged.append(answer)
            failures += [f"in the gearbox, {answer.name}, {sentence}" for sentence in answer.lost]
    searched = None if found.best is None else found.variants.results[found.best]
    return InGearbox(supports, helix, tuple(judged), found.judge.weights, searched, tuple(failures))


def _judged(supports: Supports, found: Found, name: str, assembly: Assembly) -> JudgedFlank | str | None:
    """Return a flank judged, or why it is not; None of one that levels the load and leaves the mesh without contact."""
    assert supports.file.box is not None
    meshes = supports.meshes
    try:
        if name != CASE:
            meshes = solved_anew(supports.file.box.model, supports.loads, supports.pairs, supports.number, assembly)
    except ConvergenceError as error:
        if name in (LEVEL, LEVEL_ALIGNED):
            return None
        return f"in the gearbox, {name}: {error}"
    fine = found.fine
    assert isinstance(fine, PairJudge)
    judge = _on(fine, meshes)
    state = judge.solve(assembly)
    load = state.load_N_per_mm.sum(axis=(1, 2)) / np.maximum(state.converged.sum(axis=1), 1)[:, None]
    results = judge.results_of(state, assembly, left=True)
    return JudgedFlank(name, assembly, results, state.ste_um, load, tuple(judge.lost(state)))


def _on(judge: PairJudge, meshes: Sequence[SolvedMesh]) -> PairJudge:
    """Return a judge on other supports, and under their torques."""
    torques_Nm = tuple(1e-3 * mesh.torque for mesh in meshes)
    design = replace(judge.design, load=replace(judge.design.load, torques_Nm=torques_Nm))
    anew = PairJudge(judge.reduced, design, judge.base, hubs=[mesh.hubs for mesh in meshes])
    return anew.on_angles(judge.design.search.angles)
