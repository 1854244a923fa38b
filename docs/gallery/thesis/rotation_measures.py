"""What is read off a start-up of chapter 5: how far balls lag, and when they have settled."""

import numpy as np

from gallery.thesis.drive import StartUp

SETTLED = 25.0
"""Balls have settled when they stay this near to where they end [deg]; one for all figures."""
STILL = 0.25
"""... and for so long at least before a figure ends [s]: every ball is near its end at last."""
HALF_SECOND = 0.25
"""Times are printed to half a second: they hold within a quarter."""


def lag(run: StartUp) -> float:
    """How far the mean ball falls behind the rotor at most, above the critical speed [rad/s]."""
    late = run.trajectory["time"] > run.parameters.critical_time
    return float(-run.trajectory.ball_rates[late].mean(axis=1).min())


def last_lag(run: StartUp) -> float:
    """Mean of the lag over the last 0.2 s [rad/s]."""
    time = run.trajectory["time"]
    return float(-run.trajectory.ball_rates[time > time[-1] - 0.2].mean())


def last_range(run: StartUp) -> float:
    """What the balls cover over the last ``STILL`` [deg]."""
    time = run.trajectory["time"]
    return float(np.degrees(np.ptp(run.trajectory.ball_angles[time > time[-1] - STILL, 0])))


def lag_during_hold(run: StartUp) -> float:
    """The largest [rad/s]."""
    time = run.trajectory["time"]
    return float(-run.trajectory.ball_rates[(time > 2.5) & (time < 3.0)].min())


def settled_after(run: StartUp) -> float | None:
    """How long after the critical speed the balls have settled [s]; None: not in the figure."""
    time = run.trajectory["time"]
    turned = np.degrees(run.trajectory.ball_angles.mean(axis=1))
    away = np.flatnonzero(np.abs(turned - turned[-1]) > SETTLED)
    last = float(time[int(away[-1]) if len(away) else 0])
    return None if last > time[-1] - STILL else last - run.parameters.critical_time


def after(settled: float | None) -> str:
    """In words."""
    return "not within 2.5 s" if settled is None else f"{settled:.2f} s"


def longer(settled: float | None, than: float | None) -> float | None:
    """How much later balls have settled [s]; None: one of them has not."""
    return None if settled is None or than is None else settled - than


def shaking(run: StartUp) -> float:
    """Root mean square of W/e from the critical speed on."""
    late = run.trajectory["time"] > run.parameters.critical_time
    return float(np.sqrt(np.mean(run.whirl[late] ** 2)))
