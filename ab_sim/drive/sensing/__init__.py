"""Sensor models, from specific force or displacement to readings, without ROS."""

from ab_sim.drive.sensing.pickup import Pickup, PickupState, digits, noise_variance

__all__ = ["Pickup", "PickupState", "digits", "noise_variance"]
