"""How loud a mesh is with other flanks: largest forces over the speed, the machine as it stands under its load.

Modes and receptances stay; the law of the mesh is found anew at the deflection that the machine takes, and Hill's
equations are solved with it. Lines of other sources are those of the machine as it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.whine.gradient import cycle_of_flanks
from pmor.dynamics.whine.hill import hill, mesh_forces
from pmor.dynamics.whine.readings import bearing_names, force_lines
from pmor.dynamics.whine.response import AIR, RPM, LoadResponse
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
        Over the speeds: 100 is the largest.
    """

    response: LoadResponse
    number: int
    bearing: str | None
    percentile: float

    def results(self, assembly: Assembly) -> dict[str, float]:
        """Return the results of motion with some flanks; NaN where the mesh has no law."""
        response, source = self.response, self.response.meshes[self.number]
        motion = source.mesh
        assert motion is not None, "of a mesh"
        flanks = replace(motion.standing.condition, pinion=assembly.pinion, wheel=assembly.wheel)
        try:
            cycle = cycle_of_flanks(motion, flanks, STEPS)
        except ConvergenceError:
            return dict.fromkeys(RESULTS, np.nan)
        own, told = source.ports, source.told.shape[1]
        still = np.broadcast_to(motion.at_rest, (len(response.speeds_rpm), 1, 2, 2))
        moving = np.concatenate([still, np.stack([one.ports(own, own) for one in source.orders], axis=1)], axis=1)
        acting = hill(cycle, moving, motion.cycle.mean)
        readings = np.stack([source.orders[n].readings(own, acting[:, n + 1]) for n in range(told)], axis=1)
        mesh = mesh_forces(motion.cycle.mean, moving, acting)[:, 1 : told + 1, 0]
        return {
            "mesh_force_N": self._over_speed(np.asarray(2.0 * abs(mesh) ** 2 * source.told), "mesh"),
            "bearing_force_N": self._over_speed(self._of_bearings(readings) * source.told, "bearing"),
            "radiated_power_mW": self._over_speed(self._power(readings) * source.told, "power") ** 2,
        }

    def _over_speed(self, squares: FloatArray, kind: str) -> float:
        """Root of the squares of all lines, own ones (S, K) and those of other sources, over the speeds."""
        total = np.sqrt(squares.sum(axis=1) + self._others(kind))
        return float(np.percentile(total, self.percentile))

    def _of_bearings(self, readings: ComplexArray) -> FloatArray:
        force = self.response.bearing_forces(readings)[..., self._bearing, :3]
        return np.asarray(2.0 * (abs(force) ** 2).sum(axis=-1))

    def _power(self, readings: ComplexArray) -> FloatArray:
        source, response = self.response.meshes[self.number], self.response
        omega = RPM * response.speeds_rpm[:, None] * source.rate * np.arange(1, source.told.shape[1] + 1)
        normal = response.housing(readings) @ response.machine.surface.T
        return np.asarray(2.0 * AIR * omega**2 * (abs(normal) ** 2).sum(axis=-1))

    @property
    def _bearing(self) -> int:
        names = bearing_names(self.response)
        if self.bearing is not None:
            return names.index(self.bearing)
        source = self.response.meshes[self.number]
        return int((force_lines(self.response, source, source.lines) ** 2).sum(axis=1).max(axis=0).argmax())

    def _others(self, kind: str) -> FloatArray:
        """Squares of the lines of other sources, (S,)."""
        total = np.zeros(len(self.response.speeds_rpm))
        for place, source in enumerate(self.response.sources):
            if place == self.number:
                continue
            if kind == "mesh":
                total += (2.0 * abs(source.lines.mesh_forces[..., self.number]) ** 2 * source.told).sum(axis=1)
            elif kind == "bearing":
                total += (force_lines(self.response, source, source.lines)[..., self._bearing] ** 2).sum(axis=1)
            else:
                total += self.response.power(source.lines, source).sum(axis=1)
        return total
