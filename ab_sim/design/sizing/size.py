"""Sizing from requirements to balls, drag and start-up, with every claim verified by runs."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import ab_sim
from ab_sim.base.errors import InputError
from ab_sim.base.limited_yaml import yaml_text
from ab_sim.base.presentation import Column, Columns, Presented, number
from ab_sim.design.sizing.claims import (
    CONTRADICTED,
    FAR,
    FAR_ABOVE,
    HOLDS,
    DragRuns,
    SizingClaim,
    circulation_claims,
    mass_claim,
    share_claim,
    window_runs,
)
from ab_sim.design.sizing.drag_window import SizedBalls, predicted_share, sized_balls
from ab_sim.design.sizing.settle_time import stuck
from ab_sim.design.sizing.specification import DriveSpecification
from ab_sim.design.sizing.spread_share import Running, SpreadRuns, run_share
from ab_sim.design.sizing.start_up_scene import Hold, scene_of, with_contact
from ab_sim.scene.model import Scene

RUNS = 400
"""Default number of runs of the chosen drive."""
FEWEST, MOST = 20, 100_000
HOLD_LENGTHS = (0.1, 0.2, 0.4, 0.8)
"""Durations of a hold, relative to the settling time, shortest first."""
HOLD_SPEEDS = (1.05, 1.2, 1.4)
"""Speeds of a hold, relative to the critical speed."""
PARTS = (1 / 16, 1 / 4, 1)
"""Shares of the runs after which a design is given up if its whole interval is below the share
wanted."""
PREDICTED_AT = 60
"""Number of drags of a predicted curve."""


@dataclass(frozen=True, repr=False)
class Sizing(Presented):
    """Balls, drag and start-up that balance a range of unbalance; see ``ab_sim.size``."""

    _picture = "sizing"

    specification: DriveSpecification
    candidates: tuple[SizedBalls, ...]
    """Candidates, one per number of balls."""
    chosen: SizedBalls | None
    """Chosen balls; None if nothing was found."""
    hold: Hold | None
    """Hold of the start-up; None if it needs none."""
    scene: Scene | None
    """Start-up of the chosen drive, with the largest unbalance and colliding balls."""
    runs: SpreadRuns | None
    """Runs of that scene over its spread."""
    at_drags: dict[str, DragRuns]
    """Runs at the lowest and highest drag of its window, and far above it."""
    claims: tuple[SizingClaim, ...]
    """Claims with the results of runs."""
    tried: tuple[tuple[int, SpreadRuns], ...]
    """Numbers of balls with too few balanced runs, and these runs."""

    @property
    def found(self) -> bool:
        """Flag of a successful sizing."""
        return self.chosen is not None

    def predicted(self) -> tuple[np.ndarray, np.ndarray]:
        """Return drags [N s/m] and predicted shares of the chosen balls, each of shape (drags,)."""
        chosen = self.chosen
        if chosen is None or chosen.window is None or chosen.balls is None:
            return np.empty(0), np.empty(0)
        window, balls = chosen.window, chosen.balls
        drags = np.geomspace(0.3 * window.low, 2.0 * FAR * window.high, PREDICTED_AT)
        shares = [predicted_share(balls, self.specification, each) for each in drags.tolist()]
        return drags, np.array(shares)

    def scene_text(self) -> str:
        """Return the scene's file with a header on its origin; empty without a scene."""
        if self.scene is None:
            return ""
        lines = [f"made by ab-sim size {ab_sim.__version__}, for"]
        lines += [f"  {key}: {value:.6g}" for key, value in self.specification._asdict().items()]
        lines += [f"{c.claim}: {c.predicted}; runs: {c.seen} ({c.verdict})" for c in self.claims]
        head = "".join(f"# {line}\n" for line in lines)
        return head + yaml_text(self.scene.as_mapping())

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values in SI units; see ``ab-sim size --help``."""
        return {
            "specification": self.specification._asdict(),
            "found": self.found,
            "candidates": [each.report() for each in self.candidates],
            "chosen": None if self.chosen is None else self.chosen.report(),
            "hold": None if self.hold is None else self.hold._asdict(),
            "runs": None if self.runs is None else self.runs.report(),
            "at_drags": {name: each.report() for name, each in self.at_drags.items()},
            "claims": [each._asdict() for each in self.claims],
            "tried": [{"balls": count, **runs.report()} for count, runs in self.tried],
            "scene": None if self.scene is None else self.scene.as_mapping(),
            "version": ab_sim.__version__,
        }

    def _facts(self) -> dict[str, str]:
        chosen = self.chosen
        if chosen is None or chosen.balls is None or self.runs is None:
            return {"found": "nothing"}
        return {
            "balls": str(chosen.count),
            "mass": number(chosen.balls.mass, "kg"),
            "radius": number(chosen.balls.radius, "m"),
            "drag": number(chosen.drag, "N s/m"),
            "hold": "none" if self.hold is None else number(self.hold.duration, "s"),
            "balanced": f"{100 * self.runs.share.value:.1f} %",
        }

    def _columns(self) -> Columns:
        rows = [each.report() for each in self.candidates]
        units = {
            "balls": "1", "mass": "kg", "radius": "m", "balances": "kg m", "heavier": "1",
            "circulation_border": "N s/m", "drag_low": "N s/m", "drag_high": "N s/m",
            "drag": "N s/m", "predicted_share": "1", "why_not": None,
        }  # fmt: skip
        return {name: Column(unit, [row[name] for row in rows]) for name, unit in units.items()}


def run_sizing(specification: DriveSpecification, running: Running) -> Sizing:
    """Size a balancer, and verify the claims by runs.

    Numbers of balls are tried in order of their drag window's width, with a hold if necessary,
    until enough drives are balanced in time.

    Args:
        specification: requirements.
        running: settings of the runs.

    Raises:
        InputError: the number of runs is out of range, or another process is computing the same.
    """
    if not FEWEST <= running.runs <= MOST:
        raise InputError(f"runs = {running.runs}: must be from {FEWEST} to {MOST}")
    candidates = tuple(sized_balls(count, specification) for count in specification.counts)
    tried: list[tuple[int, SpreadRuns]] = []
    for sized in _ranked(candidates):
        without = _run(sized, None, specification, running)
        hold, runs = None, without
        if without.share.value < specification.share:
            for hold in _holds(specification):
                runs = _run(sized, hold, specification, running)
                if runs.share.value >= specification.share:
                    break
        if runs.share.value < specification.share:
            tried.append((sized.count, without))
            continue
        return _checked(candidates, sized, hold, (without, runs), (specification, running), tried)
    return Sizing(specification, candidates, None, None, None, None, {}, (), tuple(tried))


def _checked(
    candidates: tuple[SizedBalls, ...],
    sized: SizedBalls,
    hold: Hold | None,
    runs: tuple[SpreadRuns, SpreadRuns],
    asked: tuple[DriveSpecification, Running],
    tried: list[tuple[int, SpreadRuns]],
) -> Sizing:
    specification, running = asked
    without, own = runs
    balls = sized.balls
    assert balls is not None
    at_drags = window_runs(
        sized, specification, running, lambda drag: predicted_share(balls, specification, drag)
    )
    smooth = specification._replace(friction_arm=0.0)
    claims = [
        mass_claim(sized, smooth),
        *circulation_claims(sized, smooth),
        *_claims_of_shares(specification, hold, (without, own), at_drags),
    ]
    return Sizing(
        specification,
        candidates,
        sized,
        hold,
        _scene(sized, hold, specification),
        own,
        at_drags,
        tuple(claims),
        tuple(tried),
    )


def _claims_of_shares(
    specification: DriveSpecification,
    hold: Hold | None,
    runs: tuple[SpreadRuns, SpreadRuns],
    at_drags: dict[str, DragRuns],
) -> Iterator[SizingClaim]:
    wanted, (without, own) = specification.share, runs
    if hold is None:
        text = f"without a hold, balanced {specification.settle:g} s after the speed is reached"
        yield share_claim(text, own, wanted)
    else:
        text = f"with a hold of {hold.duration:.3g} s at {hold.start_speed:.4g} rad/s, balanced"
        yield share_claim(text, own, wanted)
        yield share_claim("without it", without, wanted, at_least=False)
    for name, found in at_drags.items():
        at_least = name != FAR_ABOVE
        what = f"window, {name}" if at_least else f"{FAR:g} times the highest"
        text = f"{what}: at {found.drag:.3g} N s/m, balanced"
        if at_least or found.predicted < wanted:
            yield share_claim(text, found.runs, wanted, at_least)
    circulating = own.circulating + sum(each.runs.circulating for each in at_drags.values())
    count = own.share.runs + sum(each.runs.share.runs for each in at_drags.values())
    yield SizingClaim(
        "of all these runs, with balls that circulate",
        "0",
        f"{circulating} of {count}",
        HOLDS if circulating == 0 else CONTRADICTED,
    )


def _ranked(candidates: tuple[SizedBalls, ...]) -> list[SizedBalls]:
    """Return suitable candidates, the widest window first, as drag is the most uncertain value."""

    def width(each: SizedBalls) -> float:
        return 0.0 if each.window is None else each.window.ratio

    return sorted((each for each in candidates if each.why_not is None), key=width, reverse=True)


def _holds(specification: DriveSpecification) -> Iterator[Hold]:
    for length in HOLD_LENGTHS:
        for factor in HOLD_SPEEDS:
            start = factor * specification.critical_speed
            if start < specification.speed:
                yield Hold(start, length * specification.settle)


def _scene(sized: SizedBalls, hold: Hold | None, specification: DriveSpecification) -> Scene:
    assert sized.balls is not None and sized.drag is not None
    return with_contact(scene_of(sized.balls, specification, sized.drag, hold))


def _run(
    sized: SizedBalls, hold: Hold | None, specification: DriveSpecification, running: Running
) -> SpreadRuns:
    """Run a design over its spread; only a part of the runs where these rule it out."""
    scene = _scene(sized, hold, specification)
    pause = "" if hold is None else f", hold of {hold.duration:.3g} s at {hold.start_speed:.4g}"
    stage = running.at_stage(f"{sized.count} balls{pause}")
    # Runs of a part are found again by the whole.
    for part in PARTS:
        runs = max(FEWEST, round(part * running.runs))
        share = run_share(scene, specification, stage._replace(runs=min(runs, running.runs)))
        # Most of a dozen holds fail, and running all of each would take minutes: a hold must reach
        # the share itself in a part of the runs, not only with its interval.
        decisive = hold is not None and part == PARTS[-2]
        if (share.share.value if decisive else share.share.high) < specification.share:
            break
    return share


def sizing_failure(found: Sizing) -> str:
    """Return the reason why nothing could be sized, and the remedy."""
    if not found.tried:
        reasons = {each.count: each.why_not for each in found.candidates}
        reasons_text = "; ".join(f"{count} balls: {why}" for count, why in reasons.items())
        return f"nothing can be sized: {reasons_text}"
    wanted = 100.0 * found.specification.share
    runs = "; ".join(
        f"{count} balls: {100 * each.share.value:.1f} % balanced" for count, each in found.tried
    )
    holds = len(list(_holds(found.specification)))  # all were tried
    also = f", also with each of {holds} holds of the speed (variable-speed periods)"
    stuck = _where_balls_stick(found)
    advice = "give more time to settle, or ask for a smaller share"
    if stuck:
        advice = f"{stuck}; lower the friction, leave more unbalance, or ask for a smaller share"
    return (
        f"nothing can be sized: runs contradict the prediction of {wanted:g} % ({runs})"
        f"{also if holds else ''}; {advice}"
    )


def _where_balls_stick(found: Sizing) -> str:
    """Return the whirl and unbalance left by sticking balls, as text; empty without friction."""
    specification = found.specification
    if specification.friction_arm == 0.0:
        return ""
    each = []
    for sized in found.candidates:
        if sized.balls is not None and any(sized.count == count for count, _ in found.tried):
            whirl, left = stuck(sized.balls, specification)
            part = 100.0 * left / specification.limit
            each.append(f"{sized.count} balls: {1e6 * whirl:.3g} um, {part:.0f} %")
    return (
        "balls stick anywhere on the race once the whirl is below W = R arm / a, which may leave "
        f"so much of the unbalance allowed, for any time to settle ({'; '.join(each)})"
    )
