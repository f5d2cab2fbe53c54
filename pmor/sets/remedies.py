"""Remedies of a set: flanks of its members, a sun that floats, pins and gears that are true."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from pmor.case.document import COAST, MODIFICATION
from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray
from pmor.core.errors import PmorError
from pmor.gear.condition import Assembly
from pmor.gear.modification import Modification
from pmor.line.several import GearTrain
from pmor.report.verdict import Seen, findings, verdict_of
from pmor.results.root_stress import GEARS
from pmor.results.verdict import Advice, Change, Verdict, written
from pmor.sets.loader import SetFile, with_sections
from pmor.sets.settings import SetSections
from pmor.sets.solution import SetSolution, solve_set
from pmor.sets.variants import BuiltSet, SetVariant, SetVariants
from pmor_online.remedies import LEAST_GAIN, off_most, remedy, with_first
from pmor_online.trials import FIGURES, MOST_IN_MODULES, Figures, Trial

# Angles of a mesh cycle on which flanks are tried; positions beyond which nothing is.
FEW_ANGLES, MOST_POSITIONS = 10, 3000
# K_gamma that is as good as even: a second remedy that reaches it is told too.
EVEN = 1.05
# Figures of the set as a whole; others are those of a mesh.
OF_THE_SET = ("ste_peak_to_peak_um",)


@dataclass(frozen=True)
class SetTrials:
    """A set whose flanks are tried under its nominal torque.

    Parameters
    ----------
    file : SetFile
    solution : SetSolution
        As filed.
    load : int
        Number of the nominal torque.
    mesh : int
        That figures of a mesh are of.
    within : str
        Name of the set in a gearbox, empty otherwise.
    flanks : tuple of Assembly
        Of each mesh; empty: as filed.
    """

    file: SetFile
    solution: SetSolution
    load: int
    mesh: int
    within: str = ""
    flanks: tuple[Assembly, ...] = ()
    evaluations: int = 14

    @property
    def part(self) -> str:
        """Name of the mesh, behind that of the set in a gearbox."""
        own = self.solution.mesh_names[self.mesh]
        return f"{self.within}: {own}" if self.within else own

    @property
    def labels(self) -> tuple[str, ...]:
        """Torques in words."""
        return tuple(f"{torque:g} N m" for torque in self.solution.torque_Nm)

    @property
    def gears(self) -> tuple[str, ...]:
        """Members with teeth."""
        return tuple(dict.fromkeys(member for both in self._members for member in both))

    @property
    def _members(self) -> list[tuple[str, str]]:
        plan = self.solution.plan
        return [(plan.bodies[one.pinion].member, plan.bodies[one.wheel].member) for one in plan.meshes]

    @property
    def helix_of(self) -> str:
        """Member of the mesh whose helix is off most, else the one whose helix moves no other kind of mesh."""
        usual = next((one for one in self._members[self.mesh] if one in ("sun", "ring")), self._members[self.mesh][0])
        return off_most(self, (usual, *self._members[self.mesh]))

    @property
    def whole_width(self) -> bool:
        """Whether both halves of the face may differ."""
        return not self.solution.train.meshes[self.mesh].pair.meshed.mirrored

    @property
    def over_width(self) -> bool:
        """Whether anything differs over the face."""
        return meshed_width(next(iter(self.file.cases.values()))) != "plane_strain"

    @property
    def most_um(self) -> float:
        """Largest amount of a relief."""
        return MOST_IN_MODULES * 1e3 * next(iter(self.file.cases.values())).pair.module_mm

    @property
    def width_mm(self) -> float:
        """Common face width."""
        return self.solution.train.meshes[self.mesh].pair.meshed.pair.common_width

    @property
    def size_um(self) -> float:
        """By how much flanks stand askew, about."""
        moved = np.nanmean(self.solution.mesh_displacement(self.mesh)[self.load], axis=0)
        flanks = [self.filed(member) for member in self._members[self.mesh]]
        own = sum(abs(flank.helix_slope_um) + abs(flank.helix_crowning_um) for flank in flanks)
        return 1e3 * self.width_mm * float(np.abs(moved[1] - moved[0])[3:5].sum()) + own + 1.0

    @cached_property
    def _flanks(self) -> tuple[Assembly, ...]:
        return self.flanks or tuple(mesh.assembly for mesh in self.solution.train.meshes)

    def filed(self, gear: str) -> Modification:
        """Return the flanks of a member as they are filed."""
        for flanks, members in zip(self._flanks, self._members, strict=True):
            for name, member in zip(GEARS, members, strict=True):
                if member == gear:
                    found: Modification = getattr(flanks, name)
                    return found
        raise KeyError(gear)

    def having(self, trial: Trial, loads: Sequence[str] | None = None) -> SetTrials:
        """Return it with a trial in its file."""
        return replace(self, flanks=self._built(trial).flanks)

    def anew(self, file: SetFile) -> SetSolution:
        """Return the set with other supports, pins or places of gears, on these flanks, under the nominal torque."""
        meshes = tuple(replace(mesh, assembly=flanks)
                       for mesh, flanks in zip(self.solution.train.meshes, self._flanks, strict=True))  # fmt: skip
        plan = file.plan
        train: GearTrain = replace(self.solution.train, meshes=meshes, free=plan.free, compliance=plan.compliance)
        nominal = self.solution.torque_Nm[self.load : self.load + 1]
        return solve_set(plan, train, nominal, file.angles_per_pitch, file.pitches)

    def _built(self, trial: Trial) -> BuiltSet:
        flanks = []
        for own, members in zip(self._flanks, self._members, strict=True):
            changed = {name: getattr(own, name).changed(trial[member])
                       for name, member in zip(GEARS, members, strict=True) if member in trial}  # fmt: skip
            flanks.append(replace(own, **changed))
        return BuiltSet(tuple(flanks), self.solution.plan.displacement, self.solution.plan.eccentricity)

    def _solver(self, angles: int, torques: FloatArray) -> SetVariants:
        meshes = tuple(replace(mesh, assembly=mesh.assembly.of_teeth) for mesh in self.solution.train.meshes)
        train = replace(self.solution.train, meshes=meshes)
        return SetVariants(self.solution.plan, train, torques, angles, self.solution.pitches)

    @cached_property
    def _few(self) -> SetVariants:
        return self._solver(FEW_ANGLES, self.solution.torque_Nm[self.load : self.load + 1])

    @cached_property
    def _all(self) -> SetVariants:
        return self._solver(FEW_ANGLES, self.solution.torque_Nm)

    def quickly(self, trial: Trial, every: bool = False) -> Figures:
        """Return all figures on few angles under the nominal torque or all, each (D,); infinite where not known."""
        found = self._figures((self._all if every else self._few).solve(self._built(trial)))
        return {key: np.where(np.isfinite(values), values, np.inf) for key, values in found.items()}

    def _figures(self, variant: SetVariant) -> Figures:
        there = variant.converged.all(axis=1)
        return {key: np.where(there, self._figure(key, variant), np.nan) for key in FIGURES}

    def _figure(self, key: str, variant: SetVariant) -> FloatArray:
        if key == "ste_peak_to_peak_um":
            return np.asarray(np.ptp(variant.ste_um, axis=1))
        if key == "k_h_beta":
            return variant.solution.k_h_beta(self.mesh)
        return variant.solution.figures_of(self.mesh)[key]

    def solved(self, trial: Trial) -> Figures:
        """Return figures under all loads: under the nominal torque as a run has them, under others on few angles."""
        nominal = slice(self.load, self.load + 1)
        whole = self._solver(self.solution.angles_per_pitch, self.solution.torque_Nm[nominal])
        found = self._figures(whole.solve(self._built(trial)))
        if len(self.solution.torque_Nm) == 1:
            return found
        every = self._figures(self._all.solve(self._built(trial)))
        for key, values in every.items():
            values[self.load] = found[key][0]
        return every

    def sections(self, gear: str) -> Sequence[str]:
        """Return the sections of the file that have the flanks of a member."""
        given = self.file.sections.members[gear].get(COAST)
        of = f"{self.within}: " * bool(self.within)
        return [f"{of}{gear}.{MODIFICATION}", *([f"{of}{gear}.{COAST}"] if given else [])]


def verdict_of_set(file: SetFile, solution: SetSolution, data: Mapping[str, Any]) -> Verdict:
    """Return the verdict on a set under its nominal torque, by the content of `set.json`."""
    load = int(np.argmin(np.abs(solution.torque_Nm - file.plan.torque_Nm)))
    found = findings(seen_of_set(data, f"{data['torque_Nm']:g} N m" if len(data["torques"]) > 1 else ""))
    return verdict_of(
        found, lambda one, first: set_remedy(file, solution, load, one.key, one.part, first=first), data["failures"]
    )  # fmt: skip


def seen_of_set(data: Mapping[str, Any], load: str, part: str = "") -> Iterator[Seen]:
    """Yield the figures of a set under a load, and of each of its meshes."""
    yield Seen(load, part, data)
    for mesh in data["meshes"]:
        yield Seen(load, f"{part}: {mesh['name']}" if part else mesh["name"], mesh)


def set_remedy(
    file: SetFile, solution: SetSolution, load: int, key: str, mesh: str, within: str = "", first: Advice | None = None
) -> Advice | str | None:  # fmt: skip
    """Return what helps a figure of a set, by its key, or of one of its meshes; None where nothing does.

    Parameters
    ----------
    load : int
        Number of the torque.
    mesh : str
        Its name; empty for the set as a whole.
    within : str
        Name of the set in a gearbox, empty otherwise.
    first : Advice, optional
        That is in the file.
    """
    if solution.pitches * solution.angles_per_pitch > MOST_POSITIONS:
        return f"nothing is tried, since each trial takes {solution.pitches * solution.angles_per_pitch} positions"
    names = solution.mesh_names
    tried = SetTrials(file, solution, load, names.index(mesh) if mesh in names else 0, within)
    if key == "k_gamma":
        found = [] if within else even_load(with_first(tried, first))
        return found[0][0] if found else "supports and pins are tried where the file of the set is run" * bool(within)
    if first is not None and first.figure == "k_gamma":
        file = next(changed for advice, changed in even_load(tried) if advice.changes == first.changes)
        tried = replace(tried, file=file, solution=tried.anew(file), load=0)
    tried = with_first(tried, first)
    advice = remedy(tried, key, tried.helix_of)
    return replace(advice, part=within) if advice is not None and advice.figure in OF_THE_SET else advice


def even_load(tried: SetTrials) -> list[tuple[Advice, SetFile]]:
    """Return what levels the load of the planets, the best first: a sun that floats, a true pin, or a true gear.

    Each with the set that has it.
    """
    filed = tried.anew(tried.file).k_gamma[0] if tried.flanks else tried.solution.k_gamma[tried.load]
    before, found = float(filed), list[tuple[Advice, SetFile]]()
    for what, said, change in _evener(tried.file.sections):
        try:
            changed = with_sections(tried.file, said)
            after = float(tried.anew(changed).k_gamma[0])
        except PmorError:
            continue
        if after - 1.0 <= (1.0 - LEAST_GAIN) * (before - 1.0):
            found.append((Advice(what, "k_gamma", "", "", before, after, (change,)), changed))
    if not found:
        return []
    (best, changed), *others = sorted(found, key=lambda one: one[0].after)
    beside = [
        f"Or {one.what[:1].lower()}{one.what[1:]}, to {one.after:.3g}: {written(one.changes)}."
        for one, _ in others if one.after < max(EVEN, best.after)
    ]  # fmt: skip
    return [(replace(best, beside=tuple(beside)), changed), *others]


def _evener(said: SetSections) -> Iterator[tuple[str, SetSections, Change]]:
    """Yield what may level the load: in words, as sections, and as the key that says it."""
    supports, planets, off = said.supports, said.planets, said.eccentricity
    if supports.sun_radial_N_per_mm != "free":
        free = replace(said, supports=replace(supports, sun_radial_N_per_mm="free"))
        yield "A sun that floats", free, Change("supports", {"sun_radial_N_per_mm": "free"})
    for key, words in (("tangential_um", "around"), ("radial_um", "outwards")):
        errors = getattr(planets, key)
        if any(errors):
            number, true = _without_largest(errors)
            changed = replace(said, planets=replace(planets, **{key: true}))  # type: ignore[arg-type]
            yield f"A true pin of planet {number + 1} {words}", changed, Change("planets", {key: true}, {key: errors})
    if any(off.planets_um):
        number, true = _without_largest(off.planets_um)
        changed = replace(said, eccentricity=replace(off, planets_um=true))
        change = Change("eccentricity", {"planets_um": true}, {"planets_um": off.planets_um})
        yield f"Planet {number + 1} true on its pin", changed, change
    for key, member in (("sun_um", "The sun"), ("ring_um", "The ring")):
        if getattr(off, key):
            changed = replace(said, eccentricity=replace(off, **{key: 0.0}))  # type: ignore[arg-type]
            yield f"{member} true on its axis", changed, Change("eccentricity", {key: 0.0})


def _without_largest(errors: tuple[float, ...]) -> tuple[int, tuple[float, ...]]:
    """Number of the error that is furthest from the others' median, and all of them with that one at the median."""
    middle = float(np.median(errors))
    number = int(np.argmax(np.abs(np.array(errors) - middle)))
    return number, tuple(middle if place == number else error for place, error in enumerate(errors))
