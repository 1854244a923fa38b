"""`ab-sim export`."""

from dataclasses import replace
from pathlib import Path

from ab_sim.cli.outputs import check_files, people, say_written
from ab_sim.cli.progress import interruptible
from ab_sim.errors import AbSimError, InputError
from ab_sim.output_file import CSV, PARQUET
from ab_sim.recording import StoredRun, open_recording
from ab_sim.recording import export as formats


def export_command(
    recording: Path, parquet: Path | None, csv: Path | None, part: formats.Part
) -> None:
    """Write what was asked for; outputs are tried first."""
    written = check_files((parquet, PARQUET, "--parquet"), (csv, CSV, "--csv"))
    if not written:
        raise InputError(
            "nothing to write: ask for a file with --parquet or --csv, or for a bag with --mcap"
        )
    forms = {formats.PARQUET: parquet, formats.CSV: csv}
    files = {form: file for form, file in forms.items() if file is not None}
    run = open_recording(recording)
    part = replace(part, hangs=_hangs(run))
    part.names(run)
    with interruptible(f"export {recording.name}", "nothing was written") as tell:
        total = run.extent.rows
        rows = formats.export(run, files, part, lambda read: tell("samples", read, total))
    people.print(f"{rows} samples of {len(part.names(run))} channels")
    if run.torn:
        people.print(f"{recording}: {run.torn}")
    say_written(written)


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
