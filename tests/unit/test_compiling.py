"""numba's cache must notice an edit in any file of the kernels, not only in the one of the function itself."""

import importlib
import os
import pkgutil
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core import event

import pmor
import pmor.penalty.kernels
from pmor.core import keeping
from pmor.core.compiling import compiled, sources_stamp
from pmor.gear.kernels.motion import roll_angle
from pmor.penalty.kernels.windows import relative_radius

CHECKOUT = Path(pmor.__file__).parents[1]
# `relative_radius` stands on `roll_angle` in another file, and that on the constant it is given here in a third one.
CALL = """
import numpy as np
from pmor.penalty.kernels.windows import relative_radius
from pmor.gear.kernels.types import Gear, Kinematics
def filled(kind, **known):
    return kind(*[known.get(name, kind._field_defaults.get(name, 0.0)) for name in kind._fields])
gear = filled(
    Gear, nodes=np.zeros((2, 2, 3)), roll=np.zeros(2), extents=np.zeros((2, 2, 4)), base_radius=40.0, form_roll=0.1,
    tip_roll=0.6, line_constant=np.zeros(0), edge_radius=0.0,
)
pair = filled(Kinematics, action_length=30.0, pressure_angle=0.35, centre_distance=84.0, pitch=0.3, least_radius=0.4)
print(relative_radius(pair, (gear, gear), 0.0))
"""


def dispatchers():
    """All compiled functions of the package, by name."""
    found = {}
    for module in pkgutil.iter_modules(pmor.penalty.kernels.__path__):
        path = f"pmor.penalty.kernels.{module.name}"
        for name, value in vars(importlib.import_module(path)).items():
            if hasattr(value, "py_func") and value.py_func.__module__ == path:
                found[f"{module.name}.{name}"] = value
    return found


@pytest.mark.jit
def test_every_dispatcher_is_stamped_with_all_sources_of_the_package():
    stamps = {name: d._cache._cache_file._source_stamp for name, d in dispatchers().items()}
    assert len(stamps) > 50
    assert set(stamps.values()) == {sources_stamp()}, [n for n, stamp in stamps.items() if stamp != sources_stamp()]


@pytest.mark.jit
def test_a_kernel_outside_the_package_is_stamped_with_the_files_of_its_own_folder_too():
    def outside(x):
        return x

    beside = sorted(Path(__file__).parent.glob("*.py"))
    assert compiled(outside)._cache._cache_file._source_stamp == sources_stamp(*beside)


def relative_radius_of(copy):
    """What a fresh process finds with the kernels in a folder and the cache beside them."""
    environment = os.environ | {"PYTHONPATH": str(copy), "NUMBA_CACHE_DIR": str(copy / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", CALL], env=environment, cwd=copy, capture_output=True, text=True, check=True
    )
    return float(done.stdout)


@pytest.fixture
def kernels(tmp_path):
    """A copy of the package that can be edited."""
    folder = tmp_path / "pmor" / "contact" / "kernels"
    shutil.copytree(CHECKOUT / "pmor" / "contact" / "kernels", folder, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(CHECKOUT / "pmor" / "arrays.py", tmp_path / "pmor" / "arrays.py")
    for package in (folder.parent, folder.parents[1]):
        (package / "__init__.py").touch()
    return folder


@pytest.mark.jit
def test_a_cache_of_types_that_are_no_more_is_passed_over(tmp_path, kernels):
    """As after an upgrade: the kept index names a type that stands elsewhere now."""
    before = relative_radius_of(tmp_path)
    types = kernels / "types.py"
    (kernels / "places.py").write_text(types.read_text())
    types.write_text("from pmor.penalty.kernels.places import *\n")
    assert relative_radius_of(tmp_path) == before
    (kernels / "places.py").rename(kernels / "rooms.py")
    types.write_text("from pmor.penalty.kernels.rooms import *\n")
    assert relative_radius_of(tmp_path) == before


@pytest.fixture
def homeless(tmp_path, kernels):
    """Runs a small kernel in a process that can write neither beside it nor to a home; gives its temporary folder."""
    (kernels / "__pycache__").touch()  # not even root can make a folder of it
    (kernels / "small.py").write_text(
        "from pmor.core.compiling import compiled\n\n\n@compiled\ndef twice(x):\n    return 2.0 * x\n"
    )
    temporary = tmp_path / "temporary"
    temporary.mkdir()

    def run():
        nowhere = {"NUMBA_CACHE_DIR": "", "HOME": os.devnull, "XDG_CACHE_HOME": os.devnull, "TMPDIR": str(temporary)}
        code = "from pmor.penalty.kernels.small import twice; print(twice(2.0))"
        done = subprocess.run(
            [sys.executable, "-c", code], env=os.environ | nowhere | {"PYTHONPATH": str(tmp_path)}, cwd=tmp_path,
            capture_output=True, text=True,
        )  # fmt: skip
        assert (done.stdout, done.returncode) == ("4.0\n", 0), done.stderr
        return temporary

    return run


@pytest.mark.jit
def test_without_a_home_kernels_are_kept_among_temporary_files_of_this_user_alone(homeless):
    (folder,) = homeless().glob("pmor_kernels_*")
    assert folder.stat().st_mode & 0o777 == 0o700
    assert len(list(folder.rglob("*.nbc"))) == 1


@pytest.mark.jit
def test_what_others_can_write_to_is_not_trusted_with_kernels(tmp_path, homeless):
    folder = tmp_path / "temporary" / f"pmor_kernels_{os.getuid()}"
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
    text = text.replace("import compiled\n", "import compiled\nfrom pmor.penalty.kernels.lowest import base\n", 1)
    motion.write_text(text)
    before, again = relative_radius_of(tmp_path), relative_radius_of(tmp_path)
    assert again == before
    assert list((tmp_path / "cache").rglob("*.nbc")), "nothing was kept: there is nothing to notice"
    lowest = kernels / "lowest.py"
    lowest.write_text(lowest.read_text().replace("x + 0.0", "x + 0.1"))
    assert relative_radius_of(tmp_path) != before
