"""How far a running drive is from the truth, estimated beside it, at a bounded price; no ROS.

Now and then a window of the run is done again with half the step, from the same state and with the
same commands. What the two differ by at the same times is the error that the drive's step has made
*within the window*, to a part in 2^p for a stepper of order p: step doubling (Hairer, Norsett,
Wanner, Solving Ordinary Differential Equations I, II.4), over many steps instead of one, so that
errors have the time to grow at a resonance, and to decay where damping forgets them.

What it is not: the error since the start. What had been made before a window began is not in it,
and a run that never forgets, without damping, has the sum of all windows' errors, seen or not.
Where the windows are longer than what the drive remembers, which ``WINDOW`` steps usually are, the
largest estimate of the run has been a half to one and a half times the largest true error. And
rounding is in both runs: estimates near 1e-12 are of rounding's size, not more.
"""

import math
import time
from collections import deque
from typing import NamedTuple

import numpy as np

from ab_sim.drive import Drive
from ab_sim.errors import DivergedError
from ab_sim.scene.model import Scene
from ab_sim.trajectory import Trajectory

WINDOW = 1000
"""Steps of the drive in a window: seconds, of a drive that turns once in some ten steps."""
_FEWEST = 8
"""Steps of half the length that are worth a call."""


class ErrorEstimate(NamedTuple):
    """Largest differences to half the step: within a window."""

    angle: float
    """Of any ball's angle [rad]."""
    whirl: float
    """Of the deck's place [e], in race radii if e = 0."""


NONE_YET = ErrorEstimate(0.0, 0.0)


class _Command(NamedTuple):
    step: int
    speed: float


class _Sample(NamedTuple):
    step: int
    position: np.ndarray
    angles: np.ndarray


class ErrorChecks:
    """Runs windows of a drive's run again, in slices that keep within a share of the work.

    The drive itself is only read: what it does is the same, bit for bit, with and without checks.

    Args:
        drive: to be commanded, advanced and reset through this from now on.
        share: of all the work's CPU time, the most that checks may take, above 0 and at most 1.
        longest: CPU time that one slice may be expected to take [s].
    """

    def __init__(self, drive: Drive, share: float, longest: float = math.inf) -> None:
        if not 0.0 < share <= 1.0:
            raise ValueError(f"share = {share}: must be above 0, and at most 1")
        self._drive, self._most, self._longest = drive, share, longest
        self._shadow = Drive(half_step(drive), commanded=True)
        self._per_step = math.inf
        """CPU time of a shadow's step, call included, in the slices so far: slowly forgotten."""
        self.reset_counts()

    @property
    def share(self) -> float:
        """What checks have taken of all the work's CPU time so far."""
        return self._spent / max(self._spent + self._worked, 1e-9)

    def reset_counts(self) -> None:
        """Forget estimates, and times but for the cost of a step; a window begins anew."""
        self.latest = NONE_YET
        self.largest = NONE_YET
        self.checked = 0
        """Steps of the drive that have been done again."""
        self._spent = self._worked = 0.0
        self._window: deque[_Command | _Sample] | None = None
        self._end = 0
        self._now = NONE_YET

    def command(self, speed: float) -> None:
        """``Drive.command``."""
        self._drive.command(speed)
        if self._recording:
            assert self._window is not None
            self._window.append(_Command(self._drive.steps, speed))

    def advance(self, steps: int) -> Trajectory:
        """``Drive.advance``."""
        begin = time.thread_time()
        if self._window is None:
            self._begin_window()
        self._account(begin)
        taken = self._drive.advance(steps)
        if len(taken) and self._recording:
            assert self._window is not None
            place = np.array([taken["x"][-1], taken["y"][-1]])
            self._window.append(_Sample(self._drive.steps, place, taken.ball_angles[-1].copy()))
        return taken

    def reset(self) -> None:
        """``Drive.reset``; estimates begin anew."""
        self._drive.reset()
        self._window = None
        self.latest = self.largest = self._now = NONE_YET

    def work(self, seconds: float) -> None:
        """Do a slice of checking, if the share allows it.

        Args:
            seconds: CPU time that the work beside checks has taken since the last call, in
                ``advance`` and wherever else.
        """
        self._worked += seconds
        begin = time.thread_time()
        steps = self._affordable()
        if steps >= _FEWEST:
            self.check(steps)
            self._account(begin)

    def check(self, steps: int) -> None:
        """Do at most so many steps of half the length, as far as the window has been recorded."""
        if self._window is None:
            return
        begin, before = time.thread_time(), self._shadow.steps
        try:
            while self._window and self._shadow.steps - before < steps:
                self._check_on(before + steps)
        except DivergedError:
            # The drive itself is still sound, or this would not be called.
            self._found(ErrorEstimate(math.inf, math.inf))
            self._window = None
            return
        done = self._shadow.steps - before
        self.checked += done // 2
        if done >= _FEWEST:
            cost = (time.thread_time() - begin) / done
            # The dearest of late: what costs more than expected would break the bound.
            self._per_step = cost if math.isinf(self._per_step) else max(cost, 0.9 * self._per_step)
        if not self._window and not self._recording:
            self.latest, self._now, self._window = self._now, NONE_YET, None

    @property
    def estimate(self) -> ErrorEstimate:
        """The larger one of the window under way and the last one that was finished."""
        return ErrorEstimate(*map(max, self._now, self.latest))

    @property
    def _recording(self) -> bool:
        return self._window is not None and self._drive.steps <= self._end

    def _begin_window(self) -> None:
        kept = self._drive.snapshot()
        # Twice as many steps of half the length end at the same time to the last bit.
        kept = kept._replace(steps=2 * kept.steps, step=self._shadow.step, pickup=None)
        self._shadow.restore(kept)
        self._window = deque()
        self._end = self._drive.steps + WINDOW

    def _affordable(self) -> int:
        """Steps of half the length that the share pays for now."""
        if self._window is None or not self._window:
            return 0
        if math.isinf(self._per_step):
            return _FEWEST
        # spent + x <= most (worked + spent + x)
        left = self._most * self._worked / max(1.0 - self._most, 1e-9) - self._spent
        return int(min(left, self._longest) / self._per_step)

    def _account(self, begin: float) -> None:
        self._spent += time.thread_time() - begin

    def _check_on(self, last: int) -> None:
        """Go to the next command, or through the samples before it, up to a step of the shadow."""
        assert self._window is not None
        if isinstance(self._window[0], _Command):
            if 2 * self._window[0].step > self._shadow.steps:
                self._go(min(2 * self._window[0].step, last), [])
            else:
                self._shadow.command(self._window.popleft().speed)  # type: ignore[union-attr]
            return
        samples: list[_Sample] = []
        while self._window and isinstance(self._window[0], _Sample):
            if samples and 2 * self._window[0].step > last:
                break
            samples.append(self._window.popleft())  # type: ignore[arg-type]
        if 2 * samples[-1].step > last:
            self._window.appendleft(samples.pop())
        self._go(min(2 * samples[-1].step if samples else last, last), samples)

    def _go(self, until: int, samples: list[_Sample]) -> None:
        first = self._shadow.steps
        taken = self._shadow.advance(until - first)
        if not samples:
            return
        rows = [2 * sample.step - first - 1 for sample in samples]
        angles = np.abs(taken.ball_angles[rows] - np.array([s.angles for s in samples]))
        places = np.array([s.position for s in samples])
        apart = np.hypot(taken["x"][rows] - places[:, 0], taken["y"][rows] - places[:, 1])
        unit = self._drive.scene.whirl_unit
        self._found(ErrorEstimate(float(angles.max(initial=0.0)), float(apart.max()) / unit))

    def _found(self, error: ErrorEstimate) -> None:
        self._now = ErrorEstimate(*map(max, self._now, error))
        self.largest = ErrorEstimate(*map(max, self.largest, error))


def half_step(drive: Drive) -> Scene:
    """The drive's scene at half its step, without what acts on nothing."""
    effects = {name: effect for name, effect in drive.scene.effects.items() if effect.acts}
    solver = {"stepper": drive.stepper.name, "step": drive.step / 2.0}
    # Unchecked: half a step need not be whole nanoseconds, which only stamps need.
    return drive.scene.model_copy(
        update={"effects": effects, "solver": drive.scene.solver.model_copy(update=solver)}
    )
