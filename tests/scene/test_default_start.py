"""Start angles of a scene that gives none, and warnings of balls that never part."""

import math
from pathlib import Path

import numpy as np
import pytest

import ab_sim
from ab_sim.drive.overlap import together_at_start
from ab_sim.model.equations.neighbours import never_part, start_angles
from ab_sim.scene import load_scene, scene_names
from tests.cli import tool

DEFAULT = ["start.ball_angles="]
TOGETHER = ["start.ball_angles=[0.0, 6.283185307179586]"]
WARNING = "qual balls that start at one angle never part, and act as one ball: balls 0, 1"


@pytest.mark.parametrize("count", [1, 2, 3, 7, 64])
def test_balls_start_apart(count: int) -> None:
    scene = load_scene("balanced-start-up", [*DEFAULT, f"balls.count={count}", "balls.mass=1e-5"])
    angles = np.array(start_angles(scene))
    assert angles[0] == 0.0 and (np.abs(angles) <= math.pi).all()
    row = np.sort(angles)
    gaps = np.diff(row, append=row[0] + 2 * math.pi)
    assert gaps.min() > 0.38 * 2 * math.pi / count
    assert never_part(scene) == [] and together_at_start(scene) == ""
    assert angles.tolist() == list(start_angles(scene))


def test_without_a_start_a_good_design_balances() -> None:
    """At one angle, the former default, the same drive ends at 1.5 times the limit."""
    apart, together = (
        ab_sim.simulate(load_scene("balanced-start-up", changes)).metrics
        for changes in (DEFAULT, TOGETHER)
    )
    assert apart.verdict == "balanced"
    assert together.verdict == "not balanced" and together["residual_unbalance"] > 0.1


def test_scenes_of_the_package_say_where_their_balls_start() -> None:
    """But for those whose balls touch, or have none: their numbers do not depend on a default."""
    left_out = {
        name for name in scene_names() if load_scene(name).start.ball_angles is None
    }  # fmt: skip
    assert left_out == {"no-ball", "on-edge", "packed-balls"}


def ab(*words: str, cwd: Path) -> str:
    """What a command says; a tuning of runs as short as these finds nothing, and says that too."""
    done = tool.ab_sim(*words, cwd=cwd)
    assert done.returncode in (0, 1), done.stderr
    return " ".join((done.stdout + done.stderr).replace("│", " ").split())


@pytest.mark.parametrize(
    "words",
    [
        ("check",),
        ("run",),
        ("sweep", "--over", "balls.mass=5e-4,6e-4"),
        ("tune", "--vary", "balls.mass=5e-4..6e-4", "--minimise", "final_whirl_over_e",
         "--runs", "16"),
        ("robust", "--spread", "balls.mass=1%", "--runs", "4"),
    ],
    ids=lambda words: words[0],
)  # fmt: skip
def test_commands_warn_of_balls_that_never_part(words: tuple[str, ...], tmp_path: Path) -> None:
    command, *options = words
    short = ("--set", "duration=0.2")
    said = ab(command, "balanced-start-up", *short, "--set", *TOGETHER, *options, cwd=tmp_path)
    assert WARNING in said, said


def test_balls_that_part_are_not_warned_of(tmp_path: Path) -> None:
    assert WARNING not in ab("check", "balanced-start-up", "--set", *DEFAULT, cwd=tmp_path)


def test_balls_that_differ_may_start_together() -> None:
    scene = load_scene("balanced-start-up", [*TOGETHER, "balls.mass=[5e-4, 6e-4]"])
    assert never_part(scene) == []
    assert never_part(load_scene("balanced-start-up", TOGETHER)) == [(0, 1)]
