"""What a study file may say, and how it is refused."""

from pathlib import Path

import pytest

from pmor.core.errors import CaseError
from pmor.lab.study.measures import study_cases
from pmor.lab.study.settings import Cell, ReferenceMesh, load, parse_study, quick_study
from tests.support.refusals import refused
from tests.support.small_case import case_text

SHIPPED = Path(__file__).parents[2] / "cases" / "paper_study.toml"

TEXT = """
base = "base.toml"
[grid]
cells = ["4@2", "6@1"]
[[variant]]
name = "facets"
cell = "6@2"
contact = { scheme = "facet" }
[reference]
meshes = [[6, 1, 2], [8, 1, 2]]
[quick]
cells = ["4@2"]
meshes = [[5, 1, 1], [6, 1, 1]]
"""


def parse(text, folder=Path()):
    return parse_study(text, "small", "small.toml", folder)


@pytest.fixture
def base(tmp_path):
    (tmp_path / "base.toml").write_text(case_text())
    return tmp_path


def test_cells_know_their_detail_and_name():
    assert Cell(16, 4).detail == 64
    assert Cell(16, 4).label == "16@4"
    assert Cell(8, 8, "as printed").label == "8@8 as printed"


def test_a_study_says_what_its_file_says():
    study = parse(TEXT)
    assert study.grid.cells == (Cell(4, 2), Cell(6, 1))
    assert study.cells == (*study.grid.cells, Cell(6, 2, "facets"))
    assert study.reference.meshes == (ReferenceMesh(6, 1, 2), ReferenceMesh(8, 1, 2))
    assert study.peer is None
    assert study.title == "small"


def test_cells_become_cases(base):
    cases = study_cases(parse(TEXT, base))
    plain, facets = cases.cells[Cell(4, 2)], cases.cells[Cell(6, 2, "facets")]
    assert (plain.mesh.profile_elements, plain.contact.lodm_profile, plain.contact.scheme) == (4, 2, "direct")
    assert (facets.mesh.profile_elements, facets.contact.lodm_profile, facets.contact.scheme) == (6, 2, "facet")
    assert plain.compare.torques_Nm == (60.0, 100.0)  # of the base case
    assert cases.meshes[ReferenceMesh(8, 1, 2)].mesh.profile_elements == 8
    # Keys that make no difference to a cell leave its case as the base case has it.
    assert plain.pair == facets.pair


def test_quick_shortens(base):
    study = quick_study(parse(TEXT, base))
    assert study.cells == (Cell(4, 2),)
    assert (parse(TEXT, base).curve_angles, study.curve_angles) == (200, 100)
    case = study_cases(study).cells[Cell(4, 2)]
    assert (case.offline.angles_per_pitch, case.compare.angles) == (20, 8)
    with pytest.raises(CaseError, match=r"\[quick\]: is missing"):
        quick_study(parse(TEXT[: TEXT.index("[quick]")]))


def test_the_shipped_study_is_the_papers_table():
    study = load(SHIPPED)
    assert {cell.label for cell in study.grid.cells} == {
        "8@1", "8@2", "8@4", "8@8", "16@1", "16@2", "16@4", "32@1", "32@2", "64@1",
    }  # fmt: skip
    finest = study.reference.meshes[-1]
    assert all(finest.n_profile > cell.n_profile for cell in study.cells)
    cases = study_cases(study)
    assert all(finest.n_width > case.mesh.width_elements for case in cases.cells.values())
    assert all(case.offline.angles_per_pitch <= 40 for case in cases.cells.values())
    assert all(len(case.offline.torques_Nm) <= 3 for case in cases.cells.values())
    assert len(quick_study(study).cells) == 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('base = "base.toml"', "", "base: is missing"),
        ("[grid]", "[gird]", r"\[gird\]: unknown section: did you mean grid"),
        ('cells = ["4@2", "6@1"]', "", r"\[grid\] cells: is missing"),
        ('"4@2", "6@1"', '"4x2"', r"\[grid\] cells = .*write text such as \"16@4\""),
        ('"4@2", "6@1"', '"4@2", "4@2"', r"\[grid\] cells = .*has an entry twice"),
        ("[grid]", "[grid]\nangles_per_pich = 9", "angles_per_pich: unknown key: did you mean angles_per_pitch"),
        ("[[6, 1, 2], [8, 1, 2]]", "[[6, 1, 2]]", r"\[reference\] meshes: must be two or three"),
        ("[[6, 1, 2], [8, 1, 2]]", "[[8, 1, 2], [6, 1, 2]]", r"\[reference\] meshes: .*coarse to fine"),
        ("[[6, 1, 2], [8, 1, 2]]", "[[6, 1], [8, 1]]", r"\[reference\] meshes = .*each value must be"),
        ('name = "facets"\n', "", r"\[variant\] name: is missing"),
        ('contact = { scheme = "facet" }', 'scheme = "facet"', r"\[variant\] scheme = .*unknown key"),
        ("[grid]", "[conventional]\nsolved = [\"9@9\"]\n[grid]", r"solved: 9@9: is not among the \[grid\] cells"),
        ("[grid]", "[[grid]]", "grid: must be a section"),
        ("[grid]", "a = " + "[" * 100_000 + "\n[grid]", "not valid TOML: .* nested too deeply"),
        ("[[variant]]", "[variant]", "variant: must be a list of sections"),
        ("[reference]\nmeshes", "[reference]\nmembers", r"members: unknown key: was renamed: write meshes"),
    ],
)  # fmt: skip
def test_what_is_refused(old, new, message):
    assert old in TEXT
    with pytest.raises(CaseError, match=message) as caught:
        parse(TEXT.replace(old, new))
    assert str(caught.value).startswith("small.toml: ")
    assert "\n" not in str(caught.value)


def test_what_a_cell_makes_of_the_base_case_is_refused_with_the_cell_named(base):
    text = TEXT.replace('scheme = "facet"', 'scheme = "facets"')
    with pytest.raises(CaseError, match=r"cell 6@2 facets: \[contact\] scheme = .*did you mean facet"):
        study_cases(parse(text, base))


def test_a_bad_study_is_one_line_and_exit_code_2(base):
    path = base / "study.toml"
    path.write_text(TEXT.replace("[grid]", "[gird]"))
    refused("lab", "study", path, "--out", base / "out", words=["gird"])
    assert not (base / "out").exists()
    refused("lab", "study", base / "none.toml", words=["none.toml: there is no such study file"])


VARIANTS = 'base = "base.toml"\n[[variant]]\nname = "wide"\ncell = "4@1"\npair = { face_width_mm = 30.0 }\n'


def test_a_study_of_variants_alone_needs_no_reference(base):
    study = parse(VARIANTS, base)
    assert (study.reference, study.meshes, study.cells) == (None, (), (Cell(4, 1, "wide"),))
    assert [case.pair.face_width_mm for case in study_cases(study).cells.values()] == [30.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (VARIANTS + '[grid]\ncells = ["4@2"]\n', r"\[reference\] meshes: is missing"),
        ('base = "base.toml"\n', r"\[\[variant\]\]: is missing: add one"),
    ],
)
def test_a_study_needs_something_to_compare(text, message):
    with pytest.raises(CaseError, match=message):
        parse(text)
