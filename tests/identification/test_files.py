"""Recordings of every kind, the command, its page, and what `ab-sim robust` takes from it."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import ab_sim
from ab_sim.analysis.comparison import without_balls
from ab_sim.base.errors import InputError
from ab_sim.cli.app import app
from ab_sim.design.draws import DrawnPoints
from ab_sim.design.tolerances import fitted_tolerances
from ab_sim.identification.files import measured_of
from ab_sim.identification.mapping import mapping_of, read_mapping_file
from ab_sim.identification.measured import NUISANCES
from ab_sim.identification.tables import read_table
from ab_sim.record.bags.exporting import export_bag
from ab_sim.record.recording.export import CSV, PARQUET, Part, export
from tests.cli.tool import ab_sim as command
from tests.identification import drives

FIT = ["effects.suspension.stiffness", "effects.suspension.damping", "rotor.eccentricity"]
TRUE = (1100.0, 1.7, 8.5e-5)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One run without balls, as .rrd, .csv, .parquet and as a bag; and the scene to begin with."""
    place = tmp_path_factory.mktemp("files")
    drive = without_balls(drives.scene(dict(zip(FIT, TRUE, strict=True))))
    ab_sim.save_recording(ab_sim.simulate(drive), place / "run.rrd")
    stored = ab_sim.open_recording(place / "run.rrd")
    export(stored, {CSV: place / "csv.csv", PARQUET: place / "parquet.parquet"}, Part())
    export_bag(stored, place / "bag")
    (place / "start.yaml").write_text(json.dumps(drives.scene().as_mapping()))
    return place


@pytest.mark.parametrize("name", ["csv.csv", "parquet.parquet", "bag"])
def test_every_kind_of_file_gives_the_same_recording(folder: Path, name: str) -> None:
    """The fit of a recording (.rrd) is in test_fit.py."""
    found, expected = (measured_of(folder / each, drives.scene()) for each in (name, "run.rrd"))
    assert found.kind == expected.kind
    np.testing.assert_allclose(found.time, expected.time, rtol=1e-9)
    np.testing.assert_allclose(found.signals, expected.signals, rtol=1e-9, atol=1e-15)
    assert found.spindle_angle == pytest.approx(expected.spindle_angle, rel=1e-9)


def test_the_command_writes_scene_page_and_json(folder: Path) -> None:
    out, page, report = (folder / name for name in ("fitted.yaml", "page.html", "fit.json"))
    ran = command(
        *("identify", str(folder / "run.rrd"), "--scene", str(folder / "start.yaml")),
        *("--fit", ",".join(FIT), "--out", str(out), "--html", str(page), "--json", str(report)),
    )
    assert ran.returncode == 0, ran.stderr
    assert "bench: fits" in ran.stdout and "proposed next recordings" in ran.stdout
    assert ab_sim.load_scene(out).rotor.eccentricity == pytest.approx(8.5e-5, rel=1e-6)
    text = page.read_text()
    assert "residuals: measured minus fitted" in text and "rotor.eccentricity" in text
    assert "at its bound" not in text
    assert '"text":"[mm]"' in text and '"text":"[m]"' not in text
    assert "http" not in text.partition("</style>")[0]
    found = json.loads(report.read_text())
    assert found["verdict"] == "fits" and len(found["covariance"]["values"]) == 3


def test_a_wrong_word_is_told_in_one_line(folder: Path) -> None:
    recording, scene = str(folder / "run.rrd"), str(folder / "start.yaml")
    for words, says in (
        (("--fit", "rotor.eccentricit"), "no such key; did you"),
        (("--fit", "spindle.max_speed"), "the spindle does what"),
        (("--fit", "balls.count"), "a continuous number"),
        (("--fit", "effects.motor.torque_limit"), "no torque was measured"),
        (("--fit", FIT[0], "--bounds", f"{FIT[0]}=2000..3000"), "1000 lies outside"),
        (("--fit", FIT[0], "--bounds", f"{FIT[1]}=1..3"), "is not fitted; "),
        (("--fit", FIT[0], "--free", "phase"), "one of gain, bias"),
        (("--fit", FIT[0], "--trial-mass", "other=5 g"), "no such recording"),
        (("--fit", FIT[0], "--hold-out", recording), "is given twice"),
        (("--fit", FIT[0], "--signal", "pickup"), "one of displacement, acceler"),
        (("--fit", "rotor.eccentricity.0"), "rotor.eccentricity is one number"),
    ):  # fmt: skip
        asked = ["identify", recording, "--scene", scene, *words]
        with pytest.raises(InputError) as caught:
            CliRunner().invoke(app, asked, catch_exceptions=False)
        assert says in str(caught.value) and "\n" not in str(caught.value)


def test_samples_and_rows_that_are_missing_are_counted(tmp_path: Path) -> None:
    table = {name: np.delete(each, [900]) for name, each in drives.recorded(drives.scene()).items()}
    table["ch1"][400] = math.nan
    file = drives.write(table, tmp_path / "bench.csv")
    found = measured_of(file, drives.scene(), read_mapping_file(drives.mapping(tmp_path)))
    assert found.notes == (
        "1 of 1999 samples of ch1 missing or not finite, left out",
        "1 row is missing between 1999: the time jumps there",
    )


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("t;x;y\n0,1;2,5;3,5\n", "separator is ';'"),
        ("t;x;y\n0.1;2.5;3.5\n", "separator is ';'"),
        ("t,x,y\n0,1,2,5,3,5\n0,2,2,5,3,5\n", "decimal commas"),
        ("t,x,y\n0.1,2.5,3.5\n0.2,2.5\n", "line 3, .* 2 of 3 columns"),
        ("0.0,0.0,0.0\n0.1,2.5,3.5\n", "first line is numbers"),
        ("t,x,x\n0.1,2.5,3.5\n", "two columns 'x'"),
    ],
)
def test_a_table_of_another_dialect_or_torn_is_told(tmp_path: Path, text: str, says: str) -> None:
    file = tmp_path / "bench.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=says):
        read_table(file)


@pytest.mark.parametrize("what", NUISANCES)
def test_a_mapping_may_free_whatever_a_recording_has_of_its_own(what: str) -> None:
    own = {"sampling": 1e3, "speed": {"column": "w"}, "signals": [{"column": "x"}]}
    assert mapping_of({**own, "free": [what]}, "test").free == (what,)


def covariance(path: Path, values: list[list[float]]) -> Path:
    """As an identification writes it."""
    names = ["balls.mass", "rotor.eccentricity"]
    report = {
        "parameters": [{"name": name, "per_recording": False} for name in names]
        + [{"name": "gain of run", "per_recording": True}],
        "covariance": {"parameters": [*names, "gain of run"], "values": values},
    }
    path.write_text(json.dumps(report), encoding="utf-8")
    return path


def test_a_fit_s_covariance_is_a_spread(tmp_path: Path) -> None:
    given = [[4e-12, -6e-13, 0.0], [-6e-13, 1e-12, 0.0], [0.0, 0.0, 1.0]]
    tolerances = fitted_tolerances(covariance(tmp_path / "fit.json", given))
    scene = drives.scene()
    points = DrawnPoints(scene, tolerances, 4000, seed=1)
    assert set(points.sources) == {"group fit of balls.mass", "group fit of rotor.eccentricity"}
    assert points.keys == ("balls.mass", "rotor.eccentricity")
    drawn = np.array([points.at(run) for run in range(4000)])
    assert drawn.mean(axis=0) == pytest.approx([5.5e-4, 1e-4], abs=1e-7)
    assert np.cov(drawn.T) == pytest.approx(np.array(given)[:2, :2], rel=0.15)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "not positive definite"),
        (
            [[math.nan, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            "variance that is not",
        ),
        ([[1.0]], "what `ab-sim identify --json` writes"),
    ],
)
def test_what_is_no_fit_is_refused(tmp_path: Path, values: list[list[float]], says: str) -> None:
    with pytest.raises(InputError, match=says):
        fitted_tolerances(covariance(tmp_path / "fit.json", values))


DRIFT = Path(__file__).with_name("drift.csv")
"""One axis drifts by 0.25 mm in 5 s; every fourth ms of the first 1.2 s."""


def test_a_signal_that_drifts_leaves_all_files(tmp_path: Path) -> None:
    """Also if a result is not finite; none of them needs another."""
    (tmp_path / "map.yaml").write_text(
        "time: {column: t, unit: s}\nspeed: {column: rpm, unit: rpm}\n"
        "signals:\n  - {column: x, unit: mm}\n  - {column: y, unit: mm}\n"
    )
    (tmp_path / "bare.yaml").write_text(
        "rotor: {total_mass: 0.0989, eccentricity: 1.0e-4}\nballs: {count: 0}\nduration: 5.0\n"
        "effects:\n  - suspension: {stiffness: 1200.0, damping: 1.5}\n  - spindle_acceleration\n"
        "spindle: {max_speed: 420.0, max_acceleration: 50.0}\n"
    )
    done = command(
        "identify", str(DRIFT), "--map", "map.yaml", "--scene", "bare.yaml", "--workers", "1",
        "--fit", "rotor.eccentricity", "--json", "f.json", "--out", "f.yaml", "--html", "f.html",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} in the JSON")

    report = json.loads((tmp_path / "f.json").read_text(), parse_constant=refuse)
    assert report["verdict"] == "does not fit"
    assert "drifts by" in done.stdout and "does its sensor drift?" in done.stdout
    assert ab_sim.load_scene(tmp_path / "f.yaml").as_mapping() == report["fitted_scene"]
    assert "drifts by" in (tmp_path / "f.html").read_text()
