"""The text of a REXS 2.0 file: components with numbered ids, relations between them, load cases."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from pmor.core.version import __version__
from pmor.rexs.units import UNITS
from pmor.storage.atomic import atomic_path

VERSION = "2.0.0"
Value = str | bool | int | float | Sequence[int] | Sequence[float] | np.ndarray
Attributes = Mapping[str, Value]
# Relations whose parts have an order, which is that of their being said.
ORDERED = ("manufacturing_step", "ordered_assembly")


@dataclass
class Document:
    """A REXS file in the making.

    Parameters
    ----------
    components : list of (kind, name, attributes)
        Their ids are 1, 2, ...
    relations : list of (kind, roles)
    cases : list of dict
        Attributes of components in each load case, by their ids.
    """

    components: list[tuple[str, str, Attributes]] = field(default_factory=list)
    relations: list[tuple[str, Mapping[str, int]]] = field(default_factory=list)
    cases: list[dict[int, Attributes]] = field(default_factory=list)

    def add(self, kind: str, name: str = "", /, **attributes: Value) -> int:
        """Add a component and return its id."""
        self.components.append((kind, name, attributes))
        return len(self.components)

    def add_to(self, whole: int, kind: str, name: str = "", relation: str = "assembly", /, **attributes: Value) -> int:
        """Add a component that is a part of another one, and return its id."""
        number = self.add(kind, name, **attributes)
        self.relate(relation, assembly=whole, part=number)
        return number

    def refer(self, origin: int, kind: str, name: str = "", /, **attributes: Value) -> int:
        """Add a component that another one refers to, and return its id."""
        number = self.add(kind, name, **attributes)
        self.relate("reference", origin=origin, referenced=number)
        return number

    def join(self, inner: int, outer: int, kind: str, name: str, /, **attributes: Value) -> int:
        """Add a bearing, a coupling or a fit between two components, and return its id."""
        number = self.add(kind, name, **attributes)
        self.relate("side", assembly=number, inner_part=inner, outer_part=outer)
        return number

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
        orders = dict[tuple[str, int], int]()
        for number, (kind, roles) in enumerate(self.relations, start=1):
            whole = kind, next(iter(roles.values()))
            orders[whole] = orders.get(whole, 0) + 1
            more = {"order": str(orders[whole])} if kind in ORDERED else {}
            relation = ElementTree.SubElement(relations, "relation", {"id": str(number), "type": kind} | more)
            for role, component in roles.items():
                hint = self.components[component - 1][0]
                ElementTree.SubElement(relation, "ref", id=str(component), role=role, hint=hint)
        components = ElementTree.SubElement(root, "components")
        for number, (kind, name, attributes) in enumerate(self.components, start=1):
            said = {"id": str(number), "type": kind} | ({"name": name} if name else {})
            _attributes(ElementTree.SubElement(components, "component", said), attributes)
        spectrum = ElementTree.SubElement(root, "load_spectrum", id="1") if self.cases else root
        for place, loads in enumerate(self.cases, start=1):
            case = ElementTree.SubElement(spectrum, "load_case", id=str(place))
            for number, attributes in loads.items():
                kind = self.components[number - 1][0]
                _attributes(ElementTree.SubElement(case, "component", id=str(number), type=kind), attributes)
        ElementTree.indent(root)
        return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def save(path: Path, overwrite: bool, text: Callable[[str], bytes]) -> None:
    """Write the text of a file as it is now, from its date; OutputError where it cannot be."""
    content = text(datetime.now().astimezone().isoformat(timespec="seconds"))
    with atomic_path(path, overwrite) as temporary:
        temporary.write_bytes(content)


def _attributes(component: ElementTree.Element, attributes: Attributes) -> None:
    for name, value in attributes.items():
        attribute = ElementTree.SubElement(component, "attribute", id=name, unit=UNITS.get(name, "none"))
        if isinstance(value, str | bool | int | float):
            attribute.text = _cell(value)
            continue
        values = np.asarray(value)
        rows = [ElementTree.SubElement(attribute, "array")]
        if values.ndim == 2:
            rows[0].tag = "matrix"
            rows = [ElementTree.SubElement(rows[0], "r") for _ in values]
        for row, items in zip(rows, values.reshape(len(rows), -1).tolist(), strict=True):
            for item in items:
                ElementTree.SubElement(row, "c").text = _cell(item)


def _cell(value: str | bool | int | float) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else repr(value)
