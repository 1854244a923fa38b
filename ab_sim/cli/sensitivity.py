"""`ab-sim sensitivity`."""

from collections.abc import Iterator

import numpy as np
from rich.table import Table

from ab_sim.analysis.sensitivity import Sensitivities, real_keys, sensitivities
from ab_sim.analysis.sensitivity.of_merits import MeritSensitivities, differentiable_merits
from ab_sim.cli.progress import Tell
from ab_sim.cli.runner import Command, Outcome, plotted
from ab_sim.errors import InputError
from ab_sim.scene import load_scene


def sensitivity_command(
    scene_name: str, changes: list[str], merits: str, keys: str | None
) -> Command:
    """Derivatives of merits of a scene's run by its numbers."""
    names = _listed("--of", merits)
    differentiable_merits(names)
    scene = load_scene(scene_name, changes)
    wanted = [real.key for real in real_keys(scene)] if keys is None else _listed("--to", keys)

    def work(tell: Tell) -> Outcome:
        def progress(time: float, end: float) -> None:
            tell("running", round(100 * time / end), 100)

        run = sensitivities(scene, wanted, progress=progress)
        found = run.of_merits(names)
        return Outcome(_shown(run, found), found.report, plotted(found))

    return Command(work, scene.name)


def _listed(option: str, text: str) -> list[str]:
    """Names with commas between.

    Raises:
        InputError: one is missing, or there twice.
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
            if found.derivatives[i, k] == 0.0:
                still.append(key)
                continue
            table.add_row(
                key,
                f"{found.values[k]:.6g} {'' if own == '1' else own}".rstrip(),
                f"{found.derivatives[i, k]:.6g} {found.unit(i, k)}",
                _percent(float(found.elasticities[i, k])),
            )
        yield table
        if still:
            yield f"no influence on {merit}: {', '.join(still)}"
    yield (
        f"exact derivatives of the run by {run.stepper}, step {run.scene.solver.step:g} s; % per "
        "%: by how many percent it changes if the key does by one"
    )


def _order(found: MeritSensitivities, merit: int) -> list[int]:
    """Keys that do most per percent first; then those that are 0 themselves."""
    sizes = np.abs(found.elasticities[merit])
    order = np.lexsort((np.arange(len(sizes)), -np.nan_to_num(sizes)))
    return [int(k) for k in order]


def _percent(elasticity: float) -> str:
    return "-" if not np.isfinite(elasticity) else f"{elasticity:.4g}"
