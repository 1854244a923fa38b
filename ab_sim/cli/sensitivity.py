"""`ab-sim sensitivity`."""

from collections.abc import Iterator

import numpy as np
from rich.table import Table

from ab_sim.analysis.merits import merits_of
from ab_sim.analysis.sensitivity import NoDerivative, Sensitivities, real_keys, sensitivities
from ab_sim.analysis.sensitivity.keys import RealKey, scale_of
from ab_sim.analysis.sensitivity.of_merits import MeritSensitivities, differentiable_merits
from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome, plotted
from ab_sim.errors import InputError
from ab_sim.scene import Scene, load_scene

ROUNDING = 1e-10
"""Least relative change of a metric that counts as a dependence."""


def sensitivity_command(
    scene_name: str, changes: list[str], merits: str, keys: str | None
) -> Command:
    """Return the command that computes derivatives of metrics by numbers of a scene."""
    names = _listed("--of", merits)
    differentiable_merits(names)
    scene = load_scene(scene_name, changes)
    wanted = None if keys is None else _listed("--to", keys)

    def work(tell: Tell) -> Outcome:
        run, without = _run(scene, wanted, tell)
        found = run.of_merits(names)
        if not merits_of(run.trajectory, run.scene, ["settled"])["settled"]:
            without.append(
                "the run has not settled: final values still change, and so do their derivatives; "
                "a longer duration tells of the settled drive"
            )
        return Outcome([*_shown(run, found), *without], found.report, plotted(found))

    return Command(work, scene.name)


def _run(scene: Scene, keys: list[str] | None, tell: Tell) -> tuple[Sensitivities, list[str]]:
    """Return the run, and with all numbers requested, those without a derivative."""

    def progress(time: float, end: float) -> None:
        tell("running", round(100 * time / end), 100)

    left = [real.key for real in real_keys(scene)] if keys is None else keys
    without: dict[str, str] = {}
    while True:
        try:
            found = sensitivities(scene, left, progress=progress)
        except NoDerivative as error:
            if keys is not None or error.key is None or len(left) == 1:
                raise
            left = [key for key in left if key != error.key]
            without[error.key] = str(error)
            continue
        first = next(iter(without.values()), "")
        said = [f"left out: {', '.join(without)}. {first}"] if without else []
        return found, said


def _listed(option: str, text: str) -> list[str]:
    """Split names at commas.

    Raises:
        InputError: a name is missing or repeated.
    """
    names = [name.strip() for name in text.split(",")]
    if not all(names) or len(set(names)) < len(names):
        raise InputError(f"{option} {text}: must be names with commas between, each once")
    return names


def _shown(run: Sensitivities, found: MeritSensitivities) -> Iterator[Table | str]:
    for i, merit in enumerate(found.merits):
        unit = found.merit_units[i]
        named = merit if unit in ("1", "-") else f"{merit} [{unit}]"
        table = Table(title=f"{found.scene.name}: {named} = {found.merit_values[i]:.6g}, by")
        table.add_column("key", overflow="fold")
        table.add_column("value", justify="right")
        table.add_column("derivative", justify="right")
        table.add_column("% per %", justify="right")
        still = []
        for k in _order(found, i):
            key, own = found.keys[k], found.key_units[k]
            if _is_nothing(found, i, k):
                still.append(key)
                continue
            table.add_row(
                key,
                f"{found.values[k]:.6g} {'' if own == '1' else own}".rstrip(),
                f"{found.derivatives[i, k]:.6g} {found.unit(i, k)}",
                _percent(float(found.elasticities[i, k]), float(found.values[k])),
            )
        yield table
        at_zero = [
            f"{found.derivatives[i, k]:.4g} {found.unit(i, k)} ({found.keys[k]})"
            for k in _order(found, i)
            if not found.values[k] and not _is_nothing(found, i, k)
        ]
        if at_zero:
            yield f"no percent of 0, so not in the picture; by derivative: {', '.join(at_zero)}"
        if still:
            yield f"no influence on {merit}: {', '.join(still)}"
    yield (
        f"exact derivatives of the run by {run.stepper}, step {run.scene.solver.step:g} s; % per "
        "%: by how many percent it changes if the key does by one"
    )


def _is_nothing(found: MeritSensitivities, merit: int, key: int) -> bool:
    """Return whether the derivative is 0 apart from rounding."""
    real = RealKey(found.keys[key], float(found.values[key]), found.key_units[key])
    moves = abs(found.derivatives[merit, key]) * 100.0 * scale_of(real)
    return bool(moves <= ROUNDING * abs(found.merit_values[merit]))


def _order(found: MeritSensitivities, merit: int) -> list[int]:
    """Return the keys by decreasing elasticity; keys with the value 0 come last."""
    sizes = np.abs(found.elasticities[merit])
    order = np.lexsort((np.arange(len(sizes)), -np.nan_to_num(sizes)))
    return [int(k) for k in order]


def _percent(elasticity: float, value: float) -> str:
    return f"{elasticity:.4g}" if np.isfinite(elasticity) and value else "-"
