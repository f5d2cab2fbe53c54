"""A unit for co-simulation (FMU, FMI 2.0): description, C source, and a binary where there is a compiler."""

from __future__ import annotations

import hashlib
import math
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from importlib.resources import files
from pathlib import Path

import numpy as np

from pmor.core.arrays import IntArray
from pmor.dynamics.fmu.description import description
from pmor.dynamics.fmu.law import UnitLaw
from pmor.dynamics.table_cells import COLUMNS, ROWS
from pmor.storage.atomic import atomic_path

SOURCES = ("mesh.c", "table.h")
NUMBERS_PER_LINE = 16
# Seconds for which a compiler may run: the largest tables take one.
COMPILING_S = 120.0
FLAGS = ("-std=c99", "-O2", "-shared", "-fPIC", "-fvisibility=hidden")
# A time stamp for all files in the archive: the same law gives the same bytes.
STAMP = (1980, 1, 1, 0, 0, 0)


def write_fmu(law: UnitLaw, path: Path, overwrite: bool = False) -> bool:
    """Write a unit for co-simulation.

    Parameters
    ----------
    overwrite : bool
        As in `pmor.storage.atomic.atomic_path`.

    Returns
    -------
    bool
        Whether it has a binary for this computer; else whoever takes it compiles the source.
    """
    name = "pmor_" + re.sub(r"\W", "_", law.case.name, flags=re.ASCII)
    source = files("pmor.dynamics.fmu").joinpath("mesh.c").read_text(encoding="utf-8")
    constants = _table_text(law)
    guid = hashlib.sha256((source + constants).encode()).hexdigest()[:32]
    texts = {"mesh.c": source, "table.h": f'#define GUID "{{{guid}}}"\n{constants}'}
    folder, library = _platform(name)
    binary = _compiled(texts, library) if folder else None
    with atomic_path(path, overwrite) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        _add(archive, "modelDescription.xml", description(law, name, guid, SOURCES[:1]))
        for file_name, text in texts.items():
            _add(archive, f"sources/{file_name}", text.encode())
        if binary is not None:
            _add(archive, f"binaries/{folder}/{library}", binary)
    return binary is not None


def _add(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    archive.writestr(zipfile.ZipInfo(name, STAMP), content, zipfile.ZIP_DEFLATED)


def _table_text(law: UnitLaw) -> str:
    pair, table = law.pair, law.table
    numbers = {
        "BASE_1": pair.pinion.base_radius, "BASE_2": pair.wheel.base_radius, "TEETH_1": float(pair.pinion.teeth),
        "TURN": 2.0 * math.pi, "WORKING_ANGLE": pair.working_pressure_angle,
        "TAN_BASE_HELIX": math.tan(pair.base_helix_angle), "LOW": table.low, "HIGH": table.high,
        "BACKLASH_START": 1e-3 * (law.backlash or 0.0),
    }  # fmt: skip
    whole = {"COLUMNS": COLUMNS, "ROWS": ROWS, "BACKS": int(law.backlash is not None)}
    defined = [f"#define {name} {value!r}" for name, value in (numbers | whole).items()]
    values = table.values.reshape(len(table.values), -1)
    rows = ",\n".join("{" + ",".join(f"{float(v):.8g}f" if v else "0.0f" for v in row) + "}" for row in values)
    return "\n".join([
        *defined, f'#define HIGH_TEXT "{table.high:.6g}"',
        f"static const unsigned char KIND[{len(table.kind)}] = {{\n{_whole_numbers(table.kind)}}};",
        f"static const int NEXT[{len(table.next)}] = {{\n{_whole_numbers(table.next)}}};",
        f"static const float VALUES[{len(values)}][16] = {{\n{_as_floats(rows)}}};", "",
    ])  # fmt: skip


def _as_floats(rows: str) -> str:
    """Numbers of C as floats: a whole one needs its point."""
    return re.sub(r"(?<![\d.e+-])(-?\d+)f", r"\1.0f", rows)


def _whole_numbers(values: IntArray) -> str:
    lines = [values[i : i + NUMBERS_PER_LINE] for i in range(0, len(values), NUMBERS_PER_LINE)]
    return ",\n".join(",".join(str(int(v)) for v in np.atleast_1d(line)) for line in lines)


def _platform(name: str) -> tuple[str | None, str]:
    """Name of this platform in the standard, and of the library there; None for one that FMI 2.0 has no name for."""
    if platform.machine().lower() not in ("x86_64", "amd64") or sys.maxsize < 2**32:
        return None, ""
    names = {"Linux": ("linux64", "so"), "Darwin": ("darwin64", "dylib"), "Windows": ("win64", "dll")}
    folder, ending = names.get(platform.system(), (None, ""))
    return folder, f"{name}.{ending}"


def _compiled(texts: dict[str, str], library: str) -> bytes | None:
    """The library, compiled; None without a compiler that does it."""
    compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        for name, text in texts.items():
            Path(folder, name).write_text(text, encoding="utf-8")
        command = [compiler, *FLAGS, "mesh.c", "-o", library, "-lm"]
        try:
            subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=COMPILING_S)
            return Path(folder, library).read_bytes()
        except (OSError, subprocess.SubprocessError):
            return None
