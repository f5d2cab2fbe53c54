"""Published figures, exact results and those of other programs, each beside that of this one.

    python -m pmor.validation [FILE]

makes the table anew (by default `cases/manual/validation.md`). Figures stand here once; tests ask whether each holds.
"""
