from dataclasses import replace

import h5py
import numpy as np
import pytest

from pmor.body.flank_compliance import FlankCompliance
from pmor.case import basis_key, change_case, parse_case
from pmor.core.errors import FileFormatError, OutputError, PmorError
from pmor.reduction.contact_shapes import ContactShapes
from pmor.storage.basis_file import read_basis, write_basis
from pmor.storage.describe import file_text
from pmor.storage.hdf5 import attribute
from tests.support.broken_files import flip_bit_of, is_a_folder, is_missing, lacks, set_attribute
from tests.support.small_case import case_text

FAMILIES = {
    "flank_lines": {},
    "static_modes": {"shapes": "static_modes"},
    "positions": {"shapes": "positions"},
    "pod": {"shapes": "pod", "interpolation": "cubic"},
}
DATASETS = {"flank_lines": 20, "static_modes": 20, "positions": 16, "pod": 16}


@pytest.fixture(
    params=["flank_lines", "positions", *(pytest.param(f, marks=pytest.mark.slow) for f in ("static_modes", "pod"))]
)
def family(request):
    return request.param


@pytest.fixture
def whole(family, small_basis_file):
    """A basis file of each family, not to be changed."""
    return small_basis_file(**FAMILIES[family])


@pytest.fixture
def basis(whole):
    return read_basis(whole)


@pytest.fixture
def force(whole):
    with h5py.File(whole) as file:
        return file["training/force"][()]


@pytest.fixture
def path(tmp_path, basis, force):
    target = tmp_path / "basis.h5"
    write_basis(target, basis, force)
    return target


def assert_same(found, expected):
    assert found.dtype == expected.dtype
    np.testing.assert_array_equal(found, expected)


# --- round trips -----------------------------------------------------------------------------------------------------


def test_identical_gears_share_the_compliance_of_one_and_others_have_their_own(tmp_path, basis, force):
    pinion, wheel = basis.compliance.gears
    assert wheel is pinion
    own = FlankCompliance((pinion, pinion.copy()), basis.compliance.components)
    write_basis(tmp_path / "basis.h5", replace(basis, compliance=own), force)
    pinion, wheel = read_basis(tmp_path / "basis.h5").compliance.gears
    assert wheel is not pinion
    assert_same(pinion, wheel)


def test_the_decay_of_a_greedy_sampling_comes_back(tmp_path, small_basis_path):
    basis = read_basis(small_basis_path)
    decay = np.linspace(3.0, 0.1, len(basis.training.phi))
    decay[:2] = np.nan
    training = replace(basis.training, estimate_percent=decay)
    greedy = replace(basis, case=change_case(basis.case, sampling="greedy"), training=training)
    write_basis(tmp_path / "basis.h5", greedy, np.zeros((1, 1, 2, basis.shapes.gears[0].force.shape[1])))
    np.testing.assert_array_equal(read_basis(tmp_path / "basis.h5").training.estimate_percent, decay)


def test_a_basis_without_error_estimate_has_no_compliance(tmp_path, basis, force):
    case = change_case(basis.case, error_estimate=False)
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
    else:
        for lines, expected in zip(found.shapes.gears, basis.shapes.gears, strict=True):
            for name in ("start", "force", "displacement", "gram"):
                assert_same(getattr(lines, name), getattr(expected, name))
    assert found.shapes.neighbours == basis.shapes.neighbours
    assert found.compliance.components == 3
    for gear in range(2):
        assert_same(found.compliance.gears[gear], basis.compliance.gears[gear])
    assert found.training.conditions == basis.training.conditions
    for name in ("phi", "ste_um", "converged"):
        assert_same(getattr(found.training, name), getattr(basis.training, name))
    assert found.training.seconds == basis.training.seconds
    with h5py.File(path) as file:
        assert_same(file["training/force"][()], force)
        assert attribute(file, "basis_key") == basis_key(basis.case)


def items_in(file):
    found = [file]
    file.visititems(lambda _name, item: found.append(item))
    return found


def test_every_dataset_says_unit_axes_and_meaning(path, family):
    with h5py.File(path) as file:
        datasets = [item for item in items_in(file) if isinstance(item, h5py.Dataset)]
        for item in datasets:
            assert all(item.attrs[key] for key in ("unit", "dims", "description", "sha256"))
            # One name for each axis.
            assert len(attribute(item, "dims").split(", ")) == item.ndim, item.name
        assert len(datasets) == DATASETS[family]
        provenance = {"schema", "schema_version", "created", "pmor_version", "numpy_version", "h5py_version"}
        assert provenance | {"case_text", "case_sha256", "basis_key"} <= set(file.attrs)


def test_no_text_lies_where_the_format_has_no_checksum(path):
    """Text of variable length does; one flipped bit in it can make the HDF5 library loop forever."""
    with h5py.File(path) as file:
        kinds = [item.attrs.get_id(key).dtype for item in items_in(file) for key in item.attrs]
    lengths = [text.length for text in map(h5py.check_string_dtype, kinds) if text is not None]
    assert len(lengths) > 50
    assert None not in lengths


def test_a_case_file_with_long_comments_fits(tmp_path, basis, force, family):
    text = basis.case.text + "# a comment\n" * 10_000  # beyond the 64 KiB that HDF5 gives to a plain attribute
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
    flip_bit_of(gram_of(path))(path)


# What the table of contents and the case have to do with it: robustness/test_corruption.
@pytest.mark.parametrize("damage", [is_missing, is_a_folder, lacks_gram, lacks("training"), lacks_checksum, is_flipped])
def test_a_basis_that_cannot_be_trusted_is_refused(damage, path):
    damage(path)
    with pytest.raises(FileFormatError) as caught:
        read_basis(path)
    message = str(caught.value)
    assert str(path) in message
    assert "pmor.train" in message, "says what to do"
    assert len(message.splitlines()) == 1
    assert caught.value.exit_code == 2


def test_a_case_text_that_this_version_refuses_names_the_basis_file(path):
    set_attribute("case_text", case_text(load={"torque_Nm": -1.0}))(path)
    with pytest.raises(PmorError) as caught:
        read_basis(path)
    assert str(path) in str(caught.value)


# --- writing ---------------------------------------------------------------------------------------------------------


def test_an_existing_file_stays_unless_told_otherwise(path, basis, force):
    before = path.read_bytes()
    with pytest.raises(OutputError, match=r"basis\.h5: exists already; .*pass overwrite=True"):
        write_basis(path, basis, force)
    assert path.read_bytes() == before
    other = replace(basis, training=replace(basis.training, seconds=7.0))
    write_basis(path, other, force, overwrite=True)
    assert read_basis(path).training.seconds == 7.0


# --- what is in a file -----------------------------------------------------------------------------------------------


def test_file_text_lists_attributes_and_datasets(path, basis):
    lines = [" ".join(line.split()) for line in file_text(path).splitlines()]
    assert lines[0] == f"{path}: pmor-basis"
    assert "case_name small" in lines
    assert f"basis_key {basis_key(basis.case)}" in lines
    shapes = basis.shapes
    positions = isinstance(shapes, ContactShapes)
    shape = shapes.displacement.shape if positions else shapes.gears[1].displacement.shape
    name = f"shapes/{'' if positions else 'wheel/'}displacement"
    expected = f"{name} {' x '.join(map(str, shape))} mm displacement of each shape"
    assert any(line.startswith(expected) for line in lines)
    angles = "0 x 0" if not len(basis.training.phi) else "6 x 2"
    assert any(line.startswith(f"training/conditions {angles} x 4 N mm, um, um, um columns: torque,") for line in lines)
    assert not any("[load]" in line for line in lines), "the case text would swamp the rest"
