"""A scene that asks for an accuracy gets it, at the least price, or is told what can be had."""

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ab_sim.accuracy import SAFETY, Price, Timed, cheapest, resolve_accuracy
from ab_sim.accuracy.deviation import MOST_SAMPLES, Deviation, Samples, deviation
from ab_sim.drive import Drive
from ab_sim.drive.description import describe
from ab_sim.dynamics.assemble import system_of
from ab_sim.dynamics.race.neighbours import start_angles
from ab_sim.errors import DivergedError, SceneError
from ab_sim.integrate.choose import choose_stepper
from ab_sim.scene import Scene, check_scene, load_scene, scene_names
from tests.conftest import THESIS, merge
from tests.reference import simulate, simulate_deck
from tests.reference.of_scene import deck_of, params_of

GRID = 5e-4
"""s; errors are looked at wherever a step ends on it, so that their peaks are not missed."""
DOUBT = 3e-11
"""What the reference's own error may be, in rad and in e."""
SHORT = {
    # Through the resonance, from close to it: an independent simulator takes its time.
    "thesis-hold": ["start.speed=80", "duration=0.7"],
    "thesis-baseline": ["start.speed=80", "duration=0.7"],
    "thesis-half-acceleration": ["start.speed=80", "duration=0.7"],
    "one-ball": ["start.speed=80", "duration=0.7"],
    "no-ball": ["start.speed=80", "duration=0.7"],
    "balanced-start-up": ["start.speed=80", "duration=0.5"],
    "weak-motor": ["duration=0.6"],
    "five-balls-8000-rpm": ["start.speed=220", "duration=0.3"],
    "on-edge": ["start.speed=80", "duration=0.4"],
    "everything": ["duration=0.3"],
    "nsc-case-1": ["profile.start_time=0.1", "duration=0.3"],
    "nsc-case-2": ["profile.start_time=0.1", "duration=0.3"],
    "nsc-case-3": ["profile.start_time=0.1", "duration=0.3"],
    # With eight balls at rest the reference has 10^7 modes to choose from: see the last of these
    # tests. Three in a row start to slide, meet and part.
    "packed-balls": ["balls.count=3", "duration=0.5"],
    "feeding-deck": ["duration=0.3"],
    # Through the tilt's critical speeds.
    "couple-unbalance": ["start.speed=320", "duration=0.5"],
}
MEETING = ["balls.count=2", "balls.mass=0.001", "effects.viscous_drag.coefficient=0.02"]
MEETING += ["start.ball_angles=[0.6,-0.6]"]
EVENTFUL = {
    "balls that stick": (
        "thesis-hold",
        ["start.speed=60", "start.ball_angles=[0.5,-1.1]", "effects.rolling_friction.arm=5e-6"]
        + ["effects.viscous_drag.coefficient=0.1", "duration=0.6"],
        {"stick", "release"},
    ),
    "balls that collide": (
        "packed-balls",
        [*MEETING, "effects.rolling_friction.arm=0", "start.speed=90", "duration=0.4"],
        {"impact"},
    ),
    "balls that stick and collide": (
        "packed-balls",
        [*MEETING, "effects.rolling_friction.arm=5e-6", "start.speed=60", "duration=0.6"],
        {"stick", "release", "impact"},
    ),
}
"""A scene, changes of it, and what the reference has to see happen there.

What measures an accuracy shares our laws and our location of events, so these are the scenes in
which that has to be right. In the sets of effects of the scenes above."""
NEW: dict[str, Any] = merge(
    THESIS,
    {
        "rotor": {"total_mass": 0.13, "eccentricity": 7e-5},
        "race": {"radius": 0.013},
        "balls": {"count": 3, "mass": [6e-4, 1.1e-3, 9e-4], "radius": 1.2e-3},
        "effects": {
            "suspension": {"stiffness": 2100.0, "damping": 0.5},
            "viscous_drag": {"coefficient": 0.35},
            "gravity": {"tilt": 0.4, "direction": 0.7},
        },
        "start": {"speed": 90.0, "ball_angles": [0.4, 2.0, -1.7]},
        "profile": {"kind": "start_up", "acceleration": 90.0, "target_speed": 180.0},
        "solver": None,
        "duration": 0.9,
    },
)
"""A drive that nothing was tuned on."""


def wished(name: str, **accuracy: float) -> Scene:
    if name == "new":
        return check_scene({**NEW, "accuracy": accuracy}, "new")
    scene, changes, _ = EVENTFUL[name] if name in EVENTFUL else (name, SHORT[name], set())
    return load_scene(scene, [*changes, *(f"accuracy.{k}={v!r}" for k, v in accuracy.items())])


@functools.cache
def truth(name: str) -> tuple[np.ndarray, Samples]:
    """The independent reference, and its times."""
    scene = wished(name, whirl=1.0)
    times = GRID * np.arange(1, round(scene.duration / GRID) + 1)
    # Events may come and go within the long steps that the reference could take.
    longest = 2e-3 if name in EVENTFUL else np.inf
    angles = start_angles(scene)
    if scene.deck is None:
        want = simulate(params_of(scene), angles, times, rtol=1e-12, max_step=longest)
    else:
        start, still = np.append(np.zeros(6), angles), np.zeros(6 + len(angles))
        want = simulate_deck(deck_of(scene), start, still, times, rtol=1e-12, max_step=longest)
    if name in EVENTFUL:
        assert EVENTFUL[name][2] <= {event.kind for event in want.events}
    return times, Samples(want.deck[:, : 2 if scene.deck is None else 3], want.theta)


def resolved(scene: Scene, period: float | None = None) -> tuple[Drive, Price]:
    """A drive with what was found, and the price of it."""
    scene, price = resolve_accuracy(scene, period)
    assert price is not None
    return Drive(scene), price


def error_of(drive: Drive, name: str) -> Deviation:
    times, want = truth(name)
    step, grid = (round(1e9 * each) for each in (drive.step, GRID))
    both = math.lcm(step, grid)
    run = Samples.of(drive.advance(round(times[-1] / drive.step))).every(both // step)
    return deviation(run, want.every(both // grid), drive.scene.whirl_unit[0])


def test_all_scenes_are_here() -> None:
    assert set(SHORT) == set(scene_names())


@pytest.mark.parametrize("name", [*SHORT, *EVENTFUL, "new"])
def test_the_error_asked_for_is_met(name: str) -> None:
    """Against an independent simulator, for a loose, a tight and another kind of wish."""
    wishes: list[dict[str, float]] = [{"angle": 1e-6}, {"angle": 1e-9}, {"whirl": 1e-6}]
    for wish in wishes if name != "no-ball" else wishes[2:]:
        drive, price = resolved(wished(name, **wish))
        found, claimed = error_of(drive, name), price.measured
        for key, asked in wish.items():
            true, measured = getattr(found, key), getattr(claimed, key)
            assert SAFETY * measured <= asked, (wish, price.reason)
            assert true <= asked / SAFETY * 1.1 + DOUBT, (wish, price.reason)
            assert true <= 1.5 * measured + DOUBT, "what was measured flatters nobody"


@pytest.mark.parametrize("name", ["packed-balls", "nsc-case-1"])
def test_whole_scenes_that_the_reference_cannot_do(name: str) -> None:
    """Eight balls, many impacts; twenty seconds: against tsit5 at a much shorter step.

    That is the package's own kernel, so that what it shows is the convergence, not the equations.
    """
    drive, _ = resolved(load_scene(name, ["accuracy.angle=1e-6"]))
    fine = Drive(load_scene(name, ["solver.stepper=tsit5", "solver.step=1e-4"]))
    every = round(drive.step / fine.step)
    count = round(drive.scene.duration / drive.step)
    run, want = drive.advance(count), fine.advance(every * count)
    apart = np.abs(run.ball_angles - want.ball_angles[every - 1 :: every]).max()
    assert apart <= 1e-6 / SAFETY * 1.1


def test_where_drag_is_stiff_it_is_met_too() -> None:
    """Measured by collocation alone; Radau's method, on other equations, is the judge here."""
    changes = ["effects.rolling_friction=", "effects.viscous_drag.coefficient=100"]
    changes += ["start.speed=80", "start.ball_angles=[2,-1]", "duration=0.2"]

    def asked(angle: float) -> tuple[Drive, Price]:
        return resolved(load_scene("thesis-hold", [*changes, f"accuracy.angle={angle!r}"]))

    drive, price = asked(1e-6)
    assert price.stepper == "collocation" and price.reference.startswith("collocation at ")
    count = round(0.2 / drive.step)
    run, times = drive.advance(count), drive.step * np.arange(1, count + 1)
    scene = drive.scene
    want = simulate(params_of(scene), start_angles(scene), times, method="Radau", rtol=1e-11)
    apart = np.abs(run.ball_angles - want.theta).max()
    assert apart <= 1e-6 / SAFETY * 1.1 + 1e-9
    assert apart <= 1.5 * price.measured.angle + 1e-9, "what was measured flatters nobody"
    with pytest.raises(SceneError, match="the best that can be had is about") as caught:
        asked(1e-18)
    best = float(str(caught.value).split(" is about ")[1].split()[0])
    assert 1e-14 < best < 1e-11, "rounding is seen"
    assert SAFETY * asked(best)[1].measured.angle <= best


def test_looser_wishes_are_not_wasted() -> None:
    """What is taken for them errs more: which setting it is depends on this machine's times."""
    loose, tight = (
        resolved(wished("thesis-hold", angle=wish))[1].measured.angle for wish in (1e-3, 1e-12)
    )
    assert loose > 1e3 * tight


@pytest.mark.parametrize(
    ("name", "accuracy"), [("thesis-hold", "angle"), ("weak-motor", "whirl"), ("new", "angle")]
)
def test_below_double_precision_is_refused_with_the_best_there_is(name: str, accuracy: str) -> None:
    with pytest.raises(SceneError, match=f"accuracy.{accuracy} = 1e-18") as caught:
        resolved(wished(name, **{accuracy: 1e-18}))
    text = str(caught.value)
    assert "the best that can be had is about" in text and "ask for no more" in text
    best = float(text.split(" is about ")[1].split()[0])
    assert 1e-15 < best < 1e-8
    _, price = resolved(wished(name, **{accuracy: best}))
    assert SAFETY * getattr(price.measured, accuracy) <= best, "that much can be had indeed"


def test_both_wishes_are_met() -> None:
    _, price = resolved(wished("one-ball", angle=1e-4, whirl=1e-8))
    assert SAFETY * price.measured.whirl <= 1e-8
    assert " rad, " in price.reason and " e (asked 0.0001 rad, 1e-08 e" in price.reason


def test_resolved_scene_is_what_is_recorded_and_runs_again_to_the_same_bits() -> None:
    scene = wished("one-ball", angle=1e-7)
    assert check_scene(scene.as_mapping(), "again") == scene
    drive, price = resolved(scene)
    assert drive.scene.accuracy is None
    assert drive.scene.solver.step == drive.step
    assert drive.scene.solver.stepper == drive.stepper.name
    described = describe(drive.scene, price.report())
    assert described["accuracy"]["asked"] == {"angle": 1e-7}
    by = described["accuracy"]["measured_by"]
    assert by.startswith("ab_sim's own rk8 at ") and by in described["accuracy"]["reason"]
    again = Drive(check_scene(described["scene"], "a recording"))
    assert again.advance(100).samples.tobytes() == drive.advance(100).samples.tobytes()


def test_a_scene_without_a_wish_is_left_alone() -> None:
    scene = load_scene("one-ball")
    assert resolve_accuracy(scene) == (scene, None)


@pytest.mark.parametrize("rate", [250.0, 100.0, 400.0, 1000.0])
def test_steps_go_into_the_period_asked_for(rate: float) -> None:
    drive, _ = resolved(wished("one-ball", angle=1e-6), period=1.0 / rate)
    ratio = 1.0 / rate / drive.step
    assert ratio == pytest.approx(round(ratio), rel=1e-9) and ratio > 0.5


@pytest.mark.parametrize("rate", [60.0, 120.0, 300.0])
def test_periods_that_leave_no_choice_are_refused(rate: float) -> None:
    with pytest.raises(SceneError, match="a rate of 50, 100, .* would do"):
        resolved(wished("one-ball", angle=1e-6), period=1.0 / rate)


def test_an_accelerometer_gets_steps_that_suit_it() -> None:
    changes = [*SHORT["one-ball"], "sensors.accelerometer={}", "accuracy.angle=1e-3"]
    drive, _ = resolved(load_scene("one-ball", changes))
    assert drive.step <= 1e-3, "one sample per step at most"
    assert 1e-3 / drive.step == pytest.approx(round(1e-3 / drive.step))


# The search itself, on runs that cost and err as the test wants.


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
    runs, told = FakeRuns(stage=1e-5), []
    cheapest(
        wished("one-ball", angle=1e-5), runs, tell=lambda *now: told.append((*now, len(runs.seen)))
    )
    assert len(told) == len(runs.seen)
    for k, (what, spent, most, seen) in enumerate(told):
        name, step = runs.seen[k]
        assert what == f"{name} at {step:.12g} s; seconds of CPU time" and seen == k
        assert 0 <= spent <= most
    assert told[-1][1] > told[0][1] == 0


def test_the_cheapest_of_all_is_found() -> None:
    for wish in (1e-1, 1e-3, 1e-5, 1e-8):
        runs = FakeRuns()
        _, price = cheapest(wished("one-ball", angle=wish), runs)
        # By hand: the longest step on the ladder for each method; fewest stages per second win.
        prices = {}
        for name, order, stages, longest in (
            ("rk8", 8, 12, 5e-3), ("tsit5", 5, 6, 2.5e-3), ("rk4", 4, 4, 2.5e-3)
        ):  # fmt: skip
            for parts in (1, 2, 4, 5, 10, 20, 40, 50, 100, 200, 400, 500, 1000):
                step = 0.01 / parts
                if step <= longest and SAFETY * 10.0 * (step / 0.01) ** order <= wish / 1.1:
                    prices[name, step] = stages / step
                    break
        least = min(prices.values())
        alike = [setting for setting, cost in prices.items() if cost <= 1.15 * least]
        assert (price.stepper, pytest.approx(price.step)) in alike


class Tolerant(FakeRuns):
    """A method whose error is five times its tolerance, at no price to speak of."""

    def __call__(self, scene: Scene, steps: int, every: int) -> Timed:
        samples, seconds = super().__call__(scene, steps, every)
        tolerance = scene.solver.parameters.get("tolerance")
        if tolerance is None:
            return Timed(samples, seconds)
        return Timed(samples._replace(angles=0.0 * samples.angles + 5.0 * tolerance), 1e-9 * steps)


def test_a_tolerance_is_found_that_delivers_the_accuracy() -> None:
    for wish, tolerance in ((1e-3, 1e-5), (3e-8, 1e-9)):
        scene, price = cheapest(wished("nsc-case-1", angle=wish), Tolerant())
        assert price.stepper == "collocation" and price.parameters == {"tolerance": tolerance}
        assert scene.solver.parameters == price.parameters
        assert f"tolerance {tolerance:g}" in price.reason
        assert price.step == 0.005, "samples as close as the usual method would need them"


def test_stiff_drag_leads_to_what_solves_it() -> None:
    """Where drag limits explicit steps by far, they are not even tried; where by little, only."""
    explicit = {"rk8", "tsit5", "rk4"}
    for coefficient, tried in ((1000, set()), (20, explicit)):
        changes = [f"effects.viscous_drag.coefficient={coefficient}", "accuracy.angle=1e-1"]
        runs = Tolerant()
        _, price = cheapest(load_scene("one-ball", [*SHORT["one-ball"], *changes]), runs)
        assert {stepper for stepper, _ in runs.seen} <= {*tried, "collocation"}
        assert price.stepper == "collocation" and price.step > 1e-4


class Blind(FakeRuns):
    """Steps of 1 ms and longer are all alike in what they miss."""

    def __call__(self, scene: Scene, steps: int, every: int) -> Timed:
        samples, seconds = super().__call__(scene, steps, every)
        missed = 1.0 if scene.solver.step > 0.9e-3 else 1e3 * scene.solver.step**2
        return Timed(samples._replace(angles=samples.angles + missed), seconds)


def test_runs_that_agreed_by_chance_are_not_taken_for_rounding() -> None:
    """Where a shorter step shows more than all that was seen before, there is more to be seen."""
    _, price = cheapest(wished("one-ball", angle=1e-5), Blind())
    assert SAFETY * price.measured.angle <= 1e-5 and price.step < 1e-4


def test_the_shortest_step_of_all_is_not_called_rounding() -> None:
    class Slow(FakeRuns):
        def __call__(self, scene: Scene, steps: int, every: int) -> Timed:
            samples, seconds = super().__call__(scene, steps, every)
            return Timed(samples._replace(angles=samples.angles + scene.solver.step), seconds)

    with pytest.raises(SceneError, match="a shorter step is not tried; ask for no more"):
        cheapest(wished("one-ball", angle=1e-7), Slow(stage=1e-9))


def test_rounding_is_recognised() -> None:
    runs = FakeRuns(floor=1e-7)
    with pytest.raises(SceneError, match="the best that can be had is about"):
        cheapest(wished("one-ball", angle=1e-8), runs)
    assert min(step for _, step in runs.seen) > 1e-5, "no endless shortening"
    _, price = cheapest(wished("one-ball", angle=1e-5), FakeRuns(floor=1e-7))
    assert SAFETY * price.measured.angle <= 1e-5


def test_measuring_that_would_take_too_long_is_refused_before() -> None:
    runs = FakeRuns(stage=1.0)
    with pytest.raises(SceneError, match="more than 300 s of CPU time.*shorter duration"):
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

    _, price = cheapest(wished("one-ball", angle=1e-1), sometimes)
    assert price.step <= 1e-3


# Scenes.


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["accuracy.angle=0"], "accuracy.angle = 0: must be more than 0"),
        (["accuracy.angle=.nan"], "accuracy.angle = nan: must be a finite number"),
        (["accuracy.angle=yes"], "accuracy.angle = True: a number is needed"),
        (["accuracy.angel=1e-9"], "did you mean 'angle'"),
        (["accuracy={}"], "give angle [rad] or whirl [e], or both"),
        (["accuracy=1e-9"], "must be a section"),
        (["accuracy.angle=1e-9", "solver.step=0.001"], "remove one of the two"),
        (["accuracy.angle=1e-9", "solver.stepper=rk4"], "stands instead of solver"),
        (["balls.count=0", "start.ball_angles=", "accuracy.angle=1e-9"], "ask for accuracy.whirl"),
    ],
)
def test_bad_wishes(changes: list[str], words: str) -> None:
    with pytest.raises(SceneError) as caught:
        load_scene("thesis-hold", changes)
    assert words in str(caught.value)


def test_a_change_of_one_takes_the_files_other_away(tmp_path: Any) -> None:
    assert load_scene("thesis-hold", ["accuracy.angle=1e-9"]).accuracy is not None
    file = tmp_path / "mine.yaml"
    raw = load_scene("one-ball", ["accuracy.angle=1e-9"]).as_mapping()
    file.write_text(repr(raw))  # YAML reads Python's literals
    assert load_scene(file).accuracy is not None
    changed = load_scene(file, ["solver.step=0.002"])
    assert changed.accuracy is None and changed.solver.step == 0.002
    assert load_scene(file, ["accuracy.whirl=1e-3", "accuracy.angle="]).accuracy is not None
    assert load_scene(file, ["accuracy="]).accuracy is None


def test_a_solver_and_a_wish_in_one_file_are_refused(scene: Any) -> None:
    with pytest.raises(SceneError, match="remove one of the two sections"):
        scene(accuracy={"angle": 1e-9})


@pytest.mark.parametrize("use", [Drive, describe])
def test_a_scene_that_was_not_measured_is_refused_at_once(use: Callable[[Scene], Any]) -> None:
    """Nothing is searched for behind a constructor; the message says who does."""
    with pytest.raises(SceneError, match=r"accuracy: .* ab_sim\.accuracy\.resolve_accuracy\("):
        use(wished("one-ball", angle=1e-9))
