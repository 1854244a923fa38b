"""A process of its own that uses the kernel cache, held wherever it is about to do something.

As a program: it computes the laws named by its arguments with a toy kernel, and says what it is
about to do, before it does it, to whoever started it, who then lets it go on.
"""

import os
import subprocess
import sys
from pathlib import Path

TOY = """
from ab_sim.dynamics.dispatch import forward
from ab_sim.integrate.compile_cache import compiled

law = forward("law")

@compiled
def run(thing, x):
    return law(thing, x)
"""
LAWS = """
from typing import NamedTuple
from factor import FACTOR

class Twice(NamedTuple):
    size: float

    def law(self, x):
        return FACTOR * self.size * x

class Squared(NamedTuple):
    size: float

    def law(self, x):
        return self.size * x * x

class Cubed(NamedTuple):
    size: float

    def law(self, x):
        return self.size * x * x * x

class Halved(NamedTuple):
    size: float

    def law(self, x):
        return 0.5 * self.size * x
"""
FACTOR = "FACTOR = 2.0\n"
LOOKS, WAITS, WRITES = "looks", "waits", "writes"


def write_toy(folder: Path) -> None:
    """A kernel, and what a user's effects are: classes in a file of their own."""
    for name, text in {"toy": TOY, "laws": LAWS, "factor": FACTOR}.items():
        (folder / f"{name}.py").write_text(text)


class Process:
    """Computes laws of size 3 at x = 5 in a folder with the toy, its cache there too.

    Args:
        folder: with the toy in it.
        laws: names of classes, computed in this order.
        held: what it is held before: LOOKS, all is imported and nothing compiled; WAITS, it asks
            for a lock; WRITES, it gives a file its final name.
    """

    def __init__(self, folder: Path, *laws: str, held: tuple[str, ...] = ()) -> None:
        self.last = ""
        self.process = subprocess.Popen(
            [sys.executable, __file__, ",".join(held), *laws],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={
                "XDG_CACHE_HOME": str(folder / "cache"),
                "PYTHONPATH": os.pathsep.join((str(folder), *sys.path)),
                "PYTHONDONTWRITEBYTECODE": "1",
            },
        )

    def says(self) -> str:
        """What it says next: what it is held before, or its results; waits for it."""
        assert self.process.stdout is not None
        self.last = self.process.stdout.readline().strip()
        return self.last

    def go(self) -> None:
        """Let it go on."""
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def finish(self) -> str:
        """Let it go on to its end; results and how many kernels it compiled."""
        output, _ = self.process.communicate("\n" * 100)
        assert self.process.returncode == 0
        return str([self.last, *output.splitlines()][-1])


def results(folder: Path, *laws: str) -> str:
    """What a process computes and compiles that nobody holds."""
    return Process(folder, *laws).finish()


def main() -> None:
    held, laws = sys.argv[1].split(","), sys.argv[2:]

    def hold(what: str) -> None:
        if what in held:
            print(what, flush=True)
            sys.stdin.readline()

    def about_to(event: str, arguments: tuple[object, ...]) -> None:
        if event == "os.rename" and str(arguments[1]).startswith(os.environ["XDG_CACHE_HOME"]):
            hold(WRITES)
        elif event == "fcntl.flock":
            hold(WAITS)

    sys.addaudithook(about_to)
    import laws as kinds
    import toy

    hold(LOOKS)
    numbers = [toy.run(getattr(kinds, law)(3.0), 5.0) for law in laws]
    print(*numbers, "compiled", sum(toy.run.stats.cache_misses.values()), flush=True)


if __name__ == "__main__":
    main()
