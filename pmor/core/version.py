"""Version of the program."""

__version__ = "0.11.0"
