"""Libraries of expressions: the formula by each of them as code that a compiled loop calls."""

import ctypes
import os
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np

from ab_sim.compiling import Floats, Integers, call, compiled
from beside.formula import TIME, Case, Made, slope


def loop_three(f: int, out: Floats, given: Floats, user: int, n: int) -> None:
    """SymEngine: f(out, in, user data)."""
    for _ in range(n):
        call(f, out, given, user)
        given[4] = 1.0 + 1e-9 * out[2]


def loop_casadi(
    f: int, arg: Integers, res: Integers, iw: Integers, w: Floats, y: Floats, k: Floats, n: int
) -> None:
    """CasADi's C: f(arg, res, iw, w, memory)."""
    for _ in range(n):
        call(f, arg, res, iw, w, 0)
        y[4] = 1.0 + 1e-9 * k[2]


def loop_heyoka(f: int, k: Floats, y: Floats, p: Floats, t: Floats, n: int) -> None:
    """heyoka: f(out, in, parameters, time)."""
    for _ in range(n):
        call(f, k, y, p, t)
        y[4] = 1.0 + 1e-9 * k[2]


def loop_heyoka_lanes(f: int, k: Floats, y: Floats, p: Floats, t: Floats) -> None:
    """heyoka, eight at once: f(out, in, parameters, time, stride)."""
    for _ in range(20000):
        call(f, k, y, p, t, 8)
        for j in range(8):
            y[32 + j] = 1.0 + 1e-9 * k[16 + j]


def symengine_made(case: Case, jacobian: bool = False) -> Made:
    """Its LLVM visitor."""
    import symengine as se

    def columns(name: str) -> np.ndarray:
        return np.array([se.Symbol(f"{name}{i}") for i in range(case.n)])

    cos, sin = np.vectorize(se.cos), np.vectorize(se.sin)
    y, p, t = case.symbols(se.Symbol, columns)
    found = slope(y, p, t, case.n, cos, sin, np.sum)
    states, roots = list(np.hstack(y)), list(np.hstack(found))
    if jacobian:
        roots = [se.diff(root, x) for root in roots for x in states]
    inputs = [*states, t, *np.hstack(p)]
    f = se.Lambdify(inputs, roots, backend="llvm", cse=True)
    function, user = f.as_ctypes()
    address = ctypes.cast(function, ctypes.c_void_p).value
    given, out = np.concatenate([case.states[0], [TIME], case.p]), np.empty(len(roots))

    def outputs(state: np.ndarray) -> np.ndarray:
        at = np.concatenate([state, [TIME], case.p])
        compiled(loop_three)(address, out, at, user.value, 1)
        return out.reshape(case.size, -1).squeeze().copy()

    run = compiled(loop_three)
    return Made(lambda n: run(address, out, given, user.value, n), outputs, (f, function))


def casadi_function(case: Case, kind: Any, jacobian: bool) -> Any:
    """Of SX, where a column is so many numbers, or MX, where it is one node."""
    import casadi as ca

    y, p, t = case.symbols(kind.sym, lambda name: kind.sym(name, case.n))
    found = ca.vertcat(*slope(y, p, t, case.n, ca.cos, ca.sin, ca.sum1))
    if kind is ca.MX:
        state = ca.MX.sym("y", case.size)
        parts = ca.vertsplit(state, [0, 1, 2, 3, 4, 4 + case.n, case.size])
        numbers = ca.MX.sym("p", len(case.p))
        cuts = [*range(9), *(8 + case.n * k for k in range(1, 5))]
        values = ca.vertsplit(numbers, cuts)
        found = slope(parts, values, t, case.n, ca.cos, ca.sin, ca.sum1)
        found = ca.vertcat(*found)
    else:
        state, numbers = ca.vertcat(*y), ca.vertcat(*p)
    if jacobian:
        found = ca.densify(ca.jacobian(found, state))
    return ca.Function("f", [state, t, numbers], [found])


def casadi_c(case: Case, kind: str, flags: Sequence[str], jacobian: bool = False) -> Made:
    """Its C, by gcc."""
    import casadi as ca

    f = casadi_function(case, getattr(ca, kind), jacobian)
    with tempfile.TemporaryDirectory() as folder:
        here = os.getcwd()
        os.chdir(folder)
        try:
            f.generate("f.c")
            command = ["gcc", "-O3", *flags, "-shared", "-fPIC", "f.c", "-o", "f.so", "-lm"]
            subprocess.run(command, check=True)
            library = ctypes.CDLL(os.path.join(folder, "f.so"))
        finally:
            os.chdir(here)
    address = ctypes.cast(library.f, ctypes.c_void_p).value
    y, t, k = case.states[0].copy(), np.full(1, TIME), np.empty(case.size * (case.size**jacobian))
    w, iw = np.zeros(max(f.sz_w(), 1)), np.zeros(max(f.sz_iw(), 1), np.int64)

    def pointers(*arrays: np.ndarray) -> np.ndarray:
        return np.array([x.ctypes.data for x in arrays] + [0] * f.sz_arg(), np.int64)

    arg, res = pointers(y, t, case.p), pointers(k)

    def outputs(state: np.ndarray) -> np.ndarray:
        at = state.copy()
        compiled(loop_casadi)(address, pointers(at, t, case.p), res, iw, w, at, k, 1)
        return k.reshape(-1, case.size).T.squeeze().copy() if jacobian else k.copy()

    run = compiled(loop_casadi)
    return Made(lambda n: run(address, arg, res, iw, w, y, k, n), outputs, library)


def casadi_vm(case: Case, jacobian: bool = False) -> Made:
    """Its virtual machine; a thousand states in one call, for a call from Python takes longer."""
    import casadi as ca

    f = casadi_function(case, ca.SX, jacobian)
    many = f.map(1000)
    buffer, evaluate = many.buffer()
    states = np.asfortranarray(np.repeat(case.states[:1].T, 1000, axis=1))
    times, numbers = np.full(1000, TIME), np.asfortranarray(np.repeat(case.p[:, None], 1000, 1))
    out = np.empty(many.numel_out(0))
    for k, array in enumerate((states, times, numbers)):
        buffer.set_arg(k, memoryview(array.ravel(order="F")))
    buffer.set_res(0, memoryview(out))

    def run(n: int) -> None:
        for _ in range(n // 1000):
            evaluate()

    def outputs(state: np.ndarray) -> np.ndarray:
        return np.array(f(state, TIME, case.p)).squeeze()

    return Made(run, outputs, (f, many, buffer, states, times, numbers, out))


def heyoka_made(case: Case, jacobian: bool = False, lanes: bool = False) -> Made:
    """Its cfunc, whose object code is loaded so as to have its address."""
    import heyoka as hy

    hy.llvm_state.clear_memcache()
    hy.llvm_state.set_diskcache_enabled(False)

    def columns(name: str) -> np.ndarray:
        return np.array([hy.expression(f"{name}{i}") for i in range(case.n)])

    cos, sin = np.vectorize(hy.cos), np.vectorize(hy.sin)
    y, _, _ = case.symbols(hy.expression, columns)
    p: list[Any] = [hy.par[k] for k in range(8)]
    n = case.n
    p += [np.array([hy.par[8 + j * n + i] for i in range(n)]) for j in range(4)]
    total = lambda each: hy.sum(list(each))  # noqa: E731
    found = list(np.hstack(slope(y, p, hy.time, n, cos, sin, total)))
    states = list(np.hstack(y))
    if jacobian:
        tensors = hy.diff_tensors(found, states, diff_order=1)
        found = [entry for row in tensors.jacobian for entry in row]
    f = hy.cfunc(found, vars=states)
    engine = _loaded(hy, f.llvm_states[2 if lanes else 0].object_code)
    address = engine.get_function_address("cfunc")
    wide = 8 if lanes else 1
    y0, p0, t0 = (np.repeat(x, wide) for x in (case.states[0], case.p, np.full(1, TIME)))
    k = np.empty(len(found) * wide)

    def outputs(state: np.ndarray) -> np.ndarray:
        at = np.repeat(state, wide)
        kinds = [ctypes.c_void_p] * 4 + [ctypes.c_int64] * lanes
        given = [*(x.ctypes.data for x in (k, at, p0, t0)), *([8] * lanes)]
        ctypes.CFUNCTYPE(None, *kinds)(address)(*given)
        return k.reshape(-1, wide)[:, -1].reshape(case.size, -1).squeeze().copy()

    def run(n: int) -> None:
        if lanes:
            compiled(loop_heyoka_lanes)(address, k, y0, p0, t0)
        else:
            compiled(loop_heyoka)(address, k, y0, p0, t0, n)

    return Made(run, outputs, (f, engine))


def _loaded(hy: Any, code: bytes) -> Any:
    """heyoka's object code in memory; it calls C's sincos and what comes with the wheel."""
    for name in ("libsleef", "libheyoka"):
        (library,) = Path(hy.__file__).parents[1].glob(f"heyoka.libs/{name}-*")
        ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)
    sincos = ctypes.cast(ctypes.CDLL("libm.so.6").sincos, ctypes.c_void_p).value
    llvm.add_symbol("sincos", sincos)
    machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
    empty = llvm.parse_assembly("")
    empty.triple, empty.data_layout = machine.triple, str(machine.target_data)
    engine = llvm.create_mcjit_compiler(empty, machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine
