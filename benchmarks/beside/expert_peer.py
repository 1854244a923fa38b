"""Equations in C++ with explicit vectors, as an expert would write them: ../expert.

    apt install g++

Taylor's method of fixed order with steps by tolerance, and the Runge-Kutta method of order 8 with
steps that divide the output's period. It is compiled here for each number of balls, with vectors of
AVX-512 if the processor has them, or limited to AVX2. The lanes of vectors hold the balls'
components of one run, or the runs of a batch, which all take the same steps.
"""

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.accuracy_cost.methods import FailedError
from ab_sim.analysis.accuracy_cost.problem import RightHandSide
from ab_sim.engine.integrate.steppers.rk8 import RK8
from ab_sim.model.spindle.schedule import Ramp
from ab_sim.scene import Scene
from beside.case import SAMPLING, VARIATIONS, BatchCase, Case, equal_balls
from beside.turns import AbsentError, Family, Maker, timed
from beside.width import for_compilers, lanes

FOLDER = Path(__file__).parents[1] / "expert"
FLAGS = ("-std=c++17", "-O3")
FAST = ("-ffast-math",)
ORDERS = (6, 8, 9, 10, 11, 12, 13, 14, 15, 16, 18)
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(6, 29))
MOST_BALLS = 8
"""Largest number of balls that fit in the lanes of one run."""
TAYLOR, RK, TAIL = "Taylor in C++", "RK8 in C++", ", -ffast-math"
INSTALL = "apt install g++"
CALLED = (
    "the same equations in C++ with GCC's vectors, written by hand for this drive in the variables "
    "(momenta) in which Taylor's method has the fewest products, built with "
    f"`{' '.join(FLAGS)} -march=native`, with and without `-ffast-math`; a whole run is one call. "
    "Taylor's method at fixed orders with steps by tolerance, output from the series; the "
    "Runge-Kutta method of order 8, with steps that end at the outputs. Batches: runs in the "
    "lanes, all with the steps of the one that needs the shortest"
)
POINTER = ctypes.POINTER(ctypes.c_double)


class Leg(ctypes.Structure):
    """``struct Leg`` of drive.h."""

    _fields_ = (
        ("start_speed", ctypes.c_double),
        ("slope", ctypes.c_double),
        ("count", ctypes.c_long),
    )


class Build(NamedTuple):
    """Settings of a compilation."""

    balls: int
    runs: int
    """Number of runs in lanes; 1 if the balls are in lanes."""
    flags: tuple[str, ...]


def compiler() -> str:
    """Return the name and version of the compiler.

    Raises
    ------
    AbsentError
        There is no compiler.
    """
    found = shutil.which("c++")
    if found is None:
        raise AbsentError(f"c++ is not installed; {INSTALL}")
    said = subprocess.run([found, "--version"], capture_output=True, text=True, check=True).stdout
    return said.splitlines()[0]


def versions() -> dict[str, str]:
    """Return the compiler's version and options; empty without a compiler."""
    try:
        return {"C++ compiler": " ".join([compiler(), *FLAGS, *for_compilers()])}
    except AbsentError:
        return {}


@cache
def library(build: Build) -> ctypes.CDLL:
    """Compile the shared library.

    Raises
    ------
    AbsentError
        There is no compiler, or it fails.
    """
    compiler()
    with tempfile.TemporaryDirectory(prefix="expert-") as folder:
        Path(folder, "tableau.h").write_text(_tableau(), encoding="utf-8")
        built = Path(folder, "expert.so")
        defined = {
            "BALLS": build.balls,
            "RUNS": build.runs,
            "WIDTH": lanes(),
            "ORDERS": " ".join(f"ORDER({order})" for order in ORDERS),
        }
        options = [*FLAGS, *for_compilers(), *build.flags, f"-I{folder}"]
        options += [f"-D{name}={value}" for name, value in defined.items()]
        sources = [str(FOLDER / "taylor.cpp"), str(FOLDER / "rk8.cpp")]
        command = ["c++", *options, "-shared", "-fPIC", *sources, "-o", str(built)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            why = next((line for line in done.stderr.splitlines() if "error" in line), "")
            raise AbsentError(f"{FOLDER.name} cannot be built ({why})")
        return ctypes.CDLL(str(built))


def _tableau() -> str:
    """Return the tableau of the package's rk8: that of Dormand and Prince, as in DOP853."""
    a, b, c = RK8.weights
    numbers = lambda row: "{" + ", ".join(float(x).hex() for x in row) + "}"  # noqa: E731
    rows = ", ".join(numbers(row) for row in a)
    s = len(b)
    return (
        f"constexpr int STAGES = {s};\n"
        f"constexpr double A[{s}][{s}] = {{{rows}}};\n"
        f"constexpr double B[{s}] = {numbers(b)};\n"
        f"constexpr double C[{s}] = {numbers(c)};\n"
    )


def constants(scene: Scene) -> list[float]:
    """Return the ``Constants`` of drive.h."""
    M, R, suspension = scene.total_mass, scene.race.radius, scene.effects["suspension"]
    m, _, mu, lever, drag = equal_balls(scene)
    kappa = m / (mu * R)
    return [
        kappa * m * R / M,
        kappa * scene.eccentric_mass * scene.rotor.eccentricity / M,
        suspension.damping / M,
        suspension.stiffness / M,
        drag / mu,
        1.0 - lever / R,
        kappa,
    ]


class Function:
    """Compiled method on runs that differ in their constants.

    Parameters
    ----------
    build
        Settings of the compilation.
    name
        Name of the function.
    runs
        Runs, as many as there are lanes.
    dial
        Last argument of the function.
    """

    def __init__(self, build: Build, name: str, runs: list[RightHandSide], dial: Any) -> None:
        self._call, self._dial = getattr(library(build), name), dial
        self._call.argtypes = [
            *(POINTER, ctypes.POINTER(Leg), ctypes.c_long, POINTER, POINTER, POINTER),
            ctypes.c_double if isinstance(dial, float) else ctypes.c_long,
        ]
        self._call.restype = ctypes.c_long
        legs = runs[0].legs
        self._constants = np.array([constants(f.scene) for f in runs]).T.copy()
        self._legs = (Leg * len(legs))()
        for at, leg in zip(self._legs, legs, strict=True):
            law = leg.scheduled.law
            assert isinstance(law, Ramp)
            at.start_speed, at.slope, at.count = law.start_speed, law.slope, leg.grid.size
        self._times = np.concatenate([leg.grid - leg.scheduled.start for leg in legs])
        self._start = np.array([f.start for f in runs]).T.copy()
        self.rows = np.empty((self._times.size, *self._start.shape))
        first = np.cumsum([0, *(leg.grid.size for leg in legs[:-1])])
        self.keep = np.concatenate([a + leg.keep for a, leg in zip(first, legs, strict=True)])
        self._arguments = (
            *(_of(self._constants), self._legs, len(legs), _of(self._times), _of(self._start)),
            *(_of(self.rows), self._dial),
        )

    def __call__(self) -> int:
        """Run from the start and write to ``rows``; return the number of steps."""
        return int(self._call(*self._arguments))


class Single:
    """Single run."""

    ours, simulated, evaluations = False, SAMPLING.end, None

    def __init__(
        self, case: Case, method: str, setting: str, build: Build, name: str, dial: Any
    ) -> None:
        self.case, self.method, self.setting = case, method, setting
        self.continuous = isinstance(dial, float)
        self.function = Function(build, name, [case.f], dial)

    def once(self) -> tuple[float, Any]:
        """Run once."""
        seconds, self.steps = timed(self.function)
        return seconds, self.function.rows

    def error(self, kept: np.ndarray) -> float:
        """Return the error of the states."""
        return self.case.error(self.case.f.samples(kept[self.function.keep, :, 0]))


class EightAtOnce:
    """Batch, in as many groups as the lanes require."""

    ours, evaluations = False, None
    simulated = len(VARIATIONS) * SAMPLING.end

    def __init__(
        self, case: BatchCase, method: str, setting: str, build: Build, name: str, dial: Any
    ) -> None:
        self.case, self.method, self.setting = case, method, setting
        self.continuous = isinstance(dial, float)
        runs = case.runs
        groups = [runs[at : at + build.runs] for at in range(0, len(runs), build.runs)]
        self.functions = [Function(build, name, group, dial) for group in groups]

    def once(self) -> tuple[float, Any]:
        """Run all eight."""
        return timed(self._run)

    def _run(self) -> list[np.ndarray]:
        for function in self.functions:
            function()
        return [function.rows for function in self.functions]

    def error(self, kept: list[np.ndarray]) -> float:
        """Return the largest error of all runs."""
        states = np.concatenate(kept, axis=2)[self.functions[0].keep]
        runs = enumerate(self.case.runs)
        return self.case.error([f.samples(states[:, :, lane]) for lane, f in runs])


def families(case: Case) -> list[Family]:
    """Return the methods for one run."""
    return _families(case, Single, case.scene.balls.count, 1, "")


def batch_families(case: BatchCase) -> list[Family]:
    """Return the methods for eight runs."""
    balls = case.runs[0].scene.balls.count
    return _families(case, EightAtOnce, balls, lanes(), ", batch of 8")


def _families(case: Any, kind: Any, balls: int, runs: int, what: str) -> list[Family]:
    found: list[Family] = []
    for tail, flags in (("", ()), (TAIL, FAST)):
        build = Build(balls, runs, flags)
        for name, settings in ((TAYLOR, _taylor), (RK, _rk8)):
            full = name + what + tail
            found.append((full, partial(settings, partial(kind, case, full), build)))
    return found


def _check(build: Build) -> None:
    if build.balls > MOST_BALLS and build.runs == 1:
        raise FailedError(f"one run in C++ has room for {MOST_BALLS} balls")
    library(build)


def _taylor(made: Any, build: Build) -> Iterator[tuple[str, Maker]]:
    """Yield, for each tolerance, orders near -ln(tolerance)/2 + 1, the choice of Jorba and Zou."""
    _check(build)
    for tolerance in TOLERANCES:
        wanted = 1.0 - 0.5 * np.log(tolerance)
        for order in ORDERS:
            if abs(order - wanted) <= 2.5:
                setting = f"order {order}, tol {tolerance:.0e}"
                yield setting, partial(made, setting, build, f"taylor_{order}", tolerance)


def _rk8(made: Any, build: Build) -> Iterator[tuple[str, Maker]]:
    _check(build)
    for parts in (1, 2, 3, 4, 5, 8):
        setting = f"{1e3 * SAMPLING.period / parts:.3g} ms"
        yield setting, partial(made, setting, build, "rk8", parts)


def _of(values: np.ndarray) -> Any:
    return values.ctypes.data_as(POINTER)
