"""A campaign of sets: two of its four designs can be assembled, one of them with a sun whose profile is shifted."""

from tests.support.small_sets import SMALL_SET

BASE = SMALL_SET.replace("tangential_um = [10.0, 0.0, 0.0]\n", "")
STEPPED = (
    BASE.replace("[planet]\nteeth = 18", "[planet]\nteeth = 20")
    + """
[second_planet]
teeth = 16
bore_radius_mm = 14.0
[second_pair]
module_mm = 3.95
"""
)
DESIGNS = """
set = "set.toml"
[designs]
method = "grid"
sun.teeth = [18, 20]
ring.teeth = [54, 55]
"""
RELATIONS = """
[relations]
planet_teeth_fewer = 0
bore_share = 0.5
solve = "sun"
"""


def written(folder, text=DESIGNS + RELATIONS):
    """Write a campaign of sets into a folder, and return its path."""
    (folder / "set.toml").write_text(BASE)
    path = folder / "sets.toml"
    path.write_text(text)
    return path
