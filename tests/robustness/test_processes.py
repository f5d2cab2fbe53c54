"""Processes that cannot do their work: told in words."""

import subprocess
import sys

from tests.support.processes import ROOT


def test_a_script_without_a_guard_is_told_that_its_processes_need_one(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "import math\nfrom pmor.core.threads import in_order, processes\n"
        "with processes(2) as executor:\n    list(in_order(math.sqrt, [4.0], executor))\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120, cwd=ROOT)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("pmor.core.errors.ExternalProgramError: the executor does no more")
    assert '__name__ == "__main__"' in done.stderr.splitlines()[-1]
