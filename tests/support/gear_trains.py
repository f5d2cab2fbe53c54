"""Gearboxes whose gears mesh with several others, on two bearings each."""

import math

MODULE, BEND = 2.5, 0.9
BACKLASH_MM = 0.02
SHAFT = """[[shafts]]
name = "{name}"
at_mm = {place}
sections = [{{ length_mm = 80.0, outer_mm = 24.0 }}]
[[bearings]]
name = "{name} A"
shaft = "{name}"
at_mm = 10.0
axial_N_per_mm = {stiffness}
radial_N_per_mm = {stiffness}
[[bearings]]
name = "{name} B"
shaft = "{name}"
at_mm = 70.0
radial_N_per_mm = {stiffness}
"""
MESH = """[[meshes]]
name = "{pinion}-{wheel}"
pair = {{ module_mm = 2.5, face_width_mm = 16.0, helix_angle_deg = {helix} }}
mesh = {{ profile_elements = 3, width_elements = 2, element = "hex8i" }}
online = {{ angles_per_pitch = 6 }}
wheel = {{ shaft = "{wheel}", at_mm = 35.0, teeth = {teeth[1]}, {body} }}
[meshes.pinion]
shaft = "{pinion}"
at_mm = 35.0
teeth = {teeth[0]}
bore_radius_mm = 12.0
"""
BORE = "bore_radius_mm = 12.0"
TORQUE = '{{ shaft = "{0}", at_mm = 0.0, torque_Nm = {1} }}'
TEETH = {"one": 19, "two": 29, "three": 21}


def places(meshes, helix, bend, ring=False):
    """Axes of all shafts, y and z in mm: each mesh goes on from a shaft that stands, turned by an angle."""
    found = {meshes[0][0]: (0.0, 0.0)}
    for number, (pinion, wheel) in enumerate(meshes):
        known, new = (pinion, wheel) if pinion in found else (wheel, pinion)
        apart = 0.5 * MODULE * abs(TEETH[wheel] + (-1 if ring else 1) * TEETH[pinion]) / math.cos(math.radians(helix))
        apart += -BACKLASH_MM if ring else BACKLASH_MM
        y, z = found[known]
        found[new] = y + apart * math.cos(number * bend), z + apart * math.sin(number * bend)
    return found


def box(tmp_path, meshes, torques, helices=(0.0, 0.0), bend=BEND, stiffness="2e5", body=BORE, mesh=""):
    axes = places(meshes, helices[0], bend, "internal" in body)
    text = "".join(SHAFT.format(name=name, place=list(axes[name]), stiffness=stiffness) for name in axes)
    for (pinion, wheel), helix in zip(meshes, helices, strict=False):
        text += MESH.format(pinion=pinion, wheel=wheel, helix=helix, teeth=(TEETH[pinion], TEETH[wheel]), body=body)
    text = text.replace('"hex8i" }', f'"hex8i"{mesh} }}')
    listed = ", ".join(TORQUE.format(*torque) for torque in torques)
    path = tmp_path / "box.toml"
    path.write_text(f'{text}[[loads]]\nname = "drive"\ntorques = [{listed}]\n')
    return path


IDLER = (("one", "two"), ("two", "three"))
DRIVE = (("one", 60.0), ("three", '"balance"'))
SPLIT = (
    ("input", "left", (18, 54)), ("input", "right", (18, 54)), ("left", "output", (18, 72)),
    ("right", "output", (18, 72)),
)  # fmt: skip


def power_split(speeds=20):
    """Two layshafts between an input and an output on one axis, opposite each other: 18/54 and 18/72."""
    first = 0.5 * MODULE * (18 + 54) + BACKLASH_MM
    axes = {"input": (0.0, 0.0), "left": (-first, 0.0), "right": (first, 0.0), "output": (0.0, 0.0)}
    text = "".join(SHAFT.format(name=name, place=list(axes[name]), stiffness="2e5") for name in axes)
    for name in ("left", "right"):
        long = SHAFT.format(name=name, place=list(axes[name]), stiffness="2e5")
        text = text.replace(long, long.replace("80.0, outer", "160.0, outer").replace("at_mm = 70.0", "at_mm = 150.0"))
    text = text.replace('name = "output"\n', 'name = "output"\nstart_mm = 90.0\n', 1)
    for pinion, wheel, teeth in SPLIT:
        mesh = MESH.format(pinion=pinion, wheel=wheel, helix=0.0, teeth=teeth, body=BORE)
        if wheel == "output":  # the second stage has the same distance of its axes
            module = 2.0 * (first - BACKLASH_MM) / sum(teeth)
            mesh = mesh.replace("module_mm = 2.5", f"module_mm = {module}")
            mesh = mesh.replace(f'shaft = "{pinion}"\nat_mm = 35.0', f'shaft = "{pinion}"\nat_mm = 125.0')
        text += mesh
    listed = ", ".join(TORQUE.format(*torque) for torque in (("input", 120.0), ("output", '"balance"')))
    motion = f"[dynamics]\nspeeds = {speeds}\nharmonics = 3\n"
    return f'{text}{motion}[[loads]]\nname = "drive"\nspeed_rpm = 1000.0\ntorques = [{listed}]\n'
