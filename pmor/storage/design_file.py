"""The file of a design: all evaluated variants, in arrays with unit, axes and description."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pmor.storage.hdf5 import Schema, attribute, create, open_checked, read_all, write_all
from pmor.storage.layout import Field

DESIGN_SCHEMA = Schema("pmor-design", 2, "make it anew with pmor.run_design")

DESIGN_LAYOUT = {
    "torque": Field("N m", "torque", "on the pinion", least=0.0),
    "weight": Field("1", "torque", "share of each torque in the objective", least=0.0),
    "lowest": Field("1", "variable", "end of the range, in the unit of the variable"),
    "highest": Field("1", "variable", "other end of the range, in the unit of the variable"),
    "x": Field("1", "variant, variable", "values of the variables, each in its unit"),
    "results": Field("1", "variant, torque, result", "nominal, each in its unit; NaN: not converged", finite=False),
    "objective": Field("um", "variant", "minimised quantity, or a factor of 1; NaN: not converged", finite=False),
    "angles": Field("1", "variant", "angles per pitch that results are of", kind=int, least=1.0, optional=True),
    "searched": Field("um", "variant", "objective on the angles of the search", finite=False, optional=True),
    "limits": Field("1", "variant, constraint", "constrained quantity, in its unit", finite=False, optional=True),
    "kept": Field("1", "variant", "whether all constraints are kept", kind=bool),
    "origin": Field("1", "variant", "number among the origins of the file", kind=int, least=0.0),
    "front": Field("1", "point", "variants of the Pareto front", kind=int, least=0.0, optional=True),
    "curves/phi": Field("rad", "angle", "pinion angle", optional=True),
    "curves/ste": Field(
        "um", "curve, torque, angle", "static transmission error of chosen variants", finite=False, optional=True
    ),
}


@dataclass(frozen=True)
class DesignResults:
    """Content of a design file.

    Parameters
    ----------
    text : str
        Of the design file and its case.
    variables, results, constraints, origins, curves : tuple of str
        Names along the axes.
    arrays : mapping of str to ndarray
        By their paths in `DESIGN_LAYOUT`.
    """

    text: str
    variables: tuple[str, ...]
    results: tuple[str, ...]
    constraints: tuple[str, ...]
    origins: tuple[str, ...]
    curves: tuple[str, ...]
    arrays: Mapping[str, np.ndarray]


NAMES = ("variables", "results", "constraints", "origins", "curves")


def write_design_file(path: Path, content: DesignResults) -> None:
    """Write a design file, whole, in the place of an older one of ours; OutputError where that fails."""
    attributes = {"text": content.text} | {name: ", ".join(getattr(content, name)) for name in NAMES}
    with create(path, DESIGN_SCHEMA, attributes, overwrite=True) as file:
        write_all(file, content.arrays, DESIGN_LAYOUT)


def read_design_file(path: Path) -> DesignResults:
    """Read a design file.

    Raises
    ------
    FileFormatError
        When it is missing, foreign, damaged, or of another version.
    """
    with open_checked(path, DESIGN_SCHEMA) as file:
        arrays = read_all(file, DESIGN_LAYOUT)
        names = {name: tuple(filter(None, attribute(file, name, str).split(", "))) for name in NAMES}
        return DesignResults(text=attribute(file, "text", str), arrays=arrays, **names)
