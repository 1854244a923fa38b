"""Pipes, devices and damaged files, given to each function that reads a file."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from ab_sim import sweep
from ab_sim.base.errors import AbSimError
from ab_sim.base.yaml_files import read_yaml_file
from ab_sim.cli.scene_commands import ViewOptions
from ab_sim.cli.view import run_view
from ab_sim.design.sweep import open_sweep
from ab_sim.design.tolerances import fitted_tolerances
from ab_sim.drive.snapshot_file import read_content
from ab_sim.identification.tables import read_table
from ab_sim.record.bags.reader import Bag
from ab_sim.record.bags.repair import repair_bag
from ab_sim.record.recording import open_recording
from ab_sim.scene import load_scene

READERS: dict[str, Callable[[Path], Any]] = {
    "scene.yaml": load_scene,
    "parameters.yaml": read_yaml_file,
    "snapshot.json": lambda path: read_content(path, "any", ""),
    "fit.json": fitted_tolerances,
    "sweep.parquet": open_sweep,
    "table.csv": read_table,
    "table.parquet": read_table,
    "run.rrd": open_recording,
    "seen.rrd": lambda path: run_view(ViewOptions([path], web=True)),
    "run.mcap": Bag,
    "run.db3": Bag,
    "torn.mcap": repair_bag,
}


@pytest.mark.parametrize("name", READERS)
def test_pipes_and_devices_are_refused_where_a_file_is_read(name: str, tmp_path: Path) -> None:
    """An open pipe without a writer would block, and /dev/zero never ends."""
    os.mkfifo(tmp_path / f"pipe-{name}")
    (tmp_path / f"device-{name}").symlink_to("/dev/zero")
    for kind in ("pipe", "device"):
        with pytest.raises((AbSimError, OSError), match="pipe or a device"):
            READERS[name](tmp_path / f"{kind}-{name}")


def test_a_pipe_in_a_bags_folder_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "bag_0.mcap")
    with pytest.raises(AbSimError, match="bag_0.mcap: .*pipe or a device"):
        Bag(tmp_path)


def test_a_sweep_whose_runs_are_not_numbered_in_order_is_refused(tmp_path: Path) -> None:
    whole, damaged = tmp_path / "whole.parquet", tmp_path / "damaged.parquet"
    sweep(load_scene("thesis-hold", ["duration=0.05"]), {"balls.mass": [0.001, 0.002]}).write(whole)
    table = pq.read_table(whole)
    pq.write_table(table.set_column(0, table.schema.field(0), [[7, 1]]), damaged)
    assert len(open_sweep(whole).table) == 2
    with pytest.raises(AbSimError, match="damaged.parquet: is not a Parquet"):
        open_sweep(damaged)


def test_a_damaged_sweep_is_refused_by_one_error(tmp_path: Path) -> None:
    scene = load_scene("thesis-hold", ["duration=0.05"])
    whole = tmp_path / "whole.parquet"
    sweep(scene, {"balls.mass": [0.001, 0.002]}).write(whole)
    content, generator = whole.read_bytes(), np.random.default_rng(44)
    for place in generator.integers(4, len(content), 150).tolist():
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(generator.integers(8))
        file = tmp_path / "damaged.parquet"
        file.write_bytes(damaged)
        try:
            open_sweep(file)
        except AbSimError as error:
            assert str(file) in str(error)
