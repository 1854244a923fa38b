"""`ab-sim export`."""

from dataclasses import replace
from pathlib import Path

from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome
from ab_sim.errors import AbSimError, InputError
from ab_sim.output_file import CSV, PARQUET
from ab_sim.recording import StoredRun, open_recording
from ab_sim.recording import export as formats


def export_command(
    recording: Path, parquet: Path | None, csv: Path | None, part: formats.Part
) -> Command:
    """A recording's samples as tables, which the work writes."""
    forms = {formats.PARQUET: parquet, formats.CSV: csv}
    files = {form: file for form, file in forms.items() if file is not None}
    if not files:
        raise InputError(
            "nothing to write: ask for a file with --parquet or --csv, or for a bag with --mcap"
        )

    def work(tell: Tell) -> Outcome:
        run = open_recording(recording)
        whole = replace(part, hangs=_hangs(run))
        channels, total = len(whole.names(run)), run.extent.rows
        rows = formats.export(run, files, whole, lambda read: tell("samples", read, total))
        torn = [f"{recording}: {remark}" for remark in run.remarks]
        return Outcome([f"{rows} samples of {channels} channels", *torn])

    outputs = (parquet, PARQUET, "--parquet"), (csv, CSV, "--csv")
    return Command(work, f"export {recording.name}", "nothing was written", outputs, aside=True)


def _hangs(run: StoredRun) -> tuple[float, float] | None:
    """x and y [m] of where the recorded deck hangs at rest, if that is known."""
    if "z" not in run.channels:  # in the plane, displacements count from there
        return 0.0, 0.0
    from ab_sim.analysis.rest import rest_of
    from ab_sim.scene.load import check_scene

    try:
        scene = check_scene(run.description.get("scene") or {}, "the recording's scene")
        x, y, _ = rest_of(scene).place.tolist()
    except AbSimError:
        return None
    return None if scene.deck is None else (x, y)
