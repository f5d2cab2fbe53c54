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
import subprocess
import sys
import tempfile
from pathlib import Path

import pmor
from pmor.app.capabilities import plan_of
from pmor.app.records import typed

CASES = Path(__file__).parents[2] / "cases"
FACTOR = 2.0


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


def table(rows: list[tuple[str, str, float, float, str]], machine: str) -> str:
    """Return the table of files, commands, planned and taken seconds, and what was run in Markdown."""
    off = [row for row in rows if not 1.0 / FACTOR <= row[2] / row[3] <= FACTOR]
    scaled = sum(bool(part) for *_, part in rows)
    lines = [
        "# What `pmor plan` foretells, and what is taken", "",
        "All shipped files, on one core with compiled kernels and nothing kept; seconds of the processor. Made by "
        f"`python -m tests.programs.plan_truth parts.json cases/manual/plan.md`. {machine}", "",
        f"{len(rows) - len(off)} of {len(rows)} are within a factor of two; {scaled} of them from a part of the work, "
        "scaled.", "",
        "| file | command | plan, s | taken, s | plan / taken | run |", "|---|---|---|---|---|---|",
        *(
            f"| {name} | {typed(command)} | {planned:.1f} | {taken:.1f} | {planned / taken:.2f} | {part or 'whole'} |"
            for name, command, planned, taken, part in rows
        ),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def main(parts: Path, out: Path, names: list[str]) -> None:
    """Measure what is not measured yet, and write the table."""
    taken = json.loads(parts.read_text()) if parts.exists() else {}
    rows = []
    for file in sorted(CASES.glob("*.toml")):
        for command, planned in plan_of(pmor.load(file)).seconds.items():
            key = f"{command} {file.stem}"
            if file.stem in names or (key not in taken and not names):
                taken[key] = round(taken_seconds(command, file), 1)
                parts.write_text(json.dumps(taken, indent=1))
                print(f"{key}: {planned:.1f} s planned, {taken[key]:.1f} s taken", file=sys.stderr)
            if key in taken:
                seconds, part = taken[key] if isinstance(taken[key], list) else (taken[key], "")
                rows.append((file.stem, command, planned, seconds, part))
    out.write_text(table(rows, taken.get("", "")), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
