"""A second process compiles kernels that the first run needs later, and nothing depends on it."""

from pathlib import Path

from pmor.case import parse_case
from pmor.work import kernels
from tests.support.small_case import case_text, small_case


def test_what_the_second_process_does_works_for_full_fe_and_for_trained_shapes(monkeypatch):
    monkeypatch.setattr(kernels, "is_kept", lambda _kernel: False)
    monkeypatch.setattr(kernels, "kernels_folder", Path)
    monkeypatch.setattr(kernels, "other_models", lambda _case: [("direct", None)])
    text = case_text(contact={"scheme": "line"}).replace("lodm_profile = 2\n", "")
    with kernels.kernels_beside(parse_case(text, "lines", "lines")) as wait:
        assert wait() == 0


def test_nothing_is_started_where_all_is_compiled(monkeypatch):
    monkeypatch.setattr(kernels, "is_kept", lambda _kernel: True)
    monkeypatch.setattr(kernels.subprocess, "Popen", None)
    with kernels.kernels_beside(small_case()) as wait:
        assert wait() is None


def test_a_second_process_that_fails_is_waited_for_and_no_matter(monkeypatch):
    monkeypatch.setattr(kernels, "is_kept", lambda _kernel: False)
    monkeypatch.setattr(kernels, "kernels_folder", Path)
    monkeypatch.setattr(kernels, "_COMMAND", "raise SystemExit(3)")
    with kernels.kernels_beside(small_case()) as wait:
        assert wait() == 3
