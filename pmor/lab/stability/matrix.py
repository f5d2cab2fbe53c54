"""The matrix of a case, and the base case that its variants change."""

from __future__ import annotations

from pmor.case import Case, change_case, of_linear_elements, without_models
from pmor.lab.core.measures import merged
from pmor.lab.stability.contact_variants import DIRECT, basis_variants, contact_variants
from pmor.lab.stability.flank_variants import flank_variants
from pmor.lab.stability.variants import Variant, gear_variants, load

# A mesh on which a position takes milliseconds: the question is whether the program holds, not the last digit.
MOST_PROFILE_ELEMENTS = 16
WIDTH_ELEMENTS = 4


def base_case(case: Case) -> Case:
    """Return a case on the mesh of the matrix, with its nominal torque for all stages, and with a penalty.

    Line contact has neither penalty nor refinement, which the matrix varies most; it has variants of its own, on
    quadratic elements. Penalties are for linear ones.
    """
    linear = of_linear_elements(case.mesh)
    elements = min(linear.profile_elements, MOST_PROFILE_ELEMENTS)
    across = min(linear.width_elements, WIDTH_ELEMENTS)
    mesh = {"mesh": {"element": linear.element, "profile_elements": elements, "width_elements": across}}
    scheme = DIRECT if case.contact.scheme == "line" else {}
    return change_case(without_models(case), **merged(mesh, load(case.torque_Nm), scheme))


def matrix(base: Case, only: str = "") -> tuple[Variant, ...]:
    """Return the variants of a base case with a text in name or group; all of them without a text."""
    variants = (
        Variant("base case", "Base case", "the case itself, on the mesh of this matrix"),
        *contact_variants(base),
        *gear_variants(base),
        *flank_variants(base),
        *basis_variants(base),
    )
    return tuple(v for v in variants if only.lower() in f"{v.group} {v.name}".lower())
