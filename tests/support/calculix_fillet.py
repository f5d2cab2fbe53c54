"""A gear with one loaded tooth for CalculiX, its fillets finely meshed: an independent solution for the root stress.

A whole ring of C3D20, bore fixed. The loaded tooth's sector has elements of `FILLET_MM` along its fillets, thinner than
that below the surface; the other teeth are coarse. A line load acts on a row of nodes of the flank, along its normal.
"""

import os
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

from pmor.fe import sector
from pmor.fe.element import tributary_widths
from pmor.lab.rivals.calculix import PROGRAM
from tests.support.calculix_ring import fields, flank_rows, material_lines, mesh_lines, ring_of

FREE_ROWS, FREE_FILLET = 3, 8
# Elements of the loaded tooth: below the surface and their growth, over the flank on either side of the load.
FIRST_MM, GROWTH, FLANK_ROWS = 0.08, 1.5, 10


def _across(half_width, first):
    """Places through half the tooth, from its surface inwards, 0 to 1."""
    count = int(np.ceil(np.log(1.0 + (GROWTH - 1.0) * half_width / first) / np.log(GROWTH)))
    steps = GROWTH ** np.arange(count)
    return np.append(0.0, np.cumsum(steps)) / steps.sum()


def _sector(tooth, bore_mm, z, roll, fillet, across, depth):
    """One sector, on columns at z, with flank nodes at roll angles and so many elements along the fillet."""

    with (
        flank_rows(roll, int(np.ceil(fillet / 0.4))),
        patch.object(sector, "_through_thickness", lambda *_: across),
        patch.object(sector, "_graded", lambda *_: depth),
    ):
        rows, wide = (len(roll) - 1) // 2, (len(z) - 1) // 2
        made = sector.build_sector(tooth, bore_mm, 1.0, rows, wide, order=2)
    nodes = made.nodes.copy()
    nodes[:, 2] = np.tile(z, len(nodes) // len(z))
    return replace(made, nodes=nodes, z=z)


def fillet_stress(tooth, bore_mm, youngs_mpa, poisson, z, plane, roll_load, line_load, fillet_mm):
    """Nodes and stress tensors (xx, yy, zz, xy, yz, zx) of the loaded tooth's fillets: loaded side, other side.

    The gear goes from ``z[0]`` to ``z[-1]``, where its plane of symmetry is; in plane strain no node moves along z.
    """
    low, high = (0.5 * tooth.base_radius * u**2 for u in (tooth.form_roll_angle, tooth.tip_roll_angle))
    at = 0.5 * tooth.base_radius * roll_load**2
    arc = np.append(np.linspace(low, at, 2 * FLANK_ROWS + 1), np.linspace(at, high, 2 * FLANK_ROWS + 1)[1:])
    fine_roll = np.sqrt(2.0 * arc / tooth.base_radius)
    free_roll = np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, 2 * FREE_ROWS + 1)
    fillet = tooth.root_section(np.linspace(0.0, 1.0, 2001))
    length = np.linalg.norm(np.diff(fillet, axis=0), axis=1).sum()
    count = 2 * int(np.ceil(length / fillet_mm))
    height = tooth.root_radius - bore_mm
    depth, half = _across(height, FIRST_MM), abs(tooth.flank_section(fine_roll[:1])[0, 0])
    fine = _sector(tooth, bore_mm, z, fine_roll, count, _across(half, FIRST_MM), depth)
    free = _sector(tooth, bore_mm, z, free_roll, FREE_FILLET, np.linspace(0.0, 1.0, 3), depth)
    return _solve(tooth, [fine] + [free] * (abs(tooth.teeth) - 1), plane, youngs_mpa, poisson, roll_load, line_load)


def _solve(tooth, meshes, plane, youngs_mpa, poisson, roll_load, line_load):
    ring = ring_of(meshes)
    mesh = meshes[0]
    row = np.abs(mesh.flank_roll_angle - roll_load).argmin()
    loaded = ring.numbers[0][mesh.flank[row]]
    kept = np.isin(loaded, ring.used)
    force = -line_load * tributary_widths(mesh.z, 2)[:, None] * tooth.flank_normal(np.array(roll_load), np.array(0.0))
    assert kept.all(), "the loaded row has nodes in the middle of faces"
    layers = len(mesh.z)
    sides = []
    upper = [row.reshape(-1, layers) for row in mesh.tooth_rows[: len(mesh.tooth_rows) - len(mesh.flank) + 1]]
    top = mesh.ring_rows[0].reshape(-1, layers)
    lower = int(np.flatnonzero(top[:, 0] == mesh.tooth_rows[0][0])[0])
    for end, land in ((0, top[: lower + 1][::-1]), (-1, top[len(top) - 1 - lower :])):
        line = np.concatenate([np.stack([row[end] for row in upper[::-1]]), land[1:]])
        ids = ring.numbers[0][line].ravel()
        sides.append(ids[np.isin(ids, ring.used)])
    lines = _deck(ring, loaded, force, np.concatenate(sides), plane, mesh.z[-1], youngs_mpa, poisson)
    with tempfile.TemporaryDirectory(prefix="pmor-fillet-") as folder:
        (Path(folder) / "gear.inp").write_text("\n".join(lines) + "\n")
        environment = os.environ | {"OMP_NUM_THREADS": "1"}
        ran = subprocess.run([PROGRAM, "gear"], cwd=folder, capture_output=True, text=True, check=True, env=environment)
        assert "Job finished" in ran.stdout, ran.stdout[-400:]
        stress = _read_stress((Path(folder) / "gear.frd").read_text())
    return [(ring.nodes[ids], np.stack([stress[int(i) + 1] for i in ids])) for ids in sides]


def _deck(ring, loaded, force, fillet, plane, symmetry, youngs_mpa, poisson):
    yield from mesh_lines(ring, "ALL", "GEAR")
    middle = ring.used[ring.nodes[ring.used, 2] > symmetry - 1e-9]
    for name, ids in (("BORE", ring.bore), ("FILLET", np.unique(fillet)), ("MID", middle)):
        yield f"*NSET,NSET={name}"
        yield from (str(i + 1) for i in ids)
    yield from material_lines("STEEL", "GEAR", youngs_mpa, poisson)
    yield from ("*BOUNDARY", "BORE,1,3", "ALL,3,3" if plane else "MID,3,3", "*STEP", "*STATIC", "*CLOAD")
    for node, components in zip(loaded, force, strict=True):
        yield from (f"{node + 1},{d + 1},{fields([components[d]])}" for d in range(2))
    yield from ("*EL FILE,NSET=FILLET", "S", "*END STEP")


def _read_stress(text):
    """Stress tensors by node from CalculiX's file of results: lines of fixed columns behind the heading STRESS."""
    found, inside = {}, False
    for line in text.splitlines():
        if line.startswith(" -4"):
            inside = "STRESS" in line
        elif inside and line.startswith(" -1"):
            found[int(line[3:13])] = np.array([float(line[13 + 12 * i : 25 + 12 * i]) for i in range(6)])
        elif inside and line.startswith(" -3"):
            inside = False
    return found


def largest_principal(stress):
    """Largest principal stresses of tensors (xx, yy, zz, xy, yz, zx)."""
    xx, yy, zz, xy, yz, zx = np.moveaxis(stress, -1, 0)
    tensor = np.stack([np.stack([xx, xy, zx], -1), np.stack([xy, yy, yz], -1), np.stack([zx, yz, zz], -1)], -2)
    return np.linalg.eigvalsh(tensor)
