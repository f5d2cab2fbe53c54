"""How loud a mesh is with other flanks: largest forces over the speed, the machine as it stands under its load.

Modes and receptances stay; the law of the mesh is found anew at the deflection that the machine takes, and Hill's
equations are solved with it. Lines of other sources are those of the machine as it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.whine.gradient import cycle_of_flanks
from pmor.dynamics.whine.hill import hill
from pmor.dynamics.whine.readings import bearing_names
from pmor.dynamics.whine.response import LoadResponse, Source
from pmor.gear.condition import Assembly

#: results of motion by their keys
RESULTS = ("mesh_force_N", "bearing_force_N", "radiated_power_mW")
# Steps of the deflection that the machine takes.
STEPS = 2


@dataclass(frozen=True)
class QuietMesh:
    """A mesh of a machine in motion whose flanks are chosen.

    Parameters
    ----------
    response : LoadResponse
        With the flanks of the file.
    number : int
        Of the mesh.
    bearing : str or None
        Whose force counts; None is the most loaded.
    percentile : float
        Percentile over the speeds: 100 is the largest.
    """

    response: LoadResponse
    number: int
    bearing: str | None
    percentile: float

    def results(self, assembly: Assembly) -> dict[str, float]:
        """Return the results of motion with some flanks; NaN where the mesh has no law."""
        source, motion, place = self.response.source_of(self.number)
        meshes = motion.standing.with_flank(place, 0, assembly.pinion).with_flank(place, 1, assembly.wheel)
        try:
            cycle = cycle_of_flanks(motion, meshes, STEPS)
        except ConvergenceError:
            return dict.fromkeys(RESULTS, np.nan)
        told = source.told.shape[1]
        acting = hill(cycle, self._moving, motion.cycle.mean)
        readings = np.stack([source.orders[n].readings(source.ports, acting[:, n + 1]) for n in range(told)], axis=1)
        forces = source.lines.mesh_forces.copy()
        forces[..., motion.standing.numbers] = motion.forces(self._moving, acting)[:, 1 : told + 1]
        squares = self._squares(replace(source, lines=replace(source.lines, mesh_forces=forces, readings=readings)))
        total = {key: np.sqrt(one + self._others[key]) for key, one in squares.items()}
        found = {key: float(np.percentile(root, self.percentile)) for key, root in total.items()}
        return {**found, "radiated_power_mW": found["radiated_power_mW"] ** 2}

    @cached_property
    def _moving(self) -> ComplexArray:
        """Receptance of the closed machine at the mesh, at rest and at all harmonics, (S, K + 1, q, q)."""
        source, motion, _ = self.response.source_of(self.number)
        return motion.moving(source.orders)

    @cached_property
    def _bearing(self) -> int:
        """Number of the bearing whose force counts."""
        names = bearing_names(self.response)
        if self.bearing is not None:
            return names.index(self.bearing)
        source, *_ = self.response.source_of(self.number)
        return int((self.response.force_lines(source) ** 2).sum(axis=1).max(axis=0).argmax())

    @cached_property
    def _others(self) -> dict[str, FloatArray]:
        """Squares of the lines of all other sources over the speed."""
        own, *_ = self.response.source_of(self.number)
        every = [self._squares(one) for one in self.response.sources if one is not own]
        return {key: np.asarray(sum((one[key] for one in every), np.zeros(len(self.response.speeds_rpm))))
                for key in RESULTS}  # fmt: skip

    def _squares(self, source: Source) -> dict[str, FloatArray]:
        """Squares of the results over the speed by the lines of a source, (S,); of power itself."""
        force = self.response.force_lines(source)[..., self._bearing]
        mesh = abs(source.lines.mesh_forces[..., self.number])
        return {
            "mesh_force_N": 2.0 * (mesh**2 * source.told).sum(axis=1),
            "bearing_force_N": (force**2).sum(axis=1),
            "radiated_power_mW": self.response.power(source.lines, source).sum(axis=1),
        }
