"""What is compiled for the kernel cannot be called from Python: these can."""

import numba
from ab_sim.dynamics.planar import derivatives
from ab_sim.dynamics.pools import pool


@numba.njit(error_model="numpy")
def compiled_derivatives(system, place, time, state, modes, slope, scratch):  # type: ignore[no-untyped-def]
    """``derivatives``."""
    derivatives(system, place, time, state, modes, slope, scratch)


@numba.njit(error_model="numpy")
def compiled_pool(system, modes, scratch, pools):  # type: ignore[no-untyped-def]
    """``pool``."""
    return pool(system, modes, scratch, pools)
