"""`ab-sim modes`, `ab-sim floquet` and `ab-sim recovery`."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from rich.table import Table

from ab_sim.analysis.floquet import (
    STARTS,
    Followed,
    Stability,
    follow,
    held_speed,
    none_found,
    solutions_of,
)
from ab_sim.analysis.floquet.follow import SPEED, Case, case_of
from ab_sim.analysis.modes import AVERAGING, ZERO, Mode, NaturalVibration, moving, vibration_of
from ab_sim.analysis.recovery import (
    LONGEST,
    Recovery,
    RecoveryOverDrag,
    composite_of,
    recovery_over_drag,
)
from ab_sim.base.errors import InputError
from ab_sim.base.numbers import number_in, whole_number_in
from ab_sim.base.presentation import NOTATION, Progress, in_one_turn
from ab_sim.cli.analysis_commands import FloquetOptions, ModesOptions, RecoveryOptions
from ab_sim.cli.checks import check_speed
from ab_sim.cli.progress import progress_bar
from ab_sim.cli.runner import Command, Draw, Outcome, picture
from ab_sim.model.dynamics.assemble import free_coordinates, system_of
from ab_sim.scene import Scene, load_scene


def modes_command(options: ModesOptions) -> Command:
    """Return the command that computes the deck's modes, at a speed and over speeds."""
    check_speed(options.speed)
    scene = load_scene(options.scene, options.change)

    def work(_: Progress) -> Outcome:
        modes = vibration_of(scene, options.speed)
        return Outcome(_modes_shown(modes), modes.report, picture("modes", modes))

    return Command(work)


def _modes_table(vibration: NaturalVibration) -> Table:
    """Return the table of modes."""
    table = Table(title=f"{vibration.scene}: modes at {vibration.speed:g} rad/s")
    for name in ("rad/s", "Hz", "damping ratio", "whirl", "largest motion"):
        table.add_column(name, justify="right" if name in ("rad/s", "Hz") else "left")
    largest = max(abs(value) for mode in vibration.modes for value in mode.eigenvalues)
    for mode in vibration.modes:
        table.add_row(
            f"{mode.frequency:.2f}",
            f"{mode.frequency / (2.0 * math.pi):.3f}",
            _damping(mode, ZERO * largest),
            _whirl(mode),
            ", ".join(moving(vibration.linearised, mode)),
        )
    return table


def _whirl(mode: Mode) -> str:
    """Return the direction of a mode's whirl as text."""
    return mode.sense or ("back and forth" if mode.damped_frequency > 0.0 else "no oscillation")


def _damping(mode: Mode, rounding: float) -> str:
    """Return the damping ratio or the growth rate of a mode; growth below ``rounding`` is none."""
    if mode.growth > rounding:
        return f"grows, {mode.growth:.3g} 1/s"
    return "nothing restores it" if mode.damping_ratio is None else f"{mode.damping_ratio:.4f}"


def _modes_shown(vibration: NaturalVibration) -> Iterator[Table | str]:
    yield _modes_table(vibration)
    about, over_speed = vibration.linearised, vibration.over_speed
    yield f"undamped frequencies; {AVERAGING}"
    if not about.stiffness.any():
        yield (
            "nothing holds the deck at its rest position: no suspension or mount of the scene has "
            "a stiffness there"
        )
    if any(about.rest):
        yield f"about the deck's rest position: {about.hangs}"
    met = [f"{w:.2f}" + (f" ({m.sense})" if m.sense else "") for w, m in over_speed.critical]
    yield (
        f"critical speeds up to {over_speed.speeds[-1]:g} rad/s, at which a frequency equals the "
        f"spindle's speed: {', '.join(met) or 'none'}"
    )


MOST_VALUES = 10_000
"""Largest number of values of ``--over``."""


def floquet_command(options: FloquetOptions) -> Command:
    """Return the command that finds periodic motions, and follows one over a key if requested."""
    speed, start, over = options.speed, options.begin, options.over
    scene = load_scene(options.scene, options.change)
    sweep = None if over is None else _sweep(scene, over, speed)
    if speed is None and over is not None and over.startswith(SPEED + "="):
        speed = float(sweep[2][-1]) if sweep is not None else None
    at = held_speed(scene) if speed is None else speed

    def work(_: Progress) -> Outcome:
        solutions = solutions_of(scene, at, start)
        followed = None if sweep is None else _follow(solutions, start, *sweep)

        def report() -> dict[str, Any]:
            first = solutions[0].report() if solutions else none_found(scene, at)
            first["others"] = [other.report() for other in solutions[1:]]
            return first if followed is None else {**first, "followed": followed.report()}

        def shown() -> Iterator[Table | str]:
            yield _solutions_table(scene, at, solutions)
            yield from _notes(scene, solutions)
            yield from () if followed is None else _borders(followed)

        return Outcome(shown(), report, _draw(solutions, followed))

    return Command(work)


def _follow(
    stabilities: list[Stability], start: str, key: str, case: Case, values: np.ndarray
) -> Followed:
    """Follow a periodic motion over a key, beginning from where the first one was found."""
    first = stabilities[0].found_from if stabilities else ""
    starts = [start] if start else sorted(STARTS, key=lambda name: name != first)
    with progress_bar("floquet") as tell:
        return follow(key, case, values.tolist(), starts, lambda done: tell(key, done, len(values)))


def _draw(stabilities: list[Stability], followed: Followed | None) -> Draw | None:
    """Return the function that draws the result; None if there is nothing to draw."""
    if followed is not None and any(point.solution is not None for point in followed.points):
        return picture("followed", followed)
    if followed is None and stabilities:
        return picture("periodic_solutions", stabilities)
    return None


def _sweep(scene: Scene, over: str, speed: float | None) -> tuple[str, Case, np.ndarray]:
    """Return the key of ``--over``, the function from a value to a case, and the values.

    Raises
    ------
    InputError
        The text is not KEY=from:to:count, or the scene with the first value is invalid.
    """
    key, _, text = over.partition("=")
    parts, key = text.split(":"), key.strip()
    try:
        low, high, count = float(parts[0]), float(parts[1]), int(parts[2])
    except (ValueError, IndexError):
        raise InputError(
            f"--over {over!r}: must be KEY=from:to:count, e.g. speed=100:500:41 or "
            "race.radius=0.02:0.04:21"
        ) from None
    finite = math.isfinite(low) and math.isfinite(high)
    if len(parts) != 3 or not key or not finite or low == high or not 2 <= count <= MOST_VALUES:
        raise InputError(
            f"--over {over!r}: must be KEY=from:to:count with two different numbers, and a count "
            f"within 2 to {MOST_VALUES}"
        )
    values = np.linspace(low, high, count)
    if key == SPEED and speed is not None:
        raise InputError("--speed and --over speed=...: give one of them")
    return key, case_of(scene, key, values.tolist(), speed, f"--over {key}="), values


def _solutions_table(scene: Scene, speed: float, stabilities: list[Stability]) -> Table:
    """Return the table of periodic solutions."""
    table = Table(title=f"{scene.name}: periodic solutions at {speed:g} rad/s")
    for name in ("found from", "verdict", "largest", "whirl", "ball angles [deg]", "residual"):
        table.add_column(name, overflow="fold")
    e, unit = scene.whirl_unit
    for stability in stabilities:
        low, high = (whirl / e for whirl in stability.whirl)
        angles = [f"{math.degrees(in_one_turn(angle)):.2f}" for angle in stability.angles]
        table.add_row(
            stability.found_from,
            stability.verdict,
            f"{stability.largest:.9g}",
            "deck at rest" if stability.balanced else f"{low:.4g} to {high:.4g} {unit}",
            ", ".join(angles) or "-",
            f"{stability.orbit.residual:.1e}",
        )
    table.caption = NOTATION
    if not stabilities:
        table.add_row("none found", "-", "-", "-", "-", "-")
    return table


def _notes(scene: Scene, stabilities: list[Stability]) -> Iterator[str]:
    if not stabilities:
        yield (
            "no motion that repeats with every turn was found from any start: there may be none, "
            "or only far from them; try other start.ball_angles"
        )
        return
    yield (
        "largest: modulus of the largest multiplier over one turn; below 1, nearby motions return "
        "to the solution. There may be more solutions than those found from these starts."
    )
    first = stabilities[0]
    yield (
        f"{first.found_from}: {first.orbit.steps} steps per turn, {first.orbit.iterations} Newton "
        f"iterations; halving the step changed multipliers by {first.difference:.1e} at most"
    )
    if first.structural:
        yield (
            f"{first.structural} of the multipliers are 1 because balanced positions of the "
            "balls form a continuum; they are ignored, and the verdict applies to these positions"
        )
    if first.ball_turns.any():
        yield f"turns of the balls in the rotor per turn: {first.ball_turns.tolist()}"
    if first.verdict == "undecided":
        free = free_coordinates(system_of(scene))
        if free:
            yield (
                f"undecided: no stiffness holds the deck along {', '.join(free)}, so multipliers "
                "are 1 there; add a stiffness"
            )
        else:
            yield "undecided: the largest multiplier is 1 within rounding; run the scene to see"


def _borders(followed: Followed) -> Iterator[str]:
    """Yield lines on the borders of stability over the followed parameter."""
    missing = [point.value for point in followed.points if point.solution is None]
    if missing:
        yield (
            f"{followed.key}: none found at {len(missing)} of {len(followed.points)} values, "
            f"from {min(missing):g} to {max(missing):g}"
        )
    for border in followed.borders:
        side = "below" if border.stable_below else "above"
        mu = border.multiplier
        yield (
            f"{followed.key}: border at {border.value:.9g}, stable {side} it; the multiplier is "
            f"{mu.real:.4g} +- {abs(mu.imag):.4g}i there"
        )
    verdicts = {point.solution.verdict for point in followed.points if point.solution is not None}
    if not followed.borders and len(verdicts) == 1:
        yield f"{followed.key}: no border; {verdicts.pop()} throughout"
    for one, other in followed.unlocated:
        before, after = (point.solution.verdict if point.solution else "" for point in (one, other))
        yield (
            f"{followed.key}: from {before} at {one.value:g} to {after} at {other.value:g}; the "
            "border between them was not located"
        )


_MOST_DRAGS = 1000
"""Largest number of drags."""


def recovery_command(options: RecoveryOptions) -> Command:
    """Return the command that computes the recovery from a scene's change of speed, over drags."""
    values = drags_of(options.drags)
    scene = load_scene(options.scene, options.change)

    def work(tell: Progress) -> Outcome:
        recovery = recovery_over_drag(scene, values, tell)
        return Outcome(_recovery_shown(recovery), recovery.report, picture("recovery", recovery))

    return Command(work, scene.name)


def drags_of(text: str) -> tuple[float, ...]:
    """Parse ``first:last:count`` to evenly spaced drags [N s/m].

    Raises
    ------
    InputError
        The text has another form.
    """
    try:
        first, last, count = text.split(":")
        low, high, n = number_in(first), number_in(last), whole_number_in(count)
    except ValueError:
        low, high, n = math.nan, math.nan, 0
    if not (0.0 < low < high < math.inf and 2 <= n <= _MOST_DRAGS):
        raise InputError(
            f"--drags {text}: must be first:last:count, two rising numbers above 0 [N s/m] and a "
            f"whole number from 2 to {_MOST_DRAGS}, e.g. 0.1:0.5:5"
        )
    return tuple(float(f"{drag:.12g}") for drag in np.linspace(low, high, n))


def _recovery_table(results: RecoveryOverDrag, balls: int, runs: tuple[Recovery, ...]) -> Table:
    """Return the table of recoveries, with all balls or with one.

    Parameters
    ----------
    results
        Results over the drags.
    balls
        Number of balls in the runs.
    runs
        Recovery at the scene's drag, then at each of the drags over which they were computed.
    """
    several = "1 ball" if balls == 1 else f"{balls} balls"
    title = (
        f"{results.scene}, {several}: from {results.from_speed:g} to {results.to_speed:g} rad/s, "
        f"settled within {1e3 * results.band:g} mm"
    )
    table = Table(title=title)
    for name in ("drag [N s/m]", "settling [s]", "amplitude [mm]", "lambda_Rmax [1/s]"):
        table.add_column(name, justify="right")
    table.add_column("at rest")
    table.add_column("composite [s]", justify="right")
    composite = composite_of(runs[1:])
    index = (None, *(composite.index if composite else [None] * len(results.drags)))
    for k, (drag, run) in enumerate(zip((results.drag, *results.drags), runs, strict=True)):
        rest = "nowhere" if run.label is None else f"{run.label}, {run.verdict}"
        prefix = "scene: " if k == 0 else ""
        cells = (f"{prefix}{drag:g}", *_cells(run), rest, _text(index[k]))
        table.add_row(*cells, end_section=k == 0)
    return table


def _cells(run: Recovery) -> list[str]:
    return [_text(run.settling_time), f"{1e3 * run.maximum_amplitude:.5g}", _text(run.lambda_max)]


def _text(value: float | None) -> str:
    return "-" if value is None else f"{value:.5f}"


def _recovery_shown(results: RecoveryOverDrag) -> Iterator[Table | str]:
    yield _recovery_table(results, results.balls, (results.at_scene_drag, *results.at_drags))
    if results.one_ball is not None:
        yield _recovery_table(results, 1, results.one_ball)
    runs = (results.at_scene_drag, *results.at_drags, *(results.one_ball or ()))
    if results.best_drag is not None and results.composite is not None:
        yield (
            f"best of these drags: {results.best_drag:g} N s/m, where the composite index is "
            f"smallest: settling time + {results.composite.factor:.5g} s/m x amplitude; the factor "
            "is the mean settling time over the mean amplitude of the drags in the table"
        )
    if any(run.settling_time is None for run in runs):
        longest = max(run.duration for run in runs)
        yield (
            f"-: not settled after {longest:g} s, {LONGEST:g} times the scene's duration; there "
            "may be no stable state (ab-sim equilibria), or it takes longer (--set duration=...)"
        )
    if not all(run.rested_before for run in runs):
        yield "some drives did not rest before the change began: set profile.start_time later"
    if any(run.verdict == "undecided" for run in runs):
        yield "undecided: lambda_Rmax is 0; only the run shows whether this start settles"
    if results.balls_coincide:
        yield (
            "balls that start at one angle stay together, and settle like one ball with their "
            "total mass and drag; lambda_Rmax may belong to a motion that separates them, which "
            "this run does not excite: change start.ball_angles"
        )
