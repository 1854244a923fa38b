"""A snapshot of a drive in a file, for another process to go on from, to the bit."""

import functools
import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import ab_sim
from ab_sim.drive.observation import Snapshot
from ab_sim.errors import InputError
from ab_sim.output_file import REPORT, check_ending, check_writable, write_whole
from ab_sim.quoting import short, shortened
from ab_sim.scene.model import Scene
from ab_sim.sensing import PickupState
from ab_sim.sources import NotOfSources, sources
from ab_sim.spindle import ScheduledSegment, SpeedSchedule
from ab_sim.spindle.speed_laws import RaisedCosine, Ramp

FORMAT, VERSION = "ab_sim snapshot", 1
MOST_BYTES = 1 << 24
"""Of a file; hours of commands take some MB."""
MOST_TIME = 2.0**31
"""s; a message's stamp cannot say more."""
SEGMENTS = {kind.__name__: kind for kind in (Ramp, RaisedCosine)}


def write_snapshot(
    path: Path, scene: Scene, snapshot: Snapshot, beside: Mapping[str, Any], *modules: str
) -> None:
    """Write one; a file that is there is replaced at once, or stays whole.

    Args:
        path: ends in .json.
        scene: the drive's.
        snapshot: the drive's.
        beside: whatever else is to be kept, as JSON-able values.
        modules: names of those that go on from that.

    Raises:
        InputError: the file cannot be written.
    """
    check_ending(path, REPORT, "snapshot")
    check_writable(path, "snapshot")
    run = json.dumps({"drive": _as_values(snapshot), "beside": dict(beside)})
    content = {
        "format": FORMAT,
        "version": VERSION,
        "ab_sim": ab_sim.__version__,
        "kernel": _kernel(*modules),
        "scene": scene.as_mapping(),
        "digest": _digest(run),
        "run": run,
    }
    try:
        write_whole(path, json.dumps(content, indent=1).encode())
    except OSError as error:
        raise InputError(f"snapshot {path}: cannot be written: {error.strerror}") from error


def read_snapshot(path: Path, scene: Scene, *modules: str) -> tuple[Snapshot, dict[str, Any]]:
    """Read one, and what was kept beside it.

    Args:
        path: of the file.
        scene: what is to go on from it.
        modules: as when it was written.

    Raises:
        InputError: there is none, it is damaged, or it is of another scene or another ab_sim.
    """
    try:
        with path.open("rb") as file:
            text = file.read(MOST_BYTES + 1)
        if len(text) > MOST_BYTES:
            raise InputError(f"snapshot {path}: is none: it has more than {MOST_BYTES} bytes")
        content = json.loads(text)
    except OSError as error:
        raise InputError(f"snapshot {path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"snapshot {path}: is damaged, or none: {error}") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise InputError(f"snapshot {path}: is a JSON file, but no snapshot of ab_sim")
    version, *of = (content.get(key) for key in ("version", "ab_sim", "kernel"))
    if version != VERSION:
        raise InputError(
            f"snapshot {path}: is of version {short(version)}, and this ab_sim reads version "
            f"{VERSION}; save it again"
        )
    if of != [ab_sim.__version__, _kernel(*modules)]:
        program, kernel = (shortened(str(each)) for each in of)
        raise InputError(
            f"snapshot {path}: is of ab_sim {program} with kernel {kernel}, and this is "
            f"{ab_sim.__version__} with {_kernel(*modules)}: it would not go on to the same bits; "
            "save it again"
        )
    if different := _different(content.get("scene"), json.loads(json.dumps(scene.as_mapping()))):
        names = shortened(", ".join(different))
        raise InputError(
            f"snapshot {path}: is of another scene, which differs in {names}; load that scene first"
        )
    run = content.get("run")
    if not isinstance(run, str) or _digest(run) != content.get("digest"):
        raise InputError(f"snapshot {path}: is damaged: its digest does not fit")
    try:
        kept = json.loads(run)
        return _from_values(kept["drive"]), dict(kept["beside"])
    except (
        ArithmeticError,
        AttributeError,
        LookupError,
        RecursionError,
        TypeError,
        ValueError,
    ) as error:
        said = short(error)
        raise InputError(f"snapshot {path}: holds no state of a drive: {said}") from error


def _digest(run: str) -> str:
    return hashlib.sha256(run.encode()).hexdigest()


@functools.cache
def _kernel(*modules: str) -> str:
    """A few digits that say of which sources a drive is made, and what is beside it."""
    try:
        made_of = sources(["ab_sim.drive.drive", *modules])
    except NotOfSources as error:
        raise InputError(f"snapshot: {error}; start this process again") from error
    digests = "".join(source.digest for source in made_of.values())
    return hashlib.sha256(digests.encode()).hexdigest()[:16]


def _different(one: Any, other: Any, name: str = "") -> list[str]:
    """Dotted names of what differs."""
    if one == other:
        return []
    if not (isinstance(one, dict) and isinstance(other, dict)):
        return [name or "everything"]
    keys = sorted(one.keys() | other.keys())
    inner = [_different(one.get(key), other.get(key), f"{name}.{key}".lstrip(".")) for key in keys]
    return [found for each in inner for found in each]


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
        "leader": snapshot.leader,
    }


def _from_values(kept: dict[str, Any]) -> Snapshot:
    shape, numbers = kept["memory"]
    scheduled_segments = [
        ScheduledSegment(float(start), float(end), float(angle), SEGMENTS[kind](*map(float, parts)))
        for start, end, angle, kind, parts in kept["pieces"]
    ]
    starts, ends = (
        [scheduled.start for scheduled in scheduled_segments],
        [scheduled.end for scheduled in scheduled_segments],
    )
    if (
        not scheduled_segments
        or starts[1:] != ends[:-1]
        or sorted(starts) != starts
        or ends[-1] != math.inf
    ):
        raise ValueError("its profile is not one piece after the other")
    steps, state = kept["steps"], np.array(kept["state"], float)
    if not isinstance(steps, int) or not abs(steps) * float(kept["step"]) < MOST_TIME:
        raise ValueError(f"{short(steps)} is no number of steps")
    if not np.all(np.isfinite(state)):
        raise ValueError("its state is not finite")
    return Snapshot(
        steps=steps,
        step=float(kept["step"]),
        state=state,
        discrete_state=np.array(kept["modes"], np.int64),
        memory=np.array(numbers, float).reshape(shape),
        profile=SpeedSchedule.of_scheduled(scheduled_segments, kept["variable_speed_period"]),
        command=None if kept["command"] is None else float(kept["command"]),
        acceleration=float(kept["acceleration"]),
        pickups={
            name: PickupState(
                np.array([complex(*z) for z in mode]),
                np.array(force, float),
                np.array(reading, float),
            )
            for name, (mode, force, reading) in kept["pickups"].items()
        },
        leader=kept["leader"],
    )
