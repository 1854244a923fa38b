"""`ab-sim equilibria` and `ab-sim stability`."""

import math
import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, Literal

from rich.table import Table

from ab_sim.analysis.circulating import BunchRange
from ab_sim.analysis.circulating.ranges import LARGE_SWING, SEARCH_END
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
from ab_sim.analysis.equilibria.balanced import ALL, SAMPLED
from ab_sim.analysis.equilibria.over_speed import OverSpeed
from ab_sim.analysis.held_speed import last_speed
from ab_sim.analysis.maps.family import (
    BallCountComparison,
    Family,
    StableShares,
    family,
    members,
    plane_with_balls,
    values_of,
)
from ab_sim.analysis.maps.plane import Plane, axes_of
from ab_sim.analysis.maps.refine import check_coarse
from ab_sim.analysis.maps.stability import COARSE, StabilityMap, stability_map
from ab_sim.analysis.maps.verdicts import CIRCULATES, NOT_KNOWN, name_of
from ab_sim.api.resting import speeds_of_branches
from ab_sim.base.errors import DivergedError, InputError, SceneError
from ab_sim.base.presentation import NOTATION, Progress, in_one_turn
from ab_sim.base.version import __version__
from ab_sim.base.workers import KEPT
from ab_sim.cli.analysis_commands import EquilibriaOptions, StabilityOptions
from ab_sim.cli.checks import check_speed, processes
from ab_sim.cli.outputs import own_command
from ab_sim.cli.runner import Command, Outcome, WholeLine, new_table, picture
from ab_sim.design import basin as basins
from ab_sim.scene import load_scene
from ab_sim.scene.model import Scene

_MOST_PLACES = 6
"""Largest number of ball places that a line of the table lists."""


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
                "version": __version__,
            }

        def shown() -> Iterator[Table | str]:
            yield _equilibria_table(scene, equilibria)
            yield from (
                *_resting_notes(equilibria),
                *_disturbance_notes(equilibria, disturbed),
                *_over_speed(over_speed),
            )
            stable = [state.label for state in equilibria.stable]
            yield from circulation_lines(circulation, scene.balls.count, stable)
            if other := _other_motions(scene):
                yield f"{other}; this command shows where runs end:"
                yield WholeLine(f"  {_command(scene, options.scene, options.change)}")

        return Outcome(shown(), report, picture("branches", scene, equilibria, over_speed))

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
    command = ["run", name] if scene.balls.count == 1 else ["stability", name, "--basin", "12"]
    words = [*command, *(word for change in changes for word in ("--set", change))]
    return f"{own_command()} {shlex.join(words)}"


def _beyond_linear(scene: Scene, speed: float, state: RestingState) -> dict[str, Any]:
    """Return what the linear stability of a resting state leaves open, for the JSON.

    Returns
    -------
    dict[str, Any]
        ``returns``: whether an undecided state returns after disturbances; ``held_by_friction``:
        for each ball the range of angles in which friction holds it [rad]. None: not computed.
    """
    returns, held = None, None
    if state.stable is None and speed:
        try:
            returns = settles(scene, speed, state).stable
        except DivergedError:
            returns = False
        except InputError:
            pass  # The speed is too low to simulate the necessary turns.
    if speed and any("friction" in name for name in scene.effects):
        try:
            held = [[interval.low, interval.high] for interval in sticking(scene, speed, state)]
        except SceneError:
            pass  # Unknown if an effect shifts the resting states, as a race's runout does.
    return {"returns": returns, "held_by_friction": held}


def _equilibria_table(scene: Scene, equilibria: Equilibria) -> Table:
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
    more = len(places) - _MOST_PLACES
    return ", ".join(places[:_MOST_PLACES]) + (f" and {more} more" if more > 0 else "")


def _positions_text(positions: str) -> str:
    """Return a line on the balanced positions that were compared."""
    if positions == ALL:
        return "worst and best: of all balanced positions"
    return "worst and best: of sampled positions; between them there may be worse and better ones"


def _resting_notes(equilibria: Equilibria) -> Iterator[str]:
    """Yield lines on the limits of the search for resting states."""
    if not equilibria.branches:
        yield "there is no resting state at this speed"
    elif not equilibria.stable:
        yield "no state is stable at this speed by the linear test"
    if equilibria.by_numbers:
        yield "found by Newton's method from many starts: some states may be missing"
    if equilibria.balanced_positions is not None:
        yield _positions_text(equilibria.balanced_positions)
    if equilibria.left_out:
        yield f"states and verdicts neglect: {', '.join(equilibria.left_out)}"
    if "ball_contact" in equilibria.left_out:
        yield "balls may be at one place here; rows of touching balls are not searched for"


def _disturbance_notes(
    equilibria: Equilibria, disturbed: Sequence[dict[str, Any]]
) -> Iterator[str]:
    """Yield lines on the results of ``_beyond_linear``, one for each state."""
    answers = {
        True: "all come back",
        False: "not all come back",
        None: "none was tried, at so low a speed",
    }
    for state, more in zip(equilibria.branches, disturbed, strict=True):
        if state.stable is None:
            yield (
                f"{state.label}: undecided, because the largest growth rate is 0 within rounding; "
                f"of motions disturbed along each coordinate {answers[more['returns']]}"
            )
    for state, more in zip(equilibria.branches, disturbed, strict=True):
        if more["held_by_friction"] is not None:
            ends = [
                f"{math.degrees(first):.1f} to {math.degrees(first + high - low):.1f}"
                for low, high in more["held_by_friction"][:_MOST_PLACES]
                for first in (in_one_turn(low),)
            ]
            place = f"at {', '.join(ends)} deg"
            yield f"{state.label}: friction holds each ball, the others in place, {place}"


def _over_speed(over_speed: OverSpeed) -> Iterator[str]:
    """Yield lines on folds, changes of stability, and ranges of speed without stable states."""
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
    """Return ranges of speed [rad/s] as text."""
    text = ", ".join(f"{low:.6g} to {high:.6g}" for low, high in ranges)
    return f"{text} rad/s" if text else "nowhere"


def circulation_lines(
    circulation: CoexistingCirculation, balls: int, stable: Sequence[str]
) -> Iterator[str]:
    """Yield lines on circulating balls.

    Parameters
    ----------
    circulation
        Result of the search at a speed.
    balls
        Number of balls of the scene.
    stable
        Labels of the resting states that are stable at the speed.
    """
    if circulation.reason_not_covered is not None:
        if balls:
            yield f"circulating balls were not searched for: {circulation.reason_not_covered}"
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
    for bunch in circulation.other_speed_ranges:
        denied = ""
        if bunch.low <= abs(circulation.speed) <= bunch.high:
            denied = f"; at {circulation.speed:g} rad/s the full equations do not confirm this"
        over = _range(bunch, "rad/s", "at spindle speeds")
        yield f"  by the closed form, all {balls} can circulate {over}{denied}"


def _line(coexisting: Coexisting, balls: int) -> str:
    """Return a line on a bunch of circulating balls, with its ranges of speed and drag."""
    reach = []
    if coexisting.over_speed is not None:
        reach.append(_range(coexisting.over_speed, "rad/s", "at spindle speeds"))
    if coexisting.over_drag is not None:
        reach.append(_range(coexisting.over_drag, "N s/m", "with drags"))
    summary = f"  {coexisting.bunch.count} of {balls} at {coexisting.speed:.4g} rad/s (stable)"
    return "; ".join([summary, *reach])


def _range(reach: BunchRange, unit: str, what: str) -> str:
    """Return the range in which a bunch circulates, in words.

    Parameters
    ----------
    reach
        Range, and the reason for each of its ends.
    unit
        Unit of its values.
    what
        Quantity, at the beginning of the text. An end of the searched range is omitted.
    """
    low = "" if reach.low_end == SEARCH_END else f" from {reach.low:.4g}"
    high = "" if reach.high_end == SEARCH_END else f" to {reach.high:.4g}"
    unknown = [
        side
        for side, end in (("below", reach.low_end), ("above", reach.high_end))
        if end == LARGE_SWING
    ]
    text = f"{what}{low}{high} {unit}" if low or high else f"{what} of any size"
    return f"{text} (not known {' and '.join(unknown)})" if unknown else text


_BASIS = {
    ALL: "computed from all balanced positions of the balls",
    SAMPLED: "computed from samples of the balls' balanced positions: others may differ",
}
"""Captions of maps, by the balanced positions from which verdicts are computed."""


def stability_command(options: StabilityOptions) -> Command:
    """Return the command for a map, a family of maps, a basin, or resting states."""
    _check_combination(options)
    if options.basin is not None:
        return _basin_command(options, options.basin)
    if options.map is None:
        return equilibria_command(options)
    coarse = COARSE if options.coarse is None else options.coarse
    check_coarse(coarse, f"--coarse {coarse}")
    family_of = None if options.each is None else values_of(options.each)
    across, up = axes_of(options.map)
    scene = load_scene(options.scene, options.change)
    speed = last_speed(scene) if options.speed is None else check_speed(options.speed)
    plane = Plane(scene, speed, across, up)
    if family_of is not None:
        return _family_command(plane, coarse, *family_of)
    return _map_command(plane, coarse, options.against)


def _check_combination(options: StabilityOptions) -> None:
    """Refuse options that exclude each other."""
    if options.map is not None and options.basin is not None:
        raise InputError("--map and --basin: give one of them")
    if options.map is None and (options.against, options.each) != (None, None):
        raise InputError("--against, --each: apply to a map; add --map")
    if options.against is not None and options.each is not None:
        raise InputError("--against and --each: give one of them")
    if options.coarse is not None and options.map is None:
        raise InputError("--coarse: applies to a map; add --map")
    if options.speed is not None and options.basin is not None:
        raise InputError("--speed: a basin runs the scene's profile; change that with --set")


def _map_command(plane: Plane, coarse: int, against: int | None) -> Command:
    """Return the command that computes a map, or two for different numbers of balls."""
    planes = [plane] if against is None else [plane, plane_with_balls(plane, against)]
    for plane_here in planes:
        plane_here.check()

    def work(tell: Progress) -> Outcome:
        maps = [stability_map(plane, coarse, processes(None), tell) for plane in planes]
        compared = None if against is None else BallCountComparison(*maps)

        def report() -> dict[str, Any]:
            beside = {} if compared is None else {"against": compared.report()}
            return maps[0].report() | beside

        def shown() -> Iterator[Table | str]:
            yield from map(_map_table, maps)
            yield from map(_circulation_line, maps)
            if compared is not None:
                yield _against_table(compared)
            yield (
                f"islands of fewer than {coarse} by {coarse} points may have been missed (--coarse)"
                if coarse > 1
                else "every point was computed"
            )

        return Outcome(shown(), report, picture("stability_map", *maps))

    return Command(work, plane.scene.name, KEPT)


def _family_command(plane: Plane, coarse: int, key: str, values: tuple[float, ...]) -> Command:
    """Return the command that computes a map for each value of another key."""
    members(plane, key, values)

    def work(tell: Progress) -> Outcome:
        maps = family(plane, key, values, coarse, processes(None), tell)
        return Outcome([_family_table(maps)], maps.report, picture("family", maps))

    return Command(work, plane.scene.name, KEPT)


def _basin_command(options: StabilityOptions, count: int) -> Command:
    """Return the command that computes the final states of runs over start angles of two balls."""
    scene = load_scene(options.scene, options.change)

    def work(tell: Progress) -> Outcome:
        basin = basins.basin(scene, count, processes(None), progress=tell)
        return Outcome([_basin_table(basin)], basin.report, picture("basin", basin))

    return Command(work, scene.name, KEPT)


def _map_table(stable_map: StabilityMap) -> Table:
    """Return the table of a map's shares."""
    plane = stable_map.plane
    rows, columns = plane.shape
    balls = plane.scene.balls.count
    title = f"{plane.scene.name}, {balls} ball{'s' * (balls != 1)}: {columns} by {rows} points"
    title += f", {int(stable_map.computed.sum())} of them computed"
    table = new_table("stable", "share of the map", title=title)
    for label, share in stable_map.shares.items():
        table.add_row(name_of(label), f"{100 * share:.2f} %")
    table.caption = _of_which(stable_map)
    return table


def _circulation_line(stable_map: StabilityMap) -> str:
    """Return a line on circulating balls in a map."""
    reason = stable_map.reason_not_covered
    if reason is not None:
        return f"circulating balls were not searched for: {reason}"
    all_, beside = (stable_map.circulating == CIRCULATES).mean(), stable_map.coexisting.mean()
    unknown = (stable_map.circulating == NOT_KNOWN).mean()
    sentence = (
        f"all balls can circulate together on {100 * all_:.2f} % of the map, coexisting with "
        f"stable balance on {100 * beside:.2f} %"
    )
    more = f"; not known, because swings are too large, on {100 * unknown:.2f} %" if unknown else ""
    return f"{sentence}{more} (closed form: no friction, small effects of the spindle's angle)"


def _of_which(stable_map: StabilityMap) -> str | None:
    """Return the caption of a map: the positions from which its verdicts were computed."""
    return None if stable_map.balanced_positions is None else _BASIS[stable_map.balanced_positions]


def _family_table(maps_of_values: Family) -> Table:
    """Return the table of the shares of each map in which balance is stable."""
    title = f"{maps_of_values.maps[0].plane.scene.name}: share of the map with stable balance"
    columns = f"{maps_of_values.key} | at one or more positions | at every position"
    table = new_table("", columns, title=title)
    for value, stable_map in zip(maps_of_values.values, maps_of_values.maps, strict=True):
        shares = stable_map.balanced.mean(), stable_map.balanced_everywhere.mean()
        table.add_row(f"{value:g}", *(f"{100 * share:.2f} %" for share in shares))
    table.caption = _of_which(maps_of_values.maps[0])
    return table


def _against_table(comparison: BallCountComparison) -> Table:
    """Return the table that compares two numbers of balls."""
    ours, other = (m.plane.scene.balls.count for m in (comparison.ours, comparison.other))
    title = f"balance of {ours} and of {other} balls, of the same total mass"
    columns = f"for both | only for {ours} | only for {other}"
    table = new_table("stable", columns, title=title)
    rows: tuple[tuple[str, StableShares], ...] = (
        ("at one or more positions", comparison.somewhere),
        ("at every position", comparison.everywhere),
    )
    for name, shares in rows:
        table.add_row(name, *(f"{100 * share:.2f} %" for share in shares))
    return table


def _basin_table(basin: basins.Basin) -> Table:
    """Return a table of the outcomes of runs, with the share of starts for each outcome."""
    title = f"{basin.scene.name}: outcomes of runs from {len(basin.angles)}^2 starts"
    table = new_table("outcome", "share of the starts", title=title)
    for label, share in basin.shares.items():
        table.add_row(basins.NAMES[label], f"{100 * share:.2f} %")
    left_out = int((basin.labels == basins.LEFT_OUT).sum())
    table.caption = f"balanced: residual unbalance of at most {basin.limit:g}"
    if left_out:
        table.caption += f"; {left_out} starts {basins.NAMES[basins.LEFT_OUT]}"
    return table
