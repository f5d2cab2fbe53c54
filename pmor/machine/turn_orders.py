"""What changes over a turn of the carrier of a set, and its orders: loads of planets, rows, supports, misalignment."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.line.hubs import HUB
from pmor.machine.carrier_turn import CarrierTurn
from pmor.machine.coupled_sets import SolvedSet
from pmor.machine.loaded import LoadedGearbox
from pmor.machine.mesh_force import f_beta_um
from pmor.sets.lost import known
from pmor.sets.readings import plain
from pmor.sets.solution import on_planets

# Orders of the carrier's turn that are told in any case.
LOW = (1, 2, 3)
ROUND_OFF = 1e-9


class Course(NamedTuple):
    """A quantity over the positions of a turn.

    Attributes
    ----------
    of : str
        What it is of: planet, row, mesh, support.
    quantity : str
        Its key in the table of quantities.
    values : ndarray, shape (P,)
    """

    of: str
    quantity: str
    name: str
    values: FloatArray

    def data(self, turn: CarrierTurn, told: Sequence[float]) -> dict[str, Any]:
        """Return its mean and the amplitudes of orders, zero to peak; null where a position has no solution."""
        lines = 2.0 / len(self.values) * np.abs(np.fft.rfft(self.values))
        found = [plain(lines[round(order * turn.turns)]) for order in told]
        return {
            "of": self.of, "quantity": self.quantity, "name": self.name,
            "mean": plain(known(np.mean, self.values)), "amplitudes": found,
        }  # fmt: skip


def orders_told(turn: CarrierTurn, planets: int) -> list[float]:
    """Return the orders to a turn of the carrier that are told: low ones, of the planets, and of loads that turn.

    In the housing a load comes back as often as its shaft turns, before the planets as often as it passes them.
    """
    rates = [abs(one) for rate in turn.rates.tolist() for one in (rate, rate - 1.0)]
    found = {round(one, 9) for one in (*map(float, (*LOW, planets)), *rates) if one > ROUND_OFF}
    return sorted(one for one in found if round(one * turn.turns) <= len(turn.angle_deg) // 2)


def courses(gearbox: LoadedGearbox, one: SolvedSet) -> Iterator[Course]:
    """Yield what is told of a set over a turn of its carrier."""
    turn, plan = one.turn, one.meshing.file.plan
    assert turn is not None
    assert plan.on_pins is not None, "of a planetary set"
    share, rows = planet_shares(turn, one), planet_rows(turn)
    names = [plan.bodies[body].name for body in plan.planets]
    for planet, name in enumerate(names):
        yield Course("planet", "planet_load_over_mean", name, share.shape[1] * share[:, planet])
    for planet, name in enumerate(names):
        for row, place in enumerate(plan.on_pins.pin.bearings_mm):
            yield Course("row", "radial_force_N", f"{name}, row at {place:g} mm", rows[:, planet, row])
    for name, values in zip(one.solution.mesh_names, mesh_misalignment(turn, one).T, strict=True):
        yield Course("mesh", "f_beta_um", name, values)
    for number, bearing in enumerate(gearbox.bearings):
        across = np.linalg.norm(turn.bearing_force[:, number, 1:3], axis=1)
        yield Course("support", "radial_force_N", bearing.settings.name, across)


def planet_shares(turn: CarrierTurn, one: SolvedSet) -> FloatArray:
    """Return the share of each planet in what the meshes carry around, (P, N)."""
    force = one.solution.outwards_and_around(on_planets(one.meshing.file.plan, turn.hub_wrench)[..., :2])[..., 1]
    return np.asarray(force / force.sum(axis=1, keepdims=True))


def planet_rows(turn: CarrierTurn) -> FloatArray:
    """Return forces across the bearing rows of all planets, (P, N, b), N."""
    return np.asarray(np.linalg.norm(turn.pin_load[..., :2], axis=-1))


def mesh_misalignment(turn: CarrierTurn, one: SolvedSet) -> FloatArray:
    """Return F_beta of all meshes as `f_beta_um` has it, positive where flanks overlap more at the larger x, (P, M)."""
    found = []
    for mesh in one.solution.train.meshes:
        hubs = np.zeros((len(turn.angle_deg), 2, HUB))
        hubs[..., 3:5] = turn.tilt[:, list(mesh.bodies)]
        found.append(f_beta_um(mesh.pair.meshed.pair, hubs @ mesh.to_train))
    along = float(np.sign(one.meshing.frame.turn[0, 2]))
    return along * np.where(turn.converged[:, None], np.transpose(found), np.nan)
