"""heyoka.py: Taylor's method with steps and order by tolerance, compiled from expressions.

    pip install heyoka

It is not a dependency of the package or of its extras: only this benchmark calls it.

It is called as its documentation advises for speed: double precision, ``compact_mode`` off (slower
to compile, faster to run; the system is small), and ``fast_math`` both ways. The values of a
profile's segment are runtime parameters of one compiled integrator, and time counts from the
segment's beginning. Output comes from ``propagate_grid``, by the Taylor polynomials of the steps.
The integrator restarts at each kink of the profile. In a batch, values that depend on the balls'
masses are runtime parameters, too. All products of constants are computed beforehand, so that no
step computes them.
"""

import importlib.metadata
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.accuracy_cost.methods import FailedError
from ab_sim.analysis.accuracy_cost.problem import RightHandSide, SmoothInterval
from ab_sim.model.spindle.schedule import Ramp
from ab_sim.scene import Scene
from beside.case import SAMPLING, VARIATIONS, BatchCase, Case, equal_balls
from beside.turns import AbsentError, Family, Maker, timed
from beside.width import lanes

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-14)
CALLED = (
    "heyoka.py: adaptive Taylor series, compiled from expressions of the same equations on the "
    "rotating axes, `compact_mode` off, `fast_math` off and on; what a segment of the profile sets "
    "are runtime parameters; output by `propagate_grid`. Batches: `taylor_adaptive_batch` with "
    "`force_avx512`, the constants of its runs runtime parameters; limited to AVX2, two of four"
)
NAME = "heyoka"
INSTALL = "heyoka.py is not installed; pip install heyoka"


def versions() -> dict[str, str]:
    """Return the version of heyoka.py; empty if it is not installed."""
    try:
        return {"heyoka": importlib.metadata.version("heyoka")}
    except importlib.metadata.PackageNotFoundError:
        return {}


class Constants(NamedTuple):
    """Constants of a drive with equal balls, in equations divided by M and by mu R."""

    stiffness: Any
    """k/M."""
    damping: Any
    """c/M."""
    unbalance: Any
    """M0 e/M."""
    load: Any
    """m R/M."""
    coupling: Any
    """m^2/(mu M)."""
    drag: Any
    """c_b/mu."""
    pull: Any
    """m/(mu R)."""
    dragged: Any
    """m R c_b/(mu M)."""

    @classmethod
    def of(cls, scene: Scene) -> "Constants":
        """Return the constants of a scene."""
        M, R, suspension = scene.total_mass, scene.race.radius, scene.effects["suspension"]
        m, _, mu, _, drag = equal_balls(scene)
        return cls(
            suspension.stiffness / M,
            suspension.damping / M,
            scene.eccentric_mass * scene.rotor.eccentricity / M,
            m * R / M,
            m * m / (mu * M),
            drag / mu,
            m / (mu * R),
            m * R * drag / (mu * M),
        )


class OnRamp(NamedTuple):
    """Values of a profile's segment, the first of the runtime parameters."""

    speed: Any
    """Speed at the segment's beginning [rad/s]."""
    slope: Any
    """Acceleration al [rad/s^2]."""
    unbalance: Any
    """M0 e al/M."""
    lever: Any
    """(m R - (I/a^2) a) al/(mu R): effect of the spindle's acceleration on a ball."""
    left: Any
    """m R al/M minus m/M times the effect on a ball: effect on the deck."""

    @classmethod
    def of(cls, scene: Scene, leg: SmoothInterval) -> "OnRamp":
        """Return the values of a segment; the expressions support ramps only."""
        law = leg.scheduled.law
        assert isinstance(law, Ramp)
        al, M, R = law.slope, scene.total_mass, scene.race.radius
        ball = equal_balls(scene)
        unbalance = scene.eccentric_mass * scene.rotor.eccentricity * al / M
        return cls(
            law.start_speed,
            al,
            unbalance,
            ball.lever * al / R,
            ball.m * (R - ball.lever) * al / M,
        )


ON_RAMP = len(OnRamp._fields)


def equations(hy: Any, k: Constants, balls: int) -> list[tuple[Any, Any]]:
    """Return docs/equations.md, section 1, on the rotating axes, solved for the accelerations.

    Each ball has g/R = -(drag r + lever al + pull A.t). Inserted into the deck's equations, this
    leaves two equations for A, solved by hand. Each constant multiplies a single function, because
    Taylor's method would treat products of parameters as functions of time, at the same cost.
    """
    on = OnRamp(*(hy.par[i] for i in range(ON_RAMP)))
    u1, u2, v1, v2 = hy.make_vars("u1", "u2", "v1", "v2")
    names = [f"{what}{i}" for what in ("theta", "rate") for i in range(balls)]
    moving = hy.make_vars(*names)
    angles, rates = moving[:balls], moving[balls:]
    w = on.speed + on.slope * hy.time
    n = [(hy.cos(angle), hy.sin(angle)) for angle in angles]
    f1 = [k.unbalance * w**2, -k.damping * v1, -k.stiffness * u1]
    f2 = [-on.unbalance, -k.damping * v2, -k.stiffness * u2]
    for (c, s), rate in zip(n, rates, strict=True):
        load, along = k.load * (w + rate) ** 2, on.left - k.dragged * rate
        f1 += [load * c, along * s]
        f2 += [load * s, -(along * c)]
    F1, F2 = hy.sum(f1), hy.sum(f2)
    squares = k.coupling * hy.sum([s**2 for _, s in n])
    d11, d22 = 1.0 - squares, 1.0 - balls * k.coupling + squares
    d12 = k.coupling * hy.sum([s * c for c, s in n])
    determinant = d11 * d22 - d12**2
    A1, A2 = (F1 * d22 - F2 * d12) / determinant, (F2 * d11 - F1 * d12) / determinant
    return [
        (u1, v1 + w * u2),
        (u2, v2 - w * u1),
        (v1, A1 + w * v2),
        (v2, A2 - w * v1),
        *zip(angles, rates, strict=True),
        *(
            (rate, k.pull * (A1 * s - A2 * c) - k.drag * rate - on.lever)
            for (c, s), rate in zip(n, rates, strict=True)
        ),
    ]


class Single:
    """Single run."""

    ours, continuous, simulated, evaluations = False, True, SAMPLING.end, None

    def __init__(self, hy: Any, case: Case, method: str, tolerance: float, fast: bool) -> None:
        self.case, self.method, self.setting = case, method, f"tol {tolerance:.0e}"
        f, k = case.f, Constants.of(case.scene)
        self.legs = [
            (leg.grid - leg.scheduled.start, np.array(OnRamp.of(case.scene, leg)), leg.keep)
            for leg in f.legs
        ]
        self.enough = hy.taylor_outcome.time_limit
        self.integrator = hy.taylor_adaptive(
            equations(hy, k, case.scene.balls.count),
            f.start.copy(),
            pars=np.zeros(ON_RAMP),
            tol=tolerance,
            fast_math=fast,
            compact_mode=False,
        )

    def once(self) -> tuple[float, Any]:
        """Run once."""
        return timed(self._run)

    def _run(self) -> list[np.ndarray]:
        integrator, kept = self.integrator, []
        self.steps = 0
        integrator.state[:] = self.case.f.start
        for grid, pars, keep in self.legs:
            integrator.time = grid[0]
            integrator.pars[:] = pars
            done = integrator.propagate_grid(grid)
            if done[0] != self.enough:
                raise FailedError(f"gave up: {done[0]}")
            self.steps += done[3]
            kept.append(done[-1][keep])
        return kept

    def error(self, kept: list[np.ndarray]) -> float:
        """Return the error of the states."""
        return self.case.error(self.case.f.samples(np.concatenate(kept)))


class Group:
    """Runs in the lanes of vectors, each with separate steps."""

    def __init__(
        self, hy: Any, runs: Sequence[RightHandSide], tolerance: float, fast: bool
    ) -> None:
        each = [Constants.of(f.scene) for f in runs]
        self.start = np.array([f.start for f in runs]).T.copy()
        self.legs = []
        for leg in runs[0].legs:
            grid = np.repeat((leg.grid - leg.scheduled.start)[:, None], len(each), axis=1)
            both = zip(runs, each, strict=True)
            pars = np.array([[*OnRamp.of(f.scene, leg), *k] for f, k in both]).T.copy()
            self.legs.append((grid, pars, leg.keep))
        self.enough = hy.taylor_outcome.time_limit
        k = Constants(*(hy.par[ON_RAMP + i] for i in range(len(Constants._fields))))
        self.integrator = hy.taylor_adaptive_batch(
            equations(hy, k, runs[0].scene.balls.count),
            self.start.copy(),
            pars=self.legs[0][1].copy(),
            tol=tolerance,
            fast_math=fast,
            compact_mode=False,
            force_avx512=lanes() == 8,
        )

    def run(self) -> list[np.ndarray]:
        """Return the states at the outputs."""
        integrator, kept = self.integrator, []
        integrator.state[:] = self.start
        for grid, pars, keep in self.legs:
            integrator.set_time(grid[0])
            integrator.pars[:] = pars
            done = integrator.propagate_grid(grid)
            if any(result[0] != self.enough for result in integrator.propagate_res):
                raise FailedError(f"gave up: {integrator.propagate_res}")
            kept.append(done[-1][keep])
        return kept


class EightAtOnce:
    """Batch, in as many groups as the vectors' lanes require."""

    ours, continuous, evaluations = False, True, None
    simulated = len(VARIATIONS) * SAMPLING.end

    def __init__(self, hy: Any, case: BatchCase, method: str, tolerance: float, fast: bool) -> None:
        self.case, self.method, self.setting = case, method, f"tol {tolerance:.0e}"
        runs, width = case.runs, lanes()
        groups = (runs[at : at + width] for at in range(0, len(runs), width))
        self.groups = [Group(hy, group, tolerance, fast) for group in groups]

    def once(self) -> tuple[float, Any]:
        """Run all eight."""
        return timed(lambda: [group.run() for group in self.groups])

    def error(self, kept: list[list[np.ndarray]]) -> float:
        """Return the largest error of all runs."""
        states = np.concatenate([np.concatenate(each) for each in kept], axis=2)
        runs = enumerate(self.case.runs)
        return self.case.error([f.samples(states[:, :, lane]) for lane, f in runs])


def families(case: Case) -> list[Family]:
    """Return the methods for one run, ``fast_math`` off and on."""
    return _both(NAME, Single, case)


def batch_families(case: BatchCase) -> list[Family]:
    """Return the methods for eight runs, ``fast_math`` off and on."""
    return _both(f"{NAME}, batch of 8", EightAtOnce, case)


def _both(name: str, kind: Any, case: Any) -> list[Family]:
    return [
        (name + tail, partial(_settings, kind, case, name + tail, fast))
        for tail, fast in (("", False), (", fast_math", True))
    ]


def _settings(kind: Any, case: Any, name: str, fast: bool) -> Iterator[tuple[str, Maker]]:
    try:
        import heyoka
    except ImportError:
        raise AbsentError(INSTALL) from None
    heyoka.llvm_state.set_diskcache_enabled(False)  # so that what compiling takes is seen
    for tolerance in TOLERANCES:
        heyoka.llvm_state.clear_memcache()
        yield f"tol {tolerance:.0e}", partial(kind, heyoka, case, name, tolerance, fast)
