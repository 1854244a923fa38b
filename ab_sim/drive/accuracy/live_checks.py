"""Error estimate of a running drive, at a bounded cost and without ROS.

From time to time a window of the run is repeated with half the step, from the same state and with
the same commands. The difference at the same times is the error that the drive's step has caused
*within the window*, up to a fraction of 2^-p for a stepper of order p. This is step doubling
(Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.4) over many steps instead
of one. Errors thus have time to grow at a resonance, and to decay by damping.

The estimate is not the error since the start: errors from before a window are not included. Without
damping such errors persist, and those of all windows accumulate. If checks keep up with the drive,
windows are ``WINDOW`` steps long, which is usually enough for earlier errors to decay. On ten
scenes and three methods the largest estimate of a run was 0.35 to 1.0 times its largest true error.
If the share allows less, windows are shorter, so that one starts at least every ``WINDOW`` steps.
Short windows contain less of the accumulated error, and the estimate is then a lower bound. Both
runs contain rounding errors: an estimate near 1e-12 is of that order.
"""

import contextlib
import itertools
import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from ab_sim.base.errors import DivergedError
from ab_sim.drive import Drive
from ab_sim.drive.accuracy.trials import Samples, deviation
from ab_sim.drive.faults.fault import of_the_plant
from ab_sim.drive.trajectory import Trajectory
from ab_sim.engine.integrate.registry import parameters_of
from ab_sim.model.spindle.commands import TimedSpeeds
from ab_sim.scene.model import Scene

WINDOW = 1000
"""Number of the drive's steps in a window if checks keep up with the drive."""
SHORTEST = 125
"""Number of the drive's steps in the first window, and in windows if checks do not keep up."""
_SHARPER = 1e-3
"""Factor on a stepper's tolerance for the comparison run, whose own error is then negligible."""
SLICE = 128
"""Number of half steps in a slice; it makes the overhead of calls small."""


class ErrorEstimate(NamedTuple):
    """Largest differences from the run with half the step, within a window."""

    angle: float
    """Largest difference of any ball's angle [rad]."""
    whirl: float
    """Largest difference of the deck's displacement, in units of e; in race radii if e = 0."""


_NONE_YET = ErrorEstimate(0.0, 0.0)


class _Part(NamedTuple):
    """Samples of the drive from one call."""

    commands: tuple[Callable[[Drive], None], ...]
    """Commands given just before; each is a function of a drive."""
    first: int
    """Number of the first step."""
    taken: Trajectory
    """Samples of the drive, beginning with step ``first``."""

    @property
    def last(self) -> int:
        """Number of the last step."""
        return self.first + len(self.taken) - 1


class LiveChecks:
    """Repeated windows of a drive's run, in slices within a share of the work.

    The drive is only read: its results are bit-identical with and without checks.

    Parameters
    ----------
    drive
        Drive; from now on it is commanded, advanced and reset through this object.
    share
        Largest share of checks in the total CPU time, above 0 and at most 1.
    longest
        Largest expected CPU time of a slice [s].
    """

    def __init__(self, drive: Drive, share: float, longest: float = math.inf) -> None:
        if drive.system.energy_balance:
            raise ValueError(
                "checks repeat steps without an energy balance; create the drive without "
                "energy_balance=True"
            )
        if not 0.0 < share <= 1.0:
            raise ValueError(f"share = {share}: must be above 0, and at most 1")
        self._drive, self._most, self._longest = drive, share, longest
        broken = of_the_plant(drive.faults)
        self._shadow = Drive(_half_step(drive), commanded=True, faults=broken)
        self._per_step = 1e-9
        """CPU time of a half step [s], from the most expensive recent slice."""
        self.reset_counts()

    @property
    def share(self) -> float:
        """CPU time of checks so far, as a fraction of the CPU time of checks and all other work."""
        return self._spent / max(self._spent + self._worked, 1e-9)

    @property
    def checked(self) -> int:
        """Number of the drive's steps that have been repeated."""
        return self._halves // 2

    def warm_up(self, speed: float, steps: int) -> None:
        """Run some checks, so that all code is loaded and its cost known, then reset.

        Parameters
        ----------
        speed
            Speed of a command [rad/s].
        steps
            Number of steps by which the drive will be advanced.
        """
        for _ in range(3):
            self.reset()
            with contextlib.suppress(DivergedError):
                self.advance(steps)
                self.command(speed)
                while self._recorded() < SLICE:
                    self.advance(steps)
            self.check(SLICE)
        self.reset()
        self.reset_counts()

    def reset_counts(self) -> None:
        """Reset estimates and times, except for the cost of a step, and start a new window."""
        self.latest = _NONE_YET
        self.largest = _NONE_YET
        self._halves = 0
        self._spent = self._worked = 0.0
        self._window: deque[_Part] | None = None
        self._commands: tuple[Callable[[Drive], None], ...] = ()
        self._begun = self._end = 0
        self._length = SHORTEST
        self._now = _NONE_YET

    def command(self, speed: float, acceleration: float | None = None) -> None:
        """Call ``Drive.command``."""
        self._give(lambda drive: drive.command(speed, acceleration))

    def follow(self, speeds: TimedSpeeds, acceleration: float) -> None:
        """Call ``Drive.follow``."""
        self._give(lambda drive: drive.follow(speeds, acceleration))

    def _give(self, command: Callable[[Drive], None]) -> None:
        """Apply a command to the drive, and keep the command for the comparison run."""
        command(self._drive)
        self._commands = (*self._commands, command)

    def advance(self, steps: int) -> Trajectory:
        """Call ``Drive.advance`` and record the returned samples for a check."""
        if self._window is None:
            begin = time.thread_time()
            self._window = self._begin_window()
            self._commands = ()  # The window starts after these commands.
            self._account(begin)
        recording, commands = self._recording, self._commands
        try:
            taken = self._drive.advance(steps)
        except DivergedError:
            self._window = None  # It lacks the samples of this call.
            raise
        self._commands = ()
        if len(taken) and recording:
            first = self._drive.steps - steps + 1
            self._window.append(_Part(commands, first, taken))
        return taken

    def reset(self) -> None:
        """Call ``Drive.reset`` and reset the estimates."""
        self._drive.reset()
        self.restart()

    def restart(self) -> None:
        """Discard the recorded window after the drive's state has been changed."""
        self._window, self._commands, self._length = None, (), SHORTEST
        self.latest = self.largest = self._now = _NONE_YET

    def work(self, seconds: float) -> None:
        """Check one slice of steps, if the allowed share of CPU time is not exceeded.

        Parameters
        ----------
        seconds
            CPU time of all work except checks since the last call [s].
        """
        self._worked += seconds
        begin = time.thread_time()
        steps = int(min(SLICE, self._longest / self._per_step)) or 1
        if self._recorded() < steps:
            if self._recording:
                return  # Wait until a whole slice is recorded.
            steps = self._recorded()
        # Ensures spent + cost <= share * (worked + spent + cost).
        paid = self._most / (1.0 - self._most) if self._most < 1.0 else math.inf
        if steps and self._spent + steps * self._per_step <= paid * self._worked:
            self.check(steps)
            self._account(begin)

    def check(self, steps: int) -> None:
        """Take at most ``steps`` half steps, as far as the window has been recorded."""
        if self._window is None:
            return
        begin, before = time.thread_time(), self._shadow.steps
        try:
            while self._window and self._shadow.steps - before < steps:
                self._check_on(self._window, before + steps)
        except DivergedError:
            # The drive itself is finite, otherwise this would not be called.
            self._add_error(ErrorEstimate(math.inf, math.inf))
            self.latest, self._now, self._window = self._now, _NONE_YET, None
            return
        done = self._shadow.steps - before
        self._halves += done
        if done:
            # Use the higher cost at once: an underestimate would violate the bound.
            self._per_step = max((time.thread_time() - begin) / done, 0.9 * self._per_step)
        if not self._window and not self._recording:
            self.latest, self._now, self._window = self._now, _NONE_YET, None
            # Choose the longest window that can be repeated while the drive advances by WINDOW.
            pace = self._length / max(self._drive.steps - self._begun, self._length)
            self._length = max(SHORTEST, round(WINDOW * pace))

    @property
    def estimate(self) -> ErrorEstimate:
        """Maximum of the current window and the last finished one."""
        return ErrorEstimate(*map(max, self._now, self.latest))

    @property
    def _recording(self) -> bool:
        return self._drive.steps < self._end

    def _begin_window(self) -> deque[_Part]:
        """Set the comparison run to the drive's present state, and return an empty window."""
        kept = self._drive.snapshot()
        # Twice as many half steps end at the same time, to the last bit.
        kept = kept._replace(steps=2 * kept.steps, step=self._shadow.step, pickups={})
        self._shadow.restore(kept)
        self._begun, self._end = self._drive.steps, self._drive.steps + self._length
        return deque()

    def _recorded(self) -> int:
        """Return the number of half steps that can be taken now."""
        if not self._window:
            return 0
        return 2 * self._window[-1].last - self._shadow.steps

    def _account(self, begin: float) -> None:
        """Add the CPU time since ``begin`` [s] to that of the checks."""
        self._spent += time.thread_time() - begin

    def _check_on(self, window: deque[_Part], last: int) -> None:
        """Advance the comparison run to the next command, at most to step ``last``, and compare."""
        for command in window[0].commands:
            command(self._shadow)
        window[0] = window[0]._replace(commands=())
        parts = [window[0]]
        for part in itertools.islice(window, 1, None):
            if part.commands or 2 * parts[-1].last >= last:
                break
            parts.append(part)
        begin, until = self._shadow.steps, min(2 * parts[-1].last, last)
        taken = self._shadow.advance(until - begin)
        # Steps of the drive that the comparison run has now reached.
        lowest, highest = begin // 2 + 1, until // 2
        if lowest <= highest:
            same = slice(2 * lowest - begin - 1, 2 * highest - begin, 2)
            compared = slice(lowest - parts[0].first, highest - parts[0].first + 1)
            shadow = Samples(taken.position[same], taken.ball_angles[same])
            drive = Samples.of(Trajectory.join([part.taken for part in parts]))
            drive = Samples(drive.position[compared], drive.angles[compared])
            error = deviation(drive, shadow, self._drive.scene.whirl_unit[0])
            self._add_error(ErrorEstimate(error.angle, error.whirl))
        while window and 2 * window[0].last <= until:
            window.popleft()

    def _add_error(self, error: ErrorEstimate) -> None:
        """Include an error in the maximum of the current window and in that of the run."""
        self._now = ErrorEstimate(*map(max, self._now, error))
        self.largest = ErrorEstimate(*map(max, self.largest, error))


def _half_step(drive: Drive) -> Scene:
    """Return the drive's scene at half its step, without sensors, which do not affect the motion.

    A stepper with a tolerance ignores the step, so its tolerance is reduced by ``_SHARPER``, too.
    """
    solver: dict[str, Any] = {"stepper": drive.stepper.name, "step": drive.step / 2.0}
    if drive.stepper.keeps_tolerance:
        allowed = parameters_of(drive.stepper.name)["tolerance"]
        parameters = drive.scene.solver.parameters
        sharper = _SHARPER * parameters.get("tolerance", allowed.default)
        solver["parameters"] = {**parameters, "tolerance": max(sharper, allowed.lowest)}
    # Skip validation: half a step need not be whole nanoseconds, which only time stamps need.
    return drive.scene.model_copy(
        update={"sensors": {}, "probes": {}, "solver": drive.scene.solver.model_copy(update=solver)}
    )
