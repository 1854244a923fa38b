"""Basins of attraction: the start angles of two balls from which a scene's run ends balanced.

Equal balls that start at the same angle never separate in a simulation. No real run behaves like
that, so such starts are left out.
"""

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.maps.refine import Point
from ab_sim.analysis.metrics import metrics_of
from ab_sim.analysis.metrics.judging import limits_of
from ab_sim.analysis.metrics.verdict import Verdict
from ab_sim.analysis.result_cache import PointCheckpoint
from ab_sim.base.errors import InputError, SceneError
from ab_sim.base.presentation import Column, Columns, Presented, Progress, number
from ab_sim.base.version import __version__
from ab_sim.base.workers import Workers
from ab_sim.design.batch import simulate_batch
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.model.equations.neighbours import at_one_angle, equal_pairs, start_angles
from ab_sim.scene.load import SceneLike, as_scene, changed_scene
from ab_sim.scene.model import Scene

_METRICS = ("verdict", "residual_unbalance", "final_whirl_over_e")
"""Metrics from which the outcome of a run is determined."""
SAMPLES = 1000
"""Minimum number of samples of a run from which metrics are computed."""
_CHUNK = 32
"""Runs per work item of a process: a multiple of the lanes."""

BALANCED, NOT_BALANCED, CHANGING, DIVERGED, CIRCULATING, RINGING_DOWN = 1, 0, 2, 3, 4, 5
"""Labels of outcomes; ``NAMES`` has their meanings."""
LEFT_OUT = -1
"""Label of starts that are not run."""
NAMES = {
    BALANCED: Verdict.BALANCED.value,
    RINGING_DOWN: Verdict.RINGING_DOWN.value,
    NOT_BALANCED: Verdict.NOT_BALANCED.value,
    CHANGING: Verdict.CHANGING.value,
    CIRCULATING: Verdict.CIRCULATES.value,
    DIVERGED: "diverged",
    LEFT_OUT: "left out: equal balls that never part, or overlap",
}
"""Outcomes in words, by label."""
_LABELS = {name: label for label, name in NAMES.items()}


class BasinEnd(NamedTuple):
    """Outcome of a run."""

    label: int
    """Outcome of the run, a key of ``NAMES``."""
    residual_unbalance: float | None
    """Residual |M0 e + sum m_i R exp(i theta_i)| / (M0 e), over the last tenth; None without a
    run."""
    whirl: float | None
    """Root mean square of the whirl over the last tenth [m]; None without a run."""


@dataclass(frozen=True, repr=False)
class Basin(Presented):
    """Outcomes of a scene's run over the start angles of two balls; see ``ab_sim.basin``."""

    _picture = "basin"

    scene: Scene
    """Scene whose first two start angles vary."""
    angles: tuple[float, ...]
    """Start angles of either ball [rad], ascending from -pi."""
    ends: tuple[tuple[BasinEnd, ...], ...]
    """Outcomes; rows by the second ball's angle, columns by the first ball's."""

    @property
    def labels(self) -> np.ndarray:
        """Labels of the outcomes, integers of shape (angles, angles)."""
        return np.array([[end.label for end in row] for row in self.ends])

    @property
    def shares(self) -> dict[int, float]:
        """Shares of the starts that are not left out, by label, the largest first."""
        labels = self.labels[self.labels != LEFT_OUT]
        distinct, counts = np.unique(labels, return_counts=True)
        order = np.argsort(-counts, kind="stable")
        return {int(distinct[k]): float(counts[k] / labels.size) for k in order}

    @property
    def limit(self) -> float:
        """Largest residual unbalance that counts as balanced in the scene."""
        return limits_of(self.scene)[0]

    def _facts(self) -> dict[str, str]:
        balanced = sum(self.shares.get(label, 0.0) for label in (BALANCED, RINGING_DOWN))
        return {
            "scene": self.scene.name,
            "starts": f"{len(self.angles)} x {len(self.angles)}",
            "balanced": f"{100.0 * balanced:.3g} %",
            "to within": number(self.limit, "of M0 e"),
        }

    def _columns(self) -> Columns:
        """Return one row per start, sorted by the second ball's angle, then by the first ball's."""
        ends = [end for row in self.ends for end in row]
        return {
            "ball_0_angle": Column("rad", np.tile(self.angles, len(self.angles))),
            "ball_1_angle": Column("rad", np.repeat(self.angles, len(self.angles))),
            "end": Column(None, [NAMES[end.label] for end in ends]),
            "residual_unbalance": Column("1", [end.residual_unbalance for end in ends]),
            "whirl": Column("m", [end.whirl for end in ends]),
        }

    def report(self) -> dict[str, object]:
        """Return everything as JSON-able values in SI units: see docs/reference/json.md."""
        return {
            "scene": self.scene.name,
            "angles": list(self.angles),
            "limit": self.limit,
            "kinds": [
                {"label": label, "name": NAMES[label], "share": share}
                for label, share in self.shares.items()
            ],
            "labels": self.labels.tolist(),
            "residual_unbalance": [[end.residual_unbalance for end in row] for row in self.ends],
            "final_whirl": [[end.whirl for end in row] for row in self.ends],
            "version": __version__,
        }


def basin(
    scene: SceneLike,
    count: int = 12,
    workers: int = 1,
    *,
    progress: Progress | None = None,
) -> Basin:
    """Map the start angles of two balls from which a run balances: ``ab-sim stability --basin``.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene with an unbalance and at least two balls; the first two start angles vary. Its
        ``balanced.residual_unbalance`` is the criterion of balance, as in every run.
    count : int, default 12
        Number of angles of either ball, over a turn from -pi; from 2 to 1000.
    workers : int, default 1
        Number of processes; more than one needs a program with ``if __name__ == "__main__":``.
    progress : callable, optional
        Called with the current task, the number of finished runs and the total.

    Returns
    -------
    Basin
        ``labels``, integers of shape (count, count), rows by the second ball's angle; ``ends`` with
        residual unbalance and final whirl [m]; ``shares`` of the starts by label.

    Raises
    ------
    SceneError
        The scene has fewer than two balls, no unbalance, or further equal balls that start at one
        angle.
    InputError
        ``count`` is out of range.

    Examples
    --------
    >>> import ab_sim
    >>> basin = ab_sim.basin(ab_sim.load_scene("thesis-hold", ["duration=0.1"]), count=3)
    >>> basin.labels.shape, basin.shares
    ((3, 3), {0: 1.0})
    """
    scene = as_scene(scene)
    _check(scene, count)
    angles = tuple(float(a) for a in np.linspace(-math.pi, math.pi, count, endpoint=False))
    # With equal balls, exchanging them gives the same run: one half of the map is enough.
    alike = (0, 1) in set(equal_pairs(scene))
    pairs = itertools.product(range(count), range(count))
    points = [(i, j) for i, j in pairs if not alike or i <= j]
    numbers = {"count": count}
    ends: dict[Point, list[Any]] = {}
    with Workers(workers) as pool, PointCheckpoint(basin, scene, numbers) as kept:

        def run(wanted: Sequence[Point]) -> Any:
            # Resolve an accuracy once here, not in each part of the work.
            ready = resolve_accuracy(scene, tell=progress)[0] if wanted else scene
            parts = [wanted[k : k + _CHUNK] for k in range(0, len(wanted), _CHUNK)]
            of_part = functools.partial(_ends, ready, count)
            return itertools.chain.from_iterable(pool.each(of_part, parts))

        ends = dict(zip(points, kept.of(points, run, "runs", progress), strict=True))
    rows = [
        tuple(_end(*(ends.get((i, j)) or ends[j, i])) for j in range(count)) for i in range(count)
    ]
    return Basin(scene, angles, tuple(rows))


def _check(scene: Scene, count: int) -> None:
    """Refuse a scene without a basin, or a number of angles that is out of range; see ``basin``."""
    if not 2 <= count <= 1000:
        raise InputError(f"basin: {count} angles: must be from 2 to 1000")
    if scene.balls.count < 2:
        raise SceneError(
            f"balls.count = {scene.balls.count}: a basin is drawn over the start angles of two "
            "balls; give the scene at least 2"
        )
    if scene.eccentric_mass * scene.rotor.eccentricity == 0.0:
        raise SceneError("rotor.eccentricity = 0 m: must be above 0; a basin needs an unbalance")
    angles = start_angles(scene)
    for i, j in equal_pairs(scene):
        if i > 1 and at_one_angle(angles[i], angles[j]):
            raise SceneError(
                f"start.ball_angles: the equal balls {i + 1} and {j + 1} start at one angle and "
                "would never separate; give them different start angles"
            )


def _ends(scene: Scene, count: int, points: Sequence[Point]) -> list[list[Any]]:
    """Run the starts at some points and return their outcomes, JSON-able.

    Parameters
    ----------
    scene
        Scene of the basin.
    count
        Number of angles of either ball.
    points
        Row and column of each start.

    Returns
    -------
    list[list[Any]]
        For each start: name in ``NAMES``, residual unbalance, whirl [m]; None without a run.
    """
    ends: list[list[Any]] = [[NAMES[LEFT_OUT], None, None] for _ in points]
    variations = {}
    for k, point in enumerate(points):
        angles = _start(scene, count, point)
        if angles is not None:
            variations[k] = {"start.ball_angles": angles}
    if not variations:
        return ends
    steps = math.ceil(scene.duration / scene.solver.step)
    every = max(1, steps // SAMPLES)
    batch = simulate_batch(scene, list(variations.values()), every)
    for k, run in zip(variations, batch.runs, strict=True):
        if run.failure:
            ends[k] = [NAMES[DIVERGED], None, None]
            continue
        metrics = metrics_of(run.trajectory, run.scene, _METRICS)
        ends[k] = [metrics.verdict, metrics.residual_unbalance, metrics.final_whirl]
    return ends


def _start(scene: Scene, count: int, point: Point) -> list[float] | None:
    """Return the start angles of all balls at a point [rad]; None if the start is left out.

    Starts are left out where balls would overlap, or where equal balls would never separate.
    """
    row, column = point
    turn = 2.0 * math.pi / count
    angles = [-math.pi + turn * column, -math.pi + turn * row, *start_angles(scene)[2:]]
    if any(at_one_angle(angles[i], angles[j]) for i, j in equal_pairs(scene)):
        return None
    try:
        changed_scene(scene, {"start.ball_angles": angles}, "basin")
    except SceneError:  # overlapping balls: everything else was checked with the scene
        return None
    return angles


def _end(name: str, residual: float | None, whirl: float | None) -> BasinEnd:
    """Return the outcome of a start from the values that ``_ends`` returned for the start."""
    return BasinEnd(_LABELS[name], residual, whirl)
