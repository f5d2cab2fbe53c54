"""The study: a grid of meshes and refinements, three models, error against run time, in one report.

The only package below the commands that uses both stages.
"""
