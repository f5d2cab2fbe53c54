"""The smallest example of each machine in the matrix of capabilities: plane strain where that is allowed."""

from tests.support.body_meshes import body_mesh, write_mesh
from tests.support.gearboxes import SMALL, SMALL_CASE
from tests.support.set_gearboxes import EVEN_SET, one_stage
from tests.support.small_case import case_text
from tests.support.small_sets import NO_STRESS, SMALL_SET

PLANE = {"width": "plane_strain", "profile_elements": 8, "error_bar": True, "element": "hex20"}
WIDE = {"width": "whole", "profile_elements": 8, "width_elements": 2, "error_bar": True, "element": "hex20"}
RING = {"teeth": 60, "internal": True, "addendum": 0.8, "root_fillet_mm": 0.6, "rim_thickness_mm": 12.0}
DUTY = """[[loads]]
name = "often"
torque_Nm = 50.0
hours = 30.0
[[loads]]
name = "full"
torque_Nm = 100.0
hours = 10.0
"""
LUGS = {"held": {"lugs": 6, "lug_deg": 10.0}}
WEB = {"rim_thickness_mm": 6.0, "web_thickness_mm": 5.0, "hub_radius_mm": 24.0}
HOLES = {"holes": {"count": 7, "radius_mm": 2.0, "on_radius_mm": 27.5}}
RELIEF = {"tip_relief_um": 10.0, "tip_relief_start_roll_deg": 27.0}
MOTION = "[dynamics]\nspeed_range_rpm = [800.0, 1000.0]\nspeeds = 3\nharmonics = 1\n"
COARSE = SMALL_SET.replace("angles_per_pitch = 6\ntorques_Nm = [100.0]", "angles_per_pitch = 4") + MOTION
EVEN = COARSE.replace("tangential_um = [10.0, 0.0, 0.0]\n", "")
STEPPED = EVEN.replace("[planet]\nteeth = 18", "[planet]\nteeth = 24").replace("teeth = 54", "teeth = 57")
STEPPED = STEPPED.replace("[ring]", "[second_planet]\nteeth = 15\nbore_radius_mm = 15.0\n[ring]")
# Two equal paths from a pinion to a coaxial wheel.
SPLIT_GEARS = {
    "input": (18, 0.0, "torque_Nm = 100.0"), "output": (24, 0.0, 'torque_Nm = "balance"'),
    "left_wheel": (24, -84.0, 'shaft = "left"'), "left_pinion": (18, -84.0, 'shaft = "left"'),
    "right_wheel": (24, 84.0, 'shaft = "right"'), "right_pinion": (18, 84.0, 'shaft = "right"'),
}  # fmt: skip
SPLIT_MESHES = ("input", "left_wheel"), ("input", "right_wheel"), ("left_pinion", "output"), ("right_pinion", "output")
SPLIT = "\n".join(
    [
        *(f'[[gears]]\nname = "{name}"\nat_mm = [{x}, 0.0]\n{more}' for name, (_, x, more) in SPLIT_GEARS.items()),
        *(f'[[meshes]]\ngears = ["{one}", "{other}"]' for one, other in SPLIT_MESHES),
        *(f"[{name}]\nteeth = {z}\nbore_radius_mm = {z}.0" for name, (z, *_) in SPLIT_GEARS.items()),
        "[pair]\nmodule_mm = 4.0\nface_width_mm = 20.0\n[sweep]\nangles_per_pitch = 4",
        "[mesh]\nprofile_elements = 3\nwidth_elements = 2\n",
    ]
)


WITHIN = {"profile_slope_um": 3.0, "samples": 8}


def _pair(mesh=PLANE, torque=100.0, **more):
    sections = {
        "contact": {"scheme": "line", "lodm_profile": 2}, "reduction": None, "offline": None, "mesh": mesh,
        "load": {"torque_Nm": torque, "speed_rpm": 1000.0}, "online": {"angles_per_pitch": 4, "torques_Nm": [torque]},
        "compare": {"angles": 2, "torques_Nm": [torque]}, "results": {"maps": True, "harris_torques_Nm": [torque]},
        "dynamics": {"mesh_frequency_ratio": [0.4, 0.5], "damping_ratio": 0.1, "run_cycles": 300},
    }  # fmt: skip
    return case_text(**{**sections, "tolerances": WITHIN, **more}) + DUTY


def _blank(**more):
    return _pair(WIDE, **{"pinion.blank": WEB | more})


# Rows of the page of the manual: what a machine has, and its file.
ROWS = {
    "spur": _pair(),
    "helical": _pair(WIDE, pair={"helix_angle_deg": 12.0}),
    "internal": _pair(pinion={"teeth": 20}, wheel=RING),
    "modified": _pair(**{"pinion.modification": RELIEF}),
    "misaligned": _pair(WIDE, misalignment={"in_plane_um": 5.0}),
    "pitch deviations": _pair(**{"pinion.modification": {"pitch_deviations_um": [0.0, 3.0, *[0.0] * 19]}}),
    "eccentric": EVEN + "[eccentricity]\nsun_um = 5.0\n",
    "coast flanks": _pair(torque=-100.0),
    "light blank": _blank(),
    "holes": _blank(**HOLES),
    "body by a mesh": _pair(WIDE, **{"pinion.blank": {"mesh": "body.inp"}}),
    "ring at lugs": _pair(WIDE, pinion={"teeth": 20}, wheel=RING | LUGS),
    "supports": EVEN + "[supports]\nsun_radial_N_per_mm = 2e5\nplanet_radial_N_per_mm = 5e5\n",
    "shafts and bearings": SMALL.replace('name = "drive"\n', 'name = "drive"\nspeed_rpm = 1000.0\nhours = 10.0\n')
    + MOTION,
    "planetary set": COARSE + "[tolerances]\npins_tangential_um = 5.0\nsamples = 8\n",
    "stepped planets": STEPPED,
    "power split": SPLIT + "[tolerances]\ntiming_mrad = 0.05\nsamples = 8\n",
    "set in a gearbox": one_stage() + MOTION,
}


def _solid(radius, *_):
    return radius > 0.0


def written_row(row, folder):
    """Write the machine of a row with the files that it names, and return its path."""
    of_set = EVEN_SET.replace(NO_STRESS, "") + "[tolerances]\npins_tangential_um = 5.0\nsamples = 8\n"
    of_case = SMALL_CASE + "[tolerances]\nhelix_slope_um = 5.0\nsamples = 8\n"
    (folder / "small.toml").write_text(of_set if row == "set in a gearbox" else of_case)
    if row == "body by a mesh":
        write_mesh(folder / "body.inp", *body_mesh((20.0, 24.0, 30.0, 34.0), (-10.0, 0.0, 10.0), 42, _solid))
    path = folder / "machine.toml"
    path.write_text(ROWS[row])
    return path
