"""A deck model of a stranger's own: written here, in one file, without a change to the package.

It is the deck in the plane once more, on axes that do not turn: another state, other equations of
the deck, the same drive. Balls, friction, events, steppers and recording know nothing of it.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import yaml
from jsonschema import Draft202012Validator
from typer.testing import CliRunner

import ab_sim
from ab_sim.base.errors import SceneError
from ab_sim.base.sample_columns import ANGLE
from ab_sim.base.yaml_files import read_scene_file
from ab_sim.cli.app import app
from ab_sim.drive.disc import with_disc
from ab_sim.drive.faults.fault import faults_of
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.dynamics.registry import (
    IN_SPACE,
    PLANAR,
    DeckFromScene,
    register_deck_model,
)
from ab_sim.model.dynamics.system import System
from ab_sim.model.equations.arrowhead import Arrow
from ab_sim.model.equations.deck_model import deck_model
from ab_sim.model.equations.motion import (
    BallConstants,
    DeckMotion,
    OnRace,
    SpindleMotion,
    drag_force,
    relative_load,
)
from ab_sim.model.equations.sums import Number, over_balls, over_effects
from ab_sim.scene import Scene, check_scene, find_scene
from ab_sim.scene.keys import scene_keys
from ab_sim.scene.schema import scene_schema
from tests.c_code.compiled import InC, needs_compiler

NAME, SCENE = "on_fixed_axes", "five-balls-8000-rpm"


@deck_model(
    UNKNOWNS=2,
    STATE_NAMES=("x", "y", "x rate", "y rate"),
    NEEDS_ANGLE=True,
    AXES=2,
    CHANNELS=("x", "y", "vx", "vy", "ax", "ay"),
)
class OnFixedAxes(NamedTuple):
    """M [kg], M0 e [kg m], and e [m]; state: place and velocity on fixed axes."""

    total_mass: Number
    unbalance: Number
    eccentricity: Number

    def arrow(
        self,
        effects: Any,
        balls: BallConstants,
        on: OnRace,
        spindle: SpindleMotion,
        state: Sequence[Number],
    ) -> Arrow:
        n, m, w, M = balls.number, balls.mass, spindle.speed, self.total_mass
        nx, ny = on.c * spindle.cos - on.s * spindle.sin, on.s * spindle.cos + on.c * spindle.sin
        load, along = relative_load(effects, balls, on, w)
        fx, fy = over_effects(effects, "deck_force", (0.0, 0.0), DeckMotion(*state))
        ux, uy = self.unbalance * spindle.cos, self.unbalance * spindle.sin
        turning = -uy - over_balls(n, on.mh * ny), ux + over_balls(n, on.mh * nx)
        return Arrow(
            block=[[M, 0.0, turning[0]], [0.0, M, turning[1]], [0.0, 0.0, 0.0]],
            force=[
                fx + ux * w * w + over_balls(n, load * nx),
                fy + uy * w * w + over_balls(n, load * ny),
                0.0,
            ],
            coupling=[m * ny, -(m * nx), -on.lever],
            normal_coupling=[-(m * nx), -(m * ny), 0.0],
            load=load,
            path_force=along + drag_force(effects, balls, on),
        )

    def rates(
        self, effects: Any, spindle: SpindleMotion, state: Sequence[Number], x: Sequence[Number]
    ) -> list[Number]:
        return [state[2], state[3], x[0], x[1]]

    def channels(
        self, effects: Any, spindle: SpindleMotion, state: Sequence[Number], x: Sequence[Number]
    ) -> list[Number]:
        return [*state, x[0], x[1]]

    def jump(self, state: Sequence[Number], jumps: Sequence[Number]) -> list[Number]:
        return [0.0, 0.0, jumps[0], jumps[1]]

    def at_rest(self, states: np.ndarray) -> np.ndarray:
        return np.array([[*states[:2], 0.0, 0.0, 0.0, 0.0]])

    def energy(
        self, effects: Any, balls: BallConstants, state: np.ndarray, psi: float, speed: float
    ) -> float:
        return 0.0  # nobody asks for a balance here


def make(scene: Scene, effects: tuple[object, ...]) -> OnFixedAxes:
    planar = system_of(scene.model_copy(update={"deck_model": None})).deck_model
    return OnFixedAxes(planar.total_mass, planar.unbalance, planar.eccentricity)


def start(scene: Scene, system: System) -> np.ndarray:
    deck = scene.start.deck
    return np.array([*(deck.position or (0.0, 0.0)), *(deck.velocity or (0.0, 0.0))])


def yields(system: System) -> list[np.ndarray]:
    return [np.full((len(system.balls),) * 2, 1.0 / system.deck_model.total_mass)]


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    """Known while a test runs."""
    with ab_sim.temporary_registrations():
        register_deck_model(NAME, OnFixedAxes, DeckFromScene(make, start, yields))
        yield


def test_the_same_drive_on_axes_that_do_not_turn() -> None:
    """Five balls with friction and contact, from the start: the same motion, the same events."""
    changes = ["duration=0.5"]
    scene = ab_sim.load_scene(SCENE, [*changes, f"deck_model={NAME}"])
    expected, drive = ab_sim.Drive(ab_sim.load_scene(SCENE, changes)), ab_sim.Drive(scene)
    assert type(drive.system.deck_model) is OnFixedAxes
    steps = round(0.5 / scene.solver.step)
    run, own = expected.advance(steps), drive.advance(steps)
    assert drive.events == expected.events >= 3
    # Truncation differs with the axes; rk8 leaves next to none of it.
    np.testing.assert_allclose(own.ball_angles, run.ball_angles, rtol=0, atol=1e-9)
    np.testing.assert_allclose(own.position, run.position, rtol=0, atol=1e-13)
    np.testing.assert_allclose(own.acceleration, run.acceleration, rtol=0, atol=1e-8)


def test_it_is_judged_and_kept_like_any_other() -> None:
    changes = ["duration=0.2", "start.deck.position=[1e-5, 0]", "start.deck.velocity=[0, 1e-3]"]
    expected = ab_sim.simulate(ab_sim.load_scene(SCENE, changes))
    run = ab_sim.simulate(ab_sim.load_scene(SCENE, [*changes, f"deck_model={NAME}"]))
    assert run.metrics.peak_whirl == pytest.approx(expected.metrics.peak_whirl, rel=1e-9)
    assert run.metrics.final_ball_angles == pytest.approx(expected.metrics.final_ball_angles)
    kept = run.scene.as_mapping()
    assert kept["deck_model"] == NAME and "deck_model" not in expected.scene.as_mapping()
    assert check_scene(kept, "a recording") == run.scene


def test_keys_schema_and_check_know_it(tmp_path: Path) -> None:
    (row,) = scene_keys("deck_model")
    assert row.range == f"{IN_SPACE}, {NAME} or {PLANAR}" and row.default == "-"
    file = tmp_path / "own.yaml"
    raw = read_scene_file(find_scene(SCENE)) | {"deck_model": NAME}
    file.write_text(yaml.safe_dump(raw))
    assert not list(Draft202012Validator(scene_schema()).iter_errors(raw))
    said = CliRunner().invoke(app, ["check", str(file)])
    assert said.exit_code == 0 and re.search(rf"deck model +. {NAME}", said.stdout), said.output


def test_what_it_does_not_say_is_refused_where_it_is_asked_for() -> None:
    scene = ab_sim.load_scene(SCENE, [f"deck_model={NAME}"])
    with pytest.raises(SceneError, match="deck_model: OnFixedAxes .* free motion"):
        ab_sim.modes(scene)


@needs_compiler
def test_it_is_written_as_c() -> None:
    smooth = ["effects.rolling_friction=", f"deck_model={NAME}"]
    scene = ab_sim.load_scene(SCENE, smooth)
    in_c, drive = InC(scene), ab_sim.Drive(scene)
    assert np.array_equal(in_c.rows(200), drive.advance(200).samples[:, ANGLE:])


def refused_for(asked: str) -> str:
    return re.escape(f"deck_model = {NAME!r}: {asked} needs the equations")


@pytest.mark.parametrize(
    ("asked", "call"),
    [
        ("the search for resting states", lambda scene: ab_sim.equilibria(scene, 800.0)),
        ("the search for resting states", lambda scene: ab_sim.branches(scene)),
        ("Floquet analysis", lambda scene: ab_sim.floquet(scene, 800.0)),
    ],
)
def test_formulas_of_the_built_in_decks_are_not_used(
    asked: str, call: Callable[[Scene], object]
) -> None:
    """They would be of another deck than the one that runs."""
    with pytest.raises(SceneError, match=refused_for(asked)):
        call(ab_sim.load_scene(SCENE, [f"deck_model={NAME}"]))


@pytest.mark.parametrize("text", ["ball_0 sticks", "ball_1 lost", "disc slips 0.1"])
def test_faults_that_know_the_built_in_decks_are_refused(text: str) -> None:
    scene = ab_sim.load_scene(SCENE, [f"deck_model={NAME}"])
    with pytest.raises(SceneError, match=refused_for(f"faults: {text!r}")):
        ab_sim.Drive(scene, faults=faults_of([text]))
    with pytest.raises(SceneError, match=refused_for("another disc with disc_angle = 1 rad")):
        with_disc(scene, 1e-4, 1.0)


def test_faults_that_do_not_are_as_on_a_deck_of_the_package() -> None:
    faults = faults_of(["suspension softens 0.5", "vibration drops 0.5"])
    expected, own = (
        ab_sim.Drive(ab_sim.load_scene(SCENE, deck), faults=faults).advance(200)
        for deck in ([], [f"deck_model={NAME}"])
    )
    np.testing.assert_allclose(own.position, expected.position, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    ("scene", "name", "words"),
    [
        (SCENE, "planr", "no such deck model; "),
        (SCENE, IN_SPACE, "moves in space"),
        ("couple-unbalance", PLANAR, "moves in the plane"),
        ("couple-unbalance", NAME, "moves in the plane"),
    ],
)
def test_a_name_that_does_not_fit_is_refused(scene: str, name: str, words: str) -> None:
    with pytest.raises(SceneError, match=re.escape(f": deck_model = {name!r}: {words}")):
        ab_sim.load_scene(scene, [f"deck_model={name}"])


@pytest.mark.parametrize(("scene", "name"), [(SCENE, PLANAR), ("couple-unbalance", IN_SPACE)])
def test_the_usual_ones_have_names_too(scene: str, name: str) -> None:
    named = ab_sim.Drive(ab_sim.load_scene(scene, [f"deck_model={name}"])).advance(50)
    unnamed = ab_sim.Drive(ab_sim.load_scene(scene)).advance(50)
    assert named.samples.tobytes() == unnamed.samples.tobytes()


def test_a_name_and_a_class_are_there_once() -> None:
    for name, kind in ((NAME, tuple), ("other", OnFixedAxes)):
        with pytest.raises(ValueError, match="registered twice|class is already registered"):
            register_deck_model(name, kind, DeckFromScene(make, start, yields))
