"""`ab-sim sensitivity`."""

import math
from collections.abc import Iterator

import numpy as np
from rich.table import Table

from ab_sim.base.errors import InputError
from ab_sim.base.progress import Progress
from ab_sim.cli.design_commands import SensitivityOptions
from ab_sim.cli.runner import Command, Outcome, plotted
from ab_sim.design.batch import simulate_batch
from ab_sim.design.derivatives import MetricSensitivities, metric_sensitivities, real_keys
from ab_sim.design.derivatives.of_metrics import differentiable_metrics
from ab_sim.scene import load_scene


def sensitivity_command(given: SensitivityOptions) -> Command:
    """Return the command that computes derivatives of metrics by numbers of a scene."""
    names = _listed("--of", given.of)
    differentiable_metrics(names)
    scene = load_scene(given.scene, given.change)
    keys = (
        [real.key for real in real_keys(scene)] if given.to is None else _listed("--to", given.to)
    )

    def work(tell: Progress) -> Outcome:
        sensitivities = metric_sensitivities(
            scene, keys, names, progress=lambda done, runs: tell("running", done, runs)
        )
        judged = simulate_batch(sensitivities.scene, [{}], metrics=["settled"]).metrics["settled"]
        return Outcome(
            _shown(sensitivities, bool(judged[0])), sensitivities.report, plotted(sensitivities)
        )

    return Command(work, scene.name)


def _listed(option: str, text: str) -> list[str]:
    """Split names at commas.

    Raises:
        InputError: a name is missing or repeated.
    """
    names = [name.strip() for name in text.split(",")]
    if not all(names) or len(set(names)) < len(names):
        raise InputError(f"{option} {text}: must be names with commas between, each once")
    return names


def _shown(found: MetricSensitivities, settled: bool) -> Iterator[Table | str]:
    for i, metric in enumerate(found.metrics):
        unit = found.metric_units[i]
        named = metric if unit in ("1", "-") else f"{metric} [{unit}]"
        table = Table(title=f"{found.scene.name}: {named} = {found.metric_values[i]:.6g}, by")
        table.add_column("key", overflow="fold")
        table.add_column("value", justify="right")
        table.add_column("derivative", justify="right")
        table.add_column("% per %", justify="right")
        order = _order(found, i)
        keys = [k for k in order if not found.has_no_influence[i, k] and _is_known(found, i, k)]
        for k in keys:
            own = found.key_units[k]
            percent = found.elasticities[i, k], found.elasticity_uncertainties[i, k]
            has_percent = found.values[k] and np.isfinite(percent[0])
            table.add_row(
                found.keys[k],
                f"{found.values[k]:.6g} {'' if own == '1' else own}".rstrip(),
                _derivative(found, i, k),
                with_uncertainty(*percent) if has_percent else "-",
            )
        yield table
        at_zero = [f"{_derivative(found, i, k)} ({found.keys[k]})" for k in keys]
        at_zero = [each for each, k in zip(at_zero, keys, strict=True) if not found.values[k]]
        if at_zero:
            yield f"no percent of 0, so not in the picture; by derivative: {', '.join(at_zero)}"
        still = [found.keys[k] for k in order if found.has_no_influence[i, k]]
        if still:
            yield f"no influence on {metric}: {', '.join(still)}"
        unknown = [found.keys[k] for k in order if not _is_known(found, i, k)]
        if unknown:
            yield (
                f"{metric} is not differentiable here by: {', '.join(unknown)}; larger changes: "
                "`ab-sim sweep`"
            )
    yield (
        f"central differences of runs by {found.scene.solver.stepper}, step "
        f"{found.scene.solver.step:g} s, +- their uncertainty; % per %: by how many percent it "
        "changes if the key does by one"
    )
    if not settled:
        yield (
            "the run has not settled: final values still change, and so do their derivatives; "
            "a longer duration tells of the settled drive"
        )


def with_uncertainty(value: float, uncertainty: float) -> str:
    """Text of a value, to the first digit that is uncertain and at most six."""
    digits = 6
    if value and uncertainty:
        digits = math.floor(math.log10(abs(value))) - math.floor(math.log10(uncertainty)) + 1
    return f"{value:.{min(max(digits, 1), 6)}g} +- {uncertainty:.1g}"


def _derivative(found: MetricSensitivities, metric: int, key: int) -> str:
    number = with_uncertainty(
        float(found.derivatives[metric, key]), float(found.uncertainties[metric, key])
    )
    return f"{number} {found.unit(metric, key)}"


def _is_known(found: MetricSensitivities, metric: int, key: int) -> bool:
    return bool(np.isfinite(found.derivatives[metric, key]))


def _order(found: MetricSensitivities, metric: int) -> list[int]:
    """Return the keys by decreasing elasticity; keys with the value 0 come last."""
    sizes = np.abs(found.elasticities[metric])
    order = np.lexsort((np.arange(len(sizes)), -np.nan_to_num(sizes)))
    return [int(k) for k in order]
