"""Rings and planetary sets far from the usual converge, balance and have no jumps, or are refused with the reason."""

import pytest

from tests.programs.set_stability import page
from tests.support.set_variants import VARIANTS, measure

FEW = (
    "thin ring, rim of half a module", "9 planets, floating sun", "a pin 200 um ahead unloads two planets",
    "stepped planets that tilt on 1e7 N mm/rad", "a billionth of the torque", "1000 times the torque",
)  # fmt: skip


def holds(name):
    entry = measure(name)
    assert entry.ok or entry.explained, f"{name}: {entry.note}"
    return entry


@pytest.mark.parametrize("name", FEW)
def test_a_few_sets_far_from_the_usual_hold(name):
    holds(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in VARIANTS if name not in FEW])
def test_sets_far_from_the_usual_hold(name):
    holds(name)


def test_the_table_names_what_failed():
    entry = measure("6 planets that touch")
    assert "1 variants: 0 ok, 1 refused as they should be, 0 failed" in page([entry])
    assert "tip circles are 80 mm wide" in page([entry])
