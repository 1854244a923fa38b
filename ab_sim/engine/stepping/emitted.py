"""Emitted code for steps of eight runs: acceptance of results, and a test for possible events.

``events.event_functions`` and ``events.location`` define events. Between both ends of a step, a
force or a speed is bounded from below by the Bezier ordinates of the cubic through its values and
rates there. This needs no branch. Rates of forces are difference quotients. The emitted test, for
scenes without ball contact, is conservative: if it rules out an event, the driver of a single run
would find none either. Margins cover the difference in rounding.
"""

import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

from ab_sim.engine.events.event_functions import NEVER
from ab_sim.engine.events.location import DOUBT, NEAR, SHORTLY
from ab_sim.engine.events.run import COMMANDED, GRIP, MOST, NORMAL, PULL, SIZE
from ab_sim.engine.kernels.code import Code
from ab_sim.engine.kernels.emission import Emission
from ab_sim.engine.stepping.fixed_step import DRIFT, TWO_PI_REST
from ab_sim.model.dynamics.system import StateLayout
from ab_sim.tracing import Expression, Graph, Level, sqrt, total, where
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, module_text

SOUND, MOVED = 0, 1
"""Lines of ``status``. SOUND: 1 while a run is within its bounds, else 0. MOVED: 1 if the removal
of turns or the normalisation of a quaternion has changed its state, else 0."""


def settle_address(code: Code, layout: StateLayout, quaternion: int, lanes: int) -> int:
    """Return the address of ``settle(t, y, trial, bounds, turns, status)``, in lanes.

    The function does for each lane what ``fixed_step.unwind`` and ``location.within_bounds`` do for
    one run. The length of each run's step follows t; a run with length 0 keeps its state. ``turns``
    has a line for each ball, and one for the spindle if a motor drives it; ``status`` has the lines
    ``SOUND`` and ``MOVED``.

    Parameters
    ----------
    code
        Machine code of the kind of scene, which caches the function.
    layout
        Layout of the state.
    quaternion
        Index of a spatial deck's quaternion in the state; -1 without one.
    lanes
        Number of runs side by side.
    """
    return code.made("settle", "settle", partial(_settle_text, layout, quaternion, lanes))


def _settle_text(layout: StateLayout, quaternion: int, lanes: int) -> str:
    """Return the LLVM IR of ``settle``; the arguments are those of ``settle_address``."""
    graph, size = Graph(), layout.size
    pointers = ["t", "y", "trial", "bounds", "turns", "status"]
    into = Function("settle", pointers, Shape(0, lanes))
    names = {"length": MemorySlot("t", 0), "sound": MemorySlot("status", SOUND)}
    angles = [*range(size)[layout.angles], *range(size)[layout.spindle][:1]]
    for pointer in ("y", "trial", "bounds"):
        names |= {f"{pointer}[{j}]": MemorySlot(pointer, j) for j in range(size)}
    names |= {f"turns[{k}]": MemorySlot("turns", k) for k in range(len(angles))}
    body, input_ = Body(into, names), graph.input

    def all_of(pointer: str) -> list[Expression]:
        return [input_(f"{pointer}[{j}]") for j in range(size)]

    taken, trial = input_("length") > 0.0, all_of("trial")
    sound, moved = input_("sound"), graph.constant(0.0)
    for value, bound in zip(trial, all_of("bounds"), strict=True):
        sound = where(abs(value) < bound, sound, 0.0)
    after = [where(taken, new, old) for new, old in zip(trial, all_of("y"), strict=True)]
    if quaternion >= 0:
        unit = slice(quaternion, quaternion + 4)
        after[unit], moved = normalised(after[unit])
    turns = []
    for k, j in enumerate(angles):
        turn, after[j] = unwound(after[j])
        turns.append(input_(f"turns[{k}]") + turn)
        moved = where(abs(turn) > 0.0, 1.0, moved)
    # All values are read before any is written: outputs may overwrite inputs.
    results = [*after, *turns, where(taken, sound, input_("sound")), moved]
    places = [MemorySlot("y", j) for j in range(size)]
    places += [MemorySlot("turns", k) for k in range(len(angles))]
    places += [MemorySlot("status", SOUND), MemorySlot("status", MOVED)]
    for result in results:
        body.values(result)
    for result, place in zip(results, places, strict=True):
        body.store(result, place)
    return module_text([into])


def normalised(unit: Sequence[Expression]) -> tuple[list[Expression], Expression]:
    """Return the quaternion, normalised as in ``fixed_step.normalise``, and 1 where it changed."""
    square = unit[0] * unit[0]
    for q in unit[1:]:
        square = square + q * q
    near = abs(square - 1.0) <= DRIFT
    scale = 1.0 / sqrt(square)
    return [where(near, q, q * scale) for q in unit], where(near, 0.0, 1.0)


def unwound(angle: Expression) -> tuple[Expression, Expression]:
    """Return the whole turn (-1, 0 or 1) in an angle after a step, and the angle without this turn.

    The arithmetic is that of ``fixed_step.take_out_turns``.
    """
    turn = where(abs(angle) > 2.0 * math.pi, where(angle > 0.0, 1.0, -1.0), 0.0)
    return turn, (angle - turn * (2.0 * math.pi)) - turn * TWO_PI_REST


_SURE = 1e-6
"""Margin far above rounding, as a fraction of the forces in an event function, or of a speed."""
_NUMBERS_PER_BALL, _NUMBERS_OF_MOTOR = 8, 4
"""Numbers kept between steps: value and change of each event function that is tested."""


def event_test_address(code: Code, lanes: int) -> int:
    """Return the address of ``event_test(c, b, t, y, k, seen, suspected)``, in lanes.

    The state y is that of a step's end. The length of each run's step and the time at its end
    follow t. The function fills in the slope k, and ``suspected`` with a number for each run, 0.0
    if the step cannot contain an event. ``seen`` must hold the values from the step's start and is
    overwritten: see ``size_of_seen``.

    Parameters
    ----------
    code
        Machine code of the kind of scene, which caches the function.
    lanes
        Number of runs side by side.
    """
    return code.made("event_test", "event_test", partial(_event_test_text, code.emission, lanes))


def size_of_seen(code: Code) -> int:
    """Return the count of numbers that ``event_test`` keeps of each run between steps."""
    return _NUMBERS_PER_BALL * code.model.count + _NUMBERS_OF_MOTOR


class _Function(NamedTuple):
    """Event function that is a force: see ``events.event_functions``."""

    value: Expression
    size: Expression
    """Magnitude of the forces in ``value``, which bounds the rounding error of ``value``."""


def _event_test_text(emission: Emission, lanes: int) -> str:
    """Return the LLVM IR of ``event_test``.

    ``body`` evaluates the forces at the step's end, ``near`` a moment later. The values and changes
    are compared with those of the step's start in ``seen``, which they then replace.
    """
    into, body = emission.function(
        "event_test", ["y", "k", "seen", "suspected"], ["length", "time"], state="y", lanes=lanes
    )
    emission.store_slope(body, emission.roots["slope"], "k")
    forces, sliding = _forces(emission), _sliding(emission)
    near = Body(into, emission.places, emission.derived_slots, _shortly_after(emission, body))
    taken = emission.model.graph.input("length", Level.TIME)
    judged, inputs = Graph(), {"length": body.values(taken)}
    places: dict[str, MemorySlot] = {}
    kept: list[tuple[Expression, MemorySlot]] = []
    doubts: list[Expression] = []
    at = 0

    def number(name: str, by_ball: bool, values: list[str]) -> Expression:
        inputs[name] = values
        return judged.input(name, per_ball=by_ball)

    def remembered(name: str, by_ball: bool, now: Expression) -> Expression:
        nonlocal at
        places[name] = MemorySlot("seen", at)
        kept.append((now, places[name]))
        at += emission.model.count if by_ball else 1
        return judged.input(name, per_ball=by_ball)

    length = judged.input("length")
    for k, force in enumerate(forces):
        by_ball = force.value.each

        def of(body: Body, x: Expression, by_ball: bool = by_ball) -> list[str]:
            return body.each(x) if by_ball else body.values(x)

        value = number(f"value {k}", by_ball, of(body, force.value))
        size = number(f"size {k}", by_ball, of(body, force.size))
        shortly = number(f"near {k}", by_ball, of(near, force.value))
        change = (shortly - value) / SHORTLY
        before = remembered(f"value before {k}", by_ball, value)
        change_before = remembered(f"change before {k}", by_ball, change)
        doubts.append(_doubt_of_force(before, change_before, value, change, size))
    if sliding is not None:
        speed, rate = (number(f"slide {k}", True, body.each(x)) for k, x in enumerate(sliding))
        before = remembered("slide before", True, speed)
        rate_before = remembered("rate before", True, rate)
        doubts.append(_doubt_of_speed(before, rate_before * length, speed, rate * length))
    summed = judged.constant(0.0)
    for doubt in doubts:
        summed = summed + (total(doubt) if doubt.each else doubt)
    judge = Body(into, places, bound=inputs)
    # All values are read before any is written: outputs may overwrite inputs.
    for x in (summed, *(now for now, _ in kept)):
        judge.values(x)
    for now, place in kept:
        judge.store(now, place)
    judge.store(summed, MemorySlot("suspected", 0))
    return module_text([into])


def _shortly_after(emission: Emission, body: Body) -> dict[str, list[str]]:
    """Return the inputs a moment later, for difference quotients of forces.

    ``location.put_force_rates`` uses the same ones for a single run.
    """
    model, slope = emission.model, emission.roots["slope"]
    input_ = model.graph.input
    shortly = SHORTLY * input_("length", Level.TIME)
    moment_later = {"time": body.values(input_("time", Level.TIME) + shortly)}
    for state, change in zip(model.state_inputs(), slope, strict=True):
        if model.count or not state.each:
            later = state + shortly * change
            moment_later[state.payload] = body.each(later) if state.each else body.values(later)
    return moment_later


def _forces(emission: Emission) -> list[_Function]:
    """Return the event functions that are forces.

    They are a ball's normal force, a sticking ball's friction reserve either way, and a motor's
    torque reserve.
    """
    model, table = emission.model, emission.roots["table"]
    functions: list[_Function] = []
    if model.has_friction and model.count:
        normal, pull, size = table[NORMAL], table[PULL], table[SIZE]
        grip = table[GRIP] * where(normal > 0.0, normal, 0.0)
        sign, sticks = _sign(emission), _sticks(emission)
        load = where(sticks, normal, where(abs(sign) > 0.0, normal, -normal))
        functions += [
            _Function(load, size),
            _Function(where(sticks, grip + pull, NEVER), size),
            _Function(where(sticks, grip - pull, NEVER), size),
        ]
    if model.has_motor:
        commanded, most = (emission.roots["motor"][k] for k in (COMMANDED, MOST))
        limit = model.graph.input("limit", Level.TIME)
        free, size = abs(limit) <= 0.0, most + abs(commanded)
        functions += [
            _Function(where(free, most + commanded, limit * commanded - most), size),
            _Function(where(free, most - commanded, NEVER), size),
        ]
    return functions


def _sliding(emission: Emission) -> tuple[Expression, Expression] | None:
    """Return each ball's speed in the direction of sliding, and the rate of this speed."""
    model = emission.model
    if not (model.has_friction and model.count):
        return None
    sign, rate = _sign(emission), model.graph.input("rate", per_ball=True)
    change = emission.roots["slope"][model.states + 1]
    slides = abs(sign) > 0.0
    return where(slides, sign * rate, NEVER), where(slides, sign * change, 0.0)


def _sign(emission: Emission) -> Expression:
    """Return the direction in which each ball slides; 0 if it sticks or is not loaded."""
    return emission.model.graph.input("sign", Level.TIME, per_ball=True)


def _sticks(emission: Emission) -> Expression:
    """Return whether each ball sticks; its mobility is then 0."""
    return emission.model.graph.input("mobility_now", Level.TIME, per_ball=True) <= 0.0


def _doubt_of_force(
    g0: Expression, r0: Expression, g1: Expression, r1: Expression, size: Expression
) -> Expression:
    """Return 1.0 where a force may become negative within a step, else 0.0.

    The bound follows from values and changes at both ends of the step.

    Parameters
    ----------
    g0, g1
        Values at the start and at the end [N or N m].
    r0, r1
        Rates there times the length of the step.
    size
        Magnitude of the terms of the force, to which its rounding error is relative.
    """
    sure = _SURE * size
    varies = abs(r0) + abs(r1)
    doubt = where(varies < DOUBT * size, varies, DOUBT * size) + sure
    low = where(_hull(g0, r0, g1, r1) > doubt, 0.0, 1.0)
    dips = where(r0 < sure, where(r1 > -sure, low, 0.0), 0.0)
    is_far = _least(g0, g1) > (1.0 + _SURE) * NEAR * size
    # A force negative at the end, or NaN, always counts: the comparison is false for NaN. Far from
    # zero there is no event for any changes.
    return where(g1 >= 0.0, where(is_far, 0.0, dips), 1.0)


def _doubt_of_speed(g0: Expression, r0: Expression, g1: Expression, r1: Expression) -> Expression:
    """Return 1.0 where a speed may become negative within a step, else 0.0.

    The arguments are those of ``_doubt_of_force``; a speed's rate is exact.
    """
    sure = _SURE * (abs(r0) + abs(r1) + _least(abs(g0), abs(g1)))
    low = where(_hull(g0, r0, g1, r1) > sure, 0.0, 1.0)
    dips = where(r0 < 0.0, where(r1 > 0.0, low, 0.0), 0.0)
    return where(g1 > 0.0, dips, 1.0)


def _hull(g0: Expression, r0: Expression, g1: Expression, r1: Expression) -> Expression:
    """Return a lower bound within a step of the cubic with given values and changes at both ends.

    A cubic lies within the convex hull of its four Bezier ordinates.
    """
    ends = _least(g0, g1)
    return _least(ends, _least(g0 + r0 / 3.0, g1 - r1 / 3.0))


def _least(a: Expression, b: Expression) -> Expression:
    return where(a < b, a, b)
