"""The reduced models that a case compares: each a contact scheme, with the reduction that goes with it."""

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
                compare=alone,
            )  # fmt: skip


def of_linear_elements(mesh: MeshCase) -> MeshCase:
    """Return the mesh itself, or one of linear elements between the nodes of its quadratic ones."""
    if mesh.order == 1:
        return mesh
    along, across = mesh.order * mesh.profile_elements, mesh.order * mesh.width_elements
    return replace(mesh, element="hex8i", profile_elements=along, width_elements=across)
