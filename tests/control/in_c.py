"""Start-up controller in C, with the interface of ``ab_sim.control.StartUp``."""

import ctypes
import subprocess
from pathlib import Path
from typing import Any

from ab_sim.control import StartUpSettings

SOURCE = Path(__file__).parents[2] / "examples" / "firmware_prototype" / "c" / "adaptive.c"
PICOLIBC = Path("/usr/lib/picolibc")
FLAGS = (
    *("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror"),
    "-Wdouble-promotion",  # slow on a board that computes in single precision
)


def compiled(folder: Path, real: str) -> ctypes.CDLL:
    """Compile the controller to a library; ``real`` is double or float."""
    library = folder / f"adaptive_{real}.so"
    flags = [*FLAGS, f"-DADAPTIVE_REAL={real}", "-shared", "-fPIC"]
    subprocess.run(["cc", *flags, "-o", library, SOURCE, "-lm"], check=True)
    return ctypes.CDLL(str(library))


class InC:
    """Start-up controller in C.

    Parameters
    ----------
    library
        Result of ``compiled``.
    real
        Floating-point type of the library.
    settings
        Settings as in Python.
    """

    def __init__(self, library: ctypes.CDLL, real: str, settings: StartUpSettings) -> None:
        number: Any = ctypes.c_double if real == "double" else ctypes.c_float
        sensing = settings.sensing

        class InSettings(ctypes.Structure):
            _fields_ = (
                *((name, number) for name in ("final_speed", "acceleration", "period")),
                *((name, ctypes.c_int) for name in ("quantity", "axes")),
                *((name, number) for name in ("axis_angle", "noise")),
                ("most_retries", ctypes.c_int),
                *((name, number) for name in ("patience", "silence", "limit")),
            )

        self._library = library
        library.adaptive_command.restype = number
        time = ctypes.c_double
        library.adaptive_command.argtypes = [ctypes.c_void_p, time]
        library.adaptive_abort.argtypes = [ctypes.c_void_p, time]
        library.adaptive_sample.argtypes = [ctypes.c_void_p, time, *[number] * 4]
        self._self = ctypes.create_string_buffer(16384)
        own = InSettings(
            settings.final_speed,
            settings.acceleration,
            settings.period,
            int(sensing.quantity == "acceleration"),
            sensing.axes,
            sensing.axis_angle,
            sensing.noise,
            settings.most_retries,
            settings.patience,
            settings.silence,
            settings.limit,
        )
        library.adaptive_init(self._self, ctypes.byref(own))

    def sample(
        self, time: float, angle: float, speed: float, first: float, second: float = 0.0
    ) -> None:
        self._library.adaptive_sample(self._self, time, angle, speed, first, second)

    def command(self, time: float) -> float:
        return float(self._library.adaptive_command(self._self, time))

    def abort(self, time: float) -> None:
        self._library.adaptive_abort(self._self, time)

    def state_numbers(self) -> tuple[float, ...]:
        numbers = (ctypes.c_double * 1024)()
        count = self._library.adaptive_numbers(self._self, numbers)
        return tuple(numbers[:count])

    def restore(self, numbers: tuple[float, ...]) -> None:
        self._library.adaptive_restore(self._self, (ctypes.c_double * 1024)(*numbers))
