"""What an engineer must find in each picture."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import matplotlib
import matplotlib.style
import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.condition import Assembly
from pmor.report.page import Picture
from pmor.report.replay import figure_of
from pmor.report.run_figures import LOADED_FLANK_COLOUR, conditions_figure, contact_pattern_figure, mesh_figure
from pmor.report.style import log_log, panels, picture_bytes, write_picture
from pmor.report.svg import DARK, chart_svgs
from pmor.report.svg_marks import WIDTH, width_of
from pmor.report.sweep_figures import (
    error_figure,
    load_sharing_figure,
    spectrum_figure,
    ste_figure,
    stiffness_figure,
)
from pmor.results.sweep import mesh_stiffness
from pmor_online.conditions import ConditionSweep
from pmor_online.contact_pattern import ContactPattern
from tests.support.sweeps import made_up_sweep

ROUND_OFF = 1e-12
# Of words on a panel, px; places are written with a decimal.
LEAST_SIZE, ROUNDED = 11.0, 1.0
UNIT = re.compile(r"\[[^\]]+\]")


def make_sweep(torques=(30.0, 100.0, 160.0), n=24):
    torques = np.asarray(torques, float)
    x = np.arange(n) / n
    ste = torques[:, None] * (0.08 + 0.02 * np.sign(np.cos(2 * np.pi * x)) + 0.001 * np.cos(6 * np.pi * x))
    return made_up_sweep(ste, torques, np.stack([0.5 * x, 1.0 - 0.5 * x, 0.0 * x], axis=-1), first_pair=-1)


def legend_texts(figure):
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def draw(figure):
    """Lay out, so that errors of layout and labels surface."""
    figure.draw_without_rendering()


def assert_units_on_every_axis(figure):
    for axes in figure.axes:
        # Panels that share an axis carry its label once.
        for label in (axes.get_xlabel(), axes.get_ylabel()):
            assert not label or UNIT.search(label), f"no unit in {label!r}"
    labels = [axes.get_xlabel() + axes.get_ylabel() for axes in figure.axes]
    assert any(labels)


def sector():
    """A 4 x 3 patch of quads with its left column as flank."""
    x, y = np.meshgrid(np.linspace(-2.0, 2.0, 4), np.linspace(36.0, 46.0, 5))
    nodes = np.column_stack([x.ravel(), y.ravel()])
    i = np.arange(20).reshape(5, 4)
    quads = np.stack([i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]], axis=-1).reshape(-1, 4)
    return nodes, quads, nodes[i[2:, 0]]


def pattern(pressure=400.0):
    cells = np.zeros((12, 5))
    cells[4:6] = pressure
    roll, z = np.radians(np.linspace(10, 30, 13)), np.linspace(-10, 10, 6)
    return ContactPattern(0, 40.0, 0.5, roll, z, cells, largest=cells.max())


def all_charts():
    sweep = make_sweep()
    return {
        "ste": ste_figure(sweep, make_sweep((100.0,), 7)),
        "load sharing": load_sharing_figure(sweep),
        "spectrum": spectrum_figure(sweep),
        "stiffness": stiffness_figure(sweep, mesh_stiffness(sweep, 40.0, 20.0)),
        "error": error_figure(sweep.phi_rad, sweep.torque_Nm, 1e-3 * sweep.ste_um),
        "mesh": mesh_figure(*sector()),
        "contact pattern": contact_pattern_figure([pattern()] * 2),
        "conditions": conditions_figure(sweep, 1, [ConditionSweep("x" * 60, Assembly(), 0, sweep)]),
    }


def test_every_figure_renders_and_names_its_units():
    for figure in map(figure_of, all_charts().values()):
        draw(figure)
        assert_units_on_every_axis(figure)


@pytest.mark.parametrize("name", all_charts())
def test_no_word_of_a_panel_is_cut_or_as_small_that_a_phone_cannot_show_it(name):
    """A phone shows a panel at 0.85 of its size: 358 of 420 px."""
    for svg in chart_svgs(all_charts()[name]):
        root = ElementTree.fromstring(svg)
        _, _, width, height = map(float, root.get("viewBox").split())
        assert width == WIDTH
        for text in root.iter("text"):
            assert float(text.get("font-size")) >= LEAST_SIZE
            size, turned = width_of(text.text, float(text.get("font-size"))), text.get("x") is None
            x, y = (
                map(float, re.findall(r"translate\(([-\d.]+) ([-\d.]+)", text.get("transform"))[0]) if turned
                else (float(text.get("x")), float(text.get("y")))
            )  # fmt: skip
            first = {"start": 0.0, "middle": -0.5 * size, "end": -size}[text.get("text-anchor")]
            low, room = (y - 0.5 * size, height) if turned else (x + first, width)
            assert -ROUNDED <= low <= room + ROUNDED - size, text.text


def test_every_colour_of_words_and_of_axes_has_another_one_on_dark_paper():
    for chart in all_charts().values():
        for colour in re.findall(r'<text[^>]* fill="(#\w+)"', "".join(chart_svgs(chart))):
            assert colour in DARK or colour == "#b00020"


def test_ste_figure_has_a_curve_and_markers_per_torque_in_one_colour():
    figure = figure_of(ste_figure(make_sweep(), make_sweep((30.0, 160.0), 7)))
    lines = [line for line in figure.axes[0].get_lines() if len(line.get_xdata())]
    curves = [line.get_color() for line in lines if line.get_linestyle() == "-"]
    markers = [line.get_markeredgecolor() for line in lines if line.get_marker() == "o"]
    assert (len(set(curves)), len(markers)) == (3, 2)
    assert markers == [curves[2], curves[0]], "curves are drawn from the largest torque down, as the key has them"
    assert legend_texts(figure) == ["160 N m", "100 N m", "30 N m", "reduced", "full FE"]


def test_ste_curve_goes_through_the_positions_that_are_compared():
    """Chords of a coarse sweep must not look like an error of the reduced model."""
    fine = make_sweep((30.0, 100.0), 48)
    odd = replace(
        fine, phi_rad=fine.phi_rad[1::6], ste_um=fine.ste_um[:, 1::6], pair_share=fine.pair_share[:, 1::6],
        newton_steps=fine.newton_steps[:, 1::6], converged=fine.converged[:, 1::6],
    )  # fmt: skip
    figure = figure_of(ste_figure(make_sweep((100.0,), 6), odd, odd))
    curves = figure.axes[0].get_lines()[:2]
    assert [curve.get_linestyle() for curve in curves] == ["-", ":"], "30 N m is only compared"
    for curve, ste in zip(curves, odd.ste_um[::-1], strict=True):
        assert_allclose(np.interp(np.degrees(odd.phi_rad), *curve.get_data()), ste, rtol=ROUND_OFF)


@pytest.mark.slow
def test_positions_that_did_not_converge_are_gaps_and_are_counted():
    sweep = make_sweep()
    sweep.ste_um[1, 3:5] = np.nan
    figure = figure_of(ste_figure(sweep))
    draw(figure)
    assert "2 of 72 positions did not converge" in figure.axes[0].get_title()
    draw(figure_of(load_sharing_figure(sweep)))
    draw(figure_of(spectrum_figure(sweep)))
    draw(figure_of(error_figure(sweep.phi_rad, sweep.torque_Nm, sweep.ste_um * np.nan)))


def test_the_nominal_torque_is_in_every_picture_however_many_there_are():
    many = make_sweep(np.linspace(1.0, 1000.0, 1000), 6)
    stiffness = mesh_stiffness(many, 40.0, 20.0)
    for drawn in (
        ste_figure(many, nominal_Nm=137.0), load_sharing_figure(many, 137.0), spectrum_figure(many, nominal_Nm=137.0),
        stiffness_figure(many, stiffness, 137.0),
    ):  # fmt: skip
        assert ", 137, " in drawn.heading == figure_of(drawn).get_suptitle()
    assert "137 N m, nominal" in legend_texts(figure_of(ste_figure(many, nominal_Nm=137.0)))


def test_load_sharing_leaves_out_pairs_that_never_carry_and_ends_a_share_where_its_successor_began():
    figure = figure_of(load_sharing_figure(make_sweep()))
    assert len(figure.axes) == 3
    assert legend_texts(figure) == ["pair -1", "pair 0"]
    assert_allclose([line.get_ydata()[-1] for line in figure.axes[0].get_lines()], [100.0, 0.0])


@pytest.mark.parametrize(("angles", "count"), [(24, 10), (12, 5)], ids=["ten", "what the sweep resolves"])
def test_spectrum_has_orders_per_torque_on_a_logarithmic_axis(angles, count):
    axes = figure_of(spectrum_figure(make_sweep(n=angles))).axes[0]
    assert axes.get_yscale() == "log"
    assert [len(bars) for bars in axes.containers] == [count] * 3
    assert_allclose(axes.get_xticks(), np.arange(1, count + 1))


def test_mesh_figure_highlights_the_loaded_flank_and_zooms_on_it():
    nodes, quads, flank = sector()
    whole, zoom = figure_of(mesh_figure(nodes, quads, flank)).axes
    for axes in (whole, zoom):
        (line,) = [line for line in axes.get_lines() if line.get_label() == "loaded flank"]
        assert line.get_color() == LOADED_FLANK_COLOUR
        assert_allclose(np.column_stack(line.get_data()), flank)
        assert axes.get_aspect() == 1.0
        assert len(axes.collections[0].get_paths()) == len(quads)
    (x0, x1), (y0, y1) = zoom.get_xlim(), zoom.get_ylim()
    assert ((flank > [x0, y0]) & (flank < [x1, y1])).all()
    assert y1 - y0 < np.ptp(whole.get_ylim())


def test_contact_pattern_uses_one_scale_and_states_the_peaks():
    figure = figure_of(contact_pattern_figure([pattern(), pattern(0.0)]))
    draw(figure)
    first, second, *_ = figure.axes
    assert first.get_title() == "Pinion flank, 50 % of torque\nlargest 400 MPa"
    assert second.get_title() == "Pinion flank, 50 % of torque\nno contact"
    assert first.collections[0].get_clim() == second.collections[0].get_clim() == (0.0, 400.0)
    assert_allclose(first.get_xlim(), [-10.0, 10.0])


def test_a_contact_pattern_at_a_sharp_edge_tells_no_larger_pressure_than_the_table():
    sharp = replace(pattern(1300.0), largest=650.0), replace(pattern(), largest=np.nan)
    figure = figure_of(contact_pattern_figure(sharp))
    draw(figure)
    first, second, *_ = figure.axes
    assert first.get_title().endswith("largest 650 MPa")
    assert second.get_title().endswith("a sharp edge carries all")
    assert first.collections[0].get_clim() == (0.0, 650.0)


def test_contact_pattern_of_nothing_is_refused():
    with pytest.raises(ValueError, match="no tooth pair"):
        figure_of(contact_pattern_figure([]))


@pytest.mark.parametrize("name", ["$\\bad$", "_hidden", "50 $ or $ 60", "a^{b", "%s{x:g}"])
def test_names_of_conditions_are_shown_as_they_are_written(name):
    sweep = make_sweep()
    figure = figure_of(conditions_figure(sweep, 1, [ConditionSweep(name, Assembly(), 0, sweep)]))
    draw(figure)
    assert [text.strip() for text in legend_texts(figure)] == [name, "the case's own"]
    assert not any(text.get_parse_math() for text in figure.legends[0].get_texts())


@pytest.mark.parametrize("top", [30.0, 1e3, 1e9])
def test_logarithmic_axes_have_plain_numbers(top):
    with panels(1, 4.0, 4.0) as (figure, (axes,)):
        axes.plot([1.0, top], [1e-3, 1e-3 * top])
        log_log(axes)
        figure.canvas.draw()
        labels = [label.get_text() for axis in (axes.xaxis, axes.yaxis) for label in axis.get_ticklabels(which="both")]
    assert any(labels)
    for label in filter(None, labels):
        float(label)


@pytest.mark.slow
def test_pictures_look_the_same_whatever_the_users_settings():
    def picture():
        return picture_bytes(figure_of(ste_figure(make_sweep(), make_sweep((100.0,), 7))), "png")

    expected = picture()
    with matplotlib.rc_context():
        matplotlib.style.use("dark_background")
        matplotlib.rcParams.update({"text.usetex": True, "font.size": 30, "savefig.dpi": 20, "savefig.bbox": "tight"})
        assert picture() == expected


@pytest.mark.parametrize(
    ("kind", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml"), pytest.param("pdf", b"%PDF", marks=pytest.mark.slow)]
)
def test_picture_files_hold_what_their_names_say_and_no_time_of_day(kind, start, tmp_path, monkeypatch):
    target = tmp_path / f"ste.{kind}"
    write_picture(Picture(target.name, "", ste_figure(make_sweep((100.0,)))).content(kind), target)
    found = target.read_bytes()
    assert found.startswith(start)
    assert [p.name for p in tmp_path.iterdir()] == [target.name]
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")  # what dates there are would be of 1970 now
    write_picture(Picture(target.name, "", ste_figure(make_sweep((100.0,)))).content(kind), target)
    assert target.read_bytes() == found
