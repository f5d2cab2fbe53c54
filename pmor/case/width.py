"""How much of the face width is meshed.

Deformation and contact of a spur pair with parallel axes, and faces and webs without offset, mirror themselves at mid
width. Half the width then stands for the whole: the plane at mid width keeps its nodes (u_z = 0), and what acts on a
node counts together with what acts on its image. In plane strain all sections deform alike, each in its own plane, and
one layer of elements is the whole.

The live page of a case: whether it is asked for, and on which mesh it solves the case.
"""

from __future__ import annotations

from dataclasses import replace

from pmor.case.capability import why_not
from pmor.case.schema import Case, Width
from pmor.case.tolerances import UNEVEN


def mirrors_at_mid_width(case: Case) -> bool:
    """Return whether half the width stands for the whole: spur, no offset, parallel axes, nodes in the middle plane."""
    return _mirrors_with_parallel_axes(case) and not _uneven(case)


def mirrors_without_tilt(case: Case) -> bool:
    """Return whether tilted axes of the training alone forbid half the width."""
    return _mirrors_with_parallel_axes(case) and _uneven(case)


def meshed_width(case: Case) -> Width:
    """Return the meshed part of the face width: half of it only where it stands for the whole."""
    if case.mesh.width == "plane_strain":
        return "plane_strain"
    return "half" if mirrors_at_mid_width(case) else "whole"


def elements_across(case: Case) -> int:
    """Return the number of elements over the width that are meshed."""
    across = case.mesh.width_elements
    return {"whole": across, "half": across // 2, "plane_strain": 1}[meshed_width(case)]


def intervals_across(case: Case) -> int:
    """Return the number of intervals between nodes over the width that is meshed."""
    return case.mesh.order * elements_across(case)


def sections_across(case: Case) -> int:
    """Return the number of sections over the width that is meshed, of line contact; of helical gears about.

    Columns of nodes, and two more elements of sections where the ends of the whole width are split
    (`pmor.line.sections`).
    """
    mesh, pair = case.mesh, case.pair
    element, depth = pair.face_width_mm / mesh.width_elements, case.contact.layer_depth * pair.module_mm
    split = meshed_width(case) == "whole" and pair.helix_angle_deg == 0.0 and element > depth
    return intervals_across(case) + 1 + (2 * mesh.order if split else 0)


def _mirrors_with_parallel_axes(case: Case) -> bool:
    mesh, pair = case.mesh, case.pair
    symmetric = pair.helix_angle_deg == pair.pinion.face_offset_mm == pair.wheel.face_offset_mm == 0.0
    gears = pair.pinion, pair.wheel
    blanks = [gear.light_blank(pair.face_width_mm) for gear in gears]
    even = all(blank is None or (blank.web_even and blank.held_offset_mm == 0.0) for blank in blanks)
    even = even and all(gear.body is None for gear in gears)  # the ends of a mesh may differ
    return mesh.width == "half" and symmetric and even and mesh.width_elements % 2 == 0


def _uneven(case: Case) -> bool:
    """Whether the halves are loaded unequally in any state: of the training, or, without one, of the sweep."""
    trained = case.offline
    if any(trained.in_plane_um) or any(trained.out_of_plane_um):
        return True
    if case.reduction.trained:
        return False
    if case.tolerances is not None and case.tolerances.scattering(UNEVEN):
        return True
    misalignments = [case.misalignment, *(condition.misalignment for condition in case.conditions)]
    flanks = [case.pinion_modification, case.wheel_modification, *case.other_flanks]
    flanks += [flank for condition in case.conditions for flank in (condition.pinion, condition.wheel)]
    return any(misalignment.tilted for misalignment in misalignments) or not all(flank.mirrored for flank in flanks)


def whole_width(case: Case) -> Case:
    """Return a case in which the whole width is meshed."""
    return replace(case, mesh=replace(case.mesh, width="whole"))


def asks_for_live_page(case: Case) -> bool:
    """Return whether a case asks for a page that solves it."""
    return case.output.report and case.output.live_page


def takes_whole_width(case: Case) -> bool:
    """Return whether the finite elements of the whole width are solved for the page alone.

    Half of it cannot represent differences between the halves, such as tilted axes and sloped flanks.
    """
    asked = asks_for_live_page(case) and not why_not(case, "page")
    return asked and case.mesh.width != "plane_strain" and mirrors_at_mid_width(case)


def case_of_page(case: Case) -> Case:
    """Return the case whose finite elements the page takes: of the whole width, without error bar and stress."""
    return whole_width(replace(case.without_stress(), mesh=replace(case.mesh, error_bar=False)))
