"""Content of a REXS file of any version: components, relations, loads; units and names of version 2.0.

Forms of a file: XML (`.rexs`), the same in a ZIP archive (`.rexsz`), JSON (`.rexsj`). Names of attributes changed from
version to version, their numbers did not: those that matter here are renamed below, as the schemas say by number.
"""

from __future__ import annotations

import base64
import json
import math
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from pmor.core.errors import FileFormatError

#: in 1.x: in 2.0
COMPONENT_NAMES = {"flank_geometry": "cylindrical_gear_flank", "stage_gear_data": "cylindrical_stage_gear_data"}
ATTRIBUTE_NAMES = {
    "addendum_basic_profile": "tooth_tip_height",
    "helix_angle_base_circle": "helix_angle_base_diameter",
    "tip_radius": "tip_corner_radius_reference_profile",
    "tip_radius_factor": "tip_corner_radius_factor_reference_profile",
}
#: unit in a file: the one used here, and how many of it
UNITS = {
    "deg": ("deg", 1.0), "°": ("deg", 1.0), "rad": ("deg", 180.0 / math.pi),
    "mm": ("mm", 1.0), "mum": ("mm", 1e-3), "µm": ("mm", 1e-3), "m": ("mm", 1e3),
    "MPa": ("MPa", 1.0), "N / mm^2": ("MPa", 1.0), "Pa": ("MPa", 1e-6),
    "N m": ("N m", 1.0), "none": ("none", 1.0), "": ("none", 1.0),
}  # fmt: skip
#: numbers of arrays in Base64
CODES = {"int32": "<i4", "float32": "<f4", "float64": "<f8"}
# Largest unpacked size: an archive may hold anything.
LARGEST_BYTES = 200 * 2**20
REMEDY = "give a REXS file (.rexs, .rexsz or .rexsj) as a gearbox program writes it"

Value = float | str | list[float] | list[str]


@dataclass
class Component:
    """A component and its attributes.

    Parameters
    ----------
    number : int
    kind, name : str
    values : dict
        By attribute: numbers in the units of `UNITS`, text, lists of them.
    used : set of str
        Attributes that were read.
    """

    number: int
    kind: str
    name: str
    values: dict[str, Value]
    used: set[str] = field(default_factory=set)

    @property
    def label(self) -> str:
        """Name in messages."""
        return f"{self.kind} {self.number}" + (f" ({self.name})" if self.name else "")

    def number_of(self, *attributes: str) -> float | None:
        """Return the first of some attributes that is a finite number; None where none is."""
        for attribute in attributes:
            value = self.values.get(attribute)
            if isinstance(value, float) and math.isfinite(value):
                self.used.add(attribute)
                return value
        return None

    def text_of(self, attribute: str) -> str:
        """Return an attribute as text; empty where it is not there."""
        value = self.values.get(attribute, "")
        self.used.add(attribute)
        return value if isinstance(value, str) else ""

    def numbers_of(self, attribute: str) -> list[float]:
        """Return an attribute that is a list of numbers; empty where it is not there, or none."""
        value = self.values.get(attribute, [])
        self.used.add(attribute)
        return [v for v in value if isinstance(v, float)] if isinstance(value, list) else []


@dataclass(frozen=True)
class Relation:
    """Components that belong together, each with its role: (role, component), in their order."""

    kind: str
    parts: tuple[tuple[str, int], ...]

    def role(self, name: str) -> int | None:
        """Return the component in a role; None where there is none."""
        return next((number for role, number in self.parts if role == name), None)


@dataclass(frozen=True)
class Gearbox:
    """A REXS model.

    Parameters
    ----------
    version, program : str
    components : dict of int to Component
    relations : tuple of Relation
    load_cases : tuple of dict
        Attributes of components in each load case, by their numbers.
    """

    version: str
    program: str
    components: dict[int, Component]
    relations: tuple[Relation, ...]
    load_cases: tuple[dict[int, Component], ...]

    def of_kind(self, kind: str) -> list[Component]:
        """List the components of a kind."""
        return [component for component in self.components.values() if component.kind == kind]

    def beside(self, number: int, kind: str, relation: str | None = None) -> list[Component]:
        """List the components of a kind that share a relation (of a kind, where given) with a component."""
        found = dict[int, Component]()
        for one in self.relations:
            members = [member for _, member in one.parts]
            if number in members and relation in (None, one.kind):
                found |= {m: self.components[m] for m in members if m in self.components}
        return [component for component in found.values() if component.kind == kind]


def read_rexs(path: Path | str) -> Gearbox:
    """Read a REXS file.

    Raises
    ------
    FileFormatError
        When it is not there, cannot be read, or is no REXS file.
    """
    path = Path(path)
    try:
        if path.suffix.lower() == ".rexsj":
            return _from_json(json.loads(path.read_text(encoding="utf-8-sig")), path)
        root = ElementTree.fromstring(_xml_text(path))
    except FileNotFoundError:
        raise FileFormatError(f"{path}: there is no such file: check the path") from None
    except (OSError, ValueError, zipfile.BadZipFile, ElementTree.ParseError, RecursionError) as error:
        raise FileFormatError(f"{path}: cannot be read as REXS ({error}): {REMEDY}") from None
    return _from_xml(root, path)


def _xml_text(path: Path) -> bytes:
    if not zipfile.is_zipfile(path):
        text = path.read_bytes()
    else:
        with zipfile.ZipFile(path) as archive:
            inside = [item for item in archive.infolist() if item.filename.lower().endswith(".rexs")]
            if len(inside) != 1:
                raise ValueError(f"{len(inside)} .rexs files in the archive, instead of one")
            if inside[0].file_size > LARGEST_BYTES:
                raise ValueError(f"more than {LARGEST_BYTES // 2**20} MiB")
            text = archive.read(inside[0])
    if b"<!DOCTYPE" in text[:4096] or b"<!ENTITY" in text:
        raise ValueError("it declares entities, which no gearbox needs")  # they can make a page a gigabyte
    return text


def _from_xml(root: ElementTree.Element, path: Path) -> Gearbox:
    if root.tag != "model" or "version" not in root.attrib:
        raise FileFormatError(f"{path}: is XML, but no REXS model (it begins with <{root.tag}>): {REMEDY}")
    try:
        components = _components(root.iterfind("components/component"))
        relations = [
            Relation(item.get("type", ""), tuple((ref.get("role", ""), int(ref.get("id", ""))) for ref in item))
            for item in root.iterfind("relations/relation")
        ]
        load_cases = [_components(case.iterfind("component")) for case in root.iterfind("load_spectrum/load_case")]
    except (KeyError, ValueError) as error:
        place = "an id is no whole number, or an array none of its code"
        raise FileFormatError(f"{path}: {place} ({error}): {REMEDY}") from None
    program = f"{root.get('applicationId', '')} {root.get('applicationVersion', '')}".strip()
    return Gearbox(root.get("version", ""), program, components, tuple(relations), tuple(load_cases))


def _components(items: Iterable[ElementTree.Element]) -> dict[int, Component]:
    found = {}
    for item in items:
        values = {a.get("id", ""): _value(a.get("unit", ""), _content(a)) for a in item.iterfind("attribute")}
        component = _component(int(item.get("id", "")), item.get("type", ""), item.get("name", ""), values)
        found[component.number] = component
    return found


def _component(number: int, kind: str, name: str, values: dict[str, Value]) -> Component:
    renamed = {ATTRIBUTE_NAMES.get(key, key): value for key, value in values.items()}
    return Component(number, COMPONENT_NAMES.get(kind, kind), name, renamed)


def _content(attribute: ElementTree.Element) -> str | list[str]:
    array = attribute.find("array")
    if array is not None and array.get("code"):
        return _decoded(array.get("code", ""), array.text or "")
    cells = [cell.text or "" for cell in attribute.iter("c")]
    return cells if len(attribute) else (attribute.text or "").strip()


def _decoded(code: str, text: str) -> list[str]:
    """Numbers of an array in Base64, lowest byte first."""
    values = np.frombuffer(base64.b64decode(text), dtype=np.dtype(CODES[code]))
    return [repr(value) for value in values.tolist()]


def _value(unit: str, content: str | list[str]) -> Value:
    factor = UNITS.get(unit, (unit, 1.0))[1]
    if isinstance(content, list):
        numbers = list(_numbers(content, factor))
        return numbers if len(numbers) == len(content) else content
    return next(_numbers([content], factor), content)


def _numbers(texts: Iterable[str], factor: float) -> Iterator[float]:
    for text in texts:
        try:
            yield float(text) if factor == 1.0 else factor * float(text)
        except ValueError:
            return


def _from_json(document: Any, path: Path) -> Gearbox:
    """Build the model of a JSON file: the elements of the XML as objects, values under the name of their type."""
    try:
        model = document["model"]
        relations = [
            Relation(item["type"], tuple((ref["role"], int(ref["id"])) for ref in item["refs"]))
            for item in model.get("relations", [])
        ]
        components = _json_components(model.get("components", []))
        spectra = model.get("load_spectrum") or model.get("load_spectrums") or []
        spectra = spectra if isinstance(spectra, list) else [spectra]
        load_cases = [_json_components(c.get("components", [])) for s in spectra for c in s.get("load_cases", [])]
        program = f"{model.get('applicationId', '')} {model.get('applicationVersion', '')}".strip()
        return Gearbox(str(model["version"]), program, components, tuple(relations), tuple(load_cases))
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise FileFormatError(f"{path}: is JSON, but no REXS model ({error!r}): {REMEDY}") from None


def _json_components(items: list[Any]) -> dict[int, Component]:
    found = {}
    for item in items:
        values = dict[str, Value]()
        for attribute in item.get("attributes", []):
            content = next((v for k, v in attribute.items() if k not in ("id", "unit")), "")
            values[attribute["id"]] = _value(attribute.get("unit", ""), _flat(content))
        found[int(item["id"])] = _component(int(item["id"]), item["type"], item.get("name", ""), values)
    return found


def _flat(content: Any) -> str | list[str]:
    if isinstance(content, dict):
        return _decoded(content["code"], content["value"])
    if isinstance(content, list):
        return [str(_flat(item)) for item in content]
    return str(content).lower() if isinstance(content, bool) else str(content)
