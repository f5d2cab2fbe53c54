"""Offline stage: full finite-element contact at sampled positions and torques, compressed to a reduced basis."""
