"""Evaluations of expressions by all back ends, with the same arguments."""

import ctypes
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ab_sim.tracing.c_text import BALLS, REPEATED, SUMS, Store, c_statements
from ab_sim.tracing.expression import Expression
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, module_text
from ab_sim.tracing.lowering import name_of, unrolled
from ab_sim.tracing.machine_code import MachineCode
from tests.tracing.plain import python_function

Inputs = dict[str, np.ndarray]
"""Values of each input by name, shape (runs,), or (runs, balls) for an input per ball."""
NAMES = ("a", "b", "c")
EACH = ("p", "q")


def by_plain(roots: Sequence[Expression], balls: int, inputs: Inputs) -> np.ndarray:
    """Return the roots' values by the Python function, shape (runs, numbers)."""
    flat = [one for root in unrolled(roots, balls) for one in root]
    function = python_function(flat, _arguments(balls))
    runs = len(inputs["a"])
    return np.array([function(**_values(inputs, run, balls)) for run in range(runs)])


def by_c(roots: Sequence[Expression], balls: int, inputs: Inputs, folder: Path) -> np.ndarray:
    """Return the roots' values by a C compiler, shape (runs, numbers)."""
    where = {name: f"{name}[0]" for name in NAMES} | {name: f"{name}[i]" for name in EACH}
    stores, at = [], 0
    for root in roots:
        stores.append(Store(root, f"out[{at} + i]" if root.each else f"out[{at}]"))
        at += balls if root.each else 1
    pointers = ", ".join(f"const double *{name}" for name in (*NAMES, *EACH))
    body = "\n".join(c_statements(stores, where))
    text = f"#include <math.h>\nenum {{ {BALLS} = {balls} }};\n{SUMS}{REPEATED}"
    text += f"void evaluate({pointers}, double *out)\n{{\n{body}\n}}\n"
    source, library = folder / "roots.c", folder / "roots.so"
    source.write_text(text)
    options = ["-O2", "-march=native", "-ffp-contract=off", "-shared", "-fPIC", "-lm"]
    subprocess.run(["cc", str(source), "-o", str(library), *options], check=True)
    function = ctypes.CDLL(str(library)).evaluate
    found = []
    for run in range(len(inputs["a"])):
        given = [np.atleast_1d(inputs[name][run]) for name in (*NAMES, *EACH)]
        out = np.empty(at)
        function(*map(_pointer, (*given, out)))
        found.append(out)
    return np.array(found)


def by_machine(
    roots: Sequence[Expression],
    shape: Shape,
    inputs: Inputs,
    features: str | None = None,
) -> np.ndarray:
    """Return the roots' values by machine code; runs are in lanes as the shape states."""
    balls, lanes = shape
    into = Function("evaluate", ["x", "out"], shape)
    places = {name: MemorySlot("x", k) for k, name in enumerate(NAMES)}
    places |= {name: MemorySlot("x", len(NAMES) + k * balls) for k, name in enumerate(EACH)}
    body, at = Body(into, places), 0
    for root in roots:
        body.store(root, MemorySlot("out", at))
        at += balls if root.each else 1
    code = MachineCode(module_text([into]), features)
    function = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(code.address("evaluate"))
    columns = [inputs[name][:, None] for name in NAMES] + [inputs[name] for name in EACH]
    given, found = np.concatenate(columns, axis=1), []
    for first in range(0, len(given), lanes):
        x = np.ascontiguousarray(given[first : first + lanes].T)
        out = np.empty((at, lanes))
        function(*map(_pointer, (x, out)))
        found.append(out.T)
    return np.concatenate(found)


def _arguments(balls: int) -> dict[str, str]:
    each = {name_of(name, k): f"{name}_{k}" for name in EACH for k in range(balls)}
    return {name: name for name in NAMES} | each


def _values(inputs: Inputs, run: int, balls: int) -> dict[str, float]:
    each = {f"{name}_{k}": float(inputs[name][run, k]) for name in EACH for k in range(balls)}
    return {name: float(inputs[name][run]) for name in NAMES} | each


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)
