"""Figures for the method ``plot()`` of results."""

from collections.abc import Callable
from importlib import import_module

from ab_sim.analysis.comparison import Comparison
from ab_sim.analysis.floquet import Followed
from ab_sim.analysis.offline import OfflineRun
from ab_sim.base.errors import InputError
from ab_sim.show.figures.accuracy_cost import drawn_accuracy
from ab_sim.show.figures.basin_map import drawn_basin
from ab_sim.show.figures.campbell import drawn_campbell
from ab_sim.show.figures.effect_cost import drawn_cost
from ab_sim.show.figures.eigenvalues import drawn_states
from ab_sim.show.figures.multipliers import drawn_modulus
from ab_sim.show.figures.paths import drawn_batch, drawn_trajectory
from ab_sim.show.figures.recovery import drawn_recovery
from ab_sim.show.figures.run import drawn_run
from ab_sim.show.figures.saved import ResultFigure, with_plain_texts
from ab_sim.show.figures.sensitivity import drawn_sensitivities
from ab_sim.show.figures.sizing import drawn_sizing
from ab_sim.show.figures.spread import drawn_spread
from ab_sim.show.figures.stability_map import drawn_map
from ab_sim.show.figures.sweep import drawn_sweep
from ab_sim.show.figures.tuning import drawn_tuning


def _run(offline_run: OfflineRun, comparison: Comparison | None = None) -> ResultFigure:
    """Draw a run and the runs for comparison."""
    beside = Comparison(None, None) if comparison is None else comparison
    period, adaptive = offline_run.variable_speed_period, offline_run.adaptive
    path, aborted = offline_run.trajectory, offline_run.aborted
    return drawn_run(path, offline_run.scene, beside, period, adaptive=adaptive, aborted=aborted)


def _followed(followed: Followed) -> ResultFigure:
    """Draw the largest modulus over a parameter.

    Raises:
        InputError: no solution was found at any value.
    """
    if all(point.found is None for point in followed.points):
        raise InputError(f"{followed.over}: no periodic solution was found; there is none to draw")
    return drawn_modulus(followed.scene, followed)


DRAWN: dict[str, Callable[..., ResultFigure]] = {
    "accuracy_cost": drawn_accuracy,
    "basin": drawn_basin,
    "batch": drawn_batch,
    "effect_cost": lambda cost: drawn_cost([cost]),
    "equilibria": drawn_states,
    "followed": _followed,
    "metric_sensitivities": drawn_sensitivities,
    "modes": drawn_campbell,
    "recovery": drawn_recovery,
    "run": _run,
    "sizing": drawn_sizing,
    "spread": drawn_spread,
    "stability_map": drawn_map,
    "sweep": drawn_sweep,
    "trajectory": drawn_trajectory,
    "tuning": drawn_tuning,
}
"""Function that draws each ``_picture`` of a result."""


def figure_of(picture: str, *results: object) -> ResultFigure:
    """Return the figure of results.

    Args:
        picture: key in ``DRAWN``, or a function as ``module:function``.
        results: arguments of the function that draws.
    """
    module, _, name = picture.rpartition(":")
    draw = getattr(import_module(module), name) if module else DRAWN[name]
    return with_plain_texts(draw(*results))
