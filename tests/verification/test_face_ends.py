"""Line loads near the free ends of a spur face, against bricks that resolve the contact and the ends.

One sector, its bore and side faces held, and its mirror image, pressed together along a line amid the flank, also with
a rigid tilt of 8 um over the width. Bricks: Hertz's pressure of a given half-width b on elements b / 2 wide, and
sections that are 0.06 mm wide at the ends. Displacements are averaged as the pressure acts, so that the compliance
between sections is symmetric; the law for that is ``c w [ln(2 d / b) + 1/4 + a]``. Elements of 0.37 b and sections of
0.04 mm change the largest load by 2e-4, the displacement by 2e-5.

Slow, a minute: ``pytest -n 0 -m slow tests/verification/test_face_ends.py -s``. Bricks: the largest line load is 1.453
of the mean, 1.1 mm inside, and 0.84 of the mean at the face. Line contact over bricks: largest load -0.9, -0.7 and -0.9
% on 4, 8 and 16 elements over the width, displacement -0.23, -0.18 and -0.16 %. Without `layer_coupling`, in plane
strain up to the face, the largest load is 4 % high.
"""

import math
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest

from pmor.body.far_compliance import section_shares
from pmor.fe import sector
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.condensation import sector_stiffness
from pmor.fe.element import tributary_widths
from pmor.fe.elimination import condense, inverse
from pmor.fe.nested_dissection import element_places
from pmor.fe.outline import tooth_outline
from pmor.fe.sector import build_sector
from pmor.fe.surface_layer import layer_compliance, surface_layer
from pmor.line.bonded_layer import bonded_layer_constant
from pmor.line.face_ends import layer_coupling
from pmor.line.hertz import line_compliance
from pmor.line.sections import flank_sections
from tests.support.gear_models import MODULE, POISSON, WIDTH, YOUNG, tooth

GEAR, BORE, PROFILE, MIDDLE_ROW = tooth(21), 20.0, 8, 8
HALF_WIDTH, LINE_LOAD, TILT = 0.13, 200.0, 8e-3 / WIDTH
FINE = 0.5 * HALF_WIDTH
# Rows of nodes on either side of the middle of the contact.
BAND = 6
LARGEST_LOAD, DISPLACEMENT = 0.01, 0.003


def steps(length, first, ratio, largest):
    """Lengths of elements that grow from about the first one, of this length together."""
    found = [first]
    while sum(found) < length:
        found.append(min(found[-1] * ratio, largest))
    return np.array(found) * (length / sum(found))


def halved(edges):
    """Edges of elements, and their middles."""
    return np.sort(np.concatenate([edges, 0.5 * (edges[1:] + edges[:-1])]))


def normal(roll):
    """Into the tooth."""
    direction = GEAR.base_half_angle - roll
    return np.array([math.cos(direction), math.sin(direction), 0.0])


def bricks(roll):
    """Sector whose elements are fine where the flank is loaded and at the ends of the face."""
    arc = 0.5 * GEAR.base_radius * np.array([GEAR.form_roll_angle, roll, GEAR.tip_roll_angle]) ** 2
    band = 0.5 * BAND * FINE
    below, above = (steps(length - band, 1.5 * FINE, 1.5, 1.0) for length in np.diff(arc))
    edges = np.append(0.0, np.cumsum(np.concatenate([below[::-1], np.full(BAND, FINE), above])))
    rolls = np.sqrt(GEAR.form_roll_angle**2 + 2.0 * halved(edges) / GEAR.base_radius)
    inwards = np.append(0.0, np.cumsum(steps(1.0, FINE / (0.75 * MODULE), 1.6, 0.4)))
    ends = np.append(0.0, np.cumsum(steps(0.5 * WIDTH, 0.06, 1.5, 2.5))) - 0.5 * WIDTH
    z = halved(np.concatenate([ends, -ends[-2::-1]]))

    def outline(gear, _, spacing, order):
        return replace(tooth_outline(gear, 6, spacing, order), flank=gear.flank_section(rolls), flank_roll_angle=rolls)

    with patch.object(sector, "tooth_outline", outline), patch.object(sector, "_through_thickness", lambda *_: inwards):
        mesh = build_sector(GEAR, BORE, WIDTH, len(edges) - 1, len(z) // 2, "arc_length", order=2)
    nodes = mesh.nodes.reshape(-1, len(z), 3).copy()
    nodes[..., 2] = z
    return replace(mesh, nodes=nodes.reshape(-1, 3), z=z)


def flank_compliance(mesh, stiffness, rows):
    """Compliance of rows of flank nodes, shape (rows, columns, 3, rows, columns, 3), mm/N."""
    held = np.unique(np.concatenate([mesh.bore, mesh.left, mesh.right]))
    nodes = mesh.flank[rows]
    own = nodes_of_elements(mesh, nodes)
    full = completion(mesh, nodes)
    found = inverse(condense(stiffness, mesh.elements[:, :20], element_places(mesh), own, held))
    return (full @ (full @ found).T).reshape(*nodes.shape, 3, *nodes.shape, 3)


def hertz_forces(place):
    """Share of a line load on nodes at these places (mm from its middle), of quadratic elements."""
    at = HALF_WIDTH * ((np.arange(20_000) + 0.5) / 10_000 - 1.0)
    pressure = np.sqrt(1.0 - (at / HALF_WIDTH) ** 2)
    element = np.searchsorted(place[::2], at, side="right") - 1
    s = (at - place[2 * element]) / (place[2 * element + 2] - place[2 * element])
    shares = (1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)
    found = sum(np.bincount(2 * element + n, pressure * share, len(place)) for n, share in enumerate(shares))
    return found / pressure.sum()


def resolved(roll):
    """Places and widths of sections, and the compliance between them, by bricks."""
    mesh = bricks(roll)
    middle = int(np.argmin(np.abs(mesh.flank_roll_angle - roll)))
    rows = np.arange(middle - BAND, middle + BAND + 1)
    compliance = flank_compliance(mesh, sector_stiffness(mesh, YOUNG, POISSON, "hex20"), rows)
    rolls = mesh.flank_roll_angle[rows]
    shares = hertz_forces(0.5 * GEAR.base_radius * (rolls**2 - roll**2))[:, None] * np.stack([*map(normal, rolls)])
    between = np.einsum("ra,rjaskb,sb->jk", shares, compliance, shares, optimize=True)
    return mesh.z, tributary_widths(mesh.z, 2), between


def by_line_contact(across):
    """Those of the program, by so many elements over the width."""
    mesh = build_sector(GEAR, BORE, WIDTH, PROFILE, across, order=2)
    stiffness = sector_stiffness(mesh, YOUNG, POISSON, "hex20")
    columns, depths = surface_layer(GEAR, PROFILE, "roll_angle", sector.LAYER_DEPTH * MODULE, 2)
    left = flank_compliance(mesh, stiffness, np.arange(len(mesh.flank)))
    left -= layer_compliance(mesh, columns, stiffness).reshape(left.shape)
    force, depth = normal(mesh.flank_roll_angle[MIDDLE_ROW]), depths[[MIDDLE_ROW]]
    between = np.einsum("a,jakb,b->jk", force, left[MIDDLE_ROW][:, :, MIDDLE_ROW], force)
    sections = flank_sections(mesh.z, mesh.z, False, 2, depth[0])
    shares = section_shares(sections.column[0], sections.share[0], len(mesh.z))
    edges, compliance = np.append(0.0, np.cumsum(sections.width)), line_compliance(YOUNG, POISSON)
    coupled = layer_coupling(edges, (0.0, WIDTH), depth, compliance, POISSON)[0]
    shape = math.log(2.0 * depth[0] / HALF_WIDTH) + 0.25 + bonded_layer_constant(POISSON)
    own = np.diag(compliance * shape / sections.width)
    return sections.z, sections.width, shares @ between @ shares.T + coupled + own


def pressed(z, width, between, tilt):
    """Line loads over their mean, and the displacement, mm, of two such flanks."""
    size = len(z)
    matrix = np.zeros((size + 1, size + 1))
    matrix[:size, :size], matrix[:size, size], matrix[size, :size] = 2.0 * between, -1.0, 1.0
    found = np.linalg.solve(matrix, np.append(tilt * z, LINE_LOAD * WIDTH))
    return found[:size] / (width * LINE_LOAD), found[size]


@pytest.mark.slow
def test_largest_load_of_a_tilted_face_is_that_of_bricks_that_resolve_its_end():
    roll = build_sector(GEAR, BORE, WIDTH, PROFILE, 2, order=2).flank_roll_angle[MIDDLE_ROW]
    z, width, between = resolved(roll)
    (true, _), (_, displacement) = pressed(z, width, between, TILT), pressed(z, width, between, 0.0)
    inside = 0.5 * WIDTH - z[np.argmax(true)]
    print(f"\nbricks: {true.max():.4f} of the mean {inside:.2f} mm inside, {true[-1]:.2f} at the face")  # noqa: T201
    assert 0.5 < inside < 1.5
    assert true[-1] < 0.65 * true.max()
    for across in (4, 8, 16):
        sections = by_line_contact(across)
        largest = pressed(*sections, TILT)[0].max() / true.max() - 1.0
        mean = pressed(*sections, 0.0)[1] / displacement - 1.0
        print(f"{across} elements: largest load {100.0 * largest:+.2f} %, displacement {100.0 * mean:+.2f} %")  # noqa: T201
        assert abs(largest) < LARGEST_LOAD
        assert abs(mean) < DISPLACEMENT
