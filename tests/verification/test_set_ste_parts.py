"""Transmission error of a set on shafts by its parts: what supports add is what rigid ones take away."""

import pytest

import pmor
from tests.support.set_gearboxes import EVEN_SET, bearing, one_stage, written_reducer

# Two planets carry alike whatever the sun stands on: its supports do not move load from one to the other.
TWO = EVEN_SET.replace("count = 3", "count = 3\nmissing = [3]")
# Where the sun tilts, contact spreads otherwise over the face.
TILTED = 3e-4
RIGHT_THERE = bearing("A", "sun", 50.0)
ASTRIDE = bearing("A", "sun", 20.0, "4e6", '"free"') + bearing("A2", "sun", 58.0, "4e6", '"free"')


@pytest.mark.parametrize(
    ("text", "shafts", "close"),
    [(one_stage(sun="2e5"), False, 1e-9), (one_stage(torque=-300.0).replace(RIGHT_THERE, ASTRIDE), True, TILTED)],
    ids=["on a soft bearing", "on a shaft that bends, from its other end"],
)
def test_supports_add_by_virtual_work_what_rigid_ones_take_away(text, shafts, close, tmp_path):
    assert TWO.count("missing") == 1
    (load,) = pmor.run(written_reducer(tmp_path, text, TWO)).data["loads"]
    (found,) = load["sets"]
    added = found["ste_mean_um"] - found["rigid_ste_mean_um"]
    assert added > 0.5
    assert found["ste_of_shafts_um"] + found["ste_of_bearings_um"] == pytest.approx(added, rel=close)
    assert found["ste_of_teeth_um"] == pytest.approx(found["rigid_ste_mean_um"], rel=close)
    assert (found["ste_of_shafts_um"] > 0.3 * added) == shafts
