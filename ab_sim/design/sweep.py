"""Sweep of a scene over some of its keys: a row of metrics per run."""

import json
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow
from pyarrow import csv, parquet

from ab_sim.analysis.metrics.metric import Better
from ab_sim.analysis.metrics.verdict import BALANCED
from ab_sim.base.errors import InputError, SceneError, short
from ab_sim.base.files import check_regular, replacing
from ab_sim.base.presentation import Column, Columns, Presented, Progress, number, titled
from ab_sim.base.version import __version__
from ab_sim.base.workers import Workers
from ab_sim.design.judged import (
    FAILURE,
    OUTCOME,
    OUTCOMES,
    RUN,
    Job,
    has_settled,
    metric_columns,
    varied_scene,
)
from ab_sim.design.points import MOST_RUNS, Points
from ab_sim.design.work import Executor, rows_of
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.drive.overlap import together_at_start
from ab_sim.scene.keys import scene_keys
from ab_sim.scene.load import check_scene
from ab_sim.scene.model import Scene
from ab_sim.scene.units import ShownUnit, ShownUnits, shown_units

if TYPE_CHECKING:
    from xarray import Dataset  # type: ignore[import-not-found, unused-ignore]

DEFAULT_METRICS = ("final_whirl_over_e", "in_band_from", "peak_whirl_over_e", "residual_unbalance")
"""Default metrics of a sweep."""
ABOUT = b"ab_sim.sweep"
"""Key of the sweep's description, JSON, in the metadata of a Parquet schema."""
UNIT, _AS_JSON = b"unit", b"as_json"
"""Metadata keys of a column: its unit; flag of values stored as JSON, such as lists."""


@dataclass(frozen=True, repr=False)
class Sweep(Presented):
    """Runs of a scene over values of its keys; see ``ab_sim.sweep``."""

    _picture = "sweep"

    scene: Scene
    """Scene of the sweep; a requested accuracy has been resolved to a solver."""
    keys: tuple[str, ...]
    """Varied keys, dotted."""
    metrics: tuple[str, ...]
    """Metrics with columns."""
    points: dict[str, object]
    """Definition of the points: values of a grid, or a design's ranges, count and seed."""
    table: pyarrow.Table
    """Row per run: run, keys, metrics, outcome, failure; SI units, whirls in e."""
    shown_units: ShownUnits = field(default_factory=dict)
    """Units of tables and pictures for users; columns, reports and files keep theirs."""

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a column, shape (runs,); NaN where a number is null.

        Raises
        ------
        InputError
            The name is unknown.
        """
        if name not in self.table.column_names:
            raise InputError(f"{short(name)}: no such column; there are: {self._names}")
        column = self.table[name]
        if pyarrow.types.is_boolean(column.type) and column.null_count:
            column = column.cast(pyarrow.float64())
        values: np.ndarray = column.to_numpy(zero_copy_only=False)
        return values

    @property
    def _names(self) -> str:
        """Names of all columns, for messages."""
        return ", ".join(self.table.column_names)

    @property
    def outcomes(self) -> dict[str, int]:
        """Number of runs by outcome; see ``OUTCOMES``."""
        counts = Counter(self.table[OUTCOME].to_pylist())
        return {name: counts[name] for name in OUTCOMES if counts[name]}

    @property
    def reasons(self) -> dict[str, str]:
        """Reason of the first failure and of the first abort, by outcome."""
        outcomes, why = (self.table[name].to_pylist() for name in (OUTCOME, FAILURE))
        texts: dict[str, str] = {}
        for outcome, reason in zip(outcomes, why, strict=True):
            if reason:
                texts.setdefault(outcome, reason)
        return texts

    @property
    def shape(self) -> tuple[int, ...] | None:
        """Number of values per key of a grid; None for a design."""
        grid = self.points.get("grid")
        return tuple(map(len, grid.values())) if isinstance(grid, dict) else None

    @property
    def start_warning(self) -> str:
        """Warning about equal balls that start at one angle; empty if balls separate.

        It checks the first, the middle and the last run.
        """
        for run in dict.fromkeys([0, len(self.table) // 2, len(self.table) - 1]):
            with suppress(SceneError):
                if reason := together_at_start(self.scene_of(run)):
                    return reason
        return ""

    def unit(self, name: str) -> str | None:
        """Return the unit of a column: SI, e for whirls, 1 if dimensionless; None for words."""
        return self._about(name, UNIT)

    def in_units(self, units: str) -> "Sweep":
        """Return a copy whose pictures and printed tables use other units.

        Columns and files are unchanged.

        Parameters
        ----------
        units
            Units separated by commas, e.g. ``"rpm, g mm, deg"``.

        Raises
        ------
        InputError
            See ``shown_units``.
        """
        return replace(self, shown_units=shown_units(units))

    def factor(self, name: str) -> float:
        """Return the factor from a column's values to the displayed unit."""
        unit = self._shown_unit(name)
        return 1.0 if unit is None else unit.factor

    def shown(self, name: str) -> np.ndarray:
        """Return a column's values in the displayed unit, shape (runs,)."""
        factor = self.factor(name)
        return self[name] if factor == 1.0 else self[name] * factor

    def titled(self, name: str) -> str:
        """Return a column's name with its displayed unit."""
        unit = self._shown_unit(name)
        return titled(name, self.unit(name) if unit is None else unit.text)

    def setting(self, key: str, value: float | str) -> str:
        """Return ``KEY=VALUE`` in the displayed unit; the unit is added if it is not SI.

        Parameters
        ----------
        key
            Dotted key of the scene.
        value
            Value in SI, or a word.
        """
        if isinstance(value, str):
            return f"{key}={value}"
        unit = self._shown_unit(key)
        text = number(value) if unit is None else number(value * unit.factor, unit.text)
        return f"{key}={text}"

    def _shown_unit(self, name: str) -> ShownUnit | None:
        """Return the displayed unit of a column; None for its own."""
        return self.shown_units.get(self.unit(name) or "")

    def _about(self, name: str, what: bytes) -> str | None:
        """Return a column's metadata, ``UNIT`` or ``_AS_JSON``; None if it has none."""
        entry: bytes | None = (self.table.schema.field(name).metadata or {}).get(what)
        return None if entry is None else entry.decode()

    def best(self, metric: str) -> int | None:
        """Return the index of the settled run with a metric's best value; None if none.

        For a time into the band, only balanced runs count if there is one, because an unbalanced
        drive may settle sooner.

        Raises
        ------
        InputError
            The metric has no preferred values.
        """
        (judged,) = metric_columns([metric])
        better = judged.better
        if better is Better.NEITHER:
            raise InputError(f"metric {metric!r}: has no preferred values; choose another metric")
        count = has_settled(self[OUTCOME])
        balanced = np.isin(self[OUTCOME].astype(str), BALANCED)
        if judged.of_balanced and balanced.any():
            count = balanced
        values = np.where(count, self[metric].astype(float), np.nan)
        if not np.isfinite(values).any():
            return None
        place = np.nanargmin(values) if better is Better.SMALLER else np.nanargmax(values)
        return int(self[RUN][place])

    def scene_of(self, run: int) -> Scene:
        """Return the scene of a run, to repeat it.

        Raises
        ------
        InputError
            There is no such run.
        SceneError
            Its values give no valid scene; the message states why.
        """
        if not 0 <= run < len(self.table):
            raise InputError(f"run {run!r}: must be from 0 to {len(self.table) - 1}")
        row = self.table.slice(run, 1).to_pylist()[0]
        values = [
            json.loads(row[key]) if self._about(key, _AS_JSON) else row[key] for key in self.keys
        ]
        return varied_scene(Job(self.scene, self.keys, self.metrics), values)

    def write(self, path: Path | str) -> None:
        """Write the table as Parquet (with units and scene) or CSV, by the suffix.

        Raises
        ------
        InputError
            The file cannot be written; the message contains the reason.
        """
        path = Path(path)
        if path.suffix.lower() not in (".parquet", ".csv"):
            raise InputError(f"{path}: must end in .parquet or .csv")
        try:
            with replacing(path) as unfinished:
                if path.suffix.lower() == ".csv":
                    csv.write_csv(self.table, unfinished)
                else:
                    parquet.write_table(self.table, unfinished, compression="zstd")
        except OSError as error:
            raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values in SI units; see docs/reference/json.md."""
        return {
            "scene": self.scene.as_mapping(),
            "keys": list(self.keys),
            "metrics": list(self.metrics),
            "points": self.points,
            "units": {name: self.unit(name) for name in self.table.column_names},
            "outcomes": self.outcomes,
            "runs": self.table.to_pydict(),
            "version": __version__,
        }

    def to_xarray(self) -> "Dataset":
        """Return a grid's metrics with the keys as dimensions.

        Raises
        ------
        InputError
            The sweep is not a grid.
        ImportError
            Xarray is not installed, which ab_sim does not need otherwise.
        """
        try:
            from xarray import Dataset
        except ImportError as error:
            raise ImportError(
                "to_xarray() needs xarray, which is not installed: pip install xarray"
            ) from error
        if self.shape is None:
            raise InputError("to_xarray: the points of a design are not a grid; use to_dataframe")
        coordinates = {
            key: (key, np.moveaxis(self[key].reshape(self.shape), axis, 0).reshape(count, -1)[:, 0])
            for axis, (key, count) in enumerate(zip(self.keys, self.shape, strict=True))
        }
        variables = {
            name: (
                list(self.keys),
                self[name].reshape(self.shape),
                {"units": self.unit(name) or ""},
            )
            for name in (*self.metrics, OUTCOME)
        }
        dataset = Dataset(variables, coordinates, {"scene": self.scene.name})
        for name in (*self.keys, *self.metrics):
            dataset[name].attrs["units"] = self.unit(name) or ""
        return dataset

    def _facts(self) -> dict[str, str]:
        facts = {"scene": self.scene.name, "runs": str(len(self.table))}
        if self.shape is not None:
            facts["grid"] = " x ".join(map(str, self.shape))
        facts |= {name: str(count) for name, count in self.outcomes.items()}
        for metric in self.metrics:
            if metric_columns([metric])[0].better is not Better.NEITHER:
                run = self.best(metric)
                if run is not None:
                    unit = self.unit(metric) or ""
                    best = float(self[metric][run])
                    facts[f"best {metric}"] = f"{number(best, unit.replace('1', ''))} in run {run}"
        return facts

    def _columns(self) -> Columns:
        return {
            name: Column(self.unit(name), self.table[name].to_pylist())
            for name in self.table.column_names
        }


def run_sweep(
    scene: Scene,
    points: Points,
    metrics: Iterable[str] = DEFAULT_METRICS,
    executor: Executor | None = None,
    tell: Progress | None = None,
) -> Sweep:
    """Run a scene at points; arguments as for ``rows_of``, ``executor`` None for this process.

    Raises
    ------
    InputError
        A metric is not a number, or another process is computing the same sweep.
    SceneError
        None of the first points is a valid scene; the message states why.
    """
    wanted = tuple(dict.fromkeys(metrics))
    metric_columns(wanted)
    resolved, _ = resolve_accuracy(scene)
    job = Job(resolved, points.keys, wanted)
    check_first(job, points)
    with executor or Workers(1) as entered:
        return sweep_of(job, points, rows_of(job, points, entered, tell))


def sweep_of(job: Job, points: Points, rows: pyarrow.Table) -> Sweep:
    """Return a sweep from computed rows, one row per point, in the order of the points."""
    about = points.report()
    return Sweep(job.scene, job.keys, job.metrics, about, table_of(job, points, rows))


def check_first(job: Job, points: Points) -> None:
    """Check a few points before anything runs, as a typing error would make every run fail.

    Raises
    ------
    SceneError
        None of the first, middle and last points is a valid scene; the message states why.
    """
    first = None
    for run in dict.fromkeys([0, len(points) // 2, len(points) - 1]):
        try:
            varied_scene(job, points.at(run))
        except SceneError as error:
            first = first or error
        else:
            return
    if first is not None:
        raise first


def table_of(job: Job, points: Points, rows: pyarrow.Table) -> pyarrow.Table:
    """Return rows as ``Sweep.table``, with the keys' columns, units and a description.

    Parameters
    ----------
    job
        Common data of the runs.
    points
        Points of the rows, in their order.
    rows
        See ``rows_of``.
    """
    table = _with_values(job, points, rows)
    units: dict[str, str | None] = {RUN: "1", OUTCOME: None, FAILURE: None}
    units |= {key: unit_of(key) for key in job.keys}
    units |= {metric.key: metric.unit for metric in metric_columns(job.metrics)}
    fields = [
        field.with_metadata({**(field.metadata or {}), UNIT: unit})
        if (unit := units[field.name])
        else field
        for field in table.schema
    ]
    metadata = {
        "scene": job.scene.as_mapping(),
        "keys": list(job.keys),
        "metrics": list(job.metrics),
        "points": points.report(),
        "version": __version__,
    }
    return table.cast(pyarrow.schema(fields, {ABOUT: json.dumps(metadata, allow_nan=False)}))


def _with_values(job: Job, points: Points, rows: pyarrow.Table) -> pyarrow.Table:
    """Return rows with the columns of the keys' values after the run number.

    Values that a column of one type cannot hold, such as lists, are stored as JSON.
    """
    values = list(zip(*(points.at(run) for run in range(len(points))), strict=True))
    table = rows
    for place, (key, column) in enumerate(zip(job.keys, values, strict=True), start=1):
        kinds = {type(value) for value in column}
        about: dict[bytes, bytes] = {}
        if not (kinds <= {int, float} or kinds in ({str}, {bool})):
            column, about = tuple(json.dumps(value) for value in column), {_AS_JSON: b"1"}
        array = pyarrow.array(column, pyarrow.float64() if kinds == {int, float} else None)
        table = table.add_column(place, pyarrow.field(key, array.type, metadata=about), array)
    return table


def unit_of(key: str) -> str | None:
    """Return the unit of a scene's key; None if it is not a number."""
    unit = scene_keys(key)[0].unit
    return None if unit == "-" else unit


def open_sweep(path: Path | str) -> Sweep:
    """Read a file of ``Sweep.write`` or ``ab-sim sweep --parquet``.

    Parameters
    ----------
    path : str or Path
        Parquet file of a sweep.

    Returns
    -------
    Sweep
        The sweep as it was written.

    Raises
    ------
    InputError
        The file cannot be read, or is not a sweep's; the message states file and reason.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["duration=0.2"])
    >>> ab_sim.sweep(scene, {"balls.mass": [0.001, 0.002]}).write("balls.parquet")
    >>> ab_sim.open_sweep("balls.parquet")
    <Sweep: scene thesis-hold, runs 2, grid 2, ...>
    """
    try:
        check_regular(Path(path))
        with parquet.ParquetFile(path) as file:
            rows = file.metadata.num_rows
            if rows > MOST_RUNS:
                raise InputError(f"{path}: has {rows} rows; must have at most {MOST_RUNS}")
            about = json.loads((file.schema_arrow.metadata or {})[ABOUT])
            table = file.read()
            table.select([*about["keys"], *about["metrics"], OUTCOME, FAILURE])  # all are there
            if table[RUN].to_pylist() != list(range(rows)):
                raise ValueError("its runs are not numbered in order")
        scene = check_scene(about["scene"], str(path))
        keys, metrics = tuple(about["keys"]), tuple(about["metrics"])
        return Sweep(scene, keys, metrics, about["points"], table)
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read: {error.strerror or str(error).strip()}"
        ) from error
    except (KeyError, ValueError, TypeError, pyarrow.ArrowException) as error:
        raise InputError(
            f"{path}: is not a Parquet file of a sweep, or is from another version of ab_sim"
        ) from error
