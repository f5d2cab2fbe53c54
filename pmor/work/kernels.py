"""Kernels compiled by a second process while the first one is at other work: a fresh machine's first run waits less.

Nothing depends on it: the first process compiles the kernels that are missing.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from pmor.case import Case, make_case, other_models
from pmor.core.keeping import is_kept, kernels_folder
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import elastic_model, mesh_model
from pmor.pair.sweep import sweep_ste
from pmor.penalty.kernels.sweep import sweep_reduced
from pmor.penalty.kernels.windows import place_windows
from pmor_offline.train import train
from pmor_online.compare import compare_models
from pmor_online.errors import estimate_errors
from pmor_online.model import reduced_pair
from pmor_online.run import sweep_case

_COMMAND = "import sys; from pmor.work.kernels import compile_kernels; compile_kernels(*sys.argv[1:])"
# Kernels that tell whether those of full FE, and those of trained shapes, were compiled before.
_OF_FULL, _OF_SHAPES = place_windows, sweep_reduced


@contextmanager
def kernels_beside(case: Case) -> Iterator[tuple[Callable[[], object], Callable[[], object]]]:
    """Let a second process compile kernels that a case needs later: those of full FE, and of its further models.

    Yields
    ------
    full, trained : callable
        Return when the kernels of full FE, and those of trained shapes too, are there or their process has ended.
    """
    # Full FE under line contact places its sections by the kernels of the sweep, which this process compiles.
    full = "" if case.contact.scheme == "line" or is_kept(_OF_FULL) else case.contact.scheme
    # The nodal schemes share their kernels.
    trained = next((scheme for scheme, _ in other_models(case) if not is_kept(_OF_SHAPES)), "")
    if kernels_folder() is None or not (full or trained):
        yield (lambda: None), (lambda: None)
        return
    with subprocess.Popen(
        # From the same folders as this process, and not from the one that it happens to be in.
        [sys.executable, "-P", "-c", _COMMAND, full, trained],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
    ) as process:  # fmt: skip
        try:
            assert process.stdout is not None
            yield process.stdout.readline, process.wait
        finally:
            process.kill()


def compile_kernels(full: str, trained: str) -> None:
    """Compile kernels by solving a tiny pair; say on a line when those of full FE are there.

    Parameters
    ----------
    full, trained : str
        Contact schemes of full FE, and of a reduced model that is trained and compared; empty for none.
    """
    if full:
        case = _tiny_case(full)
        model = elastic_model(case, mesh_model(case))
        sweep_ste(model.mesh.meshed, model.elasticity_at, np.array([0.01]), [nominal_condition(case)])
    if trained:
        case = _tiny_case(trained)
        model = elastic_model(case, mesh_model(case))
        reduced = reduced_pair(train(case, model, estimate_errors).basis)
    sys.stdout.write("full FE\n")
    sys.stdout.flush()
    if trained:
        sweep_case(reduced)
        compare_models(reduced, model)


def _tiny_case(scheme: str) -> Case:
    return make_case(
        teeth=21, bore_radius_mm=20.0, module_mm=4.0, face_width_mm=20.0, torque_Nm=100.0, scheme=scheme,
        profile_elements=6, width_elements=1, offline={"angles_per_pitch": 4, "torques_Nm": [100.0]},
        online={"angles_per_pitch": 4, "torques_Nm": [100.0]}, compare={"angles": 1, "torques_Nm": [100.0]},
    )  # fmt: skip
