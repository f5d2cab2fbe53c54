"""The one way from a machine to its gears: finite elements of each body that differs, solved once for line loads.

A gear's key is a digest of all that it depends on: mesh, material, contact layer, what it stands on, teeth loaded
together. Wherever a gear stands, in a pair, a set, a gearbox or a design, it is taken from where gears are kept.
"""

from __future__ import annotations

import time
from dataclasses import replace
from threading import Lock
from typing import Any

from pmor.body.elastic_gear import ElasticGear
from pmor.body.far_compliance import FarTeeth
from pmor.body.flank_compliance import SolvedGear, solved_gear_of
from pmor.case import Case, GearCase
from pmor.case.models import coarser
from pmor.core.errors import MeshError
from pmor.core.threads import one_thread
from pmor.fe.sector import SectorMesh
from pmor.line.layered_pair import layers_of
from pmor.line.sections import loaded_components
from pmor.pair.blank import blank_below
from pmor.pair.model import ElasticModel, MeshModel, mesh_model, per_gear, solved_gear
from pmor.reduction.basis import Basis, basis_of_gears, untrained
from pmor.storage.content_key import key_of
from pmor.storage.gear_store import KeptGear, not_kept


@one_thread()
def line_basis(
    case: Case, kept: KeptGear = not_kept, mesh: MeshModel | None = None, model: ElasticModel | None = None,
    started: float | None = None,
) -> Basis:  # fmt: skip
    """Return the basis of a case of line loads from its gears, with those on half as many elements for its error bar.

    Parameters
    ----------
    kept : callable
        Where gears are kept.
    mesh : MeshModel, optional
        Of the case, where it is meshed already.
    model : ElasticModel, optional
        Of the case, where its gears are solved already.
    started : float, optional
        ``time.perf_counter()`` at the start of the offline stage, when meshing shall count.

    Raises
    ------
    CaseError, GeometryError, MeshError
    """
    started = time.perf_counter() if started is None else started
    mesh, coarse = mesh or mesh_model(case), coarser(case)

    def solved(sector: SectorMesh, gear: GearCase) -> SolvedGear:
        body = None if model is None else (model.pinion if sector is mesh.pinion else model.wheel)
        return line_gear(case, mesh, sector, gear, kept, body=body)

    gears = per_gear(case, mesh, solved)
    on_coarse = None
    if coarse is not None:
        try:
            on_coarse = line_basis(coarse, kept)
        except MeshError as error:
            remedy = "take more elements, or write [mesh] error_bar = false"
            raise MeshError(f"half as many elements, for the error bar of the mesh: {error}; {remedy}") from error
    training = untrained(time.perf_counter() - started, case.offline.sampling == "greedy")
    return basis_of_gears(case, mesh, gears, training, coarser=on_coarse)


@one_thread()
def line_gear(
    case: Case, mesh: MeshModel, sector: SectorMesh, gear: GearCase, kept: KeptGear = not_kept,
    far: FarTeeth | None = None, body: ElasticGear | None = None,
) -> SolvedGear:  # fmt: skip
    """Return one gear of a pair, solved for line loads unless it is kept.

    Parameters
    ----------
    sector, far
        As in `pmor.pair.model.solved_gear`.
    body : ElasticGear, optional
        The gear, where it is solved already.
    """
    pair = mesh.meshed.pair
    place, tooth = (0, pair.pinion) if sector is mesh.pinion else (1, pair.wheel)
    components, neighbours = loaded_components(True, tooth.helix_angle != 0.0), pair.neighbouring_teeth
    # What is brought is condensed for a new gear alone: the digest of its file stands for it.
    below = blank_below(case, gear, tooth, sector, place) if gear.body is None else (*_brought(gear), place)
    key = key_of(
        sector, tooth, gear.youngs_modulus_GPa, gear.poisson_ratio, case.mesh.element, neighbours,
        layers_of(mesh.meshed)[place].columns, components, case.root_stress, below, far,
    )  # fmt: skip
    return kept(key, lambda: solved_gear_of(body or solved_gear(case, mesh, sector, gear, far=far), components))


def solved_once(kept: KeptGear) -> KeptGear:
    """Return where gears are kept that gives each of them once, as one object, whichever thread asks."""
    gears, locks, lock = dict[str, SolvedGear](), dict[str, Lock](), Lock()

    def get(key: str, solve: Any) -> SolvedGear:
        with lock:
            own = locks.setdefault(key, Lock())
        with own:
            if key not in gears:
                gears[key] = kept(key, solve)
        return gears[key]

    return get


def _brought(gear: GearCase) -> tuple[Any, ...]:
    """What a body that is brought depends on: where its file is does not matter."""
    assert gear.body is not None
    return gear.bore_radius_mm, gear.body.unit, gear.body.x_axis_deg, replace(gear.body.found, file="")
