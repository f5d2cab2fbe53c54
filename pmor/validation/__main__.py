"""Make the table: ``python -m pmor.validation [FILE]``."""

from __future__ import annotations

import sys
from pathlib import Path

from pmor.core.threads import use_one_thread

PAGE = "cases/manual/validation.md"


def main(path: str = PAGE) -> int:
    """Write the page; 1 where a figure is farther from its source than allowed."""
    use_one_thread()  # before anything loads numpy
    from pmor.validation.page import write_page

    checks = write_page(Path(path))
    far = [check.quantity for check in checks if not check.holds]
    sys.stdout.write(f"{len(checks)} figures in {path}; too far from their source: {', '.join(far) or 'none'}\n")
    return 1 if far else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
