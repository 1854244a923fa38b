"""The call that fits a scene to recordings."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from ab_sim.api.common import Progress, SceneLike, as_scene
from ab_sim.errors import InputError
from ab_sim.identification.files import Files, read_files
from ab_sim.identification.result import Identification
from ab_sim.identification.run import Question, run_identification

Paths = Sequence[Path | str]


def identify(
    recordings: Paths | Path | str,
    scene: SceneLike,
    fit: Sequence[str],
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    without_balls: Paths = (),
    hold_out: Paths = (),
    maps: Paths = (),
    signal: str | None = None,
    free: Sequence[str] = (),
    trial_masses: Mapping[str, float] | None = None,
    seed: int = 0,
    hold_open: bool = True,
    propose: bool = True,
    workers: int = 1,
    progress: Progress | None = None,
) -> Identification:
    """Find a drive's numbers from recordings of its vibration: ``ab-sim identify``.

    Parameters
    ----------
    recordings : sequence of Path or str
        Recordings of the drive: ``.rrd``, ``.csv``, ``.parquet`` files, folders of ROS bags.
    scene : Scene, str or Path
        The drive as far as it is known: where the fit begins.
    fit : sequence of str
        Dotted keys of the scene, ``"rotor.eccentricity"``, ``"balls.mass"``.
    bounds : mapping, optional
        By key the lowest and highest value [SI]. Default: a factor of 10 to both sides.
    without_balls : sequence of Path or str, optional
        Further recordings, made without balls; ab_sim's own say so themselves.
    hold_out : sequence of Path or str, optional
        Recordings that are not fitted, but judged.
    maps : sequence of Path or str, optional
        YAML files that say what columns of tables are: one for all recordings, or one for each.
    signal : str, optional
        Of ab_sim's own recordings: ``"displacement"``, ``"acceleration"``, or a sensor's name.
        Default: the first sensor, else the displacement.
    free : sequence of str, optional
        What else of each recording is not known, and fitted: ``"gain"``, ``"bias"``, ``"delay"``,
        ``"disc_angle"``.
    trial_masses : mapping, optional
        By the name of a recording's file, without ending, a mass that was clamped to the deck for
        it [kg]: it tells the deck's mass.
    seed : int, default 0
        Of the random starts; the same seed, the same answer.
    hold_open : bool, default True
        Whether what the recordings cannot tell is held at the scene's value.
    propose : bool, default True
        Whether it is looked for which recording to make next.
    workers : int, default 1
        Processes that share the search where it takes long; any number gives the same to the bit.
    progress : callable, optional
        Called with what is done now, how much is done, and of how much.

    Returns
    -------
    Identification
        ``scene``, the fitted one; ``verdict`` and ``reasons``; ``estimates``, each with its
        interval of 95 %, or by name, ``found["balls.mass"]``; ``intervals`` with the covariance;
        ``knowledge``: what the recordings can tell; ``whiteness`` of the residuals; ``tried``
        effects; ``proposals`` for the next recording.

    Raises
    ------
    InputError
        A recording, key or bound cannot be used; says which, why, and what to do.
    RecordingError
        A recording cannot be read.
    SceneError
        The scene cannot be run as it was recorded.

    Notes
    -----
    Least squares over runs that follow the recorded spindle, as of L. Ljung, System
    Identification, 2nd ed. (1999), sections 7 and 16; what can be known from the singular values
    of scaled sensitivities. Ctrl-C (KeyboardInterrupt) gives the best so far, marked as such.

    Examples
    --------
    >>> import ab_sim, tempfile, pathlib
    >>> drive = ab_sim.load_scene("no-ball", ["duration=4", "effects.suspension.damping=2"])
    >>> guess = ab_sim.load_scene("no-ball", ["effects.suspension.damping=3"])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "mine.rrd")
    ...     ab_sim.save_recording(ab_sim.simulate(drive), file)
    ...     found = ab_sim.identify(
    ...         file, guess, ["effects.suspension.damping", "rotor.eccentricity"], propose=False
    ...     )
    >>> found
    <Identification: scene no-ball, verdict fits, recordings 1, parameters 2, runs ...>
    >>> round(found["effects.suspension.damping"].value, 6)
    2.0
    """
    start = as_scene(scene)
    if isinstance(fit, str):
        raise InputError(f"fit = {fit!r}: must be a list of keys, [{fit!r}]")
    given = [recordings] if isinstance(recordings, str | Path) else recordings
    paths = [[Path(path) for path in each] for each in (given, without_balls, hold_out, maps)]
    files = Files(paths[0], paths[1], paths[2], paths[3], signal, tuple(free), trial_masses or {})
    read, outside = read_files(files, start)
    question = Question(tuple(fit), dict(bounds or {}), seed, hold_open, propose)
    if workers < 1:
        raise InputError(f"workers = {workers}: must be at least 1")
    tell = progress or (lambda *_: None)
    return run_identification(start, read, question, outside, tell, workers)
