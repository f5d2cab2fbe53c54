"""Convergence of line contact with the mesh of the bodies."""
