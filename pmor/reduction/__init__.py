"""Orthonormal contact shapes, their interpolation over the roll angle, and the error estimate."""
