"""A design from samples to the front: pieces of work, each kept when it is finished."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pmor.case import Case
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.errors import ConvergenceError
from pmor.design.descent import Descent, best_first, kept
from pmor.design.files import DesignFile
from pmor.design.fine import judged_finely
from pmor.design.judge import Judge, at_load, nominal
from pmor.design.settings import Constraint, Design
from pmor.design.variables import spread_evenly
from pmor.design.variants import Store, Variants, all_kept, as_data, from_data, together
from pmor.pair.model import elastic_model, refuse_loads
from pmor.work.cost import meshed_within_memory
from pmor.work.front import pareto_front
from pmor.work.pieces import Piece, Result, run_pieces
from pmor_offline.train import train
from pmor_online.model import ReducedPair, reduced_pair

# Positions that a chunk of samples solves at least: a second.
POSITIONS_PER_CHUNK = 100_000
# Most variants that are judged again on fine angles.
MOST_FINE = 300
# Most loads for which a design for that load alone is searched too, for comparison.
MOST_SINGLE = 6


@dataclass(frozen=True)
class Found:
    """All variants of a search."""

    file: DesignFile
    judge: Judge[Any, Any]  # For figures of single variants
    variants: Variants
    # shape (V,): Angles per pitch that results are of, and the objective on those of the search
    angles: IntArray
    searched: FloatArray
    evaluations: Mapping[str, int]  # Judgements of a variant, by stage; one with derivatives counts as one
    seconds: float  # Of this run, without the finite elements
    failures: tuple[str, ...]
    final: bool = True  # Whether variants on the angles of the search alone are none to choose

    @property
    def design(self) -> Design:
        """Settings of the search."""
        return self.file.design

    @property
    def kept(self) -> BoolArray:
        """Whether a variant is known and keeps all constraints, (V,)."""
        return all_kept(self.design, self.variants)

    @property
    def eligible(self) -> BoolArray:
        """Whether a variant may be chosen: it keeps all constraints, on fine angles, (V,)."""
        return np.asarray(self.kept & ((self.angles > self.design.search.angles) | (not self.final)))

    @property
    def fine(self) -> Judge[Any, Any]:
        """Judge on the most angles that a chosen variant took."""
        return self.judge.on_angles(int(self.angles.max()))

    @property
    def chosen(self) -> dict[str, int]:
        """Numbers of the best variants by name, such as "best at 170 N m"."""
        labels = self.design.load.labels
        numbers = {"best": self.best}
        if self.design.scatters:
            numbers["best without scatter"] = self.best_at(range(len(labels)))
        if len(labels) > 1:
            numbers |= {f"best at {labels[t]}": self.best_at([t]) for t in (0, len(labels) - 1)}
        return {name: n for name, n in numbers.items() if n is not None}

    @property
    def best(self) -> int | None:
        """The best variant that keeps all constraints."""
        value = np.where(self.eligible, self.variants.objective, np.inf)
        return int(value.argmin()) if np.isfinite(value).any() else None

    @property
    def against(self) -> FloatArray:
        """Result weighed against the objective, the largest over the torques, (V,)."""
        return np.asarray(
            self.variants.results[:, :, self.design.results.index(self.design.pareto.against)].max(axis=1)
        )

    @property
    def front(self) -> IntArray:
        """Variants that no other one beats in both, of those that keep all constraints."""
        values = np.stack([self.variants.objective, self.against], axis=1)
        return pareto_front(np.where(self.eligible[:, None], values, np.nan))

    def best_at(self, torques: Sequence[int]) -> int | None:
        """The variant of the least objective as drawn under some of the torques that keeps all constraints."""
        weights = np.array(self.design.load.weights)[list(torques)]
        column = self.design.results.index(self.design.objective.minimise)
        if not self.eligible.any() or not weights.any():
            return None
        value = self.variants.results[:, list(torques), column] @ weights
        return int(np.where(self.eligible, value, np.inf).argmin())


def trained_pair(case: Case, torques_Nm: tuple[float, ...] = ()) -> ReducedPair:
    """Return the reduced pair of a case, by line loads; CaseError where one of the torques is beyond their range."""
    mesh = meshed_within_memory(case)
    if torques_Nm:
        refuse_loads(replace(case, online=replace(case.online, torques_Nm=torques_Nm)), mesh.meshed)
    return reduced_pair(train(case, elastic_model(case, mesh)).basis)


def run_design(
    file: DesignFile, judge: Judge[Any, Any], pieces_folder: Path, *, around: str = "",
    also: Sequence[FloatArray] = (), best_alone: bool = False, executor: Executor | None = None,
    progress: Callable[[int], None] | None = None,
) -> Found:  # fmt: skip
    """Search a design; the rest as in `pmor.design.run.run`.

    Parameters
    ----------
    judge : Judge
        Of the file's design.
    around : str
        Text of what results depend on beside the cases: a gearbox, a set.
    also : sequence of ndarray, shape (n,)
        Variants of a search on aligned axes, judged beside the samples.
    best_alone : bool
        Without a front, and without designs for single loads.
    """
    start = time.perf_counter()
    search = _Search(file, judge, pieces_folder, around, executor, progress)
    samples = search.samples(also)
    tried = search.descents(samples, best_alone)
    tried += [] if best_alone else search.trade_offs(samples, tried)
    found = search.judged_finely(together([samples, *tried]), best_alone)
    failures = (*search.failures, *_lost(found.variants, file))
    return replace(found, seconds=time.perf_counter() - start, failures=failures)


def _lost(variants: Variants, file: DesignFile) -> tuple[str, ...]:
    names = [v.name for v in file.design.variables]
    return tuple(
        f"variant {n} ({', '.join(f'{name} = {value:g}' for name, value in zip(names, variants.x[n], strict=True))}) "
        "has a position that did not converge"
        for n in np.flatnonzero(~np.isfinite(variants.objective))
    )


class _Search:
    """The stages of a search, piece by piece."""

    def __init__(
        self, file: DesignFile, judge: Judge[Any, Any], folder: Path, around: str, executor: Executor | None,
        progress: Callable[[int], None] | None,
    ) -> None:  # fmt: skip
        self.file, self.judge, self.design = file, judge, file.design
        self.folder, self.executor, self.progress = folder, executor, progress
        self.evaluations: dict[str, int] = {}
        self.failures: tuple[str, ...] = ()
        self.store = Store(file, self.folder)
        # Settings that results depend on beside the cases; titles do not count, nor the names of files.
        self.settings = asdict(replace(file.design, title="", case="", gearbox=around, set=""))

    def samples(self, also: Sequence[FloatArray]) -> Variants:
        """Judge variants spread evenly over the ranges, and others."""
        design = self.design
        x = spread_evenly(design.variables, design.search.samples)
        positions = len(design.load.labels) * len(self.judge.phi) * len(self.judge.draws)
        size = max(1, -(-POSITIONS_PER_CHUNK // positions))
        chunks = [x[i : i + size] for i in range(0, len(x), size)]
        pieces = [
            self._piece(f"samples {number:05d}", [], partial(_judged, self.judge, chunk, "sample"))
            for number, chunk in enumerate(chunks)
        ] + [
            self._piece(f"variant {number:05d}", one.tolist(), partial(_judged, self.judge, one[None], "aligned axes"))
            for number, one in enumerate(also)
        ]
        parts = self._run("samples", pieces)
        if not parts:
            raise ConvergenceError(f"no variant was solved, first: {self.failures[0]}", [])
        return together([from_data(part, design) for part in parts])

    def descents(self, samples: Variants, best_alone: bool) -> list[Variants]:
        """Go downhill from the best samples, and from that for each load alone, and as drawn."""
        design, constraints, pieces = self.design, self.design.constraints, []
        best = best_first(samples.objective, samples.limits, constraints)[: design.search.descents]
        for number, n in enumerate(best[np.isfinite(samples.objective[best])]):
            work = partial(_descended, self.judge, self.judge, samples.x[n], "descent")
            pieces.append(self._piece(f"descent {number:03d}", samples.x[n].tolist(), work))
        others = [] if not design.scatters or best_alone else [("nominal", nominal(design))]
        labels = design.load.labels
        if 1 < len(labels) <= MOST_SINGLE and not best_alone:
            others += [(label, at_load(design, number)) for number, label in enumerate(labels)]
        column = design.results.index(design.objective.minimise)
        for name, other in others:
            chosen = [labels.index(label) for label in other.load.labels]
            weights = np.array(other.load.weights) / sum(other.load.weights)
            value = samples.results[:, chosen, column] @ weights
            first = best_first(value, samples.limits, constraints)[0]
            if not np.isfinite(value[first]):
                continue
            start = samples.x[first]
            work = partial(_descended, self.judge.alike(other), self.judge, start, name)
            pieces.append(self._piece(f"best {name}", start.tolist(), work))
        return [from_data(part, design) for part in self._run("descents", pieces)]

    def trade_offs(self, samples: Variants, tried: Sequence[Variants]) -> list[Variants]:
        """Minimise the objective under bounds on the other result, between its least value and that of the best."""
        design, all_of_them = self.design, together([samples, *tried])
        key, points = design.pareto.against, design.pareto.points
        against = all_of_them.results[:, :, design.results.index(key)].max(axis=1)
        order = best_first(all_of_them.objective, all_of_them.limits, design.constraints)
        good = order[kept(design.constraints, all_of_them.limits[order])]
        if not points or not len(good):
            return []
        least, at_best = float(np.nanmin(against[good])), float(against[good[0]])
        if not at_best - least > 1e-3 * abs(at_best):
            return []
        pieces = []
        for number, bound in enumerate(np.linspace(least, at_best, points + 2)[1:-1]):
            # A bound in few digits: the same in the name of a piece and in a constraint.
            level = float(f"{bound:.5g}")
            within = good[against[good] <= level]
            start = all_of_them.x[within[0] if len(within) else good[np.nanargmin(against[good])]]
            other = replace(design, constraints=(*design.constraints, Constraint(result=key, at_most=level)))  # type: ignore[arg-type]
            work = partial(_descended, self.judge.alike(other), self.judge, start, "trade-off")
            pieces.append(self._piece(f"trade-off {number:03d}", [level, *start.tolist()], work))
        return [from_data(part, design) for part in self._run("trade-offs", pieces)]

    def judged_finely(self, variants: Variants, best_alone: bool) -> Found:
        """Judge the variants that are to be chosen on fine angles, until these are the ones that are chosen."""
        few, tried = self.design.search.angles, 0
        angles = np.full(len(variants), few)
        found = Found(
            self.file, self.judge, variants, angles, variants.objective.copy(), self.evaluations, 0.0, (), False
        )
        while tried < MOST_FINE:
            wanted = {*found.front.tolist(), *found.chosen.values()} if not best_alone else {found.best} - {None}
            missing = [n for n in wanted if n is not None and angles[n] == few]
            if not missing:
                break
            tried += len(missing)
            pieces = [
                Piece(f"fine angles {n:06d}", self.file.searched, [self.settings, variants.x[n].tolist()],
                      partial(_finely, self.judge, variants.x[n], n)) for n in sorted(missing)
            ]  # fmt: skip
            variants.objective[missing], angles[missing] = np.nan, 2 * few
            for part in self._run("fine angles", pieces):
                n, angles[part["number"]] = part["number"], part["angles"]
                one = from_data(part, self.design)
                for name in ("results", "objective", "limits"):
                    getattr(variants, name)[n] = getattr(one, name)[0]
        return replace(found, final=True)

    def _piece(self, name: str, start: Any, run: Callable[[], Result]) -> Piece:
        def is_whole(part: Result) -> bool:
            self.store.take_over(from_data(part, self.design))
            return True

        def keep(part: Result) -> None:
            self.store.add(from_data(part, self.design))

        return Piece(name, self.file.searched, [self.settings, start], run, is_whole, keep)

    def _run(self, stage: str, pieces: Sequence[Piece]) -> list[Result]:
        found, failures = run_pieces(
            pieces, self.folder, executor=self.executor, progress=self.progress, what=f"pieces of {stage}"
        )
        self.failures += failures
        parts = [found[piece.name] for piece in pieces if piece.name in found]
        self.evaluations[stage] = self.evaluations.get(stage, 0) + sum(part["evaluations"] for part in parts)
        return parts


def _judged(judge: Judge[Any, Any], x: FloatArray, origin: str) -> Result:
    return as_data([judge.verdict(one) for one in x], origin, len(x))


def _finely(judge: Judge[Any, Any], x: FloatArray, number: int) -> Result:
    verdict, angles = judged_finely(judge, x)
    return {**as_data([verdict], "fine angles", 1), "angles": angles, "number": number}


def _descended(downhill: Judge[Any, Any], judge: Judge[Any, Any], start: FloatArray, origin: str) -> Result:
    """Go downhill by one judge; the end is judged by another."""
    way = Descent(downhill)
    best = way.run(np.asarray(start))[0]
    verdict = best if downhill is judge else judge.verdict(best.x)
    return as_data([verdict], origin, way.evaluations)
