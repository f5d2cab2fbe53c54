"""The basis file: what the offline stage hands to the online stage."""

from __future__ import annotations

import hashlib
from pathlib import Path

import h5py
import numpy as np

from pmor.arrays import FloatArray
from pmor.case import Case, basis_key, describe, parse_case, text_of
from pmor.contact.flank import SurfaceLayer
from pmor.errors import FileFormatError
from pmor.reduction.basis import Basis, Training
from pmor.reduction.contact_shapes import ContactShapes
from pmor.reduction.error_estimate import FlankCompliance
from pmor.reduction.flank_lines import FlankLineShapes, GearLines
from pmor.storage.condition_table import read_conditions, write_conditions
from pmor.storage.hdf5 import Field, Schema, attribute, create, open_checked, read, set_attributes, write

BASIS_SCHEMA = Schema("pmor-basis", 5, "make it anew with 'pmor offline'")
GEARS = ("pinion", "wheel")


def write_basis(path: Path, basis: Basis, force: FloatArray, overwrite: bool = False) -> None:
    """Write a basis file.

    Parameters
    ----------
    path : Path
    basis : Basis
    force : ndarray, shape (M, T, 2, f)
        Nodal forces of full FE over roll position and condition (off a grid: of M loaded tooth pairs, T = 1),
        N, those on a node and on its image together: not needed online, kept for checks and for later enrichment.
    overwrite : bool

    Raises
    ------
    OutputError
    """
    case, shapes, training = basis.case, basis.shapes, basis.training
    text = text_of(case)
    attributes = {
        "case_name": case.name,
        "case_text": text,
        "case_sha256": hashlib.sha256(text.encode()).hexdigest(),
        "basis_key": basis_key(case),
        "offline_s": training.seconds,
    }
    with create(path, BASIS_SCHEMA, attributes, overwrite) as file:
        for gear, nodes, roll in zip(GEARS, basis.flank_nodes, basis.flank_roll_angle, strict=True):
            group = file.create_group(f"flank/{gear}")
            write(group, "nodes", nodes, Field("mm", "profile, width, xyz", "undeformed flank nodes, tooth frame"))
            write(group, "roll_angle", roll, Field("rad", "profile", "roll angle of the flank nodes"))
        for gear, layer in zip(GEARS, basis.layers, strict=False):
            _write_layer(file.create_group(f"layer/{gear}"), layer)
        if isinstance(shapes, ContactShapes):
            _write_positions(file.create_group("shapes"), shapes)
        else:
            for gear, lines in zip(GEARS, shapes.gears, strict=True):
                _write_lines(file.create_group(f"shapes/{gear}"), lines)
            set_attributes(file["shapes"], beside=shapes.beside)
        if basis.compliance is not None:
            _write_compliance(file.create_group("error_estimate"), basis.compliance)
        group = file.create_group("training")
        write(group, "phi", training.phi, Field("rad", "angle", "pinion angle"))
        write_conditions(group, training.conditions)
        write(group, "ste", training.ste_um, Field("um", "condition, angle", "static transmission error of full FE"))
        write(group, "converged", training.converged, Field("1", "condition, angle", "whether full FE converged"))
        if training.estimate_percent is not None:
            decay = Field("%", "angle", "largest error estimate over the STE before each solve of a greedy sampling")
            write(group, "estimate", training.estimate_percent, decay)
        write(group, "force", force, Field("N", "position, condition, gear, flank unknown", "nodal forces of full FE"))


def read_basis(path: Path) -> Basis:
    """Read a basis file; the force fields stay on disk.

    Raises
    ------
    FileFormatError
        When the file is not a valid basis file of this version.
    """
    with open_checked(path, BASIS_SCHEMA) as file:
        case = parse_case(attribute(file, "case_text"), attribute(file, "case_name"), f"{path} (case text)")
        if attribute(file, "basis_key") != basis_key(case):
            raise ValueError("its case text does not say what it was made from")
        layers = tuple(_read_layer(file[f"layer/{gear}"]) for gear in GEARS if case.contact.kind == "line")
        shapes: FlankLineShapes | ContactShapes
        if case.reduction.by_line:
            pinion, wheel = (_read_lines(file[f"shapes/{gear}"]) for gear in GEARS)
            shapes = FlankLineShapes((pinion, wheel), bool(attribute(file["shapes"], "beside")))
        else:
            shapes = _read_positions(file["shapes"])
        training = Training(
            phi=read(file["training"], "phi"),
            conditions=read_conditions(file["training"]),
            ste_um=read(file["training"], "ste", finite=False),
            converged=read(file["training"], "converged"),
            estimate_percent=_read_decay(file["training"], case),
            seconds=float(attribute(file, "offline_s")),
        )
        if not np.array_equal(np.isfinite(training.ste_um), training.converged):
            raise ValueError("its training has numbers where it did not converge, or none where it did")
        nodes, roll = ([read(file[f"flank/{gear}"], name) for gear in GEARS] for name in ("nodes", "roll_angle"))
        compliance = _read_compliance(file["error_estimate"]) if case.reduction.error_estimate else None
        return Basis(case, (nodes[0], nodes[1]), (roll[0], roll[1]), layers, shapes, training, compliance)


def require_made_from(path: Path, basis: Basis, case: Case) -> None:
    """Raise FileFormatError, naming the first difference, when a basis was made from another case.

    Parameters
    ----------
    path : Path
        Of the basis file.
    basis : Basis
    case : Case
        What it should have been made from; modifications, sweep, comparison and output may differ.
    """
    if basis_key(basis.case) == basis_key(case):
        return
    own = {name: value for name, value, _ in describe(basis.case)}
    # What no basis depends on comes last and is never reached: the keys differ.
    modifications = "pinion.modification.", "wheel.modification."
    free = ("title", "load.", *modifications, "misalignment.", "online.", "compare.", "output.")
    differences = (
        f"[{name.replace('.', '] ')} is {own.get(name)} in it, {value} in the case"
        for name, value, _ in sorted(describe(case), key=lambda setting: setting[0].startswith(free))
        if own.get(name) != value
    )
    raise FileFormatError(f"{path}: is the basis of another case: {next(differences)}; {BASIS_SCHEMA.remedy}")


def _write_layer(group: h5py.Group, layer: SurfaceLayer) -> None:
    set_attributes(group, compliance=layer.compliance, columns=layer.columns)
    write(group, "depth", layer.depth, Field("mm", "profile", "depth of the layer that line contact stands on"))
    write(group, "constant", layer.constant, Field("1", "profile", "constant of the approach, ln(2 depth) + 1/2 + a"))


def _read_layer(group: h5py.Group) -> SurfaceLayer:
    compliance, columns = float(attribute(group, "compliance")), int(attribute(group, "columns"))
    return SurfaceLayer(read(group, "depth"), compliance, read(group, "constant"), columns)


def _write_lines(group: h5py.Group, lines: GearLines) -> None:
    write(group, "start", lines.start, Field("1", "line", "first shape of each flank line"))
    write(group, "force", lines.force, Field("N", "shape, flank unknown", "unit load of each shape"))
    dims = "tooth offset, shape, flank unknown"
    write(group, "displacement", lines.displacement, Field("mm", dims, "displacement of each shape"))
    write(group, "gram", lines.gram, Field("N mm", "tooth offset, shape, shape", "energy products of the shapes"))


def _read_lines(group: h5py.Group) -> GearLines:
    return GearLines(*(read(group, name) for name in ("start", "force", "displacement", "gram")))


def _read_decay(group: h5py.Group, case: Case) -> FloatArray | None:
    return read(group, "estimate", finite=False) if case.offline.sampling == "greedy" else None


def _write_compliance(group: h5py.Group, compliance: FlankCompliance) -> None:
    set_attributes(group, components=compliance.components)
    pinion, wheel = compliance.gears
    dims = "tooth offset, flank unknown, flank unknown"
    for gear, blocks in zip(GEARS, (pinion,) if wheel is pinion else (pinion, wheel), strict=False):
        write(group, gear, blocks, Field("mm/N", dims, "compliance between loaded flanks; identical gears: one"))


def _read_compliance(group: h5py.Group) -> FlankCompliance:
    pinion = read(group, GEARS[0])
    wheel = read(group, GEARS[1]) if GEARS[1] in group else pinion
    return FlankCompliance((pinion, wheel), int(attribute(group, "components")))


def _write_positions(group: h5py.Group, shapes: ContactShapes) -> None:
    set_attributes(group, angles_per_pitch=shapes.angles_per_pitch, geodesic=shapes.geodesic)
    write(group, "roll_position", shapes.roll_position, Field("rad", "position", "roll position of the tooth pair"))
    write(group, "loaded", shapes.loaded, Field("1", "position, shape", "whether the pair carries load"))
    dims = "position, shape, gear, tooth offset, flank unknown"
    write(group, "displacement", shapes.displacement, Field("mm", dims, "displacement of each shape"))
    dims = "pitch offset, position, a, b, shape, shape"
    write(group, "gram", shapes.gram, Field("N mm", dims, "energy products of the shapes"))


def _read_positions(group: h5py.Group) -> ContactShapes:
    return ContactShapes(
        roll_position=read(group, "roll_position"),
        angles_per_pitch=int(attribute(group, "angles_per_pitch")),
        loaded=read(group, "loaded"),
        displacement=read(group, "displacement"),
        gram=read(group, "gram"),
        geodesic=bool(attribute(group, "geodesic")),
    )
