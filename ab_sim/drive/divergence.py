"""Error for a state out of bounds, with its likely cause in the scene or the step."""

from collections.abc import Sequence

from ab_sim.base.errors import DivergedError
from ab_sim.engine.integrate.stepper import Stepper

MOST_NAMED = 3
"""Number of variables that the message names; it counts the others."""


def diverged(beyond: Sequence[str], stepper: Stepper, step: float, time: float) -> DivergedError:
    """Return the error that names the variables out of bounds, the likely cause, and a step to try.

    Args:
        beyond: variables of the state that are out of bounds.
        stepper: stepper in use.
        step: integration step [s].
        time: end of the step that went out of bounds [s].
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
