"""Study files: one dataclass for each section, read from TOML; `pmor.case` checks their changes of the base case."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from pmor.case.reader import Reader, Sections, parse_toml, read_text, sections_in
from pmor.case.values import Refused, convert
from pmor.core.errors import CaseError, printable
from pmor.core.ranges import Range
from pmor.core.shown import brief
from pmor.lab.core.measures import merged

Count = Annotated[int, Range(1, 10_000)]
CELL = re.compile(r"([1-9]\d{0,2})@([1-9]\d?)")
# Angles of the reduced model's curves, per pitch.
CURVE_ANGLES = 200
# Of the short variant: angles per pitch of the grid and of the curves, and how it trains and compares.
QUICK_ANGLES, QUICK_CURVE_ANGLES = 24, 100
QUICK_CHANGES: Sections = {"offline": {"angles_per_pitch": 20}, "compare": {"angles": 8}}


@dataclass(frozen=True, order=True)
class Cell:
    """A cell of the study's grid: elements and level-of-detail magnification over the profile."""

    n_profile: int
    lodm: int
    variant: str = ""  # Name of the other differences from the base case; empty for the grid itself

    @staticmethod
    def from_toml(value: object) -> Cell:
        """Return the cell of a text such as ``"16@4"``."""
        match = CELL.fullmatch(value) if isinstance(value, str) else None
        if match is None:
            raise Refused('must be elements@LoDM over the profile: write text such as "16@4"')
        return Cell(int(match[1]), int(match[2]))

    @property
    def detail(self) -> int:
        """Level of detail E: contact points over the profile, elements times LoDM."""
        return self.n_profile * self.lodm

    @property
    def label(self) -> str:
        """Such as ``16@4``, followed by the variant's name."""
        return f"{self.n_profile}@{self.lodm}{' ' * bool(self.variant)}{self.variant}"


@dataclass(frozen=True, kw_only=True)
class Variant:
    """A cell with other settings (section ``[[variant]]``), solved by condensed full FE alone.

    Parameters
    ----------
    name : str
        Names the cell in results; no two variants of a cell have the same.
    cell : Cell
        Elements over the profile and level-of-detail magnification: `"16@4"`.
    changes : mapping
        Sections of the case file with the keys that differ.
    """

    name: str
    cell: Cell
    changes: Sections

    @property
    def varied_cells(self) -> tuple[Cell, ...]:
        """The cell under the variant's name."""
        return (replace(self.cell, variant=self.name),)


@dataclass(frozen=True, kw_only=True)
class Rung:
    """A step of a ladder of schemes (section ``[[rung]]``), in the order of the file: full and reduced model.

    Parameters
    ----------
    name : str
        Names the cells in results.
    cells : tuple of Cell
        Such as `["16@4", "32@2"]`.
    changes : mapping
        Sections of the case file with the keys that differ.
    """

    name: str
    cells: tuple[Cell, ...]
    changes: Sections

    @property
    def varied_cells(self) -> tuple[Cell, ...]:
        """The cells under the rung's name."""
        return tuple(replace(cell, variant=self.name) for cell in self.cells)


@dataclass(frozen=True, kw_only=True)
class GridSettings:
    """Cells and angles (section ``[grid]``).

    Parameters
    ----------
    cells : tuple of Cell
        None in a study of variants alone, which are then compared with each other and not with a reference.
    angles_per_pitch : int
        Regular grid of pinion angles on which every mesh is compared with the reference.
    """

    cells: tuple[Cell, ...] = ()
    angles_per_pitch: Annotated[int, Range(8, 1000)] = 96


@dataclass(frozen=True)
class ReferenceMesh:
    """A mesh of the reference's family: elements over profile and width, and LoDM over the profile."""

    n_profile: int
    n_width: int
    lodm: int

    @staticmethod
    def from_toml(value: object) -> ReferenceMesh:
        """Return the mesh of a list such as ``[96, 12, 4]``."""
        if not isinstance(value, list) or len(value) != 3:
            raise Refused("must be [elements over the profile, over the width, LoDM], such as [96, 12, 4]")
        return ReferenceMesh(*(convert(number, Count) for number in value))

    @property
    def label(self) -> str:
        """Such as ``96 x 12 @ 4``."""
        return f"{self.n_profile} x {self.n_width} @ {self.lodm}"


@dataclass(frozen=True, kw_only=True)
class ReferenceSettings:
    """Family of meshes whose finest is the reference (section ``[reference]``), coarsest first.

    Parameters
    ----------
    meshes : tuple of ReferenceMesh
        Two or three meshes: `[elements over the profile, over the width, LoDM]` each.
    """

    meshes: tuple[ReferenceMesh, ...]


@dataclass(frozen=True, kw_only=True)
class ConventionalSettings:
    """Where the conventional full FE is run (section ``[conventional]``).

    Parameters
    ----------
    solved : tuple of Cell
        A factorisation for every Newton step: minutes for each.
    """

    solved: tuple[Cell, ...] = ()


@dataclass(frozen=True, kw_only=True)
class PeerSettings:
    """The independent solver (section ``[peer]``).

    Parameters
    ----------
    cell : Cell
        The cell that it solves too.
    changes : mapping
        Sections of the case file with the keys that differ: the independent solver has its own surface.
    """

    cell: Cell
    changes: Sections


@dataclass(frozen=True, kw_only=True)
class QuickSettings:
    """The short variant of ``--quick`` (section ``[quick]``), on a coarser grid of angles.

    Parameters
    ----------
    cells : tuple of Cell
        Cells in place of those of the grid.
    meshes : tuple of ReferenceMesh
        Meshes of the reference, coarsest first.
    """

    cells: tuple[Cell, ...]
    meshes: tuple[ReferenceMesh, ...]


@brief
@dataclass(frozen=True, kw_only=True)
class Study:
    """Everything that a study file says, checked.

    Parameters
    ----------
    name : str
        Stem of the file name; it names the output folder.
    where : str
        Name of the file in error messages.
    changes : mapping
        Keys of the base case that differ in every cell: those that ``--quick`` shortens.
    title : str
        One line for the report; by default the name of the file.
    base : Path
        Case file that the cells vary.
    grid, variants, rungs, reference, conventional, peer, quick
        One per section; `reference`, `peer` and `quick` are None where the file has none.
    """

    name: str
    where: str
    changes: Sections
    title: str = ""
    base: Path
    grid: GridSettings
    variants: Annotated[tuple[Variant, ...], "variant"] = ()
    rungs: Annotated[tuple[Rung, ...], "rung"] = ()
    reference: ReferenceSettings | None = None
    conventional: ConventionalSettings = ConventionalSettings()
    peer: PeerSettings | None = None
    quick: QuickSettings | None = None

    @property
    def meshes(self) -> tuple[ReferenceMesh, ...]:
        """Meshes of the reference's family; none in a study of variants alone."""
        return self.reference.meshes if self.reference is not None else ()

    @property
    def cells(self) -> tuple[Cell, ...]:
        """Cells of the grid, of the ladder, and of the variants."""
        return (*self.reduced_cells, *(cell for variant in self.variants for cell in variant.varied_cells))

    @property
    def ladder_cells(self) -> tuple[Cell, ...]:
        """Cells of the ladder, rung after rung."""
        return tuple(cell for rung in self.rungs for cell in rung.varied_cells)

    @property
    def reduced_cells(self) -> tuple[Cell, ...]:
        """Cells with a reduced model: of the grid, then of the ladder."""
        return (*self.grid.cells, *self.ladder_cells)

    @property
    def curve_angles(self) -> int:
        """Angles of the reduced model's curves, per pitch."""
        return QUICK_CURVE_ANGLES if self.changes else CURVE_ANGLES

    def changes_of(self, cell: Cell) -> dict[str, dict[str, Any]]:
        """Sections and keys in which a cell differs from the base case."""
        listed: list[Variant | Rung] = [*self.variants, *self.rungs]
        varied = [v.changes for v in listed if cell in v.varied_cells]
        own = {"mesh": {"profile_elements": cell.n_profile}, "contact": {"lodm_profile": cell.lodm}}
        return merged(self.changes, *varied, own)


def quick_study(study: Study) -> Study:
    """Return the short variant of a study; `CaseError` when its file has no section ``[quick]``."""
    quick = study.quick
    if quick is None:
        raise CaseError(f"{study.where}: [quick]: is missing: add it to say what --quick runs")
    return replace(
        study,
        title=f"{study.title} (quick)",
        grid=replace(study.grid, cells=quick.cells, angles_per_pitch=QUICK_ANGLES),
        variants=(),
        rungs=tuple(replace(rung, cells=rung.cells[:1]) for rung in study.rungs),
        reference=ReferenceSettings(meshes=quick.meshes),
        conventional=ConventionalSettings(),
        peer=None,
        changes=QUICK_CHANGES,
    )


def load(path: Path | str, *, quick: bool = False) -> Study:
    """Read and check a study file, or its short variant; its base case is looked for beside it.

    Raises
    ------
    CaseError
        One line with file, section, key, rule and remedy.
    """
    path = Path(path)
    study = parse_study(read_text(path, "study file"), printable(path.stem), str(path), path.parent)
    return quick_study(study) if quick else study


def parse_study(text: str, name: str, where: str, folder: Path) -> Study:
    """Check the TOML text of a study file, called `where` in messages; the base case is looked for in `folder`."""
    reader = Reader(where, sections_in(Study))
    given = {"name": name, "where": where, "changes": {}}
    study = reader.section(parse_toml(text, where), Study, filled={"title": name}, given=given)
    study = replace(study, base=folder / study.base)
    _check_together(study)
    return study


def _check_together(study: Study) -> None:
    """Raise `CaseError` where values that are fine alone do not go together."""

    def refuse(place: str, rule: str) -> None:
        raise CaseError(f"{study.where}: {place}: {rule}")

    if not study.reduced_cells and study.reference is not None:
        refuse("[grid] cells", "is missing: add 'cells = ...' there")
    if study.reduced_cells and study.reference is None:
        refuse("[reference] meshes", "is missing: add 'meshes = ...' there")
    if not study.cells:
        refuse("[[variant]]", "is missing: add one, or [grid] cells with a [reference]")
    for section, family in (("reference", study.reference), ("quick", study.quick)):
        sizes = [(m.n_profile, m.n_width) for m in family.meshes] if family is not None else [(1, 1), (2, 1)]
        finer = all(a[0] < b[0] and a[1] <= b[1] for a, b in zip(sizes[:-1], sizes[1:], strict=True))
        if len(sizes) not in (2, 3) or not finer:
            refuse(f"[{section}] meshes", "must be two or three meshes, from coarse to fine over the profile")
    varied = study.cells[len(study.grid.cells) :]
    if len(set(varied)) < len(varied):
        refuse("[variant], [rung] name", "two variants of a cell have the same name: rename one")
    grid = set(study.grid.cells)
    for cell in study.conventional.solved:
        if cell not in grid:
            rule = "is not among the [grid] cells: add it there or remove it here"
            refuse(f"[conventional] solved: {cell.label}", rule)
