"""`ab-sim sensitivity`."""

import math
from collections.abc import Iterator

import numpy as np
from rich.table import Table

from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Progress
from ab_sim.cli.design_commands import SensitivityOptions
from ab_sim.cli.runner import Command, Outcome, picture
from ab_sim.design.batch import simulate_batch
from ab_sim.design.derivatives import (
    MetricSensitivities,
    differentiable_metrics,
    metric_sensitivities,
)
from ab_sim.design.differences import real_keys
from ab_sim.scene import load_scene


def sensitivity_command(options: SensitivityOptions) -> Command:
    """Return the command that computes derivatives of metrics with respect to keys of a scene."""
    names = _listed("--of", options.of)
    differentiable_metrics(names)
    scene = load_scene(options.scene, options.change)
    keys = (
        [real.key for real in real_keys(scene)]
        if options.to is None
        else _listed("--to", options.to)
    )

    def work(tell: Progress) -> Outcome:
        sensitivities = metric_sensitivities(
            scene, keys, names, progress=lambda done, runs: tell("running", done, runs)
        )
        judged = simulate_batch(sensitivities.scene, [{}], metrics=["settled"]).metrics["settled"]
        return Outcome(
            _shown(sensitivities, bool(judged[0])),
            sensitivities.report,
            picture("metric_sensitivities", sensitivities),
        )

    return Command(work, scene.name)


def _listed(option: str, text: str) -> list[str]:
    """Split names at commas.

    Raises
    ------
    InputError
        A name is missing or repeated.
    """
    names = [name.strip() for name in text.split(",")]
    if not all(names) or len(set(names)) < len(names):
        raise InputError(f"{option} {text}: must be different names separated by commas")
    return names


def _shown(sensitivities: MetricSensitivities, settled: bool) -> Iterator[Table | str]:
    for i, metric in enumerate(sensitivities.metrics):
        unit = sensitivities.metric_units[i]
        named = metric if unit in ("1", "-") else f"{metric} [{unit}]"
        table = Table(
            title=f"{sensitivities.scene.name}: {named} = {sensitivities.metric_values[i]:.6g}"
        )
        table.add_column("key", overflow="fold")
        table.add_column("value", justify="right")
        table.add_column("derivative", justify="right")
        table.add_column("% per %", justify="right")
        order = _order(sensitivities, i)
        keys = [
            k
            for k in order
            if not sensitivities.has_no_influence[i, k] and _is_known(sensitivities, i, k)
        ]
        for k in keys:
            key_unit = sensitivities.key_units[k]
            percent = sensitivities.elasticities[i, k], sensitivities.elasticity_uncertainties[i, k]
            has_percent = sensitivities.values[k] and np.isfinite(percent[0])
            table.add_row(
                sensitivities.keys[k],
                f"{sensitivities.values[k]:.6g} {'' if key_unit == '1' else key_unit}".rstrip(),
                _derivative(sensitivities, i, k),
                with_uncertainty(*percent) if has_percent else "-",
            )
        yield table
        at_zero = [f"{_derivative(sensitivities, i, k)} ({sensitivities.keys[k]})" for k in keys]
        at_zero = [
            text for text, k in zip(at_zero, keys, strict=True) if not sensitivities.values[k]
        ]
        if at_zero:
            yield f"value 0, so no % per % and not in the picture; derivative: {', '.join(at_zero)}"
        still = [sensitivities.keys[k] for k in order if sensitivities.has_no_influence[i, k]]
        if still:
            yield f"no influence on {metric}: {', '.join(still)}"
        unknown = [sensitivities.keys[k] for k in order if not _is_known(sensitivities, i, k)]
        if unknown:
            yield (
                f"{metric} is not differentiable here with respect to {', '.join(unknown)}; for "
                "larger changes use `ab-sim sweep`"
            )
    yield (
        f"central differences of runs by {sensitivities.scene.solver.stepper}, step "
        f"{sensitivities.scene.solver.step:g} s, +- their uncertainty; % per %: change of the "
        "metric in percent if the key changes by one percent"
    )
    if not settled:
        yield (
            "the run has not settled: final values still change, and so do their derivatives; "
            "use a longer duration for those of the settled drive"
        )


def with_uncertainty(value: float, uncertainty: float) -> str:
    """Return ``value +- uncertainty`` as text, the value up to its first uncertain digit."""
    digits = 6
    if value and uncertainty:
        digits = math.floor(math.log10(abs(value))) - math.floor(math.log10(uncertainty)) + 1
    return f"{value:.{min(max(digits, 1), 6)}g} +- {uncertainty:.1g}"


def _derivative(sensitivities: MetricSensitivities, metric: int, key: int) -> str:
    number = with_uncertainty(
        float(sensitivities.derivatives[metric, key]),
        float(sensitivities.uncertainties[metric, key]),
    )
    return f"{number} {sensitivities.unit(metric, key)}"


def _is_known(sensitivities: MetricSensitivities, metric: int, key: int) -> bool:
    return bool(np.isfinite(sensitivities.derivatives[metric, key]))


def _order(sensitivities: MetricSensitivities, metric: int) -> list[int]:
    """Return the keys by decreasing elasticity; keys with the value 0 come last."""
    sizes = np.abs(sensitivities.elasticities[metric])
    order = np.lexsort((np.arange(len(sizes)), -np.nan_to_num(sizes)))
    return [int(k) for k in order]
