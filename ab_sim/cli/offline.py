"""`ab-sim run`."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rich.table import Table

from ab_sim.analysis import OfflineRun, compare_run, run_scene
from ab_sim.analysis.adaptive import net_unbalance
from ab_sim.cli.merits import merits_table
from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.errors import InputError, exact
from ab_sim.output_file import RECORDING
from ab_sim.scene import load_scene

INTERVALS = 100
"""Number of intervals between samples in the JSON, if no times are given."""


def run_command(
    scene_name: str,
    changes: list[str],
    times: str | None,
    sampled: bool,
    rrd: Path | None,
    every: int,
) -> Command:
    """Return the command that runs a scene; ``sampled``: at evenly spaced times by default."""
    if every > 1 and rrd is None:
        raise InputError(f"--every {every}: is of a recording; add --rrd FILE")
    scene = load_scene(scene_name, changes)
    wanted = parse_times(times)
    if not wanted and sampled:
        wanted = [i / INTERVALS * scene.duration for i in range(INTERVALS + 1)]

    def work(tell: Tell) -> Outcome:
        tell(f"{scene.name}, compiling; ms simulated", 0, round(1e3 * scene.duration))

        def update(drive: Drive, newest: Trajectory) -> None:
            what = f"{drive.scene.name} at {newest['speed'][-1]:.1f} rad/s; ms simulated"
            tell(what, round(1e3 * drive.time), round(1e3 * drive.scene.duration))

        result = run_scene(scene, wanted, update, tell=tell)
        comparison = compare_run(result, update)
        beside = comparison.report(result.merits, result.scene.rotor.eccentricity)
        report = {**result.report(), **beside}

        def draw(file: Path) -> None:
            from ab_sim.figures.run import DOTS
            from ab_sim.figures.saved import save

            save(result.plot(comparison), file, DOTS)

        def write() -> None:
            if rrd is not None:
                from ab_sim.api.runs import save_recording

                save_recording(result, rrd, every=every)

        def shown() -> Iterator[Table | str]:
            title = f"{result.scene.name}, {report['duration']:g} s"
            if (end := result.aborted) is not None:
                title += f": aborted at {end.time:.1f} s: {end.text}"
            yield merits_table(title, result.scene, {"this run": result.merits}, comparison)
            yield _summary(result, report)
            if max(wanted, default=0.0) > scene.duration:
                yield (
                    f"--times go beyond duration = {exact(scene.duration)} s: the run, and all "
                    f"that is said of it, lasts {report['duration']:g} s"
                )

        return Outcome(shown(), lambda: report, draw, (write,))

    return Command(work, "run", outputs=[(rrd, RECORDING, "--rrd")])


def parse_times(text: str | None) -> list[float]:
    """Parse times such as ``2.5,3,6``.

    Raises:
        InputError: a text is not a number.
    """
    if text is None:
        return []
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise InputError(
            f"--times {text}: must be numbers separated by commas, e.g. 2.5,3,6"
        ) from error


def _summary(result: OfflineRun, report: dict[str, Any]) -> Table:
    table = Table(show_header=False)
    if "motor" in result.scene.effects:
        speed, command = (result.trajectory[name][-1] for name in ("speed", "command"))
        table.add_row("motor", f"at {speed:.4g} of {command:.4g} commanded rad/s in the end")
    table.add_row("stepper", f"{report['stepper']}, {report['step']:g} s")
    if result.work_precision is not None:
        table.add_row("accuracy", result.work_precision.reason)
    if result.events:
        crowded = result.steps_with_unresolved_events
        lost = f"; too many to locate them all in {crowded} steps" if crowded else ""
        table.add_row("events", f"{result.events} located{lost}")
    for decided in result.decisions:
        table.add_row(f"at {decided.time:.3f} s", decided.text)
    if result.adaptive is not None:
        table.add_row("believed at the end", _believed(result))
    table.add_row("effects", ", ".join(report["effects"]) or "none")
    for section in ("sensors", "probes"):
        if report[section]:
            table.add_row(section, ", ".join(report[section]))
    return table


def _believed(result: OfflineRun) -> str:
    """Compare the estimates of an adaptive start-up's controller with the true values."""
    assert result.adaptive is not None
    belief, scene = result.adaptive.belief, result.scene
    length, symbol = scene.whirl_unit
    if math.isnan(belief.critical_speed):
        return "nothing of the drive"
    critical = f"{belief.critical_speed:.4g} +- {belief.critical_speed_deviation:.2g} rad/s"
    if scene.critical_speed is not None:
        critical += f" (true: {scene.critical_speed:.4g})"
    left = f"{abs(belief.net_unbalance) / length:.3g}"
    left += f" +- {belief.net_unbalance_deviation / length:.2g} {symbol}"
    true = net_unbalance(result.trajectory.last(1), scene)[0] / length
    return f"critical speed {critical}, net unbalance {left} (true: {true:.3g})"
