"""A bore that is held on a part of its length: closed form, one system of equations, and what symmetry says."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import make_case
from pmor.fe.blank_section import Block, hookes_law, ring_stiffness, row_stiffness
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import elastic_model, mesh_model
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import reduced_pair
from tests.support.line_pairs import on_columns

E, NU = 206_000.0, 0.3
ROUND_OFF = 1e-9
# Of a tube's twist: parabolas over its wall and along it.
PARABOLAS = 1e-4
WEB = {"rim_thickness_mm": 1.6, "web_thickness_mm": 4.0, "hub_radius_mm": 9.5}
SMALL = {
    "teeth": 13, "bore_radius_mm": 8.0, "module_mm": 2.5, "face_width_mm": 12.0, "torque_Nm": 50.0, "scheme": "line",
    "profile_elements": 3, "width_elements": 2, "results": {"root_stress": False}, "error_bar": False,
}  # fmt: skip


def test_a_tube_that_is_held_at_one_end_twists_as_the_closed_form_says():
    """Two places of its outside, clear of the held length and of the load at the other end: T (z2 - z1) / (G J)."""
    block = Block(np.array([20.0, 21.0, 22.0]), np.linspace(0.0, 60.0, 41))
    stiffness = ring_stiffness((block,), E, NU, np.array([0]), False, held=(0.0, 12.0))[0]
    z = block.nodes_z
    load = np.zeros(len(stiffness))
    load[-2] = 1.0 / 22.0  # around the axis, 1 N mm
    turned = np.linalg.solve(stiffness, load)[1::3] / 22.0
    shear, polar = 0.5 * E / (1.0 + NU), 0.5 * np.pi * (22.0**4 - 20.0**4)
    places = [int(np.abs(z - place).argmin()) for place in (24.0, 48.0)]
    assert_allclose(np.diff(turned[places]), np.diff(z[places]) / (shear * polar), rtol=PARABOLAS)
    assert abs(turned[int(np.abs(z - 3.0).argmin())]) < 1e-3 * turned[-1], "held there"


@pytest.mark.parametrize("twist", [0.0, 0.02])
def test_nodes_of_the_bore_are_free_beyond_the_length_that_is_held(twist):
    """Against one system of equations of all nodes of two blocks."""
    z = np.array([-8.0, -3.0, 1.0, 6.0])
    blocks, harmonics = (Block(np.array([6.0, 13.0]), z), Block(np.array([13.0, 20.0, 27.0]), z)), [0, 1, 2, 60]
    law, nodes = hookes_law(E, NU), blocks[0].nodes_z
    row = 3 * len(nodes)
    found = ring_stiffness(blocks, E, NU, np.array(harmonics), False, twist, held=(-3.0, 1.0))
    for n, reduced in zip(harmonics, found, strict=True):
        whole = np.zeros((7 * row, 7 * row), dtype=complex)
        for place, (block, own) in enumerate(((blocks[0], 0), (blocks[1], 0), (blocks[1], 1))):
            constant, linear, square = row_stiffness(block, own, law, twist)
            at = slice(2 * place * row, (2 * place + 3) * row)
            whole[at, at] += 2.0 * np.pi * (constant + n * linear + n * n * square)
        kept = np.append(~((nodes >= -3.0) & (nodes <= 1.0)).repeat(3), np.ones(6 * row, dtype=bool))
        inverse = np.linalg.inv(whole[np.ix_(kept, kept)])[-row:, -row:]
        expected = np.linalg.inv(inverse)
        assert_allclose(reduced, expected, rtol=0.0, atol=ROUND_OFF * np.abs(expected).max())


@cache
def swept(width="half", **blank):
    """STE (um) and line loads of a pair whose pinion stands on a blank."""
    case = make_case(**SMALL, width=width, pinion={"blank": WEB | blank})
    reduced = on_columns(reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis))
    phi = np.linspace(0.0, reduced.meshed.pair.pitch, 5, endpoint=False)
    found = sweep_line_loads(reduced, phi, [nominal_condition(case)], recorded=True)
    return found.ste_um[0], found.states.lines.load_N_per_mm


def test_the_shorter_the_held_length_the_more_the_gear_gives():
    means = [swept(held_length_mm=length)[0].mean() for length in (2.0, 4.0, 8.0, 11.99, 12.0)]
    assert (np.diff(means) < 0.0).all()
    assert means[0] > 1.02 * means[-1]
    assert_allclose(means[-2], means[-1], rtol=1e-3)


def test_a_solid_gear_may_be_held_on_a_part_of_its_bore():
    solid = {"web_thickness_mm": 12.0}
    plain, part = swept(**solid)[0].mean(), swept(**solid, held_length_mm=6.0)[0].mean()
    assert part > 1.005 * plain
