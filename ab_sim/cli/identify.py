"""`ab-sim identify`."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.table import Table

from ab_sim.cli.outputs import write_scene
from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome, plotted
from ab_sim.cli.sharing import processes
from ab_sim.errors import InputError, Interrupted
from ab_sim.identification.files import Files, read_files, trial_masses_of
from ab_sim.identification.parameters import bounds_of
from ab_sim.identification.result import INTERRUPTED, Identification, share_words
from ab_sim.identification.run import Question, run_identification
from ab_sim.output_file import PAGE, SCENE
from ab_sim.presentation import number, titled
from ab_sim.scene import load_scene

MOST_NAMED = 3
"""Largest number of proposed recordings."""


class IdentifyOptions(NamedTuple):
    """Options of `ab-sim identify`."""

    recordings: list[Path]
    without_balls: list[Path]
    hold_out: list[Path]
    maps: list[Path]
    fit: str
    bounds: list[str]
    signal: str | None
    free: str | None
    trial_masses: list[str]
    seed: int
    hold_open: bool
    workers: int | None
    out: Path | None
    html: Path | None


def identify_command(scene_name: str, changes: list[str], given: IdentifyOptions) -> Command:
    """Return the command that identifies a drive's parameters from recordings.

    Args:
        scene_name, changes: see ``load_scene``.
        given: the other options.
    """
    scene = load_scene(scene_name, changes)
    keys = tuple(key.strip() for key in given.fit.split(",") if key.strip())
    question = Question(keys, bounds_of(given.bounds), given.seed, given.hold_open)
    free = tuple(part.strip() for part in (given.free or "").split(",") if part.strip())
    files = Files(
        given.recordings, given.without_balls, given.hold_out, given.maps, given.signal, free,
        trial_masses_of(given.trial_masses),
    )  # fmt: skip

    shared = processes(given.workers)

    def work(tell: Tell) -> Outcome:
        recordings, held_out = read_files(files, scene)
        found = run_identification(scene, recordings, question, held_out, tell, shared)

        def write_fitted() -> None:
            if given.out is not None:
                write_scene(found.scene_text(), given.out)

        def write_page() -> None:
            if given.html is not None:
                from ab_sim.reports.identification import identification_page

                try:
                    identification_page(found, given.html)
                except OSError as error:
                    raise InputError(
                        f"--html {given.html}: cannot be written: {error.strerror}"
                    ) from error

        return Outcome(_shown(found), found.report, plotted(found), (write_fitted, write_page))

    outputs = ((given.out, SCENE, "--out"), (given.html, PAGE, "--html"))
    left = "nothing was fitted yet"
    return Command(work, scene.name, left, outputs)


def _shown(found: Identification) -> Iterator[Table | str]:
    yield f"{found.before.name}: {found.verdict}"
    yield from (f"  {reason}" for reason in found.reasons)
    for note in found.notes:
        yield f"  {note}"
    yield _parameter_table(found)
    if found.tried:
        yield _tried_table(found)
    if found.proposals:
        yield "what to record next, the best first:"
    for each in found.proposals[:MOST_NAMED]:
        gain = f"{share_words(each.now)} -> {share_words(each.then)}"
        opens = f"; {each.gains}" if each.opens else ""
        yield f"  {each.name}: {each.words} (worst interval, {each.worst}: {gain}{opens})"
    if found.verdict == INTERRUPTED:
        raise Interrupted("interrupted; what is shown and written is the best so far, not a fit")


def _parameter_table(found: Identification) -> Table:
    table = Table(title="values and their intervals of 95 %")
    table.add_column("parameter", overflow="fold")
    for name in ("value", "from", "to", "began at"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("by", overflow="fold")
    for each in found.estimates:
        table.add_row(
            titled(each.name, each.unit),
            f"{each.value:.5g}", f"{each.low:.5g}", f"{each.high:.5g}", number(each.start),
            each.how + (", at bound" if each.at_bound else ""),
        )  # fmt: skip
    return table


def _tried_table(found: Identification) -> Table:
    table = Table(title="what is missing, tried one by one")
    for name in ("tried", "explains", "z with it"):
        table.add_column(name, justify="left" if name == "tried" else "right")
    for each in found.tried:
        if each.failure:
            table.add_row(each.name, "-", each.failure)
        else:
            table.add_row(each.name, _percent(each.explains), f"{each.z:.1f}")
    return table


def _percent(share: float) -> str:
    return "-" if not np.isfinite(share) else f"{100.0 * share:.2g} %"
