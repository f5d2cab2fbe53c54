"""One function per command: the one place that knows foundation, offline stage and online stage.

Imports of what is heavy or belongs to a stage stand inside the functions, so that `pmor --help` stays instant.
"""

from pathlib import Path


def run(case_path: Path, out: Path | None = None, jobs: int = 1, overwrite: bool = False) -> None:
    """Do everything that the case asks for: plan, offline if there is no valid basis, sweep, comparison, report."""
    from pmor.case import load_case

    load_case(case_path)
    raise NotImplementedError


def plan(case_path: Path) -> None:
    """Print what will run, and how much of it; runs nothing."""
    from pmor.case import load_case
    from pmor.plan import plan_text

    print(plan_text(load_case(case_path)))


def offline(case_path: Path, basis_path: Path, resume: bool = False, jobs: int = 1, overwrite: bool = False) -> None:
    """Generate the reduced basis of a case and write it to `basis_path`."""
    from pmor.case import load_case

    load_case(case_path)
    raise NotImplementedError


def online(basis_path: Path, out: Path | None = None) -> None:
    """Sweep the static transmission error with the reduced model of a basis file."""
    raise NotImplementedError


def compare(case_path: Path, out: Path | None = None) -> None:
    """Compare the reduced with the full model: error and run time."""
    from pmor.case import load_case

    load_case(case_path)
    raise NotImplementedError


def info(path: Path) -> None:
    """Print what is in an HDF5 file."""
    raise NotImplementedError
