"""The package's steppers, as a user runs them: through Drive."""

import numpy as np

from ab_sim.analysis.accuracy.energy import INSTANTS, EnergyBalance
from ab_sim.analysis.accuracy.methods import FailedError
from ab_sim.analysis.accuracy.sampling import Samples, Sampling
from ab_sim.drive import Drive
from ab_sim.errors import DivergedError
from ab_sim.price import with_solver
from ab_sim.scene.model import Scene

AT_ONCE = 20_000
"""Steps per call: a long run of short steps need not be in memory as a whole."""


class Stepping:
    """A stepper at a step.

    Raises:
        SceneError: the scene refuses the step, e.g. beyond the stability limit.
    """

    peer: bool = False
    tolerance: float | None = None
    evaluations: int | None = None

    def __init__(self, scene: Scene, sampling: Sampling, stepper: str, step: float) -> None:
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
        """Back to the start."""
        self.drive.reset()

    def run(self) -> list[np.ndarray]:
        """All steps; every one is recorded, as in use, and those at sample times are kept."""
        most = max(1, AT_ONCE // self.each)
        kept, left = [], self.sampling.number
        try:
            while left:
                periods = min(most, left)
                trajectory = self.drive.advance(periods * self.each)
                kept.append(trajectory.samples[self.each - 1 :: self.each].copy())
                left -= periods
        except DivergedError as error:
            raise FailedError(f"diverged: {error}") from error
        return kept

    def samples(self, kept: list[np.ndarray]) -> Samples:
        """Position and ball angles at the sample times."""
        rows, names = np.concatenate(kept), self.drive.channels
        balls = [names.index(f"ball_{i}_angle") for i in range(self.scene.balls.count)]
        return Samples(rows[:, [names.index("x"), names.index("y")]], rows[:, balls])

    def energy_error(self) -> float | None:
        """In a run of its own, because the ledger takes time."""
        drive = Drive(self.scene, ledger=True)
        every = -(-self.sampling.number // INSTANTS)
        energies = []
        try:
            for at in range(0, self.sampling.number, every):
                drive.advance(self.each * min(every, self.sampling.number - at))
                energies.append(drive.energy())
        except DivergedError:
            return None
        return EnergyBalance(energies).error()
