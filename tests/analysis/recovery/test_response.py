"""Recovery from a change of speed: the report's definitions, on runs and on paths made for them."""

import math

import numpy as np
import pytest

from ab_sim.analysis.equilibria import equilibria_of
from ab_sim.analysis.equilibria.balanced import completed
from ab_sim.analysis.equilibria.resting import resting_system, rotor_of
from ab_sim.analysis.recovery import nearest_state, recover, settled_at
from ab_sim.base.errors import InputError, SceneError
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import load_scene


def test_settled_at_is_found_between_samples() -> None:
    """W = 5e-6 + 1e-5 exp(-3 t), turning: within 1e-9 of 5e-6 from ln(1e4) / 3 on."""
    time = np.linspace(0.0, 6.0, 1201)
    turn, fall = np.exp(0.7j * time), 1e-5 * np.exp(-3.0 * time)
    place = (5e-6 + fall) * turn
    rate = (0.7j * (5e-6 + fall) - 3.0 * fall) * turn
    columns = (time, place.real, place.imag, rate.real, rate.imag)
    run = Trajectory(("time", "x", "y", "vx", "vy"), np.stack(columns, axis=1))
    assert settled_at(run, 5e-6, 1e-9) == pytest.approx(math.log(1e4) / 3.0, abs=1e-6)
    assert settled_at(run, 5e-6, 1.1e-5) == 0.0, "never outside"
    assert settled_at(run, 1e-6, 1e-9) == 6.0, "never within"


def test_shorter_steps_change_nothing() -> None:
    coarse, fine = (
        recover(load_scene("nsc-case-3", [f"solver.step={step}"])) for step in (1e-3, 2.5e-4)
    )
    assert coarse.settling_time == pytest.approx(fine.settling_time, abs=1e-6)
    assert coarse.maximum_amplitude == pytest.approx(fine.maximum_amplitude, rel=1e-9)
    assert coarse.peak_time == pytest.approx(fine.peak_time, abs=1e-6)


def test_the_other_way_round_is_the_same() -> None:
    one = recover(load_scene("nsc-case-1"))
    other = recover(load_scene("nsc-case-1", ["start.speed=-1000", "profile.to_speed=-900"]))
    assert other.settling_time == pytest.approx(one.settling_time, abs=1e-8)
    assert other.maximum_amplitude == pytest.approx(one.maximum_amplitude, rel=1e-11)
    assert other.lambda_max == pytest.approx(one.lambda_max, rel=1e-9)


def test_a_wider_band_is_reached_earlier() -> None:
    scene = load_scene("nsc-case-3")
    strict, wide = recover(scene), recover(scene, band=5e-8)
    assert strict.settling_time and wide.settling_time and strict.lambda_max
    assert wide.peak_time == strict.peak_time
    # The tail falls with lambda_Rmax: by a factor of 50 in ln(50) / 0.7603 s, and what falls
    # faster is still there at the wider band.
    late = math.log(50.0) / -strict.lambda_max
    assert strict.settling_time - wide.settling_time == pytest.approx(late, rel=0.02)


def test_no_change_needs_no_time() -> None:
    found = recover(load_scene("nsc-case-1", ["profile.to_speed=1000"]))
    assert found.settling_time == 0.0
    assert found.maximum_amplitude == pytest.approx(found.steady_whirl, rel=1e-9)


def test_where_no_state_is_stable_it_never_settles() -> None:
    """Case 3 between the fold of its clustered state and the speed where balance holds."""
    found = recover(load_scene("nsc-case-3", ["profile.to_speed=180", "duration=11"]))
    assert found.settling_time is None and found.settled_at is None
    assert found.label is None and found.lambda_max is None and found.verdict is None
    assert found.duration == pytest.approx(88.0), "it was waited for"


def test_balls_apart_settle_later_than_together_where_lambda_is_0() -> None:
    """Case 2: lambda_Rmax = 0 decides nothing."""
    apart = ["start.ball_angles=[3.0, 3.3]", "duration=25"]
    assert recover(load_scene("nsc-case-2")).settling_time == pytest.approx(2.45301, abs=1e-5)
    found = recover(load_scene("nsc-case-2", apart))
    assert found.settling_time is None and not found.rested_before
    assert 1e-9 < found.steady_whirl < 1e-7, "the last whirl"


def test_of_a_continuum_it_is_the_state_where_the_balls_are() -> None:
    """Three balls that can balance do so at many positions, each with a lambda_Rmax of its own."""
    scene = load_scene("nsc-case-3", ["balls.count=3", "start.ball_angles="])
    states = equilibria_of(scene, 900.0)
    rotor = rotor_of(resting_system(scene))
    assert rotor is not None
    found = []
    for last in (2.9, 2.0):
        theta = completed(rotor, np.array([last]))
        assert theta is not None
        state = nearest_state(scene, states, np.array([1e-10, 0.0]), theta, 1e-9)
        assert state is not None and state.label == "balanced" and state.structural_zeros == 1
        assert state.stable and np.abs(state.eigenvalues).min() < 1e-6
        found.append(state.lambda_max)
    assert found[0] != pytest.approx(found[1], rel=1e-2)
    assert nearest_state(scene, states, np.array([2e-9, 0.0]), theta, 1e-9) is None


def test_an_unstable_state_is_none_to_settle_at() -> None:
    scene = load_scene("nsc-case-1")
    states = equilibria_of(scene, 900.0)
    found = {
        state.label: nearest_state(scene, states, state.u, state.theta, 1e-9)
        for state in states.branches
    }
    assert {label for label, state in found.items() if state is not None} == {"2+0"}


@pytest.mark.parametrize(
    ("scene", "changes", "words"),
    [
        ("thesis-hold", (), "profile.kind = start_up: thesis-hold"),
        ("nsc-case-1", ("profile=",), "profile.kind = none"),
        ("nsc-case-1", ("duration=10.11",), "is over, at 10.11 s"),
        ("nsc-case-1", ("effects.unequal_suspension.stiffness_2=9000",), "unequal_suspension"),
    ],
)
def test_scenes_that_cannot_recover(scene: str, changes: tuple[str, ...], words: str) -> None:
    with pytest.raises(SceneError, match=words.replace(".", r"\.")):
        recover(load_scene(scene, changes))


def test_a_run_too_long_to_keep_is_refused_before_it_starts() -> None:
    with pytest.raises(InputError, match=r"duration = 1e\+06 s: .*at most .* 0\.0005 s"):
        recover(load_scene("nsc-case-1", ["duration=1e6"]))
