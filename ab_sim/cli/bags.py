"""Commands that convert between recordings and bags: `ab-sim export` and `import`."""

import re
from dataclasses import replace
from pathlib import Path

from ab_sim.base.errors import AbSimError, InputError
from ab_sim.base.files import (
    CSV,
    PARQUET,
    RECORDING,
    check_ending,
    check_folder,
    check_writable,
)
from ab_sim.base.presentation import Progress
from ab_sim.cli.checks import check_positive
from ab_sim.cli.outputs import people, print_written, results
from ab_sim.cli.progress import progress_bar
from ab_sim.cli.recording_commands import (
    ExportOptions,
    ImportOptions,
)
from ab_sim.cli.runner import Command, Outcome
from ab_sim.record.bags.exporting import STATE_RATE, export_bag
from ab_sim.record.bags.importing import import_bag
from ab_sim.record.bags.reader import Bag
from ab_sim.record.recording import StoredRun, open_recording
from ab_sim.record.recording import export as formats

_NAMESPACE = re.compile(r"/?|/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)


def export_command(options: ExportOptions) -> Command | None:
    """Write a recording as a bag, if requested, and return the command that writes its tables.

    Raises
    ------
    InputError
        Options exclude each other or cannot be used.
    RecordingError
        See `open_recording` and `export_bag`.
    """
    names = options.channels and tuple(name.strip() for name in options.channels.split(","))
    part = formats.Part(options.begin, options.end, options.every, names or None)
    if options.mcap is None:
        if (options.namespace, options.rate) != (None, None):
            raise InputError("--namespace, --rate: apply to a bag; add --mcap FOLDER")
    else:
        _export_bag(options, options.mcap, part)
        if options.parquet is None and options.csv is None:
            return None
    return _table_command(options, part)


def _export_bag(options: ExportOptions, mcap: Path, part: formats.Part) -> None:
    """Write a recording as a bag.

    Raises
    ------
    InputError
        The folder exists or cannot be written, the rate or namespace is invalid, or a part of the
        recording was requested.
    RecordingError
        See `open_recording` and `export_bag`.
    """
    recording, namespace = options.recording, options.namespace or "/"
    if part != formats.Part():
        raise InputError(
            "--from, --to, --every, --channels: a bag has the whole recording; give them with "
            "--parquet or --csv, in another call"
        )
    check_folder(mcap, "--mcap")
    if mcap.exists():
        raise InputError(f"--mcap {mcap}: exists already; name a new folder")
    check_writable(mcap, "--mcap")
    rate = STATE_RATE if options.rate is None else options.rate
    check_positive("--rate", rate, "messages a second")
    if not _NAMESPACE.fullmatch(namespace):
        raise InputError(f"--namespace {namespace}: must be words between slashes, e.g. /left")
    run = open_recording(recording)
    with progress_bar(recording.name) as update:
        messages = export_bag(
            run,
            mcap,
            "/" + namespace.strip("/"),
            rate,
            lambda done, of: update("samples", done, of),
        )
    if not run.complete:
        people.print(f"{recording} was not finished; its readable part is exported")
    results.print(f"{run.extent.rows} samples in {messages} messages")
    print_written([mcap])


def _table_command(options: ExportOptions, part: formats.Part) -> Command:
    """Return the command that writes a recording's samples as tables."""
    recording = options.recording
    files = {formats.PARQUET: options.parquet, formats.CSV: options.csv}
    wanted = {form: file for form, file in files.items() if file is not None}
    if not wanted:
        raise InputError(
            "nothing to write: name a file with --parquet or --csv, or a bag with --mcap"
        )

    def work(tell: Progress) -> Outcome:
        run = open_recording(recording)
        whole = replace(part, rest=_hangs(run))
        channels, total = len(whole.names(run)), run.extent.rows
        rows = formats.export(run, wanted, whole, lambda read: tell("samples", read, total))
        for remark in run.remarks:
            people.print(f"{recording}: {remark}")
        return Outcome([f"{rows} samples of {channels} channels"], written=[*wanted.values()])

    outputs = (options.parquet, PARQUET, "--parquet"), (options.csv, CSV, "--csv")
    return Command(work, f"export {recording.name}", "nothing was written", outputs)


def _hangs(run: StoredRun) -> tuple[float, float] | None:
    """Return x and y [m] of the recorded deck at rest; None if they are unknown."""
    if "z" not in run.channels:  # in the plane, displacements count from the rest position
        return 0.0, 0.0
    from ab_sim.analysis.rest import rest_of
    from ab_sim.scene.load import check_scene

    try:
        scene = check_scene(run.description.get("scene") or {}, "the recording's scene")
        x, y, _ = rest_of(scene).place.tolist()
    except AbSimError:
        return None
    return None if scene.deck is None else (x, y)


def import_command(options: ImportOptions) -> None:
    """Convert a bag to recordings.

    Raises
    ------
    InputError
        The recording cannot be written, or exists and was not named by ``--out``.
    RecordingError
        See `import_bag`.
    """
    bag, out = options.bag, options.out
    with Bag(bag):
        pass  # refuse a file that is no bag before complaints about the output
    file = out or Path(f"{bag.resolve().stem}.rrd")
    check_ending(file, RECORDING, "--out")
    check_writable(file, "--out")
    if out is None and file.exists():
        raise InputError(f"{file}: exists already; to replace it, add --out {file}")
    with progress_bar(bag.name) as update:
        import_result = import_bag(
            bag, file, options.namespace, lambda done, of: update("messages", done, of)
        )
    for topic, (count, reason) in import_result.ignored.items():
        people.print(f"ignored {count} messages on {topic}, the last one: {reason}")
    for note in import_result.notes:
        people.print(note)
    if not import_result.complete:
        people.print(f"{bag} was not finished; its readable part is imported")
    missing = (
        f", {import_result.missing} steps missing between them" if import_result.missing else ""
    )
    results.print(f"{import_result.rows} samples{missing}")
    print_written(import_result.files)
