"""The package's compiled loop alone, without what a Drive does around it."""

import time
from collections.abc import Callable

import numpy as np

from ab_sim.drive import Drive
from ab_sim.drive.way import Way
from ab_sim.dynamics.assemble import place_on, state_bounds
from ab_sim.dynamics.system import has_events
from ab_sim.integrate.events import events_address
from ab_sim.integrate.fixed_step import Run, stepping
from ab_sim.integrate.kept import Kept
from ab_sim.integrate.workspace import aligned, workspace
from ab_sim.scene import Scene
from ab_sim.spindle.stretches import Stretch


class PackageKernel:
    """Takes the same steps of a scene, within one piece of its profile, again and again.

    Args:
        scene: what to simulate.
        first: steps taken before.
        steps: steps to take.
    """

    def __init__(self, scene: Scene, first: int, steps: int) -> None:
        drive = Drive(scene)
        drive.advance(first)
        self.drive, self.first, self.steps = drive, first, steps
        self.start = drive.snapshot()
        self.piece = drive.profile.piece_at(drive.time)
        if self.piece.end < (first + steps) * drive.step:
            raise SystemExit(f"{scene.name}: the steps run across a breakpoint of the profile")
        system = drive.system
        self.work = workspace(system, drive.stepper, state_bounds(system, drive.step))
        events = events_address() if has_events(system.effects) else 0
        self.state, self.modes = aligned(self.start.state.shape), self.start.modes.copy()
        self.place, changing = place_on(self.piece), (self.state, self.modes, self.work, events)
        fixed = system, self.place, drive.stepper.weights, drive.step
        self._advance = stepping(Kept(Run(*fixed, *changing)))
        way = Way([Stretch(self.piece, first, steps, 0.0, drive.step)])
        self._leg, self._at = next(way.after(first))
        self.samples = np.zeros((steps, len(drive.channels)))

    def rewind(self) -> None:
        """Back to before the steps."""
        self.state[:], self.modes[:] = self.start.state, self.start.modes
        self.work.smooth[0] = np.nan

    def run(self) -> None:
        """Take the steps."""
        self.rewind()
        asked = self.first, self.steps, np.nan, self.samples
        assert self._advance(self._leg.table, self._at, *asked) == self.steps


def ns_per_step(run: Callable[[], None], steps: int, runs: int) -> float:
    """CPU time of some runs, per step [ns]."""
    begin = time.thread_time_ns()
    for _ in range(runs):
        run()
    return (time.thread_time_ns() - begin) / (steps * runs)
