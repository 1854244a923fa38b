"""Laws of single effects as plain functions: against geometry, and against what they promise."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.model.equations.effects import (
    BallContact,
    Gravity,
    HardeningSuspension,
    Motor,
    RaceRunout,
    Suspension,
    UnequalSuspension,
)
from ab_sim.model.equations.motion import DeckMotion
from ab_sim.scene import load_scene

R = 0.01
OVAL = RaceRunout(offset_1=3e-4, offset_2=-2e-4, lobe=4e-4, lobe_angle=0.3)


def place(theta: float) -> complex:
    """The point of the race with the outward normal at theta, from the effect's own shape."""
    beyond, across, _, _ = OVAL.race_shape(math.cos(theta), math.sin(theta))
    return (R + beyond + 1j * across) * complex(math.cos(theta), math.sin(theta))


def direction(theta: float) -> complex:
    h = 1e-4
    return (place(theta + h) - place(theta - h)) / (2 * h)


@pytest.mark.parametrize("theta", np.linspace(-7.0, 7.0, 15))
def test_arc_of_an_oval_race_is_the_length_of_its_curve(theta: float) -> None:
    length, _ = quad(lambda t: abs(direction(t)), 0.0, theta, epsabs=1e-13, limit=200)
    arc = R * theta + OVAL.race_arc(theta) - OVAL.race_arc(0.0)
    assert arc == pytest.approx(length, rel=1e-7)


@pytest.mark.parametrize("theta", np.linspace(0.0, 6.0, 13))
def test_radius_of_curvature_of_an_oval_race_and_its_rate(theta: float) -> None:
    """X' = l t with t across the normal; l' by differences of l."""

    def radius(at: float) -> float:
        return R + OVAL.race_shape(math.cos(at), math.sin(at))[2]

    tangent = direction(theta) * complex(math.cos(theta), -math.sin(theta))
    assert tangent.real == pytest.approx(0.0, abs=1e-9)
    assert radius(theta) == pytest.approx(tangent.imag, rel=1e-6)
    rate = (radius(theta + 1e-4) - radius(theta - 1e-4)) / 2e-4
    assert OVAL.race_shape(math.cos(theta), math.sin(theta))[3] == pytest.approx(rate, abs=1e-9)


STEP = 1e-7
SPRINGS = {
    "suspension": (Suspension(900.0, 0.3), "deck"),
    "hardening_suspension": (HardeningSuspension(7e8), "deck"),
    "unequal_suspension": (UnequalSuspension(900.0, 1300.0, 0.3, 0.5, 0.4), "space"),
}


@pytest.mark.parametrize("name", SPRINGS)
def test_springs_store_what_they_take_and_dampers_lose_it(name: str) -> None:
    """f = -dE/du at rest, and f.v = -dE/dt - loss."""
    law, axes = SPRINGS[name]
    force, energy = getattr(law, f"{axes}_force"), getattr(law, f"{axes}_energy")
    for x, y, vx, vy in np.random.default_rng(1).normal(0.0, [1e-3, 1e-3, 0.1, 0.1], (20, 4)):
        one, other = (energy(DeckMotion(x + h, y, vx, vy)) for h in (STEP, -STEP))
        along = (other - one) / (2 * STEP)
        one, other = (energy(DeckMotion(x, y + h, vx, vy)) for h in (STEP, -STEP))
        across = (other - one) / (2 * STEP)
        assert force(DeckMotion(x, y, 0.0, 0.0)) == pytest.approx((along, across), rel=1e-6)
        fx, fy = force(DeckMotion(x, y, vx, vy))
        loss = getattr(law, f"{axes}_loss", lambda deck: 0.0)(DeckMotion(x, y, vx, vy))
        assert (fx - along) * vx + (fy - across) * vy == pytest.approx(-loss, rel=1e-6, abs=1e-7)
        assert energy(DeckMotion(x, y, 0.0, 0.0)) > 0.0 <= loss


def test_springs_have_the_stiffness_that_they_are_given() -> None:
    """Of the two of a suspension that is unequal, each along its own axis."""
    assert Suspension(900.0, 0.3).deck_force(DeckMotion(2.0, 0.0, 0.0, 10.0)) == (-1800.0, -3.0)
    assert HardeningSuspension(7.0).deck_force(DeckMotion(0.0, 2.0, 1.0, 1.0)) == (0.0, -56.0)
    turned = UnequalSuspension(900.0, 1300.0, 0.3, 0.5, 0.4)
    for k, c, angle in ((900.0, 0.3, 0.4), (1300.0, 0.5, 0.4 + math.pi / 2)):
        axis = np.array([math.cos(angle), math.sin(angle)])
        got = turned.space_force(DeckMotion(*(2.0 * axis), *(10.0 * axis)))
        assert got == pytest.approx(-(2.0 * k + 10.0 * c) * axis)


def test_hardening_mounts_store_what_they_take() -> None:
    """The force at a displacement d is the stiffening times d; energy counts from d = 0."""
    law = HardeningSuspension(7e8)
    for d in (1e-4, 3e-3):
        work, _ = quad(lambda r: law.mount_stiffening(r * r) * r, 0.0, d)
        assert law.mount_energy(d * d) == pytest.approx(work, rel=1e-9)
        assert law.mount_stiffening(d * d) == pytest.approx(7e8 * d * d)


def test_gravity_has_its_size_wherever_it_points() -> None:
    """Down the shaft of a disc that lies, in its plane of one on edge."""
    for tilt, direction in np.random.default_rng(2).uniform(-math.pi, math.pi, (20, 2)):
        law = Gravity(tilt, direction, 9.7)
        assert math.hypot(*law.weight()) == pytest.approx(9.7)
        assert law.weight()[:2] == law.gravity()
        assert law.weight()[2] == pytest.approx(-9.7 * math.cos(tilt))
        aside = 9.7 * math.sin(tilt) * np.array([math.cos(direction), math.sin(direction)])
        assert law.gravity() == pytest.approx(tuple(aside))


def test_the_motors_integral_does_not_wind_up_at_the_torque_limit() -> None:
    """Held by a load at the limit, k_i z goes to T_max: then T_a - T_max = k_p error."""
    motor = Motor(rotor_inertia=2e-5, torque_limit=1e-2, proportional_gain=1e-3, integral_gain=1e-2)
    for error in (50.0, -50.0):

        def rate(_: float, z: np.ndarray, error: float = error) -> list[float]:
            asked = motor.loop_torque(error, float(z[0]))
            limit = motor.largest_torque()
            return [motor.integral_rate(error, asked - min(max(asked, -limit), limit))]

        # Its time constant is k_p / k_i = 0.1 s.
        held = solve_ivp(rate, (0.0, 5.0), [0.0], rtol=1e-8, atol=1e-10).y[0, -1]
        torque = motor.integral_gain * held
        assert torque == pytest.approx(math.copysign(motor.largest_torque(), error), rel=1e-6)


def test_the_motors_integral_follows_the_error_below_the_limit() -> None:
    motor = Motor(2e-5, 1e-2, 1e-3, 1e-2)
    assert motor.integral_rate(3.0, 0.0) == 3.0


def test_balls_bounce_down_to_ten_micrometres_a_second() -> None:
    """What bounces less than that would rise by less than 1e-11 m on edge."""
    law = BallContact(0.7)
    assert law.restitution(1.01e-5) == 0.7
    assert law.restitution(0.99e-5) == law.restitution(0.0) == law.restitution(-1.0) == 0.0


def test_a_motor_is_switched_off_by_its_limit_not_by_its_gain() -> None:
    with pytest.raises(SceneError, match="gain = 0: .*off: torque_limit 0"):
        load_scene("weak-motor", ["effects.motor.proportional_gain=0"])
    off = ["effects.motor.torque_limit=0", "effects.motor.back_emf_slope=0"]
    run = Drive(load_scene("weak-motor", off)).advance(200)
    assert not run["motor_torque"].any() and run["speed"][-1] < run["command"][-1] - 5.0
