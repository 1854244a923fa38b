"""A metric of a stranger's own: all of it is in this file, and no file of the package knows it."""

import importlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import ab_sim
from ab_sim.analysis import Metrics, metrics_of, metrics_of_blocks
from ab_sim.analysis.metrics import passes_of
from ab_sim.cli.app import app
from ab_sim.scene import Scene
from tests.analysis.made import made

KEY = "largest_final_acceleration"
CHANGES = ["--set", "duration=0.3"]


class LargestAcceleration:
    equation = "max hypot(x'', y'')"

    def __init__(self, scene: Scene, samples: int) -> None:
        self.left, self.largest = samples, -1.0

    def take(self, piece: ab_sim.Trajectory) -> None:
        self.left -= len(piece)
        self.largest = max(self.largest, float(np.hypot(piece["ax"], piece["ay"]).max()))

    def value(self) -> float | None:
        assert self.left == 0, "it has been shown as many samples as it was told"
        return self.largest


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    """Known while a test runs."""
    with ab_sim.temporary_registrations():
        add = ab_sim.register_metric(
            KEY, unit="m/s^2", label="largest a", meaning="the deck's, in the end",
            last_stretch=True, better="smaller",
        )  # fmt: skip
        assert add(LargestAcceleration) is LargestAcceleration
        yield


def largest(run: ab_sim.Trajectory) -> float:
    last = run.last(round(0.1 * len(run)))
    return float(np.hypot(last["ax"], last["ay"]).max())


def test_it_is_in_reports_and_tables(tmp_path: Path) -> None:
    file = tmp_path / "run.rrd"
    said = CliRunner().invoke(
        app,
        ["run", "thesis-hold", *CHANGES, "--json", str(tmp_path / "r.json"), "--rrd", str(file)],
    )
    assert said.exit_code == 0, said.output
    report = json.loads((tmp_path / "r.json").read_text())
    assert list(report)[list(report).index(KEY) - 1] == "verdict", "the last one"
    assert report[KEY] > 0 and report["without_balls"][KEY] > 0
    (row,) = [line for line in said.output.splitlines() if "largest a [m/s^2]" in line]
    assert f"{report[KEY]:.3g}" in row and f"{report['without_balls'][KEY]:.3g}" in row
    said = CliRunner().invoke(app, ["report", str(file), "--json", str(tmp_path / "s.json")])
    assert said.exit_code == 0 and "largest a [m/s^2]" in said.output, said.output
    (judged,) = json.loads((tmp_path / "s.json").read_text())["runs"]
    assert judged["metrics"][KEY] == pytest.approx(report[KEY], rel=1e-12)


def test_it_is_in_the_table_of_the_documentation(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("sphinx", reason="the site needs ab_sim[docs]")
    # As docs/conf.py has it: its modules import each other.
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "docs" / "extensions")
    from_code = importlib.import_module("from_code")
    lines = list(from_code.metrics())
    assert (
        f"| `{KEY}` | m/s^2 | smaller | sweep, tune, robust | the deck's, in the end "
        "| `max hypot(x'', y'')` |" in lines
    )
    assert any("`final_whirl_relative_to_no_balls`" in line for line in lines)


def test_it_is_listed_with_all_that_is_said_of_it() -> None:
    said = CliRunner().invoke(app, ["metrics", KEY, "--json"])
    assert json.loads(said.output) == [
        {
            "name": KEY,
            "unit": "m/s^2",
            "better": "smaller",
            "kind": "number",
            "meaning": "the deck's, in the end",
            "equation": "max hypot(x'', y'')",
            "taken_by": "sweep, tune, robust",
        }
    ]


def test_drives_of_a_batch_are_sorted_by_its_key() -> None:
    scene = ab_sim.load_scene("thesis-hold", ["duration=0.1"])
    variations = [{"rotor.eccentricity": e} for e in (2e-4, 5e-5, 1e-4)]
    runs = ab_sim.simulate_batch(scene, variations, every=2).runs
    found = [metrics_of(run.trajectory, run.scene, [KEY])[KEY] for run in runs]
    assert found == [largest(run.trajectory) for run in runs]
    assert np.argsort(found).tolist() == [1, 2, 0]


def test_in_a_batch_it_gets_the_readings_of_sensors() -> None:
    @ab_sim.register_metric("largest_reading", unit="m/s^2", meaning="the sensor's largest reading")
    class LargestReading(LargestAcceleration):
        def take(self, piece: ab_sim.Trajectory) -> None:
            self.left -= len(piece)
            self.largest = max(self.largest, float(abs(piece["pickup_1"]).max()))

    scene = ab_sim.load_scene("thesis-hold", ["duration=0.1", "sensors.pickup.noise_density=0.01"])
    variations = [{"sensors.pickup.seed": seed} for seed in (1, 2)]
    found = ab_sim.simulate_batch(scene, variations, metrics=["largest_reading"]).metrics
    runs = ab_sim.simulate_batch(scene, variations).runs
    expected = [abs(run.trajectory["pickup_1"]).max() for run in runs]
    assert found["largest_reading"].tolist() == expected and len({*expected}) == 2


@pytest.mark.parametrize("size", [1, 7, 1001])
def test_it_is_found_piece_by_piece(size: int, scene: Any) -> None:
    run = made(balls=2, step=1e-2, ax=lambda t: t * np.sin(9 * t))

    def pieces() -> Iterator[ab_sim.Trajectory]:
        for first in range(0, len(run), size):
            yield ab_sim.Trajectory(run.channels, run.samples[first : first + size])

    assert metrics_of_blocks(pieces, len(run), scene())[KEY] == largest(run)


def test_only_what_is_asked_for_is_computed(scene: Any) -> None:
    run = made(balls=2, step=1e-2, x=lambda t: 1e-4 * t)
    metrics = metrics_of(run, scene(), ["in_band_from", KEY])
    assert list(metrics.report()) == ["in_band_from", KEY]
    assert metrics["in_band_from"] == metrics_of(run, scene()).in_band_from
    with pytest.raises(ab_sim.InputError, match="'peak_time': was not computed"):
        metrics.of(Metrics.peak_time)
    assert (passes_of([KEY]), passes_of(["in_band_from"]), passes_of()) == (1, 2, 2)


def test_what_is_no_metric_names_the_nearest(scene: Any) -> None:
    run = made(balls=2)
    with pytest.raises(ab_sim.InputError, match="'peak_wirl_over_e'.*mean 'peak_whirl_over_e'"):
        metrics_of(run, scene(), ["peak_wirl_over_e"])
    with pytest.raises(ab_sim.InputError, match="'residual'"):
        metrics_of(run, scene())["residual"]
    with pytest.raises(ValueError, match="registered twice"):
        ab_sim.register_metric("peak_time", meaning="taken")(LargestAcceleration)
    with pytest.raises(ab_sim.InputError, match="better = 'less': .*smaller, larger"):
        ab_sim.register_metric("mine", meaning="mine", better="less")


def test_a_length_may_be_in_eccentricities(scene: Any) -> None:
    @ab_sim.register_metric("first_whirl_over_e", unit="e", meaning="the first whirl")
    class FirstWhirl:
        def __init__(self, scene: Scene, samples: int) -> None:
            self.whirl: float | None = None

        def take(self, piece: ab_sim.Trajectory) -> None:
            self.whirl = float(piece.whirl[0]) if self.whirl is None else self.whirl

        def value(self) -> float | None:
            return self.whirl

    run = made(balls=2, x=lambda t: 3e-4 - t)
    assert metrics_of(run, scene())["first_whirl_over_e"] == pytest.approx(3.0)
    assert metrics_of(run, scene(rotor={"eccentricity": 0.0}))["first_whirl_over_e"] is None
