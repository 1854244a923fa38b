"""The thesis' drive in C (c_kernel/thesis.c), compiled for a number of balls and a tableau."""

import ctypes
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from beside.width import for_compilers

from ab_sim.engine.kernels.runge_kutta import Tableau

SOURCE = Path(__file__).with_name("c_kernel") / "thesis.c"
FLAGS = ("-O3",)


class CDrive(ctypes.Structure):
    """``struct drive`` of equations.h."""

    _fields_ = [
        (name, ctypes.c_double)
        for name in (
            "total_mass unbalance race_radius stiffness damping drag start_speed slope mass radius"
        ).split()
    ]


def compiler() -> str:
    """Return the name and version of gcc.

    Raises
    ------
    SystemExit
        Gcc is missing.
    """
    gcc = shutil.which("gcc")
    if gcc is None:
        sys.exit("gcc: not found; the C kernel is built with it (apt install gcc)")
    first = subprocess.run([gcc, "--version"], capture_output=True, text=True, check=True).stdout
    return f"{first.splitlines()[0]}, {' '.join([*FLAGS, *for_compilers()])}"


def build(tableau: Tableau, balls: int) -> ctypes.CDLL:
    """Compile the shared library for a tableau and a number of balls."""
    folder = Path(tempfile.mkdtemp(prefix="c_kernel-"))
    a, b, c = tableau
    s = b.size

    def numbers(values: np.ndarray) -> str:
        return "{" + ", ".join(float(value).hex() for value in values) + "}"

    lines = [
        f"#define STAGES {s}",
        f"static const double A_[{s}][{s}] = {{{', '.join(numbers(row) for row in a)}}};",
        f"static const double B_[{s}] = {numbers(b)};",
        f"static const double C_[{s}] = {numbers(c)};",
    ]
    (folder / "tableau.h").write_text("\n".join(lines) + "\n")
    library = folder / "thesis.so"
    options = [*FLAGS, *for_compilers(), f"-DBALLS={balls}", f"-I{folder}", "-shared", "-fPIC"]
    subprocess.run(["gcc", *options, str(SOURCE), "-o", str(library), "-lm"], check=True)
    loaded = ctypes.CDLL(str(library))
    pointer, number = ctypes.POINTER(ctypes.c_double), ctypes.c_double
    loaded.advance.argtypes = [
        ctypes.POINTER(CDrive), number, number, ctypes.c_long, pointer, pointer
    ]  # fmt: skip
    loaded.advance.restype = None
    return loaded
