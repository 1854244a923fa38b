"""`ab-sim identify`."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.table import Table

from ab_sim.base.errors import Interrupted
from ab_sim.base.files import PAGE, SCENE
from ab_sim.base.presentation import Progress, number, titled
from ab_sim.cli.checks import processes
from ab_sim.cli.recording_commands import IdentifyOptions
from ab_sim.cli.runner import Command, Outcome, new_table, picture, scene_writer
from ab_sim.identification.files import Files, read_files, trial_masses_of
from ab_sim.identification.parameters import bounds_of
from ab_sim.identification.result import INTERRUPTED, Identification, share_words
from ab_sim.identification.run import IdentificationSettings, run_identification
from ab_sim.scene import load_scene

_MOST_NAMED = 3
"""Largest number of proposed recordings that are printed."""


def identify_command(options: IdentifyOptions) -> Command:
    """Return the command that identifies a drive's parameters from recordings."""
    scene = load_scene(options.scene, options.change)
    settings = IdentificationSettings(
        _names(options.fit), bounds_of(options.bounds), options.seed, options.hold_open
    )
    files = Files(
        options.recordings, options.without_balls, options.hold_out, options.map, options.signal,
        _names(options.free or ""), trial_masses_of(options.trial_mass),
    )  # fmt: skip
    workers = processes(options.workers)

    def work(tell: Progress) -> Outcome:
        recordings, held_out = read_files(files, scene)
        identification = run_identification(scene, recordings, settings, held_out, tell, workers)

        def write_page(file: Path) -> None:
            from ab_sim.show.identification import identification_page

            identification_page(identification, file)

        writes = {"--out": scene_writer(identification.scene_text), "--html": write_page}
        return Outcome(
            _shown(identification),
            identification.report,
            picture("identification", identification),
            writes,
        )

    outputs = ((options.out, SCENE, "--out"), (options.html, PAGE, "--html"))
    return Command(work, scene.name, "nothing was fitted yet", outputs)


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())


def _shown(identification: Identification) -> Iterator[Table | str]:
    yield f"{identification.before.name}: {identification.verdict}"
    yield from (f"  {reason}" for reason in identification.reasons)
    for note in identification.notes:
        yield f"  {note}"
    yield _parameter_table(identification)
    if identification.tried:
        yield _tried_table(identification)
    if identification.proposals:
        yield "proposed next recordings, the best first:"
    for proposal in identification.proposals[:_MOST_NAMED]:
        gain = f"{share_words(proposal.now)} -> {share_words(proposal.then)}"
        opens = f"; {proposal.gains}" if proposal.opens else ""
        worst = f"worst interval, {proposal.worst}: {gain}{opens}"
        yield f"  {proposal.name}: {proposal.words} ({worst})"
    if identification.verdict == INTERRUPTED:
        raise Interrupted("interrupted; the values are the best so far, not those of a fit")


def _parameter_table(identification: Identification) -> Table:
    table = Table(title="values and their 95 % intervals")
    table.add_column("parameter", overflow="fold")
    for name in ("value", "from", "to", "start"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("by", overflow="fold")
    for estimate in identification.estimates:
        table.add_row(
            titled(estimate.name, estimate.unit),
            f"{estimate.value:.5g}", f"{estimate.low:.5g}", f"{estimate.high:.5g}",
            number(estimate.start),
            estimate.how + (", at bound" if estimate.at_bound else ""),
        )  # fmt: skip
    return table


def _tried_table(identification: Identification) -> Table:
    table = new_table("tried", "explains | z with it", title="missing effects, tried one by one")
    for trial in identification.tried:
        if trial.failure:
            table.add_row(trial.name, "-", trial.failure)
        else:
            table.add_row(trial.name, _percent(trial.explains), f"{trial.z:.1f}")
    return table


def _percent(share: float) -> str:
    return "-" if not np.isfinite(share) else f"{100.0 * share:.2g} %"
