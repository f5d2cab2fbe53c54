"""Surroundings of every test: no display, one thread, loud floating-point errors, seeds, kernels compiled once."""

import gc
import os
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from functools import cache

from pmor.core.threads import use_one_thread

# As the command does, and before numpy is loaded. On matrices this small, threads of the linear algebra library that
# wait for each other on busy cores cost up to fifteen times what one thread takes.
use_one_thread()

import matplotlib  # noqa: E402
import numpy as np  # noqa: E402
import pytest  # noqa: E402

matplotlib.use("Agg")

# Underflow to zero is harmless; the others hide mistakes.
np.seterr(divide="raise", over="raise", invalid="raise")


@pytest.hookimpl(trylast=True)
def pytest_configure(config):
    """Compile the kernels that are not kept before the workers of a whole run start: each would take a minute for it.

    A run that fails here is no matter: the tests will say what is wrong.
    """
    whole_run = config.args_source is pytest.Config.ArgsSource.TESTPATHS and not config.option.collectonly
    if not whole_run or hasattr(config, "workerinput") or not config.getoption("numprocesses", None):
        return
    from pmor.core.keeping import is_kept
    from pmor.line.kernels.loads import solve_lines
    from pmor.penalty.kernels.sweep import sweep_reduced
    from tests.support.small_case import case_text

    schemes = [scheme for scheme, last in (("direct", sweep_reduced), ("line", solve_lines)) if not is_kept(last)]
    if not schemes:
        return
    config.get_terminal_writer().line("compiling the kernels, once for all workers")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with tempfile.TemporaryDirectory() as folder, ExitStack() as running:
        for scheme in schemes:
            path = os.path.join(folder, f"{scheme}.toml")
            with open(path, "w") as file:
                file.write(case_text(contact=None, reduction=None, output={"plots": False, "report": False}))
                file.write(f'[contact]\nscheme = "{scheme}"\n')
            command = [sys.executable, "-m", "pmor", "run", path, "--out", os.path.join(folder, scheme)]
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            running.enter_context(subprocess.Popen(command, env=environment, **quiet))


def pytest_collection_finish():
    """What is collected stays until the end, and garbage may wait: looking for it takes one second in forty."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


@pytest.fixture(scope="session", autouse=True)
def gears_once():
    """Equal gears are solved once in a process: half of the time of all tests goes into finite elements."""
    import pmor.body.elastic_gear
    from tests.support.solved_gears import solved_once

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pmor.body.elastic_gear, "elastic_gear", solved_once(pmor.body.elastic_gear.elastic_gear))
        yield


@pytest.fixture
def rng():
    return np.random.default_rng(20160919)


@pytest.fixture
def undrawn(monkeypatch):
    """Pictures are empty where a test looks at what is around them: to draw one takes half a second."""
    monkeypatch.setattr("pmor.report.page.picture_bytes", lambda figure, picture_format: b"")


@pytest.fixture(scope="module")
def few_candidates():
    """A greedy training looks for the worst of a hundred states per dimension: which one it is no matter here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pmor_offline.adaptive.CANDIDATES_PER_DIMENSION", 96)
        yield


@pytest.fixture(scope="module")
def full(case):
    """Full FE of the case of a module."""
    import pmor

    return pmor.full_model(case)


@pytest.fixture(scope="module")
def model(case, full):
    import pmor

    return pmor.train(case, full)


@pytest.fixture(scope="session")
def small_models():
    """Function from the meshed width to the case and full FE of a small spur pair.

    5 x 2 elements per flank, so that rows and columns cannot be mixed up.
    """
    from pmor.pair.model import elastic_model, mesh_model
    from tests.support.small_case import small_case

    @cache
    def model(width):
        case = small_case(width)
        return case, elastic_model(case, mesh_model(case))

    return model


@pytest.fixture(scope="session")
def small_model(small_models):
    """Full FE of the small spur pair, half of its width."""
    return small_models("half")


@pytest.fixture(scope="session")
def small_basis_file(small_models, tmp_path_factory):
    """Function from the meshed width and the keys of [reduction] to a basis file; copy it before changing it."""
    from pmor.work.offline import run_offline
    from tests.support.small_case import small_case

    @cache
    def basis_file(width="half", **reduction):
        path = tmp_path_factory.mktemp("basis") / "small.h5"
        assert run_offline(small_case(width, **reduction), small_models(width)[1], path).failed == ()
        return path

    return basis_file


@pytest.fixture(scope="session")
def small_basis_path(small_basis_file):
    """The basis file of `small_model` with the default shapes."""
    return small_basis_file()


@pytest.fixture(scope="session")
def small_basis(small_basis_path):
    from pmor.storage.basis_file import read_basis

    return read_basis(small_basis_path)
