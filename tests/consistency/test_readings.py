"""What a run of exact line loads leaves beside the transmission error: results file, tables, pictures, and the API."""

import json
import math
from dataclasses import replace

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.app.model import ReducedModel
from pmor.case import change_case
from pmor.core.errors import FileFormatError, GeometryError
from pmor.gear.modification import Modification
from pmor.pair.model import refuse_loads
from pmor.report.parameter_words import parameter_words
from pmor.report.readings_blocks import readings_picture_names, readings_pictures, sensitivities_table
from pmor.report.results_data import HARRIS, RESULTS
from pmor.report.run_page import page_files, run_pictures
from pmor.report.summary import result_files, summary, summary_rows, write_results
from pmor.report.torque_table import load_table, torque_rows
from pmor.results.sweep import orders_of
from pmor.storage.describe import file_text
from pmor.storage.results_file import RESULTS_SCHEMA, read_results
from pmor.storage.results_layout import RESULTS_LAYOUT
from pmor.work.online import run_online
from pmor_online.model import reduced_pair
from pmor_online.readings import LIGHT
from tests.support.broken_files import flip_bit
from tests.support.line_pairs import models
from tests.support.stored_files import rows_of

RELIEF = {"tip_relief_um": 8.0, "tip_relief_start_roll_deg": 26.0, "helix_crowning_um": 6.0}
TORQUES = [40.0, 100.0]


def model_of(name, width="whole", **changes):
    """The reduced model of a small pair of line loads, asked for two torques and a Harris map of three."""
    basis = models(name, width=width, root_stress=True)[1].basis
    asked = {"online": {"torques_Nm": TORQUES, "angles_per_pitch": 12}, "pinion.modification": RELIEF} | changes
    asked = {"results": {"harris_torques_Nm": [20.0, 60.0, 100.0]}} | asked
    return ReducedModel(replace(basis, case=change_case(basis.case, **asked)))


def run_of(model, folder):
    path = folder / "basis.h5"
    path.write_bytes(b"its size is told")
    return run_online(reduced_pair(model.basis), path)


@pytest.fixture(scope="module", params=["spur", pytest.param("helical", marks=pytest.mark.slow)])
def run(request, tmp_path_factory):
    found = run_of(model_of(request.param), tmp_path_factory.mktemp("run"))
    return replace(found, sweep=replace(found.sweep, mesh_error_percent=np.array([0.2, 0.3])))  # the basis has none


def test_results_file_holds_what_was_found_and_says_what_it_is(run, tmp_path):
    write_results(run, tmp_path)
    assert {path.name for path in tmp_path.iterdir() if not path.name.startswith(".")} == set(result_files(run.case))
    found = read_results(tmp_path / RESULTS)
    assert found.case_name == run.case.name
    assert found.case_text == run.case.text
    assert found.names["parameters"] == run.readings.sensitivities.parameter
    assert set(found.arrays) == set(RESULTS_LAYOUT)
    assert_allclose(found.arrays["ste/ste"], run.sweep.ste_um, rtol=0.0)
    assert_allclose(found.arrays["lines/load"], run.sweep.states.lines.load_N_per_mm, rtol=0.0)
    assert_allclose(found.arrays["maps/wheel/pressure"][1], run.readings.maps[1][1].pressure_MPa, rtol=0.0)
    radius = run.reduced.meshed.pair.pinion.base_radius
    assert_allclose(found.arrays["ste/rotation"] * radius, 1e3 * found.arrays["ste/ste"], rtol=1e-14)
    # The orders make the curve again: 12 angles resolve 5 of them, so at their middle nothing is exact but the mean.
    assert_allclose(found.arrays["orders/amplitude"][1], orders_of(run.sweep, 1).amplitude, rtol=0.0)
    text = file_text(tmp_path / RESULTS)
    assert "pmor-results" in text
    assert all(name in text for name in RESULTS_LAYOUT)


def test_arrays_of_a_results_file_have_named_axes_with_coordinates(run, tmp_path):
    """As netCDF wants it: read by hand with xarray 2026.9, by h5netcdf 1.8 and netCDF4 1.7."""
    write_results(run, tmp_path)
    with h5py.File(tmp_path / RESULTS) as file:
        for name, field in RESULTS_LAYOUT.items():
            scales = [(file[name],)] if file[name].is_scale else [axis.values() for axis in file[name].dims]
            assert [len(found) for found in scales] == [1] * file[name].ndim, name
            assert tuple(len(scale) for (scale,) in scales) == file[name].shape
            for (scale,), axis in zip(scales, field.dims.split(", "), strict=True):
                path, place = scale.name.rpartition("/")[::2]
                assert path == f"/{name.rpartition('/')[0]}"
                assert place.removesuffix("_number") == axis
        assert_allclose(file["lines/torque"][()], TORQUES, rtol=0.0)
        assert_allclose(file["lines/angle"][()], run.sweep.phi_rad, rtol=0.0)
        assert [axis[0].name for axis in file["ste/ste"].dims] == ["/ste/torque", "/ste/angle"]


def test_a_results_file_that_was_changed_is_refused(run, tmp_path):
    write_results(run, tmp_path)
    path = tmp_path / RESULTS
    flip_bit(path, path.stat().st_size // 2)
    with pytest.raises(FileFormatError, match="damaged"):
        file_text(path)
    with pytest.raises(FileFormatError, match=RESULTS_SCHEMA.remedy):
        read_results(tmp_path / "summary.json")


def test_summary_has_the_figures_of_the_nominal_torque(run):
    s, readings, i = summary(run), run.readings, run.nominal
    assert s["k_h_beta"] == readings.figures["k_h_beta"][i]
    assert s["flank_pressure_max_MPa"] == np.nanmax(run.sweep.states.lines.pressure_MPa[i])
    assert len(s["ste_harmonics_um"]) == 10
    assert_allclose(s["ste_harmonics_um"][:5], orders_of(run.sweep, i).amplitude, rtol=1e-14)
    pair = run.reduced.meshed.pair
    deflection = run.sweep.ste_um[i] - run.sweep.unloaded_um[i]
    mean = np.mean(1e3 * TORQUES[i] / pair.pinion.base_radius / pair.common_width / deflection)
    assert_allclose(s["mesh_stiffness_mean_N_per_mm_um"], mean, rtol=1e-12)
    assert 1.0 < s["mesh_stiffness_tangent_mean_N_per_mm_um"] / s["mesh_stiffness_mean_N_per_mm_um"] < 2.0
    json.dumps(s)
    assert {"K_Hβ", "flank pressure, max"} <= {label for label, *_ in summary_rows(run)}


def test_harris_table_begins_with_the_rigid_flanks(run, tmp_path):
    write_results(run, tmp_path)
    rows = [[float(value) for value in row.values()] for row in rows_of(tmp_path / HARRIS)]
    assert [row[0] for row in rows] == [0.0, 20.0, 60.0, 100.0]
    sweep = run.readings.harris
    assert_allclose([row[2] for row in rows[1:]], np.ptp(sweep.ste_um, axis=1), rtol=1e-15)
    assert_allclose(rows[0][2], np.ptp(sweep.unloaded_um[0]), rtol=1e-15)
    assert_allclose(sweep.ste_um[2], run.sweep.ste_um[1], rtol=1e-12)


@pytest.mark.slow
def test_harris_map_and_light_pattern_see_all_teeth_that_the_sweep_sees(tmp_path):
    """With pitch deviations the first pitch shows a part of the peak-to-peak alone: a turn is the default."""
    online = {"torques_Nm": TORQUES, "angles_per_pitch": 6}
    deviations = [12.0 * math.sin(2.0 * math.pi * tooth / 21) for tooth in range(21)]
    model = model_of("spur", online=online, **{"pinion.modification": {"pitch_deviations_um": deviations}})
    run = run_of(model, tmp_path)
    assert_allclose(run.readings.harris.ste_um[2], run.sweep.ste_um[1], rtol=1e-12)
    assert np.ptp(run.sweep.ste_um[1]) > 2.0 * np.ptp(run.sweep.ste_um[1, :6])
    assert_allclose(model.harris_map().ste_um, run.readings.harris.ste_um, rtol=0.0)
    light = model.sweep([LIGHT * model.case.torque_Nm]).flank_maps()[0]
    assert_allclose(run.readings.light[0].load_N_per_mm, light.load_N_per_mm, rtol=0.0)
    note = next(note for label, _, _, note in summary_rows(run) if label == "STE mean")
    assert "over 126 angles of 21 pitches" in note
    assert "over 21 pitches" in run_pictures(run, None)[0].caption


def test_page_has_a_picture_and_a_table_for_each(run):
    pictures = readings_pictures(run)
    assert tuple(picture.file_name.removesuffix(".svg") for picture in pictures) == (
        "harris", "flank_maps", "flank_pattern",
    )  # fmt: skip
    assert {picture.file_name for picture in pictures} <= set(page_files(run.case))
    over_torque, (derivatives,) = load_table(run, torque_rows(run)), sensitivities_table(run)
    assert [row[0] for row in over_torque.rows] == TORQUES
    names = run.readings.sensitivities.parameter
    assert [row[0] for row in derivatives.rows] == [parameter_words(name) for name in names], "in words, no keys"
    assert not {row[0] for row in derivatives.rows} & set(names)


def test_maps_that_nobody_asks_for_are_not_made(tmp_path):
    run = run_of(model_of("spur", results={"harris_torques_Nm": [100.0], "maps": False}), tmp_path)
    assert run.readings.maps == ()
    assert run.readings.light is None
    assert readings_picture_names(run.case) == ("harris",)
    assert [picture.file_name for picture in readings_pictures(run)] == ["harris.svg"]
    write_results(run, tmp_path)
    assert not {name for name in read_results(tmp_path / RESULTS).arrays if name.startswith(("maps", "light"))}


def test_shapes_without_line_loads_leave_the_file_without_them(small_model, small_basis, small_basis_path, tmp_path):
    run = run_online(reduced_pair(small_basis), small_basis_path)
    assert run.readings is None
    write_results(run, tmp_path)
    groups = {name.partition("/")[0] for name in read_results(tmp_path / RESULTS).arrays}
    assert groups == {"ste", "stiffness", "orders"}
    assert not (tmp_path / HARRIS).exists()
    assert summary(run)["k_h_beta"] is None
    assert summary(run)["mesh_stiffness_mean_N_per_mm_um"] > 0.0
    assert sensitivities_table(run) == []
    with pytest.raises(ValueError, match="keeps no line loads"):
        ReducedModel(small_basis).sweep(angles=4).k_h_beta  # noqa: B018


def test_python_reads_the_same_off_a_sweep(run):
    model = model_of("helical" if run.reduced.meshed.pair.base_helix_angle else "spur")
    result = model.sweep()
    assert_allclose(result.k_h_beta, run.readings.figures["k_h_beta"], rtol=0.0)
    assert_allclose(result.effective_contact_ratio, run.readings.figures["effective_contact_ratio"], rtol=0.0)
    assert_allclose(result.sensitivities().ste, run.readings.sensitivities.ste, rtol=0.0)
    assert_allclose(result.mesh_forces().moment_Nm, run.readings.forces.moment_Nm, rtol=0.0)
    assert_allclose(result.flank_maps()[0].load_N_per_mm, run.readings.maps[1][0].load_N_per_mm, rtol=0.0)
    assert_allclose(result.line_loads.load_N_per_mm, run.sweep.states.lines.load_N_per_mm, rtol=0.0)
    assert_allclose(result.stiffness.tangent_torque_Nm, TORQUES)
    assert_allclose(model.harris_map().ste_um, run.readings.harris.ste_um, rtol=0.0)
    assert len(result.plot_flank_maps().axes) == 8
    assert len(result.plot_harris_map().axes) == 2


def test_derivatives_of_mean_and_peak_to_peak_foretell_a_small_change():
    model = model_of("spur")
    before, step = model.sweep(), 0.01
    names = before.sensitivities().parameter
    after = model.sweep(pinion=Modification(**RELIEF | {"helix_crowning_um": 6.0 + step}))
    k = names.index("pinion.helix_crowning_um")
    # The second derivative counts: measured 3e-4.
    assert_allclose(after.mean_um - before.mean_um, step * before.sensitivities().mean[k], rtol=2e-3)
    change = step * before.sensitivities().peak_to_peak[k]
    assert_allclose(after.peak_to_peak_um - before.peak_to_peak_um, change, rtol=2e-2, atol=1e-6)


def test_a_torque_of_the_harris_map_beyond_the_contact_model_is_refused():
    model = model_of("spur", results={"harris_torques_Nm": [1e4]})
    with pytest.raises(GeometryError, match="torque 10000 N m: makes the contact"):
        refuse_loads(model.case, model.reduced.meshed)
