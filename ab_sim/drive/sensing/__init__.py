"""Sensor models: from specific force to readings. Without ROS."""

from ab_sim.drive.sensing.pickup import Pickup, PickupState, digits, noise_variance

__all__ = ["Pickup", "PickupState", "digits", "noise_variance"]
