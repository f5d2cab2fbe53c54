"""The store of compliances: keys by content, entries whole, the limit kept, the least recently used out."""

import os

import numpy as np
import pytest

import pmor.storage.gear_store as store_module
from pmor.body.flank_compliance import SolvedGear
from pmor.body.support import Support
from pmor.campaigns.describe import folder_text
from pmor.core.errors import OutputError
from pmor.storage.content_key import key_of
from pmor.storage.describe import file_text
from pmor.storage.gear_store import GIB, PARTS, entries, open_store, remove_unfinished

ONE = SolvedGear(np.arange(18.0).reshape(2, 3, 3), None)
# Of an entry of that size, about.
ENTRY_BYTES = 3600


def unsolvable():
    raise AssertionError("is there already")


def key(part, number):
    return part + f"{number:063x}"


def test_a_gear_is_solved_once_and_read_back_to_the_last_bit(tmp_path):
    store = open_store(tmp_path / "store", 1.0)
    first, again = store.get(key("a", 1), lambda: ONE), store.get(key("a", 1), unsolvable)
    assert first.compliance.tobytes() == again.compliance.tobytes()
    assert open_store(tmp_path / "store", 1.0).get(key("a", 1), unsolvable).root_stress is None


def test_an_entry_keeps_what_holes_add(tmp_path):
    holes = Support(np.arange(6.0).reshape(3, 2), np.arange(24.0).reshape(3, 2, 2, 2))
    store, solved = open_store(tmp_path / "store", 1.0), SolvedGear(ONE.compliance, None, holes)
    store.get(key("a", 2), lambda: solved)
    again = store.get(key("a", 2), unsolvable)
    np.testing.assert_array_equal(again.support.rows, holes.rows)
    np.testing.assert_array_equal(again.support.compliance, holes.compliance)


def test_what_killed_processes_left_half_written_goes_and_what_others_write_stays(tmp_path):
    store = open_store(tmp_path / "store", 1.0)
    store.get(key("a", 1), lambda: ONE)
    never, always = 99_999_999, 1  # processes: beyond the largest number, and the first of all
    left, at_work = (store.folder / "a" / f".x.h5.pmor-{number}-01234567.tmp" for number in (never, always))
    left.touch(), at_work.touch()
    remove_unfinished(store)
    assert not left.exists()
    assert at_work.exists()
    assert len(entries(store.folder)) == 1


def test_keys_tell_contents_apart():
    values = [np.zeros(3), np.zeros((3, 1)), np.zeros(3, dtype=np.float32), (0.0, 0.0), (0.0, (0.0,)), "0.0", 0.0, 0,
              np.array([0.0, 0.0, 5e-324])]  # fmt: skip
    assert len({key_of(value) for value in values}) == len(values)
    assert key_of(np.zeros(3), 1) == key_of(np.zeros(3), 1)


def test_what_was_not_used_for_longest_goes_first(tmp_path):
    store = open_store(tmp_path / "store", len(PARTS) * 3.5 * ENTRY_BYTES / GIB)
    for number in range(3):
        store.get(key("b", number), lambda: ONE)
    size = entries(store.folder)[0].stat().st_size
    assert 0.7 * ENTRY_BYTES < size < 1.16 * ENTRY_BYTES, "three of them and no more fit into a part"
    for number, path in enumerate(entries(store.folder)):
        os.utime(path, ns=(number * 10**9, number * 10**9))
    store.get(key("b", 0), unsolvable)  # used now
    store.get(key("b", 3), lambda: ONE)
    assert [path.stem[-1] for path in entries(store.folder)] == ["0", "2", "3"]


def test_a_damaged_entry_is_solved_anew(tmp_path):
    store = open_store(tmp_path / "store", 1.0)
    store.get(key("c", 1), lambda: ONE)
    path = entries(store.folder)[0]
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    assert store.get(key("c", 1), lambda: ONE) is ONE
    assert path.read_bytes() == whole, "equal contents are equal files"


def test_entries_that_were_exchanged_are_solved_anew(tmp_path):
    store, other = open_store(tmp_path / "store", 1.0), SolvedGear(2.0 * ONE.compliance, None)
    store.get(key("c", 1), lambda: ONE)
    store.get(key("c", 2), lambda: other)
    first, second = entries(store.folder)
    whole = first.read_bytes(), second.read_bytes()
    first.write_bytes(whole[1])
    second.write_bytes(whole[0])
    assert store.get(key("c", 1), lambda: ONE) is ONE
    assert store.get(key("c", 2), lambda: other) is other
    assert (first.read_bytes(), second.read_bytes()) == whole


def test_a_disk_that_is_full_stops_nobody(tmp_path, monkeypatch):
    store = open_store(tmp_path / "store", 1.0)

    def full(path, key, solved):
        raise OutputError("no space is left")

    monkeypatch.setattr(store_module, "write_compliance", full)
    assert store.get(key("d", 1), lambda: ONE) is ONE
    assert entries(store.folder) == []


def test_a_folder_of_other_things_is_no_store(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(OutputError, match="holds other things"):
        open_store(tmp_path, 1.0)


def test_info_tells_of_a_store_and_of_an_entry(tmp_path):
    store = open_store(tmp_path / "store", 1.0)
    store.get(key("e", 1), lambda: ONE)
    assert "compliances of 1 gears" in folder_text(store.folder)
    assert "pmor-compliance" in file_text(entries(store.folder)[0])
