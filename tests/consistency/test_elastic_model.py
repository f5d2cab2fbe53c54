"""Mesh and compliance of a pair belong together, or are refused."""

import pytest

from pmor.case import parse_case
from pmor.pair.model import ElasticModel, mesh_model
from tests.support.small_case import case_text, small_case


def test_a_compliance_that_belongs_to_the_mesh_is_taken(small_model):
    """Also where the mesh was made anew: contact may differ, flanks and bodies are the same."""
    case, model = small_model
    again = mesh_model(case)
    assert again.pinion is not model.mesh.pinion
    ElasticModel(again, model.pinion, model.wheel)


@pytest.mark.parametrize("width", ["whole", "plane_strain"])
def test_a_compliance_of_another_width_is_refused(width, small_model):
    """Half of a width and the whole of it have the same rows; whichever came first would stand for both."""
    with pytest.raises(ValueError, match="pinion: the compliance is that of another mesh"):
        ElasticModel(mesh_model(small_case(width)), small_model[1].pinion, small_model[1].wheel)


def test_a_compliance_of_another_spacing_is_refused(small_model):
    """As many flank nodes, in other places: nothing would fail, and every number be wrong."""
    mesh = {"profile_elements": 5, "width_elements": 2, "spacing": "roll_angle"}
    other = mesh_model(parse_case(case_text(mesh=mesh), "small", "another spacing"))
    assert other.pinion.flank_nodes.shape == small_model[1].pinion.mesh.flank_nodes.shape
    with pytest.raises(ValueError, match="pinion: the compliance is that of another mesh"):
        ElasticModel(other, small_model[1].pinion, small_model[1].wheel)


def test_line_contact_refuses_a_compliance_with_the_layer_still_in_it(small_model):
    mesh = {"profile_elements": 5, "width_elements": 2}
    lines = mesh_model(parse_case(case_text(mesh=mesh, contact={"scheme": "line"}), "small", "lines"))
    with pytest.raises(ValueError, match="pinion: contact takes . columns .* the compliance is without 0"):
        ElasticModel(lines, small_model[1].pinion, small_model[1].wheel)
