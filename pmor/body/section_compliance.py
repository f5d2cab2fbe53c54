"""Compliance between the sections of flanks, for line loads: that of the flank nodes, interpolated over the width."""

from __future__ import annotations

import numpy as np

from pmor.body.flank_compliance import FlankCompliance
from pmor.core.arrays import FloatArray
from pmor.line.kernels.types import Sections

# Rows of nodes that carry a section.
ROWS = 4


def section_compliance(
    compliance: FlankCompliance, sections: Sections, rows: tuple[int, int]
) -> tuple[FloatArray, FloatArray]:
    """Return displacements at each section's rows of nodes under unit forces there.

    Parameters
    ----------
    compliance : FlankCompliance
    sections : Sections
    rows : (int, int)
        Rows of nodes on the pinion's and the wheel's flank.

    Returns
    -------
    two ndarrays, shape (neighbours + 1, S, S, r c, r c)
        Displaced section, loaded section; r rows, at least four, of c components, mm/N. The same array for gears that
        share their compliance and whose columns carry the sections alike.
    """
    pinion = _of_gear(compliance.gears[0], compliance.components, rows[0], sections, 0)
    alike = np.array_equal(sections.column[0], sections.column[1]) and np.array_equal(*sections.share)
    if compliance.gears[1] is compliance.gears[0] and alike:
        return pinion, pinion
    return pinion, _of_gear(compliance.gears[1], compliance.components, rows[1], sections, 1)


def _of_gear(blocks: FloatArray, components: int, rows: int, sections: Sections, gear: int) -> FloatArray:
    columns = blocks.shape[1] // (rows * components)
    shares = np.zeros((len(sections.z), columns))
    for section, (first, weights) in enumerate(zip(sections.column[gear], sections.share[gear], strict=True)):
        used = weights[: columns - first]
        shares[section, first : first + len(used)] = used
    between = np.empty((len(blocks), len(shares), len(shares), max(rows, ROWS) * components,
                        max(rows, ROWS) * components))  # fmt: skip
    between[:] = 0.0
    size = rows * components
    for apart, block in enumerate(blocks):
        whole = block.reshape(rows, columns, components, rows, columns, components)
        loaded = np.tensordot(whole, shares, axes=(4, 1))  # rows, columns, parts, rows, parts, sections
        both = np.tensordot(shares, loaded, axes=(1, 1))  # sections, rows, parts, rows, parts, sections
        between[apart, :, :, :size, :size] = both.transpose(0, 5, 1, 2, 3, 4).reshape(
            len(shares), len(shares), size, size
        )
    return between
