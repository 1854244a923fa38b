"""What a run is judged by, as a table: beside the same run without period, and without balls."""

from collections.abc import Iterator, Mapping

from rich.table import Table

from ab_sim.analysis import Compared, Comparison, Merits
from ab_sim.analysis.merits import BAND, FLOOR, LAST
from ab_sim.conventions import ANGLES, WHIRL
from ab_sim.drive.overlap import WHAT_CHANGES, overlaps_text
from ab_sim.reports.wording import (
    angles_text,
    circulating_text,
    final_text,
    in_band_text,
    milli_text,
    number_text,
    passage_text,
    peak_text,
)
from ab_sim.scene import Scene

CIRCULATE = (
    "Balls circulate: they go round the race, steadily, as long as the run lasts, and do not "
    "balance the rotor; their speed is absolute, in the mean over the last stretch."
)


def merits_table(
    title: str, scene: Scene, runs: Mapping[str, Merits], comparison: Comparison
) -> Table:
    """A column for each run, and for each that they are compared with.

    Args:
        title: the table's.
        scene: what was run.
        runs: by the heads of their columns.
        comparison: what stands beside them.
    """
    columns = dict(runs)
    notes = []
    for head, beside in comparison.by_name().items():
        if isinstance(beside, Compared):
            columns[head] = beside.merits
        else:
            notes.append(f"{head} it could not run: {beside}")
    merits = list(columns.values())
    e = scene.rotor.eccentricity
    scale, unit, symbol = (1 / e, "e", "W/e") if e > 0 else (1e3, "mm", "W [mm]")
    balls = scene.balls.count > 0
    table = Table(title=title, caption_justify="left")
    table.add_column("", no_wrap=True)
    for head in columns:
        table.add_column(head, overflow="fold")

    table.add_row(f"peak {symbol}", *(peak_text(m, scale) for m in merits))
    table.add_row(f"final {symbol}", *(final_text(m, scale) for m in merits))
    if balls:
        shares = [comparison.relative_whirl(m) for m in merits]
        table.add_row("... / without balls", *(number_text(share) for share in shares))
        table.add_row("residual unbalance", *(number_text(m.residual_unbalance) for m in merits))
        if any(m.residual_couple is not None for m in merits):
            table.add_row("residual couple", *(number_text(m.residual_couple) for m in merits))
    if scene.deck is not None:
        table.add_row("peak tilt [mrad]", *(milli_text(m.peak_tilt) for m in merits))
        table.add_row("final tilt [mrad]", *(milli_text(m.final_tilt) for m in merits))
    table.add_row("in the band", *(in_band_text(m, scale, unit) for m in merits))
    if balls and scene.profile is not None and scene.profile.kind == "start_up":
        table.add_row("all at -180 deg", *(passage_text(m) for m in merits))
    if balls:
        table.add_row("final ball angles", *(angles_text(m) for m in merits))
    if any(m.circulating for m in merits):
        table.add_row("balls circulate", *(circulating_text(m) for m in merits))
        notes.append(CIRCULATE)
    if any(m.overlaps for m in merits):
        table.add_row("balls overlap", *(overlaps_text(m.overlaps) for m in merits))
        notes.append(f"Balls overlap: {WHAT_CHANGES}.")
    table.add_row("final speed", *(f"{m.final_speed:.4g} rad/s" for m in merits))
    table.caption = "\n".join([_caption(scene), *notes])
    return table


def _caption(scene: Scene) -> str:
    def sentences() -> Iterator[str]:
        yield (
            f"Final: root mean square over the last {100 * LAST:g} % of the run. Band: "
            f"+-{100 * BAND:g} % of final W, at least +-{100 * FLOOR:g} % of M0 e/M. "
            "Times, and when all balls were at -180 deg first, from the run's start."
        )
        if scene.balls.count:
            yield "Without balls: their mass is taken out too."
        if scene.deck is not None:
            yield "Tilt: of the shaft, about any axis."
        if "gravity" in scene.effects:
            tilt = " and tilt count" if scene.deck is not None else " counts"
            yield f"W{tilt} from where the deck hangs."
        yield f"W, e, M0 e/M: {WHIRL}; angles: {ANGLES}."

    return " ".join(sentences())
