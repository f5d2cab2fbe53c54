import os
from contextlib import contextmanager
from dataclasses import replace

import h5py
import numpy as np
import pytest

from pmor.case import basis_key, parse_case
from pmor.errors import FileFormatError, OutputError, PmorError
from pmor.reduction.basis import Basis, Training
from pmor.reduction.contact_shapes import ContactShapes
from pmor.reduction.error_estimate import FlankCompliance
from pmor.reduction.flank_lines import FlankLineShapes, GearLines
from pmor.storage.basis_file import read_basis, write_basis
from pmor.storage.describe import file_text
from pmor.storage.hdf5 import Field, Schema, attribute, create, write
from tests.small_case import case_text
from tests.stored_files import (
    flip_a_byte,
    is_a_folder,
    is_empty,
    is_half,
    is_missing,
    is_text,
    is_truncated,
    lacks,
    set_attribute,
    some_conditions,
)

POSITIONS, TORQUES, UNKNOWNS = 7, 2, 6
DATASETS = {"flank_lines": 19, "static_modes": 19, "positions": 15, "pod": 15}


@pytest.fixture(params=list(DATASETS))
def family(request):
    return request.param


def text_of(family, **changes):
    return case_text(reduction={"shapes": family}, **changes)


@pytest.fixture
def case(family):
    return parse_case(text_of(family), "small", "small case")


def line_shapes(rng, *counts):
    """Shapes of a gear that has so many on each of its lines."""
    size = sum(counts)
    return GearLines(
        start=np.cumsum([0, *counts]),
        force=rng.normal(size=(size, UNKNOWNS)),
        displacement=rng.normal(size=(3, size, UNKNOWNS)),
        gram=rng.normal(size=(3, size, size)),
    )


def position_shapes(rng, geodesic):
    return ContactShapes(
        roll_position=np.linspace(-0.2, 0.3, POSITIONS),
        angles_per_pitch=4,
        loaded=rng.random((POSITIONS, TORQUES)) < 0.5,
        displacement=rng.normal(size=(POSITIONS, TORQUES, 2, 3, UNKNOWNS)),
        gram=rng.normal(size=(2, POSITIONS, 2, 2, TORQUES, TORQUES)),
        geodesic=geodesic,
    )


@pytest.fixture
def basis(case, rng):
    family = case.reduction.shapes
    if family in ("positions", "pod"):
        shapes = position_shapes(rng, geodesic=family == "pod")
    else:
        shapes = FlankLineShapes((line_shapes(rng, 1, 2, 1), line_shapes(rng, 1, 1, 3)), family == "static_modes")
    ste_um = rng.normal(size=(TORQUES, 4))
    ste_um[1, 2] = np.nan
    training = Training(
        phi=rng.normal(size=4), conditions=tuple(some_conditions(rng, TORQUES) for _ in range(4)), ste_um=ste_um,
        converged=np.isfinite(ste_um), estimate_percent=None, seconds=1.5,
    )  # fmt: skip
    nodes = rng.normal(size=(2, 3, 2, 3))
    roll = np.sort(rng.random((2, 3)))
    compliance = FlankCompliance((rng.normal(size=(2, 12, 12)), rng.normal(size=(2, 12, 12))), 2)
    return Basis(case, (nodes[0], nodes[1]), (roll[0], roll[1]), (), shapes, training, compliance)


@pytest.fixture
def force(rng):
    return rng.normal(size=(POSITIONS, TORQUES, 2, UNKNOWNS))


@pytest.fixture
def path(tmp_path, basis, force):
    target = tmp_path / "basis.h5"
    write_basis(target, basis, force)
    return target


def assert_same(found, expected):
    assert found.dtype == expected.dtype
    np.testing.assert_array_equal(found, expected)


# --- round trips -----------------------------------------------------------------------------------------------------


def test_identical_gears_share_the_compliance_of_one(tmp_path, basis, force):
    one = basis.compliance.gears[0]
    write_basis(tmp_path / "basis.h5", replace(basis, compliance=FlankCompliance((one, one), 2)), force)
    pinion, wheel = read_basis(tmp_path / "basis.h5").compliance.gears
    assert wheel is pinion
    assert_same(pinion, one)


def test_the_decay_of_a_greedy_sampling_comes_back(tmp_path, basis, force):
    text = text_of("flank_lines", offline={"sampling": "greedy"})
    decay = np.array([np.nan, np.nan, 3.0, 0.1])
    case = parse_case(text, "small", "small case")
    shapes = FlankLineShapes(2 * (line_shapes(np.random.default_rng(1), 1, 2, 1),))
    training = replace(basis.training, estimate_percent=decay)
    write_basis(tmp_path / "basis.h5", replace(basis, case=case, shapes=shapes, training=training), force)
    np.testing.assert_array_equal(read_basis(tmp_path / "basis.h5").training.estimate_percent, decay)


def test_a_case_with_replaced_fields_writes_a_basis_that_reads_back(tmp_path, basis, force):
    changed = replace(basis.case, mesh=replace(basis.case.mesh, spacing="roll_angle"), title="changed")
    write_basis(tmp_path / "basis.h5", replace(basis, case=changed), force)
    read = read_basis(tmp_path / "basis.h5").case
    assert replace(read, text=changed.text) == changed


def test_a_basis_without_error_estimate_has_no_compliance(tmp_path, basis, force):
    case = parse_case(basis.case.text + "\nerror_estimate = false\n", "small", "small case")
    write_basis(tmp_path / "basis.h5", replace(basis, case=case, compliance=None), force)
    assert read_basis(tmp_path / "basis.h5").compliance is None


def test_basis_comes_back_bit_for_bit(path, basis, force):
    found = read_basis(path)
    assert found.case == basis.case
    for gear in range(2):
        assert_same(found.flank_nodes[gear], basis.flank_nodes[gear])
        assert_same(found.flank_roll_angle[gear], basis.flank_roll_angle[gear])
    assert type(found.shapes) is type(basis.shapes)
    if isinstance(basis.shapes, ContactShapes):
        for name in ("roll_position", "loaded", "displacement", "gram"):
            assert_same(getattr(found.shapes, name), getattr(basis.shapes, name))
        assert found.shapes.angles_per_pitch == basis.shapes.angles_per_pitch
        assert found.shapes.geodesic is basis.shapes.geodesic
    else:
        for lines, expected in zip(found.shapes.gears, basis.shapes.gears, strict=True):
            for name in ("start", "force", "displacement", "gram"):
                assert_same(getattr(lines, name), getattr(expected, name))
        assert found.shapes.beside is basis.shapes.beside
    assert found.shapes.reach == 1
    assert found.compliance.components == 2
    for gear in range(2):
        assert_same(found.compliance.gears[gear], basis.compliance.gears[gear])
    assert found.training.conditions == basis.training.conditions
    for name in ("phi", "ste_um", "converged"):
        assert_same(getattr(found.training, name), getattr(basis.training, name))
    assert found.training.seconds == basis.training.seconds
    with h5py.File(path) as file:
        assert_same(file["training/force"][()], force)
        assert attribute(file, "basis_key") == basis_key(basis.case)


def test_every_dataset_says_unit_axes_and_meaning(path, family):
    with h5py.File(path) as file:
        found = []

        def visit(_name, item):
            if isinstance(item, h5py.Dataset):
                assert all(item.attrs[key] for key in ("unit", "dims", "description", "sha256"))
                # One name for each axis.
                assert len(attribute(item, "dims").split(", ")) == item.ndim, item.name
                found.append(item.name)

        file.visititems(visit)
        assert len(found) == DATASETS[family]
        provenance = {"schema", "schema_version", "created", "pmor_version", "numpy_version", "h5py_version"}
        assert provenance | {"case_text", "case_sha256", "basis_key"} <= set(file.attrs)


def test_no_text_lies_where_the_format_has_no_checksum(path):
    """Text of variable length does; one flipped bit in it can make the HDF5 library loop forever."""
    with h5py.File(path) as file:
        found = []

        def visit(_name, item):
            for key in item.attrs:
                text = h5py.check_string_dtype(item.attrs.get_id(key).dtype)
                if text is not None:
                    found.append(text.length)

        visit("/", file)
        file.visititems(visit)
    assert len(found) > 50
    assert None not in found


def test_a_case_file_with_long_comments_fits(tmp_path, basis, force, family):
    text = text_of(family) + "# a comment\n" * 10_000  # beyond the 64 KiB that HDF5 gives to a plain attribute
    write_basis(tmp_path / "long.h5", replace(basis, case=parse_case(text, "small", "small case")), force)
    assert read_basis(tmp_path / "long.h5").case.text == text


# --- what is refused -------------------------------------------------------------------------------------------------


def gram_of(path):
    """Name of a dataset that either family has."""
    with h5py.File(path) as file:
        return "shapes/gram" if "shapes/gram" in file else "shapes/wheel/gram"


def lacks_checksum(path):
    name = gram_of(path)
    with h5py.File(path, "r+") as file:
        del file[name].attrs["sha256"]


def lacks_gram(path):
    lacks(gram_of(path))(path)


def is_flipped(path):
    flip_a_byte(path, gram_of(path))


DAMAGES = [
    is_missing,
    is_truncated,
    is_half,
    is_empty,
    is_text,
    is_a_folder,
    set_attribute("schema", "somebody-elses"),
    lacks("schema"),
    set_attribute("schema_version", np.int64(99)),
    set_attribute("schema_version", np.int64(1)),
    set_attribute("schema_version", "1.x"),
    lacks("schema_version"),
    lacks("basis_key"),
    set_attribute("basis_key", 64 * "0"),
    lacks("case_text"),
    lacks_gram,
    lacks("training"),
    lacks("flank/wheel/nodes"),
    lacks_checksum,
    is_flipped,
]
NAMES = [
    "missing", "truncated", "half", "empty", "text", "folder", "foreign", "no schema", "newer", "older", "odd version",
    "no version", "no key", "other key", "no case", "no dataset", "no group", "no wheel", "no checksum", "flipped bit",
]  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES, ids=NAMES)
def test_a_basis_that_cannot_be_trusted_is_refused(damage, path):
    damage(path)
    with pytest.raises(FileFormatError) as caught:
        read_basis(path)
    message = str(caught.value)
    assert str(path) in message
    assert "'pmor offline'" in message, "says what to do"
    assert len(message.splitlines()) == 1
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(("version", "word"), [(99, "newer"), (1, "older")])
def test_another_version_is_named(version, word, path):
    set_attribute("schema_version", np.int64(version))(path)
    with pytest.raises(FileFormatError, match=f"version {version}, written by an? {word} pmor; this one reads version"):
        read_basis(path)


def test_a_case_text_that_this_version_refuses_names_the_basis_file(path):
    set_attribute("case_text", case_text(load={"torque_Nm": -1.0}))(path)
    with pytest.raises(PmorError) as caught:
        read_basis(path)
    assert str(path) in str(caught.value)


# --- writing ---------------------------------------------------------------------------------------------------------


def test_an_existing_file_stays_unless_told_otherwise(path, basis, force):
    before = path.read_bytes()
    with pytest.raises(OutputError, match=r"basis\.h5: exists already; .*--overwrite"):
        write_basis(path, basis, force)
    assert path.read_bytes() == before
    other = replace(basis, training=replace(basis.training, seconds=7.0))
    write_basis(path, other, force, overwrite=True)
    assert read_basis(path).training.seconds == 7.0


def test_a_failed_write_leaves_nothing_beside_the_target(tmp_path, basis, force):
    class Full(Exception):
        pass

    class Failing:
        def __array__(self, *_args, **_kwargs):
            raise Full

    with pytest.raises(Full):
        write_basis(tmp_path / "basis.h5", replace(basis, training=replace(basis.training, phi=Failing())), force)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_replacement_keeps_the_old_file(path, tmp_path):
    before = path.read_bytes()
    with pytest.raises(RuntimeError), create(path, Schema("s", 1, "r"), {}, overwrite=True) as file:
        write(file, "x", np.zeros(3), Field("1", "i", "zeros"))
        raise RuntimeError
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_missing_folder_and_full_disk_are_output_errors(tmp_path, basis, force, monkeypatch):
    with pytest.raises(OutputError, match="folder does not exist"):
        write_basis(tmp_path / "no" / "basis.h5", basis, force)

    @contextmanager
    def full(*_args, **_kwargs):
        raise OSError(28, os.strerror(28))
        yield

    monkeypatch.setattr(h5py, "File", full)
    with pytest.raises(OutputError, match="no space is left"):
        write_basis(tmp_path / "basis.h5", basis, force)
    assert list(tmp_path.iterdir()) == []


# --- what is in a file -----------------------------------------------------------------------------------------------


SHAPES_LINE = {
    **dict.fromkeys(
        ("flank_lines", "static_modes"), "shapes/wheel/displacement 3 x 5 x 6 mm displacement of each shape"
    ),
    **dict.fromkeys(("positions", "pod"), "shapes/loaded 7 x 2 1 whether the pair carries load"),
}


def test_file_text_lists_attributes_and_datasets(path, case, family):
    lines = [" ".join(line.split()) for line in file_text(path).splitlines()]
    assert lines[0] == f"{path}: pmor-basis"
    assert "case_name small" in lines
    assert f"basis_key {basis_key(case)}" in lines
    assert any(line.startswith(SHAPES_LINE[family]) for line in lines)
    assert any(line.startswith("training/conditions 4 x 2 x 4 N mm, um, um, um columns: torque,") for line in lines)
    assert not any("[load]" in line for line in lines), "the case text would swamp the rest"


@pytest.mark.parametrize("damage", [is_missing, is_truncated, is_text, lacks("schema"), is_flipped])
def test_file_text_refuses_what_cannot_be_trusted(damage, path):
    damage(path)
    with pytest.raises(FileFormatError, match=r"basis\.h5"):
        file_text(path)
