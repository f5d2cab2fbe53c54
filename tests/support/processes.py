"""Run the command line as a user does: as a process of its own, on the checkout, with warm kernels."""

import os
import resource
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]


def start(*arguments, **more):
    """Start `pmor` with arguments; BLAS on one thread, so that every run does the same arithmetic."""
    one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, "-m", "pmor.app.cli", *map(str, arguments)], cwd=ROOT, env={**os.environ, **one_thread},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more,
    )  # fmt: skip


def finish(process, timeout=300):
    """Wait for a process: (exit code, what it printed, its errors)."""
    text, errors = process.communicate(timeout=timeout)
    return process.returncode, text, complaints(errors)


def complaints(errors):
    """What a process says on its error stream, beside its stages and that kernels are compiled: it may be the first."""
    told = [line for line in errors.splitlines(True) if not line.endswith(" ...\n")]
    return "".join(line for line in told if not line.startswith("pmor: compiling "))


@contextmanager
def small_disk(folder, size):
    """A small file system, or a plain folder where none may be mounted: (folder, whether it is small)."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    small = shutil.which("mount") is not None and subprocess.run(mount, capture_output=True).returncode == 0
    yield folder, small
    if small:
        subprocess.run(["umount", str(folder)], check=True)


@contextmanager
def full_disk(folder, small, free, files):
    """Leave so many bytes on a small disk, or limit each of so many files: keywords for `start`; None: no change."""
    ballast = folder / "ballast"
    more = {}
    if free is not None and small:
        ballast.write_bytes(bytes(max(shutil.disk_usage(folder).free - free, 0)))
    elif free is not None:
        limit = (max(free // files, 1),) * 2  # of one file, where it was of all
        more["preexec_fn"] = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    yield more
    ballast.unlink(missing_ok=True)
