"""Calls that differentiate runs."""

from collections.abc import Callable, Sequence

import numpy as np

from ab_sim.analysis import sensitivity
from ab_sim.analysis.sensitivity import Sensitivities
from ab_sim.api.common import SceneLike, as_scene


def sensitivities(
    scene: SceneLike,
    keys: Sequence[str],
    *,
    channels: Sequence[str] | None = None,
    times: Sequence[float] | np.ndarray | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> Sensitivities:
    """Run a scene, with the exact derivatives of its channels by numbers of the scene.

    They are derivatives of what the run computes, to rounding: tangents of all stages of all steps,
    and across events by the saltation terms.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene to run, with its own stepper if that is an explicit Runge-Kutta method, else with
        ``rk8`` and the same step.
    keys : sequence of str
        Dotted keys of real numbers in the sections rotor, deck, mounts, race, balls, effects, start
        and profile; entries of lists counted from 0: ``balls.mass``, ``balls.mass.0``,
        ``effects.suspension.stiffness``, ``start.ball_angles.1``.
    channels : sequence of str, optional
        Channels of the trajectory; default: all except ``step``, ``time`` and the sensors'.
    times : sequence of float, optional
        Times [s], increasing and on steps. The run lasts to the last of them. Default: all steps
        until ``scene.duration``.
    progress : callable, optional
        Called with the simulated time and the end time [s].

    Returns
    -------
    Sensitivities
        ``derivatives``, shape (channels, keys, samples), SI; ``trajectory``, the run with every
        step; ``times``, ``keys``, ``values``, ``channels``; ``of(channel, key)`` is one of them.

    Raises
    ------
    InputError
        A key or channel does not exist, a key is not a real number, or a time is not on a step.
    SceneError
        The scene is not valid, cannot be run with its solver, or has no derivative; the message
        names the event without one.
    DivergedError
        The state went beyond all bounds.

    Notes
    -----
    Source: Leine and Nijmeijer (2004), Dynamics and Bifurcations of Non-Smooth Mechanical Systems,
    ch. 7; Griewank and Walther (2008), Evaluating Derivatives, ch. 3.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["duration=0.1"])
    >>> found = ab_sim.sensitivities(scene, ["balls.mass", "rotor.eccentricity"])
    >>> found.derivatives.shape
    (13, 2, 101)
    >>> found.of("x", "rotor.eccentricity").shape
    (101,)
    """
    return sensitivity.sensitivities(as_scene(scene), keys, channels, times, progress)
