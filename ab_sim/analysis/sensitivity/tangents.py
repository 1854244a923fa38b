"""Arrays for the driver that carries changes along with the state, made of a system."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.sensitivity.changes import SceneChange, without_contact
from ab_sim.analysis.sensitivity.plan import PlanPart
from ab_sim.compiling import compiled
from ab_sim.drive.step_plan import StepPlan
from ab_sim.dynamics.assemble import start_discrete_state, start_state, state_bounds
from ab_sim.dynamics.system import System
from ab_sim.events.run_arrays import aligned, balls_of, workspace
from ab_sim.integrate.explicit import Tableau
from ab_sim.kernels.code import Code, code_of
from ab_sim.kernels.parameter_tangent import parameter_tangents, raw_constants
from ab_sim.kernels.tangent import lanes_for
from ab_sim.scene.model import Scene
from ab_sim.stepping.assemble import run_with
from ab_sim.stepping.tangent_steps import PLACE_CHANGE, advance_with_tangents
from ab_sim.stepping.tangents import Tangents

NEVER = 2**62
"""A step's number that never comes."""
FIRST_CHANNELS = 2
"""Of a sample, before its row."""
MOBILITY = "mobility"
"""Of ``BallConstants``."""


class Columns(NamedTuple):
    """How numbers with a column for each key lie in blocks of lanes."""

    keys: int
    lanes: int
    clock: bool
    """Whether there is one more."""

    @property
    def blocks(self) -> int:
        """Of lanes."""
        return -(-(self.keys + self.clock) // self.lanes)

    def room(self, *shape: int) -> np.ndarray:
        """Zeros, of shape (first, blocks, .., lanes) as a table."""
        *first, lines = shape
        return aligned((int(np.prod(first)) * self.blocks * lines, self.lanes))

    def put(self, values: np.ndarray, into: np.ndarray) -> None:
        """Write values of shape (.., lines, keys) into a table that ``room(.., lines)`` has made."""
        *first, lines, keys = values.shape
        wide = np.zeros((*first, lines, self.blocks * self.lanes))
        wide[..., :keys] = values
        parted = wide.reshape(-1, lines, self.blocks, self.lanes)
        into[:] = parted.transpose(0, 2, 1, 3).reshape(into.shape)

    def taken(self, table: np.ndarray, lines: int) -> np.ndarray:
        """Values of a table as ``put`` writes them, shape (first, lines, keys)."""
        parted = table.reshape(-1, self.blocks, lines, self.lanes).transpose(0, 2, 1, 3)
        whole: np.ndarray = parted.reshape(-1, lines, self.blocks * self.lanes)[..., : self.keys]
        return whole


class TangentSteps:
    """Steps of a scene's system, with what its keys change.

    Args:
        scene: to be run.
        system: of it.
        tableau: of an explicit method.
        changes: by each key.
        plan: of its steps, with
        parts: of that, and their changes.
        wanted: numbers of the samples whose changes are wanted, rising.
    """

    def __init__(
        self,
        scene: Scene,
        system: System,
        tableau: Tableau,
        changes: Sequence[SceneChange],
        plan: tuple[StepPlan, Sequence[PlanPart]],
        wanted: Sequence[int],
    ) -> None:
        self._system, self._tableau, self._changes = system, tableau, changes
        self._step = scene.solver.step
        self._plan, self._parts = plan
        discrete = start_discrete_state(scene, system)
        bounds = state_bounds(system, self._step)
        self._balls = balls_of(system, discrete)
        self._work = workspace(self._balls, bounds)
        self._state = aligned(bounds.shape)
        self._state[:] = start_state(scene, system)
        self._apart = without_contact(system)
        code = code_of(self._apart, self._parts[0].part.kind)
        lanes = lanes_for(len(system.balls))
        self._columns = columns = Columns(len(changes), lanes, code.model.has_events)
        self._channels = len(code.emission.roots["sample"]) + 2 * len(system.balls)
        self._channels += code.model.has_motor
        size, stages = len(bounds), len(tableau.b)
        n, rows = len(system.balls), code.model.unknowns + 3
        if code.model.has_events:
            rows += n * len(code.emission.roots["table"])
        self._shared = {
            "blocks": columns.blocks,
            "lanes": lanes,
            "clock": len(changes) if columns.clock else -1,
            "a": np.ascontiguousarray(tableau.a),
            "weights": np.ascontiguousarray(tableau.b),
            "nodes": np.ascontiguousarray(tableau.c),
            "at": aligned((stages, size)),
            "slopes": aligned((stages, size)),
            "sums": aligned((stages + 1, size)),
            "change": columns.room(size),
            "yields": columns.room(n),
            "begin": columns.room(1),
            "length": columns.room(1),
            "rest": columns.room(1),
            "event_rate": columns.room(1),
            "time": np.zeros(2),
            "along": aligned((size + 2, lanes)),
            "rates": aligned((stages * size, lanes)),
            "at_event": aligned((rows, lanes)),
            "wanted": np.array([*wanted, NEVER], np.int64),
            "row_change": columns.room(len(wanted), self._channels),
            "channels": self._channels,
            "cursor": np.zeros(1, np.int64),
            "trouble": np.zeros(3, np.int64),
        }
        start = np.array([change.start for change in changes]).T
        columns.put(start, self._shared["change"])
        self._made: dict[type[Any], tuple[Callable[..., int], Tangents, Code, Code]] = {}
        self._tables = {each.part.first: self._plan_changes(each) for each in self._parts}

    def advance(self, first: int, steps: int) -> int:
        """Take steps after so many; as of ``tangent_steps.advance_with_tangents``."""
        done = 0
        for part, at in self._plan.after(first):
            left = steps - done
            samples = np.empty((left, FIRST_CHANNELS + self._channels))
            along, changes = self._along(part.kind), self._tables[part.first]
            taken = along(part.table, changes, at, first + done, left, samples)
            if taken < 0:
                return taken - done
            done += taken
            if done == steps or self._shared["trouble"][0]:
                break
        return done

    @property
    def trouble(self) -> tuple[int, int, int]:
        """As of ``Tangents.trouble``."""
        kind, which, steps = self._shared["trouble"].tolist()
        return kind, which, steps

    @property
    def row_changes(self) -> np.ndarray:
        """Of the wanted samples' rows, from the spindle's angle on, shape (wanted, channels, keys)."""
        return self._columns.taken(self._shared["row_change"], self._channels)

    def _along(self, kind: type[Any]) -> Callable[..., int]:
        if kind not in self._made:
            code, apart = code_of(self._system, kind), code_of(self._apart, kind)
            step = code.step(*self._tableau)
            shared = self._balls, self._work, self._system, code, step, self._step, self._state
            own = self._tangents(run_with(*shared), apart, kind)
            self._made[kind] = compiled(advance_with_tangents).bind(own), own, code, apart
        return self._made[kind][0]

    def _tangents(self, run: Any, code: Code, kind: type[Any]) -> Tangents:
        layout, columns = code.layout, self._columns
        raw = raw_constants(code, kind._fields)
        by_key = np.zeros((layout.size, len(self._changes)))
        for k, change in enumerate(self._changes):
            by_key[: layout.place, k] = change.constants
        table = columns.room(layout.size)
        columns.put(by_key, table)
        moving = by_key.any(axis=1)
        for part in self._parts:
            if part.part.kind is kind:
                moving[layout.place :] |= part.changes[:, PLACE_CHANGE:].any(axis=(0, 2))
        n, names = len(self._system.balls), set()
        for name, at in raw:
            width = n if layout.balls <= at < layout.place else 1
            if moving[at : at + width].any():
                names.add(name)
        functions = parameter_tangents(code, kind, frozenset(names))
        at = dict(raw)
        return Tangents(
            run=run,
            prepare=code.address("prepare"),
            slope=code.address("slope"),
            change_slope=functions.slope,
            change_row=functions.row,
            change_table=functions.table,
            c=code.constants(self._apart),
            b=aligned((2 * n + 1,)),
            place=layout.place,
            mobility=at.get(MOBILITY, 0),
            constants=table,
            **self._shared,
        )

    def _plan_changes(self, part: PlanPart) -> np.ndarray:
        lines, fields, _ = part.changes.shape
        table = self._columns.room(lines, fields)
        self._columns.put(part.changes, table)
        return table
