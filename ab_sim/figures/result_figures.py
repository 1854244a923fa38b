"""Figures of the method ``plot()`` of results: a function for each ``_picture`` of a result."""

from ab_sim.analysis.compared import Comparison
from ab_sim.analysis.equilibria import Equilibria
from ab_sim.analysis.floquet import Followed
from ab_sim.analysis.maps.stability import StabilityMap
from ab_sim.analysis.modes import NaturalVibration
from ab_sim.analysis.offline import OfflineRun
from ab_sim.analysis.recovery import RecoveryOverDrag
from ab_sim.batch import Batch
from ab_sim.design.basin import Basin
from ab_sim.design.derivatives import MeritSensitivities
from ab_sim.design.sizing.size import Sizing
from ab_sim.design.spread import Spread
from ab_sim.design.sweep import Sweep
from ab_sim.design.tune import Tuning
from ab_sim.drive.trajectory import Trajectory
from ab_sim.errors import InputError
from ab_sim.figures.accuracy_cost import drawn_accuracy
from ab_sim.figures.basin_map import drawn_basin
from ab_sim.figures.campbell import drawn_campbell
from ab_sim.figures.effect_cost import drawn_cost
from ab_sim.figures.eigenvalues import drawn_states
from ab_sim.figures.multipliers import drawn_modulus
from ab_sim.figures.paths import drawn_batch, drawn_trajectory
from ab_sim.figures.recovery import drawn_recovery
from ab_sim.figures.run import drawn_run
from ab_sim.figures.saved import ResultFigure, with_plain_texts
from ab_sim.figures.sensitivity import drawn_sensitivities
from ab_sim.figures.sizing import drawn_sizing
from ab_sim.figures.spread import drawn_spread
from ab_sim.figures.stability_map import drawn_map
from ab_sim.figures.sweep import drawn_sweep
from ab_sim.figures.tuning import drawn_tuning
from ab_sim.studies.accuracy_cost import AccuracyCost
from ab_sim.studies.effect_cost import EffectCost


def trajectory(found: Trajectory) -> ResultFigure:
    """Draw speed, whirl and ball angles of samples."""
    return with_plain_texts(drawn_trajectory(found))


def run(found: OfflineRun, comparison: Comparison | None = None) -> ResultFigure:
    """Draw a run with the runs that it is compared with."""
    beside = Comparison(None, None) if comparison is None else comparison
    period, adaptive = found.variable_speed_period, found.adaptive
    path, aborted = found.trajectory, found.aborted
    drawn = drawn_run(path, found.scene, beside, period, adaptive=adaptive, aborted=aborted)
    return with_plain_texts(drawn)


def batch(found: Batch) -> ResultFigure:
    """Draw the whirl of all runs."""
    return with_plain_texts(drawn_batch(found))


def equilibria(found: Equilibria) -> ResultFigure:
    """Draw eigenvalues of resting states, and positions of their balls."""
    return with_plain_texts(drawn_states(found))


def stability_map(found: StabilityMap) -> ResultFigure:
    """Draw labels over the plane."""
    return with_plain_texts(drawn_map(found))


def basin(found: Basin) -> ResultFigure:
    """Draw the final states of runs."""
    return with_plain_texts(drawn_basin(found))


def followed(found: Followed) -> ResultFigure:
    """Draw the largest modulus over a parameter.

    Raises:
        InputError: no solution was found at any value.
    """
    if all(point.found is None for point in found.points):
        raise InputError(f"{found.over}: no periodic solution was found; there is none to draw")
    return with_plain_texts(drawn_modulus(found.scene, found))


def modes(found: NaturalVibration) -> ResultFigure:
    """Draw a Campbell diagram."""
    return with_plain_texts(drawn_campbell(found))


def recovery(found: RecoveryOverDrag) -> ResultFigure:
    """Draw settling time and amplitude over drag."""
    return with_plain_texts(drawn_recovery(found))


def accuracy_cost(found: AccuracyCost) -> ResultFigure:
    """Draw errors over CPU time."""
    return with_plain_texts(drawn_accuracy(found))


def effect_cost(found: EffectCost) -> ResultFigure:
    """Draw the time per step of each variant."""
    return with_plain_texts(drawn_cost([found]))


def sweep(found: Sweep) -> ResultFigure:
    """Draw metrics over the keys that vary."""
    return with_plain_texts(drawn_sweep(found))


def tuning(found: Tuning) -> ResultFigure:
    """Draw the points that a search evaluated."""
    return with_plain_texts(drawn_tuning(found))


def spread(found: Spread) -> ResultFigure:
    """Draw distributions of metrics, and Sobol indices."""
    return with_plain_texts(drawn_spread(found))


def sizing(found: Sizing) -> ResultFigure:
    """Draw drag windows, and shares of drives that balance in time."""
    return with_plain_texts(drawn_sizing(found))


def merit_sensitivities(found: MeritSensitivities) -> ResultFigure:
    """Draw percents per percent, as bars."""
    return with_plain_texts(drawn_sensitivities(found))
