"""Results as tables and labelled arrays of other packages, with units as attributes."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from pmor.core.errors import ExternalProgramError
from pmor.core.shown import Columns, html_table
from pmor.results.quantities import TABLE

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset, DataTree

# Units by the ends of keys, the longest first.
ENDS = {
    "N_per_mm_um": "N/(mm um)", "N_per_mm": "N/mm", "N_per_um": "N/um", "percent": "%", "mrad": "mrad",
    "urad": "urad", "rad": "rad", "deg": "deg", "um": "um", "mm": "mm", "Nm": "N m", "MPa": "MPa", "Hz": "Hz",
    "rpm": "rpm", "kg": "kg", "N": "N", "mW": "mW", "W": "W", "s": "s",
}  # fmt: skip
# Parts of the path of an array of a machine with several parts: kind, name, load.
PLACE = 3


class Labelled(Protocol):
    """An array with its unit, axes and description."""

    @property
    def values(self) -> np.ndarray: ...  # noqa: D102

    @property
    def unit(self) -> str: ...  # noqa: D102

    @property
    def dims(self) -> tuple[str, ...]: ...  # noqa: D102

    @property
    def description(self) -> str: ...  # noqa: D102


class Tabular:
    """A result that is a table: shown as one in a notebook, and taken over by pandas and xarray."""

    def columns(self) -> Columns:
        """All of it by the names of columns."""
        raise NotImplementedError

    def _shown(self) -> Columns:
        """What a notebook shows of it."""
        return headed(self.columns())

    def _labelled(self) -> Mapping[str, Labelled]:
        """Return its arrays, as `results.h5` has them; empty of one that is a table alone."""
        return {}

    def to_dataframe(self) -> DataFrame:
        """Return the result as a table of pandas, units in the names of its columns and in ``attrs["units"]``.

        Raises
        ------
        ExternalProgramError
            Where pandas is not installed.
        """
        columns = dict(self.columns())
        frame: DataFrame = _package("pandas", "to_dataframe").DataFrame(columns)
        frame.attrs["units"] = {name: unit for name in columns if (unit := unit_of(name))}
        return frame

    def to_xarray(self) -> Dataset | DataTree:
        """Return the result as labelled arrays of xarray: those of `results.h5`, units and meaning as attributes.

        A machine with several parts, or motion under several loads, is a tree with a dataset for each part and load;
        a result that is a table has its columns along one axis.

        Raises
        ------
        ExternalProgramError
            Where xarray is not installed.
        """
        xarray = _package("xarray", "to_xarray")
        places = dict[str, dict[str, Labelled]]()
        for name, array in self._labelled().items():
            parts = name.split("/")
            inside = PLACE if len(parts) > PLACE else 0
            places.setdefault("/".join(parts[:inside]), {})["/".join(parts[inside:])] = array
        if not places:
            columns = {name: np.asarray(values) for name, values in self.columns().items()}
            first = next(iter(columns), "row")
            return xarray.Dataset({
                name: (first, values, {"units": unit} if (unit := unit_of(name)) else {})
                for name, values in columns.items()
            })  # fmt: skip
        datasets = {place or "/": _dataset(xarray, arrays) for place, arrays in places.items()}
        return datasets["/"] if list(datasets) == ["/"] else xarray.DataTree.from_dict(datasets)

    def _repr_html_(self) -> str:
        return html_table(repr(self), self._shown())


def headed(columns: Columns) -> Columns:
    """Return columns by the words of the table of quantities, where it has their keys."""
    return {TABLE[key].head if key in TABLE else key: values for key, values in columns.items()}


def unit_of(name: str) -> str:
    """Return the unit of a column by its key; empty where it has none."""
    if (found := TABLE.get(name.rpartition(".")[2])) is not None:
        return "" if found.unit == "1" else found.unit
    return parted(name)[1]


def parted(key: str) -> tuple[str, str]:
    """Return a key in words, and the unit at its end; empty where it has none."""
    end = next((end for end in ENDS if key.endswith(f"_{end}")), None)
    return (key if end is None else key.removesuffix(f"_{end}")).replace("_", " "), ENDS.get(end or "", "")


def _package(name: str, method: str) -> Any:
    try:
        return import_module(name)
    except ImportError:
        raise ExternalProgramError(
            f"{method}: the package {name} is not installed: pip install {name}, or 'pmor-gear[{name}]'"
        ) from None


def _dataset(xarray: Any, arrays: Mapping[str, Labelled]) -> Any:
    """Return arrays of some groups as one dataset.

    Names are those in their groups where these differ, and axes of one name but other lengths have that of the group in
    front. An axis has the first ascending array along it as coordinate.
    """
    last = [path.rpartition("/")[2] for path in arrays]
    lengths = dict[str, int]()
    found, coordinates = dict[str, Any](), dict[str, Any]()
    for path, array in arrays.items():
        group, _, own = path.rpartition("/")
        prefix = group.replace("/", "_")
        dims = [axis if lengths.setdefault(axis, size) == size else f"{prefix}_{axis}"
                for axis, size in zip(array.dims, array.values.shape, strict=True)]  # fmt: skip
        name = own if last.count(own) == 1 else f"{prefix}_{own}"
        variable = dims, array.values, {"units": array.unit, "long_name": array.description}
        if len(dims) == 1 and dims[0] not in coordinates and _ascends(array.values):
            coordinates[dims[0]] = variable
            if name in (dims[0], own) and own == dims[0]:
                continue
        found[name if name not in dims or len(dims) == 1 and name == dims[0] else f"{prefix}_{own}"] = variable
    clash = {name for name in found if name in lengths}
    renamed = {f"{name}_values" if name in clash else name: variable for name, variable in found.items()}
    return xarray.Dataset(renamed, coordinates)


def _ascends(values: np.ndarray) -> bool:
    return values.dtype.kind in "if" and bool((np.diff(values.astype(float)) > 0.0).all())
