"""Adaptive start-up: a controller that finds the speed profile from measurements; without ROS.

The controller is imported on first use, because every scene needs the settings, but few scenes run
a controller.
"""

from typing import TYPE_CHECKING, Any

from ab_sim.control.settings import SensorFacts, StartUpSettings, checked

if TYPE_CHECKING:
    from ab_sim.control.start_up import Decision, Estimates, StartUp, State
else:

    def __getattr__(name: str) -> Any:
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from ab_sim.control import start_up

        return getattr(start_up, name)


__all__ = ["Estimates", "Decision", "SensorFacts", "StartUpSettings", "StartUp", "State", "checked"]
