"""The same bits whatever the processor can do, for our code and for the libraries below it."""

import os
import subprocess
import sys

SCENES = [
    ("on-edge",),
    ("nsc-case-1",),
    ("thesis-hold", "solver.stepper=collocation"),
    ("feeding-deck", "solver.stepper=collocation"),
]
PROGRAM = """
import hashlib, sys
from ab_sim.drive import Drive
from ab_sim.scene import load_scene
for line in sys.argv[1:]:
    name, *changes = line.split()
    run = Drive(load_scene(name, changes)).advance(600)
    print(line, hashlib.sha256(run.samples.tobytes()).hexdigest())
"""
LESS = {
    "AB_SIM_CPU_FEATURES": "-avx512f",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable,-FMA4,-FMA4_Usable",
    "OPENBLAS_CORETYPE": "Haswell",
    "NPY_DISABLE_CPU_FEATURES": "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL "
    "AVX512_SPR X86_V4",
}
"""A processor of ten years ago, as far as one can pretend; names that a library does not know it
passes over."""


def run(more: dict[str, str]) -> list[str]:
    command = [sys.executable, "-W", "ignore", "-c", PROGRAM, *map(" ".join, SCENES)]
    done = subprocess.run(
        command, env={**os.environ, **more}, capture_output=True, text=True, check=True
    )
    return done.stdout.splitlines()


def test_runs_do_not_depend_on_what_the_processor_can_do() -> None:
    as_it_is = run({})
    assert len(as_it_is) == len(SCENES)
    assert run(LESS) == as_it_is
