"""Pictures of a pair in motion: response over the speed, spectra over the speed, phase plane, motion over a cycle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.dynamics.measure import Data
from pmor.report.chart import COLOURS, Chart, Field, Panel, panels
from pmor.results.flank_maps import cell_edges

RUNS = {"run_up": ("^", "run-up"), "run_down": ("v", "run-down")}
# Most marks of a run on a curve.
MARKS = 45
# Below the largest amplitude, decades that spectra show.
DECADES = 3.0
# Numbers of modes closer than this, over the range of the speeds, share a place.
MODES_APART = 0.05
# Mesh cycles that a picture of the motion shows.
CYCLES = 2


def response_figure(responses: Sequence[Data], factors: Sequence[Data]) -> Chart:
    """Transmission error, marks for the runs, and dynamic factor beside K_v, over the mesh frequency."""
    with panels(1, 8.2, 8.0, rows=2) as (figure, (above, below)):
        for colour, response in _coloured(responses):
            for branch in response["branches"]:
                for axes, key in ((above, "dte_rms_um"), (below, "dynamic_factor")):
                    _branch(axes, branch, key, colour)
            for key, (mark, _) in RUNS.items():
                points = (response[key] or [])[:: max(1, len(response[key] or []) // MARKS)]
                above.plot(_frequencies(points), _values(points, "dte_rms_um"), mark, color=colour, ms=3.5, mfc="none",
                           mew=0.8)  # fmt: skip
            for axes in (above, below):
                _mark_modes(axes, response, colour)
        for (colour, _), factor in zip(_coloured(responses), factors, strict=True):
            below.plot(1e-3 * np.array(factor["mesh_frequency_Hz"]), factor["k_v"], color=colour, lw=0.9, ls="-.")
        above.set(ylabel="Dynamic transmission error, rms [µm]", xlabel="Mesh frequency [kHz]")
        below.set(ylabel="Dynamic factor [-]", xlabel="Mesh frequency [kHz]")
        above.set_ylim(bottom=0.0)
        _number_modes(above, responses)
        _speed_axis(above, responses)
        _legend(figure, responses, runs=True, iso=True)
    return figure


def contact_figure(responses: Sequence[Data]) -> Chart:
    """Share of the cycle without contact, and bearing forces, over the mesh frequency."""
    with panels(1, 8.2, 8.0, rows=2) as (figure, (above, below)):
        for colour, response in _coloured(responses):
            for branch in response["branches"]:
                _branch(above, branch, "contact_loss", colour, 100.0)
                _branch(below, branch, "bearing_force_N", colour, 1e-3, place=0)
            for axes in (above, below):
                _mark_modes(axes, response, colour)
        _speed_axis(above, responses)
        above.set(ylabel="Cycle without contact [%]", xlabel="Mesh frequency [kHz]")
        below.set(ylabel="Largest force of the pinion on its bearings [kN]", xlabel="Mesh frequency [kHz]")
        _legend(figure, responses, runs=False)
    return figure


def waterfall_figure(responses: Sequence[Data]) -> Chart | None:
    """Amplitude over mesh frequency and order along the run-up, a panel per torque; None where there is no run."""
    shown = [response for response in responses if response["waterfall"]]
    if not shown:
        return None
    top = max(float(np.max(response["waterfall"]["amplitude_um"])) for response in shown)
    floor = top * 10.0**-DECADES
    columns = min(2, len(shown))
    rows = math.ceil(len(shown) / columns)
    with panels(columns, 8.2, 3.4 * rows, rows=rows) as (figure, each):
        for axes, response in zip(each, shown, strict=False):
            spectra = response["waterfall"]
            amplitude = np.maximum(np.array(spectra["amplitude_um"]).T, floor)
            edges = cell_edges(1e-3 * np.array(spectra["mesh_frequency_Hz"])), cell_edges(np.array(spectra["order"]))
            label = "DTE amplitude, zero to peak [µm]"
            axes.field(Field(*edges, amplitude, floor, top, label, logarithmic=True))
            axes.set(title=f"{response['torque_Nm']:g} N m, run-up", xlabel="Mesh frequency [kHz]",
                     ylabel="Order of the mesh frequency [-]")  # fmt: skip
        for axes in each[len(shown) :]:
            axes.shown = False
    return figure


def motion_figure(responses: Sequence[Data]) -> Chart | None:
    """The largest stable motion: in the phase plane, and displacement and mesh force over two cycles."""
    shown = [(colour, response) for colour, response in _coloured(responses) if response["largest"]]
    if not shown:
        return None
    with panels(3, 12.0, 3.4) as (figure, (plane, along, force)):
        for colour, response in shown:
            motion = response["largest"]
            period = round(motion["mesh_cycles"][-1] + motion["mesh_cycles"][1])
            repeats = math.ceil(CYCLES / period)
            cycles = np.concatenate([np.array(motion["mesh_cycles"]) + period * k for k in range(repeats)])
            displacement, pushed = (np.tile(motion[key], repeats) for key in ("displacement_um", "mesh_force_N"))
            x, v = motion["displacement_um"], motion["velocity_mm_s"]
            plane.plot([*x, x[0]], [*v, v[0]], color=colour)
            along.plot(cycles, displacement, color=colour)
            force.plot(cycles, 1e-3 * pushed, color=colour)
        plane.axvline(0.0, color="#555555", lw=0.8, ls="--")
        along.axhline(0.0, color="#555555", lw=0.8, ls="--")
        plane.set(xlabel="Displacement along the line of action [µm]", ylabel="Velocity [mm/s]")
        along.set(ylabel="Displacement [µm]", xlabel="Mesh cycles [-]")
        force.set(ylabel="Mesh force [kN]", xlabel="Mesh cycles [-]")
        _legend(figure, [response for _, response in shown], runs=False, branches=False)
    return figure


def _mark_modes(axes: Panel, response: Data, colour: str) -> None:
    """Mark the natural frequencies within the speeds of a response, that of the mesh stronger than the others."""
    lowest, highest = response["mesh_frequencies_Hz"]
    for mode in response["modes"]:
        frequency = mode["natural_frequency_Hz"]
        if lowest <= frequency <= highest:
            strong = frequency == response["natural_frequency_Hz"]
            axes.axvline(1e-3 * frequency, color=colour, lw=1.2 if strong else 0.8, ls=":")


def _number_modes(axes: Panel, responses: Sequence[Data]) -> None:
    """Write the numbers of the modes above their marks under the last torque; those close together share a place."""
    response = responses[-1]
    lowest, highest = response["mesh_frequencies_Hz"]
    places = list[tuple[float, list[str]]]()
    for number, mode in enumerate(response["modes"], start=1):
        frequency = mode["natural_frequency_Hz"]
        if not lowest <= frequency <= highest:
            continue
        if places and frequency - places[-1][0] < MODES_APART * (highest - lowest):
            places[-1][1].append(str(number))
        else:
            places.append((frequency, [str(number)]))
    for frequency, numbers in places:
        axes.text(1e-3 * frequency, axes.limits("y")[1], ", ".join(numbers), va="top", color="#555555")


def _speed_axis(axes: Panel, responses: Sequence[Data]) -> None:
    """Draw the speed of the pinion over the mesh frequency in kHz."""
    rpm = responses[0]["speeds_rpm"][1] / (1e-3 * responses[0]["mesh_frequencies_Hz"][1])
    axes.second_x(rpm, "Pinion speed [rpm]")


def _branch(axes: Panel, branch: Sequence[Data], key: str, colour: str, factor: float = 1.0, place: int | None = None,
            ) -> None:  # fmt: skip
    """Draw a branch, stretch by stretch: solid where motion is stable, dashed where not."""
    frequency, values = _frequencies(branch), factor * _values(branch, key, place)
    stable = np.array([point["stable"] for point in branch], dtype=bool)
    # A stretch goes on to the first point of the next one, so that no gap shows.
    bounds = [0, *(np.flatnonzero(stable[1:] != stable[:-1]) + 1).tolist(), len(stable)]
    for start, end in zip(bounds[:-1], bounds[1:], strict=True):
        line: dict[str, Any] = {"ls": "-", "lw": 1.6} if stable[start] else {"ls": "--", "lw": 1.0}
        axes.plot(frequency[start : end + 1], values[start : end + 1], color=colour, **line)


def _frequencies(points: Sequence[Data]) -> FloatArray:
    return 1e-3 * _values(points, "mesh_frequency_Hz")


def _values(points: Sequence[Data], key: str, place: int | None = None) -> FloatArray:
    return np.array([point[key] if place is None else point[key][place] for point in points], dtype=float)


def _coloured(responses: Sequence[Data]) -> list[tuple[str, Data]]:
    return [(COLOURS[i % len(COLOURS)], response) for i, response in enumerate(responses)]


def _legend(figure: Chart, responses: Sequence[Data], runs: bool, branches: bool = True, iso: bool = False) -> None:
    """Name colours and lines on the last panel."""
    axes, grey, nothing = figure.panels[-1], {"color": "#555555"}, (list[float](), list[float]())
    for colour, response in _coloured(responses):
        axes.plot(*nothing, color=colour, label=f"{response['torque_Nm']:g} N m")
    if branches:
        axes.plot(*nothing, label="stable", **grey)
        axes.plot(*nothing, "--", lw=1.0, label="unstable", **grey)
    for mark, name in RUNS.values() if runs else ():
        axes.plot(*nothing, mark, mfc="none", label=name, **grey)
    if iso:
        axes.plot(*nothing, "-.", lw=0.9, label="K_v, ISO 6336-1:2006 method B", **grey)
