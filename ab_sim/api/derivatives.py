"""Calls that differentiate runs."""

from collections.abc import Callable, Sequence

import numpy as np

from ab_sim.api.common import SceneLike, as_scene
from ab_sim.design import derivatives
from ab_sim.design.derivatives import MeritSensitivities, Sensitivities


def merit_sensitivities(
    scene: SceneLike,
    keys: Sequence[str],
    merits: Sequence[str],
    *,
    progress: Callable[[int, int], None] | None = None,
) -> MeritSensitivities:
    """Differentiate merits of a scene's run by values of the scene.

    Derivatives are differences of whole runs, side by side, with their uncertainty.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene to run, with its own stepper.
    keys : sequence of str
        Dotted keys of real numbers in the sections rotor, deck, mounts, race, balls, effects, start
        and profile; entries of lists counted from 0: ``balls.mass``, ``balls.mass.0``,
        ``effects.suspension.stiffness``, ``start.ball_angles.1``.
    merits : sequence of str
        Names of merits that are numbers: `ab-sim merits` lists them.
    progress : callable, optional
        Called with (runs done, runs) of each batch of runs.

    Returns
    -------
    MeritSensitivities
        ``derivatives`` and their ``uncertainties``, shape (merits, keys), NaN where a merit is not
        differentiable; ``elasticities``, percent per percent.

    Raises
    ------
    InputError
        There is no such key or merit; it is no real number; a merit has no value in this run, or is
        the time of a sample.
    SceneError
        The scene is not valid, or cannot be run with its solver.
    DivergedError
        The state went beyond all bounds.

    Notes
    -----
    Source: Moré and Wild (2011), SIAM J. Sci. Comput. 33, 1292, for the step; Richardson (1911),
    Phil. Trans. R. Soc. A 210, 307.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["duration=0.1"])
    >>> found = ab_sim.merit_sensitivities(scene, ["balls.mass"], ["final_whirl_over_e"])
    >>> found.derivatives.shape
    (1, 1)
    >>> bool((found.elasticity_uncertainties < 1e-6).all())
    True
    """
    return derivatives.merit_sensitivities(as_scene(scene), keys, merits, progress)


def sensitivities(
    scene: SceneLike,
    keys: Sequence[str],
    *,
    channels: Sequence[str] | None = None,
    times: Sequence[float] | np.ndarray | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sensitivities:
    """Differentiate channels of a scene's run by values of the scene.

    Derivatives are differences of whole runs, side by side, with their uncertainty.

    Parameters
    ----------
    scene, keys
        See ``merit_sensitivities``.
    channels : sequence of str, optional
        Channels of the trajectory; default: all except ``step``, ``time`` and the sensors'.
    times : sequence of float, optional
        Times [s], increasing and on steps. The run lasts to the last of them. Default: all steps
        until ``scene.duration``.
    progress : callable, optional
        Called with (runs done, runs) of each batch of runs.

    Returns
    -------
    Sensitivities
        ``derivatives`` and their ``uncertainties``, shape (channels, keys, samples), SI;
        ``trajectory``, the run with every step; ``times``, ``keys``, ``values``, ``channels``;
        ``of(channel, key)`` is one of them.

    Raises
    ------
    InputError
        A key or channel does not exist, a key is not a real number, or a time is not on a step.
    SceneError
        The scene is not valid, or cannot be run with its solver.
    DivergedError
        The state went beyond all bounds.

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
    return derivatives.sensitivities(as_scene(scene), keys, channels, times, progress)
