"""Roof: the two front doors, command line and Python API, and the plan."""
