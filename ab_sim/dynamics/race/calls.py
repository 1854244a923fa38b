"""What events need of a scene: its equations, its steps, its law of impact.

What decides events is compiled once for all scenes and knows none; it is given where in memory the
scene's own functions are, and calls them there.
"""

from typing import Any, NamedTuple

from numba.core import types
from numba.core.types.containers import NamedTuple as NamedTupleType
from numba.extending import register_jitable

from ab_sim.dynamics.calling import call_at
from ab_sim.dynamics.dispatch import INLINED

STATE = types.Array(types.float64, 1, "C")
EVALUATE = (types.float64, STATE, STATE)
TAKE_STEP = (types.float64, types.float64, STATE)
RESTITUTION = (types.float64,)
KICK = (STATE, STATE)


class Calls(NamedTuple):
    """Addresses of functions of a scene, and of what each is given first."""

    context: int
    evaluate: int
    take_step: int
    restitution: int
    kick: int


CALLS = NamedTupleType((types.int64,) * len(Calls._fields), Calls)
"""Numba's type of them."""

_evaluate = call_at(types.int64, types.int64, *EVALUATE)
_take_step = call_at(types.int64, types.int64, *TAKE_STEP)
_restitution = call_at(types.float64, types.int64, *RESTITUTION)
_kick = call_at(types.int64, types.int64, *KICK)


@register_jitable(**INLINED)
def evaluate(calls: Any, time: float, state: Any, slope: Any) -> None:
    """The equations of motion at a state, see ``slope.evaluate``; local time [s]."""
    _evaluate(calls.evaluate, (calls.context, time, state, slope))


@register_jitable(**INLINED)
def take_step(calls: Any, begin: float, length: float, state: Any) -> None:
    """One step of the scene's stepper into the workspace's ``trial``; local time [s]."""
    _take_step(calls.take_step, (calls.context, begin, length, state))


@register_jitable(**INLINED)
def restitution(calls: Any, approach: float) -> Any:
    """Speed at which two balls part per speed at which they have met [m/s]."""
    return _restitution(calls.restitution, (calls.context, approach))


@register_jitable(**INLINED)
def kick(calls: Any, state: Any, jumps: Any) -> None:
    """Add jumps of velocity, in the order of the accelerations, to the carrier's state."""
    _kick(calls.kick, (calls.context, state, jumps))
