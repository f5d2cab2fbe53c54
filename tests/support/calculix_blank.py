"""A pinion against a wheel on its whole blank for CalculiX: rim, web, hub and round holes of C3D20, spur, full width.

The blank is meshed without anything of the program's own blanks: columns of nodes go on from the sectors' ends, the
rim's inner cylinder, down to the bore. Around a hole part of the web's grid, three by three blocks, gives up the block
in the middle, and the others are drawn around it. The pinion is an arc of a thin rim.
"""

import math
from dataclasses import dataclass, replace
from unittest.mock import patch

import numpy as np

from pmor.fe import sector
from pmor.fe.element import node_places
from pmor.pair.model import held_radii
from tests.support.calculix_plane import MARGIN, START, arc_of, deck_of, driver_path, flank_faces, graded_rows
from tests.support.calculix_ring import flank_rows, ring_of

# Elements along a fillet and root land of teeth that can touch and of others, rows of these, growth of columns.
FILLET, FREE_FILLET, FREE_ROWS, COLUMN_GROWTH = 5, 1, 2, 1.7
# Teeth of the pinion that are kept beside those that can touch.
BESIDE = 2
# Half the height of a hole's grid over that of the web, and its half-width over its height.
BOX, WIDE = 0.85, 1.3
# How much rows of a web crowd where it meets hub and rim: a sine of the place on it.
BOTH_ENDS = 0.14


@dataclass(frozen=True)
class BlankMesh:
    """Rows of elements of rim, web and hub, and lines of elements over the width, or half of it up to 0, mm."""

    rim_rows: int
    web_rows: int
    hub_rows: int
    z: tuple[float, ...]


def blank_ste_um(case, pair, phi, fine, reach, penalty, expected_um, made):
    """STE of a pair whose wheel stands on its blank by CalculiX, um; arguments as in `plane_ste_um`."""
    start = 1e-3 * START * expected_um
    index = pair.touching_pairs(phi, MARGIN * pair.pitch)
    rolls = pair.contact_roll_angles(np.clip(phi + pair.pitch * index, *pair.roll_position_range))
    angles = phi + start / pair.pinion.base_radius, math.pi + pair.wheel_tooth_rotation(phi)
    rings, touching = [], []
    for gear, tooth in enumerate((pair.pinion, pair.wheel)):
        end = held_radii(case, pair)[0]
        if gear == 1:
            end = tooth.root_radius - case.pair.wheel.blank.rim_thickness_mm
        at = np.clip(rolls[gear], tooth.form_roll_angle, tooth.tip_roll_angle)
        teeth = [int(i) % tooth.teeth for i in (index if gear == 0 else -index)]
        meshes = _sectors(tooth, end, pair.face_width, dict(zip(teeth, at, strict=True)), fine, reach, made)
        faces = flank_faces(meshes)
        ring = ring_of(meshes, angles[gear], (0.0, pair.centre_distance)[gear])
        if gear == 0:
            rings.append(arc_of(ring, meshes, teeth, BESIDE))
        else:
            turned = pair.wheel_tooth_rotation(phi) - pair.wheel_tooth_rotation(0.0)
            rings.append(_on_blank(ring, meshes, case.pair.wheel, pair, turned, made))
        touching.append([(tooth, faces[tooth]) for tooth in teeth])
    width = "half" if made.z[-1] == 0.0 else "whole"
    return 1e3 * (start + driver_path(deck_of(case, pair, rings, touching, penalty, width)))


def _sectors(tooth, end, width, touching, fine, reach, made):
    """Sectors of a spur gear down to a radius; those of some teeth, by roll angle, resolve the contact."""
    ends = tooth.form_roll_angle, tooth.tip_roll_angle
    half_width = abs(tooth.flank_section(np.array([np.mean(ends)]))[0, 0])
    across = sector._through_thickness(half_width, sector.LAYER_DEPTH * tooth.module, fine, COLUMN_GROWTH**2)
    depth, lines = _crowded(made.rim_rows), np.array(made.z)
    z = _with_middles(lines)

    def built(roll, fillet, columns):
        with (
            flank_rows(roll, fillet),
            patch.object(sector, "_through_thickness", lambda *_: columns),
            patch.object(sector, "_graded", lambda *_: depth),
        ):
            mesh = sector.build_sector(tooth, end, width, (len(roll) - 1) // 2, len(lines) - 1, order=2)
        nodes = mesh.nodes.reshape(-1, len(z), 3).copy()
        nodes[..., 2] = z
        return replace(mesh, nodes=nodes.reshape(-1, 3), z=z)

    meshes = [built(np.linspace(*ends, 2 * FREE_ROWS + 1), FREE_FILLET, np.array([0.0, 1.0]))] * tooth.teeth
    for number, roll in touching.items():
        meshes[number] = built(graded_rows(tooth, roll, fine, reach), FILLET, across)
    return meshes


def _crowded(rows):
    """Lines between rows of elements from 0 to 1, where they are finer."""
    return 1.0 - (1.0 - np.linspace(0.0, 1.0, rows + 1)) ** 2


def _with_middles(lines):
    return np.insert(lines, np.arange(1, len(lines)), 0.5 * (lines[1:] + lines[:-1]))


def _on_blank(ring, meshes, gear, pair, turned, made):
    """A ring of sectors with what it stands on: its elements, and the bore instead of the rim's inner cylinder."""
    blank, z = gear.blank, meshes[0].z
    columns = [n[mesh.bore].reshape(-1, len(z))[:0:-1] for n, mesh in zip(ring.numbers, meshes, strict=True)]
    rim = np.concatenate(columns)  # counter-clockwise, (columns, layers)
    centre = np.array([0.0, pair.centre_distance])
    off = ring.nodes[rim[:, 0], :2] - centre
    angle, inner = np.unwrap(np.arctan2(off[:, 1], off[:, 0])), float(np.hypot(*off[0]))
    places = np.linspace(-1.0, 1.0, made.web_rows + 1)
    web = 0.5 + 0.5 * places + BOTH_ENDS * np.sin(np.pi * places)
    hub, web = (
        _with_middles(first + (last - first) * share) for first, last, share in (
            (gear.bore_radius_mm, blank.hub_radius_mm, _crowded(made.hub_rows)), (blank.hub_radius_mm, inner, web)
        )
    )  # fmt: skip
    radius = np.append(hub, web[1:])
    nodes = np.empty((len(radius), len(angle), 2))
    nodes[..., 0], nodes[..., 1] = radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
    material = np.ones((len(radius) // 2, len(angle) // 2, len(z) // 2), dtype=bool)
    outside = np.abs(z[1::2] - blank.web_offset_mm) > 0.5 * blank.web_thickness_mm
    material[made.hub_rows :, :, outside] = False
    if blank.holes is not None:
        # From the line to the mate's centre, which points downwards.
        first = -0.5 * math.pi + math.radians(blank.holes.first_deg) + turned
        for k in range(blank.holes.count):
            at = first + 2.0 * math.pi * k / blank.holes.count
            _pierce(nodes, material, radius, angle, 2 * made.hub_rows, blank.holes, at)
    nodes += centre
    placed = np.empty((*nodes.shape[:2], len(z), 3))
    placed[..., :2], placed[..., 2] = nodes[:, :, None], z
    grid = len(ring.nodes) + np.arange(placed[..., 0].size).reshape(placed.shape[:3])
    grid[-1] = rim
    closed = np.concatenate([grid, grid[:, :1]], axis=1)
    windows = np.lib.stride_tricks.sliding_window_view(closed, (3, 3, 3))[::2, ::2, ::2]
    bricks = windows[material][(slice(None), *node_places(2)[:20].T)]
    all_nodes = np.concatenate([ring.nodes, placed.reshape(-1, 3)])
    used = np.union1d(ring.used, bricks)
    elements = np.concatenate([ring.elements, bricks])
    kept = np.ones(len(elements), dtype=bool)
    return replace(ring, nodes=all_nodes, elements=elements, used=used, bore=np.intersect1d(grid[0], used), kept=kept)


def _pierce(nodes, material, radius, angle, hub, holes, at):
    """Draw the grid of a web around a hole at an angle, and take out what would be in it."""
    middle = holes.on_radius_mm * np.array([math.cos(at), math.sin(at)])
    height = BOX * min(holes.on_radius_mm - radius[hub], radius[-1] - holes.on_radius_mm)
    half = WIDE * height / holes.on_radius_mm
    inside = 0.6 * holes.radius_mm  # where the sides are parted

    def rows(off):
        return hub + 2 * int(np.argmin(np.abs(radius[hub::2] - holes.on_radius_mm - off)))

    def columns(off):  # even ones, beyond the end they go on from the start
        whole = np.concatenate([angle[::2], angle[::2] + 2.0 * math.pi])
        wanted = angle[0] + (at + off - angle[0]) % (2.0 * math.pi)
        return 2 * int(np.argmin(np.abs(whole - wanted)))

    r = [max(rows(-height), hub + 2), rows(-inside), rows(inside), min(rows(height), len(radius) - 3)]
    t = [columns(-half)]
    for off in (-inside / holes.on_radius_mm, inside / holes.on_radius_mm, half):
        found = columns(off)
        t.append(found if found > t[0] else found + len(angle))
    assert all(np.diff(r) >= 2)
    assert all(np.diff(t) >= 2)
    theta = np.concatenate([angle, angle + 2.0 * math.pi])

    def plain(i, j):
        return radius[i] * np.array([math.cos(theta[j]), math.sin(theta[j])])

    # Parts of its edge meet at 45 degrees: inner or outer, clockwise or counter-clockwise.
    eighths = {(0, 0): -3, (0, 1): 3, (1, 1): 1, (1, 0): -1}
    turns = {key: at + 0.25 * math.pi * count for key, count in eighths.items()}
    corner = {key: middle + holes.radius_mm * np.array([math.cos(v), math.sin(v)]) for key, v in turns.items()}

    def share(values, first, last):
        return (values[first : last + 1] - values[first]) / (values[last] - values[first])

    def straight(a, b, s):
        return a + s[:, None] * (b - a)

    def arc(one, other, s):
        a, b = turns[one], turns[other]
        b = a + (b - a + math.pi) % (2.0 * math.pi) - math.pi
        turn = a + s * (b - a)
        return middle + holes.radius_mm * np.stack([np.cos(turn), np.sin(turn)], axis=-1)

    for bi in range(3):
        for bj in range(3):
            rows_, cols = slice(r[bi], r[bi + 1] + 1), np.arange(t[bj], t[bj + 1] + 1)
            if (bi, bj) == (1, 1):
                cells = (cols[:-1:2] % len(angle)) // 2
                material[r[1] // 2 : r[2] // 2, cells] = False
                continue
            u, v = share(theta, t[bj], t[bj + 1]), share(radius, r[bi], r[bi + 1])

            def point(i, j):
                at_circle = i in (1, 2) and j in (1, 2)
                return corner[i - 1, j - 1] if at_circle else plain(r[i], t[j])

            def side(i, j, k, m, s):  # along one side of a block, from (i, j) to (k, m)
                if all(a in (1, 2) for a in (i, j, k, m)):
                    return arc((i - 1, j - 1), (k - 1, m - 1), s)
                if i == k and i in (0, 3):
                    return np.array([plain(r[i], c) for c in range(t[j], t[m] + 1)])
                if j == m and j in (0, 3):
                    return np.array([plain(c, t[j]) for c in range(r[i], r[k] + 1)])
                return straight(point(i, j), point(k, m), s)

            low, high = side(bi, bj, bi, bj + 1, u), side(bi + 1, bj, bi + 1, bj + 1, u)
            left, right = side(bi, bj, bi + 1, bj, v), side(bi, bj + 1, bi + 1, bj + 1, v)
            s, q = u[None, :, None], v[:, None, None]
            made = (1 - q) * low + q * high + (1 - s) * left[:, None] + s * right[:, None]
            made -= (1 - q) * ((1 - s) * low[0] + s * low[-1]) + q * ((1 - s) * high[0] + s * high[-1])
            nodes[rows_, cols % len(angle)] = made
