"""The file of a single gear, solved for line loads: as a store of them keeps it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from pmor.body.far_compliance import FarCompliance
from pmor.body.flank_compliance import SolvedFlank, SolvedGear
from pmor.body.rim import RimMotion
from pmor.body.root_stress import RootStressShapes
from pmor.body.support import Support
from pmor.body.web_stress import WebStress
from pmor.core.arrays import FloatArray
from pmor.core.errors import FileFormatError
from pmor.storage.basis_answers import check_answers, moved_far_teeth, moved_flank, stress_of_fillets, stress_of_web
from pmor.storage.basis_layout import ANSWERED, ANSWERS, COMPLIANCE, FIXED_SIZES, ROOT_STRESS, SUPPORT, WEB_STRESS
from pmor.storage.hdf5 import Schema, attribute, create, open_checked, read_all, write_all
from pmor.storage.layout import Field

COMPLIANCE_SCHEMA = Schema("pmor-compliance", 9, "remove it: the gear is solved again")
FAR_BLOCKS = "tooth, shape, shape"
FAR = {
    "shapes": Field("1", "loaded unknown, shape", "shapes in which far teeth move, over the unknowns of a flank"),
    "flanks": Field("mm/N", FAR_BLOCKS, "of flanks under forces on the flank of tooth 0; NaN: not asked", finite=False),
    "images": Field("mm/N", FAR_BLOCKS, "the same of the other flanks, all in the image", finite=False),
    "backs": Field("mm/N", FAR_BLOCKS, "of the other flanks under forces on the flank of tooth 0", finite=False),
}
RIM = {
    "rows": Field("1", "loaded unknown, rim pattern", "patterns of forces on a flank that move a ring's rim"),
    "moved": Field(
        "mm/N", "loaded tooth, cut, direction, rim pattern", "of the root between teeth, radially and around the axis"
    ),
}  # fmt: skip
# Parts that a file may be without, by the names of their folders.
PARTS: dict[str, tuple[Callable[..., Any], dict[str, Field]]] = {
    "holes": (Support, SUPPORT), "root_stress": (RootStressShapes, ROOT_STRESS), "far": (FarCompliance, FAR),
    "rim": (RimMotion, RIM), "web_stress": (WebStress, WEB_STRESS),
    "other/root_stress": (RootStressShapes, ROOT_STRESS),
}  # fmt: skip
OTHER, BACKS = "other/compliance", "other/holes"
LAYOUT = {
    "compliance": Field("mm/N", COMPLIANCE, "of the flank nodes, of the loaded tooth and those beside it"),
    OTHER: Field("mm/N", COMPLIANCE, "the same of the other flanks, in their image", optional=True),
    BACKS: Field("1", "loaded unknown, felt pattern", "the patterns that holes feel, on them", optional=True),
    **{
        # Holes are felt by all teeth of a gear with several meshes.
        f"{part}/{name}": replace(field, dims=field.dims.replace("pitch offset", "further tooth"), optional=True)
        for part, (_, layout) in PARTS.items() for name, field in layout.items()
    },
    f"{ANSWERS}/displacement": Field(
        "mm", "tooth beside, loaded unknown", "of the flanks under uneven forces on one of them"
    ),
    f"{ANSWERS}/other_displacement": Field(
        "mm", "tooth beside, loaded unknown", "the same of the other flanks", optional=True
    ),
    f"{ANSWERS}/stress": ANSWERED["stress"],
    f"{ANSWERS}/web_stress": ANSWERED["web_stress"],
    f"{ANSWERS}/other_stress": ANSWERED["stress"],
    f"{ANSWERS}/far": Field("mm", "kind, tooth, loaded unknown", "of far flanks under uneven loads", optional=True),
}  # fmt: skip


def read_compliance(path: Path, key: str) -> SolvedGear:
    """Read the file of the gear with a key.

    Raises
    ------
    FileFormatError
        When it is missing, foreign, damaged, of another version, or of another gear.
    """
    with open_checked(path, COMPLIANCE_SCHEMA) as file:
        if attribute(file, "key", str) != key:
            raise FileFormatError(f"{path}: is of another gear, mesh or version; {COMPLIANCE_SCHEMA.remedy}")
        arrays = read_all(file, LAYOUT, _sizes(file))
        parts = {
            part: kind(*(arrays[f"{part}/{name}"] for name in layout)) if part in file else None
            for part, (kind, layout) in PARTS.items()
        }
        other = SolvedFlank(arrays[OTHER], parts["other/root_stress"]) if OTHER in file else None
        holes = parts["holes"] and replace(parts["holes"], backs=arrays.get(BACKS))
        found = SolvedGear(
            arrays["compliance"], parts["root_stress"], holes, parts["far"], other, parts["rim"], parts["web_stress"]
        )
        with np.errstate(all="ignore"):  # absurd numbers are refused, not warned of
            check_answers(_answers(found), {name: array for name, array in arrays.items() if name.startswith(ANSWERS)})
        return found


def write_compliance(path: Path, key: str, solved: SolvedGear) -> None:
    """Write the file of the gear with a key, whole; equal contents are equal files; OutputError where that fails."""
    parts = {"root_stress": solved.root_stress, "holes": solved.support, "far": solved.far, "rim": solved.rim_motion,
             "web_stress": solved.web_stress}  # fmt: skip
    if solved.other is not None:
        parts["other/root_stress"] = solved.other.root_stress
    arrays = {
        f"{part}/{name}": getattr(found, name)
        for part, found in parts.items() if found is not None for name in PARTS[part][1]
    }  # fmt: skip
    if solved.other is not None:
        arrays[OTHER] = solved.other.compliance
    if solved.support is not None and solved.support.backs is not None:
        arrays[BACKS] = solved.support.backs
    with create(path, COMPLIANCE_SCHEMA, {"key": key}, overwrite=True, dated=False) as file:
        write_all(file, {"compliance": solved.compliance, **arrays, **_answers(solved)}, LAYOUT)


def _sizes(file: h5py.File) -> dict[str, int]:
    """Lengths of axes: those of the compliance hold for all parts."""
    neighbours, unknowns = (file["compliance"].shape + (0, 0))[:2]
    return {**FIXED_SIZES, "pitch offset": neighbours, "loaded unknown": unknowns}


def _answers(solved: SolvedGear) -> dict[str, FloatArray]:
    """How a gear yields, by the paths in its file (`pmor.storage.basis_answers`)."""
    found = {"displacement": moved_flank(solved.compliance, solved.support)}
    if solved.root_stress is not None:
        found["stress"] = stress_of_fillets(solved.root_stress)
    if solved.web_stress is not None:
        found["web_stress"] = stress_of_web(solved.web_stress)
    if (other := solved.other) is not None:
        holes, backs = solved.support, None if solved.support is None else solved.support.backs
        found["other_displacement"] = moved_flank(
            other.compliance, None if holes is None or backs is None else replace(holes, rows=backs)
        )
        if other.root_stress is not None:
            found["other_stress"] = stress_of_fillets(other.root_stress)
    if solved.far is not None:
        found["far"] = moved_far_teeth(solved.far)
    return {f"{ANSWERS}/{name}": array for name, array in found.items()}
