"""The verdict on a gearbox: its figures under all loads, and what helps where one is not good."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pmor.case.coast import as_drawn
from pmor.machine.coupled import SolvedLoad, SolvedMesh
from pmor.machine.fit import Fit, Helix
from pmor.pair.backlash import backlash_remarks
from pmor.pair.conditions import assembly_of
from pmor.report.verdict import Finding, Seen, findings, verdict_of
from pmor.results.verdict import Advice, Change
from pmor.sets.remedies import seen_of_set, set_remedy
from pmor_online.model import ReducedPair
from pmor_online.remedies import LEAST_GAIN, in_words, others_kept, remedy, with_first
from pmor_online.trials import MeshTrials, Under

Pairs = Mapping[str, ReducedPair]
# What is said of parts that are not tried.
SHARED = "flanks of gears in several meshes are not tried: give these meshes as a set with [[gears]]"


def verdict_of_gearbox(
    loads: Sequence[SolvedLoad], pairs: Pairs, fits: Sequence[Fit], data: Mapping[str, Any]
) -> dict[str, Any] | None:
    """Return the verdict on a gearbox as plain data, by the content of `gearbox.json`; None where nothing is solved."""
    if not loads:
        return None
    by_name = {fit.mesh: fit for fit in fits}

    def tried(one: Finding, first: Advice | None) -> Advice | str | None:
        at = next(load for load in loads if load.load.name == one.load or len(loads) == 1)
        number = next((n for n, mesh in enumerate(at.meshes) if mesh.meshing.settings.name == one.part), None)
        if number is None:
            return _of_set(one, at, first)
        if one.part not in by_name:
            return SHARED
        fit, fits_all = by_name[one.part], one.key == "k_h_beta"
        key = (loads[0] if fits_all else at).meshes[number].meshing.key
        alike = [(load.load.name, load.meshes[number]) for load in loads if load.meshes[number].meshing.key == key]
        if fits_all:
            answer: Advice | str | None = _of_fit(fit, pairs[key], len(loads) > 1)
        else:
            fitted = fit.loads if first and first.figure == "k_h_beta" else None
            answer = _of_flanks(one, at.load.name, alike, pairs[key], first, fitted)
        both = len(fit.loads if fits_all else alike) < len(loads)
        return others_kept(answer, pairs[key].basis.case) if both and isinstance(answer, Advice) else answer

    drawn = [remark for name, pair in pairs.items() for remark in backlash_remarks(as_drawn(pair.basis.case), name)]
    return verdict_of(findings(_seen(data)), tried, data["failures"], drawn).data


def _seen(data: Mapping[str, Any]) -> Iterator[Seen]:
    for load in data["loads"]:
        name = load["name"] if len(data["loads"]) > 1 else ""
        for mesh in load["meshes"]:
            yield Seen(name, mesh["name"], mesh)
        for one in load["sets"]:
            yield from seen_of_set(one, name, one["name"])


def _of_fit(fit: Fit, reduced: ReducedPair, several: bool) -> Advice | None:
    """The flank that fits, as the keys of a file have it; None where it gains too little."""
    if not fit.after <= (1.0 - LEAST_GAIN) * fit.before:
        return None
    filed = assembly_of(reduced.basis.case).pinion
    flank = Helix(fit.helix_slope_um, fit.helix_crowning_um).on(filed)
    values = {key: round(getattr(flank, key), 2) for key in ("helix_slope_um", "helix_crowning_um")}
    now = {key: value for key in values if (value := getattr(filed, key))}
    section = MeshTrials(reduced, (), 0, fit.mesh).sections("pinion")[0]
    of = (f"the worst of {', '.join(fit.loads)}" if len(fit.loads) > 1 else fit.loads[0]) if several else ""
    what = in_words(("pinion", "wheel"), {"pinion": values})
    return Advice(what, "k_h_beta", fit.mesh, of, fit.before, fit.after,
                  (Change(section, values, now),))  # fmt: skip


def _of_flanks(
    one: Finding, worst: str, alike: Sequence[tuple[str, SolvedMesh]], reduced: ReducedPair, first: Advice | None,
    fitted: Sequence[str] | None,
) -> Advice | str | None:  # fmt: skip
    """What helps a mesh on the supports that it has under each load."""
    own = assembly_of(reduced.basis.case)
    under = tuple(Under(name, 1e-3 * mesh.torque, own, mesh.hubs) for name, mesh in alike)
    tried = MeshTrials(reduced, under, [load.label for load in under].index(worst), one.part)
    if tried.beyond:
        return "flanks are not tried, since each trial takes long"
    return remedy(with_first(tried, first, fitted), one.key)


def _of_set(one: Finding, load: SolvedLoad, first: Advice | None) -> Advice | str | None:
    """What helps a set, or a mesh of it, on the supports that it has under a load."""
    name, _, mesh = one.part.partition(": ")
    found = next(of for of in load.sets if of.meshing.settings.name == name)
    return set_remedy(found.meshing.file, found.solution, 0, one.key, mesh, name, first)
