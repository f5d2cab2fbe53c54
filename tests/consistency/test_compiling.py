"""Kernels: compiled once and kept; pictures of a copy of this process."""

import gc
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from numba import njit, types
from numba.core import event
from numba.core.errors import TypingError

import pmor
from pmor.core import compiling, keeping
from pmor.core.compiling import compiled
from pmor.gear.kernels.motion import roll_angle
from pmor.penalty.kernels.windows import relative_radius
from pmor.work import kernels as beside
from tests.support.small_case import case_with

CHECKOUT = Path(pmor.__file__).parents[1]
# `relative_radius` stands on `roll_angle` in another file, and that on the constant it is given here in a third one.
CALL = """
import numpy as np
from pmor.penalty.kernels.windows import relative_radius
from pmor.gear.kernels.types import Gear, Kinematics
def filled(kind, **known):
    return kind(*[known.get(name, kind._field_defaults.get(name, 0.0)) for name in kind._fields])
gear = filled(
    Gear, nodes=np.zeros((2, 2, 3)), roll=np.zeros(2), base_radius=40.0, form_roll=0.1, tip_roll=0.6,
    edge_radius=0.0, undercut_roll=0.0,
)
pair = filled(Kinematics, action_length=30.0, pressure_angle=0.35, centre_distance=84.0, pitch=0.3)
print(relative_radius(pair, (gear, gear), 0.4, 0.0))
"""


@compiled
def doubled(x):
    return 2.0 * x


@compiled
def doubled_and_one(x):
    return doubled(x) + 1.0


@pytest.mark.jit
def test_every_file_of_kernels_names_the_folder_that_keeps_them():
    """A kernel elsewhere could be edited unnoticed."""
    imports = re.compile(r"^(from pmor\.core\.compiling import|from numba import|import numba)", re.MULTILINE)
    with_kernels = [path for path in (CHECKOUT / "pmor").rglob("*.py") if imports.search(path.read_text())]
    asked = {CHECKOUT / "pmor" / "core" / "keeping.py"}  # where kernels lie is not what they compute
    assert len(with_kernels) > 20
    assert set(with_kernels) - asked <= set(keeping.kernel_sources())
    assert relative_radius.stats.cache_path.startswith(str(keeping.kernels_folder()))


@pytest.mark.jit
def test_what_has_no_module_compiles_too():
    """As what numba makes of a user's own types."""

    def own(x):
        return x

    own.__module__ = None
    assert njit(own)(1) == 1


@pytest.mark.jit
def test_what_a_user_compiles_is_kept_where_numba_keeps_it_anyway(tmp_path, monkeypatch):
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path))

    def own(x):
        return x

    assert str(keeping.kernels_folder()) != str(tmp_path)
    assert not compiled(own).stats.cache_path.startswith(str(tmp_path))
    assert njit(cache=True)(own).stats.cache_path.startswith(str(tmp_path))


@pytest.mark.jit
def test_what_kernels_alone_call_is_linked_into_them_and_has_no_code_for_the_machine():
    assert doubled_and_one(1.0) == 3.0
    doubled.get_call_template((types.float64,), {})  # compiles it where its caller was kept
    (within,) = doubled.get_overload.__self__.overloads.values()
    assert not list(within.library.get_defined_functions())
    assert any(not function.is_declaration for function in within.library._get_module_for_linking().functions)


@pytest.mark.jit
def test_garbage_is_collected_again_after_a_compilation_and_one_that_fails():
    def wrong(x):
        return x.nonsense

    pause = compiling._Uncollected()
    pause.on_start(None)
    pause.on_start(None)  # of a function that it calls
    pause.on_end(None)
    assert not gc.isenabled()
    pause.on_end(None)
    assert gc.isenabled()
    with pytest.raises(TypingError):
        compiled(wrong)(1)
    assert gc.isenabled()


def test_folders_of_earlier_sources_go_but_for_the_last_used_and_nothing_else_does(tmp_path):
    names = [f"pmor_kernels_{number:032x}" for number in range(6)]
    for age, name in enumerate(names):
        (tmp_path / name).mkdir()
        (tmp_path / name / "compiled by pmor").touch()
        os.utime(tmp_path / name / "compiled by pmor", (1e9 - age, 1e9 - age))
    others = ["pmor_kernels_mine", f"pmor_kernels_{9:032x}", "notes"]  # not by us: no number, no marker, neither
    for name in others:
        (tmp_path / name).mkdir()
    new = tmp_path / f"pmor_kernels_{7:032x}"
    assert keeping._usable(new) == new
    assert {path.name for path in tmp_path.iterdir()} == {new.name, *names[:3], *others}
    assert keeping._usable(tmp_path / "notes" / "deep" / new.name) is not None


def relative_radius_of(copy):
    """What a fresh process finds with the kernels in a folder and the cache beside them."""
    environment = os.environ | {"PYTHONPATH": str(copy), "NUMBA_CACHE_DIR": str(copy / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", CALL], env=environment, cwd=copy, capture_output=True, text=True, check=True
    )
    return float(done.stdout)


@pytest.fixture
def kernels(tmp_path):
    """The folder of the gears' kernels in a copy of the package that can be edited."""
    shutil.copytree(CHECKOUT / "pmor", tmp_path / "pmor", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path / "pmor" / "gear" / "kernels"


@pytest.mark.slow
@pytest.mark.jit
def test_a_cache_of_types_that_are_no_more_is_passed_over(tmp_path, kernels):
    """As after an upgrade: the kept index names a type that stands elsewhere now."""
    before = relative_radius_of(tmp_path)
    types = kernels / "types.py"
    (kernels / "places.py").write_text(types.read_text())
    types.write_text("from pmor.gear.kernels.places import *\n")
    assert relative_radius_of(tmp_path) == before
    (kernels / "places.py").rename(kernels / "rooms.py")
    types.write_text("from pmor.gear.kernels.rooms import *\n")
    assert relative_radius_of(tmp_path) == before


@pytest.fixture
def homeless(tmp_path, kernels):
    """Runs a small kernel in a process that can write neither beside it nor to a home; gives its temporary folder."""
    (tmp_path / "pmor" / "__pycache__").touch()  # not even root can make a folder of it
    (kernels / "small.py").write_text(
        "from pmor.core.compiling import compiled\n\n\n@compiled\ndef twice(x):\n    return 2.0 * x\n"
    )
    temporary = tmp_path / "temporary"
    temporary.mkdir()

    def run():
        nowhere = {"NUMBA_CACHE_DIR": "", "HOME": os.devnull, "XDG_CACHE_HOME": os.devnull, "TMPDIR": str(temporary)}
        code = "from pmor.gear.kernels.small import twice; print(twice(2.0))"
        done = subprocess.run(
            [sys.executable, "-c", code], env=os.environ | nowhere | {"PYTHONPATH": str(tmp_path)}, cwd=tmp_path,
            capture_output=True, text=True,
        )  # fmt: skip
        assert (done.stdout, done.returncode) == ("4.0\n", 0), done.stderr
        return temporary

    return run


@pytest.mark.jit
def test_without_a_home_kernels_are_kept_among_temporary_files_of_this_user_alone(homeless):
    (folder,) = homeless().glob("pmor_*")
    assert folder.stat().st_mode & 0o777 == 0o700
    assert len(list(folder.rglob("*.nbc"))) == 1


@pytest.mark.jit
def test_what_others_can_write_to_is_not_trusted_with_kernels(tmp_path, homeless):
    folder = tmp_path / "temporary" / f"pmor_{os.getuid()}"
    folder.mkdir()
    folder.chmod(0o777)
    homeless()
    assert not list(folder.iterdir()), "compiled, and not kept"


@pytest.mark.jit
def test_compilation_is_announced_once_with_how_long_it_takes(caplog, monkeypatch):
    monkeypatch.setattr(keeping, "_PAUSE_S", 1e9)
    ends = keeping._Announcement()
    for kernel in (relative_radius, roll_angle):
        compilation = event.Event("numba:compile", event.EventStatus.START, {"dispatcher": kernel})
        with caplog.at_level("INFO", "pmor.kernels"):
            ends.on_start(compilation)
            ends.on_start(compilation)  # of a function that it calls
            ends.on_end(compilation)
            ends.on_end(compilation)
    assert caplog.messages == [
        "compiling the kernels of contact, once after each installation: up to two minutes in all"
    ]


@pytest.mark.slow
@pytest.mark.jit
def test_an_edit_two_files_down_is_noticed(tmp_path, kernels):
    # A file below the one below that of the function that is called.
    (kernels / "lowest.py").write_text(
        "from pmor.core.compiling import compiled\n\n\n@compiled\ndef base(x):\n    return x + 0.0\n"
    )
    motion = kernels / "motion.py"
    text = motion.read_text()
    assert "pinion = roll_position + " in text
    text = text.replace("pinion = roll_position + ", "pinion = base(roll_position) + ")
    text = text.replace("import compiled\n", "import compiled\nfrom pmor.gear.kernels.lowest import base\n", 1)
    motion.write_text(text)
    before, again = relative_radius_of(tmp_path), relative_radius_of(tmp_path)
    assert again == before
    assert list((tmp_path / "cache").rglob("*.nbc")), "nothing was kept: there is nothing to notice"
    lowest = kernels / "lowest.py"
    lowest.write_text(lowest.read_text().replace("x + 0.0", "x + 0.1"))
    assert relative_radius_of(tmp_path) != before


@pytest.mark.slow
def test_what_the_second_process_does_works_for_full_fe_and_for_trained_shapes(monkeypatch):
    monkeypatch.setattr(beside, "is_kept", lambda _kernel: False)
    monkeypatch.setattr(beside, "kernels_folder", Path)
    monkeypatch.setattr(beside, "other_models", lambda _case: [("direct", None)])
    with beside.kernels_beside(case_with(contact={"scheme": "line"})) as (full, trained):
        assert full() == b"full FE\n"  # those of trained shapes are compiled for as long again
        assert trained() == 0


def test_nothing_is_started_where_all_is_compiled(monkeypatch):
    monkeypatch.setattr(beside, "is_kept", lambda _kernel: True)
    monkeypatch.setattr(beside.subprocess, "Popen", None)
    with beside.kernels_beside(case_with()) as (full, trained):
        assert full() is trained() is None


def test_a_second_process_that_fails_is_waited_for_and_no_matter(monkeypatch):
    monkeypatch.setattr(beside, "is_kept", lambda _kernel: False)
    monkeypatch.setattr(beside, "kernels_folder", Path)
    monkeypatch.setattr(beside, "_COMMAND", "raise SystemExit(3)")
    with beside.kernels_beside(case_with()) as (full, trained):
        assert full() == b""
        assert trained() == 3


CODE = """
import os
from pmor.report import drawing
from pmor.report.page import Picture
from pmor.report.style import new_figure, plot_style

def pictures():
    for n in range(3):
        with plot_style():
            figure = new_figure(3.0, 2.0)
            figure.add_subplot().plot([0.0, 1.0], [0.0, n])
        yield Picture(f"{n}.png", "words", figure)

here = os.getpid()
class Fails(Picture):
    def content(self, picture_format):
        if os.getpid() != here:
            raise MemoryError
        return super().content(picture_format)

formats = ("png", "svg")
drawing.copies = lambda: 0
alone = list(pictures()); drawing.draw(alone, formats)
drawing.copies = lambda: 2
content, seen = drawing.Picture.content, []
shared = list(pictures())
drawing.Picture.content = lambda self, kind: seen.append(kind not in self.drawn) or content(self, kind)
drawing.draw(shared, formats)
assert sum(seen) == 2, seen  # one of three, in two formats
drawing.Picture.content = content
failed = [Fails(p.file_name, p.caption, p.figure) for p in pictures()]; drawing.draw(failed, formats)
assert [p.drawn for p in alone] == [p.drawn for p in shared] == [p.drawn for p in failed]
assert all(set(p.drawn) == set(formats) for p in alone)
"""


@pytest.mark.slow
def test_pictures_of_a_copy_are_the_same_and_this_process_draws_what_a_copy_cannot():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
