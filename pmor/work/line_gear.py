"""Finite elements of a single gear, solved for line loads, or taken from where they are kept."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from pmor.body.far_compliance import FarTeeth
from pmor.body.flank_compliance import loaded_part, loaded_rim, loaded_support
from pmor.body.root_stress import root_stress_shapes
from pmor.case import Case, GearCase
from pmor.core.errors import FileFormatError
from pmor.core.threads import one_thread
from pmor.fe.sector import SectorMesh
from pmor.line.layered_pair import layers_of
from pmor.line.sections import loaded_components
from pmor.pair.blank import blank_below
from pmor.pair.model import MeshModel, neighbouring_teeth, solved_gear
from pmor.storage.compliance_file import (
    COMPLIANCE_SCHEMA,
    KeptGear,
    SolvedFlank,
    SolvedGear,
    read_compliance,
    write_compliance,
)
from pmor.storage.content_key import key_of
from pmor.storage.hdf5 import refuse_other_kind

_LOG = logging.getLogger("pmor.work")


@one_thread()
def line_gear(
    case: Case, mesh: MeshModel, sector: SectorMesh, gear: GearCase, kept: KeptGear, far: FarTeeth | None = None
) -> SolvedGear:
    """Return one gear of a pair, solved for line loads unless it is kept.

    Parameters
    ----------
    sector, far
        As in `pmor.pair.model.solved_gear`.
    kept : callable
        Given the key of all that the gear depends on, and a function that solves for it.
    """
    pair = mesh.meshed.pair
    place, tooth = (0, pair.pinion) if sector is mesh.pinion else (1, pair.wheel)
    components = loaded_components(True, tooth.helix_angle != 0.0)
    neighbours = neighbouring_teeth(pair)

    def solve() -> SolvedGear:
        body = solved_gear(case, mesh, sector, gear, far=far)
        flank, *other = (
            SolvedFlank(
                loaded_part(side.compliance, components),
                None if side.fillet is None else root_stress_shapes(side.fillet, components),
            )
            for side in (body, body.other) if side is not None
        )  # fmt: skip
        support, rim = loaded_support(body, components), loaded_rim(body, components)
        return SolvedGear(flank.compliance, flank.root_stress, support, body.far, other[0] if other else None, rim)

    # What is brought is condensed for a new gear alone: the digest of its file stands for it.
    below = blank_below(case, gear, tooth, sector, place) if gear.body is None else (*_brought(gear), place)
    found = kept(
        key_of(sector, tooth, gear.youngs_modulus_GPa, gear.poisson_ratio, case.mesh.element, neighbours,
               layers_of(mesh.meshed)[place].columns, components, case.root_stress, below, far),
        solve,
    )  # fmt: skip
    unknowns, unlike = components * sector.flank.size, bool(gear.repeats(case.pair.face_width_mm))
    both = unlike and far is not None and bool(far.backs or far.images)
    whole = found.compliance.shape == (neighbours + 1, unknowns, unknowns) and (found.support is not None) == unlike
    if both:
        whole = whole and found.other is not None and found.support is not None and found.support.backs is not None
    return found if whole else solve()


def not_kept(key: str, solve: Callable[[], SolvedGear]) -> SolvedGear:
    """Solve for a gear that is kept nowhere, as `KeptGear`."""
    return solve()


def kept_in_file(path: Path, anew: bool = False) -> KeptGear:
    """Keep a gear in a file of its own; the log says where one that is there is not taken over.

    What is there and is no such file is refused: OutputError.

    Parameters
    ----------
    anew : bool
        Solve for it, and replace whatever is there.
    """

    def get(key: str, solve: Callable[[], SolvedGear]) -> SolvedGear:
        if os.path.lexists(path) and not anew:
            try:
                return read_compliance(path, key)
            except FileFormatError as error:
                refuse_other_kind(path, COMPLIANCE_SCHEMA)
                _LOG.info("not used, made anew: %s", error)
        found = solve()
        write_compliance(path, key, found)
        return found

    return get


def _brought(gear: GearCase) -> tuple[Any, ...]:
    """What a body that is brought depends on: where its file is does not matter."""
    assert gear.body is not None
    return gear.bore_radius_mm, gear.body.unit, gear.body.x_axis_deg, replace(gear.body.found, file="")
