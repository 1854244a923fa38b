"""`ab-sim equilibria`."""

import math
import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, Literal

from rich.table import Table

import ab_sim
from ab_sim.analysis.circulating import Reach
from ab_sim.analysis.circulating.reach import END, SWING
from ab_sim.analysis.coexisting import (
    Coexisting,
    CoexistingCirculation,
    coexisting_circulation,
)
from ab_sim.analysis.equilibria import (
    Equilibria,
    RestingState,
    equilibria_of,
    kept_branches,
    settles,
    sticking,
)
from ab_sim.analysis.equilibria.balanced import ALL
from ab_sim.analysis.equilibria.over_speed import OverSpeed
from ab_sim.analysis.held_speed import last_speed
from ab_sim.api.resting import speeds_of_branches
from ab_sim.base.errors import DivergedError, InputError, SceneError
from ab_sim.base.presentation import NOTATION, Progress, in_one_turn
from ab_sim.cli.analysis_commands import EquilibriaOptions, StabilityOptions
from ab_sim.cli.checks import check_speed
from ab_sim.cli.outputs import own_command
from ab_sim.cli.runner import Command, Outcome, WholeLine, picture
from ab_sim.scene import load_scene
from ab_sim.scene.model import Scene

MOST_PLACES = 6
"""Largest number of places in a line of the table."""


def equilibria_command(options: EquilibriaOptions | StabilityOptions) -> Command:
    """Return the command that finds resting states of the balls, at a speed and over speeds."""
    if options.speed is not None:
        check_speed(options.speed)
    scene = load_scene(options.scene, options.change)

    def work(tell: Progress) -> Outcome:
        at = last_speed(scene) if options.speed is None else options.speed
        tell("at one speed", 0, 1)
        equilibria = equilibria_of(scene, at)
        top = max(abs(at), scene.spindle.max_speed)
        over_speed = kept_branches(scene, speeds_of_branches(scene, top), tell)
        disturbed = []
        for k, state in enumerate(equilibria.branches):
            tell(f"disturbed {state.label}", k, len(equilibria.branches))
            disturbed.append(_beyond_linear(scene, at, state))

        tell("circulating balls", 0, 1)
        circulation = coexisting_circulation(scene, at)

        def report() -> dict[str, Any]:
            branches = [a.report() | b for a, b in zip(equilibria.branches, disturbed, strict=True)]
            return equilibria.report() | {
                "branches": branches,
                "over_speed": over_speed.report(),
                "circulation": circulation.report(),
                "other_motions": _other_motions(scene),
                "version": ab_sim.__version__,
            }

        def shown() -> Iterator[Table | str]:
            yield equilibria_table(scene, equilibria)
            yield from (
                *_notes(equilibria),
                *_disturbance_notes(equilibria, disturbed),
                *_over_speed(over_speed),
            )
            stable = [state.label for state in equilibria.stable]
            yield from circulation_lines(circulation, scene.balls.count, stable)
            if other := _other_motions(scene):
                yield f"{other}; this command shows where runs end:"
                yield WholeLine(f"  {_command(scene, options.scene, options.change)}")

        drawn = scene, equilibria, over_speed
        return Outcome(
            shown(), report, picture("ab_sim.show.figures.branches:branches_figure", *drawn)
        )

    return Command(work, f"resting states of {scene.name}")


def _other_motions(scene: Scene) -> str | None:
    """Return the kinds of motion that the search does not cover; None without balls."""
    if scene.balls.count == 0:
        return None
    return (
        "the search covers balls at rest on the rotor, and one bunch of circulating balls: there "
        "can be other motions, such as several bunches, and a start-up may end in any of them"
    )


def _command(scene: Scene, name: str, changes: Sequence[str]) -> str:
    """Return the command that shows where a scene's start-ups end.

    It runs from many angles, or for one ball from its own start angle.
    """
    act = ["run", name] if scene.balls.count == 1 else ["stability", name, "--basin", "12"]
    words = [*act, *(word for change in changes for word in ("--set", change))]
    return f"{own_command()} {shlex.join(words)}"


def _beyond_linear(scene: Scene, speed: float, state: RestingState) -> dict[str, Any]:
    """Return whether a disturbed state returns, and where friction holds it; None: not computed."""
    comes_back, held = None, None
    if state.stable is None and speed:
        try:
            comes_back = settles(scene, speed, state).stable
        except DivergedError:
            comes_back = False
        except InputError:
            pass  # The speed is too low to simulate the necessary turns.
    if speed and any("friction" in name for name in scene.effects):
        try:
            held = [[interval.low, interval.high] for interval in sticking(scene, speed, state)]
        except SceneError:
            pass  # Unknown if an effect shifts the resting states, as a race's runout does.
    return {"comes_back": comes_back, "held_by_friction": held}


def equilibria_table(scene: Scene, equilibria: Equilibria) -> Table:
    """Return the table of resting states."""
    length, symbol = scene.whirl_unit
    table = Table(title=f"{equilibria.scene}: resting states at {equilibria.speed:g} rad/s")
    right = (f"W/{symbol}", "lambda_max", "ways")
    for name in ("balls", *right[:2], "verdict", "ways", "theta"):
        side: Literal["left", "right"] = "right" if name in right else "left"
        table.add_column(name, justify=side, no_wrap=name != "theta")
    for state in equilibria.branches:
        table.add_row(
            state.label,
            f"{state.W / length:.6g}",
            f"{state.lambda_max:.5g}",
            state.verdict,
            "" if state.assignments is None else f"{state.assignments}",
            _places(state),
        )
    table.caption = (
        "theta in deg from the unbalance, lambda_max in 1/s; ways: number of ways to assign the "
        f"places to the balls. {NOTATION}"
    )
    return table


def _places(state: RestingState) -> str:
    """Return the ball angles [deg], with equal angles grouped."""
    angles = [f"{math.degrees(angle):.1f}" for angle in state.theta]
    places = [
        f"{count} x {angle}" if count > 1 else angle for angle, count in Counter(angles).items()
    ]
    more = len(places) - MOST_PLACES
    return ", ".join(places[:MOST_PLACES]) + (f" and {more} more" if more > 0 else "")


def _of_which(positions: str) -> str:
    if positions == ALL:
        return "worst and best: of all balanced positions"
    return "worst and best: of sampled positions; between them there may be worse and better ones"


def _notes(equilibria: Equilibria) -> Iterator[str]:
    if not equilibria.branches:
        yield "there is no resting state at this speed"
    elif not equilibria.stable:
        yield "no state is stable at this speed by the linear test"
    if equilibria.by_numbers:
        yield "found by Newton's method from many starts: some states may be missing"
    if equilibria.balanced_positions is not None:
        yield _of_which(equilibria.balanced_positions)
    if equilibria.left_out:
        yield f"states and verdicts neglect: {', '.join(equilibria.left_out)}"
    if "ball_contact" in equilibria.left_out:
        yield "balls may be at one place here; rows of touching balls are not searched for"


def _disturbance_notes(
    equilibria: Equilibria, disturbed: Sequence[dict[str, Any]]
) -> Iterator[str]:
    answers = {
        True: "all come back",
        False: "not all come back",
        None: "none was tried, at so low a speed",
    }
    for state, more in zip(equilibria.branches, disturbed, strict=True):
        if state.stable is None:
            yield (
                f"{state.label}: undecided, because the largest growth rate is 0 within rounding; "
                f"of motions disturbed along each coordinate {answers[more['comes_back']]}"
            )
    for state, more in zip(equilibria.branches, disturbed, strict=True):
        if more["held_by_friction"] is not None:
            ends = [
                f"{math.degrees(first):.1f} to {math.degrees(first + high - low):.1f}"
                for low, high in more["held_by_friction"][:MOST_PLACES]
                for first in (in_one_turn(low),)
            ]
            place = f"at {', '.join(ends)} deg"
            yield f"{state.label}: friction holds each ball, the others in place, {place}"


def _over_speed(over_speed: OverSpeed) -> Iterator[str]:
    yield f"over {over_speed.speeds[0]:.4g} to {over_speed.speeds[1]:.4g} rad/s:"
    for label, fold in over_speed.folds:
        verb = {"appear": "appears", "vanish": "vanishes"}[fold.kind]
        yield f"  fold: {label} {verb} at {fold.speed:.9g} rad/s, W = {fold.W:.6g} m"
    for crossing in over_speed.crossings:
        turns = "stable" if crossing.gains else "unstable"
        how = f"Hopf, {crossing.frequency:.4g} rad/s" if crossing.frequency else "a real eigenvalue"
        yield f"  {crossing.label} is {turns} above {crossing.speed:.9g} rad/s ({how})"
    yield f"  no state at all: {_ranges(over_speed.without_state)}"
    yield f"  no stable state: {_ranges(over_speed.without_stable_state)}"
    if over_speed.undecided:
        yield f"  undecided: {_ranges(over_speed.undecided)}"


def _ranges(ranges: Sequence[tuple[float, float]]) -> str:
    text = ", ".join(f"{low:.6g} to {high:.6g}" for low, high in ranges)
    return f"{text} rad/s" if text else "nowhere"


def circulation_lines(
    circulation: CoexistingCirculation, balls: int, stable: Sequence[str]
) -> Iterator[str]:
    """Yield lines on circulating balls.

    Args:
        circulation: result of the search at a speed.
        balls: number of balls of the scene.
        stable: labels of the resting states that are stable at the speed.
    """
    if circulation.not_looked_for is not None:
        if balls:
            yield f"circulating balls were not searched for: {circulation.not_looked_for}"
        return
    if circulation.states:
        resting = "; ".join(f"{label}: stable" for label in stable)
        place = f"coexisting with {resting}" if stable else "where no resting state is stable"
        yield f"balls can also circulate, {place}:"
        yield from (_line(state, balls) for state in circulation.states)
    else:
        yield f"no bunch of balls circulates at {circulation.speed:g} rad/s"
    if len(circulation.numbers) < balls:
        yield f"  searched for: bunches of {', '.join(map(str, circulation.numbers))} balls"
    for bunch in circulation.elsewhere:
        denied = ""
        if bunch.low <= abs(circulation.speed) <= bunch.high:
            denied = f"; at {circulation.speed:g} rad/s the full equations do not confirm this"
        over = _range(bunch, "rad/s", "at spindle speeds")
        yield f"  by the closed form, all {balls} can circulate {over}{denied}"


def _line(coexisting: Coexisting, balls: int) -> str:
    reach = []
    if coexisting.over_speed is not None:
        reach.append(_range(coexisting.over_speed, "rad/s", "at spindle speeds"))
    if coexisting.over_drag is not None:
        reach.append(_range(coexisting.over_drag, "N s/m", "with drags"))
    summary = f"  {coexisting.bunch.count} of {balls} at {coexisting.speed:.4g} rad/s (stable)"
    return "; ".join([summary, *reach])


def _range(reach: Reach, unit: str, what: str) -> str:
    """Return a range in words; ends of the known or searched range are marked as such."""
    low = "" if reach.low_end == END else f" from {reach.low:.4g}"
    high = "" if reach.high_end == END else f" to {reach.high:.4g}"
    unknown = [
        side for side, end in (("below", reach.low_end), ("above", reach.high_end)) if end == SWING
    ]
    text = f"{what}{low}{high} {unit}" if low or high else f"{what} of any size"
    return f"{text} (not known {' and '.join(unknown)})" if unknown else text
