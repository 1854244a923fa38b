"""Steppers of this package, run through Drive as by a user."""

import math

from ab_sim.analysis.accuracy_cost.energy import INSTANTS, RunEnergies
from ab_sim.analysis.accuracy_cost.methods import FailedError
from ab_sim.analysis.accuracy_cost.sampling import SampleTimes
from ab_sim.base.errors import DivergedError
from ab_sim.drive import Drive
from ab_sim.drive.accuracy.deviation import Samples
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.load import with_solver
from ab_sim.scene.model import Scene


class OwnStepper:
    """Stepper at one step.

    Raises:
        SceneError: the scene refuses the step, e.g. beyond the stability limit.
    """

    peer: bool = False
    tolerance: float | None = None
    evaluations: int | None = None

    def __init__(self, scene: Scene, sampling: SampleTimes, stepper: str, step: float) -> None:
        self.name, self.sampling = stepper, sampling
        self.step: float | None = step
        self.each = sampling.per_period(step)
        assert self.each, "the step divides the sample period"
        self.scene = with_solver(scene, stepper, step)
        self.drive = Drive(self.scene)

    @property
    def events(self) -> int:
        """Events located in the last run."""
        return self.drive.events

    def prepare(self) -> None:
        """Return to the start."""
        self.drive.reset()

    def run(self) -> Trajectory:
        """Take and record all steps, as in normal use; keep those at the reference's times."""
        every = self.each // math.gcd(self.each, self.sampling.parts)
        try:
            return self.drive.advance(self.sampling.number * self.each, every)
        except DivergedError as error:
            raise FailedError(f"diverged: {error}") from error

    def samples(self, kept: Trajectory) -> Samples:
        """Return deck position and ball angles."""
        return Samples.of(kept)

    def energy_error(self) -> float | None:
        """Return the energy balance's error, from a separate run because it takes time."""
        drive = Drive(self.scene, energy_balance=True)
        every = -(-self.sampling.number // INSTANTS)
        energies = []
        try:
            for at in range(0, self.sampling.number, every):
                drive.advance(self.each * min(every, self.sampling.number - at))
                energies.append(drive.energy())
        except DivergedError:
            return None
        return RunEnergies(energies).error()
