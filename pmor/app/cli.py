"""The `pmor` command: arguments in, exit code out.

Exit codes: 0 done, 2 the engineer can mend it (case file, output folder, arguments), 3 no convergence, 130 interrupted.
"""

import argparse
import errno
import logging
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pmor.app import commands
from pmor.app.streams import usable_streams
from pmor.core.errors import OutputError, PmorError, printable
from pmor.core.memory import memory_limits, memory_text
from pmor.core.threads import use_one_thread
from pmor.core.version import __version__

INTERRUPTED = 130
# Results have messages of their own (pmor.storage.atomic); this is for the files that libraries write.
# Measured: numpy, scipy, numba and h5py with one thread take 480 MiB before anything is solved.
FEWEST_ADDRESSES = 520 * 2**20
OUT_OF_SPACE = (errno.ENOSPC, errno.EDQUOT)
KEPT = "finished pieces are kept; the same command goes on where it stopped"
RESUME_HINTS = {
    "offline": "the same command with --resume goes on where it stopped",
    "study": KEPT,
    "stability": KEPT,
    "convergence": KEPT,
    "reductions": KEPT,
    "dynamics": KEPT,
    "design": KEPT,
    "campaign": KEPT,
}
# Commands whose run times compare models, or that share out their work: one thread of linear algebra.
ONE_THREAD = ("study", "convergence", "stability", "reductions", "dynamics", "design", "campaign", "bench")
SMALLER = "lower the elements, the angles or the torques of the case"
USUAL_HINT = "no file was left half written; the same command starts again"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; those of the process by default.
    """
    with usable_streams(), _spoken_log():
        arguments = vars(build_parser().parse_args(argv))
        return _run(arguments.pop("command"), arguments)


def _run(name: str, arguments: dict[str, Any]) -> int:
    try:
        _ask_for_few_addresses()
        if name in ONE_THREAD:
            use_one_thread()  # before anything loads numpy
        getattr(commands, name)(**arguments)
        sys.stdout.flush()
    except PmorError as error:
        print(f"pmor: error: {_one_line(str(error))}", file=sys.stderr)
        return error.exit_code
    except MemoryError as error:
        print(f"pmor: error: the memory of this computer does not suffice ({error}): {SMALLER}", file=sys.stderr)
        return PmorError.exit_code
    except OSError as error:
        if error.errno == errno.ENOMEM:
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


def build_parser() -> argparse.ArgumentParser:
    """Build the parser; the names of the arguments are those of the functions in `pmor.app.commands`."""
    parser = argparse.ArgumentParser(
        prog="pmor", description="Static transmission error of gear pairs by full FE contact and by a reduced model."
    )
    parser.add_argument("--version", action="version", version=f"pmor {__version__}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)

    def command(name: str, text: str) -> argparse.ArgumentParser:
        return subparsers.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")

    run = command("run", "everything the case asks for: basis, sweep, comparison, report")
    _add_case(run)
    _add_out(run, "--out")
    _add_jobs(run)
    _add_overwrite(run)

    _add_case(command("plan", "show what will run and all settings; runs nothing"))

    offline = command("offline", "generate the reduced basis only")
    _add_case(offline)
    offline.add_argument("-o", dest="basis_path", metavar="BASIS.h5", type=_path, required=True, help="file to write")
    offline.add_argument("--resume", action="store_true", help="go on where an interrupted run stopped")
    _add_jobs(offline)
    _add_overwrite(offline)

    online = command("online", "sweep the transmission error with a basis")
    online.add_argument("basis_path", metavar="BASIS.h5", type=_path, help="file that `pmor offline` wrote")
    _add_out(online, "-o")
    online.add_argument(
        "--case", dest="case_path", metavar="CASE", type=_path,
        help="sweep that this case asks for, instead of the one that the basis was made from",
    )  # fmt: skip
    _add_jobs(online)
    _add_overwrite(online)

    compare = command("compare", "reduced against full FE: error and run time")
    _add_case(compare)
    _add_out(compare, "--out")
    _add_jobs(compare)
    _add_overwrite(compare)

    study = command("study", "a grid of meshes, refinements and models: error against run time, in one report")
    study.add_argument("study_path", metavar="STUDY", type=_path, help="study file (TOML)")
    _add_out(study, "--out")
    _add_jobs(study)
    study.add_argument("--quick", action="store_true", help="the short variant that the study file describes")
    _add_overwrite(study)

    convergence = command("convergence", "what the mesh costs: finer and finer meshes against their limit")
    _add_case(convergence)
    _add_out(convergence, "--out", "out/<name of the case>_convergence")
    _add_overwrite(convergence)

    stability = command("stability", "stiff and extreme variants of a case: does it hold, and how well")
    _add_case(stability)
    _add_out(stability, "--out", "out/<name of the case>_stability")
    _add_jobs(stability, "variants")
    stability.add_argument("--only", metavar="TEXT", default="", help="variants with this text in their name or group")
    _add_overwrite(stability)

    reductions = command("reductions", "reductions and samplings compared with full FE at equal conditions")
    _add_case(reductions)
    _add_out(reductions, "--out", "out/<name of the case>_reductions")
    _add_jobs(reductions, "unseen states")
    _add_overwrite(reductions)

    dynamics = command("dynamics", "the pair in motion: frequency response, run-up and run-down, dynamic factor")
    _add_case(dynamics)
    _add_out(dynamics, "--out", "out/<name of the case>_dynamics")
    _add_jobs(dynamics, "torques")
    _add_overwrite(dynamics)

    design = command("design", "flank modifications searched over ranges, with tolerances: Pareto front")
    design.add_argument("design_path", metavar="DESIGN", type=_path, help="design file (TOML)")
    _add_out(design, "--out", "out/<name of the design>")
    _add_jobs(design, "pieces of the search")
    design.add_argument(
        "--case", dest="variant", metavar="N", type=_whole, help="write variant N of finished results as a case file"
    )
    _add_overwrite(design)
    campaign = command("campaign", "many macro-geometries, each with finite elements of its own")
    campaign.add_argument("campaign_path", metavar="CAMPAIGN", type=_path, help="campaign file (TOML)")
    _add_out(campaign, "--out", "out/<name of the campaign file>")
    _add_jobs(campaign, "designs")
    campaign.add_argument(
        "--dask", metavar="ADDRESS", help="scheduler of a Dask cluster whose workers solve the designs instead"
    )
    campaign.add_argument(
        "--case", dest="case_number", metavar="N", type=_positive,
        help="write the case file of design N, into the current folder or that of --out, and solve nothing",
    )  # fmt: skip
    _add_overwrite(campaign)

    bench = command("bench", "run time by phase and by size")
    _add_case(bench)
    bench.add_argument(
        "--json", dest="json_path", metavar="FILE", type=_path, required=True,
        help="file to write; one that is there is compared with first",
    )  # fmt: skip
    bench.add_argument(
        "--jobs", metavar="N", type=_positive, default=2, help="threads of the parallel sweep (default: 2)"
    )
    _add_overwrite(bench)

    export = command("export", "a basis, a gearbox or results in the formats of other programs")
    export.add_argument("source", metavar="FILE", type=_path, help="a basis, or a REXS file for --to case")
    export.add_argument("--to", choices=("case", "csv", "fmu", "rexs", "vtkhdf"), required=True, help="format to write")
    export.add_argument(
        "-o", dest="target", metavar="PATH", type=_path,
        help="file to write, or folder for tables (default: named after FILE, in the current folder)",
    )  # fmt: skip
    export.add_argument("--stage", metavar="ID", type=_positive, help="stage of a REXS file that has several")
    export.add_argument(
        "--torque", dest="torque_Nm", metavar="N_M", type=_positive_number,
        help="torque on the pinion up to which the force law of an FMU reaches (default: twice that of the case)",
    )  # fmt: skip
    _add_overwrite(export)

    info = command("info", "what is in an HDF5 file")
    info.add_argument(
        "path", metavar="FILE.h5", type=_path, help="a basis or another HDF5 file of pmor; or the folder of a campaign"
    )
    info.add_argument("--verify", action="store_true", help="hold a basis against full FE of its case: seconds")
    return parser


def _add_case(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("case_path", metavar="CASE", type=_path, help="case file (TOML)")


def _add_out(parser: argparse.ArgumentParser, flag: str, usual: str = "out/<name of the case>") -> None:
    parser.add_argument(flag, dest="out", metavar="DIR", type=_path, help=f"folder for the results (default: {usual})")


def _add_jobs(parser: argparse.ArgumentParser, what: str = "angles") -> None:
    parser.add_argument("--jobs", metavar="N", type=_positive, default=1, help=f"{what} solved at a time (default: 1)")


def _add_overwrite(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--overwrite", action="store_true", help="replace results that are there, whoever wrote them")


def _ask_for_few_addresses() -> None:
    """Where addresses are limited: one thread, each further one reserves some; and libraries that find none just die.

    Raises
    ------
    OutputError
        When they do not suffice for the libraries alone.
    """
    for limit in memory_limits():
        if limit.of_addresses:
            use_one_thread()  # before anything loads numpy
            if limit.size < FEWEST_ADDRESSES:
                raise OutputError(
                    f"{limit.source} {memory_text(limit.size)} of addresses, and the libraries alone reserve "
                    f"{memory_text(FEWEST_ADDRESSES)}: {limit.remedy}"
                )


@contextmanager
def _spoken_log() -> Iterator[None]:
    """Show on the error stream what the library notes beside its work, from INFO upwards."""
    log, handler = logging.getLogger("pmor"), logging.StreamHandler()
    handler.setFormatter(_Line())
    # matplotlib complains in three lines where a user has no folder for its settings; nothing here depends on them.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    level = log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)


class _Line(logging.Formatter):
    """One line, ``pmor: ...`` or ``pmor: warning: ...``."""

    def format(self, record: logging.LogRecord) -> str:
        # On a terminal a bar may stand half written in the line.
        start = "\r\x1b[K" if sys.stderr.isatty() else ""
        level = "warning: " if record.levelno >= logging.WARNING else ""
        return f"{start}pmor: {level}{_one_line(record.getMessage())}"


def _one_line(text: str) -> str:
    return printable(" ".join(text.splitlines()))


def _path(text: str) -> Path:
    if not text:
        raise argparse.ArgumentTypeError("an empty name: write . for the current folder")
    return Path(text)


def _positive(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least 1")
    return number


def _whole(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least 0")
    return int(text)


def _positive_number(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0.0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number")
    return number


if __name__ == "__main__":
    sys.exit(main())
