"""Claims of a sizing, verified by runs."""

import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.circulating import drive_of, stalled, state_of_bunch
from ab_sim.analysis.equilibria.resting import resting_system
from ab_sim.design.batch import simulate_batch
from ab_sim.design.sizing.drag_window import SizedBalls
from ab_sim.design.sizing.specification import DriveSpecification
from ab_sim.design.sizing.spread_share import Running, SpreadRuns, run_share
from ab_sim.design.sizing.start_up_scene import scene_of, step_at, with_contact
from ab_sim.design.spread import share_text
from ab_sim.drive import Drive
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

HOLDS, CONTRADICTED, UNDECIDED = "holds", "contradicted", "undecided"
TOO_LIGHT = 0.8
"""Fraction of the required ball moment with which balls are shown to be too light."""
CLOSE = 0.02
"""Tolerance of the residual, as a fraction of the unbalance."""
BESIDE = 0.05
"""Relative distance from the circulation border at which both sides are tested."""
FAR = 10.0
"""Drag, as a multiple of the window's highest, at which too few drives must balance in time."""
SAME_SPEED = 0.03
NEARER = 4
"""Number of times a window's end is moved half-way to the chosen drag."""
FAR_ABOVE, BY_RUNS = "far above", ", by runs"
"""Name of the drag above the window, and suffix of corrected drags."""


class SizingClaim(NamedTuple):
    """Claim of a sizing, with the result of runs."""

    claim: str
    predicted: str
    seen: str
    verdict: str
    """Verdict: holds, contradicted, or undecided if the runs are too few."""


class DragRuns(NamedTuple):
    """Runs over the spread at one drag, with the prediction."""

    drag: float
    """Drag [N s/m]."""
    predicted: float
    """Predicted share of drives balanced in time."""
    runs: SpreadRuns

    def report(self) -> dict[str, Any]:
        """Return the runs as JSON-able values."""
        return {"drag": self.drag, "predicted": self.predicted, **self.runs.report()}


def share_claim(text: str, runs: SpreadRuns, wanted: float, at_least: bool = True) -> SizingClaim:
    """Test the claim that a share is at least, or below, the required one, by its interval."""
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
    light = TOO_LIGHT * specification.largest_unbalance / balls.moment * balls.mass
    # The settling time grows with the inverse square of the ball mass.
    longer = scene.duration + 3.0 * specification.settle * (balls.mass / light) ** 2
    lighter = changed_scene(scene, {"balls.mass": light, "duration": longer}, scene.name)
    run = simulate_batch(lighter, [{}]).runs[0]
    residual = 1.0 - TOO_LIGHT
    last = run.trajectory.ball_angles[-max(1, len(run.trajectory) // 10) :]
    moved = light * balls.path_radius * np.exp(1j * last).sum(axis=1)
    seen = float(np.sqrt(np.mean(np.abs(1.0 + moved / specification.largest_unbalance) ** 2)))
    return SizingClaim(
        f"balls with {TOO_LIGHT:g} of the moment needed are too light and leave",
        f"{residual:.3f} of the unbalance",
        f"{seen:.3f} of the unbalance",
        HOLDS if abs(seen - residual) <= CLOSE else CONTRADICTED,
    )


def circulation_claims(sized: SizedBalls, specification: DriveSpecification) -> list[SizingClaim]:
    """Test the claims that a bunch persists just below the border's drag and stops just above."""
    balls = sized.balls
    assert balls is not None
    claims = []
    for factor, stays in ((1.0 - BESIDE, True), (1.0 + BESIDE, False)):
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

    Args:
        scene: scene, whose drag may be above the border; balls do not collide.
        speed: spindle speed w [rad/s].
        border: drag with such a state, from which the run starts if there is none at the scene's
            drag.

    Returns:
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
    return bool((np.abs(speeds - bunch.speed) < SAME_SPEED * bunch.speed).all())


def window_runs(
    sized: SizedBalls, specification: DriveSpecification, running: Running, predict: Any
) -> dict[str, DragRuns]:
    """Run drives over the spread at the ends of a drag window, and far above it.

    If runs contradict an end, another end nearer to the chosen drag is sought.

    Args:
        sized: balls with a drag window.
        specification, running: see ``run_share``.
        predict: function that returns the predicted share at a drag.
    """
    balls, window = sized.balls, sized.window
    assert balls is not None and window is not None
    drags = {"lowest": window.low, "highest": window.high, FAR_ABOVE: FAR * window.high}
    runs_by_name = {}

    def look(name: str, drag: float) -> SpreadRuns:
        scene = with_contact(scene_of(balls, specification, drag))
        stage = running.at_stage(f"drag {name}, {drag:.3g} N s/m")
        runs = run_share(scene, specification, stage, drag_too=False)
        runs_by_name[name] = DragRuns(drag, predict(drag), runs)
        return runs

    for name, drag in drags.items():
        runs = look(name, drag)
        if name == FAR_ABOVE or runs.share.high >= specification.share:
            continue
        for _ in range(NEARER):
            drag = math.sqrt(drag * float(sized.drag or drag))
            if look(name + BY_RUNS, drag).share.value >= specification.share:
                break
        else:
            del runs_by_name[name + BY_RUNS]
    return runs_by_name
