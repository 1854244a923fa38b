"""What a state that went beyond all bounds says about the scene and its step."""

from collections.abc import Sequence

from ab_sim.errors import DivergedError
from ab_sim.integrate.stepper import Stepper

MOST_NAMED = 3
"""Variables that the message names; it counts the others."""


def diverged(beyond: Sequence[str], stepper: Stepper, step: float, time: float) -> DivergedError:
    """The error that names what went beyond, its likely cause, and a step to try.

    Args:
        beyond: variables of the state.
        stepper: that was used.
        step: its length [s].
        time: at the end of the step that went there [s].
    """
    wrong = list(beyond)
    cause = "the step is too long for the scene's masses, stiffness and drag"
    if any(name.endswith("rate") for name in wrong):
        within = "one step" if stepper.parts == 1 else "a part of one step"
        cause = (
            f"a ball turns more than 3 rad along the race within {within}, which {stepper.name} "
            "cannot follow: the whirl is large for the race, or the step is too long"
        )
    if len(wrong) > MOST_NAMED:
        wrong = [*wrong[:MOST_NAMED], f"{len(wrong) - MOST_NAMED} more"]
    return DivergedError(
        f"{', '.join(wrong)} went beyond all bounds at t = {time:.9g} s; likely cause: "
        f"{cause}; try solver.step = {step / 4:.2g} s"
    )
