"""A run has the same bits whatever the processor can do, and however runs are grouped.

Machine code made with the processor limited to vectors of four or two numbers, in a process of its
own, is compared byte by byte with this process' code for all it can do (vectors of eight). Without
fused multiply-add in hardware, the C library computes it.
"""

import hashlib
import json
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from ab_sim.design.batch import simulate_batch
from ab_sim.drive import Drive
from ab_sim.scene import load_scene

pytestmark = pytest.mark.long

PROCESSORS = {
    "vectors of four": "+avx2,+fma,-avx512f",
    "vectors of two": "+sse4.2,-avx",
}
LESS = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable,-FMA4,-FMA4_Usable",
    "OPENBLAS_CORETYPE": "Prescott",
    "NPY_DISABLE_CPU_FEATURES": "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL "
    "AVX512_SPR X86_V4",
}
"""A processor of ten years ago for the libraries below, as far as one can pretend; names that one
does not know it passes over."""
RUNS: dict[str, list[str]] = {
    "thesis-hold": ["start.speed=95", "effects.rolling_friction.arm=2e-5"],
    "everything": ["start.speed=60"],
    "nsc-case-1": ["start.speed=100", "solver.stepper=imex8"],
    "on-edge": ["start.speed=95", "solver.stepper=imex8"],
    "feeding-deck": ["start.speed=60", "solver.stepper=imex8"],
    "nsc-case-2": ["start.speed=100", "solver={stepper: taylor, parameters: {order: 6}}"],
}
"""Scenes with and without events, in the plane and in space, by steps and by series."""
IN_LANES = {"rk8": [], "imex8": [], "taylor": ["solver.parameters={order: 6}"]}
"""Steppers of batches, with their parameters."""
STEPS = 100


def digests() -> dict[str, str]:
    """Return digests of all runs and of quantities derived from them, and of a batch in lanes."""
    found = {}
    for name, changes in RUNS.items():
        scene = load_scene(name, changes)
        drive = Drive(scene, energy_balance=True)
        run = drive.advance(STEPS)
        # What is computed from the samples of a run, apart from cosines and sines by NumPy.
        computed = [run.samples, run.angular_velocity, run.angular_acceleration]
        computed += [drive.observe().u, drive.observe().v, np.array(drive.energy())]
        whole = b"".join(array.tobytes() for array in computed)
        found[name] = hashlib.sha256(whole).hexdigest()
    for stepper in ("rk8", "taylor"):  # code for lanes takes seconds to make
        batch = simulate_batch(*varied(stepper))
        whole = b"".join(run.trajectory.samples.tobytes() for run in batch.runs)
        found[f"batch by {stepper}"] = hashlib.sha256(whole).hexdigest()
    return found


def varied(stepper: str) -> tuple[Any, list[dict[str, Any]]]:
    changes = ["duration=0.1", "start.speed=100", f"solver.stepper={stepper}", *IN_LANES[stepper]]
    base = load_scene("nsc-case-1", changes)
    return base, [{"rotor.eccentricity": 1e-6 * (5 + k)} for k in range(9)]


def by(features: str) -> dict[str, str]:
    """Return the digests of a process whose code is made for a processor with these features."""
    code = "import json; from tests.integrate.test_same_bits import digests; "
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", f"{code}print(json.dumps(digests()))"],
        env={**os.environ, **LESS, "AB_SIM_CPU_FEATURES": features},
        capture_output=True,
        text=True,
        check=True,
    )
    found: dict[str, str] = json.loads(done.stdout.splitlines()[-1])
    return found


@pytest.fixture(scope="module")
def here() -> dict[str, str]:
    return digests()


@pytest.mark.parametrize("processor", PROCESSORS)
def test_whatever_the_processor_can_do(processor: str, here: dict[str, str]) -> None:
    assert by(PROCESSORS[processor]) == here


@pytest.mark.parametrize("stepper", IN_LANES)
def test_side_by_side_or_alone(stepper: str) -> None:
    batch = simulate_batch(*varied(stepper))
    assert batch.in_lanes == 9
    for run in batch.runs:
        alone = Drive(run.scene).advance(len(run.trajectory))
        assert run.trajectory.samples.tobytes() == alone.samples.tobytes()
