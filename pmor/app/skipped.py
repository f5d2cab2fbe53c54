"""Computed and skipped work of a case, with the reason of each omission and its saving.

Sizes are those of the meshes of this very case; nothing is solved for them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from pmor.case import Case, beyond_training, other_models
from pmor.case.models import coarser, halved
from pmor.case.width import meshed_width, mirrors_without_tilt, sections_across
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.completion import nodes_of_elements
from pmor.fe.fillet import build_fillet
from pmor.fe.sector import SectorMesh
from pmor.gear.pair import GearPair
from pmor.line.sections import loaded_components
from pmor.pair.conditions import full_solves
from pmor.pair.limits import range_warnings
from pmor.pair.model import approach_estimate, contact_scheme, gear_pair, same_body, sector_meshes
from pmor.work.cost import sharing_bodies
from pmor.work.sizes import rows_in_contact

DOUBLE = 8  # bytes
PICTURES = "curves, load sharing, stiffness, spectrum, error, mesh"
WHY_UNTRAINED = {
    "static_modes": "unit forces on all flank nodes",
    "line_loads": "all that line contact asks of the teeth is the compliance of their flanks",
}


@dataclass(frozen=True)
class Scene:
    """A case with what its plan is counted from.

    Parameters
    ----------
    sectors : two SectorMesh
        The same object twice when the gears have the same mesh.
    """

    case: Case
    pair: GearPair
    sectors: tuple[SectorMesh, SectorMesh]

    @property
    def bodies(self) -> tuple[SectorMesh, ...]:
        """Meshes that finite elements are solved on."""
        return self.sectors[:1] if same_body(self.case, *self.sectors) else self.sectors

    @property
    def lines(self) -> int:
        """Rows of nodes along a flank."""
        return self.case.mesh.profile_intervals + 1

    @property
    def columns(self) -> int:
        """Nodes over the face width, as far as it is meshed."""
        return len(self.sectors[0].z)

    @property
    def flank_unknowns(self) -> int:
        """Unknowns of a flank that elements have."""
        return 3 * len(nodes_of_elements(self.sectors[0], self.sectors[0].flank))


@dataclass(frozen=True)
class Skipped:
    """One thing that is not computed.

    Parameters
    ----------
    what, why, saving : str
        The saving has the numbers.
    """

    what: str
    why: str
    saving: str


def scene(case: Case) -> Scene:
    """Mesh a case for its plan; CaseError, GeometryError or MeshError where that fails."""
    pair = gear_pair(case)
    return Scene(case, pair, sector_meshes(case, pair))


def computed(scene: Scene) -> list[tuple[str, str]]:
    """List the computed parts, as (what, how much)."""
    teeth = [sector.teeth for sector in scene.bodies]
    parts = [
        ("finite-element models", f"{len(scene.bodies)}, one tooth sector each"),
        ("  unknowns", ", ".join(f"{unknowns(sector)}" for sector in scene.bodies)),
        ("  right-hand sides", f"{scene.flank_unknowns} unit forces on one flank per model"),
        ("  systems of the ring", ", ".join(f"{z // 2 + 1} harmonics of {z}" for z in teeth)),
    ]
    if mirrors_without_tilt(scene.case):
        parts.append(("  face width", "all of it: the axes of the training tilt, and load its halves unequally"))
    if scene.case.reduction.shapes == "line_loads":
        parts.append(("compliance for the line loads", _compliance(scene)))
        if coarse := coarser(scene.case):
            parts.append(("error bar of the mesh", f"all of that on {_elements(coarse)} elements too"))
        if scene.case.root_stress:
            parts.append(("stress along the fillets", _fillets(scene)))
    elif scene.case.reduction.error_estimate:
        parts.append(("compliance for the error bar", _compliance(scene)))
    return parts


def skipped(scene: Scene) -> list[Skipped]:
    """List the skipped parts, in the order of the work."""
    return [item for part in (_of_bodies, _of_training, _of_contact, _of_output) for item in part(scene)]


def remarks(scene: Scene) -> tuple[str, ...]:
    """Warn of loads beyond linear elasticity, of elements that lock, and of a sweep beyond the training."""
    beyond = (f"the sweep extrapolates: {text}; read its error bar" for text in beyond_training(scene.case))
    return (*range_warnings(scene.case, scene.pair, approach_estimate(scene.case, scene.pair)), *beyond)


def unknowns(sector: SectorMesh) -> int:
    """Return the unknowns of a sector: nodes of elements, but not on a bore, in the directions in which they move."""
    held = [degrees_of_freedom(sector.held), sector.held_axially, degrees_of_freedom(sector.middles)]
    return 3 * len(sector.nodes) - len(np.unique(np.concatenate(held)))


def _of_bodies(scene: Scene) -> Iterator[Skipped]:
    right_sides, kept = scene.flank_unknowns * len(scene.bodies), 2 * scene.pair.neighbouring_teeth + 1
    if len(scene.bodies) == 1:
        saving = f"{unknowns(scene.sectors[1])} unknowns, {scene.flank_unknowns} right-hand sides"
        yield Skipped("the wheel's finite elements", "the gears are identical", saving)
    if shared := sharing_bodies(scene.case):
        saving = f"{len(shared)} x {sum(map(unknowns, scene.bodies))} unknowns, {right_sides} right-hand sides"
        why = f"{', '.join(shared)}: the same gears, whatever the contact"
        yield Skipped("finite elements of models", why, saving)
    yield Skipped("the flanks that carry no load", "the pinion drives one way", f"{right_sides} right-hand sides")
    if matrices := sum(max(0, sector.teeth - kept) for sector in scene.bodies):
        why = f"loads of one contact act on {kept} neighbouring teeth at most"
        saving = f"{matrices} matrices, {_mib(matrices * scene.flank_unknowns**2 * DOUBLE)}"
        yield Skipped("the compliance of distant teeth", why, saving)
    # Every line has at least one shape, with a displacement field for each neighbouring tooth.
    inside = [unknowns(sector) - int(np.count_nonzero(~sector.flank_held_axially)) for sector in scene.sectors]
    saving = f"{_mib(scene.lines * kept * sum(inside) * DOUBLE)} of shapes at least"
    yield Skipped("displacements inside the gears", "contact sees the flanks alone", saving)


def _of_training(scene: Scene) -> Iterator[Skipped]:
    case, offline = scene.case, scene.case.offline
    if not case.reduction.trained:
        saved = full_solves(replace(case, reduction=replace(case.reduction, shapes="flank_lines")))
        others = any(other.reduction.trained for _, other in other_models(case))
        what = "training of the case's own model" if others else "the training"
        why = f'shapes = "{case.reduction.shapes}": {WHY_UNTRAINED[case.reduction.shapes]}'
        yield Skipped(what, why, f"{saved} full solves, those of [offline]")
    asked = halved(case)
    if asked is not None and not case.mesh.error_bar:
        saving = f"finite elements on {_elements(asked)} elements"
        yield Skipped("the error bar of the mesh", "[mesh] error_bar is off", saving)
    if not case.root_stress:
        asked_for = case.results.root_stress
        why = "found from exact line loads alone" if asked_for else "[results] root_stress is off"
        yield Skipped("the root stress", why, _fillets(scene))
    if case.reduction.trained and offline.sampling == "grid" and len(offline.torques_Nm) == 1:
        saving = f"{full_solves(case)} full solves for each of them"
        yield Skipped("training at further torques", "one torque is trained", saving)


def _of_contact(scene: Scene) -> Iterator[Skipped]:
    case, contact, rows = scene.case, scene.case.contact, scene.case.mesh.profile_intervals
    most = scene.pair.most_touching_pairs
    teeth = min(sector.teeth for sector in scene.sectors)
    if most < teeth:
        why = f"{_contact_ratios(scene.pair)}: at most {most} pairs can touch at a time"
        yield Skipped("tooth pairs out of mesh", why, f"{teeth - most} of {teeth} pairs in every position")
    if (kept := rows_in_contact(case, scene.pair)) < rows:
        saving = f"about {rows - kept} of {rows} rows of elements, neither deformed nor refined"
        yield Skipped("flank patches without contact", f"contact strip at {case.torque_Nm:g} N m", saving)
    if meshed_width(case) != "whole":
        yield _width(scene)
    if contact.scheme == "line":
        saving = f"all but one load on each of {sections_across(case)} sections of a tooth pair, whatever the mesh"
        yield Skipped("contact points and penalty", 'scheme = "line": exact flanks', saving)
    if contact.lodm_width < contact.lodm_profile and contact.kind == "nodal":
        points = (scene.lines - 1) * contact.lodm_profile + 1
        points *= (scene.columns - 1) * (contact.lodm_profile - contact.lodm_width)
        why = f"lodm_width = {contact.lodm_width}, {contact.lodm_profile} over the profile"
        yield Skipped("contact points over the width", why, f"{points} per flank")


def _width(scene: Scene) -> Skipped:
    what, why = "all but one layer over the width", '[mesh] width = "plane_strain"'
    if meshed_width(scene.case) == "half":
        what, why = "half the face width", "spur teeth, nodes at mid width: symmetric"
    mesh, scheme = scene.case.mesh, contact_scheme(scene.case)
    columns = mesh.order * mesh.width_elements + 1
    saved = columns - scene.columns
    points = ((scene.lines - 1) * scheme.lodm_profile + 1) * saved * scheme.lodm_width
    carried = f"{points} contact points per flank" if scene.case.contact.kind == "nodal" else "as many sections"
    less = sum(_unknowns_of_the_whole(sector, mesh.width_elements) - unknowns(sector) for sector in scene.bodies)
    return Skipped(what, why, f"{saved} of {columns} columns of nodes, {less} unknowns, {carried}")


def _unknowns_of_the_whole(sector: SectorMesh, elements: int) -> int:
    """Unknowns of a sector that is as wide as the gear, with so many elements over the width."""
    there = np.ones(len(sector.nodes), dtype=bool)
    there[sector.held] = there[sector.middles] = False
    nodes = there.reshape(-1, len(sector.z)).sum(axis=0)  # of each column
    return int(3 * ((elements + 1) * nodes[0] + (sector.order - 1) * elements * nodes[1]))


def _of_output(scene: Scene) -> Iterator[Skipped]:
    case, output, shapes = scene.case, scene.case.output, scene.case.reduction.shapes
    if shapes != "line_loads":
        why = f'shapes = "{shapes}": they are read off exact line loads'
        yield Skipped("flank pressure, K_Hβ, sensitivities", why, "flank maps, forces and Harris map too")
    elif not case.results.maps:
        angles = case.online.angles_per_pitch * case.pitches
        saving = f"a sweep of {angles} angles at a hundredth of the torque, and three pictures"
        yield Skipped("flank maps and contact pattern", "[results] maps is off", saving)
    if not (output.plots or output.report):
        saving = f"no {PICTURES}"
        yield Skipped("all pictures", "[output] plots and report are off", saving)
    elif not output.plots:
        yield Skipped("picture files", "[output] plots is off", "they are drawn for the page alone")
    elif not output.report:
        yield Skipped("the report page", "[output] report is off", "classical formulas not evaluated, no page")


def _contact_ratios(pair: GearPair) -> str:
    overlap = f" and overlap ratio {pair.overlap_ratio:.3f}" if pair.overlap_ratio > 0.0 else ""
    return f"contact ratio {pair.contact_ratio:.3f}{overlap}"


def _compliance(scene: Scene) -> str:
    """Size of the compliance between loaded flanks, as a basis holds it."""
    components = loaded_components(scene.case.contact.kind != "nodal", scene.pair.pinion.helix_angle != 0.0)
    size = components * scene.lines * scene.columns
    blocks = (scene.pair.neighbouring_teeth + 1) * len(scene.bodies)
    return f"{blocks} matrices of {size} x {size} in the basis, {_mib(blocks * size**2 * DOUBLE)}"


def _fillets(scene: Scene) -> str:
    """Elements around the fillets, and points on both fillets of a tooth."""
    teeth = (scene.pair.pinion, scene.pair.wheel)[: len(scene.bodies)]
    meshes = [build_fillet(tooth, sector) for tooth, sector in zip(teeth, scene.bodies, strict=True)]
    elements = " and ".join(str(len(mesh.elements)) for mesh in meshes)
    points = " and ".join(str(2 * (mesh.section.shape[1] - mesh.first) * len(mesh.columns)) for mesh in meshes)
    return f"{elements} elements around a fillet, stress at {points} points of a tooth"


def _elements(case: Case) -> str:
    return f"{case.mesh.profile_elements} x {case.mesh.width_elements}"


def _mib(size: int) -> str:
    return f"{size / 2**20:.3g} MiB"
