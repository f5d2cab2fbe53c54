"""A design from samples to the front: pieces of work, each kept when it is finished."""

from __future__ import annotations

import hashlib
import math
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.design.descent import Descent, best_first, kept
from pmor.design.fine import judged_finely, judged_once
from pmor.design.judge import Judge, at_load, nominal
from pmor.design.settings import Constraint, Design
from pmor.design.settings import Search as SearchSettings
from pmor.design.variables import SEED, limits, neighbours, spread_evenly
from pmor.design.variants import AGREE, Found, Store, Variants, all_kept, apart, as_data, from_data, together
from pmor.work.pace import LOG, Beat
from pmor.work.pieces import Piece, Result, run_pieces

# Positions that a chunk of samples solves at least: a quarter of a second, so that threads share them out.
POSITIONS_PER_CHUNK = 25_000
# Most variants that are judged again on fine angles.
MOST_FINE = 300
# Most loads for which a design for that load alone is searched too, for comparison.
MOST_SINGLE = 6
# Seeds of the two halves of the samples, which know nothing of each other.
SEEDS = (SEED, SEED + 1)
# Of the samples, those from which the first result is found, and how many at most.
FIRST_SHARE, MOST_FIRST = 0.125, 64
# So many times two further descents at most, where the ends of both halves do not agree.
MOST_FURTHER = 2
# So many times the variants next to the best are judged at most.
MOST_AROUND = 4
# Most variants without a value that a page names.
MOST_SAID = 12
# Seconds between two lines on judgements.
EVERY_S = 5.0
# Descents start at least so far apart where they can, over the ranges: near ones end in one valley.
APART = 0.15


def _lost(variants: Variants, judge: Judge) -> tuple[str, ...]:
    """Name variants without a value; of the first ones, which a page has room for, why, where it shows as drawn."""
    names, sentences = [v.name for v in judge.design.variables], []
    for count, n in enumerate(np.flatnonzero(~np.isfinite(variants.objective)).tolist()):
        x = variants.x[n]
        values = ", ".join(f"{name} = {value:g}" for name, value in zip(names, x, strict=True))
        why = judge.lost(judge.solve(judge.assembly(x))) if count < MOST_SAID else []
        named = f"variant {n} ({values}) has a position that did not converge"
        sentences.append(f"{named}: {'; '.join(why)}" if why else named)
    return tuple(sentences)


class Search:
    """A search, stage by stage and piece by piece; the rest as in `pmor.design.run.run`.

    Parameters
    ----------
    judge : Judge
        Of the file's design.
    folder : Path
        Of finished pieces.
    around : str, optional
        Text of what results depend on beside the cases, by default that of the file: a gearbox, a set.
    """

    def __init__(
        self, judge: Judge, folder: Path, *, around: str | None = None, executor: Executor | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> None:  # fmt: skip
        self.file, self.judge, self.design = judge.file, judge, judge.design
        self.folder, self.executor, self.progress = folder, executor, progress
        self.evaluations: dict[str, int] = {}
        self.store = Store(self.file, self.folder)
        # Settings that results depend on beside the cases; titles do not count, nor the names of files.
        around = self.file.around if around is None else around
        self.settings = asdict(replace(self.design, title="", case="", gearbox=around, set=""))
        self._begin, self._told, self._beat = time.perf_counter(), Judgements(), Beat()
        # Finished pieces and reasons of those that stopped, by name: a stage may ask for those of an earlier one.
        self._known: dict[str, Result] = {}
        self._stopped: dict[str, str] = {}
        # Ends of the descents from each half of the samples, by where they start.
        self._ended: tuple[dict[bytes, Variants], dict[bytes, Variants]] = ({}, {})

    def first(self) -> Found | None:
        """Return what few samples and one descent find, long before the whole, which takes it over; None of nothing."""
        return self._found(self._few, best_alone=True) if self._few else None

    @cached_property
    def _few(self) -> list[Variants]:
        """What the first result is found from: few samples, and the end of a descent from the best of them."""
        parts = self._run("samples", self._samples(0)[:1])
        if not parts:
            return []
        few = from_data(parts[0], self.design)
        self._descend([(0, start) for start in self._starts(0, few, 1)])
        return [few, *self._ended[0].values()]

    def found(self, also: Sequence[FloatArray] = (), best_alone: bool = False) -> Found:
        """Return what the whole search finds.

        Parameters
        ----------
        also : sequence of ndarray, shape (n,)
            Variants of a search on aligned axes, judged beside the samples.
        best_alone : bool
            Without a front, and without designs for single loads.
        """
        _ = self._few  # asked for or not: results are the same
        halves, others = self.samples(also)
        samples = together([*(half for half in halves if half is not None), *others])
        tried = self.descents(halves, samples, best_alone)
        tried += [] if best_alone else self.trade_offs(samples, tried)
        return self._found([samples, *tried], best_alone, MOST_AROUND)

    def _found(self, parts: Sequence[Variants], best_alone: bool, around: int = 0) -> Found:
        """Judge variants finely, and so many times those around the best: a search on few angles passes them by."""
        pool = together(parts)
        outcome = self.judged_finely(pool, best_alone)
        for _ in range(around):
            near = self._around(outcome)
            if not near:
                break
            pool, before = together([pool, *near]), outcome.best
            outcome = self.judged_finely(pool, best_alone)
            if outcome.best == before:
                break
        failures = (*self._stopped.values(), *_lost(outcome.variants, self.judge))
        seconds, evaluations = time.perf_counter() - self._begin, dict(self.evaluations)
        return replace(outcome, seconds=seconds, failures=failures, ends=self._ends, evaluations=evaluations)

    def _around(self, outcome: Found) -> list[Variants]:
        """Judge the variants next to the best that are not known yet, on the angles of the search."""
        if outcome.best is None:
            return []
        known, best = {x.tobytes() for x in outcome.variants.x}, outcome.variants.x[outcome.best]
        near = [x for x in neighbours(self.design.variables, best) if x.tobytes() not in known]
        pieces = [
            self._piece(f"around {_number(x)}", x.tolist(), partial(self._judged, x[None], "next to the best"))
            for x in near
        ]
        self._run("next to the best", pieces)
        return self._parts(pieces)

    def samples(self, also: Sequence[FloatArray]) -> tuple[list[Variants | None], list[Variants]]:
        """Judge variants spread evenly over the ranges, in two halves, and others; None is a half without any."""
        halves = [self._samples(half) for half in (0, 1)]
        others = [
            self._piece(f"variant {number:05d}", one.tolist(), partial(self._judged, one[None], "aligned axes"))
            for number, one in enumerate(also)
        ]
        if not self._run("samples", [piece for pieces in (*halves, others) for piece in pieces]):
            raise ConvergenceError(f"no variant was solved, first: {next(iter(self._stopped.values()))}", [])
        of_halves = [self._parts(pieces) for pieces in halves]
        return [together(parts) if parts else None for parts in of_halves], self._parts(others)

    def _samples(self, half: int) -> list[Piece]:
        """Pieces of a half of the samples; the first of the first half are those of the first result."""
        search = self.design.search
        x = spread_evenly(self.design.variables, (search.samples + 1 - half) // 2, SEEDS[half])
        positions = len(self.design.load.labels) * self.judge.positions * len(self.judge.draws)
        first, size = first_samples(search), max(1, -(-POSITIONS_PER_CHUNK // positions))
        begins = [0, *range(first, len(x), size)] if half == 0 else list(range(0, len(x), size))
        return [
            self._piece(f"samples {half} {begin:06d}", [], partial(self._judged, x[begin:end], "sample"))
            for begin, end in zip(begins, [*begins[1:], len(x)], strict=True)
        ]

    def descents(self, halves: Sequence[Variants | None], samples: Variants, best_alone: bool) -> list[Variants]:
        """Go downhill from the best samples of both halves, and from the best for each load alone, and as drawn."""
        count = self.design.search.descents
        least = [np.inf if half is None else _least(half, self.design) for half in halves]
        counts = {int(np.nanargmin([*least, np.inf])) % 2: 1} if count == 1 else {0: (count + 1) // 2, 1: count // 2}
        starts = [(half, start) for half, many in counts.items() for start in self._starts(half, halves[half], many)]
        others = [] if best_alone else self._for_comparison(samples)
        self._descend(starts, others)
        for _ in range(MOST_FURTHER):
            if count == 1 or not (apart(self._ends) or 0.0) > AGREE:
                break
            worse = int(np.argmax(self._ends))
            self._descend([(worse, start) for start in self._starts(worse, halves[worse], 2)])
        return [end for ended in self._ended for end in ended.values()] + self._parts(others)

    def _for_comparison(self, samples: Variants) -> list[Piece]:
        """Pieces that go downhill for each load alone, and as drawn."""
        design, pieces, labels = self.design, list[Piece](), self.design.load.labels
        others = [("nominal", nominal(design))] if design.scatters else []
        if 1 < len(labels) <= MOST_SINGLE:
            others += [(label, at_load(design, number)) for number, label in enumerate(labels)]
        column = design.results.index(design.objective.key)
        for name, other in others:
            chosen = [labels.index(label) for label in other.load.labels]
            weights = np.array(other.load.weights) / sum(other.load.weights)
            value = samples.results[:, chosen, column] @ weights
            first = best_first(value, samples.limits, design.constraints)[0]
            if np.isfinite(value[first]):
                start = samples.x[first]
                work = partial(self._descended, self.judge.alike(other), start, name)
                pieces.append(self._piece(f"best {name}", start.tolist(), work))
        return pieces

    def _starts(self, half: int, samples: Variants | None, count: int) -> list[FloatArray]:
        """Return the best samples of a half from which no descent started yet, apart from each other where they can."""
        if samples is None:
            return []
        order = best_first(samples.objective, samples.limits, self.design.constraints)
        low, high = limits(self.design.variables)
        before = [np.frombuffer(start) for start in self._ended[half]]
        known = samples.x[order[np.isfinite(samples.objective[order])]]
        free = [x for x in known if x.tobytes() not in self._ended[half]]
        near, starts = list[FloatArray](), list[FloatArray]()
        for x in free:
            far = all(np.abs((x - other) / (high - low)).max() > APART for other in (*starts, *before))
            (starts if far else near).append(x)
            if len(starts) == count:
                break
        return [*starts, *near][:count]

    def _descend(self, starts: Sequence[tuple[int, FloatArray]], others: Sequence[Piece] = ()) -> None:
        """Go downhill from samples of both halves; other pieces beside them."""
        pieces = [
            self._piece(f"descent {_number(x)}", x.tolist(), partial(self._descended, self.judge, x, "descent"))
            for _, x in starts
        ]
        self._run("descents", [*pieces, *others])
        for (half, x), piece in zip(starts, pieces, strict=True):
            self._ended[half].update({x.tobytes(): end for end in self._parts([piece])})

    @property
    def _ends(self) -> tuple[float, float]:
        first, second = (_least(together([*one.values()]), self.design) if one else np.nan for one in self._ended)
        return first, second

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
            work = partial(self._descended, self.judge.alike(other), start, "trade-off")
            pieces.append(self._piece(f"trade-off {number:03d}", [level, *start.tolist()], work))
        self._run("trade-offs", pieces)
        return self._parts(pieces)

    def judged_finely(self, variants: Variants, best_alone: bool) -> Found:
        """Judge the variants that are to be chosen on fine angles, until these are the ones that are chosen.

        All of them on the fewest of these first: what few angles flatter is not judged further.
        """
        few, tried = self.design.search.angles, 0
        angles, settled = np.full(len(variants), few), np.zeros(len(variants), dtype=bool)
        variants = together([variants])  # those on few angles stay with the caller
        outcome = Found(self.judge, variants, angles, settled, variants.objective.copy(), {}, 0.0, (), final=False)
        seen = set[int]()
        while tried < MOST_FINE:
            best = [] if outcome.best is None else [outcome.best]
            wanted = best if best_alone else sorted({*outcome.front.tolist(), *outcome.chosen.values()})
            missing = [n for n in wanted if not settled[n]]
            now = [n for n in missing if n not in seen] or missing
            if not now:
                break
            tried += len(now)
            self._judge_finely(outcome, now, settle=now is missing)
            seen.update(now)
        return replace(outcome, final=True)

    def _judge_finely(self, outcome: Found, numbers: Sequence[int], settle: bool) -> None:
        """Put results on fine angles in the place of those of some variants."""
        variants, what = outcome.variants, "fine angles" if settle else "finer angles"
        pieces = {
            n: Piece(f"{what} {_number(variants.x[n])}", self.file.cases, [self.settings, variants.x[n].tolist()],
                     partial(_finely, self.judge, variants.x[n], settle, self._told.step)) for n in numbers
        }  # fmt: skip
        chosen = list(pieces)
        variants.objective[chosen], outcome.angles[chosen] = np.nan, 2 * self.design.search.angles
        outcome.settled[chosen] = settle
        self._run(what, list(pieces.values()))
        for n, piece in pieces.items():
            for one in self._parts([piece]):
                outcome.angles[n] = self._known[piece.name]["angles"]
                for name in ("results", "objective", "limits"):
                    getattr(variants, name)[n] = getattr(one, name)[0]

    def _judged(self, x: FloatArray, origin: str) -> Result:
        return _judged(self.judge, x, origin, self._told.step)

    def _descended(self, downhill: Judge, start: FloatArray, origin: str) -> Result:
        return _descended(downhill, self.judge, start, origin, self._told.step)

    def _piece(self, name: str, start: Any, run: Callable[[], Result]) -> Piece:
        def is_whole(part: Result) -> bool:
            self.store.take_over(from_data(part, self.design))
            return True

        def keep(part: Result) -> None:
            self.store.add(from_data(part, self.design))

        return Piece(name, self.file.cases, [self.settings, start], run, is_whole, keep)

    def _run(self, what: str, pieces: Sequence[Piece]) -> list[Result]:
        """Do the pieces that are not known yet; return the results of all that are there."""
        missing = {piece.name: piece for piece in pieces if piece.name not in {*self._known, *self._stopped}}
        done, failures = run_pieces(
            list(missing.values()), self.folder, executor=self.executor, progress=self.progress,
            what=f"pieces of {what}", beat=self._beat,
        )  # fmt: skip
        self._known |= done
        self._stopped |= zip((name for name in missing if name not in done), failures, strict=True)
        spent = sum(part["evaluations"] for part in done.values())
        self.evaluations[what] = self.evaluations.get(what, 0) + spent
        return [self._known[piece.name] for piece in pieces if piece.name in self._known]

    def _parts(self, pieces: Sequence[Piece]) -> list[Variants]:
        return [from_data(self._known[piece.name], self.design) for piece in pieces if piece.name in self._known]


class Judgements:
    """Counts judgements of variants, and tells of them while a piece of work takes long; threads may share it."""

    def __init__(self) -> None:
        self._count, self._next, self._lock = 0, time.perf_counter() + EVERY_S, threading.Lock()

    def step(self) -> None:
        """Count one."""
        with self._lock:
            self._count += 1
            now = time.perf_counter()
            if now >= self._next:
                self._next = now + EVERY_S
                LOG.info("%d judgements of variants so far", self._count)


def first_samples(search: SearchSettings) -> int:
    """Return from how many samples the first result is found."""
    return min(MOST_FIRST, math.ceil(FIRST_SHARE * search.samples))


def _least(variants: Variants, design: Design) -> float:
    """The least objective that keeps all constraints; NaN where none does."""
    good = all_kept(design, variants)
    return float(variants.objective[good].min()) if good.any() else np.nan


def _number(x: FloatArray) -> str:
    """Name a variant by its values: pieces of a stage and of the next one are the same by it."""
    return hashlib.sha256(x.tobytes()).hexdigest()[:12]


def _judged(judge: Judge, x: FloatArray, origin: str, step: Callable[[], None]) -> Result:
    verdicts = []
    for one in x:
        verdicts.append(judge.verdict(one))
        step()
    return as_data(verdicts, origin, len(x))


def _finely(judge: Judge, x: FloatArray, settle: bool, step: Callable[[], None]) -> Result:
    verdict, angles = judged_finely(judge, x) if settle else judged_once(judge, x)
    step()
    return {**as_data([verdict], "fine angles", 1), "angles": angles}


def _descended(downhill: Judge, judge: Judge, start: FloatArray, origin: str, step: Callable[[], None]) -> Result:
    """Go downhill by one judge; the end is judged by another."""
    way = Descent(downhill, step)
    best = way.run(np.asarray(start))[0]
    verdict = best if downhill is judge else judge.verdict(best.x)
    return as_data([verdict], origin, way.evaluations)
