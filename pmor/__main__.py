"""`python -m pmor`: the command line."""

from pmor.app.cli import program

program()
