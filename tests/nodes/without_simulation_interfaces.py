"""Node drive_sim as if the package simulation_interfaces were not installed."""

import sys

from ab_sim.nodes import drive_sim


def main() -> None:
    """Run the node."""
    sys.modules["simulation_interfaces.srv"] = None  # type: ignore[assignment]
    drive_sim.main()
