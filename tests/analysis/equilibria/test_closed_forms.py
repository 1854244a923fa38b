"""Closed forms against the running kernel's equations, and against the numerical finder."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from ab_sim.analysis.equilibria.at_speed import equilibria_of, resting_states
from ab_sim.analysis.equilibria.balanced import positions
from ab_sim.analysis.equilibria.finder import found_states
from ab_sim.analysis.equilibria.patterns import patterns_of, phase, radii
from ab_sim.analysis.equilibria.resting import field_at, resting_system, rotor_of, state_of
from ab_sim.analysis.equilibria.sticking import sticking
from ab_sim.base.errors import SceneError
from ab_sim.model.dynamics.system import RACE_RADIUS
from ab_sim.model.equations.effects import (
    BallSpin,
    RaceRunout,
    RollingFriction,
    SpindleAcceleration,
    ViscousDrag,
)
from tests.analysis.equilibria.drives import altered, base, drive

SETS = 4000


class Stranger(NamedTuple):
    """An effect with a method that no closed form has heard of, beside one that it has."""

    strength: float = 1.0

    def ball_drag(self, ball: Any) -> float:
        return self.strength

    def newly_invented(self, c: Any, s: Any) -> Any:
        return self.strength * s


def test_closed_forms_are_for_effects_that_they_know() -> None:
    """With any other, states are looked for by numbers: a closed form would be wrong, silently."""
    system = base()
    for known in (ViscousDrag(1.0), BallSpin(), SpindleAcceleration(), RollingFriction(1e-6)):
        assert rotor_of(system._replace(effects=(*system.effects, known))) is not None
    for unknown in (Stranger(), RaceRunout(lobe=1e-5)):
        assert rotor_of(system._replace(effects=(*system.effects, unknown))) is None


def test_where_friction_holds_balls_is_refused_by_what_moves_them() -> None:
    """The error names the effect that stands in the way, and none that does not."""
    scene = drive(
        effects={
            "rolling_friction": {"arm": 1e-6},
            "ball_contact": {"restitution_coefficient": 0.5},
        }
    )
    state = equilibria_of(scene, 200.0).branches[0]
    assert len(sticking(scene, 200.0, state)) == 2
    other = scene.model_copy(update={"effects": {**scene.effects, "mine": Stranger()}})
    with pytest.raises(SceneError, match=r"^effects\.mine: .*friction holds"):
        sticking(other, 200.0, state)


def test_they_satisfy_the_equations() -> None:
    """To 1e-12 of the largest single term: forces per mass on the deck, and on a ball per m R.

    At 4000 drives at random, one pattern each, up to ten times the critical speed and either
    way round; 40 of them balanced as well.
    """
    draw, first = np.random.default_rng(12), base()
    states = worst = 0.0
    several = 0
    for k in range(SETS):
        system = altered(first, draw)
        rotor = rotor_of(system)
        assert rotor is not None
        natural = (rotor.stiffness / rotor.mass) ** 0.5
        speed = float(natural * 10.0 ** draw.uniform(-1, 1) * draw.choice([-1.0, 1.0]))
        field = field_at(system, speed)
        patterns = patterns_of(rotor)
        pattern = patterns[int(draw.integers(len(patterns)))]
        found = []
        for W in radii(rotor, pattern.moment, speed):
            phi = phase(rotor, pattern.moment, speed, W)
            theta = phi + np.pi * (np.array(pattern.signs) < 0)
            found.append((W * np.array([np.cos(phi), np.sin(phi)]), theta))
        several += len(found) > 2
        if k % 100 == 0:
            found += [(np.zeros(2), theta) for theta in positions(rotor)]
        pull = speed**2 * (rotor.unbalance + sum(rotor.moments)) / rotor.mass
        for u, theta in found:
            W = float(np.hypot(*u))
            terms = [pull, speed**2 * W, rotor.stiffness * W / rotor.mass]
            terms += [rotor.damping * abs(speed) * W / rotor.mass]
            terms += [rotor.cubic_stiffness * W**3 / rotor.mass]
            scale = max(terms)
            slope = field.slope(0.0, state_of(system, speed, u, theta))
            length = system.balls[0, RACE_RADIUS]
            errors = [abs(slope[:2]).max() / abs(speed), abs(slope[2:4]).max()]
            errors += [abs(slope[4 + len(theta) :]).max() * length]
            states += 1
            worst = max(worst, errors[0] * speed**2 / scale, errors[1] / scale, errors[2] / scale)
    assert states > SETS
    assert several > 20, "patterns with more than two radii were among them"
    assert worst < 1e-12


@pytest.mark.parametrize(
    ("given", "speed"),
    [
        ({}, 70.0),
        ({}, -150.0),
        ({"m": (9e-4, 6e-4)}, 130.0),
        ({"m": (4e-4,) * 3}, 60.0),
        ({"k3": 2e8}, 130.0),
    ],
)
def test_the_numerical_finder_finds_them_all(given: dict, speed: float) -> None:
    system = resting_system(drive(**given))
    rotor = rotor_of(system)
    assert rotor is not None
    by_label = {state.label: state for state in found_states(system, speed)}
    expected = resting_states(system, rotor, speed)
    assert sorted(by_label) == sorted(state.label for state in expected)
    for state in expected:
        found = by_label[state.label]
        assert found.W == pytest.approx(state.W, rel=1e-10)
        assert found.structural_zeros == state.structural_zeros
        assert found.assignments == state.assignments
        if state.structural_zeros:
            # The same positions, and some at random beside them.
            assert found.lambda_max == pytest.approx(state.lambda_max, rel=0.02)
        else:
            assert found.lambda_max == pytest.approx(state.lambda_max, rel=1e-8, abs=1e-10)


def test_negative_radii_are_the_other_patterns() -> None:
    """Of the paper's eight for three balls: r12 = -r21 and so on; four states are left."""
    rotor = rotor_of(resting_system(drive(m=(2e-4,) * 3)))
    assert rotor is not None
    labels = [p.label for p in patterns_of(rotor) for _ in radii(rotor, p.moment, 70.0)]
    assert labels == ["3+0", "2+1", "1+2", "0+3"]
