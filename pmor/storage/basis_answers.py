"""Answers that a file keeps: how flanks and fillets yielded to a load when it was written.

No law ties the compliance of a case's flanks or the stress along its fillets to the case without its finite elements. A
basis whose arrays were put into another order, or of which a number was changed, would give wrong results; the laws
(`pmor.storage.basis_checks`) cannot tell. So whoever reads the file loads flanks and fillets again and compares.

The load is uneven, between 1 and 2 N on every unknown: none of its parts can be exchanged unnoticed. It does not depend
on the law of contact: a basis stays valid where that becomes better, and reading takes no contact kernels.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pmor.body.far_compliance import FarCompliance
from pmor.body.root_stress import RootStressShapes
from pmor.body.support import Support
from pmor.body.web_stress import WebStress
from pmor.core.arrays import FloatArray
from pmor.reduction.basis import Basis
from pmor.storage.basis_layout import ANSWERS, GEARS
from pmor.storage.layout import require

# Relative to the largest of an answer: the same sums in another order, on another computer.
ROUND_OFF = 1e-11
# Its multiples are spread over a period as evenly as can be, and never repeat (Weyl, Math. Ann. 77, 1916, 313).
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


def answers_of(basis: Basis) -> dict[str, FloatArray]:
    """Load the flanks of a basis, without those further ones that it has beside it.

    Returns
    -------
    dict of str to ndarray
        By the paths in the file: displacement of the flanks of pinion and wheel, mm, shape (pitch offset, loaded
        unknown), the stress along their fillets, MPa, shape (neighbour, side, point, column, 3), and on their webs,
        shape (cell, point, 3); each as far as the basis has what it takes.
    """
    found = dict[str, FloatArray]()
    for number, gear in enumerate(GEARS):
        answers = dict[str, FloatArray]()
        if (compliance := basis.compliance) is not None:
            answers["displacement"] = moved_flank(compliance.gears[number], compliance.supports[number])
        if basis.root_stress is not None:
            answers["stress"] = stress_of_fillets(basis.root_stress[number])
        found |= {f"{ANSWERS}/{gear}/{name}": array for name, array in answers.items()}
    for gear, web in zip(GEARS, basis.web_stress, strict=True):
        if web is not None:
            found[f"{ANSWERS}/{gear}/web_stress"] = stress_of_web(web)
    return found


def moved_flank(blocks: FloatArray, support: Support | None) -> FloatArray:
    """Displacement of the loaded tooth and of those beside it; by holes, as a sum over unevenly loaded teeth.

    Parameters
    ----------
    blocks, support
        As in `pmor.body.flank_compliance.FlankCompliance`, of one gear.
    """
    load = _load(blocks.shape[1])
    moved = np.asarray(blocks @ load)
    if support is None:
        return moved
    summed = np.tensordot(_load(len(support.compliance)), support.compliance, axes=1)
    by_holes = np.asarray(summed @ (support.rows.T @ load) @ support.rows.T)
    by_holes[: len(moved)] += moved
    return by_holes


def stress_of_fillets(shapes: RootStressShapes) -> FloatArray:
    """Stress along the fillets under that load, as a sum over unevenly loaded teeth where they differ."""
    load = _load(shapes.pattern.shape[1])
    bent = np.tensordot(_load(shapes.repeats), shapes.rim_moved, axes=1)
    bent = np.tensordot(_load(len(bent)), bent, axes=1) @ (shapes.rim_pattern @ load)
    return np.asarray(shapes.stress @ (shapes.pattern @ load) + shapes.rim_stress @ bent)


def stress_of_web(web: WebStress) -> FloatArray:
    """Stress on the web under that load, as a sum over unevenly loaded teeth."""
    bent = np.tensordot(_load(len(web.moved)), web.moved, axes=1) @ (web.pattern @ _load(web.pattern.shape[1]))
    return np.asarray(np.einsum("pia,ca->cpi", web.stress, bent))


def moved_far_teeth(far: FarCompliance) -> FloatArray:
    """Displacement of far teeth by loads on their shapes, (flanks images backs, teeth, loaded unknown); 0 of others."""
    load = _load(far.shapes.shape[1])
    between = np.nan_to_num(np.stack([far.flanks, far.images, far.backs]))
    return np.asarray((between @ load) @ far.shapes.T)


def _load(count: int) -> FloatArray:
    """Uneven forces on the unknowns of a flank, N."""
    return np.asarray(1.0 + np.modf(GOLDEN * np.arange(1, count + 1))[0])


def check_answers(found: Mapping[str, FloatArray], kept: Mapping[str, FloatArray]) -> None:
    """Raise Damaged where what was read does not answer as it did when its file was written.

    Parameters
    ----------
    found : mapping of str to ndarray
        Answers of what was read and obeys the laws of its file (`pmor.storage.basis_checks`), by their paths there.
    kept : mapping of str to ndarray
        Answers in the file.
    """
    for name in sorted({*found, *kept}):
        own, asked = found.get(name, np.empty(0)), kept.get(name, np.empty(0))
        largest = np.abs(asked).max(initial=0.0)
        same = own.shape == asked.shape and np.abs(own - asked).max(initial=0.0) <= ROUND_OFF * largest
        require(same, f"it does not answer as it did when it was written ({name})")
