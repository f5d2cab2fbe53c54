"""Two versions of the program compared number by number.

    python -m tests.programs.same_numbers collect FOLDER [--pmor "COMMAND"]     # each version into its own folder
    python -m tests.programs.same_numbers compare BEFORE AFTER

`collect` runs the cases, a small pair with each contact scheme and each reduction, misaligned and plane-strain pairs,
the short study, the stability matrix, sets, gearboxes, designs, campaigns, pairs in motion and files of other formats
through the command line, so that it works with any version. `compare` checks STE, shares, error estimates and Newton
steps; STE to 1e-10, relative. The datum of the STE may move by one constant per sweep of misaligned axes. Numbers of
sets and gearboxes hold to 1e-10 of the largest one of their key, those of designs, campaigns and motion to 1e-6.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping
from itertools import zip_longest
from pathlib import Path
from typing import Any

CASES = Path(__file__).parents[2] / "cases"
STE_TOLERANCE = 1e-10  # relative; sums in another order are allowed, other mechanics are not
ESTIMATE_TOLERANCE = 1e-7  # of the largest estimate of a sweep: derivatives of energies that all but cancel
PRODUCT_TOLERANCE = 1e-6  # relative; optima and folds are found to their own tolerances
TABLE_TOLERANCE = 1e-7  # differences of models, which are relative already
SHIPPED = (
    "small_spur", "unequal_pair", "paper_spur", "paper_hermite", "paper_64", "paper_misaligned", "paper_relief",
    "osu_spur", "helical", "fva_high_speed",
)  # fmt: skip
SETS = ("planetary_stage", "stepped_planets", "power_split", "idler_chain", "nrel_5mw_second_stage")
GEARBOXES = ("two_stage_gearbox", "wind_turbine_gearbox")
# Files of the products, and of their numbers that hold to their own tolerances.
ANSWERS = dict.fromkeys(SETS, "set.json") | dict.fromkeys((*GEARBOXES, "gearbox_rexs"), "gearbox.json")
PRODUCTS = {
    "osu_design": ("design", "design.json"),
    "helical_design": ("design", "design.json"),
    "planetary_design": ("design", "design.json"),
    "two_stage_design": ("design", "design.json"),
    "osu_dynamics": ("dynamics", "dynamics.json"),
    "helical_dynamics": ("dynamics", "dynamics.json"),
    "campaign": ("campaign", "campaign.json"),
    "planetary_campaign": ("campaign", "campaign.json"),
}
# Of files of other formats: what may differ.
DATED = re.compile(r'(date|applicationVersion)="[^"]*"|pmor \d[\w.]*')
# Sources of exports below `collect`'s folder or the cases, formats, targets; text that must stay to the letter.
EXPORTS = {
    "small_spur.csv": ("small_spur/basis.h5", "csv"),
    "small_spur.rexs": ("small_spur/basis.h5", "rexs"),
    "gearbox.toml": ("gearbox.rexs", "gearbox"),
    "planetary_stage.rexs": ("planetary_stage.toml", "rexs"),
    "two_stage_gearbox.rexs": ("two_stage_gearbox.toml", "rexs"),
}
# Endings of keys of run times and machines.
UNCOMPARED = ("seconds", "_ms", "_s", "_mib", "machine", "version", "created")
SCHEMES = ("line", "direct", "paper", "facet")
REDUCTIONS = {
    "positions": {"shapes": "positions"},
    "positions_cubic": {"shapes": "positions", "interpolation": "cubic"},
    "pod": {"shapes": "pod"},
    "global_pod": {"shapes": "global_pod"},
    "static_modes": {"shapes": "static_modes"},
}
TILTED = {"in_plane_um": [-10.0, 10.0], "out_of_plane_um": [0.0, 8.0]}
# Lists of a study and of a stability matrix, and what must not move in their rows.
TABLES = {
    "study/study.json": (
        "rows", ("ste_mean_um", "ste_peak_to_peak_um", "shape_error_um", "ripple_um", "rom_vs_full_ste_max_rel"),
    ),
    "stability/stability.json": ("entries", ("converged", "difference_rel", "ok")),
}  # fmt: skip


def variants() -> dict[str, dict[str, dict[str, Any]]]:
    """Return changes to the small pair by section, by the name of the variant."""
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for scheme in SCHEMES:
        found[f"scheme_{scheme}"] = {"contact": {"scheme": scheme}}
        found[f"whole_{scheme}"] = {"contact": {"scheme": scheme}, "mesh": {"width": "whole"}}
    for name, reduction in REDUCTIONS.items():
        found[f"{name}_direct"] = {"contact": {"scheme": "direct"}, "reduction": reduction}
    for scheme in ("line", "direct"):
        tilt = {"in_plane_um": 5.0, "out_of_plane_um": 4.0}
        found[f"tilted_{scheme}"] = {"contact": {"scheme": scheme}, "offline": TILTED, "misalignment": tilt}
    found["plane_strain"] = {"contact": {"scheme": "line"}, "mesh": {"width": "plane_strain"}}
    found["slave_both"] = {"contact": {"slave": "both"}}
    found["hex8"] = {"mesh": {"element": "hex8"}}
    found["sobol"] = {"contact": {"scheme": "direct"}, "offline": {"sampling": "sobol", "solves": 24, **TILTED}}
    return found


def collect(folder: Path, pmor: list[str]) -> None:
    """Run everything with one version of the program."""
    folder.mkdir(parents=True)
    texts = {name: (CASES / f"{name}.toml").read_text(encoding="utf-8") for name in SHIPPED}
    texts |= {f"small_{name}": changed(texts["small_spur"], changes) for name, changes in variants().items()}
    for name, text in texts.items():
        case = folder / f"{name}.toml"
        case.write_text(changed(text, {"output": {"plots": False, "report": False}}), encoding="utf-8")
        run([*pmor, "run", str(case), "--out", str(folder / name)])
    known = subprocess.run([*pmor, "--help"], capture_output=True, text=True, check=True).stdout.split()
    lab = ["lab"] if "lab" in known else []
    study = [*lab, "study", str(CASES / "paper_study.toml"), "--quick", "--out", str(folder / "study")]
    stability = [*lab, "stability", str(CASES / "paper_spur.toml"), "--out", str(folder / "stability"), "--jobs", "2"]
    run([*pmor, *study])
    run([*pmor, *stability])
    for name, (command, _) in PRODUCTS.items():
        run([*pmor, command, str(CASES / f"{name}.toml"), "--out", str(folder / name)])
    for names, command in ((SETS, "set"), (GEARBOXES, "gearbox"), (("gearbox_rexs",), "gearbox")):
        for name in names:
            file = CASES / f"{name.replace('_rexs', '.rexs') if '_rexs' in name else name + '.toml'}"
            run([*pmor, command if command in known else "run", str(file), "--out", str(folder / name)])
    for target, (source, form) in EXPORTS.items():
        path = folder / source if "/" in source else CASES / source
        run([*pmor, "export", str(path), "--to", form, "-o", str(folder / "exports" / target)])


def run(command: list[str]) -> None:
    """Run a command; a position that does not converge (3) is a result like any other."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    print(f"{done.returncode}  {shlex.join(command[-4:])}", flush=True)
    if done.returncode not in (0, 3):
        print(done.stderr, file=sys.stderr)


def changed(text: str, changes: Mapping[str, Mapping[str, Any]]) -> str:
    """Return a case's text with some keys changed."""
    document: dict[str, Any] = tomllib.loads(text)
    for section, keys in changes.items():
        document[section] = document.get(section, {}) | dict(keys)
    return "\n".join(written(document)) + "\n"


def written(section: Mapping[str, Any], name: str = "") -> Iterator[str]:
    """Write the keys of a section as lines of TOML, then the sections and the lists of sections below it."""
    below = {key: value for key, value in section.items() if isinstance(value, dict) or dicts(value)}
    yield from (f"{key} = {json.dumps(value)}" for key, value in section.items() if key not in below)
    for key, value in below.items():
        place = f"{name}.{key}" if name else key
        head = f"[[{place}]]" if isinstance(value, list) else f"[{place}]"
        for one in value if isinstance(value, list) else [value]:
            yield head
            yield from written(one, place)


def dicts(value: Any) -> bool:
    """Whether a value is a list of sections."""
    return isinstance(value, list) and bool(value) and isinstance(value[0], dict)


def compare(before: Path, after: Path) -> int:
    """Print the largest differences; return how many things differ by more than they may."""
    problems = [text for path in sorted(before.glob("*/ste.csv")) for text in sweep_differences(path, after)]
    for file, (rows, keys) in TABLES.items():
        problems += file_differences(file, before, after, TABLE_TOLERANCE, lambda content, rows=rows, keys=keys: {
            row.get("name", str(i)): {key: row.get(key) for key in keys} for i, row in enumerate(content[rows])
        })  # fmt: skip
    for name, file in ANSWERS.items():
        problems += file_differences(f"{name}/{file}", before, after, STE_TOLERANCE, lambda content: content)
    for name, (_, file) in PRODUCTS.items():
        problems += file_differences(f"{name}/{file}", before, after, PRODUCT_TOLERANCE, lambda content: content)
    problems += text_differences(before / "exports", after / "exports")
    print("\n".join(problems) or "the same")
    return len(problems)


def sweep_differences(path: Path, after: Path) -> Iterator[str]:
    """Name what differs between two sweeps of a case."""
    name = path.parent.name
    other = after / name / "ste.csv"
    if not other.exists():
        yield f"{name}: no results"
        return
    rows, others = read(path), read(other)
    if len(rows) != len(others):
        yield f"{name}: {len(rows)} rows, now {len(others)}"
        return
    moved = datum(rows, others)
    for row in others:
        if row["ste_um"]:
            row["ste_um"] = repr(float(row["ste_um"]) - moved)
    ste = worst(rows, others, "ste_um", lambda a: abs(a))
    estimates = [abs(float(r["ste_error_estimate_um"] or 0.0)) for r in rows]
    estimate = worst(rows, others, "ste_error_estimate_um", lambda _: max(estimates) or 1.0)
    shares = [key for key in rows[0] if key.startswith("share_pair_")]
    share = max(worst(rows, others, key, lambda _: 1.0) for key in shares)
    steps = sum(a["newton_steps"] != b["newton_steps"] for a, b in zip(rows, others, strict=True))
    print(
        f"{name:32s} STE {ste:8.1e}  datum {moved:+.4f} um  share {share:8.1e}  estimate {estimate:8.1e}  "
        f"other steps {steps}"
    )
    misaligned = "[misalignment]" in path.parent.with_suffix(".toml").read_text(encoding="utf-8")
    if ste > STE_TOLERANCE or share > STE_TOLERANCE or estimate > ESTIMATE_TOLERANCE or steps:
        yield f"{name}: STE {ste:.1e}, share {share:.1e}, estimate {estimate:.1e}, other Newton steps at {steps}"
    if moved and not misaligned:
        yield f"{name}: the datum moved by {moved:.4f} um on aligned axes"


def datum(rows: list[dict[str, str]], others: list[dict[str, str]]) -> float:
    """Return by which constant the STE moved, um; 0 where that is round-off."""
    both = [(float(a["ste_um"]), float(b["ste_um"])) for a, b in zip(rows, others, strict=True)
            if a["ste_um"] and b["ste_um"]]  # fmt: skip
    moved = sum(b - a for a, b in both) / len(both)
    return moved if abs(moved) > STE_TOLERANCE * max(abs(a) for a, _ in both) else 0.0


def file_differences(
    file: str, before: Path, after: Path, tolerance: float, wanted: Callable[[Any], Any]
) -> Iterator[str]:
    """Name the numbers of a JSON file that differ; `wanted` picks them from its content."""
    paths = [folder / file for folder in (before, after)]
    if not all(path.exists() for path in paths):
        yield f"{file}: not there on both sides"
        return
    one, other = (wanted(json.loads(path.read_text(encoding="utf-8"))) for path in paths)
    found = list(differences(one, other, "", tolerance, largest(one)))
    print(f"{file:32s} {len(found)} numbers differ")
    yield from (f"{file}: {text}" for text in found[:20])


def differences(
    one: Any, other: Any, place: str, tolerance: float, scales: Mapping[str, float], key: str = ""
) -> Iterator[str]:
    """Name the places at which two trees of plain data differ; keys may have been added."""
    if isinstance(one, dict) and isinstance(other, dict):
        for name, value in one.items():
            if not name.endswith(UNCOMPARED):
                yield from differences(value, other.get(name), f"{place}/{name}", tolerance, scales, name)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from differences(a, b, f"{place}/{number}", tolerance, scales, key)
    elif one != other:
        numbers = isinstance(one, float) and isinstance(other, int | float)
        if numbers and math.isclose(one, other, rel_tol=tolerance, abs_tol=tolerance * scales[key]):
            return
        yield f"{place} = {one}, now {other}"


def largest(content: Any, key: str = "", found: dict[str, float] | None = None) -> dict[str, float]:
    """Return the largest amount of the numbers of each key: what a rest of round-off is measured by."""
    found = {} if found is None else found
    below = content.items() if isinstance(content, dict) else [(key, one) for one in content]
    for name, value in below:
        if isinstance(value, dict | list):
            largest(value, name, found)
        elif isinstance(value, int | float):
            found[name] = max(found.get(name, 0.0), abs(value))
    return found


def text_differences(before: Path, after: Path) -> Iterator[str]:
    """Name the first line at which files of other formats differ, but for times and versions."""
    for path in sorted(one for one in before.rglob("*") if one.is_file()):
        name = path.relative_to(before)
        if not (after / name).exists():
            yield f"exports/{name}: not there any more"
            continue
        lines, others = (
            DATED.sub("", (folder / name).read_text(encoding="utf-8")).splitlines() for folder in (before, after)
        )
        pairs = ((a, b) for a, b in zip_longest(lines, others, fillvalue="") if a != b)
        yield from (f"exports/{name}: {a.strip()[:100]}, now {b.strip()[:100]}" for a, b in list(pairs)[:3])


def read(path: Path) -> list[dict[str, str]]:
    """Read the rows of a CSV file."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def worst(rows: list[dict[str, str]], others: list[dict[str, str]], key: str, scale: Any) -> float:
    """Return the largest difference of a column, over a scale; infinite where a number is missing on one side."""
    largest = 0.0
    for a, b in zip(rows, others, strict=True):
        if (a.get(key, "") == "") != (b.get(key, "") == ""):
            return float("inf")
        if a.get(key, "") != "":
            largest = max(largest, abs(float(a[key]) - float(b[key])) / scale(float(a[key])))
    return largest


def main() -> int:
    """Collect or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    first = commands.add_parser("collect")
    first.add_argument("folder", type=Path)
    first.add_argument("--pmor", default=f"{sys.executable} -m pmor")
    second = commands.add_parser("compare")
    second.add_argument("before", type=Path)
    second.add_argument("after", type=Path)
    arguments = parser.parse_args()
    if arguments.command == "collect":
        collect(arguments.folder, shlex.split(arguments.pmor))
        return 0
    return 1 if compare(arguments.before, arguments.after) else 0


if __name__ == "__main__":
    sys.exit(main())
