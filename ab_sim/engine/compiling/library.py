"""Combine functions of the subset into LLVM modules, and keep those that are compiled already.

A function's code depends on its source and on the known values of the fields that it reads, or
that functions called by it read. If these values agree, a function is compiled only once, and later
modules call the existing machine code.
"""

import itertools
import threading
from collections.abc import Mapping
from types import FunctionType
from typing import NamedTuple

from ab_sim.engine.compiling.blocks import METADATA, BlockWriter
from ab_sim.engine.compiling.expressions import result_type
from ab_sim.engine.compiling.source import FunctionSource, Scalar, Signature, leaves
from ab_sim.engine.compiling.translate import FunctionTranslator, Translated
from ab_sim.tracing.machine_code import CONTROL, MachineCode


class Kept(NamedTuple):
    """Compiled function, and the values of flags for which the machine code is valid."""

    translated: Translated
    flags: dict[str, bool | None]
    """Values of the flags on which the code depends; None for a flag without a known value."""


class Library:
    """Store of compiled functions, which live as long as this object.

    Parameters
    ----------
    features
        Processor features, as for ``MachineCode``.
    """

    def __init__(self, features: str | None = None) -> None:
        self._features = features
        self._kept: dict[FunctionType, list[Kept]] = {}
        self._codes: list[MachineCode] = []
        self._addresses: dict[str, int] = {}
        self._lock = threading.Lock()

    def find(self, function: FunctionType, flags: Mapping[str, bool]) -> Kept | None:
        """Return the machine code of a function for values of flags; None if not yet compiled."""
        for compiled in self._kept.get(function, ()):
            if all(flags.get(name) == value for name, value in compiled.flags.items()):
                return compiled
        return None

    @property
    def size(self) -> int:
        """Number of compiled functions."""
        return sum(map(len, self._kept.values()))

    def made(self, function: FunctionType, flags: Mapping[str, bool]) -> tuple[int, Signature]:
        """Compile a function for these flags.

        Returns
        -------
        tuple[int, Signature]
            Address of its entry, see ``Module``, and its signature.
        """
        with self._lock:
            module = Module(function, flags, self)
            code = MachineCode(
                module.text(), self._features, optimization=CONTROL, elsewhere=self._addresses
            )
            self._codes.append(code)
            for function_, translated in module.new.items():
                fields = {name: flags.get(name) for name in module.reads(function_)}
                # Later modules call long functions by their addresses. Short ones are inlined, so
                # their text is kept.
                if not translated.is_short:
                    symbol, translated = translated.signature.symbol, translated._replace(body="")
                    self._addresses[symbol] = code.address(symbol)
                self._kept.setdefault(function_, []).append(Kept(translated, fields))
            return code.address("entry"), module.signature(function)


class Module:
    """LLVM module with a function of the subset and all its callees that are not compiled yet.

    Parameters
    ----------
    function
        Function that is called from outside as ``entry(first, others)``, with pointers to the
        leaves of its first argument and to those of the others, eight bytes each. The entry returns
        a number; the leaves of a record are written after the others.
    flags
        Values of records' bool fields that are known at compile time, by name. Branches that are
        unreachable with these values are left out, and functions that only they call.
    library
        Store of compiled functions.
    """

    def __init__(
        self, function: FunctionType, flags: Mapping[str, bool], library: Library | None = None
    ) -> None:
        self.flags, self._library = flags, library or Library()
        self.new: dict[FunctionType, Translated] = {}
        """Functions to be compiled with this module."""
        self._kept: dict[FunctionType, Kept] = {}
        self._signatures: dict[FunctionType, Signature] = {}
        self._numbers = itertools.count(self._library.size)
        self._ahead: list[tuple[FunctionType, FunctionSource]] = []
        self._root = self.signature(function)
        while self._ahead:
            function_, source = self._ahead.pop()
            translator = FunctionTranslator(source, self)
            self.new[function_] = translator.translated(self._signatures[function_])

    def signature(self, function: FunctionType) -> Signature:
        """Return the signature of a function, and queue it for translation unless compiled."""
        if function not in self._signatures:
            kept = self._library.find(function, self.flags)
            if kept is None:
                source = FunctionSource(function)
                symbol = f"{function.__module__}.{function.__qualname__}.{next(self._numbers)}"
                signature = Signature(symbol, source.arguments, source.kinds, source.result)
                self._ahead.append((function, source))
            else:
                signature, self._kept[function] = kept.translated.signature, kept
            self._signatures[function] = signature
            if kept and kept.translated.is_short:
                for call in kept.translated.calls:
                    self.signature(call)
        return self._signatures[function]

    def reads(self, function: FunctionType) -> set[str]:
        """Return the fields of records that a new function or any of its callees reads."""
        fields: set[str] = set()
        ahead, seen = [function], {function}
        while ahead:
            function_ = ahead.pop()
            if function_ in self._kept:
                fields |= self._kept[function_].flags.keys()
            else:
                fields |= self.new[function_].reads
                ahead += self.new[function_].calls - seen
                seen |= self.new[function_].calls
        return fields

    def text(self) -> str:
        """Return the module in LLVM IR."""
        kept = [compiled.translated for compiled in self._kept.values()]
        here = [*self.new.values(), *(translated for translated in kept if translated.is_short)]
        declared = {line for translated in here for line in translated.declared}
        declared |= {f"declare {translated.head}" for translated in kept if not translated.is_short}
        parts = [translated.definition() for translated in here]
        return "\n".join([*sorted(declared), *parts, self._entry(), METADATA])

    def _entry(self) -> str:
        """Return the function ``entry``, which unpacks its arguments and calls the root."""
        body, at, arguments = BlockWriter(), 0, []
        symbol, _, kinds, result = self._root
        for k, kind in enumerate(kinds):
            pointer, first = ("%others", at) if k else ("%first", 0)
            arguments += body.passed(body.load(kind, pointer, first))
            at += len(leaves(kind)) if k else 0
        argument_text = ", ".join(" ".join(argument) for argument in arguments)
        to = "" if result is None else "%result = "
        body.lines.append(f'{to}call {result_type(result)} @"{symbol}"({argument_text})')
        returned = "void"
        if isinstance(result, Scalar):
            returned = result.llvm
            body.lines.append(f"ret {returned} %result")
        else:
            if result is not None:
                of, count = result_type(result), len(leaves(result))
                parts = [body.put(f"extractvalue {of} %result, {k}") for k in range(count)]
                body.store(body.made(result, iter(parts)), body.step("%others", at))
            body.lines.append("ret void")
        # C requires the upper bits of a returned bool to be 0, hence zeroext.
        head = f"define {'zeroext ' * (returned == 'i1')}{returned} @entry(ptr %first, ptr %others)"
        lines = "\n".join([*body.entry, *body.lines])
        return f"{head} nounwind {{\n{lines}\n}}\n"
