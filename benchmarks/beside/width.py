"""Width of vectors in this process: that of AVX-512 if available, or limited to AVX2.

``AB_SIM_CPU_FEATURES`` sets it for the package's code, and compilers get options. heyoka has no
such setting: a batch of four fills vectors of AVX2, but with the registers and encodings of AVX-512
if available, which is to its advantage.
"""

import os
from pathlib import Path

from ab_sim.tracing.machine_code import LIMIT

NO_AVX512 = "-avx512f"


def limit() -> None:
    """Limit vectors to AVX2 from now on."""
    os.environ[LIMIT] = NO_AVX512


def is_limited() -> bool:
    """Return whether vectors are limited to AVX2."""
    return NO_AVX512 in os.environ.get(LIMIT, "").split(",")


def lanes() -> int:
    """Return the number of doubles in a vector."""
    return 4 if is_limited() or not has_avx512() else 8


def has_avx512() -> bool:
    """Return whether the processor has AVX-512."""
    try:
        return "avx512f" in Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return False


def vectors() -> str:
    """Return the vectors' width as text for a report."""
    return "AVX-512" if lanes() == 8 else "AVX2"


def for_compilers() -> tuple[str, ...]:
    """Return GCC's options."""
    return ("-march=native", "-mno-avx512f") if is_limited() else ("-march=native",)
