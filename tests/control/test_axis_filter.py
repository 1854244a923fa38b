"""The filter against a truth that is known, and against anything that may come."""

import math

import numpy as np
import pytest

from ab_sim.control.axis_filter import AxisFilter

CRITICAL, DAMPING, NET = 92.0, 2.4, complex(7e-5, -4e-5)


def motion(acceleration: bool, seconds: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A ramp to 150 rad/s: time, spindle angle and reading, by steps of 20 us of the equation."""
    h, x, v = 2e-5, 0.0, 0.0
    rows = []
    for i in range(round(seconds / h)):
        time = i * h
        speed = min(200.0 * time, 150.0)
        slope = 200.0 if speed < 150.0 else 0.0
        angle = 100.0 * time * time if slope else 56.25 + 150.0 * (time - 0.75)
        force = NET * complex(speed * speed, -slope)
        pull = (force * complex(math.cos(angle), math.sin(angle))).real
        a = pull - CRITICAL**2 * x - DAMPING * v
        if i % 50 == 0:
            rows.append((time, angle, a if acceleration else x))
        v += h * a
        x += h * v
    found = np.array(rows).T
    return found[0], found[1], found[2]


def filtered(acceleration: bool, offset: float = 0.0, told: bool = True) -> AxisFilter:
    time, angle, sound = motion(acceleration, 1.5)
    noise = 0.02 if acceleration else 1e-6
    readings = sound + offset + np.random.default_rng(2).normal(0.0, noise, len(time))
    axis = AxisFilter(acceleration, 200.0, noise if told else 0.0)
    before = (0.0, 0.0)
    for t, psi, reading in zip(time.tolist(), angle.tolist(), readings.tolist(), strict=True):
        speed = min(200.0 * t, 150.0)
        slope, c, s = (200.0 if speed < 150.0 else 0.0), math.cos(psi), math.sin(psi)
        force = speed * speed * c + slope * s, slope * c - speed * speed * s
        if axis.known == 1.0:
            axis.predict(1e-3, *before, *force)
            axis.update(reading, *force)
        else:
            axis.collect(reading, speed)
        before = force
    return axis


@pytest.mark.parametrize("acceleration", [False, True])
@pytest.mark.parametrize("told", [False, True])
@pytest.mark.parametrize("offset", [0.0, 9.81])
def test_it_finds_what_is_there(acceleration: bool, told: bool, offset: float) -> None:
    axis = filtered(acceleration, offset, told)
    assert math.sqrt(axis.state[4]) == pytest.approx(CRITICAL, rel=2e-3)
    assert axis.state[5] == pytest.approx(DAMPING, rel=0.15)
    assert abs(complex(axis.state[2], axis.state[3]) - NET) < 0.02 * abs(NET)
    assert axis.state[6] == pytest.approx(offset, abs=0.05 if acceleration else 3e-6)
    noise = math.sqrt(axis.variance) / (0.02 if acceleration else 1e-6)
    assert 0.3 < noise < 1.5


@pytest.mark.parametrize("acceleration", [False, True])
def test_its_deviations_are_those_of_its_errors(acceleration: bool) -> None:
    axis = filtered(acceleration)
    deviation = math.sqrt(axis.covariance[4][4])
    assert abs(axis.state[4] - CRITICAL**2) < 4.0 * deviation < 0.04 * CRITICAL**2


@pytest.mark.parametrize("seed", range(6))
def test_no_input_makes_it_lose_its_numbers(seed: int) -> None:
    """Variances stay positive, correlations below 1, all finite; whatever is read."""
    draw = np.random.default_rng(seed)
    axis = AxisFilter(bool(seed % 2), 200.0, 1e-6 * (seed % 3))
    for i in range(3000):
        speed = float(draw.uniform(0.0, 250.0)) if seed > 2 else min(0.1 * i, 200.0)
        size = 10.0 ** float(draw.uniform(-9, 9 if seed > 3 else -3))
        force = [float(value) for value in speed * speed * draw.normal(size=4)]
        if axis.known == 1.0:
            axis.predict(float(draw.uniform(1e-5, 1.5e-3)), *force)
            axis.update(size * float(draw.normal()), force[2], force[3])
        else:
            axis.collect(size * float(draw.normal()), speed)
        covariance = np.array(axis.covariance)
        assert np.isfinite(covariance).all() and np.isfinite(axis.state).all()
        assert (covariance == covariance.T).all() and (np.diag(covariance) >= 0.0).all()
    assert 20.0 <= math.sqrt(axis.state[4]) <= 200.0
