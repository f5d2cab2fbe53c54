"""Gearboxes with a small planetary set on shafts of their own: a reducer of one stage, and one of two."""

from tests.support.gearboxes import SMALL_CASE
from tests.support.small_sets import NO_STRESS, SMALL_SET

# Ring held, planets equal: errors of single tests come on top.
EVEN_SET = SMALL_SET.replace("tangential_um = [10.0, 0.0, 0.0]\n", "").replace("torques_Nm = [100.0]\n", "")
EVEN_SET += NO_STRESS
BEARING = """
[[bearings]]
name = "{name}"
shaft = "{shaft}"
at_mm = {at}
radial_N_per_mm = {radial}
axial_N_per_mm = "rigid"
tilt_Nmm_per_rad = {tilt}
"""


def bearing(name, shaft, at, radial='"rigid"', tilt='"rigid"'):
    """A bearing that holds its shaft along the axis."""
    return BEARING.format(name=name, shaft=shaft, at=at, radial=radial, tilt=tilt)


SHAFTS = """
title = "reducer"
[[shafts]]
name = "sun"
sections = [{ length_mm = 60.0, outer_mm = 30.0 }]
[[shafts]]
name = "carrier"
start_mm = 70.0
sections = [{ length_mm = 60.0, outer_mm = 50.0 }]
[[sets]]
name = "stage"
set = "small.toml"
sun = { shaft = "sun", at_mm = 50.0 }
carrier = { shaft = "carrier", at_mm = 10.0 }
"""
LOAD = """
[[loads]]
name = "{name}"
speed_rpm = 1000.0
torques = [
    {{ shaft = "sun", at_mm = 0.0, torque_Nm = {torque} }},
    {{ shaft = "{out}", at_mm = {at}, torque_Nm = "balance" }},
]
"""


def one_stage(sun='"rigid"', tilt='"rigid"', torque=300.0, extra=""):
    """Bearings right at the members: rigid, or the sun's across the axis."""
    return (
        SHAFTS + bearing("A", "sun", 50.0, sun, tilt) + bearing("B", "carrier", 10.0)
        + LOAD.format(name="drive", torque=torque, out="carrier", at=60.0) + extra
    )  # fmt: skip


def written_reducer(folder, text, of_set=EVEN_SET):
    """Write a gearbox with a set into a folder, and return its path."""
    (folder / "small.toml").write_text(of_set)
    (folder / "pair.toml").write_text(SMALL_CASE)
    path = folder / "reducer.toml"
    path.write_text(text)
    return path


# The carrier drives; the sun shaft carries a helical pinion beside the set, and two soft bearings.
TWO_STAGES = """
title = "two stages"
[[shafts]]
name = "carrier"
start_mm = -80.0
sections = [{ length_mm = 70.0, outer_mm = 50.0, inner_mm = 34.0 }]
[[shafts]]
name = "sun"
start_mm = -20.0
sections = [{ length_mm = 120.0, outer_mm = 30.0 }]
[[shafts]]
name = "out"
at_mm = [62.2, 0.0]
start_mm = 40.0
sections = [{ length_mm = 80.0, outer_mm = 28.0 }]
[[sets]]
name = "stage"
set = "small.toml"
carrier = { shaft = "carrier", at_mm = 65.0 }
sun = { shaft = "sun", at_mm = 10.0 }
[[meshes]]
name = "pair"
case = "pair.toml"
pinion = { shaft = "sun", at_mm = 80.0 }
wheel = { shaft = "out", at_mm = 20.0 }
[[loads]]
name = "drive"
speed_rpm = 100.0
torques = [
    { shaft = "carrier", at_mm = 0.0, torque_Nm = 240.0 },
    { shaft = "out", at_mm = 80.0, torque_Nm = "balance" },
]
""" + "".join(
    bearing(name, shaft, at, radial, '"free"')
    for name, shaft, at, radial in (
        ("A", "carrier", 10.0, 3e5), ("B", "carrier", 60.0, 3e5), ("C", "sun", 35.0, 1e5), ("D", "sun", 110.0, 1e5),
        ("E", "out", 10.0, 2e5), ("F", "out", 70.0, 2e5),
    )
)  # fmt: skip


def two_sets(push_N):
    """Two equal sets in series: the sun of the first one drives the carrier of the second, on soft bearings."""
    shafts = "".join(
        f'[[shafts]]\nname = "{name}"\nstart_mm = {start}\nsections = [{{ length_mm = 90.0, outer_mm = {outer} }}]\n'
        for name, start, outer in (("rotor", -110.0, 50.0), ("middle", -15.0, 34.0), ("sun", 85.0, 30.0))
    )
    sets = "".join(
        f'[[sets]]\nname = "{name}"\nset = "small.toml"\ncarrier = {{ shaft = "{carrier}", at_mm = 90.0 }}\n'
        f'sun = {{ shaft = "{sun}", at_mm = 15.0 }}\n'
        for name, carrier, sun in (("first", "rotor", "middle"), ("second", "middle", "sun"))
    )
    bearings = "".join(
        bearing(f"{shaft} {at:g}", shaft, at, 2e4, '"free"')
        for shaft in ("rotor", "middle", "sun")
        for at in (40.0, 70.0)
    )
    load = LOAD.format(name="drive", torque=960.0, out="sun", at=90.0).replace(
        '"sun", at_mm = 0.0', '"rotor", at_mm = 0.0'
    )
    force = f'forces = [{{ shaft = "sun", at_mm = 90.0, y_N = {push_N} }}]\n'
    return 'title = "two sets"\n' + shafts + sets + bearings + load + force
