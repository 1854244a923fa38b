"""The package's steppers: as a user runs them, and their compiled loops alone."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from ab_sim.design.batch import Batch, simulate_batch
from ab_sim.drive import Drive
from ab_sim.drive.accuracy.trials import Samples
from ab_sim.scene import Scene
from beside.case import SAMPLING, VARIATIONS, BatchCase, Case
from beside.turns import Family, Maker, timed

STEPS = (5e-3, 2.5e-3, 1e-3)
"""Steps of rk8 and imex8 [s]; they must divide the period of the output."""
TOLERANCES = tuple(10.0**-k for k in range(4, 14))
"""Tolerances of taylor [rad per step]."""
CALLED = (
    '`Drive.advance`, as users run it, with a trajectory at its end; "compiled loop": the calls of '
    "compiled code alone that it makes. rk8 and imex8 have a sample at each of "
    "their steps, taylor every 5 ms. Batches: `simulate_batch`, eight runs with balls of different "
    "masses, its compiled kernel alone and the whole call"
)
LOOP, KERNEL, WHOLE = ", compiled loop", ", compiled kernel", ", whole call"

Settings = Iterator[tuple[str, tuple[str, ...]]]


def by_step(stepper: str) -> Settings:
    """Yield the steps of a stepper; each is a sample."""
    for step in STEPS:
        yield f"{1e3 * step:g} ms", (f"solver.stepper={stepper}", f"solver.step={step}")


def taylor_settings() -> Settings:
    """Yield tolerances; the method chooses its steps, the scene's step is that of the output."""
    for tolerance in TOLERANCES:
        yield (
            f"tolerance {tolerance:.0e}",
            (
                "solver.stepper=taylor",
                f"solver.step={SAMPLING.period}",
                f"solver.parameters.tolerance={tolerance}",
            ),
        )


OURS: dict[str, Callable[[], Settings]] = {
    "rk8": partial(by_step, "rk8"),
    "imex8": partial(by_step, "imex8"),
    "taylor": taylor_settings,
}


class Whole:
    """Run of ``Drive.advance`` with a sample every 5 ms."""

    ours, simulated, evaluations = True, SAMPLING.end, None

    def __init__(self, case: Case, method: str, setting: str, of: Scene) -> None:
        self.case, self.method, self.setting = case, method, setting
        self.continuous = method == "taylor"
        self.drive = Drive(of)
        self.every = SAMPLING.per_period(self.drive.step)

    def once(self) -> tuple[float, Any]:
        """Run once."""
        self.drive.reset()
        return timed(partial(self.drive.advance, SAMPLING.number * self.every, self.every))

    def error(self, kept: Any) -> float:
        """Return the error of the samples."""
        return self.case.error(Samples.of(kept))


class Loop:
    """Call of compiled code of the same run, which writes a sample at every step."""

    ours, simulated, evaluations = True, SAMPLING.end, None

    def __init__(self, case: Case, method: str, setting: str, of: Scene) -> None:
        self.case, self.method, self.setting = case, method + LOOP, setting
        self.continuous = method == "taylor"
        self.drive = Drive(of)
        self.every = SAMPLING.per_period(self.drive.step)
        self.steps = SAMPLING.number * self.every
        self.samples = self.drive._room_for(self.steps)

    def once(self) -> tuple[float, Any]:
        """Run once."""
        self.drive.reset()
        return timed(self._run)

    def _run(self) -> Any:
        self.drive._take(self.drive._step_plan, self.steps, self.samples)
        return self.samples

    def error(self, kept: Any) -> float:
        """Return the error of ``Drive.advance``, which makes the same call."""
        self.drive.reset()
        whole = self.drive.advance(self.steps, self.every)
        return self.case.error(Samples.of(whole))


class SideBySide:
    """Eight runs by ``simulate_batch``: the whole call, or its compiled kernel alone."""

    ours, evaluations = True, None
    simulated = len(VARIATIONS) * SAMPLING.end

    def __init__(self, case: BatchCase, method: str, setting: str, of: Scene, whole: bool) -> None:
        self.case, self.setting, self.scene, self.whole = case, setting, of, whole
        self.method = method + (WHOLE if whole else KERNEL)
        self.continuous = method == "taylor"
        self.every = SAMPLING.per_period(of.solver.step)

    def once(self) -> tuple[float, Any]:
        """Run all eight."""
        seconds, batch = timed(partial(simulate_batch, self.scene, VARIATIONS, self.every))
        return (seconds if self.whole else batch.integration_seconds), batch

    def error(self, kept: Batch) -> float:
        """Return the largest error of all runs."""
        return self.case.error([Samples.of(run.trajectory) for run in kept.runs])


def families(case: Case) -> list[Family]:
    """Return the methods for one run."""
    return [
        (name + tail, partial(_single, kind, case, name))
        for name in OURS
        for kind, tail in ((Whole, ""), (Loop, LOOP))
    ]


def batch_families(case: BatchCase) -> list[Family]:
    """Return the methods for eight runs."""
    return [
        (name + tail, partial(_batch, case, name, whole))
        for name in OURS
        for whole, tail in ((False, KERNEL), (True, WHOLE))
    ]


def _single(kind: Any, case: Case, name: str) -> Iterator[tuple[str, Maker]]:
    for setting, changes in OURS[name]():
        yield setting, partial(_made, kind, case, name, setting, changes)


def _made(kind: Any, case: Case, name: str, setting: str, changes: tuple[str, ...]) -> Any:
    return kind(case, name, setting, case.with_solver(*changes))


def _batch(case: BatchCase, name: str, whole: bool) -> Iterator[tuple[str, Maker]]:
    for setting, changes in OURS[name]():
        yield (
            setting,
            lambda s=setting, c=changes: SideBySide(case, name, s, case.with_solver(*c), whole),
        )
