"""Spindle command, and the motor's clipped PI law whose integral tracks the clipped torque.

With raw = kp (w_cmd - w) + ki z and a limit L the regimes are

    LINEAR        T = raw,   z' = w_cmd - w                       while |raw| < L
    SATURATED +-  T = +-L,   z' = w_cmd - w - (raw - T) / kp      while +-raw > L
"""

from math import cos, pi, sin
from typing import NamedTuple

from .params import Motor, Params, Swing

LINEAR, SATURATED = 0, 1
SLACK = 1e-12
"""Excess of raw, relative to the limit, at which the regime changes."""


class Regime(NamedTuple):
    """Regime as above, with the sign of the limit (+1 or -1; 0 for LINEAR)."""

    kind: int = LINEAR
    side: int = 0


class Command(NamedTuple):
    """Angle, speed and acceleration that the segments command."""

    angle: float
    speed: float
    acceleration: float


def breakpoints(p: Params) -> list[float]:
    """Return the times at which the commanded acceleration jumps [s]."""
    times, now = [], 0.0
    for segment in p.spindle.segments:
        now += duration_of(segment)
        times.append(now)
    return times


def command(p: Params, start: float, time: float) -> Command:
    """Return the command at ``time``, on the segment in force just after ``start``."""
    begin, angle, speed = 0.0, p.spindle.angle, p.spindle.speed
    for segment in p.spindle.segments:
        duration = duration_of(segment)
        if start < begin + duration:
            return along(segment, angle, speed, time - begin)
        angle, speed, _ = along(segment, angle, speed, duration)
        begin += duration
    return along((0.0, 0.0), angle, speed, time - begin)


def duration_of(segment: tuple[float, float] | Swing) -> float:
    """Return the duration of a segment [s]."""
    return segment.duration if isinstance(segment, Swing) else segment[0]


def along(segment: tuple[float, float] | Swing, angle: float, speed: float, t: float) -> Command:
    """Return the command ``t`` [s] after a segment begins with an angle and a speed."""
    if isinstance(segment, Swing):
        half, rate = 0.5 * segment.change, pi / segment.duration
        turned = (speed + half) * t - half / rate * sin(rate * t)
        gained = half * (1.0 - cos(rate * t))
        return Command(angle + turned, speed + gained, half * rate * sin(rate * t))
    turned = speed * t + 0.5 * segment[1] * t**2
    return Command(angle + turned, speed + segment[1] * t, segment[1])


def raw_torque(motor: Motor, asked: Command, speed: float, z: float) -> float:
    """Return the torque that the controller requests: kp (w_cmd - w) + ki z."""
    return motor.kp * (asked.speed - speed) + motor.ki * z


def torque(motor: Motor, regime: Regime, raw: float, speed: float) -> float:
    """Return the torque T on the rotor."""
    return (raw if regime.kind == LINEAR else regime.side * motor.limit) - motor.slope * speed


def integrator_rate(motor: Motor, regime: Regime, asked: Command, speed: float, z: float) -> float:
    """Return the rate z' of the integral."""
    raw = raw_torque(motor, asked, speed, z)
    excess = raw - regime.side * motor.limit if regime.kind == SATURATED else 0.0
    return asked.speed - speed - (excess / motor.kp if excess else 0.0)


def choose(motor: Motor, asked: Command, speed: float, acceleration: float, z: float) -> Regime:
    """Return the regime just after an instant; T, z' and raw' agree in all suitable regimes."""
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
    """Return two numbers that stay positive as long as the regime lasts."""
    raw = raw_torque(motor, asked, speed, z)
    slack = SLACK * motor.limit
    if regime.kind == LINEAR:
        return [motor.limit - raw + slack, motor.limit + raw + slack]
    return [regime.side * raw - motor.limit + slack, 1.0]
