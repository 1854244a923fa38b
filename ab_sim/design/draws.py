"""Built drives, drawn at random by the tolerances of a drawing.

Draws are independent random numbers and no sequence that fills space evenly: the intervals of a
share and of quantiles are the binomial distribution's, which is that of independent runs only.
"""

import functools
import hashlib
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ab_sim.design.distributions import Discrete, Distribution, Normal
from ab_sim.design.points import MOST, check_within
from ab_sim.design.tolerances import (
    ANGLES,
    FACTOR,
    OF_BALLS,
    OFFSET,
    RANDOM,
    RATES,
    VALUE,
    Tolerance,
)
from ab_sim.equations.neighbours import angles_at_random
from ab_sim.errors import InputError, SceneError, exact
from ab_sim.quoting import short
from ab_sim.scene.changes import value_at
from ab_sim.scene.keys import scene_keys
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

BLOCK = 1024
"""Numbers drawn at a time: those of a run do not depend on how many runs there are."""
COUNT = "balls.count"
SIZES = ("balls", "race", "effects")
"""Sections that say where balls can be without overlap."""


class DrawnPoints:
    """Runs of drives as they are built.

    Args:
        scene: the drawing: values that tolerances are about.
        tolerances: in the order in which they act on a key.
        count: of runs; a run is the same one whatever it is.
        seed: of random numbers; each tolerance, or group of such, has its own, so that another one
            beside it changes nothing.

    Raises:
        InputError: names what cannot be.
    """

    def __init__(
        self, scene: Scene, tolerances: Sequence[Tolerance], count: int, seed: int
    ) -> None:
        if not tolerances:
            raise InputError("nothing is spread; name a key and its spread, e.g. balls.mass=5%")
        if not 1 <= count <= MOST:
            raise InputError(f"{count} runs: must be from 1 to {MOST}")
        self.scene, self.tolerances, self.seed, self._count = scene, tuple(tolerances), seed, count
        self.sources = _sources(tolerances)
        """Name of what each tolerance is drawn from: its group, or its own."""
        self._nominal = {each.key: value_of(scene, each.key) for each in tolerances}
        check_within(list(self._nominal))
        for key in self._nominal:
            self._check(key, [each for each in tolerances if each.key == key])
        _check_groups(tolerances)
        # The count says how many draws per ball there are, and sizes where balls have room.
        self._order = sorted(
            zip(self.tolerances, self.sources, strict=True),
            key=lambda each: 0 if each[0].key == COUNT else 2 if each[0].what == RANDOM else 1,
        )

    @property
    def keys(self) -> tuple[str, ...]:
        """See ``Points``."""
        return tuple(dict.fromkeys(each.key for each in self.tolerances))

    @property
    def factors(self) -> tuple[str, ...]:
        """What varies independently of each other: groups, and tolerances in none."""
        return tuple(dict.fromkeys(self.sources))

    def __len__(self) -> int:
        return self._count

    def at(self, run: int) -> tuple[Any, ...]:
        """See ``Points``."""
        return self.drawn(lambda _: run)

    def report(self) -> dict[str, Any]:
        """See ``Points``; without the count, so that more runs find those that are done.

        The values of the first run stand for the random numbers of this version of numpy.
        """
        spread = [each.report() for each in self.tolerances]
        return {"spread": spread, "seed": self.seed, "first": list(self.at(0))}

    def of(self, count: int) -> "DrawnPoints":
        """So many runs, those that both have being the same."""
        return DrawnPoints(self.scene, self.tolerances, count, self.seed)

    def drawn(self, run_of: Callable[[str], int]) -> tuple[Any, ...]:
        """Values in the keys' order.

        Args:
            run_of: from which run a factor's draws are taken.
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
                each = [draw(ball) for ball in range(balls)]
                values[tolerance.key] = _of_balls(tolerance, values[tolerance.key], each)
            else:
                values[tolerance.key] = _common(tolerance, values[tolerance.key], draw(0), balls)
        return tuple(values[key] for key in self.keys)

    def _sized(self, values: dict[str, Any]) -> Scene:
        """The scene in which balls have their room; of one that cannot be, the drawing."""
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
        """Whether tolerances of a key fit together, and to the value that they are about."""
        first, nominal = of_key[0], self._nominal[key]
        if first.key in OF_BALLS and self.scene.balls.count == 0 and COUNT not in self._nominal:
            raise InputError(
                f"{key}: the scene {self.scene.name} has no balls; give it some, --set "
                "balls.count=..., or do not spread it"
            )
        if any(each.what in (VALUE, RANDOM) for each in of_key[1:]):
            raise InputError(
                f"{key}: varies twice; of one key only the first spread may give the value itself, "
                "the others must be about it, like 5%"
            )
        if first.what in (VALUE, RANDOM):
            return
        if nominal is None:
            raise InputError(
                f"{key}: the scene {self.scene.name} gives none to be about; write its value, "
                f"--set {key}=..., or spread the value itself: normal:MEAN,SD"
            )
        numbers = nominal if isinstance(nominal, list) else [nominal]
        if not all(_is_number(each) for each in numbers):
            raise InputError(f"{key} = {short(nominal)}: is no number that could be spread")
        for each in of_key:
            _check_deviation(each, numbers)
        if first.what == FACTOR and not any(numbers):
            raise InputError(
                f"{key} = {short(nominal)}: a share of 0 is nothing; give the standard deviation "
                "in the key's unit"
            )


def _check_deviation(tolerance: Tolerance, numbers: Sequence[float]) -> None:
    """Refuse the deviation of a size that is larger than the size: its unit or % was forgotten."""
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
    """Runs that Sobol indices need beside those of ``DrawnPoints``.

    Run k d + i is drive 2 k with factor i of drive 2 k + 1, d being the number of factors.

    Args:
        drawn: the drives.
        pairs: how many pairs of them.
    """

    def __init__(self, drawn: DrawnPoints, pairs: int) -> None:
        self._drawn, self._pairs = drawn, pairs

    @property
    def keys(self) -> tuple[str, ...]:
        """See ``Points``."""
        return self._drawn.keys

    def __len__(self) -> int:
        return self._pairs * len(self._drawn.factors)

    def at(self, run: int) -> tuple[Any, ...]:
        """See ``Points``."""
        pair, place = divmod(run, len(self._drawn.factors))
        exchanged = self._drawn.factors[place]
        return self._drawn.drawn(lambda factor: 2 * pair + (factor == exchanged))

    def report(self) -> dict[str, Any]:
        """See ``Points``; without the count."""
        return {**self._drawn.report(), "exchanged": list(self._drawn.factors)}


def value_of(scene: Scene, key: str) -> Any:
    """What a scene says at a dotted key, plain; None if it says nothing.

    Raises:
        InputError: a list has no such entry.
    """
    try:
        return value_at(scene.as_mapping(), key)
    except SceneError as error:
        raise InputError(str(error)) from None


def _sources(tolerances: Sequence[Tolerance]) -> tuple[str, ...]:
    """Named by themselves and not by their place, so that others beside them change no draw."""
    names: list[str] = []
    for each in tolerances:
        name = each.key + " per ball" * (each.per_ball and each.what != RANDOM)
        again = sum(before.partition("#")[0].rstrip() == name for before in names)
        own = f"{name} #{again + 1}" if again else name
        names.append(own if each.group is None else f"group {each.group}")
    return tuple(names)


def _check_groups(tolerances: Iterable[Tolerance]) -> None:
    kinds: dict[str, bool] = {}
    for each in tolerances:
        if each.group is not None and kinds.setdefault(each.group, each.per_ball) != each.per_ball:
            raise InputError(
                f"group={each.group}: {each.key} is spread {'' if each.per_ball else 'not '}per "
                "ball, others of the group otherwise; draws can be shared by what is alike only"
            )


def _common(tolerance: Tolerance, value: Any, draw: Any, balls: int) -> Any:
    """A value with one draw for all that it consists of."""
    if tolerance.what == VALUE:
        drawn = _value(tolerance, draw)
        alone = tolerance.key in (ANGLES, RATES) and not isinstance(drawn, list)
        return [drawn] * balls if alone else drawn
    if isinstance(value, list):
        return [_deviating(tolerance, each, draw) for each in value]
    return _deviating(tolerance, value, draw)


def _of_balls(tolerance: Tolerance, value: Any, draws: Sequence[Any]) -> list[Any]:
    """A value for each ball."""
    if tolerance.what == VALUE:
        return [_value(tolerance, draw) for draw in draws]
    values = value if isinstance(value, list) else [value] * len(draws)
    # Where numbers of balls do not fit, the scene is refused, with the reason.
    return [_deviating(tolerance, v, draw) for v, draw in zip(values, draws, strict=False)]


def _value(tolerance: Tolerance, draw: Any) -> Any:
    return tolerance.values[draw] if isinstance(tolerance.distribution, Discrete) else draw


def _deviating(tolerance: Tolerance, value: float, draw: float) -> float:
    return value * (1.0 + draw) if tolerance.what == FACTOR else value + draw


def _draw(distribution: Distribution, seed: int, source: str, run: int, ball: int) -> Any:
    return _block(distribution, seed, source, ball, run // BLOCK)[run % BLOCK]


@functools.lru_cache(maxsize=1024)
def _block(distribution: Distribution, seed: int, source: str, ball: int, block: int) -> list[Any]:
    """Draws of so many runs in a row."""
    return [each.item() for each in distribution.at(_shares(seed, source, ball, block))]


def _shares(seed: int, source: str, ball: int, block: int) -> np.ndarray:
    """Independent, uniform between 0 and 1, both excluded; shape (BLOCK,)."""
    name = int.from_bytes(hashlib.sha256(source.encode()).digest()[:8], "big")
    numbers = np.random.default_rng([seed, name, ball, block]).random(BLOCK)
    return np.maximum(numbers, 2.0**-54)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
