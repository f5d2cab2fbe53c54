"""The geometry of a case's gear pair in Python, without finite elements."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

from pmor.case import Case
from pmor.core.wording import suggesting
from pmor.gear.data_sheet import DataSheet
from pmor.pair.model import gear_pair
from pmor.report.data_sheet import sheet_of, sheet_tables
from pmor.report.table import aligned_lines, format_cell


@dataclass(frozen=True, kw_only=True, repr=False)
class Geometry(DataSheet):
    """Data sheet of a gear pair, as ISO 21771 names it; text and notebooks show it as tables.

    `pinion` and `wheel` hold what each gear has of its own (`pmor.gear.data_sheet.GearData`).
    """

    def __repr__(self) -> str:
        return (
            f"<Geometry: {self.pinion.teeth}/{self.wheel.teeth} teeth, module {self.normal_module_mm:g} mm, "
            f"centre distance {self.centre_distance_mm:.4f} mm, contact ratio {self.transverse_contact_ratio:.3f} + "
            f"{self.overlap_ratio:.3f}>"
        )

    def __str__(self) -> str:
        parts = [[table.title, *(f"  {line}" for line in aligned_lines(table.columns, table.rows))]
                 for table in sheet_tables(self)]  # fmt: skip
        return "\n".join(line for part in parts for line in part)

    def _repr_html_(self) -> str:
        parts = []
        for table in sheet_tables(self):
            head = "".join(f"<th>{escape(name)}</th>" for name in table.columns)
            rows = ("".join(f"<td>{escape(format_cell(cell))}</td>" for cell in row) for row in table.rows)
            body = "".join(f"<tr>{row}</tr>" for row in rows)
            parts.append(f"<h4>{escape(table.title)}</h4><table><tr>{head}</tr>{body}</table>")
        return "".join(parts)


@suggesting
def geometry(case: Case) -> Geometry:
    """Return the data sheet of a case's gear pair: diameters, angles, contact ratios, backlash, places on the profile.

    Nothing is meshed or solved.

    Returns
    -------
    Geometry
        Frozen, numbers with units in their names; printed, it is the sheet.

    Raises
    ------
    CaseError, GeometryError
        When there are no such gears, or they do not mesh.
    """
    return Geometry(**vars(sheet_of(case, gear_pair(case))))
