"""Designs that are planetary sets: the figures of each are, to the last bit, those of `pmor run` of its file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from pmor.campaigns.kind import PEAKS, Cost, Kind, Solved
from pmor.campaigns.peaks import settled_peaks
from pmor.campaigns.set_relations import KNOWN, known_in, text_of_design, why_infeasible, with_relations
from pmor.campaigns.settings import OF_SETS, SetCampaign, SetRelations
from pmor.campaigns.trains import figures_in, figures_of_train, known_of
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError
from pmor.design.fine import fine_angles
from pmor.line.several import GearTrain
from pmor.pair.drawn import gear_inertias
from pmor.pair.model import held_radii
from pmor.results.quantities import TABLE
from pmor.rexs.files import load_set, read_sections
from pmor.sets.kinematics import speed_ratio
from pmor.sets.layout import SECOND_PLANET
from pmor.sets.loader import SetFile, parse_set
from pmor.sets.plan import planets_gap_mm
from pmor.sets.preview import STRESS, SWEEP, pairs_of, refuse_large_set, set_seconds, stages_of_set, sweep_seconds
from pmor.sets.readings import Data, plain, set_data
from pmor.sets.run import first_torques_Nm, solved, train_of
from pmor.sets.solution import solve_set
from pmor.storage.gear_store import Store
from pmor.work.cost import body_seconds, seconds_of

FIRST = (
    PEAKS[0], "mass_kg", "root_stress_sun_MPa", "root_stress_planet_MPa", "root_stress_ring_MPa", "k_gamma",
    "speed_ratio", "mesh_phase_pitches",
)  # fmt: skip
OF_TRAIN = (PEAKS[0], "mass_kg", "share_max", "k_h_beta", "flank_pressure_max_MPa")
# Results of the meshes of sun and ring, and keys of a mesh in `set.json`.
OF_MESHES = {
    "line_load_max_{}_N_per_mm": "line_load_max_N_per_mm",
    "k_h_beta_{}": "k_h_beta",
    "contact_ratio_{}": "contact_ratio",
}
ORDERS = 3
DIGITS = 9


def _base_text(base: Path, relations: SetRelations, fixed: Mapping[str, Any], place: str) -> str:
    # Relations may make gears fit that do not as the file has them: designs are put together with these alone.
    text, said = read_sections(base) if relations != SetRelations() else ("", None)
    if said is None:
        file = load_set(base)
        text, said = file.text, file.sections

    def refuse(what: str, rule: str) -> NoReturn:
        raise CaseError(f"{place}: {what}: {rule}")

    if said.gears and relations != SetRelations():
        refuse("[relations]", f"is of planetary sets, and {base} is a train on fixed axes: leave it out")
    if said.carrier.stiffness is not None:
        rule = "a matrix is of one number of planets and one centre distance: leave it out there"
        refuse(f"{base}: [carrier] stiffness", rule)
    if relations.centre_distance_mm is not None and relations.solve is not None:
        rule = "with centre_distance_mm the shifts of sun and ring are found both: leave it out"
        refuse(f'[relations] solve = "{relations.solve}"', rule)
    for key in ("planet_teeth_fewer", "ring_diameter_mm") if SECOND_PLANET in said.members else ():
        if getattr(relations, key) is not None:
            refuse(f"[relations] {key}", f"is of planets with one gear, and {base} has stepped ones: leave it out")
    return text_of_design(text, fixed)


def _file(text: str, name: str) -> SetFile:
    """The set of a design, without its tolerances."""
    file = parse_set(text, name, name)
    return replace(file, sections=replace(file.sections, tolerances=None))


def _refuse(text: str, name: str) -> None:
    refuse_large_set(_file(text, name))


def _cost(text: str, name: str, keys: tuple[str, ...]) -> Cost:
    file = _file(text, name)
    torques, fine = len(file.torques_Nm), fine_angles(file.angles_per_pitch * file.pitches) / file.pitches
    elements = {repr((case.pair, case.mesh)): body_seconds(case) for case in file.cases.values()}
    solved = seconds_of(stages_of_set(file), SWEEP, STRESS)
    return Cost(solved, elements, sweep_seconds(file, set_seconds(file), torques, fine))


def _solve(text: str, name: str, store: Store, keys: tuple[str, ...]) -> Solved:
    file = _file(text, name)
    refuse_large_set(file)
    result = solved(file, store.get)
    data = set_data(file, result.solution, result.samples, result.failures)
    return Solved(figures_of(file, data), next(iter(result.failures), ""))


def _peaks(text: str, name: str, store: Store) -> Mapping[str, float]:
    file = _file(text, name)
    return peaks_of(file, train_of(file, store.get))


def figures_of(file: SetFile, data: Data) -> dict[str, float | None]:
    """Return all figures of a set at its nominal torque, from the content of its `set.json`.

    None where the file does not ask for them, or where a single planet is in no phase with another.
    """
    if file.sections.gears:
        return figures_of_train(file, data)
    orders = data["ste_harmonics_um"]
    return {
        "ste_mean_um": data["ste_mean_um"],
        "ste_peak_to_peak_um": data["ste_peak_to_peak_um"],
        "ste_peak_to_peak_worst_um": _largest(row["ste_peak_to_peak_um"] for row in data["torques"]),
        **{f"ste_order_{k + 1}_um": orders[k] if k < len(orders) else None for k in range(ORDERS)},
        "k_gamma": data["k_gamma"],
        "pin_force_max_N": _largest(planet["pin_force_max_N"] for planet in data["planets"]),
        "flank_pressure_max_MPa": _largest(mesh["flank_pressure_max_MPa"] for mesh in data["meshes"]),
        **_of_meshes(file, data),
        **_stresses(file, data),
        **_sizes(file),
    }


def _of_meshes(file: SetFile, data: Data) -> dict[str, float | None]:
    """Largest values of the meshes of each kind, and how far the next planet's meshes are behind."""
    found: dict[str, float | None] = {}
    for member, name in (("sun", "sun_planet"), ("ring", "planet_ring")):
        own = [row for row, mesh in zip(data["meshes"], file.plan.meshes, strict=True)
               if member in (file.plan.bodies[mesh.pinion].member, file.plan.bodies[mesh.wheel].member)]  # fmt: skip
        found |= {key.format(name): _largest(row[of_mesh] for row in own) for key, of_mesh in OF_MESHES.items()}
        if member == "sun" and len(own) > 1:
            found["mesh_phase_pitches"] = round(own[0]["phase_pitches"] - own[1]["phase_pitches"], DIGITS) % 1.0
    return found


def _stresses(file: SetFile, data: Data) -> dict[str, float | None]:
    """Root stress of the members, of the gear of each with the largest one: of stepped planets of either gear."""
    rows: dict[str, list[dict[str, Any]]] = {}
    for body, row in zip(file.plan.bodies, data["root_stress"], strict=False):
        rows.setdefault("planet" if body.member == SECOND_PLANET else body.member, []).append(row)
    found = {
        f"root_stress_{member}_MPa": _largest(row["max_principal_MPa"] for row in rows.get(member, []))
        for member in ("sun", "planet", "ring")
    }
    ranges = (row[key] for row in rows.get("planet", []) for key in ("range_MPa", "range_other_side_MPa"))
    return found | {"root_stress_range_planet_MPa": _largest(ranges)}


def _sizes(file: SetFile) -> dict[str, float | None]:
    """Speeds, sizes and masses."""
    load, pairs = file.sections.load, pairs_of(file)
    assert load is not None
    names = list(pairs)
    inner, outer = (pairs[name] for name in names)
    (sun, planet), (second, ring) = (gear_inertias(file.cases[name], pairs[name]) for name in names)
    if any(body.member == SECOND_PLANET for body in file.plan.bodies):
        planet += second
    tip_radius = max(inner.wheel.tip_radius, outer.pinion.tip_radius)
    planets = [file.plan.bodies[number] for number in file.plan.planets]
    return {
        "overlap_ratio": inner.overlap_ratio,
        "speed_ratio": speed_ratio(file.teeth, load.on, load.held),
        "centre_distance_mm": inner.centre_distance,
        "planets_gap_mm": plain(planets_gap_mm(planets, tip_radius)),
        "outside_diameter_mm": 2.0 * abs(held_radii(file.cases[names[1]], outer)[1]),
        "mass_kg": sun.mass_kg + len(planets) * planet.mass_kg + ring.mass_kg,
        "mass_sun_kg": sun.mass_kg,
        "mass_planet_kg": planet.mass_kg,
        "mass_ring_kg": ring.mass_kg,
    }


def peaks_of(file: SetFile, train: GearTrain) -> dict[str, float]:
    """Return the peak-to-peak STE of a set on fine angles: see `pmor.campaigns.kind`.

    Raises
    ------
    ConvergenceError
    """
    torques, few = first_torques_Nm(file), file.angles_per_pitch

    def spans(angles: int) -> FloatArray:
        return np.asarray(np.ptp(solve_set(file.plan, train, torques, angles, file.pitches).ste_um, axis=1))

    return settled_peaks(spans, few, file.torques_Nm.index(file.plan.nominal_Nm), file.pitches)


def _largest(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return max(known) if known else None


def _of_base(base: Path) -> Kind:
    """Return the kind with the keys and the figures of a train, by its gears; of sets with keys in lists."""
    _, said = read_sections(base)
    if not said.gears:
        return replace(SETS, known=known_in(said))
    return replace(SETS, gear=said.gears[0].name, known=known_of(said, KNOWN), figures=figures_in(said), first=OF_TRAIN)


SETS = Kind(
    key="set", gear="sun", sections=SetCampaign, known=KNOWN, first=FIRST, base_text=_base_text,
    figures=tuple(TABLE[key] for key in OF_SETS),
    complete=with_relations, text=text_of_design, why=why_infeasible, refuse=_refuse, cost=_cost, solve=_solve,
    peaks=_peaks, of_base=_of_base,
)  # fmt: skip
