"""Compiled geometry of gears: their types, motion of the wheel's axis, deviations of the flanks."""
