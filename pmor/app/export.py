"""Files in other formats: what each is made from, what it is called, and who writes it."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from pmor.core.errors import CaseError, OutputError
from pmor.storage.atomic import atomic_path, ensure_folder, refuse_existing
from pmor.storage.results_folder import refuse_in_the_way, results_folder

if TYPE_CHECKING:
    from pmor.export.tables import Entry
    from pmor.gear.pair import GearPair
    from pmor.results.sweep import SteSweep
    from pmor_online.model import ReducedPair

#: formats, and what their files end with; tables are files in a folder
ENDINGS = {"case": ".toml", "csv": "_tables", "fmu": ".fmu", "rexs": ".rexs", "vtkhdf": ".vtkhdf"}
FORMATS = tuple(ENDINGS)
# Kind of the file with all results of a run.
RESULTS = "pmor-results"
# What only some formats take, by the name of the argument.
TAKEN_BY = {"stage": "case", "torque_Nm": "fmu"}


@dataclass(frozen=True)
class Exported:
    """What was written.

    Parameters
    ----------
    path : Path
    notes : tuple of str
        What a reader should know of it.
    """

    path: Path
    notes: tuple[str, ...] = ()


def export_file(
    source: Path, to: str, target: Path | None = None, overwrite: bool = False, stage: int | None = None,
    torque_Nm: float | None = None,
) -> Exported:  # fmt: skip
    """Write a file in another format.

    Parameters
    ----------
    source : Path
        A basis; a REXS file for a case; a file of results for tables.
    to : {"case", "csv", "fmu", "rexs", "vtkhdf"}
    target : Path, optional
        By default named after the source, in the current folder.
    overwrite : bool
        Replace what is there.
    stage : int, optional
        Of a REXS file with several.
    torque_Nm : float, optional
        On the pinion, up to which the table of a unit for co-simulation reaches.

    Returns
    -------
    Exported

    Raises
    ------
    PmorError
        When the source is none for this format, or the target cannot be written.
    """
    if to not in FORMATS:
        raise CaseError(f"to = {to!r}: must be one of {', '.join(FORMATS)}")
    for name, value in (("stage", stage), ("torque_Nm", torque_Nm)):
        if value is not None and TAKEN_BY[name] != to:
            raise CaseError(f"{name} = {value:g}: is for the format {TAKEN_BY[name]} alone: leave it out")
    path = target or Path(source.stem + ENDINGS[to])
    if to == "csv":
        return _tables(source, path, overwrite)
    refuse_existing(path, overwrite)
    refuse_in_the_way([path], overwrite, (source,))
    ensure_folder(path.parent)
    if to == "case":
        return _case(source, path, overwrite, stage)
    if to == "vtkhdf":
        return _vtkhdf(source, path, overwrite)
    return _model(source, to, path, overwrite, torque_Nm)


def export_model(
    model: ReducedPair, to: str, path: Path, overwrite: bool = False, torque_Nm: float | None = None
) -> Exported:
    """Write what follows from a reduced model: a unit for co-simulation, or a REXS file with its results."""
    if to == "fmu":
        from pmor.dynamics.fmu.law import mesh_law
        from pmor.dynamics.fmu.write import write_fmu

        compiled = write_fmu(mesh_law(model, torque_Nm), path, overwrite)
        return Exported(path, () if compiled else ("no compiler here: the unit holds its source, and no binary",))
    from pmor.export.rexs.results import stage_results
    from pmor.export.rexs.write import write_rexs

    case = model.basis.case
    if model.basis.shapes is not None:
        raise CaseError(f'{case.name}: results for REXS take line loads: write [contact] scheme = "line"')
    write_rexs(case, model.meshed.pair, path, stage_results(model), overwrite)
    return Exported(path)


def export_sweep(sweep: SteSweep, pair: GearPair, source: str, folder: Path, overwrite: bool = False) -> Exported:
    """Write the tables of a sweep into a folder."""
    from pmor.export.sweep_tables import sweep_entries

    return _write_tables(sweep_entries(sweep, pair), source, folder, overwrite, ())


def _case(source: Path, path: Path, overwrite: bool, stage: int | None) -> Exported:
    from pmor.export.rexs.read import import_rexs

    found = import_rexs(source, stage)
    with atomic_path(path, overwrite) as temporary:
        temporary.write_text(found.case.text, encoding="utf-8")
    return Exported(path, found.notes)


def _model(source: Path, to: str, path: Path, overwrite: bool, torque_Nm: float | None) -> Exported:
    return export_model(_reduced(source), to, path, overwrite, torque_Nm)


def _reduced(source: Path) -> ReducedPair:
    from pmor.storage.basis_file import read_basis
    from pmor.work.cost import refuse_large_basis
    from pmor_online.model import reduced_pair

    refuse_large_basis(source)
    return reduced_pair(read_basis(source))


def _tables(source: Path, folder: Path, overwrite: bool) -> Exported:
    from pmor.storage.hdf5 import schema_name
    from pmor_online.run import sweep_case

    if schema_name(source) == RESULTS:
        from pmor.export.file_tables import file_entries

        return _write_tables(file_entries(source), source.name, folder, overwrite, (source,))
    reduced = _reduced(source)
    return export_sweep(
        sweep_case(reduced), reduced.meshed.pair, f"{source.name}, case {reduced.basis.case.name}", folder, overwrite
    )


def _write_tables(
    entries: dict[str, Entry], source: str, folder: Path, overwrite: bool, inputs: tuple[Path, ...]
) -> Exported:
    from pmor.export.tables import csv_tables

    tables, too_long = csv_tables(entries, source)
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: is a file, and the tables go into a folder; choose another name")
    with results_folder(folder, tuple(tables), (), overwrite, inputs):
        for name, text in tables.items():
            with atomic_path(folder / name) as temporary:
                temporary.write_text(text, encoding="utf-8")
    return Exported(folder, tuple(f"{name}: has more rows than a table takes: left out" for name in too_long))


def _vtkhdf(source: Path, path: Path, overwrite: bool) -> Exported:
    from pmor.work.cost import refuse_beyond_memory

    reduced = _reduced(source)
    refuse_beyond_memory(reduced.basis.case)
    import_module("pmor.export.vtkhdf").export(reduced, path, False, overwrite)
    return Exported(path)
