"""Pairs that are drawn within tolerances: each is solved as any other, on the same finite elements."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from pmor.case import Case
from pmor.case.coast import mirrored_axes, mirrored_flank
from pmor.case.tolerances import OF_AXES, OF_FLANKS
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.threads import in_order
from pmor.gear.condition import Assembly, Misalignment
from pmor.gear.made_flanks import draw_flank, nominal_flanks, with_made
from pmor.gear.modification import Modification
from pmor.pair.conditions import assembly_of, conditions_of_assembly
from pmor.pair.model import gear_pair
from pmor.pair.samples import Samples
from pmor.results.load_distribution import line_states
from pmor.results.quantities import figures_of_mesh
from pmor.results.root_stress import GEARS
from pmor.results.sweep import SteSweep
from pmor_online.model import ReducedPair, online_angles
from pmor_online.readings import can_record
from pmor_online.sweep import sweep_reduced_pair

OF_MESH = ("k_h_beta", "flank_pressure_max_MPa")
PITCH = "pitch_deviations_um"


def solve_samples(
    reduced: ReducedPair, torques_Nm: Sequence[float], angles: int, executor: Executor | None = None
) -> Samples | None:
    """Solve all pairs that the tolerances of a case draw; None without tolerances.

    Parameters
    ----------
    reduced : ReducedPair
        On its supports.
    torques_Nm : sequence of float
    angles : int
        To a pitch.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out the samples, whose results do not depend on it.
    """
    case = reduced.basis.case
    if case.tolerances is None:
        return None
    teeth = case.pair.pinion.teeth, case.pair.wheel.teeth
    pitches = max(case.pitches, max(teeth) if case.tolerances.of_teeth else 1)
    phi, pairs = online_angles(reduced.meshed.pair.pitch, angles, pitches), tuple(drawn(case))
    recorded = can_record(reduced.meshed, case, len(phi), len(torques_Nm))

    def solve(pair: tuple[dict[str, float], Assembly]) -> tuple[Mapping[str, FloatArray], IntArray]:
        conditions = conditions_of_assembly(pair[1], torques_Nm)
        sweep = sweep_reduced_pair(reduced, phi, conditions, recorded=recorded)
        return sampled_figures(reduced, sweep), (~sweep.converged).sum(axis=1)

    figures, lost = zip(*in_order(solve, pairs, executor), strict=True)
    each = {key: np.array([row[key] for row in figures]) for key in figures[0]}
    return Samples("pairs", tuple(errors for errors, _ in pairs), each, np.array(lost), pitches)


def sampled_figures(reduced: ReducedPair, sweep: SteSweep) -> dict[str, FloatArray]:
    """Return what is told of pairs within tolerances, of one of them under each torque, (D,)."""
    spans = [float(np.ptp(ste[there])) if there.any() else np.nan
             for ste, there in zip(sweep.ste_um, sweep.converged, strict=True)]  # fmt: skip
    found = {"ste_peak_to_peak_um": np.array(spans)}
    if sweep.states is None:
        return found
    figures = figures_of_mesh(reduced.meshed.pair, line_states(sweep))
    return found | {key: figures[key] for key in OF_MESH}


def drawn(case: Case) -> Iterator[tuple[dict[str, float], Assembly]]:
    """Draw pairs within the tolerances of a case: errors by its keys, and axes and flanks as its flanks see them.

    The draws of one error do not depend on the sizes of the others.
    """
    sizes, own = case.tolerances, assembly_of(case)
    assert sizes is not None
    rng = np.random.default_rng(sizes.seed)
    of_teeth, of_made = (np.random.default_rng([sizes.seed, stream]) for stream in (1, 2))
    teeth = case.pair.pinion.teeth, case.pair.wheel.teeth
    nominal = nominal_flanks(gear_pair(case)) if sizes.flank_tolerance_class else ()
    for _ in range(sizes.samples):
        amounts, axes = rng.standard_normal((len(GEARS), len(OF_FLANKS) - 1)), rng.standard_normal(len(OF_AXES))
        off = {key: float(getattr(sizes, key) * part) for key, part in zip(OF_AXES, axes, strict=True)}
        errors, flanks = dict(off), []
        for name, modification, parts, count in zip(GEARS, (own.pinion, own.wheel), amounts, teeth, strict=True):
            moved = {key: float(getattr(sizes, key) * part) for key, part in zip(OF_FLANKS, parts, strict=False)}
            pitch = (sizes.pitch_deviations_um * of_teeth.standard_normal(count)).tolist()
            errors |= {f"{name}.{key}": value for key, value in moved.items()}
            if any(pitch):
                errors |= {f"{name}.{PITCH}_{tooth}": value for tooth, value in enumerate(pitch, start=1)}
                moved_teeth = Modification(pitch_deviations_um=tuple(pitch))
                moved_teeth = mirrored_flank(moved_teeth) if case.flank == "coast" else moved_teeth
                pitch = list(moved_teeth.pitch_deviations_um)
            flanks.append(_added(modification, moved, pitch))
        for number, (name, flank) in enumerate(zip(GEARS, nominal, strict=False)):
            assert sizes.flank_tolerance_class is not None
            made = draw_flank(flank, sizes.flank_tolerance_class, sizes.waves_per_pitch, of_made)
            errors |= {f"{name}.made_{key}": value for key, value in made.errors().items()}
            made = made.reversed if case.flank == "coast" else made
            flanks[number] = with_made(flanks[number], made, flank)
        tilt = Misalignment(**off)
        tilt = mirrored_axes(tilt) if case.flank == "coast" else tilt
        sums = {key: getattr(own.misalignment, key) + getattr(tilt, key) for key in OF_AXES}
        yield {key: value for key, value in errors.items() if value}, Assembly(Misalignment(**sums), *flanks)


def _added(modification: Modification, moved: Mapping[str, float], pitch: Sequence[float]) -> Modification:
    """Return flanks with further amounts; pitch deviations with those that are there."""
    amounts = {key: getattr(modification, key) + value for key, value in moved.items()}
    if any(pitch):
        given = modification.pitch_deviations_um or (0.0,) * len(pitch)
        return replace(modification, **amounts, pitch_deviations_um=tuple((np.array(given) + pitch).tolist()))
    return replace(modification, **amounts)
