"""How kernels are compiled.

Whatever kernels read, types and constants included, stands in the files of `pmor.core.keeping.kernel_sources`: their
hash finds the kept code.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

from numba import njit, types

from pmor.core.keeping import keeping_kernels, kernels_folder

# Divisions follow IEEE 754 instead of raising, which spares a branch at each; results are checked where they are used.
# fastmath stays off: sums keep their order, and NaN stays NaN.
_OPTIONS: dict[str, Any] = {"cache": kernels_folder() is not None, "nogil": True, "error_model": "numpy",
                            "fastmath": False, "no_cfunc_wrapper": True}  # fmt: skip
# Kernels that neither make, copy nor return arrays go without numba's runtime: arguments are borrowed from the caller
# instead of counting references to each of their arrays at every call, which took a third of a sweep's time.
_BORROWING: dict[str, Any] = {**_OPTIONS, "_nrt": False}
# Set explicitly, otherwise inherited from the caller.
ALLOCATING: dict[str, Any] = {**_OPTIONS, "_nrt": True}


def _compiling(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    def compile_kernel(function: Callable[..., Any]) -> Any:
        with keeping_kernels():
            dispatcher = njit(**options)(function)
            if hasattr(dispatcher, "get_call_template") and "inline" not in options:
                _serve_kernels(dispatcher, function, options)
        return dispatcher

    return compile_kernel


def _serve_kernels(dispatcher: Any, function: Callable[..., Any], options: dict[str, Any]) -> None:
    """Let other kernels call a twin without the wrapper that only a call from Python needs.

    The twin is compiled once for all integers: numba would do so for each constant that a caller writes, and once more
    for int. All kernels take 57 s of CPU with twins, and 80 s without (numba 0.68). Of a function that
    kernels call, numba needs `get_call_template` and `get_overload`; without these there are no twins.
    """
    within = FunctionType(function.__code__, function.__globals__, function.__name__, function.__defaults__)
    within.__qualname__ = f"{function.__qualname__}_within"  # its code is kept apart
    within.__module__ = function.__module__
    twin = njit(**{**options, "no_cpython_wrapper": True})(within)

    def call_template(arguments: Any, keywords: Any) -> Any:
        return twin.get_call_template(
            tuple(types.unliteral(kind) for kind in arguments),
            {name: types.unliteral(kind) for name, kind in keywords.items()},
        )

    dispatcher.get_call_template = call_template
    dispatcher.get_overload = twin.get_overload


compiled = _compiling(**_BORROWING)
# Called once per contact point: dozens of shapes and strides to pass on each time.
inlined = _compiling(**_BORROWING, forceinline=True)
allocating = _compiling(**ALLOCATING)
# A part of its only caller, set apart to be read. Each function below another one is optimised once more with its
# caller: near the top of the call tree that takes ten seconds.
merged = _compiling(**_OPTIONS, inline="always")
