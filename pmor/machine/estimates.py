"""Bearings of a gearbox that are known by their sizes alone: as stiff as estimated under their largest load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from pmor.core.errors import PmorError
from pmor.machine.loaded import loaded
from pmor.machine.model import GearboxModel
from pmor.machine.readings import carried

# Loads and stiffness follow from each other: loads change little with it.
ROUNDS = 3
# Of the largest load of a bearing: one that carries less is as stiff as under this.
LEAST_SHARE = 0.05
# Until the loads are known, N.
FIRST_LOAD_N = 1e3


def with_estimates(model: GearboxModel) -> tuple[GearboxModel, list[str]]:
    """Return a model whose bearings by sizes have the stiffness that belongs to their largest load; and notes.

    Their loads are those of the shafts under mean forces of the meshes. Where nothing holds a shaft, the first guess
    stays, and the solution says what is loose.
    """
    sizes = {bearing.name: bearing.catalogue for bearing in model.sections.bearings if bearing.catalogue is not None}
    if not sizes:
        return model, []
    loads: dict[str, float] = {}
    stiff = _stiffened(model, dict.fromkeys(sizes, FIRST_LOAD_N))
    try:
        for _ in range(ROUNDS):
            loads = _largest(stiff)
            least = LEAST_SHARE * max(loads.values())
            loads = {name: max(loads[name], least) for name in sizes}
            stiff = _stiffened(model, loads)
    except PmorError:
        loads = {}
    across = {bearing.name: bearing.radial_N_per_mm for bearing in stiff.sections.bearings}
    under = {name: f"under {loads[name]:.3g} N" if name in loads else "under 1 kN" for name in sizes}
    return stiff, [
        f"{name}: neither stiffness nor inner geometry: {across[name]:.3g} N/mm across {under[name]} estimated after "
        f"{one.source}: good to a factor of two"
        for name, one in sizes.items()
    ]


def _largest(model: GearboxModel) -> dict[str, float]:
    """Largest radial load of each bearing over all load cases, N."""
    found = dict[str, float]()
    for load in model.sections.loads:
        gearbox = loaded(model, load)
        for one in carried(gearbox, gearbox.solve()):
            found[one["name"]] = max(found.get(one["name"], 0.0), one["radial_force_N"])
    return found


def _stiffened(model: GearboxModel, loads: Mapping[str, float]) -> GearboxModel:
    bearings = tuple(bearing.estimated(loads.get(bearing.name, 0.0)) for bearing in model.sections.bearings)
    return replace(model, sections=replace(model.sections, bearings=bearings))
