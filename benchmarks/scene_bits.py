"""Digests of computed results to the bit, for comparisons before and after a change.

    python benchmarks/scene_bits.py > before.txt
    python benchmarks/scene_bits.py > after.txt
    diff before.txt after.txt

prints two digests for each scene that ships. The first one is of the text of the equations' machine
code: if it is unchanged, each evaluation costs the same and gives the same bits. The second one is
of the samples and energies of 300 steps, by the scene's stepper and by ``imex8``.
"""

import argparse
import hashlib
from collections.abc import Iterable

from ab_sim.base.yaml_files import scene_names
from ab_sim.drive import Drive
from ab_sim.engine.kernels.code import code_of
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.spindle import Ramp
from ab_sim.scene import Scene, load_scene
from ab_sim.tracing.llvm_text import module_text

STEPS = 300


def main() -> None:
    """Print the digests."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.parse_args()
    for name in scene_names():
        print(f"{name}: code {digest(code(load_scene(name)))}, runs {digest(runs(name))}")


def code(scene: Scene) -> Iterable[bytes]:
    """Yield the equations' functions in LLVM's language."""
    emission = code_of(system_of(scene, energy_balance=True), Ramp).emission
    for function in (emission.prepare, emission.slope, emission.finish):
        yield module_text([function()]).encode()


def runs(name: str) -> Iterable[bytes]:
    """Yield samples and energies."""
    for stepper in ([], ["solver.stepper=imex8"]):
        drive = Drive(load_scene(name, stepper), energy_balance=True)
        yield drive.advance(STEPS).samples.tobytes()
        yield repr(drive.energy()).encode()


def digest(parts: Iterable[bytes]) -> str:
    """Return a digest of bytes."""
    return hashlib.sha256(b"".join(parts)).hexdigest()[:16]


if __name__ == "__main__":
    main()
