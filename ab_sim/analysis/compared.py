"""What a run is compared with."""

from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.merits import Merits


class Compared(NamedTuple):
    """A run beside the one in question."""

    merits: Merits
    time: np.ndarray
    """s, shape (samples,)."""
    whirl: np.ndarray
    """m, shape (samples,)."""
    speed: np.ndarray
    """rad/s, shape (samples,)."""


class Comparison(NamedTuple):
    """What a run is compared with; each is None where the scene has nothing to leave out."""

    without_period: Compared | str | None
    """Without the variable-speed period; a text says why it could not run."""
    without_balls: Compared | str | None
    """Without the balls: they and their mass are taken out of the drive, so that what moves on the
    suspension is M - sum m_i, and the unbalance M0 e remains."""

    def by_name(self) -> dict[str, Compared | str]:
        """What there is, under names for people."""
        named = {
            "without variable-speed period": self.without_period,
            "without balls": self.without_balls,
        }
        return {name: run for name, run in named.items() if run is not None}

    def relative_whirl(self, merits: Merits) -> float | None:
        """A run's final whirl in that of the run without balls; None if that is not to be had."""
        alone = self.without_balls
        if not isinstance(alone, Compared) or alone.merits.final_whirl == 0:
            return None
        return merits.final_whirl / alone.merits.final_whirl

    def report(self, merits: Merits, eccentricity: float) -> dict[str, object]:
        """As JSON-able values, to be added to those of the run that has ``merits``."""
        runs: dict[str, Any] = {
            "without_variable_speed_period": self.without_period,
            "without_balls": self.without_balls,
        }
        for name, run in runs.items():
            if isinstance(run, Compared):
                runs[name] = {
                    **run.merits.report(eccentricity),
                    "final_whirl_relative_to_no_balls": self.relative_whirl(run.merits),
                }
            elif run is not None:
                runs[name] = {"failure": run}
        return {"final_whirl_relative_to_no_balls": self.relative_whirl(merits), **runs}
