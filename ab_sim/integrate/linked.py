"""Functions that a kernel is made of are linked into it, and get no machine code of their own.

Numba makes machine code of every function that it compiles, and throws it away where that is only
called by other compiled ones, whose code has it once more: a tenth to a seventh of the time that a
kernel takes to make. What Python cannot call, for want of a wrapper, is left as LLVM's code here.
"""

import contextlib
from collections.abc import Iterator
from typing import Any

from numba.core.codegen import JITCodeLibrary

_WRAPPER = "_ZN7cpython"
"""How the names of those functions begin by which Python calls compiled ones."""


class _Linked(JITCodeLibrary):  # type: ignore[misc]
    """The code of a function; machine code only if Python can call it, or it comes from a file."""

    def _finalize_final_module(self) -> None:
        from_file: bool = self._object_caching_enabled and self._compiled_object is not None
        if from_file or any(f.name.startswith(_WRAPPER) for f in self._final_module.functions):
            super()._finalize_final_module()
            return
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@contextlib.contextmanager
def linked_only(codegen: Any) -> Iterator[None]:
    """What is compiled meanwhile is made so; under numba's lock for compiling.

    Args:
        codegen: numba's, of the processor.
    """
    if codegen._library_class is _Linked:  # A kernel that another one calls.
        yield
        return
    tell = codegen.set_env

    def set_env(name: str, environment: Any) -> None:
        if codegen._engine.is_symbol_defined(name):
            tell(name, environment)

    codegen._library_class, codegen.set_env = _Linked, set_env
    try:
        yield
    finally:
        del codegen._library_class, codegen.set_env
