"""`ab-sim stability`."""

from collections.abc import Iterator, Set
from pathlib import Path
from typing import Any

from rich.table import Table

from ab_sim.analysis.equilibria.extremes import ALL, SAMPLED
from ab_sim.analysis.held_speed import last_speed
from ab_sim.analysis.maps.balls import BallCountComparison, StableShares, plane_with_balls
from ab_sim.analysis.maps.circulation import CIRCULATES, NOT_KNOWN
from ab_sim.analysis.maps.family import Family, family, members, values_of
from ab_sim.analysis.maps.plane import Plane, axes_of
from ab_sim.analysis.maps.stability import StabilityMap, stability_map
from ab_sim.analysis.maps.verdicts import name_of
from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome, picture
from ab_sim.cli.sharing import processes
from ab_sim.cli.speed import check_speed
from ab_sim.design import basin as basins
from ab_sim.errors import InputError
from ab_sim.scene import load_scene
from ab_sim.workers import KEPT

OF_WHICH = {
    ALL: "by all balanced positions of the balls",
    SAMPLED: "by sampled balanced positions of the balls: between them there may be others",
}


def map_command(
    scene_name: str,
    changes: list[str],
    speed: float | None,
    axes: str,
    coarse: int,
    against: int | None,
) -> Command:
    """Return the command that computes a map, or two for different numbers of balls."""
    _check_coarse(coarse)
    plane = _plane(scene_name, changes, speed, axes)
    planes = [plane] if against is None else [plane, plane_with_balls(plane, against)]
    for each in planes:
        each.check()

    def work(tell: Tell) -> Outcome:
        maps = [stability_map(each, coarse, processes(None), tell) for each in planes]
        compared = None if against is None else BallCountComparison(*maps)

        def report() -> dict[str, Any]:
            beside = {} if compared is None else {"against": compared.report()}
            return maps[0].report() | beside

        def shown() -> Iterator[Table | str]:
            yield from map(map_table, maps)
            yield from map(circulation_line, maps)
            if compared is not None:
                yield against_table(compared)
            yield (
                f"islands of fewer than {coarse} by {coarse} points may have been missed (--coarse)"
                if coarse > 1
                else "every point was computed"
            )

        def draw(file: Path) -> None:
            from ab_sim.figures.stability_map import map_figure

            map_figure(maps[0], file, *maps[1:])

        return Outcome(shown(), report, draw)

    return Command(work, plane.scene.name, KEPT)


def check_combination(given: Set[str], maps: bool, basin: bool) -> None:
    """Refuse options that exclude each other.

    Args:
        given: names of the given options.
        maps: whether a map is requested.
        basin: whether a basin is requested.
    """
    if maps and basin:
        raise InputError("--map and --basin: one at a time")
    if given & {"against", "each"} and not maps:
        raise InputError("--against, --each: are of maps; say what to map with --map")
    if {"against", "each"} <= given:
        raise InputError("--against and --each: one at a time")
    if "coarse" in given and not maps:
        raise InputError("--coarse: is of maps; say what to map with --map")
    if "speed" in given and basin:
        raise InputError("--speed: a basin is of the scene's own profile; change that with --set")


def family_command(
    scene_name: str, changes: list[str], speed: float | None, axes: str, coarse: int, each: str
) -> Command:
    """Return the command that computes a map for each value of another key."""
    _check_coarse(coarse)
    key, values = values_of(each)
    plane = _plane(scene_name, changes, speed, axes)
    members(plane, key, values)

    def work(tell: Tell) -> Outcome:
        found = family(plane, key, values, coarse, processes(None), tell)
        draw = picture("ab_sim.figures.stability_map:family_figure", found)
        return Outcome([family_table(found)], found.report, draw)

    return Command(work, plane.scene.name, KEPT)


def basin_command(scene_name: str, changes: list[str], count: int) -> Command:
    """Return the command that computes the final states of runs over start angles of two balls."""
    scene = load_scene(scene_name, changes)

    def work(tell: Tell) -> Outcome:
        found = basins.basin(scene, count, processes(None), progress=tell)
        draw = picture("ab_sim.figures.basin_map:basin_figure", found)
        return Outcome([basin_table(found)], found.report, draw)

    return Command(work, scene.name, KEPT)


def map_table(found: StabilityMap) -> Table:
    """Return the table of a map's shares."""
    plane = found.plane
    rows, columns = plane.shape
    balls = plane.scene.balls.count
    title = f"{plane.scene.name}, {balls} ball{'s' * (balls != 1)}: {columns} by {rows} points"
    table = Table(title=f"{title}, {int(found.computed.sum())} of them computed")
    table.add_column("stable")
    table.add_column("share of the map", justify="right")
    for label, share in found.shares.items():
        table.add_row(name_of(label), f"{100 * share:.2f} %")
    table.caption = _of_which(found)
    return table


def circulation_line(found: StabilityMap) -> str:
    """Return a line on circulating balls in a map."""
    reason = found.circulation_not_looked_for
    if reason is not None:
        return f"balls that circulate are not looked for: {reason}"
    all_, beside = (found.circulating == CIRCULATES).mean(), found.coexisting.mean()
    unknown = (found.circulating == NOT_KNOWN).mean()
    said = (
        f"all balls can circulate in one bunch on {100 * all_:.2f} % of the map, beside stable "
        f"balance on {100 * beside:.2f} %"
    )
    more = f"; not known, as swings are too large, on {100 * unknown:.2f} %" if unknown else ""
    return f"{said}{more} (closed form: no friction, what turns with the spindle is small)"


def _of_which(found: StabilityMap) -> str | None:
    return None if found.balanced_positions is None else OF_WHICH[found.balanced_positions]


def family_table(found: Family) -> Table:
    """Return the table of the shares of the maps in which balance is stable."""
    table = Table(title=f"{found.maps[0].plane.scene.name}: where balance is stable")
    for name in (found.key, "at some positions at least", "at every position"):
        table.add_column(name, justify="right")
    for value, each in zip(found.values, found.maps, strict=True):
        shares = each.balanced.mean(), each.balanced_everywhere.mean()
        table.add_row(f"{value:g}", *(f"{100 * share:.2f} %" for share in shares))
    table.caption = _of_which(found.maps[0])
    return table


def against_table(found: BallCountComparison) -> Table:
    """Return the table that compares two numbers of balls."""
    ours, other = (m.plane.scene.balls.count for m in (found.ours, found.other))
    table = Table(title=f"balance of {ours} and of {other} balls, together as heavy")
    for name in ("stable", "for both", f"only for {ours}", f"only for {other}"):
        table.add_column(name, justify="left" if name == "stable" else "right")
    rows: tuple[tuple[str, StableShares], ...] = (
        ("at some positions at least", found.somewhere),
        ("at every position", found.everywhere),
    )
    for name, shares in rows:
        table.add_row(name, *(f"{100 * share:.2f} %" for share in shares))
    return table


def basin_table(found: basins.Basin) -> Table:
    """Return the table of the shares of starts."""
    table = Table(title=f"{found.scene.name}: how runs end, of {len(found.angles)}^2 starts")
    table.add_column("the run ends")
    table.add_column("share of the starts", justify="right")
    for label, share in found.shares.items():
        table.add_row(basins.NAMES[label], f"{100 * share:.2f} %")
    left_out = int((found.labels == basins.LEFT_OUT).sum())
    table.caption = (
        f"balanced: at most {found.limit:g} of the unbalance is left; {left_out} starts left out"
    )
    return table


def _plane(scene_name: str, changes: list[str], speed: float | None, axes: str) -> Plane:
    """Return the plane of the map, at the given speed or the final speed of the scene's profile."""
    across, up = axes_of(axes)
    scene = load_scene(scene_name, changes)
    return Plane(scene, last_speed(scene) if speed is None else check_speed(speed), across, up)


def _check_coarse(coarse: int) -> None:
    if coarse < 1 or coarse & (coarse - 1):
        raise InputError(f"--coarse {coarse}: must be a power of two: 1, 2, 4, 8, ...")
