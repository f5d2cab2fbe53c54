"""Answers that a basis file keeps: how flanks and fillets yielded to a load when the file was written.

No law ties the compliance of a case's flanks or the stress along its fillets to the case without its finite elements. A
basis whose arrays were put into another order, or of which a number was changed, would give wrong results; the laws
(`pmor.storage.basis_checks`) cannot tell. So whoever reads the file loads flanks and fillets again and compares.

The load is uneven, between 1 and 2 N on every unknown: none of its parts can be exchanged unnoticed. It does not depend
on the law of contact: a basis stays valid where that becomes better, and reading takes no contact kernels.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pmor.body.flank_compliance import FlankCompliance
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
    if basis.compliance is not None:
        moved = _moved_flanks(basis.compliance)
        found |= {f"{ANSWERS}/{gear}/displacement": array for gear, array in zip(GEARS, moved, strict=True)}
    if basis.root_stress is not None:
        for gear, shapes in zip(GEARS, basis.root_stress, strict=True):
            load = _load(shapes.pattern.shape[1])
            bent = np.tensordot(_load(shapes.repeats), shapes.rim_moved, axes=1)
            bent = np.tensordot(_load(len(bent)), bent, axes=1) @ (shapes.rim_pattern @ load)
            found[f"{ANSWERS}/{gear}/stress"] = shapes.stress @ (shapes.pattern @ load) + shapes.rim_stress @ bent
    for gear, web in zip(GEARS, basis.web_stress, strict=True):
        if web is not None:
            bent = np.tensordot(_load(len(web.moved)), web.moved, axes=1) @ (web.pattern @ _load(web.pattern.shape[1]))
            found[f"{ANSWERS}/{gear}/web_stress"] = np.einsum("pia,ca->cpi", web.stress, bent)
    return found


def _moved_flanks(compliance: FlankCompliance) -> list[FloatArray]:
    """Displacement of the loaded tooth and of those beside it; by holes, as a sum over unevenly loaded teeth."""
    pinion, wheel = compliance.gears
    load = _load(pinion.shape[1])
    moved = [pinion @ load]
    moved.append(moved[0].copy() if wheel is pinion else wheel @ load)
    for gear, support in enumerate(compliance.supports):
        if support is not None:
            summed = np.tensordot(_load(len(support.compliance)), support.compliance, axes=1)
            moved[gear] += summed @ (support.rows.T @ load) @ support.rows.T
    return moved


def _load(count: int) -> FloatArray:
    """Uneven forces on the unknowns of a flank, N."""
    return np.asarray(1.0 + np.modf(GOLDEN * np.arange(1, count + 1))[0])


def check_answers(basis: Basis, kept: Mapping[str, FloatArray]) -> None:
    """Raise Damaged where a basis does not answer as it did when its file was written.

    Parameters
    ----------
    basis : Basis
        That obeys the laws of `pmor.storage.basis_checks`.
    kept : mapping of str to ndarray
        Answers in its file, by their paths there.
    """
    found = answers_of(basis)
    for name in sorted({*found, *kept}):
        own, asked = found.get(name, np.empty(0)), kept.get(name, np.empty(0))
        same = own.shape == asked.shape and np.abs(own - asked).max() <= ROUND_OFF * np.abs(asked).max()
        require(same, f"it does not answer as it did when it was written ({name})")
