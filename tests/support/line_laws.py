"""Laws of line contact by themselves, without a pair."""

import math

import numpy as np

from pmor.line.kernels.tip_corner import Corner, Corners, LineLaw
from pmor.line.tip_corner import INFLUENCE_LENGTH, corner_coefficients, wedge_softness


def corners_of(corner):
    """The same corner wherever flanks end."""
    return Corners(np.tile(corner[:4], (1, 4, 1)), np.tile(corner.coefficients, (1, 4, 1, 1, 1)))


NO_CORNERS = corners_of(Corner(0.0, 0.0, 0.0, 0.0, np.empty((3, 0, 0))))


def plain_law(compliance, opening, curvature, least):
    """Two flanks far from any corner."""
    constant = opening + 0.5 - 0.5 * math.log(2.0 * compliance / curvature)
    return LineLaw(compliance, constant, least, math.inf, 0.0, opening, 0.0, curvature, 0.0, 0.0, 1.0, 0.0)


def corner_of(angle, poisson_ratio, place=0.0, depth=1.0):
    """End of a layer at a tip land at an angle (rad) to the flank."""
    return Corner(
        place, depth, INFLUENCE_LENGTH, wedge_softness(angle) - 1.0, corner_coefficients(angle, poisson_ratio)
    )


def corner_law(corner, compliance, opening, angle, curvature, edge_radius=0.0, mate_radius=20.0, share=0.5):
    """Two flanks at a corner, `angle` (rad) to each other there."""
    edge = 1.0 / edge_radius + 1.0 / mate_radius if edge_radius > 0.0 else 0.0
    constant = opening + 0.5 - 0.5 * math.log(2.0 * compliance / curvature)
    influence_length = corner.influence_length * corner.depth
    return LineLaw(compliance, constant, 1e-9 / (compliance * curvature), 0.0, 0.0, opening, angle, curvature, edge,
                   corner.place, influence_length, share)  # fmt: skip
