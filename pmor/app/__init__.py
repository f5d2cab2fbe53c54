"""Roof: the command line, one function a command, and the plan."""
