"""Offline run of a scene without ROS, with samples at requested times."""

import cmath
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ab_sim.analysis.comparison import Compared, Comparison, without_balls, without_period
from ab_sim.analysis.metrics import Metrics, metrics_of
from ab_sim.analysis.rest import from_rest
from ab_sim.analysis.startup import AdaptiveOutcome
from ab_sim.base.errors import AbSimError, InputError, exact
from ab_sim.base.presentation import LAST, Columns, Presented, Progress, drawn, ends, number
from ab_sim.base.version import __version__
from ab_sim.drive import Drive
from ab_sim.drive.accuracy import WorkPrecision, resolve_accuracy
from ab_sim.drive.controllers import AdaptiveController, TimedDecision
from ab_sim.drive.observation import Observation
from ab_sim.drive.trajectory import MAX_VALUES, Trajectory
from ab_sim.drive.turn_vector import PHASE, SIZE, once_per_turn
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class OfflineRun(Presented):
    """Finished run with its trajectory and metrics; see ``ab_sim.simulate``."""

    _picture = "run"
    _rows = 0

    scene: Scene
    """Scene of the run; with a requested accuracy, including the solver that was chosen."""
    trajectory: Trajectory
    """Trajectory with every integration step, including the start."""
    samples: tuple[Observation, ...]
    """Observations, one per requested time and in that order."""
    variable_speed_period: float | None
    """Start of the variable-speed period [s], if the profile has one."""
    stepper: str
    """Name of the stepper used; a scene may leave the choice open."""
    events: int
    """Number of located events: reversals, sticking, release, impacts, limits of the motor."""
    steps_with_unresolved_events: int
    """Number of steps with too many events, plus instants without valid branches."""
    metrics: Metrics
    """Metrics of the run."""
    work_precision: WorkPrecision | None
    """Data of the solver choice, if an accuracy was requested."""
    decisions: tuple[TimedDecision, ...] = ()
    """Decisions of a profile that is controlled during the run, in order."""
    adaptive: AdaptiveOutcome | None = None
    """Outcome of an adaptive start-up; None for other profiles."""
    aborted: TimedDecision | None = None
    """Time and reason of an abort by the profile controller; None if there was none."""

    def plot(self, comparison: Comparison | None = None) -> "Figure":
        """Draw speed, whirl, driving force and ball angles over time.

        Parameters
        ----------
        comparison : Comparison, optional
            Result of ``ab_sim.compare_run``, drawn for comparison.

        Returns
        -------
        matplotlib.figure.Figure
            The picture of ``ab-sim run --plot``.
        """
        return drawn(self._picture, self, comparison)

    def _facts(self) -> dict[str, str]:
        length, symbol = self.scene.whirl_unit
        time = self.trajectory["time"]
        final = self.metrics.final_whirl / length
        changing = "" if self.metrics.settled else " and changing"
        return {
            "scene": self.scene.name,
            "samples": str(len(self.trajectory)),
            "time": ends(time[0], time[-1], "s"),
            **(
                {"aborted": f"at {self.aborted.time:.3f} s: {self.aborted.text}"}
                if self.aborted is not None
                else {f"W/{symbol} at the end": number(final) + changing}
            ),
            "residual unbalance": number(self.metrics.residual_unbalance),
            "verdict": self.metrics.verdict,
            "stepper": self.stepper,
        }

    def _columns(self) -> Columns:
        return self.trajectory._columns()

    def _once_per_turn(self) -> Iterator[dict[str, float | None]]:
        """Yield magnitude [m] and phase [rad] of the once-per-turn vibration for each sample."""
        if not self.samples:
            return
        time, vectors = (
            self.trajectory["time"],
            once_per_turn(from_rest(self.trajectory, self.scene)),
        )
        for sample in self.samples:
            vector = complex(
                *(np.interp(sample.time, time, w) for w in (vectors.real, vectors.imag))
            )
            defined = not math.isnan(vector.real)
            yield {
                SIZE: abs(vector) if defined else None,
                PHASE: cmath.phase(vector) if defined else None,
            }

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values in SI units.

        See docs/reference/json.md and ``ab-sim metrics``.
        """
        duration = float(self.trajectory["time"][-1])
        return {
            "samples": [
                _sample(observation) | once
                for observation, once in zip(self.samples, self._once_per_turn(), strict=True)
            ],
            **self.metrics.report(self.scene.rotor.eccentricity),
            "peak_whirl": self.metrics.peak_whirl,
            "final_whirl": self.metrics.final_whirl,
            "final_stretch": LAST * duration,
            "variable_speed_period": self.variable_speed_period,
            "decisions": list(map(_reported, self.decisions)),
            "aborted": None if self.aborted is None else _reported(self.aborted),
            "adaptive": None if self.adaptive is None else self.adaptive.report(),
            "scene": self.scene.name,
            "effects": {name: effect._asdict() for name, effect in self.scene.effects.items()},
            "sensors": {name: sensor.model_dump() for name, sensor in self.scene.sensors.items()},
            "probes": {name: probe.model_dump() for name, probe in self.scene.probes.items()},
            "stepper": self.stepper,
            "step": self.scene.solver.step,
            "accuracy": None if self.work_precision is None else self.work_precision.report(),
            "events": self.events,
            "steps_with_unresolved_events": self.steps_with_unresolved_events,
            "duration": duration,
            "version": __version__,
        }


def run_scene(
    scene: Scene,
    times: Sequence[float] = (),
    progress: Callable[[Drive, Trajectory], None] | None = None,
    parts: int = 100,
    tell: Progress | None = None,
) -> OfflineRun:
    """Run a scene's profile from its start to its end.

    Parameters
    ----------
    scene
        Scene to run; a requested accuracy is resolved first. The run lasts ``scene.duration``, or
        until the last of ``times``.
    times
        Times of the samples [s]; they need not lie on the step grid.
    progress
        Called with the drive and the newest samples about ``parts`` times.
    parts
        Number of blocks of the run for ``progress``.
    tell
        Called while an accuracy is measured, see ``resolve_accuracy``.

    Raises
    ------
    InputError
        A time is negative or not finite, or the run would have too many samples.
    SceneError, DivergedError
        See ``Drive`` and ``resolve_accuracy``.
    """
    for time in times:
        if not 0 <= time <= sys.float_info.max:
            raise InputError(f"times: {exact(time)} s: must be a finite number, at least 0")
    end = max([scene.duration, *times])
    scene, work_precision = resolve_accuracy(scene, tell=tell)
    drive = Drive(scene)
    if end / drive.step * len(drive.channels) > MAX_VALUES:
        what = "duration =" if end == scene.duration else "times:"
        most = MAX_VALUES // len(drive.channels) * drive.step
        raise InputError(
            f"{what} {exact(end)} s: every step is kept, so it must be at most {most:.10g} s with "
            f"steps of {drive.step:g} s; use a longer solver.step or a shorter run"
        )
    # The run stops at the last step before each requested time, from which a sample is computed,
    # and at the ends of ``parts`` equal blocks. 1e-9 of a step allows for rounded times.
    steps = math.ceil(end / drive.step - 1e-9)
    times_by_stop: dict[int, list[float]] = {}
    for time in times:
        times_by_stop.setdefault(math.floor(time / drive.step + 1e-9), []).append(time)
    stops = {round(steps * part / parts) for part in range(1, parts + 1)} | {0, steps}
    taken = [drive.present()]
    samples: dict[float, Observation] = {}
    for stop in sorted(stops | times_by_stop.keys()):
        newest = drive.advance(stop - drive.steps)
        taken.append(newest)
        for time in times_by_stop.get(stop, ()):
            samples[time] = drive.observe_at(max(time, drive.time))
        if progress is not None and len(newest):
            progress(drive, newest)
    whole, controller = Trajectory.join(taken), drive.controller
    return OfflineRun(
        drive.scene,
        whole,
        tuple(samples[time] for time in times),
        drive.schedule.variable_speed_period,
        drive.stepper.name,
        drive.events,
        drive.steps_with_unresolved_events,
        metrics_of(whole, drive.scene),
        work_precision,
        () if controller is None else tuple(controller.decisions),
        AdaptiveOutcome.of(controller) if isinstance(controller, AdaptiveController) else None,
        None if controller is None else controller.aborted,
    )


def compare_run(
    run: OfflineRun, progress: Callable[[Drive, Trajectory], None] | None = None
) -> Comparison:
    """Repeat a run without the balls, and without the variable-speed period.

    Parameters
    ----------
    run : OfflineRun
        Run to compare with. The others have the same duration, stepper and step.
    progress : callable, optional
        Called with the drive and its newest samples, as each run advances.

    Returns
    -------
    Comparison
        ``without_balls`` (also without their mass) and ``without_period``: time [s], whirl [m],
        speed [rad/s], each of shape (samples,), and metrics. Instead, the error message of a run
        that failed, or None if the scene has nothing to leave out.

    Examples
    --------
    >>> import ab_sim
    >>> run = ab_sim.simulate(ab_sim.load_scene("thesis-hold", ["duration=0.2"]))
    >>> comparison = ab_sim.compare_run(run)
    >>> round(comparison.relative_whirl(run.metrics), 1)  # with balls / without balls
    3.1
    >>> picture = run.plot(comparison)  # what `ab-sim run --plot` draws
    """
    period = balls = None
    if run.variable_speed_period is not None:
        period = _compared(run, without_period, progress)
    if run.scene.balls.count:
        balls = _compared(run, without_balls, progress)
    return Comparison(period, balls)


def _compared(
    run: OfflineRun,
    change: Callable[[Scene], Scene],
    progress: Callable[[Drive, Trajectory], None] | None,
) -> Compared | str:
    """Run a changed copy of a run's scene with the same duration, stepper and step.

    Returns
    -------
    Compared | str
        Results of the run, or the error message if it failed.
    """
    duration = float(run.trajectory["time"][-1])
    same = {"solver.stepper": run.stepper, "duration": duration}
    try:
        scene = changed_scene(change(run.scene), same, "compared run")
        other = run_scene(scene, progress=progress)
    except AbSimError as error:
        return str(error)
    path = from_rest(other.trajectory, other.scene)
    return Compared(other.metrics, path["time"].copy(), path.whirl, path["speed"].copy())


def _reported(decision: TimedDecision) -> dict[str, Any]:
    """Return the time [s] and the text of a decision, JSON-able."""
    return {"t": decision.time, "text": decision.text}


def _sample(observation: Observation) -> dict[str, Any]:
    """Return an observation as JSON-able values in SI units; absent quantities are left out."""
    place, velocity = observation.position.tolist(), observation.velocity.tolist()
    sample = {
        "t": observation.time,
        "psi": observation.psi,
        "omega": observation.omega,
        "u": observation.u.tolist(),
        "v": observation.v.tolist(),
        **dict(zip("xyz", place, strict=False)),
        **dict(zip(("vx", "vy", "vz"), velocity, strict=False)),
        "whirl": observation.whirl,
        "theta": observation.theta.tolist(),
        "theta_rate": observation.theta_rate.tolist(),
        "stuck": observation.stuck.tolist(),
    }
    if len(place) == 3:
        sample["tilt"] = observation.tilt.tolist()
        sample["angular_velocity"] = observation.angular_velocity.tolist()
    if not math.isnan(observation.motor_torque):
        sample["motor_torque"] = observation.motor_torque
    if observation.readings:
        sample["readings"] = {name: read.tolist() for name, read in observation.readings.items()}
    return sample
