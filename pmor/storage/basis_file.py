"""The basis file, which the offline stage hands to the online stage."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np

from pmor.body.flank_compliance import FlankCompliance
from pmor.body.root_stress import RootStressShapes
from pmor.body.support import Support
from pmor.body.web_stress import WebStress
from pmor.case import Case, basis_key, basis_settings, parse_case, text_of
from pmor.case.models import coarser
from pmor.case.width import case_of_page, mirrors_at_mid_width
from pmor.core.arrays import FloatArray
from pmor.core.errors import FileFormatError
from pmor.line.layered_pair import SurfaceLayer
from pmor.pair.conditions import on_trained_flanks
from pmor.pair.model import gear_pair
from pmor.reduction.basis import Basis, Training, untrained
from pmor.reduction.contact_shapes import ContactShapes
from pmor.reduction.flank_lines import FlankLineShapes, GearLines
from pmor.storage.basis_answers import answers_of, check_answers
from pmor.storage.basis_checks import check_basis
from pmor.storage.basis_layout import (
    ANSWERS,
    COARSER,
    GEARS,
    POSITIONS,
    ROOT_STRESS,
    SUPPORT,
    WEB_STRESS,
    WHOLE,
    basis_layout,
    basis_sizes,
    compliance_group,
    further_layout,
    has_shapes,
)
from pmor.storage.condition_table import read_conditions, write_conditions
from pmor.storage.hdf5 import Schema, attribute, create, open_checked, read, read_all, set_attributes, write_all
from pmor.storage.layout import check_layout, require
from pmor.storage.manifest import of_no_origin
from pmor.storage.structure import items_of

BASIS_SCHEMA = Schema("pmor-basis", 15, "make it anew with pmor.train")
# Not read for a basis: kept for checks and for later enrichment.
KEPT = "training/force"


def write_basis(path: Path, basis: Basis, force: FloatArray, overwrite: bool = False) -> None:
    """Write a basis file; OutputError where that fails.

    Parameters
    ----------
    force : ndarray, shape (M, T, 2, f)
        Nodal forces of full FE over roll position and condition (off a grid: of M loaded tooth pairs, T = 1),
        N, those on a node and on its image together: not needed online, kept for checks and for later enrichment.
    """
    case, layout = basis.case, basis_layout(basis.case)
    text = text_of(case)
    origin = {"case_name": case.name, "case_text": text, "case_sha256": _digest(text), "basis_key": basis_key(case)}
    made = {**origin, "offline_s": basis.training.seconds}
    with of_no_origin(path.parent), create(path, BASIS_SCHEMA, made, overwrite) as file:
        write_all(file, {**_training_arrays(basis.training), **_arrays(basis), KEPT: force}, layout)
        write_conditions(file["training"], basis.training.conditions)
        _write_attributes(file, basis)
        for name, further in ((COARSER, basis.coarser), (WHOLE, basis.whole)):
            if further is not None:
                folder = file.create_group(name)
                write_all(folder, _arrays(further), further_layout(further.case))
                _write_attributes(folder, further)


def _write_attributes(folder: h5py.Group, basis: Basis) -> None:
    for gear, layer in zip(GEARS, basis.layers, strict=False):
        set_attributes(folder[f"layer/{gear}"], compliance=layer.compliance, columns=layer.columns)
    if isinstance(basis.shapes, ContactShapes):
        set_attributes(folder["shapes"], angles_per_pitch=basis.shapes.angles_per_pitch)
    if basis.compliance is not None:
        set_attributes(folder[compliance_group(basis.case)], components=basis.compliance.components)


def _training_arrays(training: Training) -> dict[str, np.ndarray]:
    """Arrays of a training by their names in the file; the table of the conditions is written apart."""
    arrays: dict[str, np.ndarray] = {
        "training/phi": training.phi, "training/ste": training.ste_um, "training/converged": training.converged
    }  # fmt: skip
    if training.estimate_percent is not None:
        arrays["training/estimate"] = training.estimate_percent
    return arrays


def _arrays(basis: Basis) -> dict[str, np.ndarray]:
    """Arrays of a basis without its training, by their names in its folder."""
    shapes, arrays = basis.shapes, dict[str, np.ndarray]()
    for gear, nodes, roll in zip(GEARS, basis.flank_nodes, basis.flank_roll_angle, strict=True):
        arrays |= {f"flank/{gear}/nodes": nodes, f"flank/{gear}/roll_angle": roll}
    for gear, layer in zip(GEARS, basis.layers, strict=False):
        arrays |= {f"layer/{gear}/depth": layer.depth, f"layer/{gear}/constant": layer.constant}
    if isinstance(shapes, ContactShapes):
        arrays |= {f"shapes/{name}": getattr(shapes, name) for name in POSITIONS}
    elif shapes is not None:
        for gear, lines in zip(GEARS, shapes.gears, strict=True):
            arrays |= {f"shapes/{gear}/{name}": array for name, array in vars(lines).items()}
    if basis.compliance is not None:
        (pinion, wheel), group = basis.compliance.gears, compliance_group(basis.case)
        arrays[f"{group}/pinion"] = pinion
        if wheel is not pinion:
            arrays[f"{group}/wheel"] = wheel
        for gear, support in zip(GEARS, basis.compliance.supports, strict=True):
            if support is not None:
                arrays |= {f"support/{gear}/{name}": getattr(support, name) for name in SUPPORT}
    if basis.root_stress is not None:
        pinion_stress, wheel_stress = basis.root_stress
        for gear, stress in zip(GEARS, (pinion_stress, wheel_stress), strict=True):
            if gear == "pinion" or stress is not pinion_stress:
                arrays |= {f"root_stress/{gear}/{name}": array for name, array in vars(stress).items()}
    for gear, web in zip(GEARS, basis.web_stress, strict=True):
        if web is not None:
            arrays |= {f"web_stress/{gear}/{name}": array for name, array in vars(web).items()}
    return arrays | answers_of(basis)


def read_basis(path: Path) -> Basis:
    """Read a basis file; the force fields stay on disk.

    Raises
    ------
    FileFormatError
        When the file is not a valid basis file of this version.
    """
    with open_checked(path, BASIS_SCHEMA) as file:
        return _read(file, path)


def read_model(path: Path) -> tuple[Basis, FloatArray, int]:
    """Read a basis file with the force fields, as `write_basis` takes them, and the size of the file in bytes.

    FileFormatError where it is none.
    """
    with open_checked(path, BASIS_SCHEMA) as file:
        basis = _read(file, path)
        return basis, read(file, KEPT, basis_layout(basis.case)[KEPT]), file.id.get_filesize()


def _read(file: h5py.File, path: Path) -> Basis:
    case = _read_case(file, path)
    pair, present = gear_pair(case), items_of(file)
    further = {COARSER: coarser(case)}
    if WHOLE in present and mirrors_at_mid_width(case):
        further[WHOLE] = case_of_page(case)
    apart = tuple(f"{name}/" for name, own in further.items() if own is not None)
    items = {path: item for path, item in present.items() if not path.startswith(apart)}
    layout = basis_layout(case)
    check_layout(items, layout, basis_sizes(case, pair))
    arrays = {name: read(file, name, field) for name, field in layout.items() if name in file and name != KEPT}
    read_further = {
        name: (file[name], own, read_all(file[name], further_layout(own), basis_sizes(own, pair)))
        for name, own in further.items()
        if own is not None
    }
    others = {name: _basis(*read) for name, read in read_further.items()}
    own = replace(_basis(file, case, arrays), training=_training(file, case, arrays))
    basis = replace(own, coarser=others.get(COARSER), whole=others.get(WHOLE))
    with np.errstate(all="ignore"):  # absurd numbers are refused, not warned of
        check_basis(basis, pair)
        check_answers(answers_of(own), _kept_answers(arrays))
        for name, (_, _, kept) in read_further.items():
            check_answers(answers_of(others[name]), _kept_answers(kept))
    return basis


def _kept_answers(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: array for name, array in arrays.items() if name.startswith(f"{ANSWERS}/")}


def _read_case(file: h5py.File, path: Path) -> Case:
    text = attribute(file, "case_text", str)
    case = parse_case(text, attribute(file, "case_name", str), f"{path} (case text)")
    made_from = attribute(file, "basis_key") == basis_key(case) and attribute(file, "case_sha256") == _digest(text)
    require(made_from, "its case text is not that of its key")
    return case


def _shapes(
    group: h5py.Group, case: Case, of: Callable[[str], dict[str, np.ndarray]]
) -> FlankLineShapes | ContactShapes:
    if case.reduction.by_line:
        lines = GearLines(**of("shapes/pinion")), GearLines(**of("shapes/wheel"))
        return FlankLineShapes(lines)
    return ContactShapes(**of("shapes"), angles_per_pitch=attribute(group, "angles_per_pitch", int))


def _training(file: h5py.File, case: Case, arrays: dict[str, np.ndarray]) -> Training:
    return Training(
        phi=arrays["training/phi"],
        conditions=tuple(on_trained_flanks(case, there) for there in read_conditions(file["training"])),
        ste_um=arrays["training/ste"], converged=arrays["training/converged"],
        estimate_percent=arrays.get("training/estimate"), seconds=attribute(file, "offline_s", float),
    )  # fmt: skip


def _basis(file: h5py.Group, case: Case, arrays: dict[str, np.ndarray]) -> Basis:
    """Basis in a folder, without its training."""

    def of(folder: str) -> dict[str, np.ndarray]:
        return {name.rpartition("/")[2]: array for name, array in arrays.items() if name.rpartition("/")[0] == folder}

    layers, compliance = [], None
    if case.contact.kind == "line":
        for gear, material in zip(GEARS, (case.pair.pinion, case.pair.wheel), strict=True):
            group, values = file[f"layer/{gear}"], of(f"layer/{gear}")
            known = attribute(group, "compliance", float), values["constant"], attribute(group, "columns", int)
            layers.append(SurfaceLayer(values["depth"], *known, material.poisson_ratio))
    if group := compliance_group(case):
        gears = of(group)
        both = gears["pinion"], gears.get("wheel", gears["pinion"])
        pinion, wheel = (_support(gear, of(f"support/{gear}")) for gear in GEARS)
        compliance = FlankCompliance(both, attribute(file[group], "components", int), (pinion, wheel))
    webs = [of(f"web_stress/{gear}") for gear in GEARS]
    pinion_web, wheel_web = (WebStress(**web) if len(web) == len(WEB_STRESS) else None for web in webs)
    flanks = [of(f"flank/{gear}") for gear in GEARS]
    shapes_of = [of(f"root_stress/{gear}") for gear in GEARS]
    stresses = [RootStressShapes(**arrays) for arrays in shapes_of if len(arrays) == len(ROOT_STRESS)]
    return Basis(
        case=case, flank_nodes=(flanks[0]["nodes"], flanks[1]["nodes"]),
        flank_roll_angle=(flanks[0]["roll_angle"], flanks[1]["roll_angle"]), layers=tuple(layers),
        shapes=_shapes(file["shapes"], case, of) if has_shapes(case) else None, training=untrained(),
        compliance=compliance, root_stress=(stresses[0], stresses[-1]) if stresses else None,
        web_stress=(pinion_web, wheel_web),
    )  # fmt: skip


def _support(gear: str, arrays: dict[str, np.ndarray]) -> Support | None:
    require(len(arrays) in (0, len(SUPPORT)), f"of the holes of the {gear} it has {', '.join(arrays)} alone")
    return Support(**arrays) if arrays else None


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def require_made_from(path: Path, basis: Basis, case: Case) -> None:
    """Raise FileFormatError, naming the first difference, when a basis was made from another case.

    Parameters
    ----------
    path : Path
        Of the basis file.
    case : Case
        Its required origin; modifications, sweep, comparison and output may differ.
    """
    own, asked = basis_settings(basis.case), basis_settings(case)
    for name in [*asked, *own]:
        if own.get(name) != asked.get(name):
            raise FileFormatError(
                f"{path}: is the basis of another case: {name} is {own.get(name)} in it, {asked.get(name)} in the "
                f"case; {BASIS_SCHEMA.remedy}"
            )
