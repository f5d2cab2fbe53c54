"""The solving process of a campaign with made-up results, and with faults where the environment asks for them.

FAULTS is a folder; a file in it called after the number of a design says what befalls it, and how often.
"""

import json
import os
import sys
import time
from pathlib import Path
from types import ModuleType

from pmor.campaigns.rows import plain_row
from pmor.campaigns.solver import main

FOLDER = Path(os.environ["FAULTS"])


def row_of(task, number, design, store):
    fault = FOLDER / str(number)
    if fault.is_file():
        kind, times = json.loads(fault.read_text())
        if times:
            fault.write_text(json.dumps([kind, times - 1]))
            befall(kind)
    if number % 3 == 0:
        return plain_row(task, number, design, "infeasible", f"a third of them, {number}, are none")
    return plain_row(task, number, design, "ok", "", dict.fromkeys(task.results, number / 7.0))


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


def module(name, **contents):
    """Stands in for what loads all of mechanics: a second for each process."""
    sys.modules[f"pmor.campaigns.{name}"] = ModuleType(name)
    vars(sys.modules[f"pmor.campaigns.{name}"]).update(contents)


if __name__ == "__main__":
    module("solve", row_of=row_of)
    module("store", GIB=1.0, Store=None, open_store=lambda folder, limit: None)
    main()
