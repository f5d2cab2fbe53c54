"""A case on another mesh, mostly half as fine: the difference of both errors estimates the error of the mesh."""

from __future__ import annotations

from dataclasses import replace

from pmor.case.schema import Case

# Over the profile: half of fewer is too coarse to go by; two quadratic ones are three times as good as their rate.
LEAST_ELEMENTS = 8


def coarser(case: Case) -> Case | None:
    """Return a case with half as many elements, as `halved`; None where no error bar of the mesh is asked for."""
    return halved(case) if case.mesh.error_bar else None


def halved(case: Case) -> Case | None:
    """Return a case with half as many elements over profile and width.

    One or two elements over the width are not halved: there are four times as many, which loads that vary over it need.

    Returns
    -------
    Case or None
        None where the difference says nothing: of a coarse mesh, or in penalty contact, where the local compliance is
        the mesh's own and does not converge with it.
    """
    mesh = case.mesh
    if case.contact.kind != "line" or mesh.profile_elements < LEAST_ELEMENTS:
        return None
    # An even number stays even: the halves of the width remain halves.
    step = 2 if mesh.width_elements % 2 == 0 else 1
    across = step * -(-mesh.width_elements // (2 * step))
    if across == mesh.width_elements and mesh.width != "plane_strain":
        across *= 4
    along = mesh.profile_elements // 2
    return replace(
        case.without_stress(),
        mesh=replace(mesh, profile_elements=along, width_elements=across, error_bar=False),
    )
