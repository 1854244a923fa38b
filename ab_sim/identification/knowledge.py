"""What recordings can tell of parameters at all: singular values, and what they leave open."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.identification.information import ROUNDING, beyond
from ab_sim.identification.measured import GAIN
from ab_sim.identification.problem import Problem

LOOKS = 2
"""Draws of start angles from which it is asked what can be known."""
UNKNOWN = 0.5
"""Standard deviation of a direction, as a share of the parameters' scales, from which it counts as
not known."""
PART = 0.15
"""Of its largest entry: smaller ones of a direction are not named."""
ALIKE = 0.1
MASSES = ("rotor.total_mass", "rotor.mass", "rotor.eccentric_mass")
WEIGH = "weigh the deck and leave the mass out of --fit, or make a recording with a trial mass"
CALIBRATE = "calibrate the sensor and leave the gain out, or record with balls of known mass"
MOVE = "make a recording in which the balls move"
BALLS_ONLY = ("effects.viscous_drag.", "effects.rolling_friction.", "effects.race_friction.")


class OpenDirection(NamedTuple):
    """A way to change parameters together that hardly changes what was measured."""

    parts: tuple[tuple[str, float], ...]
    """Parameters with their exponents, the largest being 1."""
    deviation: float
    """Of the largest part, as a share of its scale; infinite where nothing tells."""
    words: str
    advice: str
    held: str
    """The parameter that was held to close it."""

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        return {
            "parameters": dict(self.parts),
            "deviation": self.deviation,
            "words": self.words,
            "advice": self.advice,
            "held": self.held,
        }


class Knowledge(NamedTuple):
    """Of the parameters that recordings have in common, and of their gains."""

    names: tuple[str, ...]
    singular: tuple[float, ...]
    """Of the scaled sensitivities, what recordings have of their own being fitted along."""
    open: tuple[OpenDirection, ...]
    held: tuple[int, ...]
    """Numbers of the parameters that were held."""

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
        return {
            "parameters": list(self.names),
            "singular_values": list(self.singular),
            "open": [each.report() for each in self.open],
        }


def knowledge_of(problem: Problem, values: np.ndarray, known: Sequence[int] = ()) -> Knowledge:
    """What the recordings can tell, looked at from some values.

    Parameters are held until nothing is open.

    Args:
        problem: the recordings, with their noise.
        values: of all parameters [SI].
        known: numbers of parameters that are not asked for.
    """
    shared = shared_numbers(problem)
    wanted = [j for j in shared if j not in known]
    own = [j for j in range(len(problem.parameters)) if j not in shared]
    jacobian = problem.derivatives(values, own + wanted)
    left = beyond(jacobian[:, : len(own)], jacobian[:, len(own) :])
    names = [problem.parameters[j].name for j in wanted]
    singular = np.linalg.svd(left, compute_uv=False)
    found: list[OpenDirection] = []
    held: list[int] = []
    columns = list(range(len(wanted)))
    while columns:
        _, sizes, rows = np.linalg.svd(left[:, columns], full_matrices=True)
        sizes = np.concatenate([sizes, np.zeros(len(rows) - len(sizes))])
        if sizes[-1] > max(1.0 / UNKNOWN, ROUNDING * float(singular[0])):
            break
        nothing = sizes[-1] <= ROUNDING * float(singular[0])
        deviation = np.inf if nothing else 1.0 / float(sizes[-1])
        parts = _parts([names[k] for k in columns], rows[-1])
        chosen = _chosen(parts)
        found.append(
            OpenDirection(tuple(parts), deviation, _words(parts, nothing), _advice(parts), chosen)
        )
        k = names.index(chosen)
        held.append(wanted[k])
        columns.remove(k)
    return Knowledge(tuple(names), tuple(singular.tolist()), tuple(found), tuple(held))


def knowledge_before(
    problem: Problem, seed: int, tell: Callable[[str, int, int], None] = lambda *_: None
) -> Knowledge:
    """What is open wherever the balls may have started, looked at from where the scene is.

    Args:
        problem: the recordings, with their noise.
        seed: of the start angles.
        tell: called with what is done now, done, of all.
    """
    numbers, found = np.random.default_rng([seed, 0]), []
    for look in range(LOOKS):
        tell("what can be known", look, LOOKS)
        values = problem.start
        for j, each in enumerate(problem.parameters):
            if each.is_own_angle:
                values[j] += numbers.uniform(0.0, 2.0 * np.pi)
        found.append(knowledge_of(problem, values))
    first = found[0]
    always = tuple(j for j in first.held if all(j in each.held for each in found))
    names = {problem.parameters[j].name for j in always}
    return first._replace(
        held=always, open=tuple(each for each in first.open if each.held in names)
    )


def shared_numbers(problem: Problem) -> list[int]:
    """Of the parameters that recordings have in common, and of their gains."""
    return [
        j
        for j, each in enumerate(problem.parameters)
        if each.recording is None or each.nuisance == GAIN
    ]


def _parts(names: Sequence[str], direction: np.ndarray) -> list[tuple[str, float]]:
    largest = direction[int(np.argmax(np.abs(direction)))]
    scaled = direction / largest
    return [
        (name, float(part)) for name, part in zip(names, scaled, strict=True) if abs(part) > PART
    ]


def _chosen(parts: Sequence[tuple[str, float]]) -> str:
    """Which parameter is held: one that a scale or a calibration tells, else the largest part."""
    names = [name for name, _ in parts]
    for name in (*MASSES, *(n for n in names if n.startswith(f"{GAIN} of"))):
        if name in names:
            return name
    return max(parts, key=lambda part: abs(part[1]))[0]


def _words(parts: Sequence[tuple[str, float]], nothing: bool) -> str:
    names = [name for name, _ in parts]
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    hardly = "" if nothing else "hardly more than "
    if len(names) == 1:
        what = "nothing" if nothing else "hardly anything"
        return f"{listed} changes {what} of what was measured"
    sizes = [part for _, part in parts]
    if all(abs(size - 1.0) < ALIKE for size in sizes):
        return f"{hardly}only the ratios of {listed} are fixed: all may grow by the same factor"
    if len(names) == 2 and abs(sizes[0] + sizes[1]) < ALIKE:
        return f"{hardly}only the product of {listed} is fixed"
    powers = " ".join(f"{name}^{size:.2g}" for name, size in parts)
    return f"{listed} may change together and leave the recording as it is (as {powers})"


def _advice(parts: Sequence[tuple[str, float]]) -> str:
    names = [name for name, _ in parts]
    if any(name in MASSES for name in names):
        return WEIGH
    if any(name.startswith(f"{GAIN} of") for name in names):
        return CALIBRATE
    if any(name.startswith(BALLS_ONLY) for name in names):
        return MOVE
    return "give one of them a value that is known, and leave it out of --fit"
