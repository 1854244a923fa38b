"""How wide vectors may be in this process: AVX-512's if there are, or limited to AVX2.

``AB_SIM_CPU_FEATURES`` says so; all code of ours obeys it, and compilers are told. heyoka has no
such setting: a batch of four fills vectors of AVX2, but in registers and encodings of AVX-512 where
there are some, which is in its favour.
"""

import os
from pathlib import Path

from ab_sim.tracing.machine_code import LIMIT

NO_AVX512 = "-avx512f"


def limit() -> None:
    """To AVX2, from now on."""
    os.environ[LIMIT] = NO_AVX512


def is_limited() -> bool:
    """To AVX2."""
    return NO_AVX512 in os.environ.get(LIMIT, "").split(",")


def lanes() -> int:
    """Doubles in a vector."""
    return 4 if is_limited() or not has_avx512() else 8


def has_avx512() -> bool:
    """Whether the processor does."""
    try:
        return "avx512f" in Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return False


def vectors() -> str:
    """For a report."""
    return "AVX-512" if lanes() == 8 else "AVX2"


def for_compilers() -> tuple[str, ...]:
    """GCC's options."""
    return ("-march=native", "-mno-avx512f") if is_limited() else ("-march=native",)
