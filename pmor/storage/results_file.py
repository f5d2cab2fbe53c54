"""The results file of a run, a set or a gearbox, for other programs: arrays with unit, axes and description.

Groups stand by themselves, each with the axes that it needs; those that were not asked for are left out. A new kind of
result is further lines of `RESULTS_LAYOUT`, and the arrays that fill them (`pmor.export.tables`,
`pmor.report.results_data`); of a set of `SET_LAYOUT` and `pmor.sets.results_data`. That of a gearbox has both, below
``meshes/NAME/LOAD`` and ``sets/NAME/LOAD``, and its rolling bearings below ``bearings/NAME/LOAD``.

Each axis is a dimension scale of HDF5, so that readers of netCDF have named dimensions with their coordinates:
``xarray.open_dataset("results.h5", group="ste")``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from pmor.storage.hdf5 import Schema, attribute, create, open_checked, read_all, schema_name, write_all
from pmor.storage.layout import Field, Layout
from pmor.storage.results_layout import BEARING_LAYOUT, MOTION_LAYOUT, RESULTS_LAYOUT, SET_LAYOUT
from pmor.storage.structure import items_of

RESULTS_SCHEMA = Schema("pmor-results", 2, "make it anew with pmor.run_case")
SET_RESULTS_SCHEMA = Schema("pmor-set-results", 1, "make it anew with pmor run")
MOTION_RESULTS_SCHEMA = Schema("pmor-motion-results", 1, "make it anew with pmor dynamics")
GEARBOX_RESULTS_SCHEMA = Schema("pmor-gearbox-results", 1, "make it anew with pmor run")

# Arrays that hold the coordinates along an axis, by their names in the axis' group; of common ones else in `ste`.
COORDINATES = {
    "torque": "torque", "angle": "phi", "pair": "pair_index", "section": "z", "place": "z", "point": "arc",
    "column": "z", "speed": "speed",
}  # fmt: skip
COMMON = ("torque", "angle")
# Parts of the path of a part of a gearbox under a load: kind, name, load.
PLACE = 3


@dataclass(frozen=True)
class ResultsKind:
    """A kind of results file.

    Parameters
    ----------
    always : tuple of str
        Groups that every file has.
    listed : tuple of str
        Names along axes, attributes of the file.
    """

    schema: Schema
    layout: Layout
    always: tuple[str, ...]
    listed: tuple[str, ...]


OF_A_RUN = ResultsKind(RESULTS_SCHEMA, RESULTS_LAYOUT, ("ste", "stiffness"), ("parameters",))
OF_A_SET = ResultsKind(SET_RESULTS_SCHEMA, SET_LAYOUT, ("ste", "meshes", "gears"), ("gears", "meshes"))
OF_MOTION_UNDER_A_LOAD = ResultsKind(MOTION_RESULTS_SCHEMA, MOTION_LAYOUT, ("speed", "model"), ())
BEARING_UNDER_A_LOAD = ResultsKind(GEARBOX_RESULTS_SCHEMA, BEARING_LAYOUT, (), ())
PARTS = {
    "meshes": OF_A_RUN, "sets": OF_A_SET, "bearings": BEARING_UNDER_A_LOAD, "motion": OF_MOTION_UNDER_A_LOAD
}  # fmt: skip
OF_A_GEARBOX = ResultsKind(GEARBOX_RESULTS_SCHEMA, {}, (), ("loads", "meshes", "sets"))
OF_MOTION = ResultsKind(MOTION_RESULTS_SCHEMA, {}, (), ("loads", "meshes", "bearings", "sources"))
RESULTS_KINDS = {kind.schema.name: kind for kind in (OF_A_RUN, OF_A_SET, OF_A_GEARBOX, OF_MOTION)}


@dataclass(frozen=True)
class ResultsFile:
    """Content of a results file.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        By their paths in the layout of the kind.
    names : mapping of str to tuple of str
        Of what the kind lists: parameters of the sensitivities, gears and meshes.
    """

    case_name: str
    case_text: str
    arrays: Mapping[str, np.ndarray]
    names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    kind: ResultsKind = OF_A_RUN

    @property
    def layout(self) -> Layout:
        """Of all arrays that there may be."""
        return _layout(self.kind, self.arrays)


def write_results_file(path: Path, content: ResultsFile) -> None:
    """Write a results file, whole, in the place of an older one of ours; OutputError where that fails."""
    kind = content.kind
    attributes = {"case_name": content.case_name, "case_text": content.case_text}
    attributes |= {name: ", ".join(content.names.get(name, ())) for name in kind.listed}
    with create(path, kind.schema, attributes, overwrite=True) as file:
        write_all(file, content.arrays, content.layout)
        _write_axes(file, content.arrays, content.layout)


def read_results(path: Path) -> ResultsFile:
    """Read a results file; unit, axes and meaning of each array are those of the layout of its kind.

    Raises
    ------
    FileFormatError
        When it is missing, foreign, damaged, or of another version.
    """
    kind = RESULTS_KINDS.get(schema_name(path) or "", OF_A_RUN)
    with open_checked(path, kind.schema) as file:
        items = [name for name in items_of(file) if name != "/"]
        every, depth = _layout(kind, items), 0 if kind.layout else PLACE
        groups = {*kind.always, *(_group(name, depth) for name in items)}
        layout = {name: field for name, field in every.items() if _group(name, depth) in groups}
        read = read_all(file, layout | _axes(layout, every), {"gear": 2, "side": 2, "xyz": 3})
        arrays = {name: array for name, array in read.items() if name in layout}
        listed = {name: attribute(file, name, str) for name in kind.listed}
        return ResultsFile(
            attribute(file, "case_name", str), attribute(file, "case_text", str), arrays,
            {name: tuple(text.split(", ")) if text else () for name, text in listed.items()}, kind,
        )  # fmt: skip


def _layout(kind: ResultsKind, paths: Iterable[str]) -> Layout:
    """Layout of a file by the paths in it: a gearbox has that of a run, or of a set, for each part and load."""
    if kind.layout:
        return kind.layout
    places = {"/".join(path.split("/")[:PLACE]) for path in paths if path.count("/") > PLACE}
    return {
        f"{place}/{name}": field
        for place in sorted(places) for name, field in PARTS[place.split("/")[0]].layout.items()
    }  # fmt: skip


def _group(path: str, depth: int) -> str:
    """Return the group that stands by itself."""
    return "/".join(path.split("/")[: depth + 1])


def _axes(names: Iterable[str], layout: Layout) -> dict[str, Field]:
    """Datasets of the axes of some arrays, by their paths, without those that are results themselves."""
    axes = dict[str, Field]()
    for name in names:
        for axis in layout[name].dims.split(", "):
            source = layout.get(_coordinates(name, axis, layout))
            unit, words, kind = (source.unit, source.description, source.kind) if source else ("1", "from 0", int)
            axes[_scale(name, axis, layout)] = Field(unit, axis, f"along the axis: {words}", kind, optional=True)
    return {path: axis for path, axis in axes.items() if path not in layout}


def _scale(name: str, axis: str, layout: Layout) -> str:
    """Path of the dataset of an axis of an array; netCDF names the dimension after it."""
    path = f"{name.rpartition('/')[0]}/{axis}"
    taken = path in layout and layout[path].dims != axis
    return f"{path}_number" if taken else path


def _coordinates(name: str, axis: str, layout: Layout) -> str:
    """Path of the array that holds the coordinates along an axis of an array; empty where there is none."""
    groups = [name.rpartition("/")[0], *(_common(name) if axis in COMMON else ())]
    paths = (f"{group}/{COORDINATES.get(axis)}" for group in groups)
    return next((path for path in paths if path in layout and layout[path].dims == axis), "")


def _common(name: str) -> list[str]:
    """Groups of the torques and angles of an array: that beside its own one, or one farther up."""
    parts = name.split("/")
    return ["/".join([*parts[:count], "ste"]) for count in range(len(parts) - 1, -1, -1)]


def _write_axes(file: h5py.File, arrays: Mapping[str, np.ndarray], layout: Layout) -> None:
    """Write the axes of all arrays, and refer from each array to its own."""
    along = {
        _scale(name, axis, layout): arrays.get(_coordinates(name, axis, layout), np.arange(length))
        for name, array in arrays.items()
        for axis, length in zip(layout[name].dims.split(", "), array.shape, strict=True)
    }
    axes = _axes(arrays, layout)
    write_all(file, {path: along[path] for path in axes}, axes)
    for path in along:
        file[path].make_scale(path.rpartition("/")[2])
    for name in arrays:
        for place, axis in enumerate(layout[name].dims.split(", ")):
            scale = _scale(name, axis, layout)
            if scale != name:
                file[name].dims[place].attach_scale(file[scale])
