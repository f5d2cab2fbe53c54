"""Orders over the pitches of a sweep, named by mesh and holes."""

from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from pmor.report.replay import figure_of
from pmor.report.summary import ORDERS, write_orders
from pmor.report.torque_figures import revolution_figure, waterfall_figure
from pmor.results.shaft_orders import order_name, shaft_orders
from tests.support.sweeps import PITCH, made_up_sweep

# Of a pinion with 21 teeth and a wheel with 57, eight holes in its web.
TEETH, HOLES, PITCHES, ANGLES = (21, 57), (0, 8), 57, 16
MADE = {57: 0.8, 8: 0.3, 49: 0.05, 65: 0.07, 106: 0.02}  # by the order of the wheel's shaft
NAMES = {
    57: "mesh 1", 8: "1 x 8 holes of the wheel", 49: "mesh 1 - 1 x 8 holes of the wheel",
    65: "mesh 1 + 1 x 8 holes of the wheel", 106: "mesh 2 - 1 x 8 holes of the wheel",
}  # fmt: skip


def sweep_of(factors=(1.0,)):
    phi = PITCH * np.arange(PITCHES * ANGLES) / ANGLES
    curve = 12.0 + sum(a * np.cos(order * phi * 21 / 57 + order) for order, a in MADE.items())
    return made_up_sweep([f * curve for f in factors], 100.0 * np.array(factors), phi_rad=phi)


def test_orders_are_found_and_named_by_what_makes_them():
    found = shaft_orders(sweep_of(), 0, TEETH, HOLES)
    by_wheel = {round(one.wheel_order): one for one in found}
    assert {order: one.name for order, one in by_wheel.items()} == NAMES
    np.testing.assert_allclose([by_wheel[order].amplitude_um for order in MADE], list(MADE.values()), rtol=1e-10)
    np.testing.assert_allclose(by_wheel[65].pinion_order, 65 * 21 / 57, rtol=1e-14)
    assert [round(one.wheel_order) for one in found] == sorted(MADE, key=MADE.get, reverse=True)


def test_a_sweep_with_a_gap_has_no_orders():
    sweep = sweep_of()
    sweep.ste_um[0, 5] = np.nan
    assert shaft_orders(sweep, 0, TEETH, HOLES) == []


@pytest.mark.parametrize(
    ("order", "holes", "name"),
    [
        (Fraction(4, 21), (4, 8), "1 x 4 holes of the pinion"),
        (
            1 + Fraction(4, 21) - Fraction(8, 57),
            (4, 8),
            "mesh 1 + 1 x 4 holes of the pinion - 1 x 8 holes of the wheel",
        ),
        (Fraction(2, 21), (0, 0), "order 2 of the pinion"),
        (Fraction(3, 57), (0, 0), "order 3 of the wheel"),
        (Fraction(1, 399), (0, 0), "pinion and wheel together"),
        (Fraction(2), (0, 57), "mesh 2"),
    ],
)
def test_names_take_as_few_holes_as_they_can(order, holes, name):
    assert order_name(order, TEETH, holes) == name


def test_pictures_of_orders_mark_those_of_the_mesh():
    sweep = sweep_of((0.5, 1.0, 1.5))
    spectrum = figure_of(revolution_figure(sweep, 1, TEETH, HOLES)).axes[1]
    sides, mesh = (sorted({round(x) for (x, _), _ in lines.get_segments()}) for lines in spectrum.collections[:2])
    assert (sides, mesh) == ([8, 49, 65, 106], [57])
    assert waterfall_figure(sweep, TEETH, HOLES) is not None
    assert waterfall_figure(sweep_of((1.0, 2.0)), TEETH, HOLES) is None


@pytest.mark.parametrize("missing", [False, True])
def test_orders_that_no_torque_has_leave_their_table_without_rows(missing, tmp_path):
    sweep = sweep_of()
    if missing:
        ste = sweep.ste_um.copy()
        ste[:, 3] = np.nan
        sweep = replace(sweep, ste_um=ste, converged=np.isfinite(ste))
    gears = SimpleNamespace(pinion=SimpleNamespace(teeth=21), wheel=SimpleNamespace(teeth=57), holes=HOLES)
    write_orders(SimpleNamespace(sweep=sweep, case=SimpleNamespace(pair=gears)), tmp_path)
    head, *rows = (tmp_path / ORDERS).read_text().splitlines()
    assert head == "torque_Nm,name,mesh_order,pinion_order,wheel_order,amplitude_um"
    assert bool(rows) == (not missing)
