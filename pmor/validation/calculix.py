"""Transmission error and root stress beside those that CalculiX gave: whole rings on meshes that resolve the contact.

Figures of CalculiX 2.20, minutes each. `tests/verification` makes them anew, and tells mesh and penalty.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from pmor.body.elastic_gear import ElasticGear, elastic_gear
from pmor.case import Case, make_case
from pmor.core.arrays import FloatArray
from pmor.fe.element import tributary_widths
from pmor.fe.fillet import build_fillet
from pmor.fe.sector import build_sector
from pmor.gear.tooth import Tooth
from pmor.pair.model import ElasticModel
from pmor.results.root_stress import arc_lengths
from pmor.validation.check import Check
from pmor.validation.machines import after_entry, drawn, full, ste_um
from pmor.validation.sheets import PAPER

#: width of the pairs that torques are named for, mm; 1 mm of it is solved in plane strain
WIDTH = 20.0
PLANE: dict[str, dict[str, Any]] = {
    "paper": {"module_mm": 4.0, "teeth": 21, "bore_radius_mm": 20.0},
    "unequal": {
        "module_mm": 2.5, "pinion": {"teeth": 17, "profile_shift": 0.3, "bore_radius_mm": 10.0},
        "wheel": {"teeth": 40, "bore_radius_mm": 30.0},
    },
    "undercut": {
        "module_mm": 4.0, "pinion": {"teeth": 12, "bore_radius_mm": 8.0},
        "wheel": {"teeth": 40, "bore_radius_mm": 62.0},
    },
    "internal": {
        "module_mm": 3.0, "pinion": {"teeth": 19, "profile_shift": 0.2, "bore_radius_mm": 16.0},
        "wheel": {
            "teeth": 50, "internal": True, "profile_shift": -0.1, "addendum": 0.8, "rim_thickness_mm": 7.0,
            "shaper": {"teeth": 20, "addendum": 1.25, "tip_radius_mm": 0.6},
        },
    },
}  # fmt: skip
# Pair, torque on 20 mm (N m), pitches since a tooth pair came into mesh, STE (um): two pairs in mesh, twice, and one.
INSIDE = [
    ("paper", 100.0, 0.12, 6.2340), ("paper", 100.0, 0.45, 6.2347), ("paper", 100.0, 0.75, 9.2986),
    ("unequal", 30.0, 0.15, 3.3823), ("unequal", 30.0, 0.45, 3.4123), ("unequal", 30.0, 0.75, 5.0407),
    ("internal", 60.0, 0.15, 3.6718), ("internal", 60.0, 0.45, 3.7421), ("internal", 60.0, 0.75, 5.7932),
]  # fmt: skip
# Pair, torque, where a tip corner carries, angle of the pinion beyond the path of contact (rad), STE (um).
CORNERS = [
    ("paper", 100.0, "entry", 0.003, 6.832), ("paper", 100.0, "exit", 0.003, 6.863),
    ("paper", 300.0, "entry", 0.003, 19.228), ("paper", 300.0, "exit", 0.003, 19.328),
    ("unequal", 30.0, "entry", 0.004, 3.716), ("unequal", 30.0, "exit", 0.004, 3.705),
    ("unequal", 90.0, "entry", 0.004, 10.436), ("unequal", 90.0, "exit", 0.004, 10.445),
    ("internal", 60.0, "entry", 0.003, 3.945), ("internal", 60.0, "exit", 0.003, 3.9758),
]  # fmt: skip
# Undercut pair, 50 N m: pitches since entry, length of CalculiX's elements there (mm), STE (um): contact at the edge of
# the undercut, and on the flank beside it.
UNDERCUT = [(-0.06, 0.003, 6.1055), (0.1, 0.012, 5.6591)]
# Contact in a ring is wider: 0.13 mm half-wide where the layer is 1.2 mm deep.
INSIDE_RTOL, RING_RTOL, CORNER_RTOL = 1.5e-3, 3e-3, 1e-2
# Root stress of the paper's gear, 100 N m as one line load at the outer point of single contact, MPa.
PLANE_MPA, PLANE_RADIUS_MM, PLANE_PRESSED_MPA, SOLID_MPA = 86.84, 37.614, -103.08, 91.40
PLANE_RTOL, SOLID_RTOL = 5e-3, 1e-2


@cache
def plane(name: str) -> tuple[Case, ElasticModel]:
    """Return one of `PLANE` under 1 N m and its full FE, in plane strain on 16 elements over the profile."""
    mesh = {"element": "hex20", "profile_elements": 16, "width_elements": 1, "width": "plane_strain"}
    case = make_case(name, **PLANE[name], face_width_mm=1.0, torque_Nm=1.0, mesh=mesh)
    return case, full(case)


def plane_ste_um(name: str, torque_Nm: float, phi: float) -> float:
    """Return the transmission error of one of `PLANE` under a torque on the whole width."""
    case, model = plane(name)
    return ste_um(replace(case, torque_Nm=torque_Nm / WIDTH), model, phi)


def inside_rtol(name: str) -> float:
    """Return how near the transmission error of one of `PLANE` is to CalculiX between the tips."""
    return RING_RTOL if name == "internal" else INSIDE_RTOL


def corner_angle(name: str, end: str, beyond: float) -> float:
    """Return the pinion angle so much before the entry or beyond the exit of a tooth pair, rad."""
    start, stop = plane(name)[1].mesh.meshed.pair.roll_position_range
    return start - beyond if end == "entry" else stop + beyond


def transmission_error() -> list[Check]:
    """Return the checks in plane strain."""
    source = "CalculiX, plane strain"
    checks = [
        Check(f"STE, {name} pair, {torque:g} N m, {share:g} pitches after entry", "µm", theirs,
              plane_ste_um(name, torque, after_entry(plane(name)[1].mesh.meshed.pair, share)), source,
              inside_rtol(name))
        for name, torque, share, theirs in INSIDE
    ]  # fmt: skip
    checks += [
        Check(f"STE, {name} pair, {torque:g} N m, tip corner at {end}", "µm", theirs,
              plane_ste_um(name, torque, corner_angle(name, end, beyond)), source, CORNER_RTOL)
        for name, torque, end, beyond, theirs in CORNERS
    ]  # fmt: skip
    return checks + [
        Check(f"STE, 12/40 teeth, {'edge of the undercut' if share < 0 else 'flank beside the undercut'}", "µm", theirs,
              plane_ste_um("undercut", 50.0, after_entry(plane("undercut")[1].mesh.meshed.pair, share)), source,
              CORNER_RTOL)
        for share, _, theirs in UNDERCUT
    ]  # fmt: skip


def highest_point() -> tuple[float, float]:
    """Return the pinion's roll angle at the outer point of single contact (rad), and 100 N m there, N/mm."""
    pair = drawn(PAPER)
    roll = float(pair.contact_roll_angles(np.array(after_entry(pair, 1.0)))[0])
    return roll, 1e5 / pair.pinion.base_radius / WIDTH


def loaded_gear(
    tooth: Tooth, *, elements: int = 8, across: int = 2, width: Any = "plane_strain", face: float = 1.0
) -> ElasticGear:
    """Return a gear with the fine mesh of its fillets."""
    mesh = build_sector(tooth, 20.0, face, elements, across, "arc_length", width=width, order=2)
    return elastic_gear(mesh, 210_000.0, 0.3, "hex20", 1, False, fillet=build_fillet(tooth, mesh))


def root_stress_at_highest_point(body: ElasticGear, tooth: Tooth) -> tuple[float, float, float]:
    """Return the largest principal stress of the loaded side (MPa), its radius (mm), and the least of the other."""
    assert body.fillet is not None
    own = np.asarray(body.fillet.shapes[1] @ line_load(body, tooth))
    along, over, shear = np.moveaxis(own, -1, 0)
    spread = np.hypot(0.5 * (along - over), shear)
    largest, least = 0.5 * (along + over) + spread, 0.5 * (along + over) - spread
    section, column = body.fillet.points.section, int(largest[0].max(axis=0).argmax())
    place = int(np.clip(largest[0, :, column].argmax(), 1, len(section) - 2))
    near, arc = slice(place - 1, place + 2), arc_lengths(section)
    bend, slope, _ = parabola = np.polyfit(arc[near], largest[0, near, column], 2)
    top = -0.5 * slope / bend
    radius = np.interp(top, arc, np.linalg.norm(section, axis=1))
    return float(np.polyval(parabola, top)), float(radius), float(least[1].min())


def root_stress() -> list[Check]:
    """Return the checks of the stress in the root fillet."""
    tooth = drawn(PAPER).pinion
    peak, _, pressed = root_stress_at_highest_point(loaded_gear(tooth), tooth)
    solid, *_ = root_stress_at_highest_point(loaded_gear(tooth, width="half", across=4, face=WIDTH), tooth)
    words = "root stress, paper's gear, 100 N m at the HPSTC"
    return [
        Check(f"{words}, tension", "MPa", PLANE_MPA, peak, "CalculiX, plane strain", PLANE_RTOL),
        Check(f"{words}, compression", "MPa", PLANE_PRESSED_MPA, pressed, "CalculiX, plane strain", PLANE_RTOL),
        Check(f"{words}, mid width", "MPa", SOLID_MPA, solid, "CalculiX, 3-D", SOLID_RTOL),
    ]


def line_load(body: ElasticGear, tooth: Tooth) -> FloatArray:
    """Return the forces on the nodes of a flank that the line load amounts to, by the cubic through four rows, N."""
    mesh, (highest, load) = body.mesh, highest_point()
    u = mesh.flank_roll_angle
    first = int(np.clip(np.searchsorted(u, highest) - 2, 0, len(u) - 4))
    near = u[first : first + 4]
    share = [math.prod((highest - b) / (a - b) for b in near if b != a) for a in near]
    width = tributary_widths(mesh.z, mesh.order) * (2.0 if mesh.mirrored else 1.0)
    force = np.zeros((*mesh.flank.shape, 3))
    normal = tooth.flank_normal(np.array(highest), np.array(0.0))
    force[first : first + 4] = -load * np.multiply.outer(np.outer(share, width), normal)
    return force.ravel()
