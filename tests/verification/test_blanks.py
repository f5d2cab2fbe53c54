"""Gears on blanks of revolution: closed forms, one matrix for the whole gear, and what symmetry says."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.testing import assert_allclose

import pmor.body.elastic_gear
from pmor.body.blank import blank_stiffness
from pmor.case import change_case, make_case
from pmor.case.blank import BlankCase
from pmor.core.conventions import rotation_z
from pmor.fe.assembly import assemble, degrees_of_freedom
from pmor.fe.blank_section import Block, ring_stiffness
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.whole_gear import whole_gear_mesh
from pmor.pair.blank import blank_below
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import elastic_model, gear_pair, mesh_model, sector_meshes, solved_gear
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import reduced_pair

E, NU = 206_000.0, 0.3
ROUND_OFF = 1e-9
# Of the rows of a sector's mesh between interface and bore, which the elements of a blank of revolution are finer than.
COARSE_ROWS = 1.5e-3
SMALL = {
    "teeth": 13, "bore_radius_mm": 8.0, "module_mm": 2.5, "face_width_mm": 12.0, "torque_Nm": 50.0, "scheme": "line",
    "profile_elements": 3, "width_elements": 2, "results": {"root_stress": False}, "error_bar": False,
}  # fmt: skip
WEB = {"rim_thickness_mm": 1.6, "web_thickness_mm": 4.0, "hub_radius_mm": 9.5}


def case_of(helix=0.0, **blank):
    blank = WEB | blank
    return make_case(**SMALL, helix_angle_deg=helix, pinion={"blank": blank})


@cache
def gear_of(helix=0.0, **blank):
    case = case_of(helix, **blank)
    return case, elastic_model(case, mesh_model(case)).pinion


# --- sections of blanks ---------------------------------------------------------------------------------------------


def test_a_disc_twists_as_the_closed_form_says():
    blocks = (Block(np.linspace(25.0, 71.25, 12), np.array([-10.0, 10.0])),)
    stiffness = ring_stiffness(blocks, E, NU, np.array([0]), False)[0]
    turned = np.tile([0.0, 71.25, 0.0], len(stiffness) // 3)
    shear = 0.5 * E / (1.0 + NU)
    twist = (1.0 / 25.0**2 - 1.0 / 71.25**2) / (4.0 * np.pi * shear * 20.0)
    assert_allclose(1.0 / (turned @ stiffness @ turned), twist, rtol=2e-5)  # parabolas for 1/r


@pytest.mark.parametrize("twist", [0.0, 0.02])
def test_rigid_motions_cost_nothing(twist):
    """A body of revolution that hangs together but is held nowhere: the row of elements next to the bore aside."""
    from pmor.fe.blank_section import _law, _row_stiffness

    block = Block(np.array([30.0, 33.0]), np.array([-4.0, 1.0, 5.0]))
    parts = _row_stiffness(block, 0, _law(E, NU), twist)
    r = np.repeat([30.0, 31.5, 33.0], 5)
    z = np.tile(block.nodes_z, 3)
    none, one = np.zeros_like(r), np.ones_like(r)
    # Of e^(i n (theta - tau z)): along x, about z, along z, about y.
    motions = {
        1: [(one, one, none), (z, z, -r)],
        0: [(none, r, none), (none, none, one)],
    }
    for n, listed in motions.items():
        stiffness = parts[0] + n * parts[1] + n * n * parts[2]
        for motion in listed:
            moved = (np.stack(motion, axis=1) * np.exp(1j * n * twist * z)[:, None]).ravel()
            force = stiffness @ moved
            # The twisted phase is no parabola.
            assert np.abs(force).max() < (1e-10 if twist == 0.0 else 2e-4) * np.abs(stiffness).max() * r.max()


def test_half_a_section_is_the_whole_one_where_it_mirrors():
    radii, harmonics = np.linspace(10.0, 16.0, 3), np.array([0, 1, 5])
    whole = ring_stiffness((Block(radii, np.array([-4.0, -1.0, 0.0, 1.0, 4.0])),), E, NU, harmonics, False)
    half = ring_stiffness((Block(radii, np.array([-4.0, -1.0, 0.0])),), E, NU, harmonics, True)
    nodes, image = 9, np.array([0, 1, 2, 3, 4, 3, 2, 1, 0])
    onto = np.zeros((27, 15))
    for node in range(nodes):
        for part in range(3):
            onto[3 * node + part, 3 * image[node] + part] = -1.0 if part == 2 and node > 4 else 1.0
    kept = np.delete(np.arange(15), 14)
    assert_allclose(half[:, kept][:, :, kept], (onto.T @ whole @ onto)[:, kept][:, :, kept],
                    rtol=0.0, atol=ROUND_OFF * np.abs(half).max())  # fmt: skip


# --- the gear on its blank ------------------------------------------------------------------------------------------


def test_a_blank_that_fills_the_face_is_the_bored_gear():
    solid = make_case(**SMALL)
    full = case_of(web_thickness_mm=12.0)
    both = [elastic_model(case, mesh_model(case)).pinion.compliance for case in (solid, full)]
    assert_allclose(*both, rtol=0.0, atol=0.0)


@pytest.mark.parametrize("helix", [0.0, 18.0])
def test_harmonics_below_an_interface_are_the_elements_of_a_bored_gear(helix, monkeypatch):
    bored = make_case(**SMALL, helix_angle_deg=helix)
    expected = elastic_model(bored, mesh_model(bored)).pinion.compliance
    monkeypatch.setattr(BlankCase, "fills", lambda self, width: False)
    case = case_of(helix, web_thickness_mm=12.0)
    found = elastic_model(case, mesh_model(case)).pinion.compliance
    assert_allclose(found, expected, rtol=0.0, atol=COARSE_ROWS * np.abs(expected).max())
    assert (found != expected).any()


def whole_compliance(case, teeth):
    """Displacement of flanks of some teeth under unit forces on tooth 0: all sectors and the blank in one matrix."""
    pair = gear_pair(case)
    mesh = sector_meshes(case, pair)[0]
    gear, material = case.pair.pinion, (210_000.0, 0.3)
    blank = blank_below(case, gear, pair.pinion, mesh)
    nodes, elements, numbers = whole_gear_mesh(mesh)
    stiffness = assemble(nodes, elements, *material, "hex20")
    below = blank_stiffness(mesh, blank.blocks, *material, blank.largest)
    layers, per = len(mesh.z), 3 * len(mesh.z)
    # Real amplitudes of cosine and sine of each harmonic, at all nodes of the interface.
    at, size = np.unique(numbers[:, mesh.bore]), per * (2 * blank.largest + 1)
    place = np.full(len(nodes), -1)
    place[at] = np.arange(len(at))
    shares = np.zeros((len(at), 3, size))
    for k in range(mesh.teeth):
        for angle, layer in np.ndindex(len(mesh.bore) // layers, layers):
            node = numbers[k, mesh.bore[angle * layers + layer]]
            x, y, z = nodes[node]
            theta = np.arctan2(-x, y) - mesh.twist_per_length * z
            out, around = np.array([x, y, 0.0]) / np.hypot(x, y), np.array([-y, x, 0.0]) / np.hypot(x, y)
            frame = np.stack([out, around, [0.0, 0.0, 1.0]], axis=1)
            shares[place[node], :, 3 * layer : 3 * layer + 3] = frame
            for n in range(1, blank.largest + 1):
                for part, wave in enumerate((np.cos(n * theta), np.sin(n * theta))):
                    first = per * (2 * n - 1 + part) + 3 * layer
                    shares[place[node], :, first : first + 3] = wave * frame
    energy = [below[0].real]
    both = np.hstack([np.eye(per), -1j * np.eye(per)])  # a cos + b sin = (a - i b) / 2 e^i.. + conjugate
    energy += [0.5 * (both.conj().T @ block @ both).real for block in below[1:]]
    middles = np.unique(numbers[:, mesh.middles])
    inner = np.setdiff1d(np.arange(len(nodes)), np.concatenate([at, middles]))
    kept = np.isin(at, middles, invert=True)
    onto = sp.block_array([
        [sp.eye_array(3 * len(inner)), None], [None, sp.csr_array(shares[kept].reshape(-1, size))]
    ]).tocsr()  # fmt: skip
    order = degrees_of_freedom(np.concatenate([inner, at[kept]]))
    whole = onto.T @ stiffness[order][:, order] @ onto
    whole = whole + sp.block_diag([sp.csr_array((3 * len(inner),) * 2), *energy])
    factor = spla.splu(whole.tocsc(), options={"SymmetricMode": True}, permc_spec="MMD_AT_PLUS_A")
    row = np.full(3 * len(nodes), -1)
    row[degrees_of_freedom(inner)] = np.arange(3 * len(inner))
    own, full = nodes_of_elements(mesh, mesh.flank), completion(mesh, mesh.flank)
    load = np.zeros((whole.shape[0], full.shape[0]))
    load[row[degrees_of_freedom(numbers[0, own])]] = full.T.toarray()
    solved = factor.solve(load)
    found = []
    for k in teeth:
        moved = solved[row[degrees_of_freedom(numbers[k % mesh.teeth, own])]].reshape(len(own), 3, -1)
        turned = np.einsum("ij,njm->nim", rotation_z(-k * mesh.angular_pitch), moved)
        found.append(full @ turned.reshape(3 * len(own), -1))
    return found


@pytest.mark.parametrize("helix", [0.0, 18.0])
def test_sectors_on_a_blank_are_the_whole_gear_in_one_matrix(helix):
    case = change_case(case_of(helix, web_offset_mm=3.0), scheme="direct", profile_elements=2, width_elements=1)
    teeth = (-1, 0, 1)
    gear = elastic_model(case, mesh_model(case)).pinion
    for k, expected in zip(teeth, whole_compliance(case, teeth), strict=True):
        assert_allclose(gear.tooth_compliance(k), expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("helix", [0.0, 18.0])
def test_what_one_tooth_does_to_another_the_other_does_to_it(helix, monkeypatch):
    monkeypatch.setattr(pmor.body.elastic_gear, "_reciprocal", lambda compliance: compliance)
    case = case_of(helix, web_offset_mm=3.0)
    compliance = elastic_model(case, mesh_model(case)).pinion.compliance
    largest = np.abs(compliance).max()
    assert_allclose(compliance, compliance[::-1].transpose(0, 2, 1), rtol=0.0, atol=1e-12 * largest)


def loads_of(case):
    model = elastic_model(case, mesh_model(case))
    reduced = reduced_pair(train(case, model).basis)
    phi = np.linspace(0.0, reduced.meshed.pair.pitch, 5, endpoint=False)
    return sweep_line_loads(reduced, phi, [nominal_condition(case)], recorded=True)


def test_a_web_at_the_other_end_mirrors_the_load_over_the_face():
    one, other = (loads_of(case_of(web_offset_mm=offset)) for offset in (4.0, -4.0))
    loads, mirrored = (found.states.lines.load_N_per_mm for found in (one, other))
    assert_allclose(mirrored[..., ::-1], loads, rtol=0.0, atol=ROUND_OFF * loads.max())
    assert_allclose(one.ste_um, other.ste_um, rtol=ROUND_OFF)
    carried = loads.sum(axis=(0, 1, 2))
    assert carried[-1] > 1.05 * carried[0], "the end above the web carries more"


def test_half_the_width_stands_for_the_whole_on_a_web_in_the_middle():
    half, whole = (loads_of(change_case(case_of(), width=width)) for width in ("half", "whole"))
    assert_allclose(half.ste_um, whole.ste_um, rtol=1e-8)


def test_thinner_webs_give_more_and_a_web_as_wide_as_the_face_nearly_as_little_as_none():
    means = [loads_of(case_of(web_thickness_mm=web)).ste_um.mean() for web in (2.0, 4.0, 8.0, 11.99, 12.0)]
    assert (np.diff(means) < 0.0).all()
    assert_allclose(means[-2], means[-1], rtol=2e-3)  # beside the coarse rows of a bored gear's sectors


def test_the_stress_in_the_fillets_of_a_thick_rim_is_that_of_the_bored_gear(monkeypatch):
    def stress(case):
        case = replace(case, results=replace(case.results, root_stress=True))
        mesh = mesh_model(case)
        return solved_gear(case, mesh, mesh.pinion, case.pair.pinion).fillet.shapes

    expected = stress(make_case(**SMALL))
    monkeypatch.setattr(BlankCase, "fills", lambda self, width: False)
    found = stress(case_of(web_thickness_mm=12.0, rim_thickness_mm=4.5, hub_radius_mm=8.3))
    assert_allclose(found, expected, rtol=0.0, atol=5e-3 * np.abs(expected).max())
