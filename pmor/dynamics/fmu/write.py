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
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

import numpy as np

from pmor.core.arrays import IntArray
from pmor.core.version import __version__
from pmor.dynamics.fmu.law import UnitLaw
from pmor.dynamics.table_cells import COLUMNS, ROWS
from pmor.storage.atomic import atomic_path

Causality = Literal["input", "output", "parameter"]
#: units of the variables, in those of SI
UNITS = {"rad": {"rad": 1}, "m": {"m": 1}, "N": {"kg": 1, "m": 1, "s": -2}, "N.m": {"kg": 1, "m": 2, "s": -2},
         "N/m": {"kg": 1, "s": -2}, "rad/s": {"rad": 1, "s": -1}}  # fmt: skip


@dataclass(frozen=True)
class Variable:
    """A variable of a unit; its number is its place among all, as in the source."""

    name: str
    causality: Causality
    unit: str
    text: str
    start: float = 0.0


@dataclass(frozen=True)
class Unit:
    """A unit for co-simulation.

    Parameters
    ----------
    name, sentence : str
        Of its model, and what that is.
    source : str
        Name of its source beside this file.
    table : str
        Content of `table.h`, which that includes.
    """

    name: str
    sentence: str
    variables: tuple[Variable, ...]
    source: str
    table: str


VARIABLES = (
    Variable("phi1", "input", "rad", "pinion's angle, positive counter-clockwise; 0: a tooth on the line of centres"),
    Variable("phi2", "input", "rad", "wheel's angle, positive counter-clockwise; -phi1 z1/z2 where flanks just touch"),
    Variable("axis_x", "input", "m", "displacement of the wheel's axis along x, across the line of centres"),
    Variable("axis_y", "input", "m", "displacement of the wheel's axis along y, from the pinion's axis to the wheel's"),
    Variable("backlash", "parameter", "m", "backlash along the line of action"),
    Variable("torque1", "output", "N.m", "torque of the mesh on the pinion, positive counter-clockwise"),
    Variable("torque2", "output", "N.m", "torque of the mesh on the wheel, positive counter-clockwise"),
    Variable("force", "output", "N", "force along the transverse line of action; negative on the backs of the teeth"),
    Variable(
        "transmission_error", "output", "m", "advance of the pinion along the line of action: rb1 phi1 + rb2 phi2"
    ),
    Variable("stiffness", "output", "N/m", "derivative of the force by the transmission error"),
    Variable("force1_x", "output", "N", "force of the mesh on the pinion along x"),
    Variable("force1_y", "output", "N", "force of the mesh on the pinion along y"),
    Variable("force1_z", "output", "N", "force of the mesh on the pinion along its axis"),
    Variable("force2_x", "output", "N", "force of the mesh on the wheel along x"),
    Variable("force2_y", "output", "N", "force of the mesh on the wheel along y"),
    Variable("force2_z", "output", "N", "force of the mesh on the wheel along its axis"),
)


def description(unit: Unit, name: str, guid: str) -> bytes:
    """Return the text of `modelDescription.xml`."""
    root = ElementTree.Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=unit.name, guid=f"{{{guid}}}", version=__version__,
        description=unit.sentence, generationTool=f"pmor {__version__}", variableNamingConvention="flat",
        numberOfEventIndicators="0",
    )  # fmt: skip
    said = ElementTree.SubElement(
        root, "CoSimulation", modelIdentifier=name, canHandleVariableCommunicationStepSize="true",
        canNotUseMemoryManagementFunctions="true",
    )  # fmt: skip
    listed = ElementTree.SubElement(said, "SourceFiles")
    ElementTree.SubElement(listed, "File", name=unit.source)
    units = ElementTree.SubElement(root, "UnitDefinitions")
    for symbol, base in UNITS.items():
        one = ElementTree.SubElement(units, "Unit", name=symbol)
        ElementTree.SubElement(one, "BaseUnit", {key: str(value) for key, value in base.items()})
    categories = ElementTree.SubElement(root, "LogCategories")
    ElementTree.SubElement(categories, "Category", name="logStatusError")
    _variables(root, unit.variables)
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def _variables(root: ElementTree.Element, told: Sequence[Variable]) -> None:
    variables = ElementTree.SubElement(root, "ModelVariables")
    for number, variable in enumerate(told):
        attributes = {"name": variable.name, "valueReference": str(number), "description": variable.text}
        attributes |= {"causality": variable.causality}
        attributes["variability"] = "tunable" if variable.causality == "parameter" else "continuous"
        numbers = {"unit": variable.unit}
        if variable.causality != "output":
            numbers["start"] = repr(float(variable.start))
        one = ElementTree.SubElement(variables, "ScalarVariable", attributes)
        ElementTree.SubElement(one, "Real", numbers)
    structure = ElementTree.SubElement(root, "ModelStructure")
    outputs = [number for number, variable in enumerate(told, start=1) if variable.causality == "output"]
    for tag in ("Outputs", "InitialUnknowns"):
        listed = ElementTree.SubElement(structure, tag)
        for number in outputs:
            ElementTree.SubElement(listed, "Unknown", index=str(number))


def _sentence(law: UnitLaw) -> str:
    backs = (
        "the backs of the teeth mirror the working flanks"
        if law.backlash is not None
        else "the backs of the teeth are not modelled, since axes or flanks have no mirror image: no force there"
    )
    return (
        f"Mesh of {law.case.title}: force by displacement of exact line contact, up to {law.torque_Nm:g} N m on the "
        f"pinion at every angle, {law.table.high:.6g} mm along the line of action; beyond it there is an error. "
        f"The wheel's axis moves by its part along the line of action; {backs}. No damping, no friction, no moments "
        "that tilt. The pinion's axis is at x = y = 0, the wheel's at y = the centre distance, z along the axes."
    )


# What all units include.
COMMON = "unit.h"
NUMBERS_PER_LINE = 16
# Seconds for which a compiler may run: the largest tables take one.
COMPILING_S = 120.0
FLAGS = ("-std=c99", "-O2", "-shared", "-fPIC", "-fvisibility=hidden")
# A time stamp for all files in the archive: the same law gives the same bytes.
STAMP = (1980, 1, 1, 0, 0, 0)


def write_fmu(law: UnitLaw, path: Path, overwrite: bool = False) -> bool:
    """Write the mesh of a pair as a unit for co-simulation; parameters and result as of `write_unit`."""
    start = 1e-3 * (law.backlash or 0.0)
    variables = tuple(replace(one, start=start) if one.causality == "parameter" else one for one in VARIABLES)
    return write_unit(Unit(law.case.name, _sentence(law), variables, "mesh.c", _table_text(law)), path, overwrite)


def write_unit(unit: Unit, path: Path, overwrite: bool = False) -> bool:
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
    name = "pmor_" + re.sub(r"\W", "_", unit.name, flags=re.ASCII)
    beside = files("pmor.dynamics.fmu")
    texts = {file: beside.joinpath(file).read_text(encoding="utf-8") for file in (unit.source, COMMON)}
    guid = hashlib.sha256(("".join(texts.values()) + unit.table).encode()).hexdigest()[:32]
    texts["table.h"] = f'#define GUID "{{{guid}}}"\n{unit.table}'
    folder, library = _platform(name)
    binary = _compiled(texts, unit.source, library) if folder else None
    with atomic_path(path, overwrite) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        _add(archive, "modelDescription.xml", description(unit, name, guid))
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


def _compiled(texts: dict[str, str], source: str, library: str) -> bytes | None:
    """The library, compiled; None without a compiler that does it."""
    compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        for name, text in texts.items():
            Path(folder, name).write_text(text, encoding="utf-8")
        command = [compiler, *FLAGS, source, "-o", library, "-lm"]
        try:
            subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=COMPILING_S)
            return Path(folder, library).read_bytes()
        except (OSError, subprocess.SubprocessError):
            return None
