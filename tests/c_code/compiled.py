"""Drive in C, compiled and called from Python."""

import ctypes
import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from ab_sim.export.c_code.sources import sources_of
from ab_sim.scene import Scene

GLUE = """
#include "drive.h"
#include <stddef.h>
size_t drive_size(void) { return sizeof(struct drive); }
double *drive_given(struct drive *d, size_t at) { return (double *)((char *)d + at); }
const double *drive_state(const struct drive *d) { return d->y; }
const double *drive_seen(const struct drive *d) { return (const double *)&d->out; }
size_t drive_number_seen(void) { return sizeof(struct drive_outputs) / sizeof(double); }
"""
STRICT = ("-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off")
OK, REFUSED, DIVERGED = range(3)

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler, cc")


@cache
def compiled(sources: tuple[tuple[str, str], ...], *flags: str) -> ctypes.CDLL:
    """Compile a drive's files as C99 without warnings, once for all tests; return the library."""
    with TemporaryDirectory() as folder:
        for name, text in (*sources, ("glue.c", GLUE)):
            Path(folder, name).write_text(text, encoding="utf-8")
        words = ["cc", *(flags or STRICT), "-shared", "-fPIC", "drive.c", "glue.c"]
        made = subprocess.run(
            [*words, "-o", "drive.so", "-lm"], cwd=folder, capture_output=True, text=True
        )
        assert made.returncode == 0, made.stderr
        return ctypes.CDLL(f"{folder}/drive.so")


class InC:
    """Drive in C that follows its profile until commanded."""

    def __init__(self, scene: Scene, *flags: str) -> None:
        self.sources = sources_of(scene)
        self.library = library = compiled(tuple(self.sources.files.items()), *flags)
        number, pointer = ctypes.c_double, ctypes.POINTER(ctypes.c_double)
        library.drive_command_ramp.argtypes = [ctypes.c_void_p, number, number]
        library.drive_command.argtypes = [ctypes.c_void_p, number]
        library.drive_step.argtypes = [ctypes.c_void_p, ctypes.c_long]
        library.drive_given.restype = library.drive_state.restype = pointer
        library.drive_given.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
        library.drive_seen.restype = pointer
        for name in ("drive_size", "drive_number_seen"):
            getattr(library, name).restype = ctypes.c_size_t
        library.drive_whirl.restype = library.drive_time.restype = number
        self.me = ctypes.create_string_buffer(library.drive_size())
        self._balls, self._deck = scene.balls.count, len(self.sources.channels)
        self.call("init")
        self.call("follow_profile")

    def call(self, name: str, *numbers: float) -> int:
        """Call a function of drive.h and return its result."""
        found: int = getattr(self.library, f"drive_{name}")(self.me, *numbers)
        return found

    def state(self, size: int) -> np.ndarray:
        """Return the state y."""
        return np.array(self.library.drive_state(self.me)[:size])

    def row(self) -> np.ndarray:
        """Return outputs in the order of ``Trajectory``'s columns, from the spindle angle on."""
        seen = np.array(self.library.drive_seen(self.me)[: self.library.drive_number_seen()])
        first, n = 3 + self._deck, self._balls
        balls = seen[first : first + 2 * n].reshape(2, n).T.ravel()
        return np.concatenate([seen[:first], balls, seen[first + 2 * n :]])

    def rows(self, steps: int) -> np.ndarray:
        """Return the outputs after each of a number of steps."""
        found = []
        for _ in range(steps):
            assert self.call("step", 1) == OK
            found.append(self.row())
        return np.array(found)

    def set(self, place: str, value: float) -> None:
        """Set a parameter by its member in C."""
        at = 0
        for each in self.sources.parameters:
            for name, _, _ in each.places:
                if name == place:
                    self.library.drive_given(self.me, at)[0] = value
                    return
                at += 8
        raise KeyError(place)
