"""Designs that are gearboxes: shafts, bearings, and meshes with gears of their own; figures are those of `pmor run`.

A base text is that of all files of the gearbox at once: it names none on this machine.
"""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from pmor.campaigns.keys import by_section, parts_in, split, with_value
from pmor.campaigns.kind import Cost, Design, Kind, Number, Solved
from pmor.campaigns.relations import with_relations
from pmor.campaigns.set_relations import known_in, with_kept_sums
from pmor.campaigns.set_relations import text_of_design as text_of_set
from pmor.campaigns.settings import OF_MOTION, GearboxCampaign, GearboxRelations, Relations
from pmor.case import change_case
from pmor.case.capability import refuse_beyond
from pmor.case.schema import SECTIONS
from pmor.core.errors import CaseError, ConvergenceError, PmorError
from pmor.core.ranges import Place
from pmor.dynamics.whine.readings import bearing_names
from pmor.dynamics.whine.run import about_loads, loads_of, speeds_of
from pmor.gear.inertia import Inertia
from pmor.machine.coupled import SolvedLoad
from pmor.machine.loader import GearboxFile
from pmor.machine.loader import load as load_toml
from pmor.machine.plan import LOADS, motion_of_gearbox, stages_of_gearbox
from pmor.machine.readings import load_data
from pmor.machine.run import meshes_and_trains, solved_loads
from pmor.pair.drawn import gear_inertias
from pmor.pair.model import refuse_loads_unmeshed
from pmor.results.quantities import TABLE, Quantity
from pmor.rexs.files import load_gearbox
from pmor.rexs.to_toml import gearbox_texts
from pmor.sets.loader import sections_of
from pmor.sets.preview import STRESS
from pmor.storage.gear_store import KeptGear, Store
from pmor.work.cost import body_seconds, refuse_beyond_memory, seconds_of

# *Measured*, seconds: files of a gearbox written and read.
OPENING_S = 0.2
# Stands for the name of the gearbox file in the names of those beside it.
STEM = "{stem}"
Data = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class ShaftKeys:
    """Keys of a shaft that designs may change: its axis, mm."""

    y_mm: Place = 0.0
    z_mm: Place = 0.0


@dataclass(frozen=True, kw_only=True)
class PlaceKeys:
    """By how much both gears of a mesh are farther along their shafts than in the base file, mm."""

    shift_mm: Place = 0.0


# Figures of a mesh, of a set, of a bearing, of the gearbox: the largest amounts over the load cases.
OF_MESHES = (
    "ste_mean_um", "ste_peak_to_peak_um", "ste_order_1_um", "k_h_beta", "f_beta_um", "flank_pressure_max_MPa",
    "root_stress_pinion_MPa", "root_stress_wheel_MPa",
)  # fmt: skip
OF_SETS = (*OF_MESHES[:3], "k_gamma", "row_force_max_N", "carrier_along_um")
OF_BEARINGS = ("radial_force_N", "axial_force_N")
OF_GEARBOX = (TABLE["losses_W"], replace(TABLE["mass_kg"], symbol="mass of all gears but those of sets"),
              TABLE["radiated_power_mW"])  # fmt: skip


def _of_base(base: Path) -> Kind:
    """Return the kind with the keys and the figures of a gearbox, by the names of its parts."""
    file = load_gearbox(base)
    sections = file.model.sections
    known: dict[str, type] = {f"shafts.{shaft.name}": ShaftKeys for shaft in sections.shafts}
    for one in sections.shafts:
        known = parts_in(one, f"shafts.{one.name}") | known
    for bearing in sections.bearings:
        known |= parts_in(bearing, f"bearings.{bearing.name}")
    known |= {f"places.{mesh.name}": PlaceKeys for mesh in sections.meshes}
    known |= {f"{name}.{section}": kind for name in file.cases for section, kind in SECTIONS.items()}
    for name, part in file.model.sets.items():
        known |= {f"{name}.{section}": kind for section, kind in known_in(sections_of(part.text, base)).items()}
    named: list[tuple[str, tuple[str, ...]]] = [(name, (*OF_MESHES, "mesh_force_N")) for name in file.cases]
    named += [(name, OF_SETS) for name in file.model.sets]
    named += [(bearing.name, (*OF_BEARINGS, "bearing_force_N")) for bearing in sections.bearings]
    figures = [_of(name, TABLE[key]) for name, own in named for key in own]
    still = [figure for figure in (*figures, TABLE["losses_W"]) if split(figure.key)[1] not in OF_MOTION]
    of_loads = {load.name: tuple(_of(load.name, figure) for figure in still) for load in sections.loads}
    first = [f"{name}.{OF_MESHES[1]}" for name in (*file.cases, *file.model.sets)]
    first = [*first[:1], "mass_kg", *first[1:]]
    return replace(GEARBOXES, known=known, figures=(*figures, *OF_GEARBOX), of_loads=of_loads, first=tuple(first))


def _of(name: str, figure: Quantity) -> Quantity:
    return replace(figure, key=f"{name}.{figure.key}", symbol=f"{name}: {figure.symbol}")


def _base_text(base: Path, relations: GearboxRelations, fixed: Mapping[str, Any], place: str) -> str:
    file = load_gearbox(base)
    for name in relations.shifts:
        if name not in file.cases:
            known = ", ".join(file.cases)
            raise CaseError(f'{place}: [relations] shifts: "{name}": is no mesh of {file.name}: name some of {known}')
    for name in relations.shift_sums:
        if name not in file.model.sets:
            known = ", ".join(file.model.sets) or "none, leave it out"
            raise CaseError(f'{place}: [relations] shift_sums: "{name}": is no set of {file.name}: it has {known}')
    return _text(json.dumps(gearbox_texts(_free(file), STEM)), fixed)


def _free(file: GearboxFile) -> GearboxFile:
    """Return a gearbox whose meshes take the distance of their axes from the shafts alone."""
    return replace(file, cases={n: change_case(c, pair={"centre_distance_mm": None}) for n, c in file.cases.items()})


def _text(base_text: str, design: Design) -> str:
    file, sections = _file(base_text), _file(base_text).model.sections
    cases, sets, changes = dict(file.cases), dict(file.model.sets), by_section(design)
    bearings = tuple(_with(one, _own(design, f"bearings.{one.name}")) for one in sections.bearings)
    meshes = []
    for mesh in sections.meshes:
        shift = changes.get(f"places.{mesh.name}", {}).get("shift_mm", 0.0)
        pinion, wheel = (replace(place, at_mm=place.at_mm + shift) for place in (mesh.pinion, mesh.wheel))
        meshes.append(replace(mesh, pinion=pinion, wheel=wheel))
    shafts = []
    for shaft in sections.shafts:
        keys = _own(design, f"shafts.{shaft.name}")
        at_mm = (keys.pop("y_mm", shaft.at_mm[0]), keys.pop("z_mm", shaft.at_mm[1]))
        shafts.append(_with(replace(shaft, at_mm=at_mm), keys))
    for name, case in cases.items():
        own = _own(design, name)
        cases[name] = change_case(case, pair={"centre_distance_mm": None}, **_nested(own))
    for name, one in sets.items():
        own = _own(design, name)
        sets[name] = replace(one, text=text_of_set(one.text, own)) if own else one
    sections = replace(sections, shafts=tuple(shafts), bearings=bearings, meshes=tuple(meshes))
    model = replace(file.model, sections=sections, sets=sets)
    return json.dumps(gearbox_texts(replace(file, model=model, cases=cases), STEM))


def _with(part: Any, keys: Mapping[str, Number]) -> Any:
    for name, value in keys.items():
        part = with_value(part, name.split("."), value)
    return part


def _own(design: Design, name: str) -> dict[str, Number]:
    """Return the keys of a part, without its name."""
    return {key.removeprefix(f"{name}."): value for key, value in design.items() if key.startswith(f"{name}.")}


def _nested(own: Design) -> dict[str, dict[str, Any]]:
    """Return the keys of a case by its sections; a pair has its centre distance from the shafts."""
    found = by_section(own)
    if "pair" in found:
        found["pair"] = {"centre_distance_mm": None, **found["pair"]}
    return found


def complete(base_text: str, design: Design, relations: GearboxRelations) -> dict[str, Number]:
    """Return the keys of a design with the profile shifts that follow; GeometryError where there are none."""
    found = dict(design)
    if not relations.shifts and not relations.shift_sums:
        return found
    file = _file(base_text)
    for name in relations.shift_sums:
        own = with_kept_sums(file.model.sets[name].text, _own(design, name))
        found |= {f"{name}.{key}": value for key, value in own.items()}
    shafts = {shaft.name: shaft for shaft in file.model.sections.shafts}
    for mesh in file.model.sections.meshes:
        if mesh.name not in relations.shifts:
            continue
        ends = [
            [design.get(f"shafts.{name}.{axis}_mm", at) for axis, at in zip("yz", shafts[name].at_mm, strict=True)]
            for name in (mesh.pinion.shaft, mesh.wheel.shaft)
        ]
        asked = Relations(centre_distance_mm=math.dist(*ends), solve=relations.solve)
        own = with_relations(file.cases[mesh.name].text, _own(design, mesh.name), asked)
        found |= {f"{mesh.name}.{key}": value for key, value in own.items()}
    return found


@lru_cache(maxsize=4)
def _file(base_text: str) -> GearboxFile:
    with _opened(base_text, "base") as file:
        return _free(file)


@contextmanager
def _opened(text: str, name: str) -> Iterator[GearboxFile]:
    """Give a gearbox of its texts; errors name it, and none of the files that it is read from."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.toml"
        for beside, content in files_of(text, name).items():
            (Path(folder) / f"{name}{beside}").write_text(content, encoding="utf-8")
        try:
            yield load_toml(path)
        except PmorError as error:
            said = str(error).replace(f"{path}: ", f"{name}: ").replace(f"{folder}/", "")
            raise type(error)(said, []) if isinstance(error, ConvergenceError) else type(error)(said) from None


def files_of(text: str, stem: str) -> dict[str, str]:
    """Return the files of a gearbox by what follows the stem in their names."""
    texts = {name: content.replace(STEM, stem) for name, content in json.loads(text).items()}
    return {".toml": texts.pop(""), **{name.removeprefix(STEM): content for name, content in texts.items()}}


def _refuse(text: str, name: str) -> None:
    with _opened(text, name) as file:
        for case in file.cases.values():
            refuse_loads_unmeshed(case)
            refuse_beyond_memory(case)


def _cost(text: str, name: str, keys: tuple[str, ...]) -> Cost:
    with _opened(text, name) as file:
        own = LOADS.format(len(file.model.sections.loads))
        solved = OPENING_S + seconds_of(stages_of_gearbox(file), own, STRESS)
        if any(split(key)[1] in OF_MOTION for key in keys) and (motion := motion_of_gearbox(file)) is not None:
            solved += motion.seconds
        cases = [*file.cases.values(), *(case for one in file.model.sets.values() for case in one.cases.values())]
    return Cost(solved, {repr((case.pair, case.mesh)): body_seconds(case) for case in cases})


def _solve(text: str, name: str, store: Store, keys: tuple[str, ...]) -> Solved:
    with _opened(text, name) as file:
        refuse_beyond(file, "sweep")
        loads, failures = solved_loads(file, *meshes_and_trains(file, store.get))
        if len(loads) < len(file.model.sections.loads):
            raise ConvergenceError(next(iter(failures)))
        moving = forces_in_motion(file, store.get) if any(split(key)[1] in OF_MOTION for key in keys) else {}
        return Solved(figures_of(file, loads) | moving, next(iter(failures), ""))


def forces_in_motion(file: GearboxFile, kept: KeptGear) -> dict[str, float]:
    """Return the largest forces of meshes and bearings over loads and speeds, rms of all lines, and the power."""
    refuse_beyond(file, "dynamics")
    about = about_loads(file, kept, speeds_of(file))
    found = dict[str, float]()
    for response in map(about, loads_of(file)):
        power = sum(response.power(source.lines, source).sum(axis=1) for source in response.sources)
        names = [f"{name}.mesh_force_N" for name in response.mesh_names]
        names += [f"{name}.bearing_force_N" for name in bearing_names(response)]
        most = [*response.rms.meshes.max(axis=0), *response.rms.bearings.max(axis=0), np.max(power)]
        for name, force in zip([*names, "radiated_power_mW"], most, strict=True):
            found[name] = max(float(force), found.get(name, 0.0))
    return found


def figures_of(file: GearboxFile, loads: Iterable[SolvedLoad]) -> dict[str, float | None]:
    """Return the largest amount over the loads of all figures, and those of each load; None of what is not found."""
    rows: dict[str, list[float | None]] = {}
    of_loads: dict[str, float | None] = {}
    for load in loads:
        data, before = load_data(file.model, file.cases, load), {key: len(row) for key, row in rows.items()}
        for mesh in (*data["meshes"], *data["sets"]):
            name, orders, stress = mesh["name"], mesh["ste_harmonics_um"], mesh.get("root_stress_max_MPa")
            pinion, wheel = stress or (None, None)
            of_mesh = {**mesh, "ste_order_1_um": orders[0] if orders else None, "root_stress_pinion_MPa": pinion,
                       "root_stress_wheel_MPa": wheel, **_over_the_turn(mesh.get("turn"))}  # fmt: skip
            for key in OF_MESHES if name in file.cases else OF_SETS:
                rows.setdefault(f"{name}.{key}", []).append(of_mesh[key])
        for bearing in data["bearings"]:
            rows.setdefault(f"{bearing['name']}.radial_force_N", []).append(bearing["radial_force_N"])
            rows.setdefault(f"{bearing['name']}.axial_force_N", []).append(bearing["force_N"][0])
        rows.setdefault("losses_W", []).append(data["losses_W"])
        of_loads |= {f"{load.load.name}.{key}": row[-1] for key, row in rows.items() if len(row) > before.get(key, 0)}
    masses: dict[tuple[str, float], Inertia] = {}
    for mesh in file.model.sections.meshes:  # a gear may be in several meshes
        places = ((place.shaft, place.at_mm) for place in (mesh.pinion, mesh.wheel))
        masses |= dict(zip(places, gear_inertias(file.cases[mesh.name], file.model.pairs[mesh.name]), strict=True))
    found = of_loads | {key: _largest(values) for key, values in rows.items()}
    return found | {"mass_kg": sum(inertia.mass_kg for inertia in masses.values())}


def _over_the_turn(turn: Data | None) -> dict[str, float | None]:
    """Figures of a set over a turn of its carrier; None of one that nothing stands against."""
    if turn is None:
        return {"row_force_max_N": None, "carrier_along_um": None}
    return {
        "row_force_max_N": _largest([row["largest_N"] for row in turn["planet_rows"]] or [None]),
        "carrier_along_um": float(np.mean(turn["members"]["carrier"]["along_um"])),
    }


def _largest(values: list[float | None]) -> float | None:
    known = [abs(value) for value in values if value is not None]
    return max(known) if len(known) == len(values) else None


def _peaks(text: str, name: str, store: Store) -> Mapping[str, float]:
    raise AssertionError("a gearbox has no peak-to-peak STE of its own")


GEARBOXES = Kind(
    key="gearbox", gear="high_speed.pinion", sections=GearboxCampaign, known={}, figures=(), first=(),
    base_text=_base_text, complete=complete, text=_text, why=lambda reason, *_: reason, refuse=_refuse,
    cost=_cost, solve=_solve, peaks=_peaks, of_base=_of_base, files=files_of,
)  # fmt: skip
