"""From a variant to its entry: solve, hold against the reference, judge; poor and redundant trainings."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from pmor.case import Case, change_case
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, GeometryError, MeshError
from pmor.gear.condition import at_torques
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.pair import GearPair
from pmor.lab.core.models import ModelStore
from pmor.lab.stability.solve import OTHER_LOAD, Solved, solve_variant, ste_only
from pmor.lab.stability.variants import Variant
from pmor.pair.conditions import nominal_condition
from pmor.pair.limits import range_warnings
from pmor.pair.model import ElasticModel, approach_estimate, mesh_model
from pmor_offline.gather import make_basis
from pmor_offline.sampling import TrainingPosition, training_angles
from pmor_offline.snapshots import solve_snapshots
from pmor_offline.train import train as train_basis
from pmor_online.model import ReducedPair, reduced_pair
from pmor_online.sweep import sweep_reduced_pair

# Distance of the neighbours that a special position is held against, in pitches.
NEIGHBOUR = 1e-4


def pinion_angles(meshed: MeshedPair, places: str) -> FloatArray:
    """Return the pinion angles of a variant, rad.

    ``usual``: eight positions from entry to entry, with exact entry and exit, in between with one pair more and one
    less; ``borders``: a pair's contact exactly on rows of nodes of either flank; ``ends``: exact entry and exit alone;
    ``hunting``: eight positions over the period after which the same teeth meet again.
    """
    pair = meshed.pair
    if places == "borders":
        return _borders(meshed)
    more, inside = pair.total_contact_ratio % 1.0, np.array([0.25, 0.5, 0.75])
    shares = {
        "usual": np.concatenate([[0.0], more * inside, [more], more + (1.0 - more) * inside]),
        "ends": np.array([0.0, more]),
        "hunting": math.lcm(pair.pinion.teeth, pair.wheel.teeth) * (np.arange(8) + 0.3) / 8.0,
    }
    return np.asarray(pair.meshing_range[0] + shares[places] * pair.pitch)


def mirrored_angles(pair: GearPair, phi: FloatArray, exchanged: GearPair) -> FloatArray:
    """Return the angles at which a pair with its gears exchanged stands as this one at `phi`, seen in the mirror.

    The contact then is as far from the end of the path as it was from the beginning.
    """
    share = (phi - pair.meshing_range[0]) / pair.pitch
    return np.asarray(exchanged.meshing_range[0] + (pair.total_contact_ratio - share) * exchanged.pitch)


def _borders(meshed: MeshedPair) -> FloatArray:
    pair = meshed.pair
    first, last = pair.meshing_range
    borders = []
    for gear, flank in enumerate((meshed.pinion, meshed.wheel)):
        roll = flank.roll_angle
        if gear == 1:  # along the line of action, seen from the pinion
            roll = (pair.action_length - roll * pair.wheel.base_radius) / pair.pinion.base_radius
        angles = np.array([pair.roll_position(float(u)) for u in roll])
        angles = angles[(angles > first) & (angles < last)]
        borders.append(angles[:: max(1, math.ceil(len(angles) / 4))])
    return np.concatenate(borders)


ANGLES = 8
# Trained loads over the nominal one. Nearly dependent: forces that differ in the seventh digit.
LOADS = {
    "usual": (0.5, 1.0, 1.8),
    "one_load": (1.0,),
    "single_angle": (1.0,),
    "duplicated": (1.0,),
    "nearly_dependent": (1.0, 1.0 + 1e-7),
    "border": (0.5, 1.0),
}


def train(case: Case, model: ElasticModel, way: str) -> ReducedPair:
    """Train flank lines in memory, or gather the compliance for line loads; `way` is "line_loads" or one of `LOADS`.

    "single_angle" trains at one position alone, "duplicated" takes every solution three times.
    """
    if way == "line_loads":
        return reduced_pair(train_basis(case, model).basis)
    meshed = model.mesh.meshed
    angles = training_angles(meshed.pair, ANGLES)[: 1 if way == "single_angle" else ANGLES]
    conditions = at_torques(1e3 * case.torque_Nm * load for load in LOADS[way])
    snapshots = [solve_snapshots(model, TrainingPosition(float(phi), conditions)) for phi in angles]
    if way == "duplicated":
        snapshots *= 3
    lines = replace(case.reduction, shapes="flank_lines")
    scattered = replace(case.offline, sampling="sobol")
    basis, _ = make_basis(replace(case, reduction=lines, offline=scattered), model, snapshots)
    return reduced_pair(basis)


MOST_STEPS = 12
# Allowed imbalance of the torque, relative.
TORQUE = 1e-3
# Refinement of the reference mesh of a variant that is held against one.
FINER = 1.5


@dataclass(frozen=True)
class Entry:
    """Measures and verdict of a variant; numbers are None where there is nothing to measure."""

    # Of the variant
    name: str
    group: str
    about: str
    converged: bool | None = None  # None: refused before anything was solved
    newton_steps: int | None = None  # Largest of all positions
    condition: float | None = None  # Largest estimate for the Newton matrix
    # Largest difference of the STE to the reference, over the mean of the reference
    difference_rel: float | None = None
    torque_balance_rel: float | None = None  # `pmor.lab.stability.solve`
    ste_mean_um: float | None = None
    ste_um: tuple[float, ...] | None = None  # At each position
    seconds: float = 0.0
    ok: bool = False  # Converged, balanced, and as close to the reference as it should be
    explained: bool = False  # Refused by a check that says why, or known not to hold, with a warning beforehand
    note: str = ""  # Complaints and remarks


def entry_of(data: Mapping[str, Any]) -> Entry:
    """Return an entry from plain data."""
    ste = data["ste_um"]
    return Entry(**{**data, "ste_um": None if ste is None else tuple(math.nan if s is None else s for s in ste)})


def measure(variant: Variant, base: Case, store: ModelStore) -> Entry:
    """Run a variant of a base case; whatever goes wrong becomes part of the entry."""
    started = time.perf_counter()
    entry = Entry(variant.name, variant.group, variant.about)
    try:
        entry = _solved_entry(entry, variant, change_case(base, **variant.changes), base, store)
    except (CaseError, GeometryError, MeshError) as error:
        entry = replace(entry, explained=True, note=f"refused: {error}")
    except Exception as error:  # a crash is a result too: it is named, and the other variants go on
        entry = replace(entry, converged=False, note=f"{type(error).__name__}: {error}")
    return replace(entry, seconds=time.perf_counter() - started)


def _solved_entry(entry: Entry, variant: Variant, case: Case, base: Case, store: ModelStore) -> Entry:
    model, _ = store.model(case)
    meshed, condition = model.mesh.meshed, nominal_condition(case)
    phi = pinion_angles(meshed, variant.places)
    if variant.basis is not None:
        solved = _reduced(case, model, phi, variant.basis)
    else:
        solved = solve_variant(meshed, model.elasticity_at, phi, condition, variant.start_mm, variant.rising)
    reference = variant.factor * _reference(variant, case, model, phi, base, store)
    difference = float(np.max(np.abs(solved.ste_um - reference)) / np.mean(np.abs(reference)))
    notes = _complaints(variant, solved, difference)
    warnings = range_warnings(case, meshed.pair, approach_estimate(case, meshed.pair))
    aspect = model.mesh.quality.max_aspect_ratio
    remarks = [*warnings, *([f"aspect ratio of the elements up to {aspect:.3g}"] if variant.group == "Mesh" else [])]
    return replace(
        entry,
        converged=not solved.failures,
        newton_steps=solved.steps,
        condition=_known(solved.condition),
        difference_rel=_known(difference),
        torque_balance_rel=_known(solved.torque),
        ste_mean_um=_known(float(np.mean(solved.ste_um))),
        ste_um=tuple(solved.ste_um.tolist()),
        ok=not notes,
        explained=bool(notes and variant.limit) and any(variant.limit in warning for warning in warnings),
        note="; ".join([*notes, *remarks]),
    )


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _reference(
    variant: Variant, case: Case, model: ElasticModel, phi: FloatArray, base: Case, store: ModelStore
) -> FloatArray:
    """STE of the reference of a variant, um."""
    meshed, condition = model.mesh.meshed, nominal_condition(case)
    if variant.against == "base":
        return _ste_of(base, phi, store)
    if variant.against == "finer":
        fine = _ste_of(_finer(case), phi, store)
        # The error of the coarse mesh is that of the base case too.
        return np.asarray(fine * _ste_of(base, phi, store) / _ste_of(_finer(base), phi, store))
    if variant.against == "mirror":
        return _mirrored(case, model, phi)
    if variant.against == "neighbours":
        step = NEIGHBOUR * meshed.pair.pitch
        near = [ste_only(meshed, model.elasticity_at, phi + sign * step, condition) for sign in (-1.0, 1.0)]
        return np.asarray(0.5 * (near[0] + near[1]))
    if variant.against == "full":
        return ste_only(meshed, model.elasticity_at, phi, condition)
    return ste_only(meshed, model.elasticity_at, phi, condition, OTHER_LOAD)


def _finer(case: Case) -> Case:
    elements = math.ceil(FINER * case.mesh.profile_elements)
    return change_case(case, mesh={"profile_elements": elements})


def _ste_of(case: Case, phi: FloatArray, store: ModelStore) -> FloatArray:
    model, _ = store.model(case)
    return ste_only(model.mesh.meshed, model.elasticity_at, phi, nominal_condition(case))


def _mirrored(case: Case, model: ElasticModel, phi: FloatArray) -> FloatArray:
    gears = case.pair.pinion, case.pair.wheel
    slaves = {"pinion": "wheel", "wheel": "pinion"}
    ratio = gears[1].teeth / gears[0].teeth
    loads = {name: [ratio * t for t in getattr(case, name).torques_Nm] for name in ("offline", "online", "compare")}
    exchanged = change_case(
        case, pinion=asdict(gears[1]), wheel=asdict(gears[0]), load={"torque_Nm": ratio * case.torque_Nm},
        contact={"slave": slaves.get(case.contact.slave, case.contact.slave)},
        **{name: {"torques_Nm": torques} for name, torques in loads.items()},
    )  # fmt: skip
    mirror = ElasticModel(mesh_model(exchanged), model.wheel, model.pinion)
    angles = mirrored_angles(model.mesh.meshed.pair, phi, mirror.mesh.meshed.pair)
    return ste_only(mirror.mesh.meshed, mirror.elasticity_at, angles, nominal_condition(exchanged))


def _reduced(case: Case, model: ElasticModel, phi: FloatArray, way: str) -> Solved:
    """Solve by a reduced model: its sweep gives STE and steps, the general solver the balance."""
    reduced = train(case, model, way)
    condition = nominal_condition(case)
    sweep = sweep_reduced_pair(reduced, phi, [condition])
    twin = solve_variant(reduced.meshed, reduced.elasticity_at, phi, condition)
    failures = [f"no equilibrium of the sweep at phi = {angle:.6g} rad" for angle in phi[~sweep.converged[0]]]
    return replace(twin, ste_um=sweep.ste_um[0], steps=int(sweep.newton_steps.max()),
                   failures=(*failures, *twin.failures))  # fmt: skip


def _complaints(variant: Variant, solved: Solved, difference: float) -> list[str]:
    """Return the complaints about a variant."""
    complaints = []
    if solved.failures:
        complaints.append(f"{len(solved.failures)} solutions did not converge, first: {solved.failures[0]}")
    if solved.steps > MOST_STEPS:
        complaints.append(f"{solved.steps} Newton steps, more than {MOST_STEPS}")
    # Comparisons with not: a NaN is a complaint.
    if not difference <= variant.tolerance:
        complaints.append(f"differs by {difference:.2g}, more than {variant.tolerance:g}")
    if not solved.torque <= TORQUE:
        complaints.append(f"torque off by {solved.torque:.2g}, more than {TORQUE:g}")
    return complaints
