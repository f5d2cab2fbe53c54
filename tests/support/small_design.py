"""A design of two reliefs on the small case: seconds to search."""

from tests.support.small_case import case_text

CASE = case_text(mesh={"profile_elements": 5, "width_elements": 2}, contact={"scheme": "line"}, reduction=None,
                 results={"root_stress": False})  # fmt: skip
DESIGN = """
case = "small.toml"
[[variables]]
key = "tip_relief_um"
range = [0.0, 30.0]
step = 0.5
[[variables]]
key = "tip_relief_start_roll_deg"
range = [22.0, 30.0]
[load]
torques_Nm = [60.0, 100.0]
weights = [1.0, 3.0]
[[constraints]]
result = "tip_edge_load_N_per_mm"
at_most = 200.0
[search]
samples = 32
descents = 2
angles = 12
[pareto]
points = 2
"""


def written(folder, text=DESIGN):
    (folder / "small.toml").write_text(CASE)
    path = folder / "relief.toml"
    path.write_text(text)
    return path
