"""Tolerances of random drives, in text form (``balls.mass=5%``) or from a fit.

A value is the quantile of its distribution at a uniform random number.
"""

import json
import math
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import InputError, exact, short
from ab_sim.base.files import check_regular
from ab_sim.base.numbers import number_in
from ab_sim.base.yaml_files import read_yaml
from ab_sim.scene.keys import SceneKey, scene_keys
from ab_sim.scene.units import NO_UNIT, has_unit, in_si, with_last_unit

_LEAST_MASS = 1e-6
"""Least probability between the limits; for less, rounding spoils the quantiles."""


class Normal(NamedTuple):
    """Normal distribution, truncated at limits and renormalised."""

    mean: float
    """Mean before truncation."""
    deviation: float
    """Standard deviation before truncation."""
    low: float = -math.inf
    """Lower limit."""
    high: float = math.inf
    """Upper limit."""

    def mass_within(self) -> float:
        """Return the probability between the limits before truncation, 0 to 1."""
        low, high = self._ends()
        return high - low

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return the quantiles at probabilities, shape (n,).

        Parameters
        ----------
        shares
            Probabilities above 0 and below 1, shape (n,).
        """
        from scipy.special import ndtri

        low, high = self._ends()
        drawn = self.mean + self.deviation * ndtri(low + shares * (high - low))
        return np.clip(drawn, self.low, self.high)

    def _ends(self) -> tuple[float, float]:
        """Return the probabilities below the lower and the upper limit before truncation."""
        from scipy.special import ndtr

        ends = [(limit - self.mean) / self.deviation for limit in (self.low, self.high)]
        return float(ndtr(ends[0])), float(ndtr(ends[1]))


class LogNormal(NamedTuple):
    """Log-normal distribution, reduced by ``shift``, truncated at limits."""

    median: float
    """Median before ``shift`` is subtracted."""
    log_deviation: float
    """Standard deviation of the natural logarithm."""
    low: float = -math.inf
    """Lower limit of the shifted value."""
    high: float = math.inf
    """Upper limit of the shifted value."""
    shift: float = 0.0
    """Amount subtracted from the value; 1 for a relative deviation."""

    def mass_within(self) -> float:
        """Return the probability between the limits, see ``Normal``."""
        return self._logarithm().mass_within()

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return quantiles, see ``Normal``."""
        drawn = np.exp(self._logarithm().at(shares)) - self.shift
        return np.clip(drawn, self.low, self.high)

    def _logarithm(self) -> Normal:
        """Return the normal distribution of the logarithm of the value before the shift."""
        low, high = (
            math.log(limit + self.shift) if limit + self.shift > 0 else -math.inf
            for limit in (self.low, self.high)
        )
        return Normal(math.log(self.median), self.log_deviation, low, high)


class Uniform(NamedTuple):
    """Uniform distribution between two limits."""

    low: float
    high: float

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return quantiles, see ``Normal``."""
        return self.low + shares * (self.high - self.low)


class Discrete(NamedTuple):
    """Choice from a list of values with equal probability; repeated values count repeatedly."""

    choices: int
    """Number of values in the list."""

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return indices in the list of values; arguments as for ``Normal``."""
        return np.floor(shares * self.choices).astype(np.int64)


class Loading(NamedTuple):
    """Multiple, of either sign, of a standard normal number shared with other tolerances."""

    size: float
    """Factor on the shared normal number, in the key's unit."""

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return quantiles, see ``Normal``."""
        return self.size * Normal(0.0, 1.0).at(shares)


Distribution = Normal | LogNormal | Uniform | Discrete | Loading


ANGLES, RATES = "start.ball_angles", "start.ball_rates"
"""Keys of the balls' start angles and rates."""
OF_BALLS = ("balls.mass", "balls.radius", ANGLES, RATES)
"""Keys with a number per ball."""
FACTOR, OFFSET, VALUE, RANDOM = "factor", "offset", "value", "random"
"""Kind of the drawn quantity.

``FACTOR``: relative deviation. ``OFFSET``: deviation in the key's unit. ``VALUE``: the value
itself. ``RANDOM``: position on the circle.
"""
_FORMS = (
    "must be KEY=5% (normal, about the scene's value), KEY=0.1 mm (normal, standard deviation "
    "in the key's unit), KEY=normal:MEAN,SD, KEY=lognormal:MEDIAN,40%, KEY=uniform:LOW,HIGH, "
    "KEY=uniform:5%, KEY=discrete:V,V,... or start.ball_angles=random; optionally "
    "followed by low=NUMBER, high=NUMBER, per ball, group=NAME, separated by commas"
)
_OPTION = re.compile(r"\s*,?\s*(?:(per ball)|(low|high|group)\s*=\s*([^,=]*?))\s*$")
_GROUP = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}")


class Tolerance(NamedTuple):
    """Spread of one key of a scene."""

    key: str
    """Dotted key."""
    what: str
    """Kind of the drawn quantity: FACTOR, OFFSET, VALUE or RANDOM."""
    distribution: Distribution
    """Distribution of the drawn quantity."""
    values: tuple[Any, ...] = ()
    """Values of a discrete distribution."""
    per_ball: bool = False
    """True if each ball has its own draw; otherwise all balls share one."""
    group: str | None = None
    """Name of the group; tolerances in a group share a draw, so that they are all high or all
    low."""
    text: str = ""
    """Original text."""

    def report(self) -> list[Any]:
        """Return the defining values of the draws, JSON-able."""
        kind = type(self.distribution).__name__
        numbers = [exact(number) for number in self.distribution]
        return [self.key, self.what, kind, numbers, list(self.values), self.per_ball, self.group]


class _Options(NamedTuple):
    """Options after a spread's form, as text; None for those that are missing."""

    per_ball: bool
    group: str | None
    low: str | None
    high: str | None


def tolerance_of(text: str) -> Tolerance:
    """Parse ``KEY=5%``, ``KEY=lognormal:0.1 mm,40%, per ball`` and similar; see ``_FORMS``.

    Raises
    ------
    InputError
        The text is invalid; the message states the fault and the allowed forms.
    """
    name, equals, spread_text = (part.strip() for part in text.partition("="))
    if not equals or not name or not spread_text:
        raise InputError(f"spread {short(text)}: {_FORMS}")
    reader = _Reader(text, scene_keys(name)[0], name)
    spread_text, options = _options(text, spread_text)
    reader.check_options(options)
    if spread_text == RANDOM:
        if name != ANGLES:
            raise reader.error(f"random is for {ANGLES} only; {_FORMS}")
        reader.check_no_limits(options)
        return Tolerance(name, RANDOM, Uniform(0.0, 1.0), (), True, options.group, text)
    what, distribution, values = reader.form(spread_text, options)
    mass = distribution.mass_within() if isinstance(distribution, Normal | LogNormal) else 1.0
    if mass < _LEAST_MASS:
        raise reader.error(
            f"between low and high lies {mass:.2g} of the distribution; must be at least "
            f"{_LEAST_MASS:g}"
        )
    return Tolerance(name, what, distribution, values, options.per_ball, options.group, text)


def _options(text: str, spread_text: str) -> tuple[str, _Options]:
    """Return the form of a spread, without its options, and the options; ``text`` is for errors."""
    options_: dict[str, Any] = {}
    while (option := _OPTION.search(spread_text)) is not None:
        name = "per_ball" if option[1] else option[2]
        if name in options_:
            raise InputError(f"spread {short(text)}: {option[1] or name} is given twice")
        options_[name] = option[3] if option[2] else True
        spread_text = spread_text[: option.start()].strip()
    options = _Options(
        "per_ball" in options_, options_.get("group"), options_.get("low"), options_.get("high")
    )
    if options.group is not None and not _GROUP.fullmatch(options.group):
        raise InputError(
            f"spread {short(text)}: group={options.group}: must be a name of letters, digits, - "
            "and _, a letter first"
        )
    return spread_text, options


class _Reader:
    """Reader of the forms of a spread of ``key``; ``text`` is for error messages."""

    def __init__(self, text: str, about: SceneKey, key: str) -> None:
        self._text, self._about, self._key = text, about, key
        self._unit = about.unit
        self._readers = {
            "normal": self._normal,
            "lognormal": self._lognormal,
            "uniform": self._uniform,
        }

    def error(self, message: str) -> InputError:
        """Return an error with the whole text and a message."""
        return InputError(f"spread {short(self._text)}: {message}")

    def check_options(self, options: _Options) -> None:
        """Refuse ``per ball`` for a key without a number per ball."""
        if options.per_ball and self._key not in OF_BALLS:
            raise self.error(f"per ball is for {', '.join(OF_BALLS)} only")

    def check_no_limits(self, options: _Options) -> None:
        """Refuse limits for a form that has none."""
        if options.low is not None or options.high is not None:
            raise self.error("low and high are for normal and lognormal only")

    def form(
        self, spread_text: str, options: _Options
    ) -> tuple[str, Distribution, tuple[Any, ...]]:
        """Return the kind of quantity, its distribution, and the values of a discrete one."""
        kind, colon, rest = (part.strip() for part in spread_text.partition(":"))
        if colon and kind == "discrete":
            self.check_no_limits(options)
            listed = self._listed(rest)
            return VALUE, Discrete(len(listed)), listed
        self._check_takes_numbers()
        if not colon:
            kind, rest = "normal", spread_text
        if kind not in self._readers:
            raise self.error(_FORMS)
        parts = [part.strip() for part in rest.split(",")]
        if not 1 <= len(parts) <= 2 or not all(parts):
            raise self.error(_FORMS)
        what, distribution = self._readers[kind](parts, options)
        return what, distribution, ()

    def _normal(self, parts: list[str], options: _Options) -> tuple[str, Distribution]:
        """Read ``SD``, ``5%``, ``MEAN,SD`` or ``MEAN,5%``; return the kind and the distribution."""
        if len(parts) == 2:
            shares = parts[1].endswith("%")
            parts = parts if shares else self._with_last_unit(parts)
            mean = self._number(parts[0])
            deviation = abs(mean) * self._share(parts[1]) if shares else self._positive(parts[1])
            if deviation == 0.0:
                raise self.error(f"{parts[1]} of 0 is 0; give the standard deviation itself")
            return VALUE, Normal(mean, deviation, *self._limits(options, VALUE))
        what = FACTOR if parts[0].endswith("%") else OFFSET
        deviation = self._share(parts[0]) if what == FACTOR else self._positive(parts[0])
        return what, Normal(0.0, deviation, *self._limits(options, what))

    def _lognormal(self, parts: list[str], options: _Options) -> tuple[str, Distribution]:
        """Read ``40%`` or ``MEDIAN,40%``; return the kind and the distribution."""
        if not parts[-1].endswith("%"):
            raise self.error(
                f"{short(parts[-1])}: must be the standard deviation of the logarithm, e.g. 40%: "
                "two thirds of the values lie within a factor of exp(0.4)"
            )
        deviation = self._share(parts[-1])
        if len(parts) == 1:
            limits = self._limits(options, FACTOR)
            return FACTOR, LogNormal(1.0, deviation, *limits, shift=1.0)
        median = self._positive(parts[0])
        return VALUE, LogNormal(median, deviation, *self._limits(options, VALUE))

    def _uniform(self, parts: list[str], options: _Options) -> tuple[str, Distribution]:
        """Read ``HALF``, ``5%`` or ``LOW,HIGH``; return the kind and the distribution."""
        self.check_no_limits(options)
        if len(parts) == 1:
            what = FACTOR if parts[0].endswith("%") else OFFSET
            half = self._share(parts[0]) if what == FACTOR else self._positive(parts[0])
            return what, Uniform(-half, half)
        low, high = map(self._number, self._with_last_unit(parts))
        if low >= high:
            raise self.error("must have the lower end first")
        return VALUE, Uniform(low, high)

    def _limits(self, options: _Options, what: str) -> tuple[float, float]:
        """Return the limits of the drawn quantity, infinite if missing.

        They limit the value itself, or its deviation for the kinds ``FACTOR`` and ``OFFSET``.
        """
        limits = []
        for limit, missing in ((options.low, -math.inf), (options.high, math.inf)):
            if limit is None:
                limits.append(missing)
            elif what == FACTOR:
                if not limit.endswith("%"):
                    raise self.error(
                        f"{short(limit)}: low and high limit the deviation here, e.g. low=-10%"
                    )
                limits.append(self._plain(limit.removesuffix("%")) / 100.0)
            else:
                limits.append(self._number(limit))
        if limits[0] >= limits[1]:
            raise self.error("low must be below high")
        return limits[0], limits[1]

    def _check_takes_numbers(self) -> None:
        """Refuse a continuous distribution for a key of whole numbers or words."""
        if self._about.range.startswith("whole"):
            raise self.error("takes whole numbers; write discrete:V,V,...")
        if self._unit == "-":
            raise self.error("takes no numbers; write discrete:V,V,...")

    def _share(self, text: str) -> float:
        """Read a percentage above 0 as a fraction."""
        share = self._plain(text.removesuffix("%").strip()) / 100.0
        if share <= 0.0:
            raise self.error(f"{short(text)} must be above 0")
        return share

    def _positive(self, text: str) -> float:
        """Read a number above 0, in SI."""
        number = self._number(text)
        if number <= 0.0:
            raise self.error(f"{short(text)} must be above 0")
        return number

    def _with_last_unit(self, parts: list[str]) -> list[str]:
        """Return number texts, all with the unit of the last."""
        try:
            return with_last_unit(parts)
        except ValueError as error:
            raise self.error(f"{short(parts[-1])} {error}") from None

    def _number(self, text: str) -> float:
        """Read a number with a unit or in SI; return it in SI."""
        if not has_unit(text):
            return self._plain(text)
        try:
            return in_si(text, self._unit)
        except ValueError as error:
            raise self.error(f"{short(text)} {error}") from None

    def _plain(self, text: str) -> float:
        """Read a finite number without a unit."""
        try:
            number = number_in(text)
        except ValueError:
            raise self.error(f"{short(text)} is not a number; {_FORMS}") from None
        if not math.isfinite(number):
            raise self.error(f"{short(text)} must be a finite number")
        return number

    def _listed(self, text: str) -> tuple[Any, ...]:
        """Read the values of a discrete distribution, YAML; texts of numeric keys become SI."""
        try:
            values = read_yaml(f"[{text}]")
        except ValueError as error:
            raise self.error(f"its values: {error}") from error
        if not isinstance(values, list) or not values:
            raise self.error(_FORMS)
        if self._unit in NO_UNIT:
            return tuple(values)
        return tuple(self._number(value) if isinstance(value, str) else value for value in values)


_LEAST = 1e-6
"""Fraction of a key's standard deviation up to which a component of the deviation is left out."""
MOST_BYTES = 50_000_000
"""Largest size of a file with a fit."""


def fitted_tolerances(path: Path) -> list[Tolerance]:
    """Return correlated tolerances around the fitted values of ``ab-sim identify --json``.

    A value's deviation is a sum over shared, independent standard normal numbers, weighted by the
    triangular factor of the covariance. Each number is a group named after the first key that
    depends on it, such as ``fit of rotor.eccentricity``. It is the part of this key that earlier
    keys do not explain.

    Parameters
    ----------
    path
        File of the fit.

    Raises
    ------
    InputError
        The file cannot be read or contains no fit; the message states why.
    """
    origin = f"spread from {path}"
    try:
        check_regular(path)
        if path.stat().st_size > MOST_BYTES:
            raise ValueError(f"has more than {MOST_BYTES} bytes")
        report = json.loads(path.read_bytes())
        names = report["covariance"]["parameters"]
        covariance = np.array(report["covariance"]["values"], float)
        common = {
            parameter["name"]
            for parameter in report["parameters"]
            if not parameter["per_recording"]
        }
        kept = [k for k, name in enumerate(names) if name in common]
        factor = _factor(covariance[np.ix_(kept, kept)])
    except OSError as error:
        raise InputError(f"{origin}: cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise InputError(
            f"{origin}: is not what `ab-sim identify --json` writes "
            f"({type(error).__name__}: {error})"
        ) from error
    if not kept:
        raise InputError(f"{origin}: nothing of the scene was fitted; there is nothing to spread")
    return [
        tolerance
        for row, k in zip(factor, kept, strict=True)
        for tolerance in _of_key(names[k], row, [names[j] for j in kept])
    ]


def _factor(covariance: np.ndarray) -> np.ndarray:
    """Return the lower triangular factor L of a covariance L L^T, shape (keys, keys).

    It is computed from the correlations, because the keys' units scale the covariance badly.

    Raises
    ------
    ValueError
        The covariance is not finite or not positive definite.
    """
    sizes = np.sqrt(np.diag(covariance))
    if not (np.isfinite(covariance).all() and (sizes > 0.0).all()):
        raise ValueError("its covariance is not finite, or has a variance that is not above 0")
    correlation = covariance / np.outer(sizes, sizes)
    count = len(sizes)
    try:
        lower = np.linalg.cholesky(correlation + 1e-12 * np.eye(count))
    except np.linalg.LinAlgError as error:
        raise ValueError("its covariance is not positive definite") from error
    factor: np.ndarray = lower * sizes[:, None]
    return factor


def _of_key(key: Any, row: np.ndarray, keys: list[Any]) -> list[Tolerance]:
    """Return a key's tolerances, one per shared number on which it depends.

    Parameters
    ----------
    key
        Dotted key.
    row
        Its row of the triangular factor, in the key's unit, shape (keys,).
    keys
        All fitted keys; each names the shared number of its column.
    """
    whole = math.sqrt(float(row @ row))
    return [
        Tolerance(
            str(key), OFFSET, Loading(float(size)), (), False, f"fit of {first}",
            f"{key} as fitted, with {first}",
        )
        for first, size in zip(keys, row, strict=True)
        if abs(size) > _LEAST * whole
    ]  # fmt: skip
