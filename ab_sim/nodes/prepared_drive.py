"""Drive of a live run: prepared in advance, and following the orders of a command path."""

import contextlib
import copy
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from ab_sim.base.errors import DivergedError
from ab_sim.drive import Drive
from ab_sim.drive.accuracy import WorkPrecision, resolve_accuracy
from ab_sim.drive.accuracy.live_checks import LiveChecks
from ab_sim.drive.description import describe
from ab_sim.drive.faults.active import ActiveFaults
from ab_sim.drive.faults.fault import Fault
from ab_sim.drive.observation import Snapshot
from ab_sim.drive.trajectory import Trajectory
from ab_sim.engine.integrate.registry import AUTO
from ab_sim.nodes.command_path import CommandPath, TrajectoryOrder
from ab_sim.nodes.drive_health import DriveHealth, RealTimeTolerance
from ab_sim.nodes.pacing import Pacer
from ab_sim.nodes.parameters import whole_ratio
from ab_sim.scene import Scene, load_scene

_LONGEST_CHECK = 0.25
"""Largest duration of an error check at one wake-up, as a fraction of the wake-up period."""


class Rates(NamedTuple):
    """Rates of the main loop, and limits of how far the loop may lag behind real time."""

    wake: float
    """Number of wake-ups per second [1/s]."""
    per_state: int
    """Number of wake-ups per publication of the state."""
    per_block: int
    """Number of wake-ups per block of samples."""
    patience: float
    """Lag beyond which steps are dropped [s]."""
    catch_up: float
    """Largest number of steps at one wake-up, relative to the usual number per wake-up."""


def scene_of(name: str, changes: Sequence[str], rates: Rates) -> Scene:
    """Return the scene that parameters name.

    Parameters
    ----------
    name
        Name or file of the scene.
    changes
        Changes to the scene, each ``key=value``.
    rates
        Rates of the main loop.

    Raises
    ------
    SceneError, InputError
        The scene does not exist, or cannot be run at these rates.
    """
    scene = load_scene(name, filter(None, changes))
    if scene.accuracy is None:
        _per_wake(scene.solver.step, rates)
    return scene


class PreparedDrive:
    """Scene with everything that is needed to run it live.

    Parameters
    ----------
    scene
        Scene to run.
    rates
        Rates of the main loop.
    share
        Fraction of the loop's CPU time for error checks; 0: no checks.
    tolerance
        Limits beyond which there is a warning.
    say
        Function that logs a text if the work takes long.
    """

    def __init__(
        self,
        scene: Scene,
        rates: Rates,
        share: float,
        tolerance: RealTimeTolerance,
        say: Callable[[str], Any],
    ) -> None:
        if scene.accuracy is not None:
            say(f"{scene.name}: measuring which solver delivers the requested accuracy")
        period = 1.0 / rates.wake
        self.scene, self.work_precision = resolve_accuracy(scene, period=period, commanded=True)
        self._rates = rates
        self.drive = Drive(self.scene, commanded=True)
        step = self.drive.step
        self.per_wake = _per_wake(step, rates)
        self.step_ns = round(step * 1e9)
        self.checks = self.checks_for(share)
        self.pacer = Pacer(step, self.per_wake, int(rates.catch_up * self.per_wake), rates.patience)
        self.health = DriveHealth(
            self.drive, self.pacer, self.checks, tolerance, self.work_precision
        )
        self._warm_up()

    def altered(self, scene: Scene, faults: tuple[Fault, ...], share: float) -> "PreparedDrive":
        """Return a prepared drive with other values or faults, but the same solver and pacer.

        Parameters
        ----------
        scene
            Scene with the effects and the solver of the present one.
        faults
            All faults of the new drive.
        share
            Fraction of the loop's CPU time for error checks; 0: no checks.

        Raises
        ------
        SceneError
            The scene cannot be run.
        InputError
            A fault does not apply to the scene.
        """
        other = copy.copy(self)
        other.scene, other.drive = scene, Drive(scene, commanded=True, faults=faults)
        other.checks = other.checks_for(share)
        tolerance = self.health.tolerance
        other.health = DriveHealth(
            other.drive, self.pacer, other.checks, tolerance, self.work_precision
        )
        return other

    @property
    def time_ns(self) -> int:
        """Simulated time [ns]."""
        return self.drive.steps * self.step_ns

    def checks_for(self, share: float) -> LiveChecks | None:
        """Return new error checks of the drive; None if there is no share of the CPU time for them.

        Also return None for a slipping disc, because its jerks interrupt each check.
        """
        if not share or any(fault.verb == "slips" for fault in self.drive.faults):
            return None
        return LiveChecks(self.drive, share, longest=_LONGEST_CHECK / self._rates.wake)

    def description(self) -> dict[str, Any]:
        """Return the description of the simulated drive."""
        work_precision: WorkPrecision | None = self.work_precision
        return describe(self.scene, None if work_precision is None else work_precision.report())

    def words(self) -> str:
        """Return a description of scene and solver as one line of text."""
        scene, drive = self.scene, self.drive
        chosen = scene.solver.stepper == AUTO or self.work_precision is not None
        reason = f" ({self.health.stepper_chosen})" if chosen else ""
        what = ", ".join([f"{scene.balls.count} balls", *scene.effects, *scene.sensors])
        return f"{scene.name}: {what}; {drive.stepper.name} at {drive.step:g} s{reason}"

    def _warm_up(self) -> None:
        """Call once everything that the loop calls.

        The first call of a kernel compiles it, which would make the loop late.
        """
        drive = self.drive
        with contextlib.suppress(DivergedError):  # the loop detects and reports it again
            drive.advance(self.per_wake)
            drive.command(drive.servo.max_speed)
            drive.advance(self.per_wake)
        if self.checks is not None:
            self.checks.warm_up(drive.servo.max_speed, self.per_wake)
        drive.observe()
        drive.reset()


def _per_wake(step: float, rates: Rates) -> int:
    """Return the number of integration steps per wake-up, which must be whole.

    Raises
    ------
    InputError
        The period of wake-ups is not a multiple of the step [s].
    """
    return whole_ratio(1.0 / rates.wake, step, "period of wake_rate over the scene's step")


SLICE = 1000
"""Largest number of steps between two checks for orders, such as an emergency stop."""


class CommandedDrive:
    """Advances a drive, and applies each speed order and fault at the step for which it is due.

    Parameters
    ----------
    drive
        Drive; only this object may command it.
    path
        Source of the orders.
    checks
        Error checks of the drive; None: no checks.
    faults
        Faults of the drive.
    """

    def __init__(
        self,
        drive: Drive,
        path: CommandPath,
        checks: LiveChecks | None = None,
        faults: ActiveFaults | None = None,
    ) -> None:
        self.drive, self.path = drive, path
        self.faults = faults or ActiveFaults(drive)
        self.checks: LiveChecks | None
        self._stepped: Drive | LiveChecks
        self.set_checks(checks)

    def advance(self, steps: int) -> Iterator[Trajectory]:
        """Take integration steps, and yield the trajectory in successive parts.

        Raises
        ------
        DivergedError
            See ``Drive.advance``.
        """
        end = self.drive.steps + steps
        while self.drive.steps < end:
            if (jerked := self.faults.jerk(self.drive)) is not None:
                self.restore(jerked)
            self._apply_orders()
            now = self.drive.steps
            until = min(end, now + SLICE, self.path.next(now), self.faults.next(now))
            yield self._stepped.advance(int(until) - self.drive.steps)

    def reset(self) -> None:
        """Reset to t = 0 and the scene's start.

        Commands on the bus are dropped. Faults are kept.
        """
        self._stepped.reset()
        self.path.reset()
        self.faults.restart(0)

    def reset_time(self) -> None:
        """Set the time to 0 in the present state; commands remain in force."""
        kept = self.drive.snapshot()
        self.path.count_from(self.drive.steps, 0)
        self.faults.count_from(self.drive.steps, 0)
        self.restore(kept._replace(steps=0, schedule=kept.schedule.moved(-self.drive.time)))

    def reset_state(self) -> None:
        """Reset the state to the scene's start, and keep the time; drop commands on the bus."""
        steps, time = self.drive.steps, self.drive.time
        self.reset()
        self.faults.restart(steps)
        start = self.drive.snapshot()
        self.restore(start._replace(steps=steps, schedule=start.schedule.moved(time)))

    def restore(self, to: Snapshot) -> None:
        """Continue from a snapshot, and restart the error checks."""
        self.drive.restore(to)
        if self.checks is not None:
            self.checks.restart()

    def set_checks(self, checks: LiveChecks | None) -> None:
        """Replace the error checks; None: no checks."""
        self.checks = checks
        self._stepped = checks or self.drive

    def _apply_orders(self) -> None:
        """Pass all orders of the present step to the drive."""

        def speed() -> float:
            return self.drive.observe().omega

        while (order := self.path.order(self.drive.steps, speed)) is not None:
            if isinstance(order, TrajectoryOrder):
                self._stepped.follow(*order)
            else:
                self._stepped.command(*order)
