"""REXS files of tests: parts that are made up, and files that were written, changed as other programs write them."""

import re
from xml.etree import ElementTree

from pmor.rexs.model import Component, Gearbox, Relation


def part(number, kind, **values):
    """A component as it is read, in units of the standard."""
    return Component(number, kind, "", {name: (value, "") for name, value in values.items()}, "made")


def made(parts, *relations, cases=()):
    """A gearbox of parts; relations are (kind, roles)."""
    found = tuple(Relation(kind, tuple(roles.items())) for kind, roles in relations)
    return Gearbox("2.0.0", "", {one.number: one for one in parts}, found, tuple(cases))


def numbers_and_words(text):
    """All attributes and relations of a file that was written, numbers to eleven digits: its canonical form."""
    return ElementTree.canonicalize(
        re.sub(rb"(?<=>)-?\d+\.\d+(e[+-]\d+)?(?=<)", lambda found: b"%.11g" % float(found[0]), text).decode()
    )  # fmt: skip


class RexsFile:
    """A file that was written, to be changed."""

    def __init__(self, text):
        self.root = ElementTree.fromstring(text)
        self.components = self.root.find("components")

    def of_kind(self, kind):
        """Components of a kind."""
        return [one for one in self.components if one.get("type") == kind]

    def ids(self, kind):
        """Their numbers."""
        return [int(one.get("id")) for one in self.of_kind(kind)]

    def say(self, component, **values):
        """Set attributes of a component: numbers, words, lists; None removes one."""
        for name, value in values.items():
            for old in component.findall(f"attribute[@id='{name}']"):
                component.remove(old)
            if value is None:
                continue
            attribute = ElementTree.SubElement(component, "attribute", id=name, unit="")
            if isinstance(value, list):
                array = ElementTree.SubElement(attribute, "array")
                for item in value:
                    ElementTree.SubElement(array, "c").text = str(item)
            else:
                attribute.text = str(value).lower() if isinstance(value, bool) else str(value)

    def add(self, kind, **values):
        """Add a component, and return its number."""
        number = 1 + max(int(one.get("id")) for one in self.components)
        self.say(ElementTree.SubElement(self.components, "component", id=str(number), type=kind), **values)
        return number

    def relate(self, kind, **roles):
        """Add a relation."""
        relation = ElementTree.SubElement(self.root.find("relations"), "relation", id="0", type=kind)
        for role, number in roles.items():
            ElementTree.SubElement(relation, "ref", role=role, id=str(number))

    def part_from(self, kind, part):
        """Remove the relations of a kind that a component is in, and return their numbers by role."""
        relations, found = self.root.find("relations"), []
        for relation in list(relations):
            roles = {ref.get("role"): int(ref.get("id")) for ref in relation}
            if relation.get("type") == kind and part in roles.values():
                relations.remove(relation)
                found.append(roles)
        return found

    def write(self, path):
        """Write the file, and return its path."""
        path.write_bytes(ElementTree.tostring(self.root))
        return path
