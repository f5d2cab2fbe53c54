"""The flank that fits: helix slope and crowning of the pinion that level the load over the face in the machine.

The worst face load factor K_Hbeta over all loads that carry on the same flanks is minimised over both amounts (Nelder &
Mead 1965), on the hubs' compliance and displacement that each load was solved with; the machine is then solved anew
with the flank that was found, and both factors are reported.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import Assembly
from pmor.gear.modification import Modification
from pmor.machine.coupled import MEAN_ANGLES, SolvedLoad, SolvedMesh, solve_load
from pmor.machine.model import GearboxModel
from pmor.pair.conditions import assembly_of
from pmor.results.load_distribution import face_load_factor, line_states
from pmor_online.model import ReducedPair, online_angles, with_flanks
from pmor_online.remedies import least
from pmor_online.variants import VariantSolver

# Amounts are sought so finely, um, and not beyond.
RESOLUTION_UM, MOST_UM, MOST_TRIALS = 0.01, 200.0, 300


class Helix(NamedTuple):
    """Amounts of the pinion beside what its case has, um; as in `[pinion.modification]`."""

    slope_um: float
    crowning_um: float

    def on(self, base: Modification) -> Modification:
        """Return a modification with these amounts added."""
        slope, crowning = base.helix_slope_um + self.slope_um, base.helix_crowning_um + self.crowning_um
        return replace(base, helix_slope_um=slope, helix_crowning_um=crowning)


@dataclass(frozen=True)
class Fit:
    """A flank that fits a mesh in its machine.

    Parameters
    ----------
    mesh : str
    loads : tuple of str
        That it was found for: those that carry on the flanks of the first one.
    helix_slope_um, helix_crowning_um : float
        Of the pinion, beside what its case has, um; as in `[pinion.modification]`.
    before, after : float
        Worst K_Hbeta over these loads, with the flanks of the case and with this one; the machine solved with each.
    """

    mesh: str
    loads: tuple[str, ...]
    helix_slope_um: float
    helix_crowning_um: float
    before: float
    after: float


def fit_meshes(model: GearboxModel, loads: Sequence[SolvedLoad], pairs: Mapping[str, ReducedPair]) -> tuple[Fit, ...]:
    """Return the flank that fits each mesh, one mesh at a time; none where nothing was solved.

    None of meshes that share gears. One with which the machine has no equilibrium is no better than that of the case.
    """
    meshes = enumerate(model.sections.meshes if loads else ())
    return tuple(_fit(model, loads, pairs, number) for number, mesh in meshes if mesh.name in pairs)


def _fit(model: GearboxModel, loads: Sequence[SolvedLoad], pairs: Mapping[str, ReducedPair], number: int) -> Fit:
    name = model.sections.meshes[number].name
    first = loads[0].meshes[number].meshing
    key, sense = first.key, (first.key, first.frame.along)
    alike = [load for load in loads if (one := load.meshes[number].meshing) and (one.key, one.frame.along) == sense]
    meshes = [load.meshes[number] for load in alike]
    helix, assembly = level(pairs[key], meshes), assembly_of(pairs[key].basis.case)
    fitted = replace(assembly, pinion=helix.on(assembly.pinion))
    before = _worst(meshes)
    try:
        after = _worst(solved_anew(model, alike, pairs, number, fitted))
    except ConvergenceError:  # parallel meshes may leave this one without contact: a trial that is no better
        after = before
    if after >= before:  # a level load: what is left is that fewer angles are solved with the flank that was found
        helix, after = Helix(0.0, 0.0), before
    return Fit(name, tuple(load.load.name for load in alike), *helix, before, after)


def _worst(meshes: Sequence[SolvedMesh]) -> float:
    """The largest K_Hbeta; infinite where one carries nothing."""
    found = [float(face_load_factor(line_states(mesh.sweep))[0]) for mesh in meshes]
    return float(np.nan_to_num(found, nan=np.inf).max())


def level(reduced: ReducedPair, meshes: Sequence[SolvedMesh], aligned: bool = False) -> Helix:
    """Return the amounts that lower the largest K_Hbeta of a mesh over its loads most.

    Parameters
    ----------
    meshes : sequence of SolvedMesh
        Under these loads, on the supports of each.
    aligned : bool
        On rigid supports instead.
    """
    phi, assembly = online_angles(reduced.meshed.pair.pitch, MEAN_ANGLES), assembly_of(reduced.basis.case)

    def solver(of: Sequence[SolvedMesh]) -> VariantSolver:
        hubs = [] if aligned else [mesh.hubs for mesh in of]
        return VariantSolver(reduced, phi, [1e-3 * mesh.torque for mesh in of], hubs)

    def factors(solver: VariantSolver, amounts: FloatArray) -> FloatArray:
        state = solver.solve(replace(assembly, pinion=Helix(*map(float, amounts)).on(assembly.pinion)))
        found = face_load_factor(state)
        return np.where(state.converged.all(axis=1) & np.isfinite(found), found, np.inf)

    # The slope that would level rigid flanks, either way, and a little crowning.
    size = max(abs(_misalignment_um(mesh)) for mesh in meshes) + 1.0
    starts = [np.array([slope, 0.1 * size]) for slope in (-0.5 * size, 0.5 * size)]
    whole, deciding = solver(meshes), list[int]()
    place = min(starts, key=lambda amounts: float(factors(whole, amounts).max()))
    # Few loads decide. The amounts are searched under these; where another load is then worse, it joins them.
    while (worst := int(np.argmax(factors(whole, place)))) not in deciding:
        deciding.append(worst)
        few = solver([meshes[number] for number in deciding])

        def worst_of_few(amounts: FloatArray, few: VariantSolver = few) -> float:
            return float(factors(few, amounts).max())

        place = least(
            worst_of_few, [place], (0.5 * size, 0.3 * size),
            (-MOST_UM, 0.0), (MOST_UM, MOST_UM), MOST_TRIALS, RESOLUTION_UM,
        )  # fmt: skip
    return Helix(*(round(float(amount), 2) for amount in place))


def solved_anew(
    model: GearboxModel, loads: Sequence[SolvedLoad], pairs: Mapping[str, ReducedPair], number: int, assembly: Assembly
) -> list[SolvedMesh]:
    """Return a mesh with other flanks, under each load of the machine that is solved anew with them.

    Raises
    ------
    ConvergenceError
    """
    name = model.sections.meshes[number].name
    key = loads[0].meshes[number].meshing.key
    fitted = {**pairs, key: with_flanks(pairs[key], assembly)}
    anew = (solve_load(model, load.load, fitted, MEAN_ANGLES, load.gearbox).meshes for load in loads)
    return [next(mesh for mesh in meshes if mesh.meshing.settings.name == name) for meshes in anew]


def _misalignment_um(mesh: SolvedMesh) -> float:
    relative = mesh.displacement[1] - mesh.displacement[0]
    return 1e3 * mesh.meshing.pair.face_width * float(np.abs(relative[3:5]).sum())
