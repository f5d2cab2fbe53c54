"""Arrays of a sweep and of a results file for tables, with the units, axes and descriptions of the results file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from pmor.export.tables import ResultArray
from pmor.gear.pair import GearPair
from pmor.results.sweep import SteSweep, mesh_stiffness, orders_of
from pmor.storage.layout import Layout
from pmor.storage.results_file import RESULTS_LAYOUT, read_results


def sweep_arrays(sweep: SteSweep, pair: GearPair) -> dict[str, np.ndarray]:
    """Return transmission error, load sharing, stiffness and orders of a sweep by their paths in a results file."""
    stiffness = mesh_stiffness(sweep, pair.pinion.base_radius, pair.common_width)
    optional = {
        "ste/unloaded": sweep.unloaded_um, "ste/error_bar": sweep.error_bar_um,
        "stiffness/tangent": None if sweep.stiffness_N_per_um is None else stiffness.tangent,
    }  # fmt: skip
    found = {
        "ste/phi": sweep.phi_rad, "ste/torque": sweep.torque_Nm, "ste/ste": sweep.ste_um,
        "ste/rotation": 1e3 * sweep.ste_um / pair.pinion.base_radius, "ste/converged": sweep.converged,
        "ste/pair_index": sweep.pair_index, "ste/pair_share": sweep.pair_share, "stiffness/secant": stiffness.secant,
        **{name: array for name, array in optional.items() if array is not None},
    }  # fmt: skip
    if sweep.converged.all():
        orders = [orders_of(sweep, row) for row in range(len(sweep.torque_Nm))]
        found["orders/order"] = orders[0].order
        found |= {f"orders/{name}": np.stack([getattr(o, name) for o in orders]) for name in ("amplitude", "phase")}
    return found


def sweep_entries(sweep: SteSweep, pair: GearPair) -> dict[str, ResultArray]:
    """Return the arrays of `sweep_arrays` with their descriptions."""
    return _described(sweep_arrays(sweep, pair), RESULTS_LAYOUT)


def file_entries(path: Path) -> dict[str, ResultArray]:
    """Return the arrays of a results file with their descriptions.

    Raises
    ------
    FileFormatError
        When it is foreign, damaged, or of another version.
    """
    found = read_results(path)
    return _described(found.arrays, found.kind.layout)


def _described(arrays: Mapping[str, np.ndarray], layout: Layout) -> dict[str, ResultArray]:
    fields = {name: (array, layout[name]) for name, array in arrays.items()}
    return {name: ResultArray(a, f.unit, tuple(f.dims.split(", ")), f.description) for name, (a, f) in fields.items()}
