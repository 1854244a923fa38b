"""Functions of the subset as machine code, called from Python.

Arguments are packed into blocks of eight bytes for each number, pointer and length; there is one
for the first argument, which can be kept, and one for the others and the result.
"""

import ctypes
import functools
import struct
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import FunctionType
from typing import Any

import numpy as np

from ab_sim.compiling.kinds import Array
from ab_sim.compiling.library import Library
from ab_sim.compiling.source import (
    BOOL,
    FLOAT,
    INT,
    FunctionSource,
    Kind,
    Record,
    Scalar,
    leaves,
    text_of,
)

_ENTRY = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
_FORMATS = {"double": "d", "i64": "q", "i1": "?7x", "ptr": "q"}
NOTHING_KNOWN: Mapping[str, bool] = {}
_Put = Callable[[Any], tuple[Any, ...]]


class Compiled:
    """A function of the subset as machine code, which is made when it is first needed.

    Args:
        function: of the subset, with an argument at least.
        known: fields of records in the arguments that have this value in every call, by name.
        library: where what has been made is taken from, and goes to; one of its own if None.
    """

    def __init__(
        self,
        function: FunctionType,
        known: Mapping[str, bool] = NOTHING_KNOWN,
        library: Library | None = None,
    ) -> None:
        functools.update_wrapper(self, function)
        self._function, self._known, self._library = function, known, library or Library()
        self._lock = threading.Lock()
        self._made: _Entry | None = None

    def __call__(self, first: Any, *others: Any) -> Any:
        """The function's result."""
        return BoundFunction(self._entry(), first)(*others)

    def bind(self, first: Any) -> "BoundFunction":
        """A function of the other arguments: the first is looked at once.

        Its arrays are kept, and what is in them is read at each call; its numbers are copied.
        """
        return BoundFunction(self._entry(), first)

    def _entry(self) -> "_Entry":
        if self._made is None:
            with self._lock:
                self._made = self._made or _Entry(self._function, self._known, self._library)
        return self._made


_compiled: dict[tuple[FunctionType, frozenset[tuple[str, bool]]], Compiled] = {}
_library = Library()


def compiled(function: Callable[..., Any], known: Mapping[str, bool] = NOTHING_KNOWN) -> Compiled:
    """A function of the subset, to be called as machine code; the same object each time.

    Args:
        function: of the subset.
        known: see ``Compiled``.
    """
    if not isinstance(function, FunctionType):
        raise TypeError(f"compiled({function!r}): must be a function written with def")
    which = function, frozenset(known.items())
    if which not in _compiled:
        _compiled.setdefault(which, Compiled(function, known, _library))
    return _compiled[which]


class BoundFunction:
    """A compiled function with its first argument given; of the others.

    It may be called by several threads at once if the function itself allows for it; meanwhile
    Python goes on in others.
    """

    def __init__(self, entry: "_Entry", first: Any) -> None:
        self._entry, self._run = entry, entry.run
        self._row, self._pack, self._block = entry.row, entry.others.pack_into, entry.block
        self.rebind(first)

    def rebind(self, first: Any) -> None:
        """Take another first argument from the next call on."""
        # In one go, as another thread may be about to call.
        block = self._entry.packed(first)
        self._first = ctypes.addressof(block), block, first

    def __call__(self, *others: Any) -> Any:
        """The function's result."""
        first, block = self._first, self._block()
        row = self._row(*others)
        try:
            self._pack(block, 0, *row)
        except struct.error:
            raise self._entry.wrong(others) from None
        self._run(first[0], block)
        return self._entry.result(block)


class _Entry:
    """Machine code, and how its arguments are packed."""

    def __init__(self, function: FunctionType, known: Mapping[str, bool], library: Library) -> None:
        address, (_, arguments, kinds, of_result) = library.made(function, known)
        if of_result and "ptr" in leaves(of_result):
            source = FunctionSource(function)
            what, instead = "an array as a result", "write into one that is an argument"
            raise source.error(source.tree, what, instead)
        self._library, self.run = library, _ENTRY(address)
        named = list(zip(arguments, kinds, strict=True))
        self._paths = [(kind, f"{function.__qualname__}: {name}") for name, kind in named]
        self._first = _packer(*self._paths[0])
        puts = {f"_put{k}": _packer(*path) for k, path in enumerate(self._paths)}
        row = [
            name if isinstance(kind, Scalar) else f"*_put{k}({name})"
            for k, (name, kind) in enumerate(named)
        ]
        names = ", ".join(arguments[1:])
        # A function with the arguments' names, which also says how many there must be.
        self.row = eval(f"lambda {names}: ({''.join(part + ', ' for part in row[1:])})", puts)
        first, *others = map(leaves, kinds)
        rest, result = sum(others, ()), leaves(of_result) if of_result else ()
        self._of_first, self.others, results = map(_struct, (first, rest, result))
        self.block = ctypes.c_int64 * max(len(rest) + len(result), 1)
        kind, unpack, at = of_result, results.unpack_from, self.others.size
        if kind is None:
            self.result: Callable[[Any], Any] = lambda block: None
        elif isinstance(kind, Scalar):
            self.result = lambda block: unpack(block, at)[0]
        else:
            self.result = lambda block: _made(kind, iter(unpack(block, at)))

    def packed(self, value: Any) -> ctypes.Array[Any]:
        """The block of a first argument."""
        flat = self._first(value)
        block = (ctypes.c_int64 * max(len(flat), 1))()
        self._of_first.pack_into(block, 0, *flat)
        return block

    def wrong(self, others: tuple[Any, ...]) -> TypeError:
        """Which of the numbers among the other arguments is none."""
        for path, value in zip(self._paths[1:], others, strict=True):
            try:
                _packer(*path)(value)
            except TypeError as error:
                return error
        raise AssertionError


def _struct(kinds: Sequence[str]) -> struct.Struct:
    return struct.Struct("=" + "".join(_FORMATS[kind] for kind in kinds))


def _made(kind: Kind, flat: Iterator[Any]) -> Any:
    """A result of its leaves."""
    if isinstance(kind, Scalar):
        return next(flat)
    assert isinstance(kind, Record)
    values = [_made(field, flat) for field in kind.kinds]
    return kind.cls(*values) if kind.cls else tuple(values)


def _packer(kind: Kind, path: str) -> _Put:
    """Makes of an argument its leaves; raises TypeError if it is of another kind."""
    if isinstance(kind, Array):
        return _array_packer(kind, path)
    if isinstance(kind, Record):
        return _record_packer(kind, path)
    types: dict[Scalar, Any] = {
        FLOAT: (float, int, np.floating, np.integer),
        INT: (int, np.integer),
        BOOL: (bool, np.bool_),
    }

    def put_number(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, types[kind]) or kind == INT and not -(2**63) <= value < 2**63:
            raise TypeError(f"{path} must be {kind}, not {value!r}")
        return (value,)

    return put_number


def _record_packer(kind: Record, path: str) -> _Put:
    cls: Any = kind.cls or tuple
    named = zip(kind.names, kind.kinds, strict=True)
    fields = [_packer(field, f"{path}.{name}") for name, field in named]

    def put_record(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, cls) or len(value) != len(fields):
            raise TypeError(f"{path} must be a {text_of(kind)}, not {value!r}")
        return tuple(x for put, field in zip(fields, value, strict=True) for x in put(field))

    return put_record


def _array_packer(kind: Array, path: str) -> _Put:
    dtype = np.dtype(np.float64 if kind.element is float else np.int64)
    rank, nothing, address = kind.rank, (ctypes.c_char * 0).from_buffer, ctypes.addressof

    def put_array(value: Any) -> tuple[Any, ...]:
        try:
            if value.dtype == dtype and value.ndim == rank:
                # Fails unless it is contiguous and writeable; numpy's own way takes 0.8 us.
                return address(nothing(value)), *value.shape
        except (AttributeError, TypeError):
            pass
        what = type(value).__name__
        if isinstance(value, np.ndarray):
            what = f"{value.dtype}, shape {value.shape}, strides {value.strides}"
            what += "" if value.flags.writeable else ", read-only"
        raise TypeError(
            f"{path} must be a {text_of(kind)}, 64 bits each, C-contiguous, writeable; not {what}"
        )

    return put_array
