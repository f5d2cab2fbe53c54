"""Description of a mesh unit: `modelDescription.xml`, FMI 2.0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal
from xml.etree import ElementTree

from pmor.core.version import __version__
from pmor.dynamics.fmu.law import UnitLaw

Causality = Literal["input", "output", "parameter"]
#: units of the variables, in those of SI
UNITS = {"rad": {"rad": 1}, "m": {"m": 1}, "N": {"kg": 1, "m": 1, "s": -2}, "N.m": {"kg": 1, "m": 2, "s": -2},
         "N/m": {"kg": 1, "s": -2}}  # fmt: skip


@dataclass(frozen=True)
class Variable:
    """A variable of the unit; its number is its place in `VARIABLES`, as in the source."""

    name: str
    causality: Causality
    unit: str
    text: str


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


def description(law: UnitLaw, name: str, guid: str, sources: Sequence[str]) -> bytes:
    """Return the text of `modelDescription.xml`."""
    root = ElementTree.Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=law.case.name, guid=f"{{{guid}}}", version=__version__,
        description=_sentence(law), generationTool=f"pmor {__version__}", variableNamingConvention="flat",
        numberOfEventIndicators="0",
    )  # fmt: skip
    unit = ElementTree.SubElement(
        root, "CoSimulation", modelIdentifier=name, canHandleVariableCommunicationStepSize="true",
        canNotUseMemoryManagementFunctions="true",
    )  # fmt: skip
    listed = ElementTree.SubElement(unit, "SourceFiles")
    for source in sources:
        ElementTree.SubElement(listed, "File", name=source)
    units = ElementTree.SubElement(root, "UnitDefinitions")
    for symbol, base in UNITS.items():
        one = ElementTree.SubElement(units, "Unit", name=symbol)
        ElementTree.SubElement(one, "BaseUnit", {key: str(value) for key, value in base.items()})
    categories = ElementTree.SubElement(root, "LogCategories")
    ElementTree.SubElement(categories, "Category", name="logStatusError")
    _variables(root, law)
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def _variables(root: ElementTree.Element, law: UnitLaw) -> None:
    variables = ElementTree.SubElement(root, "ModelVariables")
    for number, variable in enumerate(VARIABLES):
        attributes = {"name": variable.name, "valueReference": str(number), "description": variable.text}
        attributes |= {"causality": variable.causality}
        attributes["variability"] = "tunable" if variable.causality == "parameter" else "continuous"
        numbers = {"unit": variable.unit}
        if variable.causality != "output":
            numbers["start"] = repr(1e-3 * (law.backlash or 0.0)) if variable.causality == "parameter" else "0.0"
        one = ElementTree.SubElement(variables, "ScalarVariable", attributes)
        ElementTree.SubElement(one, "Real", numbers)
    structure = ElementTree.SubElement(root, "ModelStructure")
    outputs = [number for number, variable in enumerate(VARIABLES, start=1) if variable.causality == "output"]
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
