"""Steps of a system with what keys of its scene change: arrays for the driver, and its calls."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ab_sim.analysis.sensitivity.changes import SceneChange
from ab_sim.analysis.sensitivity.columns import Columns
from ab_sim.analysis.sensitivity.plan import PlanPart
from ab_sim.compiling import compiled
from ab_sim.compiling.kinds import aligned
from ab_sim.drive.step_plan import StepPlan
from ab_sim.dynamics.assemble import start_discrete_state, start_state, state_bounds
from ab_sim.dynamics.system import System
from ab_sim.events.run import BallEvents, Run, Workspace
from ab_sim.events.run_arrays import balls_of, workspace
from ab_sim.integrate.explicit import Tableau
from ab_sim.kernels.code import Code, code_of
from ab_sim.kernels.tangent import lanes_for, parameter_tangents, raw_constants
from ab_sim.scene.model import Scene
from ab_sim.stepping.assemble import NOWHERE, run_with
from ab_sim.stepping.fixed_step import ANGLE
from ab_sim.stepping.tangent_steps import PLACE_CHANGE, advance_with_tangents
from ab_sim.stepping.tangents import Tangents

NEVER = 2**62
"""A step's number that never comes."""


class RunWithTangents:
    """Steps of a scene's system, with what its keys change.

    Args:
        scene: to be run.
        system: of it.
        tableau: of an explicit method.
        changes: by each key.
        plan: of its steps, and its parts with their changes.
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
        self._scene, self._system, self._tableau = scene, system, tableau
        self._changes = changes
        self._plan, self._parts = plan
        self._codes: list[Code] = []
        """Kept, as their addresses are."""
        kinds = [each.part.kind for each in self._parts]
        code = code_of(system, kinds[0])
        lanes = lanes_for(len(system.balls))
        self._columns = Columns(len(changes), lanes, code.model.has_events)
        self._channels = code.emission.row_channels
        own = self._arrays(code, self._run(kinds[0]), wanted)
        self._own = {kind: self._along(own, kind) for kind in dict.fromkeys(kinds)}
        self._drivers = {
            kind: compiled(advance_with_tangents).bind(each) for kind, each in self._own.items()
        }
        self._tables = {each.part.first: self._columns.table(each.changes) for each in self._parts}

    def advance(self, first: int, steps: int) -> int:
        """Take steps after so many; as of ``tangent_steps.advance_with_tangents``."""
        done = 0
        for part, at in self._plan.after(first):
            left = steps - done
            samples = np.empty((left, ANGLE + self._channels))
            table, changes = part.table, self._tables[part.first]
            taken = self._drivers[part.kind](table, changes, at, first + done, left, samples)
            if taken < 0:
                return int(taken) - done
            done += taken
            if done == steps or self.trouble[0]:
                break
        return done

    @property
    def trouble(self) -> tuple[int, int, int, int]:
        """As of ``Tangents.trouble``."""
        kind, which, steps, column = self._shared.trouble.tolist()
        return kind, which, steps, column

    @property
    def row_changes(self) -> np.ndarray:
        """Of the wanted samples' rows, from ANGLE on, shape (wanted, channels, keys)."""
        return self._columns.values(self._shared.row_change, self._channels)

    @property
    def _shared(self) -> Tangents:
        """What all kinds of segments share is in each."""
        return next(iter(self._own.values()))

    def _run(self, kind: type[Any]) -> Run:
        system, step = self._system, self._scene.solver.step
        balls = balls_of(system, start_discrete_state(self._scene, system))
        bounds = state_bounds(system, step)
        state = aligned(bounds.shape)
        state[:] = start_state(self._scene, system)
        return self._run_along(kind, balls, workspace(balls, bounds), state)

    def _run_along(
        self, kind: type[Any], balls: BallEvents, work: Workspace, state: np.ndarray
    ) -> Run:
        code = code_of(self._system, kind)
        self._codes.append(code)
        step, length = code.step(*self._tableau), self._scene.solver.step
        return run_with(balls, work, self._system, code, step, length, state)

    def _arrays(self, code: Code, run: Run, wanted: Sequence[int]) -> Tangents:
        """All arrays; addresses and constants are still to be put in."""
        columns, tableau, size = self._columns, self._tableau, len(run.state)
        stages, n, lanes = len(tableau.b), len(self._system.balls), columns.lanes
        at_event = code.model.unknowns + 3 + n * len(code.emission.roots.get("table", ()))
        start = np.array([change.start for change in self._changes]).T
        return Tangents(
            run=run,
            slope=NOWHERE,
            change_step=NOWHERE,
            change_row=NOWHERE,
            change_table=NOWHERE,
            change_impact=NOWHERE,
            change_restitution=NOWHERE,
            rolling=0,
            race_radius=0,
            blocks=columns.blocks,
            lanes=lanes,
            clock=columns.keys if columns.clock else -1,
            a=np.ascontiguousarray(tableau.a),
            weights=np.ascontiguousarray(tableau.b),
            nodes=np.ascontiguousarray(tableau.c),
            at=aligned((stages, size)),
            slopes=aligned((stages, size)),
            sums=aligned((stages + 1, size)),
            change=columns.table(start),
            constants=aligned((0, lanes)),
            yields=columns.room(n),
            spacing=columns.table(np.array([change.spacing for change in self._changes]).T),
            begin=columns.room(1),
            length=columns.room(1),
            rest=columns.room(1),
            time=np.zeros(2),
            along=aligned((size + 2, lanes)),
            rates=aligned((stages * size, lanes)),
            at_event=aligned((at_event, lanes)),
            event_rate=columns.room(1),
            shift=np.zeros(n),
            shift_change=columns.room(n),
            approach=aligned((1, lanes)),
            parting=aligned((1, lanes)),
            kept=aligned((size,)),
            kept_discrete=np.zeros_like(run.balls.discrete),
            wanted=np.array([*wanted, NEVER], np.int64),
            row_change=columns.room(self._channels, len(wanted)),
            channels=self._channels,
            cursor=np.zeros(1, np.int64),
            trouble=np.zeros(4, np.int64),
        )

    def _along(self, own: Tangents, kind: type[Any]) -> Tangents:
        """The same, along segments of a kind."""
        code = code_of(self._system, kind)
        layout, places = code.layout, raw_constants(code)
        by_key = np.zeros((layout.size, len(self._changes)))
        by_key[: layout.place] = np.array([change.constants for change in self._changes]).T
        functions = parameter_tangents(code, self._moving(code, kind, by_key), self._tableau)
        run = own.run
        return own._replace(
            run=self._run_along(kind, run.balls, run.work, run.state),
            slope=code.address("slope"),
            change_step=functions.step,
            change_row=functions.row,
            change_table=functions.table,
            change_impact=functions.impact,
            change_restitution=functions.restitution,
            rolling=places.get("rolling_mass", 0),
            race_radius=places.get("race_radius", 0),
            constants=self._columns.table(by_key),
        )

    def _moving(self, code: Code, kind: type[Any], by_key: np.ndarray) -> frozenset[str]:
        """Names of raw constants that a key changes."""
        layout, n = code.layout, len(self._system.balls)
        moving = np.abs(by_key).max(axis=1)
        for each in self._parts:
            if each.part.kind is kind:
                places = np.abs(each.changes[:, PLACE_CHANGE:]).max(axis=(0, 2))
                moving[layout.place :] = np.maximum(moving[layout.place :], places)
        return frozenset(
            name
            for name, at in raw_constants(code).items()
            if moving[at : at + (n if layout.balls <= at < layout.place else 1)].any()
        )
