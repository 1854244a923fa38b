"""An adaptive start-up: how the spindle finds its way up to speed. It knows no scene, no ROS."""

from ab_sim.control.belief import Belief, Decision, State
from ab_sim.control.settings import SensorFacts, StartUpSettings, checked
from ab_sim.control.start_up import StartUp

__all__ = ["Belief", "Decision", "SensorFacts", "StartUpSettings", "StartUp", "State", "checked"]
