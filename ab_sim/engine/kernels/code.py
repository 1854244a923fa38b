"""All functions of a kind of scene as machine code, each compiled when it is first requested."""

import ctypes
import functools
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
from ab_sim.engine.kernels.emission import Emission
from ab_sim.engine.kernels.model import Model
from ab_sim.engine.kernels.runge_kutta import Extrapolation, Tableau, step_text
from ab_sim.model.dynamics.system import System
from ab_sim.tracing.llvm_text import Function, module_text
from ab_sim.tracing.machine_code import MachineCode

Other = TypeVar("Other")


class Code:
    """Machine code of a kind of scene.

    Args:
        system: any system of this kind.
        segment: class of its profile's segments.
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
        """Return the address of a function in LLVM IR, which is compiled if necessary."""
        with self._lock:
            if key not in self._made:
                code = MachineCode(text())
                self._made[key] = code.address(name), code
            return self._made[key][0]

    def other(self, key: Any, make: Callable[[], Other]) -> Other:
        """Return another object derived from the equations, cached as long as this code lives.

        Args:
            key: key of the object in the cache.
            make: function that creates the object; it may request functions of this code, as
                these have another lock.
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
    """Return the code of a system's kind, the same object for systems that differ in numbers only.

    The ``KINDS`` most recently used are cached. An address is valid only as long as its ``Code``
    exists, so keep a reference to it.
    """
    key = pattern(system), len(system.balls), bool(system.energy_balance), segment
    with _lock:
        if key not in _codes:
            _codes[key] = Code(system, segment)
            if len(_codes) > KINDS:
                _codes.popitem(last=False)
        _codes.move_to_end(key)
        return _codes[key]


@functools.cache
def caller(pointers: int, numbers: int) -> Any:
    """Return the ctypes type of a function with these numbers of pointers and doubles."""
    kinds = [ctypes.c_void_p] * pointers + [ctypes.c_double] * numbers
    return ctypes.CFUNCTYPE(None, *kinds)


def called(address: int, *arguments: np.ndarray | float) -> None:
    """Call emitted code from Python: arrays first, then numbers."""
    arrays = [x for x in arguments if isinstance(x, np.ndarray)]
    numbers = [x for x in arguments if not isinstance(x, np.ndarray)]
    caller(len(arrays), len(numbers))(address)(*[x.ctypes.data for x in arrays], *numbers)
