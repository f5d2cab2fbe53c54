"""Run the experiment: ``python -m pmor.lab.slices CASE [DIR]``."""

from __future__ import annotations

import sys
from pathlib import Path

from pmor.core.threads import use_one_thread


def main(case_path: str, folder: str | None = None) -> None:
    """Compare a case with its thin slices, and write the page."""
    use_one_thread()  # before anything loads numpy
    from pmor.case import load_case
    from pmor.lab.slices.page import write_slices
    from pmor.lab.slices.run import run_slices
    from pmor.storage.results_folder import default_folder

    case = load_case(case_path)
    out = Path(folder) if folder else default_folder(case.name, "_slices")
    write_slices(case, run_slices(case), out)
    sys.stdout.write(f"results in {out}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
