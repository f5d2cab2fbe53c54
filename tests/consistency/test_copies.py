"""Work in a copy of the process: what it finds comes over, and what fails there is done here."""

import subprocess
import sys

CODE = """
import os, threading
from pmor.core.copies import copies, in_a_copy
from pmor.core.progress import told_late

here = os.getpid()
assert copies() or len(os.sched_getaffinity(0)) == 1
with told_late("words"), in_a_copy(lambda: (os.getpid(), bytes(2**20))) as found:
    process, content = found()
assert process != here or not copies()
assert len(content) == 2**20

def fails():
    if os.getpid() != here:
        raise MemoryError
    return "here"

with in_a_copy(fails) as found:
    assert found() == "here"
ended = threading.Event()
threading.Thread(target=ended.wait).start()
assert copies() == 0, "a thread may hold a lock"
with in_a_copy(os.getpid) as found:
    assert found() == here
ended.set()
"""


def test_what_a_copy_finds_comes_over_and_what_fails_there_is_done_here():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")
