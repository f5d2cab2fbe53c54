"""The text of a REXS 2.0 file: components with numbered ids, relations between them, one load case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from xml.etree import ElementTree

import numpy as np

from pmor.core.version import __version__
from pmor.export.rexs.units import UNITS

VERSION = "2.0.0"
Value = str | bool | int | float | Sequence[int] | Sequence[float] | np.ndarray


@dataclass
class Document:
    """A REXS file in the making.

    Parameters
    ----------
    components : list of (kind, name, attributes)
        Their ids are 1, 2, ...
    relations : list of (kind, roles)
    loads : dict
        Attributes of components in the load case, by their ids.
    """

    components: list[tuple[str, str, Mapping[str, Value]]] = field(default_factory=list)
    relations: list[tuple[str, Mapping[str, int]]] = field(default_factory=list)
    loads: dict[int, Mapping[str, Value]] = field(default_factory=dict)

    def add(self, kind: str, name: str = "", **attributes: Value) -> int:
        """Add a component and return its id."""
        self.components.append((kind, name, attributes))
        return len(self.components)

    def relate(self, kind: str, **roles: int) -> None:
        """Add a relation; roles are given as ``role=id``."""
        self.relations.append((kind, roles))

    def text(self, date: str) -> bytes:
        """Return the XML.

        Parameters
        ----------
        date : str
            ISO 8601.
        """
        root = ElementTree.Element(
            "model", version=VERSION, applicationId="pmor", applicationVersion=__version__, date=date,
            applicationLanguage="en",
        )  # fmt: skip
        relations = ElementTree.SubElement(root, "relations")
        for number, (kind, roles) in enumerate(self.relations, start=1):
            more = {"order": "1"} if kind == "manufacturing_step" else {}
            relation = ElementTree.SubElement(relations, "relation", {"id": str(number), "type": kind} | more)
            for role, component in roles.items():
                hint = self.components[component - 1][0]
                ElementTree.SubElement(relation, "ref", id=str(component), role=role, hint=hint)
        components = ElementTree.SubElement(root, "components")
        for number, (kind, name, attributes) in enumerate(self.components, start=1):
            said = {"id": str(number), "type": kind} | ({"name": name} if name else {})
            _attributes(ElementTree.SubElement(components, "component", said), attributes)
        if self.loads:
            spectrum = ElementTree.SubElement(root, "load_spectrum", id="1")
            case = ElementTree.SubElement(spectrum, "load_case", id="1")
            for number, attributes in self.loads.items():
                kind = self.components[number - 1][0]
                _attributes(ElementTree.SubElement(case, "component", id=str(number), type=kind), attributes)
        ElementTree.indent(root)
        return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def _attributes(component: ElementTree.Element, attributes: Mapping[str, Value]) -> None:
    for name, value in attributes.items():
        attribute = ElementTree.SubElement(component, "attribute", id=name, unit=UNITS.get(name, "none"))
        if isinstance(value, str | bool | int | float):
            attribute.text = _cell(value)
            continue
        array = ElementTree.SubElement(attribute, "array")
        for item in np.asarray(value).tolist():
            ElementTree.SubElement(array, "c").text = _cell(item)


def _cell(value: str | bool | int | float) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else repr(value)
