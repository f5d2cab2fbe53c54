"""Teeth as beams that several tests share."""

from dataclasses import replace

import numpy as np

from pmor.gear.classical.tooth_beam import tooth_beam

ALPHA = np.radians(20.0)


def paper_beam():
    return tooth_beam(21, 4.0, ALPHA)


def prismatic_beam(half_thickness, y_0, y_1, n=4001):
    """A tooth of constant thickness, for closed forms."""
    y = np.linspace(y_0, y_1, n)
    return replace(paper_beam(), y_mm=y, half_thickness_mm=np.full(n, half_thickness))
