"""A case on half as many elements: the difference of its transmission error estimates the error of the mesh."""

from __future__ import annotations

from dataclasses import replace

from pmor.case.schema import Case

# Over the profile: half of fewer is too coarse to go by; two quadratic ones are three times as good as their rate.
LEAST_ELEMENTS = 8


def coarser(case: Case) -> Case | None:
    """Return a case with half as many elements over profile and width.

    Returns
    -------
    Case or None
        None where no error bar of the mesh is asked for, or where there is none: in penalty contact the local
        compliance is the mesh's own, and does not converge with it.
    """
    mesh = case.mesh
    if not mesh.error_bar or case.contact.kind != "line" or mesh.profile_elements < LEAST_ELEMENTS:
        return None
    # An even number stays even: the halves of the width remain halves.
    step = 2 if mesh.width_elements % 2 == 0 else 1
    across = step * -(-mesh.width_elements // (2 * step))
    along = mesh.profile_elements // 2
    return replace(
        case, mesh=replace(mesh, profile_elements=along, width_elements=across, error_bar=False),
        results=replace(case.results, root_stress=False),
    )  # fmt: skip
