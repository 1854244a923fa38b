"""Table of a run's metrics, next to the run without variable-speed period, and without balls."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich.table import Table

from ab_sim.analysis import Compared, Comparison, Merits
from ab_sim.analysis.merits import BAND, FLOOR, LAST, reported_merits
from ab_sim.analysis.merits.merit import Merit, Row, WhirlScale
from ab_sim.analysis.merits.wording import number_text
from ab_sim.conventions import ANGLES, WHIRL
from ab_sim.drive.overlap import together_at_start
from ab_sim.scene import Scene


def merits_table(
    title: str, scene: Scene, runs: Mapping[str, Merits], comparison: Comparison
) -> Table:
    """Return a table with a column for each run and each run that they are compared with.

    Args:
        title: title of the table.
        scene: scene of the runs.
        runs: metrics of the runs by heading.
        comparison: runs to compare with.
    """
    columns = dict(runs)
    notes = []
    for head, beside in comparison.by_name().items():
        if isinstance(beside, Compared):
            columns[head] = beside.merits
        else:
            notes.append(f"{head} it could not run: {beside}")
    runs_beside = list(columns.values())
    scale = _scale(scene)
    table = Table(title=title, caption_justify="left")
    table.add_column("", no_wrap=True)
    for head in columns:
        table.add_column(head, overflow="fold", min_width=len("balanced"))

    for merit, row in _rows():
        cells = [row.text(merits, scale) for merits in runs_beside]
        if _shown(row, scene, cells):
            table.add_row(row.head(scale.symbol), *cells)
            notes += _notes(row, cells)
        if merit.relative is not None and scene.balls.count:
            shares = [comparison.relative(merit, merits) for merits in runs_beside]
            table.add_row(merit.relative.label, *map(number_text, shares))
    table.caption = "\n".join([_caption(scene), *notes])
    return table


def _scale(scene: Scene) -> WhirlScale:
    e = scene.rotor.eccentricity
    return WhirlScale(1 / e, "e", "W/e") if e > 0 else WhirlScale(1e3, "mm", "W [mm]")


def _rows() -> list[tuple[Merit[Any], Row]]:
    """Return the reported metrics and their rows, in the order of the table."""
    rows = [(merit, merit.row) for merit in reported_merits() if merit.row is not None]
    return sorted(rows, key=lambda each: each[1].place)


def _shown(row: Row, scene: Scene, cells: Sequence[str]) -> bool:
    if row.applies is not None:
        return row.applies(scene)
    return row.says(cells)


def _notes(row: Row, cells: Sequence[str]) -> Iterator[str]:
    if row.note:
        yield row.note
    if row.caution and row.says(cells):
        yield f"{row.caution[0].upper()}{row.caution[1:]}."


def _caption(scene: Scene) -> str:
    def sentences() -> Iterator[str]:
        yield (
            f"Final: root mean square over the last {100 * LAST:g} % of the run. Band: "
            f"+-{100 * BAND:g} % of final W, at least +-{100 * FLOOR:g} % of M0 e/M. "
            "Times, and when all balls were at -180 deg first, from the run's start."
        )
        if scene.balls.count:
            yield "Without balls: their mass is taken out too."
        if together := together_at_start(scene):
            yield f"{together[0].upper()}{together[1:]}."
        if scene.deck is not None:
            yield "Tilt: of the shaft, about any axis."
        if "gravity" in scene.effects:
            tilt = " and tilt count" if scene.deck is not None else " counts"
            yield f"W{tilt} from where the deck hangs."
        yield f"W, e, M0 e/M: {WHIRL}; angles: {ANGLES}."

    return " ".join(sentences())
