"""Commands that read recordings: `ab-sim report`, `compare` and `state`."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import yaml
from rich.table import Table

from ab_sim.analysis.replay import start_from
from ab_sim.base.errors import InputError, exact
from ab_sim.base.files import PAGE, PNG
from ab_sim.base.presentation import Progress
from ab_sim.cli.progress import interruptible
from ab_sim.cli.recording_commands import CompareOptions, ReportOptions, StateOptions
from ab_sim.cli.runner import Command, Outcome, new_table, picture
from ab_sim.drive.trajectory import balls_in
from ab_sim.record.recording import open_recording
from ab_sim.scene import load_scene
from ab_sim.show.compare import ChannelDeviation, RecordingComparison, compare_recording
from ab_sim.show.gather import RunData, gather
from ab_sim.show.panels import Grid
from ab_sim.show.summary import CAPTION, summary_rows

MOST_RUNS = 8
"""Largest number of runs side by side; more would be too small to see."""
_REPORT_DOTS = 100
"""Resolution of a report's picture [dots per inch]."""


def report_command(options: ReportOptions) -> Command:
    """Return the command that reports on recorded runs."""
    recordings = options.recordings
    if len(recordings) > MOST_RUNS:
        raise InputError(f"{len(recordings)} recordings: at most {MOST_RUNS} side by side")

    def work(_: Progress) -> Outcome:
        opened = [open_recording(recording) for recording in recordings]
        runs = []
        for run, name in zip(opened, _names(recordings), strict=True):
            with interruptible(name, "nothing was written") as tell:
                runs.append(
                    gather(run, name, lambda done, of, tell=tell: tell("samples", done, of))  # type: ignore[misc]
                )
        notes = [f"{data.name}: {note}" for data in runs for note in data.notes]

        @cache
        def grid() -> Grid:
            from ab_sim.show.panels import grid_of, panels_of

            return grid_of([data.name for data in runs], [panels_of(data) for data in runs])

        def draw(file: Path) -> None:
            picture("report", grid(), dots=_REPORT_DOTS)(file)

        def write_page(file: Path) -> None:
            from ab_sim.show.page import report_page

            report_page(grid(), summary_rows(runs), [data.notes for data in runs], file)

        return Outcome(
            [_report_table(runs), *notes],
            lambda: {"runs": [data.report() for data in runs]},
            writes={"--png": draw, "--html": write_page},
        )

    return Command(work, outputs=[(options.png, PNG, "--png"), (options.html, PAGE, "--html")])


def _report_table(runs: Sequence[RunData]) -> Table:
    """Return the table of runs."""
    table = Table(caption=CAPTION, caption_justify="left")
    table.add_column("", no_wrap=True)
    for data in runs:
        table.add_column(data.name, overflow="fold")
    for label, cells in summary_rows(runs):
        table.add_row(label, *cells)
    return table


def _names(recordings: Sequence[Path]) -> list[str]:
    """Return the stems of files; if they are not unique, the paths, and if necessary numbers."""
    stems = [path.stem for path in recordings]
    if len(set(stems)) == len(stems):
        return stems
    paths = [str(path) for path in recordings]
    numbered = [f"{path} ({at})" for at, path in enumerate(paths, 1)]
    return paths if len(set(paths)) == len(paths) else numbered


def compare_command(options: CompareOptions) -> Command:
    """Return the command that runs a scene under recorded commands, and compares the runs."""
    recording, scene = options.recording, load_scene(options.scene, options.change)

    def work(tell: Progress) -> Outcome:
        run = open_recording(recording)
        total = run.extent.rows
        comparison = compare_recording(
            run, scene, progress=lambda done: tell("samples", done, total)
        )
        return Outcome(
            [_compare_table(comparison, recording.name), *comparison.notes],
            lambda: {"recording": str(recording), **comparison.report()},
            picture("comparison", comparison, recording.name),
        )

    return Command(work, f"{scene.name} as {recording.name}", "nothing was written")


def _compare_table(comparison: RecordingComparison, recording: str) -> Table:
    """Return the table of deviations."""
    title = f"{recording} compared with {comparison.scene.name}, {comparison.duration:g} s"
    columns = "largest difference | of the range | at [s] | rms | of the range"
    table = new_table("channel | unit", columns, title=title)
    for deviation in comparison.deviations:
        table.add_row(deviation.channel, deviation.unit or "", *_numbers(deviation))
    table.caption = (
        f"{comparison.rows} samples. Driven by {comparison.driven_by}, aligned "
        f"{comparison.aligned}. Range: largest less smallest recorded value."
    )
    for reason, channels in comparison.not_compared.items():
        table.caption += f"\nNot compared, {reason}: {', '.join(channels)}."
    table.caption_justify = "left"
    return table


def _numbers(deviation: ChannelDeviation) -> list[str]:
    if deviation.same:
        return ["0, to the bit", "", "", "0", ""]
    if deviation.rms is None:
        return ["not finite", "", "", "", ""]
    largest, rms = deviation.relative(deviation.largest), deviation.relative(deviation.rms)
    return [
        f"{deviation.largest:.3g}", _percent(largest), f"{deviation.at:.4f}",
        f"{deviation.rms:.3g}", _percent(rms),
    ]  # fmt: skip


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.2g} %"


def print_state(options: StateOptions) -> None:
    """Print the state of the last sample up to a time [s].

    Raises
    ------
    InputError
        There is no sample, or it lacks parts of the state.
    """
    recording = options.recording
    run = open_recording(recording)
    first, last = run.extent.first.time, run.extent.last.time
    at = last if options.time is None else options.time
    if not first <= at <= last:
        raise InputError(
            f"{recording}: there is no sample at {exact(at)} s; it has samples from {exact(first)} "
            f"to {exact(last)} s"
        )
    last_sample = None
    clock = run.channels.index("time")
    for block in run.blocks():
        until = block[block[:, clock] <= at + 0.5e-9]
        last_sample = until[-1] if len(until) else last_sample
        if len(until) < len(block):
            break
    assert last_sample is not None, "the first sample is not later than the requested time"
    sample = dict(zip(run.channels, last_sample.tolist(), strict=True))
    try:
        start = start_from(sample, balls_in(run.channels), "qw" in run.channels)
    except InputError as error:
        raise InputError(f"{recording}: {error}") from error
    print(yaml.safe_dump(start, default_flow_style=True, sort_keys=False, width=2**30), end="")
