"""Snapshot of a drive in a file, from which another process continues with identical bits.

The file is JSON, written atomically, and valid only for the same sources. Its numbers must respect
the bounds of a run of its scene.
"""

import functools
import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ab_sim.base.errors import NOT_AS_WRITTEN, InputError, short, shortened
from ab_sim.base.files import REPORT, check_ending, check_regular, check_writable, write_whole
from ab_sim.base.numbers import MOST_TIME, entry, reason_of, whole
from ab_sim.base.sources import NotOfSources, sources
from ab_sim.base.version import __version__
from ab_sim.drive.observation import Snapshot
from ab_sim.drive.pickup import PickupState
from ab_sim.model.dynamics.assemble import MOST_ANGLE, state_bounds, system_of
from ab_sim.model.dynamics.system import TURNS, has_motor, layout_of
from ab_sim.model.spindle import ScheduledSegment, SpeedSchedule
from ab_sim.model.spindle.schedule import RaisedCosine, Ramp
from ab_sim.scene.model import Scene

MOST_BYTES = 1 << 24
"""Largest size of a file; hours of commands take some MB."""


def write_content(path: Path, content: Mapping[str, Any]) -> None:
    """Write a snapshot file; an existing file is replaced atomically.

    Only a snapshot of the same format is replaced, because any ROS peer can set the parameter that
    the path may come from.

    Parameters
    ----------
    path
        File that ends in .json.
    content
        JSON-able values, including the name of their ``format``.

    Raises
    ------
    InputError
        The file cannot be written, or the existing file is no such snapshot.
    """
    check_ending(path, REPORT, "snapshot")
    check_writable(path, "snapshot")
    if path.is_symlink():
        raise InputError(f"snapshot {path}: is a symbolic link; name the file itself")
    if path.exists() and path.stat().st_size:
        try:
            read_content(path, content["format"], "another one")
        except InputError as error:
            raise InputError(
                f"snapshot {path}: the existing file is not an {content['format']}; name "
                "another file, or remove it"
            ) from error
    try:
        write_whole(path, json.dumps(content, indent=1).encode())
    except OSError as error:
        raise InputError(f"snapshot {path}: cannot be written: {error.strerror}") from error


def read_content(path: Path, named: str, otherwise: str) -> dict[str, Any]:
    """Read a snapshot file.

    Parameters
    ----------
    path
        File to read.
    named
        Expected value of the entry ``format``.
    otherwise
        End of the message for a JSON file with another format.

    Raises
    ------
    InputError
        The file is missing, damaged, or of another format.
    """
    try:
        check_regular(path)
        with path.open("rb") as file:
            text = file.read(MOST_BYTES + 1)
        if len(text) > MOST_BYTES:
            raise InputError(
                f"snapshot {path}: is not a snapshot: it has more than {MOST_BYTES} bytes"
            )
        content = json.loads(text)
    except OSError as error:
        raise InputError(f"snapshot {path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"snapshot {path}: is damaged, or not a snapshot: {error}") from error
    if not isinstance(content, dict) or content.get("format") != named:
        raise InputError(f"snapshot {path}: is a JSON file, but {otherwise}")
    return content


def origin(*modules: str) -> dict[str, str]:
    """Return version and sources that a file must have to be continued with the same bits.

    Parameters
    ----------
    modules
        Names of the modules that continue.

    Raises
    ------
    InputError
        The sources of a module have changed since it was imported.
    """
    return {"ab_sim": __version__, "kernel": _kernel(*modules)}


def check_origin(path: Path, content: Mapping[str, Any], *modules: str) -> None:
    """Refuse a file that these modules did not write.

    Raises
    ------
    InputError
        The file was written by another version or other sources.
    """
    ours = origin(*modules)
    if any(content.get(key) != value for key, value in ours.items()):
        program, kernel = (shortened(str(content.get(key))) for key in ours)
        raise InputError(
            f"snapshot {path}: is of ab_sim {program} with kernel {kernel}, and this is "
            f"{ours['ab_sim']} with {ours['kernel']}: it would not continue with the same bits; "
            "save it again"
        )


@functools.cache
def _kernel(*modules: str) -> str:
    """Return a short digest of the modules' sources."""
    try:
        made_of = sources(list(modules))
    except NotOfSources as error:
        raise InputError(f"snapshot: {error}; start this process again") from error
    digests = "".join(source.digest for source in made_of.values())
    return hashlib.sha256(digests.encode()).hexdigest()[:16]


_MOST_TURNS = 2**53
"""Largest number of whole turns of an angle that a double represents exactly."""
_MOST_MODE = 2
"""Largest magnitude of any other number of the discrete state."""
_MOST_SLOPE = 1e12
"""Largest slope of a segment [rad/s^2]; commands within one step may exceed the scene's limit."""
ROUNDING = 1e-6
"""Relative margin for rounding of computed speeds and angles."""


def check_bounds(snapshot: Snapshot, scene: Scene) -> None:
    """Refuse a snapshot with a number that no run of its scene can reach.

    Raises
    ------
    ValueError
        A number is out of bounds; the message names it and its bounds.
    """
    system = system_of(scene)
    if snapshot.state.size > layout_of(system).size:
        system = system_of(scene, energy_balance=True)
    layout, top = layout_of(system), scene.spindle.max_speed
    bounds = state_bounds(system, scene.solver.step)
    bounds[layout.angles] = 2.0 * math.pi  # whole turns are counted separately
    if has_motor(system.effects):
        bounds[layout.spindle.start] = 2.0 * math.pi
    if snapshot.state.shape != bounds.shape:
        raise ValueError(f"state: has {snapshot.state.size} numbers; must have {bounds.size}")
    for name, value, most in zip(layout.names, snapshot.state, bounds, strict=True):
        _within(name, value, most)
    _within("steps", snapshot.steps, math.inf, least=0)
    for at, row in enumerate(np.atleast_2d(snapshot.discrete_state).tolist()):
        for column, mode in enumerate(row):
            _within(
                f"discrete_state.{at}.{column}",
                mode,
                _MOST_TURNS if column == TURNS else _MOST_MODE,
            )
    if snapshot.command is not None:
        _within("command", snapshot.command, top)
    _within("acceleration", snapshot.acceleration, scene.spindle.max_acceleration, least=0)
    numbers = [("memory", snapshot.memory)]
    numbers += [
        (f"pickups.{name}", part) for name, kept in snapshot.pickups.items() for part in kept
    ]
    for name, part in numbers:
        if not np.all(np.isfinite(part)):
            raise ValueError(f"{name}: has a number that is not finite")
    for at, scheduled in enumerate(snapshot.schedule.segments):
        name = f"segments.{at}"
        _within(f"{name}.start", scheduled.start, MOST_TIME)
        _within(f"{name}.start_angle", scheduled.start_angle, MOST_ANGLE)
        law = scheduled.law
        _within(f"{name}.start_speed", law.start_speed, top)
        if isinstance(law, RaisedCosine):
            _within(f"{name}.change", law.change, 2.0 * top)
            _within(f"{name}.duration", law.duration, MOST_TIME, least=0)
        else:
            _within(f"{name}.slope", law.slope, _MOST_SLOPE)
            if law.slope != 0.0:
                change = law.slope * (scheduled.end - scheduled.start)
                _within(f"{name}: speed at its end", law.start_speed + change, top)


def _within(name: str, value: float, most: float, least: float | None = None) -> None:
    """Refuse a value beyond ``most``, or below ``least``, by default ``-most``; or a NaN."""
    low = -most if least is None else least
    # A NaN fails this comparison.
    if not low * (1.0 + ROUNDING) <= value <= most * (1.0 + ROUNDING):
        raise ValueError(f"{name} = {short(float(value))}: must be {low:g} to {most:g}")


_FORMAT, _VERSION = "ab_sim snapshot", 1
DRIVE = "ab_sim.drive.drive"
"""Module that continues from a snapshot."""
SEGMENTS = {kind.__name__: kind for kind in (Ramp, RaisedCosine)}


def write_snapshot(
    path: Path, scene: Scene, snapshot: Snapshot, extra: Mapping[str, Any], *modules: str
) -> None:
    """Write a snapshot; an existing file is replaced atomically.

    Parameters
    ----------
    path
        File that ends in .json.
    scene
        The drive's scene.
    snapshot
        The drive's state.
    extra
        Further JSON-able values to store.
    modules
        Names of the modules that continue from these values.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    run = json.dumps({"drive": _as_values(snapshot), "extra": dict(extra)})
    content = {
        "format": _FORMAT,
        "version": _VERSION,
        **origin(DRIVE, *modules),
        "scene": scene.as_mapping(),
        "digest": _digest(run),
        "run": run,
    }
    write_content(path, content)


def read_snapshot(path: Path, scene: Scene, *modules: str) -> tuple[Snapshot, dict[str, Any]]:
    """Read a snapshot and the further values stored with it.

    Parameters
    ----------
    path
        File to read.
    scene
        Scene of the drive that continues.
    modules
        Names of the modules that were passed to ``write_snapshot``.

    Raises
    ------
    InputError
        The file is missing, damaged, or from another scene or another version.
    """
    content = read_content(path, _FORMAT, "no snapshot of ab_sim")
    if (version := content.get("version")) != _VERSION:
        raise InputError(
            f"snapshot {path}: has format version {short(version)}, and this ab_sim reads version "
            f"{_VERSION}; save it again"
        )
    check_origin(path, content, DRIVE, *modules)
    if different := _different(content.get("scene"), json.loads(json.dumps(scene.as_mapping()))):
        names = shortened(", ".join(different))
        raise InputError(
            f"snapshot {path}: is of another scene, which differs in {names}; load that scene first"
        )
    run = content.get("run")
    if not isinstance(run, str) or _digest(run) != content.get("digest"):
        raise InputError(f"snapshot {path}: is damaged: its digest does not match its content")
    try:
        kept = json.loads(run)
        snapshot = _from_values(entry(kept, "drive", dict))
        check_bounds(snapshot, scene)
        return snapshot, entry(kept, "extra", dict)
    except NOT_AS_WRITTEN as error:
        reason = reason_of(error)
        raise InputError(f"snapshot {path}: holds no state of a drive: {reason}") from error


def _digest(run: str) -> str:
    """Return the SHA-256 of the stored run, which shows damage."""
    return hashlib.sha256(run.encode()).hexdigest()


def _different(one: Any, other: Any, name: str = "") -> list[str]:
    """Return the dotted names of the values in which two nested mappings differ."""
    if one == other:
        return []
    if not (isinstance(one, dict) and isinstance(other, dict)):
        return [name or "everything"]
    keys = sorted(one.keys() | other.keys())
    inner = [_different(one.get(key), other.get(key), f"{name}.{key}".lstrip(".")) for key in keys]
    return [name for names in inner for name in names]


def _as_values(snapshot: Snapshot) -> dict[str, Any]:
    """Return a snapshot as JSON-able values."""
    schedule = snapshot.schedule
    return {
        "steps": snapshot.steps,
        "step": snapshot.step,
        "state": snapshot.state.tolist(),
        "discrete_state": snapshot.discrete_state.tolist(),
        "memory": [snapshot.memory.shape, snapshot.memory.ravel().tolist()],
        "segments": [
            [*scheduled[:3], type(scheduled.law).__name__, scheduled[3]]
            for scheduled in schedule.segments
        ],
        "variable_speed_period": schedule.variable_speed_period,
        "command": snapshot.command,
        "acceleration": snapshot.acceleration,
        "pickups": {
            name: [[[z.real, z.imag] for z in mode.tolist()], force.tolist(), reading.tolist()]
            for name, (mode, force, reading) in snapshot.pickups.items()
        },
        "controller": snapshot.controller,
    }


def _from_values(kept: Mapping[str, Any]) -> Snapshot:
    """Return the snapshot of ``_as_values``; raise ValueError for values of another form."""
    steps, step = entry(kept, "steps", whole), entry(kept, "step", float)
    if not abs(steps) * step < MOST_TIME:
        raise ValueError(f"steps = {steps}, step = {step}: must be less than {MOST_TIME:g} s")
    state = entry(kept, "state", _numbers)
    if not np.all(np.isfinite(state)):
        raise ValueError("state: has a number that is not finite")
    return Snapshot(
        steps=steps,
        step=step,
        state=state,
        discrete_state=entry(kept, "discrete_state", lambda modes: np.array(modes, np.int64)),
        memory=entry(kept, "memory", lambda memory: _numbers(memory[1]).reshape(memory[0])),
        schedule=SpeedSchedule.of_scheduled(
            entry(kept, "segments", _segments), kept.get("variable_speed_period")
        ),
        command=entry(kept, "command", lambda command: None if command is None else float(command)),
        acceleration=entry(kept, "acceleration", float),
        pickups=entry(kept, "pickups", _pickups),
        controller=kept.get("controller"),
    )


def _numbers(values: Any) -> NDArray[np.float64]:
    return np.array(values, float)


def _segments(rows: Any) -> list[ScheduledSegment]:
    """Return the segments of a schedule; refuse gaps, and a last segment that ends."""
    segments = [
        ScheduledSegment(float(start), float(end), float(angle), SEGMENTS[kind](*map(float, parts)))
        for start, end, angle, kind, parts in rows
    ]
    starts = [segment.start for segment in segments]
    ends = [segment.end for segment in segments]
    if starts[1:] != ends[:-1] or sorted(starts) != starts or ends[-1] != math.inf:
        raise ValueError("its profile segments do not follow one another")
    return segments


def _pickups(values: Any) -> dict[str, PickupState]:
    return {
        name: PickupState(np.array([complex(*z) for z in mode]), _numbers(force), _numbers(reading))
        for name, (mode, force, reading) in values.items()
    }
