"""Rings for CalculiX, plane or half as wide as the faces: second-order elements, flanks that resolve the contact.

One layer of C3D20 whose nodes stay in their transverse planes, or some up to the plane of symmetry, on the true
outline. Rings are whole, or arcs with some teeth beside those that can touch. Each tooth that can touch has rows
of its own, `fine` (mm) where it touches or where its corner is, and coarser by distance; all other teeth have few. Both
have the same columns, so that all sectors fit together. Contact is surface to surface, under a penalty.
"""

import math
import re
from dataclasses import replace
from functools import partial
from unittest.mock import patch

import numpy as np

from pmor.fe import sector
from pmor.lab.rivals.calculix import BRICK_FACES, run_deck
from pmor.pair.model import held_radii
from tests.support.calculix_ring import fields, flank_rows, material_lines, mesh_lines, ring_of

# Rows of elements of teeth that are free, elements along a fillet and root land, growth of columns and rows.
FREE_ROWS, FILLET, COLUMN_GROWTH, ROW_GROWTH, COARSEST = 3, 12, 1.6, 0.8, 0.8
# Part of a pitch beyond the path of contact at which corners are still looked after.
MARGIN = 0.1
# Share of the STE by which the pinion is ahead at first: the overlap is then about as long as the contact.
START = 0.12
TOLERANCE = 1e-5
# Length of a flank's first element, mm, below which the fillet of an undercut tooth is graded to it.
FINE = 0.1
NAMES = "PINION", "WHEEL"


def plane_ste_um(case, pair, phi, fine, reach, penalty, expected_um, layers=0, beside=None):
    """STE of rings by CalculiX, um.

    `fine` is the length of elements up to `reach` (both mm) from a contact, `penalty` is in N/mm^3. With `layers`, so
    many elements over half the width, else plane strain; `beside` is how many teeth are kept on either side.
    """
    start = 1e-3 * START * expected_um
    turned = phi + start / pair.pinion.base_radius
    rings, touching = _rings(case, pair, turned, phi, fine, reach, layers, beside)
    width = "half" if layers else "plane_strain"
    return 1e3 * (start + driver_path(deck_of(case, pair, rings, touching, penalty, width)))


def driver_path(lines):
    """The path of the pinion's base circle that CalculiX finds, mm."""
    log, results = run_deck("\n".join(lines) + "\n")
    assert "best solution" not in log, "no equilibrium"
    return float(re.findall(r"displacements.*for set DRIVER.*\n\s*\n\s*\d+\s+(\S+)", results)[-1])


def graded_rows(tooth, roll, fine, reach):
    """Roll angles of nodes on a flank that touches at `roll`."""
    marks = 0.5 * tooth.base_radius
    arc = np.linspace(marks * tooth.form_roll_angle**2, marks * tooth.tip_roll_angle**2, 40001)
    return np.sqrt(graded(arc, np.abs(arc - marks * roll**2) - reach, fine) / marks)


def graded(arc, distance, fine, elements=None):
    """Nodes of second-order elements along an arc, `fine` apart and coarser by distance; so many elements, if told."""
    spacing = np.minimum(fine + ROW_GROWTH * np.maximum(distance, 0.0), COARSEST)
    count = np.append(0.0, np.cumsum(0.5 * (1.0 / spacing[1:] + 1.0 / spacing[:-1]) * np.diff(arc)))
    ends = np.interp(np.linspace(0.0, count[-1], (elements or math.ceil(count[-1])) + 1), count, arc)
    return np.append(np.stack([ends[:-1], 0.5 * (ends[1:] + ends[:-1])], axis=1).ravel(), ends[-1])


def _graded_fillet(fine, tooth, upper):
    """Nodes of an undercut tooth's upper fillet, as fine at the edge that undercut leaves as the flank beside it."""
    points = tooth.root_section(np.linspace(0.0, 1.0, 40001))
    points = points[: 1 + np.argmin(np.linalg.norm(points - upper[0], axis=1))]
    arc = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    nodes = graded(arc, arc, fine)
    return np.stack([np.interp(nodes, arc, points[:, d]) for d in range(2)], axis=-1)[::-1]


def _sector(tooth, held, width, roll, across, layers):
    first = 0.5 * tooth.base_radius * (roll[2] ** 2 - roll[0] ** 2)
    upper = {"upper": partial(_graded_fillet, first)} if tooth.is_undercut and first < FINE else {}
    with flank_rows(roll, FILLET, **upper), patch.object(sector, "_through_thickness", lambda *_: across):
        rows = (len(roll) - 1) // 2
        how = {"width": "half" if layers else "plane_strain", "order": 2}
        return sector.build_sector(tooth, held, width, rows, 2 * layers or 1, **how)


def _rings(case, pair, turned, phi, fine, reach, layers, beside):
    """Both gears, the pinion `turned` ahead of phi, and for each the teeth that can touch with their faces."""
    index = pair.touching_pairs(phi, MARGIN * pair.pitch)
    rolls = pair.contact_roll_angles(np.clip(phi + pair.pitch * index, *pair.roll_position_range))
    angles = turned, math.pi + pair.wheel_tooth_rotation(phi)
    rings, touching = [], []
    for gear, tooth in enumerate((pair.pinion, pair.wheel)):
        held, count = held_radii(case, pair)[gear], abs(tooth.teeth)
        at = np.clip(rolls[gear], *sorted((tooth.form_roll_angle, tooth.tip_roll_angle)))
        half_width = abs(tooth.flank_section(np.array([at.mean()]))[0, 0])
        across = sector._through_thickness(half_width, sector.LAYER_DEPTH * tooth.module, fine, COLUMN_GROWTH**2)
        free = np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, 2 * FREE_ROWS + 1)
        teeth = [int(i) % count for i in (index if gear == 0 else -index)]
        meshes = [_sector(tooth, held, pair.face_width, free, across, layers)] * count
        for number, roll in zip(teeth, at, strict=True):
            rows = graded_rows(tooth, roll, fine, reach)
            meshes[number] = _sector(tooth, held, pair.face_width, rows, across, layers)
        faces = flank_faces(meshes)
        ring = ring_of(meshes, angles[gear], (0.0, pair.centre_distance)[gear])
        rings.append(ring if beside is None else arc_of(ring, meshes, teeth, beside))
        touching.append([(tooth, faces[tooth]) for tooth in teeth])
    return rings, touching


def arc_of(ring, meshes, teeth, beside):
    """A ring of which the elements of teeth farther away than some beside those that touch are left out."""
    apart = np.abs((np.arange(len(meshes))[:, None] - teeth + len(meshes) // 2) % len(meshes) - len(meshes) // 2)
    kept = np.repeat(apart.min(axis=1) <= beside, [len(mesh.elements) for mesh in meshes])
    used = np.unique(ring.elements[kept])
    return replace(ring, used=used, bore=np.intersect1d(ring.bore, used), kept=kept)


def flank_faces(meshes):
    """Element, from 0, and CalculiX's number of each face on the flank of each tooth."""
    faces, first = [], 0
    for mesh in meshes:
        on_flank = np.isin(mesh.elements[:, :8], mesh.flank)
        faces.append([
            (first + int(e), face) for face, corners in enumerate(BRICK_FACES, 1)
            for e in np.flatnonzero(on_flank[:, corners].all(axis=1))
        ])  # fmt: skip
        first += len(mesh.elements)
    return faces


def deck_of(case, pair, rings, touching, penalty, width):
    """Lines of a deck: both gears, and for each the teeth that can touch with their faces; `width` as in cases."""
    plane = width == "plane_strain"
    starts = [(1, 1), (1 + len(rings[0].nodes), 1 + len(rings[0].elements))]
    for name, ring, gear, start in zip(NAMES, rings, (case.pair.pinion, case.pair.wheel), starts, strict=True):
        yield from mesh_lines(ring, f"{name}_ALL", name, *start)
        yield f"*NSET,NSET={name}_BORE"
        yield from (str(start[0] + n) for n in ring.bore)
        yield from material_lines(name, name, 1e3 * gear.youngs_modulus_GPa, gear.poisson_ratio)
    driver = starts[1][0] + len(rings[1].nodes)
    yield from ("*NODE,NSET=DRIVER", f"{driver},0,0,0", "*EQUATION")
    for n in rings[0].bore:
        x, y = rings[0].nodes[n, :2] / pair.pinion.base_radius
        for direction, ratio in ((1, -y), (2, x)):
            yield from ("2", f"{1 + n},{direction},-1,{driver},1,{fields([ratio])}")
    yield from ("*BOUNDARY", f"WHEEL_BORE,1,{2 if plane else 3}", "DRIVER,2,3")
    for name, ring, start in zip(NAMES, rings, starts, strict=True):
        # Bores, and the plane of symmetry; in plane strain all nodes.
        held = ring.used[ring.nodes[ring.used, 2] == 0.0] if width == "half" else ring.used if plane else ring.bore[:0]
        if not plane:
            held = np.union1d(held, ring.bore) if name == "PINION" else np.setdiff1d(held, ring.bore)
        yield from (f"{start[0] + n},3,3" for n in held)
    yield from ("*SURFACE INTERACTION,NAME=FLANKS", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR")
    yield fields([penalty])
    for both in zip(*touching, strict=True):
        names = [f"{name}_{tooth}" for name, (tooth, _) in zip(NAMES, both, strict=True)]
        for name, (_, faces), (_, element) in zip(names, both, starts, strict=True):
            yield f"*SURFACE,NAME={name},TYPE=ELEMENT"
            yield from (f"{element + e},S{face}" for e, face in faces)
        yield from ("*CONTACT PAIR,INTERACTION=FLANKS,TYPE=SURFACE TO SURFACE", ",".join(names))
    force = 1e3 * case.torque_Nm / pair.pinion.base_radius / (2.0 if width == "half" else 1.0)
    yield from ("*STEP", "*STATIC", "1,1", "*CONTROLS,PARAMETERS=FIELD", fields([TOLERANCE, TOLERANCE]))
    yield from ("*CLOAD", f"{driver},1,{fields([force])}", "*NODE PRINT,NSET=DRIVER", "U", "*END STEP")
