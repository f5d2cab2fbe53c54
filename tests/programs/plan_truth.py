"""What `pmor plan` foretells beside what is taken, over all shipped files.

    python -m tests.programs.plan_truth parts.json cases/manual/plan.md [NAME ...]

runs every command that answers a file, one after the other on one core, and writes the table. Times are those of the
processor, of the process and all of its children. Files that `parts.json` has are not run again; names run those alone.
What takes too long to be run whole has seconds and words there: of a part, scaled, and which; the entry "" says how the
machine was.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pmor
from pmor.app.capabilities import plan_of
from pmor.app.records import typed

CASES = Path(__file__).parents[2] / "cases"
FACTOR = 2.0
# Copies of other sizes: file, command, and what is changed in the text.
COPIES = (
    ("helical_design", "design", {"draws = 32": "draws = 8", "samples = 128": "samples = 32",
                                  "angles = 24": "angles = 12", "points = 2": "points = 1"}),
    ("helical_dynamics", "dynamics", {"torques_Nm = [100.0, 200.0]": "torques_Nm = [200.0]"}),
    ("planetary_campaign", "campaign", {"from = 15, to = 26, steps = 12": "from = 15, to = 26, steps = 6",
                                        "from = 52, to = 96, steps = 45": "from = 60, to = 81, steps = 22",
                                        "planets.count = [3, 4, 5]": "planets.count = [3]"}),
    ("campaign", "campaign", {"from = 51, to = 55, steps = 5": "from = 51, to = 52, steps = 2",
                              "helix_angle_deg = [0.0, 8.0, 12.0, 16.0]": "helix_angle_deg = [0.0, 12.0]"}),
)  # fmt: skip


def taken_seconds(command: str, file: Path) -> float:
    """Return the processor time of a command on a file, s; an exit code of 3 is an answer."""
    with tempfile.TemporaryDirectory() as folder:
        before = _children()
        words = [*typed(command).split()[1:], str(file), "--out", f"{folder}/out", "--jobs", "1"]
        done = subprocess.run(  # where no gears are kept, neither beside the results nor those of campaigns
            [sys.executable, "-m", "pmor", *words], check=False, capture_output=True, cwd=folder,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )  # fmt: skip
        if done.returncode not in (0, 3):
            raise SystemExit(f"pmor {command} {file}: {done.stderr.decode()[-500:]}")
        return _children() - before


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


Row = tuple[str, str, float, float, str]


def table(rows: list[Row], left: list[str], machine: str) -> str:
    """Return the table of files, commands, planned and taken seconds, and what was run in Markdown."""
    off = [row for row in rows if not 1.0 / FACTOR <= row[2] / row[3] <= FACTOR]
    lines = [
        "# What `pmor plan` foretells, and what is taken", "",
        "Shipped files and copies of other sizes, on one core with compiled kernels and nothing kept; seconds of the "
        "processor. Made by `python -m tests.programs.plan_truth parts.json cases/manual/plan.md`. " + machine, "",
        f"{len(rows) - len(off)} of {len(rows)} are within a factor of two. Not run: {', '.join(left) or 'none'}.", "",
        "| file | command | plan, s | taken, s | plan / taken | run |", "|---|---|---|---|---|---|",
        *(
            f"| {name} | {typed(command)} | {planned:.1f} | {taken:.1f} | {planned / taken:.2f} | {part} |"
            for name, command, planned, taken, part in rows
        ),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def main(parts: Path, out: Path, names: list[str]) -> None:
    """Measure what is not measured yet, and write the table."""
    known, rows, left = json.loads(parts.read_text()) if parts.exists() else {}, list[Row](), list[str]()

    def add(key: str, command: str, file: Path, planned: float, how: str) -> None:
        if file.stem in names or (key not in known and not names):
            known[key] = round(taken_seconds(command, file), 1)
            parts.write_text(json.dumps(known, indent=1))
            print(f"{key}: {planned:.1f} s planned, {known[key]:.1f} s taken", file=sys.stderr)
        if key not in known:
            left.append(key)
        else:
            seconds, part = known[key] if isinstance(known[key], list) else (known[key], how)
            rows.append((file.stem, command, planned, seconds, part))

    for file in sorted(CASES.glob("*.toml")):
        for command, planned in plan_of(pmor.load(file)).seconds.items():
            add(f"{command} {file.stem}", command, file, planned, "whole")
    for name, command, changes in COPIES:
        with tempfile.TemporaryDirectory() as folder:
            for one in CASES.glob("*.toml"):
                shutil.copy(one, folder)
            file = Path(folder) / f"{name}.toml"
            text = file.read_text(encoding="utf-8")
            for words, others in changes.items():
                assert words in text
                text = text.replace(words, others)
            file.write_text(text, encoding="utf-8")
            planned = plan_of(pmor.load(file)).seconds[command]
            add(f"{command} {name}, changed", command, file, planned, f"a copy with {', '.join(changes.values())}")
    out.write_text(table(rows, left, known.get("", "")), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
