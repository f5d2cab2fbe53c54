"""One broken file after the other, in one process: what becomes of it.

    python -m tests.support.fuzz_trials FOLDER FILE START STOP STEP

does the trials of a range of numbers on what `prepare` left in a folder. A line of JSON stands in the file before and
after each: a process that dies or hangs names the trial that did it. A number is a seed: each trial can be had again.
"""

import contextlib
import csv
import json
import resource
import shutil
import sys
import time
import traceback
from pathlib import Path

import h5py
import numpy as np

from pmor.case import basis_key, load_case
from pmor.core.errors import PmorError
from pmor.pair.model import elastic_model, mesh_model
from pmor.storage.basis_file import read_basis
from pmor.storage.manifest import MANIFEST, record
from pmor.storage.results_folder import working_folder
from pmor.storage.snapshot_file import write_snapshots
from pmor.work.offline import parts_of, run_offline
from pmor_offline.sampling import planned_positions
from pmor_offline.snapshots import solve_snapshots
from tests.support.broken_hdf5 import break_file
from tests.support.refusals import command
from tests.support.small_case import case_text
from tests.support.stored_files import assert_same_basis

KINDS = ("basis", "basis", "snapshots")
SAME = 1e-9
# Results that say how long something took, or how large a file is.
INCIDENTAL = {"offline_s", "basis_mib", "online_ms_per_position", "full_ms_per_position", "case", "title"}
MESH = {"profile_elements": 3, "width_elements": 1}
QUIET = {"plots": False, "report": False}
FAMILIES = {
    "flank_lines": {},
    "line": {"contact": {"scheme": "line"}},
    "positions": {"reduction": {"shapes": "positions", "interpolation": "cubic"}},
    "pod": {"reduction": {"shapes": "pod", "interpolation": "linear"}},
    "static_modes": {"reduction": {"shapes": "static_modes"}},
    "without_estimate": {"reduction": {"error_estimate": False}},
}


class Wrong(Exception):
    """What must not happen, happened."""


def prepare(folder, families=tuple(FAMILIES)):
    """Make sound files to break: bases with what they say, and the snapshots of an interrupted training."""
    for family in families:
        own = folder / family
        own.mkdir(parents=True)
        (own / "tiny.toml").write_text(case_text(mesh=MESH, output=QUIET, **FAMILIES[family]))
        case = load_case(own / "tiny.toml")
        run_offline(case, elastic_model(case, mesh_model(case)), own / "basis.h5")
        assert command("online", own / "basis.h5", "-o", own / "out")[0] == 0
    case, model = load_sound(folder)
    parts = working_folder(parts_of(folder / "resumed.h5"))
    for number, position in enumerate(planned_positions(case.offline, model.mesh.meshed.pair)):
        write_snapshots(parts / f"angle_{number:05d}.h5", solve_snapshots(model, position), basis_key(case))


def load_sound(folder):
    """Case and full FE of the training that is resumed."""
    case = load_case(folder / "flank_lines" / "tiny.toml")
    return case, elastic_model(case, mesh_model(case))


def warm_up(folder, sound):
    """Load what is loaded once: it is no trial's."""
    for source in sorted(folder.iterdir()):
        if (source / "basis.h5").exists():
            _command(["online", str(source / "basis.h5"), "-o", str(folder / "warm" / source.name)], folder)
            _command(["info", str(source / "basis.h5")], folder)
    parts = folder / "warm.h5.parts"
    shutil.copytree(folder / "resumed.h5.parts", parts, dirs_exist_ok=True)
    min(parts.glob("*.h5")).unlink()  # so that something is solved
    run_offline(*sound, folder / "warm.h5", resume=True, overwrite=True)


# --- one trial -------------------------------------------------------------------------------------------------------


def trial(number, folder, sound):
    """Break a file and use it: what was done to it and how it ended; an end that begins with ! must not be.

    Parameters
    ----------
    number : int
    folder : Path
        Of `prepare`.
    sound : tuple
        Of `load_sound`.
    """
    rng = np.random.default_rng([20160919, number])
    kind = KINDS[number % len(KINDS)]
    place = folder / "trial"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    began, memory, size, done = time.process_time(), _peak_reset(), 0, []
    try:
        if kind == "basis":
            families = [path.name for path in sorted(folder.iterdir()) if (path / "basis.h5").exists()]
            source = folder / families[int(rng.integers(len(families)))]
            shutil.copy(source / "basis.h5", place)
            done = [source.name, *break_file(place / "basis.h5", rng)]
            size = (place / "basis.h5").stat().st_size
            expected = _what_its_case_asks(place, source, folder) if "case_text" in done else source / "out"
            memory = _peak_reset()
            end = _basis(place, expected)
        else:
            broken, done = _broken_snapshots(place, folder, rng)
            size, memory = broken.stat().st_size, _peak_reset()
            end = _snapshots(place, folder, broken, "manifest forged" in done, sound)
    except Wrong as wrong:
        end = f"!{wrong}"
    except Exception:
        end = f"!{traceback.format_exc()}"
    grown = _peak() - memory
    seconds = time.process_time() - began
    return {"number": number, "kind": kind, "done": done, "end": end, "grown": grown, "size": size, "seconds": seconds}


def _what_its_case_asks(place, source, folder):
    """Give the sound basis the case text of a broken one, which may ask for another sweep: its results, if any."""
    asked = folder / "asked"
    shutil.rmtree(asked, ignore_errors=True)
    asked.mkdir()
    with h5py.File(place / "basis.h5") as file, contextlib.suppress(KeyError, AttributeError):
        (asked / "tiny.toml").write_bytes(file.attrs["case_text"])
    _command(["online", str(source / "basis.h5"), "--case", "tiny.toml", "-o", "out"], asked)
    return asked / "out"


def _basis(place, expected):
    ends = []
    before = {path.name for path in place.iterdir()}
    for arguments in (["info", "basis.h5"], ["online", "basis.h5"]):
        code, text, errors = _command(arguments, place)
        unprintable = [c for c in text if not c.isprintable() and c != "\n"]
        if unprintable:
            raise Wrong(f"{arguments[0]} printed {unprintable[0]!r}")
        ends.append(_end(code, errors))
    new = {path.name for path in place.iterdir()} - before
    if not new <= {"out"}:
        raise Wrong(f"wrote {new}")
    if code != 2:
        results = [path.parent for path in (place / "out").rglob("summary.json")]
        if len(results) != 1 or results[0].parent != place / "out":
            raise Wrong(f"wrote into {results}")
        ends.append(_same_results(results[0], expected, named=code == 3))
    return ", ".join(ends)


def _same_results(found, expected, named):
    """Whether results are those of the sound file; positions that are named as failed count for nothing."""
    for a, b in zip(_rows(found), _rows(expected), strict=True):
        for key, value in b.items():
            if not _close(a[key], value) and not (named and a[key] == ""):
                raise Wrong(f"wrong number: {key} is {a[key]}, and should be {value}")
    a, b = (json.loads((folder / "summary.json").read_text()) for folder in (found, expected))
    different = [key for key, value in b.items() if key not in INCIDENTAL and not _close(a[key], value)]
    if different and not named:
        raise Wrong(f"wrong number: {different[0]} is {a[different[0]]}, and should be {b[different[0]]}")
    return "same"


def _broken_snapshots(place, folder, rng):
    """Break one file of an interrupted training: the file, and what was done."""
    parts = shutil.copytree(folder / "resumed.h5.parts", place / "resumed.h5.parts")
    names = sorted(path.name for path in parts.glob("angle*"))
    broken = parts / names[rng.integers(len(names))]
    done = break_file(broken, rng)
    if rng.random() < 0.1:
        names.remove(broken.name)
        shutil.copy(broken, parts / names[rng.integers(len(names))])
        done.append("copied over another")
    if rng.random() < 0.5:
        done.append("manifest forged")
        for part in parts.glob("angle*"):
            record(part)
    return broken, done


def _snapshots(place, folder, broken, forged, sound):
    """Resume a training of which one file is broken: it must end with the same basis.

    Unless the manifest is forged as well: then nobody can tell, and all that is asked for is an end in words.
    """
    case, elastic = sound
    parts = broken.parent
    ends = [_end(*_command(["info", str(broken)], place)[::2])]
    try:
        run_offline(case, elastic, place / "resumed.h5", resume=True)
        if forged:
            read_basis(place / "resumed.h5")
    except PmorError as error:
        if not forged:
            raise
        return ", ".join([*ends, f"{type(error).__name__} {error.exit_code}"])
    if forged:
        return ", ".join([*ends, "taken over"])
    if {path.name for path in place.iterdir()} - {"resumed.h5", "elsewhere.raw", "resumed.h5.parts"}:
        raise Wrong(f"wrote {list(place.iterdir())}")
    left = [path.name for path in parts.iterdir()] if parts.exists() else []
    if set(left) - {"elsewhere.raw", MANIFEST}:
        raise Wrong(f"left {left}")
    try:
        assert_same_basis(place / "resumed.h5", folder / "flank_lines" / "basis.h5", SAME)
    except AssertionError as error:
        raise Wrong(f"wrong number in the resumed training: {error}") from error
    return ", ".join([*ends, "same"])


def _command(arguments, place):
    """Run a command in a folder: exit code, what it printed, its errors."""
    with contextlib.chdir(place):
        return command(*arguments)


def _end(code, errors):
    lines = errors.splitlines()
    said = [line for line in lines if line.startswith("pmor: error: ")]
    plain = all(line.isprintable() and line.startswith("pmor: ") for line in lines)
    in_words = plain and len(said) == 1 and said[0] == lines[-1]
    if code in (2, 3) and in_words:
        return "refused" if code == 2 else "named"
    if code == 0 and not said:
        return "accepted"
    raise Wrong(f"exit code {code} with {errors!r}")


def _rows(folder):
    with (folder / "ste.csv").open() as file:
        return list(csv.DictReader(file))


def _close(found, expected):
    if isinstance(expected, list):
        return isinstance(found, list) and len(found) == len(expected) and all(map(_close, found, expected))
    try:
        return abs(float(found) - float(expected)) <= SAME * max(abs(float(expected)), 1e-6)
    except (TypeError, ValueError):
        return found == expected


# --- memory, and the process -----------------------------------------------------------------------------------------


def _peak_reset():
    """Forget the largest resident memory so far: what it is now, bytes."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        pass  # then the peak only ever grows, and one trial is blamed once
    return _status("VmRSS")


def _peak():
    return _status("VmHWM")


def _status(key):
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return 0
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(f"{key}:"))


def run(folder, said, numbers):
    """Do trials; write for each a line before it and one with its outcome."""
    sound = load_sound(folder)
    with said.open("a") as file:

        def say(**found):
            file.write(json.dumps(found) + "\n")
            file.flush()

        warm_up(folder, sound)
        limit = _status("VmSize") + (1 << 30)
        resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))
        for number in numbers:
            say(begin=number)
            say(**trial(number, folder, sound))


if __name__ == "__main__":
    run(Path(sys.argv[1]), Path(sys.argv[2]), range(*map(int, sys.argv[3:])))
