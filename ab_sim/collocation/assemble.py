"""From a system and its machine code to a Collocation."""

import functools

import numpy as np

from ab_sim.collocation.coordinates import Coordinates, CoordinatesInSpace, PlanarCoordinates
from ab_sim.collocation.emission import CollocationEmission
from ab_sim.collocation.event_fallback import reach_of
from ab_sim.collocation.nodes import bounds_within_pieces, gauss, last_coefficients, nodes
from ab_sim.collocation.run import (
    COEFFICIENTS,
    NODE,
    RESULTS,
    SHARE,
    STRIDE,
    Buffers,
    CollocationFunctions,
    CollocationMethod,
    CollocationRun,
    ResponseTables,
    size_of_memory,
)
from ab_sim.collocation.sampling import LaneSampling
from ab_sim.collocation.table_lending import borrowed_tables
from ab_sim.collocation.tables import doubt_tables
from ab_sim.compiling.kinds import aligned
from ab_sim.dynamics.assemble import own_motion
from ab_sim.dynamics.own_motion import DAMPINGS, FROM_MODES, STIFFNESSES, TO_MODES
from ab_sim.dynamics.system import MASS, MOBILITY, RADIUS, System
from ab_sim.equations.motion import Ball
from ab_sim.equations.sums import over_effects
from ab_sim.events.run import Run
from ab_sim.integrate.steppers import collocation as stepper
from ab_sim.integrate.steppers.collocation import Setting, setting_for
from ab_sim.kernels.code import Code, code_of
from ab_sim.spindle.speed_laws import Ramp
from ab_sim.tracing.llvm_text import module_text
from ab_sim.tracing.machine_code import AS_WRITTEN, MachineCode

COORDINATES: dict[str, Coordinates] = {
    "Planar": PlanarCoordinates(),
    "InSpace": CoordinatesInSpace(),
}
"""By the name of a deck model's class."""


class CollocationCode:
    """Machine code of collocation for a kind of scene.

    Args:
        code: of the scene's equations.
        nodes: N.
        balls_alike: whether drag slows down all balls alike: see ``drag_rates``.
    """

    def __init__(self, code: Code, nodes: int, balls_alike: bool) -> None:
        coordinates = COORDINATES[type(code.model.deck).__name__]
        self.emission = CollocationEmission(code.emission, coordinates, nodes, balls_alike)
        sampling = LaneSampling(self.emission)
        made = [*self.emission.functions(), *sampling.functions()]
        self.columns = sum(sampling.columns.values())
        """Numbers that are known of a node."""
        self._code = MachineCode(module_text(made), optimization=AS_WRITTEN)
        names = {function.name: function.name for function in made}
        names.setdefault("iterate_near", "iterate")
        self.functions = CollocationFunctions(
            *(
                self._code.address(names[x]) if x in names else 0
                for x in CollocationFunctions._fields
            )
        )

    @property
    def memory(self) -> tuple[int, int]:
        """Shape of what belongs to the state."""
        own = self.emission
        return 1, size_of_memory(own.nodes, own.rows, own.emission.states)


def collocation_code(code: Code, nodes: int, balls_alike: bool) -> CollocationCode:
    """Collocation's code for a kind of scene: the same object each time."""
    key = CollocationCode, nodes, balls_alike
    return code.other(key, lambda: CollocationCode(code, nodes, balls_alike))


def drag_rates(system: System) -> np.ndarray:
    """How fast drag slows down each ball on a deck that does not move [1/s]."""
    balls = [Ball(m, a) for m, a in system.balls[:, [MASS, RADIUS]].tolist()]
    drag = np.array([over_effects(system.effects, "ball_drag", 0.0, ball) for ball in balls])
    return drag * system.balls[:, MOBILITY]


def linear_part(system: System, emission: CollocationEmission) -> np.ndarray:
    """``CollocationRun.linear``."""
    table, ways = own_motion(system), type(system.deck_model).COORDINATES
    drag = drag_rates(system)[: 1 if emission.balls_alike else None]
    own = 1 if emission.formulas.coordinates.are_alike else ways
    spindle = slice(ways, ways + emission.model.has_motor)
    damping = [*table[DAMPINGS, :own], *drag, *table[DAMPINGS, spindle]]
    stiffness = [*table[STIFFNESSES, :own], *np.zeros(len(damping) - own)]
    modes = [table[first : first + 7, :7].ravel() for first in (FROM_MODES, TO_MODES)]
    parts = [damping, stiffness, *(modes if emission.formulas.coordinates.has_modes else ())]
    found = aligned((sum(map(len, parts)),))
    found[:] = np.concatenate(parts)
    return found


@functools.lru_cache
def method_of(setting: Setting, tolerance: float, steps: float) -> CollocationMethod:
    """A method, made once for any number of runs.

    Args:
        setting: nodes, and samples in a step.
        tolerance: what each step may leave of an error [rad].
        steps: of the scene, that each step goes over; 0 for as many as the tolerance allows.
    """
    count = setting.nodes
    lines = aligned((COEFFICIENTS + count, count))
    lines[NODE], lines[SHARE] = gauss(count)
    lines[COEFFICIENTS:] = last_coefficients(lines[NODE], lines[SHARE])
    bounds = bounds_within_pieces(lines[NODE])
    own = nodes(count, setting.samples, setting.powers)
    return CollocationMethod(own, lines, bounds, tolerance, steps, reach_of(tolerance))


def collocation_of(
    run: Run,
    system: System,
    code: CollocationCode,
    method: CollocationMethod,
    tables: ResponseTables | None = None,
) -> CollocationRun:
    """A Collocation.

    Args:
        run: the Run; its memory has the shape of the code's ``memory``, its step is the other
            stepper's.
        system: what moves.
        code: of its kind.
        method: see ``method_of``.
        tables: that it shares with others, of which no two take steps at once; None: its own.
    """
    emission = code.emission
    count, states, balls = emission.nodes, run.state.size, run.balls
    return CollocationRun(
        run=run,
        functions=code.functions,
        method=method,
        tables=tables or borrowed_tables(method.nodes, emission.tables),
        linear=linear_part(system, emission),
        buffers=Buffers(
            states=aligned(((states + 3) * STRIDE * count,)),
            at_nodes=aligned(((states + 3) * STRIDE * count,)),
            work=aligned((emission.work, count)),
            turns=aligned((balls.number + 1,)),
            nodes=aligned((count, code.columns)),
            values=aligned((count, run.work.value.size)),
        ),
        result=aligned((RESULTS,)),
        sides=emission.tables,
        rows=emission.rows,
    )


class ByCollocation:
    """Collocation of a system, along segments of all kinds.

    Args:
        system: what moves.
        told: what the method is told.

    Attributes:
        nodes: N of a step.
    """

    def __init__(self, system: System, told: stepper.CollocationParameters) -> None:
        self._alike = have_one_drag_rate(system)
        kind = code_of(system, Ramp)
        in_space = COORDINATES[type(kind.model.deck).__name__].has_modes
        is_smooth = not (in_space or kind.model.has_events)
        setting = setting_for(told, is_smooth)
        self.nodes = setting.nodes
        self._method = method_of(setting, told.tolerance, told.steps)
        # Which kind of segment changes nothing of the memory.
        self._made: list[tuple[CollocationRun, CollocationCode]] = []
        self.memory = collocation_code(kind, self.nodes, self._alike).memory

    def along(self, run: Run, code: Code, system: System) -> CollocationRun:
        """What takes steps with a Run."""
        own = collocation_code(code, self.nodes, self._alike)
        tables = self._made[0][0].tables if self._made else None
        made = collocation_of(run, system, own, self._method, tables)
        self._made.append((made, own))
        return made

    def take(self, system: System) -> bool:
        """Go on with other numbers, of a system of the same kind; False if that cannot be.

        Code for balls that drag slows down alike is of no use for others, and vice versa.
        """
        if have_one_drag_rate(system) != self._alike:
            return False
        for made, own in self._made:
            made.linear[:] = linear_part(system, own.emission)
            doubt_tables(made.tables, made.sides)
        return True


def have_one_drag_rate(system: System) -> bool:
    """Whether drag slows down all balls alike."""
    return len(set(drag_rates(system).tolist())) <= 1
