"""A basis that somebody made on purpose, checksums and all: names are no paths, and nothing odd reaches a kernel."""

import tracemalloc

import h5py
import numpy as np
import pytest

from pmor.app.cli import main
from pmor.core.errors import FileFormatError
from pmor.storage.basis_file import read_basis
from pmor.storage.describe import file_text
from pmor.storage.hdf5 import set_attributes
from pmor.storage.results_file import ResultsFile, write_results_file
from pmor.work.offline import run_offline
from tests.support.broken_files import edit
from tests.support.broken_hdf5 import datasets_of, put, reseal, with_data
from tests.support.refusals import refused
from tests.support.small_case import case_with, full_fe
from tests.support.stored_files import results_in


def forge(path, change):
    """Change a file and make its checksums anew."""
    edit(path, change)
    edit(path, reseal)


def refused_by_online(path, words):
    refused("online", path, "-o", path.parent / "out", words=[words])
    assert not (path.parent / "out").exists()


@pytest.mark.parametrize("name", ["../../..", pytest.param("/tmp/elsewhere", marks=pytest.mark.slow)])
def test_the_name_in_a_basis_is_no_path(name, basis, tmp_path, undrawn, monkeypatch, capsys):
    inner = tmp_path / "one" / "two"
    inner.mkdir(parents=True)
    monkeypatch.chdir(inner)
    forge(basis, lambda file: set_attributes(file, case_name=name))
    assert main(["online", str(basis)]) == 0
    capsys.readouterr()
    assert results_in(tmp_path) == {"one", "basis.h5"}
    assert results_in(inner) == {"out"}
    (folder,) = (inner / "out").iterdir()
    assert "summary.json" in results_in(folder)


def soft(file):
    file.move("flank/pinion/nodes", "flank/pinion/aside")
    file["flank/pinion/nodes"] = h5py.SoftLink("/flank/pinion/aside")


def elsewhere(file):
    del file["flank/pinion/nodes"]
    file["flank/pinion/nodes"] = h5py.ExternalLink("other.h5", "/flank/pinion/nodes")


def twice(file):
    file["training/again"] = file["training/phi"]


def loop(file):
    file["training/loop"] = file["/"]


@pytest.mark.parametrize("change", [soft, elsewhere, twice, loop])
def test_links_are_refused(change, basis):
    forge(basis, change)
    refused_by_online(basis, "is of no use")
    with pytest.raises(FileFormatError, match="link to somewhere else|second name"):
        file_text(basis)


def other(name, change):
    return lambda file: with_data(file, name, change)


def times(name, factor):
    return other(name, lambda data: data * factor)


def disordered(data):
    return data[[0, *range(len(data) - 2, 0, -1), -1]]


LIES = {
    "no lines": (other("shapes/pinion/start", lambda data: data[:0]), "shapes/pinion/start has the shape (0,)"),
    "lines beyond the shapes": (other("shapes/pinion/start", lambda data: data + 1), "do not share its shapes"),
    "roll angles out of order": (other("flank/wheel/roll_angle", disordered), "do not go from the start of its"),
    "other roll angles": (times("flank/wheel/roll_angle", 1.01), "do not go from the start of its involute to its tip"),
    "zero displacements": (other("shapes/wheel/displacement", np.zeros_like), "energy products of the wheel"),
    "displacements that overflow": (
        other("shapes/wheel/displacement", lambda data: np.full_like(data, -1e308)),
        "shapes/wheel/displacement holds values beyond -1e+30 to 1e+30 mm",
    ),
    "larger displacements": (times("shapes/pinion/displacement", 1.001), "energy products of the pinion"),
    "larger forces": (times("shapes/pinion/force", 2.0), "energy products of the pinion"),
    "nodes off the flank": (other("flank/pinion/nodes", lambda data: data + 1e-3), "not on its involutes"),
    "nodes in another order": (other("flank/pinion/nodes", lambda data: data[::-1]), "not on its involutes"),
    "another compliance": (times("error_estimate/pinion", 2.0), "not what its compliance makes of them"),
    "single precision": (other("flank/pinion/nodes", lambda data: data.astype("f4")), "float32, not float64"),
    "complex numbers": (other("shapes/pinion/gram", lambda data: data.astype(complex)), "not stored number by number"),
    "whole numbers": (other("training/phi", lambda data: data.astype(int)), "int64, not float64"),
    "one axis less": (other("shapes/pinion/gram", lambda data: data[0]), "it should be tooth offset, shape, shape"),
    "angles of another pitch": (times("training/phi", 50.0), "not within one pitch"),
    "torques of another case": (times("training/conditions", 3.0), "has other conditions than its case"),
    "numbers of states without convergence": (other("training/converged", np.zeros_like), "where it did not converge"),
}


@pytest.mark.parametrize(("change", "words"), LIES.values(), ids=LIES.keys())
def test_what_cannot_be_true_of_lines_is_refused(change, words, basis):
    forge(basis, change)
    refused_by_online(basis, words)


@pytest.fixture(scope="module")
def of_line_loads(tmp_path_factory):
    """A basis that stands on the compliance of its flanks alone, with root stress and a coarser mesh beside it."""
    path = tmp_path_factory.mktemp("line") / "basis.h5"
    mesh = {"profile_elements": 8, "width_elements": 1, "error_bar": True}
    case = case_with(contact={"scheme": "line"}, reduction={"shapes": "line_loads"}, mesh=mesh)
    run_offline(case, full_fe(case), path)
    return path


def one_number(data):
    data[-1, 3, 2] *= 1.0 + 1e-6
    return data


def without(*names):
    def change(file):
        for name in names:
            del file[name]

    return change


# Of each the numbers look like those of a sound file, and no law ties them to the case.
OTHER_ANSWERS = {
    "stress turned round": other("root_stress/pinion/stress", lambda data: data[:, :, ::-1]),
    "stress of other neighbours": other("root_stress/pinion/stress", lambda data: data[::-1]),
    "stress of other patterns": other("root_stress/pinion/stress", lambda data: data[..., ::-1]),
    "stress that is larger": times("root_stress/pinion/stress", 1.01),
    "patterns in another order": other("root_stress/pinion/pattern", lambda data: data[::-1]),
    "patterns on other nodes": other("root_stress/pinion/pattern", lambda data: data[:, ::-1]),
    "a compliance that is larger": times("line_loads/pinion", 1.01),
    "a compliance in another order": other("line_loads/pinion", lambda data: data[:, ::-1, ::-1]),
    "one number of a compliance": other("line_loads/pinion", one_number),
    "a compliance of the coarser mesh": times("coarser/line_loads/pinion", 1.01),
    "an answer": times("answers/wheel/stress", 1.01),
    "no root stress": without("root_stress/pinion"),
}


# Of each array and of each kind of change one runs always.
FURTHER = (
    "stress of other patterns", "stress that is larger", "patterns in another order", "a compliance that is larger",
    "a compliance in another order",
)  # fmt: skip


@pytest.mark.parametrize(
    "change",
    [pytest.param(change, id=name, marks=[pytest.mark.slow] * (name in FURTHER))
     for name, change in OTHER_ANSWERS.items()],
)
def test_a_basis_that_does_not_answer_as_it_did_is_refused(change, of_line_loads, tmp_path):
    path = tmp_path / "basis.h5"
    path.write_bytes(of_line_loads.read_bytes())
    forge(path, change)
    with pytest.raises(FileFormatError, match="does not answer as it did when it was written"):
        read_basis(path)


@pytest.mark.parametrize("value", [np.nan, pytest.param(np.inf, marks=pytest.mark.slow)])
def test_values_that_are_not_finite_are_refused_even_with_valid_checksums(value, basis):
    with h5py.File(basis) as file:
        # Where full FE did not converge; what online does not read.
        allowed = ("training/ste", "training/force")
        names = [name for name in datasets_of(file) if file[name].dtype == float and name not in allowed]
    whole = basis.read_bytes()
    for name in names:

        def change(data):
            data[(0,) * data.ndim] = value
            return data

        basis.write_bytes(whole)
        forge(basis, other(name, change))
        with pytest.raises(FileFormatError, match=f"is of no use: /{name} holds values that are not finite"):
            read_basis(basis)


POSITION_LIES = {
    "larger displacements": times("shapes/displacement", 1.001),
    "zero displacements": other("shapes/displacement", np.zeros_like),
    "other products": times("shapes/gram", 1.001),
    "never loaded": other("shapes/loaded", np.zeros_like),
    "positions elsewhere": other("shapes/roll_position", lambda data: data + 0.01),
    "positions apart": times("shapes/roll_position", 1.5),
    "another order": other("shapes/displacement", lambda data: data[::-1]),
}


@pytest.mark.parametrize(
    ("shapes", "interpolation"), [("positions", "cubic"), pytest.param("pod", "linear", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("change", POSITION_LIES.values(), ids=POSITION_LIES.keys())
def test_what_cannot_be_true_of_positions_is_refused(change, shapes, interpolation, small_basis_file, tmp_path):
    path = tmp_path / "basis.h5"
    path.write_bytes(small_basis_file(shapes=shapes, interpolation=interpolation).read_bytes())
    read_basis(path)
    forge(path, change)
    with pytest.raises(FileFormatError, match="is of no use"):
        read_basis(path)


def packed(file):
    put(file, "training/phi", shape=(4 * 10**8,), dtype="f8", chunks=(10**6,), fillvalue=1.0, compression="gzip")


def never_written(file):
    put(file, "training/phi", shape=(4 * 10**8,), dtype="f8")


@pytest.mark.parametrize("change", [packed, never_written])
def test_gigabytes_of_nothing_are_not_unpacked(change, basis):
    forge(basis, change)
    assert basis.stat().st_size < 500_000
    for command in ("info", "online"):
        tracemalloc.start()
        refused(command, basis, words=["training/phi is not stored number by number"])
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 50 * basis.stat().st_size


def test_nothing_in_a_file_commands_the_terminal(basis, capsys):
    def change(file):
        set_attributes(file, created="\x1b[31mred\x1b[0m", case_name="a\x07b")
        set_attributes(file["training/phi"], description="\x1b]0;title\x07", unit="\r")

    forge(basis, change)
    assert main(["info", str(basis)]) == 0
    text = capsys.readouterr().out
    assert all(c.isprintable() or c == "\n" for c in text)
    assert r"\x1b[31mred" in text


# --- results of others -----------------------------------------------------------------------------------------------


@pytest.fixture
def results(tmp_path):
    """A results file with two torques and three angles."""
    grid = np.arange(6.0).reshape(2, 3)
    arrays = {
        "ste/phi": np.array([0.0, 0.1, 0.2]), "ste/torque": np.array([50.0, 100.0]), "ste/ste": grid,
        "ste/rotation": grid, "ste/converged": np.ones((2, 3), dtype=bool), "ste/pair_index": np.array([0]),
        "ste/pair_share": grid[..., None], "stiffness/secant": grid,
    }  # fmt: skip
    write_results_file(tmp_path / "results.h5", ResultsFile("small", "", arrays))
    return tmp_path / "results.h5"


def described(**words):
    return lambda file: set_attributes(file["ste/ste"], **words)


@pytest.mark.parametrize(
    "change",
    [
        described(dims="a/../../x, angle"), described(dims="../../x, /tmp/y"), described(unit="um\n# forged [um]: 1"),
        described(description="two\nlines\x1b[2J"), lambda file: set_attributes(file, case_name="\x1b[31mred\n"),
    ],
    ids=["dims that are a path", "dims out of the folder", "unit of two lines", "description of two lines", "name"],
)  # fmt: skip
def test_words_in_results_choose_no_path_and_break_no_table(change, results, tmp_path, monkeypatch, capsys):
    inner = tmp_path / "one" / "two"
    inner.mkdir(parents=True)
    monkeypatch.chdir(inner)
    assert main(["export", str(results), "--to", "csv", "-o", "plain"]) == 0
    forge(results, change)
    assert main(["export", str(results), "--to", "csv", "-o", "forged"]) == 0
    assert (results_in(tmp_path), results_in(inner)) == ({"one", "results.h5"}, {"plain", "forged"})
    plain, forged = ({p.name: p.read_bytes() for p in (inner / name).glob("*.csv")} for name in ("plain", "forged"))
    assert forged == plain != {}
    main(["info", str(results)])
    assert "\x1b" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("ste/ste", lambda data: data[:, :2]), ("ste/phi", lambda data: data[:2]),
        ("ste/torque", lambda data: data[:1]), ("ste/pair_share", lambda data: data[0]),
        ("stiffness/secant", lambda data: data[:, :1]),
    ],
)  # fmt: skip
def test_results_of_lengths_that_contradict_each_other_are_refused(name, change, results, tmp_path):
    forge(results, lambda file: with_data(file, name, change))
    refused("export", results, "--to", "csv", "-o", tmp_path / "tables", words=["pmor run"])
    assert not (tmp_path / "tables").exists()
