"""What is in a folder of a campaign, also of one that was interrupted, and in a store of compliances, as text."""

from __future__ import annotations

import json
from pathlib import Path

from pmor.campaigns.chunks import PLAN, ChunkFiles
from pmor.campaigns.store import entries, is_store
from pmor.core.errors import FileFormatError, printable
from pmor.core.memory import memory_text
from pmor.storage.describe import file_text
from pmor.storage.manifest import is_ours
from pmor.work.pieces import PARTS


def folder_text(folder: Path) -> str:
    """Describe a folder.

    Raises
    ------
    FileFormatError
        When it is neither results of a campaign nor a store.
    """
    if is_store(folder):
        found = entries(folder)
        size = memory_text(sum(path.stat().st_size for path in found))
        return printable(f"{folder}: compliances of {len(found)} gears, {size}")
    if is_ours(folder / PARTS / PLAN):
        return _unfinished(folder)
    if (folder / "campaign.h5").is_file():
        return file_text(folder / "campaign.h5")
    raise FileFormatError(f"{folder}: is a folder, and none of a campaign or of compliances; name a file")


def _unfinished(folder: Path) -> str:
    plan = json.loads((folder / PARTS / PLAN).read_text(encoding="utf-8"))
    chunks, rows = ChunkFiles.known(folder / PARTS, plan["key"])
    status: dict[str, int] = {}
    for row in rows:
        status[row["status"]] = status.get(row["status"], 0) + 1
    counts = ", ".join(f"{count} {name}" for name, count in sorted(status.items())) or "none"
    lines = [
        f"{folder}: campaign {plan['campaign']}, not finished",
        f"  {chunks} of {plan['chunks']} chunks, {sum(status.values())} of {plan['designs']} designs: {counts}",
        "  the same command goes on where it stopped",
    ]
    return "\n".join(map(printable, lines))
