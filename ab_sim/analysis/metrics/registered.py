"""User-defined metrics."""

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

from ab_sim.analysis.metrics.judging import JudgedRuns, SampleBlock
from ab_sim.analysis.metrics.metric import METRICS, Better, Metric, MetricValues, Quantity, Row
from ab_sim.analysis.metrics.wording import number_row, number_text
from ab_sim.base.errors import InputError
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene
from ab_sim.scene.units import ShownUnit


class OwnMetric(Protocol):
    """Accumulator of a user-defined metric, created for each run; may have a text ``equation``."""

    def __init__(self, scene: Scene, samples: int) -> None:
        """Prepare for ``samples`` samples of a run of the scene."""

    def take(self, block: Trajectory) -> None:
        """Process the next samples, at least one."""

    def value(self) -> float | None:
        """Return the value after the last sample in SI units; None if it is undefined."""


Own = TypeVar("Own", bound=OwnMetric)


def register_metric(
    key: str,
    *,
    meaning: str,
    unit: str = "1",
    label: str = "",
    last_stretch: bool = False,
    better: str = "neither",
) -> Callable[[type[Own]], type[Own]]:
    """Return a class decorator that registers a metric of runs, in this process.

    The metric appears in ``ab-sim metrics``, in reports, in the tables of ``ab-sim run`` and
    ``ab-sim report``, and in ``metrics`` of results. An instance of the class is created for each
    run, with the scene and the number of samples. ``take(block)`` receives the samples as
    successive ``Trajectory`` blocks, because a run may not fit into memory. Then ``value()``
    returns the number, or None if it is undefined. If the class has a text ``equation``, it is
    listed with the metric.

    Parameters
    ----------
    key : str
        Name in reports.
    meaning : str
        Meaning in a few words.
    unit : str, default "1"
        SI unit of the value; "e" for a length [m] that is reported in units of the eccentricity.
    label : str, optional
        Label of its row in tables, without the unit; default: the key, with spaces.
    last_stretch : bool, default False
        Whether the class receives only the last tenth of the run.
    better : str, default "neither"
        Preferred values: smaller, larger or neither.

    Returns
    -------
    callable
        Decorator, which returns the class.

    Raises
    ------
    ValueError
        Another metric has the key.
    InputError
        ``better`` is none of these words.

    Notes
    -----
    Displacements are relative to the deck's rest position.

    Examples
    --------
    >>> import ab_sim
    >>> @ab_sim.register_metric("mean_speed", unit="rad/s", meaning="mean speed of the spindle")
    ... class MeanSpeed:
    ...     def __init__(self, scene, samples):
    ...         self.sum, self.samples = 0.0, samples
    ...     def take(self, block):
    ...         self.sum += block["speed"].sum()
    ...     def value(self):
    ...         return float(self.sum / self.samples)
    >>> run = ab_sim.simulate(ab_sim.load_scene("thesis-hold", ["duration=0.1"]))
    >>> round(run.metrics["mean_speed"], 3), "mean_speed" in run.report()
    (2.0, True)
    """
    if better not in {choice.value for choice in Better}:
        raise InputError(
            f"better = {better!r}: must be one of {', '.join(choice.value for choice in Better)}"
        )

    def value(metrics: MetricValues) -> float | None:
        registered = metrics[key]
        assert registered is None or isinstance(registered, int | float)
        return registered

    def add(kind: type[Own]) -> type[Own]:
        head = label or key.replace("_", " ")
        row = (
            Row(head, lambda metrics, _: number_text(value(metrics)))
            if unit == "1"
            else number_row(head, value, Quantity(unit, ShownUnit(unit, 1.0)))
        )
        metric = Metric[float | None](
            key,
            unit,
            meaning,
            str(getattr(kind, "equation", "")),
            _accumulator_of(kind, last_stretch),
            lambda accumulator: [recorder.value() for recorder in accumulator.recorders],
            row,
            Better(better),
        )
        METRICS.add(key, metric)
        return kind

    return add


def _accumulator_of(kind: type[OwnMetric], last_stretch: bool) -> type[Any]:
    """Return an accumulator class for several runs, with an instance of ``kind`` per run."""

    class OwnAccumulator:
        def __init__(self, runs: JudgedRuns) -> None:
            count = runs.last if last_stretch else runs.samples
            self.recorders = [kind(scene, count) for scene in runs.scenes]

        def take(self, block: SampleBlock) -> None:
            if last_stretch and not block.late:
                return
            samples = block.late_trajectories if last_stretch else block.trajectories
            for recorder, sample in zip(self.recorders, samples, strict=True):
                recorder.take(sample)

    OwnAccumulator.__module__ = kind.__module__  # cached results depend on the metric's sources
    return OwnAccumulator
