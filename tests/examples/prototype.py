"""Firmware prototype, loaded from its folder, because it is no package but made for copying."""

import ctypes
import importlib.util
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

FOLDER = Path(__file__).parents[2] / "examples" / "firmware_prototype"


def _module(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


start_up: Any = _module("start_up")


def compiled(folder: Path) -> ctypes.CDLL:
    """Compile the decisions in C to a library."""
    library = folder / "start_up.so"
    flags = ("-std=c11", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-shared", "-fPIC")
    source = FOLDER / "c" / "start_up.c"
    subprocess.run(["cc", *flags, "-o", library, source, "-lm"], check=True)
    return ctypes.CDLL(str(library))


class InC:
    """``StartUp`` with the default settings, in C."""

    def __init__(self, library: ctypes.CDLL, say: Callable[[str], None]) -> None:
        number, self._library = ctypes.c_double, library
        library.start_up_tick.restype = number
        library.start_up_tick.argtypes = [ctypes.c_void_p, number]
        for name in ("start_up_spindle", "start_up_vibration"):
            getattr(library, name).argtypes = [ctypes.c_void_p, number, number, number]
        hear = ctypes.CFUNCTYPE(None, ctypes.c_char_p)
        self._say = hear(lambda line: say(line.decode()))  # kept: C has only its address
        self._self = ctypes.create_string_buffer(4096)
        defaults = ctypes.byref(number.in_dll(library, "default_settings"))
        library.start_up_init(self._self, defaults, self._say)

    def spindle(self, time: float, angle: float, speed: float) -> None:
        self._library.start_up_spindle(self._self, time, angle, speed)

    def vibration(self, time: float, x: float, y: float) -> None:
        self._library.start_up_vibration(self._self, time, x, y)

    def tick(self, passed: float) -> float:
        return self._library.start_up_tick(self._self, passed)

    def stop(self) -> None:
        self._library.start_up_stop(self._self)
