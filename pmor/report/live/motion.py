"""The section of a page in which a reader goes through motion over the speed: its data, packed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.report.live.model import packed_integers

# Steps of the largest force of a reading, and of the largest displacement of a mode: second differences have four times
# as many.
FORCE_STEPS, SHAPE_STEPS = 2**20, 2**12


@dataclass(frozen=True)
class MotionSection:
    """Forces of lines by load and speed, and modes: a block of `pmor.report.page.page_html`.

    Parameters
    ----------
    data : dict
        `loads`, the `load` shown first, `speeds`, names of `readings`, `by_load` (`lines`, each with `source`, `name`
        and `order`, and what `packed_forces` gives), and `modes` (`names`, `lines`, `points`, rows `across` and `up`,
        `reach`, and what `packed_shapes` gives).
    """

    data: dict[str, Any]
    note: str


def packed_forces(forces: FloatArray) -> dict[str, Any]:
    """Pack forces of readings by lines and speeds, (R, L, S): within half a millionth of the largest of each."""
    steps = forces.max(axis=(1, 2), initial=0.0) / FORCE_STEPS
    whole = np.rint(forces / np.where(steps > 0.0, steps, 1.0)[:, None, None])
    for _ in range(2):
        whole = np.diff(whole, axis=2, prepend=0.0)
    return {"steps": steps.tolist(), "forces": packed_integers(whole)}


def packed_shapes(moves: FloatArray) -> dict[str, Any]:
    """Pack displacements of modes, (m, n), the largest of each 1."""
    return {"step": 1.0 / SHAPE_STEPS, "packed": packed_integers(np.rint(moves * SHAPE_STEPS))}
