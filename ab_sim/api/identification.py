"""Function that fits a scene to recordings."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Progress
from ab_sim.identification.files import Files, read_files
from ab_sim.identification.result import Identification
from ab_sim.identification.run import IdentificationSettings, run_identification
from ab_sim.scene.load import SceneLike, as_scene

Paths = Sequence[Path | str]
"""Files of recordings."""


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
    """Estimate a drive's parameters from recordings of its vibration: ``ab-sim identify``.

    Parameters
    ----------
    recordings : sequence of Path or str
        Recordings of the drive: ``.rrd``, ``.csv``, ``.parquet`` files, folders of ROS bags.
    scene : Scene, str or Path
        The drive as known so far, from which the fit begins.
    fit : sequence of str
        Dotted keys of the scene, ``"rotor.eccentricity"``, ``"balls.mass"``.
    bounds : mapping, optional
        Lowest and highest value by key [SI]. Default: a factor of 10 to both sides.
    without_balls : sequence of Path or str, optional
        Further recordings, made without balls; those of ab_sim contain that themselves.
    hold_out : sequence of Path or str, optional
        Recordings for validation, which are not fitted.
    maps : sequence of Path or str, optional
        YAML files that describe the columns of tables: one for all recordings, or one for each.
    signal : str, optional
        Fitted signal of ab_sim's own recordings: ``"displacement"``, ``"acceleration"``, or a
        sensor's name. Default: the first sensor, else the displacement.
    free : sequence of str, optional
        Unknowns of each recording to fit as well: ``"gain"``, ``"bias"``, ``"delay"``,
        ``"disc_angle"``.
    trial_masses : mapping, optional
        Mass that was clamped to the deck for a recording [kg], by the name of its file without
        ending; it determines the deck's mass.
    seed : int, default 0
        Seed of the random starts. The same seed gives the same answer.
    hold_open : bool, default True
        Whether unidentifiable parameters are held at the scene's value.
    propose : bool, default True
        Whether to search for the recording to make next.
    workers : int, default 1
        Number of processes for a long search; any number gives the same bits.
    progress : callable, optional
        Called with the name of the current work, the finished count and the total.

    Returns
    -------
    Identification
        ``scene``, the fitted one; ``verdict`` and ``reasons``; ``estimates``, each with its
        interval of 95 %, or by name, ``result["balls.mass"]``; ``intervals`` with the covariance;
        ``knowledge``: identifiability from the recordings; ``whiteness`` of the residuals;
        ``tried`` effects; ``proposals`` for the next recording.

    Raises
    ------
    InputError
        A recording, key or bound cannot be used; the message has reason and remedy.
    RecordingError
        A recording cannot be read.
    SceneError
        The scene cannot be run as it was recorded.

    Notes
    -----
    The method is least squares over runs that follow the recorded spindle (L. Ljung, System
    Identification, 2nd ed., 1999, sections 7 and 16). Identifiability is determined from the
    singular values of scaled sensitivities. Ctrl-C (KeyboardInterrupt) ends the search with the
    best result so far, which is marked as interrupted.

    Examples
    --------
    >>> import ab_sim, tempfile, pathlib
    >>> drive = ab_sim.load_scene("no-ball", ["duration=4", "effects.suspension.damping=2"])
    >>> guess = ab_sim.load_scene("no-ball", ["effects.suspension.damping=3"])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "mine.rrd")
    ...     ab_sim.save_recording(ab_sim.simulate(drive), file)
    ...     result = ab_sim.identify(
    ...         file, guess, ["effects.suspension.damping", "rotor.eccentricity"], propose=False
    ...     )
    >>> result
    <Identification: scene no-ball, verdict fits, recordings 1, parameters 2, runs ...>
    >>> round(result["effects.suspension.damping"].value, 6)
    2.0
    """
    start = as_scene(scene)
    if isinstance(fit, str):
        raise InputError(f"fit = {fit!r}: must be a list of keys, [{fit!r}]")
    recording_list = [recordings] if isinstance(recordings, str | Path) else recordings
    paths = [
        [Path(path) for path in group] for group in (recording_list, without_balls, hold_out, maps)
    ]
    files = Files(paths[0], paths[1], paths[2], paths[3], signal, tuple(free), trial_masses or {})
    read, outside = read_files(files, start)
    settings = IdentificationSettings(tuple(fit), dict(bounds or {}), seed, hold_open, propose)
    if workers < 1:
        raise InputError(f"workers = {workers}: must be at least 1")
    tell = progress or (lambda *_: None)
    return run_identification(start, read, settings, outside, tell, workers)
