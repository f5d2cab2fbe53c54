"""Folders of campaigns, also of interrupted ones, and stores of compliances, described."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from pmor.campaigns.chunks import PLAN, planned_files
from pmor.core.errors import FileFormatError, printable
from pmor.core.memory import memory_text
from pmor.storage.describe import file_text
from pmor.storage.gear_store import entries, is_store
from pmor.storage.manifest import is_ours
from pmor.work.pieces import PARTS


def folder_text(folder: Path) -> str:
    """Describe a folder; FileFormatError when it is neither results of a campaign nor a store."""
    if is_store(folder):
        found = entries(folder)
        size = memory_text(sum(path.stat().st_size for path in found))
        return printable(f"{folder}: compliances of {len(found)} gears, {size}")
    if is_ours(folder / PARTS / PLAN):
        return _unfinished(folder)
    if (folder / "campaign.h5").is_file():
        return file_text(folder / "campaign.h5")
    text = f"{folder}: is a folder, and none of a campaign or of compliances: name a file in it, such as results.h5"
    raise FileFormatError(text)


def _unfinished(folder: Path) -> str:
    name, files, chunks = planned_files(folder / PARTS)
    answers = [answer for _, answer in files.finished()]
    status = Counter(row["status"] for answer in answers for row in answer.rows)
    counts = ", ".join(f"{count} {name}" for name, count in sorted(status.items())) or "none"
    designs = sum(chunk.count for chunk in chunks)
    lines = [
        f"{folder}: campaign {name}, not finished",
        f"  {len(answers)} of {len(chunks)} chunks, {status.total()} of {designs} designs: {counts}",
        "  the same command goes on where it stopped",
    ]
    return "\n".join(map(printable, lines))
