"""Identifiable and unidentifiable parameters by theory, for several sets of recordings.

The deck's equation, divided by the total mass M, has k/M, c/M, M0 e/M and m/M (docs/equations.md);
a ball's equation, divided by its mass m and the race's radius R, has d/m, x''/R and the arm. A
change of parameters that keeps all of these, and the signals' gain, cannot be identified.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.comparison import without_balls
from ab_sim.analysis.offline import run_scene
from ab_sim.design.draws import value_of
from ab_sim.identification.knowledge import OpenDirection, knowledge_before, knowledge_of
from ab_sim.identification.measured import ACCELERATION, DISPLACEMENT, Measured
from ab_sim.identification.parameters import fitted_parameters
from ab_sim.identification.problem import Problem
from ab_sim.identification.residuals import noises_of
from ab_sim.model.spindle import Ramp, SpeedSchedule
from ab_sim.scene import Scene
from ab_sim.scene.load import changed_scene

M, M0, R = "rotor.total_mass", "rotor.eccentric_mass", "race.radius"
K, C = "effects.suspension.stiffness", "effects.suspension.damping"
E, BALL, DRAG = "rotor.eccentricity", "balls.mass", "effects.viscous_drag.coefficient"
ARM, MU = "effects.rolling_friction.arm", "effects.race_friction.coefficient"
G, GB = "gain of with", "gain of bare"
DECK, BALLS = (K, C, E), (BALL, DRAG)
TRIAL = 0.005
"""Trial mass [kg]."""
NOISE = 0.01
"""Standard deviation of the noise relative to the signals' r.m.s."""
ABOVE, BELOW = 1.7, 0.6
"""Speeds of a hold relative to the critical speed."""


class Recorded(NamedTuple):
    """Conditions of a recording."""

    balls: bool = True
    hold: float = 0.0
    """Constant speed relative to the critical one; 0 for a start-up from rest."""
    kind: str = DISPLACEMENT
    axes: int = 2
    free: tuple[str, ...] = ()
    trial: bool = False
    """True if a trial mass is clamped to the deck."""


class Case(NamedTuple):
    """Fitted keys, recordings, and the unidentifiable directions that theory predicts."""

    name: str
    fit: tuple[str, ...]
    recorded: tuple[Recorded, ...]
    unknown: tuple[frozenset[str], ...]
    """Parameters that change along each unidentifiable direction."""
    changes: Mapping[str, Any] = {}
    """Changes of the scene by dotted key."""


WITH, BARE = Recorded(), Recorded(balls=False)


def _all(*names: str) -> frozenset[str]:
    return frozenset(names)


SCALE = _all(M, K, C, BALL, DRAG)
FRICTION = {"effects.rolling_friction": {"arm": 2e-6}, "balls.radius": 1e-3}
STUCK = {
    "effects.rolling_friction": {"arm": 1e-3}, "balls.radius": 1e-3, "start.speed": 40.0,
}  # fmt: skip
CUBIC = "effects.hardening_suspension.cubic_stiffness"
UNEQUAL = tuple(
    f"effects.unequal_suspension.{name}"
    for name in ("stiffness_1", "stiffness_2", "damping_1", "damping_2", "axis_angle")
)
TWO_SPRINGS = {
    "effects.suspension": None,
    "effects.unequal_suspension": {
        "stiffness_1": 900.0, "stiffness_2": 1150.0, "damping_1": 2.0, "damping_2": 2.5,
        "axis_angle": 0.3,
    },
}  # fmt: skip
TILT, FALL = "effects.gravity.tilt", "effects.gravity.acceleration"
UNEQUAL_MASSES, HEAVY = {"balls.mass": "unequal"}, {"balls.mass": "heavy"}
CASES = (
    Case("with and without balls, mass known", DECK + BALLS, (WITH, BARE), ()),
    Case("with and without balls, mass fitted", (*DECK, *BALLS, M), (WITH, BARE), (SCALE,)),
    Case("acceleration", DECK + BALLS, tuple(r._replace(kind=ACCELERATION) for r in (WITH, BARE)),
         ()),
    Case("acceleration, mass fitted", (*DECK, *BALLS, M),
         tuple(r._replace(kind=ACCELERATION) for r in (WITH, BARE)), (SCALE,)),
    Case("one axis", DECK + BALLS, (WITH._replace(axes=1), BARE._replace(axes=1)), ()),
    Case("one axis, mass fitted", (*DECK, *BALLS, M),
         (WITH._replace(axes=1), BARE._replace(axes=1)), (SCALE,)),
    Case("with balls only", DECK + BALLS, (WITH,), ()),
    Case("balls' mass known, deck's mass fitted", (*DECK, DRAG, M), (WITH, BARE), ()),
    Case("trial mass", (*DECK, *BALLS, M), (WITH, BARE, BARE._replace(trial=True)), ()),
    Case("trial mass, without balls", (*DECK, M), (BARE, BARE._replace(trial=True)), ()),
    Case("without balls", DECK, (BARE,), ()),
    Case("without balls, mass fitted", (*DECK, M), (BARE,), (_all(M, K, C),)),
    Case("without balls, gain unknown", DECK, (BARE._replace(free=("gain",)),), (_all(GB, E),)),
    Case("without balls, neither mass nor gain known", (*DECK, M),
         (BARE._replace(free=("gain",)),), (_all(M, K, C), _all(GB, E))),
    Case("without balls, balls' parameters fitted", DECK + BALLS, (BARE,),
         (_all(BALL), _all(DRAG))),
    Case("without balls, eccentric mass fitted", (*DECK, M0), (BARE,), (_all(M0, E),)),
    Case("without balls, angle of the disc and delay free", DECK,
         (BARE._replace(free=("disc_angle", "delay")),), ()),
    Case("with balls, gain unknown", DECK + BALLS, (WITH._replace(free=("gain",)), BARE), ()),
    Case("gain of both unknown", DECK + BALLS,
         (WITH._replace(free=("gain",)), BARE._replace(free=("gain",))), ()),
    Case("gain of both unknown, race's radius fitted", (*DECK, *BALLS, R),
         (WITH._replace(free=("gain",)), BARE._replace(free=("gain",))), (_all(G, GB, E, R),)),
    Case("race's radius fitted", (*DECK, *BALLS, R), (WITH, BARE), ()),
    Case("friction, moving balls", (*DECK, *BALLS, ARM), (WITH, BARE), (), FRICTION),
    Case("friction of two kinds", (*DECK, *BALLS, ARM, MU), (WITH, BARE), (_all(ARM, MU),),
         {**FRICTION, "effects.race_friction": {"coefficient": 1e-3}}),
    Case("friction, ball radius fitted", (*DECK, *BALLS, ARM, "balls.radius"), (WITH, BARE),
         (_all(ARM, "balls.radius"),), FRICTION),
    Case("friction, mass fitted", (*DECK, *BALLS, ARM, M), (WITH, BARE), (SCALE,), FRICTION),
    Case("hardening suspension, mass fitted", (*DECK, *BALLS, CUBIC, M), (WITH, BARE),
         (_all(*SCALE, CUBIC),), {"effects.hardening_suspension": {"cubic_stiffness": 1e8}}),
    Case("unequal suspension", (*UNEQUAL, E, *BALLS), (WITH, BARE), (), TWO_SPRINGS),
    Case("unequal suspension, one axis, mass fitted", (*UNEQUAL, E, M),
         (BARE._replace(axes=1),), (_all(M, *UNEQUAL[:4]),), TWO_SPRINGS),
    Case("gravity, size and tilt fitted", (*DECK, *BALLS, FALL, TILT), (WITH, BARE),
         (_all(FALL, TILT),), {"effects.gravity": {"tilt": 0.5, "acceleration": 9.8}}),
    Case("balls stick all the time", (*DECK, *BALLS, ARM), (WITH, BARE), (_all(DRAG), _all(ARM)),
         STUCK),
    Case("balls of unequal mass", (*DECK, f"{BALL}.0", f"{BALL}.1", DRAG), (WITH, BARE), (),
         UNEQUAL_MASSES),
    Case("balls of unequal mass, deck's mass fitted", (*DECK, f"{BALL}.0", f"{BALL}.1", DRAG, M),
         (WITH, BARE), (_all(M, K, C, f"{BALL}.0", f"{BALL}.1", DRAG),), UNEQUAL_MASSES),
    Case("one speed held above the critical speed, without balls", DECK,
         (BARE._replace(hold=ABOVE),), (_all(K, C, E),)),
    Case("one speed held below the critical speed, without balls", DECK,
         (BARE._replace(hold=BELOW),), (_all(K, C, E),)),
    Case("one speed held, mass fitted, without balls", (*DECK, M),
         (BARE._replace(hold=ABOVE),), (_all(M, K, C), _all(K, C, E))),
    Case("two speeds held, without balls", DECK,
         (BARE._replace(hold=ABOVE), BARE._replace(hold=BELOW)), ()),
    Case("one speed held, balls have balanced", DECK + BALLS, (WITH._replace(hold=ABOVE),),
         tuple(_all(name) for name in DECK + BALLS), HEAVY),
)  # fmt: skip


def problem_of(
    case: Case, scene: Scene, guess: Scene, seed: int
) -> tuple[Problem, np.ndarray]:  # fmt: skip
    """Return the problem of a case, and the true values of its parameters.

    Parameters
    ----------
    case
        Recordings and fitted keys.
    scene
        Drive with two equal balls.
    guess
        Scene with the start values of the fit.
    seed
        Seed of the noise.
    """
    # What is not asked for is known.
    known = {key: value_of(guess, key) for key in DECK + BALLS if key in case.fit}
    guess = _changed(case, changed_scene(scene, known, guess.name), scene)
    scene = _changed(case, scene, scene)
    numbers = np.random.default_rng([seed, 13])
    made = [_measured(scene, each, k, numbers, case) for k, each in enumerate(case.recorded)]
    recordings = [each for each, _ in made]
    common = fitted_parameters(guess, case.fit, {})
    problem = Problem(guess, common, recordings, noises_of(recordings))
    true = problem.start
    own = {name: value for _, known in made for name, value in known.items()}
    for j, each in enumerate(problem.parameters):
        if each.key is not None and each.recording is None:
            true[j] = value_of(scene, each.key)
        else:
            true[j] = own.get(each.name, true[j])
    return problem, true


def opened_in(problem: Problem, true: np.ndarray, seed: int) -> list[OpenDirection]:
    """Return the directions that an identification reports as open, before and after the fit.

    Parameters
    ----------
    problem
        Problem of the fit.
    true
        True values of the parameters, in place of a fit.
    seed
        Seed of the start angles for the evaluation before the fit.
    """
    before = knowledge_before(problem, seed)
    return [*before.open, *knowledge_of(problem, true, before.held).open]


def _changed(case: Case, scene: Scene, true: Scene) -> Scene:
    """Return a scene with the changes of a case."""
    mass = true.balls.masses[0]
    own = {"unequal": [0.8 * mass, 1.2 * mass], "heavy": 1.5 * mass}
    changes = {
        key: own[value] if isinstance(value, str) else value for key, value in case.changes.items()
    }
    if M0 in case.fit:
        changes[M0] = 0.09
    return changed_scene(scene, changes, scene.name)


def _measured(
    scene: Scene, how: Recorded, number: int, numbers: np.random.Generator, case: Case
) -> tuple[Measured, dict[str, float]]:
    """Return a recording, and the true values of its own parameters by name."""
    name = "with" if how.balls else "bare"
    name += f" {number + 1}" if number > 1 or (how.hold and number) else ""
    if how.trial:
        name = "trial"
        scene = changed_scene(
            scene, {M: scene.rotor.total_mass + TRIAL, M0: scene.eccentric_mass}, name
        )
    if how.hold:
        scene = _held(scene, how.hold, case.changes is HEAVY)
    run = run_scene(scene if how.balls else without_balls(scene)).trajectory
    first = 0 if not how.hold else len(run) // 2
    begin = float(run["time"][first])
    across = run.position[:, :2] if how.kind == DISPLACEMENT else run.acceleration[:, :2]
    size = max(float(np.sqrt(np.mean(across[first + 1 :] ** 2))), 1e-3 * scene.whirl_unit[0])
    noisy = across + NOISE * size * numbers.standard_normal(across.shape)
    schedule = SpeedSchedule.of_scene(scene)
    if how.hold:
        speed = float(run["speed"][first])
        still = [(scene.duration - begin, Ramp(speed, 0.0))]
        schedule = SpeedSchedule(still, speed, 0.0, float(run["angle"][first]))
    own = _own(scene, run, first, name, how)
    measured = Measured(
        name, run["time"][first + 1 :] - begin, noisy[first + 1 :, : how.axes],
        (0.0, math.pi / 2)[: how.axes], how.kind, schedule, "disc_angle" not in how.free, how.balls,
        free=how.free, at_rest=not how.hold, trial_mass=TRIAL if how.trial else 0.0,
    )  # fmt: skip
    return measured, own


def _held(scene: Scene, of_critical: float, balanced: bool) -> Scene:
    """Return a scene at constant speed from the start, twice as long as the recording."""
    critical = scene.critical_speed or 0.0
    changes: dict[str, Any] = {
        "start.speed": of_critical * critical,
        "profile": {"kind": "segments", "segments": [{"hold": 6.0}]},
        "duration": 6.0,
    }
    if balanced:
        # Both balls where they make up for the eccentricity.
        share = scene.eccentric_mass * scene.rotor.eccentricity
        share /= 2.0 * scene.balls.masses[0] * scene.race.radius
        changes["start.ball_angles"] = [math.acos(-share), -math.acos(-share)]
    return changed_scene(scene, changes, "held")


def _own(scene: Scene, run: Any, first: int, name: str, how: Recorded) -> dict[str, float]:
    found = {f"disc angle of {name}": float(run["angle"][first])}
    if how.balls:
        for ball, angle in enumerate(run.ball_angles[first].tolist()):
            found[f"start angle of ball {ball} of {name}"] = angle
            found[f"start rate of ball {ball} of {name}"] = float(run[f"ball_{ball}_rate"][first])
    if how.hold:
        for axis in ("x", "y", "vx", "vy"):
            found[f"start {axis} of {name}"] = float(run[axis][first])
    return found
