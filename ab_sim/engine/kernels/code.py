"""All functions of a kind of scene as machine code, each compiled when it is first requested."""

import ctypes
import functools
import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from ab_sim.engine.compiling.kinds import aligned
from ab_sim.engine.kernels.constants import (
    ConstantsLayout,
    layout_of_constants,
    numbers_of,
    pattern,
)
from ab_sim.engine.kernels.emission import BRANCHES, CONSTANTS, TIMES, Emission
from ab_sim.engine.kernels.model import OF_EACH_BALL, Model
from ab_sim.engine.kernels.runge_kutta import Extrapolation, Tableau, step_text
from ab_sim.model.dynamics.system import System
from ab_sim.tracing import Expression, Level, derivatives
from ab_sim.tracing.llvm_text import Function, MemorySlot, module_text
from ab_sim.tracing.machine_code import LIMIT, MachineCode

Other = TypeVar("Other")


class Code:
    """Machine code of a kind of scene.

    Parameters
    ----------
    system
        Any system of this kind.
    segment
        Class of its profile's segments.
    """

    def __init__(self, system: System, segment: type[Any]) -> None:
        self.layout: ConstantsLayout = layout_of_constants(system, segment)
        self.model = Model(system, segment)
        self.emission = Emission(self.model, self.layout, segment._fields)
        self.size = self.emission.size
        self._made: dict[Any, tuple[int, MachineCode]] = {}
        self._others: dict[Any, Any] = {}
        self._lock, self._others_lock = threading.Lock(), threading.Lock()

    def branches(self) -> int:
        """Return the length of the array that selects branches of set-valued laws.

        It holds a sign of friction per ball, the mobility (a matrix with contact, else a number
        per ball), and the direction in which the motor is at its limit.
        """
        n = self.model.count
        return n + n * (n if self.model.has_contact else 1) + 1

    def address(self, name: str, lanes: int = 1) -> int:
        """Return the address of the function that ``Emission`` emits in the method ``name``."""
        emit: Callable[..., Function] = getattr(self.emission, name)

        def text() -> str:
            return module_text([emit(lanes) if lanes > 1 else emit()])

        return self.made((name, lanes), name, text)

    def step(self, method: Tableau | Extrapolation, lanes: int = 1, parts: int = 1) -> int:
        """Return the address of a method's step (``runge_kutta.step_text``)."""
        key = *(np.asarray(table).tobytes() for table in method), lanes, parts
        return self.made(key, "step", lambda: step_text(self.emission, method, lanes, parts))

    def made(self, key: Any, name: str, text: Callable[[], str]) -> int:
        """Return the address of a function, which is compiled when it is first requested.

        Parameters
        ----------
        key
            Key of the function in the cache.
        name
            Name of the function in the text.
        text
            Function that returns the LLVM IR.
        """
        with self._lock:
            if key not in self._made:
                code = MachineCode(text())
                self._made[key] = code.address(name), code
            return self._made[key][0]

    def other(self, key: Any, make: Callable[[], Other]) -> Other:
        """Return another object derived from the equations, cached as long as this code lives.

        Parameters
        ----------
        key
            Key of the object in the cache.
        make
            Function that creates the object; it may request functions of this code, as these have
            another lock.
        """
        with self._others_lock:
            if key not in self._others:
                self._others[key] = make()
            other: Other = self._others[key]
            return other

    def constants(self, system: System) -> np.ndarray:
        """Return the aligned constants of a system; its place on the profile is all zeros."""
        constants = aligned((self.size,))
        constants[: self.layout.place] = numbers_of(system)
        return constants

    def put_place(self, constants: np.ndarray, numbers: Sequence[float]) -> None:
        """Set the segment of the speed schedule: its law's numbers, phase, end and angle.

        Constants that depend on them are computed again.
        """
        constants[self.layout.place : self.layout.place + len(numbers)] = numbers
        called(self.address("prepare"), constants)


KINDS = 16
"""Kinds of scenes whose code is cached; each takes 0.7 MB."""
_codes: OrderedDict[Any, Code] = OrderedDict()
"""Cached code, the most recently used last."""
_lock = threading.Lock()


def code_of(system: System, segment: type[Any]) -> Code:
    """Return the code for a system; systems that differ in numbers only share one object.

    The environment variable ``LIMIT`` is part of the kind. The ``KINDS`` most recently used are
    cached. An address is valid only as long as its ``Code`` exists, so keep a reference to it.
    """
    kind = pattern(system), len(system.balls), bool(system.energy_balance), segment
    key = *kind, os.environ.get(LIMIT)
    with _lock:
        if key not in _codes:
            _codes[key] = Code(system, segment)
        _codes.move_to_end(key)
        while len(_codes) > KINDS:
            _codes.popitem(last=False)
        return _codes[key]


@functools.cache
def caller(pointers: int, numbers: int) -> Any:
    """Return the ctypes type of functions with ``pointers`` pointers and ``numbers`` doubles."""
    kinds = [ctypes.c_void_p] * pointers + [ctypes.c_double] * numbers
    return ctypes.CFUNCTYPE(None, *kinds)


def called(address: int, *arguments: np.ndarray | float) -> None:
    """Call emitted code from Python: arrays first, then numbers."""
    arrays = [x for x in arguments if isinstance(x, np.ndarray)]
    numbers = [x for x in arguments if not isinstance(x, np.ndarray)]
    caller(len(arrays), len(numbers))(address)(*[x.ctypes.data for x in arrays], *numbers)


_FEW = 8
"""Maximum number of balls for directions in lanes; with more, vectors are formed of the balls."""
LANES = 8
"""Number of directions in lanes."""
DIRECTION = "d"
"""Name of the pointer to the changes of state, time and time on the profile, in this order."""


def lanes_for(balls: int) -> int:
    """Return the number of directions that are computed together."""
    return LANES if balls <= _FEW else 1


def tangent_address(code: Code) -> int:
    """Return the address of ``tangent(c, b, t, y, d, out)``, the slope's derivative along d.

    d holds a direction in the states, followed by the changes of the times; the constants and the
    branches of set-valued laws do not change. The derivative is written to out. y and the times at
    t are the same for all directions.
    """

    def text() -> str:
        return module_text([_tangent_function(code)])

    return code.made("tangent", "tangent", text)


def _tangent_function(code: Code) -> Function:
    """Emit the function ``tangent``; see ``tangent_address``."""
    emission, model = code.emission, code.model
    along, places = _directions(code)
    at = model.motion()
    slope = model.slope(at, model.evaluated(at))
    changes = emission.lowered({"tangent": derivatives(slope, along)})["tangent"]
    into, body = emission.function(
        "tangent",
        ["y", DIRECTION, "out"],
        ["time", "profile_time"],
        state="y",
        lanes=lanes_for(model.count),
        uniform=[CONSTANTS, BRANCHES, TIMES, "y"],
        times=True,
    )
    body.places.update(places)
    emission.store_slope(body, changes, "out")
    return into


def _directions(code: Code) -> tuple[dict[Expression, Expression], dict[str, MemorySlot]]:
    """Return the change of each input, for ``derivatives``, and the positions of the changes."""
    emission = code.emission
    graph, states = code.model.graph, emission.states
    of_states = emission.state_places(DIRECTION)
    of_times = {
        "time": MemorySlot(DIRECTION, states),
        "profile_time": MemorySlot(DIRECTION, states + 1),
    }
    along: dict[Expression, Expression] = {}
    for names, level in ((of_states, Level.STATE), (of_times, Level.TIME)):
        for name in names:
            many = name in OF_EACH_BALL
            along[graph.input(name, level, per_ball=many)] = graph.input(f"d {name}", per_ball=many)
    return along, {f"d {name}": place for name, place in (of_states | of_times).items()}
