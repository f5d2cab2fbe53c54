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
