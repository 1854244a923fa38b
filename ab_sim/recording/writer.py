"""Writing a recording."""

from __future__ import annotations

import time as wall
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike

from ab_sim.errors import RecordingError
from ab_sim.recording.drawing import Drawing, lines
from ab_sim.recording.layout import Array, entity_path, index_columns, layout_of, scalar_columns
from ab_sim.recording.piped_file import FLUSH_SECONDS, PipedFile

BATCH_ROWS = 200  # Sending costs the same for 1 and for 200 rows, so rows are collected, but a
BATCH_SECONDS = 0.2  # file that is opened or cut off meanwhile is never older than this.
CHUNK_ROWS = 10_000  # The viewer loads and searches chunks of this size quickly.

_NEEDED = ("step", "time", "angle", "x", "y")
_LEVELS = {"WARNING": "WARN", "FATAL": "CRITICAL"}  # Python's names to Rerun's


class Recording:
    """One run on its way into an ``.rrd`` file, which Rerun may open meanwhile as it is so far.

    An existing file is replaced. Use it from one thread at a time. Every method raises
    `RecordingError`. After a write error (disk full, file gone) all but `close` raise it again,
    and the file is cut back to the last batch that was written whole, so that it stays readable.
    A recording that is killed loses the last `BATCH_SECONDS`.

    :param path: the file; its folder must exist.
    :param description: what was run, JSON-able; kept as it is. The pictures use ``race_radius``
        [m], ``eccentricity`` [m], ``balls`` (how many), ``ball_radii`` [m] (one per ball; None:
        some that fit), and of ``effects`` whether there is a motor or an accelerometer.
    """

    def __init__(self, path: Path | str, *, description: Mapping[str, Any]) -> None:
        self.path = Path(path)
        self.rows = 0  # rows taken by block()
        self.rows_written = 0  # of these, rows known to be in the file
        self._channels: tuple[str, ...] = ()
        self._pending: list[Array] = []
        self._last_step = -np.inf
        self._last_flush = wall.monotonic()
        self._error: RecordingError | None = None
        self._closed = False
        self._scalars: list[str] = []
        self._drawing = Drawing.of(description)
        text = self._drawing.document(description)
        self._stream = rr.RecordingStream("ab_sim", recording_id=uuid.uuid4())
        self._file = PipedFile(self.path, self._stream)
        self._stream.send_recording_name(self.path.stem)
        self._stream.send_blueprint(self._drawing.blueprint())
        self._static("/description", rr.TextDocument(text, media_type="text/markdown"))
        for entity, archetype in self._drawing.scenery():
            self._static(entity, archetype)
        self.flush()

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def block(self, channels: Sequence[str], samples: ArrayLike) -> None:
        """Take samples. They are in the file after `BATCH_ROWS`, `BATCH_SECONDS`, or `close`.

        :param channels: the same in every block. ``step``, ``time`` come first; ``angle``, ``x``,
            ``y`` and the angles of all balls are needed for the drawing; the rest is free.
        :param samples: (rows, channels), float64, copied. ``step`` must grow from row to row;
            it may leap, which `read_recording` counts.
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
        self._pending.append(rows)
        self._last_step = rows[-1, 0]
        self.rows += len(rows)
        waited = wall.monotonic() - self._last_flush
        if self.rows - self.rows_written >= BATCH_ROWS or waited >= BATCH_SECONDS:
            self.flush()

    def scalar(self, name: str, time: float, value: float) -> None:
        """Note a number that is not in the samples, such as the real-time factor, at time [s].

        :param name: an identifier, such as ``real_time_factor``.
        """
        self._check_usable()
        if not name.isidentifier():
            raise RecordingError(
                f"{self.path}: the name of a scalar must be one word, not {name!r}"
            )
        if name not in self._scalars:  # every name gets a plot; an empty one would only puzzle
            self._scalars.append(name)
            self._stream.send_blueprint(self._drawing.blueprint(self._scalars))
        self._send(
            entity_path("run", name),
            index_columns([time]),
            rr.Scalars.columns(scalars=[float(value)]),
        )

    def event(self, time: float, text: str, level: str = "INFO", source: str = "run") -> None:
        """Note what happened at time [s]; ``level`` as in Python's logging."""
        self._check_usable()
        level = _LEVELS.get(level.upper(), level.upper())
        columns = [*rr.TextLog.columns(text=[text], level=[level])]
        columns += rr.AnyValues.columns(source=[source])
        self._send(entity_path("events", source), index_columns([time]), columns)

    def flush(self) -> None:
        """Send what was collected, and wait until it is in the file."""
        self._check_usable()
        self._last_flush = wall.monotonic()
        rows = np.concatenate(self._pending) if self._pending else np.empty((0, 0))
        self._pending.clear()
        for start in range(0, len(rows), CHUNK_ROWS):
            self._send_rows(rows[start : start + CHUNK_ROWS])
        try:
            self._stream.flush(timeout_sec=FLUSH_SECONDS)
            self._file.sync()
        except (RuntimeError, OSError) as error:
            raise self._fail(error) from error
        self.rows_written = self.rows

    def close(self) -> None:
        """Write the rest and the index. Does nothing when closed already, or after an error."""
        if self._closed or self._error:
            return
        self.flush()
        self._closed = True
        self._stream.disconnect()  # writes the index
        try:
            self._file.close()
        except OSError as error:
            raise self._fail(error) from error

    def _check_usable(self) -> None:
        if self._error:
            raise self._error
        if self._closed:
            raise RecordingError(f"{self.path} is closed")

    def _begin(self, names: tuple[str, ...]) -> None:
        missing = [name for name in _NEEDED if name not in names]
        if missing or names[:2] != _NEEDED[:2] or len(set(names)) < len(names):
            raise RecordingError(
                f"{self.path}: channels must start with step, time, differ from each other and "
                f"include {', '.join(_NEEDED)}; got {', '.join(names)}"
            )
        balls = len(layout_of(names).get("/balls/angle", ()))
        if balls != self._drawing.balls:
            raise RecordingError(
                f"{self.path}: channels give the angles of {balls} balls, "
                f"but the description says balls: {self._drawing.balls}"
            )
        self._channels = names
        self._static("/channels", rr.AnyValues(names=list(names)))
        for entity, columns in layout_of(names).items():
            self._static(entity, lines([names[column] for column in columns]))

    def _check_steps(self, rows: Array) -> None:
        steps = rows[:, 0]
        if not (np.isfinite(rows[:, :2]).all() and (steps == np.rint(steps)).all()):
            raise RecordingError(f"{self.path}: step must be whole and time finite in every row")
        if (np.diff(steps, prepend=self._last_step) <= 0).any():
            raise RecordingError(
                f"{self.path}: step must grow from row to row, but {steps[0]:.0f}..{steps[-1]:.0f} "
                f"came after {self._last_step:.0f}; after a reset, start a new recording"
            )

    def _send_rows(self, rows: Array) -> None:
        index, layout = index_columns(rows[:, 1], rows[:, 0]), layout_of(self._channels)
        for entity, columns in layout.items():
            self._send(entity, index, scalar_columns(rows[:, columns]))
        angle, x, y = (rows[:, self._channels.index(name)] for name in ("angle", "x", "y"))
        balls = rows[:, layout.get("/balls/angle", [])]
        for entity, part in self._drawing.frames(angle, x, y, balls):
            self._send(entity, index, part)

    def _send(self, entity: str, index: list[rr.TimeColumn], columns: Any) -> None:
        rr.send_columns(entity, index, columns, recording=self._stream, strict=True)

    def _static(self, entity: str, archetype: Any) -> None:
        rr.log(entity, archetype, static=True, recording=self._stream, strict=True)

    def _fail(self, reason: Exception) -> RecordingError:
        if isinstance(reason, OSError):  # otherwise the disk hangs, and so would these
            self._file.cut()
            self._stream.disconnect()
        self._error = RecordingError(
            f"recording stopped: {self.path} holds {self.rows_written} of {self.rows} rows and "
            f"cannot be written further: {reason}"
        )
        return self._error
