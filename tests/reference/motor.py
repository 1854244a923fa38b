"""Spindle command and the motor's clipped PI law, its integral tracking the clipped torque.

With raw = kp (w_cmd - w) + ki z and a limit L the regimes are

    LINEAR        T = raw,   z' = w_cmd - w                       while |raw| < L
    SATURATED +-  T = +-L,   z' = w_cmd - w - (raw - T) / kp      while +-raw > L
"""

from typing import NamedTuple

from .params import Motor, Params

LINEAR, SATURATED = 0, 1
SLACK = 1e-12
"""Relative to the limit: how far raw passes it before the regime changes."""


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


def integrator_rate(motor: Motor, regime: Regime, asked: Command, speed: float, z: float) -> float:
    """z'."""
    raw = raw_torque(motor, asked, speed, z)
    excess = raw - regime.side * motor.limit if regime.kind == SATURATED else 0.0
    return asked.speed - speed - (excess / motor.kp if excess else 0.0)


def choose(motor: Motor, asked: Command, speed: float, acceleration: float, z: float) -> Regime:
    """The regime just after an instant; T and z', and so raw', are the same in all that meet."""
    raw = raw_torque(motor, asked, speed, z)
    side = 1 if raw >= 0.0 else -1
    beyond = abs(raw) - motor.limit
    if abs(beyond) > 3.0 * SLACK * motor.limit:
        return Regime(SATURATED, side) if beyond > 0.0 else Regime()
    rising = motor.kp * (asked.acceleration - acceleration) + motor.ki * (asked.speed - speed)
    return Regime(SATURATED, side) if side * rising > 0.0 else Regime()


def guards(
    motor: Motor, regime: Regime, asked: Command, speed: float, acceleration: float, z: float
) -> list[float]:
    """Two numbers that stay positive as long as the regime lasts."""
    raw = raw_torque(motor, asked, speed, z)
    slack = SLACK * motor.limit
    if regime.kind == LINEAR:
        return [motor.limit - raw + slack, motor.limit + raw + slack]
    return [regime.side * raw - motor.limit + slack, 1.0]
