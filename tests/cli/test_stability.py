"""`ab-sim stability` as a user runs it."""

import contextlib
import json
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from ab_sim.analysis.maps.verdicts import CLUSTERED, EVERYWHERE, NOTHING
from tests.cli.test_interruption import ENDS, Program
from tests.cli.tool import PNG, ab_sim, refused
from tests.waiting import until

SMALL = "speed=150:250:9,effects.suspension.damping=1:60:5"


def test_a_map_against_another_number_of_balls(tmp_path: Path) -> None:
    done = ab_sim(
        "stability", "nsc-case-3", "--map", SMALL, "--coarse", "4", "--against", "3",
        "--json", "m.json", "--plot", "m.png", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "m.json").read_text())
    labels = np.array(report["labels"])
    assert labels.shape == (5, 9) and {*labels.ravel()} == {EVERYWHERE, CLUSTERED, NOTHING}
    assert report["points"] == 45 and report["computed"] < 45 and report["coarse"] == 4
    assert report["across"]["key"] == "speed" and report["across"]["values"][-1] == 250.0
    for kind in report["kinds"]:
        assert kind["share"] == pytest.approx((labels == kind["label"]).mean())
    assert report["against"]["balls"] == [2, 3]
    assert np.array(report["circulation"]["labels"]).shape == (5, 9)
    assert len(report["against"]["other"]["labels"]) == 5
    for words in (
        "nsc-case-3, 2 balls: 9 by 5 points", "nothing stable", "at every position", "only for 3",
        "islands of fewer than 4 by 4 points may have been missed",
        "all balls can circulate together on",
    ):  # fmt: skip
        assert words in done.stdout, words
    assert (tmp_path / "m.png").read_bytes().startswith(PNG)


def test_borders_for_several_drags(tmp_path: Path) -> None:
    done = ab_sim(
        "stability", "nsc-case-3", "--map", SMALL, "--coarse", "4",
        "--each", "effects.viscous_drag.coefficient=0.01,0.2", "--json", "-", "--plot", "f.png",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["values"] == [0.01, 0.2]
    assert "at every position" in done.stderr
    assert (tmp_path / "f.png").read_bytes().startswith(PNG)


def test_a_basin(tmp_path: Path) -> None:
    done = ab_sim(
        "stability", "thesis-hold", "--set", "effects.rolling_friction=", "--basin", "3",
        "--set", "balanced.residual_unbalance=2", "--json", "-", "--plot", "b.png", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert np.degrees(report["angles"]) == pytest.approx([-180.0, -60.0, 60.0])
    labels = np.array(report["labels"])
    assert (np.diag(labels) == -1).all() and (labels == labels.T).all()
    assert report["residual_unbalance"][0][0] is None and report["limit"] == 2.0
    assert "3 starts left out: equal balls that never part" in " ".join(done.stderr.split())
    assert (tmp_path / "b.png").read_bytes().startswith(PNG)


def test_without_a_map_it_says_what_rests() -> None:
    done = ab_sim("stability", "nsc-case-3", "--speed", "900", "--json", "-")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    stable = [branch["label"] for branch in report["branches"] if branch["stable"]]
    assert stable == ["balanced"] and report["over_speed"]["without_stable_state"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--map", "speed=nan:2,balls.mass=1e-4:2e-4"), "must be finite numbers"),
        (("--map", "speed=1:2,balls.masss=1e-4:2e-4"), "did you mean 'mass'?"),
        (("--map", SMALL, "--coarse", "3"), "--coarse 3: must be a power of two"),
        (("--map", SMALL, "--basin", "3"), "--map and --basin: give one of them"),
        (("--map", SMALL, "--plot", "m.txt"), "must end in one of .png"),
        (("--basin", "4", "--set", "balls.count=0", "--set", "start.ball_angles="), "at least 2"),
    ],
)
def test_bad_input_exits_with_2_and_leaves_nothing(
    arguments: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    assert words in refused("stability", "nsc-case-3", *arguments, cwd=tmp_path)


def children_of(parent: int) -> list[int]:
    """Processes that a process has started and that are still there."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it may have ended meanwhile
            number, _, rest = stat.read_text().partition(" (")
            state, above = rest.rpartition(") ")[2].split()[:2]
            if int(above) == parent and state != "Z":
                found.append(int(number))
    return found


LONG = {
    "map": ("--map", "speed=60:500:1000,effects.suspension.damping=1:121:1001", "--coarse", "1"),
    "basin": ("--basin", "200"),
}


@pytest.mark.parametrize(
    ("work", "number"),
    [("map", signal.SIGINT), ("basin", signal.SIGHUP)],
)
def test_signals_on_a_terminal_end_all_processes_and_keep_what_is_done(
    work: str, number: int
) -> None:
    """As soon as the first worker is there, while it imports, of a drag that no run has kept."""
    drag = 0.2 + 1e-9 * (time.time_ns() % 10**6)
    program = Program(
        "ab_sim", "stability", "nsc-case-3", "--set", f"effects.viscous_drag.coefficient={drag!r}",
        *LONG[work],
    )  # fmt: skip
    give_up = time.monotonic() + ENDS
    while len(started := children_of(program.process.pid)) < 2:  # one watches their resources
        assert program.process.poll() is None, program.process.communicate()
        assert time.monotonic() < give_up, "it shares no work"
        time.sleep(0.01)
    code, said = program.interrupted(number, its_children=True)
    assert code == 130
    *progress, last = said.strip().splitlines()
    assert last == "ab-sim: interrupted; finished work is kept, the same command continues it"
    assert all(line.startswith("nsc-case-3: ") for line in progress), said
    until(
        lambda: not any(Path(f"/proc/{number}").exists() for number in started),
        "no process outlives the command",
        ENDS,
    )
