"""Verdict of a run: whether it has settled, and whether the balls balance the rotor."""

from enum import Enum

import numpy as np


class Verdict(str, Enum):
    """Verdict of a run, in the words of every command, file and picture."""

    BALANCED = "balanced"
    RINGING_DOWN = "balanced, ringing down"
    """Balls balance the rotor and the whirl still falls: its final value is an upper bound."""
    NOT_BALANCED = "not balanced"
    CHANGING = "not balanced, still changing"
    CIRCULATES = "not balanced, balls circulate"
    SETTLED = "settled"
    """Settled run without balls or without an unbalance."""
    UNSETTLED = "still changing"


BALANCED = (Verdict.BALANCED.value, Verdict.RINGING_DOWN.value)
"""Verdicts of runs whose balls balance the rotor."""
SETTLED = (*BALANCED, Verdict.NOT_BALANCED.value, Verdict.SETTLED.value)
"""Verdicts of runs whose final whirl is the limit value or an upper bound of it."""


def verdicts(
    within: np.ndarray,
    settled: np.ndarray,
    ringing_down: np.ndarray,
    circulates: np.ndarray,
    can_balance: np.ndarray,
) -> list[str]:
    """Return verdicts from booleans of shape (runs,).

    Args:
        within: whether the residual unbalance is within the scene's limit.
        settled: whether the whirl has settled.
        ringing_down: whether the whirl is no larger than before, and the residual unbalance does
            not rise.
        circulates: whether a ball circulates on the race.
        can_balance: whether the scene has an unbalance and balls.
    """
    labels = np.where(settled, Verdict.NOT_BALANCED.value, Verdict.CHANGING.value)
    labels = np.where(within & ringing_down, Verdict.RINGING_DOWN.value, labels)
    labels = np.where(within & settled, Verdict.BALANCED.value, labels)
    without = np.where(settled, Verdict.SETTLED.value, Verdict.UNSETTLED.value)
    labels = np.where(can_balance, labels, without)
    names: list[str] = np.where(circulates, Verdict.CIRCULATES.value, labels).tolist()
    return names
