"""Reference values of contact and friction, by an independent event-driven simulation.

Source: ``contact_oracle.json``, from the project's ``shared/oracle/contact.json`` (EQUATIONS.md
section 5) what is compared here: an inertial-frame model with a dense mass matrix that finds its
branches by enumerating the complementarity problem. Three cases: E2, collisions with friction
through the resonance; U, an unloaded ball that leans on one that friction holds; A3, five balls in
a packed row under commands, a thousand events.

Frames: x, y, vx, vy inertial; theta from the unbalance, unwrapped; theta_rate relative to the race.
Tolerance: as in ``test_oracle``, 1e-8 rad, 1e-8 of the deck's largest distance, and 1e-6 rad/s, of
which the source's own uncertainty is a tenth at most; the scene's own step, no step with unresolved
events, and who sticks exactly. E2's kernel gets a gravity of zero, so that it is U's.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from ab_sim.drive import Drive
from ab_sim.scene import check_scene
from tests.conftest import merge
from tests.overlap import assert_apart

CASES = json.loads(Path(__file__).with_name("contact_oracle.json").read_text())["cases"]
TOLERANCE = 1e-8
RATE_TOLERANCE = 1e-6


def drive_of(name: str) -> Drive:
    raw = yaml.safe_load(CASES[name]["scene"])
    effects: dict[str, Any] = {}
    for effect in raw["effects"]:
        effects |= effect if isinstance(effect, dict) else {effect: {}}
    raw["effects"] = merge({"gravity": {"tilt": 0.0}} if name == "E2" else {}, effects)
    return Drive(check_scene(raw, name), commanded="profile" not in raw)


@pytest.mark.parametrize("name", CASES)
def test_motion(name: str) -> None:
    case = CASES[name]
    drive = drive_of(name)
    commands = list(case["commands"])
    far = max(np.hypot(want["x"], want["y"]) for want in case["expected"])

    def go_to(time: float) -> None:
        """To the end of the last step before a time."""
        assert_apart(drive, drive.advance(int(time / drive.step + 1e-9) - drive.steps))

    for time, want, doubt in zip(case["times"], case["expected"], case["uncertainty"], strict=True):
        while commands and commands[0][0] < time:
            begin, speed = commands.pop(0)
            go_to(begin)
            drive.command(speed)
        go_to(time)
        now = drive.observe_at(time)
        assert max(doubt["theta"], doubt["r"] / far) < TOLERANCE / 10, "good enough to compare with"
        assert doubt["theta_rate"] < RATE_TOLERANCE / 10, "good enough to compare with"
        np.testing.assert_allclose(
            now.theta, want["theta"], rtol=0.0, atol=TOLERANCE, err_msg=f"theta at {time}"
        )
        deck = np.hypot(*(now.position - [want["x"], want["y"]]))
        assert deck <= TOLERANCE * far, time
        np.testing.assert_allclose(
            now.theta_rate, want["theta_rate"], rtol=0.0, atol=RATE_TOLERANCE, err_msg=f"at {time}"
        )
        assert now.stuck.tolist() == want["stuck"], time
        assert now.psi == pytest.approx(want["psi"], rel=1e-12)
        assert now.omega == pytest.approx(want["omega"], rel=1e-12)
    assert drive.steps_with_unresolved_events == 0
