"""`ab-sim compare`."""

from pathlib import Path

from rich.table import Table

from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome, picture
from ab_sim.recording import open_recording
from ab_sim.reports.compare import ChannelDeviation, RecordingComparison, compare_recording
from ab_sim.scene import load_scene


def compare_command(recording: Path, scene_name: str, changes: list[str]) -> Command:
    """Return the command that compares a scene's run with a recording, by the recorded commands."""
    scene = load_scene(scene_name, changes)

    def work(tell: Tell) -> Outcome:
        run = open_recording(recording)
        total = run.extent.rows
        found = compare_recording(run, scene, progress=lambda done: tell("samples", done, total))
        return Outcome(
            [compare_table(found, recording.name), *found.notes],
            lambda: {"recording": str(recording), **found.report()},
            picture("ab_sim.reports.compare_picture:compare_picture", found, recording.name),
        )

    return Command(work, f"{scene.name} as {recording.name}", "nothing was written")


def compare_table(found: RecordingComparison, recording: str) -> Table:
    """Return the table of deviations."""
    table = Table(title=f"{recording} beside {found.scene.name}, {found.duration:g} s")
    for name in ("channel", "unit", "largest difference", "of the range", "at [s]", "rms"):
        table.add_column(name, justify="left" if name in ("channel", "unit") else "right")
    table.add_column("of the range", justify="right")
    for deviation in found.deviations:
        table.add_row(deviation.channel, deviation.unit or "", *_numbers(deviation))
    table.caption = (
        f"{found.rows} samples. Driven by {found.driven_by}, aligned {found.aligned}. Range: of "
        "what was recorded, from least to most."
    )
    for reason, channels in found.not_compared.items():
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
