"""The call by which a program adds what runs are judged by."""

from collections.abc import Callable

from ab_sim.analysis.merits.registered import Own, register_own


def register_merit(
    key: str, *, meaning: str, unit: str = "1", label: str = "", last_stretch: bool = False
) -> Callable[[type[Own]], type[Own]]:
    """Class decorator: make a merit known, a number that runs are judged by, in this process.

    It stands in reports, in the tables of ``ab-sim run`` and ``ab-sim report``, and in ``merits``
    of results. The class is made anew for each run, with the scene and how many samples there are.
    ``take(piece)`` is called with these, a ``Trajectory`` after the other: a run may be longer than
    what fits into memory. Then ``value()`` gives the number, or None where it has no meaning.

    Parameters
    ----------
    key : str
        Its name in reports.
    meaning : str
        What it is, in a few words.
    unit : str, default "1"
        SI; "e" of a length [m] that is to be reported in eccentricities.
    label : str, optional
        Of its row in tables, without the unit; default: the key, with spaces.
    last_stretch : bool, default False
        Whether the class is shown the last tenth of the run only.

    Returns
    -------
    callable
        Takes the class and returns it.

    Raises
    ------
    ValueError
        Another merit has the key.

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
    return register_own(key, unit, meaning, label, last_stretch)
