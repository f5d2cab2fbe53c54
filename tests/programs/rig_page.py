"""Measured figures of the NREL GRC gearbox beside computed ones, with the band that the unknowns of the rig leave.

After `pmor campaign cases/nrel_750kw_campaign.toml --out out/nrel_750kw_campaign`, and the same of
`nrel_750kw_sun_held`, `python -m tests.programs.rig_page out cases/manual/rig.md` writes the tables of the page; the
words about them stay. Measured: Guo & Keller, AGMA FTM 2020; Keller et al., Wind Energy Science 3 (2018) 947.
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from pmor.campaigns.page import label_of

CAMPAIGN, HELD = "nrel_750kw_campaign", "nrel_750kw_sun_held"
# Half of the force of a pin under the torque; force of a mesh of the sun along its line of action; N.
ROW_N, MESH_N = 194.8e3, 63.0e6 / 3.0 / (0.5 * 21 * 10.0 / math.cos(math.radians(7.5)) * math.cos(math.radians(20.16)))
# From the spline to the middle of the sun, mm, and its torque, N mm.
LEVER, TORQUE = 880.0, 63.0e6
DRY, MOST = 0.1, 0.3
MEASURED: dict[str, tuple[float | None, str]] = {
    "K_γ in pure torque": (1.08, "–"),
    "K_γ at the extreme moments": (1.16, "below 1.10"),
    "most loaded row of the planets in pure torque, over half of the pin force, %": (46.0, "–"),
    "axial motion of the carrier from 0 to 100 kN thrust, µm": (63.0, "–"),
}
MARKS = "<!-- tables -->", "<!-- end of tables -->"
Row = Mapping[str, str]


def rows_of(folder: Path) -> list[dict[str, str]]:
    """Return the designs of a campaign, all of which must have results."""
    rows = list(csv.DictReader((folder / "campaign.csv").open(encoding="utf-8", newline="")))
    lost = [row["design"] for row in rows if row["status"] != "ok"]
    if lost:
        raise SystemExit(f"{folder}: no results of designs {', '.join(lost)}")
    return rows


def figures(row: Row) -> dict[str, float]:
    """Return what the rig measured, as a design has it."""

    def of(load: str, key: str) -> float:
        return float(row[f"{load}.planetary.{key}"])

    return dict(
        zip(
            MEASURED,
            (
                of("full load", "k_gamma"), of("moment", "k_gamma"),
                100.0 * (of("full load", "row_force_max_N") / ROW_N - 1.0),
                abs(of("thrust", "carrier_along_um") - of("full load", "carrier_along_um")),
            ), strict=True,
        )
    )  # fmt: skip


def differing(rows: Sequence[Row]) -> list[str]:
    """Return the keys that differ between designs and are not followed from others."""
    names = list(rows[0])
    inputs = names[2 : next(i for i, name in enumerate(names) if name.endswith("k_gamma"))]
    return [name for name in inputs if len({row[name] for row in rows}) > 1 and not _follows(name)]


def _follows(name: str) -> bool:
    return name in ("planetary.sun.profile_shift", "planetary.ring.profile_shift")


def tables(rows: Sequence[Row], held: Sequence[Row]) -> str:
    """Return all tables of the page."""
    base, found, unknowns = figures(rows[0]), [figures(row) for row in rows], differing(rows)
    spans: dict[str, dict[str, tuple[float, float]]] = {}
    for name in unknowns:
        own = [one for one, row in zip(found, rows, strict=True) if row[name] != rows[0][name]] + [base]
        spans[name] = {key: (min(one[key] for one in own), max(one[key] for one in own)) for key in MEASURED}
    lines = [
        "| figure | measured | computed | lowest | highest | measured in the band | decided by |",
        "|---|---|---|---|---|---|---|",
    ]
    for key, (measured, _) in MEASURED.items():
        low, high = min(one[key] for one in found), max(one[key] for one in found)
        decides = max(unknowns, key=lambda name: spans[name][key][1] - spans[name][key][0])
        inside = "yes" if measured is not None and low <= measured <= high else "**no**"
        cells = f"{measured:g} | {base[key]:.4g} | {low:.4g} | {high:.4g} | {inside} | {label_of(decides)}"
        lines.append(f"| {key} | {cells} |")
    heads = ("K_γ, torque", "K_γ, moment", "row, %", "axial, µm")
    lines += ["", "One unknown at a time, the others as in the first row:", ""]
    lines += [f"| unknown | values | {' | '.join(heads)} |", f"|---|---|{'---|' * len(heads)}"]
    lines.append(f"| none | | {' | '.join(f'{value:.4g}' for value in base.values())} |")
    for name in unknowns:
        values = ", ".join(f"{float(value):g}" for value in dict.fromkeys(row[name] for row in rows))
        own_cells = [f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}" for low, high in spans[name].values()]
        lines.append(f"| `{name}` | {values} | {' | '.join(own_cells)} |")
    lines += ["", "Several at once (`nrel_750kw_sun_held.toml`), K_γ measured below 1.10 with tapered rollers:", ""]
    lines += [f"| design | {' | '.join(heads)} |", f"|---|{'---|' * len(heads)}"]
    names = (
        "sun held: shaft of 160 mm on a spline of 1e10 N mm/rad", "the same, 0.4 mm of clearance, one pin off by 40 µm",
        "tapered rollers, sun as in the case", "tapered rollers, sun held",
    )  # fmt: skip
    for name, row in zip(names, held, strict=True):
        lines.append(f"| {name} | {' | '.join(f'{value:.4g}' for value in figures(row).values())} |")
    lines += ["", "What a force across on the sun makes of K_γ, and what gives it:", ""]
    lines += ["| | force across, kN | moment at the spline, kN m | K_γ |", "|---|---|---|---|"]
    for friction in (DRY, MOST):
        moment = 2.0 / math.pi * friction * TORQUE
        force = moment / LEVER
        factor = 1.0 + 2.0 * force / (3.0 * MESH_N)
        cells = f"{force / 1e3:.3g} | {moment / 1e6:.3g} | {factor:.4g}"
        lines.append(f"| friction of {friction:g} in the spline, at most | {cells} |")
    for measured in (1.08, 1.16):
        force = 1.5 * (measured - 1.0) * MESH_N
        lines.append(f"| as measured | {force / 1e3:.3g} | {force * LEVER / 1e6:.3g} | {measured:g} |")
    return "\n".join(lines)


def write(folder: Path, page: Path) -> None:
    """Write the tables between their marks in the page."""
    text, made = page.read_text(encoding="utf-8"), tables(rows_of(folder / CAMPAIGN), rows_of(folder / HELD))
    before, rest = text.split(MARKS[0])
    page.write_text(f"{before}{MARKS[0]}\n{made}\n{MARKS[1]}{rest.split(MARKS[1])[1]}", encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]), Path(sys.argv[2]))
