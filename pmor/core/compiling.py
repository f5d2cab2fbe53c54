"""How kernels are compiled, and how numba's cache notices an edit in any of them.

numba keeps compiled code beside the sources and compares the time stamp of the file that holds the function: an edit in
another file, of a function that is called from there, would go unnoticed and the old code would run. So each
dispatcher's stamp is a hash over the sources of all kernels instead, and of its own folder where that is another one.
Whatever kernels read, types and constants included, therefore stands in the packages `kernels`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from types import FunctionType
from typing import Any

from numba import njit, types

from pmor.core.keeping import can_keep

# Divisions follow IEEE 754 instead of raising, which spares a branch at each; results are checked where they are used.
# fastmath stays off: sums keep their order, and NaN stays what it is.
_OPTIONS: dict[str, Any] = {"cache": can_keep(), "nogil": True, "error_model": "numpy", "fastmath": False,
                            "no_cfunc_wrapper": True}  # fmt: skip
# What neither makes, copies nor returns arrays goes without numba's runtime: it borrows its arguments from its caller
# instead of counting references to each of their arrays at every call, which took a third of a sweep's time.
_BORROWING: dict[str, Any] = {**_OPTIONS, "_nrt": False}
# Said aloud: a function that says nothing inherits this from its caller.
ALLOCATING: dict[str, Any] = {**_OPTIONS, "_nrt": True}

_PACKAGE = Path(__file__).parents[1]
_SOURCES = (Path(__file__), _PACKAGE / "core" / "linear.py", *sorted(_PACKAGE.glob("*/kernels/*.py")))


def sources_stamp(*more: Path) -> str:
    """Return a hash over the sources of all kernels, and of files elsewhere."""
    digest = hashlib.sha256()
    for path in (*_SOURCES, *more):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode() if path in _SOURCES else path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


_STAMP = sources_stamp()


def _stamped(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    def compile_stamped(function: Callable[..., Any]) -> Any:
        dispatcher = _keep_stamped(njit(**options)(function), function)
        if hasattr(dispatcher, "get_call_template") and "inline" not in options:
            _serve_kernels(dispatcher, function, options)
        return dispatcher

    return compile_stamped


def _keep_stamped(dispatcher: Any, function: Callable[..., Any]) -> Any:
    # Not there when numba is switched off or keeps no cache.
    file: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if hasattr(file, "_source_stamp"):
        own = Path(function.__code__.co_filename)
        # Kernels elsewhere call each other across the files of their own folder, and the kernels of the package.
        file._source_stamp = _STAMP if own in _SOURCES else sources_stamp(*sorted(own.parent.glob("*.py")))
        # Looked at before anything is unpickled: an index of other sources may name types that are no more.
        file._version = f"{file._version} {file._source_stamp}"
    return dispatcher


def _serve_kernels(dispatcher: Any, function: Callable[..., Any], options: dict[str, Any]) -> None:
    """Let other kernels call a twin without what only a call from Python needs, which takes long to compile.

    The twin is compiled once for all integers: numba would do so for each constant that a caller writes, and once more
    for int.
    """
    within = FunctionType(function.__code__, function.__globals__, function.__name__, function.__defaults__)
    within.__qualname__ = f"{function.__qualname__}_within"  # its code is kept apart
    within.__module__ = function.__module__
    twin = _keep_stamped(njit(**{**options, "no_cpython_wrapper": True})(within), function)

    def call_template(arguments: Any, keywords: Any) -> Any:
        return twin.get_call_template(
            tuple(types.unliteral(kind) for kind in arguments),
            {name: types.unliteral(kind) for name, kind in keywords.items()},
        )

    dispatcher.get_call_template = call_template
    dispatcher.get_overload = twin.get_overload


compiled = _stamped(**_BORROWING)
# Called once per contact point: dozens of shapes and strides to pass on each time.
inlined = _stamped(**_BORROWING, forceinline=True)
allocating = _stamped(**ALLOCATING)
# A part of its only caller, set apart to be read. Each function below another one is optimised once more with its
# caller: near the top of the call tree that takes ten seconds.
merged = _stamped(**_OPTIONS, inline="always")
