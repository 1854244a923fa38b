"""Random drives for the study of start-ups, and strategies to start them."""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

import ab_sim
from ab_sim.control import SensorFacts, StartUpSettings

SCENE = "balanced-start-up"
FINAL, ACCELERATION = 200.0, 200.0
"""Final speed [rad/s] and acceleration [rad/s^2]."""
DURATION, LAST = 20.0, 1.0
"""Duration of a run, and time at its end over which the whirl is averaged [s]."""
PERIOD, WINDOW = 0.005, 100
"""Time between commands [s], and steps over which the whirl is averaged to detect settling."""
MOTOR = "effects.motor={{rotor_inertia: 2.9e-5, torque_limit: {}, proportional_gain: 1.0e-3, {}}}"
NOISE = 0.01
"""Standard deviation of a reading, relative to the whirl without balls at the final speed."""


class Drawn(NamedTuple):
    """Parameters of a random drive."""

    eccentricity: float
    stiffness: float
    damping: float
    drag: float
    arm: float
    """Arm of rolling friction [m]; 0 for every other drive."""
    angles: tuple[float, float]


class Variation(NamedTuple):
    """Differences from the main part of the study."""

    name: str
    gain: float = 1.0
    """Gain of the sensor; the controller gets the noise of a gain of 1."""
    noise: float = NOISE
    """Noise of the sensor; the controller gets ``NOISE``."""
    weak: bool = False
    """True for a motor that reaches only 60 rad/s^2, unknown to the controller."""
    stiffness: float = 1.0
    """Factor on the stiffness."""
    quantity: str = "displacement"
    axes: int = 1
    told: bool = True
    """True if the controller gets the noise."""


class Outcome(NamedTuple):
    """Outcome of a run."""

    residual: float
    """Whirl at the end relative to that without balls."""
    settled: float
    """Time after which the whirl stays below 0.3 of that without balls at the final speed [s]."""
    peak: float
    """Largest whirl relative to the eccentricity."""
    retries: int = 0
    state: str = ""


def drives(seed: int, count: int) -> Iterator[Drawn]:
    """Yield random drives, uniform in all parameters except the drag, which is log-uniform."""
    draw = np.random.default_rng(seed)
    for i in range(count):
        e, k, c = (float(draw.uniform(*bounds)) for bounds in ((0.8, 1.2), (0.8, 1.2), (0.5, 1.5)))
        drag, arm = 0.2 * 10.0 ** float(draw.uniform()), 1e-5 * float(draw.uniform(0.5, 1.5))
        angles = draw.uniform(0.0, 2.0 * math.pi, 2).tolist()
        yield Drawn(1e-4 * e, 1e3 * k, 0.2 * c, drag, arm * (i % 2), (angles[0], angles[1]))


def scene_of(drawn: Drawn, variation: Variation) -> ab_sim.Scene:
    """Return the scene of a drive."""
    changes = [
        f"rotor.eccentricity={drawn.eccentricity!r}",
        f"effects.suspension.stiffness={drawn.stiffness * variation.stiffness!r}",
        f"effects.suspension.damping={drawn.damping!r}",
        f"effects.viscous_drag.coefficient={drawn.drag!r}",
        f"effects.rolling_friction.arm={drawn.arm!r}",
        f"start.ball_angles=[{drawn.angles[0]!r}, {drawn.angles[1]!r}]",
        f"spindle.max_acceleration={ACCELERATION!r}",
    ]
    if variation.weak:
        changes.append(MOTOR.format(60.0 * 2.9e-5, "integral_gain: 2.0e-3"))
    return ab_sim.load_scene(SCENE, changes)


def without_balls(scene: ab_sim.Scene, speed: float) -> float:
    """Return the whirl of the rotor with the balls' mass but without their effect [m]."""
    suspension: Any = scene.effects["suspension"]
    rotor: Any = scene.rotor
    total = rotor.total_mass
    unbalance = (total - sum(scene.balls.masses)) * rotor.eccentricity
    stiff = suspension.stiffness - total * speed * speed
    return unbalance * speed * speed / math.hypot(stiff, suspension.damping * speed)


class Course:
    """Start-up of one drive, and its outcome."""

    def __init__(self, scene: ab_sim.Scene) -> None:
        self.drive = ab_sim.Drive(scene, commanded=True)
        self.reference = without_balls(scene, FINAL)
        self._eccentricity: Any = scene.rotor.eccentricity
        self._whirl: list[np.ndarray] = []
        self._speed: list[np.ndarray] = []

    def to(self, speed: float) -> None:
        """Command a speed [rad/s]."""
        self.drive.command(speed, ACCELERATION)

    def on(self, seconds: float) -> Any:
        """Advance by a time [s], at most to the end."""
        left = round((DURATION - self.drive.time) / self.drive.step)
        run = self.drive.advance(min(round(seconds / self.drive.step), left))
        self._whirl.append(np.hypot(run["x"], run["y"]))
        self._speed.append(run["speed"])
        return run

    def outcome(self, retries: int = 0, state: str = "") -> Outcome:
        """Return the outcome at the end of the run."""
        self.on(DURATION)
        whirl, speed = np.concatenate(self._whirl), np.concatenate(self._speed)
        windows = whirl.reshape(-1, WINDOW).mean(axis=1)
        off = (windows > 0.3 * self.reference) | (speed[WINDOW - 1 :: WINDOW] < 0.99 * FINAL)
        step = self.drive.step
        settled = (np.flatnonzero(off)[-1] + 1) * WINDOW * step if off.any() else 0.0
        residual = whirl[-round(LAST / step) :].mean() / self.reference
        peak = whirl.max() / self._eccentricity
        return Outcome(
            float(residual),
            float(settled) if residual < 0.3 else math.inf,
            float(peak),
            retries,
            state,
        )


def hold(scene: ab_sim.Scene, speed: float, seconds: float) -> Outcome:
    """Run a start-up with a hold."""
    course = Course(scene)
    if seconds:
        course.to(speed)
        course.on(speed / ACCELERATION + seconds)
    course.to(FINAL)
    return course.outcome()


def sweeps(scene: ab_sim.Scene, count: int) -> Outcome:
    """Run a start-up with ``count`` sweeps through resonance down to 60 rad/s and up; wait 2 s."""
    course = Course(scene)
    for _ in range(count):
        course.to(FINAL)
        course.on(FINAL / ACCELERATION + 2.0)
        course.to(60.0)
        course.on((FINAL - 60.0) / ACCELERATION)
    course.to(FINAL)
    return course.outcome()


def readings(course: Course, run: Any, variation: Variation, draw: np.random.Generator) -> Any:
    """Return the sensor's readings of a run, per axis."""
    acceleration = variation.quantity == "acceleration"
    noise = variation.noise * course.reference * (FINAL * FINAL if acceleration else 1.0)
    names = ("ax", "ay") if acceleration else ("x", "y")
    for name in names:
        sound = run[name]
        yield (variation.gain * (sound + draw.normal(0.0, noise, len(sound)))).tolist()


def settings_of(course: Course, variation: Variation) -> StartUpSettings:
    """Return the settings of a controller."""
    acceleration = variation.quantity == "acceleration"
    noise = NOISE * course.reference * (FINAL * FINAL if acceleration else 1.0)
    quantity: Any = variation.quantity
    sensing = SensorFacts(quantity, variation.axes, 0.0, noise if variation.told else 0.0)
    return StartUpSettings(FINAL, ACCELERATION, sensing, PERIOD)


def led(
    course: Course,
    controller: Any,
    variation: Variation,
    draw: np.random.Generator,
    watch: Callable[[Any], None] = lambda run: None,
) -> None:
    """Run to the end under a controller with the interface of ``StartUp``."""
    drive, sample = course.drive, controller.sample
    for _ in range(round(DURATION / PERIOD)):
        course.to(controller.command(drive.time))
        run = course.on(PERIOD)
        spindle = (run[name].tolist() for name in ("time", "angle", "speed"))
        for row in zip(*spindle, *readings(course, run, variation, draw), strict=True):
            sample(*row)
        watch(run)
