"""Natural modes to look at: the machine as a mode moves it, its planets too, drawn as the loaded one is."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pmor.body.beam import NODE
from pmor.core.arrays import FloatArray, IntArray
from pmor.dynamics.whine.moving import MovingMachine
from pmor.dynamics.whine.readings import Data, main_load, shown_modes
from pmor.dynamics.whine.response import LoadResponse
from pmor.machine.bodies import Body, Detail, bodies
from pmor.machine.figures import exaggeration
from pmor.machine.loaded import LoadedGearbox, SetMeshing
from pmor.machine.loader import GearboxFile
from pmor.machine.model import GearboxModel
from pmor.machine.set_bodies import member_places
from pmor.machine.set_frame import MEMBERS, set_frame
from pmor.machine.settings import GearboxSections, PlanetarySet
from pmor.machine.view import COARSE, Drawing, colour_scale, draw, drawing
from pmor.machine.vtkhdf import write_bodies
from pmor.report.style import new_figure, plot_style, see_through
from pmor.sets.loader import SetFile

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Modes that are drawn, side by side.
MOST_DRAWN, COLUMNS, WIDTH_IN = 6, 2, 9.2
# Over how far the displacements of a loaded machine are drawn.
FURTHER = 2.0
# Steps of the scale of displacements over the largest.
LEVELS = np.linspace(0.0, 1.0, 11)


# In motion: points of the surfaces, and steps of a mode's cycle.
MOVING, CYCLE_STEPS = Detail(circle=36, profile=4, fillet=1, planes=5), 12


def as_gearbox(file: GearboxFile | SetFile, machine: MovingMachine) -> tuple[GearboxModel, MovingMachine]:
    """Return what is drawn of a file in motion: of a set by itself a gearbox without shafts in which it stands."""
    if isinstance(file, GearboxFile):
        return file.model, machine
    said = PlanetarySet(name=file.name, set=Path(file.name), sun="housing", carrier="housing")
    frame = set_frame(file.plan, 1.0, (0.0, 0.0, 0.0))
    stands = SetMeshing(said, file, (None,) * len(MEMBERS), frame, np.zeros((len(MEMBERS), NODE)), np.zeros((0, 3)))
    sections = GearboxSections(title=file.sections.title, shafts=(), bearings=(), loads=())
    return GearboxModel(sections, {}), replace(machine, gearbox=replace(machine.gearbox, sets=(stands,)))


def moving_bodies(model: GearboxModel, machine: MovingMachine, detail: Detail) -> tuple[list[Body], FloatArray]:
    """Return all bodies, planets each on its own hub, and the displacements of their nodes by those of the machine.

    Returns
    -------
    (list of Body, ndarray, shape (N, n))
        On carriers that turn, at the moment at which the first planet is above the sun.
    """
    gearbox, found = machine.gearbox, bodies(model, machine.gearbox, detail)
    # Behind the shafts and seats what stands still, as bodies have it.
    rows = [np.eye(len(gearbox.load), len(machine.mass)), np.zeros((NODE, len(machine.mass)))]
    node, place = len(gearbox.load) + NODE, len(found) - sum(len(one.file.plan.bodies) for one in gearbox.sets)
    for meshing, one in zip(gearbox.sets, machine.sets, strict=True):
        plan, turn = meshing.file.plan, meshing.frame.turn
        middle = member_places(model, meshing)[0]
        for body in plan.bodies:
            centre, count = turn[:3, :3] @ [body.x, body.y, body.z] + middle, len(found[place].rings)
            found[place] = replace(found[place], node=np.full(count, node), centre=np.tile(centre, (count, 1)))
            place, node = place + 1, node + NODE
        hubs = one.coordinates.bodies @ machine.padded(one.by)
        rows.append(np.kron(np.eye(len(plan.bodies)), turn) @ hubs)
    return found, np.concatenate(rows)


def drawn_modes(data: Data) -> list[int]:
    """Return the numbers of the modes that are drawn: those of the peaks, then those that strain the meshes most.

    Parameters
    ----------
    data : dict
        As of `pmor.dynamics.whine.output.whine_data`; the load is the one with the largest bearing force.
    """
    told = {mode["mode"]: mode for mode in shown_modes(data)}
    peaks = sorted(main_load(data)["peaks"], key=lambda peak: -float(peak["force_rms_N"]))
    strained = sorted(told, key=lambda number: -sum(told[number]["mesh_strain_energy_share"]))
    wanted = dict.fromkeys([peak["mode"] for peak in peaks] + strained)
    return sorted([number for number in wanted if number in told][:MOST_DRAWN])


def modes_figure(file: GearboxFile | SetFile, response: LoadResponse, numbers: Sequence[int]) -> Figure:
    """Natural modes of a machine by their numbers, a panel each, coloured by the share of the largest motion."""
    model, machine = as_gearbox(file, response.machine)
    found, by = moving_bodies(model, machine, COARSE)
    own = places_of(response, numbers)
    drawings = [_drawn(model, machine.gearbox, found, moved) for moved in (by @ response.modes.shape[:, own]).T]
    frequency = response.modes.frequency_Hz[own]
    rows, columns = math.ceil(len(numbers) / COLUMNS), min(COLUMNS, len(numbers))
    width, height = np.ptp(drawings[0].faces.corners[..., :2].reshape(-1, 2), axis=0)
    with plot_style():
        high = min(WIDTH_IN / columns * height / width, WIDTH_IN / COLUMNS)
        figure, scale = new_figure(WIDTH_IN, 0.5 + (high + 0.3) * rows), colour_scale(LEVELS)
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, number, of, drawn in zip(panels, numbers, frequency, drawings, strict=False):
            draw(axes, drawn, scale, 1.0 / drawn.largest)
            axes.set_title(f"mode {number}, {of:.4g} Hz")
        for axes in panels[len(numbers) :]:
            axes.set_visible(False)
        figure.colorbar(scale, ax=list(panels), label="displacement over the largest [-]", shrink=0.6)
        see_through(figure)
    return figure


def places_of(response: LoadResponse, numbers: Sequence[int]) -> IntArray:
    """Return the places of modes by their numbers, behind rotations that nothing holds."""
    return np.array(numbers, dtype=int) + int((response.modes.square == 0.0).sum()) - 1


def _drawn(model: GearboxModel, gearbox: LoadedGearbox, found: Sequence[Body], moved: FloatArray) -> Drawing:
    largest = drawing(model, gearbox, found, moved, 0.0, twist=True).largest
    size = max(float(abs(body.rings[..., 1:]).max()) for body in found)
    return drawing(model, gearbox, found, moved, FURTHER * exaggeration(size, np.array([largest])), twist=True)


def write_modes(
    file: GearboxFile | SetFile, response: LoadResponse, numbers: Sequence[int], target: Path
) -> None:  # fmt: skip
    """Write natural modes by their numbers in motion as VTKHDF, a cycle each, one after the other; OutputError.

    Time is the number of the mode and the share of its cycle; the largest displacement of each is 1 mm. Frequencies,
    Hz, are an attribute of the file.
    """
    own = places_of(response, numbers)
    found, by = moving_bodies(*as_gearbox(file, response.machine), MOVING)
    moved = by @ response.modes.shape[:, own]
    size = np.zeros(len(own))
    for body in found:
        size = np.maximum(size, [np.linalg.norm(body.displacement(one), axis=2).max() for one in moved.T])
    share = np.arange(CYCLE_STEPS) / CYCLE_STEPS
    steps = (np.array(numbers)[:, None] + share).ravel()

    def fields() -> Iterator[dict[str, FloatArray]]:
        for body in found:
            each = [body.displacement(one).reshape(-1, 3, 1) for one in (moved / size).T]
            yield {"displacement_mm": np.concatenate([one * np.cos(2.0 * np.pi * share) for one in each], axis=2)}

    frequency = response.modes.frequency_Hz[own]
    told = {"load": [response.solved.load.name], "frequency_Hz": frequency}
    write_bodies(found, target, told, steps, {"displacement_mm": 3}, fields())
