"""A command does its work whatever its streams are: closed, read by nobody, of few letters, full."""

import io
import os
import subprocess
import sys

import pytest

from pmor.app import commands
from pmor.app.cli import main
from pmor.app.streams import usable_streams
from tests.support.processes import ROOT

MANY = 100_000  # more than a pipe holds


@pytest.fixture
def pipe(monkeypatch):
    """Makes the output a pipe with an encoding, called in the test; gives a function that reads what has arrived."""
    opened = []

    def make(encoding="utf-8"):
        reader, writer = os.pipe()
        stream = open(writer, "w", encoding=encoding, errors="strict")
        opened.extend([open(reader, "rb", buffering=0), stream])
        monkeypatch.setattr(sys, "stdout", stream)
        return opened[0]

    yield make
    for stream in opened:
        stream.close()


def shell(line, **environment):
    """Run a line of shell with `pmor` standing for the command."""
    command = f'"{sys.executable}" -m pmor'
    return subprocess.run(
        ["bash", "-c", line.replace("pmor", command, 1)], cwd=ROOT, env=os.environ | environment,
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip


def test_a_reader_that_leaves_does_not_stop_the_work(pipe, monkeypatch):
    done = []

    def talkative(**_arguments):
        for _ in range(MANY):
            print("words", flush=True)
        done.append(True)

    monkeypatch.setattr(commands, "study", talkative)
    pipe().close()
    assert main(["lab", "study", "c.toml"]) == 0
    assert done == [True]


@pytest.mark.slow
def test_plan_into_head_leaves_no_traceback():
    done = shell("pmor plan cases/small_spur.toml | head -1; exit ${PIPESTATUS[0]}")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("Case small_spur")


@pytest.mark.parametrize("closed", [pytest.param("2>&-", marks=pytest.mark.slow), "<&- 2>&-"])
def test_an_error_is_said_on_the_output_when_the_error_stream_is_closed(closed):
    done = shell(f"pmor plan missing.toml {closed}")
    assert done.returncode == 2
    assert done.stdout.startswith("pmor: error: missing.toml: there is no such case file")


@pytest.mark.slow
def test_a_closed_output_leaves_exit_code_and_error():
    done = shell("pmor plan missing.toml >&-")
    assert done.returncode == 2
    assert done.stderr.startswith("pmor: error: missing.toml")
    assert shell("pmor --help >&- 2>&-").returncode == 0


def test_no_result_file_takes_the_place_of_a_closed_stream(tmp_path):
    code = (
        "import sys; from pmor.app.streams import usable_streams\n"
        "with usable_streams(), open(sys.argv[1], 'w') as file: sys.exit(file.fileno())"
    )
    line = f'"{sys.executable}" -c "{code}" {tmp_path / "result"} <&- >&- 2>&-'
    assert subprocess.run(["bash", "-c", line], cwd=ROOT).returncode > 2
    assert (tmp_path / "result").exists()


def test_letters_that_a_stream_does_not_have_are_escaped(pipe, monkeypatch):
    monkeypatch.setattr(commands, "plan", lambda **_arguments: print("Ω-Ritzel \udcff"))
    received = pipe("ascii")
    assert main(["plan", "c.toml"]) == 0
    assert received.read(100) == b"\\u03a9-Ritzel \\udcff\n"


@pytest.mark.slow
def test_a_greek_title_is_told_in_the_c_locale(tmp_path):
    case = tmp_path / "greek.toml"
    text = (ROOT / "cases" / "small_spur.toml").read_text(encoding="utf-8")
    case.write_text(text.replace('title = "', 'title = "Ω ', 1), encoding="utf-8")
    done = shell(f"pmor plan {case}", LC_ALL="C", PYTHONUTF8="0", PYTHONCOERCECLOCALE="0", PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("Case greek: \\u03a9 ")


def test_an_output_without_space_is_an_error_of_one_line(monkeypatch, capsys):
    monkeypatch.setattr(commands, "plan", lambda **_arguments: print("words"))
    with open("/dev/full", "w") as full:
        monkeypatch.setattr(sys, "stdout", full)
        assert main(["plan", "c.toml"]) == 2
    errors = capsys.readouterr().err
    assert "no space is left on a disk" in errors
    assert len(errors.splitlines()) == 1


def test_streams_that_are_no_files_are_left_alone(monkeypatch):
    notebook = io.StringIO()
    monkeypatch.setattr(sys, "stdout", notebook)
    with usable_streams():
        print("words")
    assert notebook.getvalue() == "words\n"
    assert sys.stdout is notebook


HELP = "import pmor.app.cli\ntry: pmor.app.cli.main(['--help'])\nexcept SystemExit: pass\n"
HEAVY = {"numpy", "scipy", "numba", "h5py", "matplotlib", "jinja2", "tqdm", "pmor_offline", "pmor_online"}


@pytest.mark.parametrize(("code", "said"), [(HELP, "usage: pmor"), ("import pmor\ndir(pmor)\n", "")])
def test_help_and_the_interface_import_nothing_heavy(code, said):
    code += f"import sys\nprint(sorted({HEAVY!r} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=60, check=True
    )
    assert said in done.stdout
    assert done.stdout.endswith("[]\n")


def test_pictures_need_no_backend_and_no_settings_of_the_user(tmp_path):
    """As in a process that Jupyter started, with a matplotlibrc for talks."""
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\naxes.facecolor: black\nbackend: TkAgg\n")
    code = (
        "from pmor.report.style import data_uri, new_figure, picture_bytes, plot_style\n"
        "with plot_style():\n"
        "    figure = new_figure()\n"
        "    figure.add_subplot().plot([0.0, 1.0], label='words')\n"
        "    figure.legend()\n"
        "picture = data_uri(picture_bytes(figure, 'png'), 'png')\n"
    )
    here: dict[str, str] = {}
    exec(code, here)
    environment = os.environ | {
        "MPLBACKEND": "module://matplotlib_inline.backend_inline", "MATPLOTLIBRC": str(tmp_path),
        "PYTHONPATH": os.pathsep.join(sys.path),
    }  # fmt: skip
    command = [sys.executable, "-c", code + "print(picture)"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == here["picture"]
