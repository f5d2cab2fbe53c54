import errno
import pickle
import warnings
from functools import partial
from pathlib import Path
from unittest.mock import create_autospec

import pytest

from pmor import __version__
from pmor.app import cli, commands
from pmor.app.cli import main
from pmor.app.records import COMMANDS, usage
from pmor.core.errors import ConvergenceError, OutputError
from tests.support.processes import ROOT
from tests.support.refusals import refused
from tests.support.small_case import case_text

PAPER = ROOT / "cases" / "paper_spur.toml"


# What follows when a line does not say it.
RUN = {"file_path": Path("c.toml"), "out": None, "jobs": None, "overwrite": False}
COMPARE = {"case_path": Path("c.toml"), "jobs": 1, "out": None, "overwrite": False}
ONLINE = {"basis_path": Path("b.h5"), "out": None, "case_path": None, "jobs": 1, "overwrite": False}
EXPORT = {"target": None, "stage": None, "torque_Nm": None, "overwrite": False}


@pytest.mark.parametrize(
    ("line", "arguments"),
    [
        ("run c.toml", RUN),
        ("run c.toml --out d --jobs 2 --overwrite", RUN | {"out": Path("d"), "jobs": 2, "overwrite": True}),
        ("plan c.toml", {"file_path": Path("c.toml")}),
        (
            "offline c.toml -o b.h5 --resume --jobs 2 --overwrite",
            {"case_path": Path("c.toml"), "basis_path": Path("b.h5"), "resume": True, "jobs": 2, "overwrite": True},
        ),
        ("online b.h5 -o d", ONLINE | {"out": Path("d")}),
        ("online b.h5 --case c.toml --jobs 2", ONLINE | {"case_path": Path("c.toml"), "jobs": 2}),
        ("compare c.toml --out d", COMPARE | {"out": Path("d")}),
        (
            "export b.h5 --to fmu -o m.fmu --torque 12.5",
            EXPORT | {"source": Path("b.h5"), "to": "fmu", "target": Path("m.fmu"), "torque_Nm": 12.5},
        ),
        (
            "export g.rexs --to case --stage 4 --overwrite",
            EXPORT | {"source": Path("g.rexs"), "to": "case", "stage": 4, "overwrite": True},
        ),
        ("info b.h5", {"path": Path("b.h5"), "verify": False}),
        ("info b.h5 --verify", {"path": Path("b.h5"), "verify": True}),
    ],
)
def test_arguments_reach_the_command(line, arguments, monkeypatch):
    calls = []
    monkeypatch.setattr(commands, line.split()[0], lambda **given: calls.append(given))
    assert main(line.split()) == 0
    assert calls == [arguments]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_answered(name, monkeypatch):
    """By a function of its own, or as a question: the arguments of its parser are those of the function."""
    calls, arguments = [], usage(name).partition(" [")[0].replace("FORMAT", "csv").replace("KIND", "pair").split()[1:]
    function = getattr(commands, name, partial(commands.answer, name))
    spec = create_autospec(function)
    spec.side_effect = lambda *given, **named: calls.append(named)
    monkeypatch.setattr(commands, name, spec, raising=False)
    assert main(arguments) == 0
    assert len(calls) == 1


@pytest.mark.parametrize(
    ("old", "now"), [("set s.toml", "pmor run"), ("gearbox g.toml", "pmor run"), ("study s.toml", "pmor lab study")]
)
def test_a_command_of_old_names_its_place(old, now, capsys):
    with pytest.raises(SystemExit) as caught:
        main(old.split())
    assert caught.value.code == 2
    assert capsys.readouterr().err == f"pmor: error: {old.split()[0]} is no command any more: write {now}\n"


@pytest.mark.parametrize("line", ["", "unknown", "run", "run c.toml --jobs 0", "run c.toml --jobs x", "offline c.toml"])
def test_wrong_usage_exits_with_2(line, capsys):
    with pytest.raises(SystemExit) as caught:
        main(line.split())
    assert caught.value.code == 2
    assert "error:" in capsys.readouterr().err


def test_version(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out == f"pmor {__version__}\n"


def fail_with(error, monkeypatch, name="plan"):
    def fail(**_arguments):
        raise error

    monkeypatch.setattr(commands, name, fail)


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (OutputError("a\nb"), 2, "a b"),
        (ConvergenceError("a b", [(1.0, 0.5)]), 3, "a b"),
        (OutputError("x\x1b[31m\u202ey\udcff ä𝒶"), 2, "x\\x1b[31m\\u202ey\\udcff ä𝒶"),
    ],
    ids=["output", "diverged", "what a terminal would obey"],
)
def test_known_errors_become_one_line_and_a_code(error, code, line, monkeypatch, capsys):
    fail_with(error, monkeypatch)
    assert main(["plan", "c.toml"]) == code
    assert capsys.readouterr() == ("", f"pmor: error: {line}\n")


@pytest.mark.parametrize(("line", "hint"), [("offline c.toml -o b.h5", "--resume"), ("run c.toml", "the same command")])
def test_interrupt_says_how_to_go_on(line, hint, monkeypatch, capsys):
    fail_with(KeyboardInterrupt(), monkeypatch, line.split()[0])
    assert main(line.split()) == cli.INTERRUPTED
    message = capsys.readouterr().err
    assert hint in message
    assert len(message.splitlines()) == 1


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError("Unable to allocate 3 TiB"), ["does not suffice (Unable to allocate 3 TiB): lower the elements"]),
        # Of compiled kernels.
        (
            OSError(errno.ENOSPC, "No space left on device"),
            ["no space is left on a disk: free some", "NUMBA_CACHE_DIR"],
        ),
    ],
)
def test_too_little_memory_and_a_full_disk_are_no_defects(error, words, monkeypatch):
    fail_with(error, monkeypatch)
    refused("plan", "c.toml", words=words)


@pytest.mark.parametrize("error", [OSError(errno.EBADF, "Bad file descriptor"), ZeroDivisionError()])
def test_defects_keep_their_traceback(error, monkeypatch):
    fail_with(error, monkeypatch)
    with pytest.raises(type(error)):
        main(["plan", "c.toml"])


def test_warnings_of_libraries_do_not_reach_the_error_stream(monkeypatch, capsys):
    def warns(**options):
        warnings.warn("invalid value encountered in divide", RuntimeWarning, stacklevel=1)

    monkeypatch.setattr(commands, "info", warns)
    before = warnings.showwarning
    with warnings.catch_warnings():
        warnings.simplefilter("always")  # errors in the tests
        assert main(["info", "basis.h5"]) == 0
    assert capsys.readouterr().err == ""
    assert warnings.showwarning is before


def test_convergence_error_survives_the_way_between_processes():
    error = pickle.loads(pickle.dumps(ConvergenceError("no equilibrium", iter([(1.0, 2.0)]))))
    assert str(error) == "no equilibrium"
    assert error.history == [(1.0, 2.0)]


def test_plan_shows_settings_defaults_sizes_and_work(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["plan", str(PAPER)]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "module_mm 4.0" in lines
    assert "centre_distance_mm without backlash *" in lines
    assert "plots true *" in lines
    assert "flank nodes per tooth 85 (17 over the profile x 5 over half the width)" in lines
    assert "sections over half the width 5 (a line load each, on exact flanks)" in lines
    assert "offline, full contact solves 0 (line loads are exact: nothing is trained)" in lines
    assert "compare, full and reduced 144 (48 angles x 3 torques: 30, 100, 160 N m)" in lines
    assert list(tmp_path.iterdir()) == []


def test_plan_shortens_long_lists_of_torques(capsys, tmp_path):
    case = tmp_path / "many.toml"
    case.write_text(case_text(online={"torques_Nm": [float(torque) for torque in range(1, 161)]}))
    assert main(["plan", str(case)]) == 0
    found = capsys.readouterr().out
    assert "torques_Nm             [1, 2, 3, ..., 160]\n" in found
    assert "160 torques: 1, 2, 3, ..., 160 N m)" in found
    assert max(map(len, found.splitlines())) < 160
