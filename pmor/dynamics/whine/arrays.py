"""Numbers of a gearbox or a set in motion as files have them: rows, columns, arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.dynamics.whine.readings import (
    bearing_names,
)
from pmor.dynamics.whine.response import LoadResponse, Source


def response_columns(responses: Sequence[LoadResponse]) -> dict[str, np.ndarray]:
    """Return the columns of `response.csv`: forces of meshes and bearings by load and speed."""
    return _joined([
        {
            "load": np.full(len(response.speeds_rpm), response.solved.load.name, dtype=object),
            "speed_rpm": response.speeds_rpm,
            **{f"mesh {name}, rms_N": response.rms.meshes[:, n] for n, name in enumerate(response.mesh_names)},
            **{f"bearing {name}, rms_N": response.rms.bearings[:, n]
               for n, name in enumerate(bearing_names(response))},
        } for response in responses
    ])  # fmt: skip


def _joined(parts: Sequence[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Columns of all parts, one after the other."""
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]} if parts else {}


def line_columns(responses: Sequence[LoadResponse]) -> dict[str, np.ndarray]:
    """Return the columns of `lines.csv`: each line of each source by load and speed, amplitudes from zero to peak."""
    parts = list[dict[str, np.ndarray]]()
    for response in responses:
        for source in response.sources:
            count, harmonics = source.told.shape
            forces = response.force_lines(source)
            own = {"load": response.solved.load.name, "source": source.name}
            told, orders = source.told[..., None], np.array([order.order for order in source.orders[:harmonics]])
            meshes = 2.0 * abs(source.lines.mesh_forces) * told, 2e3 * abs(source.lines.parted) * told
            parts.append({
                **{key: np.full(count * harmonics, text, dtype=object) for key, text in own.items()},
                "harmonic": np.tile([harmonic for harmonic, _ in source.places], count),
                "carrier_order": np.tile([sideband for _, sideband in source.places], count),
                "speed_rpm": np.repeat(response.speeds_rpm, harmonics),
                "frequency_Hz": source.frequency_Hz(response.speeds_rpm).ravel(),
                **{f"order of {shaft}": np.tile(np.round(orders / abs(rate), 9), count)
                   for shaft, rate in response.machine.rates.items() if rate},
                **{f"mesh {name}, {key}": values[..., n].ravel() for n, name in enumerate(response.mesh_names)
                   for key, values in zip(("force_N", "transmission_error_um"), meshes, strict=True)},
                **{f"bearing {name}, rms_N": forces[..., n].ravel() for n, name in enumerate(bearing_names(response))},
            })  # fmt: skip
    return _joined(parts)


def motion_arrays(response: LoadResponse) -> dict[str, np.ndarray]:
    """Return the arrays of a load in `results.h5`, lines that a source lacks as NaN."""
    model, sources, speeds = response.receptance, response.sources, response.speeds_rpm
    most = max(source.told.shape[1] for source in sources)

    def padded(values: np.ndarray, source: Source) -> np.ndarray:
        told = np.where(source.told.reshape(*source.told.shape, *(1,) * (values.ndim - 2)), values, np.nan)
        return np.pad(told, ((0, 0), (0, most - told.shape[1]), *((0, 0),) * (told.ndim - 2)), constant_values=np.nan)

    def on_bearings(readings: FloatArray) -> FloatArray:
        return response.bearing_forces(np.asarray(readings.T, dtype=complex)).real[..., :3].transpose(1, 2, 0)

    frequency = np.stack([padded(source.frequency_Hz(speeds), source) for source in sources])
    meshes = np.stack([padded(source.lines.mesh_forces, source) for source in sources])
    bearings = np.stack(
        [padded(response.bearing_forces(source.lines.readings)[..., :3], source) for source in sources]
    )
    acting = np.stack([padded(_on_all_ports(source, len(model.ports)), source) for source in sources])
    order = np.full((len(sources), most), np.nan)
    for number, source in enumerate(sources):
        order[number, : source.told.shape[1]] = [one.order for one in source.orders[: source.told.shape[1]]]
    return {
        "speed/speed": speeds, "speed/bearing_force": response.rms.bearings, "speed/mesh_force": response.rms.meshes,
        "lines/frequency": frequency, "lines/mesh_force": 2.0 * abs(meshes), "lines/mesh_force_phase": np.angle(meshes),
        "lines/bearing_force": 2.0 * abs(bearings), "lines/bearing_force_phase": np.angle(bearings),
        "lines/order": order, "lines/acting": 2.0 * abs(acting), "lines/acting_phase": np.angle(acting),
        "model/frequency": response.modes.frequency_Hz, "model/damping_ratio": model.damping_ratio,
        "model/ports": model.ports, "model/readings": model.readings,
        "model/gyroscopic": response.machine.sense * model.gyroscopic, "model/centrifugal": model.centrifugal,
        "model/bearing_force": on_bearings(model.readings),
        "model/left_bearing_force": on_bearings(model.left_readings),
        "model/left_ports": model.left_ports, "model/left_readings": model.left_readings,
        "model/tangent": response.tangent,
    }  # fmt: skip


def _on_all_ports(source: Source, ports: int) -> ComplexArray:
    """Forces of a source's lines on all ports, (S, K, p)."""
    found = np.zeros((*source.told.shape, ports), dtype=complex)
    found[..., source.ports] = source.lines.acting[:, : source.told.shape[1]]
    return found


