"""Results of random drives: share of balanced ones, quantiles, Sobol indices, worst runs."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from json import dumps
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import InputError, SceneError, short
from ab_sim.base.files import write_whole
from ab_sim.base.presentation import Column, Columns, Presented
from ab_sim.base.version import __version__
from ab_sim.base.yaml_files import yaml_text
from ab_sim.design.bounds import Bound
from ab_sim.design.judged import Job, varied_scene
from ab_sim.design.statistics import (
    MeanInterval,
    PairedShares,
    QuantileOfMetric,
    ShareBalanced,
    SobolIndex,
)
from ab_sim.design.sweep import Sweep
from ab_sim.design.tolerances import Tolerance
from ab_sim.scene.model import Scene

BALANCED = "balanced"
"""Name under which results list the balanced criterion among the metrics."""


class SobolIndices(NamedTuple):
    """Sobol indices of factors for each metric."""

    pairs: int
    """Number of pairs of drives that differ in all factors; 0 without indices."""
    runs: int
    """Number of additional runs for the indices."""
    indices: Mapping[str, tuple[SobolIndex, ...]]
    """Indices by metric; those of the criterion have the key ``BALANCED``."""
    missing: Mapping[str, str]
    """Reason of missing indices, by metric."""
    none: str = ""
    """Reason why there are no pairs of drives, and thus no indices; empty if there are pairs."""


class WorstRun(NamedTuple):
    """Run for closer inspection."""

    run: int
    """Number of the run."""
    outcome: str
    """Outcome in words, see ``judged.OUTCOMES``."""
    value: float | None
    """Value of the ranking metric; None if the run has none."""
    values: Mapping[str, Any]
    """Drawn values by key."""

    @property
    def changes(self) -> str:
        """Drawn values as options of ``ab-sim run``."""
        return " ".join(f"--set {shlex.quote(f'{k}={dumps(v)}')}" for k, v in self.values.items())


class DesignDifference(NamedTuple):
    """Comparison with another scene, run with the same draws."""

    runs: Sweep
    """Runs of the other scene, one per draw."""
    balanced: np.ndarray
    """True for each run that is balanced, shape (runs,)."""
    share: ShareBalanced
    """Share of balanced runs of the other scene, with its interval."""
    paired: PairedShares
    """Comparison of shares: first scene minus the other one."""
    metrics: Mapping[str, MeanInterval]
    """Differences by metric, first minus other scene, over draws with a value in both."""

    def report(self) -> dict[str, object]:
        """Return the comparison as JSON-able values."""
        return {
            "scene": self.runs.scene.as_mapping(),
            "share": self.share.report(),
            "paired": self.paired._asdict(),
            "metrics": {
                name: {**metric._asdict(), "median": metric.median._asdict()}
                for name, metric in self.metrics.items()
            },
            "outcomes": self.runs.outcomes,
            "balanced": self.balanced.tolist(),
            "runs": self.runs.table.to_pydict(),
        }


@dataclass(frozen=True, repr=False)
class Spread(Presented):
    """Random drives; see ``ab_sim.robust``."""

    _picture = "spread"

    runs: Sweep
    """Row per drive: drawn values, metrics, outcome, failure."""
    tolerances: tuple[Tolerance, ...]
    """Tolerances from which the drives were drawn."""
    criterion: tuple[Bound, ...]
    """Bounds that a settled run must satisfy to count as balanced."""
    seed: int
    """Seed of the draws."""
    balanced: np.ndarray
    """True for each run that is balanced, shape (runs,)."""
    share: ShareBalanced
    """Share of balanced runs with its interval."""
    quantiles: Mapping[str, tuple[QuantileOfMetric, ...]]
    """Quantiles by metric, over runs with a value."""
    sobol: SobolIndices
    """Sobol indices, or the reason why there are none."""
    ranked_by: str
    """Metric by which runs are ranked."""
    worst: tuple[WorstRun, ...]
    """Worst runs, the worst first."""
    against: DesignDifference | None = None
    """Comparison with another scene, run with the same draws; None if not requested."""

    @property
    def scene(self) -> Scene:
        """Nominal scene."""
        return self.runs.scene

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a column, shape (runs,); NaN where a number is null.

        Raises
        ------
        InputError
            The name is unknown.
        """
        return self.runs[name]

    def scene_of(self, run: int) -> Scene:
        """Return the scene of a run, to repeat it.

        Raises
        ------
        InputError
            There is no such run.
        SceneError
            The drawn values give no valid scene; the message states why.
        """
        return self.runs.scene_of(run)

    def in_units(self, units: str) -> "Spread":
        """Return a copy shown in other units: see ``Sweep.in_units``."""
        other = self.against
        if other is not None:
            other = other._replace(runs=other.runs.in_units(units))
        return replace(self, runs=self.runs.in_units(units), against=other)

    def write(self, path: Path | str) -> None:
        """Write the runs, as Parquet or CSV by its ending; ``ab_sim.open_sweep`` reads Parquet.

        Raises
        ------
        InputError
            The file cannot be written; the message contains the reason.
        """
        self.runs.write(path)

    def write_worst(self, folder: Path | str) -> list[Path]:
        """Write the worst runs as scenes, ``run-000123.yaml`` and so on.

        Parameters
        ----------
        folder
            Folder, created if necessary.

        Returns
        -------
        list[Path]
            Paths of the files; a run whose drawn values give no valid scene has none.

        Raises
        ------
        InputError
            The folder is not empty, or cannot be written to.
        """
        folder = Path(folder)
        check_worst_folder(folder)
        job, written = Job(self.scene, self.runs.keys, self.runs.metrics), []
        try:
            folder.mkdir(exist_ok=True)
            for worst_run in self.worst:
                try:
                    scene = varied_scene(job, list(worst_run.values.values()))
                except SceneError:
                    continue
                content = scene.as_mapping() | {"name": f"{self.scene.name}-run-{worst_run.run}"}
                file = folder / f"run-{worst_run.run:06d}.yaml"
                write_whole(file, yaml_text(content).encode())
                written.append(file)
        except OSError as error:
            raise InputError(f"{folder}: cannot be written: {error.strerror or error}") from error
        return written

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values in SI units; see docs/reference/json.md."""
        table = self.runs.table
        return {
            "scene": self.scene.as_mapping(),
            "spread": [tolerance.text for tolerance in self.tolerances],
            "seed": self.seed,
            "criterion": [str(bound) for bound in self.criterion],
            "share": self.share.report(),
            "quantiles": {
                name: [quantile._asdict() for quantile in quantile]
                for name, quantile in self.quantiles.items()
            },
            "sobol": {
                "pairs": self.sobol.pairs,
                "runs": self.sobol.runs,
                "indices": {
                    name: [quantile._asdict() for quantile in indices]
                    for name, indices in self.sobol.indices.items()
                },
                "missing": dict(self.sobol.missing),
            },
            "ranked_by": self.ranked_by,
            "worst": [
                {**worst_run._asdict(), "values": dict(worst_run.values)}
                for worst_run in self.worst
            ],
            "against": None if self.against is None else self.against.report(),
            "outcomes": self.runs.outcomes,
            "units": {name: self.runs.unit(name) for name in table.column_names},
            "balanced": self.balanced.tolist(),
            "runs": table.to_pydict(),
            "version": __version__,
        }

    def _facts(self) -> dict[str, str]:
        facts = {
            "scene": self.scene.name,
            "runs": str(self.share.runs),
            "balanced": share_text(self.share),
            "criterion": " and ".join(map(str, self.criterion)),
        }
        if self.against is not None:
            facts["of " + self.against.runs.scene.name] = share_text(self.against.share)
        return facts

    def _columns(self) -> Columns:
        return {**self.runs._columns(), "meets_criterion": Column(None, self.balanced.tolist())}


def check_worst_folder(folder: Path) -> None:
    """Refuse a folder that is not empty, so that the scenes are not mixed with other files.

    Raises
    ------
    InputError
        The folder is refused; the message states the remedy.
    """
    if folder.is_dir() and any(folder.iterdir()):
        raise InputError(f"{short(str(folder))}: is not empty; name a new or empty folder")
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{short(str(folder))}: is a file; name a folder")
    if not folder.absolute().parent.is_dir():
        raise InputError(f"{short(str(folder))}: there is no folder {folder.parent}")


def share_text(share: ShareBalanced) -> str:
    """Return a share and its interval in percent, with as many digits as the interval justifies."""
    digits = max(0, min(4, 2 - int(np.floor(np.log10(200.0 * share.half_width)))))
    value, low, high = (f"{100.0 * x:.{digits}f}" for x in (share.value, share.low, share.high))
    return f"{value} % ({low} to {high} %)"
