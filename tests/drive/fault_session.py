"""Drive whose faults are injected and removed during a run."""

import numpy as np

from ab_sim.drive import Drive
from ab_sim.drive.faults.active import transfer_faults
from ab_sim.drive.faults.fault import faults_of
from ab_sim.drive.observation import Observation
from ab_sim.drive.trajectory import Trajectory
from ab_sim.nodes.command_path import CommandPath, Rules
from ab_sim.nodes.prepared_drive import CommandedDrive
from ab_sim.scene import Scene


class FaultSession:
    """Drive whose faults are injected and removed as on a test bench, without ROS."""

    def __init__(self, scene: Scene, *texts: str) -> None:
        self.drive = Drive(scene, commanded=True, faults=faults_of(texts))
        self.path = CommandPath(self.drive.servo, self.drive.step, Rules())
        self.commanded = CommandedDrive(self.drive, self.path)

    def run(self, steps: int, speed: float | None = None) -> Observation:
        if speed is not None:
            self.path.receive(speed, self.drive.steps)
        for _ in self.commanded.advance(steps):
            pass
        return self.drive.observe()

    def heard(self) -> Trajectory:
        """Return the present sample as sensors report it."""
        return self.commanded.faults.readings(self.drive.present()).present

    def inject(self, *texts: str) -> Observation:
        """Replace the present faults, and return the drive's observation right afterwards."""
        other = Drive(self.drive.scene, commanded=True, faults=faults_of(texts))
        faults = transfer_faults(self.drive, other, self.commanded.faults)
        self.drive, self.commanded = other, CommandedDrive(other, self.path, None, faults)
        return other.observe()


def spun(scene: Scene, speed: float = 150.0, steps: int = 2500) -> FaultSession:
    session = FaultSession(scene)
    session.run(steps, speed)
    return session


def places(now: Observation) -> np.ndarray:
    """Return the positions of deck and balls in the inertial frame."""
    balls = np.exp(1j * (now.psi + now.theta))
    return np.concatenate([now.position, balls.real, balls.imag])
