"""Commands that print lists: scenes, keys, schema, metrics, effects and sensors."""

import json
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from ab_sim.base.errors import InputError, nearest
from ab_sim.base.files import REPORT
from ab_sim.base.yaml_files import find_scene, read_scene_file, scene_names
from ab_sim.cli.outputs import (
    PlainConsole,
    check_files,
    own_command,
    print_written,
    results,
    write_json,
)
from ab_sim.cli.scene_commands import (
    EffectsOptions,
    KeysOptions,
    MetricsOptions,
    ScenesOptions,
    SchemaOptions,
    SensorsOptions,
)

if TYPE_CHECKING:
    from ab_sim.export.formulas.effects import Formula

# Imports of scenes and effects are in the functions, because they are slow, and `ab-sim scenes`
# needs none of them.

_WHOLE = 2000
"""Width of a table for other programs [columns]; more than any row needs."""


def print_scenes(options: ScenesOptions) -> None:
    """Print a line for each scene in the package, or the description of a scene.

    Raises
    ------
    SceneError
        There is no such scene, or it cannot be read.
    """
    if options.name is not None:
        _print_scene(options.name)
        return
    names = scene_names()
    widest = max(map(len, names))
    for name in names:
        description = str(read_scene_file(find_scene(name)).get("description", ""))
        first, *_ = re.split(r"(?<=\.)\s", " ".join(description.split()), maxsplit=1)
        line = Text(f"{name:{widest}}  {first}")
        if results.is_terminal:
            results.print(line, no_wrap=True, overflow="ellipsis")
        else:  # a program that reads the list gets whole lines
            results.print(line, soft_wrap=True)


def _print_scene(name: str) -> None:
    from ab_sim.scene import load_scene

    file = find_scene(name)
    scene = load_scene(file)
    table = Table(show_header=False)
    table.add_row("file", str(file))
    table.add_row("description", scene.description)
    table.add_row("source", scene.source)
    table.add_row("balls", str(scene.balls.count))
    table.add_row("effects", ", ".join(scene.effects) or "none")
    for assumption in scene.assumed:
        table.add_row("assumed", assumption)
    results.print(table)
    results.print(f"for a summary of the simulation: {own_command()} check {name}")


def print_keys(options: KeysOptions) -> None:
    """Print the keys of a scene, or of one section.

    Raises
    ------
    InputError
        There is no such section; the message names the nearest.
    """
    from ab_sim.scene.keys import SceneKey, scene_keys

    _print_rows(scene_keys(options.section), SceneKey._fields, options.json)


def print_schema(options: SchemaOptions) -> None:
    """Print the JSON Schema of a scene file.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    from ab_sim.scene.schema import scene_schema

    check_files((options.out, REPORT, "--out"))
    write_json(scene_schema(), "-" if options.out is None else str(options.out))
    if options.out is not None:
        print_written([options.out])


def print_metrics(options: MetricsOptions) -> None:
    """Print the metrics of runs, or one of them.

    Raises
    ------
    InputError
        The name is unknown; the message has the nearest name and all names.
    """
    from ab_sim.analysis.metrics import described_metrics

    metrics = described_metrics(options.name)
    columns = ("name", "unit", "better", "taken_by", "meaning", "equation")
    if options.name is None or options.json:
        _print_rows(metrics, columns, options.json)
        return
    table = Table(show_header=False)
    for label, text in metrics[0]._asdict().items():
        table.add_row(label, text)
    _print_wide(table)


def _print_rows(rows: Iterable[Any], columns: Sequence[str], as_json: bool) -> None:
    """Print some fields of named tuples as a table, or all fields as JSON."""
    if as_json:
        print(json.dumps([row._asdict() for row in rows], indent=1))
        return
    table = Table()
    for column in columns:
        table.add_column(column, overflow="fold")
    for row in rows:
        table.add_row(*(str(getattr(row, column)) for column in columns))
    _print_wide(table)


def _print_wide(table: Table) -> None:
    """Print a table; for a program that reads it, with one line per row."""
    console = PlainConsole()
    if not console.is_terminal:
        console.width = _WHOLE
    console.print(table)


def print_effects(options: EffectsOptions) -> None:
    """Print meaning, equation, source and parameters of effects, or all their formulas.

    Raises
    ------
    InputError
        The name is unknown; the message has the nearest name and all names.
    """
    from ab_sim.scene.registry import effect_classes, effect_parameters

    effects, only = effect_classes(), options.name
    if only is not None and only not in effects:
        raise InputError(
            f"{only!r}: no such effect{nearest(only, effects)}; known are: {', '.join(effects)}"
        )
    for name, effect in effects.items() if only is None else [(only, effects[only])]:
        if options.equation:
            _print_formulas(name, effect)
            continue
        table = _described(name, effect, effect_parameters(effect))
        if effect.uses_ball_radius:
            table.add_row("also uses", "balls.radius")
        results.print(table)


def _print_formulas(name: str, effect: type[Any]) -> None:
    """Print the formulas of an effect: as text, then as LaTeX."""
    from ab_sim.export.formulas.effects import formulas_of

    results.print(name, style="bold")
    for formula in formulas_of(effect):
        # Formulas are for copying, so lines are not wrapped.
        results.print("\n".join(_formula_lines(formula)), soft_wrap=True)


def _formula_lines(formula: "Formula") -> list[str]:
    """Return the lines of a formula: equations, quantities and parameters, then LaTeX."""
    head = f"  {formula.method}: {formula.meaning}" if formula.meaning else f"  {formula.method}"
    if formula.trouble:
        return [head, f"    cannot be printed: {formula.trouble}"]
    equations, quantities = formula.lines
    lines = [head, *(f"    {line.text}" for line in equations)]
    lines += [f"      {'with' if k == 0 else '    '} {q.text}" for k, q in enumerate(quantities)]
    if formula.parameters:
        named = ", ".join(f"{symbol} is {field}" for symbol, field in formula.parameters.items())
        lines.append(f"    {named}")
    return [*lines, *(f"    {line.latex}" for line in [*equations, *quantities])]


def print_sensors(_: SensorsOptions) -> None:
    """Print meaning, equation, source and parameters of accelerometer and proximity probe."""
    from ab_sim.scene.sensors import Accelerometer, ProximityProbe

    for name, kind in (("accelerometer", Accelerometer), ("proximity probe", ProximityProbe)):
        results.print(_described(name, kind, kind.model_json_schema()["properties"]))


def _described(name: str, what: type[Any], parameters: dict[str, dict[str, Any]]) -> Table:
    """Return the table of an effect or a sensor; ``parameters``: their JSON schemas by name."""
    table = Table(title=name, title_justify="left", title_style="bold", show_header=False)
    table.add_row("meaning", " ".join((what.__doc__ or "").split()))
    table.add_row("equation", what.equation)
    table.add_row("source", what.source)
    for key, field in parameters.items():
        default = f"; default {_short(field['default'])}" if "default" in field else ""
        unit = f" [{field['unit']}]" if "unit" in field else ""
        table.add_row(key, f"{field.get('description', '')}{unit}{default}")
    if not parameters:
        table.add_row("parameters", "none")
    return table


def _short(value: float | list[float] | None) -> str:
    if isinstance(value, list):
        return ", ".join(map(_short, value))
    return "none" if value is None else f"{value:g}"
