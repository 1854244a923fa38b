"""`ab-sim effects --equation`."""

from typing import Any

from ab_sim.cli.outputs import PlainConsole
from ab_sim.errors import InputError, nearest
from ab_sim.formulas.effects import Formula, formulas_of
from ab_sim.scene.registry import effect_classes

console = PlainConsole()


def chosen_effects(only: str | None) -> dict[str, type[Any]]:
    """Return all registered effects by name, or only one.

    Raises:
        InputError: there is no such effect; the message names the known and the nearest ones.
    """
    known = effect_classes()
    if only is None:
        return known
    if only not in known:
        raise InputError(
            f"{only!r}: no such effect{nearest(only, known)}; known are: {', '.join(known)}"
        )
    return {only: known[only]}


def print_formulas(only: str | None) -> None:
    """Print the formulas of every effect, or of one: as text, then as LaTeX.

    Raises:
        InputError: there is no such effect.
    """
    for name, effect in chosen_effects(only).items():
        console.print(name, style="bold")
        for formula in formulas_of(effect):
            # Formulas are for copying, so lines are not wrapped.
            console.print("\n".join(_shown(formula)), soft_wrap=True)


def _shown(formula: Formula) -> list[str]:
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
