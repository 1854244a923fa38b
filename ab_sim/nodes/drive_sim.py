"""`drive_sim`: lifecycle node of one drive in real time, commanded and observed over topics."""

from ab_sim.nodes.drive_control import DriveControl
from ab_sim.nodes.drive_node import DriveNode
from ab_sim.nodes.process import run_node
from ab_sim.nodes.simulation_services import SimulationServices


class DriveSim(DriveNode):
    """Node of a drive, with the services that control it."""

    def serve(self) -> None:
        """Advertise the services."""
        SimulationServices(self, DriveControl(self))


def main() -> None:
    """Run the node."""
    run_node(DriveSim, DriveSim.run)


if __name__ == "__main__":
    main()
