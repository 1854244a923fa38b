"""What sensors make of the motion: from specific force to readings. No ROS in here."""

from ab_sim.sensing.pickup import Pickup, PickupState, digits, noise_variance

__all__ = ["Pickup", "PickupState", "digits", "noise_variance"]
