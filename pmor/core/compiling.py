"""How kernels are compiled.

Whatever kernels read, types and constants included, stands in the files of `pmor.core.keeping.kernel_sources`: their
hash finds the kept code.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba import njit, types
from numba.core import codegen, compiler, event

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


class _KernelLibrary(codegen.JITCodeLibrary):
    """Code of a kernel: simplified, and optimised with all that it calls."""

    def _optimize_functions(self, module: Any) -> None:
        """Take tuples apart and drop what is idle; numba has a whole optimisation here, which is done again later."""
        module.data_layout = self._codegen._data_layout
        passes = llvm.create_new_module_pass_manager()
        passes.add_sroa_pass()
        passes.add_instruction_combine_pass()
        passes.add_simplify_cfg_pass()
        passes.run(module, self._codegen._pass_builder())


class _WithinLibrary(_KernelLibrary):
    """What kernels alone call: code for their compiler, hardly optimised, and none for the machine.

    numba optimises a function, all that it calls included, and makes machine code of it, before it links it to its
    caller, where the same is done once more: at six levels of calls half of the time.
    """

    def _optimize_final_module(self) -> None:
        passes, builder = self._codegen._module_pass_manager(
            cost="cheap", opt=0, loop_vectorize=False, slp_vectorize=False
        )
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalized = True
        environments = ir.Module(f"environments of {self.name}")
        environments.triple, environments.data_layout = self._final_module.triple, self._final_module.data_layout
        for known in self._get_module_for_linking().global_variables:
            if known.name.startswith("_ZN08NumbaEnv"):
                pointer = ir.GlobalVariable(environments, ir.PointerType(), known.name)
                pointer.linkage, pointer.initializer = "common", ir.Constant(pointer.value_type, None)
        self._final_module = llvm.parse_assembly(str(environments))
        super()._finalize_final_module()


class _KernelFlags(compiler.Flags):
    """Options of a kernel: numba makes dictionaries of all of them to compare them, 100,000 times."""

    def __hash__(self) -> int:
        return len(self._values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _KernelFlags) and self._values == other._values


class _KernelCompiler(compiler.Compiler):
    _library = _KernelLibrary

    def __init__(
        self, typingctx: Any, targetctx: Any, library: Any, args: Any, return_type: Any, flags: Any, locals: Any
    ) -> None:
        super().__init__(typingctx, targetctx, library, args, return_type, _KernelFlags(flags), locals)

    def compile_extra(self, func: Any) -> Any:
        """Compile; numba's own functions that the kernel calls are linked into it in the same way as ours."""
        own = self.state.targetctx.codegen()
        before, own._library_class = own._library_class, _WithinLibrary
        try:
            return super().compile_extra(func)
        finally:
            own._library_class = before

    def define_pipelines(self) -> Any:
        self.state.library = self._library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        return super().define_pipelines()


class _WithinCompiler(_KernelCompiler):
    _library = _WithinLibrary


class _Uncollected(event.Listener):
    """Nothing is collected during a compilation: numba makes millions of objects, and keeps most."""

    def __init__(self) -> None:
        self._depth, self._was = 0, True

    def on_start(self, event: Any) -> None:
        """Stop the collection at the outermost function."""
        if self._depth == 0:
            self._was = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event: Any) -> None:
        """Let it go on."""
        self._depth -= 1
        if self._depth == 0 and self._was:
            gc.enable()


event.register("numba:compile", _Uncollected())
# Passes are run in this way since numba 0.62.
_OURS = hasattr(codegen, "create_pass_builder")
_KERNEL: dict[str, Any] = {"pipeline_class": _KernelCompiler} if _OURS else {}
_WITHIN: dict[str, Any] = {"pipeline_class": _WithinCompiler} if _OURS else {}


def _compiling(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    def compile_kernel(function: Callable[..., Any]) -> Any:
        with keeping_kernels():
            dispatcher = njit(**options, **_KERNEL)(function)
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

    @cache
    def twin() -> Any:  # made when a kernel that calls it is compiled: kept ones do without
        within = FunctionType(function.__code__, function.__globals__, function.__name__, function.__defaults__)
        within.__qualname__ = f"{function.__qualname__}_within"  # its code is kept apart
        within.__module__ = function.__module__
        with keeping_kernels():
            return njit(**{**options, "no_cpython_wrapper": True, **_WITHIN})(within)

    def call_template(arguments: Any, keywords: Any) -> Any:
        dispatcher.get_overload = twin().get_overload
        return twin().get_call_template(
            tuple(types.unliteral(kind) for kind in arguments),
            {name: types.unliteral(kind) for name, kind in keywords.items()},
        )

    dispatcher.get_call_template = call_template


compiled = _compiling(**_BORROWING)
# Called once per contact point: dozens of shapes and strides to pass on each time.
inlined = _compiling(**_BORROWING, forceinline=True)
allocating = _compiling(**ALLOCATING)
# A part of its only caller, set apart to be read. Each function below another one is optimised once more with its
# caller: near the top of the call tree that takes ten seconds.
merged = _compiling(**_OPTIONS, inline="always")
