"""The exact Jacobian of the equations of motion, by dual numbers, within a kernel."""

import numba

from ab_sim.dynamics.dispatch import APART
from ab_sim.dynamics.numbers.duals import PARTIALS, dual, partial_of
from ab_sim.dynamics.slope import evaluate
from ab_sim.dynamics.system import Plant, ball_count
from ab_sim.integrate.on_stack import own_array, own_room


@numba.njit(**APART)
def jacobian(plant, time, state, out):  # type: ignore[no-untyped-def]
    """Partial derivatives of ``evaluate``'s slope by each state: ``evaluate`` itself with duals.

    Exact but for rounding; in the branches of set-valued laws that are in force. It takes as many
    evaluations as there are sevens of states, begun ones included.

    Args:
        plant: the Plant; its room is not written to.
        time: local time in its speed segment [s].
        state: the state.
        out: where d f_i / d y_j goes, shape (states, states).
    """
    system, number, states = plant.system, dual(0.0, 0), state.size
    at, slope = own_array(number, (states,)), own_array(number, (states,))
    own = Plant(system, plant.place, plant.modes, own_room(system, ball_count(system), number))
    for first in range(0, states, PARTIALS):
        count = min(PARTIALS, states - first)
        for j in range(states):
            at[j] = state[j]
        for k in range(count):
            at[first + k] = dual(state[first + k], k)
        evaluate(own, time, at, slope)
        for i in range(states):
            for k in range(count):
                out[i, first + k] = partial_of(slope[i], k)


@numba.njit(**APART)
def time_derivative(plant, time, state, out):  # type: ignore[no-untyped-def]
    """Partial derivative of ``evaluate``'s slope by time, exact as the ``jacobian``.

    Args:
        plant, time, state: as of ``jacobian``.
        out: where d f_i / d t goes, shape (states,).
    """
    system, number = plant.system, dual(0.0, 0)
    slope = own_array(number, (state.size,))
    own = Plant(system, plant.place, plant.modes, own_room(system, ball_count(system), number))
    evaluate(own, dual(time, 0), state, slope)
    for i in range(state.size):
        out[i] = partial_of(slope[i], 0)
