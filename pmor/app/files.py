"""Content of files, and whether a basis obeys its laws."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pmor.app.full import FullModel, full_model
from pmor.app.records import KINDS, called, kind_of, typed
from pmor.campaigns.describe import folder_text
from pmor.core.errors import FileFormatError
from pmor.core.progress import Progress, Steps, quietly
from pmor.core.shown import brief
from pmor.core.wording import suggesting
from pmor.export.tables import ResultArray, file_entries
from pmor.rexs.model import is_rexs
from pmor.storage.basis_file import read_basis
from pmor.storage.describe import file_text
from pmor.work.verify import UNSEEN_STATES, Check, checks_text, verify_basis


@brief
@dataclass(frozen=True, eq=False)
class Verification:
    """The laws of a basis, verified against full FE of its case.

    Parameters
    ----------
    checks : tuple of Check
        Each with ``name``, ``value``, ``limit`` and ``ok``.
    """

    path: Path
    checks: tuple[Check, ...]

    @property
    def failures(self) -> tuple[str, ...]:
        """Laws that the basis does not obey, in words."""
        return tuple(f"{c.name} ({c.value:.2g}, at most {c.limit:.2g})" for c in self.checks if not c.ok)

    def __str__(self) -> str:
        return checks_text(self.checks)


@suggesting
def load_results(path: Path | str) -> dict[str, ResultArray]:
    """Read the file with all results of a run, `results.h5`; xarray reads it too, group by group.

    Returns
    -------
    dict of str to ResultArray
        By name, such as ``"ste/ste"``; each with ``values``, ``unit``, ``dims`` and ``description``.

    Raises
    ------
    FileFormatError
        When the file is foreign, damaged, or of another version.
    """
    return file_entries(Path(path))


@suggesting
def info(path: Path | str) -> str:
    """Return what a file is and holds, as text: HDF5 of pmor, the folder of a campaign, or the file of a machine.

    Raises
    ------
    FileFormatError
        When the file is foreign, damaged, or of another version.
    """
    source = Path(path)
    if source.suffix.lower() == ".toml" or is_rexs(source):
        return _machine_text(source)
    if source.suffix == ".json":
        raise FileFormatError(f"{source}: is text, which any editor opens: name an HDF5 file, as results.h5 beside it")
    return folder_text(source) if source.is_dir() else file_text(source)


def _machine_text(path: Path) -> str:
    """What a file of settings is taken for once it is read, and what answers it."""
    kind = KINDS[kind_of(path)]
    called(kind.load)(path)
    asked = [typed(kind.command), "pmor plan"]
    return f"{path}: {kind.words}, for {' and '.join(asked)}"


@suggesting
def verify(path: Path | str, full: FullModel | None = None, *, progress: Steps = quietly) -> Verification:
    """Verify a basis file against full FE of its case, as `pmor info --verify` does.

    Parameters
    ----------
    full : FullModel, optional
        Of the case in the file; made anew by default.
    progress : callable
        Called with the number of full solutions done.

    Raises
    ------
    FileFormatError
        When the file is no basis, damaged, or of another version.
    """
    basis = read_basis(Path(path))
    model = (full or full_model(basis.case)).elastic
    with Progress(UNSEEN_STATES, "full FE, unseen states", further=progress) as bar:
        return Verification(Path(path), verify_basis(basis, model, bar.step))
