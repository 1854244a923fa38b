"""One running drive: give it a scene, command it, advance it, look at it. No ROS in here."""

import math

import numpy as np

from ab_sim.drive.observation import Energy, Observation, Snapshot
from ab_sim.drive.rows import BEYOND_STATES, RowReader, follow
from ab_sim.drive.trajectory import Trajectory, check_room
from ab_sim.dynamics.assemble import (
    place_on,
    start_modes,
    start_state,
    state_bounds,
    state_names,
    system_of,
)
from ab_sim.dynamics.driving_force import driving_force
from ab_sim.dynamics.ledger import mechanical_energy
from ab_sim.dynamics.motion import Deck, Spindle
from ab_sim.dynamics.system import DIRECTION, LOADED, TURNS, has_friction, has_motor
from ab_sim.errors import CommandError, DivergedError, SceneError, exact
from ab_sim.integrate.choose import choose_stepper, top_speed
from ab_sim.integrate.fixed_step import acceleration_at, advance
from ab_sim.integrate.workspace import aligned, workspace
from ab_sim.scene.model import Scene
from ab_sim.spindle import Piece, SpeedProfile, SpeedServo
from ab_sim.spindle.stretches import Grid, Stretch, parts, piece_after, same_instant, stretches

AT_ONCE = 10_000
"""Steps between two thinnings of what need not all be kept."""


class Drive:
    """A drive in motion.

    It follows the scene's profile from t = 0 until a command takes over. The same scene and the
    same commands at the same steps give bit-identical outputs, however the steps are grouped.

    Args:
        scene: what to simulate, with its solver.
        commanded: hold the scene's start speed until commanded, instead of its profile.
        ledger: also integrate motor work and losses, for ``energy()``.

    Raises:
        SceneError: unknown stepper, a step beyond the stability limit, or the scene still asks
            for an accuracy: see ``ab_sim.accuracy.resolve_accuracy``.
    """

    def __init__(self, scene: Scene, *, commanded: bool = False, ledger: bool = False) -> None:
        if ledger and "spindle_acceleration" not in scene.effects:
            raise SceneError(
                "a ledger needs the effect spindle_acceleration: without it the equations leave "
                "out what the motor's torque does, and no energy balance can close"
            )
        self.scene = scene
        self.system = system_of(scene, ledger)
        self._stable_to = top_speed(scene, commanded)
        self.choice = choose_stepper(scene, self.system, self._stable_to)
        self.stepper = self.choice.stepper
        self.step = scene.solver.step
        self.servo = SpeedServo(scene.spindle.max_speed, scene.spindle.max_acceleration)
        self._has_motor = bool(has_motor(self.system.effects))
        self._rubs = bool(has_friction(self.system.effects))
        self._reader = RowReader(scene, self.system.effects)
        self.channels = self._reader.channels
        self._first_profile = (
            SpeedProfile.constant(scene.start.speed, scene.start.angle)
            if commanded
            else SpeedProfile.of_scene(scene)
        )
        self._work = workspace(
            self.system,
            self.stepper.slopes,
            self.stepper.nodes,
            state_bounds(self.system, self.step),
        )
        self.reset()

    @property
    def time(self) -> float:
        """Simulated time [s]: whole steps times the step."""
        return self.steps * self.step

    @property
    def events(self) -> int:
        """Events located so far: reversals, sticking, release, impacts, limits of the motor."""
        return int(self._work.counts[0])

    @property
    def crowded_steps(self) -> int:
        """Steps so far with too many events to locate them all; their results are less accurate."""
        return int(self._work.counts[1])

    def reset(self) -> None:
        """Back to t = 0 and the scene's start state; commands are forgotten."""
        self.steps = 0
        self.profile = self._first_profile
        self._command: float | None = None
        self._state = aligned((len(self._work.trial),))
        self._state[:] = start_state(self.scene, self.system)
        self._modes = start_modes(self.scene, self.system)
        self._work.counts[:] = 0
        self._integrate(Stretch(self._piece_at(0.0), 0, 0, 0.0, self.step), self._empty_rows(0))
        self._start_energy = self._stored_energy(self._state, 0.0)
        self._reader.reset()

    def command(self, speed: float) -> None:
        """Ask for a spindle speed [rad/s] from the present instant on.

        The servo goes there at the scene's ``spindle.max_acceleration`` and holds it. A command
        equal to the one in force changes nothing.

        Raises:
            CommandError: not finite, beyond ``spindle.max_speed``, or, of a drive that was not made
                ``commanded``, so much faster than its profile that the step is too long for it;
                nothing has changed.
        """
        self._check_stable(self.servo.check(speed))
        if speed == self._command:
            return
        now = self.time
        angle, present = self.profile.angle(now), self.profile.speed(now)
        self.profile = self.servo.approach(now, angle, present, speed)
        self._command = float(speed)

    def _check_stable(self, speed: float) -> None:
        if abs(speed) <= self._stable_to:
            return
        try:
            choose_stepper(self.scene, self.system, abs(speed))
        except SceneError as error:
            raise CommandError(f"command = {exact(speed)} rad/s: {error}") from error
        self._stable_to = abs(speed)

    def advance(self, steps: int = 1, every: int = 1) -> Trajectory:
        """Take whole integration steps.

        Args:
            steps: how many.
            every: keep each so-many-th sample, counted from now on, of a run too long to keep them
                all; at work, ``AT_ONCE`` of them are in memory.

        Returns:
            One sample per step, or per so many, taken at its end. Where the spindle's acceleration
            jumps just there, the sample's deck acceleration is the one before the jump.

        Raises:
            ValueError: steps is negative, every is less than 1, or there is no room for so many
                samples.
            DivergedError: the state went beyond all bounds; the drive keeps its last good one.
        """
        if steps < 0 or every < 1:
            raise ValueError(f"steps = {steps}, every = {every}: must be at least 0 and at least 1")
        check_room(steps, every, self.channels)
        if every == 1:
            return self._advance(steps)
        kept = [self._advance(0)]
        for done in range(0, steps, AT_ONCE):
            taken = self._advance(min(AT_ONCE, steps - done)).thinned(every, after=done)
            if len(taken):
                kept.append(taken)
        return Trajectory.join(kept)

    def _advance(self, steps: int) -> Trajectory:
        rows, spindle = self._empty_rows(steps), np.empty((steps, 3))
        begin = self.steps
        for stretch in stretches(self.profile, self._grid(), begin, steps):
            at = slice(stretch.first - begin, stretch.first - begin + max(stretch.steps, 1))
            self.steps = stretch.first
            self._integrate(stretch, rows[at])
            follow(stretch, self.step, spindle[at, :2])
        self.steps = begin + steps
        spindle[:, 2] = spindle[:, 1] if self._command is None else self._command
        return self._reader.trajectory(begin + 1 + np.arange(steps), rows, spindle)

    def present(self) -> Trajectory:
        """The present as a trajectory of one sample."""
        now = self.observe()
        row = np.empty((1, len(self.channels)))
        row[0, :5] = now.steps, now.time, now.psi, now.omega, now.command
        row[0, 5:11] = *now.position, *now.velocity, *now.acceleration
        balls = slice(11, 11 + 2 * self.scene.balls.count)
        row[0, balls] = np.column_stack([now.theta, now.theta_rate]).ravel()
        extra = [now.motor_torque] if self._has_motor else []
        extra += [value for reading in now.readings.values() for value in reading.tolist()]
        row[0, balls.stop :] = extra
        return Trajectory(self.channels, row)

    def observe(self) -> Observation:
        """The drive now."""
        return self._observation(self.time, self._state)

    def observe_at(self, time: float) -> Observation:
        """The drive at a time within the next step, which is not taken by this.

        Args:
            time: s, from now to one step later.

        Raises:
            ValueError: outside that range.
        """
        if not self.time <= time <= self.time + self.step * (1 + 1e-9):
            raise ValueError(
                f"time = {time} s: must lie within the next step, "
                f"{self.time} to {self.time + self.step} s"
            )
        kept, modes, counts = self._state.copy(), self._modes.copy(), self._work.counts.copy()
        try:
            if time - self.time > same_instant(time, self.step):
                for part in parts(self.profile, self._grid(), self.steps, time):
                    self._integrate(part, self._empty_rows(1))
            return self._observation(time, self._state)
        finally:
            self._state[:] = kept
            self._modes = modes
            self._work.counts[:] = counts

    def energy(self) -> Energy:
        """The energy balance since the start.

        Raises:
            ValueError: the drive was made without ``ledger=True``.
        """
        if not self.system.ledger:
            raise ValueError("this drive keeps no ledger: make it with ledger=True")
        stored = self._stored_energy(self._state, self.time)
        work, dissipated = self._state[-2:]
        return Energy(stored, self._start_energy, float(work), float(dissipated))

    def snapshot(self) -> Snapshot:
        """The present, to return to with ``restore``."""
        return Snapshot(
            self.steps,
            self.step,
            self._state.copy(),
            self._modes.copy(),
            self.profile,
            self._command,
            {name: pickup.state for name, pickup in self._reader.pickups.items()},
        )

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot of this drive or of another one with the same scene."""
        if snapshot.state.shape != self._state.shape or snapshot.step != self.step:
            raise ValueError("the snapshot is of a drive with other balls, step or ledger")
        self.steps, self.profile, self._command = (
            snapshot.steps,
            snapshot.profile,
            snapshot.command,
        )
        self._state[:] = snapshot.state
        self._modes = snapshot.modes.copy()
        for name, state in snapshot.pickups.items():
            self._reader.pickups[name].state = state

    def _grid(self) -> Grid:
        return Grid(self.step, self.choice.cycle)

    def _piece_at(self, time: float) -> Piece:
        return piece_after(self.profile, time, self.step)

    def _empty_rows(self, steps: int) -> np.ndarray:
        return aligned((steps, self._state.size + BEYOND_STATES))

    def _integrate(self, stretch: Stretch, rows: np.ndarray) -> None:
        taken = advance(
            self.system,
            place_on(stretch.piece),
            self.stepper.weights,
            stretch.piece.start,
            (stretch.first, self.step, stretch.offset),
            stretch.length,
            self._state,
            self._modes,
            self._work,
            rows,
        )
        if taken < len(rows):
            self.steps += taken
            self._diverged(rows[taken])

    def _diverged(self, bad: np.ndarray) -> None:
        names = state_names(self.system)
        wrong = [
            n
            for n, x, most in zip(names, bad, self._work.bounds, strict=False)
            if not abs(x) < most
        ]
        if len(wrong) > 3:
            wrong = [*wrong[:3], f"{len(wrong) - 3} more"]
        cause = "the step is too long for the scene's masses, stiffness and drag"
        if any(name.endswith("rate") for name in wrong):
            cause = (
                "a ball turns more than 3 rad along the race within one step, which "
                f"{self.stepper.name} cannot follow: the whirl is large for the race, or the step "
                "is too long"
            )
        raise DivergedError(
            f"{', '.join(wrong)} went beyond all bounds at t = {self.time + self.step:.9g} s; "
            f"likely cause: {cause}; try solver.step = {self.step / 4:.2g} s"
        )

    def _stored_energy(self, state: np.ndarray, time: float) -> float:
        n = self.scene.balls.count
        psi, omega = self._spindle(state, time)
        spindle = Spindle(omega, 0.0, math.cos(psi), math.sin(psi), 0.0, 0.0)
        angles, rates = state[4 : 4 + n], state[4 + n : 4 + 2 * n]
        return mechanical_energy(self.system, Deck(*state[:4].tolist()), spindle, angles, rates)

    def _spindle(self, state: np.ndarray, time: float) -> tuple[float, float]:
        """psi [rad], unwrapped, and w [rad/s]."""
        if self._has_motor:
            at = 4 + 2 * self.scene.balls.count
            psi, omega = state[at : at + 2].tolist()
            return psi + 2.0 * math.pi * float(self._modes[-1, TURNS]), omega
        piece = self._piece_at(time)
        local = time - piece.start
        return (
            float(piece.start_angle + piece.segment.angle(local)),
            float(piece.segment.speed(local)),
        )

    def _observation(self, time: float, state: np.ndarray) -> Observation:
        n = self.scene.balls.count
        piece = self._piece_at(time)
        psi, omega = self._spindle(state, time)
        rotation = np.array([[math.cos(psi), -math.sin(psi)], [math.sin(psi), math.cos(psi)]])
        a1, a2, torque = acceleration_at(
            self.system, place_on(piece), time - piece.start, state, self._modes, self._work
        )
        theta = state[4 : 4 + n] + 2.0 * math.pi * self._modes[:n, TURNS]
        position, rate = rotation @ state[:2], state[4 + n : 4 + 2 * n]
        commanded = float(piece.segment.speed(time - piece.start))
        return Observation(
            time=time,
            steps=self.steps,
            psi=psi,
            omega=omega,
            command=commanded if self._command is None else self._command,
            u=state[:2].copy(),
            v=state[2:4].copy(),
            position=position,
            velocity=rotation @ state[2:4],
            acceleration=rotation @ np.array([a1, a2]),
            theta=theta,
            theta_rate=rate.copy(),
            stuck=(self._modes[:n, DIRECTION] == 0) & (self._modes[:n, LOADED] == 1) & self._rubs,
            driving_force=driving_force(
                self.scene, position[0], position[1], psi + theta, omega + rate
            ),
            motor_torque=torque if self._has_motor else math.nan,
            readings={name: pickup.reading for name, pickup in self._reader.pickups.items()},
        )
