import errno
import pickle
from pathlib import Path

import pytest

from pmor import __version__
from pmor.app import cli, commands
from pmor.app.cli import build_parser, main
from pmor.core.errors import ConvergenceError, OutputError
from tests.support.small_case import case_text

ROOT = Path(__file__).parents[2]
PAPER = ROOT / "cases" / "paper_spur.toml"


def record(monkeypatch, name):
    calls = []
    monkeypatch.setattr(commands, name, lambda **arguments: calls.append(arguments))
    return calls


@pytest.mark.parametrize(
    ("line", "arguments"),
    [
        ("run c.toml", {"case_path": Path("c.toml"), "out": None, "jobs": 1, "overwrite": False}),
        (
            "run c.toml --out d --jobs 2 --overwrite",
            {"case_path": Path("c.toml"), "out": Path("d"), "jobs": 2, "overwrite": True},
        ),
        ("plan c.toml", {"case_path": Path("c.toml")}),
        (
            "offline c.toml -o b.h5 --resume --jobs 2 --overwrite",
            {
                "case_path": Path("c.toml"),
                "basis_path": Path("b.h5"),
                "resume": True,
                "jobs": 2,
                "overwrite": True,
            },
        ),
        (
            "online b.h5 -o d",
            {"basis_path": Path("b.h5"), "out": Path("d"), "case_path": None, "jobs": 1, "overwrite": False},
        ),
        (
            "online b.h5 --case c.toml --jobs 2",
            {"basis_path": Path("b.h5"), "out": None, "case_path": Path("c.toml"), "jobs": 2, "overwrite": False},
        ),
        (
            "compare c.toml --out d",
            {"case_path": Path("c.toml"), "out": Path("d"), "jobs": 1, "overwrite": False},
        ),
        (
            "export b.h5 --to fmu -o m.fmu --torque 12.5",
            {
                "source": Path("b.h5"),
                "to": "fmu",
                "target": Path("m.fmu"),
                "stage": None,
                "torque_Nm": 12.5,
                "overwrite": False,
            },
        ),
        (
            "export g.rexs --to case --stage 4 --overwrite",
            {"source": Path("g.rexs"), "to": "case", "target": None, "stage": 4, "torque_Nm": None, "overwrite": True},
        ),
        ("info b.h5", {"path": Path("b.h5"), "verify": False}),
        ("info b.h5 --verify", {"path": Path("b.h5"), "verify": True}),
    ],
)
def test_arguments_reach_the_command(line, arguments, monkeypatch):
    calls = record(monkeypatch, line.split()[0])
    assert main(line.split()) == 0
    assert calls == [arguments]


def test_every_command_of_the_parser_has_its_function():
    choices = build_parser()._subparsers._group_actions[0].choices
    assert all(callable(getattr(commands, name)) for name in choices)


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


@pytest.mark.parametrize(
    ("error", "code"),
    [(OutputError("a\nb"), 2), (ConvergenceError("a b", [(1.0, 0.5)]), 3)],
    ids=["output", "diverged"],
)
def test_known_errors_become_one_line_and_a_code(error, code, monkeypatch, capsys):
    def fail(**_arguments):
        raise error

    monkeypatch.setattr(commands, "plan", fail)
    assert main(["plan", "c.toml"]) == code
    assert capsys.readouterr() == ("", "pmor: error: a b\n")


@pytest.mark.parametrize(("line", "hint"), [("offline c.toml -o b.h5", "--resume"), ("run c.toml", "the same command")])
def test_interrupt_says_how_to_go_on(line, hint, monkeypatch, capsys):
    def interrupt(**_arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(commands, line.split()[0], interrupt)
    assert main(line.split()) == cli.INTERRUPTED
    message = capsys.readouterr().err
    assert hint in message
    assert len(message.splitlines()) == 1


def test_what_a_terminal_would_obey_is_escaped(monkeypatch, capsys):
    fail_with(OutputError("x\x1b[31m\u202ey\udcff ä𝒶"), monkeypatch)
    assert main(["plan", "c.toml"]) == 2
    assert capsys.readouterr().err == "pmor: error: x\\x1b[31m\\u202ey\\udcff ä𝒶\n"


def fail_with(error, monkeypatch):
    def fail(**_arguments):
        raise error

    monkeypatch.setattr(commands, "plan", fail)


def test_too_little_memory_is_no_defect(monkeypatch, capsys):
    fail_with(MemoryError("Unable to allocate 3 TiB"), monkeypatch)
    assert main(["plan", "c.toml"]) == 2
    text, errors = capsys.readouterr()
    assert (text, len(errors.splitlines())) == ("", 1)
    assert "does not suffice (Unable to allocate 3 TiB): lower the elements" in errors


def test_a_full_disk_of_compiled_kernels_is_no_defect(monkeypatch, capsys):
    fail_with(OSError(errno.ENOSPC, "No space left on device"), monkeypatch)
    assert main(["plan", "c.toml"]) == 2
    text, errors = capsys.readouterr()
    assert (text, len(errors.splitlines())) == ("", 1)
    assert "no space is left on a disk: free some" in errors
    assert "NUMBA_CACHE_DIR" in errors


def test_other_errors_of_the_system_are_defects(monkeypatch):
    fail_with(OSError(errno.EBADF, "Bad file descriptor"), monkeypatch)
    with pytest.raises(OSError, match="Bad file"):
        main(["plan", "c.toml"])


def test_defects_keep_their_traceback(monkeypatch):
    def fail(**_arguments):
        raise ZeroDivisionError

    monkeypatch.setattr(commands, "plan", fail)
    with pytest.raises(ZeroDivisionError):
        main(["plan", "c.toml"])


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
    assert list(tmp_path.iterdir()) == []


def test_plan_shortens_long_lists_of_torques(capsys, tmp_path):
    case = tmp_path / "many.toml"
    case.write_text(case_text(online={"torques_Nm": [float(torque) for torque in range(1, 161)]}))
    assert main(["plan", str(case)]) == 0
    found = capsys.readouterr().out
    assert "torques_Nm             [1, 2, 3, ..., 160]\n" in found
    assert "160 torques: 1, 2, 3, ..., 160 N m)" in found
    assert max(map(len, found.splitlines())) < 160


def test_plan_of_a_reduction_without_training_has_no_full_solves(capsys, tmp_path):
    case = tmp_path / "static.toml"
    text = PAPER.read_text().replace('scheme = "line"', 'scheme = "direct"')
    case.write_text(text + '\n[reduction]\nshapes = "static_modes"\n')
    assert main(["plan", str(case)]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "offline, full contact solves 0 (static modes are unit forces: nothing is trained)" in lines
    assert "compare, full and reduced 144 (48 angles x 3 torques: 30, 100, 160 N m)" in lines
