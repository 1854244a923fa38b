"""Commands for bags without recordings: `ab-sim replay` and `repair`; they import no Rerun."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ab_sim.base.presentation import CountProgress
from ab_sim.cli.checks import check_positive, require_ros
from ab_sim.cli.outputs import print_written, results
from ab_sim.cli.progress import progress_bar
from ab_sim.cli.recording_commands import RepairOptions, ReplayOptions
from ab_sim.record.bags.repair import repair_bag


def repair_command(options: RepairOptions) -> None:
    """Repair a bag in place.

    Raises
    ------
    RecordingError
        See `repair_bag`.
    """
    bag = options.bag
    with progress_bar(bag.name) as update:
        repaired = repair_bag(bag, lambda done, of: update("messages", done, of))
    if repaired is None:
        results.print(f"{bag} is complete: there is nothing to repair")
        return
    lost = f"; {repaired.lost} bytes of an incomplete message are lost" if repaired.lost else ""
    results.print(f"{repaired.messages} messages{lost}")
    print_written([bag])


def replay_command(options: ReplayOptions) -> None:
    """Publish a bag again, and exit the process at its end.

    Raises
    ------
    InputError
        ROS 2 is missing, or the rate is invalid.
    RecordingError
        The bag cannot be read.
    """
    check_positive("--rate", options.rate, "playback speed factor")
    require_ros("to replay")
    from ab_sim.nodes.bag_replay import replay

    bag = options.bag
    replay(bag, options.namespace, options.rate, options.start_paused, lambda: _seconds_of(bag))


@contextmanager
def _seconds_of(bag: Path) -> Iterator[CountProgress]:
    with progress_bar(bag.name) as update:
        yield lambda done, of: update("s", done, of)
