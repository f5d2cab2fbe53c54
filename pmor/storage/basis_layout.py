"""Datasets of a basis file, by its case.

A new kind of content is a further table here, the arrays that it takes (`pmor.storage.basis_file`), and the laws that
tie them to the case and to each other (`pmor.storage.basis_checks`).
"""

from __future__ import annotations

from dataclasses import replace

from pmor.body.rim import NEIGHBOURS
from pmor.case import Case
from pmor.case.width import intervals_across
from pmor.gear.pair import GearPair
from pmor.line.sections import loaded_components
from pmor.reduction.contact_shapes import STENCIL
from pmor.storage.condition_table import CONDITIONS, NAME
from pmor.storage.layout import Field

GEARS = ("pinion", "wheel")
# Folder of the same pair on half as many elements.
COARSER, WHOLE = "coarser", "whole"
# Lengths of axes that are those of all cases.
FIXED_SIZES = {
    "xy": 2, "xyz": 3, "radius angle z": 3, "gear": 2, "side": 2, "in the surface": 3, "neighbour": 2 * NEIGHBOURS + 1,
}  # fmt: skip
# Folder of what a basis answered when its file was written (`pmor.storage.basis_answers`).
ANSWERS = "answers"

FLANK = {
    "nodes": Field("mm", "profile, width, xyz", "undeformed flank nodes, tooth frame"),
    "roll_angle": Field("rad", "profile", "roll angle of the flank nodes", least=0.0),
}
LAYER = {
    "depth": Field("mm", "profile", "depth of the layer that line contact stands on", least=1e-9, most=1e6),
    "constant": Field("1", "profile", "constant of the approach, ln(2 depth) + 1/2 + a"),
}
LINES = {
    "start": Field("1", "line", "first shape of each flank line", kind=int, increasing=True, least=0),
    "force": Field("N", "shape, flank unknown", "unit load of each shape"),
    "displacement": Field("mm", "tooth offset, shape, flank unknown", "displacement of each shape"),
    "gram": Field("N mm", "tooth offset, shape, shape", "energy products of the shapes"),
}
POSITIONS = {
    "roll_position": Field("rad", "position", "roll position of the tooth pair", increasing=True),
    "loaded": Field("1", "position, shape", "whether the pair carries load", kind=bool),
    "displacement": Field(
        "mm", "position, shape, gear, tooth offset, flank unknown", "displacement of each shape"
    ),
    "gram": Field("N mm", "pitch offset, position, a, b, shape, shape", "energy products of the shapes"),
}  # fmt: skip
SUPPORT = {
    "rows": Field("1", "loaded unknown, felt pattern", "patterns of forces on a flank that holes feel"),
    "compliance": Field(
        "mm/N",
        "loaded tooth, pitch offset, felt pattern, felt pattern",
        "movement of the patterns of a tooth under forces on another one, which repeats after so many loaded ones",
    ),
}
COMPLIANCE = "pitch offset, loaded unknown, loaded unknown"
ROOT_STRESS = {
    "section": Field("mm", "point, xy", "along the loaded side's fillet, from the involute to the tooth space, z = 0"),
    "z": Field("mm", "column", "columns along the face width", increasing=True),
    "pattern": Field("1", "pattern, loaded unknown", "amplitude of each pattern of forces on a flank"),
    "stress": Field(
        "MPa/N", "neighbour, side, point, column, in the surface, pattern",
        "along both fillets of the loaded tooth and its neighbours: along the outline, across it, shear",
    ),
    "rim_stress": Field(
        "1", "side, point, column, in the surface, pattern by rim", "patterns of stress by the bending of the rim"
    ),
    "rim_pattern": Field("1", "pattern on rim, loaded unknown", "amplitude of each pattern of forces that it feels"),
    "rim_moved": Field(
        "MPa/N", "loaded tooth, tooth from it on, pattern by rim, pattern on rim",
        "amplitudes of stress on the teeth around each tooth after which the gear repeats",
    ),
}  # fmt: skip
WEB_STRESS = {
    "places": Field("mm", "place, radius angle z", "points of the first cell; angle in rad from the middle of tooth 0"),
    "edge": Field("1", "place", "whether a point is at the edge of a hole", kind=bool),
    "stress": Field("1", "place, in the surface, pattern", "patterns: two directions in the surface, shear"),
    "pattern": Field("1", "felt pattern, loaded unknown", "amplitude of each pattern of forces on a flank"),
    "moved": Field(
        "MPa/N", "loaded tooth, cell, pattern, felt pattern",
        "amplitudes of stress in the cells around the axis by forces on each tooth after which the gear repeats",
    ),
}  # fmt: skip
ANSWERED = {
    "displacement": Field("mm", "pitch offset, loaded unknown", "of the flanks under uneven forces on one of them"),
    "stress": Field(
        "MPa", "neighbour, side, point, column, in the surface", "along the fillets under these forces", optional=True
    ),
    "web_stress": Field("MPa", "cell, place, in the surface", "on the web under these forces", optional=True),
}
TRAINING = {
    "phi": Field("rad", "angle", "pinion angle"),
    NAME: CONDITIONS,
    "ste": Field("um", "condition, angle", "static transmission error of full FE", finite=False),
    "converged": Field("1", "condition, angle", "whether full FE converged", kind=bool),
    "force": Field("N", "position, state, gear, flank unknown", "nodal forces of full FE"),
}
DECAY = Field(
    "%", "angle", "largest error estimate over the STE before each solve of a greedy sampling", finite=False, least=0.0
)


def basis_layout(case: Case) -> dict[str, Field]:
    """Return the datasets of a case's basis, by their paths."""
    layout = {f"training/{name}": field for name, field in TRAINING.items()}
    for gear in GEARS:
        layout |= {f"flank/{gear}/{name}": field for name, field in FLANK.items()}
        if case.contact.kind == "line":
            layout |= {f"layer/{gear}/{name}": field for name, field in LAYER.items()}
        if case.reduction.by_line:
            layout |= {f"shapes/{gear}/{name}": field for name, field in LINES.items()}
        if group := compliance_group(case):
            words = "compliance between loaded flanks; identical gears: one"
            layout[f"{group}/{gear}"] = Field("mm/N", COMPLIANCE, words, optional=gear == "wheel")
            layout[f"{ANSWERS}/{gear}/displacement"] = ANSWERED["displacement"]
        if case.contact.kind == "line":
            layout |= {f"web_stress/{gear}/{name}": replace(f, optional=True) for name, f in WEB_STRESS.items()}
            layout[f"{ANSWERS}/{gear}/web_stress"] = ANSWERED["web_stress"]
        if case.root_stress:
            stress = {name: replace(field, optional=True) for name, field in ROOT_STRESS.items()}
            layout |= {f"root_stress/{gear}/{name}": field for name, field in stress.items()}
            layout[f"{ANSWERS}/{gear}/stress"] = ANSWERED["stress"]
    if not has_shapes(case):
        layout |= {
            f"support/{gear}/{name}": replace(field, optional=True)
            for gear in GEARS for name, field in SUPPORT.items()
        }  # fmt: skip
    elif not case.reduction.by_line:
        layout |= {f"shapes/{name}": field for name, field in POSITIONS.items()}
    if case.offline.sampling == "greedy":
        layout["training/estimate"] = DECAY
    return layout


def further_layout(case: Case) -> dict[str, Field]:
    """Return the datasets of a further basis, on another mesh, by their paths in its folder; it has no training."""
    layout = basis_layout(case)
    return {name: field for name, field in layout.items() if not name.startswith("training/")}


def has_shapes(case: Case) -> bool:
    """Return whether a basis holds shapes: all but that of line loads."""
    return case.reduction.shapes != "line_loads"


def compliance_group(case: Case) -> str:
    """Return the folder that holds the compliance between loaded flanks, empty where there is none."""
    if not has_shapes(case):
        return "line_loads"
    return "error_estimate" if case.reduction.error_estimate else ""


def basis_sizes(case: Case, pair: GearPair) -> dict[str, int]:
    """Return the lengths of the axes that follow from a case."""
    rows, columns, neighbours = case.mesh.profile_intervals + 1, intervals_across(case) + 1, pair.neighbouring_teeth
    stencil = STENCIL[case.reduction.interpolation] if case.reduction.shapes != "global_pod" else 2
    parts = loaded_components(case.contact.kind != "nodal", pair.pinion.helix_angle != 0.0)
    return {
        **FIXED_SIZES,
        "profile": rows,
        "line": rows + 1,
        "width": columns,
        "flank unknown": 3 * rows * columns,
        "loaded unknown": parts * rows * columns,
        "tooth offset": 2 * neighbours + 1,
        "pitch offset": neighbours + 1,
        "a": stencil,
        "b": stencil,
    }
