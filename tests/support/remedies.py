"""What refusals of pairs propose, taken at its word."""

import re
from dataclasses import replace

from pmor.gear.clearance import refuse_interference

REMEDY = re.compile(r"\[(pinion|wheel)\] (addendum|dedendum) to ([\d.]+)")


def followed(pair, refusal):
    """Take each remedy that a refusal proposes; return them. GeometryError where one does not clear the pair."""
    taken = []
    for remedy in refusal.rpartition(": ")[2].split(", or "):
        changes = {name: replace(getattr(pair, name), **{key: float(value)})
                   for name, key, value in REMEDY.findall(remedy)}  # fmt: skip
        if changes:
            refuse_interference(replace(pair, **changes))
            taken.append(remedy)
    return taken
