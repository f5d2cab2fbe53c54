import io

import pytest

from pmor.progress import Progress, format_time


class Terminal(io.StringIO):
    def isatty(self):
        return True


class Clock:
    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def test_silent_without_a_terminal(capsys):
    with Progress(3, "steps") as progress:
        progress.advance(3)
    assert capsys.readouterr() == ("", "")
    assert progress.done == 3


def test_reports_count_rate_and_time_left():
    terminal, clock = Terminal(), Clock()
    progress = Progress(40, "positions", terminal, clock)
    clock.now = 5.0
    progress.advance(10)
    assert terminal.getvalue() == "\rpositions: 10/40, 2/s, 15.0 s left"


def test_updates_are_throttled_but_the_last_one_is_shown():
    terminal, clock = Terminal(), Clock()
    progress = Progress(1000, "positions", terminal, clock)
    for _ in range(1000):
        clock.now += 0.001
        progress.advance()
    assert 8 <= terminal.getvalue().count("\r") <= 13
    assert "1000/1000" in terminal.getvalue()


def test_shorter_line_wipes_the_longer_one():
    terminal, clock = Terminal(), Clock()
    progress = Progress(2, "positions", terminal, clock)
    clock.now = 1000.0
    progress.advance()
    progress.close()
    first, last = terminal.getvalue().split("\r")[1:]
    assert len(last.rstrip("\n")) == len(first)


def test_close_ends_the_line_once_also_after_an_error():
    terminal = Terminal()
    with pytest.raises(RuntimeError), Progress(2, "steps", terminal, Clock()) as progress:
        raise RuntimeError
    progress.close()
    progress.advance()
    assert terminal.getvalue() == "\rsteps: 0/2 in 0.0 s\n"


def test_more_steps_than_announced_and_none_at_all():
    terminal, clock = Terminal(), Clock()
    clock.now = 1.0
    progress = Progress(0, "steps", terminal, clock)
    clock.now = 2.0
    progress.advance()
    assert "1/0, 1/s, 0.0 s left" in terminal.getvalue()


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0, "0.0 s"), (59.94, "59.9 s"), (59.96, "1 min 00 s"), (185, "3 min 05 s"), (7800, "2 h 10 min")],
)
def test_durations_read_naturally(seconds, text):
    assert format_time(seconds) == text
