"""Random case files: a result or one clear line, never a traceback, a hang or NaN.

pytest -s tests/robustness/test_random_cases.py                             # 80, to the mesh
pytest -s -m slow tests/robustness/test_random_cases.py -k ten_thousand     # 10,000, to the mesh
pytest -s -m slow tests/robustness/test_random_cases.py -k whole            # hundreds, offline and online
"""

import json
import math
import shutil
from collections import Counter

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from pmor.case import load_case
from pmor.core.errors import PmorError
from pmor.fe.outline import tooth_outline
from pmor.pair.model import mesh_model
from tests.support.random_cases import case_bytes, sound_documents, text_of
from tests.support.refusals import check_message, check_one_line, command, refused, time_limit

TO_MESH, TO_RESULT = 60, 300  # s, of one case
NUMBERS = ("ste_mean_um", "ste_peak_to_peak_um", "rom_vs_full_ste_max_rel", "rom_vs_full_ste_rms_rel")


def examples(count):
    """Hypothesis without its database: the same examples in every run, and all of them."""
    return settings(max_examples=count, deadline=None, database=None, derandomize=True,
                    suppress_health_check=list(HealthCheck), phases=[Phase.explicit, Phase.generate])  # fmt: skip


def crosses_itself(points):
    """Whether an open polygon has two edges that cross, by trying all pairs."""
    a, b = points[:-1], points[1:]

    def side(p, q, r):
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])

    first, second = np.triu_indices(len(a), k=2)
    straddles = side(a[first], b[first], a[second]) * side(a[first], b[first], b[second]) < 0.0
    straddled = side(a[second], b[second], a[first]) * side(a[second], b[second], b[first]) < 0.0
    return bool(np.any(straddles & straddled))


def test_a_polygon_that_crosses_itself_is_noticed():
    assert crosses_itself(np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]))
    assert not crosses_itself(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]))


def plan_and_mesh(data, path):
    """Run a case file up to the mesh: how it ended."""
    path.write_bytes(data)
    with time_limit(TO_MESH):
        code, text, errors = command("plan", path)
        if code != 0:
            assert (code, text) == (2, "")
            check_one_line(errors)
        assert "nan" not in text.lower().replace(path.stem, "")
        try:
            case = load_case(path)
        except PmorError:
            return "refused by the case rules"
        try:
            mesh = mesh_model(case)
        except PmorError as error:
            check_message(error)
            return f"refused as {type(error).__name__}"
    assert code == 0, "a plan for what can be meshed"
    pair = mesh.meshed.pair
    for sector, tooth in ((mesh.pinion, pair.pinion), (mesh.wheel, pair.wheel)):
        assert np.isfinite(sector.nodes).all()
        outline = tooth_outline(tooth, case.mesh.profile_elements, case.mesh.spacing)
        half = np.concatenate([outline.lower_fillet[:-1], outline.upper_fillet[:-1], outline.flank])
        assert not crosses_itself(np.concatenate([half, (half * np.array([-1.0, 1.0]))[::-1]]))
    assert 0.0 < mesh.quality.min_scaled_jacobian <= 1.0 + 1e-12
    assert math.isfinite(mesh.quality.max_aspect_ratio)
    assert 1.0 <= pair.contact_ratio < 10.0
    return "meshed"


def run_examples(count, strategy, ended):
    """Feed examples to `ended` until there are `count` of them: tally of how they ended."""
    tally = Counter()

    @examples(count)
    @given(strategy)
    def feed(example):
        tally[ended(example)] += 1

    feed()
    print(f"\n{sum(tally.values())} random case files: {dict(tally.most_common())}")
    return tally


def test_case_files_give_a_mesh_or_one_line(tmp_path):
    tally = run_examples(30, case_bytes(), lambda data: plan_and_mesh(data, tmp_path / "random.toml"))
    # That the examples reach both: the more keys a case has, the more are stopped by one that is wrong.
    assert tally["meshed"] > 0
    assert tally["refused by the case rules"] > 7


@pytest.mark.slow
def test_ten_thousand_case_files_give_a_mesh_or_one_line(tmp_path):
    tally = run_examples(10_500, case_bytes(), lambda data: plan_and_mesh(data, tmp_path / "random.toml"))
    assert sum(tally.values()) >= 10_000
    assert tally["meshed"] > 1000
    assert tally["refused as GeometryError"] > 5


@examples(50)
@given(st.binary(max_size=60))
def test_any_bytes_at_all_are_refused_in_one_line(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "bytes.toml"
    path.write_bytes(data)
    refused("plan", path)


def run_whole(document, folder):
    """Run a case from mesh to summary: how it ended."""
    folder.mkdir()
    path = folder / "random.toml"
    path.write_text(text_of([*document, ("output", [("plots", False), ("report", False)])]), encoding="utf-8")
    try:
        with time_limit(TO_RESULT):
            code, text, errors = command("run", path, "--out", folder / "out")
        if code == 0:
            found = json.loads((folder / "out" / "summary.json").read_text())
            assert all(math.isfinite(found[key]) for key in NUMBERS), found
            assert "nan" not in text.lower()
            return "result"
        check_one_line(errors)
        assert code in (2, 3)
        return "no convergence, named" if code == 3 else "refused"
    finally:
        shutil.rmtree(folder)


@pytest.mark.slow
@pytest.mark.jit
def test_hundreds_of_whole_runs_give_a_result_or_one_line(tmp_path):
    tally = run_examples(300, sound_documents(), lambda document: run_whole(document, tmp_path / "case"))
    assert tally["result"] > 100
