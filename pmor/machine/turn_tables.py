"""Tables of sets over a turn of their carrier: load sharing, rows of planets, supports, and their orders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from pmor.report.table import Column, Columns, Table, table
from pmor.results.quantities import TABLE

Data = dict[str, Any]
TURN_COLUMNS: Columns = {
    "load": "load", "set": "name", "K_γ": lambda row: row["turn"]["k_gamma"],
    "largest row of a planet's bearings [N]": lambda row: _largest(row, "largest_N"),
    "over the mean of all rows": lambda row: _largest(row, "largest_over_mean"),
}
PLANET_ROW_COLUMNS: Columns = {
    "load": "load", "set": "set", "planet": "planet", "row at [mm]": "at_mm", "largest force across [N]": "largest_N",
    "at [°] of the carrier": "largest_at_deg", "over the mean of all rows": "largest_over_mean",
}  # fmt: skip
SUPPORT_COLUMNS: Columns = {
    "load": "load", "set": "set", "support": "name",
    **{f"{word} [N]": f"radial_force_{key}_N"
       for word, key in (("least force across", "min"), ("mean", "mean"), ("largest", "max"))},
}  # fmt: skip
TURN = (
    "One position to each mesh pitch, solved in order on the law of each bearing, those of planets too: loads that "
    "stand in the housing, and bearings with their loaded zones, turn against the carrier. K_γ: largest load of a "
    "planet over the mean of all."
)
ORDERS = (
    "Times in a turn of the carrier, amplitudes from zero to peak, of force across a support and its row, load and "
    "misalignment F_β: of planets, rows and meshes the one that changes most. Order 1 is of what stands in the "
    "housing, N planets share order N, and loads on another shaft come back as often as it turns, or passes the "
    "carrier. Meshes stand alike at all positions: their own orders are those of the transmission error."
)


def turn_tables(sets: Sequence[Data]) -> dict[str, list[Table]]:
    """Return the tables, by theme, of entries of sets under loads; none of those that were not turned."""
    turning = [one for one in sets if one["turn"] is not None]
    if not turning:
        return {}
    rows, supports, orders = (
        [{**row, "load": one["load"], "set": one["name"]} for one in turning for row in rows_of(one["turn"])]
        for rows_of in (lambda turn: turn["planet_rows"], lambda turn: turn["supports"], _most)
    )
    of_rows = [table("Planets' bearings over a turn of the carrier", PLANET_ROW_COLUMNS, rows, TURN)] if rows else []
    return {
        "Stiffness and load sharing": [
            table("Planetary sets over a turn of the carrier", TURN_COLUMNS, turning, TURN),
            table("Orders of the carrier", _order_columns(turning), orders, ORDERS),
        ],
        "Shafts and bearings": [
            *of_rows, table("Supports over a turn of the carrier", SUPPORT_COLUMNS, supports, TURN)
        ],
    }  # fmt: skip


def order_rows(data: Data) -> list[Data]:
    """Return an amplitude of each order of all that is told of sets over turns: rows of `turn_orders.csv`."""
    return [
        {"load": load["name"], "set": one["name"], "of": row["of"], "name": row["name"], "quantity": row["quantity"],
         "unit": TABLE[row["quantity"]].unit, "order": order, "amplitude": amplitude}
        for load in data["loads"] for one in load["sets"] if one["turn"] is not None
        for row in one["turn"]["by_order"]
        for order, amplitude in zip(
            (0.0, *one["turn"]["carrier_orders"]), (row["mean"], *row["amplitudes"]), strict=True
        )
    ]  # fmt: skip


def _most(turn: Data) -> Iterator[Data]:
    """Of planets, rows and meshes the one that changes most; all supports."""
    of = dict.fromkeys(row["of"] for row in turn["by_order"])
    for kind in of:
        rows = [row | {"by": dict(zip(turn["carrier_orders"], row["amplitudes"], strict=True))}
                for row in turn["by_order"] if row["of"] == kind]  # fmt: skip
        yield from rows if kind == "support" else [max(rows, key=lambda row: sum(filter(None, row["amplitudes"])))]


def _order_columns(turning: Sequence[Data]) -> Columns:
    orders = sorted({order for one in turning for order in one["turn"]["carrier_orders"]})
    return {
        "load": "load", "set": "set", "of": "name", "quantity": lambda row: TABLE[row["quantity"]].head, "mean": "mean",
        **{f"order {order:.4g}": _of_order(order) for order in orders},
    }  # fmt: skip


def _largest(row: Data, key: str) -> float | None:
    return max((one[key] for one in row["turn"]["planet_rows"]), default=None)


def _of_order(order: float) -> Column:
    return lambda row: row["by"].get(order)
