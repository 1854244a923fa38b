"""`ab-sim state`."""

from pathlib import Path

import yaml

from ab_sim.analysis.start_state import start_from
from ab_sim.drive.trajectory import balls_in
from ab_sim.errors import InputError, exact
from ab_sim.recording import open_recording


def state_command(recording: Path, time: float | None) -> None:
    """Print the state of the last sample up to a time [s].

    Raises:
        InputError: there is no sample, or it lacks parts of the state.
    """
    run = open_recording(recording)
    first, last = run.extent.first[1], run.extent.last[1]
    at = last if time is None else time
    if not first <= at <= last:
        raise InputError(
            f"{recording}: there is no sample at {exact(at)} s; it holds {exact(first)} to "
            f"{exact(last)} s"
        )
    found = None
    clock = run.channels.index("time")
    for block in run.blocks():
        until = block[block[:, clock] <= at + 0.5e-9]
        found = until[-1] if len(until) else found
        if len(until) < len(block):
            break
    assert found is not None, "the first one is not later"
    sample = dict(zip(run.channels, found.tolist(), strict=True))
    try:
        start = start_from(sample, balls_in(run.channels), "qw" in run.channels)
    except InputError as error:
        raise InputError(f"{recording}: {error}") from error
    print(yaml.safe_dump(start, default_flow_style=True, sort_keys=False, width=2**30), end="")
