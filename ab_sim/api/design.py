"""Functions for design decisions over many drives."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from ab_sim.base.errors import InputError, short
from ab_sim.base.presentation import Progress
from ab_sim.base.workers import Workers
from ab_sim.design import sweep as sweeps
from ab_sim.design.bounds import bound_of
from ab_sim.design.cluster import Cluster
from ab_sim.design.points import Range, Variable, points_of, range_, values, variable_of
from ab_sim.design.search import Task
from ab_sim.design.spread import Spread
from ab_sim.design.spread_runs import SpreadQuestion, run_spread
from ab_sim.design.sweep import DEFAULT_METRICS, Sweep
from ab_sim.design.tolerances import Tolerance, fitted_tolerances, tolerance_of
from ab_sim.design.tune import DRAWS, RUNS, SHARE, Tuning, aim_of, run_tuning
from ab_sim.design.work import Executor
from ab_sim.scene.load import SceneLike, as_scene

Over = Mapping[str, str | Sequence[object]]
"""Values by dotted key: a list, or a text as on the command line, ``"0.5 g..3 g:26"``; for a
design, the two ends of a range."""


def sweep(
    scene: SceneLike,
    over: Over,
    metrics: Iterable[str] = DEFAULT_METRICS,
    *,
    design: str | None = None,
    seed: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Sweep:
    """Run a scene over values of its keys, and judge each run by metrics: ``ab-sim sweep``.

    Finished runs are kept on disk: an interrupted sweep continues when it is called again.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene to run, or its name or file.
    over : mapping of str
        Values of each dotted key: a list, or a text, ``"0.5 g..3 g:26"`` (evenly spaced),
        ``"log:0.1..10:20"`` or ``"0.001,0.002"``. All combinations are run. For a design, the
        range of each key: two numbers, or a text, ``"0.1..10"`` or ``"log:0.1..10"``.
    metrics : iterable of str, optional
        Names of numeric metrics; ``ab-sim metrics`` lists them.
    design : str, optional
        ``"sobol:1024"``, a scrambled Sobol sequence, or ``"lhs:1000"``, a Latin hypercube, instead
        of a grid.
    seed : int, default 0
        Seed of a design's random numbers.
    workers : int, default 1
        Number of processes; more than one needs a program with ``if __name__ == "__main__":``.
    scheduler : str, optional
        Address of a Dask cluster to use instead of local processes, e.g. ``"tcp://10.0.0.1:8786"``;
        its workers need the same version of ab_sim.
    progress : callable, optional
        Called with the name of the current work, the number of finished runs and the total.

    Returns
    -------
    Sweep
        ``table``, a pyarrow.Table with a row for each run: its number, the keys' values, metrics,
        ``outcome``, ``failure``; ``sweep["balls.mass"]``, a column as an array of shape (runs,);
        ``best(metric)``, the number of a run; ``scene_of(run)``, to run it again.

    Raises
    ------
    SceneError
        The scene is not valid, or none of the first points gives a valid scene.
    InputError
        A key, value, metric, design or address cannot be used, or another process computes the same
        sweep.
    AbSimError
        A worker process has ended, or the cluster cannot be used; finished runs are kept.

    Notes
    -----
    A failed run has its reason in its row; others continue. Results do not depend on the
    number of processes or machines, nor on interruptions. scipy.stats.qmc makes the designs.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["duration=0.2"])
    >>> result = ab_sim.sweep(scene, {"balls.mass": "1 g..2 g:3"}, ["peak_whirl_over_e"])
    >>> result["balls.mass"].tolist(), result.shape
    ([0.001, 0.0015, 0.002], (3,))
    >>> result.scene_of(2).balls.masses
    (0.002, 0.002)
    """
    executor = executor_of(workers, scheduler)
    variables = [_variable(key, text, design is not None) for key, text in _mapping(over).items()]
    points = points_of(variables, design, seed)
    return sweeps.run_sweep(as_scene(scene), points, metrics, executor, progress)


def tune(
    scene: SceneLike,
    vary: Over,
    *,
    minimise: str | None = None,
    maximise: str | None = None,
    subject_to: Iterable[str] = (),
    spread: Mapping[str, str | Sequence[str]] | None = None,
    draws: int = DRAWS,
    share: float = SHARE,
    runs: int = RUNS,
    seed: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Tuning:
    """Find the values of keys that optimise a metric within bounds: ``ab-sim tune``.

    Only settled runs count: those that did not fail, whose balls do not circulate, and whose whirl
    is steady. Finished runs are kept, as in ``sweep``.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene to run, or its name or file.
    vary : mapping of str
        Ranges by dotted key: two numbers, or a text, ``"0.5 g..3 g"`` or ``"log:0.1..10"``. Keys
        that take whole numbers stay whole.
    minimise, maximise : str, optional
        Metric to minimise or to maximise.
    subject_to : iterable of str, optional
        Further conditions, e.g. ``"final_whirl_over_e<0.2"``, ``"balanced"``.
    spread : mapping of str, optional
        Tolerances of built drives, as in ``robust``. The metric is then the value that a share of
        the drives reaches, and bounds must hold for that share.
    draws : int, default 32
        Number of drives for each candidate; all candidates have the same draws.
    share : float, default 0.9
        Share of the drives that must settle within all bounds and reach the metric, above 0, at
        most 1.
    runs : int, default 1000
        Approximate largest number of runs, without those that explore the neighbourhood of the
        best.
    seed : int, default 0
        Seed of the search. The same seed gives the same answer.
    workers : int, default 1
        Number of processes; more than one needs a program with ``if __name__ == "__main__":``.
    scheduler : str, optional
        Address of a Dask cluster that does the work instead; see ``sweep``.
    progress : callable, optional
        Called with the best result so far, the number of finished runs and the total.

    Returns
    -------
    Tuning
        ``values`` by key, ``best``, the metric there, and ``scene``, to run it; None and empty if
        no run has settled and kept all bounds. ``nearby``, ``before``, ``active``: results near
        the best, result of the original scene, and active bounds. ``runs``, a Sweep of all.

    Raises
    ------
    SceneError
        The scene is not valid, or the middle of the ranges is not a valid scene.
    InputError
        A key, range, metric or bound cannot be used; or another process runs the same search.

    Notes
    -----
    Differential evolution (Storn and Price 1997) on whole populations, then Nelder and Mead's
    simplex from the best; both of scipy.optimize.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("no-ball", ["duration=0.5"])
    >>> result = ab_sim.tune(
    ...     scene, {"rotor.eccentricity": (1e-5, 1e-3)}, minimise="peak_whirl_over_e", runs=20
    ... )
    >>> 1e-5 <= result.values["rotor.eccentricity"] <= 1e-3, result.best < 1.0
    (True, True)
    """
    if draws < 2:
        raise InputError(f"draws = {draws}: must be at least 2")
    tolerances = tuple(_tolerances(spread or {}))
    draws = draws if tolerances else 1
    task = Task(
        as_scene(scene),
        tuple(_range(key, limits) for key, limits in _mapping(vary).items()),
        aim_of(minimise, maximise),
        tuple(bound_of(bound) for bound in subject_to),
        runs // draws,
        seed,
        tolerances,
        draws,
        share if tolerances else 1.0,
    )
    return run_tuning(task, executor_of(workers, scheduler), progress)


def robust(
    scene: SceneLike,
    spread: Mapping[str, str | Sequence[str]] | None = None,
    metrics: Iterable[str] = DEFAULT_METRICS,
    *,
    runs: int = 10_000,
    balanced: str | Iterable[str] = ("balanced",),
    until: float | None = None,
    against: SceneLike | None = None,
    spread_from: Path | str | None = None,
    sobol: int | None = None,
    seed: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Spread:
    """Estimate the share of built drives that balance, given tolerances: ``ab-sim robust``.

    Finished runs are kept on disk: more runs, or a finer ``until``, continue from there.

    Parameters
    ----------
    scene : Scene, str or Path
        Nominal scene, or its name or file.
    spread : mapping of str, optional
        Tolerances by dotted key: ``"5%"`` (normal, about the scene's value), ``"0.1 mm"`` (so, in
        its unit), ``"normal:MEAN,SD"``, ``"lognormal:MEDIAN,40%"``, ``"uniform:LOW,HIGH"``,
        ``"uniform:5%"``, ``"discrete:V,V"``; ``"random"`` for ``start.ball_angles``. Options
        follow: ``low=NUMBER``, ``high=NUMBER``, ``per ball``, ``group=NAME``, separated by commas.
        A list combines several tolerances of one key.
    metrics : iterable of str, optional
        Names of numeric metrics to report quantiles of.
    runs : int, default 10000
        Number of drives; with ``until``, the minimum.
    balanced : str or iterable of str, default the metric of that name
        Conditions on a settled run, e.g. ``"residual_unbalance<=0.1"``.
    until : float, optional
        Half-width of the share's interval, 0 to 1, at which the runs stop.
    against : Scene, str or Path, optional
        Scene of another design to compare with, run with the same draws.
    spread_from : Path or str, optional
        JSON of an identification: uncertainties of a fitted scene with their correlations, in
        addition to ``spread``.
    sobol : int, optional
        Number of pairs of drives for Sobol indices, a power of 2; 0 for none. They need ``sobol``
        additional runs for each spread or group. Default: the largest number that needs at most
        ``runs / 2`` additional runs; none if that is fewer than 128 pairs.
    seed : int, default 0
        Seed of the random draws.
    workers : int, default 1
        Number of processes; more than one needs a program with ``if __name__ == "__main__":``.
    scheduler : str, optional
        Address of a Dask cluster that does the work instead; see ``sweep``.
    progress : callable, optional
        Called with the name of the current work, the number of finished runs and the total.

    Returns
    -------
    Spread
        ``share``, of drives that balance, with Wilson's interval; ``quantiles`` by metric, with
        those of order statistics; ``sobol.indices``, with bootstrap intervals; ``against``, the
        paired difference to another design; ``worst``; ``balanced``, booleans of shape (runs,);
        ``runs``, a ``Sweep`` with a row for each drive; ``scene_of(run)``, to run it again.

    Raises
    ------
    SceneError
        A scene is not valid, or none of the first draws gives a valid scene.
    InputError
        A key, spread, metric, bound or number cannot be used, or another process computes the same
        runs.

    Notes
    -----
    Intervals are 95 % confidence intervals of random sampling; they do not include errors of the
    model. Draws are independent, and those of a run do not depend on the number of runs. A failed
    run counts as not balanced. Sources: Saltelli and others, Computer Physics Communications 181
    (2010) 259; Newcombe, Statistics in Medicine 17 (1998) 2635.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("balanced-start-up", ["duration=0.2"])
    >>> spread = {"balls.mass": "5%, per ball", "rotor.eccentricity": "lognormal:0.1 mm,40%"}
    >>> result = ab_sim.robust(scene, spread, runs=40, balanced="peak_whirl_over_e<0.01")
    >>> result
    <Spread: scene balanced-start-up, runs 40, balanced 0.00 % (0.00 to 8.76 %), criterion ...>
    >>> result.share.runs_for(0.01) > 100, result["rotor.eccentricity"].shape
    (True, (40,))
    """
    executor = executor_of(workers, scheduler)
    tolerances = [] if spread_from is None else fitted_tolerances(Path(spread_from))
    tolerances += [] if spread is None else _tolerances(spread)
    bounds = [balanced] if isinstance(balanced, str) else balanced
    question = SpreadQuestion(
        runs,
        tuple(metrics),
        tuple(bound_of(bound) for bound in bounds),
        seed,
        sobol,
        until,
        None if against is None else as_scene(against),
    )
    return run_spread(as_scene(scene), tolerances, question, executor, progress)


def _variable(key: str, spec: str | Sequence[object], in_design: bool) -> Variable:
    """Return a varied key: its values, or for a design its range.

    Raises
    ------
    InputError
        The values cannot be used, or a design's range is not two numbers.
    """
    if isinstance(spec, str):
        return variable_of(f"{key}={spec}")
    listed = list(spec)
    if not in_design:
        return values(key, [value.item() if hasattr(value, "item") else value for value in listed])
    if len(listed) != 2 or not all(isinstance(value, int | float) for value in listed):
        raise InputError(f"{key}: {short(spec)}: must be two numbers, the ends of a range")
    low, high = (value for value in listed if isinstance(value, int | float))
    return range_(key, low, high)


def _range(key: str, spec: str | Sequence[object]) -> Range:
    """Return the range of a key.

    Raises
    ------
    InputError
        The text or the numbers are no range.
    """
    variable = _variable(key, spec, True)
    if not isinstance(variable, Range):
        raise InputError(f"{key}: {short(spec)}: must be a range, e.g. (0.1, 0.5) or '0.1..0.5'")
    return variable


def _tolerances(spread: Mapping[str, str | Sequence[str]]) -> list[Tolerance]:
    """Return the tolerances of a mapping from keys to texts.

    Raises
    ------
    InputError
        It is no such mapping, or a text is no tolerance.
    """
    if not isinstance(spread, Mapping):
        raise InputError(f"spread = {short(spread)}: must be a mapping of keys to their spread")
    for key, spec in spread.items():
        if not isinstance(spec, str | Sequence):
            raise InputError(
                f"spread of {key} = {short(spec)}: must be a text such as '5%' or "
                "'uniform:LOW,HIGH', or a list of such texts"
            )
    return [
        tolerance_of(f"{key}={text}")
        for key, spec in spread.items()
        for text in ([spec] if isinstance(spec, str) else spec)
    ]


def _mapping(over: Over) -> Over:
    """Return a mapping unchanged; refuse anything else."""
    if not isinstance(over, Mapping):
        raise InputError(f"{short(over)}: must be a mapping of keys to their values")
    return over


def executor_of(workers: int, scheduler: str | None) -> Executor:
    """Return local processes, or a Dask cluster at an address.

    Raises
    ------
    InputError
        Both are given, the number of workers is below one, or ``Cluster`` refuses the address.
    """
    if workers < 1:
        raise InputError(f"workers = {workers}: must be at least 1")
    if scheduler is not None and workers != 1:
        raise InputError("workers, scheduler: give one of them; a cluster has its own processes")
    return Workers(workers) if scheduler is None else Cluster(scheduler)
