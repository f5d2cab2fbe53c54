"""The tables and the results file of a set: arrays for other programs."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.results.quantities import OF_MESHES
from pmor.sets.loader import SetFile
from pmor.sets.readings import Data
from pmor.sets.solution import SetSolution
from pmor.storage.results_file import OF_A_SET, ResultsFile

Arrays = dict[str, np.ndarray]
# Numbers of the line loads in a file, 80 MB: those of longer sweeps are left out.
MOST_LINES = 10_000_000


def set_columns(solved: SetSolution, torque_Nm: FloatArray) -> Arrays:
    """One value per torque and angle: the columns of `ste.csv`.

    Columns: phi_rad, torque_Nm, ste_um (NaN where not converged), converged (0/1), share_<planet> (fraction of the
    torque that the pins carry), force_<pinion>_<wheel>_N (of the mesh in the transverse plane).

    Parameters
    ----------
    torque_Nm : ndarray, shape (D,)
        On the member that the file names.
    """
    torques, angles = solved.ste_um.shape
    planets = [solved.plan.bodies[body].name for body in solved.plan.planets]
    return {
        "phi_rad": np.tile(solved.phi_rad, torques), "torque_Nm": np.repeat(torque_Nm, angles),
        "ste_um": solved.ste_um.ravel(), "converged": solved.converged.ravel().astype(int),
        **{_column("share", name): solved.planet_share[..., n].ravel() for n, name in enumerate(planets)},
        **{_column("force", *names, "N"): solved.mesh_force_N[..., n].ravel()
           for n, names in enumerate(_meshing(solved))},
    }  # fmt: skip


def torque_rows(data: Data) -> list[Data]:
    """Return the figures under each torque, those of planets and gears in columns of their own: `torques.csv`."""
    rows = []
    for of_torque in data["torques"]:
        row = {key: value for key, value in of_torque.items() if not isinstance(value, list | dict)}
        row |= {f"ste_order_{n}_um": value for n, value in enumerate(of_torque["ste_harmonics_um"], start=1)}
        row |= {_column("share", one["name"]): one["share_mean"] for one in of_torque["planets"]}
        gears = of_torque["root_stress"]
        row |= {_column("root_stress", one["name"], "MPa"): one["max_principal_MPa"] for one in gears}
        rows.append(row)
    return rows


def mesh_rows(data: Data) -> list[Data]:
    """Return the figures of each mesh under each torque: rows of `meshes.csv`."""
    return [{"torque_Nm": row["torque_Nm"], **mesh} for row in data["torques"] for mesh in row["meshes"]]


def set_arrays(solved: SetSolution, torque_Nm: FloatArray) -> Arrays:
    """Return all arrays of a set by their paths in a results file."""
    return _arrays(solved, torque_Nm) | _lines(solved)


def set_results(file: SetFile, solved: SetSolution, torque_Nm: FloatArray, data: Data) -> ResultsFile:
    """Return the content of the results file of a set, `data` that of `set.json`."""
    names = {
        "gears": tuple(body.name for body in solved.plan.bodies),
        "meshes": tuple(" - ".join(names) for names in _meshing(solved)),
    }
    arrays = set_arrays(solved, torque_Nm) | _elements(data)
    return ResultsFile(file.name, file.text, arrays, names, OF_A_SET)


def _elements(data: Data) -> Arrays:
    """Loads of the rolling elements of the planets' bearings; nothing where all are by their stiffness."""
    planets = [[planet["bearings"] for planet in row["planets"]] for row in data["torques"]]
    every = [one["rows"] for of_torque in planets for of in of_torque for one in of if one.get("rows")]
    if not every:
        return {}
    rows, elements = max(map(len, every)), max(len(row["element_force_N"]) for one in every for row in one)
    force = np.full((len(planets), len(planets[0]), len(planets[0][0]), rows, elements), np.nan)
    azimuth = np.full(force.shape[2:], np.nan)
    for torque, of_torque in enumerate(planets):
        for planet, of in enumerate(of_torque):
            for seat, one in enumerate(of):
                for number, row in enumerate(one.get("rows", ())):
                    count = len(row["element_force_N"])
                    force[torque, planet, seat, number, :count] = row["element_force_N"]
                    azimuth[seat, number, :count] = row["element_azimuth_deg"]
    return {"bearings/azimuth": azimuth, "bearings/force": force}


def _meshing(solved: SetSolution) -> list[list[str]]:
    """Names of the gears of each mesh."""
    return [[solved.plan.bodies[body].name for body in mesh.bodies] for mesh in solved.train.meshes]


def _column(*words: str) -> str:
    return "_".join(words).replace(" ", "_")


def _arrays(solved: SetSolution, torque_Nm: FloatArray) -> Arrays:
    moved, wrench = solved.hub_displacement, solved.hub_wrench
    found: Arrays = {
        "ste/phi": solved.phi_rad, "ste/torque": torque_Nm, "ste/first_gear_torque": solved.torque_Nm,
        "ste/ste": solved.ste_um, "ste/converged": solved.converged,
        "meshes/pinion": np.array([mesh.bodies[0] for mesh in solved.train.meshes]),
        "meshes/wheel": np.array([mesh.bodies[1] for mesh in solved.train.meshes]),
        "meshes/force": solved.mesh_force_N, "meshes/share": solved.mesh_share,
        "gears/displacement": 1e3 * moved[..., :3], "gears/rotation": 1e6 * moved[..., 3:],
        "gears/force": wrench[..., :3], "gears/moment": 1e-3 * wrench[..., 3:],
    }  # fmt: skip
    found |= {
        f"meshes/{key}": np.stack([figures[key] for figures in solved.mesh_figures], axis=1) for key in OF_MESHES
    }
    if solved.plan.planets:
        found |= {
            "planets/gear": np.array(solved.plan.planets), "planets/share": solved.planet_share,
            "planets/pin_force": solved.pin_force_N,
        }  # fmt: skip
    orders = [solved.ste_orders(row) for row in range(len(torque_Nm))]
    found["orders/order"] = orders[0].order
    found |= {f"orders/{name}": np.stack([getattr(o, name) for o in orders]) for name in ("amplitude", "phase")}
    return found


def _lines(solved: SetSolution) -> Arrays:
    """Line loads of all meshes beside each other; nothing where they are too many."""
    meshes = range(len(solved.train.meshes))
    sections = [solved.placed.placed[mesh].mesh.pair.meshed.sections for mesh in meshes]
    pairs = max(one.mesh.pair.meshed.tooth_pair_count for one in solved.placed.placed)
    most = max(len(one.z) for one in sections)
    if solved.converged.size * len(meshes) * pairs * most > MOST_LINES:
        return {}
    loads = [solved.lines(mesh) for mesh in meshes]
    return {
        "lines/z": np.stack([_filled(one.z, most) for one in sections]),
        "lines/width": np.stack([_filled(one.images * one.width_mm, most) for one in loads]),
        "lines/first_pair": np.stack([solved.first_pair(mesh) for mesh in meshes], axis=1),
        "lines/roll": np.stack([_filled(one.roll_rad, pairs, most, 2) for one in loads], axis=1),
        "lines/load": np.stack([
            _filled(np.where(one.converged[..., None, None], one.load_N_per_mm, np.nan), pairs, most) for one in loads
        ], axis=2),
    }


def _filled(values: FloatArray, *shape: int) -> FloatArray:
    """Return values with NaN beyond the end of their last axes, up to a shape."""
    before = values.ndim - len(shape)
    beyond = [(0, length - own) for length, own in zip(shape, values.shape[before:], strict=True)]
    return np.pad(values, [(0, 0)] * before + beyond, constant_values=np.nan)
