"""Body of a gear below its rim that the engineer brings, a mesh or a stiffness matrix: what a case keeps of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import Annotated, Any, Literal, NoReturn, TypeVar

from pmor.case.motion import check_bodies
from pmor.case.values import Refused
from pmor.core.errors import CaseError
from pmor.core.ranges import Range
from pmor.gear.inertia import Inertia

# Radii and widths of the mesh may differ from those of the case by so much of them: digits that files keep.
DIGITS = 1e-3
# Of the interface below the root circle, at least, in modules: what sectors need.
LEAST_DEPTH = 0.5
# Median of a matrix's diagonal over the distance of its nodes and Young's modulus of the teeth. *Measured* 0.34 to 1.5
# of webs and rings in linear and quadratic elements; a body of plastic has a hundredth of it, N/m a thousandfold.
PLAUSIBLE = 3e-3, 200.0
#: length of a unit in mm
UNITS = {"mm": 1.0, "m": 1e3, "in": 25.4}


Found = TypeVar("Found", "BodyMesh", "BodyMatrix")
Body = TypeVar("Body", "BodyCase", "MatrixCase")


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
        return _found_in(value, BodyMesh, 'a mesh, in quotes: write "wheel.inp"')


@dataclass(frozen=True)
class BodyMatrix:
    """A file with a stiffness matrix, and what was found in it.

    Parameters
    ----------
    file, sha256, interface_radius_mm, width_mm, repeats, mirrored
        As of `BodyMesh`.
    stiffness_N_per_mm2 : float
        Median of the matrix's diagonal over the distance of its nodes.
    """

    file: str = field(compare=False)
    sha256: str
    interface_radius_mm: float
    width_mm: float
    repeats: int
    stiffness_N_per_mm2: float
    mirrored: bool = False

    @staticmethod
    def from_toml(value: object) -> BodyMatrix:
        """Read ``"wheel.npz"``, the name of a file; or what was found in one, a table with all fields."""
        return _found_in(value, BodyMatrix, 'a stiffness matrix, in quotes: write "wheel.npz"')


def _found_in(value: object, kind: type[Found], what: str) -> Found:
    if isinstance(value, kind):
        return value
    if not isinstance(value, dict) or set(value) != {item.name for item in fields(kind)}:
        raise Refused(f"must be the name of a file with {what}")
    numbers = {key: number for key, number in value.items() if key not in ("file", "sha256", "mirrored")}
    right = all(isinstance(number, int | float) and math.isfinite(number) for number in numbers.values())
    if not right or not all(isinstance(value[key], str) for key in ("file", "sha256")):
        raise Refused("must hold what was found in the file: name the file instead")
    sizes: dict[str, Any] = {key: float(number) for key, number in numbers.items()}
    sizes["repeats"] = int(numbers["repeats"])
    return kind(file=value["file"], sha256=value["sha256"], mirrored=bool(value["mirrored"]), **sizes)


@dataclass(frozen=True, kw_only=True)
class BodyCase:
    """All of a gear below its rim as a mesh of one's own, in place of dimensions: held at its bore.

    Its axis is z, its outside a whole cylinder as wide as the face, at least half a module below the root circle: there
    the rim with its teeth stands on it.

    Parameters
    ----------
    mesh : BodyMesh
        Hexahedra or tetrahedra, linear or quadratic, of CalculiX or Abaqus (`.inp`), Nastran (`.bdf`, `.nas`, `.fem`),
        Gmsh (`.msh`) or VTK (`.vtk`, `.vtu`), relative to the case; needs `meshio`.
    unit : {"mm", "m", "in"}
        Unit of its coordinates.
    x_axis_deg : float
        Place of its x axis, as `first_deg` of holes.
    """

    mesh: BodyMesh
    unit: Literal["mm", "m", "in"] = "mm"
    x_axis_deg: Annotated[float, Range(-360.0, 360.0, "deg")] = 0.0

    @property
    def found(self) -> BodyMesh:
        """What the file holds."""
        return self.mesh

    @property
    def image(self) -> BodyCase:
        """The body in the mirror, x to -x, for coast flanks."""
        return _image(self, "mesh")


@dataclass(frozen=True, kw_only=True)
class MatrixCase:
    """All of a gear below its rim as a stiffness matrix that an FE package condensed, in place of dimensions.

    It is over the nodes of such a cylinder as the outside of a mesh, the bore held in it.

    Parameters
    ----------
    matrix : BodyMatrix
        File of numpy (`.npz`): `nodes`, x, y, z in n rows, and `stiffness`, 3 n x 3 n, symmetric, over x, y, z of each
        node; or of Matrix Market (`.mtx`), with nodes in a `.csv` of the same name. Relative to the case.
    unit : {"mm", "m", "in"}
        Unit of its coordinates; the stiffness is then in N/mm, N/m or lbf/in.
    x_axis_deg : float
        Place of its x axis, as `first_deg` of holes.
    mass_kg : float
        Mass of the body without rim and teeth, kg.
    polar_inertia_kg_m2, tilting_inertia_kg_m2 : float
        Its moments of inertia about its axis, and about an axis across it through mid width, kg m2.
    """

    matrix: BodyMatrix
    unit: Literal["mm", "m", "in"] = "mm"
    x_axis_deg: Annotated[float, Range(-360.0, 360.0, "deg")] = 0.0
    mass_kg: Annotated[float, Range(0.0, 1e9, "kg", low_excluded=True)]
    polar_inertia_kg_m2: Annotated[float, Range(0.0, 1e12, "kg m2", low_excluded=True)]
    tilting_inertia_kg_m2: Annotated[float, Range(0.0, 1e12, "kg m2", low_excluded=True)]

    @property
    def found(self) -> BodyMatrix:
        """What the file holds."""
        return self.matrix

    @property
    def image(self) -> MatrixCase:
        """The body in the mirror, x to -x, for coast flanks."""
        return _image(self, "matrix")


def _image(body: Body, key: Literal["mesh", "matrix"]) -> Body:
    """A body, named by a key, in the mirror."""
    changed: dict[str, Any] = {key: replace(body.found, mirrored=not body.found.mirrored)}
    return replace(body, x_axis_deg=-body.x_axis_deg or 0.0, **changed)


def check_body(
    body: BodyCase | MatrixCase, root_mm: float, bore_mm: float, face_mm: float, module_mm: float, modulus_GPa: float,
    place: str,
) -> None:  # fmt: skip
    """Raise `CaseError` where a body is not that of the gear: arguments as of `pmor.case.blank.check_blank`."""
    content, limit_mm = body.found, root_mm - LEAST_DEPTH * module_mm
    radius_mm, place = content.interface_radius_mm, f"{place} {'mesh' if isinstance(body, BodyCase) else 'matrix'}"
    if not bore_mm < radius_mm <= limit_mm:
        raise CaseError(
            f"{place}: its outside has the radius {radius_mm:.6g} mm, and must be above the bore's, {bore_mm:.6g} "
            f"mm, and at most {limit_mm:.6g} mm, half a module below the root circle: {_other_unit(body, limit_mm)}"
        )
    own_mm = content.bore_radius_mm if isinstance(content, BodyMesh) else bore_mm
    for name, found_mm, said_mm in (
        ("bore has the radius", own_mm, bore_mm), ("outside has the width", content.width_mm, face_mm),
    ):  # fmt: skip
        if abs(found_mm - said_mm) > DIGITS * said_mm:
            key = "bore_radius_mm" if "bore" in name else "face_width_mm"
            raise CaseError(
                f"{place}: its {name} {found_mm:.6g} mm, and {key} is {said_mm:.6g}: mesh the gear of the case, "
                f"or correct {key}"
            )
    if isinstance(body, MatrixCase):
        check_bodies([(place, Inertia(body.mass_kg, body.polar_inertia_kg_m2, body.tilting_inertia_kg_m2))], _refuse)
    if isinstance(content, BodyMatrix):
        share = content.stiffness_N_per_mm2 / (1e3 * modulus_GPa)
        if not PLAUSIBLE[0] < share < PLAUSIBLE[1]:
            raise CaseError(
                f"{place}: its nodes are {share:.2g} times as stiff as elements of their size are with {modulus_GPa:g} "
                f'GPa: write the stiffness, not its inverse, in the units that go with unit = "{body.unit}"'
            )


def _refuse(place: str, rule: str) -> NoReturn:
    raise CaseError(f"{place}: {rule}")


def _other_unit(body: BodyCase | MatrixCase, limit_mm: float) -> str:
    own = body.found.interface_radius_mm / UNITS[body.unit]
    for unit, length_mm in UNITS.items():
        if unit != body.unit and 0.3 * limit_mm < own * length_mm <= limit_mm:
            return f'it would fit in {unit}, write unit = "{unit}"'
    return "mesh no teeth, and end below the root"


def repetition(body: BodyCase | MatrixCase | None, holes: Any) -> int:
    """Return how often a blank repeats around its axis, 0 where teeth are all alike on it."""
    if body is not None:
        return body.found.repeats
    return 0 if holes is None else int(holes.count)
