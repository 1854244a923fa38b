"""Description of a run, kept with its results, and quantities that explain it in pictures."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ab_sim.base.version import __version__
from ab_sim.drive.closed_forms import DrivenBalls, RotorWithoutBalls, balance_of
from ab_sim.drive.observation import channels_of
from ab_sim.engine.integrate.choose import choose_stepper
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.spindle import SpeedSchedule, top_speed_of
from ab_sim.scene.model import Scene

_PEAK = 0.15
"""Scale of a drawing as a fraction of the whirl at the critical speed; more whirl is cut off."""
_MOVES_THE_DECK = ("deck_force", "space_force")


def explain(scene: Scene) -> dict[str, Any]:
    """Return the quantities that explain a run; each is None if it has no meaning.

    Returns
    -------
    dict[str, Any]
        - ``motion``: expected size of the deck's motion [m], for the scale of a drawing.
        - ``unbalance``, ``moments``: M0 e and m_i R [kg m].
        - ``balance``: fields of `Balance`, or ``left_out`` with the reason for none.
        - ``without_balls``: fields of `RotorWithoutBalls`, or ``left_out`` with the reason.
        - ``driven``: fields of `DrivenBalls`.
        - ``critical_speed``, ``top_speed``: that of the suspension and of the profile [rad/s].
        - ``variable_speed_period``: ``start_speed``, ``end_speed`` [rad/s], ``acceleration`` during
          the period, and ``around`` it [rad/s^2].
    """
    return {
        "motion": _motion(scene),
        "unbalance": _unbalance(scene),
        "moments": [mass * scene.race.radius for mass in scene.balls.masses],
        "balance": _balance(scene),
        "without_balls": _without_balls(scene),
        "driven": _listed(DrivenBalls.of(scene)) if scene.balls.count else None,
        "critical_speed": scene.critical_speed if scene.deck is None else None,
        "top_speed": top_speed_of(scene) if scene.profile else scene.spindle.max_speed,
        "variable_speed_period": _period(scene),
    }


def _listed(values: Any) -> dict[str, Any]:
    """Return the fields of a named tuple as a JSON-able mapping, with tuples as lists."""
    fields = values._asdict()
    return {name: list(v) if isinstance(v, tuple) else v for name, v in fields.items()}


def _unbalance(scene: Scene) -> float:
    """Return the rotor's unbalance M0 e [kg m]."""
    return scene.eccentric_mass * scene.rotor.eccentricity


def _motion(scene: Scene) -> float:
    """Return the expected size of the deck's motion [m], for the scale of a drawing."""
    # Far above all critical speeds, without balls: the inertia yields to the unbalance.
    whirl, deck = _unbalance(scene) / scene.total_mass, scene.deck
    if deck is None:
        return max(whirl, _PEAK * _peak(scene))
    tilt = 2.0 * abs(scene.couple_unbalance) / (deck.inertia[0] + deck.inertia[1])
    mounts = (math.hypot(*mount.position) for mount in scene.mounts)
    return whirl + tilt * max(mounts, default=scene.race.radius)


def _peak(scene: Scene) -> float:
    """Return the whirl at the critical speed without balls [m].

    If there is no closed form or no damping, return 0.
    """
    rotor, top = _without_balls(scene), top_speed_of(scene)
    if "left_out" in rotor or not rotor["damping"] > 0.0:
        return 0.0
    critical = math.sqrt(rotor["stiffness"] / rotor["mass"])
    return float(RotorWithoutBalls(**rotor).whirl(np.array(min(critical, top))))


def _balance(scene: Scene) -> dict[str, Any] | None:
    """Return the fields of ``Balance``, or the reason why a balanced position is not given."""
    if "race_runout" in scene.effects:
        return {"left_out": "the race has a runout"}
    if len({*scene.balls.races}) > 1:
        return {"left_out": "the balls run in several planes"}
    moments = [mass * scene.race.radius for mass in scene.balls.masses]
    balance = balance_of(_unbalance(scene), moments)
    return None if balance is None else _listed(balance)


def _without_balls(scene: Scene) -> dict[str, Any]:
    """Return the fields of the rotor without balls, or the reason why they are left out."""
    if scene.deck is not None:
        return {"left_out": "the deck moves in space"}
    others = {name: effect for name, effect in scene.effects.items() if name != "suspension"}
    for name, effect in others.items():
        pulls = name == "gravity" and any(effect.gravity())
        if pulls or any(hasattr(effect, part) for part in _MOVES_THE_DECK):
            return {"left_out": f"the scene has the effect {name}"}
    suspension = scene.effects.get("suspension")
    return _listed(
        RotorWithoutBalls(
            scene.total_mass - scene.balls.total_mass,
            _unbalance(scene),
            0.0 if suspension is None else suspension.stiffness,
            0.0 if suspension is None else suspension.damping,
        )
    )


def _period(scene: Scene) -> dict[str, float] | None:
    """Return speeds and accelerations of the variable-speed period; None without one."""
    profile = scene.profile
    if profile is None or profile.kind != "start_up" or profile.variable_speed_period is None:
        return None
    schedule = SpeedSchedule.of_scene(scene)
    begins = schedule.variable_speed_period
    if begins is None:  # The speed lies below the scene's start speed.
        return None
    middle = begins + 0.5 * profile.variable_speed_period.duration
    scheduled = schedule.segment_at(middle)
    start, end = (float(scheduled.law.speed(t)) for t in (0.0, scheduled.end - scheduled.start))
    return {
        "start_speed": start,
        "end_speed": end,
        "acceleration": profile.variable_speed_period.acceleration,
        "around": profile.acceleration,
    }


def describe(scene: Scene, accuracy: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Describe the components of a scene's run as JSON-able values.

    ``check_scene(describe(scene)["scene"], "a recording")`` returns the scene.

    Parameters
    ----------
    scene
        Scene with the solver that the drive uses, not with an accuracy, so that a repetition gives
        the same bits.
    accuracy
        Origin of that solver, ``WorkPrecision.report``; None if no accuracy was requested.
    """
    radii, system = scene.balls.radii, system_of(scene)
    return {
        "version": __version__,
        "scene": scene.as_mapping(),
        "effects": list(scene.effects),
        "sensors": list(scene.sensors),
        "stepper": choose_stepper(scene, system).stepper.name,
        "step": scene.solver.step,
        "channels": list(channels_of(scene, system)),
        "accuracy": None if accuracy is None else dict(accuracy),
        "race_radius": scene.race.radius,
        "eccentricity": scene.rotor.eccentricity,
        "balls": scene.balls.count,
        "ball_radii": None if any(map(math.isnan, radii)) else list(radii),
        "deck": None if scene.deck is None else _in_space(scene),
        **explain(scene),
    }


def _in_space(scene: Scene) -> dict[str, Any]:
    """Return the positions of a deck's parts in space, on deck axes [m]."""
    heights = scene.race.heights
    return {
        "mounts": [list(mount.position) for mount in scene.mounts],
        "race_heights": list(heights),
        "ball_heights": [heights[race] for race in scene.balls.races],
        "rotor_height": scene.rotor.height,
    }
