"""Progress: told on a terminal, fitted to its width, silent elsewhere."""

import fcntl
import os
import select
import struct
import sys
import termios
import time

import pytest

from pmor.core.progress import Progress, format_time, stage


class Terminal:
    """A pseudo-terminal in the place of stderr."""

    def __init__(self, columns):
        self._screen, line = os.openpty()
        fcntl.ioctl(line, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        self.stream = os.fdopen(line, "w", encoding="utf-8")

    def text(self):
        self.stream.flush()
        found = b""
        while select.select([self._screen], [], [], 0.05)[0]:  # the system hands it over in pieces
            found += os.read(self._screen, 100_000)
        return found.decode()

    def close(self):
        self.stream.close()
        os.close(self._screen)


@pytest.fixture
def terminal(monkeypatch):
    """Makes stderr a terminal; called in the test, because pytest puts its own stderr there after the fixtures."""
    made = []

    def make(columns=80):
        made.append(Terminal(columns))
        monkeypatch.setattr(sys, "stderr", made[-1].stream)
        return made[-1]

    yield make
    for each in made:
        each.close()


def lines(text):
    """What the line showed, one after the other."""
    return [shown.rstrip() for shown in text.split("\r") if shown.strip()]


def test_silent_without_a_terminal(capsys):
    with Progress(3, "steps") as progress:
        progress.step(3)
    assert capsys.readouterr() == ("", "")


def test_a_terminal_sees_label_count_rate_and_time_left(terminal):
    screen = terminal()
    with Progress(40, "positions") as progress:
        for _ in range(40):
            progress.step()
    text = screen.text()
    last = lines(text)[-1]
    assert last.startswith("positions: 100%|")
    assert "40/40 [00:00<00:00, " in last
    assert last.endswith("it/s]")
    assert text.endswith("\n")


@pytest.mark.parametrize("columns", [20, 40, 200])
def test_no_line_is_wider_than_the_terminal(columns, terminal):
    screen = terminal(columns)
    with Progress(4, "full FE, unseen angles") as progress:
        progress.step()
    shown = lines(screen.text())
    assert max(map(len, shown)) <= columns
    assert shown[0].startswith("full FE, unseen")


def test_the_line_is_ended_once_also_after_an_error(terminal):
    screen = terminal()
    with pytest.raises(RuntimeError), Progress(2, "steps") as progress:
        raise RuntimeError
    progress.close()
    assert screen.text().count("\n") == 1


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0, "0.0 s"), (59.94, "59.9 s"), (59.96, "1 min 00 s"), (185, "3 min 05 s"), (7800, "2 h 10 min")],
)
def test_durations_read_naturally(seconds, text):
    assert format_time(seconds) == text


def test_a_stage_is_told_of_in_the_log_and_where_nobody_listens_once_it_takes_long(monkeypatch, caplog):
    monkeypatch.setattr("pmor.core.progress.LONG_S", 0.01)
    with caplog.at_level("INFO", "pmor"), stage("finite elements"):
        assert caplog.messages == ["finite elements ..."]
    caplog.clear()
    with caplog.at_level("WARNING", "pmor"):
        with stage("a long one"):
            for _ in range(1000):
                if caplog.messages:
                    break
                time.sleep(0.01)
        assert caplog.messages == ["a long one ..."]
        monkeypatch.setattr("pmor.core.progress.LONG_S", 0.2)
        with stage("a short one"):
            pass
        time.sleep(0.3)
    assert caplog.messages == ["a long one ..."]
