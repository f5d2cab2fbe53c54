"""Kinds of files and commands, one record each: help, Python, README and messages are made from these two tables.

A new question that is asked of machines is one more record in `COMMANDS`; a new notation one in `KINDS`. Functions are
named "module:function" and imported when they are called, so that ``pmor --help`` stays instant.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from pmor.core.errors import CaseError, printable
from pmor.core.threads import processes, threads

Option = tuple[tuple[str, ...], dict[str, Any]]


@dataclass(frozen=True)
class Kind:
    """A kind of file that describes a machine, or asks a question about one.

    Parameters
    ----------
    words : str
        What a file is taken for.
    command : str
        That answers it.
    sections : tuple of str
        Of a file in TOML: one of them tells the kind. Empty of the kind that is left.
    types : tuple of str
        Names of the classes of what `load` returns.
    load, plan, parse : str
        Reads a file; returns its `pmor.work.cost.Plan`; takes the text of a machine, made in Python.
    """

    words: str
    command: str
    sections: tuple[str, ...]
    types: tuple[str, ...]
    load: str
    plan: str
    parse: str = ""


# In the order in which they are told from each other: what asks about a machine before what describes one.
KINDS: Mapping[str, Kind] = {
    "study": Kind(
        "a study", "study", ("grid", "variant", "rung"), ("Study",), "pmor.lab.study.settings:load",
        "pmor.lab.study.plan:plan",
    ),
    "campaign": Kind(
        "a campaign", "campaign", ("designs",), ("Campaign",), "pmor.campaigns.loader:load",
        "pmor.campaigns.plan:plan",
    ),
    "design": Kind(
        "a design", "design", ("variables",), ("DesignFile",), "pmor.design.loader:load",
        "pmor.design.plan:plan",
    ),
    "gearbox": Kind(
        "a gearbox", "run", ("shafts", "bearings"), ("GearboxFile",), "pmor.rexs.files:load_gearbox",
        "pmor.machine.plan:plan", "pmor.rexs.files:parse_gearbox",
    ),
    "set": Kind(
        "a planetary set or a train of gears", "run", ("sun", "planet", "planets", "ring", "gears"), ("SetFile",),
        "pmor.rexs.files:load_set", "pmor.sets.preview:plan", "pmor.sets.loader:parse_set",
    ),
    "case": Kind(
        "a case of one pair", "run", (), ("Case",), "pmor.case:load_case", "pmor.app.plan:plan",
    ),
}  # fmt: skip
# What a file is called at the desk: a case is one of a pair.
FILES = tuple("pair" if kind == "case" else kind for kind in reversed(list(KINDS)))
STARTS = FILES[:-1]  # those that `pmor new` writes: studies are of laboratories


@dataclass(frozen=True)
class Command:
    """A command: how it is called, what it does, and of questions what answers them and how they fail.

    Parameters
    ----------
    words : str
        What it does, in help and README.
    options : tuple
        Flags and settings of its arguments for argparse; names of the arguments are those of its function.
    python : str
        The same in Python.
    lab : bool
        Whether it is an experiment on the program, below ``pmor lab``.
    answers : mapping of str to str
        Of a question: what answers it for each kind of file. Empty of commands with functions of their own alone.
    failed : str
        What the failures of a result are.
    folder : str
        What the usual folder of results has behind the name of the file.
    workers : callable
        Makes an executor from a number of jobs.
    on_threads : tuple of str
        Kinds of files that are answered on threads, whatever the others take.
    """

    words: str
    options: tuple[Option, ...]
    python: str
    lab: bool = False
    answers: Mapping[str, str] = field(default_factory=dict)
    failed: str = "did not converge"
    folder: str = ""
    workers: Callable[[int], AbstractContextManager[Executor | None]] = threads
    on_threads: tuple[str, ...] = ()


@dataclass(frozen=True)
class Format:
    """A format of `pmor export`.

    Parameters
    ----------
    ending : str
        What its files end with; tables are files in a folder.
    words : str
        What it is, in help and README.
    takes : str
        What it takes, and what a set leaves in place of a basis, which it has none of; empty of those from REXS alone.
    of_model : str
        Writes it from a reduced model: called with that, path, overwrite and the torque that was asked for.
    """

    ending: str
    words: str
    takes: str = ""
    of_model: str = ""


FORMATS: Mapping[str, Format] = {
    "csv": Format("_tables", "tables", "takes a basis or results.h5; pmor run leaves results.h5 of a set"),
    "rexs": Format(
        ".rexs", "REXS", "takes a basis, or the file of a machine; pmor run leaves set.rexs with results of a set",
        "pmor.app.export:write_rexs",
    ),
    "fmu": Format(
        ".fmu", "unit for co-simulation", "takes a basis, or the file of a gearbox in motion, not of a set",
        "pmor.app.export:write_unit",
    ),
    "vtkhdf": Format(
        ".vtkhdf", "animation", "takes a basis; pmor run leaves set.vtkhdf of a set", "pmor.app.export:write_animation"
    ),
    "uff": Format(".uff", "universal file", "takes results.h5 of a gearbox or a set in motion (pmor dynamics)"),
    "case": Format(".toml", "a case"),
    "gearbox": Format(".toml", "gearbox file"),
}  # fmt: skip


def _formats(of_basis: bool) -> list[str]:
    return [f"{made.words} (`{name}`)" for name, made in FORMATS.items() if bool(made.takes) == of_basis]


def _option(*flags: str, **settings: Any) -> Option:
    return flags, settings


def _path(text: str) -> Path:
    if not text:
        raise argparse.ArgumentTypeError("an empty name: write . for the current folder")
    return Path(text)


def _number(kind: type[int] | type[float], above: float, rule: str) -> Callable[[str], float]:
    """Give a function that reads a finite number above a bound."""

    def read(text: str) -> float:
        try:
            number = kind(text)
        except ValueError:
            number = kind(above)
        if not above < number < math.inf:
            raise argparse.ArgumentTypeError(f"{text!r} is not a {rule}")
        return number

    return read


_positive = _number(int, 0, "whole number of at least 1")
_whole = _number(int, -1, "whole number of at least 0")
_torque = _number(float, 0.0, "positive number")


def _file(metavar: str, text: str, dest: str = "file_path") -> Option:
    return _option(dest, metavar=metavar, type=_path, help=text)


def _out(flag: str = "--out", usual: str = "out/<name of the file>") -> Option:
    text = f"folder for the results (default: {usual})"
    return _option(flag, dest="out", metavar="DIR", type=_path, help=text)


def _jobs(what: str = "angles", default: int | None = 1, usual: str = "1") -> Option:
    text = f"{what} solved at a time (default: {usual})"
    return _option("--jobs", metavar="N", type=_positive, default=default, help=text)


CASE = _file("CASE", "case file (TOML)", "case_path")
OVERWRITE = _option("--overwrite", action="store_true", help="replace results that are there, whoever wrote them")


def _question(
    words: str, python: str, answers: Mapping[str, str], file: tuple[str, str], *more: Option, jobs: Option | None,
    **settings: Any,
) -> Command:  # fmt: skip
    """Return the record of a command that answers a file in a folder."""
    out = _out(usual=f"out/<name of the file>{settings.get('folder', '')}")
    options = (_file(*file), out, *((jobs,) if jobs else ()), *more, OVERWRITE)
    return Command(words, options, python, answers=answers, **settings)


COMMANDS: Mapping[str, Command] = {
    "run": _question(
        "all that a file asks for: of a pair a basis for each model unless there is one, sweeps, comparison with full "
        "FE, report; of a planetary set or a gearbox all meshes, shafts and bearings; a design, a campaign, a study",
        "pmor.run(file, folder)`; of a trained model `model.report(folder)", {
            "case": "pmor.app.run:run_case", "set": "pmor.app.machines:run_set",
            "gearbox": "pmor.app.machines:run_gearbox",
        },
        ("FILE", "file of any kind (TOML, or REXS)"),
        jobs=_jobs("pieces", None, "1; of a design as many as there are processors"), failed="positions failed",
    ),
    "plan": Command(
        "settings, what will run, peak memory and time, what is left out and why; runs nothing",
        (_file("FILE", "file of any kind (TOML, or REXS)"),), "pmor.plan(file)",
    ),
    "new": Command(
        "a file to start from, every line explained: `pmor new pair > pair.toml`",
        (_option("kind", metavar="KIND", choices=STARTS, help=", ".join(STARTS)),), "",
    ),
    "schema": Command(
        "JSON Schema of a kind of file, by which editors complete and check it; without KIND where all of them are",
        (_option("kind", metavar="KIND", choices=FILES, nargs="?", help=", ".join(FILES)),), "",
    ),
    "offline": Command(
        "basis only; interrupted, it goes on with `--resume`",
        (CASE, _option("-o", dest="basis_path", metavar="BASIS.h5", type=_path, required=True, help="file to write"),
         _option("--resume", action="store_true", help="go on where an interrupted run stopped"), _jobs(), OVERWRITE),
        "pmor.train(case, file=..., resume=True)",
    ),
    "online": Command(
        "sweep with a basis only",
        (_file("BASIS.h5", "file that `pmor offline` wrote", "basis_path"), _out("-o", "out/<name of the case>"),
         _option("--case", dest="case_path", metavar="CASE", type=_path,
                 help="sweep that this case asks for, instead of the one that the basis was made from"),
         _jobs(), OVERWRITE),
        "pmor.load_model(file, case=case).report(folder, compare=False)",
    ),
    "compare": Command(
        "reduced against full FE: error and run time", (CASE, _out(), _jobs(), OVERWRITE),
        "pmor.run_case(case, folder, pages=False)`; figures alone: `pmor.compare(model)",
    ),
    "dynamics": _question(
        "a pair in motion: response over the speed with its jumps, run-up and run-down; a planetary set or a "
        "gearbox: modes, mesh and bearing forces over the speed",
        "pmor.run_dynamics(file, folder)", {
            "case": "pmor.dynamics.run:run", "set": "pmor.dynamics.whine.run:run",
            "gearbox": "pmor.dynamics.whine.run:run",
        },
        ("FILE", "file of a case, a planetary set or a gearbox (TOML, or REXS)"),
        jobs=_jobs("torques, or loads,"), failed="parts of responses are missing", folder="_dynamics",
        workers=processes, on_threads=("gearbox", "set"),
    ),
    "design": _question(
        "flank modifications searched over ranges, of a case, of meshes of a gearbox or of a set, with tolerances, and "
        "their Pareto front; with `--case`, a variant as a file",
        "pmor.run_design(file, folder)`, `pmor.write_design_case(file, folder, n)", {"design": "pmor.design.run:run"},
        ("DESIGN", "design file (TOML); it names a case, or a gearbox and some of its meshes, or a set"),
        _option("--case", dest="number", metavar="N", type=_whole,
                help="write variant N of finished results as a file"),
        jobs=_jobs("pieces of the search", None, "as many as there are processors"),
    ),
    "campaign": _question(
        "many macro-geometries, of pairs or planetary sets, on processes of this machine or on a cluster: results, "
        "Pareto fronts, files",
        "pmor.campaign(file, folder)`, `pmor.write_campaign_case(file, folder, n)",
        {"campaign": "pmor.campaigns.run:run"}, ("CAMPAIGN", "campaign file (TOML)"),
        _option("--dask", metavar="ADDRESS", help="scheduler of a Dask cluster whose workers solve the designs"),
        _option("--case", dest="number", metavar="N", type=_positive,
                help="write the file of design N, into the current folder or that of --out, and solve nothing"),
        jobs=_jobs("designs"), failed="designs have no results",
    ),
    "diff": Command(
        "results of two folders beside each other: curves, quantities that differ, keys of their files",
        (_option("first", metavar="A", type=_path, help="folder of results of any kind"),
         _option("second", metavar="B", type=_path, help="another one"), _out(usual="out/<A>_<B>_diff"), OVERWRITE),
        "pmor.diff(a, b, folder)",
    ),
    "export": Command(
        f"a basis, or results, as {', '.join(_formats(True))}; a REXS gearbox as {' or '.join(_formats(False))}; the "
        "file of a machine as REXS, of a gearbox in motion as unit for co-simulation",
        (_file("FILE", "a basis, results, or the file of a machine", "source"),
         _option("--to", metavar="FORMAT", choices=sorted(FORMATS), required=True,
                 help=f"{', '.join(sorted(FORMATS)[:-1])} or {max(FORMATS)}"),
         _option("-o", dest="target", metavar="PATH", type=_path,
                 help="file to write, or folder for tables (default: named after FILE, in the current folder)"),
         _option("--stage", metavar="ID", type=_positive, help="stage of a REXS file that has several"),
         _option("--torque", dest="torque_Nm", metavar="N_M", type=_torque,
                 help="torque on the pinion up to which the force law of an FMU reaches "
                 "(default: twice that of the case)"),
         OVERWRITE),
        "pmor.export_file(file, format, path)`; of a model `model.export(path, format)",
    ),
    "info": Command(
        "what a file is and holds, or the folder of a campaign; with `--verify`, a basis compared with full FE of its "
        "case",
        (_file("FILE", "a file of pmor (HDF5, TOML), REXS, or the folder of a campaign", "path"),
         _option("--verify", action="store_true", help="compare a basis with full FE of its case: seconds")),
        "pmor.info(file)`, `pmor.verify(file)",
    ),
    "study": _question(
        "a grid of meshes, refinements, models: error against run time", "pmor.study(file, folder, quick=True)",
        {"study": "pmor.lab.study.run:run"}, ("STUDY", "study file (TOML)"),
        _option("--quick", action="store_true", help="the short variant that the study file describes"),
        jobs=_jobs(), lab=True,
    ),
    "convergence": _question(
        "STE on finer and finer meshes of each element against their limit", "pmor.convergence(file, folder)",
        {"case": "pmor.lab.convergence.run:run"}, ("CASE", "case file (TOML)"), jobs=None, lab=True,
        failed="meshes did not converge", folder="_convergence",
    ),
    "stability": _question(
        "stiff and extreme variants of a case: does it hold, and how well", "pmor.stability(file, folder)",
        {"case": "pmor.lab.stability.run:run"}, ("CASE", "case file (TOML)"),
        _option("--only", metavar="TEXT", default="", help="variants with this text in their name or group"),
        jobs=_jobs("variants"), lab=True, failed="variants failed", folder="_stability",
    ),
    "reductions": _question(
        "reductions and samplings at equal conditions", "pmor.reductions(file, folder)",
        {"case": "pmor.lab.comparison.run:run"}, ("CASE", "case file (TOML)"), jobs=_jobs("unseen states"), lab=True,
        failed="states did not converge", folder="_reductions",
    ),
    "slices": _question(
        "a pair in motion with the coupling of its teeth and without", "",
        {"case": "pmor.lab.slices.page:run"}, ("CASE", "case file (TOML)"), jobs=_jobs("force laws"), lab=True,
        folder="_slices",
    ),
    "bench": Command(
        "run time by phase and size, of a gearbox that of its motion, as ratios to FILE where it is there",
        (_file("CASE", "case or gearbox file (TOML)", "case_path"),
         _option("--json", dest="json_path", metavar="FILE", type=_path, required=True,
                 help="file to write; one that is there is compared with first"),
         _jobs("parallel sweep on so many threads;", 2, "2"), OVERWRITE),
        "pmor.bench(case, file)", lab=True, answers=dict.fromkeys(("case", "gearbox"), "pmor.lab.bench:run"),
    ),
    "validation": Command(
        "figures of others beside those of the program, as a page",
        (_option("-o", dest="page", metavar="FILE", type=_path, default=Path("validation.md"),
                 help="page to write (default: validation.md)"),),
        "", lab=True,
    ),
}  # fmt: skip
# Words that were commands once, and what answers instead.
MOVED = {
    "set": "pmor run", "gearbox": "pmor run",
    **{name: f"pmor lab {name}" for name, command in COMMANDS.items() if command.lab},
}  # fmt: skip


def typed(name: str) -> str:
    """Return how a command is typed."""
    return MOVED.get(name, f"pmor {name}")


def usage(name: str) -> str:
    """Return a command with its arguments, optional ones in brackets."""
    words = [typed(name)]
    for flags, settings in COMMANDS[name].options:
        shown = [flags[0]] if flags[0].startswith("-") else []
        shown += [settings["metavar"]] if "metavar" in settings else []
        text = " ".join(shown)
        needed = settings.get("required") or not (flags[0].startswith("-") or settings.get("nargs") == "?")
        words.append(text if needed else f"[{text}]")
    return " ".join(words)


def called(place: str) -> Callable[..., Any]:
    """Return the function at "module:function"."""
    module, _, name = place.partition(":")
    function: Callable[..., Any] = getattr(import_module(module), name)
    return function


def kind_of(path: Path, expected: str = "case") -> str:
    """Return what kind of file it is, a key of `KINDS`; messages name the kind that is expected.

    Raises
    ------
    CaseError, FileFormatError
        Where it cannot be read.
    """
    from pmor.case.reader import parse_toml, read_text
    from pmor.rexs.model import is_rexs

    if is_rexs(path):
        from pmor.rexs.files import is_one_set

        return "set" if is_one_set(path) else "gearbox"
    return kind_of_sections(parse_toml(read_text(path, f"{expected} file"), str(path)))


def kind_of_sections(written: Mapping[str, Any]) -> str:
    """Return what kind of file has these sections."""
    return next(name for name, kind in KINDS.items() if not kind.sections or written.keys() & set(kind.sections))


def kind_of_settings(settings: object) -> str:
    """Return the kind of what a reader returned; TypeError for anything else."""
    name = type(settings).__name__
    for kind, record in KINDS.items():
        if name in record.types:
            return kind
    raise TypeError(f"{settings!r:.60}: must be the name of a file, or what pmor.load() returned")


def settings_for(file: Any, command: str, **options: Any) -> Any:
    """Read a file as a command takes it; settings that a reader returned stay.

    Raises
    ------
    CaseError, GeometryError, FileFormatError
        As its reader does; with the right command where it is of another kind.
    """
    wanted = tuple(COMMANDS[command].answers) or ("case",)
    if not isinstance(file, str | Path):
        _refuse_other_kinds(kind_of_settings(file), wanted, command, file.name)
        return file
    path = Path(file)
    kind = kind_of(path, wanted[0])
    if kind == "case":  # what nothing tells: readers say what is missing
        kind = wanted[0]
    _refuse_other_kinds(kind, wanted, command, str(path))
    return called(KINDS[kind].load)(path, **options)


def _refuse_other_kinds(kind: str, wanted: tuple[str, ...], command: str, place: str) -> None:
    if kind not in wanted:
        takes = " or ".join(KINDS[name].words for name in wanted)
        rule = f"is {KINDS[kind].words}, and {typed(command)} takes {takes}: use {typed(KINDS[kind].command)}"
        raise CaseError(f"{printable(place)}: {rule}")
