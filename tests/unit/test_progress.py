"""Progress: told on a terminal, fitted to its width, silent elsewhere."""

import fcntl
import os
import struct
import sys
import termios
import threading

import pytest

from pmor.progress import Progress, format_time


class Terminal:
    """A pseudo-terminal in the place of stderr."""

    def __init__(self, columns):
        self._screen, line = os.openpty()
        fcntl.ioctl(line, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        self.stream = os.fdopen(line, "w", encoding="utf-8")

    def text(self):
        self.stream.flush()
        return os.read(self._screen, 100_000).decode()

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
        progress.advance(3)
    assert capsys.readouterr() == ("", "")


def test_a_terminal_sees_label_count_rate_and_time_left(terminal):
    screen = terminal()
    with Progress(40, "positions") as progress:
        for _ in range(40):
            progress.advance()
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
        progress.advance()
    shown = lines(screen.text())
    assert max(map(len, shown)) <= columns
    assert shown[0].startswith("full FE, unseen")


def test_steps_of_an_earlier_run_are_done_but_not_fast(terminal):
    screen = terminal()
    with Progress(100, "full FE", done=90):
        pass
    assert "90/100 [00:00<?, ?it/s]" in lines(screen.text())[0]


def test_the_line_is_ended_once_also_after_an_error(terminal):
    screen = terminal()
    with pytest.raises(RuntimeError), Progress(2, "steps") as progress:
        raise RuntimeError
    progress.close()
    assert screen.text().count("\n") == 1


def test_more_steps_than_announced_and_none_at_all(terminal):
    screen = terminal()
    with Progress(0, "steps") as progress:
        progress.advance()
    assert lines(screen.text())[-1].startswith("steps: ")


def test_no_thread_runs_beside_the_work(terminal):
    terminal()
    before = threading.active_count()
    with Progress(2, "steps"):
        assert threading.active_count() == before


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0, "0.0 s"), (59.94, "59.9 s"), (59.96, "1 min 00 s"), (185, "3 min 05 s"), (7800, "2 h 10 min")],
)
def test_durations_read_naturally(seconds, text):
    assert format_time(seconds) == text
