"""A campaign of 36 designs on the small case in plane strain: seconds to solve."""

from tests.support.small_case import case_text

BASE = case_text(contact={"scheme": "line"}, reduction=None, mesh={"width": "plane_strain"},
                 online={"angles_per_pitch": 60})  # fmt: skip
# Three bores and twelve modules around a centre distance: a third or so of the designs are infeasible.
CAMPAIGN = """
case = "base.toml"
[designs]
method = "grid"
pair.module_mm = { from = 3.86, to = 4.35, steps = 12 }
pinion.bore_radius_mm = [18.0, 20.0, 22.0]
[relations]
centre_distance_mm = 86.5
"""


def written(folder, more):
    """Path of the campaign in a folder, with more sections."""
    (folder / "base.toml").write_text(BASE)
    path = folder / "campaign.toml"
    path.write_text(CAMPAIGN + more)
    return path
