"""The same pair in CalculiX: an independent finite-element contact solver on the same mesh.

CalculiX (Guido Dhondt, http://www.calculix.de) is a program of its own, `ccx`; only `calculix_ste` needs it. Both gears
go into one input deck as whole rings, or arcs of them, with the deviations of their flanks, in their exact kinematic
position with the pinion a little ahead. The wheel's bore is fixed. The pinion's bore turns rigidly with one scalar
unknown, the path s of its base circle: u = (s / r_b) e_z x X; the torque T is the force T / r_b on that unknown.
Strains are linear.

Differences of CalculiX:

* Its surface is the faces of the elements. Those of linear ones are our ``scheme = "facet"``, ``lodm_profile = 1``.
* ``node_to_surface`` is our nodal scheme: penalty times area at the nodes of one gear, the slave. It counts a node
  wholly or not at all at the tip edge of the mate, where ours weights it by the area that faces the mate.
* ``surface_to_surface`` integrates the pressure over the facets: the limit of our facets with ever more LoDM.
* ``hex8`` is its C3D8. Its C3D8I is ``hex8i`` without the factor det(J_0) / det(J) on the incompatible gradients.
* ``hex20`` is its C3D20 with the dilatation projected, to round-off where there is no lateral contraction. Their faces
  are curved through eight nodes: with pressure integrated over them the STE differs from that of our Hermite patches by
  -17, 1.5 and -0.3 % with 6, 12 and 24 elements, and ``node_to_surface`` by 5-15 %.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from pmor.case import Case, GearCase
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.conventions import rotation_z
from pmor.core.errors import ConvergenceError, ExternalProgramError
from pmor.fe.completion import nodes_of_elements
from pmor.fe.element import QUADRATIC_NODES
from pmor.fe.sector import SectorMesh
from pmor.fe.whole_gear import whole_gear_mesh
from pmor.gear.kernels.deviation import Deviation
from pmor.gear.tooth import Tooth
from pmor.lab.rivals.deviated_mesh import flank_shift
from pmor.pair.conditions import assembly_of
from pmor.pair.model import MeshModel, assemble_pair
from pmor.penalty.pair import as_penalty
from pmor.penalty.position import active_patches
from pmor.penalty.search import search_contact
from pmor.penalty.solve import surface_error

PROGRAM = "ccx"
Contact = Literal["node_to_surface", "surface_to_surface"]
Slave = Literal["pinion", "wheel"]
ELEMENTS = {"hex8": "C3D8", "hex8i": "C3D8I", "hex20": "C3D20"}
# It reads so many entries of a line.
ENTRIES = 16
# Corners of the faces S1 to S6 of an eight-node brick.
BRICK_FACES = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
# With this overlap, of the approach that is expected, it converged at once: with none the pinion is loose, and with too
# much Newton overshoots and loses the contact. Between 0.1 and 0.5 it moves the nodal STE by less than 2e-5.
START_OVERLAP = 0.3
# How far beyond the path of contact a tooth pair gets a contact pair, of the pitch; idle ones cost little.
MARGIN = 0.1
# Its node-to-surface law is rounded near zero gap; a tensile stress this small (MPa) makes it our broken line.
TENSION = 1e-3
# Relative residual and correction at which its Newton iteration stops; by default 5e-3 and 1e-2.
TOLERANCE = 1e-6


@dataclass(frozen=True)
class CalculixSolution:
    """Static equilibrium by CalculiX."""

    ste_um: float  # Static transmission error, um
    seconds: float  # Wall time of the program
    unknowns: int  # Size of its system of equations
    iterations: int  # Newton iterations, each with a factorisation


@dataclass(frozen=True)
class PlacedGear:
    """A gear in the global frame, some of its sectors; all its numbers continue those of the gear before it, from 1.

    `elements` has no columns of nodes in the middle of faces; `nodes` holds such nodes too.
    """

    name: str
    material: GearCase
    nodes: FloatArray
    first_node: int
    elements: IntArray
    first_element: int
    bore: IntArray
    mesh: SectorMesh
    sectors: IntArray


def calculix_available() -> bool:
    """Whether CalculiX is installed."""
    return shutil.which(PROGRAM) is not None


def calculix_ste(
    case: Case, mesh: MeshModel, phi: float, torque: float, contact: Contact = "node_to_surface",
    slave: Slave = "pinion", beside: int | None = None,
) -> CalculixSolution:  # fmt: skip
    """Solve one position with CalculiX.

    Parameters
    ----------
    case : Case
        Gives the materials, the element and the penalty; surface, LoDM and slave are CalculiX's own.
    mesh : MeshModel
        Of that case.
    phi, torque : float
        Pinion angle, rad, and torque on the pinion, N mm.
    contact : {"node_to_surface", "surface_to_surface"}
    slave : {"pinion", "wheel"}
    beside : int, optional
        Teeth kept on either side of those that can touch; by default the rings are whole.

    Raises
    ------
    ExternalProgramError
        When the program is not installed, or stops for another reason than the next one.
    ConvergenceError
        When its Newton iteration does not converge.
    """
    if not calculix_available():
        raise ExternalProgramError(f"{PROGRAM}: not found; install CalculiX (Debian: apt-get install calculix-ccx)")
    base_radius = mesh.meshed.pair.pinion.base_radius
    advance = _first_touch(case, mesh, phi, slave) + START_OVERLAP * mesh.meshed.expected_approach(torque) / base_radius
    deck = input_deck(case, mesh, phi, torque, advance, contact, slave, beside)
    start = time.perf_counter()
    log, results = run_deck(deck)
    seconds = time.perf_counter() - start
    path = _path_of_the_base_circle(log, results, phi)
    return CalculixSolution(
        ste_um=(advance * base_radius + path) * 1e3,
        seconds=seconds,
        unknowns=int(re.findall(r"number of equations\s+(\d+)", log)[-1]),
        iterations=len(re.findall(r"^ iteration +\d+", log, re.MULTILINE)),
    )


def input_deck(
    case: Case, mesh: MeshModel, phi: float, torque: float, advance: float, contact: Contact, slave: Slave,
    beside: int | None = None,
) -> str:  # fmt: skip
    """Return the input deck of one position; the undeformed pinion is placed `advance` (rad) ahead."""
    meshed = mesh.meshed
    pairs = meshed.pair.touching_pairs(phi, MARGIN * meshed.pair.pitch)
    gears = place_gears(case, mesh, phi, advance, pairs, beside)
    driver = gears[1].first_node + len(gears[1].nodes)
    lines: list[str] = []
    for gear in gears:
        lines += gear_lines(gear, ELEMENTS[case.mesh.element])
    lines += _support_lines(gears, driver, meshed.pair.pinion.base_radius)
    penalty = case.contact.penalty_N_mm3
    law = _numbers((penalty, TENSION) if contact == "node_to_surface" else (penalty,))
    lines += ("*SURFACE INTERACTION,NAME=FLANKS", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR", law)
    for index in pairs:
        lines += _contact_pair_lines(gears, int(index), contact, slave)
    return "\n".join([*lines, *_step_lines(driver, torque / meshed.pair.pinion.base_radius)]) + "\n"


def _first_touch(case: Case, mesh: MeshModel, phi: float, slave: Slave) -> float:
    """Return the advance at which the undeformed facets touch, rad."""
    contact = replace(case.contact, scheme="facet", lodm_profile=1, lodm_width=1, slave=slave)
    gears = mesh.pinion, mesh.wheel
    nodes = gears[0].flank_nodes, gears[1].flank_nodes
    rolls = gears[0].flank_roll_angle, gears[1].flank_roll_angle
    facets = as_penalty(assemble_pair(replace(case, contact=contact), mesh.meshed.pair, nodes, rolls))
    position = active_patches(facets, phi, 2.0 * surface_error(facets), assembly_of(case))
    advance = position.kernel_pair.kinematics.first_touch
    for _ in range(5):
        gap = search_contact(facets, position, np.zeros_like(position.nodes), advance).smallest_gap
        advance += gap / facets.pair.pinion.base_radius
    return advance


def place_gears(
    case: Case, mesh: MeshModel, phi: float, advance: float, pairs: IntArray, beside: int | None
) -> tuple[PlacedGear, PlacedGear]:
    """Place both gears as `calculix_ste` does with these arguments; `pairs` are the tooth pairs that can touch."""
    pair = mesh.meshed.pair
    kept = np.arange(pairs[0] - (beside or 0), pairs[-1] + (beside or 0) + 1)
    # The wheel's teeth are numbered against its own counter-clockwise sense.
    sectors = [
        np.arange(teeth) if beside is None else np.unique(side * kept % teeth)
        for teeth, side in ((pair.pinion.teeth, 1), (pair.wheel.teeth, -1))
    ]
    on_wheel = math.pi + pair.wheel_tooth_rotation(phi)
    deviations = mesh.meshed.deviations(assembly_of(case))
    pinion = _place("PINION", case.pair.pinion, mesh.pinion, (pair.pinion, deviations[0]), sectors[0], phi + advance,
                   0.0, 1, 1)  # fmt: skip
    wheel = _place("WHEEL", case.pair.wheel, mesh.wheel, (pair.wheel, deviations[1]), sectors[1], on_wheel,
                   pair.centre_distance, 1 + len(pinion.nodes), 1 + len(pinion.elements))  # fmt: skip
    return pinion, wheel


def _place(
    name: str, material: GearCase, mesh: SectorMesh, flanks: tuple[Tooth, Deviation], sectors: IntArray, angle: float,
    height: float, first_node: int, first_element: int,
) -> PlacedGear:  # fmt: skip
    """Turn a gear with deviated flanks by `angle` (rad) and put its axis at (0, `height`)."""
    nodes, elements, numbers = whole_gear_mesh(mesh)
    elements = elements[:, :QUADRATIC_NODES]
    nodes[numbers[:, mesh.flank]] += flank_shift(mesh, *flanks)
    placed = nodes @ rotation_z(angle).T + np.array([0.0, height, 0.0])
    bore = first_node + np.unique(numbers[sectors][:, nodes_of_elements(mesh, mesh.bore)])
    return PlacedGear(name, material, placed, first_node, first_node + elements, first_element, bore, mesh, sectors)


def gear_lines(gear: PlacedGear, element: str) -> Iterator[str]:
    """Lines of a gear's nodes, elements (of CalculiX's name `element`), bore and material."""
    name, material = gear.name, gear.material
    count = len(gear.mesh.elements)
    kept = (gear.sectors[:, None] * count + np.arange(count)).ravel()
    yield "*NODE"
    yield from (f"{n},{_numbers(gear.nodes[n - gear.first_node])}" for n in np.unique(gear.elements[kept]))
    yield f"*ELEMENT,TYPE={element},ELSET={name}"
    for e in kept:
        entries = [str(n) for n in (gear.first_element + e, *gear.elements[e])]
        yield ",\n".join(",".join(entries[i : i + ENTRIES]) for i in range(0, len(entries), ENTRIES))
    yield f"*NSET,NSET={name}_BORE"
    yield from map(str, gear.bore)
    yield f"*MATERIAL,NAME={name}"
    yield "*ELASTIC"
    yield _numbers((1e3 * material.youngs_modulus_GPa, material.poisson_ratio))
    yield f"*SOLID SECTION,ELSET={name},MATERIAL={name}"


def _support_lines(gears: tuple[PlacedGear, PlacedGear], driver: int, base_radius: float) -> Iterator[str]:
    """Fix the wheel's bore; let the pinion's turn with the first unknown of the node `driver`."""
    pinion = gears[0]
    yield "*NODE,NSET=DRIVER"
    yield f"{driver},0,0,0"
    yield "*EQUATION"
    for node in pinion.bore:
        x, y = pinion.nodes[node - pinion.first_node, :2] / base_radius
        for direction, path_ratio in ((1, -y), (2, x)):
            yield "2"
            yield f"{node},{direction},-1,{driver},1,{_numbers([path_ratio])}"
    yield from ("*BOUNDARY", "WHEEL_BORE,1,3", "PINION_BORE,3,3", "DRIVER,2,3")


def _contact_pair_lines(
    gears: tuple[PlacedGear, PlacedGear], index: int, contact: Contact, slave: Slave
) -> Iterator[str]:
    teeth = index % gears[0].mesh.teeth, -index % gears[1].mesh.teeth
    names = [f"{gear.name}_{tooth}" for gear, tooth in zip(gears, teeth, strict=True)]
    for gear, name, tooth in zip(gears, names, teeth, strict=True):
        yield from _flank_lines(gear, name, tooth)
    yield f"*CONTACT PAIR,INTERACTION=FLANKS,TYPE={contact.replace('_', ' ').upper()}"
    yield ",".join(names if slave == "pinion" else names[::-1])


def _flank_lines(gear: PlacedGear, name: str, tooth: int) -> Iterator[str]:
    mesh = gear.mesh
    first = gear.first_element + tooth * len(mesh.elements)
    on_flank = np.isin(mesh.elements, mesh.flank)
    yield f"*SURFACE,NAME={name},TYPE=ELEMENT"
    for face, corners in enumerate(BRICK_FACES, 1):
        yield from (f"{first + e},S{face}" for e in np.flatnonzero(on_flank[:, corners].all(axis=1)))


def _step_lines(driver: int, force: float) -> Iterator[str]:
    yield from ("*STEP", "*STATIC", "1,1", "*CONTROLS,PARAMETERS=FIELD", _numbers((TOLERANCE, TOLERANCE)))
    yield from ("*CLOAD", f"{driver},1,{_numbers([force])}", "*NODE PRINT,NSET=DRIVER", "U", "*END STEP")


def _numbers(values: Iterable[float]) -> str:
    # CalculiX reads the first 20 characters of a field and would cut off an exponent behind them.
    return ",".join(f"{value:.13e}" for value in values)


def run_deck(deck: str) -> tuple[str, str]:
    """Run the program on a deck; return its log and its table of results (empty when there is none)."""
    with tempfile.TemporaryDirectory(prefix="pmor-calculix-") as folder:
        (Path(folder) / "pair.inp").write_text(deck)
        ran = subprocess.run([PROGRAM, "pair"], cwd=folder, capture_output=True, text=True, check=False)
        table = Path(folder) / "pair.dat"
        return ran.stdout + ran.stderr, table.read_text() if table.exists() else ""


def _path_of_the_base_circle(log: str, results: str, phi: float) -> float:
    """Return the displacement of the driver, mm; raise when there is none."""
    if "best solution and residuals" in log:
        raise ConvergenceError(f"{PROGRAM}: no equilibrium at phi = {phi:.6g} rad")
    rows = re.findall(r"displacements.*for set DRIVER.*\n\s*\n\s*\d+\s+(\S+)", results)
    if "Job finished" not in log or not rows:
        errors = re.findall(r"\*ERROR.*(?:\n {2,}\S.*)*", log)
        message = " ".join((errors or [log.strip()[-200:] or "nothing"])[0].split())
        raise ExternalProgramError(f"{PROGRAM}: stopped at phi = {phi:.6g} rad; it says: {message}")
    return float(rows[-1])
