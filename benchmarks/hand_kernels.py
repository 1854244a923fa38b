"""The thesis' drive as one would write it by hand: what the package's assembly is measured against.

Suspension, drag, spindle acceleration and spin, prescribed speed, no friction: that and nothing
else, the equations written out for two balls (see dynamics/carriers/planar.py). The same algorithm,
tableau loop, bounds, counting of turns and samples as the package, on the package's own arrays, so
that only what the assembly of effects leaves behind differs. Compiled with the options that serve
it best: no reference counts, as it allocates nothing, and everything inlined.
"""

from math import pi
from typing import NamedTuple

import numba

from ab_sim.dynamics.carriers.planar import on_inertial_axes
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.numbers.multiply_add import multiply_add
from ab_sim.dynamics.system import MASS, MOBILITY, MOMENT, ROUND_LEVER
from ab_sim.integrate.compile_cache import compiled
from ab_sim.integrate.fixed_step import TWO_PI_REST
from ab_sim.integrate.on_stack import room_of, trial_of

BALLS, STATES = 2, 8
OPTIONS = {"error_model": "numpy", "_nrt": False}


class ThesisDrive(NamedTuple):
    """Constants of the scene."""

    total_mass: float
    unbalance: float
    race_radius: float
    race_curvature: float
    stiffness: float
    damping: float
    drag: float
    start_speed: float
    """rad/s, at the segment's beginning."""
    slope: float
    """Spindle acceleration in the segment [rad/s^2]."""


@numba.njit(forceinline=True, **OPTIONS)
def thesis_derivatives(drive, balls, time, state, slope, scratch):  # type: ignore[no-untyped-def]
    """Slope of the state; returns the deck's acceleration A1, A2.

    Args:
        drive: a ThesisDrive.
        balls: System.balls.
        time: local time in the segment [s].
        state, slope: u1, u2, v1, v2, angles, rates.
        scratch: shape (n, 3) or wider, overwritten.
    """
    n, R = BALLS, drive.race_radius
    w, al = drive.start_speed + drive.slope * time, drive.slope
    u1, u2, v1, v2 = state[0], state[1], state[2], state[3]
    f1 = -drive.damping * v1 - drive.stiffness * u1 + drive.unbalance * w * w
    f2 = -drive.damping * v2 - drive.stiffness * u2 - drive.unbalance * al
    d11 = d22 = drive.total_mass
    d12 = d21 = 0.0
    for i in range(n):
        m, rate = balls[i, MASS], state[4 + n + i]
        c, s = cos_sin(state[4 + i])
        mobility = balls[i, MOBILITY]
        moment = balls[i, MOMENT]
        load = moment * (w + rate) * (w + rate)
        lever = balls[i, ROUND_LEVER]
        g0 = (-drive.drag * (R * rate) - lever * al) * mobility
        g1 = m * s * mobility
        g2 = -m * c * mobility
        f1 += load * c + moment * al * s + m * s * g0
        f2 += load * s - moment * al * c - m * c * g0
        d11 = multiply_add(-m * s, g1, d11)
        d12 = multiply_add(-m * s, g2, d12)
        d21 = multiply_add(m * c, g1, d21)
        d22 = multiply_add(m * c, g2, d22)
        scratch[i, 0] = g0
        scratch[i, 1] = g1
        scratch[i, 2] = g2
    inverse = 1.0 / (d11 * d22 - d12 * d21)
    A1 = (f1 * d22 - f2 * d12) * inverse
    A2 = (f2 * d11 - f1 * d21) * inverse
    slope[0] = v1 + w * u2
    slope[1] = v2 - w * u1
    slope[2] = A1 + w * v2
    slope[3] = A2 - w * v1
    for i in range(n):
        slope[4 + i] = state[4 + n + i]
        g = multiply_add(scratch[i, 1], A1, scratch[i, 0])
        slope[4 + n + i] = multiply_add(scratch[i, 2], A2, g) * drive.race_curvature
    return A1, A2


@compiled
def thesis_advance(  # type: ignore[no-untyped-def]
    drive, system, weights, start, angle, first, step, state, modes, work, samples
):
    """``ab_sim.integrate.fixed_step.advance`` for this drive, within one segment.

    Args:
        drive: a ThesisDrive.
        system: the package's, of which only the balls' masses and radii are used.
        weights: the tableau.
        start, angle: when the segment begins [s], and the spindle's angle then [rad].
        first: number of the first step.
        step: s.
        state: changed.
        modes: only the turns, its last column, are used.
        work: a Workspace.
        samples: shape (steps, channels).
    """
    slopes, bounds, balls = work.slopes, work.bounds, system.balls
    trial, scratch = trial_of(system, work), room_of(system, work).table
    n, states, stages = BALLS, STATES, weights.b.size
    thesis_derivatives(drive, balls, first * step - start, state, slopes[0], scratch)
    for k in range(samples.shape[0]):
        begin = (first + k) * step - start
        for stage in range(1, stages):
            for j in range(states):
                trial[j] = 0.0
            for earlier in range(stage):
                weight = weights.a[stage, earlier]
                if weight != 0.0:
                    for j in range(states):
                        trial[j] = multiply_add(weight, slopes[earlier, j], trial[j])
            for j in range(states):
                trial[j] = multiply_add(step, trial[j], state[j])
            time = begin + weights.c[stage] * step
            thesis_derivatives(drive, balls, time, trial, slopes[stage], scratch)
        for j in range(states):
            trial[j] = 0.0
        for stage in range(stages):
            for j in range(states):
                trial[j] = multiply_add(weights.b[stage], slopes[stage, j], trial[j])
        for j in range(states):
            trial[j] = multiply_add(step, trial[j], state[j])
        for j in range(states):
            if not abs(trial[j]) < bounds[j]:
                return k
        for j in range(states):
            state[j] = trial[j]
        for i in range(n):
            while abs(state[4 + i]) > 2.0 * pi:
                turn = 1.0 if state[4 + i] > 0.0 else -1.0
                state[4 + i] = (state[4 + i] - turn * 2.0 * pi) - turn * TWO_PI_REST
                modes[i, 3] += int(turn)
        end = (first + k + 1) * step - start
        A1, A2 = thesis_derivatives(drive, balls, end, state, slopes[0], scratch)
        speed = drive.start_speed + drive.slope * end
        psi = angle + (drive.start_speed + 0.5 * drive.slope * end) * end
        samples[k, 0], samples[k, 1] = first + k + 1, (first + k + 1) * step
        samples[k, 2], samples[k, 3], samples[k, 4] = psi, speed, speed
        c, s = cos_sin(psi)
        samples[k, 5], samples[k, 6] = on_inertial_axes(c, s, state[0], state[1])
        samples[k, 7], samples[k, 8] = on_inertial_axes(c, s, state[2], state[3])
        samples[k, 9], samples[k, 10] = on_inertial_axes(c, s, A1, A2)
        for i in range(n):
            samples[k, 11 + 2 * i] = state[4 + i] + 2.0 * pi * modes[i, 3]
            samples[k, 12 + 2 * i] = state[4 + n + i]
    return samples.shape[0]
