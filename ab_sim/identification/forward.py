"""Forward simulation of a recording with given parameters, and its derivatives."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from ab_sim.analysis.comparison import without_balls
from ab_sim.base.errors import AbSimError, SceneError
from ab_sim.design.batch.lane_group import LaneGroup, LaneStarts
from ab_sim.design.batch.prepared_run import PreparedRun
from ab_sim.design.batch.run_prepared import run_one_by_one
from ab_sim.design.draws import value_of
from ab_sim.drive.trajectory import Trajectory
from ab_sim.engine.stepping.side_by_side import LANES, LaneSamples
from ab_sim.identification.colour import low_pass_alone
from ab_sim.identification.measured import DISPLACEMENT, Measured
from ab_sim.model.dynamics.assemble import start_state
from ab_sim.model.dynamics.system import layout_of
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

MOTOR = "motor"
_ON_GRID = 1e-6
"""Tolerance for a sample's time to coincide with a step, as a fraction of the step."""
STEP_SHARE = 1e-6
"""Step of a finite difference, relative to the parameter's scale."""
Values = Mapping[str, Any]
"""Values of a scene by dotted key; entries of lists by index, ``balls.mass.1``."""


class SimulatedSignals(NamedTuple):
    """Simulated signals of a recording."""

    values: np.ndarray
    """Signals along the measured axes [m or m/s^2], without gain and bias.

    Shape (samples, axes).
    """
    slope: np.ndarray
    """Time derivative of the signals, per second, same shape; zeros unless requested."""
    derivatives: np.ndarray
    """Derivatives of the signals by each key, shape (keys, samples, axes)."""


class RecordedDrive:
    """Runs of a scene under the conditions of a recording: its spindle, sensor and times.

    The stepper is chosen for the first scene and kept, because a change would make the objective of
    a fit discontinuous. Runs for which it is unstable diverge and count as failed.

    Parameters
    ----------
    scene
        Scene whose parameters vary, with balls.
    measured
        The recording.

    Raises
    ------
    SceneError
        The scene cannot be run under these conditions; the message states why.
    """

    def __init__(self, scene: Scene, measured: Measured) -> None:
        self.measured = measured
        self.step = _step(scene, measured)
        self.scene = _followed(scene, measured, self.step)
        self._first = _prepared(self.scene_with({}), scene.name)
        self._lanes = LaneGroup(self._first, 1) if self._first.fits_lane else None
        self.steps = self._first.steps
        at = measured.time / self.step
        aligned = bool(np.all(np.abs(at - np.rint(at)) < _ON_GRID))
        self._grid = np.rint(at).astype(np.int64) - 1 if aligned else None
        self._cosine = np.cos(measured.axes)
        self._sine = np.sin(measured.axes)

    @property
    def side_by_side(self) -> bool:
        """True if up to eight runs can be computed at a time, in lanes."""
        return self._first.fits_lane

    def scene_with(self, values: Values) -> Scene:
        """Return the scene of a run with other values, and with the recorded trial mass and balls.

        Raises
        ------
        SceneError
            The values are not allowed.
        """
        changed = changed_scene(self.scene, values, "fit") if values else self.scene
        scene = changed if self.measured.with_balls else without_balls(changed)
        return _heavier(scene, self.measured.trial_mass) if self.measured.trial_mass else scene

    def signals(
        self,
        values: Values,
        keys: Sequence[str] = (),
        moves: Sequence[float] = (),
        delay: float = 0.0,
        slope: bool = False,
        central: bool = True,
    ) -> SimulatedSignals | None:
        """Return simulated signals with derivatives by finite differences; None if a run fails.

        Parameters
        ----------
        values
            Values of the scene.
        keys
            Keys for derivatives.
        moves
            Step of the finite difference for each key [SI].
        delay
            Delay of the signals [s].
        slope
            Whether the derivative with respect to time is needed.
        central
            Whether differences are central rather than one-sided.
        """
        # The runs of all differences go side by side in the lanes of the same machine code.
        every, ways = [dict(values)], (1.0, -1.0) if central else (1.0,)
        for key, move in zip(keys, moves, strict=True):
            now = float(values[key] if key in values else value_of(self.scene, key))
            every += [{**values, key: now + way * move} for way in ways]
        try:
            runs = self._run(every)
        except AbSimError:
            return None
        if runs is None:
            return None
        signals, slopes = self._at_times(runs, delay, slope)
        sides = signals[1:].reshape(len(keys), len(ways), *signals.shape[1:])
        widths = len(ways) * np.asarray(moves, float).reshape(-1, 1, 1)
        other = sides[:, 1] if central else signals[0]
        return SimulatedSignals(signals[0], slopes, (sides[:, 0] - other) / widths)

    def _run(self, every: Sequence[Values]) -> np.ndarray | None:
        """Return signals at each step, shape (runs, steps, axes); None if a run diverges."""
        prepared = [self._first.with_numbers_of(self.scene_with(values)) for values in every]
        samples = self._samples(prepared)
        if samples is None:
            return None
        signals = np.empty((len(every), self.steps, len(self.measured.axes)))
        for k, run in enumerate(prepared):
            signals[k] = self._sensed(run, Trajectory(run.channels, samples[k]))
        return signals if bool(np.isfinite(signals).all()) else None

    def _samples(self, runs: Sequence[PreparedRun]) -> np.ndarray | None:
        """Return all steps of each run, shape (runs, steps, channels); None if a run diverges."""
        if self._lanes is None:
            done, _ = run_one_by_one(runs, 1)
            if any(run.failure for run in done):
                return None
            return np.stack([run.trajectory.samples for run in done])
        # Lanes run in whole groups: unused lanes of the last group write to rows that are dropped.
        rows = -(-len(runs) // LANES) * LANES
        samples = np.empty((rows, self.steps, len(self._first.channels)))
        for begin in range(0, len(runs), LANES):
            some = runs[begin : begin + LANES]
            keys = [run.step_plan_key for run in some]
            into = LaneSamples.by_sample(samples[begin : begin + LANES])
            sound, _ = self._lanes.run(LaneStarts.of(some), keys, into)
            if (sound[: len(some)] < self.steps).any():
                return None
        return samples[: len(runs)]

    def _sensed(self, run: PreparedRun, trajectory: Trajectory) -> np.ndarray:
        """Return a run's low-passed signals along the measured axes, shape (steps, axes)."""
        sensor, deck = self.measured.sensor, run.system.deck_model
        first = trajectory.channels.index(type(deck).CHANNELS[0])
        motion = trajectory.samples[:, first : first + len(type(deck).CHANNELS)]
        sensed = self._at_sensor(run, motion)
        if sensor is not None:
            pickup = low_pass_alone(sensor, self.step)
            start = start_state(run.scene, run.system)[layout_of(run.system).deck]
            # Initialise the low-pass as if the drive had been at rest there for a long time.
            pickup.reset(self._at_sensor(run, deck.at_rest(start))[0])
            sensed = pickup.process(1, sensed)
        return sensed[:, :1] * self._cosine + sensed[:, 1:2] * self._sine

    def _at_sensor(self, run: PreparedRun, samples: np.ndarray) -> np.ndarray:
        """Return the quantity at the sensor along the deck's x and y, shape (steps, 2).

        This is the displacement [m] or the specific force [m/s^2]. ``samples`` are the deck's
        channels, shape (steps, channels).
        """
        deck, sensor = run.system.deck_model, self.measured.sensor
        if self.measured.kind == DISPLACEMENT:
            names = type(deck).CHANNELS
            return samples[:, [names.index("x"), names.index("y")]]
        point = (0.0, 0.0, 0.0) if sensor is None else sensor.position
        force = deck.specific_force(run.system.effects, samples.T, point)
        return np.stack(
            [np.broadcast_to(component, len(samples)) for component in force[:2]], axis=1
        )

    def _at_times(
        self, runs: np.ndarray, delay: float, slope: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the signals of all runs at the recorded times, and the slope of the first run."""
        if self._grid is not None and delay == 0.0 and not slope:
            return runs[:, self._grid], np.zeros(runs.shape[2:])
        # Steps that do not coincide with samples, and a delay, need interpolation. A spline also
        # has the slope, which is the derivative of the signals by a delay, up to the sign.
        time = self.step * np.arange(1, self.steps + 1)
        spline = CubicSpline(time, runs, axis=1)
        at = np.maximum(self.measured.time - delay, 0.0)
        slopes = spline(at, 1)[0] if slope else np.zeros(runs.shape[2:])
        return spline(at), slopes


def _heavier(scene: Scene, mass: float) -> Scene:
    """Return the scene with a mass clamped to the deck, which adds no unbalance."""
    key = "mass" if scene.rotor.total_mass is None else "total_mass"
    changes = {
        f"rotor.{key}": getattr(scene.rotor, key) + mass,
        "rotor.eccentric_mass": scene.eccentric_mass,
    }
    return changed_scene(scene, changes, "trial mass")


def _step(scene: Scene, measured: Measured) -> float:
    """Return the integration step [s]: recorded, or a whole fraction of the sampling interval.

    With such a fraction every sample coincides with a step and needs no interpolation. If the
    interval has too many digits, return the scene's step.
    """
    if measured.step is not None:
        return measured.step
    between = float(np.median(np.diff(measured.time)))
    parts = max(1, math.ceil(between / scene.solver.step - _ON_GRID))
    step = round(between / parts, 9)
    return step if step > 0 and abs(step * parts / between - 1.0) < 1e-9 else scene.solver.step


def _followed(scene: Scene, measured: Measured, step: float) -> Scene:
    """Return the scene with the recorded speed as its profile, and without a motor and sensors."""
    pieces = measured.schedule.segments[:-1]
    first = pieces[0].law
    # The recorded motion has happened, so the spindle's limits in the scene do not apply.
    changes: dict[str, Any] = {
        "profile": {
            "kind": "segments",
            "segments": [
                {
                    "duration": piece.end - piece.start,
                    "acceleration": float(piece.law.acceleration(0.0)),
                }
                for piece in pieces
            ],
        },
        "start.speed": float(first.speed(0.0)),
        "start.angle": float(pieces[0].start_angle),
        "spindle.max_speed": 1e5,
        "spindle.max_acceleration": 1e6,
        "sensors": {},
        "probes": {},
        "solver.step": step,
        "duration": max(measured.duration, step),
    }
    if MOTOR in scene.effects:
        others = scene.as_mapping()["effects"]
        assert isinstance(others, dict)
        changes["effects"] = {name: effect for name, effect in others.items() if name != MOTOR}
    return changed_scene(scene, changes, measured.name)


def _prepared(scene: Scene, name: str) -> PreparedRun:
    """Prepare the first run; name the original scene in an error."""
    try:
        return PreparedRun(scene)
    except SceneError as error:
        raise SceneError(f"{name}: cannot be run as it was recorded: {error}") from error
