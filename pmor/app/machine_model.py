"""The model of a set or a gearbox: finite elements of all gears once, then sweeps over torques and variants."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from pmor.app.asked import amounts_of, whole_angles
from pmor.app.cases import change
from pmor.app.machines import with_rexs
from pmor.core.errors import CaseError
from pmor.core.progress import Progress, Steps, quietly
from pmor.core.shown import Columns, keys_of
from pmor.core.threads import one_thread, refuse_processes
from pmor.core.wording import suggesting
from pmor.machine.loader import GearboxFile
from pmor.machine.result import GearboxResult
from pmor.machine.run import meshes_and_trains
from pmor.machine.run import solved as solve_gearbox
from pmor.report.curves import Drawn, joined
from pmor.sets.loader import SetFile
from pmor.sets.result import SetResult
from pmor.sets.run import solved as solve_set
from pmor.sets.run import train_of
from pmor.storage.gear_store import KeptGear, not_kept
from pmor_offline.gears import solved_once


@dataclass(frozen=True, eq=False, repr=False)
class MachineModel:
    """A planetary set, a train or a gearbox whose gears are solved: other loads and flanks take no finite elements.

    Parameters
    ----------
    file : SetFile or GearboxFile
    kept : callable
        Gives each gear that was solved, in memory.
    """

    file: SetFile | GearboxFile
    kept: KeptGear = field(default_factory=lambda: solved_once(not_kept))

    @suggesting
    def sweep(
        self, torques_Nm: float | Iterable[float] | None = None, angles: int | None = None, *,
        executor: Executor | None = None, progress: Steps = quietly,
    ) -> SetResult | GearboxResult:  # fmt: skip
        """Solve the machine over its mesh cycles and torques.

        Parameters
        ----------
        torques_Nm : float or iterable of float, optional
            Of a set the torque that its file names, in rising order; further torques of a train are in proportion. Of a
            gearbox the first torque of its first load: each is a load with all torques of that one in proportion, its
            forces and speed as they are. Negative ones load the other flanks. By default the loads of the file.
        angles : int, optional
            Angles to a mesh cycle; by default those of the file.
        executor : concurrent.futures.Executor, optional
            Of threads: shares out the work; the result is the same to the last bit.
        progress : callable
            Called with the number of steps done: of a gearbox its loads.

        Raises
        ------
        CaseError
            When torques have both signs, or a load is beyond the range of contact.
        """
        return self._swept(self.file, torques_Nm, angles, executor, progress)

    @suggesting
    def sweep_conditions(
        self, variants: Mapping[str, Mapping[str, Any]], torques_Nm: float | Iterable[float] | None = None,
        angles: int | None = None, *, executor: Executor | None = None, progress: Steps = quietly,
    ) -> VariantsResult:  # fmt: skip
        """Sweep variants of the machine; gears that differ from those before are solved first.

        Parameters
        ----------
        variants : mapping of str to mapping
            What changes, as `pmor.change` takes it, by the names that tables call them: ``{"plain": {}, "relief":
            {"sun": {"modification": {"tip_relief_um": 20.0, "tip_relief_start_percent": 60.0}}}}``.
        torques_Nm, angles, executor
            As in `sweep`, the same for all.
        progress : callable
            Called with the number of variants done.

        Raises
        ------
        CaseError
            As `sweep` and `pmor.change`, with the name of the variant.
        """
        if not isinstance(variants, Mapping) or not variants:
            raise CaseError(f'{self.file.name}: variants: are changes by names: write {{"plain": {{}}, ...}}')
        files = {name: _changed(self.file, str(name), changes) for name, changes in variants.items()}
        found = list[SetResult | GearboxResult]()
        with Progress(len(files), "variants", further=progress) as bar:
            for file in files.values():
                found.append(self._swept(file, torques_Nm, angles, executor, quietly))
                bar.step()
        return VariantsResult(tuple(map(str, files)), tuple(found))

    @one_thread()
    def _swept(
        self, file: Any, torques_Nm: Any, angles: Any, executor: Executor | None, progress: Steps
    ) -> SetResult | GearboxResult:
        refuse_processes(executor)
        if torques_Nm is not None:
            file = _under(file, *amounts_of(file.name, torques_Nm))
        if angles is not None:
            file = _with_angles(file, whole_angles(file.name, angles))
        solve: Any = solve_set if isinstance(file, SetFile) else solve_gearbox
        found: SetResult | GearboxResult = with_rexs(solve(file, self.kept, executor, progress))
        return found

    def __repr__(self) -> str:
        kind = "set" if isinstance(self.file, SetFile) else "gearbox"
        return f"<MachineModel of the {kind} {self.file.name!r}: {len(self.file.cases)} kinds of meshes>"

    def _repr_html_(self) -> str:
        return self.file._repr_html_()


@dataclass(frozen=True, eq=False, repr=False)
class VariantsResult(Drawn):
    """Variants of a set or a gearbox, under the same torques.

    Parameters
    ----------
    names : tuple of str
        Of the variants, in tables and pictures.
    results : tuple of SetResult or GearboxResult
        One for each.
    """

    names: tuple[str, ...]
    results: tuple[SetResult | GearboxResult, ...]

    @property
    def failures(self) -> tuple[str, ...]:
        """Positions and loads of all variants without a solution, in words."""
        each = zip(self.names, self.results, strict=True)
        return tuple(f"{name}: {text}" for name, result in each for text in result.failures)

    def columns(self) -> Columns:
        """Main figures and keys that differ by the names of columns: a row for each variant, load and mesh."""
        figures = [result.figures() for result in self.results]
        counts = [len(next(iter(one.values()))) for one in figures]
        texts = [dict(keys_of(tomllib.loads(result.file.text))) for result in self.results]
        keys = [key for key in dict.fromkeys(key for text in texts for key in text)
                if len({text.get(key) for text in texts}) > 1]  # fmt: skip
        found: dict[str, Any] = {"variant": np.repeat(self.names, counts)}
        for key in keys:
            values = [json.loads(text.get(key, "null")) for text in texts]
            found[key] = [value for value, count in zip(values, counts, strict=True) for _ in range(count)]
        return found | {key: np.concatenate([one[key] for one in figures]) for key in figures[0]}

    def _drawn(self) -> Columns:
        return joined({name: result.columns() for name, result in zip(self.names, self.results, strict=True)})

    def __repr__(self) -> str:
        ending = f"; {len(self.failures)} failures" if self.failures else ""
        return f"<VariantsResult: {len(self.names)} variants, the first {self.results[0]!r}{ending}>"


@one_thread()
def train_machine(
    file: SetFile | GearboxFile, executor: Executor | None = None, progress: Steps = quietly
) -> MachineModel:
    """Solve the finite elements of all gears of a machine; see `pmor.train`."""
    refuse_processes(executor)
    model = MachineModel(file)
    if isinstance(file, SetFile):
        train_of(file, model.kept, executor)
    else:
        meshes_and_trains(file, model.kept, executor)
    progress(1)
    return model


def _changed(file: Any, name: str, changes: Any) -> Any:
    try:
        return change(file, **changes)
    except (CaseError, TypeError) as error:
        raise CaseError(f"variant {name}: {error}") from None


def _under(file: Any, amounts: tuple[float, ...], sign: float) -> Any:
    """Return a machine under torques of one sign, checked as those of a file."""
    document = tomllib.loads(file.text)
    if isinstance(file, GearboxFile):
        return change(file, loads=[_load_of(document["loads"][0], sign * amount) for amount in amounts])
    *others, largest = sorted(set(amounts))
    sweep = {"torques_Nm": others or None}
    further = {"loads": None} if "loads" in document else {}
    if "gears" not in document:
        return change(file, load={"torque_Nm": sign * largest}, sweep=sweep, **further)
    factor = sign * largest / file.plan.nominal_Nm * (-1.0 if file.plan.clockwise else 1.0)
    gears = {gear["name"]: {"torque_Nm": factor * gear["torque_Nm"]}
             for gear in document["gears"] if isinstance(gear.get("torque_Nm"), int | float)}  # fmt: skip
    return change(file, gears=gears, sweep=sweep, **further)


def _load_of(load: Mapping[str, Any], torque_Nm: float) -> dict[str, Any]:
    """Return a load case like another whose first torque is a given one, all others of it in proportion."""
    first = next(one["torque_Nm"] for one in load["torques"] if one["torque_Nm"] != "balance")
    torques = [one if one["torque_Nm"] == "balance" else one | {"torque_Nm": torque_Nm / first * one["torque_Nm"]}
               for one in load["torques"]]  # fmt: skip
    kept = {key: value for key, value in load.items() if key not in ("fraction", "hours")}
    return kept | {"name": f"{torque_Nm:g} N m", "torques": torques}


def _with_angles(file: Any, angles: int) -> Any:
    """Return a machine whose meshes are solved at another number of angles to a mesh cycle."""
    if isinstance(file, SetFile):
        said = file.sections
        return replace(file, sections=replace(said, sweep=replace(said.sweep, angles_per_pitch=angles)))
    cases = {name: replace(case, online=replace(case.online, angles_per_pitch=angles))
             for name, case in file.cases.items()}  # fmt: skip
    sets = {name: _with_angles(one, angles) for name, one in file.model.sets.items()}
    return replace(file, cases=cases, model=replace(file.model, sets=sets))
