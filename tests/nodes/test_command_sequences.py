"""Any sequence of commands, rules and stops: outputs stay finite, and grouping changes nothing."""

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ab_msgs_py.set_points import SetPoint, SetPoints
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.nodes.command_path import CommandPath, Rules, WatchdogAction
from ab_sim.nodes.prepared_drive import SLICE, CommandedDrive
from ab_sim.scene import load_scene

SCENE = load_scene(
    "thesis-baseline", ["effects.rolling_friction=", "balls.count=2", "start.ball_angles=[0, 1]"]
)
DRIVE = Drive(SCENE, commanded=True)
any_speed = st.one_of(
    st.floats(-SCENE.spindle.max_speed, SCENE.spindle.max_speed),
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, -0.0, 5e-324, SCENE.spindle.max_speed, -SCENE.spindle.max_speed]),
)
any_rules = st.builds(
    Rules,
    st.floats(0.0, 1000.0),
    st.floats(1e-3, 1e4),
    st.one_of(st.just(math.inf), st.floats(1e-4, 0.1)),
    st.sampled_from(WatchdogAction),
    st.floats(1e-3, 1e4),
    st.floats(0.0, 0.05),
    st.floats(0.0, 0.05),
)
any_points = st.lists(
    st.builds(
        SetPoint,
        st.integers(0, 60_000_000),
        any_speed,
        st.one_of(st.none(), st.floats(-1e4, 1e4)),
    ),
    min_size=1,
    max_size=5,
).map(lambda points: tuple(sorted(points, key=lambda point: point.time)))
any_trajectory = st.builds(SetPoints, st.integers(-1, 120_000_000), any_points)
events = st.one_of(
    st.tuples(st.just("command"), any_speed),
    st.tuples(st.just("trajectory"), any_trajectory),
    st.tuples(st.just("advance"), st.integers(1, 12)),
    st.tuples(st.just("rules"), any_rules),
    st.tuples(st.sampled_from(["stop", "release", "reset"]), st.none()),
)


def play(happening: list[tuple[str, object]], grouping: int | None = None) -> Trajectory:
    """What a drive makes of it; steps taken at once, or in groups of so many."""
    DRIVE.reset()
    led = CommandedDrive(DRIVE, CommandPath(DRIVE.servo, DRIVE.step, Rules(), seed=3))
    parts = [DRIVE.present()]
    for what, value in happening:
        if what == "command":
            led.path.receive(value, DRIVE.steps)  # type: ignore[arg-type]
        elif what == "trajectory":
            led.path.receive_trajectory(value, DRIVE.steps)  # type: ignore[arg-type]
        elif what == "rules":
            led.path.rules = value  # type: ignore[assignment]
        elif what == "stop":
            led.path.emergency_stop()
        elif what == "release":
            led.path.release()
        elif what == "reset":
            led.reset()
        else:
            ahead = int(value)  # type: ignore[call-overload]
            while ahead:
                taken = min(ahead, grouping or ahead)
                parts += led.advance(taken)
                ahead -= taken
    return Trajectory.join(parts)


def sound(happening: list[tuple[str, object]]) -> None:
    """Nothing is raised, everything is finite, and no limit of the scene is left."""
    samples = play(happening)
    assert np.all(np.isfinite(samples.samples))
    assert np.all(np.abs(samples["speed"]) <= SCENE.spindle.max_speed * (1 + 1e-12))
    observed = DRIVE.observe()
    assert math.isfinite(observed.omega) and np.all(np.isfinite(observed.driving_force))


@settings(max_examples=300)
@given(st.lists(events, max_size=12))
def test_whatever_is_commanded_outputs_are_finite(happening: list[tuple[str, object]]) -> None:
    sound(happening)


def trajectory(rng: random.Random) -> SetPoints:
    """Most can be followed: up to 1.1 times the largest acceleration, from any speed."""
    speed, time, points = rng.uniform(-50.0, 50.0), 0, []
    for _ in range(rng.randint(1, 6)):
        points.append(SetPoint(time, speed))
        time += round(10 ** rng.uniform(0.0, 8.0))
        slope = 1.1 * SCENE.spindle.max_acceleration * rng.uniform(-1.0, 1.0)
        speed += slope * (time - points[-1].time) * 1e-9
    return SetPoints(rng.choice([0, 10**6 * rng.randint(-1, 200)]), tuple(points))


def drawn(rng: random.Random) -> list[tuple[str, object]]:
    """As ``events``, but drawn much faster."""
    most = SCENE.spindle.max_speed
    odd = (math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, 1e308, most, -most)
    happening: list[tuple[str, object]] = []
    for _ in range(rng.randint(1, 12)):
        what = rng.choice(
            ["command"] * 3
            + ["trajectory"] * 3
            + ["advance"] * 5
            + ["rules", "stop", "release", "reset"]
        )
        value: object = None
        if what == "trajectory":
            value = trajectory(rng)
        if what == "command":
            value = rng.choice([rng.choice(odd), 1.1 * rng.uniform(-most, most)])
        elif what == "advance":
            value = rng.randint(1, 12)
        elif what == "rules":
            value = Rules(
                rng.uniform(0.0, 1000.0), 10 ** rng.uniform(-3, 4),
                rng.choice([math.inf, 10 ** rng.uniform(-4, -1)]), rng.choice(list(WatchdogAction)),
                10 ** rng.uniform(-3, 4), rng.uniform(0.0, 0.05), rng.uniform(0.0, 0.05),
            )  # fmt: skip
        happening.append((what, value))
    return happening


@settings(max_examples=100)
@given(st.integers(0, 2**32))
def test_ten_thousand_sequences(seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(100):
        sound(drawn(rng))


@settings(max_examples=200)
@given(st.lists(events, max_size=12), st.integers(1, 5))
def test_steps_may_be_grouped_in_any_way(
    happening: list[tuple[str, object]], grouping: int
) -> None:
    whole, parts = play(happening), play(happening, grouping)
    assert whole.samples.tobytes() == parts.samples.tobytes()


def led_drive() -> CommandedDrive:
    DRIVE.reset()
    rules = Rules(delay=0.02, jitter=0.01, age_limit=0.5, silence=WatchdogAction.COAST, coast=20.0)
    led = CommandedDrive(DRIVE, CommandPath(DRIVE.servo, DRIVE.step, rules, seed=5))
    for speed in (50.0, 55.0, 60.0):
        led.path.receive(speed, DRIVE.steps)
        list(led.advance(40))
    return led


def test_time_begins_anew_and_nothing_else_does() -> None:
    led = led_drive()
    led.path.receive(70.0, DRIVE.steps)
    before, age = DRIVE.observe(), led.path.age(DRIVE.steps)
    led.reset_time()
    after = DRIVE.observe()
    assert (after.time, after.steps) == (0.0, 0)
    assert after.omega == pytest.approx(before.omega, rel=1e-12)
    assert after.psi == pytest.approx(before.psi, rel=1e-12)
    assert after.theta.tolist() == before.theta.tolist()
    assert led.path.age(0) == age
    list(led.advance(40))
    assert DRIVE.observe().command == 70.0, "what was on the bus comes out"
    list(led.advance(600))
    assert led.path.silent, "and so does the watchdog's time go on"


def test_the_state_begins_anew_and_time_does_not() -> None:
    led = led_drive()
    steps = DRIVE.steps
    led.reset_state()
    now = DRIVE.observe()
    assert (now.steps, now.omega, now.command) == (steps, 0.0, 0.0)
    assert now.theta.tolist() == [0.0, 1.0]
    list(led.advance(100))
    assert DRIVE.observe().omega == 0.0, "commands are forgotten"
    led.path.receive(20.0, DRIVE.steps)
    samples = Trajectory.join(list(led.advance(200)))
    assert samples["time"][0] == pytest.approx((steps + 101) * DRIVE.step)
    assert samples["speed"][-1] > 0.0


def test_a_path_goes_on_from_what_was_kept() -> None:
    led = led_drive()
    led.path.receive(33.0, DRIVE.steps)
    kept, path = DRIVE.snapshot(), led.path.state()

    def on() -> bytes:
        samples = list(led.advance(10))
        led.path.receive(44.0, DRIVE.steps)
        return Trajectory.join([*samples, *led.advance(700)]).samples.tobytes()

    first = on()
    assert led.path.silent
    led.restore(kept)
    led.path.restore(path)
    assert on() == first


def test_a_stop_is_heard_amid_many_steps() -> None:
    """As another thread wants it, while a late wake-up takes all its steps."""
    DRIVE.reset()
    led = CommandedDrive(DRIVE, CommandPath(DRIVE.servo, DRIVE.step, Rules()))
    led.path.receive(SCENE.spindle.max_speed, 0)
    parts = led.advance(5 * SLICE)
    next(parts)
    led.path.stop_wanted = True
    speeds = np.concatenate([part.samples[:, part.channels.index("speed")] for part in parts])
    assert led.path.stopped and np.all(np.diff(speeds) <= 0.0)
