"""Runs to record, and readers of the contents of a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from ab_sim.record.recording import Recording
from ab_sim.record.recording.layout import CHANNELS, DERIVED, SAMPLES

BASE = ["step", "time", "angle", "speed", "command", "x", "y", "vx", "vy", "ax", "ay"]
STEP = 1e-3


def describe(balls: int = 2, **changes: Any) -> dict[str, Any]:
    scene = {"effects": {"gravity": {"angle": 0.3}}, "note": 'three "ticks": ``` \n```json'}
    base = {"scene": scene, "race_radius": 0.01, "eccentricity": 1e-4, "balls": balls}
    return base | {"ball_radii": None, "step": STEP} | changes


def run(
    rows: int, balls: int = 2, seed: int = 0, step: float = STEP
) -> tuple[list[str], NDArray[np.float64]]:
    """Return channels and random samples with full mantissas, at times k * ``step`` [s]."""
    names = BASE + [f"ball_{i}_{what}" for i in range(balls) for what in ("angle", "rate")]
    samples = np.random.default_rng(seed).normal(size=(rows, len(names)))
    samples[:, 0] = np.arange(rows)
    samples[:, 1] = np.arange(rows) * step
    return names, samples


def record(path: Path, names: list[str], samples: NDArray[np.float64], block: int = 20) -> None:
    balls = sum(name.startswith("ball_") and name.endswith("_angle") for name in names)
    with Recording(path, description=describe(balls)) as recording:
        for start in range(0, len(samples), block):
            recording.block(names, samples[start : start + block])


def cells(path: Path, entity: str, component: str) -> list[Any]:
    """Return all cells of a component in a file, in the order of steps."""
    rows: list[tuple[int, Any]] = []
    for chunk in RrdReader(path).stream().to_chunks():
        if chunk.entity_path == entity and not chunk.is_static:
            batch = chunk.to_record_batch()
            if component not in batch.schema.names:
                continue
            rows += zip(batch["step"].to_pylist(), batch[component].to_pylist(), strict=True)
    return [cell for _, cell in sorted(rows, key=lambda row: row[0])]


def channel(path: Path, group: str) -> NDArray[np.float64]:
    """Return the samples of a group of channels in a file, shape (rows, series)."""
    return np.array(cells(path, SAMPLES, f"{CHANNELS}:{group}"))


def plotted(path: Path, entity: str, name: str) -> NDArray[np.float64]:
    """Return plotted curves of a file, shape (rows, series)."""
    return np.array(cells(path, entity, f"{DERIVED}:{name}"))


def still(path: Path, entity: str, component: str) -> list[Any]:
    """Return the last cell of a component that does not change over time."""
    sent = [
        chunk.to_record_batch()[component].to_pylist()[0]
        for chunk in RrdReader(path).stream().to_chunks()
        if chunk.entity_path == entity and chunk.is_static
    ]
    assert sent, f"nothing static at {entity}"
    return list(sent[-1])


def views(path: Path) -> list[str]:
    """Return the names of the views in all layouts of a file."""
    reader, names = RrdReader(path), "ViewBlueprint:display_name"
    chunks = (c for store in reader.blueprints() for c in reader.stream(store=store).to_chunks())
    batches = [chunk.to_record_batch() for chunk in chunks]
    return [b[names].to_pylist()[0][0] for b in batches if names in b.schema.names]


def curves(path: Path) -> dict[str, int | None]:
    """Return the plotted components of all layouts, each with its policy of aggregation."""
    reader = RrdReader(path)
    chunks = [c for store in reader.blueprints() for c in reader.stream(store=store).to_chunks()]
    sources: dict[str, str] = {}  # by the path of what draws them
    policies: dict[str, int] = {}
    maps, policy = "VisualizerInstruction:component_map", "SeriesLines:aggregation_policy"
    for chunk in chunks:
        batch = chunk.to_record_batch()
        if maps in batch.schema.names:
            sources[chunk.entity_path] = batch[maps].to_pylist()[-1][0]["source_component"]
        if policy in batch.schema.names:
            policies[chunk.entity_path] = batch[policy].to_pylist()[-1][0]
    return {source: policies.get(place) for place, source in sources.items()}
