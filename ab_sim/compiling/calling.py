"""Functions of the subset as machine code, called from Python."""

import ctypes
import functools
import struct
import threading
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from ab_sim.compiling.kinds import Array
from ab_sim.compiling.source import BOOL, FLOAT, INT, Kind, Record, Scalar, leaves, text_of
from ab_sim.compiling.translate import Module
from ab_sim.tracing.machine_code import MachineCode

_ENTRY = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
_Put = Callable[[Any, list[Any]], None]
_FORMATS = {"double": "d", "i64": "q", "i1": "q", "ptr": "q"}


class Compiled:
    """A function of the subset as machine code, which is made when it is first needed.

    Args:
        function: of the subset.
        features: of the processor, as of ``MachineCode``.
    """

    def __init__(self, function: FunctionType, features: str | None = None) -> None:
        functools.update_wrapper(self, function)
        self._function, self._features = function, features
        self._lock = threading.Lock()
        self._made: _Entry | None = None

    def __call__(self, *arguments: Any) -> Any:
        """The function's result."""
        return Bound(self.entry(), arguments[0])(*arguments[1:])

    def bind(self, first: Any) -> "Bound":
        """A function of the other arguments: the first is looked at once."""
        return Bound(self.entry(), first)

    def entry(self) -> "_Entry":
        """The machine code; made if need be."""
        if self._made is None:
            with self._lock:
                if self._made is None:
                    self._made = _Entry(self._function, self._features)
        return self._made


@functools.cache
def _compiled(function: FunctionType) -> Compiled:
    return Compiled(function)


def compiled(function: Callable[..., Any]) -> Compiled:
    """A function of the subset, to be called as machine code; the same object each time."""
    if not isinstance(function, FunctionType):
        raise TypeError(f"compiled({function!r}): must be a function written with def")
    with _lock:
        return _compiled(function)


_lock = threading.Lock()


class _Entry:
    """Machine code, and how its arguments are packed."""

    def __init__(self, function: FunctionType, features: str | None) -> None:
        module = Module(function)
        self._code = MachineCode(module.text(), features)
        self.run = _ENTRY(self._code.address("entry"))
        source = module.source
        named = zip(source.arguments, source.kinds, strict=True)
        self.puts = [_packer(kind, f"{source.name}: {name}") for name, kind in named]
        self.names, self.result = source.arguments, source.result
        first, *others = [leaves(kind) for kind in source.kinds]
        rest = [leaf for other in others for leaf in other]
        self.first, self.others = _struct(first), _struct(rest)
        result = leaves(source.result) if source.result else []
        self.results = _struct(result)
        self.block = ctypes.c_int64 * max(len(rest) + len(result), 1)

    def packed(self, value: Any) -> ctypes.Array[Any]:
        """The block of a first argument."""
        flat: list[Any] = []
        self.puts[0](value, flat)
        block = (ctypes.c_int64 * max(len(flat), 1))()
        self.first.pack_into(block, 0, *flat)
        return block


class Bound:
    """A compiled function with its first argument given; of the others.

    It may be called by several threads at once, if the function itself allows for it.
    """

    def __init__(self, entry: _Entry, first: Any) -> None:
        self._entry = entry
        self._others = entry.puts[1:]
        self.rebind(first)

    def rebind(self, first: Any) -> None:
        """Take another first argument from the next call on."""
        # In one go, as another thread may be about to call.
        self._first = self._entry.packed(first), first

    def __call__(self, *arguments: Any) -> Any:
        """The function's result."""
        entry, first = self._entry, self._first
        flat: list[Any] = []
        if len(arguments) != len(self._others):
            raise TypeError(f"must be called with {', '.join(entry.names)}; the first may be bound")
        for put, argument in zip(self._others, arguments):  # noqa: B905 (it takes time)
            put(argument, flat)
        block = entry.block()
        entry.others.pack_into(block, 0, *flat)
        entry.run(first[0], block)
        if entry.result is None:
            return None
        found = entry.results.unpack_from(block, entry.others.size)
        return found[0] if entry.result in (FLOAT, INT) else _made(entry.result, iter(found))


def _struct(kinds: list[str]) -> struct.Struct:
    return struct.Struct("=" + "".join(_FORMATS[kind] for kind in kinds))


def _made(kind: Kind, flat: Any) -> Any:
    """A result of its leaves."""
    if isinstance(kind, Scalar):
        one = next(flat)
        return bool(one) if kind == BOOL else one
    if isinstance(kind, Array):
        raise TypeError("an array as a result: write into one that is an argument")
    values = [_made(field, flat) for field in kind.kinds]
    return kind.cls(*values) if kind.cls else tuple(values)


def _packer(kind: Kind, path: str) -> _Put:
    """Puts the leaves of an argument in a row."""
    if isinstance(kind, Array):
        return _array_packer(kind, path)
    if isinstance(kind, Record):
        named = zip(kind.names, kind.kinds, strict=True)
        fields = [_packer(field, f"{path}.{name}") for name, field in named]

        cls: Any = kind.cls or tuple

        def put_record(value: Any, flat: list[Any]) -> None:
            if not isinstance(value, cls) or len(value) != len(fields):
                raise TypeError(f"{path} must be a {text_of(kind)}, not {value!r}")
            for put, field in zip(fields, value, strict=True):
                put(field, flat)

        return put_record
    types: tuple[type, ...] = (int, np.integer)
    if kind == FLOAT:
        types = (float, int, np.floating, np.integer)
    if kind == BOOL:
        types = (bool, np.bool_)

    def put_number(value: Any, flat: list[Any]) -> None:
        if not isinstance(value, types):
            raise TypeError(f"{path} must be {kind}, not {value!r}")
        flat.append(value)

    return put_number


def _array_packer(kind: Array, path: str) -> _Put:
    dtype = np.dtype(np.float64 if kind.element is float else np.int64)
    rank, nothing, address = kind.rank, (ctypes.c_char * 0).from_buffer, ctypes.addressof

    def put_array(value: Any, flat: list[Any]) -> None:
        try:
            if value.dtype == dtype and value.ndim == rank:
                # Of arrays that are contiguous and may be written to, three times as fast as numpy.
                flat.append(address(nothing(value)))
                flat.extend(value.shape)
                return
        except (AttributeError, TypeError):
            pass
        what = type(value).__name__
        if isinstance(value, np.ndarray):
            what = f"{value.dtype}, shape {value.shape}, strides {value.strides}"
            what += "" if value.flags.writeable else ", not writeable"
        raise TypeError(
            f"{path} must be a C-contiguous, writeable {text_of(kind)} of 64 bits, not {what}"
        )

    return put_array
