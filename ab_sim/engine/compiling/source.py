"""Source of functions of the subset: syntax tree, annotations, names and errors."""

import ast
import builtins
import contextlib
import functools
import linecache
import typing
from collections.abc import Sequence
from types import FunctionType
from typing import Any, NamedTuple

from ab_sim.engine.compiling.kinds import Array


class Untranslatable(Exception):
    """Error of code outside the subset; names file, line, function and a replacement."""


class Scalar(NamedTuple):
    """Kind of number: its name in Python and in LLVM."""

    name: str
    llvm: str

    def __str__(self) -> str:
        return self.name


class RecordKind(NamedTuple):
    """Names and kinds of the fields of a NamedTuple class, or of a tuple if there is no class."""

    cls: type | None
    names: tuple[str, ...]
    kinds: tuple["Kind", ...]

    def __str__(self) -> str:
        kinds = ", ".join(text_of(kind) for kind in self.kinds)
        return self.cls.__name__ if self.cls else f"tuple[{kinds}]"


Kind = Scalar | Array | RecordKind
FLOAT, INT, BOOL = Scalar("float", "double"), Scalar("int", "i64"), Scalar("bool", "i1")
_SCALARS: dict[Any, Scalar] = {float: FLOAT, int: INT, bool: BOOL}


def text_of(kind: Kind) -> str:
    """Return a kind's name for error messages."""
    if isinstance(kind, Array):
        return f"{kind.rank}-D array of {kind.element.__name__}s"
    return str(kind)


def element_of(kind: Array) -> Scalar:
    """Return the kind of an array's numbers."""
    return _SCALARS[kind.element]


@functools.lru_cache(maxsize=1024)
def leaves(kind: Kind) -> tuple[str, ...]:
    """Return LLVM's types of the leaves, the scalar parts of a value of a kind.

    In memory each leaf takes eight bytes. An array is a pointer and a length per axis.
    """
    if isinstance(kind, Scalar):
        return (kind.llvm,)
    if isinstance(kind, Array):
        return ("ptr", *["i64"] * kind.rank)
    return tuple(leaf for field in kind.kinds for leaf in leaves(field))


def tuple_of(kinds: typing.Iterable[Kind]) -> RecordKind:
    """Return the kind of a tuple with elements of these kinds."""
    kinds = tuple(kinds)
    return RecordKind(None, tuple(map(str, range(len(kinds)))), kinds)


def kind_of(annotation: Any) -> Kind | None:
    """Return the kind of an annotation, or None if it is not in the subset."""
    if annotation in _SCALARS:
        return _SCALARS[annotation]
    for mark in getattr(annotation, "__metadata__", ()):
        if isinstance(mark, Array):
            return mark
    if is_record(annotation):
        return _record_of(annotation)
    if typing.get_origin(annotation) is tuple:
        kinds = [kind_of(x) for x in typing.get_args(annotation)]
        return tuple_of(k for k in kinds if k) if all(kinds) else None
    return None


def is_record(x: Any) -> bool:
    """Return whether an object is a NamedTuple class."""
    return isinstance(x, type) and issubclass(x, tuple) and hasattr(x, "_fields")


@functools.cache
def _record_of(cls: Any) -> RecordKind | None:
    hints = typing.get_type_hints(cls, include_extras=True)
    kinds = [kind_of(hints[name]) for name in cls._fields]
    return RecordKind(cls, cls._fields, tuple(k for k in kinds if k)) if all(kinds) else None


@functools.cache
def for_class(function: FunctionType, cls: type) -> FunctionType:
    """Return a function for first arguments of class ``cls``, always the same object.

    It is a copy if the annotation leaves the class open: ``self`` of a method, or a Protocol.
    """
    name = next(iter(function.__code__.co_varnames), "")
    if name != "self" and not getattr(function.__annotations__.get(name), "_is_protocol", False):
        return function
    copy = FunctionType(function.__code__, function.__globals__, closure=function.__closure__)
    copy.__annotations__ = {**function.__annotations__, name: cls}
    copy.__qualname__ = function.__qualname__
    return copy


class Signature(NamedTuple):
    """Name, arguments and result of a function, as its callers need them."""

    symbol: str
    """Name in LLVM IR, without @."""
    arguments: list[str]
    kinds: list[Kind]
    """Kinds of the arguments."""
    result: Kind | None


class FunctionSource:
    """Source of a function.

    Parameters
    ----------
    function
        Function of the subset.

    Raises
    ------
    Untranslatable
        The source is not found, or annotations are not in the subset.
    """

    def __init__(self, function: FunctionType) -> None:
        code = function.__code__
        self.function, self.file, self.name = function, code.co_filename, function.__qualname__
        tree = _definition(linecache.getlines(self.file)[code.co_firstlineno - 1 :])
        if not isinstance(tree, ast.FunctionDef) or tree.name != code.co_name:
            where = f"{self.file}:{code.co_firstlineno}: {self.name}"
            raise Untranslatable(f"{where}: no source found; write it with def, in a file")
        self.tree = tree
        first = min([tree.lineno, *(decorator.lineno for decorator in tree.decorator_list)])
        self._above = code.co_firstlineno - first
        """Number of lines in the file above the parsed ones."""
        spec = tree.args
        if spec.vararg or spec.kwarg or spec.defaults or any(spec.kw_defaults):
            raise self.error(tree, "*args, **kwargs or a default", "pass every argument")
        self.arguments = [a.arg for a in (*spec.posonlyargs, *spec.args, *spec.kwonlyargs)]
        try:
            hints = typing.get_type_hints(function, include_extras=True)
        except NameError as error:
            raise self.error(tree, f"annotation: {error}", "import what it names") from None
        self.kinds = [self._kind(hints, name) for name in self.arguments]
        nothing = "return" in hints and hints["return"] is type(None)
        self.result = None if nothing else self._kind(hints, "return")
        cells = zip(code.co_freevars, function.__closure__ or (), strict=True)
        self._scopes = [
            {name: cell.cell_contents for name, cell in cells},
            function.__globals__,
            vars(builtins),
        ]

    def _kind(self, hints: dict[str, Any], name: str) -> Kind:
        kind = kind_of(hints.get(name))
        if kind is None:
            annotation = f"annotation {hints[name]!r}" if name in hints else "no annotation"
            raise self.error(
                self.tree,
                f"{annotation} of {'the result' if name == 'return' else name}",
                "annotate it with float, int, bool, an array of ab_sim.engine.compiling.kinds, a "
                "NamedTuple class of such fields, or, as a result, a tuple of those or None",
            )
        return kind

    def global_value(self, name: str) -> Any:
        """Return the value of a name that is not local; raise KeyError if there is none."""
        for scope in self._scopes:
            if name in scope:
                return scope[name]
        raise KeyError(name)

    def error(self, node: ast.AST, what: str, instead: str) -> Untranslatable:
        """Return an error with a node's line, what is wrong there, and what to write instead."""
        line = getattr(node, "lineno", self.tree.lineno) + self._above
        return Untranslatable(f"{self.file}:{line}: in {self.name}: {what}; {instead}")


def _definition(lines: Sequence[str]) -> ast.stmt | None:
    """Return the statement with which lines begin, without parsing the whole file.

    The statement ends before the next line that is not indented further. If that line is inside
    brackets or a string, the lines before it cannot be parsed, and a later one is tried.
    """
    if not lines:
        return None
    margin = _margin(lines[0])
    above = "if True:\n" if margin else ""
    for end, line in enumerate([*lines[1:], "end"], 1):
        if line.strip() and _margin(line) <= margin and line.lstrip()[0] != "#":
            with contextlib.suppress(SyntaxError):
                (statement,) = ast.parse(above + "".join(lines[:end])).body
                return statement.body[0] if isinstance(statement, ast.If) else statement
    return None


def _margin(line: str) -> int:
    return len(line) - len(line.lstrip())
