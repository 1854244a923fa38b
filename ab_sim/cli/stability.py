"""`ab-sim stability`."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rich.table import Table

from ab_sim.analysis.equilibria.balanced import ALL, SAMPLED
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
from ab_sim.analysis.maps.stability import StabilityMap, stability_map
from ab_sim.analysis.maps.verdicts import CIRCULATES, NOT_KNOWN, name_of
from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Progress
from ab_sim.base.workers import KEPT
from ab_sim.cli.analysis_commands import StabilityOptions
from ab_sim.cli.checks import check_speed, processes
from ab_sim.cli.equilibria import equilibria_command
from ab_sim.cli.runner import Command, Outcome, new_table, picture
from ab_sim.design import basin as basins
from ab_sim.scene import load_scene

BASIS = {
    ALL: "computed from all balanced positions of the balls",
    SAMPLED: "computed from samples of the balls' balanced positions: others may differ",
}
"""Captions of maps, by the basis of their verdicts."""


def stability_command(options: StabilityOptions) -> Command:
    """Return the command for a map, a family of maps, a basin, or resting states."""
    _check_combination(options)
    if options.basin is not None:
        return _basin_command(options, options.basin)
    if options.map is None:
        return equilibria_command(options)
    coarse = 8 if options.coarse is None else options.coarse
    if coarse < 1 or coarse & (coarse - 1):
        raise InputError(f"--coarse {coarse}: must be a power of two: 1, 2, 4, 8, ...")
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
            from ab_sim.show.figures.stability_map import map_figure

            map_figure(maps[0], file, *maps[1:])

        return Outcome(shown(), report, draw)

    return Command(work, plane.scene.name, KEPT)


def _family_command(plane: Plane, coarse: int, key: str, values: tuple[float, ...]) -> Command:
    """Return the command that computes a map for each value of another key."""
    members(plane, key, values)

    def work(tell: Progress) -> Outcome:
        maps = family(plane, key, values, coarse, processes(None), tell)
        draw = picture("ab_sim.show.figures.stability_map:family_figure", maps)
        return Outcome([family_table(maps)], maps.report, draw)

    return Command(work, plane.scene.name, KEPT)


def _basin_command(options: StabilityOptions, count: int) -> Command:
    """Return the command that computes the final states of runs over start angles of two balls."""
    scene = load_scene(options.scene, options.change)

    def work(tell: Progress) -> Outcome:
        basin = basins.basin(scene, count, processes(None), progress=tell)
        draw = picture("ab_sim.show.figures.basin_map:basin_figure", basin)
        return Outcome([basin_table(basin)], basin.report, draw)

    return Command(work, scene.name, KEPT)


def map_table(stable_map: StabilityMap) -> Table:
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


def circulation_line(stable_map: StabilityMap) -> str:
    """Return a line on circulating balls in a map."""
    reason = stable_map.circulation_not_looked_for
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
    return None if stable_map.balanced_positions is None else BASIS[stable_map.balanced_positions]


def family_table(maps_of_values: Family) -> Table:
    """Return the table of the shares of each map in which balance is stable."""
    title = f"{maps_of_values.maps[0].plane.scene.name}: share of the map with stable balance"
    columns = f"{maps_of_values.key} | at one or more positions | at every position"
    table = new_table("", columns, title=title)
    for value, stable_map in zip(maps_of_values.values, maps_of_values.maps, strict=True):
        shares = stable_map.balanced.mean(), stable_map.balanced_everywhere.mean()
        table.add_row(f"{value:g}", *(f"{100 * share:.2f} %" for share in shares))
    table.caption = _of_which(maps_of_values.maps[0])
    return table


def against_table(comparison: BallCountComparison) -> Table:
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


def basin_table(basin: basins.Basin) -> Table:
    """Return the table of outcomes, with their shares of the start angles."""
    title = f"{basin.scene.name}: outcomes of runs from {len(basin.angles)}^2 starts"
    table = new_table("outcome", "share of the starts", title=title)
    for label, share in basin.shares.items():
        table.add_row(basins.NAMES[label], f"{100 * share:.2f} %")
    left_out = int((basin.labels == basins.LEFT_OUT).sum())
    table.caption = f"balanced: residual unbalance of at most {basin.limit:g}"
    if left_out:
        table.caption += f"; {left_out} starts {basins.NAMES[basins.LEFT_OUT]}"
    return table
