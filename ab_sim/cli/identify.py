"""`ab-sim identify`."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.table import Table

from ab_sim.base.errors import Interrupted
from ab_sim.base.output_file import PAGE, SCENE
from ab_sim.base.presentation import number, titled
from ab_sim.base.progress import Progress
from ab_sim.cli.checks import processes
from ab_sim.cli.recording_commands import IdentifyOptions
from ab_sim.cli.runner import Command, Outcome, new_table, plotted, scene_writer
from ab_sim.identification.files import Files, read_files, trial_masses_of
from ab_sim.identification.parameters import bounds_of
from ab_sim.identification.result import INTERRUPTED, Identification, share_words
from ab_sim.identification.run import Question, run_identification
from ab_sim.scene import load_scene

MOST_NAMED = 3
"""Largest number of proposed recordings."""


def identify_command(given: IdentifyOptions) -> Command:
    """Return the command that identifies a drive's parameters from recordings."""
    scene = load_scene(given.scene, given.change)
    question = Question(_names(given.fit), bounds_of(given.bounds), given.seed, given.hold_open)
    files = Files(
        given.recordings, given.without_balls, given.hold_out, given.map, given.signal,
        _names(given.free or ""), trial_masses_of(given.trial_mass),
    )  # fmt: skip
    workers = processes(given.workers)

    def work(tell: Progress) -> Outcome:
        recordings, held_out = read_files(files, scene)
        identification = run_identification(scene, recordings, question, held_out, tell, workers)

        def write_page(file: Path) -> None:
            from ab_sim.show.reports.identification import identification_page

            identification_page(identification, file)

        writes = {"--out": scene_writer(identification.scene_text), "--html": write_page}
        return Outcome(
            _shown(identification), identification.report, plotted(identification), writes
        )

    outputs = ((given.out, SCENE, "--out"), (given.html, PAGE, "--html"))
    return Command(work, scene.name, "nothing was fitted yet", outputs)


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())


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
    table = new_table("tried", "explains | z with it", title="missing effects, tried one by one")
    for each in found.tried:
        if each.failure:
            table.add_row(each.name, "-", each.failure)
        else:
            table.add_row(each.name, _percent(each.explains), f"{each.z:.1f}")
    return table


def _percent(share: float) -> str:
    return "-" if not np.isfinite(share) else f"{100.0 * share:.2g} %"
