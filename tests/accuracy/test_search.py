"""The search for the cheapest setting, on runs that cost and err as the test wants."""

import numpy as np
import pytest

from ab_sim.base.errors import DivergedError, SceneError
from ab_sim.drive.accuracy import SAFETY, Timed, cheapest
from ab_sim.drive.accuracy.trials import MOST_SAMPLES, Samples
from ab_sim.engine.integrate.choose import choose_stepper
from ab_sim.engine.integrate.registry import steppers
from ab_sim.engine.kernels.runge_kutta import Tableau
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.scene import Scene, load_scene
from tests.accuracy.asked_tolerances import SHORT, wished


class FakeRuns:
    """Runs of a drive that is easy to price: seconds per stage, an error of the method's order."""

    def __init__(self, floor: float = 0.0, stage: float = 1e-7) -> None:
        self.floor, self.stage, self.seen = floor, stage, []  # type: ignore[var-annotated]

    def __call__(self, scene: Scene, steps: int, every: int) -> Timed:
        stepper = choose_stepper(scene, system_of(scene)).stepper
        step = scene.solver.step
        self.seen.append((stepper.name, step))
        size = 10.0 * (step / 0.01) ** stepper.order
        size += self.floor * np.sin(1e9 * step)  # differs from step to step
        count = steps // every
        samples = Samples(np.zeros((count, 2)), np.full((count, 1), size))
        return Timed(samples, steps * stepper.evaluations * self.stage)


def test_each_setting_is_told_before_it_is_run() -> None:
    runs, told = FakeRuns(stage=1e-4), []
    cheapest(
        wished("one-ball", angle=1e-5), runs, tell=lambda *now: told.append((*now, len(runs.seen)))
    )
    assert len(told) == len(runs.seen)
    for k, (what, spent, most, seen) in enumerate(told):
        name, step = runs.seen[k]
        new = name not in {earlier for earlier, _ in runs.seen[:k]}
        first = ", compiled first if necessary" if new else ""
        assert what == f"{name} at {step:.12g} s{first}; seconds of CPU time" and seen == k
        assert 0 <= spent <= most
    assert told[-1][1] > told[0][1] == 0


BY_HAND = (("rk8", 8, 12, 5e-3), ("tsit5", 5, 6, 2.5e-3), ("rk4", 4, 4, 2.5e-3))
"""Name, order, stages, and longest stable step on the ladder [s]."""


def test_the_cheapest_of_all_is_found() -> None:
    priced = {s.name for s in steppers().values() if s.priced and isinstance(s.weights, Tableau)}
    assert priced == {name for name, *_ in BY_HAND}, "a new stepper needs a line in BY_HAND"
    for tolerance in (1e-1, 1e-3, 1e-5, 1e-8):
        runs = FakeRuns()
        _, work_precision = cheapest(wished("one-ball", angle=tolerance), runs)
        # By hand: the longest step on the ladder for each method; fewest stages per second win.
        prices = {}
        for name, order, stages, longest in BY_HAND:
            for parts in (1, 2, 4, 5, 10, 20, 40, 50, 100, 200, 400, 500, 1000):
                step = 0.01 / parts
                if step <= longest and SAFETY * 10.0 * (step / 0.01) ** order <= tolerance / 1.1:
                    prices[name, step] = stages / step
                    break
        least = min(prices.values())
        alike = [setting for setting, cost in prices.items() if cost <= 1.15 * least]
        assert (work_precision.stepper, pytest.approx(work_precision.step)) in alike


class Tolerant(FakeRuns):
    """A method whose error is five times its tolerance, at no price to speak of."""

    def __call__(self, scene: Scene, steps: int, every: int) -> Timed:
        samples, seconds = super().__call__(scene, steps, every)
        tolerance = scene.solver.parameters.get("tolerance")
        if tolerance is None:
            return Timed(samples, seconds)
        return Timed(samples._replace(angles=0.0 * samples.angles + 5.0 * tolerance), 1e-9 * steps)


def test_a_tolerance_is_found_that_delivers_the_accuracy() -> None:
    for accuracy, tolerance in ((1e-3, 1e-5), (3e-8, 1e-9)):
        scene, work_precision = cheapest(wished("nsc-case-1", angle=accuracy), Tolerant())
        assert work_precision.stepper == "taylor" and work_precision.parameters == {
            "tolerance": tolerance
        }
        assert scene.solver.parameters == work_precision.parameters
        assert f"tolerance {tolerance:g}" in work_precision.reason
        assert work_precision.step == 0.005, "samples as close as the usual method would need them"


def test_stiff_drag_leads_to_the_method_that_solves_it() -> None:
    """Explicit methods are not tried if drag limits their steps by a factor of 1000."""
    for coefficient, stiff in ((1e5, True), (20, False)):
        changes = [f"effects.viscous_drag.coefficient={coefficient}", "accuracy.angle=1e-1"]
        runs = FakeRuns()
        _, work_precision = cheapest(load_scene("one-ball", [*SHORT["one-ball"], *changes]), runs)
        names = {stepper for stepper, _ in runs.seen}
        assert names == {"imex8"} if stiff else names >= {"rk8", "rk4"}
        assert work_precision.stepper in names


class Blind(FakeRuns):
    """Steps of 1 ms and longer are all alike in what they miss."""

    def __call__(self, scene: Scene, steps: int, every: int) -> Timed:
        samples, seconds = super().__call__(scene, steps, every)
        missed = 1.0 if scene.solver.step > 0.9e-3 else 1e3 * scene.solver.step**2
        return Timed(samples._replace(angles=samples.angles + missed), seconds)


def test_runs_that_agreed_by_chance_are_not_taken_for_rounding() -> None:
    """Where a shorter step shows more than all that was seen before, there is more to be seen."""
    _, work_precision = cheapest(wished("one-ball", angle=1e-5), Blind())
    assert SAFETY * work_precision.measured.angle <= 1e-5 and work_precision.step < 1e-4


def test_the_shortest_step_of_all_is_not_called_rounding() -> None:
    class Slow(FakeRuns):
        def __call__(self, scene: Scene, steps: int, every: int) -> Timed:
            samples, seconds = super().__call__(scene, steps, every)
            return Timed(samples._replace(angles=samples.angles + scene.solver.step), seconds)

    with pytest.raises(SceneError, match="shorter step is not"):
        cheapest(wished("one-ball", angle=1e-7), Slow(stage=1e-9))


def test_rounding_is_recognised() -> None:
    runs = FakeRuns(floor=1e-7)
    with pytest.raises(SceneError, match="accuracy.angle = 1e-08 .*best possible"):
        cheapest(wished("one-ball", angle=1e-8), runs)
    assert min(step for _, step in runs.seen) > 1e-5, "no endless shortening"
    _, work_precision = cheapest(wished("one-ball", angle=1e-5), FakeRuns(floor=1e-7))
    assert SAFETY * work_precision.measured.angle <= 1e-5


def test_measuring_that_would_take_too_long_is_refused_before() -> None:
    runs = FakeRuns(stage=1.0)
    with pytest.raises(SceneError, match="300 s of CPU time"):
        cheapest(wished("one-ball", angle=1e-6), runs)
    assert len(runs.seen) == 2, "two probes were enough to see it"


def test_no_more_samples_are_kept_than_are_compared() -> None:
    """However long the run is, and also when it is only timed."""
    kept = []

    class Counted(FakeRuns):
        def __call__(self, scene: Scene, steps: int, every: int) -> Timed:
            kept.append(steps // every)
            return super().__call__(scene, steps, every)

    scene = load_scene("one-ball", ["duration=1e5", "accuracy.angle=1e-6"])
    cheapest(scene, Counted(stage=1e-9))
    assert len(kept) > 5 and max(kept) <= MOST_SAMPLES


def test_a_run_that_diverges_with_every_step_says_so() -> None:
    def diverge(scene: Scene, steps: int, every: int) -> Timed:
        raise DivergedError("ball_0 rate went beyond all bounds at t = 1 s")

    with pytest.raises(DivergedError, match="beyond all bounds"):
        cheapest(wished("one-ball", angle=1e-6), diverge)


def test_steps_that_diverge_are_no_candidates() -> None:
    runs = FakeRuns()

    def sometimes(scene: Scene, steps: int, every: int) -> Timed:
        if scene.solver.step > 1.5e-3:
            raise DivergedError("too long")
        return runs(scene, steps, every)

    _, work_precision = cheapest(wished("one-ball", angle=1e-1), sometimes)
    assert work_precision.step <= 1e-3


@pytest.mark.parametrize(
    ("name", "tried"),
    [("weak-motor", "tsit5"), ("packed-balls", "tsit5"), ("nsc-case-1", "taylor")],
)
def test_suitable_methods_are_tried_with_events_or_without(name: str, tried: str) -> None:
    runs = Tolerant(stage=1e-7)
    cheapest(wished(name, angle=1e-1), runs)
    names = {stepper for stepper, _ in runs.seen}
    assert {"rk8", tried} <= names and ("taylor" in names) == (tried == "taylor")
