"""A scene with what its run in a batch needs."""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from ab_sim.accuracy import resolve_accuracy
from ab_sim.drive.trajectory import Trajectory
from ab_sim.dynamics.assemble import system_of
from ab_sim.dynamics.numbers.lanes import pattern
from ab_sim.dynamics.system import has_events
from ab_sim.integrate.choose import choose_stepper
from ab_sim.scene import Scene
from ab_sim.spindle import SpeedProfile
from ab_sim.spindle.stretches import Grid, Stretch, stretches


class BatchRun(NamedTuple):
    """One of the runs."""

    scene: Scene
    trajectory: Trajectory
    """Every ``every``-th step; up to the last sound one, if the run diverged."""
    failure: str
    """Why it ended early; empty if it did not."""


class Prepared:
    """A scene with what its run needs.

    Args:
        scene: checked; an accuracy that it asks for is measured.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, _ = resolve_accuracy(scene)
        self.system = system_of(self.scene)
        choice = choose_stepper(self.scene, self.system)
        self.stepper, self._grid = choice.stepper, Grid(self.scene.solver.step, choice.cycle)
        self.steps = steps_of(self.scene)
        self._profile = SpeedProfile.of_scene(self.scene)
        smooth = not has_events(self.system.effects)
        self.fits_a_lane = self.stepper.takes_lanes and smooth
        self.has_spans = self.stepper.spans and smooth

    @property
    def likeness(self) -> Any:
        """Runs in which this is the same go together."""
        names = tuple(self.scene.effects), tuple(self.scene.sensors)
        constants = pattern((self.system.carrier, self.system.effects))
        solver = self.stepper, self.scene.solver.step
        return names, constants, self.scene.balls.count, solver, self.steps

    def way(self, first: int, steps: int) -> Iterator[Stretch]:
        """Where so many steps go along the scene's profile, ``first`` having been taken before."""
        return stretches(self._profile, self._grid, first, steps)


def steps_of(scene: Scene) -> int:
    """How many steps a scene's run has."""
    return max(1, math.ceil(scene.duration / scene.solver.step - 1e-9))
