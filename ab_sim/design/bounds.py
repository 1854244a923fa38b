"""Bounds on metrics in text form: ``residual_unbalance<=0.1``."""

import math
import operator
import re
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.metrics.metric import Metric, MetricKind, metrics_named
from ab_sim.base.errors import InputError, exact, short
from ab_sim.base.numbers import number_in
from ab_sim.base.presentation import number
from ab_sim.scene.units import NO_UNIT, has_unit, in_si

_FORMS = (
    "must be METRIC<NUMBER, with <, <=, > or >=, e.g. 'final_whirl_over_e<0.2'; or the name of a "
    "metric that is true or false, alone or after 'not'"
)
_OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_COMPARISON = re.compile(r"([^<>=!]*)([<>=!]+)([^<>=!]*)")
_WITHOUT_UNIT = (*NO_UNIT, "e")
"""Units that a bound must not contain: pint's e is the elementary charge, not eccentricity."""


class Bound(NamedTuple):
    """Condition on a metric of a run."""

    metric: str
    """Key of the metric in reports."""
    op: str
    """Operator: <, <=, > or >=."""
    limit: float
    """Limit in the metric's reported unit; true is 1, false is 0."""

    def __str__(self) -> str:
        return f"{self.metric}{self.op}{exact(self.limit)}"

    @property
    def is_number(self) -> bool:
        """True if the metric is a number, not true or false."""
        (metric,) = metrics_named([self.metric])
        return metric.kind is MetricKind.NUMBER

    @property
    def text(self) -> str:
        """Text form, as ``bound_of`` reads it: ``balanced``, ``peak_whirl_over_e<5``."""
        if self.is_number:
            return f"{self.metric}{self.op}{number(self.limit)}"
        return f"not {self.metric}" if self.upper else self.metric

    @property
    def upper(self) -> bool:
        """True for an upper bound."""
        return self.op.startswith("<")

    def holds(self, values: Any) -> np.ndarray:
        """Return whether values satisfy the bound.

        Parameters
        ----------
        values
            Values of the metric in any shape; None and NaN never satisfy it.

        Returns
        -------
        np.ndarray
            Booleans of the same shape.
        """
        numbers = np.asarray(values, dtype=float)
        return np.asarray(_OPERATORS[self.op](numbers, self.limit), dtype=bool)


def bound_of(text: str) -> Bound:
    """Parse ``METRIC<NUMBER``; the number is in the metric's unit or has its own.

    A metric that is true or false may stand alone, ``balanced``, or after ``not``.

    Raises
    ------
    InputError
        The text has another form, the metric is unknown or not a number, or the number cannot be
        read; the message states the allowed forms.
    """
    match = _COMPARISON.fullmatch(text)
    if match is None:
        return _truth(text)
    name, op, number = (part.strip() for part in match.groups())
    if op not in _OPERATORS or not name or not number:
        raise InputError(f"bound {short(text)}: {_FORMS}")
    metric = _compared(text, name)
    return Bound(metric.key, op, _limit(text, metric, number))


def _truth(text: str) -> Bound:
    """Parse the name of a metric that is true or false, alone or after ``not``."""
    words = text.split()
    denied = words[:1] == ["not"]
    names = words[1:] if denied else words
    if len(names) != 1 or set(text) & set("<>=!"):
        raise InputError(f"bound {short(text)}: {_FORMS}")
    metric = _compared(text, names[0])
    if metric.kind is not MetricKind.TRUTH:
        raise InputError(
            f"bound {short(text)}: {metric.key} is a number [{metric.unit}]; add a limit, "
            f"e.g. '{metric.key}<0.1'"
        )
    return Bound(metric.key, "<=", 0.0) if denied else Bound(metric.key, ">=", 1.0)


def _compared(text: str, name: str) -> Metric[Any]:
    """Return the named metric; refuse one whose values cannot be compared, quoting ``text``."""
    (metric,) = metrics_named([name])
    if not metric.scalar:
        raise InputError(f"bound {short(text)}: {name} {metric.not_a_number}")
    return metric


def _limit(text: str, metric: Metric[Any], number: str) -> float:
    """Parse the limit of a bound, a number with or without a unit, to the metric's unit."""
    place = f"bound {short(text)}: {short(number)}"
    try:
        if has_unit(number):
            if metric.unit in _WITHOUT_UNIT:
                unit = "in e, " if metric.unit == "e" else ""
                raise ValueError(f"must be a number {unit}without unit")
            return in_si(number, metric.unit)
        limit = number_in(number)
    except ValueError as error:
        why = error if has_unit(number) else f"is not a number; {_FORMS}"
        raise InputError(f"{place} {why}") from None
    if not math.isfinite(limit):
        raise InputError(f"{place} must be a finite number")
    return limit
