"""Comparison of a recording with a scene's run under the recorded commands."""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ab_sim.analysis.replay import ReplayedDrive, scene_from
from ab_sim.base.errors import InputError, exact
from ab_sim.base.presentation import Column, Columns, Presented
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory, unit_of
from ab_sim.record.recording import StoredRun, open_recording
from ab_sim.scene.load import SceneLike, as_scene, with_solver
from ab_sim.scene.model import Scene
from ab_sim.show.blocks import Envelope

_NEEDED = ("step", "time", "command")
"""Channels that a comparison needs, in addition to at least one channel to compare."""
PROFILE, COMMANDS = "the scene's profile", "the recorded commands"
"""Sources of the spindle's motion in the simulation."""


@dataclass
class ChannelDeviation:
    """Deviation of a channel from the recording."""

    channel: str
    """Name of the channel."""
    unit: str | None
    """Unit of the channel; None if it has none."""
    largest: float = 0.0
    """Largest |simulated - recorded|, in the channel's unit."""
    at: float = math.nan
    """Time of the largest deviation [s]."""
    same: bool = True
    """True if all samples are identical to the bit."""
    least: float = math.inf
    """Least recorded value."""
    most: float = -math.inf
    """Largest recorded value."""
    compared: int = 0
    """Number of compared samples; those that are not finite are left out."""
    squares: float = 0.0
    """Sum of the squared deviations."""

    def take(self, time: np.ndarray, recorded: np.ndarray, simulated: np.ndarray) -> None:
        """Add recorded and simulated samples at the same times [s], shape (samples,) each."""
        self.same = self.same and recorded.tobytes() == simulated.tobytes()
        both = np.isfinite(recorded) & np.isfinite(simulated)
        if not both.any():
            return
        here = recorded[both]
        off = np.abs(simulated[both] - here)
        worst = int(np.argmax(off))
        if not self.compared or off[worst] > self.largest:
            self.largest, self.at = float(off[worst]), float(time[both][worst])
        self.squares += float(np.sum(off**2))
        self.least, self.most = min(self.least, here.min()), max(self.most, here.max())
        self.compared += len(off)

    @property
    def rms(self) -> float | None:
        """Root mean square of the deviation; None if nothing could be compared."""
        return math.sqrt(self.squares / self.compared) if self.compared else None

    def relative(self, value: float | None) -> float | None:
        """Return a value relative to the recorded range; None if the recorded value is constant."""
        span = self.most - self.least
        return None if value is None or not span > 0 else value / span

    def report(self) -> dict[str, Any]:
        """Return the deviation as JSON-able values; None where nothing could be compared."""
        there = self.compared > 0
        return {
            "channel": self.channel,
            "unit": self.unit,
            "largest": self.largest if there else None,
            "at": self.at if there else None,
            "rms": self.rms,
            "largest_relative": self.relative(self.largest) if there else None,
            "rms_relative": self.relative(self.rms),
            "same_to_the_bit": self.same,
            "recorded_from": float(self.least) if there else None,
            "recorded_to": float(self.most) if there else None,
            "compared": self.compared,
        }


@dataclass(frozen=True, repr=False)
class RecordingComparison(Presented):
    """Comparison of a recording with a simulation; see ``ab_sim.compare_recording``."""

    _picture = "comparison"

    scene: Scene
    """Simulated scene."""
    deviations: tuple[ChannelDeviation, ...]
    """Deviation of each compared channel."""
    not_compared: dict[str, tuple[str, ...]]
    """Channels that were not compared, by the reason."""
    recorded: Envelope
    """Curves of the compared channels, as recorded."""
    simulated: Envelope
    """Curves of the compared channels in the simulation."""
    differences: Envelope
    """Curves of simulated minus recorded values."""
    driven_by: str
    """``PROFILE`` or ``COMMANDS``."""
    aligned: str
    """Method by which samples are aligned in time, as text."""
    rows: int
    """Number of compared samples."""
    duration: float
    """Duration [s]."""
    notes: tuple[str, ...]
    """Restrictions of the comparison, as sentences."""

    @property
    def same(self) -> bool:
        """True if every compared channel is identical to the bit."""
        return all(deviation.same for deviation in self.deviations)

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.scene.name,
            "samples": str(self.rows),
            "channels": str(len(self.deviations)),
            "the same to the bit": str(self.same),
        }

    def _columns(self) -> Columns:
        deviations = self.deviations
        return {
            "channel": Column(None, [deviation.channel for deviation in deviations]),
            "unit": Column(None, [deviation.unit for deviation in deviations]),
            "largest": Column(None, [deviation.largest for deviation in deviations]),
            "at": Column("s", [deviation.at for deviation in deviations]),
            "rms": Column(None, [deviation.rms for deviation in deviations]),
            "same_to_the_bit": Column(None, [deviation.same for deviation in deviations]),
        }

    def report(self) -> dict[str, object]:
        """Return JSON-able values: see docs/reference/json.md."""
        return {
            "scene": self.scene.name,
            "driven_by": self.driven_by,
            "aligned": self.aligned,
            "samples": self.rows,
            "duration": self.duration,
            "same_to_the_bit": self.same,
            "channels": [deviation.report() for deviation in self.deviations],
            "not_compared": [
                {"channel": channel, "reason": reason}
                for reason, channels in self.not_compared.items()
                for channel in channels
            ],
            "notes": list(self.notes),
        }


def compare_recording(
    recording: StoredRun | Path | str,
    scene: SceneLike,
    *,
    progress: Callable[[int], None] | None = None,
) -> RecordingComparison:
    """Run a scene under a recording's commands and compare each channel: ``ab-sim compare``.

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
        Its ``deviations`` have the largest difference and the r.m.s. of each common channel, in the
        channel's unit. ``same`` is true if all of them are identical to the bit.

    Raises
    ------
    RecordingError
        The recording cannot be read.
    SceneError, InputError
        There is no common channel, or the scene refuses the commands.
    DivergedError
        The state went beyond all bounds.

    Notes
    -----
    A recording of ab_sim contains its step. With that step the scene is simulated step by step, and
    the same scene, commands and version give the same bits. Any other recording is aligned by time:
    its first sample is the scene's start, commands act from their time on, and the simulation is
    interpolated linearly at the recorded times.

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
    scene = as_scene(scene)
    missing = [name for name in _NEEDED if name not in run.channels]
    if missing or run.extent.rows == 0:
        what = "it is empty" if not run.channels or not run.extent.rows else ""
        raise InputError(
            f"{run.path}: cannot be compared: "
            + (what or f"it has no channel {', '.join(missing)}, which the simulation needs")
        )
    scene, stepped = _solved(run, scene)
    notes = [*run.remarks]
    if stepped and run.extent.missing:
        notes.append(
            f"{run.extent.missing} steps are missing at {run.extent.gaps} places: a command in a "
            "gap acts from its end on"
        )
    if stepped and run.extent.left_out:
        notes.append(
            f"{run.extent.left_out} steps were left out by intent: a command between recorded "
            "steps acts from the second one on"
        )
    step, time = run.extent.first if stepped else (0.0, run.extent.first.time)
    if stepped and scene.profile is not None and _follows_profile(run, scene):
        return _along(run, Drive(scene), PROFILE, 0.0, notes, progress, start=_start(run, scene))
    if step > 0 and not _begun_before(run, scene):
        recorded = _first_sample(run)
        drive = Drive(scene_from(scene, recorded), commanded=True)
        # The command in force accelerates the first sample, too.
        if math.isfinite(recorded["command"]):
            drive.command(recorded["command"])
        notes.append(
            f"the recording begins at t = {exact(time)} s: the simulation begins in the state of "
            "its first sample, without the states of friction and filters, which are not recorded"
        )
        return _along(run, drive, COMMANDS, step, notes, progress)
    first = 0.0 if stepped else time
    drive = Drive(scene, commanded=True)
    return _along(run, drive, COMMANDS, first, notes, progress, stepped)


def _begun_before(run: StoredRun, scene: Scene) -> bool:
    """Return whether no command preceded the recording, so that t = 0 was the scene's start."""
    if _first_sample(run)["command"] != scene.start.speed:
        return False  # at once, as the simulation up to the first sample may be long
    drive, steps = Drive(scene, commanded=True), int(run.extent.first.step)
    return _begins_with(run, drive.advance(steps, every=steps))


def _start(run: StoredRun, scene: Scene) -> Trajectory | None:
    """Return the scene's sample at t = 0 and constant speed if the recording begins so, else None.

    A live drive takes its first sample before it has its profile, thus without acceleration.
    """
    standing = Drive(scene, commanded=True).present()
    return standing if _begins_with(run, standing) else None


def _begins_with(run: StoredRun, sample: Trajectory) -> bool:
    """Return whether the first recorded sample equals a given one, to the bit."""
    recorded = _first_sample(run)
    common = [name for name in sample.channels if name in recorded]
    return all(sample[name][0].tobytes() == np.float64(recorded[name]).tobytes() for name in common)


def _first_sample(run: StoredRun) -> dict[str, float]:
    """Return the value of each channel at the first recorded sample."""
    (first, *_) = run.blocks(rows=1)
    return dict(zip(run.channels, first[0].tolist(), strict=True))


def _follows_profile(run: StoredRun, scene: Scene) -> bool:
    """Return whether the commands are the scene's profile, to the bit.

    The first block is compared, or all blocks if the commands depend on measurements.
    """
    replay = ReplayedDrive(Drive(scene), obeys=False)
    blocks = run.blocks(("step", "command"))
    compared = blocks if scene.is_controlled else itertools.islice(blocks, 1)
    return all(
        replay.at_steps(steps, commands)["command"].tobytes() == commands.tobytes()
        for steps, commands in map(np.transpose, compared)
    )


def _solved(run: StoredRun, scene: Scene) -> tuple[Scene, bool]:
    """Return the scene to simulate, and whether its time steps are those of the recording.

    A scene with an accuracy gets step and stepper of the recording. For a recording that does not
    state them, samples are compared by their times.
    """
    step, stepper = run.description.get("step"), run.description.get("stepper")
    if not isinstance(step, float) or not isinstance(stepper, str):
        if scene.accuracy is not None:
            raise InputError(
                f"{run.path}: does not contain its solver, and the scene {scene.name} has an "
                "accuracy instead of a solver; give it a step with --set accuracy= "
                "--set solver.step=..."
            )
        return scene, False
    if scene.accuracy is not None:
        return with_solver(scene, stepper, step), True
    if step != scene.solver.step:
        raise InputError(
            f"{run.path}: has steps of {exact(step)} s, and the scene {scene.name} has "
            f"solver.step = {exact(scene.solver.step)} s; compare with --set "
            f"solver.step={exact(step)}"
        )
    return scene, True


def _along(
    run: StoredRun,
    drive: Drive,
    driven_by: str,
    first: float,
    notes: list[str],
    progress: Callable[[int], None] | None,
    stepped: bool = True,
    start: Trajectory | None = None,
) -> RecordingComparison:
    """Simulate a drive along a recording, and compare block by block.

    Parameters
    ----------
    run
        Recorded run.
    drive
        Drive at its start.
    driven_by
        ``PROFILE`` or ``COMMANDS``.
    first
        Step of the drive's start; if not ``stepped``, its time in the recording [s].
    notes
        Restrictions of the comparison.
    progress
        Called with the number of compared samples.
    stepped
        Whether samples are compared by steps, not by times.
    start
        First sample that replaces the drive's own; None to use the latter.
    """
    # Channels that the simulation takes from the recording agree in any case.
    imposed = _NEEDED if driven_by == COMMANDS else _NEEDED[:2]
    names = [name for name in run.channels if name in drive.channels and name not in imposed]
    if set(names) <= set(_NEEDED):
        raise InputError(
            f"{run.path}: has no channel in common with the scene {drive.scene.name}; it has "
            f"{', '.join(run.channels)}"
        )
    extent, replay = run.extent, ReplayedDrive(drive, first, driven_by == COMMANDS, start)
    deviations = tuple(ChannelDeviation(name, unit_of(name)) for name in names)
    recorded, simulated, differences = (Envelope(names, extent.rows) for _ in range(3))
    done = 0
    for block in run.blocks((*_NEEDED, *names)):
        steps, time, commands = block[: extent.rows - done, :3].T
        if len(time) == 0:
            break
        samples = replay.at_steps(steps, commands) if stepped else replay.at_times(time, commands)
        measured = block[: len(time), 3:]
        computed = np.column_stack([samples[name] for name in names])
        for at, deviation in enumerate(deviations):
            deviation.take(time, measured[:, at], computed[:, at])
        recorded.take(time, measured)
        simulated.take(time, computed)
        differences.take(time, computed - measured)
        done += len(time)
        if progress is not None:
            progress(done)
    step = exact(drive.step)
    aligned = f"step by step, {step} s each"
    if not stepped:
        aligned = (
            f"by time from the first sample on; the simulation, with steps of {step} s, is "
            "interpolated at the recorded times"
        )
    duration = extent.last.time - extent.first.time
    return RecordingComparison(
        drive.scene, deviations, _not_compared(run, drive, names), recorded, simulated,
        differences, driven_by, aligned, done, duration, tuple(notes),
    )  # fmt: skip


def _not_compared(run: StoredRun, drive: Drive, names: list[str]) -> dict[str, tuple[str, ...]]:
    """Return the channels that are not compared, by the reason."""
    rest = [name for name in dict.fromkeys((*run.channels, *drive.channels)) if name not in names]
    reasons: dict[str, tuple[str, ...]] = {}
    for name in rest:
        if name not in drive.channels:
            reason = f"{drive.scene.name} has no such channel"
        elif name not in run.channels:
            reason = "not recorded"
        else:
            reason = "the scene follows it" if name == "command" else "samples are aligned by it"
        reasons[reason] = (*reasons.get(reason, ()), name)
    return reasons
