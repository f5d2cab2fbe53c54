"""The `pmor` command: arguments in, exit code out.

Exit codes: 0 done, 2 the engineer can mend it (case file, output folder, arguments), 3 no convergence, 130 interrupted.
"""

import argparse
import errno
import gc
import logging
import math
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pmor.app import commands
from pmor.app.streams import usable_streams
from pmor.core.errors import OutputError, PmorError, printable
from pmor.core.memory import memory_limits, memory_text
from pmor.core.threads import use_one_thread
from pmor.core.version import __version__
from pmor.core.wording import did_you_mean, in_command

INTERRUPTED = 130
# Results have messages of their own (pmor.storage.atomic); this is for the files that libraries write.
# Measured: numpy, scipy, numba and h5py with one thread take 480 MiB before anything is solved.
FEWEST_ADDRESSES = 520 * 2**20
OUT_OF_SPACE = (errno.ENOSPC, errno.EDQUOT)
# Commands that keep finished pieces.
IN_PIECES = ("study", "stability", "convergence", "reductions", "dynamics", "design", "campaign")
RESUME_HINTS = {
    "offline": "the same command with --resume goes on where it stopped",
    **dict.fromkeys(IN_PIECES, "finished pieces are kept; the same command goes on where it stopped"),
}
SMALLER = "lower the elements, the angles or the torques of the case"
USUAL_HINT = "no file was left half written; the same command starts again"


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
Option = tuple[tuple[str, ...], dict[str, Any]]


def _option(*flags: str, **settings: Any) -> Option:
    return flags, settings


def _out(flag: str = "--out", usual: str = "out/<name of the case>") -> Option:
    text = f"folder for the results (default: {usual})"
    return _option(flag, dest="out", metavar="DIR", type=_path, help=text)


def _jobs(what: str = "angles") -> Option:
    return _option("--jobs", metavar="N", type=_positive, default=1, help=f"{what} solved at a time (default: 1)")


CASE = _option("case_path", metavar="CASE", type=_path, help="case file (TOML)")
OVERWRITE = _option("--overwrite", action="store_true", help="replace results that are there, whoever wrote them")
# Purpose and options of each command: arguments of the function of its name in `pmor.app.commands`.
COMMANDS: dict[str, tuple[str, *tuple[Option, ...]]] = {
    "run": (
        "everything a file asks for: of a pair, a planetary set, a gearbox; a design, a campaign, a study",
        _option("file_path", metavar="FILE", type=_path, help="file of any kind (TOML, or REXS)"),
        _out(usual="out/<name of the file>"),
        _option("--jobs", metavar="N", type=_positive, default=None, help="pieces solved at a time (default: 1; of a "
                "design as many as there are processors)"),
        OVERWRITE,
    ),
    "plan": (
        "show what will run and all settings; runs nothing",
        _option("file_path", metavar="FILE", type=_path, help="case, campaign, design, gearbox, set file (TOML, REXS)"),
    ),
    "offline": (
        "generate the reduced basis only", CASE,
        _option("-o", dest="basis_path", metavar="BASIS.h5", type=_path, required=True, help="file to write"),
        _option("--resume", action="store_true", help="go on where an interrupted run stopped"), _jobs(), OVERWRITE,
    ),
    "online": (
        "sweep the transmission error with a basis",
        _option("basis_path", metavar="BASIS.h5", type=_path, help="file that `pmor offline` wrote"), _out("-o"),
        _option("--case", dest="case_path", metavar="CASE", type=_path,
                help="sweep that this case asks for, instead of the one that the basis was made from"),
        _jobs(), OVERWRITE,
    ),
    "compare": ("reduced against full FE: error and run time", CASE, _out(), _jobs(), OVERWRITE),
    "study": (
        "a grid of meshes, refinements and models: error against run time, in one report",
        _option("study_path", metavar="STUDY", type=_path, help="study file (TOML)"), _out(), _jobs(),
        _option("--quick", action="store_true", help="the short variant that the study file describes"), OVERWRITE,
    ),
    "convergence": (
        "error of the mesh: finer and finer meshes against their limit", CASE,
        _out(usual="out/<name of the case>_convergence"), OVERWRITE,
    ),
    "stability": (
        "stiff and extreme variants of a case: does it hold, and how well", CASE,
        _out(usual="out/<name of the case>_stability"), _jobs("variants"),
        _option("--only", metavar="TEXT", default="", help="variants with this text in their name or group"),
        OVERWRITE,
    ),
    "reductions": (
        "reductions and samplings compared with full FE at equal conditions", CASE,
        _out(usual="out/<name of the case>_reductions"), _jobs("unseen states"), OVERWRITE,
    ),
    "dynamics": (
        "the pair in motion: frequency response, run-up and run-down, dynamic factor", CASE,
        _out(usual="out/<name of the case>_dynamics"), _jobs("torques"), OVERWRITE,
    ),
    "design": (
        "flank modifications searched over ranges, with tolerances: Pareto front; of a case, or a mesh of a gearbox",
        _option("design_path", metavar="DESIGN", type=_path,
                help="design file (TOML); it names a case, or a gearbox and one of its meshes, or a set"),
        _out(usual="out/<name of the design>"), _option("--jobs", metavar="N", type=_positive, default=None,
                help="pieces of the search solved at a time (default: as many as there are processors)"),
        _option("--case", dest="variant", metavar="N", type=_whole,
                help="write variant N of finished results as a case file"),
        OVERWRITE,
    ),
    "gearbox": (
        "shafts, bearings and several meshes together: misalignment, transmission error and load of each",
        _option("file_path", metavar="GEARBOX", type=_path, help="gearbox file (TOML or REXS)"),
        _out(usual="out/<name of the gearbox file>"), _jobs("angles"),
        OVERWRITE,
    ),
    "set": (
        "planetary sets, idlers and stars: transmission error, and how planets share the load",
        _option("file_path", metavar="SET", type=_path, help="set file (TOML), or REXS with a planetary stage"),
        _out(usual="out/<name of the set file>"), _jobs("members"), OVERWRITE,
    ),
    "campaign": (
        "many macro-geometries, each with finite elements of its own",
        _option("campaign_path", metavar="CAMPAIGN", type=_path, help="campaign file (TOML)"),
        _out(usual="out/<name of the campaign file>"), _jobs("designs"),
        _option("--dask", metavar="ADDRESS",
                help="scheduler of a Dask cluster whose workers solve the designs instead"),
        _option("--case", dest="case_number", metavar="N", type=_positive,
                help="write the case file of design N, into the current folder or that of --out, and solve nothing"),
        OVERWRITE,
    ),
    "bench": (
        "run time by phase and by size", CASE,
        _option("--json", dest="json_path", metavar="FILE", type=_path, required=True,
                help="file to write; one that is there is compared with first"),
        _option("--jobs", metavar="N", type=_positive, default=2, help="threads of the parallel sweep (default: 2)"),
        OVERWRITE,
    ),
    "export": (
        "a basis, a gearbox, a set or results in the formats of other programs",
        _option("source", metavar="FILE", type=_path, help="a basis, or a REXS file for --to case and gearbox"),
        _option("--to", choices=("case", "csv", "fmu", "gearbox", "rexs", "vtkhdf"), required=True,
                help="format to write"),
        _option("-o", dest="target", metavar="PATH", type=_path,
                help="file to write, or folder for tables (default: named after FILE, in the current folder)"),
        _option("--stage", metavar="ID", type=_positive, help="stage of a REXS file that has several"),
        _option("--torque", dest="torque_Nm", metavar="N_M", type=_torque,
                help="torque on the pinion up to which the force law of an FMU reaches "
                "(default: twice that of the case)"),
        OVERWRITE,
    ),
    "info": (
        "content of an HDF5 file",
        _option("path", metavar="FILE.h5", type=_path,
                help="a basis or another HDF5 file of pmor; or the folder of a campaign"),
        _option("--verify", action="store_true", help="compare a basis with full FE of its case: seconds"),
    ),
}  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; those of the process by default.
    """
    with usable_streams(), _spoken_log():
        _refuse_unknown(sys.argv[1:] if argv is None else argv)
        arguments = vars(build_parser().parse_args(argv))
        return _run(arguments.pop("command"), arguments)


def _run(name: str, arguments: dict[str, Any]) -> int:
    try:
        use_one_thread()  # before anything loads numpy
        _refuse_few_addresses()
        getattr(commands, name)(**arguments)
        sys.stdout.flush()
    except PmorError as error:
        print(f"pmor: error: {_one_line(str(error))}", file=sys.stderr)
        return error.exit_code
    except (MemoryError, OSError) as error:
        if isinstance(error, MemoryError) or error.errno == errno.ENOMEM:
            print(f"pmor: error: the memory of this computer does not suffice ({error}): {SMALLER}", file=sys.stderr)
            return PmorError.exit_code
        if error.errno not in OUT_OF_SPACE:
            raise
        place = f" ({error.filename})" if error.filename else ""
        remedy = "free some; compiled kernels need some as well, beside the program or in NUMBA_CACHE_DIR"
        print(f"pmor: error: no space is left on a disk{place}: {remedy}", file=sys.stderr)
        return PmorError.exit_code
    except KeyboardInterrupt:
        # The line break ends a progress line that may stand half written on the terminal.
        start = "\n" if sys.stderr.isatty() else ""
        print(f"{start}pmor: interrupted: {RESUME_HINTS.get(name, USUAL_HINT)}", file=sys.stderr)
        return INTERRUPTED
    return 0


def _refuse_unknown(argv: Sequence[str]) -> None:
    """Exit with 2 where the first word is no command, with the one that is meant."""
    if argv and not argv[0].startswith("-") and argv[0] not in COMMANDS:
        rule = "is no command: to run a file, write pmor run FILE" if Path(argv[0]).suffix else "is no command"
        print(f"pmor: error: {printable(argv[0])} {rule}: {did_you_mean(argv[0], list(COMMANDS))}", file=sys.stderr)
        raise SystemExit(PmorError.exit_code)


def build_parser() -> argparse.ArgumentParser:
    """Build the parser; the names of the arguments are those of the functions in `pmor.app.commands`."""
    parser = argparse.ArgumentParser(
        prog="pmor", description="Static transmission error of gear pairs by full FE contact and by a reduced model."
    )
    parser.add_argument("--version", action="version", version=f"pmor {__version__}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, (text, *options) in COMMANDS.items():
        command = subparsers.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        for flags, settings in options:
            command.add_argument(*flags, **settings)
    return parser


def _refuse_few_addresses() -> None:
    """Refuse to begin where addresses are limited to fewer than the libraries reserve: without any they just die.

    Raises
    ------
    OutputError
        When they do not suffice for the libraries alone.
    """
    for limit in memory_limits():
        if limit.of_addresses and limit.size < FEWEST_ADDRESSES:
            raise OutputError(
                f"{limit.source} {memory_text(limit.size)} of addresses, and the libraries alone reserve "
                f"{memory_text(FEWEST_ADDRESSES)}: {limit.remedy}"
            )


@contextmanager
def _spoken_log() -> Iterator[None]:
    """Show the notes of the library on the error stream, from INFO upwards."""
    log, handler = logging.getLogger("pmor"), logging.StreamHandler()
    handler.setFormatter(_Line())
    # matplotlib complains in three lines where a user has no folder for its settings; nothing here depends on them.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    level, shown = log.level, warnings.showwarning
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    # What libraries warn of is for developers: states are judged by their own residuals, and flagged where they fail.
    warnings.showwarning = _keep_quiet
    try:
        yield
    finally:
        warnings.showwarning = shown
        log.removeHandler(handler)
        log.setLevel(level)


def _keep_quiet(message: Warning | str, category: type[Warning], *place: object, **more: object) -> None:
    logging.getLogger("pmor").debug("%s: %s", category.__name__, message)


class _Line(logging.Formatter):
    """One line, ``pmor: ...`` or ``pmor: warning: ...``."""

    def format(self, record: logging.LogRecord) -> str:
        # On a terminal a bar may stand half written in the line.
        start = "\r\x1b[K" if sys.stderr.isatty() else ""
        level = "warning: " if record.levelno >= logging.WARNING else ""
        return f"{start}pmor: {level}{_one_line(record.getMessage())}"


def _one_line(text: str) -> str:
    return printable(in_command(" ".join(text.splitlines())))


def program() -> None:
    """Run one command as a program, and end the process with its exit code."""
    gc.set_threshold(50_000)  # the libraries' objects stay: to look through them again and again took 0.3 s
    code = main()
    # Results are written: an interrupt while the interpreter ends would turn the code into that of a crash.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.freeze()  # the interpreter would look through all objects of the libraries once more: half a second
    sys.exit(code)


if __name__ == "__main__":
    program()
