"""What is compiled for the kernel cannot be called from Python: these can."""

import numba

from ab_sim.dynamics.planar import derivatives


@numba.njit(error_model="numpy")
def compiled_derivatives(system, place, time, state, modes, slope, scratch):  # type: ignore[no-untyped-def]
    """``derivatives``."""
    derivatives(system, place, time, state, modes, slope, scratch)
