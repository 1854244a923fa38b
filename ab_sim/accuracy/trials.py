"""Runs of a scene with one setting after the other, within a budget of CPU time."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

from ab_sim.accuracy.deviation import MOST_SAMPLES, Samples
from ab_sim.errors import DivergedError, SceneError, exact
from ab_sim.integrate.stepper import Stepper
from ab_sim.scene.load import with_solver
from ab_sim.scene.model import Scene

RUNGS = tuple(c * 10**d for d in range(4) for c in (1, 2, 4, 5))
"""Steps are the longest one divided by these: 10, 5, 2.5, 2, 1 ms ..."""
LONGEST = 1.0
"""s, of any step."""
MOST_SECONDS = 300.0
"""CPU time for measuring after which it is given up."""
ROUNDS, ENOUGH = 5, 1.0
"""Finalists are timed in this many rounds, or in fewer that have taken this long [s]."""
PROBE = 500
"""About so many steps are taken first with each method, which may compile a kernel."""
NO_PARAMETERS: Mapping[str, float] = MappingProxyType({})


class Timed(NamedTuple):
    """A run, done, and what it took."""

    samples: Samples
    seconds: float
    """CPU time of the steps."""


Tell = Callable[[str, int, int], None]
"""What is done now; CPU time spent, and what may be [s]."""
Run = Callable[[Scene, int, int], Timed]
"""Runs a scene from its start: so many steps, of which every so-manieth is kept."""


@dataclass
class Tried:
    """A setting that has been run."""

    scene: Scene
    stepper: Stepper
    rung: int
    kept: int
    """Samples per longest step, of which the rung is a whole multiple."""
    samples: Samples
    seconds: float
    """The least time that its run has taken."""

    @property
    def step(self) -> float:
        """s."""
        return self.scene.solver.step

    @property
    def parameters(self) -> Mapping[str, float]:
        """What the stepper is given."""
        return self.scene.solver.parameters


class TooExpensiveError(SceneError):
    """Measuring would take too long."""


class Trials:
    """What has been tried with a scene.

    Args:
        scene: what to run; its profile and duration.
        run: runs it.
        longest: the longest step of each method [s], by name; others are not tried.
        period: s; all steps go into it a whole number of times. None: a power of ten.
        tell: called before each run.
    """

    def __init__(
        self,
        scene: Scene,
        run: Run,
        longest: Mapping[str, float],
        period: float | None,
        tell: Tell | None = None,
    ) -> None:
        self.scene, self._run, self._longest, self._tell = scene, run, longest, tell
        reach = min(max(longest.values()), LONGEST)
        base = period or 10.0 ** max(math.ceil(math.log10(reach) - 1e-9), -6)
        self._base = round(1e9 * base)
        """ns: the longest step; all others are parts of it."""
        bases = max(1, math.ceil(scene.duration / (1e-9 * self._base) - 1e-9))
        self._stride = math.ceil(bases / MOST_SAMPLES)
        self._bases = self._stride * math.ceil(bases / self._stride)
        self._spent = 0.0
        self._per_step: dict[str, float] = {}
        """Least CPU time per step so far."""
        self.tried: list[Tried] = []

    @property
    def length(self) -> float:
        """How long the runs are [s]: the scene's duration, up to a whole step."""
        return 1e-9 * self._base * self._bases

    def rungs(self, stepper: Stepper) -> list[int]:
        """Of the ladder, from the longest stable step down to those of whole nanoseconds."""
        longest = min(self._longest[stepper.name], LONGEST)
        return [
            rung for rung in RUNGS if self._base % rung == 0 and 1e-9 * self._base / rung <= longest
        ]

    def expected(self, stepper: Stepper, rung: int, like: Stepper) -> float:
        """CPU time that a run will take [s]; by evaluations beside ``like``, until it has run."""
        per_step = self._per_step.get(stepper.name)
        if per_step is None:
            per_step = self._per_step[like.name] * stepper.evaluations / like.evaluations
        return per_step * self._bases * rung

    def run(
        self,
        stepper: Stepper,
        rung: int,
        parameters: Mapping[str, float] = NO_PARAMETERS,
        last: bool = False,
    ) -> Tried | None:
        """Run a setting; None if it diverges, or the scene does not take that stepper or step.

        Raises:
            SceneError, DivergedError: the same, of the ``last`` one.
            TooExpensiveError: it would go beyond what measuring may take.
        """
        try:
            step = 1e-9 * (self._base // rung)
            scene = with_solver(self.scene, stepper.name, step, parameters)
            if stepper.name not in self._per_step:
                few = rung * max(1, min(self._bases, PROBE // rung))
                # Twice: the first time kernels may be compiled.
                for _ in range(2):
                    self._go(scene, few, 1)
            self._afford(stepper, rung)
            kept = max(
                k for k in RUNGS if rung % k == 0 and (k == 1 or k * self._bases <= MOST_SAMPLES)
            )
            every = rung // kept * (self._stride if kept == 1 else 1)
            timed = self._go(scene, self._bases * rung, every)
        except (DivergedError, SceneError) as error:
            if last or isinstance(error, TooExpensiveError):
                raise
            return None
        tried = Tried(scene, stepper, rung, kept, timed.samples, timed.seconds)
        self.tried.append(tried)
        return tried

    def time_again(self, finalists: list[Tried]) -> None:
        """In turns, so that what else the machine does falls on all of them."""
        spent = 0.0
        for _ in range(ROUNDS):
            for one in finalists:
                seconds = self._go(
                    one.scene, self._bases * one.rung, one.rung * self._stride
                ).seconds
                one.seconds = min(one.seconds, seconds)
                spent += seconds
            if spent > ENOUGH:
                return

    def _go(self, scene: Scene, steps: int, every: int) -> Timed:
        name = scene.solver.stepper
        if self._tell is not None:
            first = "" if name in self._per_step else ", compiled first if need be"
            what = f"{name} at {exact(scene.solver.step)} s{first}; seconds of CPU time"
            self._tell(what, int(self._spent), int(MOST_SECONDS))
        timed = self._run(scene, steps, every)
        self._spent += timed.seconds
        self._per_step[name] = min(self._per_step.get(name, math.inf), timed.seconds / steps)
        return timed

    def _afford(self, stepper: Stepper, rung: int) -> None:
        if self._spent + self.expected(stepper, rung, stepper) > MOST_SECONDS:
            raise TooExpensiveError(
                f"accuracy: finding what delivers it would take more than {MOST_SECONDS:g} s of "
                f"CPU time, because a run of duration = {self.scene.duration:g} s is an expensive "
                "one; find a solver with a shorter duration, and name its stepper and step"
            )
