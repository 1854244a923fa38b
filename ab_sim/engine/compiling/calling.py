"""Call functions of the subset as machine code from Python.

Arguments are packed into two blocks, with eight bytes for each number, pointer and length. One
block holds the first argument and can be kept from call to call, the other holds the rest.
"""

import copy
import ctypes
import functools
import struct
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import FunctionType
from typing import Any

import numpy as np

from ab_sim.base.errors import short
from ab_sim.engine.compiling.kinds import Array
from ab_sim.engine.compiling.library import Library
from ab_sim.engine.compiling.source import (
    BOOL,
    FLOAT,
    INT,
    FunctionSource,
    Kind,
    RecordKind,
    Scalar,
    for_class,
    leaves,
    text_of,
)

_FORMATS = {"double": "d", "i64": "q", "i1": "?7x", "ptr": "q"}
_RETURNED: dict[Scalar, Any] = {FLOAT: ctypes.c_double, INT: ctypes.c_int64, BOOL: ctypes.c_bool}
_NO_FLAGS: Mapping[str, bool] = {}
"""Default of ``Compiled``: no flag's value is known."""
_Put = Callable[[Any], tuple[Any, ...]]
_Row = Callable[..., tuple[Any, ...]]


class Compiled:
    """Function of the subset as machine code, which is compiled when it is first needed.

    Parameters
    ----------
    function
        Function of the subset, with at least one argument.
    flags
        Values of bool fields of records in the arguments, by name, which are the same in every
        call. Code that they make unreachable is left out.
    library
        Store of compiled functions to use and to add to; None for a new one.
    """

    def __init__(
        self,
        function: FunctionType,
        flags: Mapping[str, bool] = _NO_FLAGS,
        library: Library | None = None,
    ) -> None:
        functools.update_wrapper(self, function)
        self._function, self._flags, self._library = function, flags, library or Library()
        self._lock = threading.Lock()
        self._made: dict[FunctionType, _Entry] = {}

    def __call__(self, first: Any, *others: Any) -> Any:
        """Call the function with all its arguments, and return its result."""
        return BoundFunction(self._entry(type(first)), first)(*others)

    def bind(self, first: Any) -> "BoundFunction":
        """Return a function of the other arguments, with the first one unpacked once.

        Numbers of the first argument are copied now. Arrays are kept by reference, so each call
        reads their current contents.
        """
        return BoundFunction(self._entry(type(first)), first)

    def _entry(self, cls: type) -> "_Entry":
        function = for_class(self._function, cls)
        with self._lock:
            if function not in self._made:
                self._made[function] = _Entry(function, self._flags, self._library)
            return self._made[function]


_compiled: dict[tuple[FunctionType, frozenset[tuple[str, bool]]], Compiled] = {}
_library = Library()


def compiled(function: Callable[..., Any], flags: Mapping[str, bool] = _NO_FLAGS) -> Compiled:
    """Return a function of the subset as machine code, always the same object for one function.

    Parameters
    ----------
    function
        Function of the subset.
    flags
        Values of bool fields that are the same in every call, as for ``Compiled``.

    Raises
    ------
    TypeError
        The function was not written with ``def``.
    """
    if not isinstance(function, FunctionType):
        raise TypeError(f"compiled({function!r}): must be a function written with def")
    which = function, frozenset(flags.items())
    if which not in _compiled:
        _compiled.setdefault(which, Compiled(function, flags, _library))
    return _compiled[which]


class KeptArray:
    """Array argument of many calls, whose address and shape are read once.

    Its contents may change, and each call reads them; its shape must not change.

    Parameters
    ----------
    array : array
        Floats or ints of 64 bits, C-contiguous and writeable.
    """

    __slots__ = ("array", "dtype", "leaves", "ndim")

    def __init__(self, array: np.ndarray) -> None:
        kind = Array(array.ndim, int if array.dtype == np.int64 else float)
        self.array, self.dtype, self.ndim = array, array.dtype, array.ndim
        self.leaves = _array_packer(kind, "KeptArray")(array)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the array only, as a copy has another address."""
        return KeptArray, (self.array,)


class BoundFunction:
    """Compiled function with its first arguments bound; callable with the others.

    Several threads may call it at once if the function itself allows it. The interpreter's lock is
    released during a call, so other Python threads continue.
    """

    def __init__(self, entry: "_Entry", first: Any) -> None:
        self._entry, self._pack, self._run = entry, entry.others.pack, entry.run
        self._given, self._leaves = (), ()
        self._row, self._count = entry.row(0), entry.count
        self.rebind(first)

    def bind(self, *arguments: Any) -> "BoundFunction":
        """Return a function of the remaining arguments, with the next ones unpacked once, too.

        It keeps the present first argument, whatever is passed to ``rebind`` later.

        Raises
        ------
        TypeError
            An argument is of another kind, or there are too many.
        """
        bound = copy.copy(self)
        bound._given = (*self._given, *arguments)
        bound._leaves = self._entry.leaves(bound._given)
        bound._row = self._entry.row(len(bound._given))
        bound._count = self._count - len(arguments)
        return bound

    def rebind(self, first: Any) -> None:
        """Replace the first argument from the next call on."""
        # One assignment, which is atomic: another thread may be about to call.
        block = self._entry.packed(first)
        self._first = ctypes.addressof(block), block, first

    def __call__(self, *others: Any) -> Any:
        """Call the function with the remaining arguments, and return its result."""
        first = self._first
        if len(others) != self._count:
            raise self._entry.other_number(len(self._given) + len(others))
        row = self._row(*others)
        try:
            packed = self._pack(*self._leaves, *row)
        except struct.error:
            raise self._entry.wrong((*self._given, *others)) from None
        return self._run(first[0], packed)


class _Entry:
    """Machine code of a function, and the packing of its arguments."""

    def __init__(self, function: FunctionType, flags: Mapping[str, bool], library: Library) -> None:
        address, (_, arguments, kinds, of_result) = library.made(function, flags)
        if of_result and "ptr" in leaves(of_result):
            source = FunctionSource(function)
            what, instead = "an array as a result", "write into one that is an argument"
            raise source.error(source.tree, what, instead)
        self._library = library
        self._name, self._rows = function.__qualname__, dict[int, _Row]()
        named = zip(arguments, kinds, strict=True)
        puts = [(name, kind, _packer(kind, f"{self._name}: {name}")) for name, kind in named]
        (_, _, self._first), *self._others = puts
        self.count = len(self._others)
        """Number of arguments after the first one."""
        first, *others = map(leaves, kinds)
        self._of_first, self.others = _struct(first), _struct(sum(others, ()))
        returned = _RETURNED[of_result] if isinstance(of_result, Scalar) else None
        call = ctypes.CFUNCTYPE(returned, ctypes.c_void_p, ctypes.c_char_p)(address)
        self.run: Callable[[int, bytes], Any] = call
        """Callable of the address of the first argument's block and the other arguments' block."""
        if isinstance(of_result, RecordKind):
            self.run = functools.partial(_record_from, call, of_result, _struct(leaves(of_result)))

    def row(self, unpacked: int) -> _Row:
        """Return a function from arguments to their leaves.

        Its arguments are those after the first one and the ``unpacked`` ones that follow it.
        """
        if unpacked not in self._rows:
            self._rows[unpacked] = _row_of(self._others[unpacked:])
        return self._rows[unpacked]

    def leaves(self, arguments: Sequence[Any]) -> tuple[Any, ...]:
        """Return the leaves of arguments after the first one; the last may be omitted."""
        if len(arguments) > len(self._others):
            raise self.other_number(len(arguments))
        pairs = zip(arguments, self._others, strict=False)
        return tuple(x for argument, (*_, put) in pairs for x in put(argument))

    def other_number(self, others: int) -> TypeError:
        """Return the error for another number of arguments, after the first one."""
        most = 1 + len(self._others)
        return TypeError(f"{self._name}: takes {most} arguments, {1 + others} are given")

    def packed(self, value: Any) -> ctypes.Array[Any]:
        """Return the block of a first argument."""
        flat = self._first(value)
        block = (ctypes.c_int64 * max(len(flat), 1))()
        self._of_first.pack_into(block, 0, *flat)
        return block

    def wrong(self, others: tuple[Any, ...]) -> TypeError:
        """Return the error for the first of the other arguments that cannot be packed."""
        for (*_, put), value in zip(self._others, others, strict=True):
            try:
                put(value)
            except TypeError as error:
                return error
        raise AssertionError


def _row_of(others: Sequence[tuple[str, Kind, _Put]]) -> _Row:
    """Return a function from arguments to their leaves; numbers are their own leaves."""
    puts = [None if isinstance(kind, Scalar) else put for _, kind, put in others]
    *first, last = puts or [None]

    def numbers(*values: Any) -> tuple[Any, ...]:
        return values

    # Most drivers take numbers and then one array. Without a loop, a call of `Drive.advance(1)`
    # is 20 % shorter.
    def numbers_and_last(*values: Any) -> tuple[Any, ...]:
        assert last is not None
        return *values[:-1], *last(values[-1])

    def mixed(*values: Any) -> tuple[Any, ...]:
        pairs = zip(values, puts, strict=True)
        return tuple(x for value, put in pairs for x in (put(value) if put else (value,)))

    if last is None and not any(first):
        return numbers
    return mixed if last is None or any(first) else numbers_and_last


def _struct(kinds: Sequence[str]) -> struct.Struct:
    """Return the packing of leaves with these LLVM types, eight bytes each."""
    return struct.Struct("=" + "".join(_FORMATS[kind] for kind in kinds))


def _record_from(
    call: Callable[..., None], kind: RecordKind, of_leaves: struct.Struct, first: int, others: bytes
) -> Any:
    """Call a function and return its record, which it writes after the arguments in the block."""
    block = ctypes.create_string_buffer(others + bytes(of_leaves.size))
    call(first, block)
    return _made(kind, iter(of_leaves.unpack_from(block, len(others))))


def _made(kind: Kind, flat: Iterator[Any]) -> Any:
    """Return a result of a kind, assembled from its leaves."""
    if isinstance(kind, Scalar):
        return next(flat)
    assert isinstance(kind, RecordKind)
    values = [_made(field, flat) for field in kind.kinds]
    return kind.cls(*values) if kind.cls else tuple(values)


def _packer(kind: Kind, path: str) -> _Put:
    """Return a function from an argument to its leaves; it raises TypeError for another kind."""
    if isinstance(kind, Array):
        return _array_packer(kind, path)
    if isinstance(kind, RecordKind):
        return _record_packer(kind, path)
    types: dict[Scalar, Any] = {
        FLOAT: (float, int, np.floating, np.integer),
        INT: (int, np.integer),
        BOOL: (bool, np.bool_),
    }

    most = sys.float_info.max
    low, high = (-most, most) if kind == FLOAT else (-(2**63), 2**63 - 1)

    def put_number(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, types[kind]):
            raise TypeError(f"{path} must be {kind}, not {short(value)}")
        if isinstance(value, int | np.integer) and not low <= value <= high:
            raise TypeError(f"{path} must be {kind}, {low:g} to {high:g}, not {short(value)}")
        return (value,)

    return put_number


def _record_packer(kind: RecordKind, path: str) -> _Put:
    """Return ``_packer`` for a record or a tuple."""
    cls: Any = kind.cls or tuple
    named = zip(kind.names, kind.kinds, strict=True)
    fields = [_packer(field, f"{path}.{name}") for name, field in named]

    def put_record(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, cls) or len(value) != len(fields):
            raise TypeError(f"{path} must be a {text_of(kind)}, not {value!r}")
        return tuple(x for put, field in zip(fields, value, strict=True) for x in put(field))

    return put_record


def _array_packer(kind: Array, path: str) -> _Put:
    """Return ``_packer`` for an array: its leaves are its address and its lengths."""
    dtype = np.dtype(np.float64 if kind.element is float else np.int64)
    rank, nothing, address = kind.rank, (ctypes.c_char * 0).from_buffer, ctypes.addressof

    def put_array(value: Any) -> tuple[Any, ...]:
        try:
            if value.dtype == dtype and value.ndim == rank:
                if type(value) is KeptArray:
                    return value.leaves
                # from_buffer fails unless the array is contiguous and writeable. numpy's own
                # way to the address takes 0.8 us.
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
