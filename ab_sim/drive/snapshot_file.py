"""Snapshot of a drive in a file, from which another process continues with identical bits."""

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ab_sim.base.errors import NOT_AS_WRITTEN, InputError, short, shortened
from ab_sim.base.numbers import MOST_TIME, entry, reason_of, whole
from ab_sim.drive.observation import Snapshot
from ab_sim.drive.sensing import PickupState
from ab_sim.drive.snapshot_bounds import check_bounds
from ab_sim.drive.snapshot_json import check_origin, origin, read_content, write_content
from ab_sim.model.spindle import ScheduledSegment, SpeedSchedule
from ab_sim.model.spindle.speed_laws import RaisedCosine, Ramp
from ab_sim.scene.model import Scene

FORMAT, VERSION = "ab_sim snapshot", 1
DRIVE = "ab_sim.drive.drive"
"""Module that continues from a snapshot."""
SEGMENTS = {kind.__name__: kind for kind in (Ramp, RaisedCosine)}


def write_snapshot(
    path: Path, scene: Scene, snapshot: Snapshot, beside: Mapping[str, Any], *modules: str
) -> None:
    """Write a snapshot; an existing file is replaced atomically.

    Args:
        path: file that ends in .json.
        scene: the drive's scene.
        snapshot: the drive's state.
        beside: further JSON-able values to store.
        modules: names of the modules that continue from these values.

    Raises:
        InputError: the file cannot be written.
    """
    run = json.dumps({"drive": _as_values(snapshot), "beside": dict(beside)})
    content = {
        "format": FORMAT,
        "version": VERSION,
        **origin(DRIVE, *modules),
        "scene": scene.as_mapping(),
        "digest": _digest(run),
        "run": run,
    }
    write_content(path, content)


def read_snapshot(path: Path, scene: Scene, *modules: str) -> tuple[Snapshot, dict[str, Any]]:
    """Read a snapshot and the further values stored with it.

    Args:
        path: file to read.
        scene: scene of the drive that continues.
        modules: names of the modules that were passed to ``write_snapshot``.

    Raises:
        InputError: the file is missing, damaged, or from another scene or another version.
    """
    content = read_content(path, FORMAT, "no snapshot of ab_sim")
    if (version := content.get("version")) != VERSION:
        raise InputError(
            f"snapshot {path}: has format version {short(version)}, and this ab_sim reads version "
            f"{VERSION}; save it again"
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
        return snapshot, entry(kept, "beside", dict)
    except NOT_AS_WRITTEN as error:
        reason = reason_of(error)
        raise InputError(f"snapshot {path}: holds no state of a drive: {reason}") from error


def _digest(run: str) -> str:
    return hashlib.sha256(run.encode()).hexdigest()


def _different(one: Any, other: Any, name: str = "") -> list[str]:
    """Return the dotted names of differing values."""
    if one == other:
        return []
    if not (isinstance(one, dict) and isinstance(other, dict)):
        return [name or "everything"]
    keys = sorted(one.keys() | other.keys())
    inner = [_different(one.get(key), other.get(key), f"{name}.{key}".lstrip(".")) for key in keys]
    return [name for names in inner for name in names]


def _as_values(snapshot: Snapshot) -> dict[str, Any]:
    profile = snapshot.profile
    return {
        "steps": snapshot.steps,
        "step": snapshot.step,
        "state": snapshot.state.tolist(),
        "modes": snapshot.discrete_state.tolist(),
        "memory": [snapshot.memory.shape, snapshot.memory.ravel().tolist()],
        "pieces": [
            [*scheduled[:3], type(scheduled.segment).__name__, scheduled[3]]
            for scheduled in profile.segments
        ],
        "variable_speed_period": profile.variable_speed_period,
        "command": snapshot.command,
        "acceleration": snapshot.acceleration,
        "pickups": {
            name: [[[z.real, z.imag] for z in mode.tolist()], force.tolist(), reading.tolist()]
            for name, (mode, force, reading) in snapshot.pickups.items()
        },
        "controller": snapshot.controller,
    }


def _from_values(kept: Mapping[str, Any]) -> Snapshot:
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
        discrete_state=entry(kept, "modes", lambda modes: np.array(modes, np.int64)),
        memory=entry(kept, "memory", lambda memory: _numbers(memory[1]).reshape(memory[0])),
        profile=SpeedSchedule.of_scheduled(
            entry(kept, "pieces", _segments), kept.get("variable_speed_period")
        ),
        command=entry(kept, "command", lambda command: None if command is None else float(command)),
        acceleration=entry(kept, "acceleration", float),
        pickups=entry(kept, "pickups", _pickups),
        controller=kept.get("controller"),
    )


def _numbers(values: Any) -> NDArray[np.float64]:
    return np.array(values, float)


def _segments(pieces: Any) -> list[ScheduledSegment]:
    segments = [
        ScheduledSegment(float(start), float(end), float(angle), SEGMENTS[kind](*map(float, parts)))
        for start, end, angle, kind, parts in pieces
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
