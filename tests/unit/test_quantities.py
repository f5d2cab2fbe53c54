"""One table of quantities: keys and units agree, and the page of the manual says what it says."""

import re
from dataclasses import fields

import numpy as np
from numpy.testing import assert_allclose

from pmor.campaigns.settings import OF_RELIEF, OF_SETS, USUAL
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.report.table import heads, table
from pmor.results.loads import LineStates
from pmor.results.quantities import ALL, OF_MESHES, QUANTITIES, TABLE, figures_of_mesh
from pmor.results.tabular import parted
from tests.programs.quantity_page import PAGE, with_table

ENDINGS = {
    "um": "um", "mm": "mm", "MPa": "MPa", "N": "N", "Nm": "N m", "W": "W", "rpm": "rpm", "Hz": "Hz", "kg": "kg",
    "mrad": "mrad", "deg": "deg", "percent": "%", "Nmm": "N mm", "m2": "kg m2", "pitches": ("1", "pitches"),
}  # fmt: skip


def test_each_key_stands_once_and_its_unit_is_that_of_its_end():
    assert len(TABLE) == len(QUANTITIES)
    for quantity in QUANTITIES:
        expected = ENDINGS.get(quantity.key.rpartition("_")[2], quantity.unit)
        per = parted(quantity.key)[1] if "N_per_" in quantity.key else None
        assert quantity.unit == (per or expected) or quantity.unit in expected, quantity.key


def test_the_page_of_the_manual_says_what_the_table_says():
    text = PAGE.read_text(encoding="utf-8")
    assert text == with_table(text), "run: python -m tests.programs.quantity_page"


def test_the_glossary_has_each_symbol_and_what_all_machines_tell_with_its_unit():
    text = (PAGE.parent / "glossary.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.count("|") == 5]
    for _, unit, _, where in rows:
        for key in {*re.findall(r"`(\w+)`", where)} & set(TABLE):
            assert TABLE[key].shown_unit in unit.split(", "), key
    symbols = {symbol for one in QUANTITIES for symbol in re.findall(r"\b\w+_\w+", one.symbol)}
    asked = {f"`{one.key}`" for one in QUANTITIES if one.files == ALL}
    assert sorted(told for told in symbols | asked if told not in text) == []


def test_results_of_campaigns_are_quantities():
    assert {*USUAL, *OF_RELIEF, *OF_SETS} <= set(TABLE)


def test_a_torque_under_which_nothing_converged_has_no_figures():
    load = np.zeros((2, 3, 1, 4))
    load[0] = 50.0
    given = {item.name: load for item in fields(LineStates)} | {
        "width_mm": np.full(4, 2.5), "converged": np.array([[True] * 3, [False] * 3]),
        "roll_rad": np.zeros((3, 1, 4, 2)), "z_mm": np.linspace(-3.75, 3.75, 4), "mirrored": False,
    }  # fmt: skip
    tooth = Tooth(20, 2.0, np.radians(20.0))
    found = figures_of_mesh(GearPair(tooth, tooth, 10.0, 40.0), LineStates(**given))
    assert tuple(found) == OF_MESHES
    assert_allclose([found["k_h_beta"][0], found["line_load_max_N_per_mm"][0], found["carrying_face_percent"][0]],
                    [1.0, 50.0, 100.0])  # fmt: skip
    assert np.isnan([values[1] for values in found.values()]).all()


def test_columns_have_heads_of_the_table_and_shares_in_per_cent():
    row = {"k_h_beta": 1.2, "share_mean": 0.25, "ste_mean_um": 3.0}
    shown = table("", heads(*row), [row])
    assert tuple(shown.columns) == ("K_Hβ", "share [%]", "STE mean [µm]")
    assert shown.rows == [[1.2, 25.0, 3.0]]
