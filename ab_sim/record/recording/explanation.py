"""Quantities in a description that explain a run in drawings and plots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ab_sim.drive.closed_forms import Balance, DrivenBalls, RotorWithoutBalls
from ab_sim.record.recording.layout import Array


@dataclass(frozen=True)
class Explanation:
    """Quantities of `ab_sim.drive.description.explain`; those that are None are not drawn."""

    motion: float | None
    """Size of the deck's motion [m]."""
    unbalance: float | None
    """Unbalance M0 e [kg m]."""
    moments: Array
    """Moments m_i R of the balls [kg m], shape (balls,)."""
    balance: Balance | None
    """Balanced, or best, positions of the balls."""
    without_balls: RotorWithoutBalls | None
    """Constants from which the whirl of the same drive without balls is computed."""
    driven: DrivenBalls | None
    """Constants of the driving forces on the balls."""
    critical_speed: float | None
    """Critical speed [rad/s]."""
    top_speed: float | None
    """Top speed [rad/s]."""
    period: Mapping[str, float] | None
    """Variable-speed period: start_speed and end_speed [rad/s]; acceleration [rad/s^2] during
    the period, and around: acceleration before and after it [rad/s^2]."""
    left_out: Mapping[str, str]
    """Reasons for a missing ``balance`` or ``without_balls``."""

    @classmethod
    def of(cls, description: Mapping[str, Any], balls: int) -> Explanation:
        """Read the quantities from a description.

        Raises
        ------
        KeyError, TypeError, ValueError
            The values are not those of ``explain``.
        """
        names = ("balance", "without_balls", "driven")
        balance, without_balls, driven = (description.get(name) for name in names)
        sections = {"balance": balance, "without_balls": without_balls}
        why = {
            name: str(it["left_out"]) for name, it in sections.items() if it and "left_out" in it
        }
        moments = description.get("moments")
        explanation = cls(
            _number(description.get("motion")),
            _number(description.get("unbalance")) if moments is not None else None,
            np.array(moments or [], dtype=float),
            _tuple_of(Balance, None if "balance" in why else balance),
            _tuple_of(RotorWithoutBalls, None if "without_balls" in why else without_balls),
            _tuple_of(DrivenBalls, driven),
            _number(description.get("critical_speed")),
            _number(description.get("top_speed")),
            _numbers(description.get("variable_speed_period")),
            why,
        )
        counts = {balls}
        counts |= {len(explanation.moments)} if moments is not None else set()
        counts |= {len(explanation.balance.angles)} if explanation.balance else set()
        counts |= {len(explanation.driven.masses)} if explanation.driven else set()
        if len(counts) > 1:
            raise ValueError(f"moments, balance and driven must be those of {balls} balls")
        return explanation

    @property
    def vectors(self) -> bool:
        """True if there is an unbalance of the rotor or of balls to draw as arrows."""
        return self.unbalance is not None and max([self.unbalance, *self.moments], default=0.0) > 0


def _number(value: Any) -> float | None:
    """Return a value as a float; None stays None."""
    return None if value is None else float(value)


def _numbers(values: Any) -> dict[str, float] | None:
    """Return the numbers of a variable-speed period, see `Explanation.period`; None remains."""
    if values is None:
        return None
    names = ("start_speed", "end_speed", "acceleration", "around")
    return {name: float(values[name]) for name in names}


def _tuple_of(kind: Any, fields: Any) -> Any:
    """Return a named tuple of a class from JSON-able fields; None remains."""
    if fields is None:
        return None
    fixed = {name: tuple(map(float, v)) if isinstance(v, list) else v for name, v in fields.items()}
    return kind(**fixed)
