"""Figures for the method ``plot()`` of results."""

from collections.abc import Callable

from ab_sim.analysis.comparison import Comparison
from ab_sim.analysis.offline import OfflineRun
from ab_sim.show.costs import drawn_accuracy, drawn_cost
from ab_sim.show.identification import drawn_identification
from ab_sim.show.many_runs import drawn_sensitivities, drawn_sweep, drawn_tuning
from ab_sim.show.maps import drawn_basin, drawn_family, drawn_map
from ab_sim.show.multipliers import drawn_modulus, drawn_multipliers
from ab_sim.show.paths import drawn_batch, drawn_trajectory
from ab_sim.show.picture import drawn_comparison, drawn_report
from ab_sim.show.resting import drawn_branches, drawn_campbell, drawn_recovery, drawn_states
from ab_sim.show.run import drawn_run
from ab_sim.show.saved import ResultFigure, with_plain_texts
from ab_sim.show.shares import drawn_sizing, drawn_spread


def _run(offline_run: OfflineRun, comparison: Comparison | None = None) -> ResultFigure:
    """Return the figure of a run, with the runs for comparison if there are any."""
    others = Comparison(None, None) if comparison is None else comparison
    period, adaptive = offline_run.variable_speed_period, offline_run.adaptive
    path, aborted = offline_run.trajectory, offline_run.aborted
    return drawn_run(path, offline_run.scene, others, period, adaptive=adaptive, aborted=aborted)


DRAWN: dict[str, Callable[..., ResultFigure]] = {
    "accuracy_cost": drawn_accuracy,
    "basin": drawn_basin,
    "batch": drawn_batch,
    "branches": drawn_branches,
    "comparison": drawn_comparison,
    "effect_cost": lambda cost: drawn_cost([cost]),
    "equilibria": drawn_states,
    "family": drawn_family,
    "followed": drawn_modulus,
    "identification": drawn_identification,
    "metric_sensitivities": drawn_sensitivities,
    "modes": drawn_campbell,
    "periodic_solutions": drawn_multipliers,
    "recovery": drawn_recovery,
    "report": drawn_report,
    "run": _run,
    "sizing": drawn_sizing,
    "spread": drawn_spread,
    "stability_map": drawn_map,
    "sweep": drawn_sweep,
    "trajectory": drawn_trajectory,
    "tuning": drawn_tuning,
}
"""Functions that draw results, by the results' attribute ``_picture``."""


def figure_of(picture: str, *results: object) -> ResultFigure:
    """Return the figure of results.

    Parameters
    ----------
    picture
        Key in ``DRAWN``.
    results
        Arguments of the function that draws.
    """
    return with_plain_texts(DRAWN[picture](*results))
