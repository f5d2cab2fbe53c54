"""Content of a REXS file of any version: components, relations, loads; names of version 2.0.

Forms of a file: XML (`.rexs`), the same in a ZIP archive (`.rexsz`), JSON (`.rexsj`). Names of attributes changed from
version to version, their numbers did not: those that matter here are renamed below, as the schemas say by number.
"""

from __future__ import annotations

import base64
import json
import lzma
import math
import zipfile
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from pmor.core.errors import CaseError, FileFormatError
from pmor.core.reading import read_bytes
from pmor.rexs.units import factor_of

#: in 1.x: in 2.0
COMPONENT_NAMES = {"flank_geometry": "cylindrical_gear_flank", "stage_gear_data": "cylindrical_stage_gear_data"}
ATTRIBUTE_NAMES = {
    "addendum_basic_profile": "tooth_tip_height",
    "helix_angle_base_circle": "helix_angle_base_diameter",
    "load_duration_fraction": "operating_time_fraction",
    "tip_radius": "tip_corner_radius_reference_profile",
    "tip_radius_factor": "tip_corner_radius_factor_reference_profile",
}
#: numbers of arrays in Base64; programs write these names in capitals and with underscores too
CODES = {"int32": "<i4", "float32": "<f4", "float64": "<f8"}
#: endings of files
ENDINGS = (".rexs", ".rexsz", ".rexsj")
CONCEPT, CATALOGUE = "concept_bearing", "rolling_bearing_with_catalog_geometry"
BEARINGS = (CATALOGUE, "rolling_bearing_with_detailed_geometry", CONCEPT)
# Stiffnesses from here on stand for rigid, N/mm and N mm/rad.
RIGID, RIGID_TILT = 1e10, 1e13
# Largest unpacked size: an archive may hold anything.
LARGEST_BYTES = 200 * 2**20
# Errors of reading, unpacking and parsing: lack of memory, passwords and unknown encodings or methods are among them.
UNREADABLE = (
    OSError, ValueError, LookupError, RuntimeError, EOFError, MemoryError, expat.ExpatError, zipfile.BadZipFile,
    zlib.error, lzma.LZMAError,
)  # fmt: skip
REMEDY = "give a REXS file (.rexs, .rexsz or .rexsj) as a gearbox program writes it"

Value = float | str | list[float] | list[str]


@dataclass
class Component:
    """A component and its attributes.

    Parameters
    ----------
    values : dict
        By attribute: numbers, text, lists of them, with the unit of the file.
    file : str
        For messages.
    used : set of str
        Attributes that were read.
    """

    number: int
    kind: str
    name: str
    values: dict[str, tuple[Value, str]]
    file: str
    used: set[str] = field(default_factory=set)

    @property
    def label(self) -> str:
        """Name in messages."""
        return f"{self.kind} {self.number}" + (f" ({self.name})" if self.name else "")

    def refusal(self, rule: str) -> CaseError:
        """Return the error of a component that the file does not say enough of."""
        return CaseError(f"{self.file}: {self.label}: {rule}")

    def number_of(self, *attributes: str) -> float | None:
        """Return the first of some attributes that is a finite number, in the units of `FACTORS`; None without any.

        Raises
        ------
        FileFormatError
            When its unit is unknown, or it is text.
        """
        for attribute in attributes:
            value, _ = self._read(attribute)
            if value and isinstance(value, str):
                raise FileFormatError(f"{self.file}: {self.label}: {attribute} = {value!r:.60}: must be a number")
            if isinstance(value, float) and math.isfinite(value):
                return value * self._factor(attribute)
        return None

    def whole_number_of(self, attribute: str) -> int | None:
        """Return a number without decimals; None where there is none.

        Raises
        ------
        FileFormatError
            When it has decimals, and as in `number_of`.
        """
        value = self.number_of(attribute)
        if value is not None and value != int(value):
            raise FileFormatError(f"{self.file}: {self.label}: {attribute} = {value:.9g}: must be a whole number")
        return None if value is None else int(value)

    def text_of(self, attribute: str) -> str:
        """Return an attribute as text; empty where it is not there."""
        value, _ = self._read(attribute)
        return value if isinstance(value, str) else ""

    def numbers_of(self, attribute: str) -> list[float]:
        """Return an attribute that is a list of numbers; empty where it is not there, or none."""
        value, _ = self._read(attribute)
        numbers = [v for v in value if isinstance(v, float)] if isinstance(value, list) else []
        return [v * self._factor(attribute) for v in numbers]

    def direction_of(self, attribute: str) -> list[float]:
        """Return the unit vector along an attribute of three numbers of any unit; empty where there is none."""
        value, _ = self._read(attribute)
        vector = [v for v in value if isinstance(v, float)] if isinstance(value, list) else []
        length = math.hypot(*vector) if len(vector) == 3 else 0.0
        return [v / length for v in vector] if 0.0 < length < math.inf else []

    def _read(self, attribute: str) -> tuple[Value, str]:
        self.used.add(attribute)
        return self.values.get(attribute, ("", ""))

    def _factor(self, attribute: str) -> float:
        try:
            return factor_of(attribute, self.values[attribute][1])
        except ValueError as error:
            raise FileFormatError(f"{self.file}: {self.label}: {attribute}: {error}") from None


@dataclass(frozen=True)
class Relation:
    """Components that belong together, each with its role: (role, component); and their order among others."""

    kind: str
    parts: tuple[tuple[str, int], ...]
    order: int = 0

    def role(self, name: str) -> int | None:
        """Return the component in a role; None where there is none."""
        return next((number for role, number in self.parts if role == name), None)


@dataclass(frozen=True)
class Gearbox:
    """A REXS model.

    Parameters
    ----------
    components : dict of int to Component
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

    def members(self, relation: str) -> list[list[int]]:
        """List the components of each relation of a kind."""
        return [[member for _, member in one.parts] for one in self.relations if one.kind == relation]

    def ordered(self, number: int, kind: str) -> list[Component]:
        """List the components of a kind that are ordered parts of a component, in their order."""
        found = [one for one in self.relations if one.kind == "ordered_assembly" and one.role("assembly") == number]
        parts = [one.role("part") for one in sorted(found, key=lambda one: one.order)]
        return [
            self.components[part] for part in parts if part in self.components and self.components[part].kind == kind
        ]


def is_rexs(path: Path) -> bool:
    """Return whether the name of a file ends as those of REXS do."""
    return path.suffix.lower() in ENDINGS


def read_rexs(path: Path | str) -> Gearbox:
    """Read a REXS file.

    Raises
    ------
    FileFormatError
        When it is not there, cannot be read, or is no REXS file.
    """
    path = Path(path)
    try:
        content = _unpacked(path)
        root = _json_tree(json.loads(content)) if path.suffix.lower() == ".rexsj" else _xml_tree(content)
    except FileNotFoundError:
        raise FileFormatError(f"{path}: there is no such file: check the path") from None
    except UNREADABLE as error:
        why = getattr(error, "strerror", None) or error
        raise FileFormatError(f"{path}: cannot be read as REXS ({why}): {REMEDY}") from None
    return _gearbox(root, path)


def _unpacked(path: Path) -> bytes:
    if path.is_file() and zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            inside = [item for item in archive.infolist() if item.filename.lower().endswith(".rexs")]
            if len(inside) != 1:
                raise ValueError(f"{len(inside)} .rexs files in the archive, instead of one")
            _refuse_large(inside[0].file_size)
            return archive.read(inside[0])
    return read_bytes(path, LARGEST_BYTES)


def _refuse_large(size: int) -> None:
    if size > LARGEST_BYTES:
        raise ValueError(f"more than {LARGEST_BYTES // 2**20} MiB")


def _xml_tree(text: bytes) -> ElementTree.Element:
    """Elements of XML without a document type: entities, which it declares, can expand to any size."""

    def refuse(*declaration: object) -> None:
        raise ValueError(f"it declares a document type or an entity, {declaration[0]!r:.60}")

    builder, parser = ElementTree.TreeBuilder(), expat.ParserCreate()
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler = builder.data
    parser.Parse(text, True)
    return builder.close()


def _json_tree(document: Any) -> ElementTree.Element:
    """The elements of the XML from their objects in JSON, where values stand under the name of their type."""
    try:
        model = document["model"]
        root = ElementTree.Element("model", version=str(model["version"]))
        root.attrib |= {key: str(model[key]) for key in ("applicationId", "applicationVersion") if key in model}
        relations = ElementTree.SubElement(root, "relations")
        for item in model.get("relations", []):
            order = {"order": _id(item["order"])} if item.get("order") is not None else {}
            relation = ElementTree.SubElement(relations, "relation", order, type=_text(item["type"]))
            for ref in item["refs"]:
                ElementTree.SubElement(relation, "ref", role=_text(ref["role"]), id=_id(ref["id"]))
        _add_components(ElementTree.SubElement(root, "components"), model.get("components", []))
        spectra = model.get("load_spectrum") or model.get("load_spectrums") or []
        spectrum = ElementTree.SubElement(root, "load_spectrum")
        for one in spectra if isinstance(spectra, list) else [spectra]:
            for case in one.get("load_cases", []):
                _add_components(ElementTree.SubElement(spectrum, "load_case"), case.get("components", []))
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise ValueError(f"is JSON, but no REXS model, {error!r}") from None
    return root


def _add_components(parent: ElementTree.Element, items: Iterable[dict[str, Any]]) -> None:
    for item in items:
        said = {"id": _id(item["id"]), "type": _text(item["type"]), "name": _text(item.get("name") or "")}
        component = ElementTree.SubElement(parent, "component", said)
        for attribute in item.get("attributes", []):
            names = {"id": _text(attribute["id"]), "unit": _text(attribute.get("unit") or "")}
            content = next((v for k, v in attribute.items() if k not in names), "")
            _add_content(ElementTree.SubElement(component, "attribute", names), content)


def _add_content(attribute: ElementTree.Element, content: Any) -> None:
    if isinstance(content, dict):
        array = ElementTree.SubElement(attribute, "array", code=_text(content["code"]))
        array.text = _text(content["value"])
    elif isinstance(content, list):
        array = ElementTree.SubElement(attribute, "array")
        for item in content:
            _add_content(ElementTree.SubElement(array, "c"), item)
    else:
        attribute.text = str(content).lower() if isinstance(content, bool) else str(content)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r:.60} where text belongs")
    return value


def _id(value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, int | str):
        raise TypeError(f"{value!r:.60} as an id, which is a whole number")
    return str(value)


def _gearbox(root: ElementTree.Element, path: Path) -> Gearbox:
    if root.tag != "model" or "version" not in root.attrib:
        raise FileFormatError(f"{path}: is XML, but no REXS model (it begins with <{root.tag}>): {REMEDY}")
    try:
        components = _components(root.iterfind("components/component"), path)
        relations = [
            Relation(
                item.get("type", ""),
                tuple((ref.get("role", ""), int(ref.get("id", ""))) for ref in item),
                int(item.get("order") or 0),
            )  # fmt: skip
            for item in root.iterfind("relations/relation")
        ]
        cases = root.iterfind("load_spectrum/load_case")
        load_cases = [_components(case.iterfind("component"), path) for case in cases]
    except (KeyError, ValueError) as error:
        place = "an id is no whole number, or an array none of its code"
        raise FileFormatError(f"{path}: {place} ({error}): {REMEDY}") from None
    program = f"{root.get('applicationId', '')} {root.get('applicationVersion', '')}".strip()
    return Gearbox(root.get("version", ""), program, components, tuple(relations), tuple(load_cases))


def _components(items: Iterable[ElementTree.Element], path: Path) -> dict[int, Component]:
    found = {}
    for item in items:
        number, kind, values = int(item.get("id", "")), item.get("type", ""), dict[str, tuple[Value, str]]()
        for one in item.iterfind("attribute"):
            name = one.get("id", "")
            values[ATTRIBUTE_NAMES.get(name, name)] = _value(_content(one)), one.get("unit", "")
        name = item.get("name", "")
        found[number] = Component(number, COMPONENT_NAMES.get(kind, kind), name, values, str(path))
    return found


def _content(attribute: ElementTree.Element) -> str | list[str]:
    array = next((part for part in attribute if part.tag in ("array", "matrix")), None)
    if array is not None and array.get("code"):
        # Numbers in Base64, lowest byte first.
        code = array.get("code", "").lower().replace("_", "")
        values = np.frombuffer(base64.b64decode(array.text or ""), dtype=np.dtype(CODES[code]))
        return [repr(value) for value in values.tolist()]
    cells = [(cell.text or "").strip() for cell in attribute.iter("c") if not len(cell)]
    return cells if len(attribute) else (attribute.text or "").strip()


def _value(content: str | list[str]) -> Value:
    try:
        return [float(text) for text in content] if isinstance(content, list) else float(content)
    except ValueError:
        return content
