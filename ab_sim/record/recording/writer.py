"""Writer of a recording."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike

from ab_sim.base.errors import RecordingError
from ab_sim.base.sample_columns import STEP, TIME
from ab_sim.record.recording.blueprint import state_colours, style
from ab_sim.record.recording.decimation import AROUND, DecimatedInput, Decimation
from ab_sim.record.recording.drawing import description_text
from ab_sim.record.recording.layout import (
    CHANNELS,
    CLOSED,
    DECIMATED,
    LEFT_OUT,
    SAMPLES,
    Array,
    entity_path,
    index_columns,
    layout_of,
    named_columns,
)
from ab_sim.record.recording.output_file import OutputFile
from ab_sim.record.recording.signals import FrameRate
from ab_sim.record.recording.vibration import Sent
from ab_sim.record.recording.views import ALWAYS, PERIOD, DriveView, PlotsView

BATCH_ROWS = 5000  # rows that are sent together: sending 200 rows takes as long as sending 1
_PICTURES_WAIT = 1.0  # longest delay of drawings without a viewer, in time of the run [s]
SHOWN_PERIOD = 0.02  # shortest time between two rows, and two frames, for a viewer [s]
_SLOW_PERIOD = 2.0  # time between two messages of slow curves and scalars for a viewer [s]
CHUNK_ROWS = 10_000  # largest number of rows of a chunk; viewers process this size quickly

_LEVELS = {"WARNING": "WARN", "FATAL": "CRITICAL"}  # Python's names to Rerun's


class Recording:
    """Writer of one run to an ``.rrd`` file, which viewers can open while it grows.

    An existing file is replaced. Only one thread at a time may use the writer. Every method may
    raise `RecordingError`. After a write error (disk full, file deleted), all methods except
    `close` raise it again. The file is then cut back to the last complete batch, so that it remains
    readable; a file without samples is deleted. Rows, scalars and events are collected until there
    are `BATCH_ROWS` of them, or until `flush`, which a live recorder calls periodically. If the
    process is killed, the data after the last flush are lost.

    Parameters
    ----------
    path : Path | str
        File to write; its folder must exist.
    description : mapping
        Description of the run, JSON-able, stored unchanged. Drawings use ``race_radius`` [m],
        ``eccentricity`` [m], ``balls`` (their number), ``ball_radii`` [m] (one per ball; None: a
        radius that fits), a motor in ``effects``, the names of ``sensors``, and for a deck in space
        ``deck`` as in `ab_sim.drive.description`.
    drawn : bool
        Whether there is a drawing. Without a drawing, description and channels need no data on the
        drive, and all channels are plotted.
    every : int
        Keep one in ``every`` steps, and all steps around events and the ends of a command's ramps
        (`ab_sim.record.recording.decimation`); 1 keeps all. Rows then wait for twice ``around``
        before they are sent.
    around : float
        Time before and after an event in which all steps are kept [s], if ``every`` is more than 1.
    is_shown : bool
        Whether the file is only for a viewer that follows the run. It then has one row and one
        frame in each `SHOWN_PERIOD`; curves of the vibration are still computed from all rows. They
        and scalars are sent once in each `_SLOW_PERIOD`, because a viewer without a GPU can process
        few messages at a time. Nothing is sent until `flush`. The viewer follows the newest samples
        until the recording is closed; other files open at their start, paused.
    decimated : bool
        Whether ``every`` and ``around`` have already been applied, and `block` gets the numbers of
        omitted rows.

    Examples
    --------
    >>> import ab_sim, tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "mine.rrd")
    ...     with ab_sim.Recording(file, description={}, drawn=False) as recording:
    ...         recording.block(["step", "time", "temperature"], [[0, 0.0, 20.0], [1, 0.1, 20.5]])
    ...     ab_sim.open_recording(file).trajectory()["temperature"]
    array([20. , 20.5])
    """

    def __init__(
        self,
        path: Path | str,
        *,
        description: Mapping[str, object],
        drawn: bool = True,
        every: int = 1,
        around: float = AROUND,
        is_shown: bool = False,
        decimated: bool = False,
    ) -> None:
        self.path = Path(path)
        self.rows = 0  # number of rows that block() has received
        self.rows_written = 0  # number of rows in the file
        self.missing = 0  # number of missing steps between the first and the last row
        self.last_step = -np.inf  # step of the last row
        self._channels: tuple[str, ...] = ()
        self._blocks: list[Array] = []
        self._scalars: dict[str, list[tuple[float, float]]] = {}  # by name: time, value
        self._states: dict[str, list[tuple[float, str]]] = {}  # by name: time, state
        self._events: dict[str, list[tuple[float, str, str]]] = {}  # by source: time, text, level
        self._collected = 0  # number of rows, scalars and events not sent yet
        self._sent = 0  # number of rows sent
        self._rows_without_pictures: list[Array] = []  # sent rows whose frames have not been sent
        self._rows_without_slow_curves: list[Array] = []
        self._first_step = np.nan
        self._error: RecordingError | None = None
        self._closed = False
        self._decimation = DecimatedInput(every, around) if decimated else Decimation(every, around)
        self._left_out: list[Array] = []  # one array for each block
        period = SHOWN_PERIOD if is_shown else PERIOD
        self._view = DriveView(description, period) if drawn else PlotsView()
        self._rows_shown = FrameRate(period) if is_shown else None
        self._followed, self._slow_until = is_shown, -np.inf
        self._step = _positive(description.get("step"))
        text = description_text(description)
        self.id = str(uuid.uuid4())
        self._stream = rr.RecordingStream("ab_sim", recording_id=self.id)
        self._file = OutputFile(self.path, self._stream)
        self._stream.send_recording_name(self.path.stem)
        self._static("/description", rr.TextDocument(text, media_type="text/markdown"))
        for entity, archetype in self._view.statics():
            self._static(entity, archetype)
        if every > 1:
            self._static(DECIMATED, rr.AnyValues(every=every, around=around))
        self.flush()

    @property
    def failed(self) -> bool:
        """True if the recording was ended by a write error."""
        return self._error is not None

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def left_out(self) -> int:
        """Number of rows that decimation has omitted."""
        return self._decimation.left_out

    @property
    def stretches_refused(self) -> int:
        """Number of events near which steps were omitted, because there were too many events."""
        return self._decimation.refused

    def lay_out(self, channels: Sequence[str], scalars: Sequence[str]) -> None:
        """Send the viewer's complete layout before the first samples, so as to send it only once.

        Parameters
        ----------
        channels : sequence of str
            Channels of the samples.
        scalars : sequence of str
            Names of all scalars that may be recorded.
        """
        self._check_usable()
        for name in scalars:
            self._declare_scalar(name)
        self._begin(tuple(channels))

    def block(
        self, channels: Sequence[str], samples: ArrayLike, left_out: ArrayLike | None = None
    ) -> None:
        """Record samples.

        Parameters
        ----------
        channels : sequence of str
            Channels, the same in every block. ``step`` and ``time`` are the first. The drawing
            needs ``angle``, ``x``, ``y`` and the angles of all balls, and for a deck in space ``z``
            and the quaternion; there may be any other channels.
        samples : array_like
            Samples of shape (rows, channels), float64; they are copied. ``step`` must increase from
            row to row; `Extent` counts gaps.
        left_out : array_like
            Number of rows omitted up to each row, for samples that were decimated before; only with
            ``decimated``.
        """
        self._check_usable()
        names, rows = tuple(channels), np.array(samples, dtype=np.float64)
        if not self._channels:
            self._begin(names)
        if names != self._channels or rows.ndim != 2 or rows.shape[1] != len(names):
            raise RecordingError(
                f"{self.path}: samples of shape {rows.shape} for channels {', '.join(names)}; "
                f"expected (rows, {len(self._channels)}) for {', '.join(self._channels)}"
            )
        if len(rows) == 0:
            return
        self._check_steps(rows)
        if np.isnan(self._first_step):
            self._first_step = rows[0, STEP]
        self.last_step = rows[-1, STEP]
        self.rows += len(rows)
        if left_out is not None:
            assert isinstance(self._decimation, DecimatedInput)
            before, counts = self._decimation.left_out, np.array(left_out, dtype=np.float64)
            self._collect(self._keep(*self._decimation.counted(rows, counts)))
            self.rows += self._decimation.left_out - before
            return
        command = names.index("command") if "command" in names else None
        self._collect(self._keep(*self._decimation.take(rows, command)))

    def scalar(self, name: str, time: float, value: float) -> None:
        """Record a number that is not in the samples.

        Parameters
        ----------
        name : str
            Name, an identifier such as ``real_time_factor``.
        time : float
            Time [s].
        value : float
            Number to record.
        """
        self._check_usable()
        if not name.isidentifier():
            raise RecordingError(
                f"{self.path}: the name of a scalar must be one word, not {name!r}"
            )
        if name not in self._scalars:  # declared with its first value, so that no plot is empty
            self._declare_scalar(name)
            if self._channels:
                self._send_layout()
        self._scalars[name].append((time, float(value)))
        self._collect(1)

    def event(self, time: float, text: str, level: str = "INFO", source: str = "run") -> None:
        """Record an event at a time [s]; ``level`` is that of Python's logging."""
        self._check_usable()
        level = _LEVELS.get(level.upper(), level.upper())
        self._decimation.note(time)
        self._events.setdefault(source, []).append((time, text, level))
        self._collect(1)

    def state(self, name: str, time: float, state: str) -> None:
        """Record a change of a state at a time [s], such as that of ``profile`` to ``done``."""
        self._check_usable()
        if name not in self._states:
            self._states[name] = []
            self._static(entity_path("health", name), state_colours())
        self._states[name].append((time, state))
        self._collect(1)

    def flush(self, pictures: bool = True) -> None:
        """Send the collected data to the file, and wait until all is written.

        Parameters
        ----------
        pictures : bool
            Whether to send all frames of drawings. Otherwise they are sent once per second of the
            run, because each message takes some 1.2 kB in addition to its content.
        """
        self._check_usable()
        slow = self._slow_are_due()
        self._send_collected(slow)
        if pictures or self._picture_delay >= _PICTURES_WAIT:
            self._send_derived(self._rows_without_pictures, self._view.frames)
            if slow:
                self._send_derived(self._rows_without_slow_curves, self._view.slow_curves)
        try:
            self._file.sync()
        except OSError as error:
            raise self._fail(error) from error
        self.rows_written = self._sent
        if self.rows:
            self.missing = int(self.last_step - self._first_step) + 1 - self.rows

    def conclude(self) -> None:
        """Send the collected data and the final values; more samples may follow."""
        self._slow_until = -np.inf
        self.flush()
        for entity, archetype in self._view.conclusion():
            self._static(entity, archetype)
        self.flush()

    def close(self) -> None:
        """Write the remaining data and the end mark; if closed, or after an error, do nothing."""
        if self._closed or self._error:
            return
        self._keep(*self._decimation.rest())
        if not self._channels:
            self._send_layout()
        self.conclude()
        if self._followed:
            self._followed = False
            self._send_layout()
        self._static(CLOSED, rr.AnyValues(rows=self.rows_written))
        self._closed = True
        try:
            self._file.sync()
        except OSError as error:
            raise self._fail(error) from error
        self._end()

    def _check_usable(self) -> None:
        """Raise the error of an earlier write again; refuse a closed recording."""
        if self._error:
            raise self._error
        if self._closed:
            raise RecordingError(f"{self.path} is closed")

    def _begin(self, names: tuple[str, ...]) -> None:
        """Begin the file: check the channels, write the channel names, and send the layout."""
        needed = self._view.needs
        missing = [name for name in needed if name not in names]
        if missing or names[:2] != ALWAYS or len(set(names)) < len(names):
            raise RecordingError(
                f"{self.path}: channels must start with step, time, differ from each other and "
                f"include {', '.join(needed)}; got {', '.join(names)}"
            )
        try:
            self._view.begin(names)
        except RecordingError as error:
            raise RecordingError(f"{self.path}: {error}") from error
        self._channels = names
        self._static("/channels", rr.AnyValues(names=list(names)))
        self._send_layout()

    def _declare_scalar(self, name: str) -> None:
        """Add a scalar of this name, and write the style of the scalar's plot."""
        self._scalars[name] = []
        self._static(entity_path("run", name), style(name))

    def _send_layout(self) -> None:
        """Send the viewer's layout, which takes some 0.1 MB in 100 messages."""
        self._stream.send_blueprint(self._view.blueprint(list(self._scalars), self._followed))

    def _check_steps(self, rows: Array) -> None:
        """Refuse steps that are not whole or do not increase, and times that are not finite."""
        steps = rows[:, STEP]
        if not (np.isfinite(rows[:, [STEP, TIME]]).all() and (steps == np.rint(steps)).all()):
            raise RecordingError(f"{self.path}: step must be whole and time finite in every row")
        if (np.diff(steps, prepend=self.last_step) <= 0).any():
            raise RecordingError(
                f"{self.path}: step must increase, but {steps[0]:.0f}..{steps[-1]:.0f} "
                f"came after {self.last_step:.0f}; after a reset, start a new recording"
            )

    def _keep(self, rows: Array, left_out: Array) -> int:
        """Collect rows with the numbers of omitted rows up to each; return the number of rows."""
        if len(rows):
            self._blocks.append(rows)
            self._left_out.append(left_out)
        return len(rows)

    def _collect(self, count: int) -> None:
        """Count collected rows, scalars or events; send them when a batch is complete."""
        self._collected += count
        if self._collected >= BATCH_ROWS and self._rows_shown is None:
            self.flush()

    def _slow_are_due(self) -> bool:
        """Return whether slow curves and scalars are due; if so, set their next time."""
        if self._rows_shown is not None and self._blocks:
            newest = float(self._blocks[-1][-1, TIME])
            if newest < self._slow_until:
                return False
            self._slow_until = newest + _SLOW_PERIOD
        return True

    def _send_collected(self, slow: bool) -> None:
        """Send all collected rows, events and states, and scalars if ``slow``."""
        rows = np.concatenate(self._blocks) if self._blocks else np.empty((0, 0))
        left_out = np.concatenate(self._left_out) if self._left_out else np.empty(0)
        for start in range(0, len(rows), CHUNK_ROWS):
            part = slice(start, start + CHUNK_ROWS)
            self._send_rows(rows[part], left_out[part])
        self._sent += len(rows)
        for name, points in self._scalars.items():
            if points and slow:
                times, values = zip(*points, strict=True)
                columns = rr.Scalars.columns(scalars=values)
                self._send(entity_path("run", name), self._index(times), columns)
                points.clear()
        for source, events in self._events.items():
            if events:
                times, texts, levels = zip(*events, strict=True)
                columns = rr.TextLog.columns(text=texts, level=levels)
                self._send(
                    entity_path("events", source),
                    self._index(times),
                    [*columns, *rr.AnyValues.columns(source=[source] * len(times))],
                )
        for name, changes in self._states.items():
            if changes:
                times, states = zip(*changes, strict=True)
                columns = rr.StateChange.columns(state=states)
                self._send(entity_path("health", name), self._index(times), columns)
                changes.clear()
        self._blocks.clear()
        self._left_out.clear()
        self._events.clear()
        self._collected = 0

    def _send_rows(self, rows: Array, left_out: Array) -> None:
        """Send samples with their fast curves; keep the samples for frames and slow curves."""
        self._rows_without_pictures.append(rows)
        self._rows_without_slow_curves.append(rows)
        if self._rows_shown is not None and not len(rows := self._rows_shown.of(rows)):
            return
        groups = {name: rows[:, columns] for name, columns in layout_of(self._channels).items()}
        if self._decimation.every > 1:
            groups[LEFT_OUT] = left_out[:, None]
        columns = named_columns(CHANNELS, groups) + self._view.of_samples(rows)
        self._send(SAMPLES, index_columns(rows[:, TIME], rows[:, STEP]), columns)

    @property
    def _picture_delay(self) -> float:
        """Time of the run for which frames have not been sent [s]."""
        if not (pending := self._rows_without_pictures):
            return 0.0
        return float(pending[-1][-1, TIME] - pending[0][0, TIME])

    def _send_derived(
        self, pending: list[Array], derive: Callable[[Array], Iterator[Sent]]
    ) -> None:
        """Send the frames or curves that ``derive`` yields for the pending rows; clear these."""
        if not pending:
            return
        rows = np.concatenate(pending)
        pending.clear()
        for entity, when, columns in derive(rows):
            self._send(entity, index_columns(when[:, TIME], when[:, STEP]), columns)

    def _index(self, times: Sequence[float]) -> list[rr.TimeColumn]:
        """Return the timelines of entries: their times, and the nearest steps if known."""
        if self._step is None:
            return index_columns(times)
        return index_columns(times, np.rint(np.asarray(times) / self._step))

    def _send(self, entity: str, index: list[rr.TimeColumn], columns: Any) -> None:
        """Send columns of an entity, with the times of the rows, as one message."""
        rr.send_columns(entity, index, columns, recording=self._stream, strict=True)

    def _static(self, entity: str, archetype: Any) -> None:
        """Send data that hold at all times."""
        rr.log(entity, archetype, static=True, recording=self._stream, strict=True)

    def _end(self) -> None:
        """Free what Rerun has stored, and close the file."""
        self._stream.disconnect()
        self._file.close()

    def _fail(self, reason: OSError) -> RecordingError:
        """End the recording after an error of the file, and return the error to raise."""
        if isinstance(reason, FileNotFoundError):
            self.rows_written = self.missing = 0
        else:
            self._file.cut()
        if not self.rows_written:
            self._file.remove()
        self._end()
        self._error = RecordingError(
            f"recording stopped: {self.path} contains {self.rows_written} of {self.rows} rows and "
            f"cannot be written any further: {reason}"
        )
        return self._error


def _positive(value: object) -> float | None:
    """Return a value of a description if it is a finite number above 0, else None."""
    return float(value) if isinstance(value, (int, float)) and 0.0 < value < np.inf else None
