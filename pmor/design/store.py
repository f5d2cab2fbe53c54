"""Variants as they are found, in a file that can be read at any time, also after an interruption."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pmor.core.arrays import BoolArray
from pmor.design.descent import kept
from pmor.design.loader import DesignFile
from pmor.design.settings import Design
from pmor.design.variants import Variants, together
from pmor.storage.design_file import DesignResults, write_design_file

#: name of the file, in the folder of finished pieces
STORE = "variants.h5"


class Store:
    """Keeps a file of all variants that are finished.

    Parameters
    ----------
    folder : Path
        Of finished pieces.
    """

    def __init__(self, file: DesignFile, folder: Path) -> None:
        self._file, self._path = file, folder / STORE
        self._parts: list[Variants] = []

    def take_over(self, variants: Variants) -> None:
        """Add variants of an earlier run; they are written with the next new ones."""
        self._parts.append(variants)

    def add(self, variants: Variants) -> None:
        """Add variants and write the file.

        Raises
        ------
        OutputError
        """
        self._parts.append(variants)
        write_design_file(self._path, stored(self._file, together(self._parts)))


def stored(file: DesignFile, variants: Variants) -> DesignResults:
    """Return the content of a file of variants."""
    design = file.design
    origins = tuple(dict.fromkeys(variants.origin))
    low, high = np.array([v.range for v in design.variables]).T
    weight = np.array(design.load.weights)
    arrays = {
        "torque": np.array(design.load.torques_Nm),
        "weight": weight / weight.sum(),
        "lowest": low,
        "highest": high,
        "x": variants.x,
        "results": variants.results,
        "objective": variants.objective,
        "kept": all_kept(design, variants),
        "origin": np.array([origins.index(o) for o in variants.origin], dtype=np.int64),
    }
    if design.constraints:
        arrays["limits"] = variants.limits
    constraints = tuple(f"{c.result} at most {c.at_most:g}" for c in design.constraints)
    return DesignResults(
        file.text, tuple(v.name for v in design.variables), design.results, constraints, origins, (), arrays
    )


def all_kept(design: Design, variants: Variants) -> BoolArray:
    """Return whether variants are known and keep all constraints, (V,)."""
    return np.asarray(kept(design.constraints, variants.limits) & np.isfinite(variants.objective))
