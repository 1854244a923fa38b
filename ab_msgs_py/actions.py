"""Action of the contract: a start-up profile as a goal (ab_interfaces/action/RunProfile).

ROS's standard packages have no action with a profile, a text and an estimate of the drive's state.
Colcon builds the classes of this action; for ROS from PyPI, `make action` builds them. Without
them, only the services are available.
"""

import importlib
import math
from typing import Any, NamedTuple

RUN = "~/run"
"""RunProfile: run a profile to its end."""
NOT_BUILT = "ab_interfaces is not built: there is no action ~/run; the services work without it"


class RunRequest(NamedTuple):
    """Request to run a profile, as in a goal of the action."""

    profile: str
    """Profile, as in the parameter ``profile``; empty: the profile that the parameters name."""
    changes: list[str]
    """Changes to the profile, each ``key=value``."""


class Progress(NamedTuple):
    """Feedback of the action; units and meanings are in RunProfile.action."""

    status: str
    segment: int
    segments: int
    speed: float
    elapsed: float
    critical_speed: float = math.nan
    critical_speed_deviation: float = math.nan
    net_unbalance: float = math.nan
    net_unbalance_deviation: float = math.nan


class Outcome(NamedTuple):
    """Result of the action; units and meanings are in RunProfile.action."""

    message: str
    speed: float
    elapsed: float


def run_profile() -> Any:
    """Return the class of the action RunProfile, or None if ab_interfaces has not been built."""
    try:
        return importlib.import_module("ab_interfaces.action").RunProfile
    except (ImportError, AttributeError):  # a checkout has a folder of this name without classes
        return None


def request_of(request: Any) -> RunRequest:
    """Return the request in a goal message."""
    return RunRequest(str(request.profile), [str(change) for change in request.changes])


def goal_of(request: RunRequest) -> Any:
    """Return the goal message for a request."""
    return run_profile().Goal(**request._asdict())


def feedback_of(progress: Progress) -> Any:
    """Return the feedback message for the progress of a goal."""
    return run_profile().Feedback(**progress._asdict())


def result_of(outcome: Outcome) -> Any:
    """Return the result message for an outcome."""
    return run_profile().Result(**outcome._asdict())
