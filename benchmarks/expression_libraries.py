"""Our equations beside libraries of expressions: what they take to make, and to evaluate.

    pip install casadi heyoka symengine; apt install gcc
    python benchmarks/expression_libraries.py [--repeats 7]

The right-hand side of the thesis' drive while its speed rises, written once for all of them, and
held to the package's before anything is timed. All code is called from the same kind of compiled
loop; each call begins at an angle that the last one gave, as the stages of a step do. Making counts
CPU time with that of a C compiler; everything has been made once before, so that imports and first
uses of a library do not count. Findings: docs/core.md.
"""

import argparse
import ctypes
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import llvmlite.binding as llvm  # noqa: E402

from ab_sim.compiling import Floats, Integers, call, compiled  # noqa: E402
from ab_sim.dynamics.assemble import place_on, start_modes, system_of  # noqa: E402
from ab_sim.dynamics.system import MASS, MOBILITY, MOMENT, ROUND_LEVER  # noqa: E402
from ab_sim.events.prepared import branches_of  # noqa: E402
from ab_sim.kernels.code import Code  # noqa: E402
from ab_sim.kernels.tangent import lanes_for, tangent_address  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402
from ab_sim.spindle import SpeedProfile  # noqa: E402
from ab_sim.tracing.llvm_text import module_text  # noqa: E402
from ab_sim.tracing.machine_code import MachineCode  # noqa: E402

BALLS = 2, 5, 16
CALLS, STATES_TRIED = 20_000, 1000
NARROW = "+sse4.2,+avx,+avx2,+fma"
TIME = 0.3
"""s, since the speed began to rise."""


def slope(y: Any, p: Any, now: Any, n: int, cos: Any, sin: Any, total: Any) -> list[Any]:
    """Rates of change; what each ball has is one object, whatever a library makes of that.

    Args:
        y: u1, u2, v1, v2, then the balls' angles, and their rates.
        p: M, M0 e, R, stiffness, damping, drag, speed, acceleration, then m, 1/mu, m R, lever.
        now: time.
        n: balls.
        cos, sin, total: of the library.
    """
    u1, u2, v1, v2, theta, rate = y
    mass, unbalance, radius, k, d, drag, speed, al, m, mobility, moment, lever = p
    w = speed + al * now
    c, s = cos(theta), sin(theta)
    load = moment * (w + rate) * (w + rate)
    g0 = (-(drag * (radius * rate)) - lever * al) * mobility
    g1, g2 = m * s * mobility, -(m * c * mobility)
    f1 = unbalance * (w * w) - d * v1 - k * u1 + total(load * c + moment * al * s + m * s * g0)
    f2 = total(load * s - moment * al * c - m * c * g0) - unbalance * al - d * v2 - k * u2
    d11, d22 = mass - total(m * s * g1), mass + total(m * c * g2)
    d12, d21 = -total(m * s * g2), total(m * c * g1)
    inverse = 1.0 / (d11 * d22 - d12 * d21)
    a1, a2 = (f1 * d22 - f2 * d12) * inverse, (f2 * d11 - f1 * d21) * inverse
    turning = (g0 + g1 * a1 + g2 * a2) * (1.0 / radius)
    return [v1 + w * u2, v2 - w * u1, a1 + w * v2, a2 - w * v1, rate, turning]


class Made(NamedTuple):
    """Code, and what calls it."""

    run: Callable[[int], None]
    """Evaluates so many times."""
    outputs: Callable[[np.ndarray], np.ndarray]
    """Of a state."""
    keep: Any = None
    """What has to stay alive."""


class Case:
    """A drive with so many balls, a state and the place on its profile."""

    def __init__(self, balls: int) -> None:
        changes = ["effects.rolling_friction=", f"balls.count={balls}"]
        if balls > 2:
            changes.append(f"balls.mass={2e-3 / balls}")
        angles = np.linspace(0.0, 5.0, balls).tolist()
        scene = load_scene("thesis-hold", [*changes, f"start.ball_angles={angles}"])
        self.n, self.size = balls, 4 + 2 * balls
        self.system = system_of(scene)
        self.piece = SpeedProfile.of_scene(scene).piece_at(0.0)
        own, effects, columns = self.system.carrier, scene.effects, self.system.balls.T
        suspension = effects["suspension"]
        segment = self.piece.segment
        self.scalars = [
            own.total_mass,
            own.unbalance,
            scene.race.radius,
            suspension.stiffness,
            suspension.damping,
            effects["viscous_drag"].coefficient,
            segment.speed(0.0),
            segment.acceleration(0.0),
        ]
        self.columns = [columns[k] for k in (MASS, MOBILITY, MOMENT, ROUND_LEVER)]
        self.p = np.concatenate([self.scalars, *self.columns])
        self.modes = start_modes(scene, self.system)
        random = np.random.default_rng(1)
        scale = np.array([1e-4] * 2 + [1e-2] * 2 + [3.0] * balls + [10.0] * balls)
        self.states = random.uniform(-1.0, 1.0, (STATES_TRIED, self.size)) * scale

    def symbols(self, make: Callable[[str], Any], columns: Callable[[str], Any]) -> Any:
        """y, p and time of symbols."""
        names = "M U R k d drag speed al".split()
        y = [make(x) for x in ("u1", "u2", "v1", "v2")] + [columns("theta"), columns("rate")]
        p = [make(x) for x in names] + [columns(x) for x in ("m", "mob", "mr", "lever")]
        return y, p, make("t")

    def plain(self, state: np.ndarray) -> np.ndarray:
        """The formula by NumPy."""
        n = self.n
        y = [*state[:4], state[4 : 4 + n], state[4 + n :]]
        found = slope(y, [*self.scalars, *self.columns], TIME, n, np.cos, np.sin, np.sum)
        return np.concatenate([np.ravel(x) for x in found])


# Loops in the subset, one for each way of being called.


def loop_ours(f: int, c: Floats, b: Floats, y: Floats, k: Floats, first: int, n: int) -> None:
    """slope(c, b, y, k, time)."""
    for _ in range(n):
        call(f, c, b, y, k, 0.3)
        y[first] = 1.0 + 1e-9 * k[2]


def loop_lanes(f: int, c: Floats, b: Floats, t: Floats, y: Floats, k: Floats, at: int) -> None:
    """slope(c, b, t, y, k) of eight runs."""
    for _ in range(20000):
        call(f, c, b, t, y, k)
        for j in range(8):
            y[8 * at + j] = 1.0 + 1e-9 * k[16 + j]


def loop_tangent(
    f: int, c: Floats, b: Floats, t: Floats, y: Floats, d: Floats, k: Floats, parts: int
) -> None:
    """tangent(c, b, t, y, d, out), once for each eight directions."""
    for _ in range(20000):
        for part in range(parts):
            call(f, c, b, t, y, d[part * (d.size // parts) : d.size], k)
        y[4] = 1.0 + 1e-9 * k[0]


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


class Ours:
    """``slope`` of ab_sim.kernels, with all formulas of a scene traced."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.code = Code(case.system, type(case.piece.segment))

    def prepared(self) -> tuple[np.ndarray, np.ndarray]:
        """c and b."""
        place = place_on(self.case.piece)
        c = self.code.constants(self.case.system)
        self.code.put_place(c, [*place.segment, *place[1:]])
        return c, branches_of(self.case.system, self.case.modes)

    def slope(self, features: str | None = None) -> Made:
        """Of one run."""
        text = module_text([self.code.emission.slope()])
        made = MachineCode(text, features)
        c, b = self.prepared()
        y, k = self.case.states[0].copy(), np.empty(self.case.size)
        address = made.address("slope")

        def outputs(state: np.ndarray) -> np.ndarray:
            at = state.copy()
            compiled(loop_ours)(address, c, b, at, k, 4, 1)
            return k.copy()

        return Made(lambda n: compiled(loop_ours)(address, c, b, y, k, 4, n), outputs, made)

    def lanes(self) -> Made:
        """Of eight runs; ``outputs`` has one of them in all lanes."""
        address = self.code.address("slope", 8)
        c, b = (np.repeat(x, 8) for x in self.prepared())
        y, t = np.repeat(self.case.states[0], 8), np.full(8, TIME)
        k = np.empty_like(y)

        def outputs(state: np.ndarray) -> np.ndarray:
            ctype = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 5)
            at = np.repeat(state, 8)
            ctype(address)(*(x.ctypes.data for x in (c, b, t, at, k)))
            return k.reshape(-1, 8)[:, 3].copy()

        run = compiled(loop_lanes)
        return Made(lambda n: run(address, c, b, t, y, k, 4), outputs, self.code)

    def jacobian(self) -> Made:
        """By eight directions at once, or, of many balls, by one."""
        address, size = tangent_address(self.code), self.case.size
        lanes = lanes_for(self.case.n)
        c, b = self.prepared()
        parts = -(-size // lanes)
        d = np.zeros((parts, size + 1, lanes))
        for j in range(size):
            d[j // lanes, j, j % lanes] = 1.0
        y, k, t = self.case.states[0].copy(), np.empty((size, lanes)), np.full(1, TIME)
        flat, out = d.ravel(), k.ravel()

        def outputs(state: np.ndarray) -> np.ndarray:
            ctype = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 6)
            found = []
            for part in d:
                ctype(address)(*(x.ctypes.data for x in (c, b, t, state, part, k)))
                found.append(k.copy())
            return np.hstack(found)[:, :size]

        def run(n: int) -> None:
            compiled(loop_tangent)(address, c, b, t, y, flat, out, parts)

        return Made(run, outputs, self.code)


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


def ways(case: Case) -> dict[str, Callable[[], Made]]:
    """What is compared: by name what makes it."""
    native = ["-march=native"]
    return {
        "ours": lambda: Ours(case).slope(),
        "SymEngine, LLVM visitor": lambda: symengine_made(case),
        "CasADi SX, virtual machine": lambda: casadi_vm(case),
        "CasADi SX, C by gcc -O3 -march=native": lambda: casadi_c(case, "SX", native),
        "CasADi MX (a column one node), C likewise": lambda: casadi_c(case, "MX", native),
        "heyoka cfunc": lambda: heyoka_made(case),
        "ours, eight runs in lanes": lambda: Ours(case).lanes(),
        "heyoka cfunc, eight in lanes": lambda: heyoka_made(case, lanes=True),
        "Jacobian: ours": lambda: Ours(case).jacobian(),
        "Jacobian: SymEngine": lambda: symengine_made(case, True),
        "Jacobian: CasADi SX, virtual machine": lambda: casadi_vm(case, True),
        "Jacobian: CasADi SX, C": lambda: casadi_c(case, "SX", native, True),
        "Jacobian: heyoka": lambda: heyoka_made(case, True),
    }


def cpu() -> float:
    """Seconds of this process and of those that it has waited for."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


def check(case: Case, name: str, made: Made, jacobian: np.ndarray) -> float:
    """The largest difference from the formula by NumPy, or from our Jacobian, of a line's size."""
    state = case.states[7]
    wanted = jacobian if name.startswith("Jacobian") else case.plain(state)
    found = made.outputs(state)
    rows = (x.reshape(case.size, -1) for x in (wanted, found - wanted))
    size, off = (np.abs(x).max(axis=1) for x in rows)
    return float((off / size).max())


def differing(case: Case, one: Made, other: Made) -> int:
    """Of STATES_TRIED states those whose slopes are not the same to the bit."""
    pairs = ((one.outputs(x).tobytes(), other.outputs(x).tobytes()) for x in case.states)
    return sum(a != b for a, b in pairs)


def main() -> None:
    """Measure, and print two tables for each number of balls."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=7)
    repeats = parser.parse_args().repeats
    for balls in BALLS:
        case = Case(balls)
        made = {name: make() for name, make in ways(case).items()}
        jacobian = made["Jacobian: ours"].outputs(case.states[7])
        taken: dict[str, list[float]] = {name: [] for name in made}
        spent: dict[str, list[float]] = {name: [] for name in made}
        for _ in range(repeats):
            for name, make in ways(case).items():
                begin = cpu()
                make()
                taken[name].append(1e3 * (cpu() - begin))
            for name, each in made.items():
                begin = time.thread_time()
                each.run(CALLS)
                per = 8 if "eight" in name else 1
                spent[name].append(1e9 * (time.thread_time() - begin) / CALLS / per)
        print(f"\n{balls} balls\n\n| | to make [ms] | ns each | beside ours | difference |")
        print("| --- | --- | --- | --- | --- |")
        for name in made:
            base = "Jacobian: ours" if name.startswith("Jacobian") else "ours"
            base = "ours, eight runs in lanes" if "eight" in name else base
            ratio = median(a / b for a, b in zip(spent[name], spent[base], strict=True))
            off = check(case, name, made[name], jacobian)
            print(
                f"| {name} | {median(taken[name]):.0f} | {median(spent[name]):.1f} "
                f"| {ratio:.2f} | {off:.0e} |"
            )
        print(f"\nSlopes of {STATES_TRIED} states that are not the same to the bit:")
        pairs = {
            "ours, AVX-512 beside AVX2": (made["ours"], Ours(case).slope(NARROW)),
            "ours, one run beside lanes": (made["ours"], made["ours, eight runs in lanes"]),
            "heyoka, one run beside lanes": (
                made["heyoka cfunc"],
                made["heyoka cfunc, eight in lanes"],
            ),
            "CasADi's C, -march=native beside -march=x86-64": (
                casadi_c(case, "SX", ["-march=native"]),
                casadi_c(case, "SX", ["-march=x86-64"]),
            ),
            "CasADi's C, likewise with -ffp-contract=off": (
                casadi_c(case, "SX", ["-march=native", "-ffp-contract=off"]),
                casadi_c(case, "SX", ["-march=x86-64", "-ffp-contract=off"]),
            ),
        }
        for name, (one, other) in pairs.items():
            print(f"- {name}: {differing(case, one, other)}")


if __name__ == "__main__":
    main()
