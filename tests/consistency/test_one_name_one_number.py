"""A number has one value under one name: on the page, in its tables, in summary, CSV files, HDF5 file and Python."""

from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.app.model import ReducedModel
from pmor.case import change_case
from pmor.report.run_page import write_pages
from pmor.report.summary import write_results
from pmor.report.table import format_cell
from pmor.results.quantities import TABLE
from pmor.storage.results_file import read_results
from pmor.work.online import run_online
from pmor_online.model import reduced_pair
from tests.support.line_pairs import models
from tests.support.stored_files import rows_of, summary_of

ROUND_OFF = 1e-12  # of means, which are added up in two orders
ASKED = {
    "online": {"torques_Nm": [40.0, 100.0], "angles_per_pitch": 12},
    "pinion.modification": {"tip_relief_um": 8.0, "tip_relief_start_roll_deg": 26.0, "helix_crowning_um": 6.0},
    "misalignment": {"in_plane_um": 10.0},
    "results": {"harris_torques_Nm": [40.0, 100.0]},
}
# Name on the page: key of summary and torques.csv, from the arrays of the file at torque t, from Python.
NAMES = {
    "STE mean": ("ste_mean_um", lambda h, t: h["ste/ste"][t].mean(), lambda s, _: s.mean_um),
    "STE peak-to-peak": (
        "ste_peak_to_peak_um", lambda h, t: np.ptp(h["ste/ste"][t]), lambda s, _: s.peak_to_peak_um,
    ),
    "STE without load, mean": (
        "unloaded_ste_mean_um", lambda h, t: h["ste/unloaded"][t].mean(), lambda s, _: s.unloaded_um.mean(),
    ),
    "STE without load, p-p": (
        "unloaded_ste_peak_to_peak_um", lambda h, t: np.ptp(h["ste/unloaded"][t]), lambda s, _: np.ptp(s.unloaded_um),
    ),
    "first touch": ("first_touch_um", lambda h, t: h["ste/unloaded"][t].min(), lambda s, _: s.unloaded_um.min()),
    **{
        f"order {k}": (
            f"ste_order_{k}_um", lambda h, t, k=k: h["orders/amplitude"][t, k - 1],
            lambda s, _, k=k: s.orders_um(5)[:, k - 1],
        )
        for k in range(1, 6)
    },
    "mesh stiffness": (
        "mesh_stiffness_mean_N_per_mm_um", lambda h, t: h["stiffness/secant"][t].mean(),
        lambda s, _: s.stiffness.secant.mean(axis=1),
    ),
    "mesh stiffness, tangent": (
        "mesh_stiffness_tangent_mean_N_per_mm_um", lambda h, t: h["stiffness/tangent"][t].mean(),
        lambda s, _: s.stiffness.tangent.mean(axis=1),
    ),
    "K_Hβ": ("k_h_beta", lambda h, t: h["face/k_h_beta"][t], lambda s, _: s.k_h_beta),
    "contact ratio, loaded": (
        "effective_contact_ratio", lambda h, t: h["face/effective_contact_ratio"][t],
        lambda s, _: s.effective_contact_ratio,
    ),
    "flank pressure, max": (
        "flank_pressure_max_MPa", lambda h, t: np.nanmax(h["lines/pressure"][t]),
        lambda s, _: np.nanmax(s.line_loads.pressure_MPa, axis=(1, 2, 3)),
    ),
    **{
        f"root stress, {gear}": (
            f"root_stress_{gear}_MPa", lambda h, t, g=g: np.nanmax(h["root_stress/max_principal"][t, :, g]),
            lambda _, r, g=g: [r.largest(t, g).max_principal_MPa for t in range(2)],
        )
        for g, gear in enumerate(("pinion", "wheel"))
    },
}  # fmt: skip
# What tables with a row for each torque call some of them.
BY_HEAD = {TABLE[key].head: name for name, (key, *_) in NAMES.items()}


class Tables(HTMLParser):
    """All tables of a page: rows of texts."""

    def __init__(self, html):
        super().__init__()
        self.tables, self._cell = [], None
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")
            self._cell = True

    def handle_endtag(self, tag):
        self._cell = None if tag in ("td", "th") else self._cell

    def handle_data(self, data):
        if self._cell:
            self.tables[-1][-1][-1] += data.replace("\u00a0", " ")  # of units, which no line breaks


@pytest.fixture(scope="module", params=["spur", "helical"])
def found(request, tmp_path_factory):
    """Folder, tables of the page, and sweep and root stress of a model in Python."""
    folder = tmp_path_factory.mktemp("run")
    basis = models(request.param, width="whole", root_stress=True)[1].basis
    basis = replace(basis, case=change_case(basis.case, **ASKED, output={"plots": False, "report": True}))
    (folder / "basis.h5").write_bytes(b"its size is told")
    run = run_online(reduced_pair(basis), folder / "basis.h5")
    write_results(run, folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pmor.report.run_page.run_pictures", lambda *_: [])
        write_pages(run, None, folder)
    asked = ReducedModel(basis)
    return folder, Tables((folder / "report.html").read_text()).tables, asked.sweep(), asked.root_stress()


def on_the_page(tables, t, nominal):
    """Texts of the page by name: of the quantities at nominal torque, and of all tables with a row for each torque."""
    texts = {}
    for heads, *rows in tables:
        if heads[:3] == ["quantity", "value", "unit"] and t == nominal:
            for label, value, *_ in rows:
                texts.setdefault(label, []).append(value)
        if heads[0] == TABLE["torque_Nm"].head and len(rows) == 2:
            for head, value in zip(heads, rows[t], strict=True):
                texts.setdefault(BY_HEAD.get(head, head), []).append(value)
    return texts


@pytest.mark.parametrize("t", [0, 1])
def test_a_number_has_one_value_under_one_name_wherever_it_stands(found, t):
    folder, tables, sweep, stress = found
    summary, arrays = summary_of(folder), read_results(folder / "results.h5").arrays
    table, texts = rows_of(folder / "torques.csv"), on_the_page(tables, t, nominal=1)
    seen = 0
    for name, (key, of_arrays, of_python) in NAMES.items():
        value = float(table[t][key])
        assert summary["torques"][t][key] == value, name
        if t == 1:
            assert summary[key] == value, name
        assert_allclose(of_arrays(arrays, t), value, rtol=ROUND_OFF, err_msg=name)
        assert_allclose(np.broadcast_to(of_python(sweep, stress), 2)[t], value, rtol=ROUND_OFF, err_msg=name)
        for text in texts.get(name, []):
            assert text == format_cell(value), name
            seen += 1
    assert seen == {0: 14, 1: 25}[t], "names of the page are found"


def test_tables_of_curves_hold_the_curves(found):
    folder, _, sweep, _ = found
    summary, rows = summary_of(folder), rows_of(folder / "stiffness.csv")
    for name in ("secant", "tangent"):
        values = np.reshape([float(row[f"{name}_N_per_mm_um"]) for row in rows], sweep.ste_um.shape)
        assert_allclose(values, getattr(sweep.stiffness, name), rtol=ROUND_OFF)
    assert_allclose(summary["ste_harmonics_um"][:5], [summary[f"ste_order_{k}_um"] for k in range(1, 6)], rtol=0.0)
    assert summary["root_stress_max_MPa"] == [summary[f"root_stress_{gear}_MPa"] for gear in ("pinion", "wheel")]
    largest = {(row["torque_Nm"], row["gear"]): 0.0 for row in rows_of(folder / "stress.csv")}
    for row in rows_of(folder / "stress.csv"):
        place = row["torque_Nm"], row["gear"]
        largest[place] = max(largest[place], float(row["max_principal_MPa"]))
    assert largest["100.0", "wheel"] == summary["root_stress_wheel_MPa"]
    harris = {row["torque_Nm"]: float(row["ste_peak_to_peak_um"]) for row in rows_of(folder / "harris.csv")}
    assert_allclose(harris["100.0"], summary["ste_peak_to_peak_um"], rtol=1e-9)


def test_classical_formulas_stand_beside_the_deflection_of_the_summary(found):
    """Load over mean deflection is the harmonic mean of the stiffness, less than the mean: it has another name."""
    folder, tables, *_ = found
    (row,) = [row for table in tables for row in table if row[0] == "reduced FE model, this run"]
    summary = summary_of(folder)
    assert 0.9 < float(row[1]) / summary["mesh_stiffness_mean_N_per_mm_um"] < 1.0
    assert row[2] == format_cell(summary["ste_mean_um"] - summary["unloaded_ste_mean_um"])


def test_root_stress_without_modifications_and_misalignment_is_that_of_such_a_pair(found):
    folder, tables, *_ = found
    summary = summary_of(folder)
    nominal, aligned, own = (
        summary[key]
        for key in ("root_stress_nominal_flanks_MPa", "root_stress_aligned_axes_MPa", "root_stress_max_MPa")
    )
    assert all(a != b for a, b in zip(aligned, own, strict=True))
    (table,) = [table for table in tables if table[0][1:] == ["pinion, MPa", "wheel, MPa"]]
    shown = {row[0]: row[1:] for row in table}
    assert shown["nominal flanks on aligned axes"] == [format_cell(value) for value in nominal]
    assert shown["flanks and axes of the case"] == [format_cell(value) for value in own]
