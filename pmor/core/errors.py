"""The errors that an engineer can act on.

The library raises them; only the command line turns them into an exit code. Anything else that escapes is a defect of
the program and keeps its traceback.
"""

from collections.abc import Iterable
from typing import Any


def printable(text: str) -> str:
    """Escape control characters: files can quote anything."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class PmorError(Exception):
    """Base of all errors with a message for the engineer: place, value, remedy, on one line."""

    exit_code = 2


class CaseError(PmorError):
    """The case file cannot be read or asks for something impossible."""


class InsufficientMemoryError(CaseError):
    """The case takes more memory than there is: the same case may run elsewhere."""


class GeometryError(PmorError):
    """The gear cannot be made, or the pair cannot mesh."""


class MeshError(PmorError):
    """The mesh has elements that are unusable."""


class FileFormatError(PmorError):
    """An HDF5 file is foreign, damaged, or of another version."""


class OutputError(PmorError):
    """A result cannot be written."""


class Stopped(KeyboardInterrupt):
    """Work that was interrupted after a part of it was done.

    Parameters
    ----------
    result : object
        Of that part; it can `write` itself into a folder.
    """

    def __init__(self, result: Any) -> None:
        super().__init__()
        self.result = result


class ExternalProgramError(PmorError):
    """An independent program that results are compared with is not installed, or failed."""


class ConvergenceError(PmorError):
    """The equilibrium was not found; such a state is never reported as a number.

    Parameters
    ----------
    message : str
        The quantity that did not converge, and the place.
    history : iterable of tuple of float
        Residuals of each iteration, oldest first.
    """

    exit_code = 3

    def __init__(self, message: str, history: Iterable[tuple[float, ...]] = ()) -> None:
        # Both arguments go to Exception, so that the error survives the pickling between worker processes.
        self.history = list(history)
        super().__init__(message, self.history)

    def __str__(self) -> str:
        return str(self.args[0])
