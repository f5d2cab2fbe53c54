"""Tables of results, how they are shown, and conditions as a table."""

from __future__ import annotations

import csv
import re
import sys
from dataclasses import replace
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from matplotlib.figure import Figure

import pmor
from pmor.app.result import ConditionsResult, SweepResult
from pmor.core.shown import LONGEST, MOST_ROWS, Written, html_table
from pmor.export import tables
from pmor.export.tables import ResultArray, csv_tables
from pmor.gear.condition import Assembly, Condition, Misalignment, at_torques
from pmor.report.data_files import write_ste_csv
from pmor.report.replay import figure_of
from pmor.report.sweep_figures import ste_figure
from pmor.results.tabular import Tabular
from pmor.storage.condition_table import read_conditions, write_conditions
from pmor.storage.hdf5 import Field, set_attributes, write
from pmor_online.compare import Comparison
from tests.support.stored_files import rows_of
from tests.support.sweeps import made_up_sweep


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


RELIEF = pmor.Modification(tip_relief_um=20.0, tip_relief_start_roll_deg=25.0)


@pytest.fixture
def sweep():
    angles = np.arange(8) / 8
    ste = np.array([[50.0], [100.0]]) * (0.1 + 0.01 * np.cos(2 * np.pi * angles))
    return made_up_sweep(ste, [50.0, 100.0], np.ones((8, 1)), first_pair=0)


@pytest.fixture
def result(sweep):
    return SweepResult(sweep, pair=None)


class Frame(dict):
    """Columns, and what is said of them."""

    def __init__(self, columns):
        super().__init__(columns)
        self.attrs = {}


@pytest.fixture
def pandas(monkeypatch):
    """A stand-in that keeps the columns it is given."""
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=Frame))


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


def test_assemblies_with_names_have_them_in_tables(result, pandas):
    found = ConditionsResult((Assembly(), Assembly(pinion=RELIEF)), (result, result), ("plain", "relief"))
    assert list(found.to_dataframe()["assembly"]) == ["plain", "plain", "relief", "relief"]
    assert ">relief<" in found._repr_html_()


def test_columns_have_their_units_as_attributes(result, pandas):
    units = result.to_dataframe().attrs["units"]
    assert (units["ste_um"], units["torque_Nm"], units["phi_rad"]) == ("um", "N m", "rad")
    assert not {"converged", "share_pair_0"} & set(units)


@pytest.mark.parametrize(("package", "method"), [("pandas", "to_dataframe"), ("xarray", "to_xarray")])
def test_without_a_package_the_remedy_is_said(package, method, result, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(pmor.ExternalProgramError, match=f"pip install {package}"):
        getattr(result, method)()


class Dataset:
    """A stand-in that keeps what it is given: names, with axes, values and attributes."""

    def __init__(self, variables, coordinates=None):
        self.variables, self.coordinates = variables, coordinates or {}
        lengths = {}
        for axes, values, _ in [*variables.values(), *self.coordinates.values()]:
            for axis, length in zip([axes] if isinstance(axes, str) else axes, np.shape(values), strict=True):
                assert lengths.setdefault(axis, length) == length


@pytest.fixture
def xarray(monkeypatch):
    tree = SimpleNamespace(from_dict=dict)
    monkeypatch.setitem(sys.modules, "xarray", SimpleNamespace(Dataset=Dataset, DataTree=tree))


class Machine(Tabular):
    """Results of two meshes under a load."""

    def _labelled(self):
        array = pmor.ResultArray(np.zeros(3), "um", ("angle",), "transmission error")
        return {f"meshes/{name}/full/ste/ste": array for name in ("first", "second")}


def test_arrays_of_a_machine_are_a_dataset_of_each_part_and_load(xarray):
    tree = Machine().to_xarray()
    assert list(tree) == ["meshes/first/full", "meshes/second/full"]
    assert tree["meshes/first/full"].variables["ste"][2] == {"units": "um", "long_name": "transmission error"}


def test_arrays_of_a_sweep_have_axes_with_their_places(sweep, xarray):
    class Swept(Tabular):
        def _labelled(self):
            return {
                "ste/phi": pmor.ResultArray(sweep.phi_rad, "rad", ("angle",), ""),
                "ste/torque": pmor.ResultArray(sweep.torque_Nm, "N m", ("torque",), ""),
                "ste/ste": pmor.ResultArray(sweep.ste_um, "um", ("torque", "angle"), ""),
                "harris/torque": pmor.ResultArray(np.arange(3.0), "N m", ("torque",), ""),
                "harris/ste": pmor.ResultArray(np.zeros((3, 8)), "um", ("torque", "angle"), ""),
            }

    data = Swept().to_xarray()
    np.testing.assert_array_equal(data.coordinates["torque"][1], sweep.torque_Nm)
    np.testing.assert_array_equal(data.coordinates["angle"][1], sweep.phi_rad)
    assert data.variables["harris_ste"][0] == ["harris_torque", "angle"], "of another length"
    np.testing.assert_array_equal(data.coordinates["harris_torque"][1], np.arange(3.0))


def test_a_table_alone_is_a_dataset_along_its_first_column(result, xarray):
    data = ConditionsResult((Assembly(), Assembly(pinion=RELIEF)), (result, result)).to_xarray()
    axis, values, attributes = data.variables["ste_peak_to_peak_um"]
    assert (axis, len(values), attributes) == ("assembly", 4, {"units": "um"})


def test_curves_are_drawn_into_axes_of_the_caller_and_into_new_ones(result):
    axes = Figure().subplots()
    assert result.plot(axes) is axes
    assert [line.get_label() for line in result.plot(axes, ls="--").lines[2:]] == ["50 N m", "100 N m"]
    np.testing.assert_array_equal(axes.lines[1].get_ydata(), result.ste_um[1])
    assert len(result.plot().lines) == 2


def test_files_show_the_keys_that_are_written():
    text = '[load]\ntorque_Nm = 3.0\n[[bearings]]\nname = "left"\nat_mm = 1.0\n'
    shown = Written()
    shown.name, shown.text = "box", text
    assert all(f">{words}<" in shown._repr_html_() for words in ("load.torque_Nm", "3.0", "bearings[left].at_mm"))
    shown.text = "<?xml version='1.0'?>"
    assert "box" in shown._repr_html_(), "the name of what is no TOML"


def test_settings_show_their_keys_and_what_has_a_summary_shows_that():
    shown = RELIEF._repr_html_()
    assert all(f">{words}<" in shown for words in ("tip_relief_um", "20.0", "tip_relief_start_roll_deg", "25.0"))
    check = SimpleNamespace(name="balance", value=0.5, limit=1.0, ok=True, meaning="")
    assert re.search("<pre>.*balance.*</pre>", pmor.Verification(None, (check,))._repr_html_(), re.DOTALL)


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
    assert figure_of(ste_figure(sweep))._repr_png_().startswith(b"\x89PNG")


@pytest.fixture
def file():
    with h5py.File("memory.h5", "w", driver="core", backing_store=False) as found:
        yield found


def write_table(file, columns, table):
    write(file, "conditions", table, Field("1", "angle, condition, column", "a table"))
    set_attributes(file["conditions"], columns=" ".join(columns))


def test_conditions_come_back(file):
    conditions = at_torques([1.0, 2.5], Misalignment(1.0, -2.0, 3.0)), at_torques([4.0, 5.0])
    write_conditions(file, conditions)
    assert read_conditions(file) == conditions


def test_no_conditions_come_back_as_none(file):
    write_conditions(file, ())
    assert read_conditions(file) == ()


def test_columns_go_by_their_names_and_those_left_out_have_the_default(file):
    write_table(file, ["out_of_plane", "torque"], np.array([[[7.0, 100.0]]]))
    assert read_conditions(file) == ((Condition(torque=100.0, misalignment=Misalignment(out_of_plane_um=7.0)),),)


@pytest.mark.parametrize("columns", [["torque", "humidity"], ["in_plane", "out_of_plane"], ["torque"]])
def test_columns_that_nobody_knows_or_that_are_missing_are_refused(columns, file):
    write_table(file, columns, np.zeros((1, 1, 2)))
    with pytest.raises(ValueError, match="known are torque, in_plane"):
        read_conditions(file)
