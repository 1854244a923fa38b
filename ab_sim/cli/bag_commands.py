"""Commands for ROS 2 bags: into recordings, and published again."""

from pathlib import Path
from typing import Annotated

import typer

bag_commands = typer.Typer()

NamespaceOption = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Of the drive, where the bag has several, e.g. /left."),
]
BagArgument = Annotated[
    Path, typer.Argument(help="Folder of a ROS 2 bag, or a .mcap or .db3 file.", metavar="BAG")
]


@bag_commands.command("import")
def import_(
    bag: BagArgument,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The .rrd file. Default: the bag's name, here."),
    ] = None,
    namespace: NamespaceOption = None,
) -> None:
    """Convert a ROS 2 bag to a recording.

    With vibration/block it is to the bit what the recorder would have written. Without, it has what
    there is of spindle/command, joint_states, vibration, whirl, imu/data_raw and displacement, with
    a row for each stamp of the sensor that has most; where positions are unknown there are plots
    and no drawing. An unfinished bag is read as far as it goes. Where a drive was reset there are
    several recordings, FILE, FILE-2 and so on.
    """
    from ab_sim.cli.bags import import_command

    import_command(bag, out, namespace)


@bag_commands.command()
def mend(bag: BagArgument) -> None:
    """Repair a ROS 2 bag whose recorder was killed, in place.

    What is whole in it stays, to the bit, and gets the index and the counts that other programs ask
    for. A new file is written beside the old one first, and takes its place when it is complete.
    A bag that is still being written is refused.
    """
    from ab_sim.cli.bags import mend_command

    mend_command(bag)


@bag_commands.command()
def replay(
    bag: BagArgument,
    rate: Annotated[float, typer.Option(help="How many times as fast as it was.")] = 1.0,
    namespace: NamespaceOption = None,
    start_paused: Annotated[
        bool, typer.Option("--start-paused", help="Wait for the service replay/pause, with false.")
    ] = False,
) -> None:
    """Publish a ROS 2 bag again, with its timing and QoS.

    Commands, too: whoever listens to spindle/command obeys them. drive_description is told first;
    a recorder that listens records the same samples.
    """
    from ab_sim.cli.bags import replay_command

    replay_command(bag, rate, namespace, start_paused)
