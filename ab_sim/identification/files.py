"""Files of an identification, and their conversion to recordings."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import ValidationError

from ab_sim.base.errors import InputError, nearest, short
from ab_sim.identification.checks import (
    check_agree,
    check_finite,
    check_held,
    check_held_signal,
    check_sense,
    check_signal,
    check_speed,
    check_time,
    spikes_in,
)
from ab_sim.identification.mapping import (
    AXES,
    ColumnMapping,
    ColumnOf,
    Keyphasor,
    SignalColumn,
    factor_of,
    kind_of_unit,
    number_of,
    pair_of,
    read_mapping_file,
    sensitivity_factor,
    usual_mapping,
)
from ab_sim.identification.measured import (
    ACCELERATION,
    DISC_ANGLE,
    DISPLACEMENT,
    NUISANCES,
    UNITS,
    Measured,
)
from ab_sim.identification.spindle import angle_from_pulses, schedule_from
from ab_sim.identification.tables import Table, read_table
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene.model import Scene
from ab_sim.scene.sensors import Accelerometer, ProximityProbe, Sampled, steps_per_sample

SENSORS: dict[str, type[Sampled]] = {"sensors": Accelerometer, "probes": ProximityProbe}
"""Sensor class by section of a scene: accelerations and displacements."""
_STANDS = 1e-3
"""Speed below which a spindle stands still, relative to the top speed."""
_RUN_BEGINS = 1
"""Largest step number of the first sample at which a recording includes the run's start."""


def measured_of(
    path: Path,
    scene: Scene,
    mapping: ColumnMapping | None = None,
    signal: str | None = None,
    with_balls: bool | None = None,
) -> Measured:
    """Read a recording from a file, convert it to SI units and check it.

    Parameters
    ----------
    path
        File of a type that ``read_table`` reads.
    scene
        Scene of the drive; the mapping may refer to its sensors.
    mapping
        Meaning of the columns; None for recordings of ab_sim.
    signal
        Signal to be fitted, see ``usual_mapping``.
    with_balls
        Whether there were balls; None to use the mapping or the recorded scene.

    Raises
    ------
    InputError
        The recording cannot be used; the message states the reason and the remedy.
    RecordingError
        The file cannot be read.
    """
    table = read_table(path, None if signal is None else pair_of(signal)[0])
    if mapping is None:
        sensors, probes = _sensors_of(table)
        usual = usual_mapping(list(table.columns), sensors, probes, signal)
        if isinstance(usual, str):
            if table.description:
                raise InputError(f"{path}: {usual}")
            raise InputError(
                f"{path}: {usual}: it is not a recording of ab_sim; describe its columns by --map"
            )
        mapping = usual
    return _Reader(table, scene, mapping).measured(with_balls)


def _sensors_of(table: Table) -> tuple[list[str], list[str]]:
    """Return the names of the accelerometers and of the probes of a recorded scene or bag."""
    recorded = table.description.get("scene")
    if recorded:
        sensors, probes = (list(recorded.get(section) or ()) for section in SENSORS)
        return sensors, probes
    pickups = (table.description.get("pickups") or {}).items()
    return (
        [name for name, kind in pickups if kind == ACCELERATION],
        [name for name, kind in pickups if kind == DISPLACEMENT],
    )


def _whirl_of(signals: np.ndarray, axes: Sequence[float]) -> np.ndarray:
    """Return the displacement or acceleration as x + i y, from signals along two axes.

    Return the first signal if there is only one, or if the axes are nearly parallel.

    Parameters
    ----------
    signals
        Finite signals, shape (samples, axes).
    axes
        Angles of the signals' axes [rad].
    """
    if len(axes) == 1 or abs(math.sin(axes[1] - axes[0])) < 0.1:
        first: np.ndarray = signals[:, 0]
        return first
    across = np.array([[math.cos(a), math.sin(a)] for a in axes])
    x, y = np.linalg.solve(across, signals.T)
    return np.asarray(x + 1j * y)


class _Reader:
    """Conversion of a table to a recording in SI units, by its mapping."""

    def __init__(self, table: Table, scene: Scene, mapping: ColumnMapping) -> None:
        self._table, self._scene, self._mapping = table, scene, mapping
        self._name = table.name

    def measured(self, with_balls: bool | None) -> Measured:
        """Return the recording, checked; for ``with_balls`` see ``measured_of``."""
        mapping, name = self._mapping, self._name
        kind = self._kind()
        signals = np.column_stack(
            [self._numbers(signal, UNITS[kind], f"signals.{k}")
             for k, signal in enumerate(mapping.signals)]
        )  # fmt: skip
        # Treat infinite values as missing.
        signals[np.isinf(signals)] = np.nan
        spikes = self._without_spikes(signals)
        time = self._time(len(signals))
        check_time(time, name)
        speed = self._optional(mapping.speed, "rad/s", "speed")
        angle = self._optional(mapping.angle, "rad", "angle")
        cut: tuple[str, ...] = ()
        if mapping.keyphasor is not None:
            angle = self._angle_from(mapping.keyphasor, time)
            finite = np.isfinite(angle)
            cut = (
                f"{int((~finite).sum())} samples before the first pulse and after the last one of "
                "the keyphasor left out",
            )
            time, signals, angle = time[finite], signals[finite], angle[finite]
            speed = None if speed is None else speed[finite]
        from_start, step = self._run(time)
        time = time - (0.0 if from_start else time[0])
        schedule = self._schedule(time, speed, angle)
        axes = self._axes()
        turned = schedule.angles(time)
        remarks = [
            check_signal(time, turned, signals[:, k], f"signals.{k} ({signal.column})", name)
            for k, signal in enumerate(mapping.signals)
        ]
        there = np.isfinite(signals).all(axis=1)
        balls = mapping.balls if with_balls is None else with_balls
        if with_balls is None and (count := self._table.description.get("balls")) is not None:
            balls = bool(count)
        sense = check_sense(turned[there], _whirl_of(signals[there], axes), balls, name)
        remarks.append(sense.note)
        sensor = self._sensor()
        # The sample at time 0 is the initial state, which is fitted separately.
        kept = time > 1e-12
        if sensor is not None and step is not None:
            # In a recorded simulation, a sensor's reading is repeated until its next sample.
            every = steps_per_sample(sensor.sample_rate, step)
            kept &= np.rint(time / step).astype(np.int64) % every == 0
        rests = mapping.at_rest
        if rests is None:
            rests = abs(schedule.speed(0.0)) < _STANDS * schedule.top_speed
        if len(axes) == 1 and not rests:
            remarks.append(
                "does not begin at rest, and has one signal: the deck's start across it is not "
                "known, so it is taken as 0"
            )
        for k, signal in enumerate(mapping.signals):
            check_held_signal(signals[kept, k], f"signals.{k} ({signal.column})", name)
        pulses = mapping.keyphasor
        zero_known = angle is not None if pulses is None else pulses.angle is not None
        free = dict.fromkeys((*mapping.free, *(() if zero_known else (DISC_ANGLE,))))
        return Measured(
            name=name,
            time=time[kept],
            signals=signals[kept],
            axes=axes,
            kind=kind,
            schedule=schedule,
            angle_known=angle is not None,
            with_balls=balls and self._scene.balls.count > 0,
            sensor=sensor,
            step=step,
            delay=number_of(mapping.delay, "s", f"{name}: delay"),
            free=tuple(free),
            trial_mass=number_of(mapping.trial_mass, "kg", f"{name}: trial_mass"),
            doubt=sense.doubt,
            at_rest=rests,
            notes=(
                *self._table.notes,
                *cut,
                *spikes,
                *self._left_out(time[kept], signals[kept]),
                *filter(None, remarks),
            ),
        )

    def _schedule(
        self, time: np.ndarray, speed: np.ndarray | None, angle: np.ndarray | None
    ) -> SpeedSchedule:
        """Return the speed schedule of the spindle from its recorded speed or angle."""
        name = self._name
        if angle is not None:
            check_finite(time, angle, "angle", name)
            check_held(angle, "angle", name)
            # Unwrap the angle of an encoder that counts within one revolution.
            angle = np.unwrap(angle) if float(np.ptp(angle)) <= 2.0 * math.pi * 1.01 else angle
            check_speed(time, np.gradient(angle, time), "angle", name)
        if speed is not None:
            check_speed(time, speed, "speed", name)
            check_held(speed, "speed", name)
        if speed is not None and angle is not None:
            check_agree(time, speed, angle, name)
        schedule = schedule_from(time - time[0], speed, angle, name)
        if time[0] > 0.0:
            schedule = schedule.moved(float(time[0]))
        return schedule

    def _without_spikes(self, signals: np.ndarray) -> list[str]:
        """Set spikes of a real drive's signals to NaN; return notes on them."""
        notes = []
        # In a simulation, impacts between balls cause genuine spikes.
        for k, signal in enumerate(() if self._table.description else self._mapping.signals):
            rows = spikes_in(signals[:, k])
            if len(rows):
                one = "spike" if len(rows) == 1 else "spikes"
                notes.append(
                    f"{len(rows)} {one} in {signal.column} left out, the first at row {rows[0]}: "
                    "is its line disturbed?"
                )
                signals[rows, k] = np.nan
        return notes

    def _left_out(self, time: np.ndarray, signals: np.ndarray) -> list[str]:
        """Return notes on missing samples that are not fitted."""
        notes = []
        for signal, column in zip(self._mapping.signals, signals.T, strict=True):
            missing = int((~np.isfinite(column)).sum())
            if missing:
                notes.append(
                    f"{missing} of {len(column)} samples of {signal.column} missing or not finite, "
                    "left out"
                )
        steps = np.diff(time)
        lost = int(np.sum(np.rint(steps / np.median(steps)) - 1.0))
        # For recordings of ab_sim the recorder has already noted missing rows.
        if not self._table.description and lost > 0:
            rows = "row is" if lost == 1 else "rows are"
            notes.append(f"{lost} {rows} missing between {len(time)}: the time jumps there")
        return notes

    def _kind(self) -> str:
        """Return the kind of the signals: stated, or that of the unit of the first that has one."""
        kind = self._mapping.kind_of_signals
        if kind is None:
            units = [
                self._table.units.get(signal.column)
                for signal in self._mapping.signals
                if signal.sensitivity is None
            ]
            kind = next((kind_of_unit(unit) for unit in units if unit), None)
        if kind is None:
            signal = self._mapping.signals[0]
            unit = signal.unit or self._table.units.get(signal.column)
            raise InputError(
                f"{self._name}: signals.0 ({signal.column}): "
                + (f"unit {unit!r} is neither of a displacement nor of an acceleration"
                   if unit else "has no unit")
                + "; give it in the mapping, e.g. {unit: mm} or {unit: m/s^2}"
            )  # fmt: skip
        return kind

    def _numbers(self, column: ColumnOf, si: str, place: str) -> np.ndarray:
        """Return the numbers of a column in an SI unit; ``place`` is its key in the mapping."""
        unit = self._table.unit_of(column.column, column.unit)
        if isinstance(column, SignalColumn) and column.sensitivity is not None:
            factor = sensitivity_factor(column.sensitivity, unit, si, f"{self._name}: {place}")
        else:
            factor = factor_of(unit, si, f"{self._name}: {place}")
        return factor * self._table.column(column.column, place)

    def _angle_from(self, keyphasor: Keyphasor, time: np.ndarray) -> np.ndarray:
        """Return the spindle's angle [rad]; NaN before the first and after the last pulse."""
        reading = self._table.column(keyphasor.column, "keyphasor")
        check_finite(time, reading, "keyphasor", self._name)
        place = f"{self._name}: keyphasor.angle"
        first = 0.0 if keyphasor.angle is None else number_of(keyphasor.angle, "rad", place)
        return first + angle_from_pulses(time, reading, keyphasor.per_turn, self._name)

    def _optional(self, column: ColumnOf | None, si: str, place: str) -> np.ndarray | None:
        return None if column is None else self._numbers(column, si, place)

    def _time(self, count: int) -> np.ndarray:
        """Return the times of ``count`` samples [s], from a column or from the sampling rate."""
        mapping = self._mapping
        if mapping.time is not None:
            return self._numbers(mapping.time, "s", "time")
        assert mapping.sampling is not None
        rate = number_of(mapping.sampling, "Hz", f"{self._name}: sampling")
        if not 0.0 < rate < math.inf:
            raise InputError(f"{self._name}: sampling = {rate} Hz: must be more than 0")
        return np.arange(count) / rate

    def _run(self, time: np.ndarray) -> tuple[bool, float | None]:
        """Return whether a recorded simulation includes the run's start, and its time step [s].

        Return False and None for a real drive.
        """
        step = self._table.description.get("step")
        if not isinstance(step, float) or "step" not in self._table.columns:
            return False, None
        first = float(self._table.columns["step"][0])
        return first <= _RUN_BEGINS and abs(time[0] - first * step) < 1e-9, step

    def _axes(self) -> tuple[float, ...]:
        """Return the direction of each signal's axis from the deck's x [rad]."""
        axes = []
        turned = 0.0
        sensor = self._sensor()
        if sensor is not None:
            turned = sensor.axis_angle
        for k, signal in enumerate(self._mapping.signals):
            place = f"{self._name}: signals.{k}.direction"
            direction = signal.direction
            axes.append(
                turned + AXES[k] if direction is None else number_of(direction, "rad", place)
            )
        return tuple(axes)

    def _sensor(self) -> Sampled | None:
        """Return the sensor that the mapping describes or names; None if its low-pass is unknown.

        The scene of a recorded simulation takes precedence over the fitted scene.
        """
        sensor = self._mapping.sensor
        if sensor is None:
            return None
        if isinstance(sensor, dict):
            kind = Accelerometer if self._kind() == ACCELERATION else ProximityProbe
            try:
                return kind.model_validate(sensor)
            except ValidationError as error:
                error_entry = error.errors(include_url=False)[0]
                key = ".".join(map(str, ("sensor", *error_entry["loc"])))
                near = nearest(key.partition(".")[2], kind.model_fields)
                raise InputError(
                    f"{self._name}: {key} = {short(error_entry['input'])}: "
                    f"{error_entry['msg']}{near}"
                ) from None
        recorded = self._table.description.get("scene") or {}
        for section, model in SENSORS.items():
            if sensor in (recorded.get(section) or {}):
                return model.model_validate(recorded[section][sensor])
        if sensor in self._scene.pickups:
            return self._scene.pickups[sensor]
        if sensor in itertools.chain(*_sensors_of(self._table)):
            return None  # a test rig's sensor, whose low-pass is unknown
        raise InputError(
            f"{self._name}: sensor = {sensor!r}: no such sensor; the scene has "
            + (", ".join(self._scene.pickups) or "no sensors")
            + "; name one, or give its parameters, e.g. {bandwidth: 200}"
        )


def _check_names(recordings: Sequence[Measured]) -> None:
    """Refuse recordings with equal names.

    Raises
    ------
    InputError
        Two recordings have the same name.
    """
    names = [recording.name for recording in recordings]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{name}: two recordings have this name; rename one of the files")


_MOST_MASS = 1e3
"""Upper limit of a trial mass [kg]."""


class Files(NamedTuple):
    """Files of an identification, and settings of their conversion."""

    recordings: Sequence[Path]
    without_balls: Sequence[Path] = ()
    """Further recordings, made without balls."""
    hold_out: Sequence[Path] = ()
    """Recordings that are predicted but not fitted."""
    maps: Sequence[Path] = ()
    """Mapping files: one for all, one per recording in the order given, or none."""
    signal: str | None = None
    """Name of the signal; see ``usual_mapping``."""
    free: Sequence[str] = ()
    """Names in ``NUISANCES`` that are fitted for each recording."""
    trial_masses: Mapping[str, float] = {}
    """Mass clamped to the deck [kg], by the recording's name without ending."""


def read_files(files: Files, scene: Scene) -> tuple[list[Measured], list[Measured]]:
    """Read all recordings; return those for the fit, and those held out.

    Parameters
    ----------
    files
        Recordings, their mappings and further settings.
    scene
        Scene of the drive.

    Raises
    ------
    InputError
        A recording cannot be used; the message states the reason and the remedy.
    RecordingError
        A recording cannot be read.
    """
    for what in files.free:
        if what not in NUISANCES:
            raise InputError(
                f"free {what}: must be one of {', '.join(NUISANCES)}{nearest(what, NUISANCES)}"
            )
    paths = [*files.recordings, *files.without_balls, *files.hold_out]
    for path in paths:
        if paths.count(path) > 1:
            raise InputError(f"{path}: is given twice; give each recording once")
    mappings = _mappings(files, paths)
    bare = len(files.recordings)
    outside = bare + len(files.without_balls)
    recordings = []
    for k, (path, mapping) in enumerate(zip(paths, mappings, strict=True)):
        balls = False if bare <= k < outside else None
        measured = measured_of(path, scene, mapping, files.signal, balls)
        free = tuple(dict.fromkeys((*measured.free, *files.free)))
        mass = files.trial_masses.get(measured.name, measured.trial_mass)
        if not 0.0 <= mass < _MOST_MASS:
            raise InputError(
                f"{measured.name}: trial mass = {mass} kg: must be at least 0, below {_MOST_MASS:g}"
            )
        recordings.append(replace(measured, free=free, trial_mass=mass))
    _check_names(recordings)
    names = [recording.name for recording in recordings]
    for name in files.trial_masses:
        if name not in names:
            raise InputError(
                f"trial mass {name}: there is no such recording{nearest(name, names)}; there are "
                + ", ".join(names)
            )
    return recordings[:outside], recordings[outside:]


def _mappings(files: Files, paths: Sequence[Path]) -> list[ColumnMapping | None]:
    """Return the mapping of each file; None for recordings and bags, whose columns are known."""
    if len(files.maps) not in (0, 1, len(paths)):
        raise InputError(
            f"--map: {len(files.maps)} mappings for {len(paths)} recordings; give one for all, or "
            "one for each"
        )
    read = [read_mapping_file(path) for path in files.maps]
    if not read:
        return [None] * len(paths)
    mappings: list[ColumnMapping | None] = list(
        read if len(read) == len(paths) else read * len(paths)
    )
    return [
        mapping if path.suffix.lower() in (".csv", ".parquet") else None
        for path, mapping in zip(paths, mappings, strict=True)
    ]


def trial_masses_of(texts: Sequence[str]) -> dict[str, float]:
    """Parse ``NAME=MASS`` into masses [kg] by the recording's name without ending.

    Raises
    ------
    InputError
        The text has another form.
    """
    masses = {}
    for text in texts:
        name, equals, mass = (part.strip() for part in text.partition("="))
        if not (name and equals and mass):
            raise InputError(f"--trial-mass {short(text)}: must be NAME=MASS, e.g. 'run-2=5 g'")
        masses[Path(name).stem] = number_of(mass, "kg", f"--trial-mass {short(text)}")
    return masses
