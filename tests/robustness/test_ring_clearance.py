"""Internal pairs that are accepted run: pinion and ring are rolled, all their teeth held against each other."""

import re
from collections import Counter

import numpy as np
import pytest

from pmor.core.errors import GeometryError
from pmor.gear.clearance import ROUNDED, refuse_interference
from tests.support.internal_pairs import deepest_overlap, random_internal_pair
from tests.support.remedies import followed

OVERLAP = ROUNDED + 2e-6  # mm; cuts of rounded dimensions are let pass, chords of the outlines cut off less
REASONS = {
    "tips": "tips pass through those of the .* more than 0: (reduce|lower)",
    "fillet": "tip cuts .* mm into .* fillet, more than 0: (reduce|raise|lower)",
    "tip clearance": "tip circle reaches .* mm below .* root circle.* must not be below 0: (reduce|raise|lower)",
    "trimming": "shaper teeth = .* trim .*: lower it, or reduce",
    "tip inside base": "lies inside .*: reduce addendum",
    "contact ratio": r"contact ratio \S+ is below 1: .*raise .pinion. addendum",
    "no flank": "leaves .almost. no involute",
    "pointed": "pointed below",
    "fillet room": "has no room for it: lower it",
    "rack": "too large for the rack tooth .*: (write at most|reduce)",
    "cutter": "shaper (tip_radius_mm|profile_shift|teeth) = .*(lower|take)",
    "shifts": "profile shifts add up to .* lower",
    "base circles": "below the difference of the base radii .* raise it",
}
BEYOND_THE_PAIR = ("trimming",)
FINE = 240  # positions at which the least of interference shows


def check_pairs(count, seed):
    """Hold random pairs against the rolling oracle; return how many were accepted, and refused for which reason."""
    rng, tally = np.random.default_rng(seed), Counter()
    for number in range(count):
        pair, refusal = None, ""
        try:
            pair = random_internal_pair(rng)
            refuse_interference(pair)
        except GeometryError as error:
            refusal = str(error)
        if not refusal:
            overlap = deepest_overlap(pair)
            assert overlap < OVERLAP, f"pair {number} overlaps by {overlap} mm: {pair}"
            tally["accepted"] += 1
            continue
        (reason, *_) = (name for name, words in REASONS.items() if re.search(words, refusal))
        tally[reason] += 1
        tally["remedies"] += len(followed(pair, refusal)) if pair else 0
        fouls = pair is None or reason in BEYOND_THE_PAIR or deepest_overlap(pair, FINE) > 0.0
        assert fouls, f"pair {number} has room, yet: {refusal}"
    return tally


def test_random_internal_pairs_run_without_overlap_or_are_refused_with_the_reason():
    tally = check_pairs(50, 3)
    assert tally["accepted"] > 15
    assert tally["fillet"] > 0
    assert tally["tips"] > 0
    assert tally["remedies"] > 1


@pytest.mark.slow
def test_thousands_of_internal_pairs_run_without_overlap_or_are_refused():
    print(check_pairs(2000, 4))  # noqa: T201
