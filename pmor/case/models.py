"""Cases beside a case: its reduced models, each with its contact scheme, and the same case on a coarser mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from pmor.case.schema import Case, MeshCase, Scheme
from pmor.case.training import Shapes

#: shapes of the models that `[compare] models` names by their contact schemes
SHAPES_OF_MODEL: dict[Scheme, Shapes] = {
    "paper": "positions",
    "direct": "flank_lines",
    "facet": "flank_lines",
    "line": "line_loads",
}


def model_names(case: Case) -> tuple[Scheme, ...]:
    """Return the schemes of the models that a case compares, its own among them; none where it lists none."""
    listed, own = case.compare.models or (), case.contact.scheme
    return listed if own in listed or not listed else (*listed, own)


def other_models(case: Case) -> Iterator[tuple[Scheme, Case]]:
    """Return the models that a case compares beside its own, each as a case of its own.

    They answer for the condition of the case alone, and keep all else: gears, training, sweep and comparison, and the
    nodes of the mesh. Between these, schemes other than line contact have linear elements: corners and middles of
    quadratic ones would carry their points unevenly.
    """
    for scheme in model_names(case):
        if scheme != case.contact.scheme:
            reduction = replace(case.reduction, shapes=SHAPES_OF_MODEL[scheme], interpolation="linear")
            contact = replace(case.contact, scheme=scheme)
            alone = replace(case.compare, models=None)
            mesh = case.mesh if contact.kind == "line" else of_linear_elements(case.mesh)
            yield scheme, replace(
                case, name=f"{case.name}_{scheme}", mesh=mesh, contact=contact, reduction=reduction, conditions=(),
                loads=(), tolerances=None, compare=alone,
            )  # fmt: skip


def of_linear_elements(mesh: MeshCase) -> MeshCase:
    """Return the mesh itself, or one of linear elements between the nodes of its quadratic ones."""
    if mesh.order == 1:
        return mesh
    along, across = mesh.order * mesh.profile_elements, mesh.order * mesh.width_elements
    return replace(mesh, element="hex8i", profile_elements=along, width_elements=across)


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
