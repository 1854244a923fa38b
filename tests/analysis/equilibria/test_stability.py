"""Eigenvalues and verdicts against an independent formulation and against simulation."""

import math
from typing import Any

import numpy as np
import pytest

from ab_sim.analysis.equilibria import equilibria_of, settles, sticking
from ab_sim.analysis.equilibria import states as states_module
from ab_sim.analysis.equilibria.resting import field_at, resting_system, state_of
from ab_sim.drive import Drive
from ab_sim.scene import load_scene
from tests.analysis.equilibria.drives import drive
from tests.dynamics.inertial import Thesis, accelerations


def inertial_slope(p: Thesis, w: float, state: np.ndarray) -> np.ndarray:
    """The thesis' equations on inertial axes, in the state of the rotating ones, at psi = 0."""
    n = (len(state) - 4) // 2
    u, v, theta, rates = state[:2], state[2:4], state[4 : 4 + n], state[4 + n :]
    found = accelerations(p, 0.0, w, 0.0, state[:4], theta, w + rates, np.zeros(n, bool))
    across = np.array([[0.0, -1.0], [1.0, 0.0]])
    return np.concatenate([v - w * across @ u, found[:2] - w * across @ v, rates, found[2:]])


@pytest.mark.parametrize(
    ("n", "speed"), [(1, 80.0), (2, 70.0), (2, -160.0), (3, 130.0), (5, 130.0)]
)
def test_eigenvalues_of_an_independent_formulation(n: int, speed: float) -> None:
    """By central differences of the inertial-frame model: to 1e-6 of the largest."""
    m, M, e = 1.5e-3 / n, 0.1, 1e-4
    scene = drive(m=(m,) * n, me=(M - n * m) * e)
    p = Thesis(M=M, k=1000.0, c=0.2, e=e, R=0.01, m=m, a=1e-3, cb=1.0)
    system = resting_system(scene)
    states = equilibria_of(scene, speed).branches
    assert len(states) >= n
    for state in states:
        at = state_of(system, speed, state.u, state.theta)
        size = np.array([e, e, e * abs(speed), e * abs(speed), *[1.0] * n, *[abs(speed)] * n])
        jacobian = np.empty((len(at), len(at)))
        for j, step in enumerate(1e-5 * size):
            far = np.zeros(len(at))
            far[j] = step
            ahead, behind = (inertial_slope(p, speed, at + s * far) for s in (1.0, -1.0))
            jacobian[:, j] = (ahead - behind) / (2.0 * step)
        left = list(np.linalg.eigvals(jacobian * size / size[:, None]))
        for value in state.eigenvalues:
            nearest = left.pop(int(np.argmin(np.abs(np.array(left) - value))))
            # Of the balanced set's double zeros' like, differences see the root of their error.
            assert abs(nearest - value) < 1e-6 * np.abs(state.eigenvalues).max()


POINTS = 200


def test_verdicts_agree_with_simulation() -> None:
    """200 drives and states at random, growth rates from 0.5 % of the speed on.

    Disturbed by 1e-6 of everything; over ten times 1/|lambda| that decays to a tenth at most, or
    grows tenfold at least, where exp(10) is 22,000. The rotor and the balls, points, are the NSC's.
    """
    draw = np.random.default_rng(5)
    seen = {True: 0, False: 0}
    while sum(seen.values()) < POINTS:
        natural, ratio = 192.0, draw.uniform(0.6, 2.5)
        speed = float(natural * draw.uniform(0.3, 3.0))
        m = 0.3e-3 * ratio
        c = 2.0 * 0.216 * natural * 10.0 ** draw.uniform(-1.7, -0.5)
        scene = drive(
            M=0.216, me=1e-5, k=0.216 * natural**2, c=c, R=0.0165, m=(m, m), rolls=False,
            cb=float(m * speed * 10.0 ** draw.uniform(-1.5, 0.0)), start={"speed": speed},
            spindle={"max_speed": 1000.0, "max_acceleration": 100.0},
            solver={"stepper": "rk8", "step": round(2.0 * math.pi / speed / 30.0, 9)},
        )  # fmt: skip
        states = equilibria_of(scene, speed).branches
        state = states[int(draw.integers(len(states)))]
        if abs(state.lambda_max) < 5e-3 * speed:
            continue
        assert state.stable is not None
        run = Drive(scene)
        rest = state_of(resting_system(scene), speed, state.u, state.theta)
        length = max(state.W, 1e-5 / 0.216)
        size = np.array([length, length, length * speed, length * speed, 1, 1, speed, speed])
        moved = rest + 1e-6 * size * draw.normal(size=8)
        run.restore(run.snapshot()._replace(state=moved, memory=np.empty(0)))
        steps = math.ceil(10.0 / abs(state.lambda_max) / run.step)
        run.advance(steps, every=steps)
        off = np.abs((run.snapshot().state - rest) / size).max() / 1e-6
        assert off < 0.1 if state.stable else off > 10.0, (state.label, state.lambda_max, off)
        seen[state.stable] += 1
    assert min(seen.values()) > 30


def test_a_degenerate_balance_is_undecided_and_settles() -> None:
    """NSC case 2, 2 m R = M2 eps: lambda_Rmax is 0; the nonlinear test says stable."""
    scene = load_scene("nsc-case-2")
    found = {state.label: state for state in equilibria_of(scene, 900.0).branches}
    assert found["balanced"].stable is None
    assert found["balanced"].structural_zeros == 0
    assert settles(scene, 900.0, found["balanced"]).stable
    assert found["1+1"].stable is False
    assert not settles(scene, 900.0, found["1+1"]).stable


def test_friction_holds_balls_beside_a_state() -> None:
    """Within the interval a run stays where it is, beyond it does not; none without friction."""
    scene = load_scene("thesis-hold")
    found = {state.label: state for state in equilibria_of(scene, 200.0).branches}
    state = found["balanced"]
    first, second = sticking(scene, 200.0, state)
    assert first.low < state.theta[0] < first.high
    assert second.high - second.low == pytest.approx(first.high - first.low), "they are mirrored"
    for far, stays in ((0.99, True), (1.05, False)):
        theta = state.theta.copy()
        theta[0] += far * (first.high - theta[0])
        system = resting_system(scene)
        pull = 200.0**2 * (9.8e-6 + 1e-5 * np.exp(1j * theta).sum())
        z = pull / complex(1000.0 - 0.1 * 200.0**2, 0.2 * 200.0)
        at = state_of(system, 200.0, np.array([z.real, z.imag]), theta)
        start = type(scene.start)(speed=200.0, ball_angles=(0.0, 0.0))
        held = scene.model_copy(update={"start": start, "profile": None})
        run = Drive(held)
        run.restore(run.snapshot()._replace(state=at, memory=np.empty(0)))
        run.advance(300)
        moved = np.abs(run.snapshot().state[4:6] - theta).max()
        assert bool(moved == 0.0) is stays
    smooth = load_scene("thesis-hold", ["effects.rolling_friction.arm=0"])
    assert all(s.low == s.high for s in sticking(smooth, 200.0, state))


def test_what_does_not_reach_the_deck_decouples(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eigenvalues of many balls that balance are those of the whole, from small matrices."""
    scene, speed = drive(m=(1.5e-3 / 12,) * 12), 130.0
    system = resting_system(scene)
    sizes = []
    eig = states_module.eig

    def counted(matrix: np.ndarray, **sides: bool) -> Any:
        sizes.append(len(matrix))
        return eig(matrix, **sides)

    monkeypatch.setattr(states_module, "eig", counted)
    balanced = [s for s in equilibria_of(scene, speed).branches if s.label.startswith("balanced")]
    assert len(balanced) == 3 and max(sizes) <= 12
    for state in balanced:
        at = state_of(system, speed, state.u, state.theta)
        whole = np.linalg.eigvals(field_at(system, speed).jacobian(0.0, at))
        left = list(state.eigenvalues)
        for value in whole:  # as sets
            near = int(np.argmin(np.abs(np.array(left) - value)))
            # A zero of a whole matrix is not as exact.
            assert abs(left.pop(near) - value) < 1e-5 * np.abs(whole).max()
