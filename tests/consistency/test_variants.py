"""Variants of a pair at fixed angles: memory stays within its bound, however many axes are drawn."""

import tracemalloc

import numpy as np

from pmor.gear.condition import Assembly, Misalignment
from pmor_online import variants
from pmor_online.variants import VariantSolver
from tests.support.line_pairs import TORQUE, models

ANGLES, DRAWS, KEPT = 16, 60, 4


def test_thousands_of_axes_do_not_fill_the_memory(monkeypatch):
    """5.7 MB for each of a helical pair at 32 angles: 23 GB after 4,096 draws, had all been kept."""
    _, reduced = models("helical")
    phi = reduced.meshed.pair.pitch * np.arange(ANGLES) / ANGLES
    one = reduced.lines.place(phi, Misalignment())
    monkeypatch.setattr(variants, "MOST_IDLE_BYTES", KEPT * one.nbytes, raising=False)
    solver = VariantSolver(reduced, phi, [1e-3 * TORQUE])
    drawn = [Assembly(Misalignment(in_plane_um=float(n))) for n in range(DRAWS)]
    first = solver.solve(drawn[0])  # compiles
    tracemalloc.start()
    for assembly in drawn:
        solver.solve(assembly)
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert held < (KEPT + 2) * one.nbytes < DRAWS * one.flexibility.between.nbytes
    again = solver.solve(drawn[0])  # placed anew
    assert np.array_equal(first.ste_um, again.ste_um)
    assert np.array_equal(first.load_N_per_mm, again.load_N_per_mm)
