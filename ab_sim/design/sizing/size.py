"""Sizing from requirements to balls, drag and start-up, with every claim verified by runs."""

import functools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Column, Columns, Presented, number
from ab_sim.base.version import __version__
from ab_sim.base.yaml_files import yaml_text
from ab_sim.design.sizing.claims import (
    CONTRADICTED,
    FAR,
    FAR_ABOVE,
    HOLDS,
    DragRuns,
    Hold,
    Running,
    SizingClaim,
    SpreadRuns,
    circulation_claims,
    mass_claim,
    run_share,
    scene_of,
    share_claim,
    window_runs,
    with_contact,
)
from ab_sim.design.sizing.closed_forms import stuck
from ab_sim.design.sizing.drag_window import SizedBalls, predicted_share, sized_balls
from ab_sim.design.sizing.specification import DriveSpecification
from ab_sim.scene.model import Scene

RUNS = 400
"""Default number of runs of the chosen drive."""
_FEWEST, MOST = 20, 100_000
"""Limits of the number of runs."""
_HOLD_LENGTHS = (0.1, 0.2, 0.4, 0.8)
"""Durations of a hold, relative to the settling time, shortest first."""
_HOLD_SPEEDS = (1.05, 1.2, 1.4)
"""Speeds of a hold, relative to the critical speed."""
PARTS = (1 / 16, 1 / 4, 1)
"""Fractions of the runs after which a design is abandoned if the whole interval of its share is
below the required share."""
_PREDICTED_AT = 60
"""Number of drags of a predicted curve."""


@dataclass(frozen=True, repr=False)
class Sizing(Presented):
    """Balls, drag and start-up that balance a range of unbalance; see ``ab_sim.size``."""

    _picture = "sizing"

    specification: DriveSpecification
    """Requirements."""
    candidates: tuple[SizedBalls, ...]
    """Candidates, one per number of balls."""
    chosen: SizedBalls | None
    """Chosen balls; None if nothing was found."""
    hold: Hold | None
    """Speed and duration that the start-up holds; None for a start-up without a hold."""
    scene: Scene | None
    """Start-up of the chosen drive, with the largest unbalance and colliding balls."""
    runs: SpreadRuns | None
    """Runs of ``scene`` over its spread, if any."""
    at_drags: dict[str, DragRuns]
    """Runs at the lowest and highest drag of the drag window, and far above the window."""
    claims: tuple[SizingClaim, ...]
    """Claims with the results of runs."""
    tried: tuple[tuple[int, SpreadRuns], ...]
    """Rejected numbers of balls, each with the runs of which too few balanced."""

    @property
    def found(self) -> bool:
        """True if a balancer was found."""
        return self.chosen is not None

    def predicted(self) -> tuple[np.ndarray, np.ndarray]:
        """Return drags [N s/m] and predicted shares of the chosen balls, each of shape (drags,)."""
        chosen = self.chosen
        if chosen is None or chosen.window is None or chosen.balls is None:
            return np.empty(0), np.empty(0)
        window, balls = chosen.window, chosen.balls
        drags = np.geomspace(0.3 * window.low, 2.0 * FAR * window.high, _PREDICTED_AT)
        shares = [predicted_share(balls, self.specification, drag) for drag in drags.tolist()]
        return drags, np.array(shares)

    def scene_text(self) -> str:
        """Return the scene's file with a header on its origin; empty without a scene."""
        if self.scene is None:
            return ""
        lines = [f"made by ab-sim size {__version__}, for"]
        lines += [f"  {key}: {value:.6g}" for key, value in self.specification._asdict().items()]
        lines += [f"{c.claim}: {c.predicted}; runs: {c.seen} ({c.verdict})" for c in self.claims]
        head = "".join(f"# {line}\n" for line in lines)
        return head + yaml_text(self.scene.as_mapping())

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values in SI units; see docs/reference/json.md."""
        return {
            "specification": self.specification._asdict(),
            "found": self.found,
            "candidates": [candidate.report() for candidate in self.candidates],
            "chosen": None if self.chosen is None else self.chosen.report(),
            "hold": None if self.hold is None else self.hold._asdict(),
            "runs": None if self.runs is None else self.runs.report(),
            "at_drags": {name: at_drag.report() for name, at_drag in self.at_drags.items()},
            "claims": [claim._asdict() for claim in self.claims],
            "tried": [{"balls": count, **runs.report()} for count, runs in self.tried],
            "scene": None if self.scene is None else self.scene.as_mapping(),
            "version": __version__,
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
        rows = [candidate.report() for candidate in self.candidates]
        units = {
            "balls": "1", "mass": "kg", "radius": "m", "balances": "kg m", "heavier": "1",
            "circulation_border": "N s/m", "drag_low": "N s/m", "drag_high": "N s/m",
            "drag": "N s/m", "predicted_share": "1", "reason_unsuitable": None,
        }  # fmt: skip
        return {name: Column(unit, [row[name] for row in rows]) for name, unit in units.items()}


def run_sizing(specification: DriveSpecification, running: Running) -> Sizing:
    """Size a balancer, and verify the claims by runs.

    Numbers of balls are tried in order of their drag window's width, with a hold if necessary,
    until enough drives are balanced in time.

    Parameters
    ----------
    specification
        Requirements of the balancer.
    running
        Settings of the runs.

    Raises
    ------
    InputError
        The number of runs is out of range, or another process is computing the same runs.
    """
    if not _FEWEST <= running.runs <= MOST:
        raise InputError(f"runs = {running.runs}: must be from {_FEWEST} to {MOST}")
    with running.executor:
        return _sized(specification, running)


def _sized(specification: DriveSpecification, running: Running) -> Sizing:
    """Return the first candidate with enough balanced drives, and its verified claims."""
    candidates = tuple(sized_balls(count, specification) for count in specification.counts)
    tried: list[tuple[int, SpreadRuns]] = []
    for sized in _ranked(candidates):
        without = run_in_parts(sized, None, specification, running)
        hold, runs = None, without
        if without.share.value < specification.share:
            for hold in _holds(specification):
                runs = run_in_parts(sized, hold, specification, running)
                if runs.share.value >= specification.share:
                    break
        if runs.share.value < specification.share:
            tried.append((sized.count, without))
            continue
        balls, smooth = sized.balls, specification._replace(friction_arm=0.0)
        assert balls is not None
        predict = functools.partial(predicted_share, balls, specification)
        at_drags = window_runs(sized, specification, running, predict)
        claims = (
            mass_claim(sized, smooth),
            *circulation_claims(sized, smooth),
            *_claims_of_shares(specification, hold, (without, runs), at_drags),
        )
        scene = _scene(sized, hold, specification)
        return Sizing(
            specification, candidates, sized, hold, scene, runs, at_drags, claims, tuple(tried)
        )
    return Sizing(specification, candidates, None, None, None, None, {}, (), tuple(tried))


def _claims_of_shares(
    specification: DriveSpecification,
    hold: Hold | None,
    runs: tuple[SpreadRuns, SpreadRuns],
    at_drags: dict[str, DragRuns],
) -> Iterator[SizingClaim]:
    """Yield the claims on shares of balanced drives and on circulating balls, with their verdicts.

    Parameters
    ----------
    specification
        Requirements of the balancer.
    hold
        Hold of the start-up; None if it needs none.
    runs
        Runs of the chosen drive without a hold, and with ``hold``.
    at_drags
        Runs at the ends of the drag window and above it, by name.
    """
    wanted, (without, with_hold) = specification.share, runs
    if hold is None:
        text = f"without a hold, balanced {specification.settle:g} s after the speed is reached"
        yield share_claim(text, with_hold, wanted)
    else:
        text = f"with a hold of {hold.duration:.3g} s at {hold.start_speed:.4g} rad/s, balanced"
        yield share_claim(text, with_hold, wanted)
        yield share_claim("without it", without, wanted, at_least=False)
    for name, at_drag in at_drags.items():
        at_least = name != FAR_ABOVE
        what = f"window, {name}" if at_least else f"{FAR:g} times the highest"
        text = f"{what}: at {at_drag.drag:.3g} N s/m, balanced"
        if at_least or at_drag.predicted < wanted:
            yield share_claim(text, at_drag.runs, wanted, at_least)
    circulating = with_hold.circulating + sum(
        at_drag.runs.circulating for at_drag in at_drags.values()
    )
    count = with_hold.share.runs + sum(at_drag.runs.share.runs for at_drag in at_drags.values())
    yield SizingClaim(
        "of all these runs, with circulating balls",
        "0",
        f"{circulating} of {count}",
        HOLDS if circulating == 0 else CONTRADICTED,
    )


def _ranked(candidates: tuple[SizedBalls, ...]) -> list[SizedBalls]:
    """Return suitable candidates, the widest window first, as drag is the most uncertain value."""
    suitable = [
        candidate
        for candidate in candidates
        if candidate.window and not candidate.reason_unsuitable
    ]
    return sorted(suitable, key=lambda sized: -sized.window.ratio if sized.window else 0.0)


def _holds(specification: DriveSpecification) -> Iterator[Hold]:
    """Yield the holds that are tried, the shortest first, at speeds below the running speed."""
    for length in _HOLD_LENGTHS:
        for factor in _HOLD_SPEEDS:
            start = factor * specification.critical_speed
            if start < specification.speed:
                yield Hold(start, length * specification.settle)


def _scene(sized: SizedBalls, hold: Hold | None, specification: DriveSpecification) -> Scene:
    """Return the start-up scene of balls at their chosen drag, with colliding balls."""
    assert sized.balls is not None and sized.drag is not None
    return with_contact(scene_of(sized.balls, specification, sized.drag, hold))


def run_in_parts(
    sized: SizedBalls, hold: Hold | None, specification: DriveSpecification, running: Running
) -> SpreadRuns:
    """Run a design over its spread; stop after a part of the runs that rules it out."""
    scene = _scene(sized, hold, specification)
    pause = "" if hold is None else f", hold of {hold.duration:.3g} s at {hold.start_speed:.4g}"
    stage = running.at_stage(f"{sized.count} balls{pause}")
    # The runs of a part are cached and reused by the next part.
    for part in PARTS:
        runs = max(_FEWEST, round(part * running.runs))
        share = run_share(scene, specification, stage._replace(runs=min(runs, running.runs)))
        # Most of the dozen holds fail, and all runs of each would take minutes. Before the last
        # part, the share itself must be sufficient, not only the upper end of its interval.
        decisive = hold is not None and part == PARTS[-2]
        if (share.share.value if decisive else share.share.high) < specification.share:
            break
    return share


def sizing_failure(sizing: Sizing) -> str:
    """Return the reason why nothing could be sized, and the remedy."""
    if not sizing.tried:
        reasons = {candidate.count: candidate.reason_unsuitable for candidate in sizing.candidates}
        reasons_text = "; ".join(f"{count} balls: {why}" for count, why in reasons.items())
        return f"nothing can be sized: {reasons_text}"
    wanted = 100.0 * sizing.specification.share
    runs = "; ".join(
        f"{count} balls: {100 * estimate.share.value:.1f} % balanced"
        for count, estimate in sizing.tried
    )
    holds = len(list(_holds(sizing.specification)))  # all were tried
    also = f", also with each of {holds} holds of the speed (variable-speed periods)"
    stuck = _where_balls_stick(sizing)
    advice = "allow more time to settle, or require a smaller share"
    if stuck:
        advice = f"{stuck}; lower the friction, allow more residual unbalance or a smaller share"
    return (
        f"nothing can be sized: runs contradict the prediction of {wanted:g} % ({runs})"
        f"{also if holds else ''}; {advice}"
    )


def _where_balls_stick(sizing: Sizing) -> str:
    """Return the whirl and unbalance left by sticking balls, as text; empty without friction."""
    specification = sizing.specification
    if specification.friction_arm == 0.0:
        return ""
    phrases = []
    for sized in sizing.candidates:
        if sized.balls is not None and any(sized.count == count for count, _ in sizing.tried):
            whirl, unbalance = stuck(sized.balls, specification)
            part = 100.0 * unbalance / specification.limit
            phrases.append(f"{sized.count} balls: {1e6 * whirl:.3g} um, {part:.0f} %")
    return (
        "friction holds balls anywhere on the race if the whirl is below W = R arm / a; the "
        "residual unbalance can then reach this part of the allowed one, however long drives "
        f"settle ({'; '.join(phrases)})"
    )
