"""How refusals end: a command in one line and exit code 2, a damaged basis in words with a remedy or unchanged."""

import contextlib
import io
import pickle
import signal

from pmor.app.cli import main
from pmor.core.errors import FileFormatError
from pmor.storage.basis_file import read_basis
from pmor.storage.describe import file_text

HANG = 20  # s


def command(*arguments):
    """Run a command: exit code, what it printed, its errors."""
    with contextlib.redirect_stdout(io.StringIO()) as text, contextlib.redirect_stderr(io.StringIO()) as errors:
        code = main(list(map(str, arguments)))
    return code, text.getvalue(), errors.getvalue()


def refused(*arguments, words=()):
    """Run a command that must be refused: its one line of error, which holds all words."""
    code, text, error = command(*arguments)
    assert (code, text) == (2, ""), error
    check_one_line(error)
    for word in words:
        assert word in error
    return error


def check_one_line(error):
    """One line, after those that say what is being done."""
    *stages, last = error.splitlines(keepends=True)
    assert all(stage.startswith("pmor: ") and stage.endswith(" ...\n") for stage in stages), error
    error = last
    assert error.startswith("pmor: error: "), error
    assert error.count("\n") == 1, error
    assert error[:-1].isprintable(), error
    assert len(error) < 1000, error


def check_message(error):
    """An error of the library would be one line and exit code 2 of the command."""
    assert (error.exit_code, len(str(error).splitlines())) == (2, 1), error


@contextlib.contextmanager
def time_limit(seconds=HANG):
    def too_long(*_arguments):
        raise TimeoutError(f"takes more than {seconds} s")

    signal.signal(signal.SIGALRM, too_long)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)


def contents(path):
    """All that a command reads of a basis, as bytes."""
    return pickle.dumps(read_basis(path)), file_text(path).partition(":")[2]


def end_of(path, original, words=None):
    """How reading ends: refused in one line with a remedy, and with `words`; without them it may be the original."""
    ends = []
    for read, expected in zip((read_basis, file_text), original, strict=True):
        try:
            with time_limit():
                found = read(path)
        except FileFormatError as error:
            message = str(error)
            assert message.startswith(f"{path}: ")
            assert "pmor.train" in message
            assert len(message) < 600
            assert words is None or words in message, message
            ends.append("refused")
        else:
            assert words is None, "not refused"
            found = pickle.dumps(found) if read is read_basis else found.partition(":")[2]
            assert found == expected, "other data"
            ends.append("reads as the original")
    return ends[0]
