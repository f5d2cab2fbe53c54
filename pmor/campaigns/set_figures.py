"""The figures of a set: those of `pmor run` of its file, to the last bit, its sizes and masses."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from pmor.campaigns.kind import PEAKS, Figure
from pmor.campaigns.peaks import settled_peaks
from pmor.core.arrays import FloatArray
from pmor.line.several import GearTrain
from pmor.pair.drawn import gear_inertias
from pmor.pair.model import held_radii
from pmor.sets.kinematics import speed_ratio
from pmor.sets.layout import SECOND_PLANET
from pmor.sets.loader import SetFile
from pmor.sets.plan import planets_gap_mm
from pmor.sets.preview import pairs_of
from pmor.sets.readings import Data, plain
from pmor.sets.run import first_torques_Nm
from pmor.sets.solution import solve_set

FIGURES = (
    Figure("ste_mean_um", "STE, mean", "um"),
    Figure("ste_peak_to_peak_um", "STE, peak-to-peak", "um"),
    Figure("ste_peak_to_peak_worst_um", "STE, peak-to-peak at the worst torque", "um"),
    Figure("ste_order_1_um", "STE, first mesh order", "um"),
    Figure("ste_order_2_um", "STE, second mesh order", "um"),
    Figure("ste_order_3_um", "STE, third mesh order", "um"),
    Figure("k_gamma", "K_γ", "1"),
    Figure("pin_force_max_N", "force on a pin, largest", "N"),
    Figure("line_load_max_sun_planet_N_per_mm", "line load, sun and planet", "N/mm"),
    Figure("line_load_max_planet_ring_N_per_mm", "line load, planet and ring", "N/mm"),
    Figure("k_h_beta_sun_planet", "K_Hβ, sun and planet", "1"),
    Figure("k_h_beta_planet_ring", "K_Hβ, planet and ring", "1"),
    Figure("root_stress_sun_MPa", "root stress, sun", "MPa"),
    Figure("root_stress_planet_MPa", "root stress, planet", "MPa"),
    Figure("root_stress_ring_MPa", "root stress, ring", "MPa"),
    Figure("root_stress_range_planet_MPa", "range of root stress, planet", "MPa"),
    Figure("contact_ratio_sun_planet", "transverse contact ratio, sun and planet", "1"),
    Figure("contact_ratio_planet_ring", "transverse contact ratio, planet and ring", "1"),
    Figure("overlap_ratio", "overlap ratio", "1"),
    Figure("speed_ratio", "ratio of speeds", "1"),
    # Of the sun; of the ring alike where planets have one gear: z_sun / count, less its whole part.
    Figure("mesh_phase_pitches", "meshes of the next planet are behind", "pitches"),
    Figure("centre_distance_mm", "centre distance", "mm"),
    Figure("planets_gap_mm", "gap between neighbouring planets", "mm"),
    Figure("outside_diameter_mm", "outside diameter of the ring", "mm"),
    Figure("mass_kg", "mass of all gears", "kg"),
    Figure("mass_sun_kg", "mass, sun", "kg"),
    Figure("mass_planet_kg", "mass, planet", "kg"),
    Figure("mass_ring_kg", "mass, ring", "kg"),
)
FIRST = (
    PEAKS[0], "mass_kg", "root_stress_sun_MPa", "root_stress_planet_MPa", "root_stress_ring_MPa", "k_gamma",
    "speed_ratio", "mesh_phase_pitches",
)  # fmt: skip
# Results of the meshes of sun and ring, and keys of a mesh in `set.json`.
OF_MESHES = {
    "line_load_max_{}_N_per_mm": "line_load_max_N_per_mm",
    "k_h_beta_{}": "k_h_beta",
    "contact_ratio_{}": "contact_ratio",
}
ORDERS = 3
DIGITS = 9


def figures_of(file: SetFile, data: Data) -> dict[str, float | None]:
    """Return all figures of a planetary set at its nominal torque, from the content of its `set.json`.

    None where the file does not ask for them, or where a single planet is in no phase with another.
    """
    orders = data["ste_harmonics_um"]
    return {
        "ste_mean_um": data["ste_mean_um"],
        "ste_peak_to_peak_um": data["ste_peak_to_peak_um"],
        "ste_peak_to_peak_worst_um": _largest(row["ste_peak_to_peak_um"] for row in data["torques"]),
        **{f"ste_order_{k + 1}_um": orders[k] if k < len(orders) else None for k in range(ORDERS)},
        "k_gamma": data["k_gamma"],
        "pin_force_max_N": _largest(planet["pin_force_max_N"] for planet in data["planets"]),
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
    """Return the peak-to-peak STE of a set on fine angles: see `pmor.campaigns.peaks`.

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
