"""Gears in their machine: shafts, bearings and several meshes, from the misalignment to the flank's load."""
