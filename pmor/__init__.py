"""Parametric model order reduction for gear contact: the foundation that both stages stand on.

Units inside are mm, N, MPa, rad and N mm; the keys of a case file carry their own.
"""

__version__ = "0.4.0"
