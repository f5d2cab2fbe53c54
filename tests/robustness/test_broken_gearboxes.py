"""Whatever a gearbox file holds: it becomes a case, or is refused in one line."""

import random
import re
from collections import Counter
from pathlib import Path

from pmor.core.errors import PmorError
from pmor.export.rexs.read import read_stage

GEARBOX = Path(__file__).parents[2] / "cases" / "gearbox.rexs"
VALUES = ("0", "-1", "1e308", "nan", "inf", "", "x", "1e-300", "3", "-0.5", "9" * 20, "2.5", "true")
NAMES = ("1", "2", "99", "gear", "cylindrical_gear", "left", "")


def broken(text, rng):
    """Return the text with a value, a name or some lines changed."""
    kind = rng.choice(("value", "value", "name", "lines"))
    if kind == "lines":
        lines = text.split("\n")
        start = rng.randrange(len(lines))
        del lines[start : start + rng.randint(1, 6)]
        return "\n".join(lines)
    pattern, choices = (r">([^<>\n]+)<", VALUES) if kind == "value" else (r'(?:id|role|type)="([^"]*)"', NAMES)
    place = rng.choice(list(re.finditer(pattern, text)))
    return text[: place.start(1)] + rng.choice(choices) + text[place.end(1) :]


def test_a_broken_gearbox_is_a_case_or_refused_in_one_line(tmp_path):
    text, rng, outcomes = GEARBOX.read_text(), random.Random(17), Counter()
    for _ in range(80):
        (tmp_path / "a.rexs").write_text(broken(text, rng))
        try:
            read_stage(tmp_path / "a.rexs")
            outcomes["case"] += 1
        except PmorError as error:
            outcomes["refused"] += 1
            outcomes["of several lines"] += "\n" in str(error)
    assert outcomes["of several lines"] == 0
    assert min(outcomes["case"], outcomes["refused"]) > 10
