"""Pictures of blanks by dimensions."""

import numpy as np
import pytest

from pmor import change_case, make_case, plan
from pmor.pair.drawn import drawn_gears
from pmor.pair.model import gear_pair
from pmor.report.blank_figure import blank_figure, section_text
from pmor.report.replay import figure_of

HOLES = {"count": 5, "radius_mm": 2.0, "on_radius_mm": 17.5, "first_deg": 20.0}
BLANK = {"rim_thickness_mm": 3.0, "web_thickness_mm": 3.0, "hub_radius_mm": 12.0, "web_offset_mm": 2.5, "holes": HOLES}


def case_of(torque=50.0):
    return make_case(teeth=24, bore_radius_mm=8.0, module_mm=2.5, face_width_mm=10.0, torque_Nm=torque, scheme="line",
                     pinion={"blank": BLANK})  # fmt: skip


@pytest.mark.parametrize("torque", [50.0, -50.0])
def test_holes_stand_where_the_file_says_from_the_line_of_centres(torque):
    """Counter-clockwise seen from +z, on the pinion from +y on, on the wheel from -y on; on coast flanks too."""
    case = case_of(torque)
    figure = figure_of(blank_figure(case, gear_pair(case)))
    fronts = figure.axes[1::2]
    for front, towards in zip(fronts, (90.0, -90.0), strict=True):
        (first,) = (text for text in front.texts if text.get_text() == "1")
        expected = np.radians(towards + HOLES["first_deg"])
        np.testing.assert_allclose(first.xy, 17.5 * np.array([np.cos(expected), np.sin(expected)]))


def test_a_slot_is_drawn_as_where_a_round_hole_goes_along_its_circle():
    case = change_case(case_of(), **{"pinion.blank": {"holes": HOLES | {"length_deg": 40.0}}})
    figure = figure_of(blank_figure(case, gear_pair(case)))
    drawn = next(patch.get_xy() for patch in figure.axes[1].patches[5:])
    angle = np.angle((drawn[:, 0] + 1j * drawn[:, 1]) * np.exp(-1j * np.radians(90.0 + 20.0)))
    nearest = 17.5 * np.exp(1j * (np.clip(angle, *np.radians([-20.0, 20.0])) + np.radians(110.0)))
    np.testing.assert_allclose(np.hypot(drawn[:, 0] - nearest.real, drawn[:, 1] - nearest.imag), 2.0, rtol=1e-12)
    assert np.ptp(angle) > np.radians(40.0)
    (named,) = (line for line in section_text(drawn_gears(case, gear_pair(case))[0]) if "5 slots" in line)
    assert "4 mm wide, 40° long on ⌀ 35 mm" in named


def test_a_section_in_characters_has_web_and_holes_at_their_end_of_the_face():
    case = case_of()
    lines = section_text(drawn_gears(case, gear_pair(case))[0])
    web = [line[:32] for line in lines if "#" in line[:32] and not line[:16].strip()]
    assert web, "right of the middle"
    (named,) = (line for line in lines if "5 holes" in line)
    assert "." in named[:32]


def test_the_part_of_a_bore_that_is_held_is_drawn_and_named():
    case = change_case(case_of(), **{"pinion.blank": {"held_length_mm": 4.0, "held_offset_mm": -3.0}})
    pair = gear_pair(case)
    section = figure_of(blank_figure(case, pair)).axes[0]
    lines = [line.get_xdata() for line in section.lines if line.get_linewidth() == 3.0]
    np.testing.assert_allclose(lines, [[-5.0, -1.0]])
    assert any("held over 4 mm" in line for line in section_text(drawn_gears(case, pair)[0]))


def test_a_web_with_a_profile_is_drawn_by_its_stations():
    """At the hub at one end of the face, at the rim at the other one."""
    stations = [[12.0, -5.0, -1.0], [18.0, -5.0, -1.0], [18.0, -2.0, 1.0], [22.0, 2.0, 4.0]]
    blank = {"rim_thickness_mm": 3.0, "hub_radius_mm": 12.0, "web_profile": stations}
    case = change_case(case_of(), **{"pinion.blank": None})
    case = change_case(case, **{"pinion.blank": blank})
    pair = gear_pair(case)
    web = figure_of(blank_figure(case, pair)).axes[0].patches[2].get_xy()
    for radius, low, high in stations:
        assert {(low, radius), (high, radius)} <= set(map(tuple, web))
    lines = section_text(drawn_gears(case, pair)[0])
    assert any("web 2 to 4 mm thick" in line for line in lines)
    assert "[[12, -5, -1], [18, -5, -1]" in plan(case)


def test_solid_gears_have_no_picture_of_blanks():
    case = make_case(teeth=24, bore_radius_mm=8.0, module_mm=2.5, face_width_mm=10.0, torque_Nm=50.0, scheme="line")
    assert blank_figure(case, gear_pair(case)) is None
