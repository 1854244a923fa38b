"""Import of a bag as recordings."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from ab_msgs_py import Topic, topics
from ab_msgs_py.topics import BLOCK, CLOCK, DESCRIPTION
from ab_sim.base.errors import InputError, RecordingError
from ab_sim.record.bags import contract
from ab_sim.record.bags.contract import DECIMATED, NUMBER
from ab_sim.record.bags.drives import BagConverter
from ab_sim.record.bags.foreign_bag import ForeignBag
from ab_sim.record.bags.reader import Bag
from ab_sim.record.recording import Recording

_CHUNK = 1000  # rows


class ImportedBag(NamedTuple):
    """Result of the import of a bag."""

    files: list[Path]
    """Recordings; several if the drive was reset, or another drive published its description."""
    rows: int
    """Number of samples."""
    missing: int
    """Number of missing steps between the first and the last step."""
    ignored: dict[str, tuple[int, str]]
    """Number of unusable messages, and the error of the last one, by topic."""
    complete: bool
    """True if the bag was finished; if not, its readable part was used."""
    notes: list[str]
    """Notes on sensors whose values are held between their stamps, in a bag without blocks."""


def import_bag(
    path: Path | str,
    out: Path,
    namespace: str | None = None,
    progress: Callable[[int, int], None] = lambda done, of: None,
    rows_of: str | None = None,
) -> ImportedBag:
    """Convert a bag to recordings.

    With ``vibration/block``, the recordings are equal to those of a live recorder, to the bit.
    Without it, there is one recording, from ``vibration``, ``whirl``, ``imu/data_raw``,
    ``displacement``, joints and commands. It has a row for each stamp of the sensor with the most
    samples. Joints are interpolated; other values are the last ones received. If positions are
    unknown, the recording has no drawing.

    Args:
        path: path of the bag, see `Bag`.
        out: .rrd file of the first recording; an existing one is replaced. Files of further
            recordings get the endings ``-2`` and so on, and replace no others.
        namespace: namespace of the drive; None: that of the only drive.
        progress: function that is called with the number of messages done, and of all.
        rows_of: channel of a sensor whose stamps give the rows instead, without blocks.

    Raises:
        InputError: the bag has no drive in the namespace, or several drives and no namespace was
            given.
        RecordingError: the bag cannot be read or has no topics of a drive, or a recording cannot be
            written.
    """
    with Bag(path) as bag:
        prefix = choose_namespace(bag, namespace)
        kinds = _topics_to_read(bag, prefix)
        log = BagConverter(prefix, kinds, out)
        messages = sum(bag.topics[name].messages for name in kinds)
        if BLOCK.within(prefix) in kinds:
            # The description is converted first: if the bag's recorder started after the drive, the
            # description may follow samples.
            for first in islice(bag.messages({DESCRIPTION.within(prefix)}), 1):
                log.write(first)
            with log:
                for done, message in enumerate(bag.messages(kinds)):
                    log.write(message)
                    if done % _CHUNK == 0:
                        progress(done, messages)
            if not log.rows:
                raise RecordingError(
                    f"{path}: {BLOCK.within(prefix)} has no samples that can be used{log.summary}"
                )
            return ImportedBag(log.files, log.rows, log.missing, log.ignored, bag.complete, [])
        return _import_foreign(ForeignBag(bag, prefix, kinds, rows_of), bag, out)


def choose_namespace(bag: Bag, wanted: str | None) -> str:
    """Return the namespace of the drive to import.

    Raises:
        InputError: the namespace does not exist, or none was given and there are several.
        RecordingError: the bag has no drive.
    """
    there = contract.drive_namespaces((name, topic.type) for name, topic in bag.topics.items())
    if wanted is None and len(there) == 1:
        return there[0]
    if wanted is not None and (named := "/" + wanted.strip("/")) in there:
        return named
    if not there:
        raise RecordingError(
            f"{bag.path} has no topics of a drive: none of "
            + ", ".join(f"{kind.name} ({kind.type_name})" for kind in contract.OF_A_DRIVE)
            + f", in any namespace; it has {_listed(bag)}"
        )
    if wanted is None:
        raise InputError(
            f"{bag.path} has several drives; choose one with --namespace: {', '.join(there)}"
        )
    raise InputError(
        f"--namespace {wanted}: {bag.path} has no drive there; it has drives in {', '.join(there)}"
    )


def _listed(bag: Bag) -> str:
    there = [f"{name} ({topic.type})" for name, topic in sorted(bag.topics.items())]
    return ", ".join(there[:20] + ["..."] * (len(there) > 20)) or "no topics at all"


def _topics_to_read(bag: Bag, namespace: str) -> dict[str, Topic]:
    """Return the topics to read, by full name.

    Raises:
        RecordingError: a topic of the bag has a name of the contract, but another type.
    """
    wanted = {kind.within(namespace): kind for kind in topics.ALL}
    clock = f"{namespace.rstrip('/')}/clock"
    if clock in bag.topics:  # with two drives, each has its own clock
        del wanted[CLOCK.name]
        wanted[clock] = CLOCK
    numbers = NUMBER.within(namespace)
    for name, topic in bag.topics.items():
        is_number = name.startswith(numbers) and name.removeprefix(numbers).isidentifier()
        if is_number and topic.type == NUMBER.type_name:
            wanted[name] = NUMBER
        if further := contract.further_sensor(name, namespace):
            wanted[name] = further
    wanted[DECIMATED.within(namespace)] = DECIMATED
    topics_present = {name: kind for name, kind in wanted.items() if name in bag.topics}
    for name, kind in topics_present.items():
        if bag.topics[name].type != kind.type_name:
            raise RecordingError(
                f"{bag.path}: {name} is of type {bag.topics[name].type}; expected {kind.type_name}"
            )
    return topics_present


def _import_foreign(table: ForeignBag, bag: Bag, out: Path) -> ImportedBag:
    """Write the recording of a bag without blocks."""
    if not len(table.samples):
        raise RecordingError(f"{bag.path}: there is no message that can be used{table.summary}")
    with Recording(out, description=table.description, drawn=table.drawn, index=False) as recording:
        for first in range(0, len(table.samples), _CHUNK):
            recording.block(table.channels, table.samples[first : first + _CHUNK])
    return ImportedBag(
        [out], recording.rows, recording.missing, table.ignored, bag.complete, table.notes
    )
