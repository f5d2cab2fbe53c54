"""What follows from a REXS gearbox once its torques are known: stiffness of bearings; results of the file, compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from pmor.body.bearing_estimate import CatalogueBearing
from pmor.core.errors import PmorError
from pmor.machine.model import GearboxModel, held_torques, loaded
from pmor.machine.readings import carried

# Loads and stiffness follow from each other: loads change little with it.
ROUNDS = 3
# Of the largest load of a bearing: one that carries less is as stiff as under this.
LEAST_SHARE = 0.05
# Relative; results of other programs have losses, or are rounded.
DIFFERS = 0.01


def with_estimates(model: GearboxModel, estimated: Mapping[str, CatalogueBearing]) -> tuple[GearboxModel, list[str]]:
    """Return a model whose catalogue bearings have the stiffness that belongs to their largest load; and notes.

    Their loads are those of the shafts under mean forces of the meshes. Where nothing holds a shaft, the first guess
    stays, and the solution says what is loose.
    """
    if not estimated:
        return model, []
    loads: dict[str, float] = {}
    try:
        for _ in range(ROUNDS):
            loads = _largest(model)
            least = LEAST_SHARE * max(loads.values())
            loads = {name: max(loads[name], least) for name in estimated}
            model = _stiffened(model, {name: one.radial_N_per_mm(loads[name]) for name, one in estimated.items()})
    except PmorError:
        loads = {}
    found = {bearing.name: bearing.radial_N_per_mm for bearing in model.sections.bearings}
    under = {name: f"under {loads[name]:.3g} N" if name in loads else "under 1 kN" for name in estimated}
    return model, [
        f"{name}: neither stiffness nor inner geometry: {found[name]:.3g} N/mm across {under[name]} estimated after "
        f"{one.source}: good to a factor of two"
        for name, one in estimated.items()
    ]


def other_results(model: GearboxModel, results: Sequence[tuple[str, str, float]]) -> list[str]:
    """Return notes on torques that a file has as results, and that are others here."""
    loads, found = {load.name: load for load in model.sections.loads}, list[str]()
    for name, shaft, torque in results:
        own = held_torques(model, loads[name]).get(shaft)
        if own is not None and abs(own - torque) > DIFFERS * abs(torque):
            found.append(f"{name}: the file has {torque:.6g} N m on {shaft} as a result: {own:.6g} N m hold it here")
    return found


def _largest(model: GearboxModel) -> dict[str, float]:
    """Largest radial load of each bearing over all load cases, N."""
    found = dict[str, float]()
    for load in model.sections.loads:
        gearbox = loaded(model, load)
        for one in carried(gearbox, gearbox.solve()):
            found[one["name"]] = max(found.get(one["name"], 0.0), one["radial_force_N"])
    return found


def _stiffened(model: GearboxModel, stiffness: Mapping[str, float]) -> GearboxModel:
    bearings = tuple(
        replace(one, radial_N_per_mm=stiffness[one.name]) if one.name in stiffness else one
        for one in model.sections.bearings
    )
    return replace(model, sections=replace(model.sections, bearings=bearings))
