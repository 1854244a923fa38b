"""What is read off a start-up's figure."""

import numpy as np

from gallery.thesis.claims import opposite
from gallery.thesis.drive import StartUp


def at_time(values: np.ndarray, run: StartUp, time: float) -> np.ndarray:
    """The sample nearest to a time [s]."""
    return np.asarray(values[np.argmin(np.abs(run.trajectory["time"] - time))])


def course_apart(one: StartUp, other: StartUp) -> float:
    """Root mean square of the difference of two courses of W/e, over the other's peak."""
    return float(np.sqrt(np.mean((one.whirl - other.whirl) ** 2)) / other.peak[0])


def entered(run: StartUp) -> tuple[float | None, float | None]:
    """When all balls first are in the vicinity of -180 deg, and when for good [s]; None: never."""
    time = run.trajectory["time"]
    near = opposite(np.degrees(run.trajectory.ball_angles)).all(axis=1)
    if not near.any():
        return None, None
    away = np.flatnonzero(~near)
    stays = int(away[-1]) + 1 if len(away) else 0
    return float(time[np.argmax(near)]), float(time[stays]) if stays < len(time) else None


def closest(run: StartUp, time: float, around: float) -> tuple[float, float]:
    """How near the balls' mean comes to -180 deg [deg], short of it positive; and when [s].

    Only within so many seconds around a time.
    """
    when = run.trajectory["time"]
    looked = np.flatnonzero(np.abs(when - time) <= around)
    angle = np.degrees(run.trajectory.ball_angles[looked].mean(axis=1)) + 180.0
    least = int(np.argmin(angle))
    return float(angle[least]), float(when[looked[least]])


def seconds(time: float | None) -> str:
    """In words."""
    return "never" if time is None else f"{time:.2f} s"


def turned_back(run: StartUp, until: float | None) -> float:
    """By how much a ball went back on its way towards falling angles, before a time [s]: [deg]."""
    end = run.trajectory["time"][-1] if until is None else until
    angles = np.degrees(run.trajectory.ball_angles[run.trajectory["time"] <= end])
    return float((angles - np.minimum.accumulate(angles, axis=0)).max())


def pushed(run: StartUp) -> float:
    """The driving force's integral over time, mean of the balls [N s]."""
    return float(np.trapezoid(run.forces.mean(axis=1), run.trajectory["time"]))
