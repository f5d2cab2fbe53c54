"""Body of a gear below its rim that the engineer brings as a mesh: what a case says and keeps of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import Annotated, Any, Literal

from pmor.case.values import Refused
from pmor.core.errors import CaseError
from pmor.core.ranges import Range

# Radii and widths of the mesh may differ from those of the case by so much of them: digits that files keep.
DIGITS = 1e-3
# Of the interface below the root circle, at least, in modules: what sectors need.
LEAST_DEPTH = 0.5
#: length of a unit in mm
UNITS = {"mm": 1.0, "m": 1e3, "in": 25.4}


@dataclass(frozen=True)
class BodyMesh:
    """A file with a mesh, and what was found in it.

    Parameters
    ----------
    file : str
        Its path; not a part of what the mesh is.
    sha256 : str
        Of its bytes, in hex.
    interface_radius_mm, width_mm : float
        Of the cylinder that it ends at, mm.
    bore_radius_mm : float
        mm.
    repeats : int
        How often it repeats around its axis; 0 where it does not change around it.
    volume_mm3, polar_moment_mm5, tilting_moment_mm5 : float
        Integrals of 1, and of the squared distances from its axis and from an axis across it through mid width, on
        average.
    mirrored : bool
        The gear has the image of the mesh, x to -x.
    """

    file: str = field(compare=False)
    sha256: str
    interface_radius_mm: float
    width_mm: float
    bore_radius_mm: float
    repeats: int
    volume_mm3: float
    polar_moment_mm5: float
    tilting_moment_mm5: float
    mirrored: bool = False

    @staticmethod
    def from_toml(value: object) -> BodyMesh:
        """Read ``"wheel.inp"``, the name of a file; or what was found in one, a table with all fields."""
        if isinstance(value, BodyMesh):
            return value
        if not isinstance(value, dict) or set(value) != {item.name for item in fields(BodyMesh)}:
            raise Refused('must be the name of a file with a mesh, in quotes: write "wheel.inp"')
        numbers = {key: number for key, number in value.items() if key not in ("file", "sha256", "mirrored")}
        right = all(isinstance(number, int | float) and math.isfinite(number) for number in numbers.values())
        if not right or not all(isinstance(value[key], str) for key in ("file", "sha256")):
            raise Refused("must hold what was found in the file: name the file instead")
        repeats = numbers.pop("repeats")
        sizes = {key: float(number) for key, number in numbers.items()}
        return BodyMesh(value["file"], value["sha256"], repeats=int(repeats), mirrored=bool(value["mirrored"]), **sizes)


@dataclass(frozen=True, kw_only=True)
class BodyCase:
    """All of a gear below its rim as a mesh of one's own, in place of dimensions: held at its bore.

    Its axis is z, and its outside a whole cylinder as wide as the face, at least half a module below the root circle:
    there the rim with its teeth stands on it. Material and bore are those of the gear.

    Parameters
    ----------
    mesh : BodyMesh
        Hexahedra or tetrahedra, linear or quadratic, of CalculiX or Abaqus (`.inp`), Nastran (`.bdf`, `.nas`, `.fem`),
        Gmsh (`.msh`) or VTK (`.vtk`, `.vtu`), relative to the case; needs `meshio`.
    unit : {"mm", "m", "in"}
        Of its coordinates.
    x_axis_deg : float
        Place of its x axis at pinion angle 0, in degrees: from the line from this gear's centre to its mate's,
        counter-clockwise seen from +z.
    """

    mesh: BodyMesh
    unit: Literal["mm", "m", "in"] = "mm"
    x_axis_deg: Annotated[float, Range(-360.0, 360.0, "deg")] = 0.0

    @property
    def image(self) -> BodyCase:
        """The body in the mirror, x to -x, for coast flanks."""
        mesh = replace(self.mesh, mirrored=not self.mesh.mirrored)
        return replace(self, mesh=mesh, x_axis_deg=-self.x_axis_deg or 0.0)


def check_body(body: BodyCase, root_mm: float, bore_mm: float, face_mm: float, module_mm: float, place: str) -> None:
    """Raise `CaseError` where a mesh is not that of the gear: arguments as of `pmor.case.blank.check_blank`."""
    mesh, limit_mm = body.mesh, root_mm - LEAST_DEPTH * module_mm
    radius_mm = mesh.interface_radius_mm
    if not bore_mm < radius_mm <= limit_mm:
        raise CaseError(
            f"{place} mesh: its outside has the radius {radius_mm:.6g} mm, and must be above the bore's, {bore_mm:.6g} "
            f"mm, and at most {limit_mm:.6g} mm, half a module below the root circle: {_other_unit(body, limit_mm)}"
        )
    for name, found_mm, said_mm in (
        ("bore has the radius", mesh.bore_radius_mm, bore_mm), ("outside has the width", mesh.width_mm, face_mm),
    ):  # fmt: skip
        if abs(found_mm - said_mm) > DIGITS * said_mm:
            key = "bore_radius_mm" if "bore" in name else "face_width_mm"
            raise CaseError(
                f"{place} mesh: its {name} {found_mm:.6g} mm, and {key} is {said_mm:.6g}: mesh the gear of the case, "
                f"or correct {key}"
            )


def _other_unit(body: BodyCase, limit_mm: float) -> str:
    own = body.mesh.interface_radius_mm / UNITS[body.unit]
    for unit, length_mm in UNITS.items():
        if unit != body.unit and 0.3 * limit_mm < own * length_mm <= limit_mm:
            return f'it would fit in {unit}, write unit = "{unit}"'
    return "mesh no teeth, and end below the root"


def repetition(body: BodyCase | None, holes: Any) -> int:
    """Return how often a blank repeats around its axis, 0 where teeth are all alike on it."""
    if body is not None:
        return body.mesh.repeats
    return 0 if holes is None else int(holes.count)
