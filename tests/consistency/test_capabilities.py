"""Each cell of the matrix of capabilities: what it promises is done on a small machine, what it refuses is refused."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

import pmor
from pmor.app.export import export_file
from pmor.case.capability import ASKED, why_not
from pmor.gear.modification import Modification
from tests.programs import capability_page
from tests.support.matrix import ROWS, written_row

PAGE = Path(__file__).parents[2] / capability_page.PAGE
ALWAYS = ("spur",)
VARIABLE = {"key": "profile_crowning_um", "gear": "{gear}", "range": [0.0, 8.0]}
SEARCH = "[search]\nsamples = 8\ndescents = 1\nangles = 8\n[pareto]\npoints = 0\n"
CAMPAIGN = '[designs]\nmethod = "list"\n{key} = [{values}]\n'
pytestmark = [pytest.mark.jit, pytest.mark.usefixtures("undrawn")]


def numbers(data, key):
    """All numbers below a key, at any depth."""
    if isinstance(data, dict):
        inside = [number for name, value in data.items() if name != key for number in numbers(value, key)]
        return [*_flat(data.get(key)), *inside]
    return [number for one in data for number in numbers(one, key)] if isinstance(data, list) else []


def _flat(value):
    if isinstance(value, list):
        return [number for one in value for number in _flat(one)]
    if isinstance(value, dict):
        return [number for one in value.values() for number in _flat(one)]
    return [value] if isinstance(value, int | float) and math.isfinite(value) else []


class Machine:
    """A machine of a row, its results, and a question for each column."""

    def __init__(self, row, folder):
        self.row, self.folder, self.path = row, folder, written_row(row, folder)
        self.file, self.out = pmor.load(self.path), folder / "out"
        self.kind = type(self.file).__name__
        self.result = pmor.run(self.file, self.out)
        assert self.result.failures == ()
        names = {"Case": "summary.json", "SetFile": "set.json", "GearboxFile": "gearbox.json"}
        self.data = json.loads((self.out / names[self.kind]).read_text())

    def is_set(self):
        return self.kind == "SetFile"

    def sweep(self):
        assert numbers(self.data, "ste_peak_to_peak_um")

    def full(self):
        assert max(numbers(self.data, "rom_vs_full_ste_max_rel")) < 1e-6

    def error_bar(self):
        """Of sets and meshes of gearboxes where they ask: `tests/verification/test_gears_in_gearboxes.py`."""
        assert numbers(self.data, "ste_mesh_error_percent") or self.kind != "Case"

    def what_if(self):
        """Other flanks, from the finite elements that are kept."""
        if self.kind == "Case":
            model = pmor.load_model(self.out / "basis.h5")
            crowned = replace(self.file.pinion_modification or Modification(), profile_crowning_um=3.0)
            torques = [-80.0] if self.row == "coast flanks" else [80.0]
            swept, plain = (model.sweep(torques, pinion=flank) for flank in (crowned, None))
            assert abs(swept.ste_um - plain.ste_um).max() > 0.1
        else:
            assert [*(self.folder / "compliances").rglob("*.h5")]

    def root_stress(self):
        assert numbers(self.data, "root_stress_max_MPa") or numbers(self.data, "max_principal_MPa")

    def pressure(self):
        assert min(numbers(self.data, "flank_pressure_max_MPa")) > 0.0

    def losses(self):
        assert max(numbers(self.data, "loss_factor")) > 0.0

    def duty(self):
        assert "duty" in self.data
        if self.kind == "Case":
            often, full = self.data["torques"]
            assert self.data["duty"]["losses_W"] == pytest.approx(0.75 * often["losses_W"] + 0.25 * full["losses_W"])

    def tolerances(self):
        """Of rows that have some: `tests/verification/test_set_errors.py` has the truth of each."""
        if self.kind == "GearboxFile" or "[tolerances]" in self.path.read_text():
            assert min(numbers(self.data, "percentile_95")) > 0.0
        if self.kind != "GearboxFile" and "[tolerances]" in self.path.read_text():
            assert len((self.out / "tolerances.csv").read_text().splitlines()) == 9

    def design(self):
        key = {"Case": "case", "SetFile": "set", "GearboxFile": "gearbox"}[self.kind]
        gear = next(iter(ROWS_GEARS.get(self.row, ("pinion",))))
        text = f'{key} = "{self.path.name}"\n[[variables]]\nkey = "profile_crowning_um"\ngear = "{gear}"\n'
        path = self.folder / "design.toml"
        path.write_text(f"{text}range = [0.0, 8.0]\n{SEARCH}")
        assert pmor.plan(path)
        assert pmor.run(path).data["pareto"]

    def campaign(self):
        key, varied = {
            "Case": ("case", "pinion.profile_shift"), "SetFile": ("set", "planet.bore_radius_mm"),
            "GearboxFile": ("gearbox", "bearings.A.at_mm"),
        }[self.kind]  # fmt: skip
        varied = "input.bore_radius_mm" if self.row == "power split" else varied
        path = self.folder / "campaign.toml"
        values = {"Case": "0.0, 0.1", "SetFile": "15.0, 16.0", "GearboxFile": "9.0, 11.0"}[self.kind]
        path.write_text(f'{key} = "{self.path.name}"\n{CAMPAIGN.format(key=varied, values=values)}')
        assert "2" in pmor.plan(path)

    def page(self):
        assert "Change the" in (self.out / "report.html").read_text()

    def vtkhdf(self):
        if self.kind == "Case":
            assert export_file(self.out / "basis.h5", "vtkhdf", self.folder / "pair.vtkhdf").stat().st_size > 1000
        else:
            assert [*self.out.glob("*.vtkhdf")]

    def rexs(self):
        source = self.out / "basis.h5" if self.kind == "Case" else self.path
        assert export_file(source, "rexs", self.folder / "machine.rexs").stat().st_size > 1000

    def tables(self):
        assert pmor.load_results(self.out / "results.h5")
        assert [*self.out.glob("*.csv")]

    def python(self):
        assert str(self.result)

    def plan(self):
        assert pmor.plan(self.file)

    def dynamics(self):
        """Takes up to minutes: in a test of its own."""


# Gears whose flanks a design varies, where it has no pinion.
ROWS_GEARS = {
    **dict.fromkeys(("eccentric", "supports", "planetary set", "stepped planets"), ("sun",)), "power split": ("input",),
    "set in a gearbox": ("sun",),
}  # fmt: skip
# Doors of their own, which refuse what the plan says.
DOORS = ("design", "campaign", "vtkhdf", "rexs")


def refused(machine, asked, why):
    """In the words of the table: by the plan, and at each door of its own."""
    words = " ".join(pmor.plan(machine.file).split())
    assert " ".join(why.split("takes ", 1)[1].split()) in words, asked
    if asked in DOORS:
        with pytest.raises(pmor.PmorError) as refusal:
            getattr(machine, asked)()
        assert why.split("takes ", 1)[1].split(": ")[0] in str(refusal.value)


@pytest.mark.parametrize("row", [row if row in ALWAYS else pytest.param(row, marks=pytest.mark.slow) for row in ROWS])
def test_every_cell_of_the_matrix_does_what_it_says(row, tmp_path):
    machine = Machine(row, tmp_path)
    for asked in ASKED:
        if why := why_not(machine.file, asked):
            refused(machine, asked, why)
        else:
            getattr(machine, asked)()


@pytest.mark.slow
@pytest.mark.parametrize("row", ROWS)
def test_machines_move_where_the_matrix_says_so(row, tmp_path):
    """All of it is found, and it is motion."""
    file = pmor.load(written_row(row, tmp_path))
    if why := why_not(file, "dynamics"):
        with pytest.raises(pmor.PmorError) as refusal:
            pmor.run_dynamics(file)
        assert why in str(refusal.value)
        return
    moved = pmor.run_dynamics(file, tmp_path / "out")
    assert moved.failures == ()
    rows = list(csv.DictReader((tmp_path / "out" / "response.csv").read_text().splitlines()))
    assert max(float(row[key]) for row in rows for key in row if "rms" in key and row[key]) > 0.0


def test_the_page_of_the_manual_is_made_from_the_table():
    assert PAGE.read_text(encoding="utf-8") == capability_page.page()
