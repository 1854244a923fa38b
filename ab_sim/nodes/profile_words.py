"""Texts of the profile controller: diagnostics, log, feedback and results."""

from ab_msgs_py import Level
from ab_msgs_py.actions import Outcome, Progress
from ab_sim.model.spindle.profile_run import ProfileRun, ProfileState

GAVE_UP = "at the final speed, but "
"""Beginning of the message on a profile that ended with a problem; the reason follows."""
HEALTH = {
    ProfileState.IDLE: "waiting for ~/start",
    ProfileState.DONE: "profile done, holding its final speed",
    ProfileState.ABORTED: "aborted, commanding standstill",
}
"""Messages for states that their status text does not describe well enough."""


def logged(status: str, well: bool = True) -> str:
    """Return the text of a status for the log; ``well``: there is no problem."""
    word, _, more = status.partition(": ")
    state = ProfileState(word)
    if state is ProfileState.DONE and not well:
        return f"{GAVE_UP}{more}"
    words = HEALTH.get(state, status)
    return f"{words}; {more}" if more and more not in words else words


def health(run: ProfileRun) -> tuple[Level, str, dict[str, str]]:
    """Return level, message and values of the diagnostics."""
    message = HEALTH.get(run.state, run.status)
    if run.why and run.state is ProfileState.DONE:
        message = f"{GAVE_UP}{run.why}"
    elif run.why and run.why not in message:
        message += f"; {run.why}"
    values = {
        "state": run.state.value,
        "status": run.status,
        "speed commanded [rad/s]": f"{run.command:.9g}",
    }
    if run.execution is not None and run.state in (ProfileState.RUNNING, ProfileState.DONE):
        values |= run.execution.values
    return Level.WARN if run.why else Level.OK, message, values


def progress(run: ProfileRun, elapsed: float) -> Progress:
    """Return the feedback for a goal's client, with the time since the start [s]."""
    assert run.execution is not None
    estimates, (segment, segments) = run.execution.estimates, run.execution.segment
    return Progress(run.status, segment, segments, run.command, elapsed, *estimates)


def outcome(run: ProfileRun, elapsed: float, first: str = "") -> Outcome:
    """Return the result of a run for a goal's client.

    Args:
        run: run of the profile.
        elapsed: time since its start [s].
        first: beginning of the text.
    """
    why = f": {run.why}" if run.why and run.why not in run.status else ""
    return Outcome(f"{first}{run.status}{why}", run.command, elapsed)
