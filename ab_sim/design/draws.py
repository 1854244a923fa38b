"""Random drives from the tolerances of a nominal scene.

Draws are independent random numbers instead of a space-filling sequence. The binomial confidence
intervals of shares and quantiles hold for independent runs only.
"""

import functools
import hashlib
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ab_sim.base.errors import InputError, SceneError, exact, short
from ab_sim.design.points import MOST_RUNS, check_within
from ab_sim.design.tolerances import (
    ANGLES,
    FACTOR,
    OF_BALLS,
    OFFSET,
    RANDOM,
    RATES,
    VALUE,
    Discrete,
    Distribution,
    Normal,
    Tolerance,
)
from ab_sim.model.equations.neighbours import angles_at_random
from ab_sim.scene.changes import value_at
from ab_sim.scene.keys import scene_keys
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

BLOCK = 1024
"""Number of values drawn at a time, so that a run's values do not depend on the number of runs."""
COUNT = "balls.count"
"""Key of the number of balls."""
SIZES = ("balls", "race", "effects")
"""Sections that determine where balls fit without overlap."""


class DrawnPoints:
    """Runs of random drives.

    Parameters
    ----------
    scene
        Nominal scene.
    tolerances
        Tolerances, applied to a key in this order.
    count
        Number of runs; a run does not depend on it.
    seed
        Seed of random numbers; each tolerance or group has its own stream, so that additional ones
        do not change the others.

    Raises
    ------
    InputError
        The tolerances are invalid; the message states why.
    """

    def __init__(
        self, scene: Scene, tolerances: Sequence[Tolerance], count: int, seed: int
    ) -> None:
        if not tolerances:
            raise InputError("nothing is spread; name a key and its spread, e.g. balls.mass=5%")
        if not 1 <= count <= MOST_RUNS:
            raise InputError(f"{count} runs: must be from 1 to {MOST_RUNS}")
        self.scene, self.tolerances, self.seed, self._count = scene, tuple(tolerances), seed, count
        self.sources = _sources(tolerances)
        """Name of each tolerance's random stream: its group, or its own name."""
        self._nominal = {tolerance.key: value_of(scene, tolerance.key) for tolerance in tolerances}
        check_within(list(self._nominal))
        for key in self._nominal:
            self._check(key, [tolerance for tolerance in tolerances if tolerance.key == key])
        _check_groups(tolerances)
        # Draw the number of balls first, because it sets the number of draws per ball. Draw angles
        # last, because sizes determine where balls fit.
        self._order = sorted(
            zip(self.tolerances, self.sources, strict=True),
            key=lambda pair: 0 if pair[0].key == COUNT else 2 if pair[0].what == RANDOM else 1,
        )

    @property
    def keys(self) -> tuple[str, ...]:
        """Varied keys, see ``Points``."""
        return tuple(dict.fromkeys(tolerance.key for tolerance in self.tolerances))

    @property
    def factors(self) -> tuple[str, ...]:
        """Independent factors: groups, and tolerances without a group."""
        return tuple(dict.fromkeys(self.sources))

    def __len__(self) -> int:
        return self._count

    def at(self, run: int) -> tuple[Any, ...]:
        """Return the values of a run, see ``Points``."""
        return self.drawn(lambda _: run)

    def report(self) -> dict[str, Any]:
        """Return the defining values, see ``Points``.

        The count is left out, so that additional runs find the earlier ones.

        The first run's values represent the random numbers of this version of numpy.
        """
        spread = [tolerance.report() for tolerance in self.tolerances]
        return {"spread": spread, "seed": self.seed, "first": list(self.at(0))}

    def of(self, count: int) -> "DrawnPoints":
        """Return points that continue or shorten this series of drives to ``count`` runs."""
        return DrawnPoints(self.scene, self.tolerances, count, self.seed)

    def drawn(self, run_of: Callable[[str], int]) -> tuple[Any, ...]:
        """Return values in the order of the keys.

        Parameters
        ----------
        run_of
            Function from a factor to the run whose draws it uses.
        """
        values = dict(self._nominal)
        for tolerance, source in self._order:
            run = run_of(source)
            balls = int(values.get(COUNT, self.scene.balls.count))
            draw = functools.partial(_draw, tolerance.distribution, self.seed, source, run)
            if tolerance.what == RANDOM:
                shares = [draw(ball) for ball in range(balls)]
                values[ANGLES] = list(angles_at_random(self._sized(values), shares))
            elif tolerance.per_ball:
                by_ball = [draw(ball) for ball in range(balls)]
                values[tolerance.key] = _of_balls(tolerance, values[tolerance.key], by_ball)
            else:
                values[tolerance.key] = _common(tolerance, values[tolerance.key], draw(0), balls)
        return tuple(values[key] for key in self.keys)

    def _sized(self, values: dict[str, Any]) -> Scene:
        """Return the scene with the drawn sizes; the nominal scene if that is invalid."""
        changes = {key: v for key, v in values.items() if key.partition(".")[0] in SIZES}
        if not changes or "ball_contact" not in self.scene.effects:
            return self.scene
        if self.scene.start.ball_angles is not None:
            changes[ANGLES] = None
        try:
            return changed_scene(self.scene, changes, "draw")
        except SceneError:
            return self.scene

    def _check(self, key: str, of_key: Sequence[Tolerance]) -> None:
        """Check that the tolerances of a key fit together and fit its nominal value."""
        first, nominal = of_key[0], self._nominal[key]
        if first.key in OF_BALLS and self.scene.balls.count == 0 and COUNT not in self._nominal:
            raise InputError(
                f"{key}: the scene {self.scene.name} has no balls; give it some, --set "
                "balls.count=..., or do not spread it"
            )
        if any(tolerance.what in (VALUE, RANDOM) for tolerance in of_key[1:]):
            raise InputError(
                f"{key}: varies twice; only the first spread of a key may replace its value, the "
                "others must be relative to it, like 5%"
            )
        if first.what in (VALUE, RANDOM):
            return
        if nominal is None:
            raise InputError(
                f"{key}: the scene {self.scene.name} has no value to spread around; give one, "
                f"--set {key}=..., or spread the value itself: normal:MEAN,SD"
            )
        numbers = nominal if isinstance(nominal, list) else [nominal]
        if not all(_is_number(number) for number in numbers):
            raise InputError(f"{key} = {short(nominal)}: is not a number that could be spread")
        for tolerance in of_key:
            _check_deviation(tolerance, numbers)
        if first.what == FACTOR and not any(numbers):
            raise InputError(
                f"{key} = {short(nominal)}: a share of 0 is 0; give the standard deviation "
                "in the key's unit"
            )


def _check_deviation(tolerance: Tolerance, numbers: Sequence[float]) -> None:
    """Refuse a deviation larger than its value: a unit or % is probably missing."""
    key, normal = tolerance.key, tolerance.distribution
    largest = max(map(abs, numbers), default=0.0)
    if tolerance.what != OFFSET or not isinstance(normal, Normal) or not largest:
        return
    positive = scene_keys(key)[0].range.lstrip("> ")[:1].isdigit()
    if normal.deviation <= largest or not positive:
        return
    raise InputError(
        f"spread {short(tolerance.text)}: the standard deviation is "
        f"{normal.deviation / largest:.4g} times the value, {key} = {exact(largest)}; write a "
        f"share of it, e.g. {key}=1%, or the deviation with its unit"
    )


class ExchangedPoints:
    """Additional runs for Sobol indices.

    Run k d + i is drive 2 k with factor i of drive 2 k + 1, d being the number of factors.

    Parameters
    ----------
    drawn
        Random drives.
    pairs
        Number of pairs of drives.
    """

    def __init__(self, drawn: DrawnPoints, pairs: int) -> None:
        self._drawn, self._pairs = drawn, pairs

    @property
    def keys(self) -> tuple[str, ...]:
        """Varied keys, see ``Points``."""
        return self._drawn.keys

    def __len__(self) -> int:
        return self._pairs * len(self._drawn.factors)

    def at(self, run: int) -> tuple[Any, ...]:
        """Return the values of a run, see ``Points``."""
        pair, place = divmod(run, len(self._drawn.factors))
        exchanged = self._drawn.factors[place]
        return self._drawn.drawn(lambda factor: 2 * pair + (factor == exchanged))

    def report(self) -> dict[str, Any]:
        """Return the values that define the points, except how many there are; see ``Points``."""
        return {**self._drawn.report(), "exchanged": list(self._drawn.factors)}


def value_of(scene: Scene, key: str) -> Any:
    """Return a scene's value at a dotted key; None if there is none.

    Raises
    ------
    InputError
        A list has no such entry.
    """
    try:
        return value_at(scene.as_mapping(), key)
    except SceneError as error:
        raise InputError(str(error)) from None


def _sources(tolerances: Sequence[Tolerance]) -> tuple[str, ...]:
    """Return names of random streams; they do not depend on other tolerances."""
    names: list[str] = []
    for tolerance in tolerances:
        name = tolerance.key + " per ball" * (tolerance.per_ball and tolerance.what != RANDOM)
        again = sum(before.partition("#")[0].rstrip() == name for before in names)
        stream = f"{name} #{again + 1}" if again else name
        names.append(stream if tolerance.group is None else f"group {tolerance.group}")
    return tuple(names)


def _check_groups(tolerances: Iterable[Tolerance]) -> None:
    """Refuse a group of which some tolerances are per ball and others are not."""
    kinds: dict[str, bool] = {}
    for tolerance in tolerances:
        if (
            tolerance.group is not None
            and kinds.setdefault(tolerance.group, tolerance.per_ball) != tolerance.per_ball
        ):
            raise InputError(
                f"group={tolerance.group}: {tolerance.key} is spread "
                f"{'' if tolerance.per_ball else 'not '}per ball, others of the group "
                "otherwise; a group shares its draws, so spread all its keys in the same way"
            )


def _common(tolerance: Tolerance, value: Any, draw: Any, balls: int) -> Any:
    """Return a key's value with one draw for all its entries.

    Parameters
    ----------
    tolerance
        Tolerance of the key.
    value
        Nominal value, a number or a list.
    draw
        Drawn deviation or value, or the index of a discrete value.
    balls
        Number of balls.
    """
    if tolerance.what == VALUE:
        drawn = _value(tolerance, draw)
        alone = tolerance.key in (ANGLES, RATES) and not isinstance(drawn, list)
        return [drawn] * balls if alone else drawn
    if isinstance(value, list):
        return [_deviating(tolerance, entry, draw) for entry in value]
    return _deviating(tolerance, value, draw)


def _of_balls(tolerance: Tolerance, value: Any, draws: Sequence[Any]) -> list[Any]:
    """Return a key's value with a draw for each ball; arguments as for ``_common``."""
    if tolerance.what == VALUE:
        return [_value(tolerance, draw) for draw in draws]
    values = value if isinstance(value, list) else [value] * len(draws)
    # If the numbers of balls do not match, the scene is refused later with the reason.
    return [_deviating(tolerance, v, draw) for v, draw in zip(values, draws, strict=False)]


def _value(tolerance: Tolerance, draw: Any) -> Any:
    """Return the drawn value, which replaces the nominal one."""
    return tolerance.values[draw] if isinstance(tolerance.distribution, Discrete) else draw


def _deviating(tolerance: Tolerance, value: float, draw: float) -> float:
    """Return a value with a drawn deviation, relative to it or in its unit."""
    return value * (1.0 + draw) if tolerance.what == FACTOR else value + draw


def _draw(distribution: Distribution, seed: int, source: str, run: int, ball: int) -> Any:
    """Return one draw of a random stream; see ``_block``."""
    return _block(distribution, seed, source, ball, run // BLOCK)[run % BLOCK]


@functools.lru_cache(maxsize=1024)
def _block(distribution: Distribution, seed: int, source: str, ball: int, block: int) -> list[Any]:
    """Return the draws of a block of successive runs for one ball.

    A draw depends only on the seed, the name of its random stream, the run and the ball.
    """
    return [share.item() for share in distribution.at(_shares(seed, source, ball, block))]


def _shares(seed: int, source: str, ball: int, block: int) -> np.ndarray:
    """Return independent uniform numbers in (0, 1), shape (BLOCK,)."""
    name = int.from_bytes(hashlib.sha256(source.encode()).digest()[:8], "big")
    numbers = np.random.default_rng([seed, name, ball, block]).random(BLOCK)
    return np.maximum(numbers, 2.0**-54)


def _is_number(value: Any) -> bool:
    """Return whether a value is a number; true and false are not."""
    return isinstance(value, int | float) and not isinstance(value, bool)
