"""Gearboxes for tests: the two stages of the box that the FVA publishes as an example of REXS, and a small one."""

import math

from pmor.case import parse_case
from pmor.machine.load_settings import LoadCase, ShaftTorque
from pmor.machine.loader import GearboxFile
from pmor.machine.model import GearboxModel
from pmor.machine.settings import Bearing, GearboxSections, GearPlace, Mesh, Shaft, ShaftSection
from pmor.pair.model import gear_pair

FVA_CASE = """
[load]
torque_Nm = 500.0
[pair]
module_mm = {module}
helix_angle_deg = {helix}
face_width_mm = {width}
centre_distance_mm = 190.0
[pinion]
teeth = {teeth[0]}
profile_shift = {shift}
bore_radius_mm = 26.0
[wheel]
teeth = {teeth[1]}
profile_shift = {shift}
bore_radius_mm = 45.0
[mesh]
width = "whole"
error_bar = false
profile_elements = 4
width_elements = 2
"""
SMALL_CASE = """
[load]
torque_Nm = 60.0
[pair]
module_mm = 2.5
face_width_mm = 16.0
helix_angle_deg = 15.0
[pinion]
teeth = 19
bore_radius_mm = 10.0
[wheel]
teeth = 29
bore_radius_mm = 14.0
[mesh]
profile_elements = 3
width_elements = 2
element = "hex8i"
[online]
angles_per_pitch = 12
"""
SMALL = """
title = "Small box"
[[shafts]]
name = "input"
sections = [{ length_mm = 80.0, outer_mm = 20.0 }]
[[shafts]]
name = "output"
at_mm = [62.2, 0.0]
sections = [{ length_mm = 80.0, outer_mm = 28.0, inner_mm = 8.0 }]
[[bearings]]
name = "A"
shaft = "input"
at_mm = 10.0
axial_N_per_mm = 1e5
radial_N_per_mm = 2e5
[[bearings]]
name = "B"
shaft = "input"
at_mm = 70.0
radial_N_per_mm = 2e5
[[bearings]]
name = "C"
shaft = "output"
at_mm = 10.0
ball = { balls = 9, ball_diameter_mm = 9.0, pitch_diameter_mm = 44.0, clearance_mm = 0.005 }
[[bearings]]
name = "D"
shaft = "output"
at_mm = 70.0
roller = { rollers = 12, roller_diameter_mm = 7.0, effective_length_mm = 9.0, pitch_diameter_mm = 42.0 }
[[meshes]]
name = "mesh"
case = "small.toml"
pinion = { shaft = "input", at_mm = 35.0 }
wheel = { shaft = "output", at_mm = 35.0 }
[[loads]]
name = "drive"
torques = [
    { shaft = "input", at_mm = 0.0, torque_Nm = 60.0 },
    { shaft = "output", at_mm = 80.0, torque_Nm = "balance" },
]
"""


# The small box with its case inside.
INLINE = SMALL.replace(
    """case = "small.toml"
pinion = { shaft = "input", at_mm = 35.0 }
wheel = { shaft = "output", at_mm = 35.0 }
""",
    """pair = { module_mm = 2.5, face_width_mm = 16.0, helix_angle_deg = 15.0 }
mesh = { profile_elements = 3, width_elements = 2, element = "hex8i" }
online = { angles_per_pitch = 12 }
[meshes.pinion]
shaft = "input"
at_mm = 35.0
teeth = 19
bore_radius_mm = 10.0
[meshes.wheel]
shaft = "output"
at_mm = 35.0
teeth = 29
bore_radius_mm = 14.0
""",
)


def written(folder, text=SMALL):
    """Write the small gearbox and its case into a folder."""
    (folder / "small.toml").write_text(SMALL_CASE)
    path = folder / "box.toml"
    path.write_text(text)
    return path


def fva_box(radial="rigid", axial="rigid", tilt="free"):
    """The two-stage box with bearings of one stiffness; `tilt` holds for those that its file has as concepts."""
    cases = {
        "high speed": FVA_CASE.format(module=4.5, helix=21.0, width=50.0, teeth=(27, 51), shift=0.231),
        "low speed": FVA_CASE.format(module=6.5, helix=-10.0, width=74.0, teeth=(23, 34), shift=0.13),
    }
    read = {name: parse_case(text, name, name) for name, text in cases.items()}
    sections = GearboxSections(
        title="FVA",
        shafts=(
            _shaft("in", 0.0, -70.0, (80, 50, 0), (80, 60, 0), (30, 50, 0)),
            _shaft("mid", -190.0, -25.0, (45, 80, 0), (60, 90, 0), (165, 80, 0)),
            _shaft("out", 0.0, 90.0, (31, 70, 58), (82, 70, 0), (10, 80, 0), (100, 60, 0)),
        ),
        bearings=(
            Bearing(name="1", shaft="in", at_mm=65.0, radial_N_per_mm=radial, axial_N_per_mm=axial),
            Bearing(name="2", shaft="in", to="out", at_mm=175.0, radial_N_per_mm=radial, tilt_Nmm_per_rad=tilt),
            Bearing(
                name="3", shaft="mid", at_mm=20.0, radial_N_per_mm=radial, axial_N_per_mm=axial, tilt_Nmm_per_rad=tilt
            ),
            Bearing(name="4", shaft="mid", at_mm=250.0, radial_N_per_mm=radial, tilt_Nmm_per_rad=tilt),
            Bearing(name="5", shaft="out", at_mm=13.0, radial_N_per_mm=radial, axial_N_per_mm=axial),
            Bearing(name="6", shaft="out", at_mm=140.0, radial_N_per_mm=radial),
        ),
        meshes=(_mesh("high speed", ("in", 117.0), ("mid", 72.0)), _mesh("low speed", ("mid", 180.0), ("out", 65.0))),
        loads=(drive("500 N m", 500.0),),
    )
    model = GearboxModel(sections, {name: gear_pair(case) for name, case in read.items()})
    return GearboxFile("fva", "", model, read, ())


def drive(name, torque_Nm):
    """A torque on the input, held by the output."""
    return LoadCase(
        name=name,
        torques=(
            ShaftTorque(shaft="in", at_mm=0.0, torque_Nm=torque_Nm),
            ShaftTorque(shaft="out", at_mm=170.0, torque_Nm="balance"),
        ),
    )


def _shaft(name, z, start, *sections):
    parts = tuple(ShaftSection(length_mm=length, outer_mm=outer, inner_mm=inner) for length, outer, inner in sections)
    return Shaft(name=name, at_mm=(0.0, z), start_mm=start, sections=parts)


def _mesh(name, pinion, wheel):
    places = [GearPlace(shaft=shaft, at_mm=place) for shaft, place in (pinion, wheel)]
    return Mesh(name=name, case=f"{name}.toml", pinion=places[0], wheel=places[1], changes={})


# A pinion out of the middle, on soft bearings: its flanks stand 20 um askew under the larger load.
ASKEW = SMALL.replace("2e5", "2e4").replace("at_mm = 35.0", "at_mm = 15.0")
ASKEW += ASKEW[ASKEW.index("[[loads]]") :].replace('"drive"', '"light"').replace("60.0", "20.0")
DESIGN = """
gearbox = "box.toml"
mesh = "mesh"
[[variables]]
key = "helix_slope_um"
gear = "pinion"
range = [-20.0, 60.0]
[[variables]]
key = "helix_crowning_um"
gear = "pinion"
range = [0.0, 20.0]
[load]
weights = [1.0, 2.0]
[search]
samples = 32
descents = 1
angles = 12
[pareto]
points = 0
"""


def written_design(folder, text=DESIGN, box=ASKEW):
    """Write a design of helix slope and crowning of the small gearbox."""
    written(folder, box)
    (folder / "small.toml").write_text(f"{SMALL_CASE}[results]\nroot_stress = false\n")
    path = folder / "design.toml"
    path.write_text(text)
    return path


# A mass on the input shaft of the small boxes, out of balance.
MOTOR = """
[[masses]]
name = "motor"
shaft = "input"
at_mm = 5.0
mass_kg = 0.4
polar_inertia_kg_m2 = 4e-4
tilting_inertia_kg_m2 = 3e-4
unbalance_kg_mm = 0.02
"""
# Two stages on the small shafts, meshes by the helix angles of both, with loads and settings of motion to follow.
TWO_STAGES = """
title = "Two stages"
[[shafts]]
name = "input"
sections = [{{ length_mm = 80.0, outer_mm = 20.0 }}]
[[shafts]]
name = "middle"
at_mm = [{distances[0]}, 0.0]
sections = [{{ length_mm = 120.0, outer_mm = 24.0 }}]
[[shafts]]
name = "output"
at_mm = [{distances[0]}, {distances[1]}]
start_mm = 40.0
sections = [{{ length_mm = 80.0, outer_mm = 28.0 }}]
[[meshes]]
name = "first"
case = "small.toml"
pair = {{ helix_angle_deg = {helix[0]} }}
pinion = {{ shaft = "input", at_mm = 35.0 }}
wheel = {{ shaft = "middle", at_mm = 35.0 }}
[[meshes]]
name = "second"
case = "small.toml"
pair = {{ helix_angle_deg = {helix[1]} }}
pinion = {{ shaft = "middle", at_mm = 85.0 }}
wheel = {{ shaft = "output", at_mm = 45.0 }}
[[loads]]
name = "drive"
torques = [
    {{ shaft = "input", at_mm = 0.0, torque_Nm = {torque} }},
    {{ shaft = "output", at_mm = 80.0, torque_Nm = "balance" }},
]
"""
_BEARINGS = (("input", 10.0, 70.0), ("middle", 10.0, 110.0), ("output", 10.0, 70.0))
TWO_STAGES += "".join(
    f"""[[bearings]]
name = "{shaft} {number}"
shaft = "{shaft}"
at_mm = {place}
radial_N_per_mm = 2e5
{"axial_N_per_mm = 1e5" if number == 1 else ""}
"""
    for shaft, *places in _BEARINGS for number, place in enumerate(places, 1)
)  # fmt: skip


def two_stages(folder, helix, torque, more=""):
    """Write the two stages with helix angles, deg, and a torque at the input, N m."""
    distances = tuple(60.0 / math.cos(math.radians(angle)) + 0.05 for angle in helix)
    return written(folder, TWO_STAGES.format(helix=helix, torque=torque, distances=distances) + more)
