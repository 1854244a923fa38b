"""Claims of a sizing, verified by runs of its start-up scene."""

import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.circulating import drive_of, stalled, state_of_bunch
from ab_sim.analysis.equilibria.resting import resting_system
from ab_sim.analysis.metrics.verdict import Verdict
from ab_sim.base.presentation import LAST, Progress
from ab_sim.design.batch import simulate_batch
from ab_sim.design.draws import DrawnPoints
from ab_sim.design.judged import FAILED, FAILURE, OUTCOME, Job, metric_values
from ab_sim.design.sizing.closed_forms import FittingBalls
from ab_sim.design.sizing.drag_window import SizedBalls
from ab_sim.design.sizing.specification import DriveSpecification
from ab_sim.design.spread import share_text
from ab_sim.design.statistics import ShareBalanced, share_of
from ab_sim.design.tolerances import Tolerance, tolerance_of
from ab_sim.design.work import Executor, rows_of
from ab_sim.drive import Drive
from ab_sim.scene.load import changed_scene, check_scene
from ab_sim.scene.model import Scene

_TURN_OF_A_STEP = 0.2
"""Largest spindle angle of a step [rad]."""
_RESTITUTION = 0.5
"""Restitution coefficient of colliding balls."""
NAME = "sized"
"""Name of the sized scene."""


class Hold(NamedTuple):
    """Variable-speed period that holds the speed."""

    start_speed: float
    """Speed that the start-up holds [rad/s]."""
    duration: float
    """Duration of the hold [s]."""


def scene_of(
    balls: FittingBalls,
    specification: DriveSpecification,
    drag: float,
    hold: Hold | None = None,
) -> Scene:
    """Return the scene of a start-up with the largest unbalance.

    The last tenth of the run, over which final metrics are taken, starts ``specification.settle``
    after the running speed is reached.

    Parameters
    ----------
    balls, specification
        Balls and drive.
    drag
        Drag c_b on a ball [N s/m].
    hold
        Hold of the speed, or None.
    """
    speed, acceleration = specification.speed, specification.acceleration
    profile: dict[str, Any] = {
        "kind": "start_up",
        "acceleration": acceleration,
        "target_speed": speed,
    }
    reached = speed / acceleration
    if hold is not None:
        profile["variable_speed_period"] = hold._asdict()
        reached += hold.duration
    count = balls.count
    friction = [{"rolling_friction": {"arm": specification.friction_arm}}]
    content = {
        "name": NAME,
        "rotor": {
            "mass": specification.mass,
            "eccentricity": specification.largest_unbalance / specification.mass,
        },
        "race": {"radius": balls.path_radius},
        "balls": {"count": count, "mass": balls.mass, "radius": balls.radius},
        "effects": [
            {
                "suspension": {
                    "stiffness": specification.stiffness,
                    "damping": specification.damping,
                }
            },
            {"viscous_drag": {"coefficient": drag}},
            "spindle_acceleration",
            "ball_spin",
            *(friction if specification.friction_arm > 0.0 else ()),
        ],
        # Start at different angles: equal balls at one place never separate.
        "start": {
            "ball_angles": [round(2.0 * math.pi * (k / count) ** 1.2, 4) for k in range(count)]
        },
        "spindle": {"max_speed": 1.2 * speed, "max_acceleration": 1.2 * acceleration},
        "profile": profile,
        "solver": {"step": step_at(speed)},
        "balanced": {"residual_unbalance": specification.residual},
        "duration": (reached + specification.settle) / (1.0 - LAST),
    }
    return check_scene(content, NAME)


def with_contact(scene: Scene) -> Scene:
    """Return the scene with colliding balls."""
    changes = {"effects.ball_contact": {"restitution_coefficient": _RESTITUTION}}
    return changed_scene(scene, changes, NAME)


def step_at(speed: float) -> float:
    """Return a round step [s] in which the spindle turns by at most ``_TURN_OF_A_STEP``."""
    most = min(_TURN_OF_A_STEP / speed, 1e-3)
    decade = 10.0 ** math.floor(math.log10(most))
    return max(
        round(digit * decade, 12) for digit in (1, 2, 5) if digit * decade <= most * 1.000001
    )


_GRADE, _PEAK = "balance_grade", "peak_whirl_over_e"
"""Metrics from which claims are judged."""
_GRADE_UNIT = 1e3
"""Factor from m/s to the metric's unit, mm/s."""


class SpreadRuns(NamedTuple):
    """Runs of one design over its spread."""

    share: ShareBalanced
    """Share of drives within the allowed residual unbalance and without circulating balls."""
    circulating: int
    """Number of runs that end with circulating balls."""
    failed: int
    """Number of failed runs."""
    failure: str | None
    """Error message of the first failed run; None if no run failed."""
    peak_whirl: float
    """Median of the largest whirl during the start-up [m]."""

    def report(self) -> dict[str, Any]:
        """Return the runs as JSON-able values."""
        return {**self._asdict(), "share": self.share.report()}


class Running(NamedTuple):
    """Number and seed of the runs of a design, and the executor that performs them."""

    runs: int
    """Number of runs of a design."""
    seed: int
    """Seed of the draws."""
    executor: Executor
    """Executor of the runs, entered by ``run_sizing``."""
    tell: Progress | None
    """Progress callback; None for none."""

    def at_stage(self, name: str) -> "Running":
        """Return these settings with a stage's name in front of each progress message."""
        tell = self.tell
        if tell is None:
            return self

        def tell_stage(what: str, done: int, total: int) -> None:
            tell(f"{name}: {what}", done, total)

        return self._replace(tell=tell_stage)


def _tolerances_of(specification: DriveSpecification, drag_too: bool = True) -> list[Tolerance]:
    """Return the tolerances of unbalance, start angles and, if ``drag_too``, drag."""
    mass = specification.mass
    low, high = specification.least_unbalance / mass, specification.largest_unbalance / mass
    written = [f"rotor.eccentricity=uniform:{low!r},{high!r}", "start.ball_angles=random"]
    if drag_too and specification.drag_tolerance > 0.0:
        percent = 100.0 * specification.drag_tolerance
        written.append(f"effects.viscous_drag.coefficient=uniform:{percent!r}%")
    return [tolerance_of(text) for text in written]


def run_share(
    scene: Scene, specification: DriveSpecification, running: Running, drag_too: bool = True
) -> SpreadRuns:
    """Run a design over its spread.

    Unlike ``robust``, a drive with an unsettled whirl can count as balanced: only its residual
    unbalance at the end of the settling time counts.

    Parameters
    ----------
    scene
        Nominal scene.
    specification
        Specification with spread and allowed residual.
    running
        Settings of the runs.
    drag_too
        Whether the drag varies as well.
    """
    drawn = DrawnPoints(scene, _tolerances_of(specification, drag_too), running.runs, running.seed)
    job = Job(scene, drawn.keys, (_GRADE, _PEAK))
    rows = rows_of(job, drawn, running.executor, running.tell)
    outcomes = np.array(rows[OUTCOME].to_pylist())
    limit = _GRADE_UNIT * specification.limit / scene.total_mass * specification.speed
    balanced = (metric_values(rows, _GRADE) <= limit) & (outcomes != Verdict.CIRCULATES.value)
    keys = drawn.keys.index("rotor.eccentricity")
    whirls = metric_values(rows, _PEAK) * [drawn.at(run)[keys] for run in range(len(drawn))]
    failures = [failure for failure in rows[FAILURE].to_pylist() if failure]
    return SpreadRuns(
        share_of(balanced),
        int(np.count_nonzero(outcomes == Verdict.CIRCULATES.value)),
        int(np.count_nonzero(outcomes == FAILED)),
        failures[0] if failures else None,
        float(np.nanmedian(whirls)) if np.isfinite(whirls).any() else float("nan"),
    )


HOLDS, CONTRADICTED, UNDECIDED = "holds", "contradicted", "undecided"
_TOO_LIGHT = 0.8
"""Fraction of the required ball moment at which a run must show that balls are too light."""
CLOSE = 0.02
"""Tolerance of the residual, as a fraction of the unbalance."""
_BESIDE = 0.05
"""Relative distance of the two tested drags, one on each side, from the circulation border."""
FAR = 10.0
"""Drag, as a multiple of the window's highest drag, at which too few drives balance in time."""
_SAME_SPEED = 0.03
"""Largest relative difference from the bunch's speed at which a ball belongs to the bunch."""
NEARER = 4
"""Number of times a window's end is moved half-way to the chosen drag."""
FAR_ABOVE, _BY_RUNS = "far above", ", by runs"
"""Name of the drag above the window, and suffix of corrected drags."""


class SizingClaim(NamedTuple):
    """Claim of a sizing, with the result of runs."""

    claim: str
    """Claim in words, without the predicted value."""
    predicted: str
    """Predicted value, as text."""
    seen: str
    """Result of the runs, as text."""
    verdict: str
    """Verdict: holds, contradicted, or undecided if the runs are too few."""


class DragRuns(NamedTuple):
    """Runs over the spread at one drag, with the prediction."""

    drag: float
    """Drag [N s/m]."""
    predicted: float
    """Predicted share of drives balanced in time."""
    runs: SpreadRuns
    """Runs of drives with the drag ``drag``."""

    def report(self) -> dict[str, Any]:
        """Return the runs as JSON-able values."""
        return {"drag": self.drag, "predicted": self.predicted, **self.runs.report()}


def share_claim(text: str, runs: SpreadRuns, wanted: float, at_least: bool = True) -> SizingClaim:
    """Test a claim on the share of balanced drives by its confidence interval.

    Parameters
    ----------
    text
        Claim in words.
    runs
        Runs of a design over its spread.
    wanted
        Required share, 0 to 1.
    at_least
        True for the claim that the share is at least ``wanted``, False for below.
    """
    share = runs.share
    above, below = share.low >= wanted, share.high < wanted
    if above or below:
        verdict = HOLDS if above == at_least else CONTRADICTED
    else:
        verdict = UNDECIDED
    sign = "at least" if at_least else "below"
    return SizingClaim(text, f"{sign} {100 * wanted:g} %", share_text(share), verdict)


def mass_claim(sized: SizedBalls, specification: DriveSpecification) -> SizingClaim:
    """Test the claim that balls with 0.8 of the least n m R leave 0.2 of the largest unbalance."""
    balls, drag = sized.balls, sized.drag
    assert balls is not None and drag is not None
    scene = scene_of(balls, specification, drag)
    light = _TOO_LIGHT * specification.largest_unbalance / balls.moment * balls.mass
    # The settling time grows with the inverse square of the ball mass: light balls feel less force
    # and cause less whirl. Run long enough for them.
    longer = scene.duration + 3.0 * specification.settle * (balls.mass / light) ** 2
    lighter = changed_scene(scene, {"balls.mass": light, "duration": longer}, scene.name)
    run = simulate_batch(lighter, [{}]).runs[0]
    residual = 1.0 - _TOO_LIGHT
    last = run.trajectory.ball_angles[-max(1, len(run.trajectory) // 10) :]
    moved = light * balls.path_radius * np.exp(1j * last).sum(axis=1)
    seen = float(np.sqrt(np.mean(np.abs(1.0 + moved / specification.largest_unbalance) ** 2)))
    return SizingClaim(
        f"balls with {_TOO_LIGHT:g} of the moment needed are too light and leave",
        f"{residual:.3f} of the unbalance",
        f"{seen:.3f} of the unbalance",
        HOLDS if abs(seen - residual) <= CLOSE else CONTRADICTED,
    )


def circulation_claims(sized: SizedBalls, specification: DriveSpecification) -> list[SizingClaim]:
    """Test the claims that a bunch persists just below the border's drag and stops just above."""
    balls = sized.balls
    assert balls is not None
    claims = []
    for factor, stays in ((1.0 - _BESIDE, True), (1.0 + _BESIDE, False)):
        drag = factor * sized.border
        scene = scene_of(balls, specification, drag)
        where = f"at {factor:g} of the border, {drag:.3g} N s/m, a bunch that circulates"
        prediction = "stays" if stays else "comes to rest"
        seen = bunch_stays(scene, specification.speed, sized.border * (1.0 - 1e-6))
        if seen is None:
            verdict, outcome = UNDECIDED, "unknown: its swings are too large"
        else:
            verdict = HOLDS if seen == stays else CONTRADICTED
            outcome = "stays" if seen else "comes to rest"
        claims.append(SizingClaim(where, prediction, outcome, verdict))
    return claims


def bunch_stays(scene: Scene, speed: float, border: float) -> bool | None:
    """Return whether a bunch of all balls continues to circulate at constant speed.

    Parameters
    ----------
    scene
        Scene, whose drag may be above the border; balls do not collide.
    speed
        Spindle speed w [rad/s].
    border
        Drag with such a state, from which the run starts if there is none at the scene's drag.

    Returns
    -------
    bool | None
        The result; None if no such state is known.
    """
    step = step_at(speed)
    held = changed_scene(
        scene, {"start.speed": speed, "solver.step": step, "profile": None}, scene.name
    )
    numbers = drive_of(held)
    if numbers is None:
        return None
    bunch = stalled(numbers, speed, numbers.balls)
    if bunch is None:
        bunch = stalled(numbers._replace(drag=border), speed, numbers.balls)
    if bunch is None:
        return None
    # Start near the bunch. Small disturbances of the angles let an unstable bunch separate, which
    # equal balls at one place never would.
    state = state_of_bunch(resting_system(held), bunch)
    n = numbers.balls
    state[4 : 4 + n] += 1e-2 * np.random.default_rng(0).normal(size=n)
    slowest = max(numbers.rolling_mass / numbers.drag, numbers.mass / numbers.damping)
    run = Drive(held)
    run.restore(run.snapshot()._replace(state=state))
    done = run.advance(math.ceil(60.0 * slowest / step), every=10)
    half, time = len(done) // 2, done["time"]
    speeds = speed + np.polyfit(time[half:] - time[half], done.ball_angles[half:], 1)[0]
    # A ball at rest on the rotor turns with the spindle.
    return bool((np.abs(speeds - bunch.speed) < _SAME_SPEED * bunch.speed).all())


def window_runs(
    sized: SizedBalls, specification: DriveSpecification, running: Running, predict: Any
) -> dict[str, DragRuns]:
    """Run drives over the spread at the ends of a drag window, and far above it.

    If runs contradict an end, another end nearer to the chosen drag is sought.

    Parameters
    ----------
    sized
        Balls with a drag window.
    specification, running
        See ``run_share``.
    predict
        Function that returns the predicted share at a drag [N s/m].

    Returns
    -------
    dict[str, DragRuns]
        Runs by the name of the drag: ``lowest``, ``highest`` and ``FAR_ABOVE``, and corrected ends
        with the suffix ``_BY_RUNS``.
    """
    balls, window = sized.balls, sized.window
    assert balls is not None and window is not None
    drags = {"lowest": window.low, "highest": window.high, FAR_ABOVE: FAR * window.high}
    runs_by_name = {}

    def run_at(name: str, drag: float) -> SpreadRuns:
        scene = with_contact(scene_of(balls, specification, drag))
        stage = running.at_stage(f"drag {name}, {drag:.3g} N s/m")
        runs = run_share(scene, specification, stage, drag_too=False)
        runs_by_name[name] = DragRuns(drag, predict(drag), runs)
        return runs

    for name, drag in drags.items():
        runs = run_at(name, drag)
        if name == FAR_ABOVE or runs.share.high >= specification.share:
            continue
        for _ in range(NEARER):
            drag = math.sqrt(drag * float(sized.drag or drag))
            if run_at(name + _BY_RUNS, drag).share.value >= specification.share:
                break
        else:
            del runs_by_name[name + _BY_RUNS]
    return runs_by_name
