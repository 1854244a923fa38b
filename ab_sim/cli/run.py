"""`ab-sim run`, and the table of a run's metrics."""

import math
from collections.abc import Iterator, Mapping, Sequence
from json import dumps
from pathlib import Path
from typing import Any

from rich.table import Table

from ab_sim.analysis import Compared, Comparison, Metrics, OfflineRun, compare_run, run_scene
from ab_sim.analysis.metrics import BAND, FLOOR, reported_metrics
from ab_sim.analysis.metrics.metric import Display, Metric, Row
from ab_sim.analysis.metrics.wording import ANGULAR_SPEED, number_text, speed_text
from ab_sim.analysis.startup import net_unbalance
from ab_sim.base.errors import InputError, exact
from ab_sim.base.files import RECORDING
from ab_sim.base.numbers import number_in
from ab_sim.base.presentation import ANGLES, LAST, WHIRL, Progress
from ab_sim.cli.runner import FINE, Command, Outcome, picture
from ab_sim.cli.scene_commands import RunOptions
from ab_sim.drive import Drive
from ab_sim.drive.overlap import together_at_start
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import Scene, load_scene
from ab_sim.scene.units import ShownUnit, shown_units

_INTERVALS = 100
"""Number of intervals between samples in the JSON, if no times are given."""


def run_command(options: RunOptions) -> Command:
    """Return the command that runs a scene."""
    if options.every > 1 and options.rrd is None:
        raise InputError(f"--every {options.every}: applies to a recording; add --rrd FILE")
    changes = [*options.change]
    if options.stepper is not None:
        changes.append(f"solver.stepper={dumps(options.stepper)}")
    if options.step is not None:
        changes.append(f"solver.step={options.step!r}")
    scene, units = load_scene(options.scene, changes), shown_units(options.units)
    times = _parse_times(options.times)
    if not times and options.json is not None:
        times = [i / _INTERVALS * scene.duration for i in range(_INTERVALS + 1)]

    def work(tell: Progress) -> Outcome:
        tell(f"{scene.name}, compiling; ms simulated", 0, round(1e3 * scene.duration))

        def update(drive: Drive, newest: Trajectory) -> None:
            what = f"{drive.scene.name} at {newest['speed'][-1]:.1f} rad/s; ms simulated"
            tell(what, round(1e3 * drive.time), round(1e3 * drive.scene.duration))

        result = run_scene(scene, times, update, tell=tell)
        comparison = compare_run(result, update)
        compared = comparison.report(result.metrics, result.scene.rotor.eccentricity)
        report = {**result.report(), **compared}

        def record(file: Path) -> None:
            from ab_sim.api.runs import save_recording

            save_recording(result, file, every=options.every)

        def shown() -> Iterator[Table | str]:
            title = f"{result.scene.name}, {report['duration']:g} s"
            if (end := result.aborted) is not None:
                title += f": aborted at {end.time:.1f} s: {end.text}"
            runs = {"this run": result.metrics}
            yield metrics_table(title, result.scene, runs, comparison, units)
            yield _summary(result, report, _display(scene, units))
            if max(times, default=0.0) > scene.duration:
                yield (
                    f"--times exceed duration = {exact(scene.duration)} s: the run and its metrics "
                    f"cover {report['duration']:g} s"
                )

        draw = picture("run", result, comparison, dots=FINE)
        return Outcome(shown(), lambda: report, draw, {"--rrd": record})

    return Command(work, "run", outputs=[(options.rrd, RECORDING, "--rrd")])


def _parse_times(text: str | None) -> list[float]:
    """Parse times such as ``2.5,3,6``.

    Raises
    ------
    InputError
        A text is not a number.
    """
    if text is None:
        return []
    try:
        return [number_in(part) for part in text.split(",")]
    except ValueError as error:
        raise InputError(
            f"--times {text}: must be numbers separated by commas, e.g. 2.5,3,6"
        ) from error


def _summary(result: OfflineRun, report: dict[str, Any], display: Display) -> Table:
    table = Table(show_header=False)
    if "motor" in result.scene.effects:
        speed, command = (
            speed_text(result.trajectory[name][-1], display) for name in ("speed", "command")
        )
        table.add_row("motor", f"at {speed} at the end, commanded: {command}")
    table.add_row("stepper", f"{report['stepper']}, {report['step']:g} s")
    if result.work_precision is not None:
        table.add_row("accuracy", result.work_precision.reason)
    if result.events:
        crowded = result.steps_with_unresolved_events
        lost = f"; in {crowded} steps, there were too many to locate all" if crowded else ""
        table.add_row("events", f"{result.events} located{lost}")
    for decided in result.decisions:
        table.add_row(f"at {decided.time:.3f} s", decided.text)
    if result.adaptive is not None:
        table.add_row("estimates at the end", _estimates(result, display))
    table.add_row("effects", ", ".join(report["effects"]) or "none")
    for section in ("sensors", "probes"):
        if report[section]:
            table.add_row(section, ", ".join(report[section]))
    return table


def _estimates(result: OfflineRun, display: Display) -> str:
    """Compare the estimates of an adaptive start-up's controller with the true values."""
    assert result.adaptive is not None
    estimates, scene = result.adaptive.estimates, result.scene
    length, symbol = scene.whirl_unit
    if math.isnan(estimates.critical_speed):
        return "none yet"
    unit = display.of(ANGULAR_SPEED)
    deviation = estimates.critical_speed_deviation * unit.factor
    critical = f"{estimates.critical_speed * unit.factor:.4g} +- {deviation:.2g} {unit.text}"
    if scene.critical_speed is not None:
        critical += f" (true: {scene.critical_speed * unit.factor:.4g})"
    estimate = f"{abs(estimates.net_unbalance) / length:.3g}"
    estimate += f" +- {estimates.net_unbalance_deviation / length:.2g} {symbol}"
    true = net_unbalance(result.trajectory.last(1), scene)[0] / length
    return f"critical speed {critical}, net unbalance {estimate} (true: {true:.3g})"


def metrics_table(
    title: str,
    scene: Scene,
    runs: Mapping[str, Metrics],
    comparison: Comparison,
    units: Mapping[str, ShownUnit] = {},
) -> Table:
    """Return the table of metrics, with a column for each run and each comparison run.

    Parameters
    ----------
    title
        Title of the table.
    scene
        Scene of the runs.
    runs
        Metrics of the runs by heading.
    comparison
        Runs to compare with.
    units
        Requested units by SI unit.
    """
    columns = dict(runs)
    notes = []
    for head, beside in comparison.by_name().items():
        if isinstance(beside, Compared):
            columns[head] = beside.metrics
        else:
            notes.append(f"The run {head} failed: {beside}")
    runs_beside = list(columns.values())
    display = _display(scene, units)
    table = Table(title=title, caption_justify="left")
    table.add_column("", no_wrap=True)
    for head in columns:
        broken = head.replace("variable-speed", "variable-\nspeed")  # rich would break it anywhere
        table.add_column(broken, overflow="fold", min_width=len("balanced"))

    for metric, row in _rows():
        cells = [row.text(metrics, display) for metrics in runs_beside]
        if _shown(row, scene, cells):
            table.add_row(row.head(display), *cells)
            notes += _notes(row, cells)
        if metric.relative is not None and scene.balls.count:
            shares = [comparison.relative(metric, metrics) for metrics in runs_beside]
            table.add_row(metric.relative.label, *map(number_text, shares))
    table.caption = "\n".join([_caption(scene), *notes])
    return table


def _display(scene: Scene, units: Mapping[str, ShownUnit]) -> Display:
    """Return the units of a table: lengths in eccentricities, unless a unit was requested."""
    e = scene.rotor.eccentricity
    if "m" in units or e == 0:
        unit = units.get("m", ShownUnit("mm", 1e3))
        return Display(unit.factor, unit.text, f"W [{unit.text}]", units=units)
    return Display(1 / e, "e", "W/e", units=units)


def _rows() -> list[tuple[Metric[Any], Row]]:
    """Return the reported metrics and their rows, in the order of the table."""
    rows = [(metric, metric.row) for metric in reported_metrics() if metric.row is not None]
    return sorted(rows, key=lambda row: row[1].place)


def _shown(row: Row, scene: Scene, cells: Sequence[str]) -> bool:
    """Return whether a row applies to the scene; without that rule, whether a cell has content."""
    if row.applies is not None:
        return row.applies(scene)
    return row.has_content(cells)


def _notes(row: Row, cells: Sequence[str]) -> Iterator[str]:
    """Yield the notes of a row for the caption."""
    if row.note:
        yield row.note
    if row.caution and row.has_content(cells):
        yield f"{row.caution[0].upper()}{row.caution[1:]}."


def _caption(scene: Scene) -> str:
    """Return the table's caption, with definitions of those values that apply to the scene."""

    def sentences() -> Iterator[str]:
        yield (
            f"Final: root mean square over the last {100 * LAST:g} % of the run. Band: "
            f"+-{100 * BAND:g} % of final W, at least +-{100 * FLOOR:g} % of M0 e/M. "
            "Times count from the run's start, also that when all balls first were at -180 deg."
        )
        if scene.balls.count:
            yield "Without balls: their mass is removed, too."
        if together := together_at_start(scene):
            yield f"{together[0].upper()}{together[1:]}."
        if scene.deck is not None:
            yield "Tilt: of the shaft, about any axis."
        if "gravity" in scene.effects:
            tilt = " and tilt count" if scene.deck is not None else " counts"
            yield f"W{tilt} from the deck's rest position."
        yield f"W, e, M0 e/M: {WHIRL}; angles: {ANGLES}."

    return " ".join(sentences())
