"""Random machines whose verdicts are written into their files and solved anew: what was promised, and what is kept.

    python -m tests.programs.verdicts [pairs sets gearboxes [rounds [seed]]]

Each round goes on from the machine that the one before has left.
"""

import re
import sys

import numpy as np

from tests.support.random_machines import figure_of, random_machine, solved, written_into

# Of what an advice promises.
KEPT = 0.8


def main(pairs=36, sets=14, gearboxes=10, rounds=1, seed=42):
    """Print a line for each machine and round, and what is kept in all."""
    kinds, kept, silent = dict[str, list[float]](), list[float](), 0
    for kind, count in (("pair", pairs), ("set", sets), ("gearbox", gearboxes)):
        for number in range(count):
            machine = random_machine(np.random.default_rng([seed, number, len(kind)]), kind)
            before = solved(machine)
            for turn in range(rounds):
                advised, said = before["verdict"], f"{kind} {number}, {turn + 1}: "
                if advised["advice"] is None:
                    silent += 1
                    print(f"{said}{advised['not_good']} -> {advised['try_first']}", flush=True)
                    break
                for line, advice in (("try_first", advised["advice"]), ("then", advised["then_advice"])):
                    if advice is None:
                        continue
                    machine = written_into(machine, advice["changes"])
                    after = solved(machine)
                    ratio = (advice["before"] - figure_of(after, advice)) / (advice["before"] - advice["after"])
                    kept.append(ratio)
                    told = re.sub(r"-?\d[\d.e-]*", "..", advice["what"])
                    kinds.setdefault(f"{line}, {told}: {advice['figure']}", []).append(ratio)
                    print(f"{said}{advised[line]} -> kept {ratio:.3f}", flush=True)
                before = after
    print(f"\n{'advice, and the figure that it is to better':90} machines  least kept")
    for name, ratios in sorted(kinds.items()):
        print(f"{name:90} {len(ratios):8} {min(ratios):11.3f}")
    print(f"{'no advice':90} {silent:8}")
    print(f"{len(kept)} advise; least kept {min(kept):.3f}, {sum(one < KEPT for one in kept)} below {KEPT}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
