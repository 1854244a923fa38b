"""Data of a report, gathered from a recording block by block."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ab_sim.analysis.metrics import Metrics, metrics_of_blocks, passes_of
from ab_sim.analysis.rest import Rest, rest_of
from ab_sim.base.errors import AbSimError, InputError
from ab_sim.base.presentation import CountProgress, last_stretch
from ab_sim.base.sample_columns import STEP
from ab_sim.drive.closed_forms import RotorWithoutBalls, WhirlWithoutBalls, driving_forces
from ab_sim.drive.observation import channels_of
from ab_sim.drive.trajectory import Trajectory, is_ball_angle
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.record.recording import StoredRun
from ab_sim.record.recording.signals import FinalRms, FrameRate
from ab_sim.record.recording.views import PERIOD
from ab_sim.scene.load import check_scene
from ab_sim.scene.model import Scene
from ab_sim.show.blocks import Envelope, OncePerTurn, PowerSpectrum, Waterfall

_ANGLE = 3
"""Column of the spindle's angle, after time, x and y, in the samples of the last orbit."""
TURNS = 20
"""Number of final turns of the spindle in the last orbit."""
_ORBIT = 4000
"""Largest number of points of an orbit."""


@dataclass(frozen=True)
class RunData:
    """Data of a recording, reduced for figures and tables."""

    run: StoredRun
    name: str
    """Name of the recording in the report."""
    scene: Scene | None
    """Scene of the run; None if it is unknown, so that there are no metrics."""
    metrics: Metrics | None
    """Metrics of the run; None if its scene is unknown."""
    curves: Envelope
    """Curves of speed, command, whirl, ball angles and more in SI units, if recorded."""
    orbit: np.ndarray
    """Time, x, y [s, m] of selected samples of the whole run, shape (points, 3)."""
    last_orbit: np.ndarray
    """Time, x, y [s, m] of the last ``TURNS`` turns, shape (points, 3)."""
    vibrating: str
    """Source of the vibration, as text: a sensor, or the deck's acceleration."""
    vibration: OncePerTurn
    """Vibration in the last tenth of the run."""
    spectrum: PowerSpectrum
    """Spectrum of the last tenth of the run."""
    waterfall: Waterfall
    """Vibration of the whole run over frequency and spindle speed."""
    notes: tuple[str, ...]
    """Remarks on the recording for the reader."""
    without_balls: Envelope | None
    """``whirl`` of the drive without balls along the run's speed [m]; None if unknown."""
    final_without_balls: float | None
    """Final whirl without balls [m], as in the metrics; None if unknown."""

    @property
    def eccentricity(self) -> float:
        """Eccentricity e [m]; 0 if unknown."""
        value = self.run.description.get("eccentricity")
        return float(value) if isinstance(value, int | float) else 0.0

    def report(self) -> dict[str, Any]:
        """Return JSON-able values: see docs/reference/json.md."""
        extent, factors = self.run.extent, self.real_time_factors
        metrics = None if self.metrics is None else self.metrics.report(self.eccentricity)
        return {
            "recording": str(self.run.path),
            "scene": None if self.scene is None else self.scene.name,
            "version": self.run.description.get("version"),
            "begins": extent.first.time,
            "duration": extent.last.time - extent.first.time,
            "samples": extent.rows,
            "gaps": extent.gaps,
            "missing": extent.missing,
            "complete": self.run.complete,
            "log_entries": len(self.run.notes.events),
            "metrics": metrics,
            "vibration_of": self.vibrating,
            "vibration_rms": self.vibration.rms,
            "once_per_turn_share": self.vibration.share,
            "real_time_factor": None
            if len(factors) == 0
            else {"mean": float(factors.mean()), "least": float(factors.min())},
            "notes": list(self.notes),
        }

    @property
    def real_time_factors(self) -> np.ndarray:
        """Recorded real-time factors of a live run; empty for an offline run."""
        _times, factors = self.run.notes.scalars.get("real_time_factor", np.empty((0, 2))).T
        return factors


def gather(run: StoredRun, name: str, progress: CountProgress | None = None) -> RunData:
    """Read a recording in several passes, block by block, and keep the data of a report.

    Parameters
    ----------
    run
        Recording to read.
    name
        Name of the recording in the report.
    progress
        Called with the number of samples read and the total.

    Raises
    ------
    InputError
        The recording has no samples.
    RecordingError
        The recording cannot be read.
    """
    extent = run.extent
    if extent.rows == 0:
        raise InputError(f"{run.path}: the recording is empty: it has no samples to report on")
    scene, why = _scene_of(run)
    read = [0]
    passes = 1 + (0 if scene is None else passes_of()) + (run.every > 1)

    def blocks() -> Iterator[Trajectory]:
        # for a recording in progress, only the samples at the start of the report
        remaining = extent.rows
        for stored in run.blocks():
            rows = stored[:remaining]
            if len(rows) == 0:
                return
            remaining -= len(rows)
            # Evenly spaced samples only: the full-rate ones around events would have too much
            # weight.
            block = Trajectory(run.channels, rows[rows[:, STEP] % run.every == 0])
            if len(block):
                yield block
            read[0] += len(rows)
            if progress is not None:
                progress(read[0], passes * extent.rows)

    count = extent.rows if run.every == 1 else sum(map(len, blocks()))
    if count == 0:
        raise InputError(
            f"{run.path}: there is no whole interval of {run.every} steps to report on"
        )
    metrics = None if scene is None else metrics_of_blocks(blocks, count, scene)
    collected = _Collected(run, scene, count)
    for block in blocks():
        collected.take(block)
    notes = [note for note in (*run.remarks, why) if note]
    if not run.complete and not run.torn:
        notes.append("was not closed: it is still being written, or its writer was killed")
    if extent.left_out:
        notes.append(
            f"{extent.left_out} steps were left out by intent: the report uses one of {run.every} "
            "steps, which misses shorter peaks and faster vibration"
        )
    if extent.missing:
        notes.append(f"{extent.missing} steps are missing, at {extent.gaps} places")
    if metrics is not None:
        notes += metrics.cautions()
    return collected.result(name, metrics, tuple(notes))


def _scene_of(run: StoredRun) -> tuple[Scene | None, str | None]:
    """Return a recording's scene, or None and the reason why the scene is unknown."""
    try:
        scene = check_scene(run.description.get("scene") or {}, "the recording's scene")
        channels = channels_of(scene, system_of(scene))
    except AbSimError as error:
        first = str(error).splitlines()[0]
        return None, f"has no metrics: its scene is unknown ({first})"
    if channels != run.channels:
        return None, "has no metrics: its channels are not those of its scene"
    return scene, None


class _Collected:
    """Data of a report, collected from consecutive blocks of samples."""

    def __init__(self, run: StoredRun, scene: Scene | None, count: int) -> None:
        self._run, self._scene = run, scene
        self._rest = (
            Rest(np.zeros(3), np.array([1.0, 0, 0, 0])) if scene is None else rest_of(scene)
        )
        extent = run.extent
        self._count, self._done = count, 0
        self._last = self._count - last_stretch(self._count)
        balls = [name for name in run.channels if is_ball_angle(name)]
        self._plain = [n for n in ("speed", "command", "motor_torque", *balls) if n in run.channels]
        names = list(self._plain)
        names += ["whirl"] if {"x", "y"} <= set(run.channels) else []
        names += ["alpha", "beta", "gamma"] if "qw" in run.channels else []
        names += [f"force_{i}" for i in range(len(balls))] if scene is not None else []
        self.curves = Envelope(names, self._count)
        self._axes, self._vibrating = _vibrating(run)
        begin, end = extent.first.time, extent.last.time
        rate = (self._count - 1) / (end - begin) if end > begin else 1.0
        self._vibration, self._spectrum = OncePerTurn(), PowerSpectrum(self._count - self._last)
        self._waterfall = Waterfall(self._count, rate, _speeds(run))
        rotor = run.description.get("without_balls")
        self._without_balls = None
        if balls and "speed" in run.channels and isinstance(rotor, dict) and "mass" in rotor:
            self._without_balls = WhirlWithoutBalls(RotorWithoutBalls(**rotor))
        self._frames, self._final_without_balls = FrameRate(PERIOD), FinalRms()
        self._curve_without_balls = Envelope(("whirl",), math.ceil((end - begin) / PERIOD) + 1)
        self._every = max(1, self._count // _ORBIT)
        self._orbit: list[np.ndarray] = []
        self._turning: list[np.ndarray] = []

    def take(self, block: Trajectory) -> None:
        """Add the samples of a block to curves, orbit, spectrum and waterfall."""
        time, have = block["time"], block.channels
        from_rest = self._rest.counted_from(block)
        columns = [block[name] for name in self._plain]
        if "whirl" in self.curves.channels:
            columns.append(from_rest.whirl)
            self._take_orbit(from_rest)
        if block.tilts:
            columns += list((block.tilt - self._rest.tilt).T)
        if self._scene is not None and block.balls:
            columns += list(driving_forces(block, self._scene).T)
        if self._without_balls is not None:
            rows = np.column_stack([block["step"], time, block["speed"]])
            _, when, speed = self._frames.of(rows).T
            if len(when):
                whirl = self._without_balls.along(when, speed)
                self._curve_without_balls.take(when, whirl[:, None])
                self._final_without_balls.take(when, whirl)
        self.curves.take(time, np.column_stack(columns) if columns else np.empty((len(time), 0)))
        if self._axes:
            axes = np.column_stack([block[name] for name in self._axes])
            # Steps of a decimated run are counted in kept ones, so that they have no gaps.
            step = block["step"] // self._run.every
            late = slice(max(self._last - self._done, 0), None)
            self._spectrum.take(step[late], time[late], axes[late])
            if "angle" in have and len(self._axes) > 1:
                self._vibration.take(block["angle"][late], axes[late])
            if "speed" in have:
                self._waterfall.take(step, time, np.abs(block["speed"]), axes)
        self._done += len(block)

    def _take_orbit(self, from_rest: Trajectory) -> None:
        """Add every n-th sample to the orbit, and all samples to the orbit of the last turns."""
        rows = np.column_stack([from_rest["time"], from_rest["x"], from_rest["y"]])
        self._orbit.append(rows[(-self._done) % self._every :: self._every].copy())
        if "angle" not in from_rest.channels:
            return
        self._turning.append(np.column_stack([rows, from_rest["angle"]]))
        # Blocks before the last turns are not needed any more.
        end = self._turning[-1][-1, _ANGLE]
        while len(self._turning) > 1 and _turns(end, self._turning[0][-1, _ANGLE]) > TURNS:
            del self._turning[0]
        if len(self._turning) > 100:  # at standstill, old samples are not drawn
            del self._turning[:50]

    def result(self, name: str, metrics: Metrics | None, notes: tuple[str, ...]) -> RunData:
        """Return the collected data, with the run's name, metrics and notes."""
        last = np.empty((0, 3))
        if self._turning:
            turning = np.concatenate(self._turning)
            turning = turning[_turns(turning[-1, _ANGLE], turning[:, _ANGLE]) <= TURNS]
            last = turning[:: max(1, len(turning) // _ORBIT), :_ANGLE]
        orbit = np.concatenate(self._orbit) if self._orbit else np.empty((0, 3))
        final = self._final_without_balls.value
        return RunData(
            self._run, name, self._scene, metrics, self.curves, orbit, last, self._vibrating,
            self._vibration, self._spectrum, self._waterfall, notes,
            None if self._without_balls is None else self._curve_without_balls, final and final.rms,
        )  # fmt: skip


def _turns(end: float, angle: Any) -> Any:
    """Return the number of turns from spindle angles [rad] to the last angle."""
    return np.abs(end - angle) / (2.0 * math.pi)


def _vibrating(run: StoredRun) -> tuple[list[str], str]:
    """Return the channels of vibration across the shaft, and a text that names the source.

    The source is the first sensor, or the deck in a drive without sensors.
    """
    for sensor in run.description.get("sensors") or ():
        axes = [f"{sensor}_{axis}" for axis in (1, 2)]
        if set(axes) <= set(run.channels):
            return axes, f"the sensor {sensor}"
    return [name for name in ("ax", "ay") if name in run.channels], "the deck's acceleration"


def _speeds(run: StoredRun) -> tuple[float, float]:
    """Return the least and the largest speed of the spindle in a recording [rad/s]."""
    if "speed" not in run.channels:
        return 0.0, 0.0
    low, high = math.inf, -math.inf
    for block in map(np.abs, run.blocks(("speed",))):
        low, high = min(low, float(np.nanmin(block))), max(high, float(np.nanmax(block)))
    return low, high
