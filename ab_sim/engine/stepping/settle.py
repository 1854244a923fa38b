"""Emit the code that accepts the results of a step of eight runs and removes whole turns."""

import math
from collections.abc import Sequence
from functools import partial

from ab_sim.engine.kernels.code import Code
from ab_sim.engine.stepping.fixed_step import DRIFT, TWO_PI_REST
from ab_sim.model.dynamics.layout import StateLayout
from ab_sim.tracing import Expression, Graph, sqrt, where
from ab_sim.tracing.llvm_text import Body, Function, MemorySlot, Shape, module_text

SOUND, MOVED = 0, 1
"""Lines of ``said``. SOUND: 1 while a run is within its bounds, else 0. MOVED: 1 if removing turns
or normalising a quaternion has changed its state, else 0."""


def settle_address(code: Code, layout: StateLayout, quaternion: int, lanes: int) -> int:
    """Return the address of ``settle(t, y, trial, bounds, turns, said)``, in lanes.

    The function does for each lane what ``fixed_step.unwind`` and ``location.within_bounds`` do for
    one run. The length of each run's step follows t; a run with length 0 keeps its state. ``turns``
    has a line for each ball, and one for the spindle if a motor drives it; ``said`` has the lines
    above.

    Args:
        code: machine code of the kind of scene, which caches the function.
        layout: layout of the state.
        quaternion: index of a spatial deck's quaternion in the state; -1 without one.
        lanes: number of runs side by side.
    """
    return code.made("settle", "settle", partial(_text, layout, quaternion, lanes))


def _text(layout: StateLayout, quaternion: int, lanes: int) -> str:
    graph, size = Graph(), layout.size
    pointers = ["t", "y", "trial", "bounds", "turns", "said"]
    into = Function("settle", pointers, Shape(0, lanes))
    names = {"length": MemorySlot("t", 0), "sound": MemorySlot("said", SOUND)}
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
    places += [MemorySlot("said", SOUND), MemorySlot("said", MOVED)]
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
    """Return the turn in an angle, at most one per step, and the rest.

    The arithmetic is that of ``fixed_step.take_out_turns``.
    """
    turn = where(abs(angle) > 2.0 * math.pi, where(angle > 0.0, 1.0, -1.0), 0.0)
    return turn, (angle - turn * (2.0 * math.pi)) - turn * TWO_PI_REST
