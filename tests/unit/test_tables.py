"""Arrays with units, axes and meanings become tables that say all of it."""

import csv

import numpy as np
import pytest

from pmor.export import tables
from pmor.export.tables import ResultArray, csv_tables


def some():
    return {
        "ste/torque": ResultArray(np.array([50.0, 100.0]), "N m", ("torque",), "on the pinion"),
        "ste/phi": ResultArray(np.array([0.0, 0.1, 0.3]), "rad", ("angle",), "pinion angle"),
        "ste/ste": ResultArray(np.arange(6.0).reshape(2, 3) / 7.0, "um", ("torque", "angle"), "transmission error"),
        "ste/converged": ResultArray(np.ones((2, 3), dtype=bool), "1", ("torque", "angle"), "1 where it converged"),
        "forces/force": ResultArray(np.array([[1.0, np.nan]]), "N", ("torque", "xyz"), "on the pinion"),
        "lines/load": ResultArray(np.zeros((2, 2)), "N/mm", ("torque", "section"), "line load"),
        "lines/width": ResultArray(np.array([2.0, 1.0]), "mm", ("section",), "of sections"),
        "lines/z": ResultArray(np.array([-1.0, 1.0]), "mm", ("section",), "places"),
        "teeth": ResultArray(np.array(21), "1", (), "of the pinion"),
    }


def test_arrays_of_a_group_with_the_same_axes_share_a_table_with_their_places():
    found, too_long = csv_tables(some(), "a sweep")
    assert too_long == []
    assert sorted(found) == [
        "forces_per_torque_per_xyz.csv", "lines_per_section.csv", "lines_per_torque_per_section.csv",
        "ste_per_torque_per_angle.csv", "values.csv",
    ]  # fmt: skip
    comments, rows = split(found["ste_per_torque_per_angle.csv"])
    assert comments[0].startswith("# a sweep, pmor ")
    assert comments[1:] == [
        "# torque [N m]: on the pinion", "# phi [rad]: pinion angle", "# ste [um]: transmission error",
        "# converged [1]: 1 where it converged",
    ]  # fmt: skip
    assert rows[0] == ["torque", "phi", "ste", "converged"]
    assert [float(cell) for cell in rows[6]] == [100.0, 0.3, 5.0 / 7.0, 1.0]  # to the last digit


def test_places_ascend_and_torques_are_those_of_the_sweep():
    _, rows = split(csv_tables(some(), "x")[0]["lines_per_torque_per_section.csv"])
    assert rows[:3] == [["torque", "z", "load"], ["50.0", "-1.0", "0.0"], ["50.0", "1.0", "0.0"]]


def test_an_axis_without_places_has_its_index_and_what_is_no_number_is_empty():
    comments, rows = split(csv_tables(some(), "x")[0]["forces_per_torque_per_xyz.csv"])
    assert "# xyz [1]: index, from 0" in comments
    assert rows[1:] == [["0", "0", "1.0"], ["0", "1", ""]]  # the sweep has more torques


def test_what_is_longer_than_a_table_is_left_out_by_name(monkeypatch):
    monkeypatch.setattr(tables, "MOST_ROWS", 5)
    found, too_long = csv_tables(some(), "x")
    assert too_long == ["ste/ste", "ste/converged"]
    assert "forces_per_torque_per_xyz.csv" in found


def test_axes_have_to_be_named():
    with pytest.raises(ValueError, match="a/b: 1 axes, and names for 2"):
        csv_tables({"a/b": ResultArray(np.zeros(3), "1", ("x", "y"), "")}, "x")


def split(text):
    lines = text.splitlines()
    comments = [line for line in lines if line.startswith("#")]
    return comments, list(csv.reader(lines[len(comments) :]))
