"""Threads of the linear algebra library: one, so that run times of different models compare.

Nothing here may import numpy: the libraries read their variables once, when numpy loads them.
"""

import os

VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


def use_one_thread() -> None:
    """Ask for one thread unless the engineer's environment says otherwise; call before numpy is loaded."""
    if not any(name in os.environ for name in VARIABLES):
        os.environ.update(dict.fromkeys(VARIABLES, "1"))


def linear_algebra_threads() -> str:
    """What the environment asks for, for the report."""
    return next((os.environ[name] for name in VARIABLES if name in os.environ), "the library's choice")
