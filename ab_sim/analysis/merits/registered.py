"""User-defined metrics."""

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

from ab_sim.analysis.merits.judging import JudgedRuns, Piece
from ab_sim.analysis.merits.merit import Better, Merit, MeritValues, Row, WhirlScale, register
from ab_sim.analysis.merits.wording import number_text
from ab_sim.drive.trajectory import Trajectory
from ab_sim.errors import InputError
from ab_sim.scene.model import Scene


class OwnMerit(Protocol):
    """Accumulator of a user-defined metric, created for each run; may have a text ``equation``."""

    def __init__(self, scene: Scene, samples: int) -> None:
        """Prepare for ``samples`` samples of a run of the scene."""

    def take(self, piece: Trajectory) -> None:
        """Process the next samples, at least one."""

    def value(self) -> float | None:
        """Return the value after the last sample in SI units; None if it is undefined."""


Own = TypeVar("Own", bound=OwnMerit)


def register_own(
    key: str, unit: str, meaning: str, label: str, last_stretch: bool, better: str
) -> Callable[[type[Own]], type[Own]]:
    """Return a class decorator: see ``ab_sim.register_merit``."""
    if better not in {each.value for each in Better}:
        raise InputError(
            f"better = {better!r}: must be one of {', '.join(each.value for each in Better)}"
        )

    def text(merits: MeritValues, scale: WhirlScale) -> str:
        value = merits[key]
        assert value is None or isinstance(value, int | float)
        return number_text(value)

    def add(kind: type[Own]) -> type[Own]:
        head = label or key.replace("_", " ")
        row = Row(head if unit == "1" else f"{head} [{unit}]", text)
        watch, equation = _watch_of(kind, last_stretch), str(getattr(kind, "equation", ""))
        register(
            Merit[float | None](
                key,
                unit,
                meaning,
                equation,
                watch,
                lambda each: [own.value() for own in each.own],
                row,
                Better(better),
            )
        )
        return kind

    return add


def _watch_of(kind: type[OwnMerit], last_stretch: bool) -> type[Any]:
    class OwnWatch:
        def __init__(self, runs: JudgedRuns) -> None:
            count = runs.last if last_stretch else runs.samples
            self.own = [kind(scene, count) for scene in runs.scenes]

        def take(self, piece: Piece) -> None:
            if last_stretch and not piece.late:
                return
            samples = piece.late_trajectories if last_stretch else piece.trajectories
            for own, each in zip(self.own, samples, strict=True):
                own.take(each)

    OwnWatch.__module__ = kind.__module__  # cached results depend on the metric's sources
    return OwnWatch
