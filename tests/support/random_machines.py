"""Random pairs, sets and gearboxes as somebody could draw them, their verdicts, and these written into their files."""

from pathlib import Path

import pmor
from pmor.case import Case
from pmor.core.errors import PmorError
from pmor.pair.model import gear_pair
from pmor.report.summary import figures
from pmor.work.online import run_online
from pmor_offline.gears import line_basis
from pmor_online.model import reduced_pair
from tests.support.gearboxes import INLINE
from tests.support.small_sets import SMALL_SET
from tests.support.toml import parsed

MESH = {"profile_elements": 4, "width_elements": 4, "error_bar": False}
UNSTRESSED = {"root_stress": False}
TEETH = ((3, 18, 18, 54), (3, 24, 18, 60), (4, 40, 20, 80), (5, 40, 20, 80))
# A torque of so much over face width and square of the pinion's diameter, N/mm2 (the K factor).
LIGHT, HEAVY = 0.5, 4.0


def random_machine(rng, kind):
    """A pair, set or gearbox that its reader takes."""
    for _ in range(200):
        try:
            machine = pmor.make(kind, **{"pair": _pair, "set": _set, "gearbox": _gearbox}[kind](rng))
            if isinstance(machine, Case):
                gear_pair(machine)  # tips may meet fillets
            return machine
        except PmorError:
            continue
    raise AssertionError("no machine in two hundred")


def solved(machine):
    """Figures of a machine as plain data, with its verdict."""
    if isinstance(machine, Case):
        found = run_online(reduced_pair(line_basis(machine)), Path(__file__))
        return figures(found) | {"contact_ratio": gear_pair(machine).contact_ratio}
    return pmor.run(machine).data


def written_into(machine, changes):
    """The machine with the changes of an advice, as its reader takes them."""
    sections = {}
    for change in changes:
        part, _, place = change["section"].rpartition(": ")
        at = sections.setdefault("meshes", {}).setdefault(part, {}) if part else sections
        for name in place.split("."):
            at = at.setdefault(name, {})
        at.update(dict.fromkeys(change["instead_of"]) | change["values"])
    return pmor.change(machine, **sections)


def figure_of(data, advice):
    """The figure of an advice in the data of a machine."""
    key, part, load = advice["figure"], advice["part"], advice["load"]
    if not isinstance(data.get("loads"), list):
        own = {mesh["name"]: mesh for mesh in data.get("meshes", ())}
        return own[part][key] if part else data[key]
    rows = {one["name"]: one for one in data["loads"]}
    chosen = [rows[load]] if load in rows else list(rows.values())
    return max(next(mesh for mesh in one["meshes"] if mesh["name"] == part)[key] for one in chosen)


def _modification(rng, module):
    """Flanks as somebody has drawn them: some fit, some do not."""
    found = {}
    if rng.random() < 0.3:
        found |= {"tip_relief_um": float(rng.uniform(1.0, 6.0) * module),
                  "tip_relief_start_percent": float(rng.uniform(45.0, 90.0))}  # fmt: skip
    if rng.random() < 0.3:
        found["helix_crowning_um"] = float(rng.uniform(1.0, 15.0))
    return found


def _pair(rng):
    module, helix = float(rng.choice([1.5, 2.0, 3.0, 5.0])), float(rng.choice([0.0, 0.0, 8.0, 15.0, 25.0]))
    teeth, width = (int(rng.integers(17, 45)), int(rng.integers(20, 75))), module * float(rng.uniform(5.0, 12.0))
    addendum = float(rng.choice([0.75, 0.9, 1.0, 1.0, 1.1]))
    gears = [{
        "teeth": count, "bore_radius_mm": 0.3 * module * count, "addendum": addendum,
        "profile_shift": round(float(rng.uniform(-0.1, 0.3)), 2),
    } for count in teeth]  # fmt: skip
    if rng.random() < 0.3:
        gears[1]["face_width_mm"] = 1.15 * width
    for gear in gears:
        if own := _modification(rng, module):
            gear["modification"] = own
    diameter = module * teeth[0]
    torque = float(1e-3 * rng.uniform(LIGHT, HEAVY) * width * diameter**2 / 2.0)
    sign = -1.0 if rng.random() < 0.15 else 1.0
    torques = sorted(sign * share * torque for share in ((0.4, 1.0) if rng.random() < 0.4 else (1.0,)))
    axes = {"out_of_plane_um": float(rng.normal(0.0, 15.0)), "in_plane_um": float(rng.normal(0.0, 15.0))}
    return {
        "load": {"torque_Nm": sign * torque}, "pair": {
            "module_mm": module, "face_width_mm": width, "helix_angle_deg": helix
        }, "pinion": gears[0], "wheel": gears[1], "mesh": MESH | {"width": "whole"}, "results": UNSTRESSED,
        "online": {"angles_per_pitch": 24, "torques_Nm": torques},
        **({"misalignment": axes} if rng.random() < 0.5 else {}),
    }  # fmt: skip


def _set(rng):
    count, *teeth = TEETH[rng.integers(len(TEETH))]
    said = parsed(SMALL_SET)
    for member, number in zip(("sun", "planet", "ring"), teeth, strict=True):
        said[member] = said[member] | {"teeth": number}
        if own := _modification(rng, 4.0):
            said[member]["modification"] = own
    pins = rng.normal(0.0, 12.0, count) * (rng.random(count) < 0.4)
    said["planets"] = {"count": count, "tangential_um": [round(float(pin), 1) for pin in pins]}
    said["load"] = {"torque_Nm": float(rng.uniform(80.0, 900.0))}
    said["supports"] = {"sun_radial_N_per_mm": [1e5, "rigid", "free"][rng.integers(3)]}
    if rng.random() < 0.4:
        said["supports"] |= {"planet_tilt_Nmm_per_rad": float(10.0 ** rng.uniform(7.0, 9.0))}
        said["carrier"] = {"windup_Nmm_per_rad": float(10.0 ** rng.uniform(8.5, 10.0))}
    said["sweep"] = {"angles_per_pitch": 12}
    return said | {"mesh": MESH | {"profile_elements": 3, "width": "whole"}, "results": UNSTRESSED}


def _gearbox(rng):
    said = parsed(INLINE)
    mesh = said["meshes"][0]
    at = float(rng.uniform(14.0, 60.0))
    for gear in ("pinion", "wheel"):
        mesh[gear]["at_mm"] = at
        if own := _modification(rng, 2.5):
            mesh[gear]["modification"] = own
    mesh["mesh"], mesh["results"] = MESH | {"profile_elements": 3}, UNSTRESSED
    for bearing in said["bearings"][:2]:
        bearing["radial_N_per_mm"] = float(10.0 ** rng.uniform(4.3, 6.0))
    torque = float(rng.uniform(15.0, 90.0))
    load = said["loads"][0]
    load["torques"][0]["torque_Nm"] = torque
    if rng.random() < 0.5:
        light = {"shaft": "input", "at_mm": 0.0, "torque_Nm": float(rng.choice([-0.6, 0.3]) * torque)}
        said["loads"].append({"name": "light", "torques": [light, load["torques"][1]]})
    return said
