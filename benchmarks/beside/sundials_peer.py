"""SUNDIALS as a C program calls it: c_kernel/sundials.c, compiled here.

    apt install gcc libsundials-dev

CVODE's Adams methods with fixed-point iteration or Newton's, its BDF with Newton's, both with a
dense Jacobian by differences, and ARKODE's ERKStep with Fehlberg's pair of orders 7 and 8. All
restart at each kink of the profile and interpolate between steps for the output. ERKStep's
polynomials are of degree 5 at most, so it also runs with steps that end at each output. The faster
variant of a method counts, at each error.
"""

import ctypes
import shutil
import subprocess
import tempfile
import weakref
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from c_kernels import FLAGS, CDrive, compiler

from ab_sim.analysis.accuracy_cost.methods import ABSOLUTE, FailedError
from beside.case import SAMPLING, Case, equal_balls
from beside.turns import AbsentError, Family, Maker, timed
from beside.width import for_compilers

CALLED = (
    "a C program: C right-hand side, C loop over the outputs, Debian's libsundials-dev. CVODE "
    "Adams with fixed-point iteration or Newton's, CVODE BDF with Newton's, on a dense Jacobian by "
    "differences; ARKODE's ERKStep with Fehlberg's pair of orders 7 and 8, interpolating or with "
    "steps that end at the outputs; of variants the quicker counts"
)
SOURCE = Path(__file__).parents[1] / "c_kernel" / "sundials.c"
LIBRARIES = (
    *("cvode", "arkode", "nvecserial", "sunlinsoldense", "sunmatrixdense"),
    "sunnonlinsolfixedpoint",
)
INSTALL = "apt install gcc libsundials-dev"
ADAMS, ADAMS_NEWTON, BDF, ERK, ERK_TO_OUTPUTS = range(5)
"""``enum method`` of sundials.c."""
METHODS = {
    "CVODE Adams in C": ((ADAMS_NEWTON, ", Newton"), (ADAMS, ", fixed point")),
    "CVODE BDF in C": ((BDF, ""),),
    "ARKODE Fehlberg 8 in C": ((ERK, ""), (ERK_TO_OUTPUTS, ", steps end at outputs")),
}
TOLERANCES = tuple(10.0**-k for k in range(3, 14))
POINTER = ctypes.POINTER(ctypes.c_double)


@cache
def library(balls: int) -> ctypes.CDLL:
    """Compile the shared library for a number of balls.

    Raises
    ------
    AbsentError
        The compiler or SUNDIALS is missing, or it is another release.
    """
    gcc = shutil.which("gcc")
    if gcc is None:
        raise AbsentError(f"gcc is not installed; {INSTALL}")
    folder = tempfile.TemporaryDirectory(prefix="sundials-")
    built = Path(folder.name) / "sundials.so"
    options = [*FLAGS, *for_compilers(), f"-DBALLS={balls}", "-shared", "-fPIC"]
    command = [gcc, *options, str(SOURCE), "-o", str(built)]
    command += [f"-lsundials_{name}" for name in LIBRARIES] + ["-lm"]
    with folder:
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            why = next((line for line in done.stderr.splitlines() if "error" in line), "")
            raise AbsentError(f"{SOURCE.name} cannot be built; {INSTALL} ({why})")
        loaded = ctypes.CDLL(str(built))
    loaded.peer_open.argtypes = [ctypes.c_int, ctypes.POINTER(CDrive), ctypes.c_double, POINTER]
    loaded.peer_open.restype = ctypes.c_void_p
    loaded.peer_leg.argtypes = [
        *(ctypes.c_void_p, ctypes.c_double, ctypes.c_double),
        *(POINTER, ctypes.c_long, POINTER, POINTER),
    ]
    loaded.peer_evaluations.argtypes = [ctypes.c_void_p]
    loaded.peer_evaluations.restype = ctypes.c_long
    loaded.peer_close.argtypes = [ctypes.c_void_p]
    loaded.peer_close.restype = None
    return loaded


def versions() -> dict[str, str]:
    """Return the version of Debian's package; empty if SUNDIALS is from elsewhere."""
    command = ["dpkg-query", "--show", "--showformat=${Version}", "libsundials-dev"]
    try:
        found = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return {}
    return {"SUNDIALS in C": found, "C compiler": compiler()}


class InC:
    """Method at a relative tolerance."""

    ours, continuous, simulated = False, True, SAMPLING.end

    def __init__(self, case: Case, method: str, setting: str, number: int, rtol: float) -> None:
        self.case, self.method, self.setting = case, method, setting
        self.evaluations: float | None = None
        f, scene, ball = case.f, case.scene, equal_balls(case.scene)
        self.library = library(scene.balls.count)
        drive = CDrive(
            scene.total_mass,
            scene.eccentric_mass * scene.rotor.eccentricity,
            scene.race.radius,
            scene.effects["suspension"].stiffness,
            scene.effects["suspension"].damping,
            ball.drag,
            0.0,  # speed and acceleration: of each leg
            0.0,
            ball.m,
            ball.a,
        )
        absolute = rtol * ABSOLUTE * f.scale
        self.peer = self.library.peer_open(number, ctypes.byref(drive), rtol, _of(absolute))
        if not self.peer:
            raise FailedError("SUNDIALS refused to begin")
        weakref.finalize(self, self.library.peer_close, self.peer)
        self.times = [leg.grid - leg.scheduled.start for leg in f.legs]
        self.states = [np.empty((leg.grid.size, f.start.size)) for leg in f.legs]

    def once(self) -> tuple[float, Any]:
        """Run once."""
        self.library.peer_evaluations(self.peer)
        found = timed(self._run)
        self.evaluations = self.library.peer_evaluations(self.peer)
        return found

    def _run(self) -> list[np.ndarray]:
        state = self.case.f.start
        for leg, times, states in zip(self.case.f.legs, self.times, self.states, strict=True):
            ramp = leg.scheduled.law
            done = self.library.peer_leg(
                self.peer,
                ramp.start_speed,
                ramp.slope,
                _of(times),
                times.size,
                _of(state),
                _of(states),
            )
            if done < 0:
                raise FailedError(f"gave up: SUNDIALS returned {done}")
            state = states[-1]
        return self.states

    def error(self, kept: list[np.ndarray]) -> float:
        """Return the error of the states."""
        f = self.case.f
        pairs = zip(kept, f.legs, strict=True)
        return self.case.error(f.samples(np.concatenate([x[leg.keep] for x, leg in pairs])))


def _of(values: np.ndarray) -> Any:
    return values.ctypes.data_as(POINTER)


def families(case: Case) -> list[Family]:
    """Return all methods."""
    return [(name, partial(_settings, case, name)) for name in METHODS]


def _settings(case: Case, name: str) -> Iterator[tuple[str, Maker]]:
    library(case.scene.balls.count)
    for number, tail in METHODS[name]:
        for rtol in TOLERANCES:
            setting = f"rtol {rtol:.0e}{tail}"
            yield setting, partial(InC, case, name, setting, number, rtol)
