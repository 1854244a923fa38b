"""Translate expressions that branch: comparisons, `and`, `or`, and conditional expressions."""

import ast
import functools
from collections.abc import Callable, Sequence

from ab_sim.engine.compiling.blocks import Number, Value
from ab_sim.engine.compiling.expressions import Expressions
from ab_sim.engine.compiling.operations import COMPARED
from ab_sim.engine.compiling.source import BOOL, leaves


class Conditions(Expressions):
    """Translator of a function's expressions, including those that branch."""

    def _Compare(self, node: ast.Compare) -> Value:
        for op in node.ops:
            if type(op) not in COMPARED:
                self.fail(node, f"'{ast.unparse(node)}'", "write ==, as in a == b or a == c")
        last = [self.number(node.left)]

        def step(op: ast.cmpop, right: ast.AST) -> Number:
            a, b = last[0], self.number(right)
            last[0] = b
            return self.compared(op, a, b)

        pairs = list(zip(node.ops, node.comparators, strict=True))
        return self._one_by_one([functools.partial(step, *pair) for pair in pairs], True)

    def _BoolOp(self, node: ast.BoolOp) -> Value:
        def step(part: ast.AST) -> Number:
            x = self.number(part)
            if x.kind != BOOL:
                self.fail(part, f"{x.kind} in 'and' or 'or'", "write a comparison, as x != 0")
            return x

        steps = [functools.partial(step, part) for part in node.values]
        return self._one_by_one(steps, isinstance(node.op, ast.And))

    def _one_by_one(self, steps: Sequence[Callable[[], Number]], every: bool) -> Number:
        """Return whether every step, or any, is true, with short-circuit evaluation.

        Each step is a block that jumps to the end if it decides the result; a phi node merges the
        results there. A step that is known at compile time emits no code: it either decides the
        result or changes nothing.
        """
        if len(steps) == 1:
            return steps[0]()
        done, ends = self.new("done"), list[str]()
        for step in steps[:-1]:
            truth = step()
            if truth.constant is (not every):
                break
            if truth.constant is None:
                following = self.new("next")
                ends.append(f"[ {'false' if every else 'true'}, %{self.block} ]")
                self.fork(truth.code, *((following, done) if every else (done, following)))
                self.start(following)
        else:
            truth = steps[-1]()
        if not ends:
            return truth
        ends.append(f"[ {truth.code}, %{self.block} ]")
        self.go(done)
        self.start(done)
        return Number(BOOL, self.put(f"phi i1 {', '.join(ends)}"))

    def _IfExp(self, node: ast.IfExp) -> Value:
        test = self.condition(node.test)
        if test.constant is not None:
            return self.value(node.body if test.constant else node.orelse)
        yes, no, done = self.new("yes"), self.new("no"), self.new("done")
        self.fork(test.code, yes, no)
        self.start(yes)
        a = self.value(node.body)
        of_a, end_of_yes = self.flat(a), self.block
        self.go(done)
        self.start(no)
        b = self.fitted(node.orelse, self.value(node.orelse), a.kind, "the other branch")
        of_b, end_of_no = self.flat(b), self.block
        self.go(done)
        self.start(done)
        merged = [
            self.put(f"phi {leaf} [ {x}, %{end_of_yes} ], [ {y}, %{end_of_no} ]")
            for leaf, x, y in zip(leaves(a.kind), of_a, of_b, strict=True)
        ]
        return self.made(a.kind, iter(merged))
