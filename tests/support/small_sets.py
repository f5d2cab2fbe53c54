"""Small trains of gears that mesh with several others: chains and sets on coarse meshes."""

from functools import cache

import numpy as np

from pmor.line.hubs import HUB
from pmor.sets.model import SetBody, SetMesh, build_train
from tests.support.small_case import case_with

ROTATION = 5
MODULE, WIDTH = 4.0, 20.0


def line_case(pinion, wheel, helix=0.0, torque_Nm=100.0, mesh=None, **more):
    """A pair of line contact on a coarse mesh; gears by their keys, or by their tooth numbers."""
    gears = [
        {"bore_radius_mm": 0.25 * MODULE * gear, "teeth": gear} if isinstance(gear, int) else gear
        for gear in (pinion, wheel)
    ]  # fmt: skip
    mesh = {"profile_elements": 4, "width_elements": 2, "element": "hex20", "width": "half"} | (mesh or {})
    return case_with(
        pinion=gears[0], wheel=gears[1], pair={"helix_angle_deg": helix, "module_mm": MODULE, "face_width_mm": WIDTH},
        load={"torque_Nm": torque_Nm}, mesh=mesh, contact={"scheme": "line", "lodm_profile": 4},
        results={"root_stress": False}, **more,
    )  # fmt: skip


def levers_at(placed, movement):
    """Levers of the sections of a placed train, turned where corners carry, at movements (A, K): (A, N, K)."""
    joined = placed.train.joined
    ahead = joined.ahead[joined.mesh]
    further = np.maximum(movement @ ahead.T - placed.lines.corner_advance, 0.0)
    return placed.rows + (placed.lines.lever_slope * further)[..., None] * ahead


def rotations(bodies, held=()):
    """Rotations of all bodies but the held ones, as rows of the movements of a train."""
    rows = [body for body in range(bodies) if body not in held]
    free = np.zeros((len(rows), HUB * bodies))
    free[np.arange(len(rows)), HUB * np.array(rows) + ROTATION] = 1.0
    return free


def shifts(bodies, body):
    """Movements of a body along x and y."""
    free = np.zeros((2, HUB * bodies))
    free[[0, 1], [HUB * body, HUB * body + 1]] = 1.0
    return free


@cache
def chain(teeth=(21, 25, 19), helix=0.0, bend_deg=0.0, **mesh):
    """A chain of gears whose last one is held; every further axis turns the line of centres by an angle."""
    cases, bodies, meshes = {}, [], []
    x, y, direction = 0.0, 0.0, 0.0
    for number, count in enumerate(teeth):
        bodies.append(SetBody(f"{number + 1}", f"{number + 1}", x, y))
        if number + 1 < len(teeth):
            name = f"{number + 1}-{number + 2}"
            cases[name] = line_case(count, teeth[number + 1], helix, mesh=mesh)
            meshes.append(SetMesh(name, number, number + 1))
            distance = 0.5 * MODULE * (count + teeth[number + 1]) / np.cos(np.radians(helix))
            x, y = x - distance * np.sin(direction), y + distance * np.cos(direction)
            direction += np.radians(bend_deg)
    free = rotations(len(teeth), held=(len(teeth) - 1,))
    size = HUB * len(teeth)
    return cases, build_train(cases, bodies, meshes, free, np.zeros((size, size)))


# Members as in the FVA's planetary stage, with a full root of the ring; z_s + z_r = 3 x 26.
SUN, PLANET, RING = 17, 22, 61


@cache
def planetary(planets=3, floating=False, teeth=(SUN, PLANET, RING), helix=0.0, lugs=(), **mesh):
    """A set whose ring is held, seen from its carrier; the sun drives, and floats where that is asked for.

    Lugs are their number, their angle and the place of the first one, degrees.
    """
    sun, planet, ring = teeth
    inside = {"teeth": ring, "internal": True, "addendum": 0.8, "root_fillet_mm": 0.6, "rim_thickness_mm": 12.0}
    if lugs:
        inside["held"] = dict(zip(("lugs", "lug_deg", "first_deg"), lugs, strict=True))
    middle = {"teeth": planet, "bore_radius_mm": 22.0}
    cases = {
        "sun": line_case({"teeth": sun, "bore_radius_mm": 17.0}, middle, helix, mesh=mesh),
        "ring": line_case(middle, inside, helix, mesh=mesh),
    }
    distance = 0.5 * MODULE * (sun + planet) / np.cos(np.radians(helix))
    bodies, meshes = [SetBody("sun", "sun", 0.0, 0.0), SetBody("ring", "ring", 0.0, 0.0)], []
    for number in range(planets):
        angle = 2.0 * np.pi * number / planets
        bodies.append(SetBody(f"planet {number + 1}", "planet", -distance * np.sin(angle), distance * np.cos(angle)))
        meshes += [SetMesh("sun", 0, number + 2), SetMesh("ring", number + 2, 1)]
    free = rotations(len(bodies), held=(1,))
    if floating:
        free = np.concatenate([free, shifts(len(bodies), 0)])
    size = HUB * len(bodies)
    return cases, build_train(cases, bodies, meshes, free, np.zeros((size, size)))


def mean_forces(placed, found):
    """Force of each mesh at each angle, N, (A, M)."""
    return np.stack([found.force[0][:, one.part].sum(axis=1) for one in placed.placed], axis=1)


SMALL_SET = """
title = "small set"
[pair]
module_mm = 4.0
face_width_mm = 20.0
[sun]
teeth = 18
bore_radius_mm = 18.0
[planet]
teeth = 18
bore_radius_mm = 18.0
[ring]
teeth = 54
internal = true
addendum = 0.8
root_fillet_mm = 0.6
rim_thickness_mm = 12.0
[planets]
count = 3
tangential_um = [10.0, 0.0, 0.0]
[load]
torque_Nm = 300.0
[sweep]
angles_per_pitch = 6
torques_Nm = [100.0]
[mesh]
profile_elements = 3
width_elements = 2
element = "hex8i"
"""
# Of a set: half of what its finite elements cost.
NO_STRESS = "[results]\nroot_stress = false\n"

# Positions and mesh of sets, and one with all that a file of another program says of a set.
SOLVED_SET = """[mesh]
profile_elements = 3
width_elements = 2
element = "hex8i"
[results]
root_stress = false
[sweep]
angles_per_pitch = 6"""
MODIFIED_SET = f"""
title = "small set"
[pair]
module_mm = 4.0
face_width_mm = 20.0
helix_angle_deg = 10.0
[sun]
teeth = 18
bore_radius_mm = 18.0
[sun.modification]
tip_relief_um = 15.0
tip_relief_length_mm = 1.5
[planet]
teeth = 18
bore_radius_mm = 18.0
[planet.modification]
helix_crowning_um = 4.0
[planet.coast_modification]
tip_relief_um = 10.0
tip_relief_length_mm = 1.5
[ring]
teeth = 54
internal = true
addendum = 0.8
shaper = {{teeth = 24, addendum = 1.25}}
rim_thickness_mm = 12.0
[ring.coast_modification]
profile_crowning_um = 3.0
[planets]
count = 3
radial_um = [0.0, 5.0, 0.0]
tangential_um = [10.0, 0.0, 0.0]
[supports]
sun_radial_N_per_mm = 2e5
[pins]
diameter_mm = 30.0
length_mm = 30.0
middle_mm = 1.0
bearings = [{{at_mm = -6.0}}, {{at_mm = 6.0, radial_N_per_mm = 1e6}}]
[load]
torque_Nm = 300.0
speed_rpm = 1500.0
{SOLVED_SET}
torques_Nm = [100.0]
"""

SMALL_CHAIN = """
[pair]
module_mm = 4.0
face_width_mm = 20.0
[[gears]]
name = "input"
at_mm = [0.0, 0.0]
torque_Nm = 100.0
[[gears]]
name = "idler"
at_mm = [0.0, 92.0]
[[gears]]
name = "output"
at_mm = [88.0, 92.0]
torque_Nm = "balance"
[[meshes]]
gears = ["input", "idler"]
[[meshes]]
gears = ["idler", "output"]
[input]
teeth = 21
bore_radius_mm = 21.0
[idler]
teeth = 25
bore_radius_mm = 25.0
[output]
teeth = 19
bore_radius_mm = 19.0
[sweep]
angles_per_pitch = 6
[mesh]
profile_elements = 3
width_elements = 2
element = "hex8i"
"""


def written_set(folder, text=SMALL_SET):
    """Write a set file, and return its path."""
    path = folder / "small.toml"
    path.write_text(text)
    return path


# Of flanks of all members, of planets on both sides.
SMALL_DESIGN = """
title = "small design"
set = "small.toml"
[[variables]]
key = "tip_relief_um"
gear = "sun"
range = [0.0, 20.0]
step = 0.5
[[variables]]
key = "tip_relief_start_percent"
gear = "sun"
range = [60.0, 90.0]
[[variables]]
key = "profile_crowning_um"
gear = "planet"
flank = "coast"
range = [0.0, 6.0]
[[variables]]
key = "helix_crowning_um"
gear = "planet"
range = [0.0, 4.0]
[load]
torques_Nm = [300.0]
[search]
samples = 8
descents = 1
angles = 8
[pareto]
points = 0
"""


def written_design(folder, text=SMALL_DESIGN, base=SMALL_SET):
    """Write a design of a set beside its set file, and return its path."""
    written_set(folder, base)
    path = folder / "design.toml"
    path.write_text(text)
    return path
