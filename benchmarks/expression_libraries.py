"""Our equations beside libraries of expressions: what they take to make, and to evaluate.

    pip install 'ab_sim[peers]'; apt install gcc
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
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from beside.formula import STATES_TRIED, TIME, Case, Made  # noqa: E402
from beside.libraries import casadi_c, casadi_vm, heyoka_made, symengine_made  # noqa: E402

from ab_sim.compiling import Floats, call, compiled  # noqa: E402
from ab_sim.dynamics.assemble import place_on  # noqa: E402
from ab_sim.events.run_arrays import branches_of  # noqa: E402
from ab_sim.kernels.code import Code  # noqa: E402
from ab_sim.kernels.tangent import lanes_for, tangent_address  # noqa: E402
from ab_sim.tracing.llvm_text import module_text  # noqa: E402
from ab_sim.tracing.machine_code import MachineCode  # noqa: E402

BALLS = 2, 5, 16
CALLS = 20_000
NARROW = "+sse4.2,+avx,+avx2,+fma"


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


class Ours:
    """``slope`` of ab_sim.kernels, with all formulas of a scene traced."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.code = Code(case.system, type(case.scheduled.segment))

    def prepared(self) -> tuple[np.ndarray, np.ndarray]:
        """c and b."""
        place = place_on(self.case.scheduled)
        c = self.code.constants(self.case.system)
        self.code.put_place(c, [*place.segment, *place[1:]])
        return c, branches_of(self.case.system, self.case.discrete_state)

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
        for each in made.values():
            each.run(CALLS)
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
