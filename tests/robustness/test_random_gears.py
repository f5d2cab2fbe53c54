"""Random gears: outlines and meshes that can be made of them, or one line that refuses."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from pmor.core.errors import GeometryError, MeshError
from pmor.fe.outline import tooth_outline
from pmor.fe.quality import mesh_quality
from pmor.fe.sector import build_sector
from pmor.gear.tooth import Tooth
from tests.support.refusals import check_message

PARAMETERS = {
    "teeth": st.one_of(st.integers(10, 60), st.integers(6, 1000)),
    "module": st.floats(0.05, 100.0),
    "pressure_angle": st.floats(10.0, 35.0).map(math.radians),
    "profile_shift": st.one_of(st.just(0.0), st.floats(-0.6, 0.8), st.floats(-3.0, 3.0)),
    "addendum": st.one_of(st.floats(0.7, 1.3), st.floats(0.1, 3.0)),
    "dedendum": st.one_of(st.floats(1.0, 1.5), st.floats(0.1, 4.0)),
    "rack_tip_radius": st.one_of(st.floats(0.0, 0.4), st.floats(0.0, 1.0)),
}
many = settings(max_examples=60, deadline=None, database=None, derandomize=True,
                suppress_health_check=list(HealthCheck))  # fmt: skip


@st.composite
def teeth(draw, **given_values):
    """Teeth that can be made; those that cannot are refused with one line."""
    values = {name: given_values.get(name) or draw(strategy) for name, strategy in PARAMETERS.items()}
    try:
        return Tooth(**values)
    except GeometryError as error:
        check_message(error)
        assume(False)


def crosses_itself(points):
    """Whether an open polygon has two edges that cross, by trying all pairs."""
    a, b = points[:-1], points[1:]

    def side(p, q, r):
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])

    first, second = np.triu_indices(len(a), k=2)
    straddles = side(a[first], b[first], a[second]) * side(a[first], b[first], b[second]) < 0.0
    straddled = side(a[second], b[second], a[first]) * side(a[second], b[second], b[first]) < 0.0
    return bool(np.any(straddles & straddled))


def test_a_polygon_that_crosses_itself_is_noticed():
    assert crosses_itself(np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]))
    assert not crosses_itself(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]))


def test_a_corner_in_place_of_a_fillet_is_refused():
    corner = Tooth(10, 1.0, math.radians(10.0), profile_shift=1.0, addendum=0.75, dedendum=1.0, rack_tip_radius=0.0)
    with pytest.raises(MeshError, match="rack_tip_radius = 0: leaves a corner .*; raise it"):
        tooth_outline(corner, 4, "arc_length")


@many
@given(teeth(), st.integers(2, 40), st.sampled_from(["arc_length", "roll_angle"]), st.floats(0.05, 0.95))
def test_outlines_do_not_cross_and_meshes_are_sound_or_refused(tooth, elements, spacing, bore):
    rim = tooth.root_radius - 0.5 * tooth.module
    assume(rim > 0.1 * tooth.module)
    try:
        outline = tooth_outline(tooth, elements, spacing)
        mesh = build_sector(tooth, bore * rim, tooth.module, elements, 1, spacing)
        quality = mesh_quality(mesh.nodes, mesh.elements)
    except MeshError as error:
        check_message(error)
        return
    half = np.concatenate([outline.lower_fillet[:-1], outline.upper_fillet[:-1], outline.flank])
    mirrored = (half * np.array([-1.0, 1.0]))[::-1]
    assert np.isfinite(mesh.nodes).all()
    assert not crosses_itself(np.concatenate([half, mirrored]))
    assert 0.0 < quality.min_scaled_jacobian <= 1.0 + 1e-12
