"""The action of the contract: a start-up profile as one goal (ab_interfaces/action/RunProfile).

ROS's own packages have no action with a profile, a text and what is believed of a drive in it.
This one's classes are built by colcon, or beside the wheels from PyPI by `make action`; where they
are not, the services do without.
"""

import importlib
from typing import Any, NamedTuple

RUN = "~/run"
"""RunProfile: run a profile to its end."""
NOT_BUILT = "ab_interfaces is not built: there is no action ~/run; the services do without"


class Asked(NamedTuple):
    """A goal."""

    profile: str
    """As the parameter ``profile``; empty: what the parameters name."""
    changes: list[str]


class Progress(NamedTuple):
    """Feedback; units and meanings are in RunProfile.action."""

    status: str
    segment: int
    segments: int
    speed: float
    elapsed: float
    critical_speed: float
    critical_speed_deviation: float
    net_unbalance: float
    net_unbalance_deviation: float


class Outcome(NamedTuple):
    """A result; units and meanings are in RunProfile.action."""

    message: str
    speed: float
    elapsed: float


def run_profile() -> Any:
    """The action's class; None where it is not built."""
    try:
        return importlib.import_module("ab_interfaces.action").RunProfile
    except (ImportError, AttributeError):  # of a checkout there is the folder of its sources
        return None


def asked_of(request: Any) -> Asked:
    """What a goal asks for."""
    return Asked(str(request.profile), [str(change) for change in request.changes])


def goal_of(asked: Asked) -> Any:
    """A goal that asks for something."""
    return run_profile().Goal(**asked._asdict())


def feedback_of(progress: Progress) -> Any:
    """The message."""
    return run_profile().Feedback(**progress._asdict())


def result_of(outcome: Outcome) -> Any:
    """The message."""
    return run_profile().Result(**outcome._asdict())
