"""Many runs at once: `simulate_batch`."""

from ab_sim.design.batch.prepared_run import BatchRun
from ab_sim.design.batch.simulate import Batch, simulate_batch

__all__ = ["Batch", "BatchRun", "simulate_batch"]
