"""Faults of sensors, faults that go on, refused ones, and any sequence of them."""

import random
from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import CommandError, InputError
from ab_sim.drive import Drive
from ab_sim.drive.accuracy.live_checks import LiveChecks
from ab_sim.drive.faults.fault import check_faults, faults_of
from ab_sim.scene import load_scene
from tests.drive.fault_session import FaultSession, places, spun

SENSORS = {"pickup": {"noise_density": 0.0, "sample_rate": 100.0, "range": 50.0}}


def test_what_is_heard_of_a_slipping_disc_is_told_from_the_hub(scene: Any) -> None:
    """The hub has turned further than the disc, and where balls are in space does not change."""
    session = FaultSession(scene(), "disc slips 5")
    session.run(1000, 80.0)
    slipped, true, heard = (
        session.commanded.faults.slipped,
        session.drive.present(),
        session.heard(),
    )
    assert slipped > 4.9
    assert heard["angle"] == pytest.approx(true["angle"] + slipped, abs=1e-12)
    before = true["angle"][:, None] + true.ball_angles
    np.testing.assert_allclose(heard["angle"][:, None] + heard.ball_angles, before, atol=1e-12)


def test_however_steps_are_grouped(scene: Any) -> None:
    benches = [FaultSession(scene(), "disc slips 7", "ball_1 sticks") for _ in range(2)]
    for session, groups in zip(benches, ([1] * 333 + [667], [1000]), strict=True):
        session.path.receive(120.0, 0)
        for steps in groups:
            session.run(steps)
    assert np.array_equal(*(places(session.drive.observe()) for session in benches))


def test_sensors_lie_and_the_motion_does_not_know(scene: Any) -> None:
    sound, session = spun(scene(sensors=SENSORS)), spun(scene(sensors=SENSORS))
    session.inject(
        "pickup drifts 200", "pickup saturates 20", "spindle drifts -3", "spindle drops 0.5"
    )
    told = []
    for _ in range(60):
        true, now = sound.run(4), session.run(4)
        assert np.array_equal(true.readings["pickup"], now.readings["pickup"])
        heard, silent = session.commanded.faults.readings(session.drive.present())
        told.append("spindle" in silent)
        since = now.steps - 2500
        assert heard["speed"][0] == pytest.approx(150.0 - 3e-3 * since)
        said = np.array([heard["pickup_1"][0], heard["pickup_2"][0]])
        # Drift is that of the sample, which is held.
        sampled = (now.steps // 10 * 10 - 2500) * 1e-3
        offset = np.clip(true.readings["pickup"] + 200.0 * max(sampled, 0.0), -50.0, 50.0)
        assert said == pytest.approx(np.clip(offset, -20.0, 20.0), abs=2.5e-3)
        assert np.array_equal(heard.position[0], true.position)
        steps = np.array([now.steps - 40, now.steps])
        both = np.array([now.readings["pickup"]] * 2)
        kept, sampled = session.commanded.faults.sampled("pickup", steps, both)
        assert np.array_equal(kept, steps) and np.array_equal(sampled[1], said)
    assert 10 < sum(told) < 50
    session.inject()
    heard, silent = session.commanded.faults.readings(session.drive.present())
    assert not silent
    assert [heard["pickup_1"][0], heard["pickup_2"][0]] == true.readings["pickup"].tolist()


def test_errors_are_those_of_the_drive_as_it_is(scene: Any) -> None:
    """What is done again with half the step is broken in the same way."""
    texts = ["ball_1 sticks", "suspension softens 0.5", "pickup drops", "spindle drifts 1"]
    drive = Drive(scene(sensors=SENSORS), commanded=True, faults=faults_of(texts))
    checks = LiveChecks(drive, 1.0)
    checks.command(150.0)
    checks.advance(1000)
    checks.check(2000)
    assert checks.checked > 0
    assert 0.0 < checks.estimate.angle < 1e-6


def test_the_vibration_of_a_scene_without_sensors(scene: Any) -> None:
    session = spun(scene())
    session.inject("vibration saturates 0.01", "vibration drops")
    session.run(1)
    heard, silent = session.commanded.faults.readings(session.drive.present())
    assert np.abs(heard.acceleration).max() == 0.01
    assert silent == {"vibration"}
    none = session.commanded.faults.sampled("vibration", np.arange(5), np.zeros((5, 2)))
    assert [part.shape for part in none] == [(0,), (0, 2)]


def test_what_goes_on_goes_on(scene: Any) -> None:
    """A second injection leaves alone what is in both; a reset lets faults begin anew."""
    session = spun(scene())
    session.inject("spindle drifts 1", "disc slips 1")
    session.run(1000)
    slipped = session.commanded.faults.slipped
    session.inject("spindle drifts 1", "disc slips 1", "ball_0 sticks")
    assert session.commanded.faults.slipped == slipped == pytest.approx(0.99)
    now = session.drive.observe()
    assert session.heard()["speed"][0] == pytest.approx(now.omega + 1.0)
    session.commanded.reset_time()
    now = session.run(500)
    assert session.heard()["speed"][0] == pytest.approx(now.omega + 1.5)
    session.commanded.reset()
    now = session.drive.observe()
    assert (session.commanded.faults.slipped, now.omega) == (0.0, 0.0)
    assert session.heard()["speed"][0] == 0.0
    session.run(100, 10.0)
    session.commanded.reset_state()
    now = session.drive.observe()
    assert session.heard()["speed"][0] == 0.0
    assert now.theta_rate[0] == 0.0


@pytest.mark.parametrize("name", ["pickup", "vibration"])
def test_a_sensor_sits_turned_as_one_with_another_axis_angle(scene: Any, name: str) -> None:
    fine = {"pickup": {"resolution": 0.0, "axis_angle": 0.2}} if name == "pickup" else {}
    heard = spun(scene(sensors=fine)), spun(scene(sensors=fine))
    heard[1].inject(f"{name} turned 0.5")
    axes = ("pickup_1", "pickup_2") if name == "pickup" else ("ax", "ay")
    true, said = ([session.heard()[axis][0] for axis in axes] for session in heard)
    assert complex(*said) == pytest.approx(complex(*true) * np.exp(-0.5j))
    turned = {"pickup": {**fine.get("pickup", {}), "axis_angle": 0.7}}
    if name == "pickup":
        mounted = spun(scene(sensors=turned)).heard()
        assert said == pytest.approx([mounted[axis][0] for axis in axes], abs=1e-2)


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["ball_2 sticks"], "'ball_2 sticks': 'sticks' goes with ball_0, ball_1 in"),
        (["mount_0 softens 0.5"], "goes with suspension"),
        (["pickup drops"], "'drops' goes with vibration, spindle"),
        (["ball_0 slips 2"], "'slips' goes with disc in"),
        (["ball_0 stick"], "did you mean 'sticks'?"),
        (["ball_0"], "must be an object and its fault, e.g. 'ball_0 sticks'"),
        (["ball_0 sticks 3"], "3: this fault takes no number"),
        (["spindle drops 0.5 1"], "must be an object and its fault"),
        (["disc slips"], "needs a number, rad/s, not 0"),
        (["disc slips nan"], "nan: must be not 0"),
        (["disc slips 0"], "must be not 0"),
        (["suspension softens 1"], "must be between 0 and 1"),
        (["suspension softens x"], "x: must be between 0 and 1"),
        (["spindle saturates -1"], "must be from 0 to 1e9"),
        (["spindle drifts inf"], "inf: must be"),
        (["spindle turned 1"], "'turned' goes with vibration"),
        (["vibration turned 4"], "4: must be not 0, from -pi"),
        (["ball_0 sticks", "ball_0 lost"], "'ball_0 sticks' and 'ball_0 lost' exclude each other"),
        (["disc slips 1", "disc slips 2"], "exclude each other"),
    ],
)
def test_no_such_fault(scene: Any, texts: list[str], said: str) -> None:
    with pytest.raises(InputError) as error:
        check_faults(faults_of(texts), scene())
    assert said in str(error.value)


def test_what_is_not_modelled() -> None:
    for name, text, said in (
        ("everything", "ball_0 sticks", "balls push"),
        ("everything", "disc slips 1", "race is off"),
        ("couple-unbalance", "disc slips 1", "same all around"),
        ("no-ball", "ball_0 lost", "'lost' goes with nothing"),
    ):
        with pytest.raises(InputError, match=said):
            check_faults(faults_of([text]), load_scene(name))
    with pytest.raises(ValueError, match="keeps no energy balance"):
        Drive(load_scene("nsc-case-1"), energy_balance=True, faults=faults_of(["ball_0 sticks"]))


def test_texts_say_what_they_mean() -> None:
    texts = ["ball_0 sticks", "mount_0 softens 0.5", "pickup drops", "disc slips -1e-3"]
    faults = faults_of(["", *texts, " "])
    assert [fault.text for fault in faults] == [*texts[:2], "pickup drops 1", "disc slips -0.001"]
    assert faults_of(fault.text for fault in faults) == faults


FAULTS = (
    "ball_0 sticks", "ball_0 lost", "ball_1 sticks", "ball_1 lost", "suspension softens 0.3",
    "disc slips 9", "disc slips -2", "vibration drops 0.5", "vibration drifts 1e3",
    "vibration saturates 1", "vibration turned 2", "spindle drifts -5", "spindle saturates 30",
    "ball_7 sticks", "junk",
)  # fmt: skip


def play(session: FaultSession, chance: random.Random) -> None:
    """Anything that may happen on a bench."""
    what = chance.choice(["inject", "inject", "clear", "command", "reset", "time", "state"])
    try:
        if what == "inject":
            session.inject(*chance.sample(FAULTS, chance.randint(1, 4)))
        elif what == "clear":
            session.inject()
        elif what == "command":
            session.path.receive(
                chance.choice([0.0, 90.0, 110.0, -300.0, 1e4]), session.drive.steps
            )
        else:
            {
                "reset": session.commanded.reset,
                "time": session.commanded.reset_time,
                "state": session.commanded.reset_state,
            }[what]()
    except (InputError, CommandError):
        pass
    for part in session.commanded.advance(chance.choice([1, 7, 40])):
        assert np.isfinite(part.samples).all()
    heard = session.heard()
    assert np.isfinite(heard.samples).all()
    held = {f.component for f in session.drive.faults if f.verb in ("sticks", "lost")}
    assert all(heard.ball_rates[0, int(name[-1])] == 0.0 for name in held)


@pytest.mark.parametrize(("name", "sequences"), [("", 250), ("thesis-hold", 12)])
def test_whatever_happens(scene: Any, name: str, sequences: int) -> None:
    made = load_scene(name) if name else scene()
    for seed in range(sequences):
        chance = random.Random(seed)
        session = FaultSession(made)
        for _ in range(4):
            play(session, chance)
