"""Pictures of a gearbox in motion: bearing and mesh forces over the speed, Campbell diagram, waterfall."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.dynamics.whine.compliance import mesh_compliance
from pmor.dynamics.whine.orders import spinning_Hz
from pmor.dynamics.whine.readings import (
    MOST_LINES,
    bearing_names,
    line_words,
    moved_bearings,
    order_words,
    shown_lines,
)
from pmor.dynamics.whine.response import RPM, LoadResponse, Source, Totals
from pmor.report.chart import COLOURS, Chart, Field, Panel, panels
from pmor.results.flank_maps import cell_edges
from pmor.results.root_stress import GEARS

if TYPE_CHECKING:
    from collections.abc import Iterator


# Decades below the largest that a waterfall shows.
DECADES = 3.0
# Highest over lowest line of a waterfall from which on frequencies are logarithmic: slow shafts are seen too.
SPREAD = 100.0
# Of a mode's strain energy: a mesh that moves so little is not marked in the Campbell diagram.
MARKED = 0.01
# Orders of shafts' turns, speeds at which natural frequencies are found, and over the highest shown those among which
# gyroscopic moments act.
SHAFT_ORDERS, SPINS, BEYOND = 3, 13, 1.5
# Lines that are cut out.
CUTS, TINY = 6, 1e-300
# Frequencies of a compliance, and the lowest over the highest.
FREQUENCIES, LOWEST = 600, 0.005
# Places of a waterfall upwards, and how many of them a line takes.
UP, THICK = 200, 2


def bearings_figure(responses: Sequence[LoadResponse]) -> Chart:
    """Dynamic forces of all bearings over the speed, a panel each, a colour for each load; thin by mean stiffness."""
    (there, _), names = moved_bearings(responses), bearing_names(responses[0])
    rows, shown = math.ceil(len(there) / 2), [names[number] for number in there]
    grid, height = (rows, 2), 0.9 + 2.2 * rows
    return _forces_figure(responses, shown, lambda total: total.bearings[:, there], grid, height, "Force, rms [N]")


def meshes_figure(responses: Sequence[LoadResponse]) -> Chart:
    """Dynamic force of each mesh over the speed."""
    names = responses[0].mesh_names
    grid, height = (len(names), 1), 0.9 + 2.4 * len(names)
    return _forces_figure(responses, names, lambda total: total.meshes, grid, height, "Dynamic mesh force, rms [N]")


def _forces_figure(
    responses: Sequence[LoadResponse], names: Sequence[str], forces: Callable[[Totals], FloatArray],
    grid: tuple[int, int], height_in: float, label: str,
) -> Chart:  # fmt: skip
    """A panel for each name, the forces with varying stiffness and with its mean, under all loads."""
    every = [(response, forces(response.rms), forces(response.constant_rms)) for response in responses]
    with panels(grid[1], 9.2, height_in, rows=grid[0]) as (figure, each):
        for number, (axes, name) in enumerate(zip(each, names, strict=False)):
            for colour, (response, varying, mean) in zip(_colours(responses), every, strict=True):
                load = response.solved.load.name
                axes.plot(response.speeds_rpm, varying[:, number], color=colour, label=load)
                axes.plot(response.speeds_rpm, mean[:, number], color=colour, lw=0.6, ls="--")
            axes.set(title=name, ylabel=label, xlim=(responses[0].speeds_rpm[0], responses[0].speeds_rpm[-1]))
            axes.set_ylim(bottom=0.0)
        _finish(each, len(names), responses[0])
    return figure


def campbell_figure(response: LoadResponse, highest_Hz: float) -> Chart:
    """Natural frequencies over the speed, with the lines of each mesh, marked where they meet, and with shafts' turns.

    A panel for each, as meshes of fast shafts have many times the frequency of slow ones.
    """
    speeds, passing = response.speeds_rpm, response.passing
    rows, at = math.ceil((len(passing) + 1) / 2), np.linspace(response.speeds_rpm[0], response.speeds_rpm[-1], SPINS)
    with panels(2, 9.2, 3.6 * rows, rows=rows) as (figure, each):
        for axes, colour, mesh in zip(each, COLOURS * len(passing), passing, strict=False):
            top = min(highest_Hz, 1.05 * float(mesh.frequency_Hz(speeds)[-1].max()))
            for number in shown_lines(response, mesh):
                words = order_words(response, mesh, number).removeprefix("harmonic ")
                _order_line(axes, speeds, mesh.frequency_Hz(speeds)[:, number], top, words, color=colour,
                            lw=1.4 if mesh.places[number][0] == 1 else 0.8)  # fmt: skip
            for rpm, frequency, strain in _meetings(response, mesh):
                if speeds[0] <= rpm <= speeds[-1] and frequency <= top:
                    axes.plot(rpm, frequency, "o", color=colour, ms=2.0 + 6.0 * math.sqrt(strain), mfc="none")
            axes.set(title=mesh.name, ylim=(0.0, top))
        below, rates = each[len(passing)], {name: abs(rate) for name, rate in response.machine.rates.items() if rate}
        top = 1.05 * SHAFT_ORDERS * max(rates.values(), default=1.0) * float(speeds[-1]) / 60.0
        for colour, (name, rate) in zip(COLOURS * len(rates), rates.items(), strict=False):
            for order in range(1, SHAFT_ORDERS + 1):
                _order_line(below, speeds, order * rate * speeds / 60.0, top, str(order), color=colour,
                            lw=0.8 if order > 1 else 1.4, label=name if order == 1 else None)  # fmt: skip
        below.set(title="turns of the shafts", ylim=(0.0, top))
        for axes in each[: len(passing) + 1]:
            highest = BEYOND * axes.limits("y")[1]
            for mode in np.transpose(spinning_Hz(response.receptance, RPM * at, highest)):
                axes.plot(at, mode, color="#999999", lw=0.6, zorder=1)
            axes.set(xlim=(speeds[0], speeds[-1]), ylabel="Frequency [Hz]")
        _finish(each, len(passing) + bool(rates), response)
    return figure


def _order_line(axes: Panel, speeds: FloatArray, frequency: FloatArray, top: float, name: str, **style: Any) -> None:
    """A frequency over the speed as far as it is below the top, its name at its end."""
    own = frequency <= top
    axes.plot(speeds[own], frequency[own], **style)
    if own.any():
        axes.text(speeds[own][-1], frequency[own][-1], name, color=style["color"], outside=True)


def orders_figure(response: LoadResponse) -> Chart:
    """Order cuts: the largest lines of the bearing forces over the speed, a panel each bearing, and all lines."""
    names, total, speeds = bearing_names(response), response.rms.bearings, response.speeds_rpm
    there, _ = moved_bearings([response])
    cuts = [
        (line_words(response, source, number), own[:, number])
        for source in response.sources for own in [response.force_lines(source)]
        for number in range(own.shape[1])
    ]  # fmt: skip
    # The largest over the forces of each bearing: no bearing is left out for being light.
    share = [float((line.max(axis=0) / np.maximum(total.max(axis=0), TINY)).max()) for _, line in cuts]
    shown = [cuts[number] for number in np.argsort(share)[::-1][:CUTS]]
    rows = math.ceil(len(there) / 2)
    with panels(2, 9.2, 2.6 * rows, rows=rows) as (figure, each):
        for axes, number in zip(each, there, strict=False):
            axes.plot(speeds, total[:, number], color="#b5b5b5", lw=2.4, label="all lines")
            for colour, (words, line) in zip(COLOURS, shown, strict=False):
                axes.plot(speeds, line[:, number], color=colour, lw=1.1, label=words)
            axes.set(title=names[number], ylabel="Force, rms [N]", xlim=(speeds[0], speeds[-1]))
            axes.set_ylim(bottom=0.0)
        _finish(each, len(there), response)
    return figure


def compliance_figure(response: LoadResponse, highest_Hz: float) -> Chart:
    """Compliance of both gears at each mesh, and the mesh force by transmission error, over the frequency."""
    lowest = LOWEST * highest_Hz
    frequency = np.geomspace(lowest, highest_Hz, FREQUENCIES)
    count = len(response.solved.meshes)
    logarithmic = {"xscale": "log", "yscale": "log", "xlabel": "Frequency [kHz]"}
    with panels(count, 4.6 * count, 5.4, rows=2, **logarithmic) as (figure, each):
        for number, (above, below) in enumerate(zip(each[:count], each[count:], strict=True)):
            found = mesh_compliance(response, number, frequency)
            for gear, values, colour in zip(GEARS, found.gears.T, COLOURS, strict=False):
                above.plot(1e-3 * frequency, 1e6 * abs(values), color=colour, lw=1.2, label=gear)
            above.axhline(1e6 * found.contact, color="#555555", lw=0.9, ls="--", label="mesh, mean")
            below.plot(1e-3 * frequency, 1e-3 * abs(found.force), color=COLOURS[2], lw=1.2)
            above.set(title=found.name, ylabel="Compliance at the mesh [µm/kN]", tight=True)
            below.set(title=found.name, ylabel="Mesh force by transmission error [N/µm]", tight=True)
    return figure


def _meetings(response: LoadResponse, mesh: Source) -> Iterator[tuple[float, float, float]]:
    """Speed, frequency and strain energy of the mesh where its harmonics meet modes that strain it."""
    own = mesh.ports
    for order in (mesh.orders[number] for number in shown_lines(response, mesh)):
        by = order.by_ports[own]
        strain = np.einsum("am,ab,bm->m", by.conj(), response.tangent[own][:, own], by).real
        for speed, share in zip(order.resonance, strain, strict=True):
            if share > MARKED:
                yield 60.0 * speed / (2.0 * math.pi), order.order * speed / (2.0 * math.pi), float(share)


def waterfall_figure(response: LoadResponse, highest_Hz: float) -> Chart:
    """Lines of the force of all bearings over speed and frequency, a panel each, in colours by their size."""
    (there, _), names, speeds = moved_bearings([response]), bearing_names(response), response.speeds_rpm
    lines = [response.force_lines(source) for source in response.sources]
    largest = max(float(line.max()) for line in lines)
    least = largest * 10.0**-DECADES
    tops = [source.frequency_Hz(speeds)[-1] for source in response.passing]
    top, lowest = min(highest_Hz, max(float(one.max()) for one in tops)), min(float(one.min()) for one in tops)
    logarithmic = top > SPREAD * lowest
    edges = np.geomspace(0.1 * lowest, top, UP + 1) if logarithmic else np.linspace(0.0, top, UP + 1)
    rows = math.ceil(len(there) / 2)
    with panels(2, 9.2, 2.6 * rows, rows=rows) as (figure, each):
        for axes, number in zip(each, there, strict=False):
            found = np.full((UP, len(speeds)), np.nan)
            for source, own in zip(response.sources, lines, strict=True):
                size = np.maximum(own[..., number], least)
                told = (size > least) | (len(source.places) <= MOST_LINES)
                rows_of = np.searchsorted(edges, source.frequency_Hz(speeds)) - 1
                _mark_lines(found, rows_of, np.where(told, size, 0.0))
            label = "Line of the bearing force, rms [N]"
            cells = cell_edges(speeds), 1e-3 * edges
            axes.field(Field(*cells, found, least, largest, label, logarithmic=True))
            axes.set(title=names[number], ylabel="Frequency [kHz]", yscale="log" if logarithmic else "linear",
                     ylim=1e-3 * edges[[0, -1]])  # fmt: skip
        _finish(each, len(there), response)
    return figure


def _mark_lines(found: FloatArray, rows: IntArray, size: FloatArray) -> None:
    """Write into a picture (frequency, speed), in place, the largest of the lines (speed, line) at each place."""
    columns = np.broadcast_to(np.arange(len(size))[:, None], size.shape)
    for move in range(THICK):
        own = (rows + move >= 0) & (rows + move < len(found)) & (size > 0.0)
        np.fmax.at(found, (rows[own] + move, columns[own]), size[own])


def _colours(responses: Sequence[LoadResponse]) -> list[str]:
    return [COLOURS[number % len(COLOURS)] for number in range(len(responses))]


def _speed(response: LoadResponse) -> str:
    return f"Speed of {response.speed_of} [rpm]"


def _finish(each: Sequence[Panel], used: int, response: LoadResponse) -> None:
    for axes in each[used:]:
        axes.shown = False
    for axes in each[:used]:
        axes.set(xlabel=_speed(response))
