"""The involute function and its inverse (ISO 21771:2007)."""

from __future__ import annotations

import math


def involute_function(alpha: float) -> float:
    """Return ``inv(alpha) = tan(alpha) - alpha`` (rad)."""
    return math.tan(alpha) - alpha


def inverse_involute(value: float) -> float:
    """Return the angle (rad) whose involute function is `value`, for values between 0 and that of 1.5 rad."""
    angle = min((3.0 * value) ** (1.0 / 3.0), 1.5)  # not below the solution: tan(a) - a > a^3 / 3
    for _ in range(100):
        step = (involute_function(angle) - value) / math.tan(angle) ** 2
        angle -= step
        if abs(step) <= 1e-16:
            break
    return angle
