"""Circulating balls that coexist with resting states, and their range of speeds.

A stable bunch is found in closed form (``analysis.circulating``). If all balls circulate, the
motion is then computed exactly (``analysis.floquet.circulating``), even if swings are too large for
the closed form. If fewer balls circulate, the motion is simulated. Friction is left out, as for
resting states.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.circulating import (
    BunchDrive,
    BunchRange,
    CirculatingBunch,
    drag_ranges,
    drive_of,
    lasting_speed,
    reason_not_covered,
    speed_ranges,
    stalled,
)
from ab_sim.analysis.equilibria.resting import without_events
from ab_sim.analysis.floquet.circulating import CirculatingSolution, circulating_solution
from ab_sim.base.errors import SceneError
from ab_sim.scene.model import Scene

_MOST_NUMBERS = 8
"""Largest number of bunch sizes tried; with more balls, only some sizes are tried."""
TURNS = 100.0
"""Largest beat, in spindle revolutions, for which a periodic solution is computed."""
NEAR = 0.05
"""Largest relative difference in speed of an exact solution from the closed form."""


class Coexisting(NamedTuple):
    """Stable bunch at the requested speed, and the ranges of speed and drag in which it exists."""

    bunch: CirculatingBunch
    """Bunch by the closed form."""
    exact: CirculatingSolution | None
    """Exact motion if all balls circulate; None for fewer balls, or if none was found."""
    run_speed: float | None
    """Speed s in a simulation that starts near the bunch [rad/s]; None with an exact solution."""
    over_speed: BunchRange | None
    """Range of speed of the closed form [rad/s]; None if swings are too large for it."""
    over_drag: BunchRange | None
    """Range of drag of the closed form around the scene's drag [N s/m]."""

    @property
    def speed(self) -> float:
        """Absolute speed s [rad/s]: exact, from the simulation, or from the closed form."""
        if self.exact is not None:
            return self.exact.speed
        return self.bunch.speed if self.run_speed is None else self.run_speed

    def report(self) -> dict[str, Any]:
        """Return the result as JSON-able values in SI units."""
        return {
            "balls": self.bunch.count,
            "speed": self.speed,
            "stable": True,
            "closed_form": self.bunch.report(),
            "exact": self.exact and self.exact.report(),
            "run_speed": self.run_speed,
            "over_speed": self.over_speed and self.over_speed.report(),
            "over_drag": self.over_drag and self.over_drag.report(),
        }


@dataclass(frozen=True)
class CoexistingCirculation:
    """Stable bunches of circulating balls at a speed, by their number of balls."""

    speed: float
    """Spindle speed w [rad/s]."""
    reason_not_covered: str | None
    """Reason why the search is not possible; None if it was made."""
    numbers: tuple[int, ...] = ()
    """Bunch sizes that were tried, the largest first."""
    states: tuple[Coexisting, ...] = ()
    """Bunches that were found, the largest first; the other balls rest on the rotor."""
    other_speed_ranges: tuple[BunchRange, ...] = ()
    """Speed ranges [rad/s] in which all balls can circulate, if they cannot at this speed."""

    def report(self) -> dict[str, Any]:
        """Return the result as JSON-able values in SI units."""
        return {
            "reason_not_covered": self.reason_not_covered,
            "numbers": list(self.numbers),
            "states": [state.report() for state in self.states],
            "other_speed_ranges": [bunch.report() for bunch in self.other_speed_ranges],
        }


def coexisting_circulation(scene: Scene, speed: float) -> CoexistingCirculation:
    """Return the stable bunches that can circulate in a scene, in addition to its resting states.

    Parameters
    ----------
    scene
        Scene; see ``equilibria_of`` for the scenes it covers.
    speed
        Spindle speed w [rad/s].
    """
    drive = drive_of(scene)
    if drive is None:
        return CoexistingCirculation(speed, reason_not_covered(scene))
    spaced = np.linspace(drive.balls, 1, min(drive.balls, _MOST_NUMBERS))
    numbers = tuple(int(round(x)) for x in spaced)
    bunches = [_confirmed(scene, drive, speed, count) for count in numbers]
    states = tuple(bunch for bunch in bunches if bunch is not None)
    all_circulate = bool(states) and states[0].bunch.count == drive.balls
    other_speed_ranges = () if all_circulate else tuple(speed_ranges(drive, drive.balls))
    return CoexistingCirculation(speed, None, numbers, states, other_speed_ranges)


def _confirmed(scene: Scene, drive: BunchDrive, speed: float, count: int) -> Coexisting | None:
    """Return a stable bunch of ``count`` balls; None if it does not exist or does not last."""
    bunch = stalled(drive, speed, count, valid_only=False)
    if bunch is None:
        return None
    # An exact solution needs the places of all resting balls, of which there are many, and a beat
    # that is short enough to integrate. Other bunches are simulated instead.
    short = abs(speed) <= TURNS * abs(speed - bunch.speed)
    exact = _exact(scene, bunch) if count == drive.balls and short else None
    run_speed = None if exact else lasting_speed(scene, bunch)
    if run_speed is None if exact is None else not exact.stable:
        return None
    over_speed = speed_ranges(drive, count, also=(speed,))
    over_drag = drag_ranges(drive, speed, count)
    ranges = _containing(abs(speed), over_speed), _containing(drive.drag, over_drag)
    return Coexisting(bunch, exact, run_speed, *ranges)


def _exact(scene: Scene, bunch: CirculatingBunch) -> CirculatingSolution | None:
    """Return the exact solution without friction; None if none is found near the bunch."""
    try:
        solution = circulating_solution(without_events(scene), bunch)
    except SceneError:
        return None  # a turn of the spindle takes too many steps
    if solution is None or abs(solution.speed - bunch.speed) > NEAR * abs(bunch.speed):
        return None
    return solution


def _containing(value: float, ranges: list[BunchRange]) -> BunchRange | None:
    """Return the range that contains a value; None if none does."""
    return next((range_ for range_ in ranges if range_.low <= value <= range_.high), None)
