"""Content of files that users name: never more than a file of its kind has, whatever the name stands for."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

# Of text; matrices of hundreds of seats have a tenth of it.
MOST_TEXT = 2**26
# Of meshes and condensed matrices: what a computer can hold.
MOST_BYTES = 2**34


def read_bytes(path: Path, most: int = MOST_BYTES) -> bytes:
    """Return the content of a file, at most so many bytes; pipes are read too.

    Raises
    ------
    OSError
        Also of devices, which may never end, and of larger files.
    """
    with path.open("rb") as file:
        mode = path.stat().st_mode
        if stat.S_ISCHR(mode) or stat.S_ISBLK(mode):
            raise OSError(errno.EINVAL, "is a device, no file")
        content = file.read(min(most, MOST_BYTES) + 1)
        if len(content) > most:
            raise OSError(errno.EFBIG, f"has more than {most // 2**20} MiB")
    return content
