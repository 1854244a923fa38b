"""What sensors make of the motion: from specific force to readings. No ROS in here."""

from ab_sim.sensing.pickup import Pickup, PickupState

__all__ = ["Pickup", "PickupState"]
