"""Calls that measure costs of accuracy and effects, and deviations of recordings from scenes."""

from collections.abc import Callable, Sequence
from pathlib import Path

from ab_sim.api.common import SceneLike, as_scene
from ab_sim.progress import Progress
from ab_sim.recording import StoredRun, open_recording
from ab_sim.reports.compare import RecordingComparison, compare_with
from ab_sim.studies import accuracy_cost as accuracy_study
from ab_sim.studies import effect_cost as effect_study
from ab_sim.studies.accuracy_cost import AccuracyCost
from ab_sim.studies.accuracy_cost.families import TOLERANCES
from ab_sim.studies.accuracy_cost.sampling import LADDER
from ab_sim.studies.effect_cost import EffectCost


def accuracy_cost(
    scene: SceneLike,
    repeats: int = accuracy_study.REPEATS,
    *,
    steps: Sequence[float] = LADDER,
    tolerances: Sequence[float] = TOLERANCES,
    progress: Progress | None = None,
) -> AccuracyCost:
    """Measure error and CPU time of every method at every setting: ``ab-sim accuracy``.

    This takes minutes for a scene of seconds.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene to run.
    repeats : int, default 9
        Rounds in which all settings are timed in turns.
    steps : sequence of float, optional
        Steps to try [s], whole nanoseconds.
    tolerances : sequence of float, optional
        Relative tolerances to try for peers that choose their steps; empty: such peers are left
        out.
    progress : callable, optional
        Called with the present work, the finished count and the total.

    Returns
    -------
    AccuracyCost
        ``rows``: errors of ball angle [rad] and whirl [e], and CPU seconds per simulated second;
        ``cheapest(error)``.

    Raises
    ------
    SceneError
        The scene cannot run.
    InputError
        ``repeats`` is below 1, the scene is too short, or no reference can be made.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("nsc-case-1", ["duration=0.1"])
    >>> cost = ab_sim.accuracy_cost(scene, repeats=1, steps=[1e-3], tolerances=[1e-8])
    >>> cost.cheapest(1e-4, peer=False) in cost.rows
    True
    """
    own = as_scene(scene)
    return accuracy_study.measure(own, repeats, progress, steps=steps, tolerances=tolerances)


def effect_cost(
    scene: SceneLike,
    repeats: int = effect_study.REPEATS,
    *,
    leave_one_out: bool = False,
    progress: Progress | None = None,
) -> EffectCost:
    """Measure the cost per step of each effect and sensor of a scene: ``ab-sim cost``.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene to run, for at most 10,000 steps.
    repeats : int, default 15
        Rounds in which all variants are timed in turns.
    leave_one_out : bool, default False
        Also measure the scene's effects less each of them.
    progress : callable, optional
        Called with the present work, the finished count and the total.

    Returns
    -------
    EffectCost
        ``rows``, one for each variant: ns per step, and events per 1000 steps.

    Raises
    ------
    SceneError
        An effect is refused with any of the scene's others.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("nsc-case-1", ["duration=0.05"])
    >>> [row.name for row in ab_sim.effect_cost(scene, repeats=1).rows][0]
    'no effects'
    """
    return effect_study.measure(as_scene(scene), repeats, leave_one_out, progress)


def compare_recording(
    recording: StoredRun | Path | str,
    scene: SceneLike,
    *,
    progress: Callable[[int], None] | None = None,
) -> RecordingComparison:
    """Run a scene under a recording's commands, and compare each channel: ``ab-sim compare``.

    Parameters
    ----------
    recording : StoredRun, Path or str
        Result of ``open_recording``, or an .rrd file.
    scene : Scene, str or Path
        Scene to run as recorded.
    progress : callable, optional
        Called with the number of compared samples.

    Returns
    -------
    RecordingComparison
        ``deviations``, one for each channel that both have, in its unit: largest and r.m.s.;
        ``same``: whether all of them are the same to the bit.

    Raises
    ------
    RecordingError
        The recording cannot be read.
    SceneError, InputError
        The two have nothing in common, or the scene does not take the commands.
    DivergedError
        The state went beyond all bounds.

    Examples
    --------
    >>> import ab_sim, tempfile, pathlib
    >>> scene = ab_sim.load_scene("thesis-hold", ["duration=0.1"])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "run.rrd")
    ...     ab_sim.save_recording(ab_sim.simulate(scene), file)
    ...     ab_sim.compare_recording(file, scene)
    <RecordingComparison: scene thesis-hold, samples 101, channels 13, the same to the bit True>
    """
    run = recording if isinstance(recording, StoredRun) else open_recording(recording)
    return compare_with(run, as_scene(scene), progress)
