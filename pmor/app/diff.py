"""Two folders of results beside each other: both curves, what differs by the table of quantities, and in the files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.app.diff_sides import FURTHER, RIGID, SOURCES, Side, documents, quantity, read_sides
from pmor.core.arrays import FloatArray
from pmor.core.shown import Columns
from pmor.core.wording import suggesting
from pmor.report.chart import Chart, panels
from pmor.report.curves import plot_beside
from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.replay import figure_of
from pmor.report.table import Table, aligned_lines
from pmor.results.tabular import Tabular
from pmor.work.results import Report, writing_results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FILES = ("diff.json", "diff.md", "report.html", "curves.svg")
# Of the largest value of a quantity: below is round-off of files and sums; below that no engineer does anything.
SAME, SMALL = 1e-6, 0.01
MOST_LINES, MOST_PANELS, MOST_LOADS, LONGEST_VALUE = 10, 8, 3, 100
#: sections of files that are told first
FIRST = ("load", "loads", "lubricant")
# Spans of angles that are one.
SPAN = 1e-6


@dataclass(frozen=True)
class Difference:
    """A quantity on both sides, in the unit of its key; None where it is not known."""

    load: str
    of: str
    key: str
    a: float | None
    b: float | None

    @property
    def difference(self) -> float | None:
        """Second less first."""
        return None if self.a is None or self.b is None else self.b - self.a

    @property
    def percent(self) -> float | None:
        """Of the first."""
        return 100.0 * self.difference / abs(self.a) if self.difference is not None and self.a else None


@dataclass(frozen=True)
class CurveDifference:
    """Curves of a part under a load, the second one interpolated at the points of the first, about their means."""

    load: str
    of: str
    largest: float | None
    a: tuple[FloatArray, FloatArray]
    b: tuple[FloatArray, FloatArray]


@dataclass(frozen=True)
class Key:
    """A key of the files whose value differs; None where it is not written."""

    file: str
    key: str
    a: str | None
    b: str | None


@dataclass(frozen=True, eq=False, repr=False)
class Differences(Tabular):
    """Results of two folders beside each other.

    Parameters
    ----------
    changed, same : tuple of Difference
        Those that differ, the largest change first, in parts of the largest value of their quantity; the others.
    keys : tuple of Key
        Of the files; those of loads and lubricant first.
    notes : tuple of str
        What is not compared, and how loads and angles that differ were taken.
    """

    sides: tuple[Side, Side]
    changed: tuple[Difference, ...]
    same: tuple[Difference, ...]
    curves: tuple[CurveDifference, ...]
    keys: tuple[Key, ...]
    notes: tuple[str, ...]

    @property
    def failures(self) -> tuple[str, ...]:
        """What did not converge on either side."""
        return tuple(f"{side.name}: {text}" for side in self.sides for text in side.failures)

    @property
    def data(self) -> dict[str, Any]:
        """All of it as plain data: the content of `diff.json`."""
        return {
            **{letter: {"folder": side.name, "file": side.file, "pmor": side.version}
               for letter, side in zip("ab", self.sides, strict=True)},
            "quantities": [
                {**asdict(one), "unit": self._quantity(one.key).unit, "difference": one.difference,
                 "percent": one.percent, "same": same}
                for same, listed in ((False, self.changed), (True, self.same)) for one in listed
            ],
            "curves": [{"load": one.load, "of": one.of, "largest_difference": one.largest} for one in self.curves],
            "keys": [asdict(key) for key in self.keys],
            "notes": list(self.notes),
            "failures": list(self.failures),
        }  # fmt: skip

    def columns(self) -> Columns:
        """All quantities by the names of columns, for `to_dataframe`."""
        rows = self.data["quantities"]
        heads = ("load", "of", "key", "unit", "a", "b", "difference", "percent")
        return {head: [row[head] for row in rows] for head in heads}

    def plot(self) -> Figure:
        """Draw both curves of each part in one axes, the first solid, the second dashed."""
        return figure_of(self._chart())

    def _chart(self) -> Chart:
        parts = list(dict.fromkeys(one.of for one in self.curves))[:MOST_PANELS]
        names, shown = (self.sides[0].name, self.sides[1].name), self.sides[0].curves
        assert shown is not None, "there are curves"
        about = " about its mean" if shown.periodic else ""
        with panels(1, 7.2, 3.4 * len(parts), rows=len(parts)) as (figure, axes):
            for one, part in zip(axes, parts, strict=True):
                own = [curve for curve in self.curves if curve.of == part][:MOST_LOADS]
                plot_beside(one, [(curve.load, names, curve.a, curve.b) for curve in own])
                one.set(title=part, xlabel=self._x_words(), ylabel=f"{shown.y_words}{about}")
        return figure

    def _x_words(self) -> str:
        shown = self.sides[0].curves
        assert shown is not None, "there are curves"
        return shown.x_words if _one_axis(self.sides) else "fraction of the angles that are solved"

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `diff.json`, `diff.md`, `report.html` and the picture of both curves; OutputError where that fails."""
        text = "\n".join(str(value) for side in self.sides for value in (side.name, side.text, side.figures))
        with writing_results(folder, FILES, text, overwrite=overwrite, working=()) as out:
            names = " and ".join(side.name for side in self.sides)
            Report("diff", self.data, f"Differences: {names}", list(self._blocks())).write(out)

    def _blocks(self) -> Iterator[Block]:
        yield from map(Warning, self.failures)
        few = self._few()
        yield Table("What differs most", self._few_heads(), few) if few else self._nothing()
        if self.curves:
            words = f"Solid: {self.sides[0].name}. Dashed: {self.sides[1].name}."
            yield Picture("curves.svg", words, self._chart())
        yield from self.notes
        yield Heading("What changed in the files")
        files = len({key.file for key in self.keys}) > 1
        rows = [(*([key.file] if files else []), key.key, key.a, key.b) for key in self.keys]
        heads = (*(["file"] if files else []), "key", *self._names())
        yield Table("Keys", heads, rows, "–: not written; the default holds.")
        if not rows:
            yield "No key differs." if self._texts_are_one else "Keys are not compared."
        yield Heading("Quantities")
        yield self._table("All that differ", self.changed)
        yield self._table(f"{len(self.same)} that do not", self.same, folded=True)

    def _table(self, title: str, listed: Sequence[Difference], folded: bool = False) -> Table:
        loads = len({one.load for one in listed}) > 1
        heads = ("quantity", *(["load"] if loads else []), "of", *self._heads())
        rows = [(self._quantity(one.key).head, *([one.load] if loads else []), one.of, *self._cells(one))
                for one in listed]  # fmt: skip
        return Table(title, heads, rows, folded=folded)

    @property
    def _texts_are_one(self) -> bool:
        return self.sides[0].text is not None and self.sides[0].text == self.sides[1].text

    def _names(self) -> tuple[str, str]:
        return self.sides[0].name, self.sides[1].name

    def _heads(self) -> tuple[str, ...]:
        return (*self._names(), "difference", "%")

    def _few_heads(self) -> tuple[str, ...]:
        return ("quantity", *self._names(), "change, %")

    def _cells(self, one: Difference) -> tuple[float | None, ...]:
        scale = 100.0 if self._quantity(one.key).percent else 1.0
        shown = (None if value is None else scale * value for value in (one.a, one.b, one.difference))
        return (*shown, None if one.percent is None else float(f"{one.percent:.3g}"))

    def _few(self) -> list[tuple[Any, ...]]:
        """The largest change of each quantity, those that matter alone, as rows."""
        told = [one for one in self.changed if not one.key.startswith(RIGID)]
        largest = {one.key: one for one in reversed(told)}
        order = [one for one in told if largest[one.key] is one]
        kept = [one for one in order if abs(one.percent if one.percent is not None else 100.0) >= 100.0 * SMALL]
        return [
            (", ".join(filter(None, (self._quantity(one.key).head, one.of, one.load))), a, b, percent)
            for one in kept[:MOST_LINES] for a, b, _, percent in [self._cells(one)]
        ]

    def _nothing(self) -> str:
        if not self.changed:
            return "No quantity differs." if self.same else "There is no quantity that both have."
        return f"No quantity differs by more than {100.0 * SMALL:g} %; {len(self.changed)} differ by less."

    @property
    def _further(self) -> bool:
        return self.sides[0].file in FURTHER

    def _quantity(self, key: str) -> Any:
        return quantity(key, self._further)

    def _shown(self) -> Columns:
        rows = self._few()
        return {head: [row[place] for row in rows] for place, head in enumerate(self._few_heads())}

    def __repr__(self) -> str:
        return f"<Differences of {self._names()[0]!r} and {self._names()[1]!r}: {len(self.changed)} quantities>"

    def __str__(self) -> str:
        few, lines = self._few(), [f"Differences: {self._names()[0]} and {self._names()[1]}"]
        lines += [f"  {line}" for line in aligned_lines(self._few_heads(), few)] if few else []
        lines += [] if few else [f"  {self._nothing()}"]
        lines += [f"  {', '.join(filter(None, (key.file, key.key)))}: {key.a or '–'} -> {key.b or '–'}"
                  for key in self.keys[:MOST_LINES]]  # fmt: skip
        more = len(self.keys) - MOST_LINES
        lines += [f"  and {more} further keys"] if more > 0 else []
        lines += [f"  note: {note}" for note in self.notes]
        return "\n".join([*lines, *(f"  ! {one}" for one in self.failures)])


@suggesting
def diff(a: Path | str, b: Path | str, folder: Path | str | None = None, *, overwrite: bool = False) -> Differences:
    """Set the results of two folders beside each other, as `pmor diff` does.

    Parameters
    ----------
    a, b : Path or str
        Folders of results, of machines of one kind or of two.
    folder : Path or str, optional
        For the page; none by default.
    overwrite : bool
        Replace files there, whoever wrote them.

    Raises
    ------
    FileFormatError
        Where a folder holds no results.
    OutputError
    """
    first, second = read_sides([Path(a), Path(b)])
    loads = _matched(first.loads, second.loads)
    notes = list(_notes(first, second, loads))
    found, lacking = _quantities(first, second, loads)
    notes += lacking
    further = first.file in FURTHER
    scale = dict[str, float]()
    for one in found:
        known = [abs(value) for value in (one.a, one.b) if value is not None]
        scale[one.key] = max(scale.get(one.key, 0.0), *known, 0.0)

    def change(one: Difference) -> float:
        if one.difference is None:
            return 0.0 if one.a == one.b else 1.0
        return abs(one.difference) / scale[one.key] if one.difference else 0.0

    found = [one for one in found if quantity(one.key, further) and (one.a is not None or one.b is not None)]
    # What one side alone knows stands behind all that can be compared.
    found.sort(key=lambda one: (change(one) <= SAME, one.difference is None, -change(one)))
    changed = tuple(one for one in found if change(one) > SAME)
    keys, words = _keys(first, second)
    result = Differences((first, second), changed, tuple(found[len(changed) :]), tuple(_curves(first, second, loads)),
                         tuple(keys), (*notes, *words))  # fmt: skip
    if folder is not None:
        result.write(folder, overwrite=overwrite)
    return result


def _matched(a: Sequence[str], b: Sequence[str]) -> list[tuple[str, str]]:
    """Return loads that are compared: those of one name, else one after the other, of unequal numbers the first."""
    if common := [name for name in a if name in b]:
        return [(name, name) for name in common]
    return list(zip(a, b, strict=True)) if len(a) == len(b) else list(zip(a, b, strict=False))[:1]


def _notes(a: Side, b: Side, loads: Sequence[tuple[str, str]]) -> Iterator[str]:
    if a.file != b.file:
        kinds = " beside ".join(f"{SOURCES[side.file].words} ({side.name})" for side in (a, b))
        yield f"Machines of two kinds are compared: {kinds}; quantities that one alone has are left out."
    if other := [f"{first} of {a.name} beside {second} of {b.name}" for first, second in loads if first != second]:
        yield f"Loads differ: {', '.join(other)}."
    for side, place in ((a, 0), (b, 1)):
        compared = {pair[place] for pair in loads}
        if alone := [load for load in side.loads if load not in compared]:
            yield f"Loads of {side.name} alone are left out: {', '.join(alone)}."
    if a.version != b.version:
        yield f"Versions of the program differ: {a.name} is of {a.version or 'an unknown one'}, {b.name} of " \
              f"{b.version or 'an unknown one'}."  # fmt: skip
    if a.curves and b.curves and a.curves.periodic and not _one_axis((a, b)):
        yield "Angles that are solved span different parts of a turn: curves are drawn over fractions of them."


def _quantities(a: Side, b: Side, loads: Sequence[tuple[str, str]]) -> tuple[list[Difference], list[str]]:
    """Return quantities of one place on both sides, and of one of which each side has a single place."""
    found, lost = list[Difference](), set[str]()
    for first, second in [*loads, ("", "")]:
        mine, other = (
            {(of, key): value for (load, of, key), value in side.figures.items() if load == own}
            for side, own in ((a, first), (b, second))
        )
        load = first if first == second else f"{first} / {second}"
        found += [Difference(load, of, key, value, other[of, key]) for (of, key), value in mine.items()
                  if (of, key) in other]  # fmt: skip
        alone = [{place: value for place, value in own.items() if place not in both}
                 for own, both in ((mine, other), (other, mine))]  # fmt: skip
        for key in dict.fromkeys(key for _, key in alone[0]):
            places = [[of for of, own in side if own == key] for side in alone]
            if [len(listed) for listed in places] == [1, 1]:
                (of,), (beside,) = places
                words = " / ".join(dict.fromkeys(filter(None, (of, beside))))
                found.append(Difference(load, words, key, alone[0].pop((of, key)), alone[1].pop((beside, key))))
        if a.file == b.file:
            lost |= {of for side in alone for (of, _), value in side.items() if of and value is not None}
    parts = sorted(part for part in lost if not any(one.of == part for one in found))
    return found, [f"Parts of one side alone are left out: {', '.join(parts)}."] if parts else []


def _one_axis(sides: Sequence[Side]) -> bool:
    """Whether curves of both sides span the same angles."""
    spans = [_span(*next(iter(side.curves.curves.values()))) if side.curves and side.curves.curves else 0.0
             for side in sides]  # fmt: skip
    periodic = all(side.curves is not None and side.curves.periodic for side in sides)
    return not periodic or abs(spans[0] - spans[1]) <= SPAN * max(spans)


def _span(x: FloatArray, y: FloatArray) -> float:
    """Angle over which a curve repeats; its end is not among its points."""
    return float(np.ptp(x)) * len(x) / max(len(x) - 1, 1)


def _curves(a: Side, b: Side, loads: Sequence[tuple[str, str]]) -> Iterator[CurveDifference]:
    if a.curves is None or b.curves is None or a.curves.y_words != b.curves.y_words:
        return
    periodic, one_axis = a.curves.periodic, _one_axis((a, b))
    for first, second in loads or [("", "")]:
        parts = [[part for load, part in side.curves.curves if load == own] if side.curves else []
                 for side, own in ((a, first), (b, second))]  # fmt: skip
        for part, other in _matched(*parts):
            own, beside = a.curves.curves[first, part], b.curves.curves[second, other]
            if periodic:
                own, beside = (_repeated(*curve, one_axis) for curve in (own, beside))
            words = part if part == other else f"{part or a.name} / {other or b.name}"
            load = first if first == second else f"{first} / {second}"
            yield CurveDifference(load, words, _largest(own, beside), own, beside)


def _repeated(x: FloatArray, y: FloatArray, in_degrees: bool) -> tuple[FloatArray, FloatArray]:
    """Return a curve about its mean up to the end of its angles, where the first value is again."""
    span, mean = _span(x, y), np.nanmean(y) if np.isfinite(y).any() else 0.0
    ended, about = np.append(x, x[0] + span) - x[0], np.append(y, y[0]) - mean
    return ended if in_degrees else ended / span, about


def _largest(a: tuple[FloatArray, FloatArray], b: tuple[FloatArray, FloatArray]) -> float | None:
    """Largest difference at the points of the first one, the other one interpolated; None where they do not meet."""
    order = np.argsort(b[0], kind="stable")
    there = np.interp(a[0], b[0][order], b[1][order], left=np.nan, right=np.nan)
    apart = np.abs(there - a[1])
    return float(np.nanmax(apart)) if np.isfinite(apart).any() else None


def _keys(a: Side, b: Side) -> tuple[list[Key], list[str]]:
    """Return the keys that differ, and what is not known of them."""
    if a.text is None or b.text is None:
        without = [side.name for side in (a, b) if side.text is None]
        does = "do not hold the text that they are" if len(without) == 2 else "does not hold the text that it is"
        return [], [f"Keys are not compared: {' and '.join(without)} {does} made from."]
    if a.text == b.text:
        return [], []
    if a.file != b.file:
        return [], ["Keys are not compared: files of two kinds have different ones."]
    both = [documents(side.text or "") for side in (a, b)]
    if both[0] is None or both[1] is None:
        return [], ["Keys are not compared: the texts differ, and one is no TOML."]
    found, first, second = list[Key](), both[0], both[1]
    for name in {**first, **second}:
        own = [files.get(name, {}) for files in (first, second)]
        items = [{key.partition("]")[0] for key in keys if "]" in key} for keys in own]
        # Items of lists that one side alone has are one row.
        alone = (items[0] ^ items[1]) if all(own) else set[str]()
        found += [Key(name, f"{item}]", *(_counted(item, keys) for keys in own)) for item in sorted(alone)]
        found += [Key(name, key, *(_short(keys.get(key)) for keys in own)) for key in {**own[0], **own[1]}
                  if own[0].get(key) != own[1].get(key) and key.partition("]")[0] not in alone]  # fmt: skip
    return sorted(found, key=lambda key: key.key.partition(".")[0].partition("[")[0] not in FIRST), []


def _counted(item: str, keys: Mapping[str, str]) -> str | None:
    count = sum(key.startswith(f"{item}]") for key in keys)
    return f"{count} keys" if count else None


def _short(value: str | None) -> str | None:
    return value if value is None or len(value) <= LONGEST_VALUE else f"{value[:LONGEST_VALUE]} …"
