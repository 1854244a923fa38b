"""Balls that circulate beside resting states: whether they can at a speed, and over which speeds.

Where the closed form of one bunch (``analysis.circulating``) has a stable one, the motion of all
balls together is computed exactly (``analysis.floquet.circulating``), also where swings are too
large for the closed form; that of fewer is run. Friction is left out, as it is of resting states.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.circulating import (
    BunchDrive,
    CirculatingBunch,
    Reach,
    drive_of,
    lasting_speed,
    reach_over_drag,
    reach_over_speed,
    stalled,
    why_not,
)
from ab_sim.analysis.equilibria.resting import LEFT_OUT
from ab_sim.analysis.floquet.circulating import CirculatingSolution, circulating_solution
from ab_sim.errors import SceneError
from ab_sim.scene.model import Scene

MOST_NUMBERS = 8
"""Numbers of balls that are looked for: of up to so many balls each, of more some."""
TURNS = 100.0
"""Of the spindle in a beat, up to which a periodic solution is looked for."""
NEAR = 0.05
"""Share of its speed that an exact solution may differ by from the closed form it was begun at."""


class Coexisting(NamedTuple):
    """A stable bunch at the speed that was asked for, and how far it reaches."""

    bunch: CirculatingBunch
    """By the closed form."""
    exact: CirculatingSolution | None
    """Of all balls together; None of fewer, or where none was found."""
    run_speed: float | None
    """s in a run that began beside it [rad/s]; None where there is an exact solution."""
    over_speed: Reach | None
    """The closed form's range about the speed [rad/s]; None where swings are too large for it."""
    over_drag: Reach | None
    """The same about the scene's drag [N s/m]."""

    @property
    def speed(self) -> float:
        """s, absolute [rad/s]: the exact one, or that of the run."""
        if self.exact is not None:
            return self.exact.speed
        return self.bunch.speed if self.run_speed is None else self.run_speed

    def report(self) -> dict[str, Any]:
        """As JSON-able values, SI units."""
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
    """Which numbers of balls can circulate in a stable bunch at a speed."""

    speed: float
    """w of the spindle [rad/s]."""
    not_looked_for: str | None
    """Why they are not looked for; None where they are."""
    numbers: tuple[int, ...] = ()
    """Of balls in a bunch that were looked for, the largest first."""
    states: tuple[Coexisting, ...] = ()
    """Those that were found, the most balls first; the others are at rest on the rotor."""
    elsewhere: tuple[Reach, ...] = ()
    """The closed form's ranges of speed [rad/s] in which all balls can circulate, where they cannot
    at this one."""

    def report(self) -> dict[str, Any]:
        """As JSON-able values, SI units."""
        return {
            "not_looked_for": self.not_looked_for,
            "numbers": list(self.numbers),
            "states": [each.report() for each in self.states],
            "elsewhere": [each.report() for each in self.elsewhere],
        }


def coexisting_circulation(scene: Scene, speed: float) -> CoexistingCirculation:
    """Bunches that can circulate in a scene beside its resting states.

    Args:
        scene: as ``equilibria_of`` takes it.
        speed: w [rad/s].
    """
    drive = drive_of(scene)
    if drive is None:
        return CoexistingCirculation(speed, why_not(scene))
    some = np.linspace(drive.balls, 1, min(drive.balls, MOST_NUMBERS))
    numbers = tuple(int(round(x)) for x in some)
    found = [_confirmed(scene, drive, speed, count) for count in numbers]
    states = tuple(each for each in found if each is not None)
    all_circulate = bool(states) and states[0].bunch.count == drive.balls
    elsewhere = () if all_circulate else tuple(reach_over_speed(drive, drive.balls))
    return CoexistingCirculation(speed, None, numbers, states, elsewhere)


def _confirmed(scene: Scene, drive: BunchDrive, speed: float, count: int) -> Coexisting | None:
    """A stable bunch of so many balls; None where it is not there, or does not last."""
    bunch = stalled(drive, speed, count, known=False)
    if bunch is None:
        return None
    # What rests beside a bunch may sit in many ways, and a long beat takes long: it is run instead.
    short = abs(speed) <= TURNS * abs(speed - bunch.speed)
    exact = _exact(scene, bunch) if count == drive.balls and short else None
    run_speed = None if exact else lasting_speed(scene, bunch)
    if run_speed is None if exact is None else not exact.stable:
        return None
    over_speed = reach_over_speed(drive, count, also=(speed,))
    over_drag = reach_over_drag(drive, speed, count)
    ranges = _about(abs(speed), over_speed), _about(drive.drag, over_drag)
    return Coexisting(bunch, exact, run_speed, *ranges)


def _exact(scene: Scene, bunch: CirculatingBunch) -> CirculatingSolution | None:
    """Without friction; None where none is found that is the bunch's."""
    effects = {name: effect for name, effect in scene.effects.items() if name not in LEFT_OUT}
    try:
        found = circulating_solution(scene.model_copy(update={"effects": effects}), bunch)
    except SceneError:
        return None  # A turn of the spindle takes too many steps.
    if found is None or abs(found.speed - bunch.speed) > NEAR * abs(bunch.speed):
        return None
    return found


def _about(value: float, found: list[Reach]) -> Reach | None:
    return next((each for each in found if each.low <= value <= each.high), None)
