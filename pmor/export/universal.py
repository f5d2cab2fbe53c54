"""Motion over the speed as a universal file: a function at a degree of freedom (data set 58) for each line of a force.

The abscissa is the speed, rpm; values are complex, from zero to peak, N; the axis z is the order, the frequency over
the speed. Response nodes count the bearings, reference nodes the sources, both from 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from pmor.core.errors import CaseError, ExternalProgramError
from pmor.storage.atomic import atomic_path
from pmor.storage.results_file import ResultsFile

# Types of data in the format: general, reaction force, turns a minute, order.
GENERAL, REACTION, RPM, ORDER = 0, 9, 19, 20
# Characters of a line of words.
LONGEST = 80


def write_universal(results: ResultsFile, path: Path, overwrite: bool = False) -> None:
    """Write the bearing forces of results of motion.

    Raises
    ------
    CaseError
        Where the results are not of a machine in motion.
    ExternalProgramError
        Where pyuff is not installed.
    OutputError
    """
    told = "/lines/frequency"
    places = sorted(name.removesuffix(told) for name in results.arrays if name.endswith(told))
    if not places:
        raise CaseError(f"{results.case_name}: --to uff takes results.h5 of pmor dynamics of a gearbox or a set")
    try:
        from pyuff import UFF
    except ImportError:
        raise ExternalProgramError(
            "export --to uff: the package pyuff is not installed: pip install pyuff, or 'pmor-gear[uff]'"
        ) from None
    with atomic_path(path, overwrite) as temporary:
        UFF(str(temporary)).write_sets([one for place in places for one in functions(results, place)], "overwrite")


def functions(results: ResultsFile, place: str) -> Iterator[dict[str, Any]]:
    """Give the data sets of a load: each line of each bearing along x, y and z, at the speeds that have it."""
    arrays, load = results.arrays, place.rsplit("/", 1)[-1]
    speed, frequency = arrays[f"{place}/speed/speed"], arrays[f"{place}/lines/frequency"]
    force = arrays[f"{place}/lines/bearing_force"] * np.exp(1j * arrays[f"{place}/lines/bearing_force_phase"])
    names, number = results.names, results.names["loads"].index(load) + 1 if load in results.names["loads"] else 1
    for source, line in np.argwhere(np.isfinite(frequency).any(axis=1)):
        known = np.isfinite(frequency[source, :, line])
        order = float((60.0 * frequency[source, known, line] / speed[known])[0])
        for bearing in range(force.shape[3]):
            for direction in range(3):
                words = names["bearings"][bearing], names["sources"][source], f"line {line + 1}, load {load}"
                yield {
                    "type": 58, "func_type": GENERAL, "id1": words[0][:LONGEST], "id2": words[1][:LONGEST],
                    "id3": words[2][:LONGEST], "load_case_id": number, "rsp_node": bearing + 1,
                    "rsp_dir": direction + 1, "ref_node": int(source) + 1, "ref_dir": 0, "z_axis_value": order,
                    "z_axis_spec_data_type": ORDER, "abscissa_spec_data_type": RPM, "abscissa_axis_lab": "speed",
                    "abscissa_axis_units_lab": "rpm", "ordinate_spec_data_type": REACTION, "ordinate_axis_lab": "force",
                    "ordinate_axis_units_lab": "N", "orddenom_spec_data_type": 0, "abscissa_spacing": 0,
                    "x": speed[known], "data": force[source, known, line, bearing, direction],
                }  # fmt: skip
