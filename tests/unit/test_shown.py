"""Results, cases and conditions show themselves: one line in a prompt, a table in a notebook, pandas by request."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import pmor
from pmor.app.result import ConditionsResult, SweepResult
from pmor.core.shown import LONGEST, MOST_ROWS, html_table
from pmor.gear.condition import Assembly, Misalignment
from pmor.report.data_files import write_ste_csv
from pmor.report.sweep_figures import ste_figure
from pmor_online.compare import Comparison
from tests.support.stored_files import rows_of
from tests.support.sweeps import made_up_sweep

RELIEF = pmor.Modification(tip_relief_um=20.0, tip_relief_start_roll_deg=25.0)


@pytest.fixture
def sweep():
    angles = np.arange(8) / 8
    ste = np.array([[50.0], [100.0]]) * (0.1 + 0.01 * np.cos(2 * np.pi * angles))
    return made_up_sweep(ste, [50.0, 100.0], np.ones((8, 1)), first_pair=0)


@pytest.fixture
def result(sweep):
    return SweepResult(sweep, pair=None)


@pytest.fixture
def pandas(monkeypatch):
    """A stand-in that keeps the columns it is given."""
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=dict))


def test_conditions_are_told_by_what_differs_from_the_defaults_and_read_back():
    assert repr(RELIEF) == "Modification(tip_relief_um=20.0, tip_relief_start_roll_deg=25.0)"
    built = Assembly(Misalignment(in_plane_um=5.0), RELIEF)
    assert eval(repr(built), vars(pmor) | {name: getattr(pmor, name) for name in pmor.__all__}) == built
    assert repr(Assembly()) == "Assembly()"


def test_arrays_are_told_by_their_sizes(sweep, result):
    for thing in (sweep, Comparison(sweep, sweep), result, pmor.ResultArray(np.zeros((900, 3)), "mm", ("a", "b"), "")):
        assert len(repr(thing)) <= LONGEST
        assert "\n" not in repr(thing)
    assert repr(sweep).startswith("SteSweep(phi_rad=<8>, torque_Nm=<2>, ste_um=<2 x 8>, ")


def test_a_data_frame_has_the_columns_of_the_file(result, sweep, pandas, tmp_path):
    write_ste_csv(tmp_path / "ste.csv", sweep)
    frame, rows = result.to_dataframe(), rows_of(tmp_path / "ste.csv")
    assert list(frame) == list(rows[0])
    for key in ("torque_Nm", "phi_rad", "ste_um", "share_pair_0"):
        np.testing.assert_array_equal(frame[key], [float(row[key]) for row in rows])


def test_assemblies_are_told_apart_by_what_differs(result, pandas):
    found = ConditionsResult((Assembly(), Assembly(pinion=RELIEF)), (result, result)).to_dataframe()
    assert list(found["assembly"]) == [0, 0, 1, 1]
    assert found["pinion.tip_relief_um"] == [0.0, 0.0, 20.0, 20.0]
    assert not any(key.startswith(("wheel.", "misalignment.")) for key in found)
    np.testing.assert_array_equal(found["ste_mean_um"], np.tile(result.mean_um, 2))


def test_without_pandas_the_remedy_is_said(result, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(pmor.ExternalProgramError, match="pip install pandas"):
        result.to_dataframe()


def test_a_notebook_shows_a_table_of_each_torque(result):
    shown = result._repr_html_()
    assert "&lt;SweepResult: 8 angles x 50, 100 N m" in shown
    assert shown.count("<tr>") == 1 + 2
    assert "<th>order 1, um</th>" in shown
    irregular = replace(result.sweep, phi_rad=result.sweep.phi_rad**2)
    assert "order 1" not in SweepResult(irregular, pair=None)._repr_html_(), "angles that divide no pitch have none"


def test_a_long_table_says_how_much_is_left_out_and_text_is_no_markup():
    shown = html_table("<b>", {"a<": [None, float("nan"), *range(MOST_ROWS)]})
    assert "2 more rows" in shown
    assert "&lt;b&gt;" in shown
    assert "a&lt;" in shown
    assert shown.count("–") == 2


def test_a_case_shows_both_gears():
    case = pmor.make_case(teeth=21, bore_radius_mm=20.0, module_mm=4.0, face_width_mm=20.0, torque_Nm=100.0,
                          wheel={"teeth": 34, "bore_radius_mm": 30.0})  # fmt: skip
    assert all(text in case._repr_html_() for text in ("<th>pinion</th>", ">21<", ">34<", ">bore_radius_mm<"))


def test_a_figure_is_a_picture_in_a_notebook(sweep):
    assert ste_figure(sweep)._repr_png_().startswith(b"\x89PNG")
