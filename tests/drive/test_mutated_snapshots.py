"""Snapshots with one value changed: refused by InputError, or the start of a finite run."""

import json
import random
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from ab_sim.base.errors import DivergedError, InputError
from ab_sim.drive import Drive
from ab_sim.drive.snapshot_file import read_snapshot, write_snapshot
from ab_sim.nodes.command_path import CommandPath, Rules
from ab_sim.nodes.prepared_drive import CommandedDrive
from ab_sim.scene import Scene, load_scene
from tests.drive.mutations import changed

SCENES = {
    "thesis-hold": ["sensors.front.bandwidth=200", "sensors.front.noise_density=0"],
    "everything": ["start.speed=60"],
    "couple-unbalance": [],
    "nsc-case-1": [],
    "adaptive-start-up": [],
}
EACH = 80
"""Mutations of each scene's snapshot."""
STEPS = 200


def commanded(scene: Scene) -> CommandedDrive:
    """A drive on a bus, as a node has it; led by its profile if that decides while it runs."""
    drive = Drive(scene, commanded=not scene.is_controlled)
    return CommandedDrive(drive, CommandPath(drive.servo, drive.step, Rules(delay=0.05)))


def go_on(path: Path, scene: Scene, to: CommandedDrive) -> None:
    """Restore a snapshot as ``~/restore_snapshot`` does, and go on; all samples are finite."""
    kept, commands = read_snapshot(path, scene)
    try:
        to.drive.check(kept)
    except ValueError as error:
        raise InputError(str(error)) from error
    if commands:
        to.path.restore(commands)
    to.restore(kept)
    for part in to.advance(STEPS):
        assert np.all(np.isfinite(part.samples))


@pytest.mark.parametrize("name", SCENES)
def test_a_mutated_snapshot_is_refused_or_runs(name: str, tmp_path: Path) -> None:
    scene, path, rng = load_scene(name, SCENES[name]), tmp_path / "kept.json", random.Random(name)
    drive = commanded(scene)
    top = scene.spindle.max_speed
    for speed in (0.5 * top, 0.4 * top):
        if not scene.is_controlled:
            drive.path.receive(speed, drive.drive.steps)
        for _ in drive.advance(STEPS // 2):
            pass
    extra = {}
    if not scene.is_controlled:
        drive.path.receive(0.3 * top, drive.drive.steps)
        extra = drive.path.state()
    write_snapshot(path, scene, drive.drive.snapshot(), extra)
    content, refused, failures = json.loads(path.read_text()), 0, []
    for _ in range(EACH):
        run, words = changed(json.loads(content["run"]), rng)
        text = json.dumps(run)
        path.write_text(
            json.dumps(content | {"run": text, "digest": sha256(text.encode()).hexdigest()})
        )
        try:
            go_on(path, scene, drive)
        except InputError as error:
            assert "\n" not in str(error)
            refused += 1
        except DivergedError:
            pass
        except Exception as error:
            failures.append(f"{words}: {error!r}")
        drive.reset()
    assert not failures, "\n".join(failures)
    assert 0.2 * EACH < refused < EACH
