"""Functions that run scenes, and write them as C and as FMUs."""

from collections.abc import Callable, Sequence
from pathlib import Path

from ab_sim import analysis
from ab_sim.analysis import OfflineRun
from ab_sim.base.errors import InputError
from ab_sim.base.files import FMU, check_ending, check_writable
from ab_sim.base.presentation import Progress
from ab_sim.drive import Drive, accuracy
from ab_sim.drive.accuracy import WorkPrecision
from ab_sim.drive.description import describe
from ab_sim.drive.trajectory import Trajectory
from ab_sim.export.c_code import fmu
from ab_sim.export.c_code.sources import sources_of, write_sources
from ab_sim.scene import Scene
from ab_sim.scene.load import SceneLike, as_scene

ROWS = 10_000
"""Number of rows of a recorded block."""


def simulate(
    scene: SceneLike,
    times: Sequence[float] = (),
    *,
    progress: Callable[[float, float], None] | None = None,
) -> OfflineRun:
    """Run a scene's profile from its start to its end: ``ab-sim run``.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene to run, or its name or file. A requested accuracy is resolved first, which may take
        minutes.
    times : sequence of float, optional
        Times of observations [s]; they need not lie on steps. A run lasts until ``scene.duration``,
        or to the last of these.
    progress : callable, optional
        Called with the simulated time and the end time [s], some hundred times.

    Returns
    -------
    OfflineRun
        ``trajectory`` with every step, the start included; ``samples``, one Observation for each of
        ``times``; ``metrics``: final and peak whirl [m], residual unbalance, settling;
        ``decisions`` of a profile that decides while it runs; ``adaptive``: estimates of an
        adaptive start-up's controller.

    Raises
    ------
    SceneError
        The scene is not valid, or cannot be run with its solver.
    InputError
        A time is negative or not finite, or the run would not fit into memory.
    DivergedError
        The simulation diverged.

    Notes
    -----
    The same scene gives the same bits on any x86-64 machine. Equations: docs/equations.md.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["duration=0.2"])
    >>> run = ab_sim.simulate(scene, times=[0.05, 0.2])
    >>> run
    <OfflineRun: scene thesis-hold, ...>
    >>> run.trajectory.ball_angles.shape, len(run.samples)
    ((201, 2), 2)
    >>> run.metrics.peak_whirl < 1e-4
    True
    """
    checked_scene = as_scene(scene)
    end = max([checked_scene.duration, *times])

    def tell(drive: Drive, newest: Trajectory) -> None:
        if progress is not None:
            progress(drive.time, end)

    return analysis.run_scene(checked_scene, times, tell)


def resolve_accuracy(
    scene: SceneLike, *, progress: Progress | None = None
) -> tuple[Scene, WorkPrecision | None]:
    """Find the cheapest solver with the accuracy that a scene requests.

    Parameters
    ----------
    scene : Scene, str or Path
        With ``accuracy``: the largest error of any ball's angle [rad], of the whirl [e], or both.
    progress : callable, optional
        Called before each run with the setting, and CPU time spent and allowed.

    Returns
    -------
    scene : Scene
        Scene with that stepper and step; unchanged without a requested accuracy.
    work_precision : WorkPrecision or None
        Measured error and time; None without a requested accuracy.

    Raises
    ------
    SceneError
        The accuracy cannot be reached; the message states the reachable one.
    DivergedError
        The scene's run diverges with every step.

    Examples
    --------
    >>> import ab_sim
    >>> requested = ab_sim.load_scene("nsc-case-1", ["accuracy.angle=1e-4", "duration=0.2"])
    >>> scene, result = ab_sim.resolve_accuracy(requested)
    >>> result.measured.angle < 1e-4
    True
    >>> scene.solver.step == result.step
    True
    """
    return accuracy.resolve_accuracy(as_scene(scene), tell=progress)


def save_recording(run: OfflineRun, path: Path | str, *, every: int = 1) -> None:
    """Record a finished run into a Rerun file: ``ab-sim run --rrd``.

    Decisions of a profile during the run are recorded as events.

    Parameters
    ----------
    run : OfflineRun
        Result of ``simulate``.
    path : Path or str
        An .rrd file, replaced if it exists.
    every : int, default 1
        Keep one step in every ``every``, and all steps around events.

    Raises
    ------
    RecordingError
        The file cannot be written.
    InputError
        ``every`` is less than 1.

    Examples
    --------
    >>> import ab_sim, tempfile, pathlib
    >>> run = ab_sim.simulate(ab_sim.load_scene("thesis-hold", ["duration=0.1"]))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ab_sim.save_recording(run, pathlib.Path(folder, "run.rrd"))
    ...     recorded = ab_sim.open_recording(pathlib.Path(folder, "run.rrd"))
    ...     same = (recorded.trajectory().samples == run.trajectory.samples).all()
    >>> bool(same)
    True
    """
    from ab_sim.record.recording import Recording

    if every < 1:
        raise InputError(f"every = {every}: must be at least 1")
    precision = None if run.work_precision is None else run.work_precision.report()
    with Recording(path, description=describe(run.scene, precision), every=every) as recording:
        for decided in run.decisions:  # as a recorder writes a profile controller's status
            recording.state("profile", decided.time, decided.text.partition(":")[0])
            recording.event(decided.time, f"profile: {decided.text}", "INFO", "profile")
        samples = run.trajectory.samples
        for first in range(0, len(samples), ROWS):
            recording.block(run.trajectory.channels, samples[first : first + ROWS])


def write_c(scene: SceneLike, folder: Path | str) -> list[Path]:
    """Write a scene's drive as self-contained C99: ``ab-sim c --out``.

    Parameters
    ----------
    scene : Scene, str or Path
        Smooth scene with an explicit stepper.
    folder : Path or str
        Folder, created if missing. Files in it by ``ab-sim c`` are replaced.

    Returns
    -------
    list of Path
        Written files: header, source, example, check, CMakeLists.txt, README.md.

    Raises
    ------
    SceneError
        The scene has effects with events (friction, contact, a motor), requests an accuracy or
        another kind of stepper, or has a step that is too long at ``spindle.max_speed``.
    InputError
        The folder cannot be written to, or has another file with such a name.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["effects.rolling_friction="])
    >>> [file.name for file in ab_sim.write_c(scene, "drive")]
    ['drive.h', 'drive.c', 'main.c', 'drive_check.c', 'CMakeLists.txt', 'README.md']
    """
    return write_sources(sources_of(as_scene(scene)), Path(folder), "folder")


def write_fmu(scene: SceneLike, file: Path | str) -> str | None:
    """Write a scene's drive as an FMU of FMI 3.0, for co-simulation: ``ab-sim c --fmu``.

    Parameters
    ----------
    scene : Scene, str or Path
        Smooth scene with an explicit stepper.
    file : Path or str
        File to write, .fmu; an existing one is replaced. The FMU gets its name.

    Returns
    -------
    str or None
        Platform of the FMU's binary, e.g. x86_64-linux; None if there is no C compiler (``cc``),
        so that the FMU has sources only.

    Raises
    ------
    SceneError
        As in ``write_c``.
    InputError
        The file cannot be written, or the compiler fails.

    Examples
    --------
    >>> import ab_sim
    >>> platform = ab_sim.write_fmu("no-ball", "drive.fmu")
    """
    path = Path(file)
    check_ending(path, FMU, "file")
    check_writable(path, "file")
    return fmu.write_fmu(sources_of(as_scene(scene)), path, "file").binary
