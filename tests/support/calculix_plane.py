"""Whole rings in plane strain for CalculiX: second-order elements, flanks that resolve the contact.

One layer of C3D20 whose nodes stay in their transverse planes, on the true outline. Each tooth that can touch has rows
of its own, `fine` (mm) where it touches or where its corner is, and coarser by distance; all other teeth have few. Both
have the same columns, so that all sectors fit together. Contact is surface to surface, under a penalty.
"""

import math
import os
import re
import subprocess
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

from pmor.core.conventions import rotation_z
from pmor.fe import sector
from pmor.fe.outline import tooth_outline
from pmor.lab.rivals.calculix import BRICK_FACES, PROGRAM

# Rows of elements of teeth that are free, elements along a fillet and root land, growth of columns and rows.
FREE_ROWS, FILLET, COLUMN_GROWTH, ROW_GROWTH, COARSEST = 3, 12, 1.6, 0.8, 0.8
# Part of a pitch beyond the path of contact at which corners are still looked after.
MARGIN = 0.1
# Share of the STE by which the pinion is ahead at first: the overlap is then about as long as the contact.
START = 0.12
TOLERANCE = 1e-5


@dataclass(frozen=True)
class Ring:
    """A gear of C3D20: nodes as placed, elements, nodes in use and on the bore, faces of each tooth's flank."""

    name: str
    nodes: np.ndarray
    elements: np.ndarray
    used: np.ndarray
    bore: np.ndarray
    faces: dict


def plane_ste_um(case, pair, phi, fine, reach, penalty, expected_um):
    """STE of whole rings by CalculiX, um.

    `fine` is the length of elements up to `reach` (both mm) from a contact, `penalty` is in N/mm^3.
    """
    start = 1e-3 * START * expected_um
    rings, teeth = _rings(case, pair, phi + start / pair.pinion.base_radius, phi, fine, reach)
    deck = "\n".join([*_deck(case, pair, rings, teeth, penalty)]) + "\n"
    with tempfile.TemporaryDirectory(prefix="pmor-plane-") as folder:
        (Path(folder) / "pair.inp").write_text(deck)
        environment = os.environ | {"OMP_NUM_THREADS": "1"}
        ran = subprocess.run([PROGRAM, "pair"], cwd=folder, capture_output=True, text=True, check=True, env=environment)
        results = (Path(folder) / "pair.dat").read_text()
    assert "best solution" not in ran.stdout, "no equilibrium"
    path = re.findall(r"displacements.*for set DRIVER.*\n\s*\n\s*\d+\s+(\S+)", results)[-1]
    return 1e3 * (start + float(path))


def _rows(tooth, roll, fine, reach):
    """Roll angles of nodes on a flank that touches at `roll`."""
    marks = 0.5 * tooth.base_radius
    arc = np.linspace(marks * tooth.form_roll_angle**2, marks * tooth.tip_roll_angle**2, 40001)
    spacing = np.minimum(fine + ROW_GROWTH * np.maximum(np.abs(arc - marks * roll**2) - reach, 0.0), COARSEST)
    count = np.append(0.0, np.cumsum(0.5 * (1.0 / spacing[1:] + 1.0 / spacing[:-1]) * np.diff(arc)))
    ends = np.interp(np.linspace(0.0, count[-1], math.ceil(count[-1]) + 1), count, arc)
    both = np.append(np.stack([ends[:-1], 0.5 * (ends[1:] + ends[:-1])], axis=1).ravel(), ends[-1])
    return np.sqrt(both / marks)


def _sector(tooth, gear, width, roll, across):
    def outline(tooth, _, spacing, order):
        made = tooth_outline(tooth, FILLET, spacing, order)
        return replace(made, flank=tooth.flank_section(roll), flank_roll_angle=roll)

    with patch.object(sector, "tooth_outline", outline), patch.object(sector, "_through_thickness", lambda *_: across):
        rows = (len(roll) - 1) // 2
        return sector.build_sector(tooth, gear.bore_radius_mm, width, rows, 1, width="plane_strain", order=2)


def _rings(case, pair, turned, phi, fine, reach):
    """Both gears, the pinion `turned` ahead of phi, and the numbers of their teeth that can touch."""
    index = pair.tooth_pair_count(phi, MARGIN * pair.pitch)
    rolls = pair.contact_roll_angles(np.clip(phi + pair.pitch * index, *pair.roll_position_range))
    angles = turned, math.pi + pair.wheel_tooth_rotation(phi)
    rings, teeth = [], []
    for gear, tooth in enumerate((pair.pinion, pair.wheel)):
        made_of = (case.pair.pinion, case.pair.wheel)[gear]
        at = np.clip(rolls[gear], tooth.form_roll_angle, tooth.tip_roll_angle)
        half_width = abs(tooth.flank_section(np.array([at.mean()]))[0, 0])
        across = sector._through_thickness(half_width, sector.LAYER_DEPTH * tooth.module, fine, COLUMN_GROWTH**2)
        free = np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, 2 * FREE_ROWS + 1)
        touching = [int(i) % tooth.teeth for i in (index if gear == 0 else -index)]
        meshes = [_sector(tooth, made_of, pair.face_width, free, across)] * tooth.teeth
        for number, roll in zip(touching, at, strict=True):
            rows = _rows(tooth, roll, fine, reach)
            meshes[number] = _sector(tooth, made_of, pair.face_width, rows, across)
        height = (0.0, pair.centre_distance)[gear]
        rings.append(_ring(("PINION", "WHEEL")[gear], meshes, angles[gear], height))
        teeth.append(touching)
    return rings, teeth


def _ring(name, meshes, angle, height):
    """Sectors put together; they share the nodes of their side faces."""
    numbers, nodes, count = [], [], 0
    for k, mesh in enumerate(meshes):
        right = np.concatenate([mesh.right, mesh.bore[-len(mesh.z) :]])
        own = np.setdiff1d(np.arange(len(mesh.nodes)), right)
        numbers.append(np.full(len(mesh.nodes), -1))
        numbers[-1][own] = count + np.arange(len(own))
        count += len(own)
        turn = rotation_z(2.0 * math.pi * k / len(meshes) + angle)
        nodes.append(mesh.nodes[own] @ turn.T + np.array([0.0, height, 0.0]))
    elements, faces, first = [], {}, 0
    for k, mesh in enumerate(meshes):
        right, before = np.concatenate([mesh.right, mesh.bore[-len(mesh.z) :]]), meshes[k - 1]
        numbers[k][right] = numbers[k - 1][np.concatenate([before.left, before.bore[: len(before.z)]])]
        on_flank = np.isin(mesh.elements[:, :8], mesh.flank)
        faces[k] = [
            (first + int(e), face) for face, corners in enumerate(BRICK_FACES, 1)
            for e in np.flatnonzero(on_flank[:, corners].all(axis=1))
        ]  # fmt: skip
        first += len(mesh.elements)
    elements = np.concatenate([n[mesh.elements[:, :20]] for n, mesh in zip(numbers, meshes, strict=True)])
    used = np.unique(elements)
    bore = np.intersect1d(np.concatenate([n[mesh.bore] for n, mesh in zip(numbers, meshes, strict=True)]), used)
    return Ring(name, np.concatenate(nodes), elements, used, bore, faces)


def _deck(case, pair, rings, teeth, penalty):
    starts = [(1, 1), (1 + len(rings[0].nodes), 1 + len(rings[0].elements))]
    for ring, material, (node, element) in zip(rings, (case.pair.pinion, case.pair.wheel), starts, strict=True):
        yield f"*NODE,NSET={ring.name}_ALL"
        yield from (f"{node + n},{_numbers(ring.nodes[n])}" for n in ring.used)
        yield f"*ELEMENT,TYPE=C3D20,ELSET={ring.name}"
        for e, corners in enumerate((ring.elements + node).tolist()):
            yield f"{element + e}," + ",".join(map(str, corners[:15])) + ","
            yield ",".join(map(str, corners[15:]))
        yield f"*NSET,NSET={ring.name}_BORE"
        yield from (str(node + n) for n in ring.bore)
        yield from (f"*MATERIAL,NAME={ring.name}", "*ELASTIC")
        yield _numbers([1e3 * material.youngs_modulus_GPa, material.poisson_ratio])
        yield f"*SOLID SECTION,ELSET={ring.name},MATERIAL={ring.name}"
    driver = starts[1][0] + len(rings[1].nodes)
    yield from ("*NODE,NSET=DRIVER", f"{driver},0,0,0", "*EQUATION")
    for n in rings[0].bore:
        x, y = rings[0].nodes[n, :2] / pair.pinion.base_radius
        for direction, ratio in ((1, -y), (2, x)):
            yield from ("2", f"{1 + n},{direction},-1,{driver},1,{_numbers([ratio])}")
    yield from ("*BOUNDARY", "WHEEL_BORE,1,2", "PINION_ALL,3,3", "WHEEL_ALL,3,3", "DRIVER,2,3")
    yield from ("*SURFACE INTERACTION,NAME=FLANKS", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR")
    yield _numbers([penalty])
    for both in zip(*teeth, strict=True):
        names = [f"{ring.name}_{tooth}" for ring, tooth in zip(rings, both, strict=True)]
        for ring, tooth, name, (_, element) in zip(rings, both, names, starts, strict=True):
            yield f"*SURFACE,NAME={name},TYPE=ELEMENT"
            yield from (f"{element + e},S{face}" for e, face in ring.faces[tooth])
        yield from ("*CONTACT PAIR,INTERACTION=FLANKS,TYPE=SURFACE TO SURFACE", ",".join(names))
    force = 1e3 * case.torque_Nm / pair.pinion.base_radius
    yield from ("*STEP", "*STATIC", "1,1", "*CONTROLS,PARAMETERS=FIELD", _numbers([TOLERANCE, TOLERANCE]))
    yield from ("*CLOAD", f"{driver},1,{_numbers([force])}", "*NODE PRINT,NSET=DRIVER", "U", "*END STEP")


def _numbers(values):
    return ",".join(f"{value:.13e}" for value in values)
