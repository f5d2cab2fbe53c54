"""Rings held at lugs: a thin ring in closed form, one matrix for the whole ring, and what symmetry says."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.testing import assert_allclose

import pmor.body.elastic_gear
import pmor.body.far_compliance
import pmor.body.rim
import pmor.body.support
from pmor.body.blank import blank_response
from pmor.body.elastic_gear import elastic_gear
from pmor.body.far_compliance import FarTeeth
from pmor.case import make_case
from pmor.core.conventions import rotation_z
from pmor.fe.assembly import assemble, degrees_of_freedom
from pmor.fe.blank_section import Block, ring_stiffness
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.element import tributary_widths
from pmor.fe.lugs import Lugs
from pmor.fe.whole_gear import whole_gear_mesh
from pmor.pair.blank import blank_below
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import elastic_model, gear_pair, mesh_model, sector_meshes
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import reduced_pair

TEETH, ANGLES = 40, 4
MATERIAL = 210_000.0, 0.3


def seats(stiffness):
    return {"seats": {"seat_radial_N_per_mm": stiffness, "seat_tangential_N_per_mm": stiffness}}


def case_of(helix=0.0, teeth=TEETH, pinion=16, held="outside", addendum=0.8, seats=None, **keys):
    wheel = {"teeth": teeth, "internal": True, "addendum": addendum, "root_fillet_mm": 0.6, "held": held}
    wheel |= seats or {}
    sections = {"profile_elements": 3, "width_elements": 2, "results": {"root_stress": False}, "error_bar": False}
    return make_case(
        "ring", module_mm=2.0, face_width_mm=12.0, torque_Nm=40.0, helix_angle_deg=helix, scheme="line",
        pinion={"teeth": pinion, "bore_radius_mm": 0.5 * pinion},
        wheel=wheel | {"rim_thickness_mm": 6.0}, **(sections | keys),
    )  # fmt: skip


def swept(count=0, lug_deg=8.0, first_deg=3.0, pitches=TEETH, at=(), **keys):
    """Reduced pair, and its STE over so many pitches."""
    return _swept(count, lug_deg, first_deg, pitches, at, tuple(keys.pop("seats", {}).items()), **keys)


@cache
def _swept(count, lug_deg, first_deg, pitches, at, seats, **keys):
    lugs = {"at_deg": list(at)} if at else {"lugs": count}
    lugs |= {"lug_deg": lug_deg, "first_deg": first_deg}
    case = case_of(held=lugs if count or at else "outside", seats=dict(seats), **keys)
    reduced = reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis)
    phi = reduced.meshed.pair.pitch * np.arange(pitches * ANGLES) / ANGLES
    return reduced, sweep_line_loads(reduced, phi, [nominal_condition(case)]).ste_um[0]


# --- closed form ----------------------------------------------------------------------------------------------------


def closing_um(radius, height, width=20.0, load=1000.0, harmonics=60):
    """Closing of a free ring under two opposite forces that are spread over its width, by its section's harmonics."""
    modulus, poisson = 206_000.0, 0.3
    block = Block(radius + 0.5 * height * np.linspace(1.0, -1.0, 5), 0.5 * width * np.linspace(-1.0, 1.0, 5))
    n = np.arange(2, harmonics + 1, 2)
    stiffness = ring_stiffness((block,), modulus, poisson, n, False, held=None)
    spread = np.zeros(stiffness.shape[1])
    spread[::3] = tributary_widths(block.nodes_z, 2) / width
    moved = sum(spread @ np.linalg.solve(matrix, 2.0 * load * spread) for matrix in stiffness)
    inertia = width * height**3 / 12.0
    bending = load * radius**3 / (modulus * inertia) * (math.pi / 4.0 - 2.0 / math.pi)
    # With normal force and shear: Roark's Formulas for Stress and Strain, 7th ed., table 9.2, case 1.
    normal = inertia / (width * height * radius**2)
    shear = 2.4 * (1.0 + poisson) * normal
    both = math.pi / 4.0 * (1.0 - normal + shear) - 2.0 / math.pi * (1.0 - normal) ** 2
    return 4e3 * moved, 1e3 * bending, 1e3 * load * radius**3 / (modulus * inertia) * both


def test_a_thin_ring_closes_under_opposite_loads_as_the_closed_form_says():
    found, bending, whole = closing_um(68.0, 7.0)
    assert_allclose(bending, 397.2, rtol=1e-3)  # FIELD; its ring is as thick as a tenth of its radius
    assert_allclose(found, whole, rtol=0.01)
    found, bending, _ = closing_um(68.0, 3.5)
    assert_allclose(found, bending, rtol=0.01)


def test_a_thin_ring_on_a_bedding_gives_as_the_closed_form_says():
    """n waves without stretching: E I (n^2 - 1)^2 / R^4 beside the bedding, which sections turn against."""
    radius, height, width, radial, along = 68.0, 2.0, 10.0, 3.0, 8.0
    block = Block(radius + 0.5 * height * np.linspace(1.0, -1.0, 3), 0.5 * width * np.linspace(-1.0, 1.0, 5))
    n = np.arange(2, 7)
    stiffness = ring_stiffness((block,), *MATERIAL, n, False, held=None, bedding=(radial, along))
    spread = np.zeros(stiffness.shape[1])
    spread[::3] = tributary_widths(block.nodes_z, 2) / width
    found = [spread @ np.linalg.solve(matrix, spread) for matrix in stiffness]
    bends = MATERIAL[0] * height**3 / 12.0 * (n**2 - 1.0) ** 2 / radius**4
    outside = radius + 0.5 * height
    around = (1.0 - (n**2 - 1.0) * 0.5 * height / radius) / n
    expected = 2.0 * np.pi * width * (radius * bends + outside * (radial + along * around**2))
    assert_allclose(1.0 / np.array(found), expected, rtol=0.02)
    assert bends[-1] > radial > 40.0 * bends[0]


def test_seats_store_what_a_bedding_stores_that_is_spread_evenly_over_lugs():
    """Polynomials over a lug follow a few waves; a seat of compliance c is a bedding of 1 / (c A)."""
    rng, most, gives = np.random.default_rng(3), 60, (2e-6, 5e-6)
    lugs = Lugs(50.0, (-6.0, 6.0), np.array([0.4, 2.0]), 1, 0.3, False, most, 7, gives)
    amplitudes = np.zeros((2 * most + 1, len(lugs.parts)), dtype=complex)
    few = rng.normal(size=(3, len(lugs.parts), 2)) @ [1.0, 1j]
    amplitudes[most + 1 : most + 4], amplitudes[most - 3 : most] = few, few[::-1].conj()
    stored = (np.abs(lugs.held() @ amplitudes.ravel()) ** 2 / lugs.seats()).sum()
    (angle, at), (z, over) = np.polynomial.legendre.leggauss(12), np.polynomial.legendre.leggauss(4)
    theta = (lugs.middles[:, None] + 0.15 * angle).ravel()
    waves = np.exp(1j * np.outer(theta, np.arange(-most, most + 1)))
    # The field whose moments over the width the amplitudes are: 3 of each direction.
    fields = np.polynomial.legendre.legvander(z, 2) * (2.0 * np.arange(3) + 1.0)
    moved = np.einsum("tn,npb,zb->ptz", waves, amplitudes.reshape(-1, 3, 3), fields)
    mean = np.einsum("ptz,t,z->p", np.abs(moved) ** 2, np.tile(at, 2), over) / 4.0
    assert_allclose(stored, (mean / np.take(gives, [0, 1, 1])).sum(), rtol=1e-3)


# --- the whole ring in one matrix -----------------------------------------------------------------------------------


def small_ring(helix, lugs, **keys):
    """Arguments of `elastic_gear`, and blank, of a ring of 30 teeth."""
    layer = {"profile_elements": 2, "layer_depth": 0.05} | keys
    case = case_of(helix, 30, 12, lugs, addendum=0.7, **layer)
    pair = gear_pair(case)
    mesh = sector_meshes(case, pair)[1]
    blank = blank_below(case, case.pair.wheel, pair.wheel, mesh, 1)
    # Few harmonics keep the matrix small; some of them feel each other, a number of teeth apart.
    return mesh, replace(blank, largest=22, lugs=replace(blank.lugs, largest=22)), case.mesh.element


def solved_at_once(matrix, held, seats, mesh, rows_of, teeth):
    """Displacement of flanks of some teeth, and of the root behind them, under forces on that of tooth 0.

    Sums of the unknowns are held on seats.
    """
    own, full = nodes_of_elements(mesh, mesh.flank), completion(mesh, mesh.flank)
    bordered = sp.block_array([[matrix, held.conj().T], [held, -sp.diags_array(seats)]]).tocsc()
    load = np.zeros((bordered.shape[0], full.shape[0]), dtype=complex)
    load[rows_of(0, own)] = full.T.toarray()
    solved = spla.splu(bordered, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(load)
    root, share, found = mesh.left[: len(mesh.z)], tributary_widths(mesh.z, mesh.order) / np.ptp(mesh.z), []
    x, y = mesh.nodes[root, :2].T / np.linalg.norm(mesh.nodes[root, :2], axis=1)
    for k in teeth:
        back = rotation_z(-k * mesh.angular_pitch)
        moved, between = (np.einsum("ij,njm->nim", back, solved[rows_of(k, nodes)].reshape(len(nodes), 3, -1)).real
                          for nodes in (own, root))  # fmt: skip
        cylindrical = np.stack([[x, y, 0.0 * x], [-y, x, 0.0 * x]])
        mean = np.einsum("n,cin,nim->cm", share, cylindrical, between)
        found.append((full @ moved.reshape(3 * len(own), -1), mean))
    return found


def whole_ring(mesh, blank, element, teeth):
    """Sectors of hexahedra, amplitudes of the interface and of the free outside, and lugs: in one matrix."""
    nodes, elements, numbers = whole_gear_mesh(mesh)
    stiffness = assemble(nodes, elements, *MATERIAL, element)
    layers, per, lugs = len(mesh.z), 3 * len(mesh.z), blank.lugs
    at, harmonics = np.unique(numbers[:, mesh.bore]), blank.harmonics
    layer_of = np.full(len(nodes), -1)
    layer_of[numbers[:, mesh.bore]] = np.tile(np.arange(layers), len(mesh.bore) // layers)
    x, y, z = nodes[at].T
    # Around the axis from the middle of tooth 0, which is drawn at -y.
    wave = np.exp(1j * np.outer(np.arctan2(x, -y) - mesh.twist_per_length * z, harmonics))
    shares = np.zeros((len(at), 3, len(harmonics), layers, 3), dtype=complex)
    for number, node in enumerate(at):
        a, b, _ = nodes[node] / np.hypot(*nodes[node, :2])
        frame = np.array([[a, -b, 0.0], [b, a, 0.0], [0.0, 0.0, 1.0]])
        shares[number, :, :, layer_of[node]] = wave[number, None, :, None] * frame[:, None, :]
    below, felt = blank_response(mesh, blank), len(lugs.parts)
    size = per * len(harmonics)
    energy = np.zeros((size + felt * len(harmonics),) * 2, dtype=complex)
    for number, n in enumerate(harmonics.tolist()):
        own, outside = (slice(first + each * number, first + each * (number + 1)) for first, each in
                        ((0, per), (size, felt)))  # fmt: skip
        parts = (below.stiffness[abs(n)], below.passed_on[abs(n)], below.flexibility[abs(n)])
        held, passed, back = (part.conj() if n < 0 else part for part in parts)
        energy[own, own], energy[own, outside] = held, -passed
        energy[outside, own], energy[outside, outside] = -passed.conj().T, -back
    middles = np.unique(numbers[:, mesh.middles])
    inner = np.setdiff1d(np.arange(len(nodes)), np.concatenate([at, middles]))
    kept = np.isin(at, middles, invert=True)
    amplitudes = np.hstack([shares[kept].reshape(-1, size), np.zeros((3 * kept.sum(), len(energy) - size))])
    onto = sp.block_array([[sp.eye_array(3 * len(inner)), None], [None, sp.csr_array(amplitudes)]]).tocsr()
    order = degrees_of_freedom(np.concatenate([inner, at[kept]]))
    matrix = onto.conj().T @ stiffness[order][:, order] @ onto
    matrix = matrix + sp.block_diag([sp.csr_array((3 * len(inner),) * 2), energy])
    row = np.full(3 * len(nodes), -1)
    row[degrees_of_freedom(inner)] = np.arange(3 * len(inner))
    held = lugs.held()
    held = sp.hstack([sp.csr_array((len(held), matrix.shape[0] - held.shape[1])), sp.csr_array(held)])

    def rows_of(k, own):
        return row[degrees_of_freedom(numbers[k % mesh.teeth, own])]

    return solved_at_once(matrix, held, lugs.seats(), mesh, rows_of, teeth)


@pytest.mark.parametrize(("helix", "element"), [(0.0, "hex8i"), pytest.param(18.0, "hex20", marks=pytest.mark.slow)])
def test_a_ring_at_lugs_is_the_whole_ring_in_one_matrix(helix, element, monkeypatch):
    monkeypatch.setattr(pmor.body.support, "LEAST_MOVED", 1e-12)
    monkeypatch.setattr(pmor.body.far_compliance, "LEFT_OUT", 1e-12)
    for module in (pmor.body.rim, pmor.body.elastic_gear):
        monkeypatch.setattr(module, "LEAST_MOVED", 1e-8)
    lugs = {"at_deg": [0.0, 60.0, 150.0, 222.0, 290.0], "lug_deg": 14.0, "first_deg": 7.0}
    mesh, blank, element = small_ring(helix, lugs, element=element, width_elements=1)
    if helix == 0.0:
        blank = replace(blank, lugs=replace(blank.lugs, gives=(2e-7, 5e-7)))
    far, teeth = (9, 15), (-1, 0, 1, 2, 9, -9, 15)
    gear = elastic_gear(mesh, *MATERIAL, element, 2, far=FarTeeth(far, (), ()), blank=blank)
    used = (3 * np.arange(mesh.flank.size)[:, None] + np.arange(2 if helix == 0.0 else 3)).ravel()
    for k, (expected, behind) in zip(teeth, whole_ring(mesh, blank, element, teeth), strict=True):
        root = gear.rim_motion.moved[0, k % mesh.teeth] @ gear.rim_motion.rows.T
        assert_allclose(root, behind, rtol=0.0, atol=1e-6 * np.abs(behind).max())
        found = gear.support.rows @ gear.support.of_teeth(*np.array([[k], [0]]), mesh.teeth)[0] @ gear.support.rows.T
        if abs(k) in far:
            found, expected = found[used[:, None], used], expected[used[:, None], used]
            found += gear.far.shapes @ gear.far.flanks[k] @ gear.far.shapes.T
        else:
            found += gear.tooth_compliance(k)
        assert_allclose(found, expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())


# --- symmetry -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [8, 5])
def test_the_transmission_error_has_the_orders_that_teeth_and_lugs_share(count):
    ste = swept(count)[1]
    orders = np.abs(np.fft.rfft(ste)) / len(ste)
    common = np.gcd(count, TEETH)
    other = np.arange(len(orders)) % common != 0
    assert orders[other].max(initial=0.0) < 1e-9 * ste.mean()
    assert orders[common] > 1e-4 * ste.mean()


@pytest.mark.slow
def test_seats_lie_between_lugs_as_they_are_and_a_ring_that_floats():
    """Lugs all around on soft seats are a bedding all around."""

    def mean(k, count=5, lug_deg=8.0):
        return swept(count, lug_deg, pitches=1, **seats(k))[1].mean()

    held = swept(5, pitches=1)[1].mean()
    assert_allclose(mean(1e12), held, rtol=1e-4)
    means = [held, *(mean(k) for k in (1e6, 1e5))]
    assert (np.diff(means) > 0.0).all()
    assert_allclose(mean(1e5, 8, 44.99), swept(pitches=1, **seats(8e5))[1].mean(), rtol=2e-3)


def test_lugs_at_listed_places_are_equal_ones_where_they_stand_so():
    equal, listed = swept(5, pitches=3)[1], swept(0, pitches=3, at=(144.0, 0.0, 72.0, 288.0, 216.0))[1]
    assert_allclose(listed, equal, rtol=1e-9)
    for at, repeats in (((0.0, 50.0, 180.0, 230.0), 2), ((0.0, 50.0, 180.0), 1)):
        pair = case_of(held={"at_deg": list(at), "lug_deg": 8.0}).pair
        assert (pair.wheel.lugs.repeats, pair.repeats_after) == (repeats, TEETH // repeats)
