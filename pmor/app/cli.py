"""The `pmor` command: arguments in, exit code out.

Exit codes: 0 done, 2 the engineer can mend it (case file, output folder, arguments), 3 no convergence, 130 interrupted.
"""

import argparse
import errno
import gc
import logging
import signal
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any

from pmor.app import commands
from pmor.app.records import COMMANDS, MOVED, Command
from pmor.app.streams import usable_streams
from pmor.core.errors import OutputError, PmorError, printable
from pmor.core.memory import keep_freed_memory, memory_limits, memory_text
from pmor.core.threads import use_one_thread
from pmor.core.version import __version__
from pmor.core.wording import did_you_mean, in_command

INTERRUPTED = 130
LAB = "lab"
# Results have messages of their own (pmor.storage.atomic); this is for the files that libraries write.
# Measured: numpy, scipy, numba and h5py with one thread take 480 MiB before anything is solved.
FEWEST_ADDRESSES = 520 * 2**20
OUT_OF_SPACE = (errno.ENOSPC, errno.EDQUOT)
RESUME_HINT = "the same command with --resume goes on where it stopped"
PIECES_HINT = "finished pieces are kept; the same command goes on where it stopped"
SMALLER = "lower the elements, the angles or the torques of the case"
USUAL_HINT = "no file was left half written; the same command starts again, with the bodies that are solved"


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
        name = arguments.pop("command")
        return _run(arguments.pop("experiment") if name == LAB else name, arguments)


def _run(name: str, arguments: dict[str, Any]) -> int:
    try:
        use_one_thread()  # before anything loads numpy
        keep_freed_memory()
        _refuse_few_addresses()
        getattr(commands, name, partial(commands.answer, name))(**arguments)
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
        print(f"{start}pmor: interrupted: {_hint(name)}", file=sys.stderr)
        return INTERRUPTED
    return 0


def _hint(name: str) -> str:
    """How an interrupted command goes on: all questions but `run` keep finished pieces."""
    if name == "offline":
        return RESUME_HINT
    return PIECES_HINT if COMMANDS[name].answers and name not in ("run", "bench") else USUAL_HINT


def _refuse_unknown(argv: Sequence[str]) -> None:
    """Exit with 2 where the first word is no command, with the one that is meant."""
    known = [LAB, *(name for name, command in COMMANDS.items() if not command.lab)]
    if not argv or argv[0].startswith("-") or argv[0] in known:
        return
    if argv[0] in MOVED:
        rule = f"is no command any more: write {MOVED[argv[0]]}"
    else:
        rule = "is no command: to run a file, write pmor run FILE" if Path(argv[0]).suffix else "is no command"
        rule += f": {did_you_mean(argv[0], [*known, *MOVED])}"
    print(f"pmor: error: {printable(argv[0])} {rule}", file=sys.stderr)
    raise SystemExit(PmorError.exit_code)


@cache
def build_parser() -> argparse.ArgumentParser:
    """Build the parser; the names of the arguments are those of the functions in `pmor.app.commands`."""
    parser = argparse.ArgumentParser(prog="pmor", description="Static transmission error of gears: full FE once, "
                                     "then a reduced model or exact line loads.")  # fmt: skip
    parser.add_argument("--version", action="version", version=f"pmor {__version__}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, command in COMMANDS.items():
        if not command.lab:
            _add(subparsers, name, command)
    words = "experiments on the program"
    lab = subparsers.add_parser(LAB, help=words, description=words[0].upper() + words[1:] + ".")
    experiments = lab.add_subparsers(dest="experiment", metavar="EXPERIMENT", required=True)
    for name, command in COMMANDS.items():
        if command.lab:
            _add(experiments, name, command)
    return parser


def _add(subparsers: Any, name: str, command: Command) -> None:
    words = command.words.replace("`", "").replace("%", "%%")
    parser = subparsers.add_parser(name, help=words, description=words[0].upper() + words[1:] + ".")
    for flags, settings in command.options:
        parser.add_argument(*flags, **settings)


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
