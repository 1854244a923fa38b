"""Which samples are kept of a run that is too long to keep them all."""

from __future__ import annotations

import math

import numpy as np

from ab_sim.errors import RecordingError
from ab_sim.recording.layout import Array

AROUND = 0.5
"""s before and after an event that are kept at full rate, unless told otherwise."""
SHARE = 0.1
"""Of the time, the most that full-rate stretches may take in the long run."""
STRETCHES = 20
"""So many of them, of full length, may come at once."""


class Thinning:
    """Keeps every so-many-th step, and all of them around what happens.

    What happens is what `note` is told, and the command's beginning to move and coming to rest
    (within ``around`` it has not moved): a ramp is kept at its two ends. Rows wait until nothing
    that is still to be noted can concern them, for twice ``around``, so what is kept depends on
    rows and notes alone, and never on how many rows come at once; as long as each event is noted
    before `take` is given rows later than its time + ``around``. Full-rate stretches may not take
    more than `SHARE` of the time, and `STRETCHES` at once; those beyond are refused, and counted,
    so that the rate is bounded whatever happens. The first and the last row are kept.

    Args:
        every: one step of so many, those whose number it divides.
        around: how much is kept at full rate before and after an event [s].

    Raises:
        RecordingError: ``every`` is not 1 or more, or ``around`` negative or not finite.
    """

    def __init__(self, every: int, around: float) -> None:
        if every < 1 or not 0.0 <= around < math.inf:
            raise RecordingError(
                f"every = {every}, around = {around:g} s: every must be at least 1, around at "
                "least 0 and finite"
            )
        self.every, self._around = every, around
        self.left_out = 0  # rows, by intent
        self.refused = 0  # full-rate stretches
        self._waiting = np.empty((0, 0))
        self._fresh: list[Array] = []  # that came after those
        self._noted: set[float] = set()  # times of what happened and is not weighed yet
        self._stretches: list[tuple[float, float]] = []  # that rows may still fall into
        self._reach = -math.inf  # end of the last stretch
        self._spent = 0.0  # s at full rate
        self._first = self._began = math.nan  # step and time of the first row
        self._moved = -math.inf  # when the command moved last
        self._resting = True
        self._command = math.nan

    def note(self, time: float) -> None:
        """Something happened at a time [s]."""
        if self.every > 1 and math.isfinite(time):
            self._noted.add(time)

    def take(self, rows: Array, command: int | None) -> tuple[Array, Array]:
        """Take rows; returns those that are kept for certain, see `_sift`.

        Args:
            rows: step, time and so on; at least one.
            command: the column of the command, if there is one.

        With ``every`` = 1 that is all of them, at once.
        """
        if self.every == 1:
            return rows, np.zeros(len(rows))
        if math.isnan(self._began):
            self._first, self._began = rows[0, :2].tolist()
            self._waiting = rows[:0]
        if command is not None:
            self._watch(rows[:, 1], rows[:, command])
        self._fresh.append(rows)
        if 4 * sum(map(len, self._fresh)) < len(self._waiting):
            return rows[:0], np.empty(0)  # few came: what waits is not copied for each of them
        self._wait()
        newest = rows[-1, 1]
        self._weigh(newest - self._around)
        # In two steps, which round as the start of a stretch that is still to be weighed.
        early = self._waiting[:, 1] < newest - self._around - self._around
        # Up to the first that must wait: they stay in order.
        return self._sift(len(early) if early.all() else int(np.argmin(early)))

    def rest(self) -> tuple[Array, Array]:
        """What is kept of the rows that wait, as `take`: no more will come."""
        if not self._fresh and not len(self._waiting):
            return self._waiting, np.empty(0)
        if not self._resting:
            self.note(self._moved)
        self._wait()
        self._weigh(math.inf)
        return self._sift(len(self._waiting), last=True)

    def _watch(self, times: Array, commands: Array) -> None:
        """Note when the command begins to move, and when it has come to rest."""
        before = np.concatenate([[self._command], commands[:-1]])
        moves = times[(commands != before) & ~np.isnan(before)]
        for time in moves.tolist():
            if self._moved < time - self._around:
                if not self._resting:
                    self.note(self._moved)
                self.note(time)
            self._moved, self._resting = time, False
        if not self._resting and self._moved < times[-1] - self._around:
            self.note(self._moved)
            self._resting = True
        self._command = float(commands[-1])

    def _wait(self) -> None:
        """Put what is fresh to what waits."""
        self._waiting = np.concatenate([self._waiting, *self._fresh])
        self._fresh.clear()

    def _weigh(self, until: float) -> None:
        """Decide on what happened before a time, in the order in which it happened."""
        ripe = sorted(time for time in self._noted if time < until)
        self._noted.difference_update(ripe)
        for time in ripe:
            start, end = time - self._around, time + self._around
            more = end - max(start, self._reach)
            allowance = 2 * self._around * STRETCHES + SHARE * max(time - self._began, 0.0)
            if more <= 0:
                continue
            if self._spent + more > allowance:
                self.refused += 1
                continue
            self._spent += more
            self._reach = max(end, self._reach)
            self._stretches.append((start, end))

    def _sift(self, count: int, last: bool = False) -> tuple[Array, Array]:
        """Of the first rows that wait: those that are kept, and rows left out up to each of them.

        The latter counts from the first row of all.
        """
        rows, self._waiting = self._waiting[:count], self._waiting[count:]
        if not count:
            return rows, np.empty(0)
        kept = rows[:, 0] % self.every == 0
        kept |= rows[:, 0] == self._first
        for start, end in self._stretches:
            kept |= (rows[:, 1] >= start) & (rows[:, 1] <= end)
        kept[-1] |= last
        self._stretches = [each for each in self._stretches if each[1] >= rows[-1, 1]]
        out = self.left_out + np.cumsum(~kept)
        self.left_out = int(out[-1])
        return rows[kept], out[kept].astype(np.float64)


class Thinned:
    """Stands for a `Thinning` where somebody else has left out rows and says how many.

    Args:
        every, around: the rule that was followed.
    """

    refused = 0

    def __init__(self, every: int, around: float) -> None:
        self.every, self.around = Thinning(every, around).every, around
        self.left_out = 0

    def note(self, time: float) -> None:
        """Nothing depends on it any more."""

    def counted(self, rows: Array, left_out: Array) -> tuple[Array, Array]:
        """Take rows, and for each how many were left out up to it."""
        self.left_out = int(left_out[-1])
        return rows, left_out

    def take(self, rows: Array, command: int | None) -> tuple[Array, Array]:
        """Take rows between which nothing was left out."""
        return self.counted(rows, np.full(len(rows), float(self.left_out)))

    def rest(self) -> tuple[Array, Array]:
        """Nothing waits."""
        return np.empty((0, 0)), np.empty(0)
