"""What a case takes of memory is told within a factor, and too little memory ends in one line."""

import dataclasses
import os
import resource
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest

import pmor
import pmor.work.cost
from pmor.case import change_case, load_case, without_models
from pmor.core.memory import MemoryLimit
from pmor.lab.core.stages import measure_stages
from pmor.work.cost import PAIR_BYTES, POSITION_BYTES, RESERVED_BYTES, stages
from tests.support.processes import ROOT
from tests.support.refusals import time_limit

CASES = ROOT / "cases"
MIB = 2**20


def peak_mib():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def paper(**changes):
    return change_case(without_models(load_case(CASES / "paper_spur.toml")), **changes)


@pytest.mark.parametrize(
    ("profile_elements", "command"),
    [
        (16, "run"),
        *(pytest.param(*other, marks=pytest.mark.slow) for other in ((64, "plan"), (16, "plan"), (64, "run"))),
    ],
)
def test_half_the_addresses_end_in_one_line(command, profile_elements, tmp_path):
    """One case gets no memory beside the libraries, the other is refused for its size."""
    case = paper(mesh={"profile_elements": profile_elements, "width_elements": 16, "width": "whole"})
    needed = max(stage.memory for stage in stages(case)) + RESERVED_BYTES
    path = tmp_path / "case.toml"
    path.write_text(pmor.case.text_of(case))
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    line = f'ulimit -v {needed // 2048}; exec "{sys.executable}" -m pmor {command} {path}'
    done = subprocess.run(["bash", "-c", line], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith("pmor: error: ")
    assert len(done.stderr.splitlines()) == 1
    assert [item.name for item in tmp_path.iterdir()] == ["case.toml"]


@pytest.fixture(scope="module")
def case():
    mesh = {"profile_elements": 4, "width_elements": 2, "error_bar": False}
    return paper(mesh=mesh, online={"angles_per_pitch": 8}, output={"plots": False, "report": False})


# Some 10 GiB each, of angles, torques, assemblies, or all of them.
LARGE = {
    "a fine sweep": lambda model, full: model.sweep(np.linspace(10.0, 160.0, 50), 10**6),
    "many torques": lambda model, full: model.sweep(np.linspace(10.0, 160.0, 10**6), 50),
    "given angles": lambda model, full: model.sweep(np.linspace(10.0, 160.0, 100), np.linspace(0.0, 0.3, 500_000)),
    "full FE": lambda model, full: full.sweep(np.linspace(10.0, 160.0, 20), 10**6),
    "many assemblies": lambda model, full: model.sweep_conditions(
        [pmor.Assembly()] * 5000, np.linspace(10.0, 160.0, 100), 200
    ),
    "stresses": lambda model, full: model.root_stress(np.linspace(10.0, 160.0, 100), 50_000),
    "a fine Harris map": lambda model, full: model.harris_map(np.linspace(10.0, 160.0, 1000), 50_000),
    "a design": lambda model, full: model.design(
        variables=[{"key": "helix_crowning_um", "range": [0.0, 9.0]}], search={"angles": 400},
        load={"torques_Nm": np.linspace(10.0, 160.0, 200_000)},
    ),
    "a case": lambda model, full: pmor.plan(
        pmor.change_case(model.case, online={"pitches": 100_000, "torques_Nm": [100.0, *range(1, 80)]})
    ),
    "a loaded model": lambda model, full: dataclasses.replace(
        model, basis=dataclasses.replace(model.basis, case=pmor.change_case(
            model.case, online={"pitches": 100_000, "torques_Nm": [100.0, *range(1, 80)]}
        ))
    ).report("out", compare=False),
}  # fmt: skip


@pytest.mark.parametrize("call", LARGE.values(), ids=LARGE)
def test_results_that_do_not_fit_into_memory_are_refused_before_they_are_solved(
    call, model, full, monkeypatch, tmp_path
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pmor.work.cost, "memory_limits", lambda: [MemoryLimit(4 * 2**30, "a test allows", "raise it")])
    before = peak_mib()
    with time_limit(), pytest.raises(pmor.CaseError, match=r"takes about .* GiB of memory, and a test allows 4 GiB: "):
        call(model, full)
    assert list(tmp_path.iterdir()) == []
    assert peak_mib() < before + 1024.0


def test_a_long_sweep_keeps_results_alone(model, monkeypatch):
    """Forces of all sections in all states would be four times as much; blocks and whole have the same numbers."""
    torques = np.linspace(10.0, 160.0, 60)
    monkeypatch.setattr("pmor_online.readings.MOST_KEPT", 0)
    model.sweep(torques[:1], 2, pinion=pmor.Modification(helix_crowning_um=3.0))  # compiles what is not yet
    tracemalloc.start()
    swept = model.sweep(torques, 2000, pinion=pmor.Modification(helix_crowning_um=3.0))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    meshed = model.reduced.meshed
    assert peak < 1.2 * swept.ste_um.size * (POSITION_BYTES + PAIR_BYTES * meshed.tooth_pair_count)
    part = model.sweep(torques[7:9], swept.phi_rad[77:79], pinion=pmor.Modification(helix_crowning_um=3.0))
    np.testing.assert_array_equal(part.ste_um, swept.ste_um[7:9, 77:79])


FACTOR = 2.0
SIZES = {
    "small": {"mesh": {"profile_elements": 6, "width_elements": 2}},
    "paper": {},
    "whole width": {"mesh": {"width": "whole"}},
    "fine": {
        "mesh": {"profile_elements": 32, "width_elements": 12, "width": "whole", "element": "hex8i"},
        "compare": {"angles": 10},
    },
    "unequal": {
        "pinion": {"teeth": 30, "bore_radius_mm": 30.0}, "wheel": {"teeth": 80, "bore_radius_mm": 40.0},
        "mesh": {"width": "whole"},
    },
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", SIZES)
def test_memory_is_within_a_factor_of_two_of_what_was_told(name, capsys):
    """Times are told, not judged: `pytest -n 0 -m slow tests/robustness/test_little_memory.py`."""
    case = paper(**SIZES[name])
    measured, estimated = measure_stages(case), {stage.name: stage for stage in stages(case)}
    with capsys.disabled():
        for stage, found in measured.items():
            told = estimated[stage]
            print(
                f"\n{name:12} {stage:16} {told.memory / MIB:6.0f} MiB told {found['peak_mib']:6.0f} found  "
                f"{told.seconds:7.2f} s told {found['seconds']:7.2f} found",
                end="",
            )
    for stage, found in measured.items():
        assert 1 / FACTOR < estimated[stage].memory / MIB / found["peak_mib"] < FACTOR, stage
