"""`ab-sim export --mcap`, `ab-sim import` and `ab-sim replay`."""

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ab_sim.bags import STATE_RATE, Bag, export_bag, import_bag, repair_bag
from ab_sim.cli.outputs import people, say_written
from ab_sim.cli.progress import progress_bar
from ab_sim.cli.ros import require_ros
from ab_sim.errors import InputError
from ab_sim.output_file import RECORDING, check_ending, check_folder, check_writable
from ab_sim.recording import open_recording
from ab_sim.recording.export import Part

_NAMESPACE = re.compile(r"/?|/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)


def export_bag_command(
    recording: Path, mcap: Path, namespace: str, rate: float | None, part: Part
) -> None:
    """Write a recording as a bag.

    Raises:
        InputError: the folder is there or cannot be written, or the rate or namespace is none; or
            a part of the recording was asked for.
        RecordingError: see `open_recording` and `export_bag`.
    """
    if part != Part():
        raise InputError(
            "--from, --to, --every, --channels: a bag has the whole recording; give them with "
            "--parquet or --csv, in a call of its own"
        )
    check_folder(mcap, "--mcap")
    if mcap.exists():
        raise InputError(f"--mcap {mcap}: is there already, and bags are not replaced")
    check_writable(mcap, "--mcap")
    rate = STATE_RATE if rate is None else rate
    _check_positive(rate, "--rate", "messages a second")
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
        people.print(f"{recording} was not finished; what it holds is exported")
    people.print(f"{run.extent.rows} samples in {messages} messages")
    say_written([mcap])


def import_command(bag: Path, out: Path | None, namespace: str | None) -> None:
    """Make recordings of a bag.

    Raises:
        InputError: the file cannot be written, or would replace one that nobody named.
        RecordingError: see `import_bag`.
    """
    with Bag(bag):
        pass  # first of all, it is one
    file = out or Path(f"{bag.resolve().stem}.rrd")
    check_ending(file, RECORDING, "--out")
    check_writable(file, "--out")
    if out is None and file.exists():
        raise InputError(f"{file} is there already: say by --out {file} that it be replaced")
    with progress_bar(bag.name) as update:
        made = import_bag(bag, file, namespace, lambda done, of: update("messages", done, of))
    for topic, (count, reason) in made.ignored.items():
        people.print(f"ignored {count} messages on {topic}, the last one: {reason}")
    for note in made.notes:
        people.print(note)
    if not made.complete:
        people.print(f"{bag} was not finished; what it holds is imported")
    missing = f", {made.missing} steps missing between them" if made.missing else ""
    people.print(f"{made.rows} samples{missing}")
    say_written(made.files)


def mend_command(bag: Path) -> None:
    """Complete a bag in place.

    Raises:
        RecordingError: see `repair_bag`.
    """
    with progress_bar(bag.name) as update:
        mended = repair_bag(bag, lambda done, of: update("messages", done, of))
    if mended is None:
        people.print(f"{bag} is complete: there is nothing to mend")
        return
    lost = f"; {mended.lost} bytes at its end were torn and are lost" if mended.lost else ""
    people.print(f"{mended.messages} messages{lost}")
    say_written([bag])


def replay_command(bag: Path, rate: float, namespace: str | None, paused: bool) -> None:
    """Publish a bag again; ends the process.

    Raises:
        InputError: ROS 2 is missing, or the rate is none.
        RecordingError: the bag cannot be read.
    """
    _check_positive(rate, "--rate", "how many times as fast")
    require_ros("to replay")
    from ab_sim.nodes.bag_replay import replay

    replay(bag, namespace, rate, paused, lambda: _seconds_of(bag))


@contextmanager
def _seconds_of(bag: Path) -> Iterator[Callable[[int, int], None]]:
    with progress_bar(bag.name) as update:
        yield lambda done, of: update("s", done, of)


def _check_positive(value: float, said: str, meaning: str) -> None:
    if not 0.0 < value < math.inf:
        raise InputError(f"{said} {value:g}: {meaning}, must be more than 0 and finite")
