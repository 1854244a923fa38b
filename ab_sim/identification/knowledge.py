"""Identifiability: singular values of the sensitivities, and unidentifiable directions."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.presentation import Progress
from ab_sim.identification.information import ROUNDING, beyond
from ab_sim.identification.measured import GAIN
from ab_sim.identification.problem import Problem

_LOOKS = 2
"""Number of draws of start angles at which identifiability is evaluated."""
UNKNOWN = 0.5
"""Standard deviation of an unknown direction, relative to the parameters' scales."""
PART = 0.15
"""Smallest component that is named, relative to the direction's largest."""
ALIKE = 0.1
"""Tolerance for equal exponents of a direction."""
MASSES = ("rotor.total_mass", "rotor.mass", "rotor.eccentric_mass")
_WEIGH = "weigh the deck and leave the mass out of --fit, or make a recording with a trial mass"
_CALIBRATE = "calibrate the sensor and leave the gain out, or record with balls of known mass"
_MOVE = "make a recording in which the balls move"
_BALLS_ONLY = ("effects.viscous_drag.", "effects.rolling_friction.", "effects.race_friction.")


class OpenDirection(NamedTuple):
    """Direction in parameter space along which the measurements hardly change."""

    parts: tuple[tuple[str, float], ...]
    """Names of parameters and their exponents in the product that is open; the largest is 1."""
    deviation: float
    """Standard deviation of the largest component, relative to its scale; may be infinite."""
    words: str
    """Description of the direction, a clause."""
    advice: str
    """Remedy: a measurement or recording that removes the direction."""
    held: str
    """Parameter that was fixed to remove the direction."""

    def report(self) -> dict[str, Any]:
        """Return the direction as JSON-able values."""
        return {
            "parameters": dict(self.parts),
            "deviation": self.deviation,
            "words": self.words,
            "advice": self.advice,
            "held": self.held,
        }


class Knowledge(NamedTuple):
    """Identifiability of the common parameters and of the recordings' gains."""

    names: tuple[str, ...]
    """Names of the examined parameters."""
    singular: tuple[float, ...]
    """Singular values of the scaled sensitivities, with the recordings' own parameters fitted."""
    open: tuple[OpenDirection, ...]
    """Unidentifiable directions."""
    held: tuple[int, ...]
    """Indices of the fixed parameters."""

    def report(self) -> dict[str, Any]:
        """Return the result as JSON-able values."""
        return {
            "parameters": list(self.names),
            "singular_values": list(self.singular),
            "open": [direction.report() for direction in self.open],
        }


def knowledge_of(
    problem: Problem, values: np.ndarray, known_parameters: Sequence[int] = ()
) -> Knowledge:
    """Return the identifiability at given values.

    Parameters are fixed until no unidentifiable direction is left.

    Parameters
    ----------
    problem
        Problem with the recordings and their noise.
    values
        Values of all parameters [SI].
    known_parameters
        Indices of parameters to be left out.
    """
    shared = shared_numbers(problem)
    wanted = [j for j in shared if j not in known_parameters]
    others = [j for j in range(len(problem.parameters)) if j not in shared]
    jacobian = problem.derivatives(values, others + wanted)
    remaining = beyond(jacobian[:, : len(others)], jacobian[:, len(others) :])
    names = [problem.parameters[j].name for j in wanted]
    singular = np.linalg.svd(remaining, compute_uv=False)
    directions: list[OpenDirection] = []
    held: list[int] = []
    columns = list(range(len(wanted)))
    # A singular value is the reciprocal of a direction's standard deviation. Several directions may
    # share parameters, so decompose again after each parameter that is fixed.
    while columns:
        _, sizes, rows = np.linalg.svd(remaining[:, columns], full_matrices=True)
        sizes = np.concatenate([sizes, np.zeros(len(rows) - len(sizes))])
        if sizes[-1] > max(1.0 / UNKNOWN, ROUNDING * float(singular[0])):
            break
        nothing = sizes[-1] <= ROUNDING * float(singular[0])
        deviation = np.inf if nothing else 1.0 / float(sizes[-1])
        parts = _parts([names[k] for k in columns], rows[-1])
        chosen = _chosen(parts)
        directions.append(
            OpenDirection(tuple(parts), deviation, _words(parts, nothing), _advice(parts), chosen)
        )
        k = names.index(chosen)
        held.append(wanted[k])
        columns.remove(k)
    return Knowledge(tuple(names), tuple(singular.tolist()), tuple(directions), tuple(held))


def knowledge_before(problem: Problem, seed: int, tell: Progress = lambda *_: None) -> Knowledge:
    """Return the directions that are unidentifiable at the scene's values, before a fit.

    The start angles are not yet known. A direction counts only if it is open for all drawn ones.

    Parameters
    ----------
    problem
        Problem with the recordings and their noise.
    seed
        Seed of the start angles.
    tell
        Called with the current task, the number of finished tasks and the total.
    """
    numbers, results = np.random.default_rng([seed, 0]), []
    for look in range(_LOOKS):
        tell("identifiability", look, _LOOKS)
        values = problem.start
        for j, parameter in enumerate(problem.parameters):
            if parameter.is_own_angle:
                values[j] += numbers.uniform(0.0, 2.0 * np.pi)
        results.append(knowledge_of(problem, values))
    first = results[0]
    always = tuple(j for j in first.held if all(j in result.held for result in results))
    names = {problem.parameters[j].name for j in always}
    return first._replace(
        held=always, open=tuple(direction for direction in first.open if direction.held in names)
    )


def shared_numbers(problem: Problem) -> list[int]:
    """Return the indices of the common parameters and of the recordings' gains."""
    return [
        j
        for j, parameter in enumerate(problem.parameters)
        if parameter.recording is None or parameter.nuisance == GAIN
    ]


def _parts(names: Sequence[str], direction: np.ndarray) -> list[tuple[str, float]]:
    """Return a direction's parameters with exponents above ``PART``; the largest exponent is 1."""
    largest = direction[int(np.argmax(np.abs(direction)))]
    scaled = direction / largest
    return [
        (name, float(part)) for name, part in zip(names, scaled, strict=True) if abs(part) > PART
    ]


def _chosen(parts: Sequence[tuple[str, float]]) -> str:
    """Return the parameter to fix: one that can be weighed or calibrated, or the largest."""
    names = [name for name, _ in parts]
    for name in (*MASSES, *(n for n in names if n.startswith(f"{GAIN} of"))):
        if name in names:
            return name
    return max(parts, key=lambda part: abs(part[1]))[0]


def _words(parts: Sequence[tuple[str, float]], nothing: bool) -> str:
    """Describe an open direction; ``nothing``: the measurements do not change at all along it.

    A step is relative to the parameters' scales, which are their start values. A small step along
    the direction thus multiplies each value by a common factor to the power of its component.
    """
    names = [name for name, _ in parts]
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    nearly = "" if nothing else "practically "
    if len(names) == 1:
        return f"{listed} {nearly}does not change the measurements"
    sizes = [part for _, part in parts]
    if all(abs(size - 1.0) < ALIKE for size in sizes):
        return f"{nearly}only the ratios of {listed} are determined: all may grow by one factor"
    if len(names) == 2 and abs(sizes[0] + sizes[1]) < ALIKE:
        return f"{nearly}only the product of {listed} is determined"
    powers = " ".join(f"{name}^{size:.2g}" for name, size in parts)
    return f"{listed} may change together (as {powers}) with {nearly}no change of the measurements"


def _advice(parts: Sequence[tuple[str, float]]) -> str:
    """Return the remedy for an open direction, which depends on the parameters involved."""
    names = [name for name, _ in parts]
    if any(name in MASSES for name in names):
        return _WEIGH
    if any(name.startswith(f"{GAIN} of") for name in names):
        return _CALIBRATE
    if any(name.startswith(_BALLS_ONLY) for name in names):
        return _MOVE
    return "give one of them a value that is known, and leave it out of --fit"
