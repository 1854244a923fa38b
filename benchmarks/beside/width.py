"""How wide vectors may be in this process: AB_SIM_CPU_FEATURES says so, of our code too."""

import os

FEATURES = "AB_SIM_CPU_FEATURES"


def is_limited() -> bool:
    """To AVX2."""
    return "-avx512f" in os.environ.get(FEATURES, "").split(",")
