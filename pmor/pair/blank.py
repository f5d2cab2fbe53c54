"""From the blank of a case to what its sectors stand on: where they end, and the section of rim, web and hub."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pmor.body.blank import Blank, MeshedBody, interpolation
from pmor.case import Case, GearCase
from pmor.case.blank import BlankCase, HolesCase
from pmor.case.body import BodyCase
from pmor.case.body_matrix import body_stiffness
from pmor.case.body_mesh import body_volume
from pmor.core.arrays import FloatArray
from pmor.fe.blank_section import ALL, MUCH, Block, Span
from pmor.fe.body_condensation import condensed_nodes, in_own_frames, onto_harmonics
from pmor.fe.element import tributary_widths
from pmor.fe.lugs import Lugs
from pmor.fe.perforated_web import PerforatedWeb
from pmor.fe.sector import SectorMesh, widest_row
from pmor.gear.tooth import Tooth

# Depth below the root circle at which sectors end, of the rim's thickness, and at most in modules. *Measured*, webs of
# 4 and 6 mm below a rim of 2.4 modules: ended 0.3 or 1.2 modules deep, compliances differ by 1e-4 of the web's share.
OF_THE_RIM, DEEPEST = 0.6, 1.0
# Of the elements at the corners of a web over its thickness, with so many elements on the flank, and by how much they
# grow away from there. *Measured*, webs of 4 and 6 mm of a wheel d 150 x 20 mm: with elements half that size its STE
# less that of the solid wheel rises by 0.1 %, with twice that size it falls by 0.25 %.
CORNER, AT_ELEMENTS, GROWTH = 0.125, 8, 0.6
# Of the elements at the ends of a length of the bore that is held, where stress has no bound, over those at corners.
# *Measured*, wheel d 150 x 20 mm with a web of 6 mm, held over 8 or 2 mm: its STE rises by 0.02 and 0.04 % with half
# that size, as without held ends; with 1 it is 0.07 and 0.3 % smaller.
HELD_END = 0.125
# Rows of elements below the bore of a gear of one piece with its shaft, and the radius of the hole that is left about
# the axis, over that of the bore.
CORE_ROWS, CENTRE = 6, 0.02
# Harmonics to a tooth, beyond the first half, to begin with: those that die within DECAY times the interface's depth.
FEWEST, DECAY = 2, 1.2
# Harmonics of a web's circles that feel its holes, to begin with: those of which more than 1 / FELT comes back from
# there, over a bridge of at least so much of a hole's radius; at least so many to a hole.
FELT, LEAST_BRIDGE, TO_A_HOLE = 1e4, 0.4, 1.5
# Of a mesh that is brought: sides of quadratic and of linear elements to a wave of the highest harmonic that it sees.
# *Measured*, tetrahedra with 48 quadratic sides around the web of a wheel with 31 teeth: its STE is 0.18 % too small
# with 2, 0.22 with 3, 0.46 with 6; with more elements over the section 0.05 % too large.
TO_A_WAVE, LINEAR_TO_A_WAVE = 2.0, 4.0
# Harmonics that feel each other through it at most, and the degree of the polynomials over the width in which they do.
COUPLED, DEGREE = 48, 4
# Change of the slope of a web's face below which the face goes on straight.
STRAIGHT = 1e-9
# Rows of elements beside an interface or the outside of a ring, over the radius of the shortest wave.
WAVE_STEP = 0.5


def stands_on_blank(gear: GearCase, case: Case) -> bool:
    """Return whether the sectors of a gear stand on a blank: of rim, web and hub, or of one piece with its shaft."""
    return gear.one_piece or not gear.solid(case.pair.face_width_mm)


def interface_radius(gear: GearCase, case: Case, tooth: Tooth) -> float:
    """Return the radius of the cylinder at which the sectors of a gear that stands on a blank end, mm."""
    if gear.body is not None:
        return gear.body.found.interface_radius_mm
    light, rim = gear.light_blank(case.pair.face_width_mm), gear.rim_thickness_mm
    if rim is None:
        rim = tooth.root_radius - (gear.bore_radius_mm or 0.0) if light is None else light.rim_thickness_mm
    return tooth.root_radius - min(OF_THE_RIM * rim, DEEPEST * tooth.module)


def blank_below(case: Case, gear: GearCase, tooth: Tooth, mesh: SectorMesh, place: int) -> Blank | None:
    """Return what the sectors of the pinion, place 0, or the wheel stand on; None where they reach to the bore."""
    if not stands_on_blank(gear, case):
        return None
    interface = interface_radius(gear, case, tooth)
    depth = (tooth.root_radius - interface) / tooth.module
    groups = FEWEST - 1 + math.ceil(DECAY / depth - 1e-9)
    # Beyond it harmonics have waves that elements do not see.
    most = mesh.teeth * (len(mesh.bore) // len(mesh.z) // mesh.order) // 2
    largest = min(mesh.teeth * groups + mesh.teeth // 2, most)
    face = gear.face(case.pair.face_width_mm)
    bore = gear.bore_radius_mm or 0.0  # given: a ring, which has none, has no blank
    widest = widest_row(case.mesh.profile_elements)
    if gear.rim_gives:
        return _rim_outside(gear, tooth, mesh, interface, largest, face, widest)
    if gear.body is not None:
        return _brought(gear, bore, interface, mesh, largest, place, widest)
    light, web = gear.light_blank(case.pair.face_width_mm), None
    blocks: tuple[Block, ...] = (_ring(bore, interface, mesh, largest, widest),)
    if light is not None:
        blocks = _section(light, bore, tooth.root_radius, interface, face, mesh, case.mesh.profile_elements)
        if light.holes is not None:
            web = _perforated(light, light.holes, blocks[1], tooth, mesh, largest, place, case.mesh.profile_elements)
    material, stress = (1e3 * gear.youngs_modulus_GPa, gear.poisson_ratio), light is not None and light.stress
    if not gear.one_piece:
        held = ALL if light is None else _held_span(light, face)
        return Blank(blocks, *material, largest, most, web, held=held, stress=stress)
    blocks = (Block(np.linspace(CENTRE * bore, bore, CORE_ROWS + 1), blocks[0].z), *blocks)
    return Blank(blocks, *material, largest, most, web, core=bore, stress=stress)


def _ring(bore: float, interface: float, mesh: SectorMesh, largest: int, widest: float) -> Block:
    """Block as wide as the face, from a bore out to the sectors, whose waves its rows see."""
    radii = _lines([bore, interface], [interface], [WAVE_STEP * interface / largest], widest)
    return Block(radii, mesh.z[:: mesh.order])


def _brought(
    gear: GearCase, bore: float, interface: float, mesh: SectorMesh, largest: int, place: int, widest: float
) -> Blank:
    """Blank of the body that a gear's case names a mesh or a matrix of."""
    assert gear.body is not None
    material = 1e3 * gear.youngs_modulus_GPa, gear.poisson_ratio
    if isinstance(gear.body, BodyCase):
        volume = body_volume(gear.body)
        nodes, matrix = volume.nodes[volume.interface], condensed_nodes(volume, *material)
        wave = volume.across * (TO_A_WAVE if volume.quadratic else LINEAR_TO_A_WAVE)
    else:
        read = body_stiffness(gear.body)
        nodes, matrix = read.nodes, in_own_frames(read.matrix.copy(), read.nodes)
        wave = read.spacing * LINEAR_TO_A_WAVE
    x, y, z = nodes.T
    z = z - z.min() + float(mesh.z[0])
    # Angles count from the middle of tooth 0, which is drawn at +y, as `first_deg` of holes does.
    angle = np.arctan2(y, x) + math.radians(gear.body.x_axis_deg) + place * math.pi / mesh.teeth
    seen = math.floor(2.0 * math.pi * interface / wave)
    seen, repeats = max(1, min(largest, seen)), gear.body.found.repeats
    waves = np.exp(1j * np.outer(np.arange(seen + 1), angle - mesh.twist_per_length * z))
    over = (mesh.z - mesh.z[0]) / (mesh.z[-1] - mesh.z[0]) * 2.0 - 1.0
    degree = min(DEGREE, len(over) - 1)
    polynomials = np.asarray(np.polynomial.legendre.legvander(over, degree), dtype=np.float64)
    shapes = np.asarray(np.kron(polynomials, np.eye(3)), dtype=np.float64)
    columns = interpolation(mesh.z, mesh.order, z)
    own = onto_harmonics(matrix, waves, columns, shapes, min(seen, COUPLED), repeats)
    weights = np.repeat(tributary_widths(mesh.z, mesh.order), 3)[:, None]
    amplitudes = np.linalg.solve(shapes.T @ (weights * shapes), (weights * shapes).T)
    blocks = (_ring(bore, interface, mesh, largest, widest),)
    body = MeshedBody(own, np.asarray(amplitudes, dtype=np.float64), repeats)
    return Blank(blocks, *material, largest, largest, body=body)


def _rim_outside(
    gear: GearCase, tooth: Tooth, mesh: SectorMesh, interface: float, largest: int, face: Span, widest: float
) -> Blank:
    """Rim of a ring outside of its sectors, and what holds it: lugs, or a bedding all around."""
    outside = (gear.rim_thickness_mm or 0.0) - tooth.root_radius
    ends = [-interface, outside]
    radii = _lines(ends, ends, [-WAVE_STEP * interface / largest] * 2, widest)[::-1]
    blocks = (Block(radii, mesh.z[:: mesh.order]),)
    material = 1e3 * gear.youngs_modulus_GPa, gear.poisson_ratio
    seats = gear.seat_radial_N_per_mm, gear.seat_tangential_N_per_mm
    if (own := gear.lugs) is None:
        area = 2.0 * math.pi * outside * (face[1] - face[0])
        rigid = {"rigid": MUCH * material[0], "free": 0.0}
        radial, along = (rigid[value] if isinstance(value, str) else value / area for value in seats)
        return Blank(blocks, *material, largest, largest, bedding=(radial, along))
    middles = np.radians(own.middles_deg) + math.pi / tooth.teeth
    gives = {"rigid": 0.0, "free": math.inf}
    radial, along = (gives[value] if isinstance(value, str) else 1.0 / value for value in seats)
    faces = float(mesh.z[0]), float(mesh.z[-1])
    lugs = Lugs(outside, faces, middles, own.repeats, math.radians(own.lug_deg), mesh.mirrored, largest, mesh.teeth,
                (radial, along))  # fmt: skip
    return Blank(blocks, *material, largest, largest, lugs=lugs)


def _perforated(
    blank: BlankCase, holes: HolesCase, ring: Block, tooth: Tooth, mesh: SectorMesh, largest: int, place: int,
    elements: int,
) -> PerforatedWeb:  # fmt: skip
    """Web with holes, and the harmonics that feel them: those that reach them from the circles of the web."""
    inner, outer = float(ring.radii[0]), float(ring.radii[-1])
    bridge = min(outer - holes.on_radius_mm - holes.radius_mm, holes.on_radius_mm - holes.radius_mm - inner)
    felt = math.log(FELT) * outer / (2.0 * max(bridge, LEAST_BRIDGE * holes.radius_mm))
    felt = max(felt, TO_A_HOLE * holes.count) * min(1.0, elements / AT_ELEMENTS)
    first = math.radians(holes.first_deg) + place * math.pi / tooth.teeth
    faces = float(ring.z[0]), float(ring.z[-1])
    return PerforatedWeb(inner, outer, faces, holes.count, holes.radius_mm, holes.on_radius_mm, first, mesh.mirrored,
                         min(largest, math.ceil(felt)), math.radians(holes.length_deg))  # fmt: skip


def _held_span(blank: BlankCase, face: Span) -> Span:
    """Where the bore is held along z, mm."""
    middle = 0.5 * (face[0] + face[1]) + blank.held_offset_mm
    half = 0.5 * (blank.held_length_mm or blank.hub_width_mm or face[1] - face[0])
    return middle - half, middle + half


def _section(
    blank: BlankCase, bore: float, root: float, interface: float, face: tuple[float, float], mesh: SectorMesh,
    elements: int,
) -> tuple[Block, ...]:  # fmt: skip
    """Hub, web and the rim below the interface, with lines of elements that crowd at the corners of the web."""
    low, high = face
    middle, inner = 0.5 * (low + high), root - blank.rim_thickness_mm
    webs = _pieces(blank.web_stations(inner, middle))
    wide = 0.5 * (blank.hub_width_mm or high - low)
    corner, widest = CORNER * blank.thinnest_web_mm * AT_ELEMENTS / elements, widest_row(elements)
    top = 0.0 if mesh.mirrored else math.inf
    hub, rim = ((first, min(last, top)) for first, last in ((middle - wide, middle + wide), (low, high)))
    part = [*_held_span(blank, face)] if blank.held_in_part(high - low) else []

    def moved(z: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
        """Take lines between two faces to where the faces are at another radius, and those beside them along."""
        start, end = np.minimum(start, top), np.minimum(end, top)
        return z + np.interp(z, start, end - start)

    def at_rim(z: Sequence[float], beyond: int = 0) -> list[float]:
        heights = np.asarray(z, dtype=np.float64)
        for web in webs[beyond:]:
            heights = moved(heights, web[0, 1:], web[-1, 1:])
        return [float(place) for place in heights]

    # Lines are laid at the rim, for all radii, and follow the faces of the web down to the hub.
    faces = [place for number, web in enumerate(webs, start=1) for place in at_rim(web[-1, 1:].tolist(), number)]
    ends, edge = at_rim(part), HELD_END * corner
    sized = [*((place, corner) for place in faces), *((place, edge) for place in ends)]
    sized = [(place, size) for place, size in sized if place <= top]
    places = [*at_rim(hub), *rim, *faces, *ends, *mesh.z[:: mesh.order].tolist()]
    z = _lines([line for line in places if line <= top], [place for place, _ in sized], [size for _, size in sized])

    def across(span: Sequence[float]) -> FloatArray:
        slack = 1e-9 * (high - low)
        return z[(z >= span[0] - slack) & (z <= span[1] + slack)]

    bends = [_bends(web) for web in webs]
    corners = sorted({radius for ends in bends for radius in ends})
    sizes = [corner] * len(corners)
    if part:
        corners, sizes = [bore, *corners], [edge, *sizes]
    blocks = [Block(_lines([inner, interface], corners, sizes, widest), across(rim))]
    for web, through in zip(reversed(webs), reversed(bends), strict=True):
        radii, lines = _lines(through, corners, sizes, widest), across(web[-1, 1:].tolist())
        at = np.stack([np.interp(radii, web[:, 0], web[:, side]) for side in (1, 2)], axis=1)
        tapered = np.stack([moved(lines, web[-1, 1:], line) for line in at])
        blocks.append(Block(radii, tapered if np.ptp(at, axis=0).any() else lines))
        z = moved(z, web[-1, 1:], web[0, 1:])
    blocks.append(Block(_lines([bore, blank.hub_radius_mm], corners, sizes, widest), across(hub)))
    return tuple(reversed(blocks))


def _pieces(stations: Sequence[Sequence[float]]) -> list[FloatArray]:
    """Stations of a web, radius and z of both faces, between its steps."""
    rows = np.asarray(stations, dtype=np.float64)
    return np.split(rows, np.flatnonzero(np.diff(rows[:, 0]) == 0.0) + 1)


def _bends(web: FloatArray) -> list[float]:
    """Radii of the ends of a piece of a web, and of its stations at which a face bends."""
    slopes = np.diff(web[:, 1:], axis=0) / np.diff(web[:, :1], axis=0)
    bent = (np.abs(np.diff(slopes, axis=0)) > STRAIGHT).any(axis=1)
    return [float(web[0, 0]), *web[1:-1, 0][bent].tolist(), float(web[-1, 0])]


def _lines(
    places: Sequence[float], corners: Sequence[float], sizes: Sequence[float], widest: float | None = None
) -> FloatArray:
    """Lines between elements through all places; elements have their sizes at corners and grow away from there.

    Of radii two that follow each other have the ratio `widest` at most.
    """
    through = np.unique(places)
    through = through[np.append(True, np.diff(through) > 1e-6 * (through[-1] - through[0]))]
    parts = [through[:1]]
    for first, last in zip(through[:-1], through[1:], strict=True):
        fine = np.linspace(first, last, 201)
        apart = np.abs(fine[:, None] - np.asarray(corners))
        grown = (np.asarray(sizes) + GROWTH * apart).min(axis=1)
        crowd = 1.0 / (grown if widest is None else np.minimum(grown, math.log(widest) * fine))
        passed = np.append(0.0, np.cumsum(0.5 * (crowd[1:] + crowd[:-1]) * np.diff(fine)))
        count = max(1, math.ceil(passed[-1] - 0.5))
        inner = np.interp(np.arange(1, count) / count * passed[-1], passed, fine)
        parts += [inner, np.array([last])]
    return np.concatenate(parts)
