"""Models that laboratories keep: shared where cases differ in the contact alone, and never mixed up."""

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from numpy.testing import assert_allclose

from pmor.case import change_case, parse_case
from pmor.gear.condition import at_torques
from pmor.lab.core import models
from pmor.lab.core.models import ModelStore
from pmor.pair.model import elastic_model, mesh_model
from pmor.penalty.solve import solve_position
from tests.support.small_case import case_text, small_case

SAME_MODEL = 1e-12


@pytest.mark.parametrize("first", ["aligned", "tilted"])
def test_axes_that_may_tilt_and_axes_that_do_not_have_models_of_their_own(first):
    """Half of the width is meshed for one, all of it for the other, with the same keys in [mesh]."""
    aligned = small_case()
    cases = {"aligned": aligned, "tilted": change_case(aligned, offline={"in_plane_um": [-10.0, 10.0]})}
    store = ModelStore()
    for name in sorted(cases, key=lambda name: name != first):
        model, _ = store.model(cases[name])
        alone = elastic_model(cases[name], mesh_model(cases[name]))
        phi = model.mesh.meshed.pair.roll_position_range[0]
        advances = [
            solve_position(m.mesh.meshed, phi, at_torques([1e5]), m.elasticity_at).equilibria[0].advance
            for m in (model, alone)
        ]
        assert_allclose(*advances, rtol=SAME_MODEL)


def test_cases_that_differ_in_the_contact_alone_share_a_model_but_line_contact_has_its_own():
    store, case = ModelStore(), parse_case(case_text(), "small", "small case")
    model, seconds = store.model(case)
    other, same_seconds = store.model(change_case(case, penalty_N_mm3=1e5))
    assert other.pinion is model.pinion
    assert other.mesh.meshed.scheme.penalty != model.mesh.meshed.scheme.penalty
    assert same_seconds == seconds
    assert store.model(change_case(case, scheme="line"))[0].pinion is not model.pinion


def test_threads_that_ask_for_one_model_solve_it_once(monkeypatch):
    case, started, go_on = small_case(), [], threading.Event()

    def slow(*arguments):
        started.append(1)
        go_on.wait(10.0)
        return elastic_model(*arguments)

    monkeypatch.setattr(models, "elastic_model", slow)
    store = ModelStore()
    with ThreadPoolExecutor(2) as executor:
        asked = [executor.submit(store.model, case) for _ in range(2)]
        go_on.set()
        one, other = (future.result()[0] for future in asked)
    assert started == [1]
    assert one.pinion is other.pinion


def test_a_model_that_fails_is_tried_again(monkeypatch):
    store, case = ModelStore(), small_case()
    monkeypatch.setattr(models, "elastic_model", lambda *arguments: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        store.model(case)
    monkeypatch.undo()
    assert store.model(case)[1] > 0.0


def test_models_beyond_the_limit_go_those_unused_for_longest_first(monkeypatch):
    cases = [change_case(small_case(), profile_elements=n) for n in (5, 6, 7)]
    solved = []

    def counted(case, mesh):
        solved.append(case.mesh.profile_elements)
        return elastic_model(case, mesh)

    monkeypatch.setattr(models, "elastic_model", counted)
    store = ModelStore()
    sizes = [models._bytes(store.model(case)[0]) for case in cases]
    store, solved[:] = ModelStore(sum(sizes) - 1), []
    for case in (*cases[:2], cases[0], cases[2], cases[0], cases[1]):
        store.model(case)
    assert solved == [5, 6, 7, 6], "6 went for 7, 5 was used after it"
