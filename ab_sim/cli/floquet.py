"""`ab-sim floquet`."""

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
from ab_sim.analysis.floquet.follow import Case
from ab_sim.base.errors import InputError
from ab_sim.base.presentation import NOTATION, Progress, in_one_turn
from ab_sim.base.yaml_files import read_yaml
from ab_sim.cli.analysis_commands import FloquetOptions
from ab_sim.cli.progress import progress_bar
from ab_sim.cli.runner import Command, Draw, Outcome, picture
from ab_sim.model.dynamics.assemble import free_coordinates, system_of
from ab_sim.scene import Scene, load_scene
from ab_sim.scene.load import changed_scene

SPEED = "speed"
"""Name of the spindle's speed among the keys of parameters."""
MOST = 10_000
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
            yield solutions_table(scene, at, solutions)
            yield from _notes(scene, solutions)
            yield from () if followed is None else _borders(followed)

        return Outcome(shown(), report, _draw(scene, solutions, followed))

    return Command(work)


def _follow(
    stabilities: list[Stability], start: str, key: str, case: Case, values: np.ndarray
) -> Followed:
    first = stabilities[0].found_from if stabilities else ""
    starts = [start] if start else sorted(STARTS, key=lambda name: name != first)
    with progress_bar("floquet") as tell:
        return follow(key, case, values.tolist(), starts, lambda done: tell(key, done, len(values)))


def _draw(scene: Scene, stabilities: list[Stability], followed: Followed | None) -> Draw | None:
    """Return the function that draws the result; None if there is nothing to draw."""
    if followed is not None and any(point.found is not None for point in followed.points):
        return picture("ab_sim.show.figures.multipliers:modulus_figure", scene.name, followed)
    if followed is None and stabilities:
        return picture("ab_sim.show.figures.multipliers:multipliers_figure", stabilities)
    return None


def _sweep(scene: Scene, over: str, speed: float | None) -> tuple[str, Case, np.ndarray]:
    """Return the key of ``--over``, the function from a value to a case, and the values.

    Raises:
        InputError: the text is not KEY=from:to:count, or the scene with the first value is invalid.
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
    if len(parts) != 3 or not key or not finite or low == high or not 2 <= count <= MOST:
        raise InputError(
            f"--over {over!r}: must be KEY=from:to:count with two different numbers, and a count "
            f"within 2 to {MOST}"
        )
    values = np.linspace(low, high, count)
    if key == SPEED:
        if speed is not None:
            raise InputError("--speed and --over speed=...: give one of them")
        return key, lambda value: (scene, value), values
    at = held_speed(scene) if speed is None else speed
    whole = bool(np.all(values == np.round(values)))

    def case(value: float) -> tuple[Scene, float]:
        number = int(value) if whole and value == round(value) else value
        # The value as a scene's file would contain it.
        parsed = read_yaml(str(number)) if isinstance(number, int) else number
        return changed_scene(scene, {key: parsed}, f"--over {key}={number:g}"), at

    case(float(values[0])), case(float(values[-1]))
    return key, case, values


def solutions_table(scene: Scene, speed: float, stabilities: list[Stability]) -> Table:
    """Return the table of periodic solutions."""
    table = Table(title=f"{scene.name}: periodic solutions at {speed:g} rad/s")
    for name in ("found from", "verdict", "largest", "whirl", "ball angles [deg]", "residual"):
        table.add_column(name, overflow="fold")
    e, unit = scene.whirl_unit
    for one in stabilities:
        low, high = (whirl / e for whirl in one.whirl)
        table.add_row(
            one.found_from,
            one.verdict,
            f"{one.largest:.9g}",
            "deck at rest" if one.balanced else f"{low:.4g} to {high:.4g} {unit}",
            ", ".join(f"{math.degrees(in_one_turn(angle)):.2f}" for angle in one.angles) or "-",
            f"{one.orbit.residual:.1e}",
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
    missing = [point.value for point in followed.points if point.found is None]
    if missing:
        yield (
            f"{followed.over}: none found at {len(missing)} of {len(followed.points)} values, "
            f"from {min(missing):g} to {max(missing):g}"
        )
    for border in followed.borders:
        side = "below" if border.stable_below else "above"
        mu = border.multiplier
        yield (
            f"{followed.over}: border at {border.value:.9g}, stable {side} it; the multiplier is "
            f"{mu.real:.4g} +- {abs(mu.imag):.4g}i there"
        )
    verdicts = {point.found.verdict for point in followed.points if point.found is not None}
    if not followed.borders and len(verdicts) == 1:
        yield f"{followed.over}: no border; {verdicts.pop()} throughout"
    for one, other in followed.unlocated:
        before, after = (point.found.verdict if point.found else "" for point in (one, other))
        yield (
            f"{followed.over}: from {before} at {one.value:g} to {after} at {other.value:g}; the "
            "border between them was not located"
        )
