"""Conditions in files: by the names of their columns, whichever there are and in whatever order."""

import h5py
import numpy as np
import pytest

from pmor.gear.condition import Condition, Misalignment, at_torques
from pmor.storage.condition_table import read_conditions, write_conditions
from pmor.storage.hdf5 import Field, set_attributes, write


@pytest.fixture
def file():
    with h5py.File("memory.h5", "w", driver="core", backing_store=False) as found:
        yield found


def write_table(file, columns, table):
    write(file, "conditions", table, Field("1", "angle, condition, column", "a table"))
    set_attributes(file["conditions"], columns=" ".join(columns))


def test_conditions_come_back(file):
    conditions = at_torques([1.0, 2.5], Misalignment(1.0, -2.0, 3.0)), at_torques([4.0, 5.0])
    write_conditions(file, conditions)
    assert read_conditions(file) == conditions


def test_no_conditions_come_back_as_none(file):
    write_conditions(file, ())
    assert read_conditions(file) == ()


def test_columns_go_by_their_names_and_those_left_out_have_the_default(file):
    write_table(file, ["out_of_plane", "torque"], np.array([[[7.0, 100.0]]]))
    assert read_conditions(file) == ((Condition(torque=100.0, misalignment=Misalignment(out_of_plane_um=7.0)),),)


@pytest.mark.parametrize("columns", [["torque", "humidity"], ["in_plane", "out_of_plane"], ["torque"]])
def test_columns_that_nobody_knows_or_that_are_missing_are_refused(columns, file):
    write_table(file, columns, np.zeros((1, 1, 2)))
    with pytest.raises(ValueError, match="known are torque, in_plane"):
        read_conditions(file)
