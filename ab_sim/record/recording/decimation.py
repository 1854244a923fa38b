"""Decimation: selection of the samples of a long run that are recorded."""

from __future__ import annotations

import math

import numpy as np

from ab_sim.base.errors import RecordingError
from ab_sim.base.sample_columns import STEP, TIME
from ab_sim.record.recording.layout import Array

AROUND = 0.5
"""Default time before and after an event in which all steps are kept [s]."""
SHARE = 0.1
"""Largest fraction of the run's time in full-rate stretches, in the long run."""
STRETCHES = 20
"""Number of full-rate stretches that are allowed in addition to ``SHARE``."""


class Decimation:
    """Selects every ``every``-th step, and all steps around events.

    Events are those passed to `note`, and the two ends of a ramp of the command: the times at which
    it starts to change and becomes constant (no change within ``around``). A period around an event
    is a *full-rate stretch*. To limit the data rate, full-rate stretches take at most `SHARE` of
    the time, in addition to `STRETCHES` of them; further ones are refused and counted. The first
    and the last row are always kept.

    Rows are pending for twice ``around``, until no later event can affect them. So the result does
    not depend on the size of blocks. This requires that an event is noted before `take` gets rows
    later than the event's time + ``around``.

    Parameters
    ----------
    every
        A step is kept if its number is a multiple of this.
    around
        Time before and after an event in which all steps are kept [s].

    Raises
    ------
    RecordingError
        ``every`` is not 1 or more, or ``around`` negative or not finite.
    """

    def __init__(self, every: int, around: float) -> None:
        if every < 1 or not 0.0 <= around < math.inf:
            raise RecordingError(
                f"every = {every}, around = {around:g} s: every must be at least 1, around at "
                "least 0 and finite"
            )
        self.every, self._around = every, around
        self.left_out = 0  # omitted rows
        self.refused = 0  # refused full-rate stretches
        self._pending = np.empty((0, 0))
        self._new: list[Array] = []  # rows received after the pending ones
        # events whose stretch is neither selected nor refused
        self._event_times: set[float] = set()
        self._stretches: list[tuple[float, float]] = []  # stretches that may contain pending rows
        self._reach = -math.inf  # end of the last stretch
        self._full_rate_time = 0.0  # total length of the stretches [s]
        self._first = self._began = math.nan  # step and time of the first row
        self._last_change = -math.inf  # time of the command's last change
        self._command_constant = True
        self._command = math.nan

    def note(self, time: float) -> None:
        """Note an event at a time [s]."""
        if self.every > 1 and math.isfinite(time):
            self._event_times.add(time)

    def take(self, rows: Array, command: int | None) -> tuple[Array, Array]:
        """Add rows, and return the earlier ones that are selected for certain.

        Parameters
        ----------
        rows
            At least one row, with step, time and further channels.
        command
            Column of the command; None: there is none.

        Returns
        -------
        tuple[Array, Array]
            Rows to keep; and for each of them, the number of rows omitted up to it.
        """
        if self.every == 1:
            return rows, np.zeros(len(rows))
        if math.isnan(self._began):
            self._first, self._began = rows[0, [STEP, TIME]].tolist()
            self._pending = rows[:0]
        if command is not None:
            self._note_command_changes(rows[:, TIME], rows[:, command])
        self._new.append(rows)
        if 4 * sum(map(len, self._new)) < len(self._pending):
            return rows[:0], np.empty(0)  # so that pending rows are not copied for a few new ones
        self._append_new_rows()
        newest = rows[-1, TIME]
        # The end of a ramp is noted ``around`` after it, so the order of events is final only then.
        self._select_stretches(newest - self._around)
        # Two subtractions have the same rounding as the start of a stretch not yet selected.
        early = self._pending[:, TIME] < newest - self._around - self._around
        # Only up to the first row that must wait, so that rows remain in order.
        return self._rows_to_keep(len(early) if early.all() else int(np.argmin(early)))

    def rest(self) -> tuple[Array, Array]:
        """Return the remaining rows to keep, at the end of the run; see `take`."""
        if not self._new and not len(self._pending):
            return self._pending, np.empty(0)
        if not self._command_constant:
            self.note(self._last_change)
        self._append_new_rows()
        self._select_stretches(math.inf)
        return self._rows_to_keep(len(self._pending), last=True)

    def _note_command_changes(self, times: Array, commands: Array) -> None:
        """Note as events the times at which the command starts to change or becomes constant."""
        before = np.concatenate([[self._command], commands[:-1]])
        moves = times[(commands != before) & ~np.isnan(before)]
        for time in moves.tolist():
            if self._last_change < time - self._around:
                if not self._command_constant:
                    self.note(self._last_change)
                self.note(time)
            self._last_change, self._command_constant = time, False
        if not self._command_constant and self._last_change < times[-1] - self._around:
            self.note(self._last_change)
            self._command_constant = True
        self._command = float(commands[-1])

    def _append_new_rows(self) -> None:
        """Append new rows to the pending ones."""
        self._pending = np.concatenate([self._pending, *self._new])
        self._new.clear()

    def _select_stretches(self, until: float) -> None:
        """Select full-rate stretches around events before a time [s], in order of time.

        Only the part that the last stretch does not cover counts towards the limit of their length.
        """
        earlier = sorted(time for time in self._event_times if time < until)
        self._event_times.difference_update(earlier)
        for time in earlier:
            start, end = time - self._around, time + self._around
            more = end - max(start, self._reach)
            allowance = 2 * self._around * STRETCHES + SHARE * max(time - self._began, 0.0)
            if more <= 0:
                continue
            if self._full_rate_time + more > allowance:
                self.refused += 1
                continue
            self._full_rate_time += more
            self._reach = max(end, self._reach)
            self._stretches.append((start, end))

    def _rows_to_keep(self, count: int, last: bool = False) -> tuple[Array, Array]:
        """Remove the first ``count`` pending rows, and return those that decimation keeps.

        Parameters
        ----------
        count
            Number of rows to remove.
        last
            Whether to keep the last of them in any case.

        Returns
        -------
        tuple[Array, Array]
            Rows to keep; and for each, the number of rows omitted since the start of the run.
        """
        rows, self._pending = self._pending[:count], self._pending[count:]
        if not count:
            return rows, np.empty(0)
        kept = rows[:, STEP] % self.every == 0
        kept |= rows[:, STEP] == self._first
        for start, end in self._stretches:
            kept |= (rows[:, TIME] >= start) & (rows[:, TIME] <= end)
        kept[-1] |= last
        self._stretches = [stretch for stretch in self._stretches if stretch[1] >= rows[-1, TIME]]
        out = self.left_out + np.cumsum(~kept)
        self.left_out = int(out[-1])
        return rows[kept], out[kept].astype(np.float64)


class DecimatedInput:
    """Replacement of `Decimation` for rows that were decimated before.

    Parameters
    ----------
    every, around
        Rule of the former decimation; see `Decimation`.
    """

    refused = 0

    def __init__(self, every: int, around: float) -> None:
        self.every, self.around = Decimation(every, around).every, around
        self.left_out = 0

    def note(self, time: float) -> None:
        """Do nothing: events have no effect."""

    def counted(self, rows: Array, left_out: Array) -> tuple[Array, Array]:
        """Return rows unchanged, with the number of rows omitted up to each."""
        self.left_out = int(left_out[-1])
        return rows, left_out

    def take(self, rows: Array, command: int | None) -> tuple[Array, Array]:
        """Return rows unchanged; none were omitted between them."""
        return self.counted(rows, np.full(len(rows), float(self.left_out)))

    def rest(self) -> tuple[Array, Array]:
        """Return no rows, because none are pending."""
        return np.empty((0, 0)), np.empty(0)
