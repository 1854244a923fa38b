"""`ab-sim` as a user runs it: output, files, messages, exit codes."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ab_sim import __version__
from ab_sim.cli.declare import STEPPERS
from ab_sim.engine.integrate.registry import AUTO, steppers
from ab_sim.scene import find_scene, load_scene, scene_names
from tests.cli.tool import PNG, ab_sim, refused
from tests.recorded import read_recording


def test_run_writes_what_was_asked_for(tmp_path: Path) -> None:
    done = ab_sim(
        "run", "thesis-hold", "--times", "2.5,3,5", "--json", "r.json", "--plot", "p.png",
        "--rrd", "r.rrd", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "r.json").read_text())
    assert [sample["t"] for sample in report["samples"]] == [2.5, 3.0, 5.0]
    keys = "t psi omega u v x y vx vy whirl theta theta_rate stuck once_per_turn phase".split()
    assert list(report["samples"][0]) == keys
    first = report["samples"][0]
    assert first["omega"] == 100.0 and first["psi"] == 125.0
    assert np.hypot(first["x"], first["y"]) == pytest.approx(first["whirl"])
    assert np.degrees(report["samples"][2]["theta"]) == pytest.approx([-198.3, -198.3], abs=0.1)
    assert report["peak_whirl_over_e"] == pytest.approx(62.53, rel=1e-3)
    assert report["peak_time"] == pytest.approx(3.297, rel=1e-3)
    passed = report["first_passage_of_opposite"] - report["variable_speed_period"]
    assert passed == pytest.approx(0.873, rel=1e-3)
    assert report["final_stretch"] == pytest.approx(0.6)
    assert report["settled"] is False and report["in_band_from"] is None
    through, alone = report["without_variable_speed_period"], report["without_balls"]
    assert through["peak_whirl_over_e"] == pytest.approx(54.56, rel=1e-3), "thesis-baseline's"
    assert alone["residual_unbalance"] == alone["final_whirl_relative_to_no_balls"] == 1.0
    share = report["final_whirl_over_e"] / alone["final_whirl_over_e"]
    assert report["final_whirl_relative_to_no_balls"] == pytest.approx(share)
    assert share > 2, "the thesis' set is not balanced by its hold"
    for words in ("without balls", "residual unbalance", "still changing", "3.373 s"):
        assert words in done.stdout
    assert re.search("variable- +┃", done.stdout), "broken at its hyphen, however narrow it is"
    assert report["scene"] == "thesis-hold"
    assert report["effects"]["suspension"] == {"stiffness": 1000.0, "damping": 0.2}
    assert (report["stepper"], report["step"]) == ("rk8", 0.001)
    assert report["events"] > 0 and report["steps_with_unresolved_events"] == 0
    assert first["stuck"] == [False, False]
    assert report["version"] == __version__
    assert (tmp_path / "p.png").read_bytes().startswith(PNG)
    recorded = read_recording(tmp_path / "r.rrd")
    assert len(recorded.samples) == 6001 and recorded.missing == 0
    assert recorded["ball_0_angle"][5000] == report["samples"][2]["theta"][0]
    assert "peak W/e" in done.stdout and "wrote" in done.stderr


def test_a_table_is_in_the_chosen_units() -> None:
    done = ab_sim("run", "thesis-hold", "--set", "duration=0.5", "--units", "um,rpm,m/s,rad")
    assert done.returncode == 0, done.stderr
    rows = {row[0].strip(): row[1].strip() for row in map(
        lambda line: line.strip("│").split("│"), done.stdout.splitlines()
    ) if len(row) > 2}  # fmt: skip
    plain = json.loads(ab_sim("run", "thesis-hold", "--set", "duration=0.5", "--json", "-").stdout)
    e = load_scene("thesis-hold").rotor.eccentricity
    assert rows["final W [um]"].split(",")[0] == f"{1e6 * e * plain['final_whirl_over_e']:.3g}"
    assert rows["final speed"] == f"{plain['final_speed'] * 60 / (2 * np.pi):.4g} rpm"
    assert rows["balance grade G [m/s]"] == f"{1e-3 * plain['balance_grade']:.3g}"
    assert rows["final ball angles"].endswith(" rad")
    assert "'sheep' is not a unit" in refused("run", "thesis-hold", "--units", "sheep")


def test_json_to_standard_output_is_only_json() -> None:
    done = ab_sim(
        "run", "no-ball", "--set", "duration=0.5", "--json", "-", "--stepper", "rk4", "--step",
        "0.0005",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    times = [sample["t"] for sample in report["samples"]]
    assert times == pytest.approx(np.linspace(0.0, 0.5, 101)), "evenly, where none are asked for"
    assert (report["stepper"], report["step"]) == ("rk4", 0.0005)
    assert report["first_passage_of_opposite"] is None
    assert report["without_balls"] is None and report["without_variable_speed_period"] is None
    assert report["final_whirl_relative_to_no_balls"] is None
    assert report["residual_unbalance"] == 1.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "thesis-hlod"), "did you mean 'thesis-hold'"),
        (("run", "thesis-hold", "--set", "balls.mass=nan"), "balls.mass"),
        (("run", "thesis-hold", "--times", "1,x"), "must be numbers separated by commas"),
        (("run", "thesis-hold", "--times", "-1"), "at least 0"),
        (("run", "thesis-hold", "--times", "nan"), "finite number"),
        (
            ("run", "thesis-hold", "--stepper", "rk9"),
            f"known are: {', '.join(steppers())}, auto",
        ),
        (("run", "thesis-hold", "--step", "0.05"), "use at most"),
        (("run", "thesis-hold", "--step", "nan"), "solver.step = 'nan': must be a finite number"),
        (("run", "thesis-hold", "--plot", "p.bmp"), "must end in one of .png, .svg, .pdf"),
        (("run", "thesis-hold", "--json", "no/r.json"), "there is no folder"),
        (("run", "thesis-hold", "--rrd", "/"), "--rrd /: is a folder"),
        (("run", "thesis-hold", "--rrd", "/dev/full"), "--rrd /dev/full: must end in .rrd"),
        (("run", "thesis-hold", "--json", "hold.png"), "--json hold.png: must end in .json"),
        (("run", "thesis-hold", "--set", "effects.rolling_fricton="), "'rolling_friction'"),
        (("run", "thesis-hold", "--set", "duration=1e5"), "every step is kept"),
        (("effects", "viscus_drag"), "no such effect; did you mean 'viscous_drag'?; known are:"),
        (("run",), "Missing argument"),
        (("fly",), "No such command"),
        (("check", "missing.yaml"), "no such scene file"),
        (("check", "."), "scene '.' is not known"),
        (("run", "../.."), "../..: is a folder; give the YAML file of a scene"),
        (("scenes", "thesis-hlod"), "did you mean 'thesis-hold'"),
    ],
)
def test_bad_input_exits_with_2_and_leaves_nothing(
    arguments: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    assert words in refused(*arguments, cwd=tmp_path)


def test_a_picture_is_not_replaced_by_a_recording(tmp_path: Path) -> None:
    picture = tmp_path / "hold.png"
    picture.write_bytes(PNG)
    done = ab_sim("run", "no-ball", "--set", "duration=0.01", "--rrd", "hold.png", cwd=tmp_path)
    assert done.returncode == 2 and "--rrd hold.png: must end in .rrd" in done.stderr
    assert picture.read_bytes() == PNG


def test_a_device_behind_a_good_name_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run.rrd").symlink_to("/dev/full")
    done = ab_sim("run", "no-ball", "--set", "duration=0.01", "--rrd", "run.rrd", cwd=tmp_path)
    assert done.returncode == 2 and "--rrd run.rrd: is a device or a pipe" in done.stderr


def test_times_beyond_the_duration_lengthen_the_run_and_that_is_said() -> None:
    run = ("run", "no-ball", "--set", "duration=0.01", "--json", "-", "--times")
    done = ab_sim(*run, "0.005,0.03")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["duration"] == 0.03
    assert "--times exceed duration = 0.01 s: the run and its metrics cover 0.03" in (
        " ".join(done.stderr.split())
    )
    assert "--times exceed" not in ab_sim(*run, "0.01").stderr


def test_a_whole_start_up_is_gone_on_with_from_its_recording(tmp_path: Path) -> None:
    """README's own line; the start-up ended at its target, which the next one begins at."""
    done = ab_sim("run", "thesis-hold", "--rrd", "run.rrd", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    ended = read_recording(tmp_path / "run.rrd")
    start = ab_sim("state", "run.rrd", cwd=tmp_path).stdout
    done = ab_sim("run", "thesis-hold", "--set", f"start={start}", "--times", "0,1", "--json", "-")
    assert done.returncode == 0, done.stderr
    first, last = json.loads(done.stdout)["samples"]
    angles = [ended[f"ball_{i}_angle"][-1] for i in range(2)]
    assert first["theta"] == pytest.approx(angles, abs=1e-12)
    assert first["psi"] == ended["angle"][-1] and first["omega"] == last["omega"] == 200.0


MOTOR = "rotor_inertia: 2.9e-5, torque_limit: 1.5e-3, proportional_gain: 1.0e-3"


def test_motor_and_accelerometer_are_in_the_json() -> None:
    done = ab_sim(
        "run", "weak-motor", "--set", "sensors.accelerometer={}", "--times", "0.5",
        "--set", "duration=0.5", "--json", "-",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (sample,) = json.loads(done.stdout)["samples"]
    assert 4e-4 < sample["motor_torque"] < 5e-4, "at its limit, less what the speed takes"
    assert [len(reading) for reading in sample["readings"].values()] == [2]
    assert 60.0 < sample["omega"] < 75.0
    assert "commanded: 80 rad/s" in done.stderr and "sensors" in done.stderr


def test_a_deck_in_space_is_run_and_checked(tmp_path: Path) -> None:
    lifted = ("--set", "rotor.height=0.004", "--set", "race.height=0.006", "--set", "duration=0.3")
    sensor = ("--set", "sensors.pickup={position: [0.02, -0.05, 0.01]}")
    done = ab_sim(
        "run", "feeding-deck", *lifted, *sensor, "--times", "0.3", "--json", "r.json", "--plot",
        "p.png", "--rrd", "r.rrd", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "r.json").read_text())
    (sample,) = report["samples"]
    assert len(sample["tilt"]) == len(sample["readings"]["pickup"]) == 3
    recorded = read_recording(tmp_path / "r.rrd")
    assert recorded["z"][-1] == sample["z"] != 0.0
    assert 0 < report["final_tilt"] < report["peak_tilt"] and report["residual_couple"] > 0
    assert report["without_balls"]["final_tilt"] > report["final_tilt"]
    shown = " ".join(done.stdout.split())
    for words in ("final tilt [mrad]", "residual couple", "Tilt: of the shaft", "without balls"):
        assert words in shown
    gravity = ("--set", f"effects.gravity={{tilt: {np.pi / 2}}}")
    checked = ab_sim("check", "feeding-deck", *gravity, *lifted)
    assert checked.returncode == 0, checked.stderr
    for words in ("moves and tilts in space, on 4 mounts", "y = -0.0003", "alpha = 7"):
        assert words in checked.stdout, words


def test_sensors_are_described() -> None:
    done = ab_sim("sensors")
    assert done.returncode == 0, done.stderr
    for words in (
        "F_c, -3 dB frequency of the low-pass filter [Hz]; default 100", "Butterworth", "TDK",
        "only with a deck in space [m]; default 0, 0, 0",
    ):  # fmt: skip
        assert words in done.stdout, words
    checked = ab_sim("check", "on-edge")
    assert "sensor accelerometer" in checked.stdout
    assert "Butterworth" not in ab_sim("effects").stdout, "no effects"


def test_an_accuracy_is_turned_into_a_solver_and_reported() -> None:
    wish = ("--set", "accuracy.whirl=1e-6", "--set", "duration=0.5")
    done = ab_sim("run", "no-ball", *wish, "--json", "-")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    found = report["accuracy"]
    assert found["requested"] == {"whirl": 1e-6} and found["whirl_unit"] == "e"
    assert found["safety_factor"] * found["measured"]["whirl"] <= 1e-6
    assert found["cpu_seconds_per_simulated_second"] > 0
    assert found["reason"].startswith(f"{report['stepper']} at {1e3 * report['step']:g} ms")
    assert "requested 1e-06 e" in done.stderr
    checked = ab_sim("check", "no-ball", *wish)
    assert checked.returncode == 0, checked.stderr
    assert "the cheapest measured to be accurate enough" in checked.stdout
    assert "safety factor 4" in checked.stdout
    refused = ab_sim("check", "no-ball", *wish, "--set", "accuracy.whirl=1e-20")
    assert refused.returncode == 2 and "the best possible" in refused.stderr
    both = ab_sim("run", "no-ball", *wish, "--step", "0.001")
    assert both.returncode == 2 and "the two sections" in both.stderr


def test_steppers_in_the_help_are_the_registered_ones() -> None:
    assert {*STEPPERS} == {AUTO, *steppers()}


def test_check_says_what_would_be_simulated(tmp_path: Path) -> None:
    text = find_scene("thesis-hold").read_text()
    for old, new in (
        ("mass: 1.0e-3,", "mass: [1.0e-3, 2.0e-3],"),
        (
            "arm: 1.0e-6}",
            "arm: 0}\n  - gravity: {tilt: 1.5707963}\nsensors: {left: , right: {sample_rate: 200}}",
        ),
        ("coefficient: 1.0}", f"coefficient: 30.0}}\n  - motor: {{{MOTOR}}}"),
    ):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "mine.yaml").write_text(text)
    done = ab_sim("check", "mine.yaml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for words in (
        "2 of 0.001, 0.002 kg",
        "y = -0.0009807 m",
        "at most 0.0015 N m at standstill",
        "0.00117 N m to accelerate at 40 rad/s^2",
        "1000 samples/s, one every step",
        "one every 5 steps; low-pass 100 Hz; aliases: up to 71 %",
        "rk8 (order 8), auto: rk8 would need steps of at most",
    ):
        assert words in done.stdout, words
    plain = ab_sim("check", "no-ball", "--set", "profile.target_speed=1910 rpm")
    assert "s for the deck's whirl at 200.015 rad/s" in plain.stdout


def test_divergence_exits_with_3(tmp_path: Path) -> None:
    done = ab_sim(
        "run", "thesis-baseline", "--set", "rotor.eccentricity=1", "--set", "race.radius=0.002",
        "--set", "effects.rolling_friction=", "--json", "r.json", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 3
    assert "went beyond all bounds at t = " in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_lists_and_help() -> None:
    listed = ab_sim("scenes").stdout.splitlines()
    assert [line.split()[0] for line in listed] == scene_names(), "a line each"
    described = ab_sim("scenes", "thesis-half-acceleration").stdout
    assert "Both balls start at the unbalance." in described and "Fig. 4.15" in described
    effects = ab_sim("effects").stdout
    for words in ("viscous_drag", "race [N s/m]", "thesis (2-8), (2-11)", "-c v - k u"):
        assert words in effects
    only = ab_sim("effects", "viscous_drag").stdout
    assert "race [N s/m]" in only and "ball_spin" not in only
    assert "is a valid scene" in ab_sim("check", "five-balls-8000-rpm").stdout
    assert __version__ in ab_sim("--version").stdout
    commands = ab_sim("--help").stdout
    for command in ("run", "scenes", "effects", "check", "demo"):
        assert command in commands


def test_what_is_looked_up_only_imports_little() -> None:
    """What a scene is checked with takes a second to import."""
    program = (
        "import sys\n"
        "from ab_sim.cli.app import app\n"
        "from ab_sim.base.errors import SceneError\n"
        "try: app(sys.argv[1:], standalone_mode=False)\n"
        "except SceneError as error: print(error)\n"
        "print([name for name in ('ab_sim.scene', 'llvmlite', 'numpy') if name in sys.modules])\n"
    )
    for arguments, words in ((("scenes",), "weak-motor"), (("check", "no.yaml"), "no such scene")):
        done = subprocess.run(
            [sys.executable, "-c", program, *arguments], capture_output=True, text=True, check=True
        )
        assert words in done.stdout and done.stdout.endswith("\n[]\n")


def test_a_run_imports_no_scipy() -> None:
    """It takes as long to import as all the rest."""
    program = (
        "import sys\n"
        "from ab_sim.cli.app import app\n"
        "app(sys.argv[1:], standalone_mode=False)\n"
        "print([name for name in sys.modules if name.startswith('scipy')])\n"
    )
    arguments = "run", "balanced-start-up", "--json", "-"
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, check=True
    )
    assert done.stdout.endswith("\n[]\n"), done.stdout[-500:]


def test_a_scene_that_is_read_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("rotor: {total_mass: 0.1}\n")
    done = ab_sim("check", "mine.yaml", cwd=tmp_path)
    assert done.returncode == 2
    for key in ("rotor.eccentricity", "balls", "spindle", "duration", "effects"):
        assert key in done.stderr
