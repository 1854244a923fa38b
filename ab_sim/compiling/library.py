"""Functions of the subset together, in LLVM's language, and those that are machine code already.

What a function's code depends on, beside its source, is the value of known fields: of those that it
reads, or that a function reads which it calls. Where these agree, a function is made once: modules
that are made later call it where it is.
"""

import itertools
import threading
from collections.abc import Mapping
from types import FunctionType
from typing import NamedTuple

from ab_sim.compiling.blocks import METADATA, BlockWriter
from ab_sim.compiling.expressions import result_type
from ab_sim.compiling.source import FunctionSource, Scalar, Signature, leaves
from ab_sim.compiling.translate import FunctionTranslator, Translated
from ab_sim.tracing.machine_code import CONTROL, MachineCode


class Kept(NamedTuple):
    """A function that has been made."""

    translated: Translated
    known: dict[str, bool | None]
    """Fields that its code depends on, and what was known of them: None where nothing was."""


class Library:
    """Functions that have been made, and stay as long as this object does.

    Args:
        features: of the processor, as of ``MachineCode``.
    """

    def __init__(self, features: str | None = None) -> None:
        self._features = features
        self._kept: dict[FunctionType, list[Kept]] = {}
        self._codes: list[MachineCode] = []
        self._addresses: dict[str, int] = {}
        self._lock = threading.Lock()

    def found(self, function: FunctionType, known: Mapping[str, bool]) -> Kept | None:
        """A function that has been made with what is known now."""
        for each in self._kept.get(function, ()):
            if all(known.get(name) == value for name, value in each.known.items()):
                return each
        return None

    @property
    def size(self) -> int:
        """How many functions have been made."""
        return sum(map(len, self._kept.values()))

    def made(self, function: FunctionType, known: Mapping[str, bool]) -> tuple[int, Signature]:
        """Address of a function's entry, see ``Module``, and its signature."""
        with self._lock:
            module = Module(function, known, self)
            code = MachineCode(
                module.text(), self._features, optimization=CONTROL, elsewhere=self._addresses
            )
            self._codes.append(code)
            for each, own in module.new.items():
                fields = {name: known.get(name) for name in module.reads(each)}
                if not own.is_short:
                    symbol, own = own.signature.symbol, own._replace(body="")
                    self._addresses[symbol] = code.address(symbol)
                self._kept.setdefault(each, []).append(Kept(own, fields))
            return code.address("entry"), module.signature(function)


class Module:
    """A function of the subset with what it calls and no module has yet.

    Args:
        function: what is called from outside, as ``entry(first, others)``: pointers to its first
            argument's leaves and to those of the others, eight bytes for each. It returns the
            result if that is a number; a record's leaves it puts behind the others.
        known: fields of records that have one value, by name: what is then not reached is not
            there, nor what only that calls.
        library: where functions are that have been made.
    """

    def __init__(
        self, function: FunctionType, known: Mapping[str, bool], library: Library | None = None
    ) -> None:
        self.known, self._library = known, library or Library()
        self.new: dict[FunctionType, Translated] = {}
        """Functions that are to be made."""
        self._kept: dict[FunctionType, Kept] = {}
        self._signatures: dict[FunctionType, Signature] = {}
        self._numbers = itertools.count(self._library.size)
        self._ahead: list[tuple[FunctionType, FunctionSource]] = []
        self._root = self.signature(function)
        while self._ahead:
            each, source = self._ahead.pop()
            translator = FunctionTranslator(source, self)
            self.new[each] = translator.translated(self._signatures[each])

    def signature(self, function: FunctionType) -> Signature:
        """Of a function, which is translated, too, unless it has been made."""
        if function not in self._signatures:
            kept = self._library.found(function, self.known)
            if kept is None:
                source = FunctionSource(function)
                symbol = f"{function.__module__}.{function.__qualname__}.{next(self._numbers)}"
                own = Signature(symbol, source.arguments, source.kinds, source.result)
                self._ahead.append((function, source))
            else:
                own, self._kept[function] = kept.translated.signature, kept
            self._signatures[function] = own
            if kept and kept.translated.is_short:
                for each in kept.translated.calls:
                    self.signature(each)
        return self._signatures[function]

    def reads(self, function: FunctionType) -> set[str]:
        """Fields of records that a new function reads, or what it calls."""
        found: set[str] = set()
        ahead, seen = [function], {function}
        while ahead:
            each = ahead.pop()
            if each in self._kept:
                found |= self._kept[each].known.keys()
            else:
                found |= self.new[each].reads
                ahead += self.new[each].calls - seen
                seen |= self.new[each].calls
        return found

    def text(self) -> str:
        """All of it in LLVM's language."""
        kept = [each.translated for each in self._kept.values()]
        here = [*self.new.values(), *(own for own in kept if own.is_short)]
        declared = {line for own in here for line in own.declared}
        declared |= {f"declare {own.head}" for own in kept if not own.is_short}
        parts = [own.definition() for own in here]
        return "\n".join([*sorted(declared), *parts, self._entry(), METADATA])

    def _entry(self) -> str:
        body, at, arguments = BlockWriter(), 0, []
        symbol, _, kinds, result = self._root
        for k, kind in enumerate(kinds):
            pointer, first = ("%others", at) if k else ("%first", 0)
            arguments += body.passed(body.load(kind, pointer, first))
            at += len(leaves(kind)) if k else 0
        given = ", ".join(" ".join(argument) for argument in arguments)
        to = "" if result is None else "%result = "
        body.lines.append(f'{to}call {result_type(result)} @"{symbol}"({given})')
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
        # A bool is the lowest bit of a byte; C takes the others to be 0.
        head = f"define {'zeroext ' * (returned == 'i1')}{returned} @entry(ptr %first, ptr %others)"
        lines = "\n".join([*body.entry, *body.lines])
        return f"{head} nounwind {{\n{lines}\n}}\n"
