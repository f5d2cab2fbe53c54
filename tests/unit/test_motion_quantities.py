"""Quantities of periodic motion, from a cycle that is made up."""

from types import SimpleNamespace

import numpy as np
import pytest

from pmor.dynamics import quantities
from pmor.dynamics.quantities import Cycle


def test_contact_is_lost_while_neither_flanks_nor_backs_touch(monkeypatch):
    """Coast flanks push with negative forces; bearings carry what is across the axis."""
    size, bearing = 4, np.zeros((4, 2, 3))
    bearing[1, 0], bearing[2, 1] = (3.0, 4.0, 12.0), (-5.0, 12.0, 84.0)
    cycle = Cycle(
        phase=np.arange(size), displacement=np.array([0.01, -0.002, 0.0, 0.02]), velocity=np.zeros(size),
        force=np.array([-1.0, 0.0, 0.0, 9.0]), bearing=bearing, positions=np.zeros((size, 0)),
    )  # fmt: skip
    monkeypatch.setattr(quantities, "cycle_of", lambda *arguments: cycle)
    unknowns = np.array([0.01, 3e-3, 4e-3, 0.0, 0.0, 0.0, 1e-3])
    found = quantities.quantities(None, SimpleNamespace(cycles=1), unknowns, 1.0)
    assert found.contact_loss == 0.5
    assert (found.smallest_force_N, found.largest_force_N) == (-1.0, 9.0)
    assert found.dynamic_factor == pytest.approx(4.5)
    assert found.separation_um == pytest.approx(2.0)
    assert found.dte_orders_um[:3] == pytest.approx((5.0, 0.0, 1.0))
    assert found.bearing_force_N == pytest.approx((5.0, 13.0))
