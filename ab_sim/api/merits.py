"""Calls that judge runs, and that add metrics."""

from collections.abc import Callable, Iterable

from ab_sim import analysis
from ab_sim.analysis import Merits
from ab_sim.analysis.merits.registered import Own, register_own
from ab_sim.api.common import SceneLike, as_scene
from ab_sim.drive.trajectory import Trajectory
from ab_sim.errors import InputError


def merits_of(
    trajectory: Trajectory, scene: SceneLike, keys: Iterable[str] | None = None
) -> Merits:
    """Compute metrics of a run, some or all: ``ab-sim merits`` lists them.

    Quantities that only other metrics need are not computed.

    Parameters
    ----------
    trajectory : Trajectory
        The whole run, from its start to its end; it may be thinned.
    scene : Scene, str or Path
        Scene of the run, or its name or file.
    keys : iterable of str, optional
        Names of the requested metrics; default: all.

    Returns
    -------
    Merits
        ``merits["final_whirl_over_e"]`` is one by its name, in the unit that the list gives;
        ``report()`` has all requested ones by name, JSON-able.

    Raises
    ------
    InputError
        There is no such metric, and the message names the nearest; or there are no samples.
    SceneError
        The scene is not valid.

    Notes
    -----
    Displacements are counted from where the deck hangs at rest.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["duration=0.5"])
    >>> run = ab_sim.Drive(scene).advance(500)
    >>> ab_sim.merits_of(run, scene, ["final_speed", "settled"]).report()
    {'final_speed': 20.0, 'settled': True}
    """
    if len(trajectory) == 0:
        raise InputError("trajectory: has no samples; a run is judged by at least one")
    return analysis.merits_of(trajectory, as_scene(scene), keys)


def register_merit(
    key: str,
    *,
    meaning: str,
    unit: str = "1",
    label: str = "",
    last_stretch: bool = False,
    better: str = "neither",
) -> Callable[[type[Own]], type[Own]]:
    """Return a class decorator that registers a metric of runs, in this process.

    It stands in ``ab-sim merits``, in reports, in the tables of ``ab-sim run`` and ``ab-sim
    report``, and in ``merits`` of results. The class is created for each run, with the scene and
    how many samples there are. ``take(piece)`` is called with these, a ``Trajectory`` after the
    other: a run may be longer than what fits into memory. Then ``value()`` gives the number, or
    None where it has no meaning. A text ``equation`` of the class, if it has one, is listed with
    the merit.

    Parameters
    ----------
    key : str
        Name in reports.
    meaning : str
        Meaning in a few words.
    unit : str, default "1"
        SI; "e" of a length [m] that is to be reported in eccentricities.
    label : str, optional
        Label of its row in tables, without the unit; default: the key, with spaces.
    last_stretch : bool, default False
        Whether the class receives only the last tenth of the run.
    better : str, default "neither"
        Which values are wanted: smaller, larger or neither.

    Returns
    -------
    callable
        Decorator, which returns the class.

    Raises
    ------
    ValueError
        Another metric has the key.
    InputError
        ``better`` is none of these words.

    Notes
    -----
    Displacements are counted from where the deck hangs at rest.

    Examples
    --------
    >>> import ab_sim
    >>> @ab_sim.register_merit("mean_speed", unit="rad/s", meaning="mean speed of the spindle")
    ... class MeanSpeed:
    ...     def __init__(self, scene, samples):
    ...         self.sum, self.samples = 0.0, samples
    ...     def take(self, piece):
    ...         self.sum += piece["speed"].sum()
    ...     def value(self):
    ...         return float(self.sum / self.samples)
    >>> run = ab_sim.simulate(ab_sim.load_scene("thesis-hold", ["duration=0.1"]))
    >>> round(run.merits["mean_speed"], 3), "mean_speed" in run.report()
    (2.0, True)
    """
    return register_own(key, unit, meaning, label, last_stretch, better)
