import errno
import os
import stat

import pytest

from pmor.core.errors import OutputError
from pmor.storage.atomic import atomic_path, ensure_folder


def test_target_appears_whole_at_the_end(tmp_path):
    target = tmp_path / "result.csv"
    with atomic_path(target) as path:
        assert path.parent == tmp_path
        path.write_text("done")
        assert not target.exists()
    assert target.read_text() == "done"
    assert list(tmp_path.iterdir()) == [target]


def test_permissions_follow_the_umask(tmp_path):
    plain, target = tmp_path / "plain", tmp_path / "atomic"
    plain.touch()
    with atomic_path(target):
        pass
    assert stat.S_IMODE(target.stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_failure_leaves_the_old_file_and_nothing_else(error, tmp_path):
    target = tmp_path / "result.csv"
    target.write_text("old")
    with pytest.raises(error), atomic_path(target) as path:
        path.write_text("half")
        raise error
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_two_writers_do_not_meet(tmp_path):
    target = tmp_path / "result.csv"
    with atomic_path(target) as first, atomic_path(target) as second:
        assert first != second
        first.write_text("first")
        second.write_text("second")
    assert target.read_text() == "first"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize(
    ("folder", "words"), [("no", "folder does not exist: create it"), ("file", "is a file, not a folder")]
)
def test_a_missing_folder_and_a_file_in_its_place_show_before_the_work(folder, words, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match=words), atomic_path(tmp_path / folder / "x"):
        pytest.fail("the block must not run")


def test_folder_in_place_of_the_file(tmp_path):
    target = tmp_path / "result.csv"
    target.mkdir()
    with pytest.raises(OutputError, match=r"cannot write .*result\.csv"), atomic_path(target) as path:
        path.write_text("x")
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize(
    ("number", "words"),
    [(errno.EACCES, "read-only for you"), (errno.EROFS, "disk is read-only"), (errno.ENOSPC, "no space is left")],
)
def test_refusals_of_the_system_come_in_plain_words(number, words, tmp_path, monkeypatch):
    def refuse(*_args, **_kwargs):  # permissions do not stop a test that runs as root
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(OutputError, match=words), atomic_path(tmp_path / "x"):
        pytest.fail("the block must not run")


def test_disk_full_inside_the_block(tmp_path):
    with pytest.raises(OutputError, match="no space is left"), atomic_path(tmp_path / "x"):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert list(tmp_path.iterdir()) == []


def test_error_about_another_file_keeps_its_words(tmp_path):
    with pytest.raises(OutputError, match=r"missing\.h5"), atomic_path(tmp_path / "x"):
        (tmp_path / "missing.h5").read_bytes()


def test_failing_clean_up_does_not_hide_the_error(tmp_path):
    with pytest.raises(RuntimeError, match="the real one"), atomic_path(tmp_path / "x") as path:
        path.unlink()
        path.mkdir()
        raise RuntimeError("the real one")


def test_ensure_folder_creates_parents_and_accepts_what_is_there(tmp_path):
    folder = tmp_path / "a" / "b"
    assert ensure_folder(folder) == folder
    assert ensure_folder(folder).is_dir()


def test_ensure_folder_refuses_a_file(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="choose another name"):
        ensure_folder(tmp_path / "file")
    with pytest.raises(OutputError, match="is a file, not a folder"):
        ensure_folder(tmp_path / "file" / "below")
