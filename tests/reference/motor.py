"""Spindle command and the motor's clipped PI law with its frozen integrator.

With raw = kp (w_cmd - w) + ki z and a limit L the regimes are

    LINEAR        T = raw,  z' = w_cmd - w       while |raw| < L
    SATURATED +-  T = +-L,  z' = 0               while +-raw > L
    SLIDING +-    T = +-L,  raw' = 0             where both neighbours drive raw back to +-L

SLIDING is Filippov's solution where freezing the integrator would at once unfreeze it: z' is the
fraction 0 <= share <= 1 of w_cmd - w that holds raw at the limit, ki z' = -kp (w_cmd' - w').
"""

from typing import NamedTuple

from .params import Motor, Params

LINEAR, SATURATED, SLIDING = 0, 1, 2
SLACK = 1e-12
"""Relative to the limit: how far raw passes it before the regime changes."""
SHARE_SLACK = 1e-9
"""How far the share may leave 0 .. 1; more than what SLACK makes of w'."""


class Regime(NamedTuple):
    """One of the above, and which limit (+1 or -1; 0 for LINEAR)."""

    kind: int = LINEAR
    side: int = 0


class Command(NamedTuple):
    """Angle, speed and acceleration that the segments ask for."""

    angle: float
    speed: float
    acceleration: float


def breakpoints(p: Params) -> list[float]:
    """Times at which the commanded acceleration jumps."""
    times, now = [], 0.0
    for duration, _ in p.spindle.segments:
        now += duration
        times.append(now)
    return times


def command(p: Params, start: float, time: float) -> Command:
    """The command at ``time``, on the segment that is in force just after ``start``."""
    begin, angle, speed = 0.0, p.spindle.angle, p.spindle.speed
    for duration, acceleration in p.spindle.segments:
        if start < begin + duration:
            break
        angle += speed * duration + 0.5 * acceleration * duration**2
        speed += acceleration * duration
        begin += duration
    else:
        acceleration = 0.0
    t = time - begin
    return Command(
        angle + speed * t + 0.5 * acceleration * t**2, speed + acceleration * t, acceleration
    )


def raw_torque(motor: Motor, asked: Command, speed: float, z: float) -> float:
    """What the controller asks for: kp (w_cmd - w) + ki z."""
    return motor.kp * (asked.speed - speed) + motor.ki * z


def torque(motor: Motor, regime: Regime, raw: float, speed: float) -> float:
    """T on the rotor."""
    return (raw if regime.kind == LINEAR else regime.side * motor.limit) - motor.slope * speed


def share(motor: Motor, asked: Command, speed: float, acceleration: float) -> float:
    """z' / (w_cmd - w) that keeps raw constant."""
    return -motor.kp * (asked.acceleration - acceleration) / (motor.ki * (asked.speed - speed))


def integrator_rate(
    motor: Motor, regime: Regime, asked: Command, speed: float, acceleration: float
) -> float:
    """z'."""
    if regime.kind == SLIDING:
        return -motor.kp * (asked.acceleration - acceleration) / motor.ki
    return 0.0 if regime.kind == SATURATED else asked.speed - speed


def choose(motor: Motor, asked: Command, speed: float, acceleration: float, z: float) -> Regime:
    """The regime just after an instant; T, and so w', are the same in all that meet there."""
    raw = raw_torque(motor, asked, speed, z)
    side = 1 if raw >= 0.0 else -1
    beyond = abs(raw) - motor.limit
    if abs(beyond) > 3.0 * SLACK * motor.limit:
        return Regime(SATURATED, side) if beyond > 0.0 else Regime()
    frozen = side * motor.kp * (asked.acceleration - acceleration)
    running = frozen + side * motor.ki * (asked.speed - speed)
    if frozen < 0.0 < running:
        return Regime(SLIDING, side)
    return Regime(SATURATED, side) if frozen > 0.0 and running > 0.0 else Regime()


def guards(
    motor: Motor, regime: Regime, asked: Command, speed: float, acceleration: float, z: float
) -> list[float]:
    """Two numbers that stay positive as long as the regime lasts."""
    raw = raw_torque(motor, asked, speed, z)
    slack = SLACK * motor.limit
    if regime.kind == LINEAR:
        return [motor.limit - raw + slack, motor.limit + raw + slack]
    if regime.kind == SATURATED:
        return [regime.side * raw - motor.limit + slack, 1.0]
    part = share(motor, asked, speed, acceleration)
    return [part + SHARE_SLACK, 1.0 - part + SHARE_SLACK]
