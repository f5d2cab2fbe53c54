"""Parameters of flanks and axes in words: what stands on pages in place of the keys of files."""

from __future__ import annotations

# Ends of names of members of a set.
FLANKS = ("drive", "coast")
UNITS = {"_um": "µm", "_roll_deg": "° of roll", "_mm": "mm", "_percent": "% of the path"}


def parameter_words(name: str) -> str:
    """Return a parameter by the key of its file, such as ``pinion.tip_relief_um``, in words with its unit."""
    gear, _, key = name.rpartition(".")
    if (of := gear.rpartition("."))[0] and of[2] in FLANKS:
        gear = f"{of[0]}, {of[2]} flanks"
    for ending, unit in UNITS.items():
        if key.endswith(ending):
            words = key.removesuffix(ending).replace("_", " ")
            return f"{words.capitalize()}{f' of the {gear}' if gear else ''} [{unit}]"
    return name
