"""What share of built drives balances, how good they are, and which tolerance is to blame."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from json import dumps
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import ab_sim
from ab_sim.design.bounds import Bound
from ab_sim.design.intervals import MeanInterval, PairedShares, QuantileOfMerit, ShareBalanced
from ab_sim.design.judged import Job, varied_scene
from ab_sim.design.sensitivity import SobolIndex
from ab_sim.design.sweep import Sweep
from ab_sim.design.tolerances import Tolerance
from ab_sim.errors import InputError, SceneError
from ab_sim.limited_yaml import yaml_text
from ab_sim.output_file import write_whole
from ab_sim.presentation import Column, Columns, Presented
from ab_sim.quoting import short
from ab_sim.scene.model import Scene

BALANCED = "balanced"
"""Name of what the criterion says of a run, beside the merits."""


class SobolIndices(NamedTuple):
    """Which factor has which share in the variance of what."""

    pairs: int
    """Of drives that differ in all factors; 0: there are no indices."""
    runs: int
    """What they cost beside the runs that are there anyhow."""
    indices: Mapping[str, tuple[SobolIndex, ...]]
    """By merit, and of whether a run is balanced."""
    missing: Mapping[str, str]
    """Why others have none, by merit."""
    none: str = ""
    """Why there are no pairs."""


class WorstRun(NamedTuple):
    """A run to look at."""

    run: int
    outcome: str
    value: float | None
    """Of the merit by which runs are ranked; None if it has none."""
    values: Mapping[str, Any]
    """What was drawn, by key."""

    @property
    def changes(self) -> str:
        """As options of ``ab-sim run``."""
        return " ".join(f"--set {shlex.quote(f'{k}={dumps(v)}')}" for k, v in self.values.items())


class DesignDifference(NamedTuple):
    """Another scene in the same draws."""

    runs: Sweep
    """Of the other scene."""
    balanced: np.ndarray
    """Booleans, shape (runs,)."""
    share: ShareBalanced
    paired: PairedShares
    """The first scene, less the other one."""
    merits: Mapping[str, MeanInterval]
    """Differences by merit, first scene less the other one; of draws with a value in both."""

    def report(self) -> dict[str, object]:
        """As JSON-able values."""
        return {
            "scene": self.runs.scene.as_mapping(),
            "share": share_report(self.share),
            "paired": self.paired._asdict(),
            "merits": {
                name: {**found._asdict(), "median": found.median._asdict()}
                for name, found in self.merits.items()
            },
            "outcomes": self.runs.outcomes,
            "balanced": self.balanced.tolist(),
            "runs": {n: self.runs.table[n].to_pylist() for n in self.runs.table.column_names},
        }


@dataclass(frozen=True, repr=False)
class Spread(Presented):
    """Drives as they are built; see ``ab_sim.robust``."""

    _picture = "spread"

    runs: Sweep
    """A row for each drive: what was drawn, merits, outcome, failure."""
    tolerances: tuple[Tolerance, ...]
    criterion: tuple[Bound, ...]
    """All have to hold of a run that has settled, for it to be called balanced."""
    seed: int
    balanced: np.ndarray
    """Whether it is, by run; shape (runs,)."""
    share: ShareBalanced
    """That is balanced, with its interval."""
    quantiles: Mapping[str, tuple[QuantileOfMerit, ...]]
    """By merit, of the runs that have it."""
    sobol: SobolIndices
    ranked_by: str
    """The merit by which runs are the worst."""
    worst: tuple[WorstRun, ...]
    """The worst first."""
    against: DesignDifference | None = None
    """Another scene in the same draws, if asked for."""

    @property
    def scene(self) -> Scene:
        """The drawing."""
        return self.runs.scene

    def __getitem__(self, name: str) -> np.ndarray:
        """A column, shape (runs,); NaN where a number is null.

        Raises:
            InputError: there is none of that name.
        """
        return self.runs[name]

    def scene_of(self, run: int) -> Scene:
        """The scene of a run, to run it again.

        Raises:
            InputError: there is no such run.
            SceneError: it was none; says why.
        """
        return self.runs.scene_of(run)

    def in_units(self, units: str) -> "Spread":
        """The same, shown in other units: see ``Sweep.in_units``."""
        other = self.against
        if other is not None:
            other = other._replace(runs=other.runs.in_units(units))
        return replace(self, runs=self.runs.in_units(units), against=other)

    def write(self, path: Path | str) -> None:
        """Write the runs, as Parquet or CSV by its ending; ``ab_sim.open_sweep`` reads Parquet.

        Raises:
            InputError: it cannot be written; names it and the reason.
        """
        self.runs.write(path)

    def write_worst(self, folder: Path | str) -> list[Path]:
        """Write the worst runs as scenes, ``run-000123.yaml`` and so on.

        Args:
            folder: made if need be.

        Returns:
            The files; what was drawn and is no scene has none.

        Raises:
            InputError: the folder is not empty, or cannot be written to.
        """
        folder = Path(folder)
        check_worst_folder(folder)
        job, written = Job(self.scene, self.runs.keys, self.runs.merits), []
        try:
            folder.mkdir(exist_ok=True)
            for each in self.worst:
                try:
                    scene = varied_scene(job, list(each.values.values()))
                except SceneError:
                    continue
                content = scene.as_mapping() | {"name": f"{self.scene.name}-run-{each.run}"}
                file = folder / f"run-{each.run:06d}.yaml"
                write_whole(file, yaml_text(content).encode())
                written.append(file)
        except OSError as error:
            raise InputError(f"{folder}: cannot be written: {error.strerror or error}") from error
        return written

    def report(self) -> dict[str, object]:
        """Everything as JSON-able values, SI units: see ``ab-sim robust --help``."""
        table = self.runs.table
        return {
            "scene": self.scene.as_mapping(),
            "spread": [each.text for each in self.tolerances],
            "seed": self.seed,
            "criterion": [str(each) for each in self.criterion],
            "share": share_report(self.share),
            "quantiles": {
                name: [each._asdict() for each in found] for name, found in self.quantiles.items()
            },
            "sobol": {
                "pairs": self.sobol.pairs,
                "runs": self.sobol.runs,
                "indices": {
                    name: [each._asdict() for each in found]
                    for name, found in self.sobol.indices.items()
                },
                "missing": dict(self.sobol.missing),
            },
            "ranked_by": self.ranked_by,
            "worst": [{**each._asdict(), "values": dict(each.values)} for each in self.worst],
            "against": None if self.against is None else self.against.report(),
            "outcomes": self.runs.outcomes,
            "units": {name: self.runs.unit(name) for name in table.column_names},
            "balanced": self.balanced.tolist(),
            "runs": {name: table[name].to_pylist() for name in table.column_names},
            "version": ab_sim.__version__,
        }

    def _facts(self) -> dict[str, str]:
        said = {
            "scene": self.scene.name,
            "runs": str(self.share.runs),
            "balanced": share_text(self.share),
            "criterion": " and ".join(map(str, self.criterion)),
        }
        if self.against is not None:
            said["of " + self.against.runs.scene.name] = share_text(self.against.share)
        return said

    def _columns(self) -> Columns:
        table = self.runs.table
        columns = {
            name: Column(self.runs.unit(name), table[name].to_pylist())
            for name in table.column_names
        }
        return {**columns, "meets_criterion": Column(None, self.balanced.tolist())}


def check_worst_folder(folder: Path) -> None:
    """Refuse a folder in which files of others would stand among the scenes.

    Raises:
        InputError: names it, and says what to do.
    """
    if folder.is_dir() and any(folder.iterdir()):
        raise InputError(f"{short(str(folder))}: has something in it; name a new or empty folder")
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{short(str(folder))}: is a file; name a folder")
    if not folder.absolute().parent.is_dir():
        raise InputError(f"{short(str(folder))}: there is no folder {folder.parent}")


def share_text(share: ShareBalanced) -> str:
    """A share with its interval, in digits that the interval allows."""
    digits = max(0, min(4, 2 - int(np.floor(np.log10(200.0 * share.half_width)))))
    value, low, high = (f"{100.0 * x:.{digits}f}" for x in (share.value, share.low, share.high))
    return f"{value} % ({low} to {high} %)"


def share_report(share: ShareBalanced) -> dict[str, object]:
    """As JSON-able values."""
    return {**share._asdict(), "value": share.value}
