"""Files in the formats of other programs: export of models, sweeps and results; import of gearboxes."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pmor.app.records import FORMATS, KINDS, called, kind_of
from pmor.case.capability import refuse_beyond
from pmor.case.reader import Reader
from pmor.core.errors import CaseError, OutputError, printable
from pmor.core.ranges import Torque
from pmor.core.wording import suggesting
from pmor.storage.atomic import atomic_path, ensure_folder, refuse_existing
from pmor.storage.results_folder import refuse_in_the_way, results_folder

if TYPE_CHECKING:
    from pmor.case import Case
    from pmor.export.tables import ResultArray
    from pmor.gear.pair import GearPair
    from pmor.results.sweep import SteSweep
    from pmor_online.model import ReducedPair

# Formats that arguments belong to.
TAKEN_BY = {"stage": "case", "torque_Nm": "fmu"}
_LOG = logging.getLogger("pmor.export")


@suggesting
def export_file(
    source: Path | str, to: str, target: Path | str | None = None, *, stage: int | None = None,
    torque_Nm: float | None = None, overwrite: bool = False,
) -> Path:  # fmt: skip
    """Write a file in another format, as `pmor export` does.

    Limitations of the new file are noted in the log ``pmor``.

    Parameters
    ----------
    source : Path or str
        A basis; a REXS file for a case or a gearbox; a file of results for tables; the file of a machine for REXS,
        without results.
    to : str
        A format of `pmor export --help`: tables, ``"csv"``, are of a sweep or of results, a ``"gearbox"`` has its cases
        beside it.
    target : Path or str, optional
        File to write, or folder for tables; named after the source in the current folder by default.
    stage : int, optional
        Of a REXS file with several.
    torque_Nm : float, optional
        On the pinion, up to which the force law of a unit for co-simulation reaches; twice that of the case by
        default.
    overwrite : bool
        Replace existing files.

    Returns
    -------
    Path
        Written file or folder.

    Raises
    ------
    PmorError
        When the source is none for this format, or the target cannot be written.
    """
    if to not in FORMATS:
        raise CaseError(f"to = {to!r}: must be one of {', '.join(sorted(FORMATS))}")
    for name, value in (("stage", stage), ("torque_Nm", torque_Nm)):
        if value is not None and TAKEN_BY[name] != to:
            raise CaseError(f"{name} = {value:g}: is for the format {TAKEN_BY[name]} alone: leave it out")
    source = Path(source)
    path = Path(source.stem + FORMATS[to].ending) if target is None else Path(target)
    if to == "csv":
        _tables(source, path, overwrite)
        return path
    refuse_existing(path, overwrite)
    refuse_in_the_way([path], overwrite, (source,))
    ensure_folder(path.parent)
    if to == "case":
        _case(source, path, overwrite, stage)
    elif to == "gearbox":
        _gearbox(source, path, overwrite)
    elif to == "uff":
        _universal(source, path, overwrite)
    elif to == "fmu" and _is_gearbox(source):
        _gearbox_unit(source, path, overwrite, torque_Nm)
    elif to == "rexs" and source.suffix == ".toml":
        _machine(source, path, overwrite)
    else:
        export_model(_reduced(source, to), to, path, overwrite, torque_Nm)
    return path


def export_model(model: ReducedPair, to: str, path: Path, overwrite: bool, torque_Nm: float | None) -> None:
    """Write what follows from a reduced model, in one of the formats that do."""
    formats = [name for name, made in FORMATS.items() if made.of_model]
    if to not in formats:
        raise CaseError(f"to = {to!r}: must be csv, {', '.join(formats[:-1])} or {formats[-1]}")
    refuse_existing(path, overwrite)
    ensure_folder(path.parent)
    if torque_Nm is not None:
        torque_Nm = Reader(model.basis.case.name).value(torque_Nm, Torque, "torque_Nm")
    called(FORMATS[to].of_model)(model, path, overwrite, torque_Nm)


def write_unit(model: ReducedPair, path: Path, overwrite: bool, torque_Nm: float | None) -> None:
    """Write a unit for co-simulation."""
    from pmor.dynamics.fmu.law import mesh_law
    from pmor.dynamics.fmu.write import write_fmu

    if not write_fmu(mesh_law(model, torque_Nm), path, overwrite):
        _LOG.info("no compiler here: the unit holds its source, and no binary")


def write_animation(model: ReducedPair, path: Path, overwrite: bool, torque_Nm: None) -> None:
    """Write both gears in motion."""
    from pmor.export.vtkhdf import export
    from pmor.work.cost import refuse_beyond_memory

    refuse_beyond(model.basis.case, "vtkhdf")
    refuse_beyond_memory(model.basis.case)
    export(model, path, overwrite)


def write_rexs(model: ReducedPair, path: Path, overwrite: bool, torque_Nm: None) -> None:
    """Write a pair with its results as REXS."""
    from pmor.rexs.document import save
    from pmor.rexs.results import stage_results
    from pmor.rexs.write import not_written, rexs_text

    case = model.basis.case
    refuse_beyond(case, "rexs")
    _LOG.info("%s", not_written(case))
    results = stage_results(model)
    save(path, overwrite, lambda date: rexs_text(case, model.meshed.pair, results, date))


def export_sweep(sweep: SteSweep, pair: GearPair, source: str, folder: Path, overwrite: bool) -> None:
    """Write the tables of a sweep into a folder."""
    from pmor.export.tables import sweep_entries

    _write_tables(sweep_entries(sweep, pair), source, folder, overwrite, ())


@suggesting
def import_rexs(path: Path | str, *, stage: int | None = None) -> Case:
    """Make a case of a cylindrical stage of a gearbox in a REXS file (1.0 to 2.0).

    Assumptions and unknown parts are noted in the log ``pmor``, and in the comments of the case's text.

    Parameters
    ----------
    path : Path or str
        `.rexs`, `.rexsz` or `.rexsj`.
    stage : int, optional
        Number of the stage in the file, where there are several.

    Raises
    ------
    FileFormatError
        When it is no REXS file.
    CaseError, GeometryError
        When there is no such stage, it is incomplete, or its teeth cannot mesh.
    """
    from pmor.rexs.read import read_stage

    found = read_stage(Path(path), stage)
    for note in found.notes:
        _LOG.info("%s", note)
    return found.case


def _case(source: Path, path: Path, overwrite: bool, stage: int | None) -> None:
    case = import_rexs(source, stage=stage)
    with atomic_path(path, overwrite) as temporary:
        temporary.write_text(case.text, encoding="utf-8")


def _gearbox(source: Path, path: Path, overwrite: bool) -> None:
    """Write a gearbox in REXS as a gearbox file."""
    from pmor.rexs.files import load_gearbox
    from pmor.rexs.model import ENDINGS as REXS
    from pmor.rexs.to_toml import write_gearbox_toml

    if source.suffix.lower() not in REXS:
        raise CaseError(f"{source}: --to gearbox takes a gearbox in REXS ({', '.join(REXS)})")
    file = load_gearbox(source)
    for note in file.notes:
        _LOG.info("%s", note)
    _, *beside = write_gearbox_toml(file, path, overwrite)
    _LOG.info("beside it: %s", ", ".join(one.name for one in beside))


def _is_gearbox(source: Path) -> bool:
    from pmor.rexs.model import ENDINGS as REXS

    return source.suffix.lower() in (".toml", *REXS) and kind_of(source, "gearbox") == "gearbox"


def _gearbox_unit(source: Path, path: Path, overwrite: bool, torque_Nm: float | None) -> None:
    """Write a gearbox in motion about its first load as a unit for co-simulation."""
    from pmor.dynamics.fmu.machine import write_machine_unit
    from pmor.rexs.files import load_gearbox

    if torque_Nm is not None:
        raise CaseError(f"torque_Nm = {torque_Nm:g}: a gearbox has the torques of its first load: leave it out")
    file = load_gearbox(source)
    if not write_machine_unit(file, path, overwrite):
        _LOG.info("no compiler here: the unit holds its source, and no binary")


def _universal(source: Path, path: Path, overwrite: bool) -> None:
    """Write results of motion as a universal file."""
    from pmor.export.universal import write_universal
    from pmor.storage.hdf5 import schema_name
    from pmor.storage.results_file import MOTION_RESULTS_SCHEMA, read_results

    if source.is_dir() or schema_name(source) != MOTION_RESULTS_SCHEMA.name:
        raise CaseError(f"{source}: --to uff {FORMATS['uff'].takes}")
    write_universal(read_results(source), path, overwrite)


def _machine(source: Path, path: Path, overwrite: bool) -> None:
    """Write a case, a set or a gearbox as REXS, without results."""
    from pmor.pair.model import gear_pair
    from pmor.rexs.document import save
    from pmor.rexs.write import rexs_text
    from pmor.rexs.write_gearbox import gearbox_rexs
    from pmor.rexs.write_set import set_rexs

    kind = kind_of(source)
    texts: dict[str, Callable[[Any, str], bytes]] = {
        "case": lambda case, date: rexs_text(case, gear_pair(case), None, date),
        "set": lambda file, date: set_rexs(file, None, date),
        "gearbox": lambda file, date: gearbox_rexs(file, (), (), date),
    }
    if kind not in texts:
        raise CaseError(f"{source}: is {KINDS[kind].words}: --to rexs takes the file of a machine, name that")
    file = called(KINDS[kind].load)(source)
    refuse_beyond(file, "rexs", str(source))
    save(path, overwrite, lambda date: texts[kind](file, date))


def _reduced(source: Path, to: str) -> ReducedPair:
    from pmor.storage.basis_file import read_basis
    from pmor.storage.compliance_file import COMPLIANCE_SCHEMA
    from pmor.storage.hdf5 import schema_name
    from pmor.storage.results_file import SET_RESULTS_SCHEMA
    from pmor.work.cost import refuse_large_basis
    from pmor_online.model import reduced_pair

    of_sets = (SET_RESULTS_SCHEMA.name, COMPLIANCE_SCHEMA.name)
    if source.is_dir() or source.suffix in (".json", ".toml") or schema_name(source) in of_sets:
        raise CaseError(f"{source}: --to {to} {FORMATS[to].takes}")
    refuse_large_basis(source)
    return reduced_pair(read_basis(source))


def _tables(source: Path, folder: Path, overwrite: bool) -> None:
    from pmor.export.tables import file_entries
    from pmor.storage.hdf5 import schema_name
    from pmor.storage.results_file import RESULTS_KINDS
    from pmor.work.cost import refuse_large_sweep_of
    from pmor_online.run import sweep_case

    if schema_name(source) in RESULTS_KINDS:
        _write_tables(file_entries(source), source.name, folder, overwrite, (source,))
        return
    reduced = _reduced(source, "csv")
    refuse_large_sweep_of(reduced.basis.case, reduced.meshed)
    about = f"{source.name}, case {reduced.basis.case.name}"
    export_sweep(sweep_case(reduced), reduced.meshed.pair, about, folder, overwrite)


def _write_tables(
    entries: dict[str, ResultArray], source: str, folder: Path, overwrite: bool, inputs: tuple[Path, ...]
) -> None:
    from pmor.export.tables import csv_tables

    tables, too_long = csv_tables(entries, printable(source))
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: is a file, and the tables go into a folder; choose another name")
    with results_folder(folder, tuple(tables), (), overwrite, inputs):
        for name, text in tables.items():
            with atomic_path(folder / name) as temporary:
                temporary.write_text(text, encoding="utf-8")
    for name in too_long:
        _LOG.info("%s: has more rows than a table takes: left out", name)
