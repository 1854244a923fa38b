"""Record a run into a Rerun file, bit for bit, with pictures that explain it; and read it back.

A run is a table of float64 *samples*: one row per integration step, one column per *channel*,
the first two being ``step`` (a whole number that grows) and ``time`` [s]. `Recording` writes the
table, `read_recording` returns exactly what was written.

==========================  ==========================================  ===================
entity                      contents                                    shown as
==========================  ==========================================  ===================
``/clock/time``             time [s] (the timeline is rounded to ns)
``/spindle/angle``          angle psi [rad, unwrapped]
``/spindle/speed``          speed, command [rad/s]                      plot
``/deck/displacement``      x, y [m], inertial axes
``/deck/velocity``          vx, vy [m/s]
``/deck/acceleration``      ax, ay [m/s^2]                              plot
``/balls/angle``            ball_0_angle, ... [rad, from the
                            unbalance, unwrapped]
``/balls/rate``             ball_0_rate, ... [rad/s]
``/other/NAME``             any other channel
``/plot``, ``/top``         derived: W/e, degrees; the drawing, in mm   plots, two top views
``/run/NAME``               what `Recording.scalar` is given            plot
``/events/SOURCE``          what `Recording.event` is given             text log
==========================  ==========================================  ===================

Timelines: ``sim_time`` and ``step``. Writing and reading files sends no analytics; Rerun's viewer
does, until ``rerun analytics disable`` has been run once.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import threading
import time as wall
import uuid
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import ArrayLike, NDArray
from rerun.chunk import RrdReader

from ab_sim.errors import RecordingError

Array = NDArray[np.float64]
Parts = Iterator[tuple[str, Any]]  # entities, each with what is sent there

BATCH_ROWS = 200  # Sending costs the same for 1 and for 200 rows, so rows are collected, but a
BATCH_SECONDS = 0.2  # file that is opened or cut off meanwhile is never older than this.
CHUNK_ROWS = 10_000  # The viewer loads and searches chunks of this size quickly.
FLUSH_SECONDS = 10.0  # A disk that takes longer counts as failed.

_NEEDED = ("step", "time", "angle", "x", "y")
_GROUPS = {
    "/clock/time": ("time",),
    "/spindle/angle": ("angle",),
    "/spindle/speed": ("speed", "command"),
    "/deck/displacement": ("x", "y"),
    "/deck/velocity": ("vx", "vy"),
    "/deck/acceleration": ("ax", "ay"),
}
_ENTITY = {name: entity for entity, names in _GROUPS.items() for name in names}
_BALL_CHANNEL = re.compile(r"ball_\d+_(angle|rate)")
_LEVELS = {"WARNING": "WARN", "FATAL": "CRITICAL"}  # Python's names to Rerun's
_FOOTER = b"RRF2FOOT"  # among the last bytes of every file that was closed

_RED, _GREY, _WHITE, _GREEN = (235, 70, 60), (150, 150, 150), (235, 235, 235), (150, 220, 90)
_HUES = [(70, 150, 255), (255, 170, 40), (60, 210, 200), (200, 120, 255), (240, 230, 90)]
_HUES += [(255, 130, 180), (170, 140, 100), (120, 130, 255)]


class Recording:
    """One run on its way into an ``.rrd`` file, which Rerun may open meanwhile as it is so far.

    An existing file is replaced. Use it from one thread at a time. Every method raises
    `RecordingError`. After a write error (disk full, file gone) all but `close` raise it again,
    and the file is cut back to the last batch that was written whole, so that it stays readable.
    A recording that is killed loses the last `BATCH_SECONDS`.

    :param path: the file; its folder must exist.
    :param description: what was run, JSON-able; kept as it is. The pictures use ``race_radius``
        [m], ``eccentricity`` [m], ``balls`` (how many), ``ball_radius`` [m] (None: one that fits).
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
        self._closed = self._has_scalars = False
        self._drawing = _Drawing.of(description)
        text = self._drawing.document(description)
        self._stream = rr.RecordingStream("ab_sim", recording_id=uuid.uuid4())
        self._file = _PipedFile(self.path, self._stream)
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
        if not self._has_scalars:  # an empty plot would only puzzle whoever records offline
            self._has_scalars = True
            self._stream.send_blueprint(self._drawing.blueprint(scalars=True))
        self._send(_path("run", name), _index([time]), rr.Scalars.columns(scalars=[float(value)]))

    def event(self, time: float, text: str, level: str = "INFO", source: str = "run") -> None:
        """Note what happened at time [s]; ``level`` as in Python's logging."""
        self._check_usable()
        level = _LEVELS.get(level.upper(), level.upper())
        columns = [*rr.TextLog.columns(text=[text], level=[level])]
        columns += rr.AnyValues.columns(source=[source])
        self._send(_path("events", source), _index([time]), columns)

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
        balls = len(_layout(names).get("/balls/angle", ()))
        if balls != self._drawing.balls:
            raise RecordingError(
                f"{self.path}: channels give the angles of {balls} balls, "
                f"but the description says balls: {self._drawing.balls}"
            )
        self._channels = names
        self._static("/channels", rr.AnyValues(names=list(names)))
        for entity, columns in _layout(names).items():
            self._static(entity, _lines([names[column] for column in columns]))

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
        index, layout = _index(rows[:, 1], rows[:, 0]), _layout(self._channels)
        for entity, columns in layout.items():
            self._send(entity, index, _scalars(rows[:, columns]))
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


class _PipedFile:
    """Stands between Rerun and the file: Rerun writes to a pipe, this to the file.

    Given a file, Rerun 0.41 does not survive a write error: its writer thread ends, the reason is
    only printed, and often flush(), disconnect() and the end of the process then block for good.
    A pipe never fails, and errors of the file come up here, where they can be raised.
    """

    def __init__(self, path: Path, stream: rr.RecordingStream) -> None:
        if not path.parent.is_dir():
            raise RecordingError(f"cannot record to {path}: there is no folder {path.parent}")
        try:
            self._file = path.open("wb", buffering=0)
        except OSError as error:
            raise RecordingError(f"cannot record to {path}: {error.strerror}") from error
        self._error: OSError | None = None
        self._whole = 0  # size [bytes] when the file last ended in a whole message
        self._lock = threading.Lock()  # held while anything is on its way from pipe to file
        outlet, inlet = os.pipe()
        os.set_blocking(outlet, False)
        self._pipe = os.fdopen(outlet, "rb", buffering=0)
        stream.set_sinks(rr.FileSink(f"/dev/fd/{inlet}"))
        os.close(inlet)  # Rerun has opened its own: when it closes that, the pipe ends
        self._thread = threading.Thread(target=self._pump, name="recording", daemon=True)
        self._thread.start()

    def sync(self) -> None:
        """Wait until all that Rerun has flushed is in the file; OSError if that fails."""
        self._drain()
        if not self._error and os.fstat(self._file.fileno()).st_nlink == 0:
            self._error = FileNotFoundError("the file has been deleted")
        if self._error:
            raise self._error
        self._whole = self._file.tell()

    def close(self) -> None:
        """Take what Rerun still writes until it disconnects; OSError if that fails."""
        self._thread.join(FLUSH_SECONDS)
        if self._thread.is_alive():
            raise TimeoutError(f"the disk did not answer for {FLUSH_SECONDS:g} s")
        self.sync()
        self._file.close()

    def cut(self) -> None:
        """Drop a torn message at the end: it would make the whole file unreadable."""
        with contextlib.suppress(OSError):  # a device, say
            self._file.truncate(self._whole)

    def _pump(self) -> None:
        poll = select.poll()
        poll.register(self._pipe)
        while self._drain():
            poll.poll()

    def _drain(self) -> bool:
        """Move what is in the pipe into the file. False: the pipe has ended."""
        with self._lock:
            while data := self._pipe.read(1 << 20):
                rest = memoryview(data)
                try:
                    while rest and not self._error:  # after an error, only keep the pipe empty
                        rest = rest[self._file.write(rest) :]
                except OSError as error:
                    self._error = error
            return data is None  # None: nothing now; b"": nothing any more


@dataclass(frozen=True)
class _Drawing:
    """The drive in pictures, to scale, in mm.

    Rerun's 2-D views have y downwards. The drawing negates y and all angles, so that on the
    screen y points upwards and angles grow anticlockwise.
    """

    race: float  # radius of the circle on which the balls' centres run
    eccentricity: float
    balls: int
    ball: float  # radius

    @classmethod
    def of(cls, description: Mapping[str, Any]) -> _Drawing:
        try:
            race, balls = 1e3 * float(description["race_radius"]), int(description["balls"])
            eccentricity = 1e3 * float(description["eccentricity"])
            ball = 1e3 * float(description.get("ball_radius") or 0.0)
        except (KeyError, TypeError, ValueError) as error:
            raise RecordingError(
                "the description of a recording needs numbers for race_radius [m], "
                f"eccentricity [m] and balls: {error!r}"
            ) from error
        return cls(race, eccentricity, balls, ball or race * min(0.1, 2.5 / max(balls, 1)))

    def document(self, description: Mapping[str, Any]) -> str:
        try:
            text = json.dumps(dict(description), indent=2)
        except (TypeError, ValueError) as error:
            raise RecordingError(f"the description of a recording is not JSON: {error}") from error
        return (
            f"**{self.balls} balls on a race of radius {self.race:g} mm, "
            f"eccentricity e = {self.eccentricity:g} mm.**\n\nTop views, to scale: balls in the "
            "colours of the plot, unbalance in red, a white cross where the shaft would rest, in "
            f"green where its centre was in the last 50 ms.\n\n```json\n{text}\n```\n"
        )

    def scenery(self) -> Parts:
        """What stays: archetypes, logged once."""
        r, turn = self.race, np.linspace(0, 2 * np.pi, 121)
        wall_of_race = (r + self.ball) * np.column_stack([np.cos(turn), np.sin(turn)])
        c, mark = 0.1 * r, 0.75 * r
        cross = [[[-c, 0.0], [c, 0.0]], [[0.0, -c], [0.0, c]]]
        arm = [[[0.0, 0.0], [mark, 0.0]]]
        yield "/top/rest", rr.LineStrips2D(cross, colors=_WHITE, radii=0.01 * r)
        yield "/top/shaft", rr.Points2D.from_fields(colors=_GREEN, radii=0.02 * r)
        yield "/top/rotor/race", rr.LineStrips2D([wall_of_race], colors=_GREY, radii=0.015 * r)
        yield "/top/rotor/arm", rr.LineStrips2D(arm, colors=_RED, radii=0.01 * r)
        yield (
            "/top/rotor/unbalance",
            rr.Points2D([[mark, 0]], colors=_RED, radii=0.06 * r, labels="unbalance"),
        )
        if self.balls:
            colors = [_HUES[ball % len(_HUES)] for ball in range(self.balls)]
            yield "/top/rotor/balls", rr.Points2D.from_fields(colors=colors, radii=self.ball)
            yield "/plot/balls", _lines([f"ball {ball}" for ball in range(self.balls)])
        yield "/plot/whirl", _lines(["W/e" if self.eccentricity else "W [mm]"])

    def frames(self, angle: Array, x: Array, y: Array, balls: Array) -> Parts:
        """What moves: columns, one row per sample. angle, x, y (rows,), balls (rows, balls)."""
        zero = np.zeros_like(angle)
        shaft = 1e3 * np.column_stack([x, -y, zero])
        half = -0.5 * np.remainder(angle, 2 * np.pi)
        turn = np.column_stack([zero, zero, np.sin(half), np.cos(half)])
        whirl = np.hypot(shaft[:, 0], shaft[:, 1]) / (self.eccentricity or 1.0)
        yield "/top/rotor", rr.Transform3D.columns(translation=shaft, quaternion=turn)
        yield "/top/shaft", rr.Points2D.columns(positions=shaft[:, :2])
        yield "/plot/whirl", _scalars(whirl[:, None])
        if self.balls:
            places = self.race * np.stack([np.cos(balls), -np.sin(balls)], axis=-1)
            points = rr.Points2D.columns(positions=places.reshape(-1, 2))
            yield "/top/rotor/balls", points.partition(np.full(len(balls), self.balls))
            yield "/plot/balls", _scalars(np.degrees(balls))

    def blueprint(self, *, scalars: bool = False) -> rrb.Blueprint:
        left = [
            self._top_view("Top view, as from a camera at rest", "/top", 1.8),
            self._top_view("Top view, turning with the rotor", "/top/rotor", 1.5, also="/top/rest"),
        ]
        whirl = f"whirl W/e [1], e = {self.eccentricity:g} mm" if self.eccentricity else "W [mm]"
        middle = [
            _plot("Spindle: speed and command [rad/s]", "/spindle/speed"),
            _plot(f"Shaft: {whirl}", "/plot/whirl"),
            _plot("Deck: vibration, ax and ay [m/s²]", "/deck/acceleration"),
        ]
        if self.balls:
            name = "Balls: angle from the unbalance [deg]"
            middle.insert(2, _plot(name, "/plot/balls", legend=self.balls <= 8))
        columns = rrb.TextLogColumns(text_log_columns=["LogLevel", "Body", "EntityPath"])
        right = [
            rrb.TextDocumentView(origin="/description", name="This run"),
            rrb.TextLogView(origin="/events", name="Events", columns=columns),
        ]
        if scalars:
            right.append(_plot("Real-time factor [1]; 1 keeps up", "/run"))
        sides = [rrb.Vertical(*views) for views in (left, middle, right)]
        return rrb.Blueprint(
            rrb.Horizontal(*sides, column_shares=[3, 4, 3]),
            rrb.TimePanel(state="collapsed", timeline="sim_time", play_state="following"),
            rrb.BlueprintPanel(state="hidden"),
            rrb.SelectionPanel(state="hidden"),
        )

    def _top_view(self, name: str, origin: str, reach: float, also: str = "") -> rrb.View:
        span = [-reach * self.race, reach * self.race]
        now = rrb.TimeRangeBoundary.cursor_relative
        trail = rrb.VisibleTimeRange("sim_time", start=now(seconds=-0.05), end=now())
        return rrb.Spatial2DView(
            name=name,
            origin=origin,
            contents=["$origin/**", also] if also else "$origin/**",
            visual_bounds=rrb.VisualBounds2D(x_range=span, y_range=span),
            overrides={"/top/shaft": [rrb.VisibleTimeRanges([trail])]},
        )


def _plot(name: str, origin: str, *, legend: bool = True) -> rrb.View:
    return rrb.TimeSeriesView(
        name=name,
        origin=origin,
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),  # zooming one zooms all
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftBottom, visible=legend),
    )


def _lines(names: list[str]) -> rr.SeriesLines:
    colors = [_GREY if n == "command" else _HUES[i % len(_HUES)] for i, n in enumerate(names)]
    widths = [3.0 if n == "speed" else 1.5 for n in names]  # command lies on top of speed
    return rr.SeriesLines(names=names, colors=colors, widths=widths)


def _scalars(values: Array) -> Any:
    """Columns of Scalars for values (rows, series)."""
    rows, series = values.shape
    return rr.Scalars.columns(scalars=values.ravel()).partition(np.full(rows, series))


def _index(time: ArrayLike, step: Array | None = None) -> list[rr.TimeColumn]:
    # Rounded here, because Rerun truncates: 0.003 s would come out as 2,999,999 ns.
    nanoseconds = np.rint(np.asarray(time, dtype=np.float64) * 1e9).astype("timedelta64[ns]")
    index = [rr.TimeColumn("sim_time", duration=nanoseconds)]
    if step is not None:
        index.append(rr.TimeColumn("step", sequence=step.astype(np.int64)))
    return index


def _path(*parts: str) -> str:
    return str(rr.new_entity_path(list(parts)))  # escapes what Rerun reserves


def _layout(channels: Sequence[str]) -> dict[str, list[int]]:
    """Columns of every entity, in order. ``step`` is a timeline and not among them."""
    layout: dict[str, list[int]] = {}
    for column, name in enumerate(channels):
        ball = _BALL_CHANNEL.fullmatch(name)
        entity = f"/balls/{ball[1]}" if ball else _ENTITY.get(name) or _path("other", name)
        if name != "step":
            layout.setdefault(entity, []).append(column)
    return layout


def _has_footer(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 64))
        return _FOOTER in file.read()


@dataclass(frozen=True)
class Event:
    """What `Recording.event` noted; ``time`` [s] is rounded to ns, ``level`` has Rerun's name."""

    time: float
    level: str
    source: str
    text: str


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """A run as it was recorded. ``run["x"]`` is the column of a channel."""

    description: dict[str, Any]
    channels: tuple[str, ...]
    samples: Array  # (rows, channels), bit for bit, in the order of step
    gaps: int  # places where step leaps by more than 1
    missing: int  # steps that are not there because of them
    events: list[Event]  # in the order of time
    scalars: dict[str, Array]  # name: (n, 2), time [s] and value
    complete: bool  # False: the recording was never closed (still running, killed, disk full)

    def __getitem__(self, channel: str) -> Array:
        return self.samples[:, self.channels.index(channel)]


def read_recording(path: Path | str) -> RecordedRun:
    """Read what `Recording` wrote, finished or not.

    :raises RecordingError: no such file, not a Rerun file, torn in the middle, or not ours.
    """
    path = Path(path)
    static, moving = _batches(path)
    if "/description" not in static:
        raise RecordingError(f"{path} is a Rerun file, but not a recording of ab_sim")
    text = _column(static["/description"], "TextDocument:text")[0]
    names = tuple(_column(static["/channels"], "names")) if "/channels" in static else ()
    samples = _samples(names, moving)
    leaps = np.diff(samples[:, 0]) if names else np.empty(0)
    components = ("TextLog:level", "source", "TextLog:text")
    noted = _notes(moving, "/events/", *components)
    events = [Event(*row) for _, times, values in noted for row in zip(times, *values, strict=True)]
    scalars = _notes(moving, "/run/", "Scalars:scalars")
    return RecordedRun(
        description=json.loads(text.split("```json\n", 1)[1].rsplit("\n```", 1)[0]),
        channels=names,
        samples=samples,
        gaps=int((leaps > 1).sum()),
        missing=int((leaps - 1).sum()),
        events=sorted(events, key=lambda event: event.time),
        scalars={name: np.column_stack([times, *values]) for name, times, values in scalars},
        complete=_has_footer(path),
    )


Batches = dict[str, list[pa.RecordBatch]]  # by entity


def _batches(path: Path) -> tuple[Batches, Batches]:
    """What is static, and what has a time."""
    if not path.is_file():
        reason = "it is a folder" if path.is_dir() else "no such file"
        raise RecordingError(f"cannot read the recording {path}: {reason}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it warns of every file that was not closed
            chunks = RrdReader(path).stream().to_chunks()
    except (RuntimeError, ValueError) as error:
        raise RecordingError(f"{path} is not a Rerun recording, or is torn: {error}") from error
    static: Batches = {}
    moving: Batches = {}
    for chunk in chunks:
        batches = static if chunk.is_static else moving
        batches.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())
    return static, moving


def _column(batches: list[pa.RecordBatch], name: str) -> NDArray[Any]:
    """All values of a component or timeline, flat."""
    columns = (batch[name] for batch in batches)
    parts = [c.flatten() if pa.types.is_list(c.type) else c for c in columns]
    return np.concatenate([part.to_numpy(zero_copy_only=False) for part in parts])


def _samples(names: Sequence[str], moving: Batches) -> Array:
    layout = _layout(names)
    if any(entity not in moving for entity in layout):
        return np.empty((0, len(names)))
    # Entities are sent one after the other: a recording that was killed may lack some of the last.
    steps = {entity: _column(moving[entity], "step") for entity in layout}
    samples = np.empty((min(map(len, steps.values()), default=0), len(names)))
    for entity, columns in layout.items():
        order = np.argsort(steps[entity])[: len(samples)]
        values = _column(moving[entity], "Scalars:scalars").reshape(-1, len(columns))
        samples[:, columns] = values[order]
        samples[:, 0] = steps[entity][order]
    return samples


def _notes(moving: Batches, root: str, *names: str) -> Iterator[tuple[str, list[float], list[Any]]]:
    """Of all entities under root: name, times [s], and the components of these names."""
    for entity, batches in moving.items():
        if entity.startswith(root):
            times = _column(batches, "sim_time").astype(np.int64) / 1e9
            yield entity.removeprefix(root), times.tolist(), [_column(batches, n) for n in names]
