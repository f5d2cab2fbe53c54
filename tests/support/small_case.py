"""The paper's gear on a mesh so coarse that a whole run takes seconds, also with interpreted kernels."""

import pmor.penalty.solve
from pmor.case import parse_case
from pmor.core.errors import ConvergenceError
from pmor.pair.model import elastic_model, mesh_model

SECTIONS = {
    "load": {"torque_Nm": 100.0},
    "pair": {"module_mm": 4.0, "face_width_mm": 20.0},
    "pinion": {"teeth": 21, "bore_radius_mm": 20.0},
    "mesh": {"profile_elements": 6, "width_elements": 1, "element": "hex8i", "error_bar": False},
    "contact": {"scheme": "direct", "lodm_profile": 2},
    "offline": {"angles_per_pitch": 4, "torques_Nm": [40.0, 160.0]},
    "online": {"angles_per_pitch": 4, "torques_Nm": [100.0]},
    "compare": {"angles": 2, "torques_Nm": [60.0, 100.0], "largest_error_percent": 100.0},
}


def case_text(**changes):
    """TOML text of the small case; each argument is a section with the keys that differ, or None to leave it out."""
    sections = {name: dict(keys) for name, keys in SECTIONS.items()}
    for name, keys in changes.items():
        if keys is None:
            sections.pop(name, None)
        else:
            sections.setdefault(name, {}).update(keys)
    lines = []
    for name, keys in sections.items():
        lines += [f"[{name}]", *(f"{key} = {_toml(value)}" for key, value in keys.items()), ""]
    return "\n".join(lines)


def write_case(folder, **changes):
    """Write the small case to a file of a folder; arguments as in `case_text`."""
    path = folder / "tiny.toml"
    path.write_text(case_text(**changes))
    return path


def case_with(**changes):
    """The small case; arguments as in `case_text`."""
    return parse_case(case_text(**changes), "small", "small case")


def full_fe(case):
    """Full FE of a case."""
    return elastic_model(case, mesh_model(case))


def small_case(width="half", **reduction):
    """The case of the fixture `small_model`, with the meshed width and the keys of its section [reduction]."""
    mesh = {"profile_elements": 5, "width_elements": 2, "width": width}
    return case_with(mesh=mesh, offline={"angles_per_pitch": 6}, compare={"angles": 4}, reduction=reduction)


def _toml(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key} = {_toml(one)}' for key, one in value.items())}}}"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def fail_where(condition, monkeypatch):
    """Let the equilibrium fail at the positions (phi, torque in N mm) that `condition` picks."""
    solve = pmor.penalty.solve.solve_equilibrium

    def failing(meshed, position, elasticity, wanted, *rest, **more):
        if condition(position.phi, wanted.torque):
            raise ConvergenceError("made to fail", [(1.0, 1.0)])
        return solve(meshed, position, elasticity, wanted, *rest, **more)

    monkeypatch.setattr(pmor.penalty.solve, "solve_equilibrium", failing)
