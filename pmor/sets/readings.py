"""Numbers of a solved set: the content of `set.json`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from pmor.body.bearing_readings import pin_bearing_data
from pmor.case.capability import left_out
from pmor.case.duty import Lubricant, shares
from pmor.pair.losses import duty_data, mesh_losses, per_second, total
from pmor.pair.samples import Samples, sample_bounds, sample_data
from pmor.report.data_files import plain_data
from pmor.sets.bounds import named_bounds
from pmor.sets.kinematics import member_speeds
from pmor.sets.loader import SetFile
from pmor.sets.lost import known
from pmor.sets.plan import SetPlan
from pmor.sets.root_stress import GearStress
from pmor.sets.solution import SetSolution
from pmor.sets.tolerances import sampled_figures

Data = dict[str, Any]
ORDERS = 10
# Of the transmission error: what rounding leaves of its orders.
ROUND_OFF = 1e-9
# Orders of two meshes whose sums and differences are named.
MOST_COMBINED = 8
# Of slopes in mrad: rounding leaves less of planets that do not tilt.
TILT_DIGITS = 9
MINERAL_OIL = Lubricant()


def set_data(file: SetFile, solved: SetSolution, samples: Samples | None, failures: tuple[str, ...]) -> Data:
    """Return the content of `set.json`, without a verdict: top values are those of the nominal torque."""
    nominal = int(np.argmin(np.abs(solved.torque_Nm - file.plan.torque_Nm)))
    speeds = speeds_rpm(file)
    rows = [
        torque_data(file, solved, number, speeds, file.sections.lubricant) for number in range(len(solved.torque_Nm))
    ]
    return {
        "title": file.sections.title,
        "verdict": None,
        **rows[nominal],
        "speeds_rpm": speeds,
        "mesh_frequency_Hz": None if speeds is None else mesh_frequency_Hz(file.teeth[0], speeds),
        "angles_per_pitch": solved.angles_per_pitch,
        "pitches": solved.pitches,
        "phi_rad": solved.phi_rad.tolist(),
        "torques": rows,
        "duty": duty_data(file.sections.loads, duty_entries(file, solved)),
        "tolerances": None if samples is None else sample_data(
            samples, sampled_figures(solved), [row["torque_Nm"] for row in rows]
        ),
        "failures": list(failures),
        "bounds": [*bounds(file, solved, samples), *file.slips, *file.rounded],
        "changed": list(file.changed),
        "left_out": [f"{what}: {why}" for what, why in left_out(file)],
        "assumptions": list(file.notes),
    }


def speeds_rpm(file: SetFile, own_rpm: float | None = None) -> dict[str, float] | None:
    """Return the speeds of the members of a planetary set, of a load with its own one too; None where none is given."""
    load = file.sections.load
    rpm = None if load is None else own_rpm or load.speed_rpm
    return None if load is None or rpm is None else member_speeds(file.teeth, load.on, load.held, rpm)


def duty_entries(file: SetFile, solved: SetSolution) -> list[Data]:
    """Return the loads of the duty cycle of a set as `duty_data` takes them; fewer where one did not converge."""
    found = []
    for load in file.sections.loads if shares(file.sections.loads) else ():
        number, speeds = file.torques_Nm.index(load.torque_Nm), speeds_rpm(file, load.speed_rpm)
        if solved.converged[number].all():
            row = torque_data(file, solved, number, speeds, file.sections.lubricant)
            on = None if speeds is None or file.sections.load is None else speeds[file.sections.load.on]
            power = None if on is None else load.torque_Nm * per_second(abs(on))
            meshes = spectrum_rows(solved, row, speeds)
            found.append({**row, "power_W": power, "meshes": meshes})
    return found


def spectrum_rows(solved: SetSolution, row: Data, speeds: Mapping[str, float] | None) -> list[Data]:
    """Return the meshes of a set under a torque, with what a duty cycle lists; speeds are against the carrier."""
    stress, rates, found = [gear["max_principal_MPa"] for gear in row["root_stress"]], solved.train.rates, list[Data]()
    for mesh, entry in zip(solved.train.meshes, row["meshes"], strict=True):
        turns = [None if speeds is None else (speeds["sun"] - speeds["carrier"]) * rates[n] for n in mesh.bodies]
        found.append({
            **entry, "torque_Nm": entry["pinion_torque_Nm"], "pinion_rpm": turns[0], "wheel_rpm": turns[1],
            "root_stress_max_MPa": [stress[body] for body in mesh.bodies] if stress else None,
        })  # fmt: skip
    return found


def bounds(file: SetFile, solved: SetSolution, samples: Samples | None) -> list[str]:
    """Return what leaves the bounds of the equations under each torque, samples within tolerances included."""
    torques = (solved.torque_Nm * file.plan.nominal_Nm / file.plan.torque_Nm).tolist()
    of_samples = () if samples is None else sample_bounds(samples, torques)
    return [*named_bounds(file, solved, torques), *of_samples]


def mesh_frequency_Hz(sun_teeth: float, speeds_rpm: Mapping[str, float]) -> float:
    """Return the frequency of the meshes of a planetary set by the speeds of sun and carrier."""
    return sun_teeth * abs(speeds_rpm["sun"] - speeds_rpm["carrier"]) / 60.0


def torque_data(
    file: SetFile, solved: SetSolution, number: int, speeds_rpm: Mapping[str, float] | None = None,
    lubricant: Lubricant = MINERAL_OIL,
) -> Data:  # fmt: skip
    """Return the figures of a set under a torque by its number; losses where its members have speeds."""
    ste, plan = solved.ste_um[number], file.plan
    meshes = [_mesh_data(solved, number, mesh, speeds_rpm, lubricant) for mesh in range(len(plan.meshes))]
    data: Data = {
        "torque_Nm": solved.torque_Nm[number] * plan.nominal_Nm / plan.torque_Nm,
        "first_gear_torque_Nm": solved.torque_Nm[number],
        "ste_mean_um": known(np.mean, ste),
        "ste_peak_to_peak_um": known(np.ptp, ste),
        "ste_mesh_error_percent": None if (error := solved.mesh_error_percent) is None else error[number],
        "ste_harmonics_um": solved.mesh_orders(number)[:ORDERS],
        "shaft_orders": shaft_orders(solved, number),
        "ste_um": ste,
        "k_gamma": solved.k_gamma[number],
        "planets": [_planet_data(solved, number, place, speeds_rpm) for place in range(len(plan.planets))],
        "meshes": meshes,
        "losses_W": total(meshes, "losses_W"),
        "root_stress": [_stress_data(solved, number, body) for body in range(len(solved.root_stress))],
    }
    if (ring := solved.ring_deflection) is not None:
        moved = ring.displacement_um[number]
        data["ring"] = {
            "radial_most_um": ring.most_um[number], "radial_least_um": ring.least_um[number],
            "place_deg": ring.place_deg, "radial_um": moved[:, 0], "around_um": moved[:, 1],
        }  # fmt: skip
    if plan.planets:
        wound = file.sections.carrier.windup_Nmm_per_rad != "rigid"
        data["carrier_windup_mrad"] = 1e3 * known(np.mean, solved.windup_rad[number]) if wound else None
        data["sun_orbit_um"] = 1e3 * solved.hub_displacement[number, :, 0, :2]
    return dict(plain_data(data))


def shaft_orders(solved: SetSolution, number: int) -> list[Data]:
    """Largest orders between those of the first mesh, with how often they are in a turn of each member.

    Members turn against the carrier. `per_cycle` has it for the cycles of meshes that differ from the first one's, and
    `combined` is `combined_orders`. None over a single mesh cycle, where meshes do not stand as before at the end, or a
    position is missing.
    """
    amplitude, pitches, plan = solved.ste_orders(number).amplitude, solved.pitches, solved.plan
    if pitches == 1 or not solved.repeats or not np.isfinite(amplitude).all():
        return []
    there = amplitude > ROUND_OFF * np.abs(solved.ste_um[number]).max()
    between = np.flatnonzero(there & ((np.arange(len(amplitude)) + 1) % pitches > 0))
    largest = between[np.argsort(-amplitude[between], kind="stable")[:ORDERS]]
    turns = {
        body.member: pitches * plan.rate_of(place) / gear.teeth
        for place, (body, gear) in enumerate(zip(plan.bodies, solved.train.bodies, strict=True))
    }
    cycles = {mesh.case: rate for mesh, rate in zip(plan.meshes, plan.rates, strict=True) if rate != 1}
    return [
        {
            "mesh_order": (place + 1) / pitches,
            "amplitude_um": amplitude[place],
            "per_turn": {member: float((place + 1) / times) for member, times in turns.items()},
            "per_cycle": {mesh: float((place + 1) / (pitches * rate)) for mesh, rate in cycles.items()},
            "combined": combined_orders(plan, Fraction(place + 1, pitches)),
        }
        for place in largest.tolist()
    ]


def combined_orders(plan: SetPlan, order: Fraction) -> dict[str, int]:
    """Return the lowest orders of the first mesh and of another one that add up to one, by cases; none of higher ones.

    Two meshes of different cycles have sums and differences of their orders in common, as each is softer or stiffer
    while the other one passes.
    """
    found, first = list[dict[str, int]](), plan.meshes[0].case
    for mesh, rate in zip(plan.meshes, plan.rates, strict=True):
        for times in range(-MOST_COMBINED, MOST_COMBINED + 1):
            rest = order - times * rate
            if rate != 1 and times and rest.denominator == 1 and 0 < abs(rest) <= MOST_COMBINED:
                found.append({first: int(rest), mesh.case: times})
    return min(found, key=lambda both: sum(map(abs, both.values())), default={})


def _planet_data(
    solved: SetSolution, number: int, place: int, speeds_rpm: Mapping[str, float] | None
) -> Data:  # fmt: skip
    share, force = solved.planet_share[number, :, place], solved.pin_force_N[number, :, place]
    moved, tilt = (
        1e3 * np.array([known(np.mean, along) for along in values[number, :, place].T])
        for values in (solved.planet_displacement_mm, solved.planet_tilt_rad)
    )
    return {
        "name": solved.plan.bodies[solved.plan.planets[place]].name,
        "share_mean": known(np.mean, share),
        "share_max": known(np.max, share),
        "share": share,
        "pin_force_mean_N": known(np.mean, force),
        "pin_force_max_N": known(np.max, force),
        "outwards_um": moved[0],
        "around_um": moved[1],
        "outwards_tilt_mrad": round(tilt[0], TILT_DIGITS) + 0.0,
        "around_tilt_mrad": round(tilt[1], TILT_DIGITS) + 0.0,
        "bearings": _bearing_data(solved, number, place, speeds_rpm),
    }


def _bearing_data(
    solved: SetSolution, number: int, place: int, speeds_rpm: Mapping[str, float] | None
) -> list[Data]:  # fmt: skip
    """Data of the bearings of a planet on its pin; elements and life of them under the mean loads."""
    on_pins = solved.plan.on_pins
    assert on_pins is not None
    loads = solved.bearing_loads[number, :, place]
    forces, moments = np.linalg.norm(loads[..., :2], axis=2).T, np.linalg.norm(loads[..., 2:], axis=2).T
    mean = loads[solved.left(number)].mean(axis=0, keepdims=True)
    body = solved.plan.planets[place]
    planet, rpm = solved.plan.bodies[body], None
    if speeds_rpm is not None:
        rpm = (speeds_rpm["sun"] - speeds_rpm["carrier"]) * float(solved.train.rates[body])
    rolling = pin_bearing_data(on_pins.rolling, mean, math.atan2(planet.y, planet.x), rpm) or [{}] * len(forces)
    return [
        {
            "at_mm": at, "force_mean_N": known(np.mean, force), "force_max_N": known(np.max, force),
            "moment_max_Nm": 1e-3 * known(np.max, moment), **elements,
        }
        for at, force, moment, elements in zip(on_pins.pin.bearings_mm, forces, moments, rolling, strict=True)
    ]  # fmt: skip


def _mesh_data(
    solved: SetSolution, number: int, mesh: int, speeds_rpm: Mapping[str, float] | None, lubricant: Lubricant
) -> Data:
    one, force = solved.train.meshes[mesh], solved.mesh_force_N[number, :, mesh]
    pair, radius, figures = one.pair.meshed.pair, one.pair.base_radius, solved.mesh_figures[mesh]
    factor, mean, rpm = figures["loss_factor"][number], known(np.mean, force), None
    if speeds_rpm is not None:
        rpm = abs(speeds_rpm["sun"] - speeds_rpm["carrier"]) * abs(float(solved.train.rates[one.bodies[0]]))
    return {
        "name": " - ".join(solved.train.bodies[body].name for body in one.bodies),
        "contact_ratio": pair.contact_ratio,
        "cycles_per_pitch": float(solved.plan.rates[mesh]),
        "phase_pitches": round(one.start / pair.pitch, 9) % 1.0,
        "share_mean": known(np.mean, solved.mesh_share[number, :, mesh]),
        "share_max": known(np.max, solved.mesh_share[number, :, mesh]),
        "force_mean_N": mean,
        "force_peak_to_peak_N": known(np.ptp, force),
        "pinion_torque_Nm": 1e-3 * radius * mean,
        "wheel_torque_Nm": 1e-3 * abs(pair.wheel.base_radius) * mean,
        **{key: values[number] for key, values in figures.items()},
        **mesh_losses(pair, float(factor), mean, rpm, lubricant),
    }


def _stress_data(solved: SetSolution, number: int, body: int) -> Data:
    found = solved.root_stress[body]
    top = int(np.argmax(np.nan_to_num(found.max_principal_MPa[number])))
    side = int(found.side[number, top])
    return {
        "name": solved.plan.bodies[body].name,
        "max_principal_MPa": found.max_principal_MPa[number, top],
        "loaded_by": loaded_by(solved, body, side),
        "radius_mm": found.radius_mm[number, top],
        "z_mm": found.z_mm[number, top],
        **_range_data(found, number, side, "range"),
        **_range_data(found, number, 1 - side, "range_other_side"),
    }


def _range_data(found: GearStress, number: int, side: int, name: str) -> Data:
    """Range on a side of the tooth where it is largest there, its limits and its place."""
    cycle, at = found.cycle, (number, found.worst_tooth(number, side), side)
    return {
        f"{name}_MPa": cycle.range_MPa[at],
        f"{name}_most_MPa": cycle.most_MPa[at],
        f"{name}_least_MPa": cycle.least_MPa[at],
        f"{name}_radius_mm": cycle.radius_mm[at],
        f"{name}_z_mm": cycle.z_mm[at],
    }


def loaded_by(solved: SetSolution, body: int, side: int) -> str | None:
    """Return the member whose teeth press on the flanks of a side of a body's teeth; None where there is none."""
    mates = solved.root_stress[body].mates[side]
    return "/".join(dict.fromkeys(solved.plan.bodies[mate].member for mate in mates)) or None


def plain(value: Any) -> float | None:
    """Return a number as JSON has it; None where it is not known."""
    number = float(value)
    return number if math.isfinite(number) else None
