"""Write the table of sets that are far from the usual: python -m tests.programs.set_stability [FILE]."""

import sys
from pathlib import Path

from tests.support.set_variants import BALANCED, MOST_STEPS, SMOOTH, VARIANTS, measure

RESULTS = Path(__file__).parents[2] / "cases" / "results" / "stability" / "sets.md"
HEAD = f"""# Stability: rings and planetary sets

Each set is far from the usual in one respect: 18/18/54 teeth, module 4 mm, 300 N m on the sun, on a coarse mesh, at six
positions over a pitch. ok: all positions converged in at most {MOST_STEPS} Newton steps, nothing pulls, torques and
forces on all free movements balance to {BALANCED:g}, and the transmission error is the mean of its neighbours a
ten-thousandth of a pitch away to {SMOOTH:g}. refused: a check before the solution says why.
Written by `python -m tests.programs.set_stability`.
"""


def page(entries):
    """Return the table of all entries, by group."""
    ok, refused = sum(entry.ok for entry in entries), sum(entry.explained for entry in entries)
    failed = len(entries) - ok - refused
    lines = [HEAD, f"{len(entries)} variants: {ok} ok, {refused} refused as they should be, {failed} failed."]
    for group in dict.fromkeys(entry.group for entry in entries):
        lines += ["", f"## {group}", "", "| variant | result | steps | balance | neighbours | STE, µm | K_γ |"]
        lines.append("| --- | --- | --- | --- | --- | --- | --- |")
        own = [entry for entry in entries if entry.group == group]
        for entry in own:
            result = "ok" if entry.ok else "refused" if entry.explained else "failed"
            numbers = (entry.steps, entry.balance, entry.difference, entry.ste_mean_um, entry.k_gamma)
            cells = ["–" if number is None else f"{number:.4g}" for number in numbers]
            lines.append(f"| {' | '.join([entry.name, result, *cells])} |")
        lines += [f"\n{entry.name}: {entry.note}" for entry in own if entry.note]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else RESULTS
    path.write_text(page([measure(name) for name in VARIANTS]))
