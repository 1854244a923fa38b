"""The drive of section 6.2, with five balls that collide, from many random starts.

The thesis prints 0.33 g cm of the balls, 0.3 g cm of the disc, 2300 and 8000 rpm, and the period of
0.5 s. Mass, damping, friction and drag are not printed: they are chosen here (the scene
``five-balls-8000-rpm``) and varied by half and double.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim import Scene, Trajectory, load_scene
from ab_sim.analysis import run_scene, without_balls
from ab_sim.analysis.metrics import metrics_of
from ab_sim.drive.closed_forms import resultant
from ab_sim.scene.load import changed_scene
from ab_sim.scene.profiles import StartUpProfile
from gallery.thesis.drive import Tell
from gallery.thesis.many import many

SCENE, CONTACT = "five-balls-8000-rpm", "effects.ball_contact={restitution_coefficient: 0.5}"
RPM = math.pi / 30.0
UNBALANCE = 0.3
"""Of the disc [g cm]: 1e-5 kg m each."""
CHOICES = ("mass", "damping", "friction", "drag")
"""What is not printed, and varied."""
OTHERS = {
    "race.radius": 0.012,
    "balls.mass": 0.33e-5 / 5 / 0.012,
    "effects.rolling_friction.arm": 3e-6,
    "profile.acceleration": 240.0,
}
"""Other choices of what is not printed; the balls' unbalance stays."""
OTHERS_NAMED = "R = 12 mm, arm 3 um, 240 rad/s^2"
CLOSEST = 0.27
"""Between neighbours at the start [rad]; balls touch at 0.25."""


CRITICAL = 2300.0
"""[rpm]."""
LATER = 0.5
""""Immediately": so long after the period's end [s]; ours, as in section 4.1."""


class Bar(NamedTuple):
    """Final whirl over many starts [um]."""

    each: np.ndarray
    """Of each start, shape (starts,)."""
    balls: np.ndarray
    """Their unbalance, from that of the disc as real axis [g cm], of each start; complex."""

    @property
    def mean(self) -> float:
        """Their mean."""
        return float(self.each.mean())

    @property
    def interval(self) -> float:
        """Half the width of the mean's 95 % interval."""
        return mean_of(self.each)[1]

    def more_than(self, other: "Bar") -> tuple[float, float]:
        """By how much, in the mean, start by start, and half its 95 % interval [um].

        Both begin at the same starts: what a start decides of both is not in the interval.
        """
        return mean_of(self.each - other.each)

    def left(self, unbalance: float = UNBALANCE) -> np.ndarray:
        """What is left of the disc's unbalance [g cm], of each start."""
        return np.asarray(np.abs(unbalance + self.balls))

    def below(self, other: "Bar") -> bool:
        """Whether the mean is smaller, and the difference's 95 % interval says so."""
        more, interval = self.more_than(other)
        return more + interval < 0.0

    def first(self, count: int) -> "Bar":
        """Of as many starts only."""
        return Bar(*(values[:count] for values in self))

    def words(self) -> str:
        """Mean and interval."""
        return f"{self.mean:.2f} +- {self.interval:.2f} um"


class Case(NamedTuple):
    """A drive of the experiments."""

    rpm: float | None = None
    """Where the variable-speed period of 0.5 s is; None: without one."""
    acceleration: float = 0.0
    """In the period [rad/s^2]; 400 rad/s^2 before and after it."""
    target: float = 8000.0
    """Speed at the end [rpm]."""
    unbalance: float = UNBALANCE
    """Of the disc [g cm]."""
    choice: str = ""
    """Of ``CHOICES``, what is changed by ``factor``; stiffness and damping go with the mass, so
    that critical speed, damping ratio and unbalance stay."""
    factor: float = 1.0
    others: bool = False
    """Whether it has ``OTHERS``."""


def base(contact: bool = True) -> Scene:
    """The drive as chosen; balls collide, or pass through each other."""
    return load_scene(SCENE, [CONTACT] if contact else [])


def changes_of(case: Case) -> dict[str, Any]:
    """A case as changes of ``base()``."""
    scene = base()
    factor = dict.fromkeys(CHOICES, 1.0) | {case.choice: case.factor}
    suspension = scene.effects["suspension"]
    assert scene.rotor.mass is not None
    mass = factor["mass"] * scene.rotor.mass
    arm, drag = scene.effects["rolling_friction"].arm, scene.effects["viscous_drag"].coefficient
    period: dict[str, Any] = (
        {"profile.variable_speed_period": None}
        if case.rpm is None
        else {
            "profile.variable_speed_period.start_speed": case.rpm * RPM,
            "profile.variable_speed_period.acceleration": case.acceleration,
        }
    )
    return {
        "rotor.mass": mass,
        "rotor.eccentricity": 1e-5 * case.unbalance / mass,
        "effects.suspension.stiffness": factor["mass"] * suspension.stiffness,
        "effects.suspension.damping": factor["mass"] * factor["damping"] * suspension.damping,
        "effects.rolling_friction.arm": factor["friction"] * arm,
        "effects.viscous_drag.coefficient": factor["drag"] * drag,
        "profile.target_speed": case.target * RPM,
        **period,
        **(OTHERS if case.others else {}),
    }


def starts(count: int) -> list[list[float]]:
    """Random places of five balls that do not touch [rad]; always the same ones."""
    random = np.random.default_rng(2014)
    found: list[list[float]] = []
    while len(found) < count:
        angles = np.sort(random.uniform(-math.pi, math.pi, 5))
        gaps = np.diff(np.append(angles, angles[0] + 2.0 * math.pi))
        if gaps.min() > CLOSEST:
            found.append(angles.tolist())
    return found


def whirl_of(scene: Scene, trajectory: Trajectory) -> list[float | None]:
    """Final whirl [um], and the balls' unbalance [g cm] (x, y)."""
    balls = _carried(scene, trajectory)[-1]
    return [1e6 * metrics_of(trajectory, scene).final_whirl, float(balls.real), float(balls.imag)]


def motion_of(scene: Scene, trajectory: Trajectory) -> list[float | None]:
    """How the balls move on their way.

    A ball's largest lag above the critical speed and largest speed over the last 0.2 s [rad/s];
    what they carry towards -180 deg ``LATER`` than the end of the period [g cm], None without one.
    """
    time, rates = trajectory["time"], trajectory.ball_rates
    above = trajectory["speed"] > CRITICAL * RPM
    last = float(np.abs(rates[time > time[-1] - 0.2]).max())
    assert isinstance(scene.profile, StartUpProfile)
    period = scene.profile.variable_speed_period
    if period is None:
        return [float(-rates[above].min()), last, None]
    assert period.start_speed is not None
    end = period.start_speed / scene.profile.acceleration + period.duration
    at = int(np.argmin(np.abs(time - end - LATER)))
    return [float(-rates[above].min()), last, -float(_carried(scene, trajectory)[at].real)]


def _carried(scene: Scene, trajectory: Trajectory) -> np.ndarray:
    """The balls' unbalance [g cm], complex, of each sample."""
    own = np.array(scene.balls.masses) * scene.race.radius
    return 1e5 * resultant(own, trajectory.ball_angles)


def mean_of(each: np.ndarray) -> tuple[float, float]:
    """A mean, and half the width of its 95 % interval."""
    return float(each.mean()), float(1.96 * each.std(ddof=1) / math.sqrt(len(each)))


def bars_of(
    what: str, cases: Sequence[Case], count: int, tell: Tell, contact: bool = True
) -> list[Bar]:
    """Each case from as many random starts."""
    begun = [{"start.ball_angles": angles} for angles in starts(count)]
    variations = [{**changes_of(case), **start} for case in cases for start in begun]
    found = many(what, base(contact), variations, whirl_of, tell)
    return [bar_of(found[count * k : count * (k + 1)]) for k in range(len(cases))]


def bar_of(found: Sequence[Sequence[float]]) -> Bar:
    """Of what ``whirl_of`` gave of each start."""
    whirl, x, y = np.array(found).T
    return Bar(whirl, x + 1j * y)


def alone(case: Case) -> float:
    """Final whirl without the balls [um]."""
    scene = changed_scene(base(), changes_of(case), "section 6.2")
    return 1e6 * run_scene(without_balls(scene)).metrics.final_whirl
