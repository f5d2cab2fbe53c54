"""Processes that cannot do their work: told in words."""

import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor

import pytest

import pmor
from pmor.case import parse_case
from tests.support.line_pairs import small_pair
from tests.support.processes import ROOT
from tests.support.small_case import case_text
from tests.support.small_design import CASE, DESIGN


def test_a_script_without_a_guard_is_told_that_its_processes_need_one(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "import math\nfrom pmor.core.threads import in_order, processes\n"
        "with processes(2) as executor:\n    list(in_order(math.sqrt, [4.0], executor))\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120, cwd=ROOT)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("pmor.core.errors.ExternalProgramError: the executor does no more")
    assert '__name__ == "__main__"' in done.stderr.splitlines()[-1]


def small(**sections):
    return parse_case(case_text(**sections), "small", "small")


def by_design(folder, executor):
    (folder / "small.toml").write_text(CASE)
    (folder / "relief.toml").write_text(DESIGN)
    pmor.run_design(folder / "relief.toml", folder / "out", executor=executor)


def by_study(folder, executor):
    pmor.study(ROOT / "cases" / "paper_study.toml", folder / "out", quick=True, executor=executor)


def by_page(folder, executor):
    pmor.ReducedModel(small_pair().basis).report(folder / "out", executor=executor)


def by_comparison(folder, executor):
    pmor.compare(pmor.ReducedModel(small_pair().basis), executor=executor)


FOR_THREADS = {
    "run_case": lambda folder, executor: pmor.run_case(small(), folder / "out", executor=executor),
    "train": lambda folder, executor: pmor.train(small(), executor=executor),
    "train, file": lambda folder, executor: pmor.train(small(), file=folder / "out" / "a.h5", executor=executor),
    "report": by_page,
    "compare": by_comparison,
    "run_design": by_design,
    "study": by_study,
    "reductions": lambda folder, executor: pmor.reductions(small(), folder / "out", executor=executor),
}


@pytest.mark.parametrize("ask", FOR_THREADS.values(), ids=FOR_THREADS)
def test_processes_are_refused_before_anything_is_solved_where_work_is_for_threads(ask, tmp_path, monkeypatch):
    small_pair()
    monkeypatch.setattr("pmor.body.elastic_gear.elastic_gear", lambda *arguments: pytest.fail("solved"))
    with pytest.raises(pmor.CaseError, match="pass a ThreadPoolExecutor"):
        ask(tmp_path, ProcessPoolExecutor(1))
    assert not (tmp_path / "out").exists()
