"""What a run is compared with."""

from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.merits.declared import Merits
from ab_sim.analysis.merits.merit import Merit, reported_merits


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
        return self.relative(Merits.final_whirl, merits)

    def relative(self, merit: Merit[float], merits: Merits) -> float | None:
        """A run's merit in that of the run without balls; None if that is not to be had."""
        alone = self.without_balls
        if not isinstance(alone, Compared) or alone.merits.of(merit) == 0:
            return None
        return merits.of(merit) / alone.merits.of(merit)

    def report(self, merits: Merits, eccentricity: float) -> dict[str, object]:
        """As JSON-able values, to be added to those of the run that has ``merits``."""
        runs: dict[str, Any] = {
            "without_variable_speed_period": self.without_period,
            "without_balls": self.without_balls,
        }
        for name, run in runs.items():
            if isinstance(run, Compared):
                runs[name] = {**run.merits.report(eccentricity), **self._shares(run.merits)}
            elif run is not None:
                runs[name] = {"failure": run}
        return {**self._shares(merits), **runs}

    def _shares(self, merits: Merits) -> dict[str, float | None]:
        """What is given relative to the run without balls, by key."""
        return {
            merit.relative.key: self.relative(merit, merits)
            for merit in reported_merits()
            if merit.relative is not None
        }
