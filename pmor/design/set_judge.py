"""Variants of a planetary set, or of a train on fixed axes: all meshes solved at once, figures with exact derivatives.

Derivatives come from one right-hand side for each state, whatever the figure and however many variables there are
(`pmor.line.kernels.several`, eq. 2): of the STE, whose figures move with the rotation of the first gear, of the mesh
load factor and of face load factors, which move with the forces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray
from pmor.design.files import SetDesign
from pmor.design.judge import Judge
from pmor.design.measures import smooth_top
from pmor.design.set_flanks import flanks_at, of_case, parameter_names
from pmor.design.set_scatter import SetDraw, drawn_sets
from pmor.design.settings import Design
from pmor.design.variables import AS_DRAWN, SEED
from pmor.line.several import GearTrain
from pmor.sets.lost import lost_positions
from pmor.sets.variants import BuiltSet, SetVariant, SetVariants

Parameters = Mapping[str, Mapping[str, float]]


class SetJudge(Judge[BuiltSet, SetVariant]):
    """Judges variants of a set.

    Parameters
    ----------
    file : SetDesign
    train : GearTrain
        Of `pmor.sets.variants.train_of_variants`.
    design : Design
        That of the file, or another one of the same set.
    known : dict of int to SetVariants, optional
        Solvers under the same loads, by the angles to a pitch: they keep what is placed.
    """

    def __init__(
        self, file: SetDesign, train: GearTrain, design: Design, known: dict[int, SetVariants] | None = None
    ) -> None:
        plan, angles, self.file, self.train = file.set.plan, design.search.angles, file, train
        self._known: dict[int, SetVariants] = {} if known is None else known
        if angles not in self._known:
            torques = np.array(design.load.torques_Nm) * plan.torque_Nm / plan.nominal_Nm
            self._known[angles] = SetVariants(plan, train, torques, angles, file.pitches)
        self.solver = self._known[angles]
        flanks = tuple(file.base[mesh.case] for mesh in plan.meshes)
        as_filed = BuiltSet(flanks, plan.displacement, plan.eccentricity)
        super().__init__(design, as_filed, self.solver.phi, file.pitches)
        self._variables = {case: of_case(design.variables, file.flanks, case) for case in file.base}
        self._over_width = meshed_width(next(iter(file.set.cases.values()))) != "plane_strain"

    def alike(self, design: Design) -> SetJudge:
        """Return the judge of another design of the same set with as many angles."""
        shared = design.load.torques_Nm == self.design.load.torques_Nm
        return SetJudge(self.file, self.train, design, self._known if shared else None)

    def on_angles(self, angles: int) -> SetJudge:
        """Return the judge of the same design on so many angles per pitch."""
        design = replace(self.design, search=replace(self.design.search, angles=angles))
        return self.alike(design)

    def drawn(self, count: int, seed: int = SEED) -> tuple[SetDraw, ...]:
        """Return by how much the flanks and pins of so many sets are off; none where nothing scatters."""
        return drawn_sets(self.file, self.design.scatter, count, seed)

    def assembly(self, x: Sequence[float] | FloatArray | None, draw: SetDraw | None = None) -> BuiltSet:
        """Return the set at some values of the variables, or with the flanks of its file, off by a draw."""
        off = (AS_DRAWN,) * len(self.base.flanks) if draw is None else draw.flanks
        flanks = tuple(
            flanks_at(base, {} if x is None else self._variables[mesh.case], () if x is None else x, of_mesh)
            for mesh, base, of_mesh in zip(self.file.set.plan.meshes, self.base.flanks, off, strict=True)
        )
        displacement = self.base.displacement if draw is None else draw.displacement
        return BuiltSet(flanks, displacement, self.base.eccentricity)

    def solve(self, built: BuiltSet, differentiated: bool = False) -> SetVariant:
        """Return the set as it is built in one way."""
        return self.solver.solve(built)

    def lost(self, state: SetVariant) -> list[str]:
        """Return a sentence for each torque under which positions have no solution."""
        return lost_positions(state.solution, self.design.load.labels)

    def measured(self, state: SetVariant, built: BuiltSet, sharpness: float) -> tuple[FloatArray, FloatArray]:
        """Return the objective made smooth under each torque, (T,), and the derivatives of its mean, (n,)."""
        wanted = {
            case: {f"{gear}.{variable.key}" for variable in own.values() for gear in variable.gears}
            for case, own in self._variables.items() if own
        }  # fmt: skip
        measure, rates = self._rates(state, sharpness, wanted)
        found = np.zeros(len(self.design.variables))
        for case, own in self._variables.items():
            for number, variable in own.items():
                # By where a relief starts that there is none of yet: nothing.
                found[number] += sum(rates[case].get(f"{gear}.{variable.key}", 0.0) for gear in variable.gears)
        return measure, found

    def rates(self, state: SetVariant, built: BuiltSet, sharpness: float) -> dict[str, float]:
        """Return the derivatives of the mean of the objective by all parameters of the modifications, by name."""
        names, found = parameter_names(self.file.flanks), dict[str, float]()
        for case, rates in self._rates(state, sharpness, dict.fromkeys(self._variables, ()))[1].items():
            for parameter, rate in rates.items():
                gear, _, key = parameter.partition(".")
                name = f"{names[case, gear]}.{key}"
                found[name] = found.get(name, 0.0) + rate
        return found

    def result(self, key: str, state: SetVariant, built: BuiltSet) -> FloatArray:
        """Return one result, none of the STE, under each torque, (T,)."""
        if key == "k_gamma":
            return state.solution.k_gamma
        return np.asarray(getattr(state, "edge_load_N_per_mm" if key == "tip_edge_load_N_per_mm" else key))

    def _rates(
        self, state: SetVariant, sharpness: float, wanted: Mapping[str, set[str] | tuple[()]]
    ) -> tuple[FloatArray, Parameters]:
        """Return the objective made smooth under each torque, and the derivatives of its mean by parameters."""
        found = state.solution.found
        by_movement, by_force = np.zeros(found.movement.shape), np.zeros(found.force.shape)
        key = self.design.objective.minimise
        if key == "k_gamma":
            measure, by_force = self._of_planets(state, sharpness)
        elif key == "k_h_beta":
            measure, by_force = self._of_faces(state, sharpness)
        else:
            measure, by_ste = self._of_ste(state, sharpness)
            radius = self.train.meshes[0].pair.base_radius
            by_movement[..., self.file.set.plan.driver] = 1e3 * radius * by_ste
        weights = self.weights[:, None, None]
        by_deviation = self.solver.differentiate(state, weights * by_movement, weights * by_force)
        return measure, self.solver.by_parameters(state, by_deviation, self._over_width, wanted)

    def _of_planets(self, state: SetVariant, sharpness: float) -> tuple[FloatArray, FloatArray]:
        """Return the smooth mesh load factor under each torque, (T,), and its derivatives by forces, (T, A, N)."""
        solved = state.solution
        share, (torques, angles) = solved.planet_share, solved.converged.shape
        count, a_pitch = len(solved.plan.planets), angles // solved.pitches
        mean = count * share.reshape(torques, solved.pitches, a_pitch, count).mean(axis=2)
        measure, weights = smooth_top(mean.reshape(torques, -1), sharpness)
        by_share = np.repeat(weights.reshape(torques, solved.pitches, count) * count / a_pitch, a_pitch, axis=1)
        total = solved.tangential_pin_force_N.sum(axis=2, keepdims=True)
        by_pin = (by_share - (by_share * share).sum(axis=2, keepdims=True)) / total
        of_pins = np.tile(solved.tangential_rows, (solved.cycles, 1, 1))
        return measure, np.einsum("tap,anp->tan", by_pin, of_pins)

    def _of_faces(self, state: SetVariant, sharpness: float) -> tuple[FloatArray, FloatArray]:
        """Return the smooth largest face load factor of the meshes, (T,), and its derivatives by forces, (T, A, N)."""
        solved, found = state.solution, []
        for number in range(len(solved.train.meshes)):
            loads = solved.face_loads(number)
            over_face = loads.load_N_per_mm.sum(axis=(1, 2))
            mean = over_face @ loads.width_mm / loads.width_mm.sum()
            # Meshes that carry nothing have no such factor.
            share = np.divide(1.0, mean, out=np.zeros(mean.shape), where=solved.carrying[:, number])[:, None]
            found.append((over_face * share, share, loads.width_mm))
        measure, weights = smooth_top(np.concatenate([ratio for ratio, _, _ in found], axis=1), sharpness)
        by_force, first = np.zeros(solved.found.force.shape), 0
        for one, (ratio, share, width) in zip(solved.placed.placed, found, strict=True):
            own = weights[:, first : first + len(width)]
            first += len(width)
            by_load = own / width - (own * ratio).sum(axis=1, keepdims=True) / width.sum()
            pairs = one.rows.shape[1] // len(width)
            by_force[..., one.part] = np.tile(by_load * share, (1, pairs))[:, None, :]
        return measure, by_force
