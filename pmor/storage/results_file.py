"""The results file of a run or a set, for other programs: arrays with unit, axes and description.

Groups stand by themselves, each with the axes that it needs; those that were not asked for are left out. A new kind of
result is further lines of `RESULTS_LAYOUT`, and the arrays that fill them (`pmor.export.tables`,
`pmor.report.results_data`); of a set of `SET_LAYOUT` and `pmor.sets.results_data`.

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
from pmor.storage.set_results_layout import SET_LAYOUT
from pmor.storage.structure import items_of

RESULTS_SCHEMA = Schema("pmor-results", 2, "make it anew with pmor.run_case")
SET_RESULTS_SCHEMA = Schema("pmor-set-results", 1, "make it anew with pmor run")

STATE, SECTIONS, FLANK = "torque, angle", "torque, angle, pair, section", "torque, roll, place"
TEETH = "torque, angle, gear, pair, side"


def _curve(description: str, unit: str = "um") -> Field:
    return Field(unit, STATE, description, finite=False)


def _of_sections(unit: str, description: str, finite: bool = True) -> Field:
    return Field(unit, SECTIONS, description, finite=finite)


def _flank(folder: str) -> dict[str, Field]:
    fields = {
        "torque": Field("N m", "torque", "on the pinion", least=0.0),
        "roll": Field("rad", "roll", "the gear's own roll angle, over its active profile", least=0.0),
        "z": Field("mm", "place", "over the common face, from mid width", increasing=True),
        "load": Field("N/mm", FLANK, "largest line load over the mesh cycle; 0 where nothing touches"),
        "half_width": Field("mm", FLANK, "Hertz's half-width of contact"),
        "pressure": Field("MPa", FLANK, "largest pressure; NaN where a sharp edge carries", finite=False),
    }
    return {f"{folder}/{gear}/{name}": field for gear in ("pinion", "wheel") for name, field in fields.items()}


def _fillet(gear: str) -> dict[str, Field]:
    axes = "torque, side, point, column"
    fields = {
        "arc": Field("mm", "point", "along the fillet, from the start of the involute on", increasing=True),
        "z": Field("mm", "column", "from mid width", increasing=True),
        "max_principal": Field("MPa", axes, "largest over the cycle; sides: tension, compression", finite=False),
        "von_mises": Field("MPa", axes, "largest over the cycle", finite=False),
    }
    return {f"root_stress/{gear}/{name}": field for name, field in fields.items()}


RESULTS_LAYOUT = {
    "ste/phi": Field("rad", "angle", "pinion angle"),
    "ste/torque": Field("N m", "torque", "on the pinion", least=0.0),
    "ste/ste": _curve("static transmission error along the transverse line of action; NaN where not converged"),
    "ste/rotation": _curve("the same as rotation of the pinion", "urad"),
    "ste/unloaded": Field("um", STATE, "transmission error of rigid flanks", finite=False, optional=True),
    "ste/error_bar": Field("um", STATE, "estimated error of reduction and mesh", finite=False, optional=True),
    "ste/converged": Field("1", STATE, "whether the position converged", kind=bool),
    "ste/pair_index": Field("1", "pair", "tooth pair: at the roll position phi + 2 pi j / z1", kind=int),
    "ste/pair_share": Field("1", "torque, angle, pair", "share of the pinion torque", finite=False),
    "stiffness/secant": _curve("force per face width over STE less that without load", "N/(mm um)"),
    "stiffness/tangent": Field("N/(mm um)", STATE, "its derivative", finite=False, optional=True),
    "orders/order": Field("1", "order", "periods per turn of the pinion", optional=True, least=0.0),
    "orders/amplitude": Field("um", "torque, order", "of the STE, zero to peak", optional=True, least=0.0),
    "orders/phase": Field("rad", "torque, order", "of the cosine at pinion angle 0", optional=True),
    "lines/pair": Field("1", "angle, pair", "tooth pairs that can touch", kind=int),
    "lines/z": Field("mm", "section", "sections over the width, from mid width; where each has an image, half of it"),
    "lines/width": Field("mm", "section", "width of each, without its image"),
    "lines/roll": Field("rad", "angle, pair, section, gear", "roll angles at which undeformed flanks meet"),
    "lines/load": _of_sections("N/mm", "line load"),
    "lines/half_width": _of_sections("mm", "Hertz's half-width of contact"),
    "lines/pressure": _of_sections("MPa", "largest pressure; NaN where a sharp edge carries", finite=False),
    "lines/sensitivity": _of_sections("um/um", "derivative of the STE by the deviation of the section"),
    "face/k_h_beta": Field("1", "torque", "largest over mean line load of the face", finite=False),
    "face/effective_contact_ratio": Field("1", "torque", "tooth pairs that carry, on average", finite=False),
    "forces/force": Field("N", "torque, angle, gear, xyz", "of the mesh on each gear"),
    "forces/moment": Field("N m", "torque, angle, gear, xyz", "about the gear's axis at mid width"),
    "sensitivity/ste": Field("um per unit", "parameter, torque, angle", "d STE / d parameter", finite=False),
    "sensitivity/mean": Field("um per unit", "parameter, torque", "of the mean STE", finite=False),
    "sensitivity/peak_to_peak": Field("um per unit", "parameter, torque", "of its peak-to-peak", finite=False),
    "root_stress/pair_index": Field("1", "pair", "tooth pair: at the roll position phi + 2 pi j / z1", kind=int),
    **{
        f"root_stress/{name}": Field(unit, TEETH, f"{words}; NaN of teeth without load", finite=False)
        for name, (unit, words) in {
            "max_principal": ("MPa", "largest on the fillet; sides: tension, compression"),
            "von_mises": ("MPa", "largest on the fillet"),
            "radius": ("mm", "where, from the axis"),
            "z": ("mm", "where, from mid width"),
        }.items()
    },
    **_fillet("pinion"),
    **_fillet("wheel"),
    **_flank("maps"),
    **_flank("light"),
    "harris/phi": Field("rad", "angle", "pinion angle"),
    "harris/torque": Field("N m", "torque", "on the pinion", least=0.0, increasing=True),
    "harris/ste": _curve("static transmission error"),
    "harris/peak_to_peak": Field("um", "torque", "of it", finite=False),
}
# Arrays that hold the coordinates along an axis, by their names in the axis' group; of common ones else in `ste`.
COORDINATES = {
    "torque": "torque", "angle": "phi", "pair": "pair_index", "section": "z", "place": "z", "point": "arc",
    "column": "z",
}  # fmt: skip
COMMON = ("torque", "angle")


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
RESULTS_KINDS = {kind.schema.name: kind for kind in (OF_A_RUN, OF_A_SET)}


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


def write_results_file(path: Path, content: ResultsFile) -> None:
    """Write a results file, whole, in the place of an older one of ours; OutputError where that fails."""
    kind = content.kind
    attributes = {"case_name": content.case_name, "case_text": content.case_text}
    attributes |= {name: ", ".join(content.names.get(name, ())) for name in kind.listed}
    with create(path, kind.schema, attributes, overwrite=True) as file:
        write_all(file, content.arrays, kind.layout)
        _write_axes(file, content.arrays, kind.layout)


def read_results(path: Path) -> ResultsFile:
    """Read a results file; unit, axes and meaning of each array are those of the layout of its kind.

    Raises
    ------
    FileFormatError
        When it is missing, foreign, damaged, or of another version.
    """
    kind = RESULTS_KINDS.get(schema_name(path) or "", OF_A_RUN)
    with open_checked(path, kind.schema) as file:
        items = items_of(file)
        groups = {*kind.always, *(name.partition("/")[0] for name in items if name != "/")}
        layout = {name: field for name, field in kind.layout.items() if name.partition("/")[0] in groups}
        found = read_all(file, layout | _axes(layout, kind.layout), {"gear": 2, "side": 2, "xyz": 3})
        arrays = {name: array for name, array in found.items() if name in layout}
        said = {name: attribute(file, name, str) for name in kind.listed}
        return ResultsFile(
            attribute(file, "case_name", str), attribute(file, "case_text", str), arrays,
            {name: tuple(text.split(", ")) if text else () for name, text in said.items()}, kind,
        )  # fmt: skip


def _axes(names: Iterable[str], layout: Layout) -> dict[str, Field]:
    """Datasets of the axes of some arrays, by their paths, without those that are results themselves."""
    found = dict[str, Field]()
    for name in names:
        for axis in layout[name].dims.split(", "):
            source = layout.get(_coordinates(name, axis, layout))
            unit, words, kind = (source.unit, source.description, source.kind) if source else ("1", "from 0", int)
            found[_scale(name, axis, layout)] = Field(unit, axis, f"along the axis: {words}", kind, optional=True)
    return {path: axis for path, axis in found.items() if path not in layout}


def _scale(name: str, axis: str, layout: Layout) -> str:
    """Path of the dataset of an axis of an array; netCDF names the dimension after it."""
    path = f"{name.rpartition('/')[0]}/{axis}"
    taken = path in layout and layout[path].dims != axis
    return f"{path}_number" if taken else path


def _coordinates(name: str, axis: str, layout: Layout) -> str:
    """Path of the array that holds the coordinates along an axis of an array; empty where there is none."""
    groups = (name.rpartition("/")[0], "ste") if axis in COMMON else (name.rpartition("/")[0],)
    paths = (f"{group}/{COORDINATES.get(axis)}" for group in groups)
    return next((path for path in paths if path in layout and layout[path].dims == axis), "")


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
