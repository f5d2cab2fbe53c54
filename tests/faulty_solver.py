"""The solving process of a campaign with made-up results, and with faults where the environment asks for them.

FAULTS is a folder; a file in it called after the number of a design says what befalls it, and how often.
"""

import json
import os
import sys
import time
from pathlib import Path

import pmor.lab.campaign.solve
from pmor.lab.campaign.relations import with_relations
from pmor.lab.campaign.solve import plain_row
from pmor.lab.campaign.solver import main

FOLDER = Path(os.environ["FAULTS"])


def row_of(task, number, design, store):
    fault = FOLDER / str(number)
    if fault.is_file():
        kind, times = json.loads(fault.read_text())
        if times:
            fault.write_text(json.dumps([kind, times - 1]))
            befall(kind)
    complete = with_relations(task.base_text, design, task.relations)
    if number % 3 == 0:
        return plain_row(task, number, complete, "infeasible", f"a third of them, {number}, are none")
    return plain_row(task, number, complete, "ok", "", dict.fromkeys(task.results, number / 7.0))


def befall(kind):
    if kind == "hang":
        time.sleep(60.0)
    elif kind == "die":
        os.kill(os.getpid(), 9)
    elif kind == "leave":
        os._exit(5)
    elif kind == "memory":
        raise MemoryError
    elif kind == "defect":
        raise ZeroDivisionError("division by zero")


pmor.lab.campaign.solve.row_of = row_of
sys.modules["pmor.lab.campaign.solve"].row_of = row_of

if __name__ == "__main__":
    main()
