"""How far a running drive is from the truth, estimated beside it, at a bounded price; no ROS.

Now and then a window of the run is done again with half the step, from the same state and with the
same commands. What the two differ by at the same times is the error that the drive's step has made
*within the window*, to a part in 2^p for a stepper of order p: step doubling (Hairer, Norsett,
Wanner, Solving Ordinary Differential Equations I, II.4), over many steps instead of one, so that
errors have the time to grow at a resonance, and to decay where damping forgets them.

What it is not: the error since the start. What had been made before a window began is not in it,
and a run that never forgets, without damping, has the sum of all windows' errors, seen or not.
Where checks keep up with the drive, windows are ``WINDOW`` steps long, which is usually longer than
what the drive remembers: on ten scenes and three methods the largest estimate of a run was 0.35 to
1.0 times its largest true error. Where the share allows less, windows are shorter, so that one is
begun every ``WINDOW`` steps at least; they see less of what accumulates: take the estimate for a
lower bound then. And rounding is in both runs: an estimate near 1e-12 is of rounding's size.
"""

import contextlib
import itertools
import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from ab_sim.accuracy.deviation import Samples, deviation
from ab_sim.drive import Drive
from ab_sim.drive.faults.fault import of_the_plant
from ab_sim.drive.trajectory import Trajectory
from ab_sim.errors import DivergedError
from ab_sim.integrate.registry import parameters_of
from ab_sim.scene.model import Scene
from ab_sim.spindle.set_points import TimedSpeeds

WINDOW = 1000
"""Steps of the drive in a window if checks keep up: many turns of the spindle."""
SHORTEST = 125
"""Steps in the first window, and in those of checks that do not keep up."""
SHARPER = 1e-3
"""What is left of a tolerance where there is one: what a run differs by is then its own error."""
SLICE = 128
"""Steps of half the length in a slice, of which calling them is then a small part."""


class ErrorEstimate(NamedTuple):
    """Largest differences to half the step: within a window."""

    angle: float
    """Of any ball's angle [rad]."""
    whirl: float
    """Of the deck's displacement [e], in race radii if e = 0."""


NONE_YET = ErrorEstimate(0.0, 0.0)


class _Part(NamedTuple):
    """What the drive did in one call."""

    commands: tuple[Callable[[Drive], None], ...]
    """Given just before; each commands a drive."""
    first: int
    """Number of the first step."""
    taken: Trajectory

    @property
    def last(self) -> int:
        """Number of the last step."""
        return self.first + len(self.taken) - 1


class LiveChecks:
    """Runs windows of a drive's run again, in slices that keep within a share of the work.

    The drive itself is only read: what it does is the same, bit for bit, with and without checks.

    Args:
        drive: to be commanded, advanced and reset through this from now on.
        share: of all the work's CPU time, the most that checks may take, above 0 and at most 1.
        longest: CPU time that one slice may be expected to take [s].
    """

    def __init__(self, drive: Drive, share: float, longest: float = math.inf) -> None:
        if drive.system.energy_balance:
            raise ValueError(
                "checks need a drive without an energy balance, which would be done again, too"
            )
        if not 0.0 < share <= 1.0:
            raise ValueError(f"share = {share}: must be above 0, and at most 1")
        self._drive, self._most, self._longest = drive, share, longest
        broken = of_the_plant(drive.faults)
        self._shadow = Drive(half_step(drive), commanded=True, faults=broken)
        self._per_step = 1e-9
        """CPU time of a step of half the length [s], the dearest slice of late."""
        self.reset_counts()

    @property
    def share(self) -> float:
        """What checks have taken of all the work's CPU time so far."""
        return self._spent / max(self._spent + self._worked, 1e-9)

    @property
    def checked(self) -> int:
        """Steps of the drive that have been done again."""
        return self._halves // 2

    def warm_up(self, speed: float, steps: int) -> None:
        """Go through all that checks call, and find out what it costs; then reset everything.

        Args:
            speed: for a command [rad/s].
            steps: as the drive will be advanced by.
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
        """Forget estimates, and times but for the cost of a step; a window begins anew."""
        self.latest = NONE_YET
        self.largest = NONE_YET
        self._halves = 0
        self._spent = self._worked = 0.0
        self._window: deque[_Part] | None = None
        self._commands: tuple[Callable[[Drive], None], ...] = ()
        self._begun = self._end = 0
        self._length = SHORTEST
        self._now = NONE_YET

    def command(self, speed: float, acceleration: float | None = None) -> None:
        """``Drive.command``."""
        self._give(lambda drive: drive.command(speed, acceleration))

    def follow(self, speeds: TimedSpeeds, acceleration: float) -> None:
        """``Drive.follow``."""
        self._give(lambda drive: drive.follow(speeds, acceleration))

    def _give(self, command: Callable[[Drive], None]) -> None:
        command(self._drive)
        self._commands = (*self._commands, command)

    def advance(self, steps: int) -> Trajectory:
        """``Drive.advance``."""
        if self._window is None:
            begin = time.thread_time()
            self._window = self._begin_window()
            self._commands = ()  # The window begins with what they did.
            self._account(begin)
        recording, commands = self._recording, self._commands
        try:
            taken = self._drive.advance(steps)
        except DivergedError:
            self._window = None  # What was taken before that is missing in it.
            raise
        self._commands = ()
        if len(taken) and recording:
            first = self._drive.steps - steps + 1
            self._window.append(_Part(commands, first, taken))
        return taken

    def reset(self) -> None:
        """``Drive.reset``; estimates begin anew."""
        self._drive.reset()
        self.begin_anew()

    def begin_anew(self) -> None:
        """The drive has leapt to another state: what has been recorded leads nowhere."""
        self._window, self._commands, self._length = None, (), SHORTEST
        self.latest = self.largest = self._now = NONE_YET

    def work(self, seconds: float) -> None:
        """Do a slice of checking, if the share allows it.

        Args:
            seconds: CPU time that the work beside checks has taken since the last call, in
                ``advance`` and wherever else.
        """
        self._worked += seconds
        begin = time.thread_time()
        steps = int(min(SLICE, self._longest / self._per_step)) or 1
        if self._recorded() < steps:
            if self._recording:
                return  # A whole slice will be there soon.
            steps = self._recorded()
        # So that spent + cost <= most (worked + spent + cost).
        paid = self._most / (1.0 - self._most) if self._most < 1.0 else math.inf
        if steps and self._spent + steps * self._per_step <= paid * self._worked:
            self.check(steps)
            self._account(begin)

    def check(self, steps: int) -> None:
        """Do at most so many steps of half the length, as far as the window has been recorded."""
        if self._window is None:
            return
        begin, before = time.thread_time(), self._shadow.steps
        try:
            while self._window and self._shadow.steps - before < steps:
                self._check_on(self._window, before + steps)
        except DivergedError:
            # The drive itself is still sound, or this would not be called.
            self._found(ErrorEstimate(math.inf, math.inf))
            self.latest, self._now, self._window = self._now, NONE_YET, None
            return
        done = self._shadow.steps - before
        self._halves += done
        if done:
            # What costs more than expected would break the bound.
            self._per_step = max((time.thread_time() - begin) / done, 0.9 * self._per_step)
        if not self._window and not self._recording:
            self.latest, self._now, self._window = self._now, NONE_YET, None
            # As long as can be done again while the drive goes on by WINDOW.
            pace = self._length / max(self._drive.steps - self._begun, self._length)
            self._length = max(SHORTEST, round(WINDOW * pace))

    @property
    def estimate(self) -> ErrorEstimate:
        """The larger one of the window under way and the last one that was finished."""
        return ErrorEstimate(*map(max, self._now, self.latest))

    @property
    def _recording(self) -> bool:
        return self._drive.steps < self._end

    def _begin_window(self) -> deque[_Part]:
        kept = self._drive.snapshot()
        # Twice as many steps of half the length end at the same time to the last bit.
        kept = kept._replace(steps=2 * kept.steps, step=self._shadow.step, pickups={})
        self._shadow.restore(kept)
        self._begun, self._end = self._drive.steps, self._drive.steps + self._length
        return deque()

    def _recorded(self) -> int:
        """Steps of half the length that can be done now."""
        if not self._window:
            return 0
        return 2 * self._window[-1].last - self._shadow.steps

    def _account(self, begin: float) -> None:
        self._spent += time.thread_time() - begin

    def _check_on(self, window: deque[_Part], last: int) -> None:
        """Go on to the next command, at most to a step of the shadow, and compare."""
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
        # Steps of the drive that the shadow has now reached and gone past.
        lowest, highest = begin // 2 + 1, until // 2
        if lowest <= highest:
            same = slice(2 * lowest - begin - 1, 2 * highest - begin, 2)
            own = slice(lowest - parts[0].first, highest - parts[0].first + 1)
            shadow = Samples(taken.position[same], taken.ball_angles[same])
            drive = Samples.of(Trajectory.join([part.taken for part in parts]))
            drive = Samples(drive.position[own], drive.angles[own])
            found = deviation(drive, shadow, self._drive.scene.whirl_unit[0])
            self._found(ErrorEstimate(found.angle, found.whirl))
        while window and 2 * window[0].last <= until:
            window.popleft()

    def _found(self, error: ErrorEstimate) -> None:
        self._now = ErrorEstimate(*map(max, self._now, error))
        self.largest = ErrorEstimate(*map(max, self.largest, error))


def half_step(drive: Drive) -> Scene:
    """The drive's scene at half its step, without sensors: they do not act on the motion.

    Of a stepper that keeps to a tolerance the step says nothing: it gets ``SHARPER`` of that, too.
    """
    solver: dict[str, Any] = {"stepper": drive.stepper.name, "step": drive.step / 2.0}
    if drive.stepper.keeps_tolerance:
        allowed = parameters_of(drive.stepper.name)["tolerance"]
        parameters = drive.scene.solver.parameters
        sharper = SHARPER * parameters.get("tolerance", allowed.default)
        solver["parameters"] = {**parameters, "tolerance": max(sharper, allowed.lowest)}
    # Unchecked: half a step need not be whole nanoseconds, which only stamps need.
    return drive.scene.model_copy(
        update={"sensors": {}, "probes": {}, "solver": drive.scene.solver.model_copy(update=solver)}
    )
