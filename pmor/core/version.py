"""Version of the program."""

__version__ = "0.10.0"
