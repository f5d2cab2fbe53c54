"""Tables of sets over a turn of their carrier, of made-up numbers: orders of one set alone, planets on springs."""

from pmor.machine.turn_tables import order_rows, turn_tables


def course(of, name, *amplitudes, quantity="radial_force_N"):
    return {"of": of, "name": name, "quantity": quantity, "mean": 5.0, "amplitudes": list(amplitudes)}


def entry(name, orders, courses):
    turn = {"k_gamma": 1.1, "planet_rows": [], "supports": [], "carrier_orders": orders, "by_order": courses}
    return {"load": "drive", "name": name, "turn": turn}


PLANETS = [course("planet", f"planet {n}", 0.1 * n, 0.0, quantity="planet_load_over_mean") for n in (1, 3, 2)]
SETS = [
    entry("first", [1.0, 3.0], [*PLANETS, course("support", "A", 7.0, 8.0), course("support", "B", 2.0, None)]),
    entry("second", [1.0, 3.5], [course("row", "planet 1, row at 4 mm", 4.0, 6.0)]),
    {"load": "drive", "name": "still", "turn": None},
]


def test_orders_of_several_sets_stand_beside_each_other():
    (_, orders), (supports,) = turn_tables(SETS).values()
    assert "Supports" in supports.title
    assert list(orders.columns)[-3:] == ["order 1", "order 3", "order 3.5"]
    assert [row[2] for row in orders.rows] == ["planet 3", "A", "B", "planet 1, row at 4 mm"]
    assert [row[-1] in (None, "–") for row in orders.rows] == [True, True, True, False]
    assert turn_tables(SETS[2:]) == {}


def test_files_have_all_planets_with_their_mean_as_order_0():
    rows = order_rows({"loads": [{"name": "drive", "sets": SETS}]})
    assert len(rows) == 3 * (len(PLANETS) + 2 + 1)
    assert [(row["order"], row["amplitude"]) for row in rows[-3:]] == [(0.0, 5.0), (1.0, 4.0), (3.5, 6.0)]
    assert {row["unit"] for row in rows} == {"1", "N"}
