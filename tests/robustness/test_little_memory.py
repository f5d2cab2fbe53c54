"""What a case takes of memory is told within a factor, and too little memory ends in one line."""

import os
import subprocess
import sys

import pytest

import pmor.work.cost
from pmor.case import change_case, load_case, without_models
from pmor.lab.core.stages import measure_stages
from pmor.work.cost import RESERVED_BYTES, stages
from tests.support.processes import ROOT

CASES = ROOT / "cases"
MIB = 2**20


def paper(**changes):
    return change_case(without_models(load_case(CASES / "paper_spur.toml")), **changes)


@pytest.mark.parametrize("command", ["plan", "run"])
@pytest.mark.parametrize("profile_elements", [16, 64])
def test_half_the_addresses_end_in_one_line(command, profile_elements, tmp_path):
    """Of a case that the libraries alone would not leave any to, and of one that is refused for its size."""
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
